//! Finding a block however it stands in its file: moved, turned, or with all its triangles inside
//! out.
//!
//! The entry face is the plane that all of the mesh lies on one side of, and that covers as much as
//! all that faces away from it. The edges of the exit face, seen along the normal of that plane,
//! run along the lines of the grid and the diagonals of its cells: the directions that are a right
//! angle apart are those of the lines.

use super::{error::BlockError, model::Block, recognise::PLANE_TOLERANCE};
use crate::{
    mesh::{Mesh, QUARTER, whole},
    solid,
};
use glam::{DMat3, DQuat, DVec2, DVec3, Vec2Swizzles, Vec3Swizzles};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Where a block is meant to stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedPose {
    /// Size of the exit face along x and y, mm.
    pub face_mm: DVec2,
    /// The entry face, mm.
    pub entry_z_mm: f64,
}

/// How a block stands in its file: what it takes to bring it where it belongs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// All triangles faced inwards, and were turned round.
    pub inside_out: bool,
    /// Turns the coordinates of the file so that the entry face is below and the lines of the grid
    /// run along x and y.
    pub turn: DMat3,
    /// By how much it is moved then, mm.
    pub shift_mm: DVec3,
}

impl Placement {
    /// The file is as it should be.
    pub const NONE: Self = Self { inside_out: false, turn: DMat3::IDENTITY, shift_mm: DVec3::ZERO };

    /// The axis, of unit length, and the angle of the turn, radians. `None` without one.
    pub fn axis_and_angle(&self) -> Option<(DVec3, f64)> {
        let (axis, angle) = DQuat::from_mat3(&self.turn).normalize().to_axis_angle();
        let (axis, angle) = if angle > TAU / 2.0 { (-axis, TAU - angle) } else { (axis, angle) };
        (self.turn != DMat3::IDENTITY).then_some((axis, angle))
    }
}

/// A block where it belongs.
#[derive(Clone, Debug)]
pub struct PlacedBlock {
    /// The solid, brought there.
    pub mesh: Mesh,
    /// The block in it.
    pub block: Block,
    /// What it took.
    pub placement: Placement,
}

/// A block may stand this part of its size beside its place: what lies within is rounding of text
/// with few digits.
const SHIFT_TOLERANCE: f64 = 1e-4;
/// Its size may differ from what is expected by this part of it.
const SIZE_TOLERANCE: f64 = 1e-3;

impl PlacedBlock {
    /// Finds the block in a mesh, and brings it where it belongs: with `stand`, its entry face at
    /// that height (of a block of another thickness its mean exit plane at z = 0), and turned so
    /// that its sides have those lengths if one way of standing does; without, its mean exit plane
    /// at z = 0 unless that passes through its exit face as it stands. In both cases the middle of
    /// its exit face stands on the axis. Of all ways to do so, the one that turns it least.
    ///
    /// # Errors
    /// The mesh as it was but for the orientation of its triangles, and why it is no block.
    pub fn find(mut mesh: Mesh, stand: Option<&ExpectedPose>) -> Result<Self, Box<(Mesh, BlockError)>> {
        let mut report = solid::check(&mesh);
        let mut placement = Placement::NONE;
        if report.is_inside_out() {
            mesh.turn_inside_out();
            report.volume_mm3 = -report.volume_mm3;
            placement.inside_out = true;
        }
        if !report.is_sound() {
            return Err(Box::new((mesh, BlockError::Unsound(report))));
        }
        let fits = |block: &Block| stand.is_none_or(|stand| ratio_off(block.size_mm(), stand.face_mm) < SIZE_TOLERANCE);
        let block = match Block::of_sound(&mesh) {
            Ok(block) => {
                let swapped =
                    stand.is_some_and(|stand| ratio_off(block.size_mm().yx(), stand.face_mm) < SIZE_TOLERANCE);
                if fits(&block) || !swapped {
                    Ok(block)
                } else {
                    placement.turn = QUARTER;
                    mesh = mesh.turned(&placement.turn);
                    Block::of_sound(&mesh)
                }
            }
            Err(error) => {
                // A file that holds the face as a surface says which way it looks.
                let turns = mesh.trimmed.as_ref().map_or_else(|| turns(&mesh), |face| vec![four_ways(face.turn)]);
                let found = turns.into_iter().find_map(|ways| {
                    let mut blocks = ways.into_iter().map(|turn| {
                        let turned = mesh.clone().turned(&turn);
                        Block::of_sound(&turned).map(|block| (turn, turned, block))
                    });
                    // A block one way is a block in all four.
                    let first = blocks.next()?.ok()?;
                    if fits(&first.2) {
                        return Some(first);
                    }
                    let other = blocks.next().and_then(Result::ok).filter(|(.., block)| fits(block));
                    Some(other.unwrap_or(first))
                });
                match found {
                    Some((turn, turned, block)) => {
                        placement.turn = turn;
                        mesh = turned;
                        Ok(block)
                    }
                    None => Err(error),
                }
            }
        };
        let block = match block {
            Ok(block) => block,
            Err(error) => return Err(Box::new((mesh, error))),
        };
        Self { mesh, block, placement }.at(stand)
    }

    /// The same block in its place.
    fn at(mut self, stand: Option<&ExpectedPose>) -> Result<Self, Box<(Mesh, BlockError)>> {
        let block = &self.block;
        let tolerance = SHIFT_TOLERANCE * block.size_mm().max_element();
        let (low, high) = block.height_range_mm();
        let by_mean = -block.mean_exit_z_mm();
        let z = match stand.map(|stand| stand.entry_z_mm - block.entry_z) {
            // A block of another thickness stands by its mean exit plane.
            Some(by_entry) if by_entry.abs().min(by_mean.abs()) <= tolerance => 0.0,
            Some(by_entry) if (by_entry - by_mean).abs() <= high - low + tolerance => by_entry,
            None if (low <= 0.0 && high >= 0.0) || by_mean.abs() <= tolerance => 0.0,
            _ => by_mean,
        };
        let shift = (-0.5 * (block.exit.lower + block.exit.upper)).extend(z);
        if shift.abs().max_element() > tolerance {
            self.placement.shift_mm = shift;
            self.mesh = self.mesh.moved(shift);
            self.block = match Block::of_sound(&self.mesh) {
                Ok(block) => block,
                Err(error) => return Err(Box::new((self.mesh, error))),
            };
        }
        Ok(self)
    }

    /// The same block turned by this many quarters about the axis, counter-clockwise as seen from
    /// the receiver.
    ///
    /// # Errors
    /// As of [`find`](Self::find).
    pub fn turned_by_quarters(
        self,
        quarters: u32,
        stand: Option<&ExpectedPose>,
    ) -> Result<Self, Box<(Mesh, BlockError)>> {
        if quarters.is_multiple_of(4) {
            return Ok(self);
        }
        let turn = (1..quarters % 4).fold(QUARTER, |turn, _| turn * QUARTER);
        let Self { mesh, mut placement, .. } = self;
        placement.turn = turn * placement.turn;
        placement.shift_mm = turn * placement.shift_mm;
        let mesh = mesh.turned(&turn);
        match Block::of_sound(&mesh) {
            Ok(block) => {
                let before = placement.shift_mm;
                let mut placed =
                    Self { mesh, block, placement: Placement { shift_mm: DVec3::ZERO, ..placement } }.at(stand)?;
                placed.placement.shift_mm += before;
                Ok(placed)
            }
            Err(error) => Err(Box::new((mesh, error))),
        }
    }
}

/// By which part the sides of a face are off, at most.
fn ratio_off(size: DVec2, expected: DVec2) -> f64 {
    (size / expected - 1.0).abs().max_element()
}

/// Bins of directions along each side of a cube's faces: odd, so that the directions of the axes
/// are in the middle of one.
const BINS: usize = 65;
/// Planes that are tried: a block has one entry face, and walls that may be larger.
const PLANES: usize = 12;
/// The entry face covers what faces away from it but for this part: slopes of the walls.
const COVERED: f64 = 1e-3;

/// The turns that bring what may be an entry face down and the lines of a grid along the axes; of
/// each face the four ways, the least turn first.
fn turns(mesh: &Mesh) -> Vec<[DMat3; 4]> {
    let mut bins = vec![DVec3::ZERO; 6 * BINS * BINS];
    for k in 0..mesh.triangles.len() {
        let area = area(mesh, k);
        if let Some(bin) = bin_of(area) {
            bins[bin] += area;
        }
    }
    let mut largest: Vec<usize> = (0..bins.len()).filter(|&k| bins[k] != DVec3::ZERO).collect();
    let by_size = |&a: &usize, &b: &usize| bins[b].length().total_cmp(&bins[a].length()).then(a.cmp(&b));
    if largest.len() > PLANES {
        largest.select_nth_unstable_by(PLANES, by_size);
        largest.truncate(PLANES);
    }
    largest.sort_unstable_by(by_size);
    let mut found: Vec<DVec3> = Vec::new();
    let mut all = Vec::new();
    for bin in largest {
        let Some(normal) = entry_normal(mesh, bins[bin].normalize_or_zero()) else { continue };
        if found.iter().all(|other| other.distance(normal) > 1e-4)
            && let Some(turns) = along_the_lines(mesh, normal)
        {
            found.push(normal);
            all.push(turns);
        }
    }
    all
}

/// The area of a triangle along its normal, mm².
fn area(mesh: &Mesh, k: usize) -> DVec3 {
    let [a, b, c] = mesh.corners(k);
    0.5 * (b - a).cross(c - a)
}

fn bin_of(direction: DVec3) -> Option<usize> {
    let greatest = direction.abs().max_element();
    if !(greatest > 0.0 && greatest.is_finite()) {
        return None;
    }
    let (face, across) =
        [direction.x, direction.y, direction.z].into_iter().enumerate().find(|(_, part)| part.abs() == greatest).map(
            |(axis, part)| {
                let other = [direction.yz(), direction.xz(), direction.xy()][axis] / greatest;
                (2 * axis + usize::from(part > 0.0), other)
            },
        )?;
    let place = |part: f64| ((0.5 * part + 0.5) * BINS as f64).min((BINS - 1) as f64) as usize;
    Some((face * BINS + place(across.x)) * BINS + place(across.y))
}

/// The outward normal of the plane that bounds the mesh in about this direction, if it covers all
/// that faces the other way.
fn entry_normal(mesh: &Mesh, about: DVec3) -> Option<DVec3> {
    let (lo, hi) = mesh.bounds();
    let tolerance = PLANE_TOLERANCE * (hi - lo).max_element().max(lo.abs().max(hi.abs()).max_element());
    let mut normal = about;
    for _ in 0..2 {
        let farthest = mesh.vertices.iter().map(|v| v.dot(normal)).fold(f64::NEG_INFINITY, f64::max);
        let on_plane = |k: usize| mesh.corners(k).iter().all(|v| v.dot(normal) >= farthest - tolerance);
        let (mut covered, mut away) = (DVec3::ZERO, 0.0);
        for k in 0..mesh.triangles.len() {
            let area = area(mesh, k);
            if on_plane(k) {
                covered += area;
            }
            away += (-area.dot(normal)).max(0.0);
        }
        normal = covered.try_normalize()?;
        if covered.length() < (1.0 - COVERED) * away {
            return None;
        }
    }
    Some(normal)
}

/// Bins of directions of edges, over a right angle.
const DIRECTIONS: usize = 1440;

/// The four turns that bring this normal to `-z` and the lines of the grid along x and y.
fn along_the_lines(mesh: &Mesh, normal: DVec3) -> Option<[DMat3; 4]> {
    let up = -normal;
    let u = up.any_orthonormal_vector();
    let v = up.cross(u);
    let angles = || {
        mesh.triangles
            .iter()
            .enumerate()
            .filter(|&(k, _)| {
                let area = area(mesh, k);
                area.dot(up) > 0.05 * area.length()
            })
            .flat_map(|(k, _)| {
                let [a, b, c] = mesh.corners(k);
                [b - a, c - b, a - c].map(|edge| DVec2::new(edge.dot(u), edge.dot(v)))
            })
    };
    let bin = |edge: DVec2| {
        let angle = edge.to_angle().rem_euclid(FRAC_PI_2) / FRAC_PI_2;
        (angle * DIRECTIONS as f64) as usize % DIRECTIONS
    };
    let mut counts = vec![0u32; DIRECTIONS];
    angles().for_each(|edge| counts[bin(edge)] += 1);
    let near = |k: usize| [(k + DIRECTIONS - 1) % DIRECTIONS, k, (k + 1) % DIRECTIONS];
    let count = |k: usize| near(k).iter().map(|&k| counts[k]).sum::<u32>();
    let best = (0..DIRECTIONS).max_by_key(|&k| (count(k), std::cmp::Reverse(k)))?;
    // Of four times the angle all lines have the same direction; long edges know it best.
    let about = near(best);
    let sum: DVec2 = angles()
        .filter(|&edge| about.contains(&bin(edge)))
        .map(|edge| DVec2::from_angle(4.0 * edge.to_angle()) * edge.length_squared())
        .sum();
    let angle = 0.25 * sum.try_normalize()?.to_angle();
    let along = DVec2::from_angle(angle);
    let x = along.x * u + along.y * v;
    Some(four_ways(DMat3::from_cols(x, up.cross(x), up).transpose()))
}

/// A turn and those that go on from it by quarters about the axis, the least first.
fn four_ways(turn: DMat3) -> [DMat3; 4] {
    let mut turns = [turn; 4];
    (1..4).for_each(|k| turns[k] = QUARTER.transpose() * turns[k - 1]);
    let mut turns = turns.map(whole);
    let trace = |turn: &DMat3| turn.x_axis.x + turn.y_axis.y + turn.z_axis.z;
    // To a millionth: equal turns in the order of their quarters, whatever the rounding.
    turns.sort_by_key(|turn| std::cmp::Reverse((1e6 * trace(turn)).round() as i64));
    turns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::{Format, parse};

    /// A block of 30 x 20 mm with a relief, 4 mm thick, as a mesh.
    fn block() -> Mesh {
        let heights =
            |i: usize, j: usize| 0.2 * (0.7 * i as f64).sin() + 0.1 * (0.4 * j as f64).cos() + 0.01 * i as f64;
        let mut off = String::new();
        let (nx, ny) = (31, 21);
        let at = |i: usize, j: usize| (i as f64 - 15.0, j as f64 - 10.0);
        let mut vertices = Vec::new();
        for j in 0..ny {
            for i in 0..nx {
                let (x, y) = at(i, j);
                vertices.push(format!("{x} {y} {}", heights(i, j)));
            }
        }
        let node = |i: usize, j: usize| j * nx + i;
        let mut faces = Vec::new();
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                faces.push(format!("3 {} {} {}", node(i, j), node(i + 1, j), node(i + 1, j + 1)));
                faces.push(format!("3 {} {} {}", node(i, j), node(i + 1, j + 1), node(i, j + 1)));
            }
        }
        let mut border: Vec<(usize, usize)> = (0..nx - 1).map(|i| (i, 0)).collect();
        border.extend((0..ny - 1).map(|j| (nx - 1, j)));
        border.extend((1..nx).rev().map(|i| (i, ny - 1)));
        border.extend((1..ny).rev().map(|j| (0, j)));
        let first = vertices.len();
        for &(i, j) in &border {
            let (x, y) = at(i, j);
            vertices.push(format!("{x} {y} -4"));
        }
        let n = border.len();
        for k in 0..n {
            let next = (k + 1) % n;
            let (above, after) = (node(border[k].0, border[k].1), node(border[next].0, border[next].1));
            faces.push(format!("4 {} {} {after} {above}", first + k, first + next));
        }
        let floor: Vec<String> = (0..n).rev().map(|k| (first + k).to_string()).collect();
        faces.push(format!("{n} {}", floor.join(" ")));
        off += &format!("OFF\n{} {} 0\n{}\n{}\n", vertices.len(), faces.len(), vertices.join("\n"), faces.join("\n"));
        parse(Format::Off, off.as_bytes()).unwrap()
    }

    fn stand() -> ExpectedPose {
        ExpectedPose { face_mm: DVec2::new(30.0, 20.0), entry_z_mm: -4.0 }
    }

    fn difference(placed: &PlacedBlock) -> f64 {
        let wanted = Block::from_mesh(&block()).unwrap();
        let pairs = placed.block.heights_mm().iter().zip(wanted.heights_mm());
        pairs.fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
    }

    #[test]
    fn a_block_in_its_place_is_left_alone() {
        let placed = PlacedBlock::find(block(), Some(&stand())).unwrap();
        assert_eq!(placed.placement, Placement::NONE);
        assert_eq!(placed.mesh, block());
        assert_eq!(PlacedBlock::find(block(), None).unwrap().placement, Placement::NONE);
    }

    #[test]
    fn moved_blocks_are_brought_back() {
        let shift = DVec3::new(300.0, -200.0, 50.0);
        for stand in [Some(stand()), None] {
            let placed = PlacedBlock::find(block().moved(shift), stand.as_ref()).unwrap();
            assert_eq!(placed.placement.turn, DMat3::IDENTITY);
            let off = (placed.placement.shift_mm + shift).abs();
            // Without a stand it is not known where the mean of the exit face belongs.
            assert!(off.truncate().max_element() < 1e-9 && off.z < if stand.is_some() { 1e-9 } else { 0.3 }, "{off}");
        }
    }

    #[test]
    fn every_quarter_turn_and_any_other_is_found() {
        let quarter = |axis: DVec3| DMat3::from_axis_angle(axis, FRAC_PI_2);
        let (x, y) = (quarter(DVec3::X), quarter(DVec3::Y));
        let mut all: Vec<DMat3> = Vec::new();
        for k in 0..64 {
            let turn = (0..k % 4).fold(DMat3::IDENTITY, |turn, _| x * turn);
            let turn = (0..k / 4 % 4).fold(turn, |turn, _| y * turn);
            let turn = whole((0..k / 16).fold(turn, |turn, _| x * turn));
            if !all.contains(&turn) {
                all.push(turn);
            }
        }
        assert_eq!(all.len(), 24);
        for turn in all {
            let placed = PlacedBlock::find(block().turned(&turn), Some(&stand())).unwrap();
            assert_eq!(placed.block.nodes(), (31, 21), "{turn}");
            // As it was, or half a turn from it.
            let half = placed.clone().turned_by_quarters(2, Some(&stand())).unwrap();
            let (this, other) = (difference(&placed), difference(&half));
            assert!(this.min(other) == 0.0, "{turn}: {this} or {other}");
        }
        for angle in [10f64, 1.0, 44.0, 0.02, 71.0] {
            for axis in [DVec3::Z, DVec3::X, DVec3::new(1.0, -2.0, 0.5).normalize()] {
                let turn = DMat3::from_axis_angle(axis, angle.to_radians());
                let placed = PlacedBlock::find(block().turned(&turn), Some(&stand())).unwrap();
                let half = placed.clone().turned_by_quarters(2, Some(&stand())).unwrap();
                let worst = difference(&placed).min(difference(&half));
                assert!(worst < 1e-9, "{angle} degrees about {axis}: {worst}");
            }
        }
    }

    #[test]
    fn a_block_inside_out_is_turned_round_and_said() {
        let mut mesh = block();
        mesh.turn_inside_out();
        let placed = PlacedBlock::find(mesh, Some(&stand())).unwrap();
        assert_eq!(placed.placement, Placement { inside_out: true, ..Placement::NONE });
        assert_eq!(difference(&placed), 0.0);
    }

    #[test]
    fn other_solids_are_no_blocks() {
        let mut mesh = block();
        // A node out of its line.
        mesh.vertices[400].x += 0.3;
        let mesh = PlacedBlock::find(mesh, None).unwrap_err().0;
        assert_eq!(mesh.vertices[400].x, block().vertices[400].x + 0.3);
        let tetrahedron = b"OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
        assert!(PlacedBlock::find(parse(Format::Off, tetrahedron).unwrap(), None).is_err());
    }
}
