//! Reading a caustic mesh, and finding the rows and columns of its quads.

use super::{CausticMesh, CausticMeshError};
use crate::grid::Field;
use glam::{DVec2, DVec3};
use std::{collections::HashMap, io::BufRead, path::Path};

/// A quad by its vertices, in their order around it.
type Quad = [u32; 4];
/// The two vertices of an edge, the lesser first.
type Edge = (u32, u32);

/// Of the mesh's size, by which z may vary.
const FLATNESS: f64 = 1e-6;

impl CausticMesh {
    /// Reads a mesh of m x n quads from an OBJ file: x and y of the receiver in mm, z the same for
    /// all.
    ///
    /// The first vertex of the first face is the corner that gets the light of the block's corner
    /// of least x and y; from there to the face's second vertex the mesh runs along the block's +x.
    /// Faces may be listed in any order and sense.
    ///
    /// # Errors
    /// A file that cannot be read, faces other than quads, quads that do not form a grid, or
    /// vertices outside of a plane.
    #[cfg(feature = "files")]
    pub fn open(path: &Path) -> Result<Self, CausticMeshError> {
        let (models, _) = tobj::load_obj(path, &tobj::LoadOptions::default())
            .map_err(|source| CausticMeshError::Read { path: path.into(), source })?;
        Self::of_models(&models)
    }

    /// The same from anything that can be read, a file in memory for instance.
    ///
    /// # Errors
    /// Those of [`new`](Self::new), [`CausticMeshError::Parse`], faces other than quads, quads that
    /// do not form a grid, or vertices outside of a plane.
    pub fn read(mut file: impl BufRead) -> Result<Self, CausticMeshError> {
        // Its materials do not matter.
        let none = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
        let (models, _) =
            tobj::load_obj_buf(&mut file, &tobj::LoadOptions::default(), none).map_err(CausticMeshError::Parse)?;
        Self::of_models(&models)
    }

    fn of_models(models: &[tobj::Model]) -> Result<Self, CausticMeshError> {
        let mut meshes = models.iter().map(|model| &model.mesh).filter(|mesh| !mesh.indices.is_empty());
        let mesh = meshes.next().ok_or(CausticMeshError::Empty)?;
        if meshes.next().is_some() {
            return Err(CausticMeshError::Objects);
        }
        // Without a list of them all faces are triangles.
        let triangles = if mesh.face_arities.is_empty() { mesh.indices.len() / 3 } else { 0 };
        let arities = mesh.face_arities.iter().copied().chain(std::iter::repeat_n(3, triangles));
        if let Some((face, corners)) = arities.enumerate().find(|(_, corners)| *corners != 4) {
            return Err(CausticMeshError::NotQuads { face: face + 1, corners: corners as usize });
        }
        let quads: Vec<Quad> = mesh.indices.chunks_exact(4).map(|quad| [quad[0], quad[1], quad[2], quad[3]]).collect();
        let point = |k: u32| {
            let at = |axis: usize| mesh.positions.get(3 * k as usize + axis).copied().map_or(f64::NAN, f64::from);
            DVec3::new(at(0), at(1), at(2))
        };
        let grid = Grid::of(&quads)?.rows;
        let vertices = grid.map(|&k| point(k));
        let (low, high) =
            vertices.as_slice().iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let size = (high - low).truncate().max_element();
        if let Some(k) =
            vertices.as_slice().iter().position(|v| !v.is_finite() || (v.z - low.z).abs() > FLATNESS * size)
        {
            let DVec3 { x, y, z } = vertices.as_slice()[k];
            return Err(CausticMeshError::Vertex { column: k % vertices.nx(), row: k / vertices.nx(), x, y, z });
        }
        Self::new(vertices.map(|v| DVec2::new(v.x, v.y)))
    }
}

/// Vertices in rows and columns.
#[derive(Debug)]
struct Grid {
    rows: Field<u32>,
}

impl Grid {
    /// Walks from the first quad along its row, and from the beginning of each row to the next.
    fn of(quads: &[Quad]) -> Result<Self, CausticMeshError> {
        let no_grid = |why, quad: usize| CausticMeshError::NotAGrid { why, face: quad + 1 };
        let first = *quads.first().ok_or(CausticMeshError::Empty)?;
        let mut sharing: HashMap<Edge, [usize; 2]> = HashMap::new();
        for (k, quad) in quads.iter().enumerate() {
            if (0..4).any(|a| (0..a).any(|b| quad[a] == quad[b])) {
                return Err(no_grid("a quad has the same vertex twice", k));
            }
            for side in 0..4 {
                let owners = sharing.entry(edge(quad[side], quad[(side + 1) % 4])).or_insert([usize::MAX; 2]);
                match owners.iter_mut().find(|owner| **owner == usize::MAX) {
                    Some(free) => *free = k,
                    None => return Err(no_grid("more than two quads share an edge", k)),
                }
            }
        }
        let beyond = |from: usize, edge: Edge| {
            sharing.get(&edge).and_then(|owners| owners.iter().find(|k| **k != from && **k != usize::MAX)).copied()
        };
        for side in [edge(first[0], first[1]), edge(first[0], first[3])] {
            if beyond(0, side).is_some() {
                return Err(no_grid("its first vertex is no corner of the mesh: begin the list of faces there", 0));
            }
        }
        let mut visited = vec![false; quads.len()];
        let mut rows: Vec<Vec<u32>> = vec![vec![first[0]], vec![first[3]]];
        // The quad that a row begins with, turned so that its first edge is the lower one, from
        // left to right.
        let (mut start, mut turned) = (0, first);
        loop {
            let row = rows.len() - 1;
            let (mut quad, mut corners) = (start, turned);
            loop {
                if std::mem::replace(&mut visited[quad], true) {
                    return Err(no_grid("a row of quads comes back to itself", quad));
                }
                let [_, b, c, _] = corners;
                // The lower side is known from the row below, but in the first row.
                let column = rows[row].len();
                match rows[row - 1].get(column) {
                    Some(known) if *known != b => return Err(no_grid("rows do not meet", quad)),
                    None if row == 1 => rows[0].push(b),
                    None => return Err(no_grid("a row is longer than the one below", quad)),
                    Some(_) => {}
                }
                rows[row].push(c);
                let Some(next) = beyond(quad, edge(b, c)) else { break };
                corners = beginning_with(quads[next], b, c).ok_or_else(|| no_grid("quads do not meet", next))?;
                quad = next;
            }
            if rows[row].len() != rows[0].len() {
                return Err(no_grid("a row is shorter than the one below", quad));
            }
            let [_, _, c, d] = turned;
            let Some(next) = beyond(start, edge(d, c)) else { break };
            let from_below = beginning_with(quads[next], d, c).ok_or_else(|| no_grid("quads do not meet", next))?;
            // Its lower edge is the side that `beginning_with` puts on the left.
            turned = [from_below[0], from_below[3], from_below[2], from_below[1]];
            start = next;
            rows.push(vec![turned[3]]);
        }
        if let Some(left) = visited.iter().position(|seen| !seen) {
            return Err(no_grid("a quad is connected to none of the others in a row", left));
        }
        let nx = rows[0].len();
        let flat: Vec<u32> = rows.into_iter().flatten().collect();
        let mut seen = std::collections::HashSet::new();
        if let Some(twice) = flat.iter().position(|vertex| !seen.insert(*vertex)) {
            let quad = quads.iter().position(|quad| quad.contains(&flat[twice])).unwrap_or(0);
            return Err(no_grid("it is closed to a ring or touches itself at a vertex", quad));
        }
        let ny = flat.len() / nx;
        Ok(Self { rows: Field::from_vec(nx, ny, flat) })
    }
}

fn edge(a: u32, b: u32) -> Edge {
    (a.min(b), a.max(b))
}

/// The quad with its corners in the order lower left, lower right, upper right, upper left, if its
/// left side goes from `low` up to `high`.
fn beginning_with(quad: Quad, low: u32, high: u32) -> Option<Quad> {
    let at = quad.iter().position(|v| *v == low)?;
    let [next, across, before] = [1, 2, 3].map(|k| quad[(at + k) % 4]);
    if before == high {
        Some([low, next, across, before])
    } else if next == high {
        Some([low, before, across, next])
    } else {
        None
    }
}
