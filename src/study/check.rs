//! Whether a block can be made, a verdict per line.

use super::{
    behind,
    budget::double_precision,
    changed::{deflection_mm, scene_of_file},
    design::Plan,
    face::surface_of,
    judge,
    verdict::{Answer, Verdict},
    workpiece::{Workpiece, walls_of},
};
use crate::{
    fabricate::{Cutter, CutterShape, FaceShape, Hollow, Pass, Scallop},
    failure::Failure,
    pipeline,
    record::{SideFile, document},
    solid::Stock,
    spec::Host,
    surface::{HeightField, Polish},
};
use glam::DVec2;
use glasswarp_verify::{Block, End, Optics, Scene, Tracer, load::Format};
use rayon::prelude::*;

/// What a file says of its exit face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceForm {
    /// Flat triangles between its nodes.
    Triangles,
    /// A smooth surface (STEP).
    Smooth,
    /// Heights, between which the program of a router goes on as it likes.
    Heights,
}

impl FaceForm {
    /// That of a file.
    pub fn of_file(format: Format) -> Self {
        match format {
            Format::Step => Self::Smooth,
            Format::HeightMapPng | Format::HeightMapExr => Self::Heights,
            // A mesh, and whatever else may be read one day.
            _ => Self::Triangles,
        }
    }
}

/// What a shop can do, and what it is asked for.
pub struct Shop {
    /// The finishing cutter.
    pub cutter: Cutter,
    /// From row to row.
    pub step_over_mm: f64,
    /// The polish after it.
    pub polish: Polish,
    /// Steepest slope that it cuts.
    pub steepest_degrees: f64,
    /// Furthest that light may be thrown by scallops and facets; else 0.5 % of the block's width.
    pub most_blur_mm: Option<f64>,
    /// Of the stock; else the thinnest standard sheet that leaves what is faced off.
    pub thickness_mm: Option<f64>,
    /// What is faced off the top of a standard sheet.
    pub facing_mm: f64,
    /// That the block may have.
    pub least_thickness_mm: f64,
}

impl Shop {
    /// Steepest slope that shops usually cut.
    pub const STEEPEST_DEGREES: f64 = 45.0;
    /// Least thickness that a block may usually have.
    pub const LEAST_THICKNESS_MM: f64 = 3.0;

    /// Cutter, rows and polish in a line.
    pub fn in_words(&self) -> String {
        let polish = match self.polish.sigma_mm() {
            sigma if sigma > 0.0 => format!(", polish {sigma} mm"),
            _ => String::new(),
        };
        format!("{}, rows {} mm apart{polish}", self.cutter.in_words(), self.step_over_mm)
    }
}

/// A block that is checked, and where it stands.
pub struct Makeable {
    /// The exit face.
    pub surface: HeightField,
    /// From the entry face to the lowest point of the exit face.
    pub thinnest_mm: f64,
    /// The bench.
    pub scene: Scene,
    /// Whether nothing is known of the light, which then is taken to be straight.
    pub assumed: bool,
    /// What the file holds of the exit face; of a design that is not written yet, what a mesh would.
    pub form: FaceForm,
    block: Block,
}

/// A line of the verdict.
pub struct CheckLine {
    /// Whether it passed.
    pub passed: bool,
    /// What was checked.
    pub what: &'static str,
    /// What was found. Settings stand in backticks.
    pub says: String,
}

impl CheckLine {
    /// The same for programs.
    pub fn document(&self) -> document::CheckLine {
        document::CheckLine { what: self.what.to_owned(), passed: self.passed, says: self.says.clone() }
    }
}

/// The lines that blur the picture and keep nobody from making the block.
const BLURS: [&str; 2] = ["scallops", "facets"];

/// Whether a block can be made.
pub struct CheckStudy {
    /// The verdict.
    pub lines: Vec<CheckLine>,
    /// What the face asks of a cutter.
    pub shape: FaceShape,
}

impl CheckStudy {
    /// Checks a block.
    ///
    /// # Errors
    /// A cutter that does not fit the block, a bench that cannot be.
    pub fn of(subject: &Makeable, shop: &Shop) -> Result<Self, Failure> {
        Pass::finishing(shop.cutter, shop.step_over_mm).check(subject.surface.extent()).map_err(Failure::refused)?;
        let shape = FaceShape::of(&subject.surface);
        Ok(Self { lines: lines(shop, subject, &shape)?, shape })
    }

    /// Answers whether the block can be made, and whether what is left on its face may blur the
    /// picture, which only its light tells.
    pub fn say(&self, shop: &Shop, verdict: &mut Verdict) {
        self.say_hard(shop, verdict);
        for CheckLine { what, says, .. } in self.failing(true) {
            verdict.say(what, Answer::But, format!("{what} may blur the picture: {says}"));
        }
    }

    /// The same without what blurs.
    pub fn say_hard(&self, shop: &Shop, verdict: &mut Verdict) {
        for CheckLine { what, says, .. } in self.failing(false) {
            verdict.say(what, Answer::No, format!("{what}: {says}"));
        }
        if self.failing(false).next().is_none() {
            verdict.say("making", Answer::Yes, format!("it can be made with {}", shop.in_words()));
        }
    }

    /// Lines that have failed: those that blur, or the others.
    fn failing(&self, blurs: bool) -> impl Iterator<Item = &CheckLine> {
        self.lines.iter().filter(move |line| !line.passed && BLURS.contains(&line.what) == blurs)
    }

    /// What has failed.
    pub fn failed(&self) -> Vec<&'static str> {
        self.lines.iter().filter(|line| !line.passed).map(|line| line.what).collect()
    }
}

impl Makeable {
    /// A block from a file, on the bench of its side file, or on that with another index and at
    /// another distance; without one, in straight light, if both are given.
    ///
    /// # Errors
    /// A bench that cannot be; without a side file, `missing` of what is not given.
    pub fn of_block(
        (block, form): (Block, FaceForm),
        side: Option<&SideFile>,
        changed: (Option<f64>, Option<f64>),
        host: &dyn Host,
        missing: impl Fn(&str) -> Failure,
    ) -> Result<Self, Failure> {
        let before = behind::of_side(side, host)?;
        let bench = side.map(|side| (side, &before));
        let scene = scene_of_file(Some(&block), block.size_mm(), bench, changed, host, missing)?;
        let (surface, thinnest_mm) = (surface_of(&block)?, block.min_thickness_mm());
        Ok(Self { surface, thinnest_mm, block, scene, assumed: side.is_none(), form })
    }

    /// A block that has been opened on its bench.
    ///
    /// # Errors
    /// Those of [`of_block`](Self::of_block).
    pub fn of_workpiece(piece: &Workpiece, form: FaceForm, host: &dyn Host) -> Result<Self, Failure> {
        let missing = |what: &str| Failure::Usage(format!("nothing is known of {what}"));
        Self::of_block((piece.block.clone(), form), Some(&piece.side), (None, None), host, missing)
    }

    /// A design that has not been written yet.
    ///
    /// # Errors
    /// A design that makes no block.
    pub fn of_design(plan: &Plan, design: pipeline::DesignedBlock) -> Result<Self, Failure> {
        let judge::Subject::Block(found) = double_precision(&design)? else {
            return Err(Failure::Usage("the design makes no block".into()));
        };
        Ok(Self {
            thinnest_mm: design.solid.thinnest_mm(),
            surface: design.surface,
            block: *found,
            scene: plan.scene.clone(),
            assumed: false,
            form: FaceForm::Triangles,
        })
    }
}

fn place(at: DVec2) -> String {
    format!("x = {:.1} mm, y = {:.1} mm", at.x, at.y)
}

fn lines(shop: &Shop, subject: &Makeable, shape: &FaceShape) -> Result<Vec<CheckLine>, Failure> {
    let Shop { cutter, polish, .. } = shop;
    let pass = Pass::finishing(*cutter, shop.step_over_mm);
    let extent = subject.surface.extent();
    let blur_mm = shop.most_blur_mm.unwrap_or(0.005 * extent.width_mm);
    let mut lines = Vec::new();
    let mut say = |what, passed, says: String| lines.push(CheckLine { passed, what, says });

    let (needed, sharpest) = (cutter.corner_mm(), shape.sharpest());
    let corner = if cutter.shape() == CutterShape::Bull { "corner radius" } else { "radius" };
    let hollow = if sharpest.radius_mm.is_finite() {
        format!("least concave radius {:.2} mm at {}", sharpest.radius_mm, place(sharpest.at))
    } else {
        "the face bulges everywhere".into()
    };
    let fits = needed > 0.0 && sharpest.radius_mm >= needed;
    let largest_mm = greatest_diameter_mm(&sharpest, cutter);
    let reaches = if needed == 0.0 {
        let steps_um = 1e3 * shape.steepest().1 * pass.step_over_mm;
        format!(
            "a flat cutter leaves steps of up to {steps_um:.1} um on every slope; `cutter` ball:d{largest_mm}mm would do"
        )
    } else if fits {
        format!("the cutter fits, whose {corner} is {needed} mm")
    } else {
        format!(
            "the cutter, whose {corner} is {needed} mm, does not fit on {:.2} % of the face; `cutter` ball:d{largest_mm}mm would do, or a design with `min-radius` {needed}mm",
            100.0 * shape.sharper_than(needed)
        )
    };
    say("hollows", fits, format!("{hollow}: {reaches}"));

    if let Some(walls) = walls_of(&subject.block, &subject.surface, *cutter) {
        let unreached = walls.unreached();
        let reached = unreached.share == 0.0;
        let says = if reached {
            "the cutter reaches all of the face beside its wall".to_owned()
        } else {
            // Below every place of the face.
            let below_mm = (subject.surface.relief_mm() + 0.5).ceil();
            format!(
                "{}; a design without `rim`, or with a flange below the face (`rim` WIDTH,-{below_mm}mm), would do",
                unreached.in_words()
            )
        };
        say("rim", reached, says);
    }

    let (at, slope) = shape.steepest();
    let degrees = slope.atan().to_degrees();
    let gentle = degrees <= shop.steepest_degrees;
    // Slopes fall as the way grows on which they throw light.
    let further_mm = subject.scene.distance_mm * slope / shop.steepest_degrees.to_radians().tan();
    let says = format!("at most {degrees:.2} degrees, at {} (`max-slope` {}deg)", place(at), shop.steepest_degrees);
    let remedy = format!(
        "; a design with `distance` {:.0}mm has about that, and so has this face in a shop that cuts {:.0} degrees",
        further_mm.ceil(),
        degrees.ceil()
    );
    say("slope", gentle, if gentle { says } else { says + &remedy });
    let (leaves, says) = leaving_light(subject)?;
    say("light", leaves, says);

    let relief = subject.surface.relief_mm();
    let greatest = subject.thinnest_mm + relief;
    let stock = shop.thickness_mm.or_else(|| Stock::sheet_for(greatest, shop.facing_mm));
    let least = shop.least_thickness_mm;
    let needed_sheet = |mm: f64| Stock::sheet_for(mm, shop.facing_mm).unwrap_or((mm + shop.facing_mm).ceil());
    let thicker = || format!("a design with `thickness` {:.1}mm would do", relief + least + 0.1);
    let contained = stock.is_some_and(|stock| relief < stock);
    let remedy = if contained { String::new() } else { format!("; {}", thicker()) };
    say("relief", contained, format!("{relief:.3} mm from peak to valley{remedy}"));
    let stock_says = stock.map_or("no standard sheet holds it".into(), |stock| format!("stock {stock} mm"));
    let holds = stock.is_some_and(|stock| greatest <= stock + 1e-6) && subject.thinnest_mm >= least - 1e-6;
    let remedy = match holds {
        true => String::new(),
        false if subject.thinnest_mm < least - 1e-6 => format!("; {}", thicker()),
        false => format!("; a stock of {} mm would do", needed_sheet(greatest)),
    };
    say(
        "thickness",
        holds,
        format!("{:.3} to {greatest:.3} mm; {stock_says}, at least {least} mm shall stay{remedy}", subject.thinnest_mm),
    );

    let scallop = Scallop::of(*cutter, pass.step_over_mm);
    // On any bench light is thrown as far as the slope is great, as long as that is small.
    let thrown = |slope: f64, along: &[DVec2]| deflection_mm(&subject.block, &subject.scene, slope, along);
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
            let remedy = if passed { String::new() } else { finer(&raw, blur_mm, &spread) };
            say(
                "scallops",
                passed,
                format!(
                    "{:.3} um high, slope {:.5}: light is thrown {:.3} mm to either side{polished} (`max-blur` {blur_mm} mm){remedy}",
                    1e3 * raw.height_mm,
                    raw.slope,
                    spread(&raw)
                ),
            );
        }
        None => {
            let ball = Cutter::ball(0.5 * largest_mm).map_err(Failure::refused)?;
            let step_over = 2.0 * ball.radius_mm() * blur_mm * SMALL_SLOPE / thrown(SMALL_SLOPE, &across)?;
            say(
                "scallops",
                false,
                format!(
                    "this cutter leaves steps or walls between its rows at this step-over; `cutter` {ball} with `step-over` {step_over:.3}mm would do"
                ),
            );
        }
    }

    let (passed, says) = facets(subject, shape, blur_mm, thrown)?;
    say("facets", passed, says);
    Ok(lines)
}

/// More nodes across than this nobody is told to take for the sake of triangles.
const MOST_NODES: f64 = 4097.0;

/// A slope that is small on any bench.
const SMALL_SLOPE: f64 = 1e-3;

/// The diameter of a ball, mm, rounded down as cutters are sold, that fits into a hollow; no larger
/// than a given cutter.
fn greatest_diameter_mm(sharpest: &Hollow, cutter: &Cutter) -> f64 {
    let most_mm = 2.0 * sharpest.radius_mm.min(cutter.radius_mm());
    let (_, greatest) = Cutter::RADIUS_LIMITS_MM;
    let step = [1.0, 0.1, 0.01].into_iter().find(|step| most_mm >= *step).unwrap_or(0.001);
    // The last digit may be one beyond for rounding.
    ((most_mm / step + 1e-9).floor() * step * 1e3).round().clamp(1.0, 2e3 * greatest) / 1e3
}

/// Whether flat triangles keep the light together, by what the file holds: the triangles of a mesh
/// are cut as they are, a smooth face as fine as the CAM program is told to.
fn facets(
    subject: &Makeable,
    shape: &FaceShape,
    blur_mm: f64,
    thrown: impl Fn(f64, &[DVec2]) -> Result<f64, Failure>,
) -> Result<(bool, String), Failure> {
    let step = shape.facet_step();
    let facets_mm = thrown(0.5 * step, &[DVec2::X, DVec2::Y])?;
    let heights = subject.surface.heights_mm();
    let (nx, ny) = (heights.nx(), heights.ny());
    let spacing_mm = subject.surface.extent().node_spacing(nx, ny).min_element();
    // A chord over an arc of the curvature k that turns by a is a^2 / (8 k) away from it.
    let turn = step * blur_mm / facets_mm.max(f64::MIN_POSITIVE);
    let tolerance_um = 1e3 * turn * turn * spacing_mm / (8.0 * step.max(f64::MIN_POSITIVE));
    let cam = if step > 0.0 && tolerance_um.is_finite() {
        let digits = (1.0 - tolerance_um.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("with a tolerance of {tolerance_um:.digits$} um in the CAM program")
    } else {
        "with any tolerance in the CAM program".to_owned()
    };
    Ok(match subject.form {
        FaceForm::Smooth => (true, format!("none: the file holds the smooth face; cut it {cam} or a finer one")),
        FaceForm::Heights => {
            (true, format!("none: the file holds heights {spacing_mm:.4} mm apart, to be taken as a smooth face"))
        }
        FaceForm::Triangles => {
            let passed = facets_mm <= blur_mm;
            let nodes = 1.0 + ((nx - 1) as f64 * facets_mm / blur_mm).ceil();
            let more =
                if nodes <= MOST_NODES { format!("a design with `nodes` {nodes:.0}, or ") } else { String::new() };
            let remedy =
                if passed { String::new() } else { format!("; {more}a STEP would do, whose face is smooth, {cam}") };
            (
                passed,
                format!(
                    "slope steps of up to {step:.5} between flat triangles throw light {facets_mm:.3} mm to either side (`max-blur` {blur_mm} mm){remedy}"
                ),
            )
        }
    })
}

/// Whether all light leaves the face towards the receiver, by the light at every node.
fn leaving_light(subject: &Makeable) -> Result<(bool, String), Failure> {
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
            _ => (
                false,
                format!(
                    "{:.2} % of the face is in the shadow or throws light at itself; a design with `distance` {:.0}mm has half its slopes",
                    share(astray),
                    2.0 * subject.scene.distance_mm
                ),
            ),
        });
    };
    let critical = (1.0 / ior).asin().to_degrees();
    Ok(if reflected == 0 {
        let says = "all of it leaves: it comes at up to";
        (true, format!("{says} {steepest:.2} degrees to the normal, total reflection begins at {critical:.2} degrees"))
    } else {
        let share = share(reflected);
        let further_mm = subject.scene.distance_mm * steepest.to_radians().tan() / critical.to_radians().tan();
        let remedy = format!(
            "a design with `distance` {:.0}mm, or with a larger `offset`, has gentler slopes",
            further_mm.max(1.1 * subject.scene.distance_mm).ceil()
        );
        (
            false,
            format!(
                "is totally reflected on {share:.2} % of the face, beyond {critical:.2} degrees to the normal; {remedy}"
            ),
        )
    })
}

/// What would let the scallops pass.
fn finer(raw: &Scallop, blur_mm: f64, spread: &dyn Fn(&Scallop) -> f64) -> String {
    let step_over = raw.step_over_mm * blur_mm / spread(raw);
    let sigma = (1..=200).map(|k| 0.005 * f64::from(k)).find(|sigma| spread(&raw.polished(*sigma)) <= blur_mm);
    let polish = sigma.map_or(String::new(), |sigma| format!(", or a polish of {sigma:.3} mm"));
    format!("; a step-over of {step_over:.3} mm would do{polish}")
}
