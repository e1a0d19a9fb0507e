//! A face with a relief: how it is understood between the nodes, and where rays meet it.

use super::{hit::Hit, search::FaceSearch};
use crate::{block::Relief, spline::Bicubic, trace::accel::SearchRay};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// A face with a relief, and the search structure over its cells.
#[derive(Debug)]
pub(super) struct Face {
    pub(super) model: Model,
    pub(super) search: FaceSearch,
}

/// How a face is understood between its nodes.
#[derive(Debug)]
pub(super) enum Model {
    Spline(Arc<Bicubic>),
    /// Normals at the nodes.
    Smooth(Vec<DVec3>),
    /// Slopes at the nodes.
    Sloped(Arc<Vec<DVec2>>),
    Facets,
}

impl Face {
    pub(super) fn relief(&self) -> &Relief {
        &self.search.relief
    }

    /// Where a ray meets the face whose triangles it crosses so, and the unit normal there. One that
    /// grazes a crest so that it crosses its triangles and not the spline meets it at these.
    #[inline]
    pub(super) fn met(&self, ray: &SearchRay, hit: &Hit) -> (DVec3, DVec3) {
        let crossing = ray.at(hit.crossing.t);
        match &self.model {
            Model::Spline(spline) => on_spline(spline, ray, hit.crossing.t)
                .unwrap_or_else(|| (crossing, self.normal_above(crossing.truncate()))),
            _ => (crossing, self.flat_normal(hit)),
        }
    }

    /// A point of the face above one of its plan, the normal of its shape (with z = 1), and the unit
    /// normal that turns light.
    #[inline]
    pub(super) fn above(&self, at: DVec2) -> (DVec3, DVec3, DVec3) {
        match &self.model {
            Model::Spline(spline) => {
                let jet = spline.jet(at.x, at.y);
                let facing = DVec3::new(-jet.zx, -jet.zy, 1.0);
                (at.extend(jet.z), facing, facing.normalize())
            }
            _ => {
                let hit = self.search.hit_at(at);
                let [a, b, c] = self.search.nodes_of(&hit).map(|(i, j)| self.search.relief.node(i, j));
                let facing = (b - a).cross(c - a);
                let z = hit.crossing.weights.dot(DVec3::new(a.z, b.z, c.z));
                (at.extend(z), facing / facing.z, self.flat_normal(&hit))
            }
        }
    }

    /// Height of the triangles above a point of the plan, mm.
    pub(super) fn height_above(&self, at: DVec2) -> f64 {
        let hit = self.search.hit_at(at);
        let z = self.search.nodes_of(&hit).map(|(i, j)| self.search.relief.node(i, j).z);
        hit.crossing.weights.dot(DVec3::from_array(z))
    }

    /// The unit normal above a point of the plan.
    pub(super) fn normal_above(&self, at: DVec2) -> DVec3 {
        match &self.model {
            Model::Spline(spline) => {
                let jet = spline.jet(at.x, at.y);
                DVec3::new(-jet.zx, -jet.zy, 1.0).normalize()
            }
            _ => self.flat_normal(&self.search.hit_at(at)),
        }
    }

    /// The normal at a point of a triangle: its own, or interpolated.
    #[inline]
    fn flat_normal(&self, hit: &Hit) -> DVec3 {
        let nodes = self.search.nodes_of(hit).map(|(i, j)| j * self.search.relief.nx + i);
        let w = hit.crossing.weights.to_array();
        match &self.model {
            Model::Smooth(normals) => {
                return (w[0] * normals[nodes[0]] + w[1] * normals[nodes[1]] + w[2] * normals[nodes[2]]).normalize();
            }
            Model::Sloped(slopes) => return (-mixed(slopes, nodes, w)).extend(1.0).normalize(),
            _ => {}
        }
        let [a, b, c] = self.search.nodes_of(hit).map(|(i, j)| self.search.relief.node(i, j));
        (b - a).cross(c - a).normalize()
    }
}

/// Slopes between three nodes.
#[inline(always)]
pub(super) fn mixed(slopes: &[DVec2], [a, b, c]: [usize; 3], [u, v, w]: [f64; 3]) -> DVec2 {
    u * slopes[a] + v * slopes[b] + w * slopes[c]
}

/// The point where a ray meets the spline, and the normal there: Newton's iteration for z(t) =
/// s(x(t), y(t)), from the triangle's `t`. A ray along the axis needs one evaluation. `None` where
/// the iteration does not converge.
#[inline]
pub(super) fn on_spline(spline: &Bicubic, ray: &SearchRay, mut t: f64) -> Option<(DVec3, DVec3)> {
    let d = ray.direction;
    let normal = |zx: f64, zy: f64| DVec3::new(-zx, -zy, 1.0) / (1.0 + zx * zx + zy * zy).sqrt();
    if d.x == 0.0 && d.y == 0.0 {
        let jet = spline.jet(ray.origin.x, ray.origin.y);
        return Some((ray.origin.truncate().extend(jet.z), normal(jet.zx, jet.zy)));
    }
    let tolerance = 1e-13 * (1.0 + ray.origin.abs().max_element());
    for _ in 0..20 {
        let p = ray.at(t);
        let jet = spline.jet(p.x, p.y);
        let step = (jet.z - p.z) / (d.z - jet.zx * d.x - jet.zy * d.y);
        t += step;
        if step.abs() <= tolerance {
            return Some((ray.at(t), normal(jet.zx, jet.zy)));
        }
    }
    None
}
