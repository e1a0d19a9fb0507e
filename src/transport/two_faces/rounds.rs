//! The closed loop: look at the light of both faces on both receivers, and ask for less where there is
//! too much.

use super::{
    faces::Faces,
    solve::{NAME, RMS, Solved, Task, rectangle},
};
use crate::{
    forward::{
        Caustic,
        two_reliefs::{TwoReliefs, View},
    },
    optim::Summary,
    solver::{EntryFace, Event, Progress, Solution, SolveError},
    surface::{HeightField, SurfaceSpline},
    transport::{
        TransportOptions,
        correction::{Correction, STAGES},
        equation::State,
        level::FORCING,
        light::relative_rms,
        newton::Criterion,
        report::of_missed,
    },
};

/// Newton steps of a round.
const STEPS: usize = 12;
/// A round is solved when its residual is no more than this share of the error that was seen.
const RESIDUAL_SHARE: f64 = 0.12;
/// A round that takes away less than this share of the error is the last of its stage.
const LEAST_GAIN: f64 = 0.03;
/// Greatest correction of the mean height that can be meant, as a share of the distance.
const MOST_SHIFT: f64 = 0.1;
/// Relative RMS error of a picture that is worth a word.
const WEAK: f64 = 0.05;
/// Beams across a cell of the pictures, at least.
const BEAMS: usize = 8;

/// Both faces, and the light that they give.
struct Block {
    entry: HeightField,
    exit: HeightField,
    thickness_mm: f64,
    /// Nodes of the entry face whose ray was not found.
    missed: usize,
    seen: [Caustic; 2],
    errors: [f64; 2],
}

impl Block {
    fn error(&self) -> f64 {
        (0.5 * (self.errors[0] * self.errors[0] + self.errors[1] * self.errors[1])).sqrt()
    }
}

impl Solved {
    /// The phase and the exit face.
    fn unknowns(&self) -> [State; 2] {
        [self.phase.state.clone(), self.exit.state.clone()]
    }

    fn take_back(&mut self, [phase, exit]: &[State; 2]) {
        self.phase.state.clone_from(phase);
        self.exit.state.clone_from(exit);
    }
}

impl Task<'_> {
    /// Improves the solution; the best that was met is returned, with its light.
    ///
    /// # Errors
    /// A solve that broke down or was cancelled.
    pub(super) fn close(
        &self,
        options: &TransportOptions,
        mut solved: Solved,
        nodes: (usize, usize),
        progress: &dyn Progress,
        mut summary: Summary,
    ) -> Result<Solution, SolveError> {
        // Two pictures at once take a round more than one.
        let rounds = match options.rounds(&rectangle(self.block)) {
            0 => 0,
            rounds => rounds + 1,
        };
        let mut best: Option<Block> = None;
        let mut corrections: Option<[Correction; 2]> = None;
        let mut known = solved.unknowns();
        let mut stage = 0;
        progress.tell(Event::Stage { name: "closed loop", steps: rounds })?;
        for round in 0.. {
            progress.tell(Event::Iteration)?;
            let block = self.block(&mut solved, nodes)?;
            let error = block.error();
            tracing::debug!(round, stage, errors = ?block.errors, "the light of both faces");
            let contour = rectangle(self.block);
            let corrections = match &mut corrections {
                None => corrections.insert([0, 1].map(|k| {
                    let (light, seen) = (solved.films[k].light.clone(), block.seen[k].irradiance.clone());
                    Correction::new(light, seen, &solved.cells[k], solved.per_cell[k], &contour)
                })),
                Some(corrections) => {
                    for (k, correction) in corrections.iter_mut().enumerate() {
                        correction.learn(&solved.films[k].light, &block.seen[k].irradiance, &solved.cells[k]);
                    }
                    corrections
                }
            };
            let gain = best.as_ref().map_or(1.0, |best: &Block| 1.0 - error / best.error());
            if gain > 0.0 {
                best = Some(block);
                known = solved.unknowns();
            }
            stage += usize::from(gain.is_nan() || gain < LEAST_GAIN);
            if round >= rounds {
                break;
            }
            if gain.is_nan() || gain <= 0.0 {
                solved.take_back(&known);
            }
            let criterion = Criterion { rms: (RESIDUAL_SHARE * error).max(RMS), steps: STEPS, forcing: FORCING };
            let name = format!("closed loop {}", round + 1);
            // A correction that leaves no rays is tried once more, more gently.
            let mut corrected = false;
            while !corrected && stage < STAGES.len() {
                for (k, correction) in corrections.iter().enumerate() {
                    correction.next(&solved.cells[k], options.floor(), stage, &mut solved.films[k].light);
                }
                let phase = solved.phase(self, criterion, progress, &mut summary, &name);
                match phase.and_then(|_| solved.exit(self, criterion, progress, &mut summary, &name)) {
                    Ok(_) => corrected = true,
                    Err(SolveError::Cancelled) => return Err(SolveError::Cancelled),
                    Err(_) => {
                        solved.take_back(&known);
                        stage += 1;
                    }
                }
            }
            if !corrected {
                break;
            }
            progress.tell(Event::Step { done: round + 1 })?;
        }
        let best = best.ok_or_else(|| SolveError::Failed {
            solver: NAME,
            nx: nodes.0,
            ny: nodes.1,
            why: "the light of the faces is not a number".into(),
        })?;
        summary.warnings.extend(of_missed(best.missed));
        for (error, which) in best.errors.into_iter().zip(["first", "second"]).filter(|(error, _)| *error > WEAK) {
            summary.warnings.push(format!(
                "the light of the {which} picture differs from it by {error:.3} of its mean (root mean square); more nodes, a larger offset, or a thicker block bring it closer"
            ));
        }
        let [first, second] = best.seen;
        Ok(Solution::new(best.exit, summary)
            .with_entry(EntryFace { surface: best.entry, thickness_mm: best.thickness_mm })
            .with_light(vec![first.irradiance, second.irradiance]))
    }

    /// The faces of the block as they are solved for, and their light.
    fn block(&self, solved: &mut Solved, (nx, ny): (usize, usize)) -> Result<Block, SolveError> {
        let faces = self.faces(solved, (nx, ny));
        let glass_mm = faces.least_glass_mm();
        if glass_mm.is_nan() || glass_mm <= 0.0 {
            return Err(self.cuts(glass_mm));
        }
        let Faces { entry, exit, missed } = faces;
        let (entry_mm, exit_mm) = (entry.mean(), exit.mean());
        let thickness_mm = exit_mm - entry_mm;
        // The next face has its mean where it shall be.
        if exit_mm.abs() < MOST_SHIFT * self.distances_mm[0] {
            solved.exit.newton.height_mm -= exit_mm;
        }
        // The next solve has the right thickness.
        solved.constant_mm += (self.ior - 1.0) * (self.thickness_mm - thickness_mm);
        let entry = HeightField::new(self.block, entry);
        let exit = HeightField::new(self.block, exit);
        let faces = [&entry, &exit].map(SurfaceSpline::through);
        let views = [0, 1].map(|k| View {
            distance_mm: self.distances_mm[k],
            window: self.windows[k],
            cells: (solved.cells[k].nx(), solved.cells[k].ny()),
        });
        let along = |nodes: usize, cells: [usize; 2]| {
            (nodes - 1) * (BEAMS * cells[0].max(cells[1])).div_ceil(nodes - 1).clamp(2, 8)
        };
        let beams = (along(nx, views.map(|view| view.cells.0)), along(ny, views.map(|view| view.cells.1)));
        let glass = TwoReliefs { entry: &faces[0], exit: &faces[1], thickness_mm, ior: self.ior };
        let seen = glass.irradiance(views, beams);
        let errors = [0, 1].map(|k| relative_rms(&seen[k].irradiance, &solved.cells[k]));
        Ok(Block { entry, exit, thickness_mm, missed, seen, errors })
    }
}
