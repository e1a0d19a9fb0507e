//! What the picture becomes where the world is not as it was designed for, each traced.

use super::{
    bench::first_met,
    changed::{Followed, follow_picture},
    face::with_face,
    progress::{advance, begin},
    workpiece::{JudgedImage, Workpiece},
};
use crate::{
    failure::Failure,
    grid::Field,
    record::document,
    solver::Progress,
    spec::{Settings, SourceName, ToleranceArgs},
    surface::HeightField,
};
use glam::{DVec2, DVec3};
use glasswarp_verify::{Block, Displacement, Image, Light, Optics, Scene, Tracer, Traversal, metrics};

/// By how much things may be off.
pub struct Tolerances {
    /// The index, to either side.
    pub index: f64,
    /// The distance, to either side.
    pub distance_mm: f64,
    /// The block is turned by this about x and about y, degrees.
    pub tilt_degrees: f64,
    /// Form error of low order, peak to valley over the block.
    pub form_error_um: f64,
    /// The stock is thicker by this.
    pub thickness_mm: f64,
    /// The block before this one stands aside, or nearer or further, by this.
    pub place_mm: f64,
    /// Angular diameters of the light as seen from the block.
    pub light_degrees: Vec<f64>,
    /// The relative RMS error up to which a picture counts as in focus; else twice that of the
    /// block.
    pub focus_error: Option<f64>,
}

impl Default for Tolerances {
    /// What is usual where nobody has measured.
    fn default() -> Self {
        Self {
            index: 0.01,
            distance_mm: 5.0,
            tilt_degrees: 1.0,
            form_error_um: 50.0,
            thickness_mm: 0.5,
            place_mm: 0.2,
            light_degrees: vec![0.53, 1.15],
            focus_error: None,
        }
    }
}

impl Tolerances {
    /// What the arguments say.
    ///
    /// # Errors
    /// Light whose size is no angle.
    pub fn of(args: &ToleranceArgs) -> Result<Self, Failure> {
        let degrees = |source: &SourceName| match source {
            SourceName::Angle(angle) => Ok(angle.deg),
            other => Err(Failure::Usage(format!(
                "`source-size {other}`: the light of a tolerance has an angular diameter as seen from the block, such as sun or 0.5deg"
            ))),
        };
        let usual = Self::default();
        Ok(Self {
            index: args.index_off,
            distance_mm: args.distance_off.mm,
            tilt_degrees: args.tilt_off.deg,
            form_error_um: 1e3 * args.form_error.mm,
            thickness_mm: args.thickness_off.mm,
            place_mm: args.place_off.mm,
            light_degrees: match args.source_size.as_slice() {
                [] => usual.light_degrees,
                given => given.iter().map(degrees).collect::<Result<_, _>>()?,
            },
            focus_error: args.focus_error,
        })
    }

    /// Refuses what cannot be looked at, before any work.
    ///
    /// # Errors
    /// A value out of range.
    pub fn check(&self) -> Result<(), Failure> {
        let within = |what: &str, value: f64, least: f64, greatest: f64| {
            if (least..=greatest).contains(&value) {
                Ok(())
            } else {
                Err(Failure::Usage(format!("{what} is {value}; it must lie between {least} and {greatest}")))
            }
        };
        within("the error of the index (`index-off`)", self.index, 0.0, 0.2)?;
        within("the error of the distance (`distance-off`), mm,", self.distance_mm, 0.0, 1e5)?;
        within("the tilt (`tilt-off`), degrees,", self.tilt_degrees, 0.0, 30.0)?;
        within("the form error (`form-error`), um,", self.form_error_um, 0.0, 1e4)?;
        within("the error of the thickness (`thickness-off`), mm,", self.thickness_mm, 0.0, 100.0)?;
        within("how far the block before stands aside (`place-off`), mm,", self.place_mm, 0.0, 100.0)?;
        self.light_degrees.iter().try_for_each(|light| {
            within("the angular diameter of the light (`source-size`), degrees,", *light, 0.0, 20.0)
        })?;
        self.focus_error.map_or(Ok(()), |error| within("the error of the focus (`focus-error`)", error, 0.0, 10.0))
    }
}

/// What tolerances do to a picture.
pub struct ToleranceStudy {
    /// As designed.
    pub designed: JudgedImage,
    /// What can be off.
    pub cases: Vec<ToleranceCase>,
    /// What means nothing on this bench.
    pub left_out: Vec<String>,
    /// The depth of focus; a failure where the focus that is asked for cannot be had.
    pub focus: Result<Focus, Failure>,
    /// From the mean plane of the exit face to the receiver.
    pub distance_mm: f64,
}

impl ToleranceStudy {
    /// Traces all cases.
    ///
    /// # Errors
    /// A block that throws no light into its window, a bench that cannot be.
    pub fn of(tolerances: &Tolerances, piece: &Workpiece, progress: &dyn Progress) -> Result<Self, Failure> {
        DesignedBench::of(piece)?.study(tolerances, progress)
    }

    /// The same for programs.
    pub fn document(&self) -> Option<document::Tolerances> {
        let Ok(Focus { limit, near_mm, far_mm }) = self.focus else { return None };
        Some(document::Tolerances {
            designed: document::finite(self.designed.metrics.rel_rms),
            cases: self.cases.iter().map(ToleranceCase::document).collect(),
            left_out: self.left_out.clone(),
            focus: document::Focus { limit, near_mm, far_mm },
        })
    }
}

/// The cases alone, without the depth of focus.
///
/// # Errors
/// Those of [`ToleranceStudy::of`].
pub fn cases(
    tolerances: &Tolerances,
    piece: &Workpiece,
    progress: &dyn Progress,
) -> Result<Vec<ToleranceCase>, Failure> {
    DesignedBench::of(piece)?.cases(tolerances, progress).map(|(_, cases, _)| cases)
}

/// What can be off, and what the picture is then.
pub struct ToleranceCase {
    /// What is off.
    pub name: String,
    /// The picture, and its relative RMS difference from that of the block as it was designed. None
    /// where none of the light falls into the window.
    pub view: Option<(JudgedImage, f64)>,
    /// Where it is.
    pub place: Place,
}

/// Where the picture is, and how large, against the design: there it is looked at.
#[derive(Clone, Copy)]
pub struct Place {
    /// How far it has moved on the receiver.
    pub moved_mm: DVec2,
    /// How much larger it is along x and y, as a ratio.
    pub growth: DVec2,
}

/// The distances between which the picture is in focus, mm; `None` where a side has no end within
/// what was looked at.
#[derive(Clone, Copy)]
pub struct Focus {
    /// The relative RMS error up to which a picture counts.
    pub limit: f64,
    /// The nearest.
    pub near_mm: Option<f64>,
    /// The furthest.
    pub far_mm: Option<f64>,
}

/// The spread of light that a block is designed for.
fn imperfect(design: &Settings) -> Option<&'static str> {
    let Settings { roughness, psf, .. } = design;
    match (design.spread_source(), roughness, psf) {
        (Some(_), ..) => Some("a source with a size"),
        (None, Some(_), _) => Some("a rough face"),
        (None, None, Some(_)) => Some("a measured spread of the light"),
        (None, None, None) => None,
    }
}

impl Place {
    const SAME: Self = Self { moved_mm: DVec2::ZERO, growth: DVec2::ONE };

    /// What a person would see without measuring.
    pub fn in_words(self) -> String {
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

impl ToleranceCase {
    fn document(&self) -> document::Tolerance {
        let view = self.view.as_ref();
        document::Tolerance {
            name: self.name.clone(),
            rel_rms: view.and_then(|(view, _)| document::finite(view.metrics.rel_rms)),
            ssim: view.and_then(|(view, _)| document::finite(view.metrics.ssim)),
            moved: view.and_then(|(_, moved)| document::finite(*moved)),
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
struct DesignedBench<'a> {
    piece: &'a Workpiece,
    block: Block,
    scene: Scene,
}

/// As designed, what can be off, and what means nothing on this bench.
type Cases = (JudgedImage, Vec<ToleranceCase>, Vec<String>);

impl<'a> DesignedBench<'a> {
    fn of(piece: &'a Workpiece) -> Result<Self, Failure> {
        let block = with_face(&piece.block, &piece.surface)?.with_spline();
        Ok(Self { piece, block, scene: piece.scene() })
    }

    fn study(&self, tolerances: &Tolerances, progress: &dyn Progress) -> Result<ToleranceStudy, Failure> {
        let (designed, cases, left_out) = self.cases(tolerances, progress)?;
        let focus = self.focus(designed.metrics.rel_rms, tolerances.focus_error);
        Ok(ToleranceStudy { designed, cases, left_out, focus, distance_mm: self.scene.distance_mm })
    }

    fn cases(&self, tolerances: &Tolerances, progress: &dyn Progress) -> Result<Cases, Failure> {
        let designed = self.view(self.traced(&self.block, &self.scene, BEAMS)?)?;
        let designed =
            designed.ok_or_else(|| Failure::Usage("none of the light of this block falls into its window".into()))?;
        let (changes, mut left_out) = self.changes(tolerances)?;
        let lights = match imperfect(&self.piece.side.design) {
            None => tolerances.light_degrees.as_slice(),
            Some(what) => {
                left_out.push(format!(
                    "the size of the light: the block is designed for {what}, in which `verify` looks at it"
                ));
                &[]
            }
        };
        begin(progress, "tracing tolerances", changes.len() + lights.len() + 1)?;
        let mut cases = Vec::new();
        for change in changes {
            cases.push(self.case(change, &designed)?);
            advance(progress, cases.len())?;
        }
        for &diameter in lights {
            let view = self.compared(self.extended_light(diameter)?, &designed)?;
            cases.push(ToleranceCase { name: format!("light {diameter} degrees across"), view, place: Place::SAME });
            advance(progress, cases.len())?;
        }
        Ok((designed, cases, left_out))
    }

    fn traced(&self, block: &Block, scene: &Scene, beams_per_pixel: usize) -> Result<Image, Failure> {
        let tracer = Tracer::for_block(block, scene).map_err(Failure::refused)?;
        Ok(self.piece.examiner.beams_through(block, &tracer, beams_per_pixel).image)
    }

    /// None where there is no light.
    fn view(&self, image: Image) -> Result<Option<JudgedImage>, Failure> {
        if image.values.iter().all(|&v| v == 0.0) {
            return Ok(None);
        }
        Ok(self.piece.examiner.compare(&image)?.map(|metrics| JudgedImage { image, metrics }))
    }

    fn compared(&self, image: Image, designed: &JudgedImage) -> Result<Option<(JudgedImage, f64)>, Failure> {
        let Some(view) = self.view(image)? else { return Ok(None) };
        let moved = metrics::rel_rms(&view.image, &designed.image).map_err(Failure::refused)?;
        Ok(Some((view, moved)))
    }

    fn case(&self, Change { name, block, scene }: Change, designed: &JudgedImage) -> Result<ToleranceCase, Failure> {
        let block = block.as_ref().unwrap_or(&self.block);
        let Followed { scene, moved_mm, growth } = follow_picture((&self.block, &self.scene), (block, scene))?;
        let view = self.compared(self.traced(block, &scene, BEAMS)?, designed)?;
        Ok(ToleranceCase { name, view, place: Place { moved_mm, growth } })
    }

    /// Other blocks and other benches, and what means nothing here.
    fn changes(&self, args: &Tolerances) -> Result<(Vec<Change>, Vec<String>), Failure> {
        let scene = &self.scene;
        let (mut changes, mut left_out) = (Vec::new(), Vec::new());
        let mut change = |name: String, block: Option<Block>, scene: Scene| changes.push(Change { name, block, scene });
        if let Optics::Refracts { ior } = scene.optics {
            for off in [-args.index, args.index] {
                let optics = Optics::Refracts { ior: ior + off };
                change(format!("index {:.4} ({off:+})", ior + off), None, Scene { optics, ..scene.clone() });
            }
        }
        for off in [-args.distance_mm, args.distance_mm] {
            let distance_mm = scene.distance_mm + off;
            let name = format!("receiver at {distance_mm} mm ({off:+})");
            change(name, None, Scene { distance_mm, ..scene.clone() });
        }
        for (axis, name) in [(DVec3::X, "x"), (DVec3::Y, "y")] {
            let scene = Scene { turned: axis * args.tilt_degrees.to_radians(), ..scene.clone() };
            let what = if scene.before.is_empty() { "block" } else { "all blocks" };
            change(format!("{what} turned by {} degrees about {name}", args.tilt_degrees), None, scene);
        }
        for (name, displaced, gap_mm) in displacements(args) {
            let mut moved = scene.clone();
            let Some(before) = moved.before.last_mut() else { break };
            (before.displaced, before.gap_mm) = (displaced, before.gap_mm + gap_mm);
            change(format!("the block before {name}"), None, moved);
        }
        let (size, peak_mm) = (self.piece.surface.extent().as_vec(), 1e-3 * args.form_error_um);
        let power = |p: DVec2| peak_mm * 4.0 * p.length_squared() / size.length_squared();
        let astigmatism = |p: DVec2| 2.0 * peak_mm * ((p.x / size.x).powi(2) - (p.y / size.y).powi(2));
        let forms: [(&str, &dyn Fn(DVec2) -> f64); 3] =
            [("hollow power", &power), ("bulging power", &|p| -power(p)), ("astigmatism", &astigmatism)];
        for (name, form) in forms {
            let block = with_face(&self.block, &with_form(&self.piece.surface, form))?;
            change(format!("form error of {} um, {name}", args.form_error_um), Some(block), scene.clone());
        }
        if scene.optics == Optics::Reflects {
            left_out
                .push("the index and the thickness of the stock, which light does not enter before a mirror".into());
            return Ok((changes, left_out));
        }
        let off = args.thickness_mm;
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

    /// The light of a disc around the bench's own, of equal power from every part of it: of
    /// directions, or of places of a lamp which is as large as that as seen from the middle of the
    /// block.
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

    /// The bench's light from a little beside its direction, or its place: by these tangents as
    /// seen from the middle of the block.
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
            return Err(Failure::BelowThreshold(format!(
                "no distance keeps to a relative RMS error of {limit} (`focus-error`): at the designed distance it is {designed:.4}"
            )));
        }
        let own = self.scene.distance_mm;
        // Where the receiver cuts the block, or where no light comes, there is no focus.
        let fits = |distance_mm: f64| -> Result<bool, Failure> {
            let to = Scene { distance_mm, ..self.scene.clone() };
            let Ok(there) = follow_picture((&self.block, &self.scene), (&self.block, to)) else { return Ok(false) };
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

/// How a block may stand beside its place before another one, and how much further away.
fn displacements(args: &Tolerances) -> Vec<(String, Displacement, f64)> {
    let (place, tilt) = (args.place_mm, args.tilt_degrees);
    let shifted = |shift_mm| Displacement { shift_mm, ..Displacement::default() };
    let turned = |axis: DVec3| Displacement { turned: axis * tilt.to_radians(), ..Displacement::default() };
    vec![
        (format!("{place} mm aside along x"), shifted(DVec3::X * place), 0.0),
        (format!("{place} mm aside along y"), shifted(DVec3::Y * place), 0.0),
        (format!("{place} mm further away"), Displacement::default(), place),
        (format!("{place} mm nearer"), Displacement::default(), -place),
        (format!("turned by {tilt} degrees about x"), turned(DVec3::X), 0.0),
        (format!("turned by {tilt} degrees about y"), turned(DVec3::Y), 0.0),
        (format!("turned by {tilt} degrees about the axis"), turned(DVec3::Z), 0.0),
    ]
}

fn with_form(surface: &HeightField, form: &dyn Fn(DVec2) -> f64) -> HeightField {
    let (extent, heights) = (surface.extent(), surface.heights_mm());
    let (nx, ny) = (heights.nx(), heights.ny());
    surface.with_heights(Field::from_fn(nx, ny, |i, j| heights[(i, j)] + form(extent.node(i, j, nx, ny))))
}
