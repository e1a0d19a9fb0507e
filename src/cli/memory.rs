//! Memory: what this machine has, and whether a command shall care.

use crate::{export::Format, irradiance::Picture, memory::Bytes, study::fits::ReadBack};
use std::path::PathBuf;

/// What every command that asks how much memory there is lets be said.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct MemoryArgs {
    /// Take more memory than this machine has free, if it must be
    #[arg(long, hide_short_help = true)]
    ignore_memory: bool,
}

impl MemoryArgs {
    /// What may be taken, if that is known and matters.
    pub(crate) fn free(self) -> Option<Bytes> {
        free().filter(|_| !self.ignore_memory)
    }
}

/// How many files of which kind are read back.
pub(crate) fn read_back(outputs: &[PathBuf]) -> ReadBack {
    let with_normals = |path: &&PathBuf| matches!(Format::from_path(path), Ok(Format::Obj | Format::Glb));
    let with_normals = outputs.iter().filter(with_normals).count();
    ReadBack { with_normals, others: outputs.len().saturating_sub(1 + with_normals) }
}

/// Bytes that reading a picture may take.
pub(crate) fn for_a_picture() -> u64 {
    free().map_or(Picture::MEMORY, |free| free.0.min(Picture::MEMORY))
}

/// Memory that can be had without swapping, if the system tells: less where a container is bounded.
/// `GLASSWARP_MEMORY`, in MB, stands in for it.
pub(super) fn free() -> Option<Bytes> {
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
