//! `glasswarp check --tolerance`: what the picture becomes where the world is not as it was designed for, each traced.

use super::{
    console::say,
    error::Failure,
    json, judge,
    length::Length,
    progress::TerminalProgress,
    workpiece::{View, Workpiece, block_of},
};
use glam::{DVec2, DVec3};
use glasswarp::{
    grid::Field,
    report::{self, Captioned},
    solver::Progress,
    surface::HeightField,
};
use glasswarp_verify::{Block, Image, Light, Optics, Scene, Traversal, metrics};

#[derive(clap::Args)]
pub(crate) struct ToleranceArgs {
    /// Trace what index, distance, tilt, form, thickness and the size of the light do to the picture, and find the depth of
    /// focus. Needs a side file
    #[arg(long, help_heading = "Tolerances")]
    pub(crate) tolerance: bool,

    /// The index is off by this, to either side
    #[arg(long, value_name = "N", default_value_t = 0.01, help_heading = "Tolerances", requires = "tolerance")]
    index_off: f64,

    /// The distance is off by this, to either side
    #[arg(long, value_name = "LENGTH", default_value = "5mm", help_heading = "Tolerances", requires = "tolerance")]
    distance_off: Length,

    /// The block is turned by this about x and about y, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 1.0, help_heading = "Tolerances", requires = "tolerance")]
    tilt: f64,

    /// Form error of low order (power, astigmatism), peak to valley over the block, micrometres
    #[arg(long, value_name = "UM", default_value_t = 50.0, help_heading = "Tolerances", requires = "tolerance")]
    form_error: f64,

    /// The stock is thicker by this, and the receiver stands at its distance from the entry face
    #[arg(long, value_name = "LENGTH", default_value = "0.5mm", help_heading = "Tolerances", requires = "tolerance")]
    thickness_off: Length,

    /// Angular diameter of the light, degrees: the sun has 0.53, a torch of 20 mm a metre away 1.15. May be given several times
    #[arg(long, value_name = "DEGREES", default_values_t = [0.53, 1.15], help_heading = "Tolerances", requires = "tolerance")]
    light: Vec<f64>,

    /// The relative RMS error up to which a picture counts as in focus [default: twice that of the block]
    #[arg(long, value_name = "ERROR", help_heading = "Tolerances", requires = "tolerance")]
    focus_error: Option<f64>,
}

/// What can be off, and what the picture is then.
struct Case {
    name: String,
    view: View,
    /// Relative RMS difference from the picture of the block as it was designed.
    moved: f64,
}

/// The distances between which the picture is in focus, mm; `None` where a side has no end within what was looked at.
struct Focus {
    limit: f64,
    near_mm: Option<f64>,
    far_mm: Option<f64>,
}

impl ToleranceArgs {
    /// Refuses what cannot be looked at, before any work.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        let within = |what: &str, value: f64, least: f64, greatest: f64| {
            if (least..=greatest).contains(&value) {
                Ok(())
            } else {
                Err(Failure::Usage(format!("{what} is {value}; it must lie between {least} and {greatest}")))
            }
        };
        within("the error of the index (--index-off)", self.index_off, 0.0, 0.2)?;
        within("the error of the distance (--distance-off), mm,", self.distance_off.mm, 0.0, 1e5)?;
        within("the tilt (--tilt), degrees,", self.tilt, 0.0, 30.0)?;
        within("the form error (--form-error), um,", self.form_error, 0.0, 1e4)?;
        within("the error of the thickness (--thickness-off), mm,", self.thickness_off.mm, 0.0, 100.0)?;
        self.light
            .iter()
            .try_for_each(|light| within("the angular diameter of the light (--light), degrees,", *light, 0.0, 20.0))?;
        self.focus_error.map_or(Ok(()), |error| within("the error of the focus (--focus-error)", error, 0.0, 10.0))
    }
}

/// Traces all cases, prints the table, and gives the pictures. Fails where the focus that is asked for cannot be had.
pub(crate) fn run(args: &ToleranceArgs, piece: &Workpiece) -> Result<(Vec<Captioned>, json::Tolerances), Failure> {
    let bench = Bench { piece, block: block_of(&piece.surface, piece.entry_z_mm)? };
    let scene = piece.scene(&bench.block);
    let progress = TerminalProgress::new();
    let designed = bench.view(&bench.block, &scene)?;
    let mut cases = Vec::new();
    let changes = bench.changes(args, &scene)?;
    progress.begin("tracing tolerances", changes.len() + args.light.len() + 1);
    for (k, (name, block, scene)) in changes.into_iter().enumerate() {
        let view = bench.view(block.as_ref().unwrap_or(&bench.block), &scene)?;
        cases.push(Case::of(name, view, &designed)?);
        progress.advance(k + 1);
    }
    for &diameter in &args.light {
        let name = format!("light {diameter} degrees across");
        cases.push(Case::of(name, bench.extended_light(&scene, diameter)?, &designed)?);
        progress.advance(cases.len());
    }
    let focus = bench.focus(&scene, designed.metrics.rel_rms, args.focus_error);
    progress.finish();
    say!("\nTolerances, each traced through the displaced surface      relative RMS     SSIM   moved by");
    say!("  {:<55} {:>12.4} {:>8.4}", "as designed", designed.metrics.rel_rms, designed.metrics.ssim);
    for Case { name, view, moved } in &cases {
        say!("  {name:<55} {:>12.4} {:>8.4} {moved:>10.4}", view.metrics.rel_rms, view.metrics.ssim);
    }
    let focus = focus?;
    let (distance, end) = (scene.distance_mm, |mm: Option<f64>| mm.map_or("beyond".into(), |mm| format!("{mm:.2} mm")));
    say!(
        "\nDepth of focus (relative RMS error up to {:.4}): from {} to {}",
        focus.limit,
        end(focus.near_mm),
        end(focus.far_mm)
    );
    if let (Some(near), Some(far)) = (focus.near_mm, focus.far_mm) {
        say!(
            "  {:.2} mm, {:.2} mm nearer and {:.2} mm further than designed",
            far - near,
            distance - near,
            far - distance
        );
    }
    let captioned = |name: &str, view: &View| Captioned {
        caption: format!("{name}: {:.4}", view.metrics.rel_rms),
        picture: report::irradiance_picture(&judge::field_of(&view.image), piece.exposure),
    };
    let mut pictures = vec![captioned("as designed", &designed)];
    pictures.extend(cases.iter().map(|case| captioned(&case.name, &case.view)));
    let found = json::Tolerances {
        designed: json::finite(designed.metrics.rel_rms),
        cases: cases
            .iter()
            .map(|case| json::BudgetStep {
                name: case.name.clone(),
                rel_rms: json::finite(case.view.metrics.rel_rms),
                ssim: json::finite(case.view.metrics.ssim),
                moved: json::finite(case.moved),
            })
            .collect(),
        focus: json::Focus { limit: focus.limit, near_mm: focus.near_mm, far_mm: focus.far_mm },
    };
    Ok((pictures, found))
}

impl Case {
    fn of(name: String, view: View, designed: &View) -> Result<Self, Failure> {
        let moved = metrics::rel_rms(&view.image, &designed.image).map_err(Failure::refused)?;
        Ok(Self { name, view, moved })
    }
}

/// Beams per pixel along each side; with extended light there are so many directions that fewer do.
const BEAMS: usize = 4;
const BEAMS_OF_A_DIRECTION: usize = 2;
/// Rings of directions around the middle of the light: 1 + 6 + 12 + 18 of equal power.
const RINGS: usize = 3;
/// How far the depth of focus is looked for, as parts of the distance.
const FOCUS_RANGE: (f64, f64) = (0.5, 3.0);
/// Halvings of the interval in which the end of the focus lies.
const BISECTIONS: usize = 7;

struct Bench<'a> {
    piece: &'a Workpiece,
    block: Block,
}

impl Bench<'_> {
    fn view(&self, block: &Block, scene: &Scene) -> Result<View, Failure> {
        let image = self.piece.look_from(block, scene, BEAMS)?;
        Ok(View { metrics: self.piece.compare(&image)?, image })
    }

    /// Other blocks and other benches, by name.
    fn changes(&self, args: &ToleranceArgs, scene: &Scene) -> Result<Vec<(String, Option<Block>, Scene)>, Failure> {
        let mut changes = Vec::new();
        for sign in [-1.0, 1.0] {
            let ior = scene.ior() + sign * args.index_off;
            changes.push((
                format!("index {ior:.4} ({:+})", sign * args.index_off),
                None,
                Scene { optics: Optics::Refracts { ior }, ..scene.clone() },
            ));
        }
        for sign in [-1.0, 1.0] {
            let distance_mm = scene.distance_mm + sign * args.distance_off.mm;
            let name = format!("receiver at {distance_mm} mm ({:+})", sign * args.distance_off.mm);
            changes.push((name, None, Scene { distance_mm, ..scene.clone() }));
        }
        for (axis, name) in [(DVec3::X, "x"), (DVec3::Y, "y")] {
            let scene = Scene { turned: axis * args.tilt.to_radians(), ..scene.clone() };
            changes.push((format!("block turned by {} degrees about {name}", args.tilt), None, scene));
        }
        let (size, peak_mm) = (self.piece.surface.extent().as_vec(), 1e-3 * args.form_error);
        let power = |p: DVec2| peak_mm * 4.0 * p.length_squared() / size.length_squared();
        let astigmatism = |p: DVec2| 2.0 * peak_mm * ((p.x / size.x).powi(2) - (p.y / size.y).powi(2));
        let forms: [(&str, &dyn Fn(DVec2) -> f64); 3] =
            [("hollow power", &power), ("bulging power", &|p| -power(p)), ("astigmatism", &astigmatism)];
        for (name, form) in forms {
            let block = block_of(&with_form(&self.piece.surface, form), self.piece.entry_z_mm)?;
            changes.push((format!("form error of {} um, {name}", args.form_error), Some(block), scene.clone()));
        }
        let off = args.thickness_off.mm;
        let thicker = block_of(&self.piece.surface, self.piece.entry_z_mm - off)?;
        changes.push((format!("stock {off} mm thicker, receiver where it was"), Some(thicker.clone()), scene.clone()));
        let nearer = Scene { distance_mm: scene.distance_mm - off, ..scene.clone() };
        changes.push((format!("stock {off} mm thicker, measured from the entry face"), Some(thicker), nearer));
        Ok(changes)
    }

    /// The light of a disc of directions, of equal power from every part of it.
    fn extended_light(&self, scene: &Scene, diameter_degrees: f64) -> Result<View, Failure> {
        let count = 1 + 3 * RINGS * (RINGS + 1);
        let radius = (0.5 * diameter_degrees).to_radians().tan();
        let mut sum: Option<Image> = None;
        let mut inner = 1;
        for ring in 0..=RINGS {
            let members = (6 * ring).max(1);
            // Half of the ring's power comes from inside of this circle.
            let at = if ring == 0 { 0.0 } else { ((inner as f64 + 0.5 * members as f64) / count as f64).sqrt() };
            for k in 0..members {
                let angle = std::f64::consts::TAU * (k as f64 + 0.5 * (ring % 2) as f64) / members as f64;
                let light = Light::parallel((radius * at * DVec2::from_angle(angle)).extend(1.0));
                let traversal = if ring == 0 { Traversal::Grid } else { Traversal::Bvh };
                let image = self.piece.look_from(
                    &self.block,
                    &Scene { light, traversal, ..scene.clone() },
                    BEAMS_OF_A_DIRECTION,
                )?;
                match &mut sum {
                    None => sum = Some(image),
                    Some(sum) => sum.values.iter_mut().zip(&image.values).for_each(|(sum, v)| *sum += v),
                }
            }
            inner += if ring == 0 { 0 } else { members };
        }
        let image = sum.ok_or_else(|| Failure::Usage("there is no light".into()))?;
        Ok(View { metrics: self.piece.compare(&image)?, image })
    }

    /// The ends of the focus, by bisection from the designed distance outwards.
    fn focus(&self, scene: &Scene, designed: f64, limit: Option<f64>) -> Result<Focus, Failure> {
        let limit = limit.unwrap_or(2.0 * designed);
        if designed > limit {
            return Err(Failure::FellShort(format!(
                "no distance keeps to a relative RMS error of {limit} (--focus-error): at the designed distance it is {designed:.4}"
            )));
        }
        let top = self.block.height_range_mm().1;
        let fits = |distance_mm: f64| -> Result<bool, Failure> {
            let image = self.piece.look_from(&self.block, &Scene { distance_mm, ..scene.clone() }, BEAMS)?;
            Ok(self.piece.compare(&image)?.rel_rms <= limit)
        };
        let end = |furthest: f64| -> Result<Option<f64>, Failure> {
            // Outwards in doubling steps, then back into the last of them.
            let mut inside = scene.distance_mm;
            let mut step = 0.01 * (furthest - inside);
            loop {
                let outside = inside + step;
                if (outside - scene.distance_mm).abs() >= (furthest - scene.distance_mm).abs() {
                    return Ok(None);
                }
                if !fits(outside)? {
                    let (mut low, mut high) = (inside, outside);
                    for _ in 0..BISECTIONS {
                        let middle = 0.5 * (low + high);
                        if fits(middle)? { low = middle } else { high = middle }
                    }
                    return Ok(Some(low));
                }
                inside = outside;
                step *= 2.0;
            }
        };
        let nearest = (FOCUS_RANGE.0 * scene.distance_mm).max(top + 1.0);
        Ok(Focus { limit, near_mm: end(nearest)?, far_mm: end(FOCUS_RANGE.1 * scene.distance_mm)? })
    }
}

fn with_form(surface: &HeightField, form: &dyn Fn(DVec2) -> f64) -> HeightField {
    let (extent, heights) = (surface.extent(), surface.heights_mm());
    let (nx, ny) = (heights.nx(), heights.ny());
    surface.with_heights(Field::from_fn(nx, ny, |i, j| heights[(i, j)] + form(extent.node(i, j, nx, ny))))
}
