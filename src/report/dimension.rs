//! Lengths in drawings, as workshops write them.

use super::svg::{Anchor, Lettering, Pen, Svg, arrow, path, text_width};
use glam::DVec2;

/// Where the line of a length lies: level at a height of the drawing, or upright.
#[derive(Clone, Copy, Debug)]
pub(super) enum Beside {
    Level(f64),
    Upright(f64),
}

const GREY: u8 = 110;

/// Draws the length between two points beside them. Its text breaks the line, and stands beside the
/// arrows where there is no room between them.
pub(super) fn dimension(sheet: &mut Svg, [a, b]: [DVec2; 2], beside: Beside, text: &str, ink: Lettering) {
    let (gap, head) = (0.5 * ink.height, 0.9 * ink.height);
    let (from, to, angle) = match beside {
        Beside::Level(y) => (DVec2::new(a.x.min(b.x), y), DVec2::new(a.x.max(b.x), y), 0.0),
        Beside::Upright(x) => (DVec2::new(x, a.y.max(b.y)), DVec2::new(x, a.y.min(b.y)), -std::f64::consts::FRAC_PI_2),
    };
    let ends = if (a - b).dot(from - to) > 0.0 { [(a, from), (b, to)] } else { [(b, from), (a, to)] };
    for (point, end) in ends {
        let away = (end - point).normalize_or_zero();
        sheet.line(point + gap * away, end + gap * away, Pen { width: 0.8, grey: GREY });
    }
    let along = (to - from).normalize_or_zero();
    let is_short = from.distance(to) < text_width(text, ink.height) + 4.0 * head;
    let strokes = if is_short {
        let tail = 2.0 * head * along;
        path([from, to]) + &arrow(from - tail, from, head) + &arrow(to + tail, to, head)
    } else {
        arrow(from, to, head) + &arrow(to, from, head)
    };
    sheet.stroke(&strokes, Pen { width: 1.0, grey: GREY });
    let ink = Lettering { halo: gap, ..ink };
    let middle = 0.5 * (from + to);
    match beside {
        _ if !is_short => sheet.turned_text(middle, Anchor::Middle, angle, text, ink),
        // Where there is more room.
        Beside::Level(y) if from.x > 0.5 * f64::from(sheet.size().0) => {
            sheet.text(DVec2::new(from.x - 2.6 * head, y), Anchor::End, text, ink);
        }
        Beside::Level(y) => sheet.text(DVec2::new(to.x + 2.6 * head, y), Anchor::Start, text, ink),
        Beside::Upright(x) if x < a.x => sheet.text(middle - DVec2::new(head, 0.0), Anchor::End, text, ink),
        Beside::Upright(_) => sheet.text(middle + DVec2::new(head, 0.0), Anchor::Start, text, ink),
    }
}
