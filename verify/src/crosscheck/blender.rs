//! Jobs for Blender's Cycles.

use super::{
    Renderer,
    job::{Code, Job, Run},
    scripted::Script,
};
use glam::DVec2;
use std::path::Path;

pub(super) const SCRIPT: Script = Script {
    common: include_str!("blender_common.py"),
    map: include_str!("blender_map.py"),
    image: include_str!("blender_image.py"),
    samples: 8,
};

fn run(script: &str, output: String, more: &[&str]) -> Run {
    let args = ["-b", "--factory-startup", "-noaudio", "--python-exit-code", "1", "-P", script];
    Run { args: args.iter().chain(more).map(|&arg| arg.into()).collect(), output }
}

pub(super) fn map(folder: &Path, landed: [DVec2; 2], pixels: (usize, usize)) -> Job {
    Job {
        renderer: Renderer::Blender,
        folder: folder.into(),
        code: Code::Landings(landed),
        pixels,
        runs: vec![run("map.py", "map.exr".into(), &[])],
    }
}

pub(super) fn image(folder: &Path, pixels: (usize, usize)) -> Job {
    let runs = ["1", "2"].map(|seed| run("image.py", format!("image-{seed}.exr"), &["--", seed]));
    Job {
        renderer: Renderer::Blender,
        folder: folder.into(),
        code: Code::Irradiance { clipped: f64::INFINITY, exposure: 1.0 },
        pixels,
        runs: runs.into(),
    }
}
