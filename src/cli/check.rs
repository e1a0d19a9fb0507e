//! `glasswarp check`: whether a block can be made, a verdict per line.

use super::{
    bench::{exit_face_in_words, exit_face_of, scene_of},
    budget::double_precision,
    console::{self, say},
    error::Failure,
    json, judge,
    length::Length,
    otherwise::{seen_otherwise, thrown_mm},
    outputs,
    placed::{self, Placing},
    plan::Plan,
    progress::TerminalProgress,
    settings::Settings,
    side_file::{self, SideFile},
    tolerance::{self, ToleranceArgs},
    workpiece::{Workpiece, surface_of},
};
use anstyle::AnsiColor;
use glam::DVec2;
use glasswarp::{
    fabricate::{Cutter, FaceShape, Pass, Scallop},
    report::{self, Captioned},
    solid::STANDARD_SHEETS_MM,
    surface::{HeightField, Polish},
};
use glasswarp_verify::{Block, End, Optics, Scene, Tracer, Window};
use rayon::prelude::*;
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
    block: Block,
    scene: Scene,
    /// Whether nothing is known of the light, which then is taken to be straight.
    assumed: bool,
}

/// A line of the verdict.
struct Line {
    passed: bool,
    what: &'static str,
    says: String,
}

pub(crate) fn run(args: &CheckArgs) -> Result<(), Failure> {
    if let Some(output) = &args.output
        && !output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
    {
        return Err(Failure::Usage(format!("{}: pictures of a check are written as .png", output.display())));
    }
    let inputs = side_file::inputs(&args.block, args.bench.as_deref())?;
    outputs::plan(inputs.iter().map(PathBuf::as_path), args.output.clone())?;
    args.tolerance.check()?;
    let polish = Polish::new(args.polish.mm).map_err(Failure::refused)?;
    let subject = Subject::open(args)?;
    let pass = Pass::finishing(args.cutter, args.step_over.mm);
    pass.check(subject.surface.extent()).map_err(Failure::refused)?;
    // Opened before anything is said, so that what is missing is told first.
    let piece = args
        .tolerance
        .tolerance
        .then(|| {
            let otherwise = (args.ior, args.distance.map(|length| length.mm));
            Workpiece::open(&args.block, args.bench.as_deref(), otherwise, args.pixels as usize)
        })
        .transpose()?;
    let shape = FaceShape::of(&subject.surface);
    let lines = lines(args, &subject, &shape, &pass, &polish)?;
    let extent = subject.surface.extent();
    say!(
        "{}: {:.2} x {:.2} mm, {}, receiver at {} mm{}; {}, rows {} mm apart",
        args.block.display(),
        extent.width_mm,
        extent.height_mm,
        exit_face_in_words(exit_face_of(&subject.scene)),
        subject.scene.distance_mm,
        if subject.assumed { ", straight light assumed without a side file" } else { "" },
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
        let distance_mm = args.distance.map(|length| length.mm);
        let scene = match (&side, args.ior, distance_mm) {
            (Some(side), ior, distance_mm) => {
                seen_otherwise(scene_of(&side.bench, &side.design)?, Some(&block), ior, distance_mm)?
            }
            (None, Some(ior), Some(distance_mm)) => {
                let window = Window { size_mm: block.size_mm(), centre_mm: DVec2::ZERO, nx: 1, ny: 1 };
                Scene::new(ior, distance_mm, window)
            }
            (None, None, _) => return Err(missing("--ior")),
            (None, _, None) => return Err(missing("--distance")),
        };
        let (surface, thinnest_mm) = (surface_of(&block)?, block.min_thickness_mm());
        Ok(Self { surface, thinnest_mm, block, scene, assumed: side.is_none() })
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
        let otherwise = [("--ior", args.ior.is_some()), ("--distance", args.distance.is_some())];
        if let Some((flag, _)) = otherwise.iter().find(|(_, given)| *given) {
            return Err(Failure::Usage(format!("{flag} is told by the design file here: change it there")));
        }
        let judge::Subject::Block(found) = double_precision(&block)? else {
            return Err(Failure::Usage("the design makes no block".into()));
        };
        Ok(Self {
            thinnest_mm: block.solid.thinnest_mm(),
            surface: block.surface,
            block: *found,
            scene: plan.scene()?,
            assumed: false,
        })
    }
}

fn place(at: DVec2) -> String {
    format!("x = {:.1} mm, y = {:.1} mm", at.x, at.y)
}

fn lines(
    args: &CheckArgs,
    subject: &Subject,
    shape: &FaceShape,
    pass: &Pass,
    polish: &Polish,
) -> Result<Vec<Line>, Failure> {
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
    let (leaves, says) = light(subject)?;
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
    // On any bench light is thrown as far as the slope is great, as long as that is small.
    let thrown = |slope: f64, along: &[DVec2]| thrown_mm(&subject.block, &subject.scene, slope, along);
    let across = [pass.direction.unit().perp()];
    let per_slope = scallop.map_or(Ok(0.0), |raw| Ok(thrown(raw.slope, &across)? / raw.slope))?;
    let spread = |scallop: &Scallop| per_slope * scallop.slope;
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

    let facets_mm = thrown(0.5 * shape.facet_step(), &[DVec2::X, DVec2::Y])?;
    say(
        "facets",
        facets_mm <= blur_mm,
        format!(
            "slope steps of up to {:.5} between flat triangles throw light {facets_mm:.3} mm to either side (smooth if the shop cuts the smooth face)",
            shape.facet_step()
        ),
    );
    Ok(lines)
}

/// Whether all light leaves the face towards the receiver, by the light at every node.
fn light(subject: &Subject) -> Result<(bool, String), Failure> {
    let block = &subject.block;
    let tracer = Tracer::for_block(block, &subject.scene).map_err(Failure::refused)?;
    let ((nx, ny), (lower, upper)) = (block.nodes(), tracer.aperture_mm());
    let node = |k: usize| {
        let part = DVec2::new((k % nx) as f64 / (nx - 1) as f64, (k / nx) as f64 / (ny - 1) as f64);
        lower + part * (upper - lower)
    };
    let none = (0.0_f64, 0_u32, 0_u32, 0_u32);
    let (steepest, lit, reflected, astray) = (0..nx * ny)
        .into_par_iter()
        .filter(|&k| block.covers(node(k)))
        .map(|k| {
            let end = tracer.path_at(node(k)).end;
            let inside = u32::from(end == End::TotallyReflected);
            let aside = u32::from(!matches!(end, End::TotallyReflected | End::Receiver(_)));
            (tracer.incidence_at(node(k)).unwrap_or(0.0), 1, inside, aside)
        })
        .reduce(|| none, |a, b| (a.0.max(b.0), a.1 + b.1, a.2 + b.2, a.3 + b.3));
    let share = |part: u32| 100.0 * f64::from(part) / f64::from(lit.max(1));
    let steepest = steepest.to_degrees();
    let Optics::Refracts { ior } = subject.scene.optics else {
        return Ok(match astray {
            0 => (
                true,
                format!("all of it is reflected to the receiver's side, at up to {steepest:.2} degrees to the normal"),
            ),
            _ => (false, format!("{:.2} % of the face is in the shadow or throws light at itself", share(astray))),
        });
    };
    let critical = (1.0 / ior).asin().to_degrees();
    Ok(if reflected == 0 {
        let says = "all of it leaves: it comes at up to";
        (true, format!("{says} {steepest:.2} degrees to the normal, total reflection begins at {critical:.2} degrees"))
    } else {
        let share = share(reflected);
        (false, format!("is totally reflected on {share:.2} % of the face, beyond {critical:.2} degrees to the normal"))
    })
}

/// What would let the scallops pass.
fn remedy(raw: &Scallop, blur_mm: f64, spread: &dyn Fn(&Scallop) -> f64) -> String {
    let step_over = raw.step_over_mm * blur_mm / spread(raw);
    let sigma = (1..=200).map(|k| 0.005 * f64::from(k)).find(|sigma| spread(&raw.polished(*sigma)) <= blur_mm);
    let polish = sigma.map_or(String::new(), |sigma| format!(", or a polish of {sigma:.3} mm"));
    format!("; a step-over of {step_over:.3} mm would do{polish}")
}

/// Where the face is hollow, steep and thin.
fn maps(args: &CheckArgs, subject: &Subject, shape: &FaceShape) -> Vec<Captioned> {
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
