//! The ellipses of a file, and the upright walls above them.

use super::{
    builder::SolidBuilder,
    conic::Conic,
    fault::malformed,
    part21::Value,
    values::{GAP_MM, odd, reference},
};
use crate::load::{error::LoadError, plane::between};
use glam::{DMat3, DVec2};
use std::f64::consts::TAU;

/// Unrolled walls are cut so much wider than they are: triangles between neighbours all the way up
/// are near the wall, those that reach far around it are not.
const STRETCH: f64 = 1e4;

impl SolidBuilder<'_> {
    /// A circle or an ellipse.
    pub(super) fn conic(&self, kind: &str, values: &[Value<'_>], number: u64) -> Result<Conic, LoadError> {
        let length = |at: usize| values.get(at).and_then(Value::number).map(|length| self.scale * length);
        let (a, b) = if kind == "ELLIPSE" { (length(2), length(3)) } else { (length(2), length(2)) };
        let semi_axes = a.zip(b).map(DVec2::from).ok_or_else(|| odd(number))?;
        if !(semi_axes.is_finite() && semi_axes.cmpgt(DVec2::ZERO).all()) {
            return Err(malformed(format!("#{number} has the semi-axes {semi_axes} mm")));
        }
        let placement = reference(values, 1, number)?;
        let centre = self.point(reference(&self.entities.expect(placement, "AXIS2_PLACEMENT_3D")?, 1, placement)?)?;
        let DMat3 { x_axis: x, y_axis: y, .. } = self.frame(placement)?;
        Ok(Conic { centre, x, y, semi_axes })
    }

    /// The ellipse below a wall.
    pub(super) fn wall(&self, kind: &str, values: &[Value<'_>], number: u64) -> Result<Conic, LoadError> {
        if kind == "CYLINDRICAL_SURFACE" {
            return self.conic(kind, values, number);
        }
        let curve = reference(values, 1, number)?;
        let (kind, of_curve) = self.entities.get(curve)?;
        if !matches!(kind, "CIRCLE" | "ELLIPSE") {
            return Err(malformed(format!("#{number} extrudes a curve of a kind that is not understood: {kind}")));
        }
        let conic = self.conic(kind, &of_curve, curve)?;
        let vector = reference(values, 2, number)?;
        let along = self.direction(reference(&self.entities.expect(vector, "VECTOR")?, 1, vector)?)?;
        let upright = along.try_normalize().is_some_and(|along| along.cross(conic.x.cross(conic.y)).length() < 1e-9);
        if upright {
            Ok(conic)
        } else {
            Err(malformed(format!("#{number} is not extruded along the axis of its curve")))
        }
    }

    /// Cuts a face on a wall into triangles, unrolled.
    pub(super) fn unroll(&mut self, conic: &Conic, loops: &[Vec<u32>], number: u64) -> Result<(), LoadError> {
        let [around] = loops else {
            return Err(malformed(format!("the curved wall #{number} has not exactly one loop")));
        };
        let size = conic.semi_axes.max_element();
        let mut angle = 0.0_f64;
        let mut flat = Vec::with_capacity(around.len());
        for &v in around {
            let at = self.vertices[v as usize];
            let (place, height) = conic.place(at);
            let gap = (place.length() - 1.0).abs() * size;
            if gap.is_nan() || gap > GAP_MM {
                return Err(malformed(format!("the edges of face #{number} lie up to {gap:.1e} mm beside it")));
            }
            // From vertex to vertex by the shorter way: a seam is at both ends.
            let turn = place.to_angle() - angle;
            angle += turn - TAU * (turn / TAU).round();
            flat.push(DVec2::new(STRETCH * size * angle, height));
        }
        let n = flat.len();
        let area: f64 = (0..n).map(|k| flat[k].perp_dot(flat[(k + 1) % n])).sum();
        // Of a wall that faces its axis the loop turns the other way around: it is looked at from
        // there.
        let seen = |k: u32| if area < 0.0 { flat[k as usize] * DVec2::new(-1.0, 1.0) } else { flat[k as usize] };
        let numbers: Vec<u32> = (0..n as u32).collect();
        let cut = between(&[numbers], seen)
            .ok_or_else(|| malformed(format!("the loop of the curved wall #{number} bounds no area")))?;
        self.triangles.extend(cut.into_iter().map(|triangle| triangle.map(|k| around[k as usize])));
        Ok(())
    }
}
