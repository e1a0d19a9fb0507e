//! The bench cut through its axis, to scale, with its dimensions.

use super::{
    Model,
    data::{Spot, figure, mm},
    rays::RayFan,
};
use crate::{
    bench::ExitFace,
    light::Light,
    report::svg::{Px, arrow, path},
    surface::SurfaceSpline,
};
use askama::Template;
use glam::{DVec2, DVec3};

/// Which way the section runs across the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Across {
    X,
    Y,
}

impl Across {
    fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
        }
    }

    fn unit(self) -> DVec2 {
        match self {
            Self::X => DVec2::X,
            Self::Y => DVec2::Y,
        }
    }

    /// Along and across the axis.
    fn project(self, point: DVec3) -> DVec2 {
        DVec2::new(
            point.z,
            match self {
                Self::X => point.x,
                Self::Y => point.y,
            },
        )
    }
}

/// A section as a drawing: the axis runs from left to right, `+x` or `+y` up.
#[derive(Template)]
#[template(path = "section.svg")]
pub(super) struct Section {
    name: &'static str,
    width: Px,
    height: Px,
    /// The scale bar, what it stands for, and where that is written.
    bar: (String, String, Px),
    block: String,
    rays: Vec<String>,
    receiver: String,
    axis: String,
    source: Option<(Spot, String)>,
    notes: String,
    dimensions: Vec<Dimension>,
    what: String,
}

/// A dimension line with its text.
struct Dimension {
    from: DVec2,
    to: DVec2,
    /// Where the lines that lead to it begin.
    leads: [DVec2; 2],
    text_at: Spot,
    anchor: &'static str,
    text: String,
    /// Too short for arrows between its ends.
    outside: bool,
}

/// The bench fits into this, units of the drawing.
const CONTENT: DVec2 = DVec2::new(410.0, 250.0);
const LEFT: f64 = 14.0;
const RIGHT: f64 = 84.0;
const WIDTH: f64 = LEFT + CONTENT.x + RIGHT;
const TOP: f64 = 46.0;
/// Between dimension lines.
const RISE: f64 = 26.0;

impl Section {
    pub(super) fn of(model: &Model<'_>, spline: &SurfaceSpline, fan: &RayFan, across: Across) -> Self {
        let bench = model.bench;
        let middle: Vec<[DVec2; 4]> =
            fan.middle(across == Across::X).map(|ray| ray.map(|point| across.project(point))).collect();
        let profile = profile(model, spline, across);
        let half = across.unit() * (0.5 * bench.window().as_vec());
        let receiver =
            [1.0, -1.0].map(|sign| across.project(bench.receiver().point(bench.window_centre_mm() + sign * half)));
        let drawn = middle.iter().flatten().chain(&profile).chain(&receiver);
        let (low, high) = drawn.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        // Room for the size of a block that nothing is drawn before.
        let near = profile.iter().map(|point| point.x).fold(f64::INFINITY, f64::min);
        let low = DVec2::new(low.x.min(near - 0.16 * (high.x - low.x)), low.y);
        let span = (high - low).max(DVec2::splat(1e-9));
        let scale = (CONTENT / span).min_element();
        let shown = span * scale;
        // Room around a bench that is long or tall.
        let shift = 0.5 * (CONTENT.x - shown.x);
        let place = |p: DVec2| DVec2::new(LEFT + shift + (p.x - low.x) * scale, TOP + (high.y - p.y) * scale);
        let bottom = TOP + shown.y;
        let polyline = |points: &[DVec2]| path(points.iter().map(|p| place(*p)));
        let source = match bench.light() {
            Light::Point { position_mm, .. } => {
                let p = position_mm;
                let text = format!("point source at ({}, {}, {}) mm", figure(p.x), figure(p.y), figure(p.z));
                Some((place(across.project(p)).into(), text))
            }
            Light::Parallel { .. } => None,
        };
        let mut section = Self {
            name: across.name(),
            width: Px(WIDTH),
            height: Px(0.0),
            bar: scale_bar(scale),
            block: polyline(&profile) + "Z",
            rays: middle.iter().map(|ray| polyline(ray)).collect(),
            receiver: polyline(&receiver),
            axis: polyline(&[DVec2::new(low.x, 0.0), DVec2::new(high.x, 0.0)]),
            source,
            notes: notes(model, &middle, receiver),
            dimensions: Vec::new(),
            what: String::new(),
        };
        section.dimension(model, across, &profile, receiver, &place, bottom);
        section.height = Px(section.dimensions.iter().map(|d| d.from.y).fold(bottom, f64::max) + 16.0);
        section.what = format!(
            "Section of the bench in the plane of z and {}: {}",
            section.name,
            section.dimensions.iter().map(|dimension| dimension.text.clone()).collect::<Vec<_>>().join("; ")
        );
        section
    }

    fn dimension(
        &mut self,
        model: &Model<'_>,
        across: Across,
        profile: &[DVec2],
        receiver: [DVec2; 2],
        place: &impl Fn(DVec2) -> DVec2,
        bottom: f64,
    ) {
        let bench = model.bench;
        let foot = if bench.receiver().is_turned() { 0.0 } else { receiver[1].y };
        let (near, far) =
            profile.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        let (_, high) = model.surface.range_mm();
        let top = model.rim_z_mm.map_or(high, |rim| rim.max(high));
        let mut row = bottom + 24.0;
        let mut along = |from: f64, to: f64, at: [f64; 2], text: String| {
            let [a, b] = [(from, at[0]), (to, at[1])].map(|(z, t)| place(DVec2::new(z, t)));
            let (left, right) = if a.x <= b.x { (a, b) } else { (b, a) };
            let outside = right.x - left.x < 74.0;
            let (text_at, anchor) = if outside {
                // Beside the arrows, wherever there is more room.
                let room_left = left.x > 0.5 * WIDTH;
                if room_left {
                    (DVec2::new(left.x - 20.0, row + 4.0), "end")
                } else {
                    (DVec2::new(right.x + 20.0, row + 4.0), "start")
                }
            } else {
                (DVec2::new(0.5 * (left.x + right.x), row - 5.0), "middle")
            };
            self.dimensions.push(Dimension {
                from: DVec2::new(left.x, row),
                to: DVec2::new(right.x, row),
                leads: [left, right],
                text_at: text_at.into(),
                anchor,
                text,
                outside,
            });
            row += RISE;
        };
        along(0.0, bench.distance_mm(), [near.y, foot], format!("{} to the mean exit plane", mm(bench.distance_mm())));
        if bench.exit_face() != ExitFace::Reflects {
            along(model.entry_z_mm, top, [near.y; 2], format!("{} thick", mm(top - model.entry_z_mm)));
        }
        if let Light::Point { position_mm, .. } = bench.light() {
            let from = across.project(position_mm);
            let (face, name) = match bench.exit_face() {
                ExitFace::Refracts { .. } => (model.entry_z_mm, "the entry face"),
                ExitFace::Reflects => (0.0, "the mirror"),
            };
            along(from.x, face, [from.y, near.y], format!("{} from the light to {name}", mm((face - from.x).abs())));
        }
        // Sizes across the axis: the block's on its left, the window's on the right of everything.
        let sizes = [
            (DVec2::new(near.x, far.y), DVec2::new(near.x, near.y), -18.0, "end", mm(far.y - near.y)),
            (receiver[0], receiver[1], 20.0, "start", mm(receiver[0].distance(receiver[1]))),
        ];
        for (upper, lower, aside, anchor, text) in sizes {
            let (a, b) = (place(upper), place(lower));
            let x = if aside < 0.0 { a.x.min(b.x) + aside } else { a.x.max(b.x) + aside };
            self.dimensions.push(Dimension {
                from: DVec2::new(x, a.y),
                to: DVec2::new(x, b.y),
                leads: [a, b],
                text_at: DVec2::new(x + 0.35 * aside, 0.5 * (a.y + b.y) + 4.0).into(),
                anchor,
                text,
                outside: (b.y - a.y).abs() < 24.0,
            });
        }
    }
}

/// The outline of the block in the plane of the section.
fn profile(model: &Model<'_>, spline: &SurfaceSpline, across: Across) -> Vec<DVec2> {
    const POINTS: usize = 81;
    let (extent, reach) =
        (model.surface.extent(), model.outline.iter().copied().fold(DVec2::ZERO, |most, p| most.max(p.abs())));
    let (half, reach) = match across {
        Across::X => (0.5 * extent.width_mm, reach.x),
        Across::Y => (0.5 * extent.height_mm, reach.y),
    };
    let mut points = vec![DVec2::new(model.entry_z_mm, -reach)];
    if let Some(rim) = model.rim_z_mm {
        points.extend([DVec2::new(rim, -reach), DVec2::new(rim, -half)]);
    }
    for k in 0..POINTS {
        let t = half * (2.0 * k as f64 / (POINTS - 1) as f64 - 1.0);
        let at = match across {
            Across::X => DVec2::new(t, 0.0),
            Across::Y => DVec2::new(0.0, t),
        };
        points.push(DVec2::new(spline.sample(at).height_mm, t));
    }
    if let Some(rim) = model.rim_z_mm {
        points.extend([DVec2::new(rim, half), DVec2::new(rim, reach)]);
    }
    points.push(DVec2::new(model.entry_z_mm, reach));
    points
}

/// How parallel light comes and how the receiver leans, in the plane of the section.
fn notes(model: &Model<'_>, rays: &[[DVec2; 4]], receiver: [DVec2; 2]) -> String {
    let degrees = |radians: f64| figure((radians.to_degrees() * 100.0).round() / 100.0);
    let mut notes = Vec::new();
    if let (Light::Parallel { .. }, Some([start, entry, ..])) = (model.bench.light(), rays.first()) {
        let way = *entry - *start;
        let angle = way.y.atan2(way.x.abs());
        notes.push(if angle.abs() < 1e-6 {
            "parallel light along the axis".to_owned()
        } else {
            format!("parallel light at {}° to the axis", degrees(angle.abs()))
        });
    }
    let along = receiver[0] - receiver[1];
    let lean = along.x.atan2(along.y);
    if lean.abs() > 1e-6 {
        notes.push(format!("receiver leans by {}°", degrees(lean.abs())));
    }
    notes.join(", ")
}

/// A bar of a round length at the top right.
fn scale_bar(units_per_mm: f64) -> (String, String, Px) {
    let wanted = 70.0 / units_per_mm;
    let decade = 10_f64.powf(wanted.log10().floor());
    let length = [5.0, 2.0, 1.0].map(|m| m * decade).into_iter().find(|length| *length <= wanted).unwrap_or(decade);
    let end = WIDTH - 16.0;
    (format!("M{end} 13v6m0 -3h-{}m0 -3v6", Px(length * units_per_mm)), format!("{}, to scale", mm(length)), Px(end))
}

impl Dimension {
    fn leads(&self) -> String {
        path([self.leads[0], self.from]) + &path([self.leads[1], self.to])
    }

    /// The line and its arrow heads, which point at its ends.
    fn arrows(&self) -> String {
        const HEAD: f64 = 7.5;
        let beyond = 16.0 * (self.to - self.from).normalize_or_zero();
        if self.outside {
            let tips = arrow(self.from - beyond, self.from, HEAD) + &arrow(self.to + beyond, self.to, HEAD);
            path([self.from, self.to]) + &tips
        } else {
            arrow(self.from, self.to, HEAD) + &arrow(self.to, self.from, HEAD)
        }
    }
}
