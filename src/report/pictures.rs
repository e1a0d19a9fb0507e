//! Irradiance and its error as pictures.

use crate::{
    grid::Field,
    irradiance::{TargetIrradiance, Transfer},
};
use image::{GrayImage, Luma};

/// How irradiance (mean 1) becomes the grey of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// The irradiance that becomes white. More is white too.
    pub white: f64,
    /// How the greys are encoded.
    pub transfer: Transfer,
}

impl Exposure {
    /// The scale of the target itself: its brightest place is just white ("the brightness was
    /// adjusted so the brightest areas became roughly white", section 4 of the paper). Pictures in
    /// one exposure can be compared.
    pub fn of(target: &TargetIrradiance, transfer: Transfer) -> Self {
        Self { white: target.cells().min_max().1, transfer }
    }

    /// The encoded value of an irradiance, 0 to 1.
    fn encoded(self, irradiance: f64) -> f64 {
        self.transfer.from_linear((irradiance / self.white).clamp(0.0, 1.0))
    }
}

/// Irradiance in picture order (see [`to_picture_order`](crate::irradiance::to_picture_order)) as a
/// picture.
pub fn irradiance_picture(irradiance: &Field<f64>, exposure: Exposure) -> GrayImage {
    grey(irradiance.nx(), irradiance.ny(), |k| exposure.encoded(irradiance.as_slice()[k]))
}

/// The difference of two pictures as they are seen, four times enlarged and inverted (figures 13
/// and 14 of the paper, part d): white where they agree, black where they differ by a quarter of
/// the scale or more. Both in picture order.
///
/// # Panics
/// If the two have different sizes.
pub fn difference_picture(target: &Field<f64>, caustic: &Field<f64>, exposure: Exposure) -> GrayImage {
    const ENLARGED: f64 = 4.0;
    assert_eq!((target.nx(), target.ny()), (caustic.nx(), caustic.ny()), "pictures of one size");
    grey(target.nx(), target.ny(), |k| {
        let [a, b] = [target, caustic].map(|field| exposure.encoded(field.as_slice()[k]));
        1.0 - ENLARGED * (a - b).abs()
    })
}

fn grey(nx: usize, ny: usize, value: impl Fn(usize) -> f64) -> GrayImage {
    GrayImage::from_fn(nx as u32, ny as u32, |i, j| {
        Luma([(value(j as usize * nx + i as usize).clamp(0.0, 1.0) * 255.0).round() as u8])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> TargetIrradiance {
        TargetIrradiance::new(Field::from_fn(256, 8, |i, _| i as f64)).unwrap()
    }

    #[test]
    fn the_target_fills_the_scale_in_either_encoding() {
        let ramp = ramp();
        let picture = irradiance_picture(ramp.cells(), Exposure::of(&ramp, Transfer::Linear));
        for i in 0..256 {
            assert_eq!(picture.get_pixel(i, 3).0[0], i as u8);
        }
        let picture = irradiance_picture(ramp.cells(), Exposure::of(&ramp, Transfer::Srgb));
        assert_eq!(picture.get_pixel(255, 0).0[0], 255);
        // Middle grey of sRGB: 55 of 255 of the light.
        assert_eq!(picture.get_pixel(55, 0).0[0], 128);
    }

    #[test]
    fn the_difference_is_enlarged_four_times_and_inverted() {
        let ramp = ramp();
        let exposure = Exposure::of(&ramp, Transfer::Linear);
        let step = exposure.white / 255.0;
        for (steps, grey) in [(0, 255), (1, 251), (-10, 215), (60, 15), (100, 0)] {
            let caustic = ramp.cells().map(|v| v + f64::from(steps) * step);
            let picture = difference_picture(ramp.cells(), &caustic, exposure);
            assert_eq!(picture.get_pixel(120, 4).0[0], grey, "{steps} steps");
        }
    }
}
