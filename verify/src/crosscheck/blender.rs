//! Scenes for Blender's Cycles, and its pictures.

use super::{
    Renderer, Study,
    job::{Code, CrosscheckError, Job, Run},
    shaded::ShadedMesh,
};
use glam::{DVec2, Vec3};
use std::path::Path;

const COMMON: &str = include_str!("blender_common.py");
const MAP: &str = include_str!("blender_map.py");
const IMAGE: &str = include_str!("blender_image.py");

/// Samples per pixel of image mode.
const SAMPLES: u32 = 32;

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

pub(super) fn write(job: &Job, study: &Study<'_>, shaded: &ShadedMesh) -> Result<(), CrosscheckError> {
    let vectors = |name: &str, vectors: &[Vec3]| {
        job.write(name, |out| {
            vectors.iter().flat_map(|v| v.to_array()).try_for_each(|v| out.write_all(&v.to_le_bytes()))
        })
    };
    vectors("positions.f32", &shaded.positions)?;
    vectors("normals.f32", &shaded.normals)?;
    job.write("triangles.u32", |out| {
        shaded.triangles.iter().flatten().try_for_each(|v| out.write_all(&v.to_le_bytes()))
    })?;
    let (name, script) = match job.code {
        Code::Landings(_) => ("map.py", MAP),
        Code::Irradiance { .. } => ("image.py", IMAGE),
    };
    job.write(name, |out| {
        writeln!(out, "# Millimetres; light travels +z. To render it, in this folder:")?;
        for command in job.commands() {
            writeln!(out, "#   {command}")?;
        }
        let (block, scene) = (study.block, &study.scene);
        let window = &scene.window;
        let corners = [window.centre_mm - 0.5 * window.size_mm, window.centre_mm + 0.5 * window.size_mm];
        let reach = block.lower.abs().max(block.upper.abs()).max(corners[0].abs()).max(corners[1].abs());
        writeln!(out, "PIXELS = ({}, {})", job.pixels.0, job.pixels.1)?;
        writeln!(out, "INDEX = {}", scene.ior)?;
        writeln!(out, "DISTANCE = {}", scene.distance_mm)?;
        writeln!(out, "ENTRY_Z = {}", block.entry_z)?;
        writeln!(out, "TOP_Z = {}", block.height_range_mm().1)?;
        writeln!(out, "REACH = {}", 3.0 * reach.max_element())?;
        let mut pair = |name: &str, v: DVec2| writeln!(out, "{name} = ({}, {})", v.x, v.y);
        pair("BLOCK_FROM", block.lower)?;
        pair("BLOCK_TO", block.upper)?;
        match job.code {
            Code::Landings([from, to]) => {
                pair("LANDED_FROM", from)?;
                pair("LANDED_TO", to)?;
            }
            Code::Irradiance { .. } => {
                pair("WINDOW_FROM", corners[0])?;
                pair("WINDOW_TO", corners[1])?;
                writeln!(out, "SAMPLES = {SAMPLES}")?;
            }
        }
        writeln!(out, "\n{COMMON}\n\n{script}")
    })
}

/// Pixels of a 32-bit OpenEXR.
#[allow(clippy::type_complexity)]
pub(super) fn read(path: &Path) -> Result<((usize, usize), Vec<[f32; 3]>), String> {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let picture = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size: exr::prelude::Vec2<usize>, _| (size, vec![[0f32; 3]; size.area()]),
            |(size, pixels), at, (r, g, b): (f32, f32, f32)| pixels[at.y() * size.x() + at.x()] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|error| error.to_string())?;
    let (size, pixels) = picture.layer_data.channel_data.pixels;
    Ok(((size.x(), size.y()), pixels))
}
