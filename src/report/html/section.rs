//! The bench cut through its axis, to scale, with its dimensions.

use super::{
    Model,
    data::{figure, mm},
    rays::RayFan,
};
use crate::{
    bench::ExitFace,
    light::Light,
    report::{
        dimension::{Beside, dimension},
        svg::{Anchor, Lettering, Pen, Svg, path, ring},
    },
    surface::SurfaceSpline,
};
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

/// The bench fits into this, units of the drawing.
const CONTENT: DVec2 = DVec2::new(410.0, 250.0);
const LEFT: f64 = 14.0;
const RIGHT: f64 = 84.0;
const WIDTH: f64 = LEFT + CONTENT.x + RIGHT;
const TOP: f64 = 46.0;
/// From the bench to the first dimension line, between them, and from the last.
const RISES: [f64; 3] = [24.0, 26.0, 16.0];
const TEXT: Lettering = Lettering { height: 8.6, grey: 20, halo: 2.0 };
const LINE: Pen = Pen { width: 1.0, grey: 60 };

/// A section as an element of a page: the axis runs from left to right, `+x` or `+y` up.
pub(super) fn section(model: &Model<'_>, spline: &SurfaceSpline, fan: &RayFan, across: Across) -> String {
    let bench = model.bench;
    let middle: Vec<[DVec2; 4]> =
        fan.middle(across == Across::X).map(|ray| ray.map(|point| across.project(point))).collect();
    let profile = profile(model, spline, across);
    let half = across.unit() * (0.5 * bench.window().as_vec());
    let receiver =
        [1.0, -1.0].map(|sign| across.project(bench.receiver().point(bench.window_centre_mm() + sign * half)));
    let bounds = |points: &mut dyn Iterator<Item = &DVec2>| {
        points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)))
    };
    let (low, high) = bounds(&mut middle.iter().flatten().chain(&profile).chain(&receiver));
    let (near, far) = bounds(&mut profile.iter());
    // Room for the size of a block that nothing is drawn before.
    let low = DVec2::new(low.x.min(near.x - 0.16 * (high.x - low.x)), low.y);
    let span = (high - low).max(DVec2::splat(1e-9));
    let scale = (CONTENT / span).min_element();
    let shown = span * scale;
    // Room around a bench that is long or tall.
    let shift = 0.5 * (CONTENT.x - shown.x);
    let place = |p: DVec2| DVec2::new(LEFT + shift + (p.x - low.x) * scale, TOP + (high.y - p.y) * scale);
    let lengths = lengths(model, across, near, receiver);
    let bottom = TOP + shown.y + RISES[0];
    let height = bottom + RISES[1] * (lengths.len() as f64 - 1.0) + RISES[2];

    let mut sheet = Svg::new(WIDTH as u32, height as u32);
    sheet.text(DVec2::new(14.0, 14.0), Anchor::Start, &format!("z, {}", across.name()), TEXT);
    scale_bar(&mut sheet, scale);
    sheet.group("rays", "", |sheet| {
        middle.iter().for_each(|ray| sheet.stroke(&path(ray.iter().map(|p| place(*p))), LINE));
    });
    let axis = [low.x, high.x].map(|z| place(DVec2::new(z, 0.0)));
    sheet.group("axis", "", |sheet| sheet.stroke(&path(axis), LINE));
    sheet.group("block", "", |sheet| sheet.stroke(&ring(profile.iter().map(|p| place(*p))), LINE));
    sheet.group("receiver", "", |sheet| sheet.stroke(&path(receiver.map(place)), LINE));
    let mut row = 14.0;
    if let Light::Point { position_mm: p, .. } = bench.light() {
        sheet.group("source", "", |sheet| sheet.circle(place(across.project(p)), 4.0, LINE));
        let text = format!("point source at ({}, {}, {}) mm", figure(p.x), figure(p.y), figure(p.z));
        sheet.text(DVec2::new(46.0, row), Anchor::Start, &text, TEXT);
        row += 16.0;
    }
    sheet.text(DVec2::new(46.0, row), Anchor::Start, &notes(model, &middle, receiver), TEXT);
    // Sizes across the axis: the block's on its left, the window's on the right of everything.
    let sizes = [
        ([near, DVec2::new(near.x, far.y)], -18.0, mm(far.y - near.y)),
        (receiver, 20.0, mm(receiver[0].distance(receiver[1]))),
    ];
    let words: Vec<&str> =
        lengths.iter().map(|(_, text)| text.as_str()).chain(sizes.iter().map(|(.., text)| text.as_str())).collect();
    let words = format!("Section of the bench in the plane of z and {}: {}", across.name(), words.join("; "));
    sheet.group("dimension", "", |sheet| {
        for (k, (ends, text)) in lengths.iter().enumerate() {
            let beside = Beside::Level(bottom + RISES[1] * k as f64);
            dimension(sheet, ends.map(place), beside, text, TEXT);
        }
        for (ends, aside, text) in &sizes {
            let ends = ends.map(place);
            let x = if *aside < 0.0 { ends[0].x.min(ends[1].x) } else { ends[0].x.max(ends[1].x) };
            dimension(sheet, ends, Beside::Upright(x + aside), text, TEXT);
        }
    });
    sheet.element(&format!("class=\"section\" role=\"img\" aria-label=\"{words}\""))
}

/// Lengths along the axis, with their ends.
fn lengths(model: &Model<'_>, across: Across, near: DVec2, receiver: [DVec2; 2]) -> Vec<([DVec2; 2], String)> {
    let bench = model.bench;
    let foot = if bench.receiver().is_turned() { 0.0 } else { receiver[1].y };
    let at = |z: f64| DVec2::new(z, near.y);
    let distance = bench.distance_mm();
    let ends = [at(0.0), DVec2::new(distance, foot)];
    let mut lengths = vec![(ends, format!("{} to the mean exit plane", mm(distance)))];
    let (face, name) = match bench.exit_face() {
        ExitFace::Refracts { .. } => {
            let (_, high) = model.surface.range_mm();
            let top = model.rim_z_mm.map_or(high, |rim| rim.max(high));
            lengths.push(([model.entry_z_mm, top].map(at), format!("{} thick", mm(top - model.entry_z_mm))));
            (model.entry_z_mm, "the entry face")
        }
        ExitFace::Reflects => (0.0, "the mirror"),
    };
    if let Light::Point { position_mm, .. } = bench.light() {
        let from = across.project(position_mm);
        lengths.push(([from, at(face)], format!("{} from the light to {name}", mm((face - from.x).abs()))));
    }
    lengths
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
fn scale_bar(sheet: &mut Svg, units_per_mm: f64) {
    let wanted = 70.0 / units_per_mm;
    let decade = 10_f64.powf(wanted.log10().floor());
    let length = [5.0, 2.0, 1.0].map(|m| m * decade).into_iter().find(|length| *length <= wanted).unwrap_or(decade);
    let end = WIDTH - 16.0;
    let begin = end - length * units_per_mm;
    let tick = |x: f64| path([DVec2::new(x, 11.0), DVec2::new(x, 17.0)]);
    sheet.group("scale", "", |sheet| {
        let bar = path([DVec2::new(begin, 14.0), DVec2::new(end, 14.0)]) + &tick(begin) + &tick(end);
        sheet.stroke(&bar, LINE);
        sheet.text(DVec2::new(end, 28.0), Anchor::End, &format!("{}, to scale", mm(length)), TEXT);
    });
}
