//! Darkness around a picture.

use super::{error::ReferenceError, plane::Plane};
use rayon::prelude::*;

/// Most of a side that may stay dark.
const MOST_MARGIN: f64 = 0.45;

/// What of the window stays dark.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Frame {
    /// Share of the window on every side, 0 to 0.45.
    pub margin: f64,
    /// Darkness outside of the ellipse within the picture, into which it fades over this share of
    /// the radius, 0 to 1; none if there is no vignette.
    pub vignette: Option<f64>,
}

impl Frame {
    pub(super) fn around(self, plane: Plane) -> Result<Plane, ReferenceError> {
        let refused = |what, value, must, flag| Err(ReferenceError::Option { what, value, must, flag });
        if !(0.0..=MOST_MARGIN).contains(&self.margin) {
            return refused("the margin", self.margin, "0 to 0.45", "--margin");
        }
        if let Some(soft) = self.vignette.filter(|soft| !(0.0..=1.0).contains(soft)) {
            return refused("the softness of the vignette", soft, "0 to 1", "--vignette");
        }
        let mut plane = plane;
        if let Some(soft) = self.vignette {
            vignetted(&mut plane, soft);
        }
        let beside = |side: usize| (self.margin / (1.0 - 2.0 * self.margin) * side as f64).round() as usize;
        let (left, top) = (beside(plane.nx), beside(plane.ny));
        if (left, top) == (0, 0) {
            return Ok(plane);
        }
        let (nx, ny) = (plane.nx + 2 * left, plane.ny + 2 * top);
        let mut values = vec![0.0; nx * ny];
        for (from, into) in plane.values.chunks_exact(plane.nx).zip(values.chunks_exact_mut(nx).skip(top)) {
            into[left..left + plane.nx].copy_from_slice(from);
        }
        Ok(Plane { nx, ny, values })
    }
}

/// Points along each side of a pixel at which the vignette is asked.
const POINTS: usize = 8;

/// Darkens pixels by the mean of the vignette over them: 1 inside, fading as a cubic with level
/// ends over `soft` of the radius.
fn vignetted(plane: &mut Plane, soft: f64) {
    let (nx, ny) = (plane.nx, plane.ny);
    let places = |side: usize| -> Vec<f64> {
        (0..side * POINTS).map(|k| (2 * k + 1) as f64 / (side * POINTS) as f64 - 1.0).collect()
    };
    let (xs, ys) = (places(nx), places(ny));
    let bright = |x: f64, y: f64| {
        let inside = 1.0 - x.hypot(y);
        if soft == 0.0 {
            return if inside > 0.0 { 1.0 } else { 0.0 };
        }
        let t = (inside / soft).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    plane.values.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
        for (i, light) in row.iter_mut().enumerate() {
            let (xs, ys) = (&xs[i * POINTS..][..POINTS], &ys[j * POINTS..][..POINTS]);
            let sum: f64 = ys.iter().map(|y| xs.iter().map(|x| bright(*x, *y)).sum::<f64>()).sum();
            *light = (f64::from(*light) * sum / (POINTS * POINTS) as f64) as f32;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    fn white(nx: usize, ny: usize) -> Plane {
        Plane { nx, ny, values: vec![1.0; nx * ny] }
    }

    #[test]
    fn an_ellipse_holds_a_quarter_of_pi_of_the_light() {
        let share = |soft: f64| {
            let framed = Frame { margin: 0.0, vignette: Some(soft) }.around(white(60, 40)).unwrap();
            framed.values.iter().map(|v| f64::from(*v)).sum::<f64>() / 2400.0
        };
        let disc = std::f64::consts::FRAC_PI_4;
        at_worst(2.3e-4, (share(0.0) - disc).abs(), "sharp");
        // A fade to the middle: twice the integral of t^2 (3 - 2 t) r dr with t = 1 - r is 3 / 10.
        at_worst(4.6e-10, (share(1.0) - 0.3 * disc).abs(), "soft");
    }

    #[test]
    fn what_is_out_of_range_is_refused() {
        for (margin, vignette) in
            [(0.46, None), (-0.1, None), (f64::NAN, None), (0.0, Some(1.1)), (0.0, Some(f64::NAN))]
        {
            assert!(Frame { margin, vignette }.around(white(8, 8)).is_err());
        }
    }
}
