//! What is likely wrong with a program that cuts another face than the design, in words, with what
//! to do about it.

use super::question::Setup;
use crate::{
    failure::Failure,
    solid::Origin,
    study::{changed::deflection_mm, workpiece::Workpiece},
    surface::{HeightField, SurfaceSpline},
};
use glam::{DMat4, DVec2, DVec4};
use glasswarp_verify::{
    Image,
    cut::Cut,
    metrics,
    program::{Survey, Tool},
};
use std::collections::BTreeMap;

/// Millimetres of an inch.
const INCH: f64 = 25.4;
/// How near to the ratio of units the size of a program must be.
const UNIT_TOLERANCE: f64 = 0.25;
/// Pixels of the picture to which straight pieces may throw light to either side: beyond, there are
/// lines on the wall where they meet.
const MOST_PIXELS: f64 = 0.5;
/// Coordinates rounded to no more than this, mm, are not looked into.
const FINE_MM: f64 = 5e-5;
/// Light that moves by less than this, relative RMS, is not spoken of.
const LEAST_LIGHT: f64 = 0.005;
/// An explanation must take away at least half of the deviation.
const EXPLAINS: f64 = 0.5;
/// Deviations below this, mm, are not looked into, nor shifts below the next, nor differences of a
/// radius below the last.
const LEAST_OFF_MM: f64 = 3e-4;
const LEAST_SHIFT_MM: f64 = 0.01;
const LEAST_RADIUS_MM: f64 = 0.01;
/// Heights that are off by less than this all over, mm, move no light; scallops do as much.
const LEAST_LIFT_MM: f64 = 1e-3;
/// Part of a side by which a program may stop short of a border.
const SHORT: f64 = 0.02;
/// Samples of the face along a side.
const SAMPLES: usize = 160;
/// Part of a side along a border that is left out.
const BORDER: f64 = 0.06;
/// Samples further off than this many times the median are left out.
const OUTLIER: f64 = 5.0;
/// Rounds of least squares.
const ROUNDS: usize = 12;

/// What the size and the place of a program say: other units, another origin.
pub(super) fn of_survey(survey: &Survey, piece: &Workpiece, setup: &Setup) -> Vec<String> {
    let half = 0.5 * piece.block.size_mm();
    let zero = setup.zero_mm;
    let (face_low, face_high) = (-half - zero.truncate(), half - zero.truncate());
    let (low, high) = survey.cut_bounds;
    let top = setup.stock_mm.1.z - zero.z;
    let (all_low, all_high) = survey.bounds;
    let ratio = (all_high - all_low).truncate() / (face_high - face_low);
    let alike = |factor: f64| (ratio / factor - 1.0).abs().max_element() < UNIT_TOLERANCE;
    let size = |v: DVec2| format!("{:.3} x {:.3} mm", v.x, v.y);
    for (factor, says) in [
        (1.0 / INCH, "its numbers are inches, taken for millimetres: it must say G20, or be posted in millimetres"),
        (INCH, "its numbers are millimetres, taken for inches: it must say G21, or be posted in inches"),
    ] {
        if alike(factor) {
            return vec![format!(
                "the program covers {} where the face has {}: {says}",
                size((all_high - all_low).truncate()),
                size(face_high - face_low)
            )];
        }
    }
    if !low.is_finite() {
        return vec![format!(
            "no feed move reaches below the top of the stock, z = {top:.3} in the program, and nothing is cut: is its zero another \
             (`origin`), or the stock (`stock`)?"
        )];
    }
    let short = (low.truncate() - face_low).max(face_high - high.truncate());
    // A program may stop a little short of a border that is cut by the cutter's flank.
    let least = SHORT * piece.block.size_mm().min_element();
    if short.max_element() <= least {
        return Vec::new();
    }
    // Where the program has its middle, the face should have it.
    let off = 0.5 * (low + high).truncate() - 0.5 * (face_low + face_high);
    let fits = (high - low).truncate().cmpge(0.8 * 2.0 * half).all();
    if !fits {
        return vec![format!(
            "the program cuts {} of a face of {}: the rest stays as high as the stock",
            size((high - low).truncate()),
            size(face_high - face_low)
        )];
    }
    let meant = Origin::ALL.into_iter().find(|origin| {
        let place = match origin {
            Origin::Corner => setup.stock_mm.0.truncate(),
            _ => DVec2::ZERO,
        };
        (zero.truncate() - off - place).length() < 2.0 * least
    });
    let remedy = meant.map_or_else(
        || "set the zero of the machine by so much aside, or post with the block's own (`origin`)".to_owned(),
        |origin| format!("it fits if its zero is `origin` {}", origin.name()),
    );
    vec![format!("the program lies ({:.3}, {:.3}) mm beside the face: {remedy}", off.x, off.y)]
}

/// What the cut face says: mirrored, shifted, cut by another cutter than it was made for.
pub(super) fn of_face(
    design: &HeightField,
    cut: &Cut,
    zero_z: f64,
    (survey, tools): (&Survey, &BTreeMap<u32, Tool>),
) -> Vec<String> {
    let spline = SurfaceSpline::through(design);
    let samples = samples(design, cut, zero_z);
    if samples.is_empty() {
        return Vec::new();
    }
    let rms = |turn: &dyn Fn(DVec2) -> DVec2| {
        let off = |(at, height): &(DVec2, f64)| height - spline.sample(turn(*at)).height_mm;
        let mean = samples.iter().map(off).sum::<f64>() / samples.len() as f64;
        (samples.iter().map(|sample| (off(sample) - mean).powi(2)).sum::<f64>() / samples.len() as f64).sqrt()
    };
    let own = rms(&|p| p);
    let size = design.extent().as_vec();
    let is_square = (size.x / size.y - 1.0).abs() < 1e-3;
    type Turn = (&'static str, fn(DVec2) -> DVec2);
    let turns: [Turn; 7] = [
        ("mirrored along x (its x has the wrong sign)", |p| DVec2::new(-p.x, p.y)),
        ("mirrored along y (its y has the wrong sign)", |p| DVec2::new(p.x, -p.y)),
        ("turned by 180 degrees", |p| -p),
        ("turned by 90 degrees", DVec2::perp),
        ("turned by 90 degrees", |p| -p.perp()),
        ("mirrored at a diagonal (its x and y are exchanged)", |p| DVec2::new(p.y, p.x)),
        ("mirrored at a diagonal (its x and y are exchanged)", |p| -DVec2::new(p.y, p.x)),
    ];
    if own > LEAST_OFF_MM {
        for (name, turn) in turns.into_iter().take(if is_square { 7 } else { 3 }) {
            let turned = rms(&turn);
            if turned < 0.25 * own {
                return vec![format!(
                    "the face is {name}: so seen it is {:.3} um off the design, and {:.3} um as it lies",
                    1e3 * turned,
                    1e3 * own
                )];
            }
        }
    }
    let Some(fit) = fit(&spline, &samples) else { return Vec::new() };
    if fit.before < LEAST_OFF_MM || fit.after > EXPLAINS * fit.before {
        return Vec::new();
    }
    let mut said = Vec::new();
    let explains = |part: f64| part > 0.2 * fit.before;
    let [dx, dy, dz, grown] = fit.values;
    let shift = DVec2::new(dx, dy);
    if shift.length() > LEAST_SHIFT_MM && explains(fit.parts[0].hypot(fit.parts[1])) {
        said.push(format!(
            "the face lies ({dx:.3}, {dy:.3}) mm beside its place: correct the zero of the machine, or of the program (`origin`), by so much"
        ));
    }
    if dz.abs() > LEAST_LIFT_MM && explains(fit.parts[2]) {
        let (how, what) = if dz > 0.0 { ("high", "glass is left") } else { ("low", "too much is cut") };
        said.push(format!("the face lies {:.4} mm too {how} ({what}): correct z by so much", dz.abs()));
    }
    if grown.abs() > LEAST_RADIUS_MM && explains(fit.parts[3]) {
        let tool = survey.finishes.and_then(|number| tools.get(&number));
        let corner = tool.map_or(0.0, |tool| tool.corner_mm);
        let meant = corner + grown;
        if tool.is_some_and(|tool| tool.corner_mm > 0.0) && meant > 0.0 {
            said.push(format!(
                "the way is that of a ball or corner of about {meant:.2} mm radius, and the tool has {corner} mm: name the one that cuts (`tool`), or \
                 calculate the program for it"
            ));
        }
    }
    if said.is_empty() {
        return said;
    }
    said.push(format!(
        "so corrected, the face is {:.3} um off the design instead of {:.3} um",
        1e3 * fit.after,
        1e3 * fit.before
    ));
    vec![said.join("; ")]
}

/// Places of the face, mm from its middle, and heights of the cut there, mm on the design's zero.
fn samples(design: &HeightField, cut: &Cut, zero_z: f64) -> Vec<(DVec2, f64)> {
    let (nx, ny) = cut.plan.nodes;
    let (extent, contour) = (design.extent(), design.contour());
    let top = cut.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // Borders are cut by whatever comes round their edge.
    let part = |k: usize| BORDER + (1.0 - 2.0 * BORDER) * (k as f64 + 0.5) / SAMPLES as f64;
    let inner = |k: usize, n: usize| (part(k) * (n - 1) as f64).round() as usize;
    (0..SAMPLES * SAMPLES)
        .filter_map(|k| {
            let (i, j) = (inner(k % SAMPLES, nx), inner(k / SAMPLES, ny));
            let (at, height) = (extent.node(i, j, nx, ny), cut.heights[j * nx + i]);
            (contour.contains(at) && height < top).then_some((at, height + zero_z))
        })
        .collect()
}

/// What fits a cut face best to its design.
struct Fit {
    /// Shift along x and y, mm, lift, mm, and by how much the cutter of the calculation is larger
    /// than the one that cuts, mm.
    values: [f64; 4],
    /// What each of them does to the heights, root of the mean square, mm.
    parts: [f64; 4],
    /// Deviation without and with all of them, mm.
    before: f64,
    after: f64,
}

/// Least squares for `cut(p) = design(p - d) + dz + c (sqrt(1 + slope²) - 1)`.
///
/// The last part is a cutter of a radius smaller by `c` than the one of the calculation, with its
/// tip where that one's should be: its face lies `c` further along the normal, and `c` deeper.
fn fit(spline: &SurfaceSpline, samples: &[(DVec2, f64)]) -> Option<Fit> {
    let half = 0.5 * spline.extent().as_vec();
    let mut values = [0.0; 4];
    let row = |at: DVec2, height: f64, values: &[f64; 4]| {
        let from = at - DVec2::new(values[0], values[1]);
        if from.abs().cmpgt(half).any() {
            return None;
        }
        let sample = spline.sample(from);
        let bulge = (1.0 + sample.slope.length_squared()).sqrt() - 1.0;
        let off = height - sample.height_mm - values[2] - values[3] * bulge;
        Some(([-sample.slope.x, -sample.slope.y, 1.0, bulge], off))
    };
    let rms = |values: &[f64; 4]| {
        let offs: Vec<f64> = samples.iter().filter_map(|&(at, z)| row(at, z, values).map(|(_, off)| off)).collect();
        (offs.iter().map(|off| off * off).sum::<f64>() / offs.len().max(1) as f64).sqrt()
    };
    let median = |values: &[f64; 4]| {
        let mut offs: Vec<f64> =
            samples.iter().filter_map(|&(at, z)| row(at, z, values).map(|(_, off)| off.abs())).collect();
        let middle = offs.len() / 2;
        if offs.is_empty() { 0.0 } else { *offs.select_nth_unstable_by(middle, f64::total_cmp).1 }
    };
    let before = rms(&values);
    let mut squares = [0.0; 4];
    for _ in 0..ROUNDS {
        let (mut normal, mut right) = ([[0.0; 4]; 4], [0.0; 4]);
        let mut count = 0.0;
        let most = OUTLIER * median(&values);
        for &(at, height) in samples {
            let Some((basis, off)) = row(at, height, &values).filter(|(_, off)| off.abs() <= most) else { continue };
            count += 1.0;
            for a in 0..4 {
                right[a] += basis[a] * off;
                (0..4).for_each(|b| normal[a][b] += basis[a] * basis[b]);
            }
        }
        if count < 16.0 {
            return None;
        }
        squares = std::array::from_fn(|k| (normal[k][k] / count).sqrt());
        // A face without curvature tells nothing of some of them.
        (0..4).for_each(|k| normal[k][k] += 1e-9 * normal[k][k] + 1e-12 * count);
        // Symmetric: its columns are its rows.
        let normal = DMat4::from_cols_array_2d(&normal);
        let step = normal.inverse() * DVec4::from(right);
        if !step.is_finite() {
            return None;
        }
        (0..4).for_each(|k| values[k] += step[k]);
        if step[0].hypot(step[1]) < 1e-6 && step[2].abs() < 1e-9 {
            break;
        }
    }
    let parts = std::array::from_fn(|k| values[k].abs() * squares[k]);
    Some(Fit { values, parts, before, after: rms(&values) })
}

/// Whether the face is cut in flats that light shows.
pub(super) fn of_facets(survey: &Survey, piece: &Workpiece) -> Result<Option<String>, Failure> {
    let Some(used) = survey.finishing() else { return Ok(None) };
    let (Some(length), Some(kink), Some(chord)) =
        (used.pieces.quantile(0.5), used.kinks.quantile(0.75), used.chord.quantile(0.95))
    else {
        return Ok(None);
    };
    // A turn of a row by an angle throws the light on both sides of it half as far to either side.
    let along = [DVec2::X, DVec2::Y];
    let scene = piece.scene();
    let throws_mm = deflection_mm(&piece.block, &scene, 0.5 * kink, &along)?;
    let most_mm = MOST_PIXELS * scene.window.size_mm.x / scene.window.nx as f64;
    Ok((throws_mm > most_mm).then(|| {
        format!(
            "the face is cut in flats of {length:.2} mm, which throw light {throws_mm:.2} mm to either side, where a pixel has {:.2} mm: the tolerance of the CAM program is about \
             {chord:.4} mm along the rows; set it, and the distance of the points on its rows, finer (glasswarp's own programs keep to \
             0.000001 mm)",
            2.0 * most_mm
        )
    }))
}

/// To what coordinates are rounded, mm, if that is coarse enough to be seen.
pub(super) fn rounding(survey: &Survey) -> Option<f64> {
    survey.resolution_mm().filter(|step| *step >= FINE_MM)
}

/// What rounding does to the light, by what as much of it once more does.
pub(super) fn of_rounding(
    step_mm: f64,
    unit_mm: f64,
    light: &Image,
    rounded: &Image,
) -> Result<Option<String>, Failure> {
    let costs = metrics::rel_rms(rounded, light).map_err(Failure::refused)?;
    let decimals = -(step_mm / unit_mm).log10().round();
    // Rounding falls tenfold with a decimal, and is gone at the first that keeps below FINE_MM.
    let needs = (decimals + (step_mm / FINE_MM).log10().ceil()).max(decimals + 1.0);
    Ok((costs > LEAST_LIGHT).then(|| {
        format!(
            "all coordinates are multiples of {step_mm:.6} mm: the post-processor rounds to {decimals} decimals, which alone moves the light by \
             {costs:.3} of its mean; set {needs} or more"
        )
    }))
}
