//! Everything of a solid that is not its exit face: walls, entry face, rim.

use super::{
    Face, Solid,
    face::Diagonal,
    nodes::Nodes,
    walls::{entry_cells, strip},
};
use glam::{DVec2, DVec3};

impl Solid {
    /// The heights along a wall, mm, in the order of [`Nodes::border`].
    pub(super) fn border_heights(&self, wall: Face) -> Vec<f64> {
        let heights = self.surface.heights_mm().as_slice();
        self.exit.border(wall).into_iter().map(|v| heights[v as usize]).collect()
    }

    /// Cells along x and y of a plane at `z` that the border of the exit face is joined to.
    fn cells_at(&self, z: f64) -> (usize, usize) {
        let [south, east, north, west] = Face::WALLS.map(|wall| -> Vec<f32> {
            self.border_heights(wall).into_iter().map(|h| (h as f32 - z as f32).abs()).collect()
        });
        let extent = self.surface.extent();
        (entry_cells(extent.width_mm, [&south[..], &north[..]]), entry_cells(extent.height_mm, [&east[..], &west[..]]))
    }

    /// Walls down to an entry face: a plane of its own nodes, or a relief on those of the exit face.
    pub(super) fn close_below(&mut self) {
        let (nx, ny) = self.exit_nodes();
        let (cells_x, cells_y) =
            if self.entry.is_some() { (nx - 1, ny - 1) } else { self.cells_at(f64::from(self.base_z)) };
        self.entry_nodes = (cells_x + 1, cells_y + 1);
        let entry = Nodes::new(self.exit.len(), self.surface.extent(), self.entry_nodes, self.origin);
        let relief = self.entry.as_ref();
        let z = |i, j| {
            let z_mm = relief.map_or(f64::from(self.base_z), |relief| relief.surface.heights_mm()[(i, j)]);
            self.file_z(z_mm)
        };
        let nodes = (0..entry.y.len()).flat_map(|j| (0..entry.x.len()).map(move |i| (i, j)));
        self.rest = nodes.map(|(i, j)| [entry.x[i], entry.y[j], z(i, j)]).collect();
        let cells = (0..cells_y).flat_map(|j| (0..cells_x).map(move |i| (i, j)));
        let bottom = cells.flat_map(|(i, j)| {
            let [a, b, c, d] =
                [entry.index(i, j), entry.index(i + 1, j), entry.index(i + 1, j + 1), entry.index(i, j + 1)];
            match relief.map_or(Diagonal::Rising, |relief| relief.diagonals[j * cells_x + i]) {
                Diagonal::Rising => [[a, c, b], [a, d, c]],
                Diagonal::Falling => [[a, d, b], [b, d, c]],
            }
        });
        self.planes.push((Face::Entry, bottom.collect()));
        for wall in Face::WALLS {
            self.planes.push((wall, strip(&self.exit.border(wall), &entry.border(wall))));
        }
    }

    /// Inner walls to the plane of the rim, the rim, outer walls and an entry face as large as the
    /// outline.
    pub(super) fn close_around(&mut self, outline: &[DVec2]) {
        let rim_z = self.rim_z_mm.unwrap_or_default();
        let (cells_x, cells_y) = self.cells_at(rim_z);
        let (z_rim, z_entry) = (self.file_z(rim_z), self.file_z(f64::from(self.base_z)));
        let inner = Nodes::new(0, self.surface.extent(), (cells_x + 1, cells_y + 1), self.origin);
        let (mut vertex, first) = (Vec::new(), self.exit.len() as u32);
        let mut push = |at: [f32; 3]| {
            vertex.push(at);
            first + vertex.len() as u32 - 1
        };
        // The inner edge of the rim, once around; every wall begins where the one before ends.
        let mut around: Vec<u32> = Vec::new();
        for wall in Face::WALLS {
            for v in inner.border(wall).into_iter().rev().skip(1).rev() {
                let (i, j) = (v as usize % inner.x.len(), v as usize / inner.x.len());
                around.push(push([inner.x[i], inner.y[j], z_rim]));
            }
        }
        around.push(around[0]);
        let place = |at: DVec2, origin: DVec3| ((at.x - origin.x) as f32, (at.y - origin.y) as f32);
        let places: Vec<(f32, f32)> = outline.iter().map(|&at| place(at, self.origin)).collect();
        let upper: Vec<u32> = places.iter().map(|&(x, y)| push([x, y, z_rim])).collect();
        let lower: Vec<u32> = places.iter().map(|&(x, y)| push([x, y, z_entry])).collect();
        self.rest = vertex;

        let corners = upper.len();
        let next = |k: usize| (k + 1) % corners;
        let outer_walls: &[Face] =
            if corners == 5 { &[Face::South, Face::East, Face::Mark, Face::North, Face::West] } else { &Face::WALLS };
        let bottom = (1..corners - 1).map(|k| [lower[0], lower[k + 1], lower[k]]).collect();
        self.planes.push((Face::Entry, bottom));
        let raised = rim_z > self.surface.heights_mm()[(0, 0)];
        let mut ring = Vec::new();
        let mut start = 0;
        for wall in Face::WALLS {
            let cells = if matches!(wall, Face::South | Face::North) { cells_x } else { cells_y };
            let edge = &around[start..=start + cells];
            start += cells;
            self.planes.push((if raised { wall.opposite() } else { wall }, strip(&self.exit.border(wall), edge)));
            let k = outer_walls.iter().position(|w| *w == wall).unwrap_or_default();
            ring.extend(strip(edge, &[upper[k], upper[next(k)]]));
            if outer_walls[next(k) % corners] == Face::Mark {
                ring.push([edge[cells], upper[next(k)], upper[next(next(k))]]);
            }
        }
        self.planes.push((Face::Rim, ring));
        for (k, &wall) in outer_walls.iter().enumerate() {
            let (a, b, c, d) = (lower[k], lower[next(k)], upper[next(k)], upper[k]);
            self.planes.push((wall, vec![[a, b, c], [a, c, d]]));
        }
    }

    pub(super) fn number_faces(&mut self) {
        let full = 2 * (self.exit.x.len() - 1) * (self.exit.y.len() - 1);
        let exit = self.trimmed.as_ref().map_or(full, |trimmed| trimmed.triangles.len());
        let mut end = exit;
        self.faces = vec![(Face::Exit, 0..exit)];
        for (face, triangles) in &self.planes {
            self.faces.push((*face, end..end + triangles.len()));
            end += triangles.len();
        }
    }
}
