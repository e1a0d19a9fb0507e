//! A test coupon.

use super::{list, put};
use crate::{
    report::pages::common::mm,
    study::coupon::{Coupon, SeenCoupon},
};
use std::path::PathBuf;

/// The coupon, what it will tell, and what was read in traced light.
pub(crate) fn coupon(coupon: &Coupon, seen: &[SeenCoupon], files: &[PathBuf]) -> String {
    let mut text = String::new();
    let (plan, solid) = (&coupon.plan, &coupon.solid);
    put!(text, "{}", list(files));
    put!(
        text,
        "  coupon         {} x {} mm from a sheet of {} mm, {:.2} mm at its thinnest place",
        mm(solid.stock_extent().width_mm),
        mm(solid.stock_extent().height_mm),
        mm(solid.thickness_mm()),
        solid.thinnest_mm()
    );
    put!(
        text,
        "  cut with       {}; the sharpest hollow has a radius of {:.2} mm",
        plan.cutter.in_words(),
        coupon.sharpest_mm
    );
    put!(
        text,
        "  read           {} mm before a sheet of paper, {} mm behind a lamp of {} mm",
        mm(plan.distance_mm),
        mm(plan.lamp_mm),
        mm(plan.lamp_diameter_mm)
    );
    if let (Some(first), Some(last)) = (coupon.rulings.first(), coupon.rulings.last()) {
        put!(
            text,
            "  polish         sigma {:.3} to {:.3} mm in {} rulings; the shallowest is {:.2} um deep",
            last.sigma_mm,
            first.sigma_mm,
            coupon.rulings.len(),
            2e3 * last.amplitude_mm
        );
    }
    put!(
        text,
        "  index          {:.2} mm between the uprights at {}; {:.5} too high for a millimetre too far",
        coupon.uprights_mm(plan.ior),
        plan.ior,
        coupon.ior_per_mm(plan.ior)
    );
    put!(text, "\n  traced, and read by the rules of the page:");
    for view in seen {
        put!(text, "  {:<44} {}", view.name, view.in_words());
    }
    text
}
