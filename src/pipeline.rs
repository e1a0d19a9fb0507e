//! The spine: from a target on a bench to a closed block.

use crate::{
    bench::{Bench, ExitFace},
    grid::{Contour, Extent, Field},
    optics::Interface,
    optim::Summary,
    solid::{Blank, Solid, SolidError},
    solver::{Problem, Progress, Solution, SolveError, Solver},
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;

/// A block that was designed: the faces that were found, and the solid between them.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct DesignedBlock {
    /// The exit face.
    pub surface: HeightField,
    /// The closed solid under it.
    pub solid: Solid,
    /// Its light as the solver sees it, for every target, see
    /// [`Solution::light`](crate::solver::Solution::light).
    pub light: Vec<Field<f64>>,
    /// What the solver did.
    pub summary: Summary,
}

impl DesignedBlock {
    /// The share of the solid's exit face beyond the part that draws: its skirt.
    pub fn skirt_share(&self) -> f64 {
        1.0 - self.surface.contour().area_mm2() / self.solid.surface().contour().area_mm2()
    }
}

/// Why there is no block.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// The number of nodes is out of range.
    #[error(
        "{nodes} height nodes across make {nx} x {ny}; both must lie between {} and {}: ask for another number",
        LEAST_NODES,
        GREATEST_NODES
    )]
    Nodes {
        /// Nodes asked for across.
        nodes: usize,
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
    },
    /// No surface draws the picture.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The surface keeps light inside, whatever its solver made of it.
    #[error(
        "{:.1} % of the light would be totally reflected inside the block, centred on x = {:.1} mm, y = {:.1} mm: this picture needs more deflection than the material gives on this bench; move the receiver further away, raise the offset, or take a smaller window",
        100.0 * share, at_mm.x, at_mm.y
    )]
    Trapped {
        /// Share of the nodes at which the light does not leave.
        share: f64,
        /// The middle of them, mm.
        at_mm: DVec2,
    },
    /// The solver gave the block a second structured face.
    #[error("2 faces of the block are structured, and a stock is cut on one side: close them by Solid::between")]
    EntryFace,
    /// The surface does not fit the stock.
    #[error(transparent)]
    Solid(#[from] SolidError),
}

/// Fewest nodes along a side: below, no picture is left.
pub const LEAST_NODES: usize = 9;
/// Most nodes along a side: indices and memory have been tried up to here.
pub const GREATEST_NODES: usize = 8193;

/// Height nodes for a block of this size with `across` nodes along its width and, as nearly as
/// whole nodes allow, the same spacing along its height.
///
/// # Errors
/// A number out of range.
pub fn node_grid(block: Extent, across: usize) -> Result<(usize, usize), DesignError> {
    let cells = across.saturating_sub(1) as f64 * block.height_mm / block.width_mm;
    let (nx, ny) = (across, 1 + cells.round().min(1e9) as usize);
    check_nodes((nx, ny))?;
    Ok((nx, ny))
}

fn check_nodes((nx, ny): (usize, usize)) -> Result<(), DesignError> {
    let limits = LEAST_NODES..=GREATEST_NODES;
    if limits.contains(&nx) && limits.contains(&ny) { Ok(()) } else { Err(DesignError::Nodes { nodes: nx, nx, ny }) }
}

/// Height nodes across a block of this outline on whose face there are as many as on that of a
/// rectangle with `across`, so that the outline does not matter to how finely a picture is drawn.
pub fn nodes_within(outline: &Contour, across: usize) -> usize {
    1 + (across.saturating_sub(1) as f64 / outline.share_of_extent().sqrt()).round() as usize
}

/// Nodes across that do justice to a picture of `pixels` across: two per pixel, as far as that
/// stays quick to solve and to load in the programs that open the files.
pub fn default_nodes(pixels: usize) -> usize {
    (2 * pixels + 1).clamp(257, 1025)
}

/// Solves for the exit face and closes the solid under it.
///
/// # Errors
/// A number of nodes out of range along either side, a blank that cannot be, a problem that the
/// solver does not do, a picture that physics forbids on this bench, a relief that the blank does
/// not hold.
pub fn design(
    problem: &Problem<'_>,
    nodes: (usize, usize),
    solver: &dyn Solver,
    blank: &Blank,
    progress: &dyn Progress,
) -> Result<DesignedBlock, DesignError> {
    let bench = problem.bench();
    check_nodes(nodes)?;
    blank.check(bench.block())?;
    let span = tracing::info_span!("solve", nx = nodes.0, ny = nodes.1);
    let solution = span.in_scope(|| solver.solve(problem, nodes, progress))?;
    close(solution, bench, blank)
}

/// Closes the solid under a face that was found.
///
/// # Errors
/// A blank that cannot be or does not hold the relief, a face that keeps its light inside, an entry
/// face that is no plane.
pub fn close(solution: Solution, bench: &Bench, blank: &Blank) -> Result<DesignedBlock, DesignError> {
    let _span = tracing::info_span!("close the solid").entered();
    if solution.entry.is_some() {
        return Err(DesignError::EntryFace);
    }
    check_light_leaves(&solution.exit, bench)?;
    let solid = Solid::shaped(&solution.exit, blank.stock, blank.shape)?;
    Ok(DesignedBlock { surface: solution.exit, solid, light: solution.light, summary: solution.summary })
}

/// How far an exit face must go on beyond its border, on every side, so that all light that leaves
/// by it enters an entry face as large as that at `entry_z_mm`, mm; 0 if it all enters below the
/// face.
pub fn overshoot_mm(surface: &HeightField, bench: &Bench, entry_z_mm: f64) -> f64 {
    if bench.exit_face() == ExitFace::Reflects {
        return 0.0;
    }
    let (heights, light) = (surface.heights_mm(), bench.incidence());
    let (nx, ny, extent) = (heights.nx(), heights.ny(), surface.extent());
    let entered = |at: DVec2, height_mm: f64| {
        let direction = light.at(at.extend(height_mm)).direction;
        at - direction.truncate() * ((height_mm - entry_z_mm) / direction.z)
    };
    let contour = surface.contour();
    if contour.is_rectangle() {
        let border = (0..nx).flat_map(|i| [(i, 0), (i, ny - 1)]).chain((0..ny).flat_map(|j| [(0, j), (nx - 1, j)]));
        let beyond = border.map(|(i, j)| {
            let entry = entered(extent.node(i, j, nx, ny), heights[(i, j)]);
            (entry.abs() - 0.5 * extent.as_vec()).max_element()
        });
        return beyond.fold(0.0, f64::max);
    }
    let spline = SurfaceSpline::through(surface);
    let sagitta_mm = 1e-6 * extent.as_vec().max_element();
    let entries: Vec<DVec2> =
        contour.polygon(sagitta_mm).into_iter().map(|at| entered(at, spline.sample(at).height_mm)).collect();
    let furthest = entries.iter().map(|at| at.length()).fold(0.0, f64::max);
    let holds = |by_mm: f64| {
        let grown = Extent::new(extent.width_mm + 2.0 * by_mm, extent.height_mm + 2.0 * by_mm);
        let grown = surface.outline().grown(by_mm).within(grown);
        entries.iter().all(|&at| grown.contains(at))
    };
    // What holds a face that is this much larger holds everything.
    let (mut low, mut high) = (0.0, furthest);
    if !furthest.is_finite() || holds(0.0) {
        return 0.0;
    }
    while high - low > OVERSHOOT_TOLERANCE_MM {
        let middle = 0.5 * (low + high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

/// How exactly the overshoot over a curved outline is found, mm.
const OVERSHOOT_TOLERANCE_MM: f64 = 1e-4;

/// Share of the nodes that may keep their light: at creases of very dark pictures a few always do.
const MOST_TRAPPED: f64 = 0.01;

fn check_light_leaves(surface: &HeightField, bench: &Bench) -> Result<(), DesignError> {
    let slopes = SurfaceSpline::through(surface).node_slopes();
    let (nx, light) = (slopes.nx(), bench.incidence());
    let outline = surface.contour();
    let (mut trapped, mut within, mut sum) = (0_usize, 0_usize, DVec2::ZERO);
    for (k, &slope) in slopes.as_slice().iter().enumerate() {
        let at = surface.extent().node(k % nx, k / nx, nx, slopes.ny());
        if !outline.contains(at) {
            continue;
        }
        within += 1;
        let incoming = light.at(at.extend(surface.heights_mm().as_slice()[k]));
        let face = Interface::new(bench.exit_face(), incoming.direction);
        if face.exitant(slope).is_none_or(|direction| direction.z <= 0.0) {
            trapped += 1;
            sum += at;
        }
    }
    let share = trapped as f64 / within.max(1) as f64;
    if share > MOST_TRAPPED { Err(DesignError::Trapped { share, at_mm: sum / trapped as f64 }) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_follows_the_aspect_of_the_block() {
        assert_eq!(node_grid(Extent::new(100.0, 100.0), 641), Ok((641, 641)));
        assert_eq!(node_grid(Extent::new(140.0, 100.0), 1793), Ok((1793, 1281)));
        assert!(node_grid(Extent::new(100.0, 100.0), 2).is_err());
        assert!(node_grid(Extent::new(100.0, 1.0), 257).is_err());
        assert!(node_grid(Extent::new(100.0, 100.0), 0).is_err());
    }
}
