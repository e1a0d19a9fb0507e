//! Scenes for renderers that are driven by a script in Python, and their pictures.

use super::{
    camera::{Camera, hole, light, reach_mm, receiver},
    error::CrosscheckError,
    job::{Code, Job, Run},
    renderer::Renderer,
    shaded::ShadedMesh,
};
use crate::{
    block::Block,
    scene::{Optics, Scene},
};
use glam::{DVec2, DVec3, Vec3};
use std::path::Path;

/// A renderer's script, in parts; the numbers of the bench are written before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Script {
    common: &'static str,
    /// `None` for a renderer whose rays cannot be aimed.
    map: Option<&'static str>,
    image: &'static str,
    /// Samples per pixel of image mode.
    samples: u32,
    /// Arguments of the program before the script, and between it and the script's own.
    before: &'static [&'static str],
    between: &'static [&'static str],
}

impl Script {
    /// `None` for POV-Ray, which has a language of its own.
    pub(super) fn of(renderer: Renderer) -> Option<Self> {
        Some(match renderer {
            Renderer::PovRay => return None,
            Renderer::Blender => Self {
                common: include_str!("blender_common.py"),
                map: Some(include_str!("blender_map.py")),
                image: include_str!("blender_image.py"),
                samples: 8,
                before: &["-b", "--factory-startup", "-noaudio", "--python-exit-code", "1", "-P"],
                between: &["--"],
            },
            Renderer::Mitsuba => Self {
                common: include_str!("mitsuba_common.py"),
                map: Some(include_str!("mitsuba_map.py")),
                image: include_str!("mitsuba_image.py"),
                samples: 64,
                before: &[],
                between: &[],
            },
            Renderer::LuxCore => Self {
                common: include_str!("luxcore_common.py"),
                map: None,
                image: include_str!("luxcore_image.py"),
                samples: 128,
                before: &[],
                between: &[],
            },
        })
    }

    /// A start of the script: of image mode with a seed.
    fn run(&self, name: &str, seed: Option<&str>) -> Run {
        let (between, output): (&[&str], _) = match seed {
            Some(seed) => (self.between, format!("{name}-{seed}.exr")),
            None => (&[], format!("{name}.exr")),
        };
        let script = format!("{name}.py");
        let args = self.before.iter().copied().chain([script.as_str()]).chain(between.iter().copied()).chain(seed);
        Run { args: args.map(str::to_owned).collect(), output }
    }

    /// The job of map mode, if the renderer has one.
    pub(super) fn map(
        &self,
        renderer: Renderer,
        folder: &Path,
        landed: [DVec2; 2],
        pixels: (usize, usize),
    ) -> Result<Job, CrosscheckError> {
        self.map.ok_or(CrosscheckError::NoMap(renderer))?;
        let runs = vec![self.run("map", None)];
        Ok(Job { renderer, folder: folder.into(), code: Code::Landings(landed), pixels, runs })
    }

    /// The job of image mode, twice with different noise.
    pub(super) fn image(&self, renderer: Renderer, folder: &Path, pixels: (usize, usize)) -> Job {
        let code = Code::Irradiance { clipped: f64::INFINITY, exposure: 1.0 };
        let runs = ["1", "2"].map(|seed| self.run("image", Some(seed))).into();
        Job { renderer, folder: folder.into(), code, pixels, runs }
    }

    /// Writes the mesh, and the script with the bench at its head.
    pub(super) fn write(
        &self,
        job: &Job,
        block: &Block,
        scene: &Scene,
        shaded: &ShadedMesh,
    ) -> Result<(), CrosscheckError> {
        let vectors = |name: &str, vectors: &[Vec3]| {
            job.write(name, |out| {
                vectors.iter().flat_map(Vec3::to_array).try_for_each(|v| out.write_all(&v.to_le_bytes()))
            })
        };
        vectors("positions.f32", &shaded.positions)?;
        vectors("normals.f32", &shaded.normals)?;
        job.write("triangles.u32", |out| {
            shaded.triangles.iter().flatten().try_for_each(|v| out.write_all(&v.to_le_bytes()))
        })?;
        let (name, body) = match job.code {
            Code::Landings(_) => ("map.py", self.map.ok_or(CrosscheckError::NoMap(job.renderer))?),
            Code::Irradiance { .. } => ("image.py", self.image),
        };
        job.write(name, |out| {
            writeln!(out, "# Millimetres. To render it, in this folder:")?;
            for command in job.commands() {
                writeln!(out, "#   {command}")?;
            }
            writeln!(out, "PIXELS = ({}, {})", job.pixels.0, job.pixels.1)?;
            writeln!(out, "INDEX = {}", scene.ior())?;
            writeln!(out, "DISTANCE = {}", scene.distance_mm)?;
            writeln!(out, "ENTRY_Z = {}", block.entry_z)?;
            writeln!(out, "TOP_Z = {}", block.height_range_mm().1)?;
            writeln!(out, "REACH = {}", reach_mm(block, scene))?;
            let mut pair = |name: &str, v: DVec2| writeln!(out, "{name} = ({}, {})", v.x, v.y);
            pair("BLOCK_FROM", block.exit.lower)?;
            pair("BLOCK_TO", block.exit.upper)?;
            let truth = |yes: bool| if yes { "True" } else { "False" };
            match job.code {
                Code::Landings([from, to]) => {
                    pair("LANDED_FROM", from)?;
                    pair("LANDED_TO", to)?;
                    let mut triple = |name: &str, v: DVec3| writeln!(out, "{name} = ({}, {}, {})", v.x, v.y, v.z);
                    let camera = Camera::of(block, scene);
                    triple("VIEW_LOCATION", camera.location(block))?;
                    triple("VIEW_CENTRE", camera.centre)?;
                    triple("VIEW_LOOKS", camera.forward)?;
                    triple("VIEW_RIGHT", camera.right)?;
                    triple("VIEW_UP", camera.up)?;
                    let axes = receiver(scene);
                    triple("RECEIVER_X", axes.x_axis)?;
                    triple("RECEIVER_Y", axes.y_axis)?;
                    triple("RECEIVER_Z", axes.z_axis)?;
                    writeln!(out, "AT_SOURCE = {}", truth(camera.source.is_some()))?;
                    writeln!(out, "MIRROR = {}", truth(scene.optics == Optics::Reflects))?;
                }
                Code::Irradiance { .. } => {
                    let [from, to] = scene.window.corners_mm();
                    pair("WINDOW_FROM", from)?;
                    pair("WINDOW_TO", to)?;
                    let [from, to] = hole(block, scene);
                    pair("HOLE_FROM", from)?;
                    pair("HOLE_TO", to)?;
                    let (source, direction) = light(scene);
                    let mut triple = |name: &str, v: DVec3| writeln!(out, "{name} = ({}, {}, {})", v.x, v.y, v.z);
                    triple("LIGHT_DIRECTION", direction)?;
                    triple("LIGHT_SOURCE", source.unwrap_or_default())?;
                    writeln!(out, "AT_SOURCE = {}", truth(source.is_some()))?;
                    writeln!(out, "SAMPLES = {}", self.samples)?;
                }
            }
            writeln!(out, "\n{}\n\n{body}", self.common)
        })
    }
}
