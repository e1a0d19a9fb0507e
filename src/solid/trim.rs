//! The exit face of a block that is not rectangular: whole cells inside, a ring of triangles
//! between them and the outline.
//!
//! Nodes nearer to the outline than a quarter of their spacing are left out, so that no triangle of
//! the ring is a sliver. Every node on the border of the whole cells has a foot on the curve, at
//! the height of the spline; both go around in the same order, and the ring joins them. The chords
//! between the feet are no longer than about a cell.

use super::{
    Solid,
    face::{Diagonal, Face, normal_of},
    ring::{Trimmed, around, spans},
};
use crate::surface::SurfaceSpline;
use glam::DVec2;

impl Solid {
    /// The exit face within the outline.
    pub(super) fn trim(&self, spline: &SurfaceSpline, border: &[(DVec2, f64)]) -> Trimmed {
        let field = self.surface.heights_mm();
        let (nx, ny) = (field.nx(), field.ny());
        let spans = spans(&self.surface.contour(), (nx, ny));
        let mut number = vec![u32::MAX; nx * ny];
        for (j, span) in spans.iter().enumerate().filter(|(_, span)| !span.is_empty()) {
            for row in [j, j + 1] {
                number[row * nx + span.start..=row * nx + span.end].fill(0);
            }
        }
        let slopes = spline.node_slopes();
        let (mut vertices, mut normals) = (Vec::new(), Vec::new());
        for (k, number) in number.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
            *number = vertices.len() as u32;
            let (i, j) = (k % nx, k / nx);
            vertices.push([self.exit.x[i], self.exit.y[j], self.file_z(field[(i, j)])]);
            normals.push(normal_of(slopes[(i, j)]));
        }
        let mut triangles = Vec::new();
        for (j, span) in spans.iter().enumerate() {
            for i in span.clone() {
                let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| number[j * nx + i]);
                triangles.extend(match self.diagonal(i, j) {
                    Diagonal::Rising => [[a, b, c], [a, c, d]],
                    Diagonal::Falling => [[a, b, d], [b, c, d]],
                });
            }
        }
        let inner: Vec<u32> = around(&spans).into_iter().map(|(i, j)| number[j * nx + i]).collect();
        let first = vertices.len() as u32;
        let mut outer: Vec<u32> = Vec::with_capacity(border.len());
        for &(at, height) in border {
            let place = at - self.origin.truncate();
            let vertex = [place.x as f32, place.y as f32, self.file_z(height)];
            // On the way away from the outline neighbours have the same foot.
            let same = |v: &usize| vertices.get(*v).is_some_and(|known| known[..2] == vertex[..2]);
            let begin = first as usize;
            let known = [vertices.len() - 1, begin].into_iter().filter(|&v| v >= begin).find(same);
            outer.push(known.unwrap_or(vertices.len()) as u32);
            if known.is_none() {
                vertices.push(vertex);
                normals.push(normal_of(spline.sample(at).slope));
            }
        }
        for k in 0..inner.len() {
            let next = (k + 1) % inner.len();
            let (a, b, c, d) = (inner[k], outer[k], outer[next], inner[next]);
            if b == c {
                triangles.push([a, c, d]);
                continue;
            }
            // Across the corner that leaves the larger triangles: the other may leave one without
            // area.
            let place = |v: u32| DVec2::new(vertices[v as usize][0].into(), vertices[v as usize][1].into());
            let area = |[a, b, c]: [u32; 3]| (place(b) - place(a)).perp_dot(place(c) - place(a));
            let splits = [[[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]];
            let least = splits.map(|[first, second]| area(first).min(area(second)));
            triangles.extend(splits[usize::from(least[1] > least[0])]);
        }
        let border = first..vertices.len() as u32;
        Trimmed { vertices, triangles, normals, border }
    }

    /// A wall straight down from the border of a trimmed exit face, and the entry face as a fan
    /// around its middle.
    pub(super) fn close_along(&mut self, trimmed: Trimmed) {
        let z = self.file_z(f64::from(self.base_z));
        let (upper, count) = (trimmed.border.start, trimmed.border.len() as u32);
        let lower = trimmed.vertices.len() as u32;
        let middle = lower + count;
        self.rest = trimmed.border.clone().map(|v| trimmed.vertices[v as usize]).map(|[x, y, _]| [x, y, z]).collect();
        self.rest.push([-self.origin.x as f32, -self.origin.y as f32, z]);
        let pairs = || (0..count).map(|k| (k, (k + 1) % count));
        self.planes.push((Face::Entry, pairs().map(|(a, b)| [middle, lower + b, lower + a]).collect()));
        let wall = pairs().flat_map(|(a, b)| {
            let (top, bottom) = ((upper + a, upper + b), (lower + a, lower + b));
            [[bottom.0, bottom.1, top.1], [bottom.0, top.1, top.0]]
        });
        self.planes.push((Face::Side, wall.collect()));
        self.adopt(trimmed);
    }

    fn adopt(&mut self, trimmed: Trimmed) {
        self.normals = trimmed.normals.clone();
        self.entry_nodes = (0, 0);
        self.trimmed = Some(trimmed);
    }

    /// The same with a rim: a wall from the border to its plane, the rim, a wall all around it and
    /// an entry face as large. To every vertex of the border belongs one of the outer edge,
    /// straight out from it.
    pub(super) fn close_along_rim(&mut self, trimmed: Trimmed, width_mm: f64) {
        let (z_rim, z_entry) = (self.file_z(self.rim_z_mm.unwrap_or_default()), self.file_z(f64::from(self.base_z)));
        let curve = self.surface.outline().grown(width_mm).within(self.stock_extent());
        let (border, count) = (trimmed.border.start, trimmed.border.len() as u32);
        let inner = trimmed.vertices.len() as u32;
        let (outer, lower, middle) = (inner + count, inner + 2 * count, inner + 3 * count);
        let plan = |v: u32| DVec2::new(trimmed.vertices[v as usize][0].into(), trimmed.vertices[v as usize][1].into());
        let origin = self.origin.truncate();
        let edge: Vec<DVec2> = (0..count)
            .map(|k| plan(border + k) + origin)
            .map(|from| {
                let to = curve.foot(from);
                match self.shape.flat(&curve) {
                    // On the way out, up to the flat of the mark.
                    Some((along, reach)) if along.dot(to) > reach => {
                        from.lerp(to, (reach - along.dot(from)) / along.dot(to - from))
                    }
                    _ => to,
                }
            })
            .map(|at| at - origin)
            .collect();
        let ring = |points: &[DVec2], z: f32| points.iter().map(|p| [p.x as f32, p.y as f32, z]).collect::<Vec<_>>();
        let below: Vec<[f32; 3]> =
            (0..count).map(|k| trimmed.vertices[(border + k) as usize]).map(|[x, y, _]| [x, y, z_rim]).collect();
        let centre = [[-self.origin.x as f32, -self.origin.y as f32, z_entry]];
        self.rest = [below, ring(&edge, z_rim), ring(&edge, z_entry), centre.to_vec()].concat();
        let pairs = || (0..count).map(|k| (k, (k + 1) % count));
        // Quads between two rings of vertices, facing away from the middle if the second is below
        // the first, else up.
        let band = |upper: u32, lower: u32| {
            let quads = pairs().flat_map(move |(a, b)| {
                let (top, bottom) = ((upper + a, upper + b), (lower + a, lower + b));
                [[bottom.0, bottom.1, top.1], [bottom.0, top.1, top.0]]
            });
            quads.collect::<Vec<_>>()
        };
        self.planes.push((Face::Entry, pairs().map(|(a, b)| [middle, lower + b, lower + a]).collect()));
        self.planes.push((Face::Inner, band(border, inner)));
        self.planes.push((Face::Rim, band(inner, outer)));
        self.planes.push((Face::Side, band(outer, lower)));
        self.adopt(trimmed);
    }

    /// Outward unit normal of a face at one of its vertices: that of the spline on a relief, of the
    /// curve on a curved wall, the face's own elsewhere.
    pub fn normal_at(&self, face: Face, v: u32) -> [f32; 3] {
        if let (Face::Entry, Some(entry)) = (face, &self.entry) {
            return entry.normals[v as usize - self.exit.len()];
        }
        if !matches!(face, Face::Side | Face::Inner) {
            return face.normal();
        }
        let [x, y, _] = self.vertex(v as usize).map(f64::from);
        let at = DVec2::new(x, y) + self.origin.truncate();
        let normal = match (face, self.shape.rim) {
            (Face::Inner, _) => {
                // It stands above all of the border, or lies below all of it.
                let border = self.trimmed.as_ref().map(|trimmed| trimmed.vertices[trimmed.border.start as usize][2]);
                let raised = self.rim_z_mm.zip(border).is_some_and(|(z, border)| self.file_z(z) > border);
                self.surface.contour().level(at).normal * if raised { -1.0 } else { 1.0 }
            }
            (_, None) => self.surface.contour().level(at).normal,
            (_, Some(rim)) => {
                let curve = self.surface.outline().grown(rim.width_mm).within(self.stock_extent());
                match self.shape.flat(&curve) {
                    Some((along, reach)) if along.dot(at) > reach - ON_FLAT_MM => along,
                    _ => curve.level(at).normal,
                }
            }
        };
        normal.extend(0.0).as_vec3().to_array()
    }
}

/// What is nearer to the flat of a mark than this belongs to it, mm: files have coordinates of
/// `f32`.
const ON_FLAT_MM: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::super::{Origin, Rim, Shape, SolidError, Stock};
    use super::*;
    use crate::{
        grid::{Extent, Field, Outline},
        measured::{at_worst, within_tenth_of},
        surface::HeightField,
    };

    fn surface(extent: Extent, outline: Outline, (nx, ny): (usize, usize)) -> HeightField {
        let h = |p: DVec2| 0.4 * (0.11 * p.x).sin() * (0.07 * p.y + 0.4).cos() + 0.002 * p.x * p.x;
        HeightField::outlined(extent, outline, Field::from_fn(nx, ny, |i, j| h(extent.node(i, j, nx, ny))))
    }

    #[test]
    fn blocks_of_every_outline_are_sound() {
        let rounded = |radius_mm| Outline::Rounded { radius_mm };
        for (extent, outline) in [
            (Extent::new(100.0, 100.0), Outline::Circle),
            (Extent::new(90.0, 60.0), Outline::Circle),
            (Extent::new(20.0, 80.0), Outline::Circle),
            (Extent::new(100.0, 70.0), rounded(10.0)),
            (Extent::new(100.0, 70.0), rounded(35.0)),
            (Extent::new(100.0, 70.0), rounded(0.8)),
        ] {
            for nodes in [(9, 9), (10, 12), (64, 41), (101, 101), (257, 200)] {
                for origin in Origin::ALL {
                    let face = surface(extent, outline, nodes);
                    let solid = Solid::shaped(&face, Stock::default(), Shape { origin, ..Shape::default() }).unwrap();
                    let proof = solid.check();
                    assert!(proof.is_ok(), "{outline:?} in {extent:?}, {nodes:?} nodes: {proof:?}");
                    let [x, y, z] = solid.bounds().1;
                    let [a, b, c] = solid.bounds().0;
                    // The chord at the outermost point stays within the curve: twice its sagitta,
                    // if no node is opposite.
                    let (half, spacing) = (0.5 * extent.as_vec(), extent.node_spacing(nodes.0, nodes.1));
                    let round = |along: usize| match outline {
                        Outline::Circle => half[1 - along].powi(2) / half[along],
                        Outline::Rounded { radius_mm } if radius_mm >= half[1 - along] => radius_mm,
                        _ => f64::INFINITY,
                    };
                    let sagitta = |along: usize| 1e-4 + (1.5 * spacing[1 - along]).powi(2) / (4.0 * round(along));
                    let short = extent.as_vec() - DVec2::new(f64::from(x - a), f64::from(y - b));
                    assert!(short.x > -1e-4 && short.x < sagitta(0), "{outline:?} {nodes:?}: {short}");
                    assert!(short.y > -1e-4 && short.y < sagitta(1), "{outline:?} {nodes:?}: {short}");
                    assert!((f64::from(z - c) - solid.thickness_mm()).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn the_outer_vertices_lie_on_the_curve_and_on_the_spline() {
        let face = surface(Extent::new(100.0, 70.0), Outline::Circle, (151, 106));
        let spline = SurfaceSpline::through(&face);
        let solid = Solid::new(&face, Stock::default()).unwrap();
        let border = solid.trimmed.as_ref().unwrap().border.clone();
        assert!(border.len() > 400);
        for v in border {
            let [x, y, z] = solid.vertex(v as usize).map(f64::from);
            let at = DVec2::new(x, y);
            assert!(face.contour().level(at).distance_mm.abs() < 5e-6, "{at}");
            assert!((spline.sample(at).height_mm - z).abs() < 1e-6);
        }
    }

    #[test]
    fn the_volume_is_that_of_the_curved_block_to_the_second_order() {
        let flat = |n: usize| {
            let extent = Extent::new(60.0, 40.0);
            let face = HeightField::outlined(extent, Outline::Circle, Field::filled(n, n, 0.0));
            let solid = Solid::new(&face, Stock::of_thickness(10.0)).unwrap();
            (solid.volume_mm3() / (10.0 * face.contour().area_mm2()) - 1.0).abs()
        };
        let (coarse, fine) = (flat(41), flat(161));
        within_tenth_of(3.4e-4, coarse, "coarse");
        within_tenth_of(0.059, fine / coarse, "fine");
    }

    #[test]
    fn rims_marks_and_skirts_around_curved_outlines_are_sound() {
        for (extent, outline) in [
            (Extent::new(60.0, 60.0), Outline::Circle),
            (Extent::new(70.0, 40.0), Outline::Circle),
            (Extent::new(60.0, 50.0), Outline::Rounded { radius_mm: 8.0 }),
        ] {
            let face = surface(extent, outline, (61, 55));
            let relief = face.relief_mm();
            for (width_mm, rise_mm, mark_mm) in
                [(5.0, 0.5, None), (8.0, 1.0, Some(8.0)), (6.0, -relief - 1.0, Some(3.0))]
            {
                for (origin, skirt_mm) in Origin::ALL.into_iter().zip([0.0, 3.0, 0.0, 4.0]) {
                    let rim = Some(Rim { width_mm, rise_mm, mark_mm });
                    let stock = Stock::of_thickness(20.0);
                    let solid = Solid::shaped(&face, stock, Shape { rim, origin, skirt_mm }).unwrap();
                    let proof = solid.check();
                    assert!(proof.is_ok(), "{outline:?} in {extent:?}, {rim:?}: {proof:?}");
                    let edge: Vec<DVec2> = solid.outline();
                    let area: f64 = (0..edge.len()).map(|k| 0.5 * edge[k].perp_dot(edge[(k + 1) % edge.len()])).sum();
                    let faces = solid.faces();
                    let (_, entry) = faces.iter().find(|(face, _)| *face == Face::Entry).unwrap();
                    let entry: f64 = entry
                        .clone()
                        .map(|t| solid.corners(t).map(|[x, y, _]| DVec2::new(x.into(), y.into())))
                        .map(|[a, b, c]| 0.5 * (c - a).perp_dot(b - a))
                        .sum();
                    at_worst(
                        3.3e-4,
                        (entry / area - 1.0).abs(),
                        format_args!("{outline:?} {rim:?}: {entry} of {area}"),
                    );
                    if mark_mm.is_none() && outline == Outline::Circle {
                        let size = solid.stock_extent();
                        let round = std::f64::consts::FRAC_PI_4 * size.area_mm2();
                        at_worst(1.65e-4, (entry / round - 1.0).abs(), format_args!("{outline:?} {rim:?}"));
                    }
                }
            }
        }
    }

    #[test]
    fn a_rim_that_cuts_a_curved_border_is_refused() {
        let face = surface(Extent::new(60.0, 60.0), Outline::Circle, (41, 41));
        let rim = Some(Rim { width_mm: 5.0, rise_mm: -0.3, mark_mm: None });
        let error = Solid::shaped(&face, Stock::default(), Shape { rim, ..Shape::default() }).unwrap_err();
        assert!(matches!(error, SolidError::RimHeight { .. }), "{error}");
    }
}
