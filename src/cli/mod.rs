//! The command line: one file per subcommand; arguments become typed options once, here.

mod angle;
mod bench;
mod budget;
mod check;
mod crosscheck;
mod cutters;
mod design;
mod diagnosis;
mod error;
mod finish;
mod judge;
mod lamp;
mod length;
mod mill;
mod opinion;
mod page;
mod plan;
mod preview;
mod progress;
mod settings;
mod shards;
mod side_file;
mod sweep;
mod tolerance;
mod verify;
mod workpiece;

use clap::{Parser, Subcommand};
use error::Failure;
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  glasswarp design portrait.png -o block.stl -o block.glb -o block.obj
  glasswarp preview portrait.png --distance 60cm
  glasswarp design logo.png --material pmma --size 15cm --distance 1m -o logo.stl
  glasswarp verify block.stl --target portrait.png
  glasswarp verify lens.stl --ior 1.49 --distance 20cm --window 50mm -o light.exr
  glasswarp verify block.stl --sweep distance=60..1000 -o sweep.csv -o sweep.png
  glasswarp crosscheck block.stl --with povray
  glasswarp check block.stl --cutter ball:3mm --step-over 0.1mm --tolerance -o check.png
  glasswarp mill block.stl --cutter ball:3mm --step-over 0.1mm --polish 0.05mm -o milled.stl

Lengths take mm, cm, m or in; a bare number is mm.
Exit codes: 0 fine, 1 file or internal error, 2 refused: senseless or against physics,
3 a verification fell short, 4 the mesh is no closed solid.";

/// Turns a picture into a block of glass whose light draws that picture.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES, max_term_width = 120)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make a block from a picture, export it, and trace light through what was exported
    Design(design::DesignArgs),
    /// Look at what a picture would become, in a second or two: a coarse block, its relief and its light
    Preview(preview::PreviewArgs),
    /// Trace light through an exported block and judge the picture that it draws
    Verify(verify::VerifyArgs),
    /// Say whether a block can be made: hollows and slopes for a cutter, thickness, scallops; and what tolerances do to its picture
    Check(check::CheckArgs),
    /// Mill a block row by row and polish it, in simulation, and judge the picture after every step
    Mill(mill::MillArgs),
    /// Show an exported block to an independent renderer, and compare what both see
    Crosscheck(crosscheck::CrosscheckArgs),
    /// List the materials known by name, with their refractive indices
    Materials,
}

/// Parses, runs, and reports.
pub(crate) fn run() -> ExitCode {
    let cli = Cli::parse();
    // Nothing half-written stays behind: outputs are written under another name until they are whole.
    let handler = ctrlc::set_handler(|| {
        let _held = glasswarp::export::remove_unfinished();
        eprintln!("\ninterrupted; nothing half-written was left");
        std::process::exit(130);
    });
    if let Err(error) = handler {
        eprintln!("warning: an interruption cannot be handled ({error})");
    }
    let done = match cli.command {
        Command::Design(args) => design::run(&args),
        Command::Preview(args) => preview::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Mill(args) => mill::run(&args),
        Command::Crosscheck(args) => crosscheck::run(&args),
        Command::Materials => materials(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

fn materials() -> Result<(), Failure> {
    println!("{:<14} {:>7}  description", "name", "index");
    for material in glasswarp::materials::MATERIALS {
        println!("{:<14} {:>7}  {}", material.name, material.ior, material.description);
    }
    Ok(())
}
