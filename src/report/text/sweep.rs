//! How errors change with the bench.

use super::put;
use crate::{
    spec::Quantity,
    study::sweep::{Law, SweepPoint},
};

/// What stands above the [points](point).
pub(crate) fn header(quantity: Quantity) -> String {
    let mut text = String::new();
    put!(text, "{:>12} {:>10}   relative RMS:", quantity.column(), "relief mm");
    put!(text, "{:>23} {:>10} {:>10} {:>10} {:>10}   plane moves by", "", "displaced", "plane", "smooth", "facets");
    text
}

/// The errors at one place of the range.
pub(crate) fn point(point: &SweepPoint) -> String {
    let errors: String = point.views.iter().map(|view| format!(" {:>10.4}", view.rel_rms)).collect();
    format!("{:>12} {:>10.3}{errors} {:>16.4}\n", point.value, point.relief_mm, point.plane_moves)
}

/// The law that they follow.
pub(crate) fn law(law: &Law) -> String {
    let mut text = String::new();
    put!(
        text,
        "\nThe plane moves the light by {:.2} r / (1 + {:.2} r) of its mean, r = relief / distance, within {:.1} %.",
        law.a,
        law.b,
        100.0 * law.residual
    );
    text
}
