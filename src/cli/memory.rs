//! Memory: what a command will take, and what the machine has.

use crate::{
    export::Format,
    failure::Failure,
    irradiance::Picture,
    memory::{self, Bytes, Load},
    pipeline,
    study::{design::Plan, judge::Examiner},
};
use glasswarp_verify::Window;
use std::path::PathBuf;

/// What every command that asks how much memory there is lets be said.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct MemoryArgs {
    /// Take more memory than this machine has free, if it must be
    #[arg(long, hide_short_help = true)]
    ignore_memory: bool,
}

/// Refuses a design that would not fit into the memory that is free, and says what would. Returns
/// what it is expected to take.
pub(crate) fn check(plan: &Plan, outputs: &[PathBuf], verified: bool, args: MemoryArgs) -> Result<Bytes, Failure> {
    let load = |nodes: (usize, usize)| {
        let load = load_of(plan, nodes);
        if !verified {
            return load;
        }
        let with_normals = |path: &&PathBuf| matches!(Format::from_path(path), Ok(Format::Obj | Format::Glb));
        let with_normals = outputs.iter().filter(with_normals).count();
        load.verified(with_normals, outputs.len().saturating_sub(1 + with_normals))
    };
    let others = "write fewer files, leave out the verification (--no-verify), ";
    demand_nodes(plan, load, "this design", others, args)
}

/// The same for a preview.
pub(crate) fn check_preview(plan: &Plan, args: MemoryArgs) -> Result<Bytes, Failure> {
    demand_nodes(plan, |nodes| load_of(plan, nodes), "this preview", "", args)
}

/// The same for a design that is looked at, at so many pixels across, and not written.
pub(crate) fn check_look(plan: &Plan, across: usize, args: MemoryArgs) -> Result<Bytes, Failure> {
    let (nx, ny) = pixels_of(plan);
    let across = across.min(nx);
    let judged = (across, (across * ny).div_ceil(nx));
    demand_nodes(plan, |nodes| load_of(plan, nodes).judged_at(judged).verified(0, 0), "this design", "", args)
}

fn pixels_of(plan: &Plan) -> (usize, usize) {
    let cells = plan.target.cells();
    (cells.nx(), cells.ny())
}

/// What a plan is made of, with other nodes.
fn load_of(plan: &Plan, nodes: (usize, usize)) -> Load {
    let pixels = pixels_of(plan);
    Load::new(nodes, pixels, plan.memory_of_solver(pixels, nodes))
}

fn demand_nodes(
    plan: &Plan,
    load: impl Fn((usize, usize)) -> Load,
    what: &str,
    others: &str,
    args: MemoryArgs,
) -> Result<Bytes, Failure> {
    demand(what, load(plan.nodes).peak(), args, |free| {
        // As `Plan` makes a grid of the flag.
        let contour = plan.bench.contour();
        let at = |across: usize| {
            pipeline::node_grid(plan.bench.block(), pipeline::nodes_within(&contour, across)).ok().map(&load)
        };
        let limits = (pipeline::LEAST_NODES, pipeline::GREATEST_NODES);
        let remedy = match memory::most_nodes_within(free, limits, at) {
            Some(across) => format!("take at most --nodes {across}"),
            None => "take a smaller picture".into(),
        };
        format!("{remedy}, {others}")
    })
}

/// Refuses to look at a file at more pixels than fit into the memory that is free. More than any
/// window holds are the tracer's to refuse.
pub(crate) fn check_pixels(examiner: &Examiner, args: MemoryArgs) -> Result<(), Failure> {
    let (nx, ny) = examiner.pixels();
    if nx * ny > Window::MOST_PIXELS {
        return Ok(());
    }
    demand(&format!("looking at {nx} x {ny} pixels"), memory::of_looking((nx, ny)), args, |free| {
        let fits = |across: &usize| memory::of_looking((*across, (across * ny).div_ceil(nx))) <= free;
        match (LEAST_PIXELS..nx).rev().find(fits) {
            Some(across) => format!("take at most --pixels {across}, "),
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
    MemoryArgs { ignore_memory }: MemoryArgs,
    remedies: impl Fn(Bytes) -> String,
) -> Result<Bytes, Failure> {
    let free = free();
    tracing::info!(%expected, free = free.map(tracing::field::display), "memory");
    match free {
        Some(free) if expected > free && !ignore_memory => Err(Failure::Usage(format!(
            "{what} takes about {expected} of memory, and {free} are free: {}close other programs, or try all the same (--ignore-memory)",
            remedies(free)
        ))),
        _ => Ok(expected),
    }
}

/// Bytes that reading a picture may take.
pub(crate) fn for_a_picture() -> u64 {
    free().map_or(Picture::MEMORY, |free| free.0.min(Picture::MEMORY))
}

/// Memory that can be had without swapping, if the system tells: less where a container is bounded.
/// `GLASSWARP_MEMORY`, in MB, stands in for it.
fn free() -> Option<Bytes> {
    if let Some(megabytes) = std::env::var("GLASSWARP_MEMORY").ok().and_then(|text| text.parse::<u64>().ok()) {
        return Some(Bytes(megabytes.saturating_mul(1_000_000)));
    }
    if !sysinfo::IS_SUPPORTED_SYSTEM {
        return None;
    }
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let bounded = system.cgroup_limits().map(|limits| limits.free_memory).filter(|free| *free > 0);
    let free = system.available_memory().min(bounded.unwrap_or(u64::MAX));
    (free > 0).then_some(Bytes(free))
}
