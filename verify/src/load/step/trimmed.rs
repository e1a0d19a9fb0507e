//! B-spline faces that a loop trims: height fields over a rectangle, of which the mesh holds the
//! whole cells within the loop and a ring of triangles between them and it.

use super::{builder::SolidBuilder, fault::malformed, values::GAP_MM};
use crate::{
    load::{error::LoadError, plane::cut},
    mesh::TrimmedFace,
    spline::Bicubic,
};
use glam::{DVec2, DVec3};

/// By how much of a spacing samples may stand beside a regular grid.
const GRID_TOLERANCE: f64 = 1e-3;

/// Heights on a regular grid along x and y.
struct Grid {
    lower: DVec2,
    upper: DVec2,
    nx: usize,
    ny: usize,
    heights: Vec<f64>,
}

impl Grid {
    /// Samples of a face, if they are such a grid, in whichever order.
    fn of(samples: &[Vec<DVec3>]) -> Option<Self> {
        let (nu, nv) = (samples.len(), samples[0].len());
        let (first, last) = (samples[0][0], samples[nu - 1][nv - 1]);
        let along_x = (samples[nu - 1][0] - first).x.abs() > (samples[nu - 1][0] - first).y.abs();
        let (nx, ny) = if along_x { (nu, nv) } else { (nv, nu) };
        let (lower, upper) = (first.truncate().min(last.truncate()), first.truncate().max(last.truncate()));
        let (back_x, back_y) = (first.x > last.x, first.y > last.y);
        let spacing = (upper - lower) / DVec2::new((nx - 1) as f64, (ny - 1) as f64);
        if !(spacing.is_finite() && spacing.cmpgt(DVec2::ZERO).all()) {
            return None;
        }
        let mut heights = Vec::with_capacity(nx * ny);
        for j in 0..ny {
            for i in 0..nx {
                let (a, b) = (if back_x { nx - 1 - i } else { i }, if back_y { ny - 1 - j } else { j });
                let at = if along_x { samples[a][b] } else { samples[b][a] };
                let off = (at.truncate() - lower) / spacing - DVec2::new(i as f64, j as f64);
                if !(off.abs().max_element() <= GRID_TOLERANCE && at.z.is_finite()) {
                    return None;
                }
                heights.push(at.z);
            }
        }
        Some(Self { lower, upper, nx, ny, heights })
    }

    fn spacing(&self) -> DVec2 {
        (self.upper - self.lower) / DVec2::new((self.nx - 1) as f64, (self.ny - 1) as f64)
    }

    fn node(&self, k: usize) -> DVec3 {
        let share = DVec2::new((k % self.nx) as f64, (k / self.nx) as f64)
            / DVec2::new((self.nx - 1) as f64, (self.ny - 1) as f64);
        (self.lower * (1.0 - share) + self.upper * share).extend(self.heights[k])
    }
}

impl SolidBuilder<'_> {
    pub(super) fn trimmed(&mut self, samples: &[Vec<DVec3>], around: &[u32], number: u64) -> Result<(), LoadError> {
        let grid = Grid::of(samples).ok_or_else(|| {
            malformed(format!("the B-spline face #{number} is trimmed, but no height field over a rectangle"))
        })?;
        let points: Vec<DVec3> = around.iter().map(|&v| self.vertices[v as usize]).collect();
        let spline = Bicubic::through(&grid.heights, grid.nx, grid.ny, grid.lower.to_array(), grid.upper.to_array());
        let gap = |at: &DVec3| {
            let beyond = (grid.lower - at.truncate()).max(at.truncate() - grid.upper).max_element();
            let above = (at.z - spline.jet(at.x, at.y).z).abs();
            if above.is_nan() { f64::INFINITY } else { above.max(beyond) }
        };
        let gap = points.iter().map(gap).fold(0.0, f64::max);
        if gap > GAP_MM {
            return Err(malformed(format!(
                "the edges of the B-spline face #{number} lie up to {gap:.1e} mm beside it"
            )));
        }
        let plan: Vec<DVec2> = points.iter().map(|p| p.truncate()).collect();
        let area: f64 = (0..plan.len()).map(|k| plan[k].perp_dot(plan[(k + 1) % plan.len()])).sum();
        let up = area > 0.0;
        let whole = self.whole_cells(&grid, &plan)?;
        let ring = self.fill(&grid, &plan, around, &whole)?;
        self.triangles.extend(ring.into_iter().map(|[a, b, c]| if up { [a, b, c] } else { [a, c, b] }));
        if up {
            self.trimmed.push(TrimmedFace {
                turn: self.turn,
                lower_mm: grid.lower,
                upper_mm: grid.upper,
                nodes: (grid.nx, grid.ny),
                heights_mm: grid.heights,
                outline_mm: points,
                rim_z_mm: None,
            });
        }
        Ok(())
    }

    /// The cells whose nodes are all within the polygon and no part of which is nearer to it than a
    /// spacing.
    fn whole_cells(&mut self, grid: &Grid, plan: &[DVec2]) -> Result<Vec<bool>, LoadError> {
        let (nx, ny) = (grid.nx, grid.ny);
        let places: Vec<DVec2> = plan.iter().map(|at| (at - grid.lower) / grid.spacing()).collect();
        let mut near = vec![false; nx * ny];
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); ny];
        for (k, &a) in places.iter().enumerate() {
            let b = places[(k + 1) % places.len()];
            let steps = (2.0 * (b - a).abs().max_element()).ceil().max(1.0);
            // A segment may be long, and there may be many of them.
            self.allowance.take(if steps > 4.0 { steps as usize } else { 0 }, "STEP")?;
            for step in 0..=steps as usize {
                let at = a.lerp(b, step as f64 / steps);
                let span =
                    |at: f64, n: usize| (at - 1.0).floor().max(0.0) as usize..=((at + 1.0).ceil() as usize).min(n - 1);
                for j in span(at.y, ny) {
                    near[j * nx..(j + 1) * nx][span(at.x, nx)].fill(true);
                }
            }
            // Every row that it crosses, its upper end left out.
            let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
            for j in low.y.ceil().max(0.0) as usize..(high.y.ceil().max(0.0) as usize).min(ny) {
                crossings[j].push(low.x + (high.x - low.x) * (j as f64 - low.y) / (high.y - low.y));
            }
        }
        let mut within = vec![false; nx * ny];
        for (j, row) in crossings.iter_mut().enumerate() {
            row.sort_by(f64::total_cmp);
            for pair in row.chunks_exact(2) {
                let (begin, end) = (pair[0].ceil().max(0.0) as usize, (pair[1].ceil().max(0.0) as usize).min(nx));
                (begin..end).for_each(|i| within[j * nx + i] = !near[j * nx + i]);
            }
        }
        let cells = (0..(nx - 1) * (ny - 1)).map(|cell| {
            let first = cell / (nx - 1) * nx + cell % (nx - 1);
            [first, first + 1, first + nx, first + nx + 1].iter().all(|&node| within[node])
        });
        Ok(cells.collect())
    }

    /// Triangles of the whole cells and of what is between them and the polygon, anticlockwise from
    /// above if that is.
    fn fill(
        &mut self,
        grid: &Grid,
        plan: &[DVec2],
        around: &[u32],
        whole: &[bool],
    ) -> Result<Vec<[u32; 3]>, LoadError> {
        let (nx, ny) = (grid.nx, grid.ny);
        let mut vertex = vec![u32::MAX; nx * ny];
        // Points of the ring: the polygon, then the nodes around the whole cells.
        let (mut points, mut numbers) = (plan.to_vec(), around.to_vec());
        let mut edges: Vec<[usize; 2]> = (0..plan.len()).map(|k| [k, (k + 1) % plan.len()]).collect();
        let mut on_ring = vec![usize::MAX; nx * ny];
        let is_whole = |i: usize, j: usize| i < nx - 1 && j < ny - 1 && whole[j * (nx - 1) + i];
        let mut triangles = Vec::new();
        for cell in (0..whole.len()).filter(|&cell| whole[cell]) {
            let (i, j) = (cell % (nx - 1), cell / (nx - 1));
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| j * nx + i);
            for node in corners {
                if vertex[node] == u32::MAX {
                    vertex[node] = self.vertex(grid.node(node))?;
                }
            }
            let [a, b, c, d] = corners.map(|node| vertex[node]);
            triangles.extend([[a, b, c], [a, c, d]]);
            let beside =
                [j > 0 && is_whole(i, j - 1), is_whole(i + 1, j), is_whole(i, j + 1), i > 0 && is_whole(i - 1, j)];
            for side in (0..4).filter(|&side| !beside[side]) {
                let ends = [corners[side], corners[(side + 1) % 4]];
                for node in ends {
                    if on_ring[node] == usize::MAX {
                        on_ring[node] = points.len();
                        points.push(grid.node(node).truncate());
                        numbers.push(vertex[node]);
                    }
                }
                edges.push(ends.map(|node| on_ring[node]));
            }
        }
        let ring =
            cut(&points, edges).ok_or_else(|| malformed("the loop of a trimmed B-spline face crosses itself"))?;
        triangles.extend(ring.into_iter().map(|triangle| triangle.map(|k| numbers[k])));
        Ok(triangles)
    }
}
