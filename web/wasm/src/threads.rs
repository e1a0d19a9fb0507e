//! rayon's threads: each is a worker of the page, with this module and its memory.

use rayon::{ThreadBuilder, ThreadPoolBuilder};
use std::sync::{Condvar, Mutex, PoisonError};
use wasm_bindgen::prelude::*;

/// Threads that no worker has taken yet.
static WAITING: Mutex<Vec<ThreadBuilder>> = Mutex::new(Vec::new());
static COMES: Condvar = Condvar::new();

/// Makes rayon compute on `count` threads: this one, and `count - 1` workers that call
/// [`work_as_thread`]. Returns once all of them are at work.
///
/// # Errors
/// That rayon has computed before.
#[wasm_bindgen]
pub fn start_threads(count: usize) -> Result<(), JsValue> {
    ThreadPoolBuilder::new()
        .num_threads(count)
        .use_current_thread()
        .spawn_handler(|thread| {
            WAITING.lock().unwrap_or_else(PoisonError::into_inner).push(thread);
            COMES.notify_one();
            Ok(())
        })
        .build_global()
        .map_err(|error| JsValue::from_str(&error.to_string()))
}

/// Computes as one of rayon's threads, for as long as this worker lives.
#[wasm_bindgen]
pub fn work_as_thread() {
    let waiting = WAITING.lock().unwrap_or_else(PoisonError::into_inner);
    let waiting = COMES.wait_while(waiting, |waiting| waiting.is_empty());
    let thread = waiting.unwrap_or_else(PoisonError::into_inner).pop();
    if let Some(thread) = thread {
        thread.run();
    }
}
