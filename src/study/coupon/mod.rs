//! A small piece of glass that tells of a bench what nobody knows of his own: how far the polish
//! blurs, which index the glass has, and what the cutter's rows leave.
//!
//! In the light of a small lamp the piece draws a ladder on a sheet of paper. Every rung is the
//! light of a ruling, a sinusoidal wave along x, spread over a bar as long as the wave is steep. A
//! polish shortens the bars of short waves first; that of a long wave, half as steep, marks half of
//! their length. Two uprights come from wedges, as far apart as the index says, and a spot at the
//! top from a plain lens, which scallops draw out to a streak.

mod face;
mod light;
mod read;
mod seen;

pub use light::CouponState;
pub use read::{Ladder, Polished, Reading, Streak, Unreadable};
pub use seen::SeenCoupon;

use crate::{
    bench::ExitFace,
    export,
    fabricate::{Cutter, FaceShape},
    failure::Failure,
    solid::{Shape, Solid, Stock},
    surface::HeightField,
};
use face::{Layout, Shows, Strip};
use glam::DVec2;
use light::Ray;

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

    fn check(&self) -> Result<(), CouponError> {
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

/// A ruling of the ladder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ruling {
    /// Its number on the page, from 1.
    pub number: usize,
    /// Its period, mm.
    pub period_mm: f64,
    /// Amplitude of the wave, mm.
    pub amplitude_mm: f64,
    /// The standard deviation of the polish that makes its bar as long as the marks, mm.
    pub sigma_mm: f64,
    /// Where it lies on the face: from and to, along y, mm.
    pub strip_mm: [f64; 2],
}

/// What a line of light across the sheet is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RungShows {
    /// The spot at the top.
    Spot,
    /// A bar half as long as all others were made.
    Marks,
    /// The bar of this ruling, counted from 0.
    Ruling(usize),
}

/// A line of light across the sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// What it is.
    pub shows: RungShows,
    /// Where it is, mm along y from the axis.
    pub at_mm: f64,
}

/// A coupon.
#[derive(Clone, Debug)]
pub struct Coupon {
    /// What it is made for.
    pub plan: CouponPlan,
    /// The block.
    pub solid: Solid,
    /// The ladder from its coarsest ruling, at the top of the sheet.
    pub rulings: Vec<Ruling>,
    /// The sharpest hollow of the face, radius, mm.
    pub sharpest_mm: f64,
    /// The steepest place of the face, slope.
    pub steepest: f64,
    layout: Layout,
    ray: Ray,
}

impl Coupon {
    /// The coupon of a plan.
    ///
    /// # Errors
    /// [`CouponError`], or a stock that does not hold it.
    pub fn of(plan: CouponPlan, shape: Shape) -> Result<Self, Failure> {
        plan.check().map_err(Failure::refused)?;
        let layout = Layout::of(&plan).map_err(Failure::refused)?;
        let surface = layout.surface();
        let face = FaceShape::of(&surface);
        let (sharpest_mm, corner_mm) = (face.sharpest().radius_mm, plan.cutter.corner_mm());
        if sharpest_mm < corner_mm {
            let cutter = plan.cutter;
            return Err(Failure::refused(CouponError::Hollow { radius_mm: sharpest_mm, corner_mm, cutter }));
        }
        let solid = Solid::shaped(&surface, plan.stock, shape).map_err(Failure::refused)?;
        let ray = Ray::of(&plan, &surface, solid.entry_z_mm());
        Ok(Self { plan, solid, rulings: layout.rulings(), sharpest_mm, steepest: face.steepest().1, layout, ray })
    }

    /// The exit face.
    pub fn surface(&self) -> &HeightField {
        self.solid.surface()
    }

    /// From the mean plane of the exit face to the sheet, mm: the plan counts from the flat face.
    pub fn distance_mm(&self) -> f64 {
        self.plan.distance_mm + self.solid.entry_z_mm()
    }

    /// How far apart the two uprights stand in the middle of the sheet, mm, at an index.
    pub fn uprights_mm(&self, ior: f64) -> f64 {
        uprights_mm(&self.ray, ior)
    }

    /// The index at which the uprights stand that far apart, if there is one between the limits of
    /// plans.
    pub fn ior_of_uprights(&self, apart_mm: f64) -> Option<f64> {
        let (low, high) = CouponPlan::IOR_LIMITS;
        inverse(|ior| self.uprights_mm(ior), apart_mm, low, high)
    }

    /// By how much the index is read too high for every millimetre that the sheet is further away
    /// than it was meant to be.
    pub fn ior_per_mm(&self, ior: f64) -> f64 {
        let h = 1e-4;
        let per_ior = (self.uprights_mm(ior + h) - self.uprights_mm(ior - h)) / (2.0 * h);
        (uprights_mm(&self.ray.further(1.0), ior) - self.uprights_mm(ior)) / per_ior
    }

    /// How long a streak scallops draw across the rows from the spot at the top, mm.
    pub fn streak_mm(&self, step_over_mm: f64, towards: DVec2, ior: f64) -> f64 {
        let half = 0.5 * step_over_mm;
        let slope = half / (self.plan.cutter.corner_mm().powi(2) - half * half).max(0.0).sqrt();
        let at = DVec2::new(0.0, self.layout.strips[0].middle_mm());
        let ends = [-slope, slope].map(|slope| self.ray.landing(at, slope * towards, ior));
        ends[0].distance(ends[1])
    }

    /// The step-over that draws a streak of this length, mm.
    pub fn step_over_of_streak(&self, length_mm: f64, towards: DVec2, ior: f64) -> Option<f64> {
        let most = self.plan.cutter.corner_mm();
        inverse(|step_over| self.streak_mm(step_over, towards, ior), length_mm, 0.0, most)
    }

    /// The spot at the top and all rungs of the ladder downwards, at an index.
    pub fn rungs(&self, ior: f64) -> Vec<Rung> {
        let mut number = 0;
        let rung = |strip: &Strip| {
            let shows = match strip.shows {
                Shows::Lens => RungShows::Spot,
                Shows::Marks => RungShows::Marks,
                Shows::Ruling(_) => {
                    number += 1;
                    RungShows::Ruling(number - 1)
                }
            };
            // The wave itself throws no light along y.
            Rung { shows, at_mm: self.ray.plain_landing(DVec2::new(0.0, strip.middle_mm()), ior).y }
        };
        self.layout.strips.iter().map(rung).collect()
    }

    /// Strips of the face from the top: where each begins and ends along y, mm, what it shows, and
    /// the period of its wave, mm.
    pub fn strips(&self) -> impl Iterator<Item = (f64, f64, RungShows, Option<f64>)> {
        let shows = self.rungs(self.plan.ior).into_iter().map(|rung| rung.shows);
        let strips = self.layout.strips.iter().zip(shows);
        strips.map(|(strip, shows)| (strip.top_mm, strip.bottom_mm, shows, strip.wave.map(|[period, _]| period)))
    }

    /// How far the ladder reaches on the face to either side of its middle, along x, mm.
    pub fn ladder_edge_mm(&self) -> f64 {
        face::LADDER_MM
    }

    /// Half of the length of a bar that nothing has shortened, mm, at an index.
    pub fn reach_mm(&self, ior: f64) -> f64 {
        self.layout.reach_mm * (ior - 1.0) / (self.plan.ior - 1.0)
    }

    /// What the exporters say of it.
    pub fn export_design(&self) -> export::Design {
        export::Design {
            name: "test coupon".into(),
            exit_face: ExitFace::Refracts { ior: self.plan.ior },
            distance_mm: self.distance_mm(),
        }
    }
}

impl Ruling {
    /// What a polish leaves of its wave, `exp(-2 pi^2 sigma^2 / L^2)`.
    pub fn left_by(&self, sigma_mm: f64) -> f64 {
        face::left(sigma_mm, self.period_mm)
    }

    /// The polish at which its bar is this many times as long as the marks, mm.
    pub fn sigma_at(&self, against_marks: f64) -> f64 {
        face::sigma_leaving(0.5 * against_marks, self.period_mm)
    }
}

fn uprights_mm(ray: &Ray, ior: f64) -> f64 {
    // Out of focus a line is as wide as the wedge, and its middle that of its places.
    let (sum, count) = Layout::wedge_places()
        .map(|x| ray.landing(DVec2::new(x, 0.0), DVec2::ZERO, ior).x)
        .fold((0.0, 0), |(sum, count), x| (sum + x, count + 1));
    2.0 * (sum / f64::from(count)).abs()
}

/// Where a rising function has a value.
fn inverse(f: impl Fn(f64) -> f64, value: f64, mut low: f64, mut high: f64) -> Option<f64> {
    if !(f(low) <= value && value <= f(high)) {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle) < value {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}
