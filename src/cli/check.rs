//! `glasswarp check`: whether a block can be made, a verdict per line.

use super::{
    bench::exit_face_in_words,
    console::{self, say},
    error::Failure,
    json,
    length::Length,
    placed::{self, Placing},
    plan::Plan,
    progress::TerminalProgress,
    settings::Settings,
    side_file::{self, SideFile},
    tolerance::{self, ToleranceArgs},
    workpiece::{Workpiece, surface_of},
};
use anstyle::AnsiColor;
use glam::{DVec2, DVec3};
use glasswarp::{
    bench::{Bench, ExitFace},
    export,
    fabricate::{Cutter, Pass, Scallop, Shape},
    grid::Extent,
    report::{self, Captioned},
    solid::STANDARD_SHEETS_MM,
    surface::{HeightField, Polish},
};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct CheckArgs {
    /// The block (as 'glasswarp verify' reads it), or a design file (.toml) whose block is checked before it is written
    block: PathBuf,

    /// The side file with the bench [default: beside the block, with the extension .toml]
    #[arg(long, value_name = "FILE")]
    bench: Option<PathBuf>,

    /// Refractive index [default: the side file's]
    #[arg(long, value_name = "N")]
    ior: Option<f64>,

    /// From the mean exit plane to the receiver [default: the side file's]
    #[arg(long, value_name = "LENGTH")]
    distance: Option<Length>,

    /// The finishing cutter and its radii: ball:3mm, flat:6mm or bull:6mm,1mm
    #[arg(long, value_name = "CUTTER", default_value = "ball:3mm")]
    cutter: Cutter,

    /// From row to row
    #[arg(long, value_name = "LENGTH", default_value = "0.1mm", allow_hyphen_values = true)]
    step_over: Length,

    /// The polish after it: the standard deviation of the Gaussian that blurs heights
    #[arg(long, value_name = "LENGTH", default_value = "0mm", allow_hyphen_values = true)]
    polish: Length,

    /// Steepest slope that the shop cuts, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 45.0)]
    max_slope: f64,

    /// Furthest that scallops or facets may throw light from its place on the receiver [default: 0.5 % of the block's width]
    #[arg(long, value_name = "LENGTH")]
    max_blur: Option<Length>,

    /// Thickness of the stock [default: the thinnest standard sheet]
    #[arg(long, value_name = "LENGTH")]
    thickness: Option<Length>,

    /// Least thickness that the block may have
    #[arg(long, value_name = "LENGTH", default_value = "3mm")]
    min_thickness: Length,

    #[command(flatten)]
    tolerance: ToleranceArgs,

    /// Pixels across at which tolerances are judged, at most the picture's own
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(8..=8192))]
    pixels: u32,

    /// Write pictures of where: hollows, slopes, thickness, and those of the tolerances (.png)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// What is checked, and where it stands.
struct Subject {
    surface: HeightField,
    thinnest_mm: f64,
    exit_face: ExitFace,
    /// Angle of the light to the axis where it meets the exit face; from a lamp, on its axis, degrees.
    incidence_deg: f64,
    distance_mm: f64,
}

/// A line of the verdict.
struct Line {
    passed: bool,
    what: &'static str,
    says: String,
}

pub(crate) fn run(args: &CheckArgs) -> Result<(), Failure> {
    if let Some(output) = &args.output {
        if !output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            return Err(Failure::Usage(format!("{}: pictures of a check are written as .png", output.display())));
        }
        export::probe(output).map_err(Failure::writing)?;
    }
    args.tolerance.check()?;
    let polish = Polish::new(args.polish.mm).map_err(Failure::refused)?;
    let subject = Subject::open(args)?;
    let pass = Pass::finishing(args.cutter, args.step_over.mm);
    pass.check(subject.surface.extent()).map_err(Failure::refused)?;
    // Opened before anything is said, so that what is missing is told first.
    let piece = args
        .tolerance
        .tolerance
        .then(|| Workpiece::open(&args.block, args.bench.as_deref(), args.pixels as usize))
        .transpose()?;
    let shape = Shape::of(&subject.surface);
    let lines = lines(args, &subject, &shape, &pass, &polish);
    let extent = subject.surface.extent();
    say!(
        "{}: {:.2} x {:.2} mm, {}, receiver at {} mm; {}, rows {} mm apart",
        args.block.display(),
        extent.width_mm,
        extent.height_mm,
        exit_face_in_words(subject.exit_face),
        subject.distance_mm,
        args.cutter,
        args.step_over.mm
    );
    for Line { passed, what, says } in &lines {
        let (word, colour) = if *passed { ("ok  ", AnsiColor::Green) } else { ("FAIL", AnsiColor::Red) };
        say!("  {}  {what:<11} {says}", console::coloured(word, colour));
    }
    let mut pictures = maps(args, &subject, &shape);
    let traced = piece.as_ref().map(|piece| tolerance::run(&args.tolerance, piece)).transpose();
    if let Ok(Some((traced, _))) = &traced {
        pictures.extend(traced.iter().cloned());
    }
    let failed: Vec<&str> = lines.iter().filter(|line| !line.passed).map(|line| line.what).collect();
    console::result(json::Result::Check(json::Check {
        file: args.block.display().to_string(),
        makeable: failed.is_empty(),
        lines: lines
            .iter()
            .map(|Line { passed, what, says }| json::CheckLine {
                what: (*what).to_owned(),
                passed: *passed,
                says: says.clone(),
            })
            .collect(),
        tolerances: traced.as_ref().ok().and_then(|traced| traced.as_ref()).map(|(_, found)| found.clone()),
    }));
    if let Some(output) = &args.output {
        report::write_png(output, &report::contact_sheet(&pictures, 3, 420)).map_err(Failure::writing)?;
    }
    traced?;
    if failed.is_empty() {
        return Ok(());
    }
    Err(Failure::FellShort(format!("{} cannot be made like this: {}", args.block.display(), failed.join(", "))))
}

impl Subject {
    fn open(args: &CheckArgs) -> Result<Self, Failure> {
        if args.block.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            return Self::design(args);
        }
        let side = SideFile::find(&args.block, args.bench.as_deref())?;
        let (_, block, warnings) = placed::open_block(&args.block, side.as_ref(), Placing::RIGHTED)?;
        if !args.tolerance.tolerance {
            warnings.into_iter().for_each(console::warn); // Else the block is opened once more.
        }
        let missing = |flag: &str| side_file::missing(&args.block, &format!(", or give {flag}"));
        let bench = side.as_ref().map(|side| &side.bench);
        let exit_face = match (bench, args.ior) {
            (_, Some(ior)) => ExitFace::Refracts { ior },
            (Some(bench), None) => bench.exit_face(),
            (None, None) => return Err(missing("--ior")),
        };
        let distance_mm = args.distance.map(|length| length.mm).or(bench.map(|bench| bench.distance_mm));
        let distance_mm = distance_mm.ok_or_else(|| missing("--distance"))?;
        Bench::new(Extent::new(100.0, 100.0), distance_mm, exit_face).map_err(Failure::refused)?;
        let incidence_deg = bench.map_or(0.0, |bench| {
            (DVec3::from(bench.light_direction).truncate().length() / exit_face.ior()).min(1.0).asin().to_degrees()
        });
        let (surface, thinnest_mm) = (surface_of(&block)?, block.min_thickness_mm());
        Ok(Self { surface, thinnest_mm, exit_face, incidence_deg, distance_mm })
    }

    fn design(args: &CheckArgs) -> Result<Self, Failure> {
        if args.tolerance.tolerance {
            return Err(Failure::Usage(
                "tolerances are those of a block: write one with 'glasswarp design' first".into(),
            ));
        }
        let settings = Settings::read(&args.block)?;
        let plan = Plan::new(settings.named_picture(&args.block)?, settings)?;
        let progress = TerminalProgress::new();
        let block = plan.design(&progress);
        progress.finish();
        let block = block?;
        Ok(Self {
            thinnest_mm: block.solid.thinnest_mm(),
            surface: block.surface,
            exit_face: plan.bench.exit_face(),
            incidence_deg: plan.bench.light_direction().truncate().length().asin().to_degrees(),
            distance_mm: plan.bench.distance_mm(),
        })
    }
}

fn place(at: DVec2) -> String {
    format!("x = {:.1} mm, y = {:.1} mm", at.x, at.y)
}

fn lines(args: &CheckArgs, subject: &Subject, shape: &Shape, pass: &Pass, polish: &Polish) -> Vec<Line> {
    let extent = subject.surface.extent();
    let blur_mm = args.max_blur.map_or(0.005 * extent.width_mm, |length| length.mm);
    let mut lines = Vec::new();
    let mut say = |what, passed, says: String| lines.push(Line { passed, what, says });

    let (needed, sharpest) = (args.cutter.corner_mm(), shape.sharpest());
    let reaches = if args.cutter.corner_mm() == 0.0 {
        format!(
            "a flat cutter leaves steps on every slope, of up to {:.1} um",
            1e3 * shape.steepest().1 * pass.step_over_mm
        )
    } else {
        let share = 100.0 * shape.sharper_than(needed);
        let unreached = if share > 0.0 { format!("; {share:.2} % of the face is sharper") } else { String::new() };
        format!("the cutter's {needed} mm fit{unreached}")
    };
    let hollow = if sharpest.radius_mm.is_finite() {
        format!("least concave radius {:.2} mm at {}", sharpest.radius_mm, place(sharpest.at))
    } else {
        "the face bulges everywhere".into()
    };
    let fits = args.cutter.corner_mm() > 0.0 && sharpest.radius_mm >= needed;
    say(
        "hollows",
        fits,
        if fits {
            format!("{hollow}: {reaches}")
        } else {
            format!("{hollow}, cutter {}: {}", args.cutter, reaches.replace("fit;", "do not fit everywhere;"))
        },
    );

    let (at, slope) = shape.steepest();
    let degrees = slope.atan().to_degrees();
    say(
        "slope",
        degrees <= args.max_slope,
        format!("at most {degrees:.2} degrees, at {} (--max-slope {})", place(at), args.max_slope),
    );
    let (leaves, says) = match subject.exit_face {
        ExitFace::Reflects => (true, "all of it is reflected to the receiver's side".to_owned()),
        ExitFace::Refracts { ior } => {
            let critical = (1.0 / ior).asin().to_degrees() - subject.incidence_deg;
            let leaves = degrees < critical;
            let says = if leaves {
                format!("all of it leaves: total reflection begins at {critical:.2} degrees")
            } else if subject.incidence_deg > 0.0 {
                format!("may be totally reflected where the slope exceeds {critical:.2} degrees against the light")
            } else {
                format!("is totally reflected where the slope exceeds {critical:.2} degrees")
            };
            (leaves, says)
        }
    };
    say("light", leaves, says);

    let relief = subject.surface.relief_mm();
    let greatest = subject.thinnest_mm + relief;
    let sheet = STANDARD_SHEETS_MM.into_iter().find(|sheet| *sheet >= greatest - 1e-6);
    let stock = args.thickness.map(|length| length.mm).or(sheet);
    say("relief", stock.is_some_and(|stock| relief < stock), format!("{relief:.3} mm from peak to valley"));
    let least = args.min_thickness.mm;
    let stock_says = stock.map_or("no standard sheet holds it".into(), |stock| format!("stock {stock} mm"));
    let holds = stock.is_some_and(|stock| greatest <= stock + 1e-6) && subject.thinnest_mm >= least - 1e-6;
    say(
        "thickness",
        holds,
        format!("{:.3} to {greatest:.3} mm; {stock_says}, at least {least} mm shall stay", subject.thinnest_mm),
    );

    let scallop = Scallop::of(args.cutter, pass.step_over_mm);
    let spread = |scallop: &Scallop| scallop.spread_mm(subject.exit_face, subject.distance_mm);
    match scallop {
        Some(raw) => {
            let left = raw.polished(polish.sigma_mm());
            let passed = spread(&left) <= blur_mm;
            let polished = if polish.sigma_mm() > 0.0 {
                format!(
                    "; polished with sigma {} mm {:.4} um and {:.3} mm",
                    polish.sigma_mm(),
                    1e3 * left.height_mm,
                    spread(&left)
                )
            } else {
                String::new()
            };
            let remedy = if passed { String::new() } else { remedy(&raw, blur_mm, &spread) };
            say(
                "scallops",
                passed,
                format!(
                    "{:.3} um high, slope {:.5}: light is thrown {:.3} mm to either side{polished} (--max-blur {blur_mm} mm){remedy}",
                    1e3 * raw.height_mm,
                    raw.slope,
                    spread(&raw)
                ),
            );
        }
        None => say("scallops", false, "this cutter leaves steps or walls between its rows at this step-over".into()),
    }

    let facet = Scallop { step_over_mm: 0.0, height_mm: 0.0, slope: 0.5 * shape.facet_step() };
    say(
        "facets",
        spread(&facet) <= blur_mm,
        format!(
            "slope steps of up to {:.5} between flat triangles throw light {:.3} mm to either side (smooth if the shop cuts the smooth face)",
            shape.facet_step(),
            spread(&facet)
        ),
    );
    lines
}

/// What would let the scallops pass.
fn remedy(raw: &Scallop, blur_mm: f64, spread: &dyn Fn(&Scallop) -> f64) -> String {
    let step_over = raw.step_over_mm * blur_mm / spread(raw);
    let sigma = (1..=200).map(|k| 0.005 * f64::from(k)).find(|sigma| spread(&raw.polished(*sigma)) <= blur_mm);
    let polish = sigma.map_or(String::new(), |sigma| format!(", or a polish of {sigma:.3} mm"));
    format!("; a step-over of {step_over:.3} mm would do{polish}")
}

/// Where the face is hollow, steep and thin.
fn maps(args: &CheckArgs, subject: &Subject, shape: &Shape) -> Vec<Captioned> {
    const WIDTH: u32 = 420;
    let extent = subject.surface.extent();
    let (sharpest, (steep_at, steepest)) = (shape.sharpest(), shape.steepest());
    let least = args.cutter.corner_mm().max(1e-3);
    let (low, high) = subject.surface.range_mm();
    let map = |field, range, at| report::map(field, extent, range, at, WIDTH);
    vec![
        Captioned {
            caption: format!("hollows: black at {least} mm, sharpest {:.2} mm", sharpest.radius_mm),
            picture: map(shape.hollow_per_mm(), (0.0, 1.0 / least), Some(sharpest.at)),
        },
        Captioned {
            caption: format!("slope: black at {:.2} degrees", steepest.atan().to_degrees()),
            picture: map(shape.slope(), (0.0, steepest.max(1e-9)), Some(steep_at)),
        },
        Captioned {
            caption: format!(
                "thickness: white {:.3} mm, black {:.3} mm",
                subject.thinnest_mm + high - low,
                subject.thinnest_mm
            ),
            picture: map(&subject.surface.heights_within(high), (high, low), None),
        },
    ]
}
