//! Opens the solid of a file and brings it where it belongs on its bench, and says what that took.

use super::{
    diagnosis,
    judge::{self, Examiner, Subject},
};
use crate::{
    export::HeightMapFormat,
    failure::Failure,
    record::{BenchRecord, SideFile},
};
use glam::{DVec3, EulerRot, Vec2Swizzles};
use glasswarp_verify::{
    Block, BlockError, ExpectedPose, Geometry, Image, Mesh, PlacedBlock, Placement, Scene, Surface, Traversal,
};
use std::path::Path;

/// How a solid comes to stand on its bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placing {
    /// It is brought where its bench has it, and that is told.
    Righted,
    /// Exactly as it stands in its file.
    AsPlaced,
}

/// What a side file says of the place of a block.
#[derive(Clone, Copy, Debug)]
pub struct Expected<'a> {
    /// The bench that it was made for.
    pub bench: &'a BenchRecord,
    /// From where the coordinates of the file are counted, in the frame of the bench.
    pub origin_mm: DVec3,
}

impl Expected<'_> {
    fn stand(&self) -> ExpectedPose {
        ExpectedPose { face_mm: self.bench.face_mm(), entry_z_mm: self.bench.entry_z_mm }
    }
}

/// Where the vertices of a file of a block are counted from, in the frame of the bench, mm.
pub fn origin_of(side: &SideFile, file: &Path) -> DVec3 {
    // Height maps have no origin.
    if HeightMapFormat::from_path(file).is_ok() { DVec3::ZERO } else { side.frame.origin_mm() }
}

/// A solid, and what was found of its place.
pub struct Opened {
    /// The solid.
    pub subject: Subject,
    /// What does not fit, but for its place.
    suspicions: Vec<String>,
    /// A block that did not stand as it should, before it is known which way up its picture is.
    moved: Option<Box<PlacedBlock>>,
    stand: Option<ExpectedPose>,
    origin: DVec3,
}

/// Pixels across at which pictures the four ways up are compared.
const COARSE: usize = 96;

impl Opened {
    /// Finds out what a mesh is; `name` is what messages call it.
    ///
    /// # Errors
    /// No closed solid, or a block in another unit than its side file's.
    pub fn of(mesh: Mesh, name: &str, expected: Option<Expected<'_>>, placing: Placing) -> Result<Self, Failure> {
        let (stand, origin) = place_of(expected);
        let placed = match find(mesh, name, expected, placing)? {
            Ok(placed) => placed,
            Err((_, error @ BlockError::Unsound(_))) => return Err(judge::not_a_block(name, error)),
            Err((mesh, _)) => {
                let subject = Subject::Solid(Box::new(mesh));
                return Ok(Self { subject, suspicions: Vec::new(), moved: None, stand, origin });
            }
        };
        let suspicions = diagnosis::of_block(&placed.block, expected.map(|expected| expected.bench));
        let block = placed.block.clone().with_spline();
        let moved = (placed.placement != Placement::NONE).then(|| Box::new(placed));
        Ok(Self { subject: Subject::Block(Box::new(block)), suspicions, moved, stand, origin })
    }

    /// The solid, and everything that there is to say of its place. A block that had to be turned
    /// is turned on about the axis so that its picture is the right way up, as far as its outline
    /// allows: its shape alone does not tell.
    ///
    /// # Errors
    /// None that is known.
    pub fn upright(self, name: &str, scene: &Scene, target: Option<&Image>) -> Result<(Subject, Vec<String>), Failure> {
        let Self { mut subject, suspicions, moved, stand, origin } = self;
        let Some(mut placed) = moved else { return Ok((subject, suspicions)) };
        if let (Some(target), Some(_)) = (target, placed.placement.axis_and_angle()) {
            let best = best_way_up(&placed, stand.as_ref(), scene, target);
            if best != 0
                && let Ok(turned) = placed.clone().turned_by_quarters(best, stand.as_ref())
            {
                *placed = turned;
                subject = Subject::Block(Box::new(placed.block.clone().with_spline()));
            }
        }
        let warnings = in_words(name, &placed, origin, stand.is_some()).into_iter().chain(suspicions).collect();
        Ok((subject, warnings))
    }
}

/// Takes a mesh that must be a block, and brings it where it belongs; tells what that took, and
/// what does not fit.
///
/// # Errors
/// No block, or one in another unit than its side file's.
pub fn place_block(
    mesh: Mesh,
    name: &str,
    expected: Option<Expected<'_>>,
    placing: Placing,
) -> Result<(Mesh, Block, Vec<String>), Failure> {
    let (stand, origin) = place_of(expected);
    let placed = find(mesh, name, expected, placing)?.map_err(|(_, error)| judge::not_a_block(name, error))?;
    let mut warnings: Vec<String> = in_words(name, &placed, origin, stand.is_some()).into_iter().collect();
    warnings.extend(diagnosis::of_block(&placed.block, expected.map(|expected| expected.bench)));
    Ok((placed.mesh, placed.block, warnings))
}

/// Where a block belongs, and from where the coordinates of its file are counted.
fn place_of(expected: Option<Expected<'_>>) -> (Option<ExpectedPose>, DVec3) {
    (expected.as_ref().map(Expected::stand), expected.map_or(DVec3::ZERO, |expected| expected.origin_mm))
}

/// The block of a mesh, where it belongs or as it stands; or what else it is, and why that is no
/// block.
fn find(
    mesh: Mesh,
    name: &str,
    expected: Option<Expected<'_>>,
    placing: Placing,
) -> Result<Result<PlacedBlock, (Mesh, BlockError)>, Failure> {
    let (stand, origin) = place_of(expected);
    let mesh = mesh.moved(origin);
    if placing == Placing::AsPlaced {
        return Ok(match Block::from_mesh(&mesh) {
            Ok(block) => Ok(PlacedBlock { mesh, block, placement: Placement::NONE }),
            Err(error) => Err((mesh, error)),
        });
    }
    let placed = PlacedBlock::find(mesh, stand.as_ref());
    if let (Ok(placed), Some(expected)) = (&placed, expected) {
        refuse_other_units(&placed.block, expected.bench, name)?;
    }
    Ok(placed.map_err(|other| *other))
}

/// By how many quarters a block is to be turned on so that its picture is nearest to the target.
fn best_way_up(placed: &PlacedBlock, stand: Option<&ExpectedPose>, scene: &Scene, target: &Image) -> u32 {
    let size = placed.block.size_mm();
    let is_square = (size.x / size.y - 1.0).abs() < 1e-3;
    let examiner = Examiner::new(Scene { traversal: Traversal::Grid, ..scene.clone() }, Some(target), COARSE);
    let error = |quarters: u32| -> f64 {
        let turned = placed.clone().turned_by_quarters(quarters, stand);
        let subject = turned.map(|turned| Subject::Block(Box::new(turned.block)));
        let seen = subject.ok().and_then(|subject| {
            let seen = examiner.trace(&subject, Surface::Spline, Geometry::Displaced).ok()?;
            examiner.likeness(&seen.image).ok()?
        });
        seen.map_or(f64::INFINITY, |likeness| likeness.rel_rms)
    };
    let ways: &[u32] = if is_square { &[0, 1, 2, 3] } else { &[0, 2] };
    let mut best = (0, f64::INFINITY);
    for &quarters in ways {
        let error = error(quarters);
        if error < best.1 {
            best = (quarters, error);
        }
    }
    best.0
}

/// A block that is another unit's number of times as large as its side file says is another block
/// to everyone who reads its file.
fn refuse_other_units(block: &Block, bench: &BenchRecord, name: &str) -> Result<(), Failure> {
    let size = block.size_mm();
    let units = [size, size.yx()].into_iter().find_map(|size| diagnosis::unit_of(size / bench.face_mm()));
    let Some((factor, unit)) = units else { return Ok(()) };
    Err(Failure::InvalidMesh {
        what: format!(
            "{}: looks like {unit}: {:.5} x {:.5} mm where its side file says {} x {} mm; scale it by {}, or judge it as it is with \
             `as-placed`",
            name,
            size.x,
            size.y,
            bench.face_mm().x,
            bench.face_mm().y,
            shortest(1.0 / factor),
        ),
        source: None,
    })
}

/// A number with as many digits as it has.
fn shortest(value: f64) -> f64 {
    (1e9 * value).round() / 1e9
}

/// What it took to bring a block where it belongs, and what does the same to its file. `None` for
/// nothing.
fn in_words(name: &str, placed: &PlacedBlock, origin: DVec3, has_side_file: bool) -> Option<String> {
    let Placement { inside_out, turn, shift_mm } = placed.placement;
    let mut said = Vec::new();
    if inside_out {
        said.push(format!("all triangles of {name} face inwards, and were turned round"));
    }
    let mut steps = Vec::new();
    if let Some((axis, angle)) = placed.placement.axis_and_angle() {
        steps.push(format!("turned by {}", turn_in_words(axis, angle)));
    }
    // In the coordinates of the file.
    let shift = turn * origin + shift_mm - origin;
    if shift_mm != DVec3::ZERO {
        steps.push(format!("moved by {}", triple(shift)));
    }
    if !steps.is_empty() {
        let place = if has_side_file { "where its side file has it" } else { "on the axis as blocks do" };
        said.push(format!(
            "{name} does not stand {place}: {}, it does, and so it is judged (`as-placed` takes it as it stands)",
            steps.join(", then ")
        ));
    }
    let is_stl = name.to_ascii_lowercase().ends_with(".stl");
    if is_stl && !said.is_empty() {
        let (z, y, x) = glam::DQuat::from_mat3(&turn).to_euler(EulerRot::ZYX);
        let mut command = String::from("admesh --no-check");
        for (axis, angle) in [("x", x), ("y", y), ("z", z)] {
            if angle.abs() > 1e-9 {
                command += &format!(" --{axis}-rotate={}", shortest(angle.to_degrees()));
            }
        }
        if inside_out {
            command += " --reverse-all";
        }
        if !steps.is_empty() {
            let lower = placed.mesh.bounds().0 - origin;
            let [x, y, z] = lower.to_array().map(|value| (1e6 * value).round() / 1e6 + 0.0);
            command += &format!(" --translate={x},{y},{z}");
        }
        said.push(format!("this rights it: {command} --write-binary-stl=righted.stl {name}"));
    }
    (!said.is_empty()).then(|| said.join("; "))
}

fn turn_in_words(axis: DVec3, angle: f64) -> String {
    let degrees = (1e4 * angle.to_degrees()).round() / 1e4;
    for (along, name) in [(DVec3::X, "x"), (DVec3::Y, "y"), (DVec3::Z, "z")] {
        if axis.dot(along).abs() > 1.0 - 1e-9 {
            return format!("{} degrees about {name}", degrees * axis.dot(along).signum());
        }
    }
    format!("{degrees} degrees about ({:.4}, {:.4}, {:.4})", axis.x, axis.y, axis.z)
}

fn triple(v: DVec3) -> String {
    let [x, y, z] = v.to_array().map(|value| (1e3 * value).round() / 1e3 + 0.0);
    format!("({x}, {y}, {z}) mm")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_and_moves_are_said_in_few_words() {
        assert_eq!(turn_in_words(DVec3::X, std::f64::consts::FRAC_PI_2), "90 degrees about x");
        assert_eq!(turn_in_words(DVec3::NEG_Z, 10f64.to_radians()), "-10 degrees about z");
        let tilted = DVec3::new(0.6, 0.8, 0.0);
        assert_eq!(turn_in_words(tilted, 1f64.to_radians()), "1 degrees about (0.6000, 0.8000, 0.0000)");
        assert_eq!(triple(DVec3::new(-300.0, 1e-9, 50.0625)), "(-300, 0, 50.063) mm");
    }
}
