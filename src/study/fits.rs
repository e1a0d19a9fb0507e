//! Whether a design, or a look at a file, fits into the memory that is free; where nobody knows how
//! much that is, or cares, everything does.

use super::{design::Plan, judge::Examiner};
use crate::{
    failure::Failure,
    memory::{self, Bytes, Load},
    pipeline,
};
use glasswarp_verify::Window;

/// Files that are read back besides the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadBack {
    /// Those with normals: OBJ and GLB.
    pub with_normals: usize,
    /// All others.
    pub others: usize,
}

/// Refuses a design that would not fit, and says what would; `None` if no file is read back. Returns
/// what it is expected to take.
///
/// # Errors
/// If it would not.
pub fn design(plan: &Plan, files: Option<ReadBack>, free: Option<Bytes>) -> Result<Bytes, Failure> {
    let load = |nodes: (usize, usize)| match files {
        Some(ReadBack { with_normals, others }) => load_of(plan, nodes).verified(with_normals, others),
        None => load_of(plan, nodes),
    };
    demand_nodes(plan, load, "this design", "write fewer files, leave out the verification (`no-verify`), ", free)
}

/// The same for a preview.
///
/// # Errors
/// If it would not fit.
pub fn preview(plan: &Plan, free: Option<Bytes>) -> Result<Bytes, Failure> {
    demand_nodes(plan, |nodes| load_of(plan, nodes), "this preview", "", free)
}

/// The same for a design that is looked at, at so many pixels across, and not written.
///
/// # Errors
/// If it would not fit.
pub fn look(plan: &Plan, across: usize, free: Option<Bytes>) -> Result<Bytes, Failure> {
    let (nx, ny) = pixels_of(plan);
    let across = across.min(nx);
    let judged = (across, (across * ny).div_ceil(nx));
    demand_nodes(plan, |nodes| load_of(plan, nodes).judged_at(judged).verified(0, 0), "this design", "", free)
}

fn pixels_of(plan: &Plan) -> (usize, usize) {
    let cells = plan.target.cells();
    (cells.nx(), cells.ny())
}

/// What a plan is made of, with other nodes.
fn load_of(plan: &Plan, nodes: (usize, usize)) -> Load {
    let pixels = pixels_of(plan);
    let before = plan.before.standing.iter().map(|standing| {
        let (nx, ny) = standing.block.nodes();
        (nx * ny) as u64
    });
    Load::new(nodes, pixels, plan.memory_of_solver(pixels, nodes)).behind(before.sum())
}

fn demand_nodes(
    plan: &Plan,
    load: impl Fn((usize, usize)) -> Load,
    what: &str,
    others: &str,
    free: Option<Bytes>,
) -> Result<Bytes, Failure> {
    demand(what, load(plan.nodes).peak(), free, |free| {
        // As `Plan` makes a grid of the flag.
        let contour = plan.bench.contour();
        let at = |across: usize| {
            pipeline::node_grid(plan.bench.block(), pipeline::nodes_within(&contour, across)).ok().map(&load)
        };
        let limits = (pipeline::LEAST_NODES, pipeline::GREATEST_NODES);
        let remedy = match memory::most_nodes_within(free, limits, at) {
            Some(across) => format!("take at most `nodes {across}`"),
            None => "take a smaller picture".into(),
        };
        format!("{remedy}, {others}")
    })
}

/// Refuses to look at a file at more pixels than fit into the memory that is free. More than any
/// window holds are the tracer's to refuse.
///
/// # Errors
/// If they would not.
pub fn pixels(examiner: &Examiner, free: Option<Bytes>) -> Result<(), Failure> {
    let (nx, ny) = examiner.pixels();
    if nx * ny > Window::MOST_PIXELS {
        return Ok(());
    }
    demand(&format!("looking at {nx} x {ny} pixels"), memory::of_looking((nx, ny)), free, |free| {
        let fits = |across: &usize| memory::of_looking((*across, (across * ny).div_ceil(nx))) <= free;
        match (LEAST_PIXELS..nx).rev().find(fits) {
            Some(across) => format!("take at most `pixels {across}`, "),
            None => String::new(),
        }
    })
    .map(drop)
}

/// The least number of pixels across that can be asked for.
const LEAST_PIXELS: usize = 8;

/// Refuses what is expected to take more than is free. `remedies` says what would fit, each
/// followed by a comma.
fn demand(
    what: &str,
    expected: Bytes,
    free: Option<Bytes>,
    remedies: impl Fn(Bytes) -> String,
) -> Result<Bytes, Failure> {
    tracing::info!(%expected, free = free.map(tracing::field::display), "memory");
    match free {
        Some(free) if expected > free => Err(Failure::Usage(format!(
            "{what} takes about {expected} of memory, and {free} are free: {}close other programs, or try all the same (`ignore-memory`)",
            remedies(free)
        ))),
        _ => Ok(expected),
    }
}
