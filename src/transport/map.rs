//! What the equation asks of a relation between an unknown over a rectangle and a map of that onto
//! the face of a block. The unknown may be an optical path on the receiver, a phase, or a height.

use glam::{DMat2, DVec2};

/// Value and derivatives of the unknown `u` at a point of its rectangle, u in mm.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Jet {
    pub(crate) value: f64,
    pub(crate) slope: DVec2,
    /// `u_xx, u_xy, u_yy`.
    pub(crate) curvature: [f64; 3],
}

impl Jet {
    pub(crate) fn hessian(&self) -> DMat2 {
        let [xx, xy, yy] = self.curvature;
        DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy))
    }
}

/// A map that an unknown and its derivatives make of its rectangle.
pub(super) trait Map: Sync {
    /// What value and slope of the unknown tell.
    type Ray: Copy;
    /// What the jacobian and its variation share.
    type Label: Copy;

    /// The ray at `y`; none if none exists. One nearby helps to find it.
    fn ray(&self, y: DVec2, u: f64, slope: DVec2, nearby: Option<&Self::Ray>) -> Option<Self::Ray>;

    /// The point whose border is fixed, mm.
    fn point(&self, y: DVec2, ray: &Self::Ray) -> DVec2;

    /// Derivatives of the point's component along the unit vector `along` with respect to `u, u_x,
    /// u_y`.
    fn point_variation(&self, ray: &Self::Ray, along: DVec2) -> [f64; 3];

    /// What the jacobian and its variation share.
    fn label(&self, ray: &Self::Ray) -> Self::Label;

    /// The jacobian with respect to `y` of the coordinates in which the light before is even.
    fn jacobian(&self, ray: &Self::Ray, jet: &Jet, label: &Self::Label) -> DMat2;

    /// By what the light that is wanted at a node is to be multiplied.
    fn gain(&self, ray: &Self::Ray, label: &Self::Label) -> f64;

    /// Derivatives of `sum_ij w_ij A_ij + of_light ln g`, `A` the jacobian and `g` the gain, with
    /// respect to `u, u_x, u_y, u_xx, u_xy, u_yy`.
    fn variation(&self, ray: &Self::Ray, jet: &Jet, label: &Self::Label, w: DMat2, of_light: f64) -> [f64; 6];

    /// The height that a constant in the unknown moves, mm, and its derivative with respect to that.
    fn height(&self, y: DVec2, ray: &Self::Ray) -> (f64, f64);

    /// Up to a factor, the area that a node at which this much light is wanted has where heights are
    /// averaged.
    fn area(&self, ray: &Self::Ray, jet: &Jet, light: f64) -> f64;

    /// The length that heights are compared with, mm.
    fn distance_mm(&self) -> f64;
}

/// A map onto a face whose heights follow from its rays: the face is the envelope of Cartesian ovals,
/// each of which sends all of its light to one point of the rectangle.
pub(super) trait Face: Map {
    /// The jacobian of the point.
    fn point_jacobian(&self, ray: &Self::Ray, jet: &Jet) -> DMat2;

    /// The height over `x` of the oval that belongs to `y`, mm. Not finite where it does not reach
    /// over `x`. The ray, if it is known, helps to find it.
    fn oval_height(&self, x: DVec2, y: DVec2, u: f64, ray: Option<&Self::Ray>) -> f64;

    /// The gradient with respect to `y` of the height of the oval over `x`, for an `x` near the point
    /// of the `ray`.
    fn oval_gradient(&self, x: DVec2, y: DVec2, height_mm: f64, ray: &Self::Ray) -> DVec2;

    /// Of two ovals over one point, whether the face is formed by the first.
    fn forms_face(&self, height: f64, other: f64) -> bool;
}
