//! The border condition: the border of the window maps to the outline of the lens.
//!
//! At a node of the border one scalar equation holds, `H(T) = 0` with `H` the level function of the
//! outline; it is solved for the slope of the unknown across the border, from which the ghosts
//! follow. For a rectangle it reads: the normal component of the lens point lies on the edge of the
//! lens. A corner of the window that maps to a corner of the lens has two such equations for its
//! two slopes. One that maps to a smooth piece of the outline has a single one, and the other is
//! that the slopes go on along the border as they come.

use super::{
    equation::{Equation, State},
    map::{Jet, Map},
    spline::{BorderSlopes, PathSpline},
};
use glam::DVec2;

/// Sweeps over the border of a lens with sharp corners at a time. Its slopes hardly depend on
/// anything but themselves, and are revisited whenever the residual is.
const SWEEPS: usize = 3;
/// The same for a curved outline, which couples the slopes along the border: a sweep leaves up to
/// 0.6 of an error at the shortest wave.
const COUPLED_SWEEPS: usize = 24;
/// Sweeps for a variation, which is wanted to a tenth.
const VARIATION_SWEEPS: usize = 6;
/// Newton steps for the slopes of a corner at a time.
const CORNER_STEPS: usize = 3;

/// How the border slopes follow the unknown.
#[derive(Clone, Debug)]
pub(super) struct BorderRows {
    /// `d slope = of_value du + of_tangent du_t` at every node; sides in the order left, right,
    /// lower, upper.
    sides: [Vec<[f64; 2]>; 4],
    /// Normals, and derivatives of `H(T)` by `u, u_x, u_y`, of corners on a smooth outline, in the
    /// order of [`CORNERS`].
    corners: [Option<(DVec2, [f64; 3])>; 4],
    active: bool,
}

/// The sides that meet in every corner, first the one across x, and whether it is at their ends.
const CORNERS: [([usize; 2], [bool; 2]); 4] =
    [([0, 2], [false, false]), ([1, 2], [false, true]), ([0, 3], [true, false]), ([1, 3], [true, true])];

impl<M: Map> Equation<'_, M> {
    /// Sets the border slopes so that the border of the window maps to the outline of the lens, and
    /// the ghosts.
    pub(super) fn fit_border(&self, state: &mut State) {
        state.spline.set_ghosts(&state.slopes);
        let smooth = !self.contour.is_rectangle();
        for _ in 0..if smooth { COUPLED_SWEEPS } else { SWEEPS } {
            let mut worst = self.each_border_node(state, |side, _, slope, jet, y| {
                let Some(ray) = self.map.ray(y, jet.value, jet.slope, None) else { return 0.0 };
                let (miss, normal) = self.miss(side, self.map.point(y, &ray));
                let by_slope = self.map.point_variation(&ray, normal)[1 + side / 2];
                *slope -= miss / by_slope;
                miss.abs()
            });
            if smooth {
                worst = worst.max(self.fit_corners(state));
            }
            if worst < 1e-13 * self.half_lens().max_element() {
                return;
            }
            state.spline.set_ghosts(&state.slopes);
        }
    }

    /// How the border slopes follow the unknown.
    pub(super) fn linearise_border(&self, state: &mut State) -> BorderRows {
        let mut rows = BorderRows { sides: [(); 4].map(|()| Vec::new()), corners: [None; 4], active: false };
        self.each_border_node(state, |side, _, _, jet, y| {
            let axis = side / 2;
            let row = match self.map.ray(y, jet.value, jet.slope, None) {
                Some(ray) => {
                    let (_, normal) = self.miss(side, self.map.point(y, &ray));
                    let d = self.map.point_variation(&ray, normal);
                    [-d[0] / d[1 + axis], -d[2 - axis] / d[1 + axis]]
                }
                None => [0.0; 2],
            };
            rows.active |= row.iter().any(|v| v.abs() > 1e-9);
            rows.sides[side].push(row);
            0.0
        });
        if !self.contour.is_rectangle() {
            for (k, (sides, _)) in CORNERS.into_iter().enumerate() {
                let (i, j) = corner_node(sides, self.grid.cells);
                let (jet, y) = (state.spline.node_jet(i, j), self.grid.node(i, j));
                rows.corners[k] = self.map.ray(y, jet.value, jet.slope, None).map(|ray| {
                    let normal = self.contour.level(self.map.point(y, &ray)).normal;
                    (normal, self.map.point_variation(&ray, normal))
                });
            }
        }
        rows
    }

    /// Where the image of a node of a side lies with respect to the outline, mm, and the outward
    /// normal there.
    #[inline(always)]
    fn miss(&self, side: usize, at: DVec2) -> (f64, DVec2) {
        if self.contour.is_rectangle() {
            let (axis, edge) = self.edge(side);
            return (at[axis] - edge, DVec2::AXES[axis]);
        }
        let level = self.contour.level(at);
        (level.distance_mm, level.normal)
    }

    /// Normal axis and position of the lens's edge that side `side` of the window maps to.
    fn edge(&self, side: usize) -> (usize, f64) {
        let axis = side / 2;
        (axis, if side.is_multiple_of(2) { -self.half_lens()[axis] } else { self.half_lens()[axis] })
    }

    fn half_lens(&self) -> DVec2 {
        0.5 * self.contour.extent().as_vec()
    }

    /// Continues the slopes along the borders into the corners, and moves those that the lens point
    /// leaves the outline by; returns the greatest miss before, mm.
    fn fit_corners(&self, state: &mut State) -> f64 {
        let mut worst = 0.0_f64;
        for (sides, ends) in CORNERS {
            let (i, j) = corner_node(sides, self.grid.cells);
            let (value, y) = (state.spline.node_jet(i, j).value, self.grid.node(i, j));
            let mut slope = continued(&state.slopes, sides, ends);
            let before = ends_of(&state.slopes, sides, ends);
            for _ in 0..CORNER_STEPS {
                let Some(ray) = self.map.ray(y, value, slope, None) else { break };
                let level = self.contour.level(self.map.point(y, &ray));
                let d = self.map.point_variation(&ray, level.normal);
                slope -= level.normal * (level.distance_mm / DVec2::new(d[1], d[2]).dot(level.normal));
            }
            // In mm on the lens, about.
            worst = worst.max((slope - before).length() * self.map.distance_mm());
            set_ends(&mut state.slopes, sides, ends, slope);
        }
        worst
    }

    /// Calls `f(side, k, slope, jet, y)` for every node of the border; returns the greatest of its
    /// values.
    fn each_border_node(&self, state: &mut State, mut f: impl FnMut(usize, usize, &mut f64, Jet, DVec2) -> f64) -> f64 {
        let State { spline, slopes, .. } = state;
        let mut worst = 0.0_f64;
        for (side, values) in slopes.sides_mut().into_iter().enumerate() {
            for (k, slope) in values.iter_mut().enumerate() {
                let (i, j) = border_node(side, k, self.grid.cells);
                worst = worst.max(f(side, k, slope, spline.node_jet(i, j), self.grid.node(i, j)));
            }
        }
        worst
    }
}

impl BorderRows {
    /// Sets the ghosts of a variation of the unknown, whose inner coefficients are given, to the
    /// border's own variation.
    pub(super) fn set_ghosts(&self, spline: &mut PathSpline, slopes: &mut BorderSlopes) {
        super::spline::reflect(&mut spline.coefficients);
        if !self.active {
            return;
        }
        let smooth = self.corners.iter().any(Option::is_some);
        for _ in 0..if smooth { VARIATION_SWEEPS } else { 1 } {
            let cells = spline.grid.cells;
            for (side, values) in slopes.sides_mut().into_iter().enumerate() {
                for (k, (slope, row)) in values.iter_mut().zip(&self.sides[side]).enumerate() {
                    let (i, j) = border_node(side, k, cells);
                    let jet = spline.node_jet(i, j);
                    *slope = row[0] * jet.value + row[1] * jet.slope[1 - side / 2];
                }
            }
            for (corner, (sides, ends)) in self.corners.iter().zip(CORNERS) {
                let Some((normal, d)) = corner else { continue };
                let (i, j) = corner_node(sides, cells);
                let along = continued(slopes, sides, ends);
                let by_slope = DVec2::new(d[1], d[2]);
                let off = d[0] * spline.node_jet(i, j).value + by_slope.dot(along);
                set_ends(slopes, sides, ends, along - *normal * (off / by_slope.dot(*normal)));
            }
            spline.set_ghosts(slopes);
        }
    }
}

fn border_node(side: usize, k: usize, (mx, my): (usize, usize)) -> (usize, usize) {
    match side {
        0 => (0, k),
        1 => (mx, k),
        2 => (k, 0),
        _ => (k, my),
    }
}

/// The node of a corner. The side across x tells its column, the one across y its row.
fn corner_node([across_x, across_y]: [usize; 2], (mx, my): (usize, usize)) -> (usize, usize) {
    (if across_x == 0 { 0 } else { mx }, if across_y == 2 { 0 } else { my })
}

/// The slopes that the two sides have in a corner.
fn ends_of(slopes: &BorderSlopes, sides: [usize; 2], ends: [bool; 2]) -> DVec2 {
    let all = slopes.sides();
    let end = |side: usize, at_end: bool| if at_end { all[side][all[side].len() - 1] } else { all[side][0] };
    DVec2::new(end(sides[0], ends[0]), end(sides[1], ends[1]))
}

fn set_ends(slopes: &mut BorderSlopes, sides: [usize; 2], ends: [bool; 2], to: DVec2) {
    let all = slopes.sides_mut();
    for (k, (side, at_end)) in sides.into_iter().zip(ends).enumerate() {
        let place = if at_end { all[side].len() - 1 } else { 0 };
        all[side][place] = to[k];
    }
}

/// The slopes of two sides continued linearly from their nodes next to the corner.
fn continued(slopes: &BorderSlopes, sides: [usize; 2], ends: [bool; 2]) -> DVec2 {
    let all = slopes.sides();
    let next = |side: usize, at_end: bool| {
        let v = all[side];
        let n = v.len();
        if at_end { 2.0 * v[n - 2] - v[n - 3] } else { 2.0 * v[1] - v[2] }
    };
    DVec2::new(next(sides[0], ends[0]), next(sides[1], ends[1]))
}
