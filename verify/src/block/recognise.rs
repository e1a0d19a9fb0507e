//! Recognising a block in a mesh: a planar entry face, an exit face over a regular grid, side
//! walls, perhaps a rim around the exit face.

use super::{
    cell::Diagonal,
    error::BlockError,
    grid::{VertexGrid, cells},
    model::Block,
    outline::{Outline, wall_tops},
    relief::Relief,
};
use crate::{
    mesh::{Mesh, TrimmedFace},
    solid,
};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// Relative tolerance for "in the entry plane": f32 in metres, far from the origin, still passes.
pub(super) const PLANE_TOLERANCE: f64 = 1e-5;
/// The cosine to the axis from which on a triangle is a part of a face, and not of an upright wall.
const UPRIGHT: f64 = 0.02;

impl Block {
    /// Recognises a block in a mesh: a planar entry face under an exit face over a regular grid, or
    /// two faces over regular grids under each other.
    ///
    /// # Errors
    /// A mesh that is not closed and oriented with a positive volume, or is another solid than a
    /// block: see [`BlockError`]. Any sound solid can still be traced as such.
    pub fn from_mesh(mesh: &Mesh) -> Result<Self, BlockError> {
        let report = solid::check(mesh);
        if !report.is_sound() {
            return Err(BlockError::Unsound(report));
        }
        Self::of_sound(mesh)
    }

    /// The same of a mesh that is known to be sound.
    pub(super) fn of_sound(mesh: &Mesh) -> Result<Self, BlockError> {
        Self::on_a_plane(mesh).or_else(|planar| Self::between_reliefs(mesh).unwrap_or(Err(planar)))
    }

    /// A block whose entry face is the lowest plane.
    fn on_a_plane(mesh: &Mesh) -> Result<Self, BlockError> {
        let (lo, hi) = mesh.bounds();
        let size = hi - lo;
        let plane = lo.z + PLANE_TOLERANCE * size.max_element().max(lo.z.abs());
        let in_entry = |v: u32| mesh.vertices[v as usize].z <= plane;
        // One that looks elsewhere is not told in these coordinates.
        if let Some(face) = mesh.trimmed.as_deref().filter(|face| face.turn == DMat3::IDENTITY) {
            entry_face(mesh, in_entry, lo, plan_area(mesh))?;
            return Self::of_trimmed_face(mesh, face, in_entry);
        }
        let above: Vec<u32> = (0..mesh.vertices.len() as u32).filter(|&v| !in_entry(v)).collect();
        let plain = entry_face(mesh, in_entry, lo, size.x * size.y)
            .and_then(|()| VertexGrid::over(mesh, above.clone()).map(|grid| (grid, None, None)));
        let (grid, rim_z, outline) = plain.or_else(|plain| {
            // A rim around the exit face, which then is what is left above the entry face.
            let framed = rim(mesh, in_entry, lo).and_then(|(in_rim, rim_z)| {
                let inside = above.iter().copied().filter(|v| !in_rim[*v as usize]).collect();
                Some((VertexGrid::over(mesh, inside).ok()?, Some(rim_z), None))
            });
            // Or an outline that is no rectangle.
            let outlined = || {
                VertexGrid::inside_walls(mesh, in_entry, &above).ok().map(|(grid, outline)| (grid, None, Some(outline)))
            };
            // Or a rim around such an outline.
            let both = || {
                let (in_rim, rim_z) = rim(mesh, in_entry, lo)?;
                let inside: Vec<u32> = above.iter().copied().filter(|v| !in_rim[*v as usize]).collect();
                let below = |v: u32| in_entry(v) || in_rim[v as usize];
                let (grid, outline) = VertexGrid::inside_walls(mesh, below, &inside).ok()?;
                Some((grid, Some(rim_z), Some(outline)))
            };
            let found = framed.or_else(outlined).or_else(both).ok_or(plain)?;
            entry_face(mesh, in_entry, lo, plan_area(mesh))?;
            Ok(found)
        })?;
        let (node_of, vertex_at) = grid.nodes(mesh)?;
        let VertexGrid { lo: lower, hi: upper, nx, ny, .. } = grid;
        let known: Vec<bool> = vertex_at.iter().map(|&v| v != u32::MAX).collect();
        let height = |&v: &u32| mesh.vertices.get(v as usize).map_or(f64::NAN, |at| at.z);
        let mut heights: Vec<f64> = vertex_at.iter().map(height).collect();
        let (diagonals, mut normals) = cells(mesh, &node_of, &known, nx, ny)?;
        let outline = match outline {
            Some(points) => {
                let outline = Outline::new(points, known).ok_or_else(not_around)?;
                outline.complete(&mut heights, (nx, ny), lower, upper);
                normals = None;
                Some(Arc::new(outline))
            }
            None => None,
        };
        let framed = rim_z.is_some() && outline.is_some();
        let entry_outline = if framed { Some(around_entry(mesh, in_entry)?) } else { None };
        Ok(Self {
            exit: Relief::new((lower, upper), (nx, ny), heights, diagonals),
            entry_z: lo.z,
            entry: None,
            normals,
            slopes: None,
            rim_z,
            outline,
            entry_face: (lo.truncate(), hi.truncate()),
            entry_outline,
        })
    }

    /// A block whose faces both are height fields over one rectangle. None if what looks down is no
    /// grid. A solid with one planar side stands on that.
    fn between_reliefs(mesh: &Mesh) -> Option<Result<Self, BlockError>> {
        let [below, above] = [-1.0, 1.0].map(|side| facing(mesh, side));
        let lower = VertexGrid::over(mesh, below).ok()?;
        let upper = VertexGrid::over(mesh, above).ok()?;
        let off = (lower.lo - upper.lo).abs().max((lower.hi - upper.hi).abs()).max_element();
        let size = (upper.hi - upper.lo).max_element();
        if off > PLANE_TOLERANCE * size {
            let why = format!("the faces on both sides have borders that lie {off:.3} mm beside each other");
            return Some(Err(BlockError::Grid { why }));
        }
        let relief = |grid: &VertexGrid| {
            let (node_of, vertex_at) = grid.nodes(mesh)?;
            let (nx, ny) = (grid.nx, grid.ny);
            let heights = vertex_at.iter().map(|&v| mesh.vertices[v as usize].z).collect();
            let (diagonals, normals) = cells(mesh, &node_of, &vec![true; nx * ny], nx, ny)?;
            Ok((Relief::new((grid.lo, grid.hi), (nx, ny), heights, diagonals), normals))
        };
        let faces = relief(&upper).and_then(|exit| Ok((exit, relief(&lower)?.0)));
        let block = faces.and_then(|((exit, normals), entry)| Self::of_faces(exit, normals, entry));
        let planar = |block: &Self| {
            let (low, high) = block.height_range_mm();
            high - low <= PLANE_TOLERANCE * size
        };
        block.map_or_else(|error| Some(Err(error)), |block| (!planar(&block)).then_some(Ok(block)))
    }

    /// A block whose file has its exit face as a surface.
    fn of_trimmed_face(mesh: &Mesh, face: &TrimmedFace, in_entry: impl Fn(u32) -> bool) -> Result<Self, BlockError> {
        let ((nx, ny), lower, upper) = (face.nodes, face.lower_mm, face.upper_mm);
        let (lo, hi) = mesh.bounds();
        let entry_outline = if face.rim_z_mm.is_some() { Some(around_entry(mesh, in_entry)?) } else { None };
        let block = Self {
            exit: Relief::new(
                (lower, upper),
                (nx, ny),
                face.heights_mm.clone(),
                vec![Diagonal::Rising; (nx - 1) * (ny - 1)],
            ),
            entry_z: lo.z,
            entry: None,
            normals: None,
            slopes: None,
            rim_z: face.rim_z_mm,
            outline: None,
            entry_face: (lo.truncate(), hi.truncate()),
            entry_outline,
        };
        block.trimmed_to(face.outline_mm.clone())
    }
}

/// The vertices of all triangles that look up, or down: not of upright walls.
fn facing(mesh: &Mesh, side: f64) -> Vec<u32> {
    let mut faces = vec![false; mesh.vertices.len()];
    for (k, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(k);
        let area = (b - a).cross(c - a);
        if side * area.z > UPRIGHT * area.length() {
            triangle.iter().for_each(|&v| faces[v as usize] = true);
        }
    }
    (0..mesh.vertices.len() as u32).filter(|&v| faces[v as usize]).collect()
}

/// The curve around the entry face.
fn around_entry(mesh: &Mesh, in_entry: impl Fn(u32) -> bool) -> Result<Arc<Outline>, BlockError> {
    let around = || BlockError::Grid { why: "the walls do not go once around the entry face".into() };
    let bottoms = wall_tops(mesh, |v| !in_entry(v));
    let points = (0..mesh.vertices.len()).filter(|&v| bottoms[v]).map(|v| mesh.vertices[v]).collect();
    Ok(Arc::new(Outline::new(points, Vec::new()).ok_or_else(around)?))
}

fn not_around() -> BlockError {
    BlockError::Grid { why: "the walls do not go once around the exit face".into() }
}

/// The level plane, facing up, that reaches the edge of the solid at its least x: which vertices
/// lie on its triangles, and its height. `None` if there is no such plane.
fn rim(mesh: &Mesh, in_entry: impl Fn(u32) -> bool, lo: DVec3) -> Option<(Vec<bool>, f64)> {
    let at = |v: u32| mesh.vertices[v as usize];
    let size = mesh.bounds().1 - lo;
    let tolerance = PLANE_TOLERANCE * size.max_element();
    let level = |k: usize, z: f64| {
        let [a, b, c] = mesh.corners(k);
        [a, b, c].iter().all(|p| (p.z - z).abs() <= tolerance) && (b - a).cross(c - a).z > 0.0
    };
    let z = (0..mesh.triangles.len()).find_map(|k| {
        let [a, ..] = mesh.triangles[k];
        let at_edge = mesh.triangles[k].iter().any(|&v| at(v).x <= lo.x + tolerance);
        (at_edge && !in_entry(a) && level(k, at(a).z)).then(|| at(a).z)
    })?;
    let mut in_rim = vec![false; mesh.vertices.len()];
    for k in (0..mesh.triangles.len()).filter(|&k| level(k, z)) {
        mesh.triangles[k].iter().for_each(|&v| in_rim[v as usize] = true);
    }
    Some((in_rim, z))
}

/// Area of everything that faces up, as seen from above, mm².
fn plan_area(mesh: &Mesh) -> f64 {
    let area = |k: usize| {
        let [a, b, c] = mesh.corners(k);
        (0.5 * (b - a).cross(c - a).z).max(0.0)
    };
    (0..mesh.triangles.len()).map(area).sum()
}

/// Demands that the lowest plane is covered by a face of this area.
fn entry_face(mesh: &Mesh, in_entry: impl Fn(u32) -> bool, lo: DVec3, needed_mm2: f64) -> Result<(), BlockError> {
    let (mut triangles, mut area_mm2) = (0, 0.0);
    for (k, triangle) in mesh.triangles.iter().enumerate() {
        if triangle.iter().all(|&v| in_entry(v)) {
            let [a, b, c] = mesh.corners(k);
            triangles += 1;
            area_mm2 -= 0.5 * (b - a).cross(c - a).z;
        }
    }
    // Not an f32 tolerance but a question of shape: a disc has 0.785 of its outline.
    if (area_mm2 - needed_mm2).abs() > 1e-4 * needed_mm2 {
        return Err(BlockError::EntryFace { triangles, z_mm: lo.z, area_mm2, needed_mm2 });
    }
    Ok(())
}
