//! Putting the verifier before independent renderers: POV-Ray and Blender.
//!
//! A [`Comparison`] of a block writes a complete scene for a renderer into a folder ([`Job`]),
//! which can be run by hand, runs it, and reads the linear picture back. There are two comparisons:
//!
//! - **Map**: camera rays *are* light rays. In parallel light an orthographic camera behind the
//!   block looks along it, at a point source a perspective camera stands in its place, and a mirror
//!   is looked at from in front. They see a receiver whose colour encodes the position: every pixel
//!   is the landing point of one ray, without noise. See [`Comparison::compare_map`].
//! - **Image**: the renderer's caustic against the verifier's, with the renderer's noise taken from
//!   two runs, for light through glass onto a receiver across the axis. See
//!   [`Comparison::compare_image`].
//!
//! Like is compared with like: renderers interpolate vertex normals over flat triangles, so the
//! verifier does too ([`Surface::Smooth`](crate::Surface::Smooth)), with the same normals. The
//! distance to the spline surface is stated besides.

mod camera;
mod comparison;
mod error;
mod image;
mod job;
mod map;
mod pictures;
mod povray;
mod renderer;
mod scripted;
mod shaded;

pub use comparison::Comparison;
pub use error::CrosscheckError;
pub use image::{ImageAgreement, ImageLevel};
pub use job::Job;
pub use map::{Distances, Landings, MapAgreement, PERCENTILES};
pub use renderer::Renderer;
