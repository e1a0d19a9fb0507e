//! Scenes for POV-Ray 3.7, and its pictures.

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
use std::{
    io::{self, Write},
    path::Path,
};

const MAP: &str = include_str!("povray_map.pov");
const IMAGE: &str = include_str!("povray_image.pov");

/// The brightest pixel of the verifier's image, in what a 16-bit picture can hold: photon maps have
/// grain.
const BRIGHTEST: f64 = 0.5;
/// Photons across the block for every pixel across the picture, and at most.
const PHOTONS_PER_PIXEL: f64 = 16.0;
const MOST_PHOTONS: f64 = 4000.0;

/// From photon to photon, mm.
fn spacing(size: DVec2, (nx, ny): (usize, usize)) -> f64 {
    size.max_element() / (PHOTONS_PER_PIXEL * nx.max(ny) as f64).min(MOST_PHOTONS)
}

fn run(scene: &str, output: &str, (nx, ny): (usize, usize), more: Option<String>) -> Run {
    let mut args: Vec<String> = vec![
        format!("+I{scene}"),
        format!("+O{output}"),
        format!("+W{nx}"),
        format!("+H{ny}"),
        "+FN16".into(),
        "File_Gamma=1.0".into(),
        "-A".into(),
        "-D".into(),
        "-V".into(),
    ];
    args.extend(more);
    Run { args, output: output.into() }
}

pub(super) fn map(folder: &Path, landed: [DVec2; 2], pixels: (usize, usize)) -> Job {
    Job {
        renderer: Renderer::PovRay,
        folder: folder.into(),
        code: Code::Landings(landed),
        pixels,
        runs: vec![run("map.pov", "map.png", pixels, None)],
    }
}

/// `peak` is the verifier's brightest pixel; its scale is the renderer's too.
pub(super) fn image(folder: &Path, peak: f64, size: DVec2, pixels: (usize, usize)) -> Job {
    let spacing = spacing(size, pixels);
    // Photons start on a lattice and are jittered by a fixed sequence: another spacing is another
    // noise.
    let runs = [spacing, spacing * 1.0137].into_iter().enumerate().map(|(k, spacing)| {
        run("image.pov", &format!("image-{}.png", k + 1), pixels, Some(format!("Declare=Spacing={spacing}")))
    });
    Job {
        renderer: Renderer::PovRay,
        folder: folder.into(),
        code: Code::Irradiance { clipped: 1.0, exposure: BRIGHTEST / peak },
        pixels,
        runs: runs.collect(),
    }
}

pub(super) fn write(job: &Job, block: &Block, scene: &Scene, shaded: &ShadedMesh) -> Result<(), CrosscheckError> {
    job.write("block.inc", |out| mesh(out, shaded))?;
    let (name, template) = match job.code {
        Code::Landings(_) => ("map.pov", MAP),
        Code::Irradiance { .. } => ("image.pov", IMAGE),
    };
    job.write(name, |out| {
        writeln!(out, "// Millimetres. To render it, in this folder:")?;
        for command in job.commands() {
            writeln!(out, "//   {command}")?;
        }
        let mut declare = |name: &str, value: f64| writeln!(out, "#declare {name} = {value};");
        declare("Index", scene.ior())?;
        declare("Distance", scene.distance_mm)?;
        declare("Entry_Z", block.entry_z)?;
        declare("Top_Z", block.height_range_mm().1)?;
        declare("Reach", reach_mm(block, scene))?;
        let mut pair = |name: &str, v: DVec2| writeln!(out, "#declare {name} = <{}, {}>;", v.x, v.y);
        pair("Block_From", block.exit.lower)?;
        pair("Block_To", block.exit.upper)?;
        match job.code {
            Code::Landings([from, to]) => {
                pair("Landed_From", from)?;
                pair("Landed_To", to)?;
                let mut triple = |name: &str, v: DVec3| writeln!(out, "#declare {name} = <{}, {}, {}>;", v.x, v.y, v.z);
                let camera = Camera::of(block, scene);
                triple("View_Location", camera.location(block))?;
                triple("View_Direction", camera.source.map_or(camera.forward, |source| camera.centre - source))?;
                triple("View_Right", camera.right)?;
                triple("View_Up", camera.up)?;
                let axes = receiver(scene);
                triple("Receiver_X", axes.x_axis)?;
                triple("Receiver_Y", axes.y_axis)?;
                triple("Receiver_Z", axes.z_axis)?;
                writeln!(out, "#declare At_Source = {};", i32::from(camera.source.is_some()))?;
                writeln!(out, "#declare Mirror = {};", i32::from(scene.optics == Optics::Reflects))?;
            }
            Code::Irradiance { exposure, .. } => {
                let [from, to] = scene.window.corners_mm();
                pair("Window_From", from)?;
                pair("Window_To", to)?;
                let [from, to] = hole(block, scene);
                pair("Hole_From", from)?;
                pair("Hole_To", to)?;
                let (source, direction) = light(scene);
                let mut triple = |name: &str, v: DVec3| writeln!(out, "#declare {name} = <{}, {}, {}>;", v.x, v.y, v.z);
                triple("Light_Direction", direction)?;
                triple("Light_Source", source.unwrap_or_default())?;
                writeln!(out, "#declare At_Source = {};", i32::from(source.is_some()))?;
                writeln!(out, "#declare Light = {exposure};")?;
                writeln!(out, "#declare First_Spacing = {};", spacing(block.size_mm(), job.pixels))?;
            }
        }
        writeln!(out)?;
        out.write_all(template.as_bytes())
    })
}

fn mesh(out: &mut dyn Write, shaded: &ShadedMesh) -> io::Result<()> {
    let vectors = |out: &mut dyn Write, name: &str, vectors: &[Vec3]| {
        writeln!(out, "  {name} {{ {}", vectors.len())?;
        vectors.iter().try_for_each(|v| writeln!(out, ",<{},{},{}>", v.x, v.y, v.z))?;
        writeln!(out, "  }}")
    };
    writeln!(out, "#declare Block = mesh2 {{")?;
    vectors(out, "vertex_vectors", &shaded.positions)?;
    vectors(out, "normal_vectors", &shaded.normals)?;
    // Vertices and normals go in pairs.
    for name in ["face_indices", "normal_indices"] {
        writeln!(out, "  {name} {{ {}", shaded.triangles.len())?;
        shaded.triangles.iter().try_for_each(|[a, b, c]| writeln!(out, ",<{a},{b},{c}>"))?;
        writeln!(out, "  }}")?;
    }
    writeln!(out, "  inside_vector <0, 0, 1>\n}}")
}
