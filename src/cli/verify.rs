//! `glasswarp verify`: opens a block as a stranger would and judges the light that comes through it.

use super::{
    design::open_picture,
    error::Failure,
    judge::{self, Look},
    length::Length,
    settings::TransferName,
    side_file::{self, SideFile},
};
use glasswarp::target::{TargetIrradiance, Transfer};
use glasswarp_verify::picture;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct VerifyArgs {
    /// The block: .stl, .obj or .glb
    block: PathBuf,

    /// The picture that its light shall draw [default: the one named in the side file]
    #[arg(long, value_name = "PICTURE")]
    target: Option<PathBuf>,

    /// The side file with the bench [default: beside the block, with the extension .toml]
    #[arg(long, value_name = "FILE")]
    bench: Option<PathBuf>,

    /// Look at another distance from the mean plane of the exit face than the side file's
    #[arg(long, value_name = "LENGTH")]
    distance: Option<Length>,

    /// Look through another refractive index than the side file's
    #[arg(long, value_name = "N")]
    ior: Option<f64>,

    /// Constant added to the light of the picture [default: the side file's]
    #[arg(long, value_name = "LIGHT")]
    offset: Option<f64>,

    /// How numbers in the picture become light [default: the side file's]
    #[arg(long, value_name = "CURVE")]
    transfer: Option<TransferName>,

    /// Pixels across at which to judge, at most the picture's own
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(8..=8192))]
    pixels: u32,

    /// Photons that confirm the beams and account for all light
    #[arg(long, value_name = "N", default_value_t = Look::default().photons)]
    photons: u64,

    /// Seed of the photons
    #[arg(long, value_name = "N", default_value_t = Look::default().seed)]
    seed: u64,

    /// Write the irradiance on the receiver: .exr (32-bit, linear) or .png (16-bit, linear)
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    /// Fail (exit code 3) if the relative RMS error of the caustic exceeds this
    #[arg(long, value_name = "ERROR")]
    max_error: Option<f64>,
}

pub(crate) fn run(args: &VerifyArgs) -> Result<(), Failure> {
    for output in &args.output {
        Picture::of(output)?;
    }
    let side = SideFile::of_block(&args.block, args.bench.as_deref())?;
    let warnings = warnings(args, &side);
    let mut bench = side.bench.clone();
    if let Some(distance) = args.distance {
        bench.distance_mm = distance.mm;
    }
    if let Some(ior) = args.ior {
        bench.ior = ior;
    }
    let picture = args
        .target
        .as_ref()
        .or(side.design.picture.as_ref())
        .ok_or_else(|| Failure::Usage("the side file names no picture: give one with --target".into()))?;
    let transfer = args.transfer.or(side.design.transfer).map(Transfer::from);
    let offset = args.offset.or(side.design.offset).unwrap_or(0.0);
    let target = TargetIrradiance::from_picture(&open_picture(picture, transfer)?, offset).map_err(Failure::refused)?;
    let look = Look { pixels: args.pixels as usize, photons: args.photons, seed: args.seed };
    let judgement = judge::judge(&args.block, &bench, &target, look)?;
    for warning in warnings.iter().chain(&judgement.suspicions) {
        eprintln!("warning: {warning}");
    }
    println!(
        "{}: {:.2} x {:.2} mm, index {}, receiver {} mm from the mean exit plane, offset {offset}",
        args.block.display(),
        bench.width_mm,
        bench.height_mm,
        bench.ior,
        bench.distance_mm
    );
    judgement.print();
    for output in &args.output {
        let written = match Picture::of(output)? {
            Picture::Exr => picture::write_exr(output, &judgement.caustic),
            // White is the brightest target, as on the wall.
            Picture::Png => {
                let peak = judgement.target.values.iter().copied().fold(0.0, f64::max);
                picture::write_png(output, &judgement.caustic, peak)
            }
        };
        written.map_err(|error| Failure::Io {
            what: format!("{} was not written", output.display()),
            source: error.into(),
        })?;
    }
    judgement.demand(args.max_error)
}

/// What does not fit together between the side file and what lies on the disk.
fn warnings(args: &VerifyArgs, side: &SideFile) -> Vec<String> {
    let mut warnings = Vec::new();
    let name = args.block.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    match (side.files.get(&name), side_file::sha256(&args.block)) {
        (Some(recorded), Ok(found)) if *recorded != found => warnings
            .push(format!("{name} is not the file that was written with its side file: its content has changed since")),
        _ => {}
    }
    if let Some(picture) = &args.target
        && let Ok(found) = side_file::sha256(picture)
        && found != side.picture.sha256
    {
        warnings.push(format!("{} is not the picture that the block was made from", picture.display()));
    }
    warnings
}

enum Picture {
    Exr,
    Png,
}

impl Picture {
    fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        match extension.as_str() {
            "exr" => Ok(Self::Exr),
            "png" => Ok(Self::Png),
            _ => Err(Failure::Usage(format!(
                "{}: irradiance is written as .exr (32-bit) or .png (16-bit), both linear",
                path.display()
            ))),
        }
    }
}
