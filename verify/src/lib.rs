//! Traces light through an exported block of glass and judges the picture it draws.
//!
//! ```text
//! file -> Mesh -> Block, Row (or any solid) -> Tracer on a Scene -> beams, photons -> Image -> Metrics
//! ```
//!
//! The verifier knows nothing of what made a file. It opens it as a stranger would and measures.
//!
//! # The stages
//!
//! 1. [`load`] reads a file of any of nine formats as a [`Mesh`]: triangles in millimetres.
//!    [`solid::check`] tells whether they bound a solid.
//! 2. [`Block::from_mesh`] recognises a block, whose exit face is a height field on a regular grid,
//!    and its entry face a plane or another one; [`PlacedBlock::find`] does so however the block
//!    stands in its file. Blocks may stand in a [`Row`].
//! 3. A [`Scene`] is the optical bench: [`Light`] with its [`SourceExtent`], what the solid does to
//!    it ([`Optics`], [`Fresnel`]), how its face is understood ([`Surface`], [`Geometry`]), and the
//!    [`Window`] of the receiver.
//! 4. A [`Tracer`] follows single rays on that bench: each has a [`RayPath`] with an [`End`].
//! 5. [`beams()`] and [`photons()`] follow many, and collect irradiance as an [`Image`], and where
//!    the rest of the light goes as [`Flux`]. Beams are free of noise; photons see rough faces and
//!    extended sources, and know their own standard error ([`PhotonTally`]). [`light_on_plane`]
//!    looks at the light on its way.
//!    [`dispersion`] adds up the colours of white light.
//! 6. [`metrics`] compares an image with its target, which [`mod@reference`] reads
//!    from a picture by a reader of its own. [`image_file`] writes images.
//! 7. [`crosscheck`] puts the same block before other renderers.
//!
//! ```
//! use glam::DVec2;
//! use glasswarp_verify::{Block, PhotonPlan, Scene, Tracer, Window, beams, photons};
//!
//! // A flat plate moves no light: it all lands in a window of its own size.
//! let block = Block::from_heights(DVec2::splat(40.0), -10.0, (5, 5), vec![0.0; 25])?;
//! let window = Window { size_mm: DVec2::splat(40.0), centre_mm: DVec2::ZERO, nx: 16, ny: 16 };
//! let tracer = Tracer::for_block(&block, &Scene::new(1.49, 200.0, window))?;
//! let image = beams(&tracer, 64, 64).image;
//! assert!(image.values.iter().all(|irradiance| (irradiance - 1.0).abs() < 1e-6));
//! let tally = photons(&tracer, &PhotonPlan::new(4096, 1).with_replicates(4))?;
//! assert!((tally.flux().total() - 1.0).abs() < 1e-12 && tally.flux().window > 0.999);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Terms
//!
//! *Irradiance* is power per area on the receiver, divided by its mean over the window; *flux* is a
//! part of the light that fills the aperture; the *aperture* is the rectangle over which rays are
//! counted; a *tally* is an exact sum of power; the *target* is the image asked for, and the
//! *reference* the file that it was read from.
//!
//! # Frame
//!
//! Millimetres; light travels `+z`; the entry face is at the least z; the exit face is
//! `z = h(x, y)` with its mean at 0; the receiver is the plane `z = distance`. A bench of blocks in
//! a row is told in the frame of the last of them. The picture is seen
//! on the receiver from the block's side: its left is `+x`, its top is `+y`, and images here are in
//! the order of pictures, row 0 on top.
//!
//! # Guarantees
//!
//! - No ray is lost between two triangles, at an edge or at a vertex of a sound solid.
//! - Power is counted in integers: it adds up to what was sent out, and every result is the same
//!   for any number of threads.
//! - Hit points, normals, refraction and landing points are computed in f64; f32 only proposes
//!   candidate triangles.

// What all share.
mod exr_blocks;
mod image;
#[cfg(test)]
#[path = "../../tests/common/measured.rs"]
mod measured;
mod mesh;
mod random;
mod spline;

// From files to solids.
mod block;
pub mod image_file;
pub mod load;
pub mod reference;
pub mod solid;

// From programs of machines to what they cut.
pub mod cut;
pub mod program;

// From the bench to light, and what it is worth.
pub mod crosscheck;
mod estimate;
mod scene;
mod trace;

pub use self::image::Image;
pub use block::{Block, BlockError, ExpectedPose, PlacedBlock, Placement};
pub use estimate::{
    Beams, Flux, Losses, MOST_BEAMS, PhotonAgreement, PhotonError, PhotonPlan, PhotonTally, PlaneLight, TallyError,
    UnbiasedError, beams, dispersion, facet_beams, light_on_plane, metrics, photons,
};
pub use mesh::{CornerNormals, Mesh, TrimmedFace};
pub use scene::{
    BeamProfile, Displacement, Emission, Fresnel, Geometry, IntensityTable, Light, Optics, Scene, SceneError,
    SourceExtent, Standing, Surface, Traversal, Window,
};
pub use trace::{End, RayEnd, RayExit, RayPath, RayTracer, Row, RowBlock, Tracer};
