//! What a coupon is made for.

use crate::{fabricate::Cutter, solid::Stock};

/// What a coupon is made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CouponPlan {
    /// The index that the glass is believed to have: where things lie on the sheet, not what is
    /// read from them.
    pub ior: f64,
    /// From the flat face of the coupon to the sheet of paper, mm.
    pub distance_mm: f64,
    /// From the lamp to the flat face of the coupon, mm.
    pub lamp_mm: f64,
    /// Diameter of the lamp, mm.
    pub lamp_diameter_mm: f64,
    /// The finishing cutter.
    pub cutter: Cutter,
    /// The sheet of glass.
    pub stock: Stock,
}

impl CouponPlan {
    /// Accepted indices.
    pub const IOR_LIMITS: (f64, f64) = (1.3, 2.0);
    /// Accepted distances of the sheet, mm: nearer than the lower one the wedges become too steep.
    pub const DISTANCE_LIMITS_MM: (f64, f64) = (500.0, 3000.0);
    /// Accepted distances of the lamp, mm.
    pub const LAMP_LIMITS_MM: (f64, f64) = (500.0, 100_000.0);
    /// Least accepted diameter of the lamp, mm.
    pub const LEAST_LAMP_DIAMETER_MM: f64 = 0.1;

    /// Greatest diameter of the blur that the lamp's own size makes on the sheet, mm: dots stand
    /// that far from what is to be told from them.
    pub const MOST_BLUR_MM: f64 = 1.5;

    /// Diameter of the image of the lamp on the sheet, by which everything on it is blurred, mm.
    pub fn blur_mm(&self) -> f64 {
        self.lamp_diameter_mm * self.distance_mm / self.lamp_mm
    }

    pub(super) fn check(&self) -> Result<(), CouponError> {
        let limits = |what, value: f64, (least, greatest): (f64, f64)| {
            if (least..=greatest).contains(&value) {
                Ok(())
            } else {
                Err(CouponError::Value { what, value, least, greatest })
            }
        };
        limits("the refractive index (`ior`)", self.ior, Self::IOR_LIMITS)?;
        limits("the distance of the sheet (`distance`), mm,", self.distance_mm, Self::DISTANCE_LIMITS_MM)?;
        limits("the distance of the lamp (`lamp-distance`), mm,", self.lamp_mm, Self::LAMP_LIMITS_MM)?;
        let most = Self::MOST_BLUR_MM * self.lamp_mm / self.distance_mm;
        if !(self.lamp_diameter_mm >= Self::LEAST_LAMP_DIAMETER_MM && self.lamp_diameter_mm <= most) {
            return Err(CouponError::Lamp {
                diameter_mm: self.lamp_diameter_mm,
                least_mm: Self::LEAST_LAMP_DIAMETER_MM,
                most_mm: most,
                away_mm: self.lamp_diameter_mm * self.distance_mm / Self::MOST_BLUR_MM,
            });
        }
        if self.cutter.corner_mm() <= 0.0 {
            return Err(CouponError::Flat { cutter: self.cutter });
        }
        Ok(())
    }
}

/// A coupon that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CouponError {
    /// A number out of its limits.
    #[error("{what} is {value}; it must lie between {least} and {greatest}")]
    Value {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Least accepted one.
        least: f64,
        /// Greatest accepted one.
        greatest: f64,
    },
    /// A lamp that would blur what it shall show.
    #[error(
        "the lamp (`lamp-diameter`) is {diameter_mm} mm across; at these distances it must lie between {least_mm} mm and {most_mm:.2} mm: put it at least {away_mm:.0} mm away (`lamp-distance`), or before it a plate with a smaller hole"
    )]
    Lamp {
        /// Its diameter, mm.
        diameter_mm: f64,
        /// Least accepted one, mm.
        least_mm: f64,
        /// Greatest accepted one, mm.
        most_mm: f64,
        /// From where on this one would do, mm.
        away_mm: f64,
    },
    /// A cutter that leaves steps.
    #[error(
        "{cutter} has no round corner, and rulings cut with it are steps: take a ball or bull-nose cutter (`cutter`)"
    )]
    Flat {
        /// The cutter.
        cutter: Cutter,
    },
    /// A cutter too large for the coupon.
    #[error(
        "the coupon has hollows of {radius_mm:.2} mm radius, less than the {corner_mm} mm of {cutter}: take a smaller cutter (`cutter`), or a sheet further away (`distance`)"
    )]
    Hollow {
        /// The sharpest hollow's radius, mm.
        radius_mm: f64,
        /// The cutter's, mm.
        corner_mm: f64,
        /// The cutter.
        cutter: Cutter,
    },
    /// Rows too near to each other to be shown.
    #[error(
        "showing rows {step_over_mm} mm apart takes {nx} x {ny} nodes, more than {most}: take a larger step-over (`step-over`)"
    )]
    Rows {
        /// Step-over, mm.
        step_over_mm: f64,
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
        /// Most that are taken.
        most: usize,
    },
    /// A cutter that no polish of interest could be told with.
    #[error(
        "{cutter} cuts no ruling that would tell a polish below {finest_mm:.2} mm, and the coarsest is {coarsest_mm} mm: take a smaller cutter (`cutter`), or a sheet further away (`distance`)"
    )]
    Coarse {
        /// The cutter.
        cutter: Cutter,
        /// The finest polish that it could tell, mm.
        finest_mm: f64,
        /// The coarsest that is told, mm.
        coarsest_mm: f64,
    },
}
