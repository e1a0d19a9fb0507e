//! Jobs for Mitsuba 3, which is a package of Python.

use super::{
    Renderer,
    job::{Code, Job, Run},
    scripted::Script,
};
use glam::DVec2;
use std::path::Path;

pub(super) const SCRIPT: Script = Script {
    common: include_str!("mitsuba_common.py"),
    map: include_str!("mitsuba_map.py"),
    image: include_str!("mitsuba_image.py"),
    samples: 64,
};

pub(super) fn map(folder: &Path, landed: [DVec2; 2], pixels: (usize, usize)) -> Job {
    Job {
        renderer: Renderer::Mitsuba,
        folder: folder.into(),
        code: Code::Landings(landed),
        pixels,
        runs: vec![Run { args: vec!["map.py".into()], output: "map.exr".into() }],
    }
}

pub(super) fn image(folder: &Path, pixels: (usize, usize)) -> Job {
    let run = |seed: &str| Run { args: vec!["image.py".into(), seed.into()], output: format!("image-{seed}.exr") };
    Job {
        renderer: Renderer::Mitsuba,
        folder: folder.into(),
        code: Code::Irradiance { clipped: f64::INFINITY, exposure: 1.0 },
        pixels,
        runs: ["1", "2"].map(run).into(),
    }
}
