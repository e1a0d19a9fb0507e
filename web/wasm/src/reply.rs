//! What goes out to the page.

use glasswarp::{
    failure::Failure,
    image::GrayImage,
    report::{Exposure, difference_picture, irradiance_picture},
    solver::SolveError,
    study::judge,
};
use glasswarp_verify::Image;
use js_sys::{JSON, Object, Reflect, Uint8Array};
use serde::Serialize;
use wasm_bindgen::JsValue;

/// Data and typed arrays for the page.
pub(crate) struct Reply {
    arrays: Object,
}

impl Reply {
    pub(crate) fn new() -> Self {
        Self { arrays: Object::new() }
    }

    /// Adds a typed array.
    pub(crate) fn array(&mut self, name: &str, array: impl Into<JsValue>) {
        // Setting a key of a fresh object cannot fail.
        let _ = Reflect::set(&self.arrays, &name.into(), &array.into());
    }

    /// Adds a picture: a byte for every pixel, row by row from the top.
    pub(crate) fn picture(&mut self, name: &str, picture: &GrayImage) {
        self.array(name, Uint8Array::from(picture.as_raw().as_slice()));
    }

    /// Adds `light`, `target` and their `difference`.
    pub(crate) fn compared(&mut self, light: &Image, target: &Image, exposure: Exposure) {
        let [light, target] = [light, target].map(judge::field_of);
        self.picture("light", &irradiance_picture(&light, exposure));
        self.picture("target", &irradiance_picture(&target, exposure));
        self.picture("difference", &difference_picture(&target, &light, exposure));
    }

    /// The reply as the page sees it: `{ facts, arrays }`.
    pub(crate) fn with_facts(self, facts: &impl Serialize) -> Result<JsValue, JsValue> {
        let object = Object::new();
        Reflect::set(&object, &"facts".into(), &plain(facts)?)?;
        Reflect::set(&object, &"arrays".into(), &self.arrays)?;
        Ok(object.into())
    }
}

/// Plain data for the page.
pub(crate) fn plain(data: &impl Serialize) -> Result<JsValue, JsValue> {
    let text = serde_json::to_string(data).map_err(|error| JsValue::from(error.to_string()))?;
    JSON::parse(&text)
}

/// What the page hears of a failure.
#[derive(Serialize)]
struct Told {
    kind: &'static str,
    message: String,
    causes: Vec<String>,
}

/// A failure as the page catches it.
pub(crate) fn told(failure: &Failure) -> JsValue {
    let cancelled = SolveError::Cancelled.to_string();
    let message = failure.to_string();
    let kind = match failure {
        _ if message == cancelled => "cancelled",
        Failure::Io { .. } | Failure::Write(_) | Failure::Unreadable(_) => "file",
        Failure::BelowThreshold(_) => "fell-short",
        Failure::InvalidMesh { .. } => "invalid-mesh",
        _ => "refused",
    };
    let told = Told { kind, message, causes: failure.causes() };
    plain(&told).unwrap_or_else(|fault| fault)
}
