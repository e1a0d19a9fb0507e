//! Progress told to a function of the page, which may cancel.

use glasswarp::solver::{Event, Progress};
use js_sys::Function;
use std::{ops::ControlFlow, time::Duration};
use wasm_bindgen::JsValue;

/// Calls `listener(kind, name, number)`: 0 a stage of so many steps begins, 1 so many steps are
/// done, 2 an iteration begins. Where the answer is true, the work ends.
pub(crate) struct PageProgress<'a> {
    pub(crate) listener: &'a Function,
}

impl PageProgress<'_> {
    fn call(&self, kind: u32, name: &str, number: usize) -> ControlFlow<()> {
        let [kind, name, number] = [JsValue::from(kind), JsValue::from(name), JsValue::from(number as f64)];
        let answer = self.listener.call3(&JsValue::NULL, &kind, &name, &number);
        // A listener that throws is a fault of the page, and wants no more either.
        match answer {
            Ok(stop) if !stop.is_truthy() => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        }
    }
}

impl Progress for PageProgress<'_> {
    fn report(&self, event: Event<'_>) -> ControlFlow<()> {
        match event {
            Event::Stage { name, steps } => self.call(0, name, steps),
            Event::Step { done } => self.call(1, "", done),
            Event::Iteration => self.call(2, "", 0),
            _ => ControlFlow::Continue(()),
        }
    }

    fn clock(&self) -> Duration {
        Duration::from_secs_f64(1e-3 * js_sys::Date::now())
    }
}
