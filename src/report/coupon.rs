//! Drawings of a test coupon: its face, the bench on which it is read, and the sheet of paper, in
//! true size, with the scales by which it is read.

use super::{
    dimension::{Beside, dimension},
    svg::{Anchor, Lettering, Pen, Svg, arrow, ring},
};
use crate::study::coupon::{Coupon, RungShows};
use glam::DVec2;

const BOLD: Pen = Pen { width: 3.0, grey: 20 };
const INK: Lettering = Lettering { height: 17.0, grey: 20, halo: 0.0 };
const SOFT: Lettering = Lettering { height: 17.0, grey: 90, halo: 0.0 };

/// The name of a ruling or of what lies between them.
fn named(shows: RungShows) -> String {
    match shows {
        RungShows::Spot => "lens".into(),
        RungShows::Marks => "mark".into(),
        RungShows::Ruling(k) => format!("{}", k + 1),
    }
}

/// The structured face from above, with its strips and the direction of the rows.
pub fn coupon_face(coupon: &Coupon) -> Svg {
    const SCALE: f64 = 15.0;
    let size = coupon.surface().extent().as_vec();
    let mut sheet = Svg::new(880, 760);
    let corner = DVec2::new(120.0, 60.0);
    // Seen from the receiver: right is +x, top is +y.
    let at = |x: f64, y: f64| corner + SCALE * DVec2::new(x + 0.5 * size.x, 0.5 * size.y - y);
    let frame = [at(-0.5 * size.x, 0.5 * size.y), at(0.5 * size.x, -0.5 * size.y)];
    let edge = coupon.ladder_edge_mm();
    for (top, bottom, shows, period) in coupon.strips() {
        let (left, right) = (at(-0.5 * size.x, bottom), at(0.5 * size.x, bottom));
        sheet.line(left, right, Pen { width: 0.8, grey: 190 });
        let middle = 0.5 * (top + bottom);
        let words = match shows {
            RungShows::Ruling(k) => {
                format!("{}   {:.2} mm", named(shows), coupon.rulings[k].period_mm)
            }
            other => named(other),
        };
        let tall = SCALE * (top - bottom);
        let ink = Lettering { height: INK.height.min(0.62 * tall), ..INK };
        sheet.text(at(0.5 * size.x, middle) + DVec2::new(16.0, 0.0), Anchor::Start, &words, ink);
        // Lines stand for crests, no closer than they can be told apart.
        let Some(period) = period else { continue };
        let shown = period.max(0.3);
        let count = (edge / shown).floor() as i32;
        for k in -count..=count {
            let x = f64::from(k) * shown;
            sheet.line(at(x, top - 0.15), at(x, bottom + 0.15), Pen { width: 1.0, grey: 120 });
        }
    }
    for x in [-edge, edge] {
        sheet.line(at(x, 0.5 * size.y), at(x, -0.5 * size.y), Pen { width: 0.8, grey: 190 });
    }
    for side in [-1.0, 1.0] {
        let middle = at(side * 0.5 * (edge + 0.5 * size.x), 0.0);
        sheet.turned_text(middle, Anchor::Middle, -std::f64::consts::FRAC_PI_2, "wedge", SOFT);
    }
    let [a, b] = frame;
    sheet.stroke(&ring([a, DVec2::new(b.x, a.y), b, DVec2::new(a.x, b.y)]), Pen { width: 2.0, grey: 20 });
    let below = b.y + 46.0;
    dimension(&mut sheet, [DVec2::new(a.x, b.y), b], Beside::Level(below), &format!("{} mm", size.x), INK);
    dimension(&mut sheet, [a, DVec2::new(a.x, b.y)], Beside::Upright(a.x - 46.0), &format!("{} mm", size.y), INK);
    let rows = at(0.0, 0.5 * size.y) - DVec2::new(0.0, 30.0);
    let half = DVec2::new(4.0 * SCALE, 0.0);
    sheet.stroke(&(arrow(rows - half, rows + half, 14.0) + &arrow(rows + half, rows - half, 14.0)), BOLD);
    sheet.text(rows + half + DVec2::new(14.0, 0.0), Anchor::Start, "rows of the cutter, x", INK);
    sheet
}

/// Lamp, coupon and sheet of paper from the side.
pub fn coupon_bench(coupon: &Coupon) -> Svg {
    let plan = &coupon.plan;
    let mut sheet = Svg::new(1180, 300);
    let axis = 120.0;
    let (lamp, block, paper) = (DVec2::new(60.0, axis), DVec2::new(620.0, axis), DVec2::new(1090.0, axis));
    sheet.dashed(lamp, paper, Pen { width: 0.8, grey: 170 });
    for aside in [-1.0, 1.0] {
        let face = block + DVec2::new(0.0, 26.0 * aside);
        sheet.line(lamp, face, Pen { width: 1.0, grey: 160 });
        for to in [-64.0, 64.0] {
            sheet.line(face + DVec2::new(16.0, 0.0), paper + DVec2::new(0.0, to), Pen { width: 1.0, grey: 160 });
        }
    }
    sheet.circle(lamp, 9.0, BOLD);
    // The block with its flat face to the lamp.
    let wavy = [(0.0, -30.0), (20.0, -30.0), (12.0, -15.0), (20.0, 0.0), (12.0, 15.0), (20.0, 30.0), (0.0, 30.0)];
    sheet.stroke(&ring(wavy.map(|(x, y)| block + DVec2::new(x, y))), BOLD);
    sheet.line(paper + DVec2::new(0.0, -90.0), paper + DVec2::new(0.0, 90.0), Pen { width: 4.0, grey: 20 });
    let words = format!("lamp, {} mm across", plan.lamp_diameter_mm);
    sheet.text(lamp + DVec2::new(-30.0, -36.0), Anchor::Start, &words, INK);
    sheet.text(block + DVec2::new(10.0, -58.0), Anchor::Middle, "flat face to the lamp, rulings to the paper", INK);
    sheet.text(paper + DVec2::new(0.0, -106.0), Anchor::Middle, "sheet of paper", INK);
    let level = Beside::Level(axis + 130.0);
    let length = |mm: f64| format!("{} mm", (mm * 100.0).round() / 100.0);
    dimension(&mut sheet, [lamp, block], level, &length(plan.lamp_mm), INK);
    dimension(&mut sheet, [block, paper], level, &length(plan.distance_mm), INK);
    sheet
}

/// Size of the printed sheet, mm, and units of the drawing to a millimetre.
pub const SHEET_MM: DVec2 = DVec2::new(196.0, 262.0);
const PER_MM: f64 = 10.0;

/// The sheet of paper in true size, as seen from the coupon: left is +x, top is +y.
pub fn coupon_sheet(coupon: &Coupon) -> Svg {
    const FINE: Pen = Pen { width: 1.2, grey: 120 };
    const LINE: Pen = Pen { width: 2.0, grey: 60 };
    const TEXT: Lettering = Lettering { height: 22.0, grey: 30, halo: 0.0 };
    const SMALL: Lettering = Lettering { height: 16.0, grey: 60, halo: 0.0 };
    let ior = coupon.plan.ior;
    let size = PER_MM * SHEET_MM;
    let mut sheet = Svg::new(size.x as u32, size.y as u32);
    // The axis lies where the ladder and the space above the spot fill the sheet.
    let axis_mm = 0.5 * SHEET_MM.y + 5.0;
    let at = |x: f64, y: f64| PER_MM * DVec2::new(0.5 * SHEET_MM.x - x, axis_mm - y);
    sheet.stroke(
        &ring([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec2::new(x, y) * (size - 1.0))),
        FINE,
    );
    // The axis.
    for along in [DVec2::X, DVec2::Y] {
        sheet.line(at(0.0, 0.0) - 40.0 * along, at(0.0, 0.0) + 40.0 * along, FINE);
    }
    // Rungs, named beside the longest bar.
    let beside = coupon.reach_mm(ior) + 7.0;
    let rungs = coupon.rungs(ior);
    for rung in &rungs {
        let y = rung.at_mm;
        for side in [-1.0, 1.0] {
            sheet.line(at(side * beside, y), at(side * (beside + 5.0), y), LINE);
        }
        let left = at(beside + 7.0, y);
        let right = at(-beside - 7.0, y);
        match rung.shows {
            RungShows::Spot => {}
            RungShows::Marks => {
                sheet.text(left, Anchor::End, "mark", TEXT);
                sheet.text(right, Anchor::Start, "mark: half of the length", SMALL);
            }
            RungShows::Ruling(k) => {
                let ruling = &coupon.rulings[k];
                sheet.text(left, Anchor::End, &format!("{}", ruling.number), TEXT);
                sheet.text(right, Anchor::Start, &format!("polish={:.3}mm", ruling.sigma_mm), TEXT);
            }
        }
    }
    // The spot, with lengths of the streak for step-overs.
    let Some(spot) = rungs.first() else { return sheet };
    sheet.circle(at(0.0, spot.at_mm), 15.0, FINE);
    sheet.text(at(beside + 7.0, spot.at_mm), Anchor::End, "spot", TEXT);
    let x = -beside - 7.0;
    sheet.line(at(x, spot.at_mm - 20.0), at(x, spot.at_mm + 20.0), LINE);
    for step_over in [0.05, 0.1, 0.15, 0.2, 0.25] {
        let half = 0.5 * coupon.streak_mm(step_over, DVec2::Y, ior);
        if half > 20.0 {
            break;
        }
        for side in [-1.0, 1.0] {
            sheet.line(at(x, spot.at_mm + side * half), at(x - 3.0, spot.at_mm + side * half), LINE);
            let label = at(x - 4.0, spot.at_mm + side * half);
            sheet.text(label, Anchor::Start, &format!("--step-over {step_over}mm"), SMALL);
        }
    }
    // The scale of the index, across the middle: one for each upright.
    let scale = coupon.index_scale();
    let room = 0.5 * SHEET_MM.x - 2.0;
    let inside: Vec<f64> = scale.iter().map(|(ior, _)| *ior).filter(|&n| 0.5 * coupon.uprights_mm(n) < room).collect();
    if let (Some(&first), Some(&last)) = (inside.first(), inside.last()) {
        for side in [-1.0, 1.0] {
            let place = |n: f64, y: f64| at(side * 0.5 * coupon.uprights_mm(n), y);
            sheet.line(place(first, 0.0), place(last, 0.0), LINE);
            // A tick for every two units of the third decimal, a number for every two of the second.
            let ticks = ((last - first) * 500.0).round() as u32;
            for k in 0..=ticks {
                let n = first + f64::from(k) / 500.0;
                let (tall, pen) = if k % 5 == 0 { (3.5, LINE) } else { (1.8, FINE) };
                sheet.line(place(n, 0.0), place(n, tall), pen);
                if k % 5 == 0 && ((n * 100.0).round() as u32).is_multiple_of(2) {
                    let angle = -std::f64::consts::FRAC_PI_2;
                    sheet.turned_text(place(n, 4.5), Anchor::Start, angle, &format!("{n:.2}"), SMALL);
                }
            }
            let middle = at(side * 0.25 * (coupon.uprights_mm(first) + coupon.uprights_mm(last)), -4.0);
            sheet.text(middle, Anchor::Middle, "--ior: mean of both sides", SMALL);
        }
    }
    // How true the print is.
    let foot = size.y - 110.0;
    let (a, b) = (DVec2::new(0.5 * size.x - 500.0, foot), DVec2::new(0.5 * size.x + 500.0, foot));
    sheet.line(a, b, LINE);
    for k in 0..=10 {
        let x = a.x + 100.0 * f64::from(k);
        sheet.line(DVec2::new(x, foot - if k % 5 == 0 { 30.0 } else { 16.0 }), DVec2::new(x, foot), LINE);
    }
    let words = "must be 100 mm long: print at 100 %, without fitting to the page";
    sheet.text(DVec2::new(0.5 * size.x, foot + 30.0), Anchor::Middle, words, TEXT);
    let away = (coupon.plan.distance_mm * 100.0).round() / 100.0;
    let words =
        format!("top; hang it upright, {away} mm from the flat face of the coupon, the cross opposite its middle");
    sheet.text(DVec2::new(0.5 * size.x, 36.0), Anchor::Middle, &words, TEXT);
    sheet
}
