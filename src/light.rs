//! The incident light: parallel, or from a point source at a finite distance, as it arrives at the
//! structured face.

mod arriving;
mod incidence;
mod photometry;
mod profile;
mod source;
mod wave;

pub use arriving::Arriving;
pub use photometry::{Photometry, PhotometryError};
pub use profile::{Profile, ProfileError};
pub use source::{Intensity, Light};

pub(crate) use incidence::{Incidence, Incoming};
pub(crate) use wave::{Arrival, PointWave, outer};
