//! What the page of a test coupon says.

use super::common::{mm, program, row};
use crate::{
    fabricate::{Pass, Scallop},
    report::{
        coupon::{SHEET_MM, coupon_bench, coupon_face, coupon_sheet},
        html::{CouponSheet, Facts, ReadingRule, View, coupon_html},
    },
    study::coupon::{Coupon, SeenCoupon},
};
use glam::DVec2;
use glasswarp_verify::Image;
use image::{GrayImage, Luma};

/// A coupon, and how it looks after some work on it.
pub(crate) struct CouponPage<'a> {
    pub(crate) coupon: &'a Coupon,
    pub(crate) seen: &'a [SeenCoupon],
    /// The pass of the program.
    pub(crate) pass: Pass,
    /// The command that made it.
    pub(crate) command: String,
}

impl CouponPage<'_> {
    /// The page by which it is read.
    pub(crate) fn html(&self) -> String {
        coupon_html(&self.page())
    }

    fn page(&self) -> CouponSheet {
        let coupon = self.coupon;
        CouponSheet {
            about: "A small piece of glass whose light tells what has to be known of a bench before a block is designed for it: how much the polish blurs, which index the glass has, and what the rows of the cutter leave. All of it is read with a ruler from one sheet of paper in the light of one small lamp.".into(),
            steps: self.steps(),
            rules: self.rules(),
            cautions: self.cautions(),
            face: coupon_face(coupon),
            bench: coupon_bench(coupon),
            sheet: coupon_sheet(coupon),
            sheet_mm: SHEET_MM.x,
            seen: self.seen.iter().map(view).collect(),
            rulings: coupon
                .rulings
                .iter()
                .map(|ruling| {
                    [
                        ruling.number.to_string(),
                        format!("{:.3} mm", ruling.period_mm),
                        format!("{:.2} µm", 2e3 * ruling.amplitude_mm),
                        format!("polish={:.3}mm", ruling.sigma_mm),
                    ]
                })
                .collect(),
            indices: coupon
                .index_scale()
                .into_iter()
                .map(|(ior, apart)| [format!("{ior:.2}"), format!("{apart:.2} mm")])
                .collect(),
            facts: self.facts(),
            command: self.command.clone(),
            program: program(),
        }
    }

    fn steps(&self) -> Vec<String> {
        let (plan, solid) = (&self.coupon.plan, &self.coupon.solid);
        let stock = solid.stock_extent();
        vec![
            format!(
                "Cut the coupon ({} × {} mm, from a sheet {} mm thick) as you will cut the block: roughed, then finished with your cutter ({}) in rows along x, the shorter side. Leave the back as it is.",
                mm(stock.width_mm),
                mm(stock.height_mm),
                mm(solid.thickness_mm()),
                plan.cutter.in_words()
            ),
            "Read it once as it comes from the machine: that tells step-over, direction and index. Then polish it as you will polish the block, clean it, and read the polish.".into(),
            format!(
                "Print this file at 100 % and hang the page with the scales upright in a dark room. Put a small lamp (a phone’s torch with a hole of {} mm before it; not the sun, which is too large) {} mm before the flat face of the coupon, and the paper {} mm behind that face, all three in a line. The ruled face looks at the paper, the coarse rulings are on top.",
                mm(plan.lamp_diameter_mm),
                mm(plan.lamp_mm),
                mm(plan.distance_mm)
            ),
            "Shift the paper sideways and up or down until both uprights stand at the same index of their scales and the spot lies in its circle. Then measure its distance from the flat face again, to a millimetre.".into(),
        ]
    }

    fn rules(&self) -> Vec<ReadingRule> {
        let coupon = self.coupon;
        let ior = coupon.plan.ior;
        let rule = |of: &str, see: String, means: String, types: &[String]| ReadingRule {
            of: of.into(),
            see,
            means,
            types: types.to_vec(),
        };
        let number = |k: usize| &coupon.rulings[k.min(coupon.rulings.len() - 1)];
        let (a, b) = (number(9), number(10));
        let streak = coupon.streak_mm(self.pass.step_over_mm, DVec2::Y, ior);
        let per_mm = self.pass.step_over_mm / streak;
        vec![
            rule(
                "Index",
                "the two bright upright lines left and right: where they cross the two scales in the middle of the sheet".into(),
                format!(
                    "the mean of what both scales say; finer: measure from line to line with a ruler, to half a millimetre, and look it up in the table ({:.1} mm are {ior}; a millimetre more is {:.4} more)",
                    coupon.uprights_mm(ior),
                    1.0 / (100.0 * (coupon.uprights_mm(ior + 0.01) - coupon.uprights_mm(ior)))
                ),
                &[format!("--ior {ior}")],
            ),
            rule(
                "Polish",
                "the ladder between them. Three short bars are marks; draw a pencil line down through their left ends and one through their right ends. Go down from bar 1: which is the last bar that reaches beyond the pencil lines?".into(),
                format!(
                    "the polish stands beside that bar; if the next one falls short by as much, it is halfway between the two (bar {} just beyond, bar {} just short: between {:.3} and {:.3} mm)",
                    a.number, b.number, b.sigma_mm, a.sigma_mm
                ),
                &[format!("--finish polish={:.2}mm", a.sigma_mm), format!("--polish {:.2}mm", a.sigma_mm)],
            ),
            rule(
                "Step-over",
                "the spot at the top, before polishing: the length of the streak that it is drawn out to".into(),
                format!(
                    "the step-over stands beside its ends; {:.4} mm to every millimetre of streak with this cutter ({streak:.1} mm are {} mm)",
                    per_mm, self.pass.step_over_mm
                ),
                &[format!("--step-over {}mm", self.pass.step_over_mm)],
            ),
            rule(
                "Direction",
                "the direction of the streak".into(),
                "rows run across it: an upright streak means rows along x, a level one rows along y. With anything but an upright streak the bars are too long: turn the piece on the machine and cut again before you read the polish".into(),
                &[format!("--direction {}", self.pass.direction)],
            ),
        ]
    }

    fn cautions(&self) -> Vec<String> {
        let coupon = self.coupon;
        let (Some(first), Some(last)) = (coupon.rulings.first(), coupon.rulings.last()) else { return Vec::new() };
        vec![
            format!(
                "A millimetre of distance too much is {:.4} of index too much, and no change of the polish: bars and marks grow alike.",
                coupon.ior_per_mm(coupon.plan.ior)
            ),
            format!(
                "Every bar longer than the marks: the polish is below {:.3} mm. Measure the last bar and the mark: a quotient of 1.8 means {:.3} mm, 1.5 means {:.3} mm. No bar longer than the marks: it is above {:.2} mm.",
                last.sigma_mm,
                last.sigma_at(1.8),
                last.sigma_at(1.5),
                first.sigma_mm
            ),
            format!(
                "The finest ruling is {:.2} µm deep. A machine that cannot hold this shortens bars too: what the bars say before polishing is the machine’s own blur, and the polish alone is the root of the difference of the squares. While the spot is still a streak, only what lies on the ladder counts.",
                2e3 * last.amplitude_mm
            ),
            "Streaks of fine rows and bars of short waves may break into coloured dots: diffraction, which the pictures do not show. Read from the outermost dots.".into(),
            format!(
                "If the index is more than 0.02 away from {}, make the coupon again for what you read: lines are then sharp.",
                coupon.plan.ior
            ),
        ]
    }

    fn facts(&self) -> Facts {
        let (coupon, plan, solid) = (self.coupon, &self.coupon.plan, &self.coupon.solid);
        let stock = solid.stock_extent();
        let mut rows = vec![
            row("Stock", format!("{} × {} × {} mm", mm(stock.width_mm), mm(stock.height_mm), mm(solid.thickness_mm()))),
            row(
                "Relief",
                format!("{:.2} mm; {:.2} mm at the thinnest place", coupon.surface().relief_mm(), solid.thinnest_mm()),
            ),
            row("Cutter", plan.cutter.in_words()),
            row("Sharpest hollow", format!("{:.2} mm radius", coupon.sharpest_mm)),
            row("Steepest place", format!("{:.1}°", coupon.steepest.atan().to_degrees())),
            row("Planned for index", format!("{}", plan.ior)),
            row("Blur by the lamp’s size", format!("{:.2} mm on the paper", plan.blur_mm())),
            row("Full bar", format!("{:.1} mm from end to end", 2.0 * coupon.reach_mm(plan.ior))),
            row("Coordinates", solid.frame_line()),
        ];
        if let Some(scallop) = Scallop::of(plan.cutter, self.pass.step_over_mm) {
            rows.push(row("Scallops", format!("{:.2} µm at {} mm", 1e3 * scallop.height_mm, self.pass.step_over_mm)));
        }
        Facts { title: "This coupon".into(), rows }
    }
}

/// The light of a coupon, as bright as a dark room shows it, cut to what is lit.
fn view(seen: &SeenCoupon) -> View {
    View {
        title: seen.name.clone(),
        note: format!("reads: {}", seen.in_words()),
        alt: format!("The light on the sheet of a coupon: {}", seen.name),
        picture: picture(&seen.image),
    }
}

/// Share of the pixels that are shown white, and the exponent of the tones.
const WHITE: f64 = 0.002;
const TONES: f64 = 0.55;
/// Part of the image that is shown.
const SHOWN: f64 = 0.92;

fn picture(image: &Image) -> GrayImage {
    let mut sorted = image.values.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let white = sorted[((1.0 - WHITE) * (sorted.len() - 1) as f64) as usize].max(f64::MIN_POSITIVE);
    let size = |n: usize| ((SHOWN * n as f64) as u32, ((1.0 - SHOWN) / 2.0 * n as f64) as usize);
    let ((nx, left), (ny, top)) = (size(image.nx), size(image.ny));
    GrayImage::from_fn(nx, ny, |i, j| {
        let value = image.values[(j as usize + top) * image.nx + i as usize + left];
        Luma([(255.0 * (value / white).min(1.0).powf(TONES)) as u8])
    })
}
