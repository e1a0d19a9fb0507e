//! `glasswarp check --tolerance`: what the picture becomes where the world is not as it was designed for, each traced.

use super::{
    bench::first_met,
    console::say,
    error::Failure,
    json, judge,
    length::Length,
    otherwise::{Followed, followed},
    progress::TerminalProgress,
    settings::Settings,
    workpiece::{View, Workpiece, with_face},
};
use glam::{DVec2, DVec3};
use glasswarp::{
    grid::Field,
    report::{self, Captioned},
    surface::HeightField,
};
use glasswarp_verify::{Block, Image, Light, Optics, Scene, Tracer, Traversal, metrics};

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

    /// Angular diameter of the light as seen from the block, degrees: the sun has 0.53, a torch of 20 mm a metre away 1.15. May be given several
    /// times
    #[arg(long, value_name = "DEGREES", default_values_t = [0.53, 1.15], help_heading = "Tolerances", requires = "tolerance")]
    light: Vec<f64>,

    /// The relative RMS error up to which a picture counts as in focus [default: twice that of the block]
    #[arg(long, value_name = "ERROR", help_heading = "Tolerances", requires = "tolerance")]
    focus_error: Option<f64>,
}

/// What can be off, and what the picture is then.
struct Case {
    name: String,
    /// None where none of the light falls into the window.
    seen: Option<Seen>,
    place: Place,
}

struct Seen {
    view: View,
    /// Relative RMS difference from the picture of the block as it was designed.
    moved: f64,
}

/// Where the picture is, and how large, against the design: there it is looked at.
#[derive(Clone, Copy)]
struct Place {
    moved_mm: DVec2,
    growth: DVec2,
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
    let bench = Bench { piece, block: with_face(&piece.block, &piece.surface)?.with_spline(), scene: piece.scene() };
    let progress = TerminalProgress::new();
    let designed = bench.view(bench.traced(&bench.block, &bench.scene, BEAMS)?)?;
    let designed =
        designed.ok_or_else(|| Failure::Usage("none of the light of this block falls into its window".into()))?;
    let (changes, mut left_out) = bench.changes(args)?;
    let lights = match imperfect(&piece.side.design) {
        None => args.light.as_slice(),
        Some(what) => {
            left_out.push(format!(
                "the size of the light: the block is designed for {what}, in which `verify` looks at it"
            ));
            &[]
        }
    };
    progress.begin("tracing tolerances", changes.len() + lights.len() + 1);
    let mut cases = Vec::new();
    for change in changes {
        cases.push(bench.case(change, &designed)?);
        progress.advance(cases.len());
    }
    for &diameter in lights {
        let image = bench.extended_light(diameter)?;
        let seen = bench.seen(image, &designed)?;
        cases.push(Case { name: format!("light {diameter} degrees across"), seen, place: Place::SAME });
        progress.advance(cases.len());
    }
    let focus = bench.focus(designed.metrics.rel_rms, args.focus_error);
    progress.finish();
    print(&designed, &cases, &left_out);
    let focus = focus?;
    focus.print(bench.scene.distance_mm);
    let captioned = |name: &str, view: &View| Captioned {
        caption: format!("{name}: {:.4}", view.metrics.rel_rms),
        picture: report::irradiance_picture(&judge::field_of(&view.image), piece.exposure),
    };
    let mut pictures = vec![captioned("as designed", &designed)];
    pictures.extend(cases.iter().filter_map(|case| Some(captioned(&case.name, &case.seen.as_ref()?.view))));
    let found = json::Tolerances {
        designed: json::finite(designed.metrics.rel_rms),
        cases: cases.iter().map(Case::to_json).collect(),
        left_out,
        focus: json::Focus { limit: focus.limit, near_mm: focus.near_mm, far_mm: focus.far_mm },
    };
    Ok((pictures, found))
}

fn print(designed: &View, cases: &[Case], left_out: &[String]) {
    say!("\nTolerances, each traced through the displaced surface      relative RMS     SSIM   moved by");
    say!("  {:<55} {:>12.4} {:>8.4}", "as designed", designed.metrics.rel_rms, designed.metrics.ssim);
    for Case { name, seen, place } in cases {
        match seen {
            Some(Seen { view, moved }) => say!(
                "  {name:<55} {:>12.4} {:>8.4} {moved:>10.4}{}",
                view.metrics.rel_rms,
                view.metrics.ssim,
                place.in_words()
            ),
            None => say!("  {name:<55} none of the light falls into the window{}", place.in_words()),
        }
    }
    left_out.iter().for_each(|what| say!("  left out: {what}"));
}

/// The spread of light that a block is designed for.
fn imperfect(design: &Settings) -> Option<&'static str> {
    let Settings { source_size, roughness, psf, .. } = design;
    match (source_size, roughness, psf) {
        (Some(_), ..) => Some("a source with a size"),
        (None, Some(_), _) => Some("a rough face"),
        (None, None, Some(_)) => Some("a measured spread of the light"),
        (None, None, None) => None,
    }
}

impl Focus {
    fn print(&self, distance_mm: f64) {
        let end = |mm: Option<f64>| mm.map_or("beyond".into(), |mm| format!("{mm:.2} mm"));
        say!(
            "\nDepth of focus (relative RMS error up to {:.4}): from {} to {}",
            self.limit,
            end(self.near_mm),
            end(self.far_mm)
        );
        if let (Some(near), Some(far)) = (self.near_mm, self.far_mm) {
            say!(
                "  {:.2} mm, {:.2} mm nearer and {:.2} mm further than designed",
                far - near,
                distance_mm - near,
                far - distance_mm
            );
        }
    }
}

impl Place {
    const SAME: Self = Self { moved_mm: DVec2::ZERO, growth: DVec2::ONE };

    /// What a person would see without measuring.
    fn in_words(self) -> String {
        let mut words = String::new();
        if self.moved_mm.length() >= 0.005 {
            words += &format!("   picture {:.2} mm aside", self.moved_mm.length());
        }
        let growth = 100.0 * (self.growth - 1.0);
        if growth.abs().max_element() >= 0.005 {
            words += &format!("   picture {:+.2} % wide, {:+.2} % high", growth.x, growth.y);
        }
        words
    }
}

impl Case {
    fn to_json(&self) -> json::Tolerance {
        let seen = self.seen.as_ref();
        json::Tolerance {
            name: self.name.clone(),
            rel_rms: seen.and_then(|seen| json::finite(seen.view.metrics.rel_rms)),
            ssim: seen.and_then(|seen| json::finite(seen.view.metrics.ssim)),
            moved: seen.and_then(|seen| json::finite(seen.moved)),
            picture_moved_mm: self.place.moved_mm.to_array(),
            picture_growth: self.place.growth.to_array(),
        }
    }
}

/// Another block or another bench.
struct Change {
    name: String,
    block: Option<Block>,
    scene: Scene,
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

/// The block on its bench: its own light, receiver and optics, from which every case starts.
struct Bench<'a> {
    piece: &'a Workpiece,
    block: Block,
    scene: Scene,
}

impl Bench<'_> {
    fn traced(&self, block: &Block, scene: &Scene, beams_per_pixel: usize) -> Result<Image, Failure> {
        let tracer = Tracer::for_block(block, scene).map_err(Failure::refused)?;
        Ok(self.piece.examiner.beams_through(block, &tracer, beams_per_pixel).image)
    }

    /// None where there is no light.
    fn view(&self, image: Image) -> Result<Option<View>, Failure> {
        if image.values.iter().all(|&v| v == 0.0) {
            return Ok(None);
        }
        Ok(self.piece.examiner.compare(&image)?.map(|metrics| View { image, metrics }))
    }

    fn seen(&self, image: Image, designed: &View) -> Result<Option<Seen>, Failure> {
        let Some(view) = self.view(image)? else { return Ok(None) };
        let moved = metrics::rel_rms(&view.image, &designed.image).map_err(Failure::refused)?;
        Ok(Some(Seen { view, moved }))
    }

    fn case(&self, Change { name, block, scene }: Change, designed: &View) -> Result<Case, Failure> {
        let block = block.as_ref().unwrap_or(&self.block);
        let Followed { scene, moved_mm, growth } = followed((&self.block, &self.scene), (block, scene))?;
        let seen = self.seen(self.traced(block, &scene, BEAMS)?, designed)?;
        Ok(Case { name, seen, place: Place { moved_mm, growth } })
    }

    /// Other blocks and other benches, and what means nothing here.
    fn changes(&self, args: &ToleranceArgs) -> Result<(Vec<Change>, Vec<String>), Failure> {
        let scene = &self.scene;
        let (mut changes, mut left_out) = (Vec::new(), Vec::new());
        let mut change = |name: String, block: Option<Block>, scene: Scene| changes.push(Change { name, block, scene });
        if let Optics::Refracts { ior } = scene.optics {
            for off in [-args.index_off, args.index_off] {
                let optics = Optics::Refracts { ior: ior + off };
                change(format!("index {:.4} ({off:+})", ior + off), None, Scene { optics, ..scene.clone() });
            }
        }
        for off in [-args.distance_off.mm, args.distance_off.mm] {
            let distance_mm = scene.distance_mm + off;
            let name = format!("receiver at {distance_mm} mm ({off:+})");
            change(name, None, Scene { distance_mm, ..scene.clone() });
        }
        for (axis, name) in [(DVec3::X, "x"), (DVec3::Y, "y")] {
            let scene = Scene { turned: axis * args.tilt.to_radians(), ..scene.clone() };
            change(format!("block turned by {} degrees about {name}", args.tilt), None, scene);
        }
        let (size, peak_mm) = (self.piece.surface.extent().as_vec(), 1e-3 * args.form_error);
        let power = |p: DVec2| peak_mm * 4.0 * p.length_squared() / size.length_squared();
        let astigmatism = |p: DVec2| 2.0 * peak_mm * ((p.x / size.x).powi(2) - (p.y / size.y).powi(2));
        let forms: [(&str, &dyn Fn(DVec2) -> f64); 3] =
            [("hollow power", &power), ("bulging power", &|p| -power(p)), ("astigmatism", &astigmatism)];
        for (name, form) in forms {
            let block = with_face(&self.block, &with_form(&self.piece.surface, form))?;
            change(format!("form error of {} um, {name}", args.form_error), Some(block), scene.clone());
        }
        if scene.optics == Optics::Reflects {
            left_out
                .push("the index and the thickness of the stock, which light does not enter before a mirror".into());
            return Ok((changes, left_out));
        }
        let off = args.thickness_off.mm;
        let entry_z_mm = self.block.entry_z_mm() - off;
        let thicker = self.block.clone().with_entry_z(entry_z_mm).map_err(Failure::refused)?;
        let name = |measured: &str| format!("stock {off} mm thicker, {measured}");
        change(name("receiver where it was"), Some(thicker.clone()), scene.clone());
        // A lamp keeps its distance from the entry face too.
        let mut nearer = Scene { distance_mm: scene.distance_mm - off, ..scene.clone() };
        if let Light::Point { position_mm, .. } = &mut nearer.light {
            position_mm.z -= off;
        }
        change(name("measured from the entry face"), Some(thicker), nearer);
        Ok((changes, left_out))
    }

    /// The light of a disc around the bench's own, of equal power from every part of it: of directions, or of places of a lamp which
    /// is as large as that as seen from the middle of the block.
    fn extended_light(&self, diameter_degrees: f64) -> Result<Image, Failure> {
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
                let light = self.light_aside(radius * at * DVec2::from_angle(angle));
                let traversal = if ring == 0 { Traversal::Grid } else { Traversal::Bvh };
                let scene = Scene { light, traversal, ..self.scene.clone() };
                let image = self.traced(&self.block, &scene, BEAMS_OF_A_DIRECTION)?;
                match &mut sum {
                    None => sum = Some(image),
                    Some(sum) => sum.values.iter_mut().zip(&image.values).for_each(|(sum, v)| *sum += v),
                }
            }
            inner += if ring == 0 { 0 } else { members };
        }
        sum.ok_or_else(|| Failure::Usage("there is no light".into()))
    }

    /// The bench's light from a little beside its direction, or its place: by these tangents as seen from the middle of the block.
    fn light_aside(&self, tangents: DVec2) -> Light {
        let across = |axis: DVec3| {
            let (x, y) = axis.any_orthonormal_pair();
            tangents.x * x + tangents.y * y
        };
        match &self.scene.light {
            Light::Parallel { direction } => {
                let direction = direction.normalize();
                Light::parallel(direction + across(direction))
            }
            Light::Point { position_mm, emission, axis } => {
                let to_middle = first_met(&self.scene, self.block.entry_z_mm()) - *position_mm;
                // The axis of the lamp stays the bench's own where it is not told.
                let aside = to_middle.length() * across(axis.unwrap_or(to_middle).normalize());
                Light::Point { position_mm: *position_mm + aside, emission: emission.clone(), axis: *axis }
            }
        }
    }

    /// The ends of the focus, by bisection from the designed distance outwards.
    fn focus(&self, designed: f64, limit: Option<f64>) -> Result<Focus, Failure> {
        let limit = limit.unwrap_or(2.0 * designed);
        if designed > limit {
            return Err(Failure::FellShort(format!(
                "no distance keeps to a relative RMS error of {limit} (--focus-error): at the designed distance it is {designed:.4}"
            )));
        }
        let own = self.scene.distance_mm;
        // Where the receiver cuts the block, or where no light comes, there is no focus.
        let fits = |distance_mm: f64| -> Result<bool, Failure> {
            let to = Scene { distance_mm, ..self.scene.clone() };
            let Ok(there) = followed((&self.block, &self.scene), (&self.block, to)) else { return Ok(false) };
            let view = self.view(self.traced(&self.block, &there.scene, BEAMS)?)?;
            Ok(view.is_some_and(|view| view.metrics.rel_rms <= limit))
        };
        let end = |furthest: f64| -> Result<Option<f64>, Failure> {
            // Outwards in doubling steps, then back into the last of them.
            let mut inside = own;
            let mut step = 0.01 * (furthest - inside);
            loop {
                let outside = inside + step;
                if (outside - own).abs() >= (furthest - own).abs() {
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
        let nearest = (FOCUS_RANGE.0 * own).max(self.block.height_range_mm().1 + 1.0);
        Ok(Focus { limit, near_mm: end(nearest)?, far_mm: end(FOCUS_RANGE.1 * own)? })
    }
}

fn with_form(surface: &HeightField, form: &dyn Fn(DVec2) -> f64) -> HeightField {
    let (extent, heights) = (surface.extent(), surface.heights_mm());
    let (nx, ny) = (heights.nx(), heights.ny());
    surface.with_heights(Field::from_fn(nx, ny, |i, j| heights[(i, j)] + form(extent.node(i, j, nx, ny))))
}
