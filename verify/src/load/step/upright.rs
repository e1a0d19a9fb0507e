//! Which way the block of a file looks: edges and faces are read as it stands upright.

use super::{
    builder::SolidBuilder,
    part21::Value,
    values::{GAP_MM, reference, truth},
};
use crate::mesh::whole;
use glam::{DMat3, DVec3};

impl SolidBuilder<'_> {
    /// The turn after which the one B-spline face of a solid looks up and the lines of its control
    /// points, seen from above, run along x and y. The direction that it looks in is an axis of
    /// the file, or that of one of its planes: of the entry face, if of no other. `None` of solids
    /// without such a face; what is wrong with a file is told when it is read.
    pub(super) fn upright(&self, faces: &[u64]) -> Option<DMat3> {
        let (mut nets, mut axes) = (Vec::new(), vec![DVec3::Z]);
        for &face in faces {
            let values = self.entities.expect(face, "ADVANCED_FACE").ok()?;
            let (surface, same_sense) = (reference(&values, 2, face).ok()?, truth(&values, 3, face).ok()?);
            let (kind, values) = self.entities.get(surface).ok()?;
            match kind {
                "PLANE" => axes.push(self.frame(reference(&values, 1, surface).ok()?).ok()?.z_axis),
                "B_SPLINE_SURFACE_WITH_KNOTS" => nets.push((values, same_sense)),
                _ => {}
            }
        }
        let [(values, same_sense)] = &nets[..] else { return None };
        let rows: Vec<Vec<u64>> = values.get(3)?.list()?.iter().map(Value::references).collect::<Option<_>>()?;
        // Two sides of the net, from the same corner.
        let points = |numbers: Vec<u64>| -> Option<Vec<DVec3>> {
            numbers.into_iter().map(|number| self.point(number).ok()).collect()
        };
        let along_u = points(rows.iter().map(|row| row.first().copied()).collect::<Option<_>>()?)?;
        let along_v = points(rows.first()?.clone())?;
        let corner = *along_u.first()?;
        let (to_u, to_v) = (along_u.last()? - corner, along_v.last()? - corner);
        let outwards = to_u.cross(to_v) * if *same_sense { 1.0 } else { -1.0 };
        axes.into_iter().find_map(|axis| {
            let up = axis * axis.dot(outwards).signum();
            let level = to_u - to_u.dot(up) * up;
            let x = level.try_normalize().filter(|_| level.length() > 0.5 * to_u.length())?;
            let y = up.cross(x);
            let on_line = |points: &[DVec3], across: DVec3| {
                points.iter().all(|point| (point - corner).dot(across).abs() <= GAP_MM)
            };
            let turn = whole(DMat3::from_cols(x, y, up).transpose());
            // Along x and y is along y and x, there and back.
            let stands = up == DVec3::Z && turn.x_axis.abs().max_element() == 1.0;
            let upright = if stands { DMat3::IDENTITY } else { turn };
            (on_line(&along_u, y) && on_line(&along_v, x)).then_some(upright)
        })
    }
}
