//! `glasswarp check`: whether a block can be made, and what tolerances do to its picture.

use super::{
    console::{self, say},
    machine::{Machine, has_extension},
    outcome::with_flags,
    outputs,
    progress::TerminalProgress,
    side_files::{self, open_block, open_workpiece},
    verify::PlacingArgs,
};
use crate::{
    failure::Failure,
    record::document,
    report::{
        self,
        pages::{common::exposure_of, maps},
        text,
    },
    spec::{self, Angle, CutterArgs, Length, ToleranceArgs},
    study::{
        check::{CheckLine, CheckStudy, FaceForm, Makeable, Shop},
        design::Plan,
        tolerance::{ToleranceStudy, Tolerances},
        verdict::{Answer, Verdict},
    },
    surface::Polish,
};
use anstyle::AnsiColor;
use glasswarp_verify::load;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct CheckArgs {
    /// The block (as 'glasswarp verify' reads it), or a design file (.toml) whose block is checked
    /// before it is written
    block: PathBuf,

    /// The side file with the bench [default: beside the block, with the extension .toml]
    #[arg(long, value_name = "FILE")]
    bench: Option<PathBuf>,

    #[command(flatten)]
    placing: PlacingArgs,

    /// Refractive index [default: the side file's]
    #[arg(long, value_name = "N")]
    ior: Option<f64>,

    /// From the mean exit plane to the receiver [default: the side file's]
    #[arg(long, value_name = "LENGTH")]
    distance: Option<Length>,

    #[command(flatten)]
    tool: CutterArgs,

    /// The polish after it: the standard deviation of the Gaussian that blurs heights
    #[arg(long, value_name = "LENGTH", default_value = "0mm", allow_hyphen_values = true)]
    polish: Length,

    /// Steepest slope that the shop cuts
    #[arg(long, value_name = "ANGLE", default_value = "45deg", allow_hyphen_values = true)]
    max_slope: Angle,

    /// Furthest that scallops or facets may throw light from its place on the receiver [default:
    /// 0.5 % of the block's width]
    #[arg(long, value_name = "LENGTH")]
    max_blur: Option<Length>,

    /// Thickness of the sheet at hand [default: the thinnest standard sheet with --facing to spare]
    #[arg(long, value_name = "LENGTH")]
    stock: Option<Length>,

    /// What is faced off the top of a standard sheet before the face is cut
    #[arg(long, value_name = "LENGTH", default_value = "0.5mm")]
    facing: Length,

    /// Least thickness that the block may have
    #[arg(long, value_name = "LENGTH", default_value = "3mm")]
    min_thickness: Length,

    /// Pixels across at which tolerances are judged, at most the picture's own
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(8..=8192))]
    pixels: u32,

    /// Write pictures of where: hollows, slopes, thickness, and those of the tolerances (.png)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    // Last: its heading goes on for all flags that follow.
    #[command(flatten, next_help_heading = "Tolerances")]
    tolerance: ToleranceArgs,
}

pub(crate) fn run(args: &CheckArgs) -> Result<(), Failure> {
    if let Some(output) = args.output.as_ref().filter(|output| !has_extension(output, "png")) {
        return Err(Failure::Usage(format!("{}: pictures of a check are written as .png", output.display())));
    }
    let inputs = side_files::inputs(&args.block, args.bench.as_deref())?;
    outputs::plan(inputs.iter().map(PathBuf::as_path), args.output.clone())?;
    let tolerances = Tolerances::of(&args.tolerance)?;
    tolerances.check()?;
    let shop = Shop {
        cutter: args.tool.cutter,
        step_over_mm: args.tool.step_over.mm,
        polish: Polish::new(args.polish.mm).map_err(Failure::refused)?,
        steepest_degrees: args.max_slope.deg,
        most_blur_mm: args.max_blur.map(|length| length.mm),
        thickness_mm: args.stock.map(|length| length.mm),
        facing_mm: args.facing.mm,
        least_thickness_mm: args.min_thickness.mm,
    };
    let progress = TerminalProgress::new();
    let subject = open(args, &progress)?;
    // Opened before anything is said, so that what is missing is told first.
    let piece = match args.tolerance.tolerance {
        true => {
            let (bench, placing, pixels) = (args.bench.as_deref(), args.placing.placing(), args.pixels as usize);
            Some(open_workpiece(&args.block, bench, placing, changed(args), pixels, &progress)?)
        }
        false => None,
    };
    let study = CheckStudy::of(&subject, &shop)?;
    let mut verdict = Verdict::default();
    study.say(&shop, &mut verdict);
    verdict.say("picture", Answer::NotAsked, "the picture of the finished face ('glasswarp ready' asks)");
    console::verdict(&verdict);
    let name = args.block.display().to_string();
    console::text(&text::check::subject(&name, &subject, &shop));
    for CheckLine { passed, what, says } in &study.lines {
        let (word, colour) = if *passed { ("ok  ", AnsiColor::Green) } else { ("FAIL", AnsiColor::Red) };
        say!("  {}  {what:<11} {}", console::coloured(word, colour), with_flags(says));
    }
    let traced = piece.as_ref().map(|piece| ToleranceStudy::of(&tolerances, piece, &progress)).transpose();
    progress.finish();
    if let Ok(Some(traced)) = &traced {
        console::text(&text::check::tolerances(traced));
    }
    let failed = study.failed();
    console::result(document::Result::Check(document::Check {
        file: name.clone(),
        makeable: failed.is_empty(),
        verdict: verdict.document(with_flags),
        lines: study
            .lines
            .iter()
            .map(CheckLine::document)
            .map(|line| document::CheckLine { says: with_flags(&line.says), ..line })
            .collect(),
        tolerances: traced.as_ref().ok().and_then(|traced| traced.as_ref()?.document()),
    }));
    if let Some(output) = &args.output {
        let traced = traced.as_ref().ok().and_then(|traced| traced.as_ref()).filter(|traced| traced.focus.is_ok());
        let traced = traced.zip(piece.as_ref()).map(|(traced, piece)| (traced, exposure_of(&piece.ideal, piece)));
        let sheet = maps::check_sheet(args.tool.cutter, &subject, &study.shape, traced);
        report::write_png(output, &sheet).map_err(Failure::writing)?;
    }
    traced?.map_or(Ok(()), |traced| traced.focus.map(drop))?;
    if failed.is_empty() {
        return Ok(());
    }
    Err(Failure::BelowThreshold(format!("{name} cannot be made like this: {}", failed.join(", "))))
}

/// Index and distance other than those of the side file.
fn changed(args: &CheckArgs) -> (Option<f64>, Option<f64>) {
    (args.ior, args.distance.map(|length| length.mm))
}

fn open(args: &CheckArgs, progress: &TerminalProgress) -> Result<Makeable, Failure> {
    if !has_extension(&args.block, "toml") {
        let side = side_files::find(&args.block, args.bench.as_deref())?;
        let (_, block, warnings) = open_block(&args.block, side.as_ref(), args.placing.placing())?;
        if !args.tolerance.tolerance {
            warnings.into_iter().for_each(console::warn); // Else the block is opened once more.
        }
        let missing = |what: &str| side_files::missing(&args.block, &format!(", or give {what}"));
        let form = FaceForm::of_file(load::Format::from_path(&args.block).map_err(Failure::refused)?);
        return Makeable::of_block((block, form), side.as_ref(), changed(args), &Machine, missing);
    }
    if args.tolerance.tolerance {
        return Err(Failure::Usage("tolerances are those of a block: write one with 'glasswarp design' first".into()));
    }
    if args.placing.as_placed {
        return Err(Failure::Usage("--as-placed is about the file of a block, not about a design".into()));
    }
    let settings = spec::read(&args.block, &Machine)?;
    let plan = Plan::new(settings.named_picture(&args.block)?, settings, &Machine, progress)?;
    let block = plan.design(progress);
    progress.finish();
    let block = block?;
    let otherwise = [("--ior", args.ior.is_some()), ("--distance", args.distance.is_some())];
    if let Some((flag, _)) = otherwise.iter().find(|(_, given)| *given) {
        return Err(Failure::Usage(format!("{flag} is told by the design file here: change it there")));
    }
    Makeable::of_design(&plan, block)
}
