//! The incident light: parallel, or from a point source at a finite distance, as it arrives at the
//! structured face.

mod arriving;
mod congruence;
mod incidence;
mod passage;
mod photometry;
mod profile;
mod source;
mod wave;
mod wavefront;

pub use arriving::Arriving;
pub use passage::{FaceShape, KnownFace, PassageError};
pub use photometry::{Photometry, PhotometryError};
pub use profile::{Profile, ProfileError};
pub use source::{Intensity, Light};

pub(crate) use congruence::{Arrival, Congruence, Label};
pub(crate) use incidence::{Incidence, Incoming};
pub(crate) use passage::{Beginning, passed};
pub(crate) use wave::{PointWave, outer};
pub(crate) use wavefront::Wavefront;
