//! Jobs for LuxCoreRender 2, which is a package of Python.

use super::{
    Renderer,
    job::{Code, Job, Run},
    scripted::Script,
};
use std::path::Path;

pub(super) const SCRIPT: Script = Script {
    common: include_str!("luxcore_common.py"),
    map: "",
    image: include_str!("luxcore_image.py"),
    samples: 128,
};

pub(super) fn image(folder: &Path, pixels: (usize, usize)) -> Job {
    let run = |seed: &str| Run { args: vec!["image.py".into(), seed.into()], output: format!("image-{seed}.exr") };
    Job {
        renderer: Renderer::LuxCore,
        folder: folder.into(),
        code: Code::Irradiance { clipped: f64::INFINITY, exposure: 1.0 },
        pixels,
        runs: ["1", "2"].map(run).into(),
    }
}
