//! Light on its way through known faces: of an entry face that is given, of plates that stand before
//! the block. What comes out is the wave behind them, see [`Wavefront`].
//!
//! A ray is followed with its two derivatives by its label `q`, by vector Snell at every face: with
//! the normal `N` of a face, `eta` the quotient of the indices before and behind it, and `c = d . N`,
//! the direction `d` becomes `eta d + (sqrt(1 - eta^2 (1 - c^2)) - eta c) N`. For every node of the
//! plane `z = 0` Newton's method finds the label of the ray that crosses it there.

use super::{source::Intensity, wavefront::Wavefront};
use crate::{
    grid::{Extent, Field},
    surface::{SurfaceSample, SurfaceSpline},
};
use glam::{DMat2, DVec2, DVec3};
use rayon::prelude::*;
use std::sync::Arc;

/// A face that light passes on its way to the block, or into it.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownFace {
    /// Its shape.
    pub shape: FaceShape,
    /// Where the zero of its heights lies on the axis, mm in the bench's frame.
    pub z_mm: f64,
    /// Refractive index of what is behind it; before the first face there is air.
    pub index_behind: f64,
}

/// The shape of a known face.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FaceShape {
    /// A plane across the axis.
    Plane,
    /// A sphere that touches the plane across the axis there. With a positive radius, mm, it bulges
    /// towards the light.
    Sphere {
        /// mm.
        radius_mm: f64,
    },
    /// A cylinder that touches the plane across the axis there, along x or along y. With a positive
    /// radius, mm, it bulges towards the light.
    Cylinder {
        /// mm.
        radius_mm: f64,
        /// Whether its axis lies along x.
        along_x: bool,
    },
    /// The spline through a height field.
    Heights(Arc<SurfaceSpline>),
}

/// Why light does not come through known faces as a wave that a solver can take.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PassageError {
    /// A place in the block's mean plane to which no ray leads, or more than one.
    #[error(
        "no light comes through face {face} of those before the block to x = {:.2} mm, y = {:.2} mm: it is totally reflected there, misses the face, or has passed a focus; take flatter faces or less distance between them",
        at_mm.x, at_mm.y
    )]
    Dark {
        /// Number of the face where the way of the light ends, counted from 1.
        face: usize,
        /// Place in the block's mean plane, mm.
        at_mm: DVec2,
    },
    /// Light that comes from beside a face that is no larger than the block.
    #[error(
        "the light of {:.1} % of the block would come from beside face {face}, which is too small, up to {beside_mm:.2} mm: what stands before the block spreads its light over less than the block; take a smaller block, or a window as large as the block",
        100.0 * share
    )]
    Beside {
        /// Number of the face, counted from 1.
        face: usize,
        /// Share of the block's area.
        share: f64,
        /// How far beside, mm.
        beside_mm: f64,
    },
    /// A focus or a fold in the light before the block.
    #[error(
        "the light has a focus before the block, or folds, at x = {:.2} mm, y = {:.2} mm: take less distance between the faces, or flatter ones",
        at_mm.x, at_mm.y
    )]
    Folded {
        /// Place in the block's mean plane, mm.
        at_mm: DVec2,
    },
}

/// How light begins, in air.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Beginning {
    /// Parallel, along this unit vector.
    Parallel(DVec3),
    /// From this point, mm.
    Point(DVec3, Intensity),
}

/// Nodes along the longer side of the block's mean plane if no known face has detail.
const SMOOTH_NODES: usize = 257;
/// How many nodes there are for one of the finest known face.
const PER_NODE: f64 = 2.0;
/// Most nodes along a side.
const MOST_NODES: usize = 8193;
/// How far beyond the block the wave is known, in nodes.
const MARGIN: usize = 6;
/// How much of the block's area may be lit from beside a face of heights: numerics, at its border.
const MOST_BESIDE: f64 = 2e-3;
/// Up to this part of the block's size the light of its brim may come from beside: how near solvers keep to the border.
const BRIM: f64 = 1e-3;
/// Newton steps for a label.
const STEPS: usize = 40;
/// The same for where a ray meets a face.
const HIT_STEPS: usize = 30;
/// A miss that is below rounding, mm.
const NEGLIGIBLE_MM: f64 = 1e-11;
/// A plane across the axis.
const LEVEL: SurfaceSample = SurfaceSample { height_mm: 0.0, slope: DVec2::ZERO, curvature: [0.0; 3] };

/// The wave behind known faces, of which there is at least one, around the plane `z = 0` of a block:
/// the last face begins its glass.
///
/// # Errors
/// Light that does not come through everywhere.
pub(crate) fn passed(beginning: Beginning, faces: &[KnownFace], block: Extent) -> Result<Wavefront, PassageError> {
    let size = block.as_vec();
    let spacing = faces.iter().filter_map(KnownFace::spacing_mm).fold(f64::INFINITY, f64::min) / PER_NODE;
    let along = |size: f64| {
        let smooth = SMOOTH_NODES as f64 * size / block.as_vec().max_element();
        (if spacing.is_finite() { size / spacing } else { smooth }.ceil() as usize).clamp(16, MOST_NODES)
    };
    let cells = [along(size.x), along(size.y)];
    let step = size / DVec2::new(cells[0] as f64, cells[1] as f64);
    let [nx, ny] = cells.map(|cells| cells + 1 + 2 * MARGIN);
    let extent = Extent::new(step.x * (nx - 1) as f64, step.y * (ny - 1) as f64);
    let way = Way { beginning, faces };
    let (mut phase, mut label_x, mut label_y) = (vec![0.0; nx * ny], vec![0.0; nx * ny], vec![0.0; nx * ny]);
    let rows = phase.par_chunks_mut(nx).zip(label_x.par_chunks_mut(nx).zip(label_y.par_chunks_mut(nx)));
    let inner: Vec<Inner> = rows
        .enumerate()
        .map(|(j, (phase, (label_x, label_y)))| {
            let mut inner = Inner::default();
            let mut nearby: Option<(DVec2, Node)> = None;
            for i in 0..nx {
                let at = extent.node(i, j, nx, ny);
                let guess = nearby
                    .map_or_else(|| way.start(at), |(before, known)| known.label + known.by_place * (at - before));
                let node = way.through(at, guess)?;
                (phase[i], label_x[i], label_y[i]) = (node.phase_mm, node.label.x, node.label.y);
                if at.abs().cmple(0.5 * size + 1e-9).all() {
                    inner.see(at, &node)?;
                }
                nearby = Some((at, node));
            }
            Ok(inner)
        })
        .collect::<Result<_, PassageError>>()?;
    let Inner { nodes, density, beside, furthest } = inner.into_iter().fold(Inner::default(), Inner::and);
    let share = beside as f64 / nodes as f64;
    if share > MOST_BESIDE && furthest.0 > (0.5 * step.min_element()).min(BRIM * size.min_element()) {
        return Err(PassageError::Beside { face: furthest.1 + 1, share, beside_mm: furthest.0 });
    }
    // Flux of mean density 1, as that of parallel light.
    let scale = (density / nodes as f64).sqrt().recip();
    let middle = phase[(ny / 2) * nx + nx / 2];
    let spline = |mut values: Vec<f64>, of: &dyn Fn(f64) -> f64| {
        values.iter_mut().for_each(|value| *value = of(*value));
        SurfaceSpline::interpolating(extent, &Field::from_vec(nx, ny, values))
    };
    let phase = spline(phase, &|phase| phase - middle);
    let label = [label_x, label_y].map(|label| spline(label, &|label| label * scale));
    Ok(Wavefront::new(faces.last().map_or(1.0, |face| face.index_behind), phase, label))
}

/// What is known of the nodes within the block.
#[derive(Clone, Copy, Debug, Default)]
struct Inner {
    nodes: usize,
    /// Sum of the flux per area.
    density: f64,
    /// How many are lit from beside a face, the furthest from there, mm, and which face that is.
    beside: usize,
    furthest: (f64, usize),
}

impl Inner {
    fn see(&mut self, at_mm: DVec2, node: &Node) -> Result<(), PassageError> {
        let flux = node.by_place.determinant();
        // Behind a focus both axes have changed their sign.
        let upright = flux > 0.0 && node.by_place.x_axis.x + node.by_place.y_axis.y > 0.0;
        if !upright {
            return Err(PassageError::Folded { at_mm });
        }
        self.nodes += 1;
        self.density += flux;
        if node.beside.0 > NEGLIGIBLE_MM {
            self.beside += 1;
            self.furthest = further(self.furthest, node.beside);
        }
        Ok(())
    }

    fn and(self, other: Self) -> Self {
        Self {
            nodes: self.nodes + other.nodes,
            density: self.density + other.density,
            beside: self.beside + other.beside,
            furthest: further(self.furthest, other.furthest),
        }
    }
}

/// Of two places beside faces, mm, the one that is further away.
fn further(one: (f64, usize), other: (f64, usize)) -> (f64, usize) {
    if other.0 > one.0 { other } else { one }
}

/// What is known of a node of the plane.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    label: DVec2,
    phase_mm: f64,
    /// The derivative of the label by the place.
    by_place: DMat2,
    /// How far beside a face of heights its ray passed, mm, and at which.
    beside: (f64, usize),
}

/// The way of the light.
struct Way<'a> {
    beginning: Beginning,
    faces: &'a [KnownFace],
}

/// A ray, with its derivatives by both components of its label.
#[derive(Clone, Copy)]
struct Bundle {
    at: DVec3,
    direction: DVec3,
    at_by: [DVec3; 2],
    direction_by: [DVec3; 2],
    phase_mm: f64,
    index: f64,
    beside: (f64, usize),
}

impl Way<'_> {
    /// The label of the ray to a place of the plane `z = 0`, if no face had any power.
    fn start(&self, at: DVec2) -> DVec2 {
        match self.beginning {
            Beginning::Parallel(direction) => at + direction.truncate() * (self.faces[0].z_mm / direction.z),
            Beginning::Point(from, intensity) => {
                let direction = (at.extend(0.0) - from).normalize();
                let m = direction.truncate();
                match intensity {
                    Intensity::Lambertian => m,
                    Intensity::Isotropic => m * (2.0 / (1.0 + direction.z)).sqrt(),
                }
            }
        }
    }

    /// The ray with a label, before the first face.
    fn bundle(&self, label: DVec2) -> Option<Bundle> {
        let unit = [DVec3::X, DVec3::Y];
        let begun = |at, direction, at_by, direction_by, phase_mm| Bundle {
            at,
            direction,
            at_by,
            direction_by,
            phase_mm,
            index: 1.0,
            beside: (0.0, 0),
        };
        Some(match self.beginning {
            Beginning::Parallel(direction) => {
                let at = label.extend(self.faces[0].z_mm);
                begun(at, direction, unit, [DVec3::ZERO; 2], direction.dot(at))
            }
            Beginning::Point(at, intensity) => {
                // The tangential part of the direction is g(|q|^2) q.
                let r2 = label.length_squared();
                let (g, slope) = match intensity {
                    Intensity::Lambertian => (1.0, 0.0),
                    Intensity::Isotropic => {
                        let g = (1.0 - 0.25 * r2).max(0.0).sqrt();
                        (g, -0.125 / g)
                    }
                };
                let m = label * g;
                let axial_2 = 1.0 - m.length_squared();
                let forward = axial_2 > 1e-4;
                if !forward {
                    return None;
                }
                let axial = axial_2.sqrt();
                let by = [DVec2::X, DVec2::Y].map(|unit| {
                    let dm = unit * g + label * (2.0 * slope * label.dot(unit));
                    dm.extend(-m.dot(dm) / axial)
                });
                begun(at, m.extend(axial), [DVec3::ZERO; 2], by, 0.0)
            }
        })
    }

    /// The ray with a label at the plane `z = 0`, or the face where it ended.
    fn follow(&self, label: DVec2) -> Result<Bundle, usize> {
        let mut bundle = self.bundle(label).ok_or(0_usize)?;
        for (k, face) in self.faces.iter().enumerate() {
            bundle = bundle.through(face, k).ok_or(k)?;
        }
        let to = -bundle.at.z / bundle.direction.z;
        Ok(bundle.moved(to, &LEVEL))
    }

    /// The ray that crosses `z = 0` at a place.
    fn through(&self, at_mm: DVec2, guess: DVec2) -> Result<Node, PassageError> {
        let mut label = guess;
        for _ in 0..STEPS {
            let bundle = self.follow(label).map_err(|face| PassageError::Dark { face: face + 1, at_mm })?;
            let by_label = DMat2::from_cols(bundle.at_by[0].truncate(), bundle.at_by[1].truncate());
            let by_place = by_label.inverse();
            let miss = bundle.at.truncate() - at_mm;
            if miss.length_squared() < NEGLIGIBLE_MM * NEGLIGIBLE_MM {
                return Ok(Node { label, phase_mm: bundle.phase_mm, by_place, beside: bundle.beside });
            }
            label -= by_place * miss;
        }
        // Every ray comes through, and none of them there.
        Err(PassageError::Dark { face: self.faces.len(), at_mm })
    }
}

impl Bundle {
    /// The ray after a face; none if it misses it or is totally reflected.
    fn through(&self, face: &KnownFace, number: usize) -> Option<Self> {
        let mut to = (face.z_mm - self.at.z) / self.direction.z;
        let mut met = None;
        for _ in 0..HIT_STEPS {
            let at = self.at + self.direction * to;
            let sample = face.sample(at.truncate())?;
            let miss = at.z - face.z_mm - sample.height_mm;
            let against = self.direction.z - sample.slope.dot(self.direction.truncate());
            if miss.abs() < 0.1 * NEGLIGIBLE_MM {
                met = Some(sample);
                break;
            }
            to -= miss / against;
        }
        let sample = met?;
        let moved = self.moved(to, &sample);
        let steep = DVec3::new(-sample.slope.x, -sample.slope.y, 1.0);
        let length = steep.length();
        let normal = steep / length;
        let [xx, xy, yy] = sample.curvature;
        let (eta, d) = (self.index / face.index_behind, self.direction);
        let cos = d.dot(normal);
        let root_2 = 1.0 - eta * eta * (1.0 - cos * cos);
        let leaves = cos > 0.0 && root_2 > 1e-6;
        if !leaves {
            return None;
        }
        let root = root_2.sqrt();
        let along_normal = root - eta * cos;
        let direction_by = [0, 1].map(|k| {
            let (p, dd) = (moved.at_by[k], self.direction_by[k]);
            let turned = DVec3::new(-(xx * p.x + xy * p.y), -(xy * p.x + yy * p.y), 0.0);
            let dn = (turned - normal * normal.dot(turned)) / length;
            let dcos = dd.dot(normal) + d.dot(dn);
            let by = eta * eta * cos * dcos / root - eta * dcos;
            dd * eta + normal * by + dn * along_normal
        });
        let beside = further(self.beside, (face.beside_mm(moved.at.truncate()), number));
        let direction = d * eta + normal * along_normal;
        Some(Self { direction, direction_by, index: face.index_behind, beside, ..moved })
    }

    /// The ray further on, where it meets a face with this slope.
    fn moved(&self, to: f64, face: &SurfaceSample) -> Self {
        let normal = DVec3::new(-face.slope.x, -face.slope.y, 1.0);
        let against = normal.dot(self.direction);
        let at_by = [0, 1].map(|k| {
            let along = self.at_by[k] + self.direction_by[k] * to;
            along - self.direction * (normal.dot(along) / against)
        });
        Self { at: self.at + self.direction * to, at_by, phase_mm: self.phase_mm + self.index * to, ..*self }
    }
}

impl KnownFace {
    /// Its height over its zero at a place, mm; none where it is not.
    fn sample(&self, at: DVec2) -> Option<SurfaceSample> {
        // z = r - sqrt(r^2 - rho^2), with rho the distance from the axis.
        let round = |radius_mm: f64, offset: DVec2| {
            let root = (radius_mm * radius_mm - offset.length_squared()).sqrt().copysign(radius_mm);
            let slope = offset / root;
            let bend = |a: f64, b: f64, same: f64| (same + a * b) / root;
            root.is_finite().then(|| SurfaceSample {
                height_mm: offset.length_squared() / (radius_mm + root),
                slope,
                curvature: [bend(slope.x, slope.x, 1.0), bend(slope.x, slope.y, 0.0), bend(slope.y, slope.y, 1.0)],
            })
        };
        match &self.shape {
            FaceShape::Plane => Some(LEVEL),
            &FaceShape::Sphere { radius_mm } => round(radius_mm, at),
            &FaceShape::Cylinder { radius_mm, along_x } => {
                let across = if along_x { DVec2::Y } else { DVec2::X };
                let sample = round(radius_mm, at * across)?;
                let [xx, _, yy] = sample.curvature;
                let curvature = if along_x { [0.0, 0.0, yy] } else { [xx, 0.0, 0.0] };
                Some(SurfaceSample { curvature, ..sample })
            }
            FaceShape::Heights(spline) => Some(spline.continued(at)),
        }
    }

    /// Distance between the nodes of a face of heights, mm.
    fn spacing_mm(&self) -> Option<f64> {
        match &self.shape {
            FaceShape::Heights(spline) => {
                let (nx, ny) = spline.nodes();
                Some(spline.extent().node_spacing(nx, ny).min_element())
            }
            _ => None,
        }
    }

    /// How far beside a face of heights a place lies, mm.
    fn beside_mm(&self, at: DVec2) -> f64 {
        match &self.shape {
            FaceShape::Heights(spline) => (at.abs() - 0.5 * spline.extent().as_vec()).max_element().max(0.0),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests;
