//! Photon runs in parts: every part can be traced on another machine, and merging all gives what
//! one run gives.

use super::{
    console::{self, say},
    machine::{IrradianceFile, Machine},
    outcome::{error_limit, unless_within},
    outputs,
    side_files::hash_of,
};
use crate::{
    failure::Failure,
    record::document,
    report::text,
    spec::{Settings, TransferName},
    study::{
        tally::{Part, bench_line, merged, tally_document},
        target_light,
    },
};
use glasswarp_verify::{
    Image, PhotonPlan, PhotonTally, TallyError, Tracer, UnbiasedError, metrics, photons, reference::resampled,
};
use std::path::{Path, PathBuf};

/// Adds up the tallies of a run's parts
#[derive(clap::Args)]
pub(crate) struct MergeArgs {
    /// The tallies to add up, in any order
    #[arg(required = true)]
    tallies: Vec<PathBuf>,

    /// Judge the light against this picture
    #[arg(long, value_name = "PICTURE")]
    target: Option<PathBuf>,

    /// Constant added to the light of the picture
    #[arg(long, value_name = "LIGHT", default_value_t = 0.0, requires = "target")]
    offset: f64,

    /// How numbers in the picture become light [default: by its file]
    #[arg(long, value_name = "CURVE", requires = "target")]
    transfer: Option<TransferName>,

    /// Fail (exit code 3) if the relative RMS error, less its noise, exceeds this
    #[arg(long, value_name = "ERROR", requires = "target", value_parser = error_limit)]
    max_error: Option<f64>,

    /// Write the sum as a tally: byte by byte the file that one run of all parts writes
    #[arg(long, value_name = "FILE")]
    tally: Option<PathBuf>,

    /// Write the irradiance on the receiver: .exr (32-bit, linear) or .png (16-bit, linear)
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
}

/// Traces the photons of a plan, writes their tally, and judges it if there is a picture.
pub(crate) fn trace(
    block: &Path,
    tracer: &Tracer,
    plan: &PhotonPlan,
    path: &Path,
    wanted: Option<&Image>,
) -> Result<Option<UnbiasedError>, Failure> {
    let tally = photons(tracer, plan).map_err(Failure::refused)?;
    let hash = hash_of(block)?;
    tally.write(path, &bench_line(&hash, tracer.scene())).map_err(Failure::writing)?;
    say!("{}: part {} of {}", path.display(), plan.shard + 1, plan.shards);
    console::text(&text::tally::photons(&tally));
    console::light("irradiance", &tally.image());
    let error = wanted.map(|wanted| judge_tally(&tally, wanted)).transpose()?;
    console::result(document::Result::Tally(tally_document(&tally, error)));
    Ok(error)
}

/// Judges the light of a tally, and prints that.
fn judge_tally(tally: &PhotonTally, wanted: &Image) -> Result<UnbiasedError, Failure> {
    let error = tally.error_against(wanted).map_err(Failure::refused)?;
    let m = metrics::compare(&tally.image(), wanted).map_err(Failure::refused)?;
    console::text(&text::tally::judgement(wanted, &m, error));
    Ok(error)
}

/// Fails if the error exceeds a limit that the user set.
pub(crate) fn demand(error: Option<UnbiasedError>, limit: Option<f64>) -> Result<(), Failure> {
    error.map_or(Ok(()), |error| unless_within(limit, error.rel_rms(), "the caustic's", " by photons"))
}

/// The picture as the light that a tally should hold.
fn wanted(args: &MergeArgs, tally: &PhotonTally) -> Result<Option<Image>, Failure> {
    let Some(picture) = &args.target else { return Ok(None) };
    let settings = Settings { transfer: args.transfer, offset: Some(args.offset), ..Settings::default() };
    let own = target_light::read(picture, &target_light::options_of(&settings), &Machine)?;
    let (nx, ny) = tally.pixels();
    Ok(Some(resampled(&own.light, nx, ny)))
}

fn read(path: &Path) -> Result<Part, Failure> {
    PhotonTally::read(path).map_err(|error| match error {
        TallyError::Read { .. } => {
            Failure::Io { what: format!("{} cannot be read", path.display()), source: error.into() }
        }
        _ => Failure::refused(error),
    })
}

pub(crate) fn merge(args: &MergeArgs) -> Result<(), Failure> {
    for output in &args.output {
        IrradianceFile::of(output)?;
    }
    let inputs = args.tallies.iter().chain(&args.target).map(PathBuf::as_path);
    outputs::plan(inputs, args.output.iter().chain(&args.tally).cloned())?;
    let (tally, bench) = merged(args.tallies.iter().map(|path| Ok((path.display().to_string(), read(path)?))))?;
    if let Some(path) = &args.tally {
        tally.write(path, &bench).map_err(Failure::writing)?;
    }
    let image = tally.image();
    console::light("irradiance", &image);
    let peak = image.values.iter().copied().fold(0.0, f64::max);
    for output in &args.output {
        IrradianceFile::of(output)?.write(output, &image, peak)?;
    }
    say!("{} tallies", args.tallies.len());
    console::text(&text::tally::photons(&tally));
    let error = wanted(args, &tally)?.map(|wanted| judge_tally(&tally, &wanted)).transpose()?;
    console::result(document::Result::Tally(tally_document(&tally, error)));
    demand(error, args.max_error)
}
