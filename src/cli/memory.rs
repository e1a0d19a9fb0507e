//! Memory: what a design will take, and what the machine has.

use crate::{
    export::Format,
    failure::Failure,
    irradiance::Picture,
    memory::{self, Bytes, Load},
    pipeline,
    study::design::Plan,
};
use std::path::PathBuf;

/// Refuses a design that would not fit into the memory that is free, and says what would. Returns what it is expected to take.
pub(crate) fn check(plan: &Plan, outputs: &[PathBuf], verified: bool, ignored: bool) -> Result<Bytes, Failure> {
    let cells = plan.target.cells();
    let pixels = (cells.nx(), cells.ny());
    let load = |nodes: (usize, usize)| {
        let load = Load::new(nodes, pixels, plan.memory_of_solver(pixels, nodes));
        if !verified {
            return load;
        }
        let with_normals = |path: &&PathBuf| matches!(Format::from_path(path), Ok(Format::Obj | Format::Glb));
        let with_normals = outputs.iter().filter(with_normals).count();
        load.verified(with_normals, outputs.len().saturating_sub(1 + with_normals))
    };
    let expected = load(plan.nodes).peak();
    let free = free();
    tracing::info!(%expected, free = free.map(tracing::field::display), "memory");
    match free {
        Some(free) if expected > free && !ignored => {
            // As `Plan` makes a grid of the flag.
            let contour = plan.bench.contour();
            let at = |across: usize| {
                pipeline::node_grid(plan.bench.block(), pipeline::nodes_within(&contour, across)).ok().map(load)
            };
            let limits = (pipeline::LEAST_NODES, pipeline::GREATEST_NODES);
            let remedy = match memory::most_nodes_within(free, limits, at) {
                Some(across) => format!("take at most --nodes {across}"),
                None => "take a smaller picture".into(),
            };
            Err(Failure::Usage(format!(
                "this design takes about {expected} of memory, and {free} are free: {remedy}, write fewer files, leave out the verification (--no-verify), close other programs, or try all the same (--ignore-memory)"
            )))
        }
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
