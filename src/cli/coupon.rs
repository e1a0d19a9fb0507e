//! `glasswarp coupon`: a piece of glass that tells of a bench what a design for it has to know.

use super::{
    console::{self, say},
    machine::{has_extension, read_mesh},
    outcome::with_flags,
    outputs,
    progress::TerminalProgress,
    report_files,
};
use crate::{
    export::{self, Format, write_atomically},
    fabricate::{Cutter, Direction, Machining, Pass, Post},
    failure::Failure,
    record::document,
    report::{pages::coupon::CouponPage, text},
    solid::{Shape, Stock},
    spec::{Feed, Length, OriginName, Settings},
    study::{
        coupon::{Coupon, CouponPlan, SeenCoupon},
        material::ior_of,
    },
};
use std::{
    io::Write as _,
    path::{Path, PathBuf},
};

#[derive(clap::Args)]
pub(crate) struct CouponArgs {
    /// Where to: the block (.stl, .obj, .glb, .step, .3mf, .ply), the program of its finishing pass
    /// (.ngc), the page to read it by (.html). May be given several times [default: coupon.stl,
    /// coupon.step and coupon.html]. Without a page, one is written beside the first file
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    /// The finishing cutter, round: ball:d6mm (its diameter) or bull:d12mm,r1mm
    #[arg(long, value_name = "CUTTER", default_value = "ball:d6mm")]
    cutter: Cutter,

    /// The glass by name (`glasswarp materials`) [default: pmma]
    #[arg(long, value_name = "NAME", conflicts_with = "ior")]
    material: Option<String>,

    /// The refractive index that the glass is believed to have: where the light lies on the sheet
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    ior: Option<f64>,

    /// From the flat face of the coupon to the sheet of paper on which it is read
    #[arg(long, value_name = "LENGTH", default_value = "1m", allow_hyphen_values = true)]
    distance: Length,

    /// From the lamp to the flat face of the coupon
    #[arg(long, value_name = "LENGTH", default_value = "3m", allow_hyphen_values = true)]
    lamp_distance: Length,

    /// Diameter of the part of the lamp that shines
    #[arg(long, value_name = "LENGTH", default_value = "3mm", allow_hyphen_values = true)]
    lamp_diameter: Length,

    /// Thickness of the sheet of glass [default: the thinnest standard sheet that leaves 3 mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    thickness: Option<Length>,

    /// Where the coordinates of all files are counted from [default: exit]
    #[arg(long, value_name = "PLACE")]
    origin: Option<OriginName>,

    /// The program's step from row to row
    #[arg(long, value_name = "LENGTH", default_value = "0.1mm", allow_hyphen_values = true)]
    step_over: Length,

    /// The program's direction of rows: x, y or an angle such as 45deg. The ladder is read after
    /// rows along x only
    #[arg(long, value_name = "DIRECTION", default_value = "x", allow_hyphen_values = true)]
    direction: Direction,

    /// What the program leaves on the face, along its normal: 0 for finishing
    #[arg(long, value_name = "LENGTH", default_value = "0mm", allow_hyphen_values = true)]
    allowance: Length,

    /// The program's feed
    #[arg(long, value_name = "FEED", default_value = "1000mm/min", allow_hyphen_values = true)]
    feed: Feed,

    /// The program's speed of the spindle, per minute
    #[arg(long, value_name = "SPEED", default_value_t = 18_000.0, allow_hyphen_values = true)]
    spindle: f64,

    /// How far above the stock the program goes between cuts
    #[arg(long, value_name = "LENGTH", default_value = "5mm", allow_hyphen_values = true)]
    safe_height: Length,
}

/// How far strokes lie off the face at most, mm: its lenses are coarse, and it is read by eye.
const CHORD_MM: f64 = 1e-5;

pub(crate) fn run(args: &CouponArgs) -> Result<(), Failure> {
    let (files, page) = files(args)?;
    outputs::plan([], files.iter().cloned().chain([page.clone()]))?;
    let settings = Settings { material: args.material.clone(), ior: args.ior, ..Settings::default() };
    let plan = CouponPlan {
        ior: ior_of(&settings)?,
        distance_mm: args.distance.mm,
        lamp_mm: args.lamp_distance.mm,
        lamp_diameter_mm: args.lamp_diameter.mm,
        cutter: args.cutter,
        stock: args.thickness.map_or_else(Stock::thinnest_sheet, |thickness| Stock::of_thickness(thickness.mm)),
    };
    let shape = Shape { origin: args.origin.map_or_else(Default::default, Into::into), ..Shape::default() };
    let pass = Pass {
        cutter: args.cutter,
        step_over_mm: args.step_over.mm,
        direction: args.direction,
        allowance_mm: args.allowance.mm,
    };
    let machining = Machining {
        feed_mm_per_min: args.feed.mm_per_minute,
        spindle_per_min: args.spindle,
        safe_mm: args.safe_height.mm,
        chord_mm: CHORD_MM,
        arcs: false,
        post: Post::LinuxCnc,
    };
    machining.check().map_err(Failure::refused)?;
    let progress = TerminalProgress::new();
    let coupon = Coupon::of(plan, shape)?;
    coupon.check(&pass)?;
    for file in &files {
        if is_program(file) {
            write_program(file, &coupon, pass, machining)?;
        } else {
            export::export(file, &coupon.solid, &coupon.export_design()).map_err(Failure::exporting)?;
        }
    }
    // What is shown and read is the light of the file, where there is one.
    let found = files.iter().find(|file| !is_program(file)).map(|file| read_mesh(file)).transpose()?;
    let seen = SeenCoupon::all(&coupon, found, pass, &progress)?;
    progress.finish();
    let minutes = pass.cost(&coupon.surface().contour()).minutes(args.feed.mm_per_minute);
    let sheet = CouponPage { coupon: &coupon, seen: &seen, pass, command: report_files::command() };
    report_files::write(&page, &sheet.html())?;
    let written: Vec<PathBuf> = files.into_iter().chain([page]).collect();
    console::text(&text::coupon::coupon(&coupon, &seen, &written));
    if written.iter().any(|file| is_program(file)) {
        say!("  program        {minutes:.0} min at {}, after roughing", args.feed);
    }
    console::result(document::Result::Coupon(Box::new(coupon.document(&seen, document::texts(&written)))));
    if args.direction.unit().y != 0.0 {
        console::warn(with_flags(&format!(
            "after rows along {} the ladder cannot be read, and says nothing of the polish: `direction` x",
            args.direction
        )));
    }
    Ok(())
}

/// The files to write, and the page beside them.
fn files(args: &CouponArgs) -> Result<(Vec<PathBuf>, PathBuf), Failure> {
    let default = || ["coupon.stl", "coupon.step"].map(PathBuf::from).to_vec();
    let outputs = if args.output.is_empty() { default() } else { args.output.clone() };
    let is_page = |file: &PathBuf| has_extension(file, "html") || has_extension(file, "htm");
    let (mut pages, files): (Vec<PathBuf>, Vec<PathBuf>) = outputs.into_iter().partition(is_page);
    for file in files.iter().filter(|file| !is_program(file)) {
        Format::from_path(file).map_err(|error| {
            Failure::Usage(format!("{error}; the program of a coupon as .ngc, and its page as .html"))
        })?;
    }
    if pages.len() > 1 {
        return Err(Failure::Usage("a coupon has one page (.html)".into()));
    }
    let page = pages.pop().unwrap_or_else(|| files[0].with_extension("html"));
    Ok((files, page))
}

fn is_program(file: &Path) -> bool {
    has_extension(file, "ngc")
}

fn write_program(file: &Path, coupon: &Coupon, pass: Pass, machining: Machining) -> Result<(), Failure> {
    let mut program = Vec::new();
    coupon.program(pass, machining).write(&mut program, "test coupon", &coupon.about()).map_err(Failure::refused)?;
    write_atomically(file, |out| out.write_all(&program)).map_err(Failure::writing)
}
