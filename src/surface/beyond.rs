//! Faces that go on beyond their border, and on other nodes.

use super::{extend, height_field::HeightField, spline::SurfaceSpline};
use crate::grid::{Extent, Field, Outline};
use glam::DVec2;
use rayon::prelude::*;

impl HeightField {
    /// The same face, which goes on smoothly beyond its border by at least this much, mm, and
    /// becomes straight there: beyond a curved outline it keeps its bend across it as far as that.
    /// Heights stay as they are: their mean is 0 without the skirt.
    pub fn with_skirt(&self, least_mm: f64) -> Self {
        let old = &self.heights_mm;
        let (nx, ny) = (old.nx(), old.ny());
        let spacing = self.extent.node_spacing(nx, ny);
        let cells = (DVec2::splat(least_mm) / spacing - 1e-9).ceil().max(DVec2::ZERO);
        let (cx, cy) = (cells.x as usize, cells.y as usize);
        if cx + cy == 0 {
            return self.clone();
        }
        if !self.contour().is_rectangle() {
            let size = self.extent.as_vec() + 2.0 * cells * spacing;
            let outline = self.outline.grown((cells * spacing).min_element());
            let heights_mm = extend::go_on_beyond(self, (cx, cy), (cells * spacing).max_element());
            return Self { extent: Extent::new(size.x, size.y), outline, heights_mm, found: self.found };
        }
        let mut along_x = vec![0.0; (nx + 2 * cx) * ny];
        along_x.par_chunks_mut(nx + 2 * cx).zip(old.as_slice().par_chunks(nx)).for_each(|(line, heights)| {
            line[cx..cx + nx].copy_from_slice(heights);
            go_on(line, cx);
        });
        let along_x = Field::from_vec(nx + 2 * cx, ny, along_x);
        let mut heights = Field::filled(nx + 2 * cx, ny + 2 * cy, 0.0);
        let mut line = vec![0.0; ny + 2 * cy];
        for i in cx..cx + nx {
            (0..ny).for_each(|j| line[cy + j] = along_x[(i, j)]);
            go_on(&mut line, cy);
            line.iter().enumerate().for_each(|(j, &z)| heights[(i, j)] = z);
        }
        // Beside the columns of the face as its rows go on; in the corners by both ways added up,
        // which no noise is extrapolated twice for.
        for j in 0..ny + 2 * cy {
            let row = j.clamp(cy, cy + ny - 1);
            for i in (0..cx).chain(cx + nx..nx + 2 * cx) {
                let column = i.clamp(cx, cx + nx - 1);
                heights[(i, j)] = along_x[(i, row - cy)] + heights[(column, j)] - along_x[(column, row - cy)];
            }
        }
        let size = self.extent.as_vec() + 2.0 * cells * spacing;
        Self { extent: Extent::new(size.x, size.y), heights_mm: heights, ..*self }
    }

    /// The same face within its outline; beyond, heights that go straight on across it, and far
    /// from it lie within those of the face. What smooths or cuts the face looks there.
    pub fn continued(&self) -> Self {
        if self.contour().is_rectangle() {
            return self.clone();
        }
        let mut heights_mm = extend::go_on_beyond(self, (0, 0), 0.0);
        extend::limit(self, &mut heights_mm);
        Self { heights_mm, ..self.clone() }
    }

    /// The same face, whose heights far beyond its outline are within its own: a surface that is
    /// trimmed to the outline then is nowhere much higher or lower than what is left of it, for
    /// programs that look at all of it. The spline within stays as it is.
    pub fn levelled(&self) -> Self {
        if self.contour().is_rectangle() {
            return self.clone();
        }
        let mut heights_mm = self.heights_mm.clone();
        extend::level(self, &mut heights_mm);
        Self { heights_mm, ..self.clone() }
    }

    /// The face as it is cut into a sheet of its whole extent, which is cut to the outline
    /// afterwards: [`continued`](Self::continued), as a rectangle. Heights stay as they are: their
    /// mean is 0 within the outline.
    pub fn sheet(&self) -> Self {
        Self { outline: Outline::Rectangle, ..self.continued() }
    }

    /// The same face on another number of nodes: the spline through its own, sampled.
    pub fn resampled(&self, nx: usize, ny: usize) -> Self {
        let spline = SurfaceSpline::through(self);
        let lattice = spline.lattice(nx, ny);
        let mut data = vec![0.0; nx * ny];
        let mut scratch = Vec::new();
        for (j, row) in data.chunks_mut(nx).enumerate() {
            lattice.row(j, &mut scratch, |i, height, _| row[i] = height);
        }
        self.with_heights(Field::from_vec(nx, ny, data))
    }
}

/// Nodes from which the curvature at the border is found: what is further away tells less than 1e-9
/// of it.
const TELLING: usize = 16;

/// Fills the first and last `count` values of a line, which goes on as the cubic at its border does
/// and soon becomes straight: the spline through it stays what it was without, where a kink would
/// make it ring.
fn go_on(line: &mut [f64], count: usize) {
    for _ in 0..2 {
        // Second derivatives M per node of the not-a-knot spline: M_1 is the second difference d_1,
        // and (1, 4, 1) M / 6 = d.
        let known = line.len() - 2 * count;
        let d = |k: usize| line[count + k - 1] - 2.0 * line[count + k] + line[count + k + 1];
        let last = TELLING.min(known - 2);
        let (mut following, mut pivots) = (d(last), [0.0; TELLING + 1]);
        let mut m = [0.0; TELLING + 1];
        m[1] = d(1);
        for k in 2..last {
            pivots[k] = 1.0 / (4.0 - pivots[k - 1]);
            m[k] = (6.0 * d(k) - m[k - 1]) * pivots[k];
        }
        for k in (2..last).rev() {
            following = m[k] - pivots[k] * following;
        }
        let at_border = 2.0 * m[1] - following;
        // Beyond, the second difference of a cubic goes on in a straight line. Two nodes are all
        // that the spline within notices; a third softens the end of the bend. More of it, and a
        // sharp edge at the border would make the skirt run away.
        let change = at_border - m[1];
        let bends = [at_border, at_border + change, 0.5 * (at_border + 2.0 * change)];
        for k in 0..count {
            let at = count - k;
            line[at - 1] = 2.0 * line[at] - line[at + 1] + bends.get(k).unwrap_or(&0.0);
        }
        line.reverse();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    #[test]
    fn a_skirt_goes_on_and_leaves_the_face_as_it_is() {
        let face = HeightField::new(
            Extent::new(8.0, 6.0),
            Field::from_fn(9, 7, |i, j| 0.1 * i as f64 - 0.2 * j as f64 + 0.05 * (i * j) as f64),
        );
        let wide = face.with_skirt(1.5);
        assert_eq!(wide.extent(), Extent::new(12.0, 10.0));
        let (old, new) = (face.heights_mm(), wide.heights_mm());
        assert_eq!((new.nx(), new.ny()), (13, 11));
        for j in 0..7 {
            for i in 0..9 {
                assert_eq!(new[(i + 2, j + 2)], old[(i, j)]);
            }
        }
        // A bilinear function is met on every side.
        let constant = old[(0, 0)];
        let f = |x: f64, y: f64| constant + 0.1 * x - 0.2 * y + 0.05 * x * y;
        for j in 0..11 {
            for i in 0..13 {
                let (x, y) = (i as f64 - 2.0, j as f64 - 2.0);
                // In the corners but for its twist.
                let (bx, by) = (x.clamp(0.0, 8.0), y.clamp(0.0, 6.0));
                let wanted = f(x, by) + f(bx, y) - f(bx, by);
                assert!((new[(i, j)] - wanted).abs() < 1e-12, "{i}, {j}");
            }
        }
        assert_eq!(face.with_skirt(0.0), face);
    }

    #[test]
    fn beyond_a_curved_outline_a_face_goes_on_as_it_bends() {
        let bowl = |p: DVec2| 0.004 * p.length_squared() + 0.1 * p.x;
        for outline in [Outline::Circle, Outline::Rounded { radius_mm: 10.0 }] {
            let extent = Extent::new(40.0, 32.0);
            let (nx, ny) = (321, 257);
            let face =
                HeightField::outlined(extent, outline, Field::from_fn(nx, ny, |i, j| bowl(extent.node(i, j, nx, ny))));
            let wide = face.with_skirt(3.0);
            assert_eq!(wide.extent(), Extent::new(46.0, 38.0));
            assert!((wide.contour().area_mm2() - face.contour().area_mm2()) > 3.0 * 100.0);
            let (narrow, spline) = (SurfaceSpline::through(&face), SurfaceSpline::through(&wide));
            let sheet = SurfaceSpline::through(&face.sheet());
            let lift = narrow.sample(DVec2::ZERO).height_mm;
            for k in 0..2000 {
                let at = DVec2::from_angle(0.7 * f64::from(k)) * (0.0115 * f64::from(k));
                if face.contour().contains(at) {
                    for other in [&spline, &sheet] {
                        at_worst(
                            5.9e-7,
                            (narrow.sample(at).slope - other.sample(at).slope).length(),
                            format_args!("{outline:?} {at}"),
                        );
                    }
                } else if wide.contour().contains(at) {
                    let wanted = bowl(at) + lift;
                    // A bowl bends the same in every direction; of its slope smoothing along the
                    // outline takes a hundredth.
                    at_worst(0.0023, (spline.sample(at).height_mm - wanted).abs(), format_args!("{outline:?} {at}"));
                }
            }
            let (low, high) = face.range_mm();
            let (least, most) = face.sheet().heights_mm().min_max();
            assert!(least >= low - 1e-9 && most < high + 0.1 * (high - low), "{least} to {most} of {low} to {high}");
        }
    }

    #[test]
    fn far_beyond_the_outline_heights_are_levelled_and_the_spline_within_does_not_notice() {
        let extent = Extent::new(60.0, 60.0);
        let h = |p: DVec2| (0.2 * p.x).sin() - 0.01 * p.length_squared() + 0.3 * (1.3 * p.y).cos();
        let face = HeightField::outlined(
            extent,
            Outline::Circle,
            Field::from_fn(121, 121, |i, j| h(extent.node(i, j, 121, 121))),
        );
        let level = face.levelled();
        let ((low, high), corner) = (face.range_mm(), level.heights_mm()[(0, 0)]);
        assert!(face.heights_mm()[(0, 0)] < low - 5.0 && (low..=high).contains(&corner));
        let (lowest, _) = level.heights_mm().min_max();
        assert!(lowest > low - 0.5 * (high - low), "{lowest} under {low}");
        let [a, b] = [&face, &level].map(SurfaceSpline::through);
        for (radius, height, slope) in [(30.0, 3.6e-8, 3.8e-7), (27.0, 1.9e-12, 8.7e-12)] {
            for k in 0..2000 {
                let at = DVec2::from_angle(f64::from(k)) * radius * (f64::from(k) / 1999.0).sqrt();
                let (a, b) = (a.sample(at), b.sample(at));
                at_worst(height, (a.height_mm - b.height_mm).abs(), format_args!("height at {at}"));
                at_worst(slope, (a.slope - b.slope).length(), format_args!("slope at {at}"));
            }
        }
        let rectangle = HeightField::new(extent, face.heights_mm().clone());
        assert_eq!(rectangle.levelled(), rectangle);
    }

    #[test]
    fn the_spline_of_the_face_does_not_notice_its_skirt() {
        let face = HeightField::new(
            Extent::new(20.0, 16.0),
            Field::from_fn(41, 33, |i, j| {
                (0.15 * i as f64).sin() + 0.02 * (j * j) as f64 * 0.05 + 0.01 * (i * j) as f64
            }),
        );
        let wide = face.with_skirt(6.0);
        let (narrow, wide) = (SurfaceSpline::through(&face), SurfaceSpline::through(&wide));
        for k in 0..400 {
            let at = DVec2::new(f64::from(k % 20) - 9.5, f64::from(k / 20) * 0.8 - 7.6);
            let (a, b) = (narrow.sample(at), wide.sample(at));
            at_worst(1.16e-4, (a.slope - b.slope).length(), format_args!("{at}: {} and {}", a.slope, b.slope));
        }
    }
}
