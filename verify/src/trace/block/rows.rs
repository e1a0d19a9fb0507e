//! Many rays of light along the axis at once: by rows of a lattice, and by the facets of the file.
//! Where light goes straight up, what it meets is known, and what neighbours share is computed
//! once.

use super::{
    body::Ray,
    face::{Model, mixed},
    tracer::BlockTracer,
};
use crate::{
    block::{Half, corners, halves},
    scene::{Fresnel, Geometry, Optics, Traversal},
    spline::Columns,
    trace::{
        path::{End, RayPath},
        refraction::tangent_behind,
    },
};
use glam::{DVec2, DVec3};

/// What the rows of a lattice of rays have in common.
#[derive(Clone, Debug)]
pub(crate) enum Lattice {
    /// Under a spline.
    Spline(Vec<f64>, Columns),
    /// Under triangles.
    Flat(Vec<Column>),
}

/// A column of rays under triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    x: f64,
    cell: usize,
    /// How far across the cell.
    part: f64,
}

/// Where the rays of a row of a lattice land. Kept from row to row for its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct RayRow {
    /// Landing points on the receiver, mm, if every ray lands there with all of its power.
    pub(crate) landings: Vec<DVec2>,
    /// All that there is to know of every ray, if that is not so.
    pub(crate) paths: Vec<RayPath>,
    met: Vec<FacePoint>,
    scratch: Vec<[f64; 2]>,
}

impl RayRow {
    /// Whether every ray lands on the receiver, with all of its power.
    pub(crate) fn lands(&self) -> bool {
        self.paths.is_empty()
    }

    /// What is known of a ray.
    #[inline]
    pub(crate) fn path(&self, k: usize) -> RayPath {
        self.paths.get(k).copied().unwrap_or_else(|| RayPath::ended(End::Receiver(self.landings[k]), 1.0))
    }
}

/// What a ray along the axis meets: the height of the face, mm, and its slopes.
#[derive(Clone, Copy, Debug)]
struct FacePoint {
    x: f64,
    z: f64,
    slope: DVec2,
}

/// The simplest bench: light along the axis, which all goes on at a face that it meets once, to a
/// receiver across the axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxialBench {
    ior: f64,
    distance_mm: f64,
    /// Height of a rim around the face.
    rim_z: f64,
    /// Square of the slope from which on light cannot meet the face again.
    steepest2: f64,
}

impl AxialBench {
    /// Where light lands that meets the face at a point, and whether it does.
    #[inline(always)]
    fn landing(&self, at: DVec2, z: f64, slope: DVec2) -> (DVec2, bool) {
        let tangent = tangent_behind(slope, self.ior);
        // False for NaN, which is what total reflection gives.
        let goes_on = self.steepest2 * tangent.length_squared() < 1.0 && z >= self.rim_z;
        (at + tangent * (self.distance_mm - z), goes_on)
    }
}

impl BlockTracer {
    /// This bench, if it is the simplest.
    fn plain(&self) -> Option<AxialBench> {
        let Optics::Refracts { ior } = self.body.optics else { return None };
        let distance_mm = self.receiver.distance_across_axis_mm()?;
        let simple = self.even && self.stand.is_none() && self.later.is_empty() && self.body.fresnel == Fresnel::Off;
        simple.then(|| AxialBench {
            ior,
            distance_mm,
            rim_z: self.body.block.rim_z_mm().unwrap_or(f64::NEG_INFINITY),
            steepest2: match self.body.geometry {
                Geometry::Displaced => self.body.exit.search.steepest * self.body.exit.search.steepest,
                Geometry::NormalMappedPlane => 0.0,
            },
        })
    }

    /// What rows of rays at these places along x have in common, if their paths can be followed row
    /// by row.
    pub(in crate::trace) fn columns(&self, xs: &[f64]) -> Option<Lattice> {
        match &self.body.exit.model {
            _ if !self.even || !self.body.block.is_rectangular() || self.body.traversal != Traversal::Grid => None,
            Model::Spline(spline) => Some(Lattice::Spline(xs.to_vec(), spline.columns(xs))),
            _ => {
                let column = |&x: &f64| {
                    let (cell, part) = self.column_at(x);
                    Column { x, cell, part }
                };
                Some(Lattice::Flat(xs.iter().map(column).collect()))
            }
        }
    }

    /// The paths of the rays of a row, as [`path_at`](Self::path_at) finds them one by one, up to
    /// rounding.
    pub(in crate::trace) fn path_row(&self, lattice: &Lattice, y: f64, row: &mut RayRow) {
        row.met.clear();
        match (lattice, &self.body.exit.model) {
            (Lattice::Spline(xs, columns), Model::Spline(spline)) => {
                spline.row(columns, y, &mut row.scratch, |k, jet| {
                    row.met.push(FacePoint { x: xs[k], z: jet.z, slope: DVec2::new(jet.zx, jet.zy) });
                });
            }
            (Lattice::Flat(columns), Model::Smooth(normals)) => {
                self.flat_row(columns, y, &mut row.met, |_, [a, b, c], [u, v, w]| {
                    let normal = u * normals[a] + v * normals[b] + w * normals[c];
                    -normal.truncate() / normal.z
                });
            }
            (Lattice::Flat(columns), Model::Sloped(slopes)) => {
                self.flat_row(columns, y, &mut row.met, |_, nodes, weights| mixed(slopes, nodes, weights));
            }
            (Lattice::Flat(columns), Model::Facets) => {
                self.flat_row(columns, y, &mut row.met, |slope, _, _| slope());
            }
            _ => unreachable!("the lattice was made for this face"),
        }
        if self.body.geometry == Geometry::NormalMappedPlane {
            row.met.iter_mut().for_each(|met| met.z = 0.0);
        }
        row.paths.clear();
        row.landings.resize(row.met.len(), DVec2::ZERO);
        let all_land = self.plain().is_some_and(|plain| {
            // Without branches, and so many at a time.
            row.met.iter().zip(&mut row.landings).fold(true, |all, (met, at)| {
                let (landing, lands) = plain.landing(DVec2::new(met.x, y), met.z, met.slope);
                *at = landing;
                all & lands
            })
        });
        if !all_land {
            let transmittance = self.illumination.enter(self.rays, DVec3::new(0.0, y, self.body.block.entry_z));
            let transmittance = transmittance.map_or(1.0, |(_, transmittance)| transmittance);
            row.paths.extend(row.met.iter().map(|met| {
                let normal = (-met.slope).extend(1.0).normalize();
                let ray = Ray { point: DVec3::new(met.x, y, met.z), direction: DVec3::Z, transmittance };
                self.leave(ray, normal, None)
            }));
        }
    }

    /// What the rays of a row meet on the triangles. `slope` is given the slopes of the triangle,
    /// the nodes of its corners, and their weights.
    #[inline(always)]
    fn flat_row(
        &self,
        columns: &[Column],
        y: f64,
        met: &mut Vec<FacePoint>,
        slope: impl Fn(&dyn Fn() -> DVec2, [usize; 3], [f64; 3]) -> DVec2,
    ) {
        let relief = self.body.exit.relief();
        let (j, v) = self.row_at(y);
        met.extend(columns.iter().map(|&Column { x, cell: i, part: u }| {
            let cut = halves(relief.diagonals[j * (relief.nx - 1) + i]);
            // In the order of `halves`, by the side of the diagonal.
            let (half, weights) = match cut[0] {
                [0, 1, 2] if v <= u => (cut[0], [1.0 - u, u - v, v]),
                [0, 1, 2] => (cut[1], [1.0 - v, u, v - u]),
                _ if u + v <= 1.0 => (cut[0], [1.0 - u - v, u, v]),
                _ => (cut[1], [1.0 - v, u + v - 1.0, 1.0 - u]),
            };
            let corners = corners(i, j).map(|(i, j)| j * relief.nx + i);
            let nodes = half.map(|k| corners[k]);
            let z: f64 = nodes.iter().zip(weights).map(|(&k, weight)| weight * relief.heights[k]).sum();
            FacePoint { x, z, slope: slope(&|| self.slope_of((i, j), half), nodes, weights) }
        }));
    }

    /// The slopes of one triangle of a cell: it has an edge along x and one along y.
    #[inline]
    fn slope_of(&self, (i, j): (usize, usize), half: Half) -> DVec2 {
        let [a, b, c, d] =
            corners(i, j).map(|(i, j)| self.body.exit.relief().heights[j * self.body.exit.relief().nx + i]);
        let (x, y) = self.body.exit.relief().lines(i, j);
        let along_x = if half[..2] == [0, 1] { b - a } else { c - d };
        let along_y = if (half[0], half[2]) == (0, 3) { d - a } else { c - b };
        DVec2::new(along_x / (x[1] - x[0]), along_y / (y[1] - y[0]))
    }

    /// The column of cells at a place, and how far across it that is.
    fn column_at(&self, x: f64) -> (usize, f64) {
        let cell = ((x - self.body.exit.relief().lower.x) * self.body.exit.search.cells_per_mm.x)
            .clamp(0.0, (self.body.exit.relief().nx - 2) as f64) as usize;
        let [from, to] = self.body.exit.relief().lines(cell, 0).0;
        (cell, (x - from) / (to - from))
    }

    /// The row of cells at a place, and how far across it that is.
    fn row_at(&self, y: f64) -> (usize, f64) {
        let cell = ((y - self.body.exit.relief().lower.y) * self.body.exit.search.cells_per_mm.y)
            .clamp(0.0, (self.body.exit.relief().ny - 2) as f64) as usize;
        let [from, to] = self.body.exit.relief().lines(0, cell).1;
        (cell, (y - from) / (to - from))
    }

    /// Follows light along the axis that meets facets, where it is known which.
    pub(in crate::trace) fn facet_lines(&self) -> Option<FacetLines<'_>> {
        let known = self.even
            && self.body.block.is_rectangular()
            && matches!(self.body.exit.model, Model::Facets)
            && self.body.geometry == Geometry::Displaced;
        let transmittance =
            self.illumination.enter(self.rays, DVec3::new(0.0, 0.0, self.body.block.entry_z)).map(|(_, t)| t);
        let plain = self.plain();
        transmittance.filter(|_| known).map(|transmittance| FacetLines { tracer: self, plain, transmittance })
    }
}

/// Light along the axis that meets facets.
pub(crate) struct FacetLines<'a> {
    tracer: &'a BlockTracer,
    plain: Option<AxialBench>,
    transmittance: f64,
}

/// What becomes of rays that meet one facet.
pub(crate) enum FromFacet<const N: usize> {
    /// They land here, mm, with all of their power.
    Landings([DVec2; N]),
    Paths([RayPath; N]),
}

impl FacetLines<'_> {
    /// The rays that meet one facet of a cell at these points of its plan.
    #[inline]
    pub(crate) fn from<const N: usize>(&self, cell: (usize, usize), half: Half, at: [DVec2; N]) -> FromFacet<N> {
        let (i, j) = corners(cell.0, cell.1)[half[0]];
        let (corner, slope) = (self.tracer.body.block.exit.node(i, j), self.tracer.slope_of(cell, half));
        let z = at.map(|at| corner.z + slope.dot(at - corner.truncate()));
        if let Some(plain) = &self.plain {
            let mut landings = at;
            let lands = |all, (at, z): (&mut DVec2, &f64)| {
                let (landing, lands) = plain.landing(*at, *z, slope);
                *at = landing;
                all & lands
            };
            if landings.iter_mut().zip(&z).fold(true, lands) {
                return FromFacet::Landings(landings);
            }
        }
        let normal = (-slope).extend(1.0).normalize();
        let mut k = 0;
        FromFacet::Paths(at.map(|at| {
            k += 1;
            let ray = Ray { point: at.extend(z[k - 1]), direction: DVec3::Z, transmittance: self.transmittance };
            self.tracer.leave(ray, normal, None)
        }))
    }
}
