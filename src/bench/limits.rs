//! What a bench may be, shared by its checks and the errors that name them.

/// Accepted refractive indices.
pub(super) const IOR_LIMITS: (f64, f64) = (1.01, 4.0);
/// Greatest angle to the axis at which light from a point source may meet the block, degrees.
pub(super) const GREATEST_INCIDENCE_DEG: f64 = 75.0;
/// Greatest angle by which the receiver may lean, degrees.
pub(super) const GREATEST_LEAN_DEG: f64 = 80.0;
