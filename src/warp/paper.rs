//! Brightness warping as the paper prints it: the reference of what the paper did.

use super::{
    limits::{LEAST_TARGET, NAME_PAPER, check_bench, check_light},
    locate::locate,
    mesh::ReceiverMesh,
    relief::normal_mapped_surface,
    solve::{AreaWeight, Run},
};
use crate::{
    irradiance::CausticMesh,
    optim::{OptionError, Summary},
    solver::{Problem, Progress, Solution, SolveError, Solver, check_nodes},
    surface::EdgeRule,
};
use std::sync::Arc;

/// Options of [`WarpingPaper`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct WarpingPaperOptions {
    /// The weight `lambda` of the area term in (14), which the paper does not state; `None`, the
    /// default, takes the one that is [balanced](super::WarpObjective::balanced_weight_mm2) on the
    /// finest level. At least 1e-12, at most 1e6.
    pub lambda: Option<f64>,
    /// Iterations at most on each level; default 200, as in the paper's figure 11; 1 to 100 000.
    pub iterations_per_level: usize,
}

impl Default for WarpingPaperOptions {
    fn default() -> Self {
        Self { lambda: None, iterations_per_level: 200 }
    }
}

impl WarpingPaperOptions {
    /// The same with this weight of the area term.
    #[must_use]
    pub fn with_lambda(self, lambda: f64) -> Self {
        Self { lambda: Some(lambda), ..self }
    }

    /// The same with so many iterations at most on each level.
    #[must_use]
    pub fn with_iterations_per_level(self, iterations: usize) -> Self {
        Self { iterations_per_level: iterations, ..self }
    }
}

/// Sections 2 and 3 of the paper with the corrections listed in [`warp`](super): one constant
/// `lambda`, a normal-mapped plane, quads of the mesh as many as intervals between height nodes,
/// outgoing directions interpolated barycentrically, slopes averaged over two nodes.
///
/// Takes every bench. The surface is right for a plane at the mean height, which costs accuracy in
/// proportion to its relief over the distance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WarpingPaper {
    options: WarpingPaperOptions,
    mesh: Option<Arc<CausticMesh>>,
}

impl WarpingPaper {
    /// A solver with these options.
    ///
    /// # Errors
    /// An option outside of its range.
    pub fn new(options: WarpingPaperOptions) -> Result<Self, OptionError> {
        if let Some(lambda) = options.lambda {
            OptionError::check("lambda", lambda, 1e-12, 1e6)?;
        }
        OptionError::check("iterations_per_level", options.iterations_per_level as f64, 1.0, 1e5)?;
        Ok(Self { options, mesh: None })
    }

    /// The same, with this mesh on the receiver in the place of the window.
    pub fn onto(self, mesh: Arc<CausticMesh>) -> Self {
        Self { mesh: Some(mesh), ..self }
    }
}

impl Solver for WarpingPaper {
    fn solve(
        &self,
        problem: &Problem<'_>,
        nodes: (usize, usize),
        progress: &dyn Progress,
    ) -> Result<Solution, SolveError> {
        let (bench, target) = problem.single(NAME_PAPER)?;
        check_nodes(NAME_PAPER, nodes)?;
        check_bench(NAME_PAPER, bench)?;
        let quads = (nodes.0 - 1, nodes.1 - 1);
        let receiver = ReceiverMesh::of(self.mesh.as_ref(), bench);
        let cells = receiver.flux(target, bench, quads);
        check_light(&cells, LEAST_TARGET)?;
        let lambda = self.options.lambda.unwrap_or_else(|| {
            let mean_area = bench.window().area_mm2() / (quads.0 * quads.1) as f64;
            super::WarpObjective::balanced_weight_mm2(bench, quads) / mean_area
        });
        let weight = AreaWeight::Constant(lambda);
        let mut run =
            Run { solver: NAME_PAPER, bench, receiver: &receiver, weight, progress, summary: Summary::default() };
        let mesh = run.pyramid(&cells, |_| self.options.iterations_per_level)?;
        let places = locate(&mesh, bench.block(), nodes);
        run.warn(&mesh, places.missed);
        let surface = normal_mapped_surface(&places, (&mesh, &receiver), bench, EdgeRule::TwoPoint)?;
        Ok(Solution::new(surface, run.summary))
    }
}
