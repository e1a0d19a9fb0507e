//! What both modes of brightness warping share: minimising level by level, and reporting it.

use super::{
    mesh::{ReceiverMesh, WarpMesh, pyramid},
    objective::WarpObjective,
    relief::check_rays,
};
use crate::{
    bench::Bench,
    grid::{Field, area_resample},
    optim::{Iteration, Level, MinimiserOptions, Summary, Termination, minimise},
    solver::{Event, Progress, SolveError},
};

/// How the two terms of (14) are weighed against each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AreaWeight {
    /// The paper's constant `lambda`, free of units, the same on every level.
    Constant(f64),
    /// A multiple of the [balanced weight](WarpObjective::balanced_weight_mm2), so that `lambda`
    /// scales with the square of the cell size and every level is equally well conditioned.
    Balanced(f64),
}

impl AreaWeight {
    /// `lambda * mean A_d` on a level, mm².
    pub(crate) fn weight_mm2(self, bench: &Bench, quads: (usize, usize)) -> f64 {
        match self {
            Self::Constant(lambda) => lambda * bench.window().area_mm2() / (quads.0 * quads.1) as f64,
            Self::Balanced(factor) => factor * WarpObjective::balanced_weight_mm2(bench, quads),
        }
    }
}

/// First trial step of a minimisation, in cells.
const FIRST_MOVE: f64 = 0.02;

/// One solve in progress.
pub(crate) struct Run<'a> {
    pub(crate) solver: &'static str,
    pub(crate) bench: &'a Bench,
    pub(crate) receiver: &'a ReceiverMesh,
    pub(crate) weight: AreaWeight,
    pub(crate) progress: &'a dyn Progress,
    pub(crate) summary: Summary,
}

impl Run<'_> {
    /// Solves from the coarsest level to the finest, whose quads are `cells`; `iterations` gives
    /// the limit for a level.
    ///
    /// # Errors
    /// Light that cannot be bent as far as the coarse levels ask, or a breakdown of the numerics.
    pub(crate) fn pyramid(
        &mut self,
        cells: &Field<f64>,
        iterations: impl Fn((usize, usize)) -> usize,
    ) -> Result<WarpMesh, SolveError> {
        let levels = pyramid((cells.nx(), cells.ny()));
        let mut mesh = WarpMesh::regular(self.bench.block(), levels[0]);
        for quads in levels {
            mesh = mesh.prolonged(quads);
            let cells = area_resample(cells, quads.0, quads.1);
            let depth = Field::filled(quads.0 + 1, quads.1 + 1, self.bench.distance_mm());
            self.minimise("pyramid", &mut mesh, &cells, &depth, iterations(quads))?;
            check_rays(&mesh, self.receiver, &depth, self.bench)?;
        }
        Ok(mesh)
    }

    /// Minimises (14) on one level.
    ///
    /// # Errors
    /// A breakdown of the numerics.
    pub(crate) fn minimise(
        &mut self,
        stage: &str,
        mesh: &mut WarpMesh,
        cells: &Field<f64>,
        depth_mm: &Field<f64>,
        iteration_limit: usize,
    ) -> Result<(), SolveError> {
        let started = self.progress.clock();
        let (nx, ny) = mesh.vertices();
        let failed = |why: String| SolveError::Failed { solver: self.solver, nx, ny, why };
        let weight = self.weight.weight_mm2(self.bench, (nx - 1, ny - 1));
        let mut objective = WarpObjective::onto(self.receiver, self.bench, cells, weight);
        objective.set_depth(depth_mm.clone());
        // A first step beyond a small part of a cell could fold the mesh for good.
        let cell = self.bench.block().node_spacing(nx, ny).min_element();
        let options =
            MinimiserOptions { iteration_limit, first_move: Some(FIRST_MOVE * cell), ..MinimiserOptions::default() };
        let progress = self.progress;
        progress.tell(Event::Stage { name: &format!("{stage}, {nx} x {ny}"), steps: iteration_limit })?;
        let watch = |done, _: &Iteration| progress.report(Event::Step { done });
        let outcome = minimise(&mut objective, &mut mesh.coordinates, &options, watch)
            .map_err(|error| failed(error.to_string()))?;
        if outcome.termination == Termination::Cancelled {
            return Err(SolveError::Cancelled);
        }
        if !outcome.objective.is_finite() {
            return Err(failed(format!("the objective is {}", outcome.objective)));
        }
        progress.tell(Event::Step { done: iteration_limit })?;
        self.summary.levels.push(Level {
            stage: stage.to_owned(),
            nx,
            ny,
            termination: outcome.termination,
            iterations: outcome.iterations,
            elapsed: progress.clock().saturating_sub(started),
        });
        Ok(())
    }

    /// Warns of what the finished mesh is short of.
    pub(crate) fn warn(&mut self, mesh: &WarpMesh, missed: usize) {
        let folds = mesh.folds();
        let quads = (mesh.vertices().0 - 1) * (mesh.vertices().1 - 1);
        let warnings = &mut self.summary.warnings;
        if folds.inverted + folds.concave > 0 {
            warnings.push(format!(
                "of {quads} quads {} are inverted and {} concave: the light folds there; a higher offset avoids it",
                folds.inverted, folds.concave
            ));
        }
        if missed > 0 {
            warnings.push(format!("{missed} height nodes have no unique place in the warp and took that of a neighbour: a higher offset avoids it"));
        }
        let unfinished = |level: &&Level| level.stage == "pyramid" && level.termination == Termination::IterationLimit;
        if let Some(level) = self.summary.levels.iter().filter(unfinished).min_by_key(|level| level.nx) {
            let (nx, ny) = (level.nx, level.ny);
            warnings.push(format!("levels from {nx} x {ny} vertices on stopped at their iteration limit"));
        }
    }
}
