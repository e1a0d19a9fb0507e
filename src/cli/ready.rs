//! `glasswarp ready`: check, milling, faults of the bench and the real light at once, and one sheet
//! for maker and shop.

use super::{
    console::{self, say},
    machine::{Machine, has_extension},
    outcome::with_flags,
    outputs,
    progress::TerminalProgress,
    report_files::{self, command, file_record},
    side_files::{self, open_workpiece, path_beside, stem},
};
use crate::{
    failure::Failure,
    record::document,
    report::{ReadyPage, exposure_of},
    spec::{Angle, Feed, Length, RowsArgs, SourceName},
    study::{
        check::{FaceForm, Shop},
        placement::Placing,
        ready::{Question, ReadyStudy},
        verdict::Answer,
    },
    surface::Polish,
};
use glasswarp_verify::load;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct ReadyArgs {
    /// The block as it will be sent (as 'glasswarp verify' reads it), or its side file (.toml), whose
    /// first file is taken
    block: PathBuf,

    /// The side file with the bench [default: beside the block, with the extension .toml]
    #[arg(long, value_name = "FILE")]
    bench: Option<PathBuf>,

    #[command(flatten)]
    rows: RowsArgs,

    /// The polish after it: the standard deviation of the Gaussian that blurs heights ('glasswarp
    /// coupon' makes a piece that tells it)
    #[arg(long, value_name = "LENGTH", default_value = "0mm", allow_hyphen_values = true)]
    polish: Length,

    /// Size of the light in which it will be seen: sun, 0.5deg, 5mm, or none for a laser [default:
    /// that of the design]
    #[arg(long, alias = "light", value_name = "SIZE", allow_hyphen_values = true)]
    source_size: Option<SourceName>,

    /// Feed of the cutter: gives the time
    #[arg(long, value_name = "FEED", default_value = "2000mm/min", allow_hyphen_values = true)]
    feed: Feed,

    /// Steepest slope that the shop cuts
    #[arg(long, value_name = "ANGLE", default_value = "45deg", allow_hyphen_values = true)]
    max_slope: Angle,

    /// Least thickness that the block may have
    #[arg(long, value_name = "LENGTH", default_value = "3mm")]
    min_thickness: Length,

    /// Pixels across at which to judge, at most the picture's own
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(8..=8192))]
    pixels: u32,

    /// The sheet to print (.html) [default: beside the block, .ready.html]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(crate) fn run(args: &ReadyArgs) -> Result<(), Failure> {
    let block = block_of(args)?;
    let sheet = args.output.clone().unwrap_or_else(|| block.with_extension("ready.html"));
    if !(has_extension(&sheet, "html") || has_extension(&sheet, "htm")) {
        return Err(Failure::Usage(format!("{}: the sheet is a page of HTML, name it .html", sheet.display())));
    }
    let inputs = side_files::inputs(&block, args.bench.as_deref())?;
    outputs::plan(inputs.iter().map(PathBuf::as_path), [sheet.clone()])?;
    let progress = TerminalProgress::new();
    let side = side_files::of_block(&block, args.bench.as_deref())?;
    let polish = Polish::new(args.polish.mm).map_err(Failure::refused)?;
    let usual = Question::of(args.rows.pass(), polish, &side);
    let question = Question {
        shop: Shop { steepest_degrees: args.max_slope.deg, least_thickness_mm: args.min_thickness.mm, ..usual.shop },
        source: args.source_size,
        ..usual
    };
    let form = FaceForm::of_file(load::Format::from_path(&block).map_err(Failure::refused)?);
    let piece =
        open_workpiece(&block, args.bench.as_deref(), Placing::Righted, (None, None), args.pixels as usize, &progress)?;
    let study = ReadyStudy::of(&question, &piece, form, &Machine, &progress);
    progress.finish();
    let study = study?;
    let shop = &question.shop;
    let beside = args.bench.clone().unwrap_or_else(|| path_beside(&block));
    let page = ReadyPage {
        title: stem(&block),
        study: &study,
        piece: &piece,
        shop,
        feed: args.feed,
        exposure: exposure_of(&piece.perceived, &piece),
        files: [&block, &beside].into_iter().map(|file| file_record(file, None)).collect::<Result<_, _>>()?,
        command: command(),
        in_flags: with_flags,
    };
    report_files::write(&sheet, &page.html())?;
    print(&study, &sheet);
    console::result(document::Result::Ready(document::Ready {
        file: block.display().to_string(),
        verdict: study.verdict.document(with_flags),
        rel_rms: document::finite(study.seen.0.metrics.rel_rms),
        ssim: document::finite(study.seen.0.metrics.ssim),
        minutes: study.mill.cost.minutes(args.feed.mm_per_minute),
        sheet_mm: study.order.sheet_mm,
        sawn_mm: study.order.sawn_mm.to_array(),
        files: vec![sheet.display().to_string()],
    }));
    match study.verdict.answer() {
        Answer::No => Err(Failure::BelowThreshold(format!("{} will not work like this", block.display()))),
        Answer::Yes | Answer::But | Answer::NotAsked => Ok(()),
    }
}

/// The block that is named, or the first file that a side file knows and that is there.
fn block_of(args: &ReadyArgs) -> Result<PathBuf, Failure> {
    if !has_extension(&args.block, "toml") {
        return Ok(args.block.clone());
    }
    let side = side_files::read(&args.block)?;
    let folder = args.block.parent().unwrap_or(Path::new(""));
    let is_block = |path: &PathBuf| load::Format::from_path(path).is_ok() && path.exists();
    side.files.keys().map(|name| folder.join(name)).find(is_block).ok_or_else(|| {
        Failure::Usage(format!("{}: none of the files of this block is beside it", args.block.display()))
    })
}

fn print(study: &ReadyStudy, sheet: &Path) {
    console::verdict(&study.verdict);
    for concern in study.verdict.concerns() {
        say!("  {:<13}  {:<20} {}", concern.answer.word(), concern.question, with_flags(&concern.says));
    }
    say!("  order    {}", study.order.in_words());
    say!("  sheet    {}, to print for maker and shop", sheet.display());
}
