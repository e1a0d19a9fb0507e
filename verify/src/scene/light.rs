//! The light of a bench before it meets the solid.

use super::error::{SceneError, in_range};
use crate::image::Image;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// The light that falls on the solid.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Parallel light.
    Parallel {
        /// Direction in which it travels before it meets the solid; need not be a unit vector. For
        /// glass z > 0, for a mirror z < 0.
        direction: DVec3,
    },
    /// Light from a point.
    Point {
        /// The source, mm, in the bench's frame: before the entry face of glass, in front of the
        /// face of a mirror.
        position_mm: DVec3,
        /// How it emits.
        emission: Emission,
        /// The axis from which `emission` counts its angles; the bench's (+z for glass, -z for a
        /// mirror) unless given. Need not be a unit vector.
        axis: Option<DVec3>,
    },
}

impl Light {
    /// Parallel light in this direction.
    pub fn parallel(direction: DVec3) -> Self {
        Self::Parallel { direction }
    }
}

/// Radiant intensity (flux per solid angle) of a point source by the angle to its axis; only its
/// course has a meaning.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Emission {
    /// The same in every direction.
    #[default]
    Isotropic,
    /// As the cosine of the angle: a small flat emitter.
    Lambertian,
    /// `2^-(angle / half)^2`: a torch.
    Gaussian {
        /// Angle at which half of the axial intensity is left, radians.
        half_angle: f64,
    },
    /// As measured.
    Table(IntensityTable),
}

impl Emission {
    /// Relative intensity at an angle whose cosine is this.
    #[inline]
    pub(crate) fn intensity(&self, cos: f64) -> f64 {
        match self {
            Self::Isotropic => 1.0,
            Self::Lambertian => cos.max(0.0),
            Self::Gaussian { half_angle } => (-(cos.clamp(-1.0, 1.0).acos() / half_angle).powi(2)).exp2(),
            Self::Table(table) => table.intensity(cos.clamp(-1.0, 1.0).acos()),
        }
    }
}

/// Relative intensity at ascending angles to the axis, as in files of the IES and LDT formats (of a
/// source that is round about its axis). Linear between the angles, constant before the first,
/// nothing beyond the last.
#[derive(Clone, Debug, PartialEq)]
pub struct IntensityTable(Arc<[(f64, f64)]>);

impl IntensityTable {
    /// Takes pairs of an angle (radians) and an intensity.
    ///
    /// # Errors
    /// [`SceneError::Table`] for no pairs, angles that do not ascend from 0 or more to pi at most,
    /// an intensity that is negative or not finite, or no light.
    pub fn new(pairs: &[(f64, f64)]) -> Result<Self, SceneError> {
        let refused = |row| Err(SceneError::Table { row });
        for (row, &(angle, intensity)) in pairs.iter().enumerate() {
            let ascends = row.checked_sub(1).is_none_or(|before| pairs[before].0 < angle);
            let angles = 0.0..=std::f64::consts::PI + 1e-12;
            if !(ascends && angles.contains(&angle) && intensity.is_finite() && intensity >= 0.0) {
                return refused(row);
            }
        }
        if pairs.iter().all(|&(_, intensity)| intensity == 0.0) {
            return refused(pairs.len());
        }
        Ok(Self(pairs.into()))
    }

    fn intensity(&self, angle: f64) -> f64 {
        let after = self.0.partition_point(|&(at, _)| at < angle);
        match (after.checked_sub(1).map(|k| self.0[k]), self.0.get(after)) {
            (None, Some(&(_, first))) => first,
            (Some((a, below)), Some(&(b, above))) => below + (above - below) * (angle - a) / (b - a),
            (_, None) => 0.0,
        }
    }
}

/// Irradiance of a beam as its user measured it: on the plane of the entry face of glass, on the
/// plane z = 0 of a mirror, with the solid taken away. It stands in for what [`Emission`] would
/// give there; the rays run as the [`Light`] says.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamProfile {
    picture: Arc<Image>,
    size_mm: DVec2,
    centre_mm: DVec2,
}

impl BeamProfile {
    /// Takes a picture of relative irradiance (linear, any positive scale) of this size and place,
    /// mm. In the order of pictures, as all [`Image`]s: row 0 at the greatest y, column 0 at the
    /// greatest x. Bilinear between the centres of pixels; outside of the picture it is dark.
    ///
    /// # Errors
    /// [`SceneError::Value`] for a size that is none, [`SceneError::Profile`] for a value that is
    /// negative or not finite, [`SceneError::Dark`] without light.
    pub fn new(picture: Image, size_mm: DVec2, centre_mm: DVec2) -> Result<Self, SceneError> {
        for (what, value, least) in [
            ("the width of the beam's picture (mm)", size_mm.x, 1e-6),
            ("the height of the beam's picture (mm)", size_mm.y, 1e-6),
            ("the centre of the beam's picture along x (mm)", centre_mm.x, -1e9),
            ("the centre of the beam's picture along y (mm)", centre_mm.y, -1e9),
        ] {
            in_range(what, value, least, 1e9)?;
        }
        if let Some(k) = picture.values.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            let (column, row) = (k % picture.nx, k / picture.nx);
            return Err(SceneError::Profile { column, row, value: picture.values[k] });
        }
        if picture.values.iter().all(|&v| v == 0.0) {
            return Err(SceneError::Dark);
        }
        Ok(Self { picture: Arc::new(picture), size_mm, centre_mm })
    }

    /// Irradiance at a point of the plane, mm.
    #[inline]
    pub(crate) fn irradiance(&self, at_mm: DVec2) -> f64 {
        let pixels = DVec2::new(self.picture.nx as f64, self.picture.ny as f64);
        let at = (self.centre_mm + 0.5 * self.size_mm - at_mm) / self.size_mm;
        if !(at.cmpge(DVec2::ZERO).all() && at.cmple(DVec2::ONE).all()) {
            return 0.0;
        }
        let last = pixels - 1.0;
        let at = (at * pixels - 0.5).clamp(DVec2::ZERO, last);
        let corner = at.floor();
        let (part, next) = (at - corner, (corner + 1.0).min(last));
        let value = |x: f64, y: f64| self.picture.values[y as usize * self.picture.nx + x as usize];
        let row = |y: f64| value(corner.x, y) * (1.0 - part.x) + value(next.x, y) * part.x;
        row(corner.y) * (1.0 - part.y) + row(next.y) * part.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_linear_between_its_angles_and_dark_beyond() {
        let table = IntensityTable::new(&[(0.1, 4.0), (0.3, 2.0), (0.4, 0.0)]).unwrap();
        for (angle, wanted) in [(0.0, 4.0), (0.1, 4.0), (0.2, 3.0), (0.3, 2.0), (0.35, 1.0), (0.4, 0.0), (1.0, 0.0)] {
            assert!((Emission::Table(table.clone()).intensity(f64::cos(angle)) - wanted).abs() < 1e-9, "{angle}");
        }
        for pairs in
            [&[][..], &[(0.0, 0.0)], &[(0.2, 1.0), (0.1, 1.0)], &[(0.0, -1.0)], &[(f64::NAN, 1.0)], &[(4.0, 1.0)]]
        {
            assert!(matches!(IntensityTable::new(pairs), Err(SceneError::Table { .. })), "{pairs:?}");
        }
    }

    #[test]
    fn a_gaussian_halves_at_its_angle() {
        let torch = Emission::Gaussian { half_angle: 0.2 };
        assert!((torch.intensity(0.2f64.cos()) - 0.5).abs() < 1e-12 && torch.intensity(1.0) == 1.0);
        assert_eq!(Emission::Lambertian.intensity(-0.3), 0.0);
    }

    #[test]
    fn a_profile_lies_as_pictures_do_and_is_dark_outside() {
        // Left is +x, top is +y.
        let picture = Image::new(2, 2, vec![1.0, 2.0, 3.0, 4.0]);
        let profile = BeamProfile::new(picture, DVec2::new(40.0, 20.0), DVec2::new(5.0, 0.0)).unwrap();
        let at = |x: f64, y: f64| profile.irradiance(DVec2::new(x, y));
        assert_eq!([at(15.0, 5.0), at(-5.0, 5.0), at(15.0, -5.0), at(-5.0, -5.0)], [1.0, 2.0, 3.0, 4.0]);
        assert_eq!([at(5.0, 0.0), at(24.9, 9.9), at(25.1, 0.0), at(5.0, -10.1)], [2.5, 1.0, 0.0, 0.0]);
        let refused = |values: Vec<f64>, size: f64| {
            BeamProfile::new(Image::new(2, 1, values), DVec2::new(size, 1.0), DVec2::ZERO).unwrap_err()
        };
        assert!(matches!(refused(vec![1.0, f64::NAN], 1.0), SceneError::Profile { column: 1, row: 0, .. }));
        assert!(matches!(refused(vec![0.0, 0.0], 1.0), SceneError::Dark));
        assert!(matches!(refused(vec![1.0, 0.0], 0.0), SceneError::Value { .. }));
    }
}
