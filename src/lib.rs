//! Turns a picture into a block of glass whose light draws that picture.
//!
//! # The pipeline
//!
//! ```text
//! image -> TargetIrradiance -> (WarpMesh -> NormalField ->) HeightField -> Solid -> files
//! ```
//!
//! The verifier (`glasswarp-verify`) starts at the other end: it opens the files, and knows nothing
//! of what made them.
//!
//! A picture in memory becomes a file for the shop:
//!
//! ```rust
#![doc = include_str!("../examples/design_from_memory.rs")]
//! ```
//!
//! # Frame, units, signs
//!
//! Millimetres and radians, a right-handed frame. Light travels along `+z`. The planar entry face
//! lies at a constant negative z, the exit face is `z = h(x, y)` with the mean of its nodes at 0,
//! the receiver is the plane `z = distance`. `x` and `y` are centred on the optical axis. The
//! picture is seen on the wall from the block's side: its left is `+x`, its top is `+y`. Inside the
//! library every grid has row `j` along `+y` and column `i` along `+x`; a picture is turned into
//! that order once, where it becomes a [`irradiance::TargetIrradiance`], and back once, where it is
//! shown.
//!
//! Irradiance is linear and has the mean 1.
//!
//! # To read in this order
//!
//! 1. [`irradiance`]: what the wall shall show. Pictures of any format, or light of your own:
//!    [below](#light-of-your-own).
//! 2. [`mod@bench`] and [`light`]: where block, light and receiver stand, and what light there is;
//!    [`optics`]: refraction and reflection at one face; [`materials`]: indices.
//! 3. [`solver`]: a [`Problem`](solver::Problem) goes in, a [`Solution`](solver::Solution) comes
//!    out, and [`Progress`](solver::Progress) may end the work in between. [`transport`] is the one
//!    to use, [`warp`] is brightness warping, improved and as the paper prints it. [`optim`] and
//!    [`grid`] are their tools, [`forward`] closes their loops.
//! 4. [`surface`]: heights, their spline, and [heights from normals](#heights-from-normals-alone).
//! 5. [`pipeline`]: all of this in one call; [`memory`]: an estimate of what it takes.
//! 6. [`solid`]: the closed block, cut from a [`Blank`](solid::Blank); [`export`]: its files, which
//!    appear whole or not at all, or their bytes.
//! 7. [`fabricate`]: cutters and polish in simulation; [`report`]: pictures of what was found.
//! 8. `spec`, `study`, `record` and `failure` (feature `study`): settings as people write them, what
//!    is found out about a block and its files, and what is written down of it.
//!
//! The package `glasswarp-verify` opens the files and [traces light through
//! them](#light-through-any-mesh).
//!
//! # Light of your own
//!
//! ```rust
#![doc = include_str!("../examples/custom_irradiance.rs")]
//! ```
//!
//! # Light through any mesh
//!
//! ```rust
#![doc = include_str!("../examples/verify_mesh.rs")]
//! ```
//!
//! # Heights from normals alone
//!
//! ```rust
#![doc = include_str!("../examples/integrate_normals.rs")]
//! ```
//!
//! # Where there are no files
//!
//! Without its default features the library reads pictures and meshes from bytes and writes blocks
//! as bytes, and builds for `wasm32-unknown-unknown`: no stage uses a clock, files or threads of
//! its own. The feature `files` adds what reads and writes by path; `drawings` a block with its
//! dimensions, as text; `study` what is found out about a block with the verifier; `report` pages
//! of it; `svg` drawings as pixels, those that are given as pictures among them; `cli` the command.
//!
//! Vectors are those of [`glam`], pictures of results those of [`image`]; both are re-exported, so
//! that a caller has the same version.
//!
//! # Guarantees
//!
//! Every result is the same bits for any number of threads. Nothing that a caller passes makes the
//! library panic, but what a `# Panics` section names. Errors are enums beside their stage, with
//! the offending value, its limit and the remedy; most may grow (`non_exhaustive`). Stages are told
//! to [`tracing`](https://docs.rs/tracing), which costs nothing as long as nobody listens.

pub use {glam, image};

pub mod bench;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
pub mod export;
pub mod fabricate;
#[cfg(feature = "study")]
pub mod failure;
pub mod forward;
pub mod grid;
pub mod irradiance;
pub mod light;
pub mod materials;
#[cfg(test)]
#[path = "../tests/common/measured.rs"]
mod measured;
pub mod memory;
pub mod optics;
pub mod optim;
pub mod pipeline;
#[cfg(feature = "study")]
pub mod record;
pub mod report;
pub mod solid;
pub mod solver;
#[cfg(feature = "study")]
pub mod spec;
#[cfg(feature = "study")]
pub mod study;
pub mod surface;
pub mod transport;
pub mod warp;
