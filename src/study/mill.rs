//! A block milled and polished in simulation, and its picture after every step.

use super::{
    bench::exit_face,
    changed::deflection_mm,
    design::shape,
    imperfect::if_it_is_the_sun,
    progress::{advance, begin},
    verdict::{Answer, Verdict, seen_in_words},
    workpiece::{JudgedImage, Workpiece, view_milled, walls_of},
};
use crate::{
    export,
    fabricate::{Milled, Pass, RowsCost, Scallop, Unreached, Walls},
    failure::Failure,
    record::{BenchRecord, document},
    solid::{Shape, Solid, Stock},
    solver::Progress,
    surface::{HeightField, Polish},
};
use glasswarp_verify::{Image, metrics::Likeness};

/// A step of the work, and the light after it.
pub struct MillStep {
    /// What was done.
    pub name: String,
    /// The face after it.
    pub surface: HeightField,
    /// The light after it.
    pub view: JudgedImage,
    /// Whether this is what the cutter leaves.
    is_milled: bool,
}

impl MillStep {
    /// A step that is none of the cutter's.
    pub(super) fn new(name: &str, surface: HeightField, view: JudgedImage) -> Self {
        Self { name: name.to_owned(), surface, view, is_milled: false }
    }

    /// The same for programs.
    pub fn document(&self) -> document::MillStep {
        let heights = self.surface.heights_mm();
        document::MillStep {
            name: self.name.clone(),
            rel_rms: document::finite(self.view.metrics.rel_rms),
            ssim: document::finite(self.view.metrics.ssim),
            nodes: [heights.nx(), heights.ny()],
        }
    }
}

/// A block worked on in simulation.
pub struct MillStudy {
    /// The pass.
    pub pass: Pass,
    /// The polish after it.
    pub polish: Option<Polish>,
    /// The face as designed, then as it is after every step; at least two.
    pub steps: Vec<MillStep>,
    /// The way of the cutter.
    pub cost: RowsCost,
    /// The ridges that the cutter leaves, and how far they throw light, mm.
    pub scallop: Option<(Scallop, f64)>,
    /// What the wall of a rim keeps the cutter from, if there is any.
    pub unreached: Option<Unreached>,
}

impl MillStudy {
    /// Mills and polishes a block.
    ///
    /// # Errors
    /// A pass that does not fit the block.
    pub fn of(piece: &Workpiece, pass: Pass, polish: Option<Polish>, progress: &dyn Progress) -> Result<Self, Failure> {
        pass.check(piece.surface.extent()).map_err(Failure::refused)?;
        begin(progress, "milling and tracing", 2 + 2 * usize::from(polish.is_some()))?;
        let step = |name: &str, surface: HeightField| -> Result<MillStep, Failure> {
            Ok(MillStep { name: name.into(), view: piece.view(&surface)?, surface, is_milled: false })
        };
        let mut steps = vec![step("as designed", piece.surface.clone())?];
        advance(progress, 1)?;
        let walls = walls_of(&piece.block, &piece.surface, pass.cutter);
        let milled = mill(&piece.surface, &pass, walls.as_ref())?;
        let name = format!("milled with {}, rows {} mm apart", pass.cutter.in_words(), pass.step_over_mm);
        let (view, surface) = view_milled(&piece.examiner, &piece.block, &piece.surface, milled)?;
        steps.push(MillStep { name, view, surface, is_milled: true });
        advance(progress, 2)?;
        if let Some(polish) = polish {
            let name = format!("and polished, sigma {} mm", polish.sigma_mm());
            steps.push(step(&name, polished(&steps[1].surface, &piece.surface, polish))?);
            advance(progress, 3)?;
            // The same polish without scallops tells what costs what.
            let alone = format!("polished alone, sigma {} mm", polish.sigma_mm());
            steps.insert(1, step(&alone, polish.polished(&piece.surface))?);
            advance(progress, 4)?;
        }
        let scallop = Scallop::of(pass.cutter, pass.step_over_mm);
        let deflected = |scallop: Scallop| {
            let across = [pass.direction.unit().perp()];
            Ok::<_, Failure>((scallop, deflection_mm(&piece.block, &piece.scene(), scallop.slope, &across)?))
        };
        let scallop = scallop.map(deflected).transpose()?;
        let unreached = walls.map(|walls| walls.unreached()).filter(|unreached| unreached.share > 0.0);
        Ok(Self { pass, polish, steps, cost: pass.cost(&piece.surface.contour()), scallop, unreached })
    }

    /// The face in the end.
    pub fn last(&self) -> &MillStep {
        &self.steps[self.steps.len() - 1]
    }

    /// The block as it is in the end, its record, and what was done to it, in words: on the nodes
    /// of the design where these hold the face, after a polish that leaves nothing of the scallops.
    ///
    /// # Errors
    /// A face of more nodes than a file of it could hold.
    pub fn result(&self, piece: &Workpiece) -> Result<(Solid, BenchRecord, String), Failure> {
        let Self { pass, polish, .. } = self;
        // Beside the wall of a rim the face goes up within a few of them.
        let smooth = self.unreached.is_none() && polish.is_some_and(|polish| polish.sigma_mm() >= pass.step_over_mm);
        let (nx, ny) = (piece.surface.heights_mm().nx(), piece.surface.heights_mm().ny());
        let last = self.last();
        let surface = if smooth { last.surface.resampled(nx, ny) } else { last.surface.clone() };
        let nodes = surface.heights_mm().as_slice().len();
        if nodes > MOST_FILE_NODES {
            return Err(Failure::Usage(format!(
                "a file with every scallop takes {nodes} nodes, more than {MOST_FILE_NODES}: take a larger step-over, or polish with at least `polish` {}mm, after which the design's own nodes hold the face",
                pass.step_over_mm
            )));
        }
        // The entry face stays where it is, and so does what stands around the exit face, which has
        // its skirt already.
        let mut shape = Shape { skirt_mm: 0.0, ..shape(&piece.side.design)? };
        let surface = match (&mut shape.rim, piece.block.rim_z_mm()) {
            // The rim stays where it is, although beside its wall the face now reaches up to it.
            (Some(rim), Some(top_mm)) if rim.rise_mm > 0.0 => {
                let surface = below(surface, top_mm - LEAST_WALL_MM);
                rim.rise_mm = top_mm - Solid::highest_mm(&surface);
                surface
            }
            _ => surface,
        };
        let rise_mm = shape.rim.map_or(0.0, |rim| rim.rise_mm.max(0.0));
        let thickness_mm = Solid::highest_mm(&surface) + rise_mm - piece.block.entry_z_mm();
        let stock = Stock::of_thickness(thickness_mm).leaving_at_least(Stock::LIMITS_MM.0);
        let solid = Solid::shaped(&surface, stock, shape).map_err(Failure::refused)?;
        let (heights, corner) = (solid.surface().heights_mm(), solid.surface().contour().radius_mm());
        let bench = BenchRecord {
            entry_z_mm: solid.entry_z_mm(),
            relief_mm: surface.relief_mm(),
            thinnest_mm: solid.thinnest_mm(),
            nodes: [heights.nx(), heights.ny()],
            corner_radius_mm: corner.to_array(),
            ..piece.side.bench.clone()
        };
        let allowance =
            if pass.allowance_mm > 0.0 { format!(", leaving {} mm", pass.allowance_mm) } else { String::new() };
        let polished = polish.map(|p| format!(", polished with sigma {} mm", p.sigma_mm())).unwrap_or_default();
        let before = piece.side.work.as_ref().map(|work| format!("{}; ", work.done)).unwrap_or_default();
        let done = format!(
            "{before}milled in simulation with {}, rows {} mm apart along {}{allowance}{polished}",
            pass.cutter.in_words(),
            pass.step_over_mm,
            pass.direction
        );
        Ok((solid, bench, done))
    }

    /// What exporters say of the block in the end; `name` is that of the block before.
    pub fn export_design(&self, piece: &Workpiece, name: &str) -> export::Design {
        let before = &piece.side.bench;
        export::Design { name: format!("{name} milled"), exit_face: exit_face(before), distance_mm: before.distance_mm }
    }
}

/// What would make a better picture of a milled face, tried in simulation.
struct MillRemedy {
    /// A polish or a step-over, in words. Settings stand in backticks.
    says: String,
    /// How alike the picture then is.
    likeness: Likeness,
}

/// Standard deviations of a polish that are tried for scallops, in step-overs: from where half of
/// their slope is left to where nothing is.
const POLISHES: [f64; 4] = [0.35, 0.5, 0.7, 1.0];
/// Halvings of the step-over that are tried.
const HALVINGS: i32 = 3;
/// Most nodes of a milled face that a remedy is looked for with.
const MOST_TRIED_NODES: usize = 60_000_000;

impl MillStudy {
    /// Answers whether the finished face draws the picture in perfect light; where it hardly does,
    /// with a polish or a step-over that would do better, tried in simulation.
    ///
    /// # Errors
    /// A pass that does not fit the block; cancellation.
    pub fn say(&self, piece: &Workpiece, progress: &dyn Progress, verdict: &mut Verdict) -> Result<(), Failure> {
        let likeness = Likeness::from(&self.last().view.metrics);
        let (answer, words) = seen_in_words(likeness.ssim);
        let mut says = format!("{words} ({}), {}", figures(likeness), self.done_in_words());
        if answer != Answer::Yes {
            says += &self.remedy_in_words(piece, &|image| likeness_in_perfect_light(piece, image), progress)?;
        }
        verdict.say("picture", answer, says);
        verdict.say_light(if_it_is_the_sun(&piece.bench, &piece.side.design).is_none());
        Ok(())
    }

    /// What would do better, as the end of a sentence. `judged` tells how alike the picture is where
    /// this image falls in perfect light.
    pub(super) fn remedy_in_words(
        &self,
        piece: &Workpiece,
        judged: &dyn Fn(&Image) -> Result<Likeness, Failure>,
        progress: &dyn Progress,
    ) -> Result<String, Failure> {
        Ok(match self.remedy(piece, judged, progress)? {
            Some(MillRemedy { says, likeness }) => format!("; {says} gives {}", figures(likeness)),
            None => "; neither a polish nor a finer step-over that was tried does better: design for it with \
                     `finish`, or take another cutter"
                .to_owned(),
        })
    }

    /// Tries polishes, which cost the shop least, then finer step-overs; returns the first that the
    /// eye is content with, or the best.
    fn remedy(
        &self,
        piece: &Workpiece,
        judged: &dyn Fn(&Image) -> Result<Likeness, Failure>,
        progress: &dyn Progress,
    ) -> Result<Option<MillRemedy>, Failure> {
        begin(progress, "looking for a better finish", POLISHES.len() + HALVINGS as usize)?;
        let own = judged(&self.last().view.image)?.ssim;
        let mut best: Option<MillRemedy> = None;
        let mut better = |says: String, image: &Image| -> Result<bool, Failure> {
            let likeness = judged(image)?;
            if likeness.ssim > best.as_ref().map_or(own, |best| best.likeness.ssim) {
                best = Some(MillRemedy { says, likeness });
            }
            Ok(seen_in_words(likeness.ssim).0 == Answer::Yes)
        };
        let step_over_mm = self.pass.step_over_mm;
        let milled = self.steps.iter().find(|step| step.is_milled).map(|step| &step.surface);
        let nodes = milled.map_or(usize::MAX, |face| face.heights_mm().as_slice().len());
        let stronger = |sigma_mm: f64| self.polish.is_none_or(|polish| sigma_mm > 1.05 * polish.sigma_mm());
        for (k, part) in POLISHES.into_iter().enumerate() {
            let sigma_mm = (1e3 * part * step_over_mm).ceil() / 1e3;
            if let Some(milled) = milled.filter(|_| stronger(sigma_mm)) {
                let polish = Polish::new(sigma_mm).map_err(Failure::refused)?;
                let view = piece.view(&polished(milled, &piece.surface, polish))?;
                if better(format!("`polish` {sigma_mm}mm"), &view.image)? {
                    return Ok(best);
                }
            }
            advance(progress, k + 1)?;
        }
        for halving in 1..=HALVINGS {
            let pass = Pass { step_over_mm: step_over_mm * 0.5_f64.powi(halving), ..self.pass };
            // A row takes as many nodes, however near the next one is.
            let finer = nodes.saturating_mul(1 << halving);
            if finer <= MOST_TRIED_NODES && pass.check(piece.surface.extent()).is_ok() {
                let walls = walls_of(&piece.block, &piece.surface, pass.cutter);
                let milled = mill(&piece.surface, &pass, walls.as_ref())?;
                let (view, kept) = match self.polish {
                    Some(polish) => {
                        (piece.view(&polished(&milled.surface, &piece.surface, polish))?, " and the same polish")
                    }
                    None => (view_milled(&piece.examiner, &piece.block, &piece.surface, milled)?.0, ""),
                };
                if better(format!("`step-over` {}mm{kept}", pass.step_over_mm), &view.image)? {
                    return Ok(best);
                }
            }
            advance(progress, POLISHES.len() + halving as usize)?;
        }
        Ok(best)
    }

    /// Cutter, rows and polish in a line.
    pub fn done_in_words(&self) -> String {
        let polish = self.polish.map(|polish| format!(", polish {} mm", polish.sigma_mm())).unwrap_or_default();
        format!("cut with {}, rows {} mm apart{polish}", self.pass.cutter.in_words(), self.pass.step_over_mm)
    }
}

/// The two figures that tell most.
pub(super) fn figures(likeness: Likeness) -> String {
    format!("SSIM {:.3}, relative RMS {:.3}", likeness.ssim, likeness.rel_rms)
}

fn likeness_in_perfect_light(piece: &Workpiece, image: &Image) -> Result<Likeness, Failure> {
    let likeness = piece.examiner.likeness(image)?;
    likeness.ok_or_else(|| Failure::Usage("there is no picture to compare with".into()))
}

/// What is left of the wall of a rim in a file, at least, mm: less could not be told from none.
const LEAST_WALL_MM: f64 = 0.06;

/// A face that reaches no higher than this, mm.
fn below(surface: HeightField, most_mm: f64) -> HeightField {
    let mut heights = surface.heights_mm().clone();
    heights.as_mut_slice().iter_mut().for_each(|height| *height = height.min(most_mm));
    surface.with_heights(heights)
}

/// A file of this many nodes has a gigabyte as STL.
const MOST_FILE_NODES: usize = 10_000_000;

/// The face that a pass leaves within the walls around it.
pub fn mill(surface: &HeightField, pass: &Pass, walls: Option<&Walls<'_>>) -> Result<Milled, Failure> {
    let milled = Milled::of(surface, *pass).map_err(Failure::refused)?;
    Ok(match walls {
        Some(walls) => walls.kept(milled),
        None => milled,
    })
}

/// A milled face after its polish, on no more nodes than it then needs and on no fewer than the
/// design has: at a spacing of half the standard deviation the polish has left 3e-9 of the shortest
/// wave that the nodes hold.
pub fn polished(milled: &HeightField, design: &HeightField, polish: Polish) -> HeightField {
    let (fine, coarse) = (milled.heights_mm(), design.heights_mm());
    let polished = polish.polished(milled);
    let enough = |size: f64, fine: usize, coarse: usize| {
        let cells = 2.0 * size / polish.sigma_mm();
        (1 + cells.ceil().clamp(0.0, 1e9) as usize).max(coarse).min(fine)
    };
    let extent = milled.extent();
    let (nx, ny) = (enough(extent.width_mm, fine.nx(), coarse.nx()), enough(extent.height_mm, fine.ny(), coarse.ny()));
    if (nx, ny) == (fine.nx(), fine.ny()) { polished } else { polished.resampled(nx, ny) }
}
