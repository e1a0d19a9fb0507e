//! Tracing a block: entry plane, exit face over a regular grid, receiver.

mod lit;

use super::{
    End, Path,
    illumination::{Illumination, Rays},
    receiver::Receiver,
};
use crate::{
    accel::{Accelerator, Crossing, SearchRay, crossing, passes_beside},
    block::{Block, Diagonal},
    optics::{Interface, Refraction, reflect, refract},
    scene::{Fresnel, Geometry, Optics, Scene, SceneError, Surface, Traversal},
    shading::node_normals,
    spline::Bicubic,
};
use glam::{DMat3, DVec2, DVec3};
use lit::Supply;
use rayon::prelude::*;
use std::sync::OnceLock;

/// How far beyond the border of the face light may pass a rim above it, mm: that of the border itself grazes the wall, and is
/// straight to rounding only. No rim is made to a micrometre.
const GRAZE_MM: f64 = 1e-3;

/// A block with its light inside, its exit face and the search structure over the cells of that face.
#[derive(Debug)]
pub(super) struct BlockTracer {
    block: Block,
    optics: Optics,
    receiver: Receiver,
    fresnel: Fresnel,
    geometry: Geometry,
    traversal: Traversal,
    face: Face,
    /// From the frame of the block to that of the bench, where they differ.
    turned: Option<DMat3>,
    /// Ideal light, in the frame of the block, and how much of it there is.
    rays: Rays,
    illumination: Illumination,
    /// Whether every part of the exit face's plan gets the same light, which has come straight up to it.
    even: bool,
    supply: Supply,
    cells_per_mm: DVec2,
    /// Greatest slope of the exit face: light that leaves steeper than this cannot meet the face again.
    steepest: f64,
    highest_mm: f64,
    /// Built when first needed.
    hierarchy: OnceLock<Hierarchy>,
}

/// A search structure over the cells of the exit face.
#[derive(Debug)]
struct Hierarchy {
    accelerator: Accelerator,
    /// What is needed to cross the cell in every slot, close together.
    cells: Vec<Cell>,
}

/// A cell of the exit face.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Heights at its corners, as [`corners`] lists them, mm.
    heights: [f64; 4],
    number: u32,
    diagonal: Diagonal,
}

#[derive(Debug)]
enum Face {
    Spline(Bicubic),
    /// Normals at the nodes.
    Smooth(Vec<DVec3>),
    Facets,
}

/// A crossing of the triangulated exit face.
#[derive(Clone, Copy, Debug)]
struct Hit {
    crossing: Crossing,
    cell: u32,
    /// Which corners of the cell the triangle has.
    half: Half,
}

/// Three of the corners of a cell, numbered as [`corners`] lists them; counter-clockwise as seen from the receiver.
type Half = [usize; 3];

/// The nodes (column, row) of the corners of a cell, going round.
#[inline]
fn corners(i: usize, j: usize) -> [(usize, usize); 4] {
    [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
}

/// The two triangles of a cell.
#[inline]
fn halves(diagonal: Diagonal) -> [Half; 2] {
    match diagonal {
        Diagonal::Rising => [[0, 1, 2], [0, 2, 3]],
        Diagonal::Falling => [[0, 1, 3], [1, 2, 3]],
    }
}

impl BlockTracer {
    pub(super) fn new(block: &Block, scene: &Scene) -> Result<Self, SceneError> {
        let illumination = Illumination::of(scene, block.entry_z);
        let rays = illumination.in_block(Rays::of(&scene.light));
        let up = match rays {
            Rays::Parallel(direction) => {
                if scene.sense() * direction.z <= 1e-3 {
                    let towards = if scene.sense() > 0.0 { "+z of the block" } else { "-z of the block" };
                    return Err(SceneError::Light { direction, towards });
                }
                direction.truncate() == DVec2::ZERO
            }
            Rays::From(_) => false,
        };
        let even = up && matches!(scene.optics, Optics::Refracts { .. }) && scene.profile.is_none();
        let face = match scene.surface {
            Surface::Spline => {
                let (lo, hi) = (block.lower.to_array(), block.upper.to_array());
                Face::Spline(Bicubic::through(&block.heights, block.nx, block.ny, lo, hi))
            }
            Surface::Facets => Face::Facets,
            Surface::Smooth => Face::Smooth(node_normals(block)),
        };
        let mut tracer = Self {
            optics: scene.optics,
            receiver: Receiver::of(scene),
            fresnel: scene.fresnel,
            geometry: scene.geometry,
            traversal: scene.traversal,
            face,
            turned: Scene::rotation(scene.turned),
            rays,
            illumination,
            even,
            supply: Supply { mean: 1.0, vignetted: 0.0 },
            cells_per_mm: DVec2::new((block.nx - 1) as f64, (block.ny - 1) as f64) / (block.upper - block.lower),
            steepest: steepest(block),
            highest_mm: block.height_range_mm().1,
            hierarchy: OnceLock::new(),
            block: block.clone(),
        };
        if !even {
            tracer.supply = tracer.supply();
            if tracer.supply.mean.is_nan() || tracer.supply.mean <= 0.0 {
                return Err(SceneError::Dark);
            }
        }
        Ok(tracer)
    }

    /// The part of the light for the exit face that meets a side wall, or a rim, before it.
    pub(super) fn vignetting(&self) -> f64 {
        self.supply.vignetted
    }

    /// The search structure over the cells of the exit face.
    fn hierarchy(&self) -> &Hierarchy {
        self.hierarchy.get_or_init(|| {
            let block = &self.block;
            let (columns, rows) = (block.nx - 1, block.ny - 1);
            let (low, high) = block.height_range_mm();
            let reach = block.lower.abs().max(block.upper.abs()).max_element() * 2.0
                + low.abs().max(high.abs()).max(block.entry_z.abs());
            let accelerator = Accelerator::build(columns * rows, reach, |k| {
                let corners = corners(k % columns, k / columns).map(|(i, j)| block.node(i, j));
                corners.iter().fold((corners[0], corners[0]), |(lo, hi), &p| (lo.min(p), hi.max(p)))
            });
            let cells = accelerator.order().par_iter().map(|&number| self.cell(number)).collect();
            Hierarchy { accelerator, cells }
        })
    }

    #[inline]
    fn cell(&self, number: u32) -> Cell {
        let (i, j) = self.place(number);
        let heights = corners(i, j).map(|(i, j)| self.block.heights[j * self.block.nx + i]);
        Cell { heights, number, diagonal: self.block.diagonals[number as usize] }
    }

    /// Column and row of a cell.
    #[inline]
    fn place(&self, number: u32) -> (usize, usize) {
        let columns = self.block.nx as u32 - 1;
        ((number % columns) as usize, (number / columns) as usize)
    }

    pub(super) fn aperture(&self) -> (DVec2, DVec2) {
        (self.block.lower, self.block.upper)
    }

    #[inline]
    pub(super) fn path(&self, start: DVec2) -> Path {
        let (origin, direction, transmittance) = match self.optics {
            Optics::Refracts { .. } => {
                let entered = start.extend(self.block.entry_z);
                let Some((inside, transmittance)) = self.illumination.enter(self.rays, entered) else {
                    return Path::ended(End::Beside, 1.0);
                };
                (entered, inside, transmittance)
            }
            Optics::Reflects => {
                let direction = self.rays.direction_at(start.extend(0.0));
                (self.before(start.extend(0.0), direction), direction, 1.0)
            }
        };
        match self.exit(&SearchRay::new(origin, direction)) {
            Ok((point, normal)) => self.leave(point, normal, direction, transmittance),
            Err(end) => Path::ended(end, transmittance),
        }
    }

    /// From the exit face, where light arrives along `direction`, to the receiver.
    #[inline]
    fn leave(&self, point: DVec3, normal: DVec3, direction: DVec3, transmittance: f64) -> Path {
        let ended = |end| Path::ended(end, transmittance);
        let (direction, passed) = match self.optics {
            Optics::Refracts { ior } => match refract(direction, normal, ior) {
                Interface::Refracted(left) => (left.direction, transmitted(self.fresnel, &left)),
                Interface::TotallyReflected => return ended(End::TotallyReflected),
            },
            Optics::Reflects if direction.dot(normal) < 0.0 => (reflect(direction, normal), 1.0),
            Optics::Reflects => return ended(End::Side),
        };
        if direction.z <= 0.0 || self.meets_the_face_again(point, direction) {
            return ended(End::Side);
        }
        if self.meets_the_rim(point, direction) {
            return ended(End::Side);
        }
        let (point, direction) = self.turned.map_or((point, direction), |turned| (turned * point, turned * direction));
        match self.receiver.landing(point, direction) {
            Some(landing) => Path::ended(End::Receiver(landing), transmittance * passed),
            None => ended(End::Side),
        }
    }

    /// Where light leaves the glass, and the unit normal there.
    #[inline]
    fn exit(&self, ray: &SearchRay) -> Result<(DVec3, DVec3), End> {
        if self.geometry == Geometry::NormalMappedPlane {
            let point = ray.at(-ray.origin.z / ray.direction.z);
            return if self.is_below(point.truncate()) {
                Ok((point, self.normal_above(point.truncate())))
            } else {
                Err(End::Side)
            };
        }
        if let (Face::Spline(spline), Traversal::Grid) = (&self.face, self.traversal)
            && ray.direction.truncate() == DVec2::ZERO
            && self.is_below(ray.origin.truncate())
        {
            // Straight up from a point below the face there is one crossing, and no triangle is needed to find it.
            return on_spline(spline, ray, 0.0).ok_or(End::Lost);
        }
        let Some(hit) = self.first_crossing(ray) else { return Err(self.miss(ray)) };
        match &self.face {
            Face::Spline(spline) => on_spline(spline, ray, hit.crossing.t).ok_or(End::Lost),
            Face::Smooth(_) | Face::Facets => Ok((ray.at(hit.crossing.t), self.flat_normal(&hit))),
        }
    }

    /// Whether the exit face reaches over a point.
    #[inline]
    fn is_below(&self, at: DVec2) -> bool {
        at.cmpge(self.block.lower).all() && at.cmple(self.block.upper).all() && self.block.covers(at)
    }

    /// Where a ray inside the glass meets the triangles of the exit face first.
    #[inline]
    fn first_crossing(&self, ray: &SearchRay) -> Option<Hit> {
        if self.traversal == Traversal::Grid && ray.direction.x == 0.0 && ray.direction.y == 0.0 {
            // It crosses a height field once: if it meets the cell above it, that is the crossing.
            let hit = self.cross(&self.cell(self.cell_above(ray.origin.truncate())), ray, |_| true);
            if hit.is_some() {
                return hit;
            }
        }
        self.search(ray, |_| true)
    }

    /// The nearest crossing of the exit face's triangles that `accept` lets pass.
    fn search(&self, ray: &SearchRay, accept: impl Fn(&Crossing) -> bool) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        let Hierarchy { accelerator, cells } = self.hierarchy();
        accelerator.visit(ray, |slot| {
            let hit = self.cross(&cells[slot], ray, &accept)?;
            if nearest.is_none_or(|n| (hit.crossing.t, hit.cell) < (n.crossing.t, n.cell)) {
                nearest = Some(hit);
            }
            Some(hit.crossing.t)
        });
        nearest
    }

    /// The nearer of the crossings of the two triangles of a cell that `accept` lets pass.
    #[inline(always)]
    fn cross(&self, cell: &Cell, ray: &SearchRay, accept: impl Fn(&Crossing) -> bool) -> Option<Hit> {
        let (i, j) = self.place(cell.number);
        let (x, y) = self.block.lines(i, j);
        let z = cell.heights;
        let corners = [(x[0], y[0], z[0]), (x[1], y[0], z[1]), (x[1], y[1], z[2]), (x[0], y[1], z[3])]
            .map(|(x, y, z)| ray.sheared(DVec3::new(x, y, z)));
        if passes_beside(&corners) {
            return None;
        }
        let mut nearest: Option<Hit> = None;
        for half in halves(cell.diagonal) {
            let Some(crossing) = crossing(half.map(|k| corners[k])).filter(|c| accept(c)) else { continue };
            if nearest.is_none_or(|n| crossing.t < n.crossing.t) {
                nearest = Some(Hit { crossing, cell: cell.number, half });
            }
        }
        nearest
    }

    /// The cell above or below a point; outside of the face the nearest one.
    #[inline]
    fn cell_above(&self, at: DVec2) -> u32 {
        let cells = DVec2::new((self.block.nx - 1) as f64, (self.block.ny - 1) as f64);
        let corner = ((at - self.block.lower) * self.cells_per_mm).floor().clamp(DVec2::ZERO, cells - 1.0);
        corner.y as u32 * (self.block.nx as u32 - 1) + corner.x as u32
    }

    /// Why a ray inside the glass met no triangle of the exit face: it passed a side wall, or else it was lost.
    #[cold]
    fn miss(&self, ray: &SearchRay) -> End {
        let (lower, upper) = (self.block.lower, self.block.upper);
        let d = ray.direction.truncate();
        // Distance to the wall that each component of the direction runs at.
        let wall = DVec2::select(d.cmpgt(DVec2::ZERO), upper, lower);
        let to_wall = (wall - ray.origin.truncate()) / d;
        let distances = to_wall.to_array().into_iter().filter(|t| t.is_finite() && *t >= 0.0);
        let leaves_at = ray.at(distances.fold(f64::INFINITY, f64::min));
        if !self.is_below(ray.origin.truncate()) {
            return End::Beside;
        }
        let margin = 1e-9 * (upper - lower).max_element();
        if leaves_at.is_finite() && leaves_at.z <= self.height_above(leaves_at.truncate()) + margin {
            End::Side
        } else {
            End::Lost
        }
    }

    /// Whether light that has left the face at `point` hits the inner walls of a rim that stands above it.
    #[inline]
    fn meets_the_rim(&self, point: DVec3, direction: DVec3) -> bool {
        let Some(top) = self.block.rim_z_mm().filter(|&z| z > point.z) else { return false };
        let passes = (point + direction * ((top - point.z) / direction.z)).truncate();
        !(passes.cmpge(self.block.lower - GRAZE_MM).all() && passes.cmple(self.block.upper + GRAZE_MM).all())
    }

    #[inline]
    fn meets_the_face_again(&self, point: DVec3, direction: DVec3) -> bool {
        if self.geometry == Geometry::NormalMappedPlane || self.is_steep(direction) {
            return false;
        }
        let ray = SearchRay::new(point, direction);
        self.search(&ray, |crossing| !crossing.outwards && crossing.t > 1e-6).is_some()
    }

    /// Whether a ray runs so much along the axis that it crosses the face once at most.
    #[inline]
    fn is_steep(&self, direction: DVec3) -> bool {
        direction.z.abs() > self.steepest * direction.truncate().length()
    }

    /// The triangle above or below a point, whatever its height.
    fn hit_at(&self, at: DVec2) -> Hit {
        let cell = self.cell_above(at);
        // The triangle in which the point lies deepest, so that rounding at the border decides nothing.
        let candidates = halves(self.block.diagonals[cell as usize]).map(|half| {
            let mut hit = Hit { crossing: Crossing { t: 0.0, weights: DVec3::ZERO, outwards: true }, cell, half };
            let [a, b, c] = self.nodes_of(&hit).map(|(i, j)| self.block.node(i, j).truncate());
            let area = (b - a).perp_dot(c - a);
            hit.crossing.weights =
                DVec3::new((b - at).perp_dot(c - at), (c - at).perp_dot(a - at), (a - at).perp_dot(b - at)) / area;
            hit
        });
        let depth = candidates.map(|hit| hit.crossing.weights.min_element());
        candidates[usize::from(depth[1] > depth[0])]
    }

    /// The nodes (column, row) of the corners of a triangle.
    #[inline]
    fn nodes_of(&self, hit: &Hit) -> [(usize, usize); 3] {
        let (i, j) = self.place(hit.cell);
        let corners = corners(i, j);
        hit.half.map(|k| corners[k])
    }

    fn height_above(&self, at: DVec2) -> f64 {
        let hit = self.hit_at(at);
        let z = self.nodes_of(&hit).map(|(i, j)| self.block.node(i, j).z);
        hit.crossing.weights.dot(DVec3::from_array(z))
    }

    fn normal_above(&self, at: DVec2) -> DVec3 {
        match &self.face {
            Face::Spline(spline) => {
                let jet = spline.jet(at.x, at.y);
                DVec3::new(-jet.zx, -jet.zy, 1.0).normalize()
            }
            Face::Smooth(_) | Face::Facets => self.flat_normal(&self.hit_at(at)),
        }
    }

    /// The normal at a point of a triangle: its own, or interpolated.
    #[inline]
    fn flat_normal(&self, hit: &Hit) -> DVec3 {
        if let Face::Smooth(normals) = &self.face {
            let [a, b, c] = self.nodes_of(hit).map(|(i, j)| normals[j * self.block.nx + i]);
            let w = hit.crossing.weights;
            return (w.x * a + w.y * b + w.z * c).normalize();
        }
        let [a, b, c] = self.nodes_of(hit).map(|(i, j)| self.block.node(i, j));
        (b - a).cross(c - a).normalize()
    }
}

/// The point where a ray meets the spline, and the normal there: Newton's iteration for z(t) = s(x(t), y(t)), from the
/// triangle's `t`. A ray along the axis needs one evaluation. `None` where the iteration does not settle.
#[inline]
fn on_spline(spline: &Bicubic, ray: &SearchRay, mut t: f64) -> Option<(DVec3, DVec3)> {
    let d = ray.direction;
    let normal = |zx: f64, zy: f64| DVec3::new(-zx, -zy, 1.0) / (1.0 + zx * zx + zy * zy).sqrt();
    if d.x == 0.0 && d.y == 0.0 {
        let jet = spline.jet(ray.origin.x, ray.origin.y);
        return Some((ray.origin.truncate().extend(jet.z), normal(jet.zx, jet.zy)));
    }
    let settled = 1e-13 * (1.0 + ray.origin.abs().max_element());
    for _ in 0..20 {
        let p = ray.at(t);
        let jet = spline.jet(p.x, p.y);
        let step = (jet.z - p.z) / (d.z - jet.zx * d.x - jet.zy * d.y);
        t += step;
        if step.abs() <= settled {
            return Some((ray.at(t), normal(jet.zx, jet.zy)));
        }
    }
    None
}

fn transmitted(fresnel: Fresnel, refraction: &Refraction) -> f64 {
    match fresnel {
        Fresnel::Off => 1.0,
        Fresnel::On => refraction.transmittance(),
    }
}

/// A bound for the slope between any two points of the exit face, from its grid lines.
fn steepest(block: &Block) -> f64 {
    let spacing = (block.upper - block.lower) / DVec2::new((block.nx - 1) as f64, (block.ny - 1) as f64);
    let (mut along_x, mut along_y) = (0f64, 0f64);
    for j in 0..block.ny {
        let row = &block.heights[j * block.nx..(j + 1) * block.nx];
        row.windows(2).for_each(|w| along_x = along_x.max((w[1] - w[0]).abs()));
        if j + 1 < block.ny {
            let above = &block.heights[(j + 1) * block.nx..(j + 2) * block.nx];
            row.iter().zip(above).for_each(|(a, b)| along_y = along_y.max((b - a).abs()));
        }
    }
    // The spline may be steeper than its nodes suggest; this only decides whether to look.
    1.5 * DVec2::new(along_x, along_y).length() / spacing.min_element()
}
