//! The objective (14) of the paper and its exact gradient.
//!
//! For a quad ABCD with the diagonals `e1 = u_C - u_A`, `e2 = u_B - u_D` and, from `s_P = n_P /
//! n_Pz`, `t1 = s_B - s_D`, `t2 = s_C - s_A`:
//!
//! - `f = area / A_s - 1` with `area = (e1.y e2.x - e1.x e2.y) / 2` (section 3.1),
//! - `g = (t1.e1 - t2.e2) / 2` (equation 9),
//! - the objective is the sum of `w f^2 + g^2` with `w = lambda * mean A_d` (equation 14).
//!
//! The derivatives with respect to `e1, e2, t1, t2` are kept for two rows of quads; each vertex
//! gathers from its four quads, and the chain rule through `s_P(u_P)` (equations 11 and 12, the
//! latter corrected to `d|o|/du = -o/|o|`) follows once per vertex. Strips of a fixed number of
//! rows run in parallel, so that nothing depends on the number of threads.

use super::mesh::ReceiverMesh;
use crate::{bench::Bench, grid::Field, optics::Interface, optim::Objective};
use glam::DVec3;
use rayon::prelude::*;

/// Rows of vertices that one task evaluates; it computes one row of quads twice.
const STRIP: usize = 16;
/// Up to so many vertices an evaluation takes no longer than waking other threads for it.
const SERIAL_VERTICES: usize = 1 << 14;

/// The objective on one level.
#[derive(Clone, Debug)]
pub struct WarpObjective {
    nx: usize,
    ny: usize,
    /// Coordinates of the vertices on the receiver, mm.
    receiver: [Field<f64>; 2],
    /// One over the desired area of every quad, 1/mm².
    inverse_area: Field<f64>,
    /// From every vertex to the receiver along z, mm.
    depth_mm: Field<f64>,
    incident: DVec3,
    eta: f64,
    area_weight: f64,
    strips: Vec<Strip>,
}

impl WarpObjective {
    /// The objective for quads that shall get the flux of `cells` (mean 1, all above 0), with the
    /// area term weighted by `area_weight_mm2`, the paper's `lambda * mean A_d`.
    ///
    /// The specular surface is the plane until [`set_depth`](Self::set_depth).
    pub fn new(bench: &Bench, cells: &Field<f64>, area_weight_mm2: f64) -> Self {
        Self::onto(&ReceiverMesh::window(bench), bench, cells, area_weight_mm2)
    }

    /// The same for any mesh on the receiver.
    pub(crate) fn onto(receiver: &ReceiverMesh, bench: &Bench, cells: &Field<f64>, area_weight_mm2: f64) -> Self {
        let (mx, my) = (cells.nx(), cells.ny());
        let (nx, ny) = (mx + 1, my + 1);
        let mean_area = bench.block().area_mm2() / (mx * my) as f64;
        let total = cells.mean();
        let interface = Interface::of(bench);
        let vertices = receiver.vertices(nx, ny);
        Self {
            nx,
            ny,
            receiver: [vertices.map(|v| v.x), vertices.map(|v| v.y)],
            inverse_area: cells.map(|b| total / (b * mean_area)),
            depth_mm: Field::filled(nx, ny, bench.distance_mm()),
            incident: interface.incident(),
            eta: interface.eta(),
            area_weight: area_weight_mm2,
            strips: (0..ny.div_ceil(STRIP)).map(|_| Strip::new(nx)).collect(),
        }
    }

    /// Weight of the area term at which both terms resist a small deformation alike: the quadratic
    /// form of (14) about the regular mesh is then a Laplacian.
    ///
    /// To first order a shift `d` of the vertices changes `f` by `div d` and `g` by `k A_s curl d`,
    /// where `k` is the [gain of slopes](Interface::slope_gain), `c / D` with `c = eta / (1 - eta)`
    /// for glass in perpendicular light; hence `w = (k A_s)^2`, or `lambda = (c / D)^2 h^2` on
    /// square cells of size `h`.
    pub fn balanced_weight_mm2(bench: &Bench, quads: (usize, usize)) -> f64 {
        let area = bench.block().area_mm2() / (quads.0 * quads.1) as f64;
        let axis = bench.window_centre_mm().extend(bench.distance_mm());
        (Interface::of(bench).slope_gain(axis) * area).powi(2)
    }

    /// Puts every vertex at its own distance from the receiver, mm.
    ///
    /// # Panics
    /// If the field has another size than the mesh.
    pub fn set_depth(&mut self, depth_mm: Field<f64>) {
        assert_eq!((depth_mm.nx(), depth_mm.ny()), (self.nx, self.ny), "one depth for each vertex");
        self.depth_mm = depth_mm;
    }
}

impl Objective for WarpObjective {
    fn variables(&self) -> usize {
        2 * self.nx * self.ny
    }

    fn evaluate(&mut self, u: &[f64], gradient: &mut [f64]) -> f64 {
        let (nx, ny) = (self.nx, self.ny);
        let mut strips = std::mem::take(&mut self.strips);
        let (gradient_x, gradient_y) = gradient.split_at_mut(nx * ny);
        if nx * ny <= SERIAL_VERTICES {
            let parts = gradient_x.chunks_mut(STRIP * nx).zip(gradient_y.chunks_mut(STRIP * nx));
            for (k, (strip, (gx, gy))) in strips.iter_mut().zip(parts).enumerate() {
                self.strip(strip, k * STRIP, u, gx, gy);
            }
        } else {
            strips
                .par_iter_mut()
                .zip(gradient_x.par_chunks_mut(STRIP * nx).zip(gradient_y.par_chunks_mut(STRIP * nx)))
                .enumerate()
                .for_each(|(k, (strip, (gx, gy)))| self.strip(strip, k * STRIP, u, gx, gy));
        }
        let value = strips.iter().map(|strip| strip.value).sum();
        self.strips = strips;
        value
    }
}

/// Workspace of one task.
#[derive(Clone, Debug)]
struct Strip {
    value: f64,
    vertices: [VertexRow; 2],
    quads: [QuadRow; 2],
}

/// `s_P`, `o_P / |o_P|` and `1 / n_Pz` of a row of vertices.
#[derive(Clone, Debug)]
struct VertexRow {
    s: [Vec<f64>; 2],
    direction: [Vec<f64>; 2],
    inverse_nz: Vec<f64>,
}

/// Derivatives of the objective with respect to the diagonals and the differences of `s`, of a row
/// of quads, with a zero on either side so that border vertices need no special case.
#[derive(Clone, Debug)]
struct QuadRow {
    e1: [Vec<f64>; 2],
    e2: [Vec<f64>; 2],
    t1: [Vec<f64>; 2],
    t2: [Vec<f64>; 2],
}

impl Strip {
    fn new(nx: usize) -> Self {
        let row = |n: usize| [vec![0.0; n], vec![0.0; n]];
        let vertices = || VertexRow { s: row(nx), direction: row(nx), inverse_nz: vec![0.0; nx] };
        let quads = || QuadRow { e1: row(nx + 1), e2: row(nx + 1), t1: row(nx + 1), t2: row(nx + 1) };
        Self { value: 0.0, vertices: [vertices(), vertices()], quads: [quads(), quads()] }
    }
}

impl QuadRow {
    fn clear(&mut self) {
        for rows in [&mut self.e1, &mut self.e2, &mut self.t1, &mut self.t2] {
            rows.iter_mut().for_each(|row| row.fill(0.0));
        }
    }
}

impl WarpObjective {
    /// Value of the quads that begin in the rows of the strip, and the gradient at its vertices.
    fn strip(&self, strip: &mut Strip, first: usize, u: &[f64], gradient_x: &mut [f64], gradient_y: &mut [f64]) {
        let (nx, ny) = (self.nx, self.ny);
        let Strip { value, vertices: [lower, upper], quads: [below, above] } = strip;
        *value = 0.0;
        if first == 0 {
            below.clear();
            self.vertex_row(lower, 0, u);
        } else {
            self.vertex_row(upper, first - 1, u);
            self.vertex_row(lower, first, u);
            self.quad_row(below, upper, lower, first - 1, u);
        }
        for (k, (gx, gy)) in gradient_x.chunks_mut(nx).zip(gradient_y.chunks_mut(nx)).enumerate() {
            let j = first + k;
            if j + 1 < ny {
                self.vertex_row(upper, j + 1, u);
                *value += self.quad_row(above, lower, upper, j, u);
            } else {
                above.clear();
            }
            self.gather(gx, gy, lower, below, above);
            // Border vertices slide along their border.
            (gx[0], gx[nx - 1]) = (0.0, 0.0);
            if j == 0 || j + 1 == ny {
                gy.fill(0.0);
            }
            std::mem::swap(lower, upper);
            std::mem::swap(below, above);
        }
    }

    fn vertex_row(&self, row: &mut VertexRow, j: usize, u: &[f64]) {
        let nx = self.nx;
        let (ux, uy) = (&u[j * nx..][..nx], &u[(self.ny + j) * nx..][..nx]);
        let [rx, ry] = self.receiver.each_ref().map(|r| &r.row(j)[..nx]);
        let depth = &self.depth_mm.row(j)[..nx];
        let [sx, sy] = row.s.each_mut().map(|v| &mut v[..nx]);
        let [dx, dy] = row.direction.each_mut().map(|v| &mut v[..nx]);
        let inverse_nz = &mut row.inverse_nz[..nx];
        let (incident, eta) = (self.incident, self.eta);
        for i in 0..nx {
            let (ox, oy, oz) = (rx[i] - ux[i], ry[i] - uy[i], depth[i]);
            let length = (ox * ox + oy * oy + oz * oz).sqrt();
            let inverse = 1.0 / (length * incident.z + eta * oz);
            let unit = 1.0 / length;
            sx[i] = (length * incident.x + eta * ox) * inverse;
            sy[i] = (length * incident.y + eta * oy) * inverse;
            dx[i] = ox * unit;
            dy[i] = oy * unit;
            inverse_nz[i] = inverse;
        }
    }

    /// Derivatives of row `j` of quads, between the vertex rows `lower` and `upper`; returns its
    /// part of the objective.
    fn quad_row(&self, out: &mut QuadRow, lower: &VertexRow, upper: &VertexRow, j: usize, u: &[f64]) -> f64 {
        let (nx, n) = (self.nx, self.nx * self.ny);
        let rows = |from: usize| (&u[from + j * nx..][..nx], &u[from + (j + 1) * nx..][..nx]);
        let ((ax, dx), (ay, dy)) = (rows(0), rows(n));
        let [asx, asy] = lower.s.each_ref().map(|v| &v[..nx]);
        let [dsx, dsy] = upper.s.each_ref().map(|v| &v[..nx]);
        let inverse_area = &self.inverse_area.row(j)[..nx - 1];
        let [e1x, e1y] = out.e1.each_mut().map(|v| &mut v[1..nx]);
        let [e2x, e2y] = out.e2.each_mut().map(|v| &mut v[1..nx]);
        let [t1x, t1y] = out.t1.each_mut().map(|v| &mut v[1..nx]);
        let [t2x, t2y] = out.t2.each_mut().map(|v| &mut v[1..nx]);
        let weight = self.area_weight;
        // Two running sums, so that the additions need not wait for each other.
        let mut sums = [0.0; 2];
        for i in 0..nx - 1 {
            let (px, py) = (dx[i + 1] - ax[i], dy[i + 1] - ay[i]);
            let (qx, qy) = (ax[i + 1] - dx[i], ay[i + 1] - dy[i]);
            let (vx, vy) = (asx[i + 1] - dsx[i], asy[i + 1] - dsy[i]);
            let (wx, wy) = (dsx[i + 1] - asx[i], dsy[i + 1] - asy[i]);
            let f = 0.5 * (py * qx - px * qy) * inverse_area[i] - 1.0;
            let g = 0.5 * (vx * px + vy * py - wx * qx - wy * qy);
            sums[i & 1] += weight * f * f + g * g;
            let alpha = weight * f * inverse_area[i];
            e1x[i] = g * vx - alpha * qy;
            e1y[i] = g * vy + alpha * qx;
            e2x[i] = alpha * py - g * wx;
            e2y[i] = -alpha * px - g * wy;
            t1x[i] = g * px;
            t1y[i] = g * py;
            t2x[i] = -g * qx;
            t2y[i] = -g * qy;
        }
        sums[0] + sums[1]
    }

    /// The gradient at a row of vertices from the quads `below` and `above` it.
    fn gather(&self, gx: &mut [f64], gy: &mut [f64], row: &VertexRow, below: &QuadRow, above: &QuadRow) {
        let nx = self.nx;
        let (gx, gy) = (&mut gx[..nx], &mut gy[..nx]);
        let [sx, sy] = row.s.each_ref().map(|v| &v[..nx]);
        let [dx, dy] = row.direction.each_ref().map(|v| &v[..nx]);
        let inverse_nz = &row.inverse_nz[..nx];
        // The vertex is A of the quad above right, B above left, C below left, D below right.
        let [a1x, a1y] = above.e1.each_ref().map(|v| &v[..nx + 1]);
        let [a2x, a2y] = above.e2.each_ref().map(|v| &v[..nx + 1]);
        let [b1x, b1y] = below.e1.each_ref().map(|v| &v[..nx + 1]);
        let [b2x, b2y] = below.e2.each_ref().map(|v| &v[..nx + 1]);
        let [at1x, at1y] = above.t1.each_ref().map(|v| &v[..nx + 1]);
        let [at2x, at2y] = above.t2.each_ref().map(|v| &v[..nx + 1]);
        let [bt1x, bt1y] = below.t1.each_ref().map(|v| &v[..nx + 1]);
        let [bt2x, bt2y] = below.t2.each_ref().map(|v| &v[..nx + 1]);
        let (incident, eta) = (self.incident, self.eta);
        for i in 0..nx {
            let wx = at1x[i] - at2x[i + 1] + bt2x[i] - bt1x[i + 1];
            let wy = at1y[i] - at2y[i + 1] + bt2y[i] - bt1y[i + 1];
            let along = (incident.x - sx[i] * incident.z) * wx + (incident.y - sy[i] * incident.z) * wy;
            gx[i] = a2x[i] - a1x[i + 1] + b1x[i] - b2x[i + 1] - (dx[i] * along + eta * wx) * inverse_nz[i];
            gy[i] = a2y[i] - a1y[i + 1] + b1y[i] - b2y[i + 1] - (dy[i] * along + eta * wy) * inverse_nz[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bench::ExitFace, grid::Extent, optim::check_gradient, warp::WarpMesh};
    use glam::DVec2;

    fn bench(face: ExitFace, tilt: DVec2) -> Bench {
        let bench = Bench::new(Extent::new(30.0, 24.0), 80.0, face).unwrap();
        let axis = bench.light_direction();
        bench
            .with_window(Extent::new(40.0, 20.0), DVec2::new(6.0, -3.0))
            .unwrap()
            .with_light_direction(axis + tilt.extend(0.0))
            .unwrap()
    }

    fn deformed(block: Extent, mx: usize, my: usize, amount: f64) -> Vec<f64> {
        let mesh = WarpMesh::regular(block, (mx, my));
        let n = (mx + 1) * (my + 1);
        let mut u = mesh.coordinates;
        for j in 0..=my {
            for i in 0..=mx {
                let k = j * (mx + 1) + i;
                if i > 0 && i < mx {
                    u[k] += amount * ((3 * i + 5 * j) as f64).sin();
                }
                if j > 0 && j < my {
                    u[n + k] += amount * ((7 * i + 2 * j) as f64).cos();
                }
            }
        }
        u
    }

    #[test]
    fn the_gradient_is_that_of_the_objective_for_glass_and_mirror_straight_and_tilted() {
        // More rows than one strip.
        let (mx, my) = (11, 37);
        let cells = Field::from_fn(mx, my, |i, j| 1.0 + 0.8 * ((i * 5 + j * 3) as f64).sin());
        for face in [ExitFace::Refracts { ior: 1.5 }, ExitFace::Reflects] {
            for tilt in [DVec2::ZERO, DVec2::new(0.2, -0.1)] {
                let bench = bench(face, tilt);
                let weight = 3.0 * WarpObjective::balanced_weight_mm2(&bench, (mx, my));
                let mut objective = WarpObjective::new(&bench, &cells, weight);
                objective.set_depth(Field::from_fn(mx + 1, my + 1, |i, j| 80.0 - ((i + 2 * j) as f64).sin()));
                let u = deformed(bench.block(), mx, my, 0.15);
                let n = (mx + 1) * (my + 1);
                let free: Vec<usize> = (0..2 * n)
                    .filter(|k| {
                        let (i, j) = (k % n % (mx + 1), k % n / (mx + 1));
                        if *k < n { i > 0 && i < mx } else { j > 0 && j < my }
                    })
                    .collect();
                let checks = check_gradient(&mut objective, &u, free.iter().copied(), 1e-3);
                let scale = checks.iter().map(|c| c.analytic.abs()).fold(0.0, f64::max);
                let worst = checks.iter().map(|c| c.relative_error(scale)).fold(0.0, f64::max);
                assert!(worst < 1e-9, "{face:?}, tilt {tilt}: {worst:e}");
                let mut gradient = vec![1.0; 2 * n];
                objective.evaluate(&u, &mut gradient);
                assert!((0..2 * n).filter(|k| !free.contains(k)).all(|k| gradient[k] == 0.0), "borders slide");
            }
        }
    }

    #[test]
    fn the_value_is_the_formula_of_the_paper() {
        let bench = bench(ExitFace::Refracts { ior: 1.5 }, DVec2::ZERO);
        let (mx, my) = (4, 3);
        let cells = Field::from_fn(mx, my, |i, j| 1.0 + 0.1 * (i * j) as f64);
        let weight = 0.02;
        let u = deformed(bench.block(), mx, my, 0.4);
        let mut mesh = WarpMesh::regular(bench.block(), (mx, my));
        mesh.coordinates.clone_from(&u);
        let interface = Interface::of(&bench);
        let mut expected = 0.0;
        for j in 0..my {
            for i in 0..mx {
                let q = mesh.quad(i, j);
                let corner = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let s: [DVec2; 4] = std::array::from_fn(|k| {
                    let x = ReceiverMesh::window(&bench).vertex(corner[k].0, corner[k].1, mx + 1, my + 1);
                    -interface.slopes((x - q[k]).extend(80.0))
                });
                let det = |a: DVec2, b: DVec2| a.perp_dot(b);
                let area = 0.5 * (det(q[1] - q[0], q[3] - q[0]) + det(q[2] - q[3], q[2] - q[1]));
                let wanted = cells[(i, j)] / cells.mean() * 720.0 / 12.0;
                let f = area / wanted - 1.0;
                let g = 0.5 * ((s[1] - s[3]).dot(q[2] - q[0]) - (s[2] - s[0]).dot(q[1] - q[3]));
                expected += weight * f * f + g * g;
            }
        }
        let mut objective = WarpObjective::new(&bench, &cells, weight);
        let value = objective.evaluate(&u, &mut vec![0.0; u.len()]);
        assert!((value / expected - 1.0).abs() < 1e-13, "{value} {expected}");
    }

    #[test]
    fn the_balanced_weight_makes_stretch_and_shear_cost_alike() {
        // About the regular mesh on its own window, div and curl of the same size must cost the
        // same.
        for (face, c) in [(ExitFace::Refracts { ior: 1.5 }, 2.0), (ExitFace::Reflects, 0.5)] {
            let bench = Bench::new(Extent::new(8.0, 8.0), 500.0, face).unwrap();
            let quads = (16, 16);
            let weight = WarpObjective::balanced_weight_mm2(&bench, quads);
            let h: f64 = 0.5;
            assert!((weight / ((c / 500.0_f64).powi(2) * h.powi(4)) - 1.0).abs() < 1e-12);
            let mut objective = WarpObjective::new(&bench, &Field::filled(16, 16, 1.0), weight);
            let mut cost = |swap: bool| {
                let mut u = WarpMesh::regular(bench.block(), quads).coordinates;
                for j in 1..16 {
                    for i in 1..16 {
                        let p = 1e-3 * DVec2::new((i as f64 * 0.7).sin(), (j as f64 * 0.7).sin());
                        let d = if swap { DVec2::new(-p.y, p.x) } else { p };
                        u[j * 17 + i] += d.x;
                        u[17 * 17 + j * 17 + i] += d.y;
                    }
                }
                objective.evaluate(&u, &mut vec![0.0; 2 * 17 * 17])
            };
            let ratio = cost(false) / cost(true);
            assert!((0.97..1.03).contains(&ratio), "{face:?}: {ratio}");
        }
    }

    #[test]
    fn threads_change_no_bit() {
        let bench = bench(ExitFace::Reflects, DVec2::ZERO);
        let (mx, my) = (140, 130);
        assert!(mx * my > SERIAL_VERTICES);
        let cells = Field::from_fn(mx, my, |i, j| 1.5 + ((i * j) as f64).sin());
        let u = deformed(bench.block(), mx, my, 0.02);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut gradient = vec![0.0; u.len()];
            let value = pool.install(|| WarpObjective::new(&bench, &cells, 1e-3).evaluate(&u, &mut gradient));
            (value, gradient)
        };
        assert_eq!(run(1), run(3));
    }
}
