//! A coupon as it looks after some work on it, for the page and as the proof that it can be read.

use super::{
    light::CouponState,
    piece::Coupon,
    plan::CouponPlan,
    read::{Polished, Reading, Unreadable},
};
use crate::{
    fabricate::{Direction, Pass},
    failure::Failure,
    record::document,
    solver::Progress,
    study::{
        bench::block_document,
        progress::{advance, begin},
    },
    surface::Polish,
};
use glasswarp_verify::{Block, Image, Mesh};

/// The light of a coupon after some work on it, and what is read from it.
pub struct SeenCoupon {
    /// What was done, in words.
    pub name: String,
    /// What was done.
    pub state: CouponState,
    /// The light on the sheet.
    pub image: Image,
    /// What is read from it.
    pub reading: Result<Reading, Unreadable>,
}

/// Photons to a picture.
const PHOTONS: u64 = 1 << 22;
/// Polishes that are shown, mm.
const SIGMAS_MM: [f64; 2] = [0.1, 0.25];
/// By how much the glass of one picture has another index than planned.
const OFF: f64 = 0.02;

impl SeenCoupon {
    /// A coupon that was found in a file, or as it was made: milled by a pass, polished in two
    /// ways, and of glass of another index. Rows that are shown run along x.
    ///
    /// # Errors
    /// A file that holds no block, a pass that does not fit the coupon.
    pub fn all(
        coupon: &Coupon,
        found: Option<Mesh>,
        pass: Pass,
        progress: &dyn Progress,
    ) -> Result<Vec<Self>, Failure> {
        let block = match found {
            Some(mesh) => Block::from_mesh(&mesh.moved(coupon.solid.origin_mm())),
            None => {
                let heights = coupon.surface().heights_mm();
                let extent = coupon.surface().extent().as_vec();
                let nodes = (heights.nx(), heights.ny());
                Block::from_heights(extent, coupon.solid.entry_z_mm(), nodes, heights.as_slice().to_vec())
            }
        };
        let what = || "the file of the coupon, read back, is no block".to_owned();
        let block = block.map_err(|error| Failure::InvalidMesh { what: what(), source: Some(error.into()) })?;
        let ior = coupon.plan.ior;
        let pass = Pass { direction: Direction::X, allowance_mm: 0.0, ..pass };
        let milled = format!("milled along x, rows {} mm apart", pass.step_over_mm);
        let [fine, coarse] = SIGMAS_MM.map(|sigma| (sigma, Polish::new(sigma).ok()));
        let polished = |sigma: f64| format!("cut perfectly, polish {sigma} mm");
        let states = [
            (format!("{milled}, not polished"), ior, Some(pass), None),
            (polished(fine.0), ior, None, fine.1),
            (polished(coarse.0), ior, None, coarse.1),
            (format!("{}, index {:.3}", polished(fine.0), ior + OFF), ior + OFF, None, fine.1),
        ];
        begin(progress, "milling and tracing", states.len())?;
        let mut seen = Vec::new();
        for (name, ior, pass, polish) in states {
            let state = CouponState { ior, pass, polish };
            let image = coupon.seen(&block, &state, PHOTONS)?;
            let reading = Reading::of(coupon, &image, &Coupon::window());
            seen.push(Self { name, state, image, reading });
            advance(progress, seen.len())?;
        }
        Ok(seen)
    }

    /// What is read, in words.
    pub fn in_words(&self) -> String {
        let reading = match &self.reading {
            Ok(reading) => reading,
            Err(fault) => return fault.to_string(),
        };
        let mut words = format!("index {:.4}", reading.ior);
        words += &match self.polish() {
            None => String::new(),
            Some(Polished::Above { sigma_mm }) => format!(", polish above {sigma_mm:.3} mm"),
            Some(polish) => format!(", polish {:.4} mm", polish.sigma_mm()),
        };
        if let Some(streak) = &reading.streak {
            words += &format!(", rows {:.3} mm apart at {:.0} degrees", streak.step_over_mm, streak.rows_deg);
        }
        words
    }

    /// The polish that is read. While rows still show, no one below the ladder is: scallops dim the
    /// ends of bars by as much.
    fn polish(&self) -> Option<Polished> {
        let reading = self.reading.as_ref().ok()?;
        let polish = reading.ladder.as_ref()?.polish;
        let lost = matches!(polish, Polished::Below { .. }) && reading.streak.is_some();
        (!lost).then_some(polish)
    }

    fn document(&self) -> document::CouponReading {
        let reading = self.reading.as_ref().ok();
        let streak = reading.and_then(|reading| reading.streak);
        document::CouponReading {
            state: self.name.clone(),
            ior: self.state.ior,
            ior_read: reading.map(|reading| reading.ior),
            polish_read_mm: self.polish().map(|polish| polish.sigma_mm()),
            step_over_read_mm: streak.map(|streak| streak.step_over_mm),
            rows_read_deg: streak.map(|streak| streak.rows_deg),
        }
    }
}

/// Indices that the scale reaches from and to at least, how far beyond that of the plan, and its
/// step.
const SCALE: (f64, f64) = (1.44, 1.62);
const BEYOND: f64 = 0.05;
const STEP: f64 = 0.01;

impl Coupon {
    /// Indices, and how far apart the uprights stand at each, mm.
    pub fn index_scale(&self) -> Vec<(f64, f64)> {
        let (low, high) = CouponPlan::IOR_LIMITS;
        let from = SCALE.0.min(self.plan.ior - BEYOND).max(low);
        let to = SCALE.1.max(self.plan.ior + BEYOND).min(high);
        let steps = (from / STEP).ceil() as u32..=(to / STEP + 1e-9).floor() as u32;
        steps.map(|k| f64::from(k) / STEP.recip()).map(|ior| (ior, self.uprights_mm(ior))).collect()
    }

    /// The record of a coupon.
    pub fn document(&self, seen: &[SeenCoupon], files: Vec<String>) -> document::Coupon {
        let heights = self.surface().heights_mm();
        document::Coupon {
            files,
            block: block_document(&self.solid, self.surface().relief_mm(), (heights.nx(), heights.ny())),
            ior: self.plan.ior,
            distance_mm: self.plan.distance_mm,
            lamp_distance_mm: self.plan.lamp_mm,
            lamp_diameter_mm: self.plan.lamp_diameter_mm,
            cutter: self.plan.cutter.to_string(),
            sharpest_mm: self.sharpest_mm,
            rulings: self
                .rulings
                .iter()
                .map(|ruling| document::CouponRuling {
                    number: ruling.number,
                    period_mm: ruling.period_mm,
                    amplitude_mm: ruling.amplitude_mm,
                    sigma_mm: ruling.sigma_mm,
                })
                .collect(),
            uprights: self
                .index_scale()
                .into_iter()
                .map(|(ior, apart_mm)| document::CouponUprights { ior, apart_mm })
                .collect(),
            ior_per_mm: self.ior_per_mm(self.plan.ior),
            readings: seen.iter().map(SeenCoupon::document).collect(),
        }
    }
}
