//! Lines of equal height with their heights in mm (figures 12 to 14 of the paper, part c).

use super::{
    axes::{Axes, FROM_ABOVE, from_above, place, round_step},
    svg::{Anchor, Lettering, Pen, Svg, path, ring, text_width},
};
use crate::{
    grid::Field,
    surface::{HeightField, SurfaceSpline},
};
use contour::ContourBuilder;
use glam::DVec2;
use image::{GrayImage, Luma};
use rayon::prelude::*;
use std::collections::HashMap;

/// Greatest number of height intervals between the lowest and the highest point.
const MOST_INTERVALS: f64 = 18.0;
/// Every so many lines one is thicker.
const INDEX: i64 = 5;
/// Widths of an ordinary line and of a thicker one, pixels.
const WIDTHS: [f64; 2] = [1.1, 2.0];
/// From one sample of the height to the next along a line, pixels.
const SAMPLE_PX: f64 = 2.0;
/// Greys of the lowest and of the highest place between the lines: just enough to tell hills from
/// hollows.
const TINT: [f64; 2] = [214.0, 255.0];
const LINE_GREY: u8 = 40;
/// Height of a figure, pixels.
const TEXT_PX: f64 = 12.0;
/// Height of a figure along the axes, pixels.
const AXES_PX: f64 = 13.0;
/// Least distance of labels of one line and of any two labels, pixels.
const LABELS_APART_PX: [f64; 2] = [330.0, 85.0];
/// How far a line may stray from the straight under its label, pixels.
const BEND_PX: f64 = 3.0;

/// The step between lines of equal height, mm: 1, 2 or 5 times a power of ten. `None` for a plane.
pub fn contour_interval_mm(surface: &HeightField) -> Option<f64> {
    let least = surface.relief_mm() / MOST_INTERVALS;
    // Below a nanometre there is nothing but rounding.
    if least.is_nan() || least <= 1e-6 {
        return None;
    }
    Some(round_step(least))
}

/// The lines of equal height of an exit face, labelled in mm.
#[derive(Clone, Debug)]
pub struct Isocontours {
    /// The lines, lighter where the block is thicker, seen from above the face: `+x` is right and
    /// `+y` up, as its axes say.
    pub picture: Svg,
    /// What is seen there.
    pub caption: String,
}

impl Isocontours {
    /// Draws them on a face whose longer side has [`LONGEST_PX`](Self::LONGEST_PX) pixels.
    pub fn of(surface: &HeightField) -> Self {
        Self::of_spline(surface, &SurfaceSpline::through(surface))
    }

    /// The same with the spline through the nodes at hand.
    pub fn of_spline(surface: &HeightField, spline: &SurfaceSpline) -> Self {
        let size = surface.extent();
        let interval = contour_interval_mm(surface);
        let steps = interval.map_or_else(|| "flat".to_owned(), |mm| format!("a line every {} mm", rounded(mm)));
        let relief = format!("relief {:.*} mm", decimals(interval.unwrap_or(1.0)) + 1, surface.relief_mm());
        let caption = format!(
            "{FROM_ABOVE}: height in mm, {steps}, {relief}, face {} × {} mm",
            rounded(size.width_mm),
            rounded(size.height_mm)
        );
        let drawing = drawing(surface, spline, interval, Self::LONGEST_PX);
        Self { picture: Axes::new(size, AXES_PX).around(drawing), caption }
    }

    /// Length of the longer side of the face, pixels.
    pub const LONGEST_PX: u32 = 1000;

    /// The picture on a sheet with a caption.
    #[cfg(feature = "svg")]
    pub fn sheet(&self) -> GrayImage {
        use super::sheet::{Captioned, sheet};
        sheet(vec![Captioned { caption: self.caption.clone(), picture: self.picture.raster() }], 1)
    }
}

/// Decimals of the multiples of a round step.
fn decimals(interval: f64) -> usize {
    (-(interval.log10() + 1e-9).floor()).max(0.0) as usize
}

/// A length without the digits that only rounding errors fill.
fn rounded(mm: f64) -> f64 {
    (mm * 1e6).round() / 1e6
}

fn drawing(surface: &HeightField, spline: &SurfaceSpline, interval: Option<f64>, longest_px: u32) -> Svg {
    let size = surface.extent().as_vec();
    let longest = f64::from(longest_px.max(64));
    let [width, height] = (size / size.max_element() * longest).round().max(DVec2::splat(2.0)).to_array();
    let mut drawing = Svg::new(width as u32, height as u32);
    let Some(interval) = interval else { return drawing };
    let relief = Relief::sample(surface, spline, width as usize, height as usize);
    let (low, high) = surface.range_mm();
    let place = |at: DVec2| place(at, size, (width as u32, height as u32));
    let outline = surface.contour();
    let tint = GrayImage::from_fn(width as u32, height as u32, |i, j| {
        let mut at = surface.extent().node(i as usize, j as usize, width as usize, height as usize);
        at.y = -at.y;
        if !outline.is_rectangle() && !outline.contains(at) {
            return Luma([255]);
        }
        let [z, ..] = relief.at(i as usize, j as usize);
        let grey = TINT[0] + (TINT[1] - TINT[0]) * ((z - low) / (high - low)).clamp(0.0, 1.0);
        Luma([grey.round() as u8])
    });
    drawing.picture(0, 0, tint);
    let edge = ring(outline.polygon(1e-4 * size.max_element()).into_iter().map(place));
    drawing.within(&edge, |drawing| {
        draw_lines(drawing, surface, spline, interval);
        draw_labels(drawing, &relief, interval);
    });
    drawing
}

/// Height, mm, and its gradient, mm per pixel, at every pixel.
struct Relief(Field<[f64; 3]>);

impl Relief {
    fn sample(surface: &HeightField, spline: &SurfaceSpline, width: usize, height: usize) -> Self {
        let lattice = spline.lattice(width, height);
        // +y is up, and rows go down.
        let pixel = surface.extent().node_spacing(width, height) * DVec2::new(1.0, -1.0);
        let mut data = vec![[0.0; 3]; width * height];
        data.par_chunks_mut(width).enumerate().for_each_init(Vec::new, |scratch, (j, row)| {
            lattice.row(j, scratch, |i, z, slope| row[i] = [z, slope.x * pixel.x, slope.y * pixel.y]);
        });
        Self(from_above(&Field::from_vec(width, height, data)))
    }

    fn at(&self, i: usize, j: usize) -> [f64; 3] {
        self.0[(i, j)]
    }

    /// Height and gradient at the nearest pixel; `None` outside.
    fn near(&self, at: DVec2) -> Option<(f64, DVec2)> {
        let inside = |v: f64, n: usize| (v > -0.5 && v < n as f64 - 0.5).then(|| v.round().max(0.0) as usize);
        let (i, j) = (inside(at.x, self.0.nx())?, inside(at.y, self.0.ny())?);
        let [z, p, q] = self.at(i, j);
        // To first order, from the middle of the pixel to the point.
        let gradient = DVec2::new(p, q);
        Some((z + gradient.dot(at - DVec2::new(i as f64, j as f64)), gradient))
    }
}

/// The number of the line nearest in height, and the distance to it in pixels, to first order.
fn nearest_line(z: f64, gradient: DVec2, interval: f64) -> (i64, f64) {
    let line = (z / interval).round();
    (line as i64, (z - line * interval).abs() / gradient.length())
}

/// Draws the lines of a face that fills the drawing. What closes them along its border is no line
/// of it.
fn draw_lines(drawing: &mut Svg, surface: &HeightField, spline: &SurfaceSpline, interval: f64) {
    let (width, height) = drawing.size();
    let last = DVec2::new(width.into(), height.into()) - 1.0;
    let samples = (last / SAMPLE_PX).ceil().max(DVec2::ONE) + 1.0;
    let (nx, ny) = (samples.x as usize, samples.y as usize);
    let heights = Relief::sample(surface, spline, nx, ny).0.map(|&[z, ..]| z);
    let (low, high) = heights.min_max();
    let numbers: Vec<i64> = ((low / interval).ceil() as i64..=(high / interval).floor() as i64).collect();
    let levels: Vec<f64> = numbers.iter().map(|&line| line as f64 * interval).collect();
    // The middle of its first cell is half a step from its origin.
    let step = last / (samples - 1.0);
    let builder =
        ContourBuilder::new(nx, ny, true).x_step(step.x).y_step(step.y).x_origin(-0.5 * step.x).y_origin(-0.5 * step.y);
    // It refuses only another number of values than nx × ny.
    let lines = builder.lines(heights.as_slice(), &levels).unwrap_or_default();
    let beyond = |p: &DVec2| p.cmplt(DVec2::splat(-1e-6)).any() || p.cmpgt(last + 1e-6).any();
    let mut strokes = [String::new(), String::new()];
    for (number, line) in numbers.iter().zip(&lines) {
        for one in line.geometry() {
            let points: Vec<DVec2> = one.coords().map(|at| DVec2::new(at.x, at.y)).collect();
            for run in points.chunk_by(|a, b| !(beyond(a) && beyond(b))).filter(|run| run.len() > 1) {
                strokes[usize::from(number % INDEX == 0)] += &path(run.iter().copied());
            }
        }
    }
    for (strokes, width) in strokes.iter().zip(WIDTHS) {
        if !strokes.is_empty() {
            drawing.stroke(strokes, Pen { width, grey: LINE_GREY });
        }
    }
}

/// A place where a label would lie well.
struct Place {
    line: i64,
    at: DVec2,
    angle: f64,
    merit: f64,
}

fn draw_labels(drawing: &mut Svg, relief: &Relief, interval: f64) {
    let decimals = decimals(interval);
    let label = |line: i64| format!("{:.decimals$}", line as f64 * interval + 0.0);
    let mut places = places(relief, interval, &label);
    places.sort_by(|a, b| b.merit.total_cmp(&a.merit));
    let mut taken: Vec<&Place> = Vec::new();
    let free = |taken: &[&Place], place: &Place| {
        taken.iter().all(|other| {
            let apart = LABELS_APART_PX[usize::from(other.line != place.line)];
            other.at.distance(place.at) >= apart
        })
    };
    // First one label for every line, the shortest lines choosing first; then as many as there is
    // room for.
    let mut lines: Vec<(usize, i64)> = Vec::new();
    for place in &places {
        match lines.iter_mut().find(|(_, line)| *line == place.line) {
            Some((count, _)) => *count += 1,
            None => lines.push((1, place.line)),
        }
    }
    lines.sort_unstable();
    for (_, line) in lines {
        taken.extend(places.iter().find(|place| place.line == line && free(&taken, place)));
    }
    for place in &places {
        if free(&taken, place) {
            taken.push(place);
        }
    }
    let ink = Lettering { height: TEXT_PX, grey: 0, halo: 2.5 };
    for place in taken {
        drawing.turned_text(place.at, Anchor::Middle, place.angle, &label(place.line), ink);
    }
}

fn places(relief: &Relief, interval: f64, label: &dyn Fn(i64) -> String) -> Vec<Place> {
    const STRIDE: usize = 3;
    let size = DVec2::new(relief.0.nx() as f64 - 1.0, relief.0.ny() as f64 - 1.0);
    let mut widths = HashMap::new();
    let mut places = Vec::new();
    for j in (0..relief.0.ny()).step_by(STRIDE) {
        for i in (0..relief.0.nx()).step_by(STRIDE) {
            let [z, p, q] = relief.at(i, j);
            let gradient = DVec2::new(p, q);
            let (line, distance) = nearest_line(z, gradient, interval);
            // On a line to within the stride, and its neighbours leave room for the text.
            let room = interval / gradient.length() / TEXT_PX;
            if distance.is_nan() || distance > 0.5 * STRIDE as f64 || room < 0.9 {
                continue;
            }
            let level = line as f64 * interval;
            let at = DVec2::new(i as f64, j as f64) - gradient * ((z - level) / gradient.length_squared());
            let half_length = 0.5 * *widths.entry(line).or_insert_with(|| text_width(&label(line), TEXT_PX)) + 3.0;
            let margin = DVec2::splat(half_length + 4.0);
            if at.cmplt(margin).any() || at.cmpgt(size - margin).any() {
                continue;
            }
            let tangent = gradient.perp().normalize();
            let tangent = if tangent.x < 0.0 { -tangent } else { tangent };
            let stray = [-1.0, -0.5, 0.5, 1.0].map(|t| {
                let there = relief.near(at + t * half_length * tangent);
                there.map_or(f64::INFINITY, |(z, gradient)| (z - level).abs() / gradient.length())
            });
            let bend = stray.into_iter().fold(0.0, f64::max);
            if bend <= BEND_PX {
                // Level text reads best.
                let merit = room.min(2.5) - bend / BEND_PX - tangent.y.abs();
                places.push(Place { line, at, angle: tangent.to_angle(), merit });
            }
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;
    use crate::{
        grid::{Extent, Outline},
        report::sheet::{CAPTION, MARGIN},
    };

    fn surface(nx: usize, ny: usize, extent: Extent, h: impl Fn(DVec2) -> f64) -> HeightField {
        HeightField::new(extent, Field::from_fn(nx, ny, |i, j| h(extent.node(i, j, nx, ny))))
    }

    #[test]
    fn intervals_are_round_and_few() {
        for relief in [0.003, 0.14, 1.0, 1.5, 6.9, 7.1, 80.0] {
            let tilted = surface(5, 5, Extent::new(100.0, 100.0), |at| relief * at.x / 100.0);
            let interval = contour_interval_mm(&tilted).unwrap();
            let lines = relief / interval;
            assert!((7.0..=18.01).contains(&lines), "{relief} mm in steps of {interval} mm");
            let mantissa = interval / 10_f64.powf((interval.log10() + 1e-9).floor());
            assert!([1.0, 2.0, 5.0].iter().any(|m| (mantissa - m).abs() < 1e-9), "{interval}");
        }
        assert_eq!(contour_interval_mm(&surface(5, 5, Extent::new(9.0, 9.0), |_| 1.0)), None);
    }

    #[test]
    fn lines_lie_where_the_height_is_a_whole_number_of_intervals() {
        // The lines of a paraboloid are circles of known radius.
        let extent = Extent::new(100.0, 100.0);
        let bowl = surface(33, 33, extent, |at| 0.002 * at.length_squared());
        let shift = bowl.heights_mm()[(16, 16)];
        let interval = contour_interval_mm(&bowl).unwrap();
        let mut drawing = Svg::new(501, 501);
        draw_lines(&mut drawing, &bowl, &SurfaceSpline::through(&bowl), interval);
        let image = drawing.raster();
        // Lines end at the border, and do not run along it.
        let border = (0..501).flat_map(|k| [(0, k), (500, k), (k, 0), (k, 500)]);
        let inked = border.filter(|&(i, j)| image.get_pixel(i, j).0[0] < 255).count();
        at_worst(136.0, inked as f64, "pixels of the border under a line");
        let mut dark = 0;
        for (i, j, pixel) in image.enumerate_pixels().filter(|(_, _, pixel)| pixel.0[0] < 128) {
            let at = (DVec2::new(f64::from(i), f64::from(j)) - 250.0) * 0.2;
            let z = 0.002 * at.length_squared() + shift;
            let off = (z / interval - (z / interval).round()).abs() * interval;
            let pixels_off = off / (0.004 * at.length()) / 0.2;
            assert!(pixels_off < 1.2 || at.length() < 1.0, "a line at ({i}, {j}), {pixels_off} pixels off: {pixel:?}");
            dark += 1;
        }
        assert!(dark > 5000, "{dark} dark pixels");
    }

    #[test]
    fn the_drawing_is_seen_from_above_the_face() {
        let tilted = surface(9, 9, Extent::new(100.0, 50.0), |at| 0.01 * at.x + 0.01 * at.y);
        let relief = Relief::sample(&tilted, &SurfaceSpline::through(&tilted), 101, 51);
        let [[top_right, ..], [top_left, ..]] = [relief.at(100, 0), relief.at(0, 0)];
        assert!((top_right - 0.75).abs() < 1e-12, "top right is at greatest x and y");
        assert!((top_left + 0.25).abs() < 1e-12, "top left is at least x and greatest y");
        let [_, p, q] = relief.at(50, 25);
        assert!((p - 0.01).abs() < 1e-12 && (q + 0.01).abs() < 1e-12, "it rises to the right and upwards");
        let drawn = drawing(&tilted, &SurfaceSpline::through(&tilted), Some(0.1), 400);
        assert_eq!(drawn.size(), (400, 200));
        // So does the tint: light where it is thick. Lines and labels cover less than half of it.
        let picture = drawn.raster();
        let tint = |left: u32, top: u32| {
            let box_of = (0..30).flat_map(|k| (0..30).map(move |l| (left + k, top + l)));
            let mut greys: Vec<u8> = box_of.map(|(i, j)| picture.get_pixel(i, j).0[0]).collect();
            greys.sort_unstable();
            greys[greys.len() / 2]
        };
        assert!(tint(360, 10) > tint(10, 10) && tint(10, 10) > tint(10, 160) && tint(360, 160) > tint(10, 160));
        // A round face stands where it stands.
        let round = HeightField::outlined(tilted.extent(), Outline::Circle, tilted.heights_mm().clone());
        let picture = drawing(&round, &SurfaceSpline::through(&round), Some(10.0), 400).raster();
        assert_eq!([(2, 2), (397, 197)].map(|(i, j)| picture.get_pixel(i, j).0[0]), [255, 255]);
    }

    #[test]
    fn planes_and_slivers_are_drawn_too() {
        let plane = surface(5, 5, Extent::new(100.0, 100.0), |_| 1.0);
        assert!(
            drawing(&plane, &SurfaceSpline::through(&plane), contour_interval_mm(&plane), 100)
                .raster()
                .pixels()
                .all(|p| p.0[0] == 255)
        );
        let sliver = surface(500, 4, Extent::new(1000.0, 1.0), |at| (0.01 * at.x).sin());
        let longest = Isocontours::LONGEST_PX;
        let (across, down) = Axes::new(sliver.extent(), AXES_PX).taken();
        let sheet = (longest + across + 2 * MARGIN, 2 + down + MARGIN + CAPTION);
        assert_eq!(Isocontours::of(&sliver).sheet().dimensions(), sheet);
    }
}
