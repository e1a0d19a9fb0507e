//! How much light there is for an exit face.

/// How much light falls on the face, found by quadrature.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct IncidentFlux {
    /// Mean flux per unit of area of the face's plan.
    pub(super) mean: f64,
    /// The part of it that meets a side wall, or a rim, before the face.
    pub(super) vignetted: f64,
}
