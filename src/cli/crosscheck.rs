//! `glasswarp crosscheck`: shows an exported block to an independent renderer, and compares what
//! both see.

use super::{
    console::{self, say},
    machine::Machine,
    outcome::error_limit,
    outputs,
    progress::TerminalProgress,
    side_files::{self, open_block},
    verify::PlacingArgs,
};
use crate::{
    failure::Failure,
    record::document,
    report::text,
    spec::{Length, name_of},
    study::{
        behind,
        bench::{exit_face_in_words, exit_face_of, scene_of},
        changed::changed_bench,
        crosscheck::{demand_image, demand_map, levels_document, map_document, pixels_over},
    },
};
use clap::ValueEnum;
use glasswarp_verify::{
    Image,
    crosscheck::{Comparison, CrosscheckError, Job, Renderer},
    image_file,
};
use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

#[derive(clap::Args)]
pub(crate) struct CrosscheckArgs {
    /// The block: .stl, .obj, .glb, .gltf, .ply, .off, .3mf, .step, or a height map in .png or .exr
    block: PathBuf,

    #[command(flatten)]
    placing: PlacingArgs,

    /// The renderer
    #[arg(long, value_name = "RENDERER")]
    with: RendererName,

    /// What to compare
    #[arg(long, value_name = "MODE", default_value = "map")]
    mode: Mode,

    /// Folder for the scene, which is kept [default: beside the block, its name with
    /// .crosscheck-RENDERER]
    #[arg(long, value_name = "DIR")]
    scene: Option<PathBuf>,

    /// Only write the scene
    #[arg(long)]
    write_only: bool,

    /// The renderer's executable, if it is not the usual one in the PATH
    #[arg(long, value_name = "FILE")]
    program: Option<OsString>,

    /// The side file with the bench [default: beside the block, with the extension .toml]
    #[arg(long, value_name = "FILE")]
    bench: Option<PathBuf>,

    /// Another distance from the mean plane of the exit face than the side file's
    #[arg(long, value_name = "LENGTH")]
    distance: Option<Length>,

    /// Another refractive index than the side file's
    #[arg(long, value_name = "N")]
    ior: Option<f64>,

    /// Pixels across, rounded up to a multiple of 8
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(64..=4096))]
    pixels: u32,

    /// Fail (exit code 3) if the difference exceeds this: in map mode the rms distance in mm, or
    /// one ray in a thousand landing by one of both only; in image mode the relative RMS at a
    /// quarter of the pixels, with the noise of one run
    #[arg(long, value_name = "DIFFERENCE", conflicts_with = "write_only", value_parser = error_limit)]
    max_difference: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum RendererName {
    /// POV-Ray 3.7
    Povray,
    /// Blender's Cycles, 3.4 or later
    Blender,
    /// Mitsuba 3: 'mitsuba' and 'numpy' of PyPI, for $GLASSWARP_PYTHON or python3
    Mitsuba,
    /// LuxCoreRender 2 (image mode only): 'pyluxcore' and 'numpy' of PyPI, likewise
    Luxcore,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// Landing points of rays, without noise: seconds
    Map,
    /// The caustic, against the renderer's noise: minutes
    Image,
}

pub(crate) fn run(args: &CrosscheckArgs) -> Result<(), Failure> {
    let side = side_files::of_block(&args.block, args.bench.as_deref())?;
    let (mesh, block, warnings) = open_block(&args.block, Some(&side), args.placing.placing())?;
    warnings.into_iter().for_each(console::warn);
    let renderer = match args.with {
        RendererName::Povray => Renderer::PovRay,
        RendererName::Blender => Renderer::Blender,
        RendererName::Mitsuba => Renderer::Mitsuba,
        RendererName::Luxcore => Renderer::LuxCore,
    };
    let folder =
        args.scene.clone().unwrap_or_else(|| args.block.with_extension(format!("crosscheck-{}", name_of(args.with))));
    let mut written = renderer.files(args.mode == Mode::Image);
    if args.mode == Mode::Image {
        written.extend(IMAGES.iter().flat_map(|name| ["exr", "png"].map(|extension| format!("{name}.{extension}"))));
    }
    // A folder that is not there yet holds nothing that could be replaced, and is made with the
    // scene.
    let written = written.iter().filter(|_| folder.is_dir()).map(|name| folder.join(name));
    let inputs = side_files::inputs(&args.block, args.bench.as_deref())?;
    outputs::plan(inputs.iter().chain([&folder]).map(PathBuf::as_path), written)?;
    let scene = scene_of(&side.bench, &side.design, &behind::open(&side.design, &Machine)?, &Machine)?;
    if !scene.before.is_empty() {
        return Err(Failure::Usage(format!(
            "{} stands behind another block (`behind` in its side file), and other renderers are shown one block alone: 'glasswarp verify' traces the row",
            args.block.display()
        )));
    }
    let mut scene = changed_bench(scene, Some(&block), args.ior, args.distance.map(|length| length.mm))?;
    (scene.window.nx, scene.window.ny) = pixels_over(scene.window.size_mm, args.pixels);
    let study = Comparison::new(&mesh, &block, &scene).map_err(Failure::refused)?;
    say!(
        "{} seen by the verifier and by {}, {}, receiver {} mm from the mean exit plane",
        args.block.display(),
        renderer.name(),
        exit_face_in_words(exit_face_of(&scene)),
        scene.distance_mm
    );
    let found = document::Crosscheck {
        renderer: renderer.name().to_owned(),
        scene: folder.display().to_string(),
        map: None,
        image: Vec::new(),
    };
    console::result(document::Result::Crosscheck(found.clone()));
    match args.mode {
        Mode::Map => {
            let (nx, ny) = pixels_over(block.size_mm(), args.pixels);
            let ours = study.landings(nx, ny).map_err(Failure::refused)?;
            let job = study.write_map(renderer, &folder, &ours).map_err(failed)?;
            if !rendered(args, &job)? {
                return Ok(());
            }
            let agreement = study.compare_map(&job, &ours).map_err(failed)?;
            console::text(&text::crosscheck::map(&agreement, job.quantum_mm()));
            console::result(document::Result::Crosscheck(document::Crosscheck {
                map: Some(map_document(&agreement)),
                ..found
            }));
            demand_map(&agreement, args.max_difference)
        }
        Mode::Image => {
            let ours = study.image(renderer).map_err(Failure::refused)?;
            let job = study.write_image(renderer, &folder, &ours).map_err(failed)?;
            if !rendered(args, &job)? {
                return Ok(());
            }
            let (agreement, theirs) = study.compare_image(&job, &ours).map_err(failed)?;
            write_images(&folder, &ours, &theirs)?;
            console::text(&text::crosscheck::image(&agreement));
            console::result(document::Result::Crosscheck(document::Crosscheck {
                image: levels_document(&agreement),
                ..found
            }));
            demand_image(&agreement, args.max_difference)
        }
    }
}

/// Renders, unless only the scene was asked for.
fn rendered(args: &CrosscheckArgs, job: &Job) -> Result<bool, Failure> {
    say!("  scene          {} (README.txt there says how to run it by hand)", job.folder().display());
    if args.write_only {
        for command in job.commands() {
            say!("  to render      {command}");
        }
        return Ok(false);
    }
    let progress = TerminalProgress::new();
    progress.begin("rendering", 0);
    job.run(args.program.as_deref()).map_err(failed)?;
    progress.finish();
    Ok(true)
}

/// The caustics that image mode compares.
const IMAGES: [&str; 2] = ["verifier", "renderer"];

/// Writes both caustics beside the scene, in the same scale.
fn write_images(folder: &Path, ours: &Image, theirs: &Image) -> Result<(), Failure> {
    let white = ours.values.iter().copied().fold(0.0, f64::max);
    for (name, image) in IMAGES.into_iter().zip([ours, theirs]) {
        let exr = image_file::write_exr(&folder.join(format!("{name}.exr")), image);
        let png = exr.and_then(|()| image_file::write_png(&folder.join(format!("{name}.png")), image, white));
        png.map_err(Failure::writing)?;
    }
    Ok(())
}

fn failed(error: CrosscheckError) -> Failure {
    match error {
        CrosscheckError::Write(_) => Failure::writing(error),
        CrosscheckError::NotInstalled { .. } | CrosscheckError::Failed { .. } | CrosscheckError::Picture { .. } => {
            Failure::Io { what: "the renderer gave no picture".into(), source: error.into() }
        }
        _ => Failure::refused(error),
    }
}
