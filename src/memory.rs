//! How much memory a design will take, told before it is begun.
//!
//! A model of the greatest resident size of `glasswarp design`, fitted to measured runs (docs/reliability.md has them). With `N` height
//! nodes, `P` pixels of the picture, and `G = min(N, P, 1024²)` cells of the receiver on which the transport solver works:
//!
//! ```text
//! solve  = 20 MB + 40 P + 700 G + 50 N
//! write  = 50 MB + 40 P + 160 min(P, 1024²) + 116 N
//! verify = 40 MB + 40 P + 790 min(P, 1024²) + 145 N + (16 MB + 140 N) for each of OBJ and GLB + 85 N for each other file
//! ```
//!
//! and the greatest of them, in bytes. The warping solvers take `550 N` in place of `700 G + 50 N`.

use std::fmt;

/// What a design is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Load {
    /// Height nodes.
    pub nodes: u64,
    /// Pixels of the picture.
    pub pixels: u64,
    /// How the face is found.
    pub method: Method,
    /// What is done with the files; `None` if they are only written.
    pub verified: Option<Files>,
}

/// The memory of solvers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// By cells of the receiver.
    #[default]
    Transport,
    /// By height nodes.
    Warping,
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

/// Pixels at which a block is judged, at most.
const JUDGED: u64 = 1024 * 1024;
/// The program itself.
const BASE: u64 = 20_000_000;
/// Pictures of the block.
const PICTURES: u64 = 30_000_000;
/// Pieces of text that are formatted or parsed at a time.
const PIECES: u64 = 16_000_000;

impl Load {
    /// A design without files.
    pub fn new(nodes: (usize, usize), pixels: (usize, usize)) -> Self {
        let area = |(nx, ny): (usize, usize)| nx as u64 * ny as u64;
        Self { nodes: area(nodes), pixels: area(pixels), ..Self::default() }
    }

    /// Found in another way.
    #[must_use]
    pub fn by(self, method: Method) -> Self {
        Self { method, ..self }
    }

    /// With files that are read back and traced.
    #[must_use]
    pub fn verified(self, with_normals: usize, others: usize) -> Self {
        let files = Files { with_normals: with_normals as u64, others: others as u64 };
        Self { verified: Some(files), ..self }
    }

    /// The most memory that it is expected to take. Measured runs took between 0.7 times this and all of it; blocks of 257 nodes, half.
    pub fn peak(&self) -> Bytes {
        let common = BASE + 40 * self.pixels;
        let solve = match self.method {
            Method::Transport => 700 * self.nodes.min(self.pixels).min(JUDGED) + 50 * self.nodes,
            Method::Warping => 550 * self.nodes,
        };
        let written = PICTURES + 160 * self.pixels.min(JUDGED) + 116 * self.nodes;
        let verify = self.verified.map_or(0, |files| {
            let of_nodes = 145 + 140 * files.with_normals + 85 * files.others;
            BASE + 790 * self.pixels.min(JUDGED) + PIECES * files.with_normals + of_nodes * self.nodes
        });
        Bytes(common + solve.max(written).max(verify))
    }

    /// The most nodes across for which it keeps to so much memory, if any do.
    pub fn most_nodes_within(&self, limit: Bytes) -> Option<usize> {
        let aspect = |across: u64| Self { nodes: across * across, ..*self }.peak() <= limit;
        (9..=8193).rev().find(|&across| aspect(across)).map(|across| across as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes across, files with normals and others that are read back, and what was measured.
    type Run = (usize, Option<(usize, usize)>, f64);

    /// Greatest resident sizes, thousands of KiB, of `design` with 512 x 512 pixels.
    const MEASURED: [Run; 15] = [
        (257, None, 102.6),
        (513, None, 214.4),
        (1025, None, 242.6),
        (1537, None, 288.3),
        (2049, None, 538.9),
        (513, Some((0, 0)), 243.6),
        (1025, Some((0, 0)), 356.5),
        (1537, Some((0, 0)), 524.4),
        (2049, Some((0, 0)), 830.8),
        (513, Some((2, 0)), 371.2),
        (1025, Some((2, 0)), 666.7),
        (1537, Some((2, 0)), 979.6),
        (2049, Some((2, 0)), 1962.0),
        (1025, Some((2, 5)), 1111.1),
        (1537, Some((2, 5)), 1995.2),
    ];

    #[test]
    fn the_model_holds_what_was_measured() {
        for (across, files, thousands_of_kib) in MEASURED {
            let measured = 1.024 * thousands_of_kib;
            let mut load = Load::new((across, across), (512, 512));
            if let Some((with_normals, others)) = files {
                load = load.verified(with_normals, others);
            }
            let ratio = measured / (load.peak().0 as f64 / 1e6);
            assert!((0.7..=1.0).contains(&ratio), "{across} {files:?}: {measured} MB of {}", load.peak());
        }
    }

    #[test]
    fn fewer_nodes_are_proposed_until_the_memory_suffices() {
        let load = Load::new((4097, 4097), (512, 512)).verified(2, 0);
        let across = load.most_nodes_within(Bytes(2_000_000_000)).unwrap();
        assert!((2000..2200).contains(&across), "{across}");
        assert_eq!(load.most_nodes_within(Bytes(1000)), None);
    }
}
