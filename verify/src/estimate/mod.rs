//! What light draws on the receiver, by beams and by photons, and how well it is what was asked
//! for.

mod beams;
pub mod dispersion;
mod film;
mod flux;
pub mod metrics;
mod photons;
mod plane_light;
mod rasteriser;

pub use beams::{Beams, Losses, MOST_BEAMS, beams, facet_beams};
pub use flux::Flux;
pub use photons::{PhotonAgreement, PhotonError, PhotonPlan, PhotonTally, TallyError, UnbiasedError, photons};
pub use plane_light::{PlaneLight, light_on_plane};
