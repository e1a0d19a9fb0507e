//! Commands, asked from Python.

use crate::{
    arrays, fault,
    work::{self, Watch},
};
use glasswarp::{cli, solver::Event};
use glasswarp_verify::Image;
use numpy::PyArray2;
use pyo3::{exceptions::PyRuntimeError, prelude::*};
use std::{
    ffi::OsString,
    ops::ControlFlow,
    sync::{Arc, Mutex, PoisonError},
};

type Light<'py> = (String, Bound<'py, PyArray2<f64>>);

/// Python, as the command sees it.
struct Caller {
    watch: Arc<Watch>,
    lights: Mutex<Vec<(String, Image)>>,
}

impl cli::Caller for Caller {
    fn report(&self, event: Event<'_>) -> ControlFlow<()> {
        self.watch.hear(event)
    }

    fn light(&self, name: &str, image: &Image) {
        self.lights.lock().unwrap_or_else(PoisonError::into_inner).push((name.to_owned(), image.clone()));
    }
}

/// Runs a command. Returns its document as JSON, and the light that it has seen: names, and arrays
/// with the top row first.
#[pyfunction]
#[pyo3(signature = (words, progress=None))]
pub(crate) fn ask<'py>(
    py: Python<'py>,
    words: Vec<OsString>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(String, Vec<Light<'py>>)> {
    let (document, lights) = work::done(py, progress.as_ref(), move |watch| {
        let caller = Arc::new(Caller { watch, lights: Mutex::default() });
        let document = cli::ask(words, Arc::clone(&caller) as Arc<dyn cli::Caller>);
        (document, std::mem::take(&mut *caller.lights.lock().unwrap_or_else(PoisonError::into_inner)))
    })?;
    let document = document.map_err(|error| fault::misused(py, &error))?;
    let document = serde_json::to_string(&document).map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    let lights = lights.into_iter().map(|(name, image)| Ok((name, arrays::of_image(py, image)?)));
    Ok((document, lights.collect::<PyResult<_>>()?))
}
