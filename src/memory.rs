//! An estimate of the memory that a design, or tracing a file, takes, made before it is begun.
//!
//! A model of the greatest resident size of `glasswarp design`, fitted to measured runs
//! (docs/reliability.md has them). With `N` height nodes, `P` pixels of the picture, `R` cells of
//! the receiver grid on which the transport solver works (about four for every pixel that the nodes
//! can draw), and `J` pixels at which the block is judged, at most 1024 across:
//!
//! ```text
//! solve  = 20 MB + 40 P + 175 R + 50 N
//! write  = 50 MB + 40 P + 40 R + 116 N
//! verify = 40 MB + 40 P + 175 R + 60 J + 190 N + (16 MB + 140 N) for each of OBJ and GLB + 85 N for each other file
//! ```
//!
//! and the greatest of them, in bytes; 32 P more to all where the files are verified, since the
//! verifier reads the picture too. The warping solvers take `550 N` in place of `175 R + 50 N`. A
//! look at a file at `J` pixels takes `50 MB + 80 J` besides the file. Blocks that stand before with `M` nodes add `300 M`.

use std::fmt;

/// What a design is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Load {
    /// Height nodes.
    pub nodes: u64,
    /// Pixels of the picture.
    pub pixels: u64,
    /// Pixels at which the block is judged.
    pub judged: u64,
    /// Height nodes of the blocks that stand before it.
    pub before: u64,
    /// How the face is found.
    pub method: Method,
    /// What is done with the files; `None` if they are only written.
    pub verified: Option<Files>,
}

/// The memory of solvers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// By cells of the receiver, see
    /// [`TransportOptions::receiver_cells`](crate::transport::TransportOptions::receiver_cells).
    Transport {
        /// How many there are.
        cells: u64,
    },
    /// By height nodes.
    Warping,
}

impl Default for Method {
    fn default() -> Self {
        Self::Transport { cells: 0 }
    }
}

/// Files that are read back together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Files {
    /// OBJ and GLB files, which carry normals.
    pub with_normals: u64,
    /// Others but the first.
    pub others: u64,
}

/// Bytes of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Bytes(pub u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 < 10_000_000_000 {
            write!(f, "{:.0} MB", self.0 as f64 / 1e6)
        } else {
            write!(f, "{:.1} GB", self.0 as f64 / 1e9)
        }
    }
}

/// Pixels across at which a block is judged, at most.
const JUDGED_ACROSS: usize = 1024;
/// The program itself.
const BASE: u64 = 20_000_000;
/// Pictures of the block.
const PICTURES: u64 = 30_000_000;
/// Pieces of text that are formatted or parsed at a time.
const PIECES: u64 = 16_000_000;
/// Bytes for every pixel of the picture as the verifier reads it.
const SECOND_READING: u64 = 32;
/// Bytes for every node of a block that stands before: its face, and the wave behind it.
const BEFORE: u64 = 300;
/// Bytes for every cell of the receiver. The solver's are not all given back before the files are
/// looked at.
const CELL: u64 = 175;

/// Bytes for every pixel of a window: light by beams and by photons, with sums of squares, and
/// their comparison.
const LOOK: u64 = 80;

/// How many there are, of whatever is counted along both sides.
fn count((nx, ny): (usize, usize)) -> u64 {
    (nx as u64).saturating_mul(ny as u64)
}

impl Load {
    /// A design without files, of so many nodes and pixels along x and y.
    pub fn new(nodes: (usize, usize), pixels: (usize, usize), method: Method) -> Self {
        let across = pixels.0.min(JUDGED_ACROSS);
        let judged = across as f64 * (across as f64 * pixels.1 as f64 / pixels.0.max(1) as f64);
        Self { nodes: count(nodes), pixels: count(pixels), judged: judged as u64, before: 0, method, verified: None }
    }

    /// Judged at so many pixels along x and y.
    #[must_use]
    pub fn judged_at(self, pixels: (usize, usize)) -> Self {
        Self { judged: count(pixels), ..self }
    }

    /// Behind blocks with so many height nodes in all.
    #[must_use]
    pub fn behind(self, nodes: u64) -> Self {
        Self { before: nodes, ..self }
    }

    /// With files that are read back and traced.
    #[must_use]
    pub fn verified(self, with_normals: usize, others: usize) -> Self {
        let files = Files { with_normals: with_normals as u64, others: others as u64 };
        Self { verified: Some(files), ..self }
    }

    /// The most memory that it is expected to take. Measured runs took between half of this and all
    /// of it.
    pub fn peak(&self) -> Bytes {
        let reading = if self.verified.is_some() { 40 + SECOND_READING } else { 40 };
        let common = BASE + reading * self.pixels + BEFORE * self.before;
        let (solve, drawn, kept) = match self.method {
            Method::Transport { cells } => (CELL * cells + 50 * self.nodes, 40 * cells, CELL * cells),
            Method::Warping => (550 * self.nodes, 160 * self.judged, 400 * self.judged),
        };
        let written = PICTURES + drawn + 116 * self.nodes;
        let verify = self.verified.map_or(0, |files| {
            let of_nodes = 190 + 140 * files.with_normals + 85 * files.others;
            BASE + kept + 60 * self.judged + PIECES * files.with_normals + of_nodes * self.nodes
        });
        Bytes(common + solve.max(written).max(verify))
    }
}

/// The most memory that looking at a file at so many pixels along x and y is expected to take,
/// besides the file itself.
pub fn of_looking(pixels: (usize, usize)) -> Bytes {
    Bytes(BASE + PICTURES + LOOK.saturating_mul(count(pixels)))
}

impl Method {
    /// The transport solver on a receiver grid of so many cells along x and y.
    pub fn transport(cells: (usize, usize)) -> Self {
        Self::Transport { cells: count(cells) }
    }
}

/// The most nodes across, between these limits, for which a design keeps to so much memory, if any
/// do. `at` tells what a number makes of it, or nothing where it cannot be.
pub fn most_nodes_within(
    limit: Bytes,
    (least, most): (usize, usize),
    at: impl Fn(usize) -> Option<Load>,
) -> Option<usize> {
    (least..=most).rev().find(|&across| at(across).is_some_and(|load| load.peak() <= limit))
}
