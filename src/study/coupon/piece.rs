//! The coupon of a plan, and where its light falls by single rays: the page's scales are drawn so.

use super::{
    face::{LADDER_MM, Layout, Ruling, Shows, Strip},
    plan::{CouponError, CouponPlan},
    ray::Ray,
};
use crate::{
    bench::ExitFace,
    export,
    fabricate::{FaceShape, Machining, Pass, Pattern, Place, Program, Sense},
    failure::Failure,
    solid::{Shape, Solid},
    surface::HeightField,
};
use glam::DVec2;

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

    /// The program of its finishing pass.
    pub fn program(&self, pass: Pass, machining: Machining) -> Program<'_> {
        let place = Place {
            top_mm: Solid::highest_mm(self.surface()),
            floor_mm: self.solid.entry_z_mm(),
            rim_mm: None,
            origin_mm: self.solid.origin_mm(),
        };
        let (pattern, sense, roughing) = (Pattern::Rows, Sense::BothWays, None);
        Program { surface: self.surface(), pass, pattern, sense, roughing, machining, place }
    }

    /// What the program says of it first.
    pub fn about(&self) -> Vec<String> {
        let (stock, solid) = (self.solid.stock_extent(), &self.solid);
        vec![
            format!("glasswarp {} test coupon, {}", env!("CARGO_PKG_VERSION"), solid.frame_line()),
            format!(
                "stock {} x {} x {} mm, clamped by its walls below the face",
                stock.width_mm,
                stock.height_mm,
                solid.thickness_mm()
            ),
        ]
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
        LADDER_MM
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
