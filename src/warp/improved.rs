//! Brightness warping that knows its own displacement and closes its loop.

use super::{
    limits::{LEAST_TARGET, NAME, check_bench, check_light},
    locate::{locate, refine},
    mesh::{ReceiverMesh, WarpMesh},
    pullback,
    relief::{check_rays, displaced_surface, landing_error_mm, mesh_heights},
    solve::{AreaWeight, Run},
};
use crate::{
    grid::{Field, area_resample},
    irradiance::CausticMesh,
    optim::{OptionError, Summary},
    solver::{Problem, Progress, Solution, SolveError, Solver, check_nodes},
    surface::{EdgeRule, HeightField, SurfaceSpline},
};
use std::sync::Arc;

/// Options of [`Warping`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct WarpingOptions {
    /// Iterations at most on levels of up to 80 quads along the longer side, where they cost
    /// milliseconds; default 500.
    pub coarse_iterations: usize,
    /// Iterations at most on finer levels; `None`, the default, takes 45, and 200 where the darkest
    /// part of the target is below a tenth of its mean.
    pub fine_iterations: Option<usize>,
    /// Passes that put the vertices at the height of the surface; default 2, 0 to 10. Without one
    /// the surface is that of a normal-mapped plane.
    pub height_passes: usize,
    /// Iterations of each such pass; default 15.
    pub height_iterations: usize,
    /// Rounds at most that correct the target by what the surface really draws; default 2, 0 to 5:
    /// the mesh suffers from more.
    pub closed_loop_rounds: usize,
    /// Iterations of each such round; default 16.
    pub closed_loop_iterations: usize,
}

impl Default for WarpingOptions {
    fn default() -> Self {
        Self {
            coarse_iterations: 500,
            fine_iterations: None,
            height_passes: 2,
            height_iterations: 15,
            closed_loop_rounds: 2,
            closed_loop_iterations: 16,
        }
    }
}

impl WarpingOptions {
    /// The same with other limits of the iterations on coarse and on fine levels.
    #[must_use]
    pub fn with_iterations(self, coarse: usize, fine: Option<usize>) -> Self {
        Self { coarse_iterations: coarse, fine_iterations: fine, ..self }
    }

    /// The same with so many passes that put the vertices at the height of the surface, of so many
    /// iterations each.
    #[must_use]
    pub fn with_height_passes(self, passes: usize, iterations: usize) -> Self {
        Self { height_passes: passes, height_iterations: iterations, ..self }
    }

    /// The same with so many rounds of the closed loop at most, of so many iterations each.
    #[must_use]
    pub fn with_closed_loop(self, rounds: usize, iterations: usize) -> Self {
        Self { closed_loop_rounds: rounds, closed_loop_iterations: iterations, ..self }
    }
}

/// The paper's method with `lambda` in proportion to the squared cell size, quads aligned with the
/// pixels of the target, a surface that is displaced as it will be milled, a smooth inverse of the
/// warp, slopes of fourth order, and a closed loop.
///
/// Light must come along the axis; the window may have any size and place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Warping {
    options: WarpingOptions,
    mesh: Option<Arc<CausticMesh>>,
}

/// Longest side, in quads, of a level that is cheap enough to converge fully.
const COARSE_QUADS: usize = 80;
/// Least number of quads along the shorter side of the finest mesh, however small the picture.
const LEAST_QUADS: usize = 32;

impl Warping {
    /// A solver with these options.
    ///
    /// # Errors
    /// An option outside of its range.
    pub fn new(options: WarpingOptions) -> Result<Self, OptionError> {
        let check = |name, value: usize, least, greatest| OptionError::check(name, value as f64, least, greatest);
        check("coarse_iterations", options.coarse_iterations, 1.0, 1e5)?;
        check("fine_iterations", options.fine_iterations.unwrap_or(1), 1.0, 1e5)?;
        check("height_passes", options.height_passes, 0.0, 10.0)?;
        check("height_iterations", options.height_iterations, 1.0, 1e5)?;
        check("closed_loop_rounds", options.closed_loop_rounds, 0.0, 5.0)?;
        check("closed_loop_iterations", options.closed_loop_iterations, 1.0, 1e5)?;
        Ok(Self { options, mesh: None })
    }

    /// The same, with this mesh on the receiver in the place of the window.
    pub fn onto(self, mesh: Arc<CausticMesh>) -> Self {
        Self { mesh: Some(mesh), ..self }
    }
}

/// Quads of the finest mesh: one for each pixel, or a whole number of them when the height grid is
/// at least twice as fine; as many as the height grid has intervals when it is much coarser than
/// the picture.
fn finest_quads(pixels: (usize, usize), nodes: (usize, usize)) -> (usize, usize) {
    let intervals = (nodes.0 - 1, nodes.1 - 1);
    let per_pixel = (4 * intervals.0 / (5 * pixels.0)).min(4 * intervals.1 / (5 * pixels.1)).max(1);
    let per_pixel = per_pixel.max(LEAST_QUADS.div_ceil(pixels.0.min(pixels.1)));
    let axis = |pixels: usize, intervals: usize| {
        // Up to 1.5 pixels for a node the alignment is worth more than the match of the grids.
        if 2 * pixels > 3 * intervals { intervals.max(4) } else { per_pixel * pixels }
    };
    (axis(pixels.0, intervals.0), axis(pixels.1, intervals.1))
}

impl Solver for Warping {
    fn solve(
        &self,
        problem: &Problem<'_>,
        nodes: (usize, usize),
        progress: &dyn Progress,
    ) -> Result<Solution, SolveError> {
        let (bench, target) = problem.single(NAME)?;
        check_nodes(NAME, nodes)?;
        check_bench(NAME, bench)?;
        if bench.light_direction().truncate().length() > 1e-9 {
            let what = "light at an angle to the axis";
            return Err(SolveError::Unsupported { solver: NAME, what, able: "transport" });
        }
        let receiver = ReceiverMesh::of(self.mesh.as_ref(), bench);
        let quads = finest_quads(receiver.pixels(target, bench), nodes);
        let wanted = receiver.flux(target, bench, quads);
        check_light(&wanted, LEAST_TARGET)?;
        let weight = AreaWeight::Balanced(1.0);
        let mut run = Run { solver: NAME, bench, receiver: &receiver, weight, progress, summary: Summary::default() };
        let dark = wanted.min_max().0 < 0.1;
        let fine = self.options.fine_iterations.unwrap_or(if dark { 200 } else { 45 });
        let coarse = |q: (usize, usize)| q.0.max(q.1) <= COARSE_QUADS;
        let mesh = run.pyramid(&wanted, |q| if coarse(q) { self.options.coarse_iterations } else { fine })?;
        let heights = Field::filled(quads.0 + 1, quads.1 + 1, 0.0);
        let mut state = State { mesh, heights };
        // Of a window the pixels as they are, of a mesh its quads.
        let flux = if self.mesh.is_none() { target.cells() } else { &wanted };
        for pass in 1..=self.options.height_passes {
            let stage = format!("height-aware pass {pass}");
            state.displace(&mut run, &stage, &wanted, self.options.height_iterations)?;
        }
        let (mut surface, mut shortfall) = state.surface(&run, nodes)?;
        let mut best_mesh = None;
        if self.options.closed_loop_rounds > 0 {
            let mut best = Drawn::by(&surface, &state.mesh, &run, flux);
            let (mut solver_target, mut latest) = (wanted.clone(), best.clone());
            for round in 1..=self.options.closed_loop_rounds {
                solver_target = latest.corrected(&solver_target, flux);
                let stage = format!("closed loop {round}");
                state.displace(&mut run, &stage, &solver_target, self.options.closed_loop_iterations)?;
                let (next, next_shortfall) = state.surface(&run, nodes)?;
                latest = Drawn::by(&next, &state.mesh, &run, flux);
                if latest.error < best.error {
                    (surface, shortfall, best) = (next, next_shortfall, latest.clone());
                    best_mesh = Some(state.mesh.clone());
                } else {
                    break;
                }
            }
        }
        run.warn(best_mesh.as_ref().unwrap_or(&state.mesh), shortfall.missed);
        run.summary.notes.extend(
            shortfall
                .off_mm
                .map(|off| format!("light lands {off:.4} mm (root mean square) from its place on the caustic mesh")),
        );
        run.summary.warnings.extend(shortfall.warning(bench.window().width_mm / target.cells().nx() as f64));
        Ok(Solution::new(surface, run.summary))
    }
}

/// A warp and the heights of its vertices, mm.
struct State {
    mesh: WarpMesh,
    heights: Field<f64>,
}

impl State {
    /// Freezes the vertices at the height they have now, and minimises again.
    fn displace(
        &mut self,
        run: &mut Run<'_>,
        stage: &str,
        cells: &Field<f64>,
        iterations: usize,
    ) -> Result<(), SolveError> {
        self.heights = mesh_heights(&self.mesh, run.receiver, run.bench, &self.heights)?;
        let depth = self.heights.map(|z| run.bench.distance_mm() - z);
        run.minimise(stage, &mut self.mesh, cells, &depth, iterations)?;
        check_rays(&self.mesh, run.receiver, &depth, run.bench)
    }

    /// The surface on the regular grid, and what it falls short of.
    fn surface(&self, run: &Run<'_>, nodes: (usize, usize)) -> Result<(HeightField, Shortfall), SolveError> {
        let block = run.bench.block();
        let mut places = locate(&self.mesh, block, nodes);
        let missed = refine(&mut places, &self.mesh, block);
        let surface = displaced_surface(&places, run.receiver, &self.heights, run.bench, EdgeRule::FourPoint)?;
        let quads = (self.mesh.vertices().0 - 1, self.mesh.vertices().1 - 1);
        let off_mm = match run.receiver {
            ReceiverMesh::Window { .. } => None,
            ReceiverMesh::Given(_) => Some(landing_error_mm(&surface, &places, run.receiver, quads, run.bench)),
        };
        Ok((surface, Shortfall { missed, off_mm }))
    }
}

/// Part of a pixel by which light may miss its place on a mesh without a warning.
const MOST_OFF: f64 = 0.25;

/// What a surface falls short of its warp.
#[derive(Clone, Copy)]
struct Shortfall {
    /// Nodes without a unique place in the warp.
    missed: usize,
    /// How far light lands from its place on a mesh that was given, root mean square, mm.
    off_mm: Option<f64>,
}

impl Shortfall {
    /// What a user should know who gave a mesh for a picture with pixels of this size.
    fn warning(&self, pixel_mm: f64) -> Option<String> {
        // A number that is none is no small one.
        let off_mm = self.off_mm.filter(|off| off.is_nan() || *off > MOST_OFF * pixel_mm)?;
        Some(format!(
            "the light misses its place on the caustic mesh by {off_mm:.3} mm (root mean square): no smooth face turns light round its axis as this mesh asks; turn the mesh so that its sides run along those of the block, and bend it less"
        ))
    }
}

/// What a surface draws on the pixels of the target, or on the quads of a mesh.
#[derive(Clone)]
struct Drawn {
    /// Not a number where it is unknown.
    flux: Field<f64>,
    /// Relative RMS difference from the target, where unknown pixels count as dark.
    error: f64,
}

/// A correction of the target at most by this factor in one round.
const GREATEST_CORRECTION: f64 = 2.0;

impl Drawn {
    fn by(surface: &HeightField, mesh: &WarpMesh, run: &Run<'_>, wanted: &Field<f64>) -> Self {
        let cells = (wanted.nx(), wanted.ny());
        let flux = pullback::flux(&SurfaceSpline::through(surface), (mesh, run.receiver), run.bench, cells);
        let square = Field::from_fn(cells.0, cells.1, |i, j| {
            let drawn = flux[(i, j)];
            (if drawn.is_nan() { 0.0 } else { drawn } - wanted[(i, j)]).powi(2)
        });
        Self { error: square.mean().sqrt(), flux }
    }

    /// `solver_target * wanted / drawn`, on the quads of `solver_target`; unchanged where it is
    /// unknown what is drawn.
    fn corrected(&self, solver_target: &Field<f64>, wanted: &Field<f64>) -> Field<f64> {
        let (mx, my) = (solver_target.nx(), solver_target.ny());
        let wanted = area_resample(wanted, mx, my);
        let drawn = area_resample(&self.flux, mx, my);
        Field::from_fn(mx, my, |i, j| {
            let ratio = wanted[(i, j)] / drawn[(i, j)].max(f64::MIN_POSITIVE);
            let factor = if drawn[(i, j)].is_nan() { 1.0 } else { ratio };
            solver_target[(i, j)] * factor.clamp(1.0 / GREATEST_CORRECTION, GREATEST_CORRECTION)
        })
    }
}
