//! Opens the solid of a file and brings it where it belongs on its bench, and says what that took.

use super::{
    diagnosis,
    error::Failure,
    judge::{self, Examiner, Subject},
    side_file::{BenchRecord, SideFile},
};
use glam::{DVec3, EulerRot, Vec2Swizzles};
use glasswarp_verify::{
    Block, BlockError, ExpectedPose, Geometry, Image, Mesh, PlacedBlock, Placement, Scene, Surface, Traversal,
};
use std::path::Path;

/// How a file's coordinates are understood.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(crate) struct Placing {
    /// Take the block exactly as it stands in its file, wherever and however that is. Otherwise it is brought where its bench
    /// has it, with a warning
    #[arg(long)]
    pub(crate) as_placed: bool,
}

impl Placing {
    /// Blocks are brought where they belong.
    pub(crate) const RIGHTED: Self = Self { as_placed: false };
}

/// A solid, and what was found of its place.
pub(crate) struct Opened {
    pub(crate) subject: Subject,
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
    /// Opens a file and finds out what it holds.
    pub(crate) fn open(path: &Path, side: Option<&SideFile>, placing: Placing) -> Result<Self, Failure> {
        let (stand, origin) = expected(path, side);
        let placed = match find(path, side, placing)? {
            Ok(placed) => placed,
            Err((_, error @ BlockError::Unsound(_))) => return Err(judge::not_a_block(path, error)),
            Err((mesh, _)) => {
                let subject = Subject::Solid(Box::new(mesh));
                return Ok(Self { subject, suspicions: Vec::new(), moved: None, stand, origin });
            }
        };
        let suspicions = diagnosis::of_block(&placed.block, side.map(|side| &side.bench));
        let block = placed.block.clone().with_spline();
        let moved = (placed.placement != Placement::NONE).then(|| Box::new(placed));
        Ok(Self { subject: Subject::Block(Box::new(block)), suspicions, moved, stand, origin })
    }

    /// The solid, and everything that there is to say of its place. A block that had to be turned is turned on about the axis so that its
    /// picture is the right way up, as far as its outline allows: its shape alone does not tell.
    pub(crate) fn upright(
        self,
        path: &Path,
        scene: &Scene,
        target: Option<&Image>,
    ) -> Result<(Subject, Vec<String>), Failure> {
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
        let warnings = in_words(path, &placed, origin, stand.is_some()).into_iter().chain(suspicions).collect();
        Ok((subject, warnings))
    }
}

/// Opens a file that must hold a block, and brings it where it belongs; tells what that took, and what does not fit.
pub(crate) fn open_block(
    path: &Path,
    side: Option<&SideFile>,
    placing: Placing,
) -> Result<(Mesh, Block, Vec<String>), Failure> {
    let (stand, origin) = expected(path, side);
    let placed = find(path, side, placing)?.map_err(|(_, error)| judge::not_a_block(path, error))?;
    let mut warnings: Vec<String> = in_words(path, &placed, origin, stand.is_some()).into_iter().collect();
    warnings.extend(diagnosis::of_block(&placed.block, side.map(|side| &side.bench)));
    Ok((placed.mesh, placed.block, warnings))
}

/// Where a side file has its block, and from where the coordinates of this file of it are counted.
fn expected(path: &Path, side: Option<&SideFile>) -> (Option<ExpectedPose>, DVec3) {
    let stand = |side: &SideFile| ExpectedPose { face_mm: side.bench.face_mm(), entry_z_mm: side.bench.entry_z_mm };
    (side.map(stand), side.map_or(DVec3::ZERO, |side| side.origin_of(path)))
}

/// The block of a file, where it belongs or as it stands; or what else the file holds, and why that is no block.
fn find(
    path: &Path,
    side: Option<&SideFile>,
    placing: Placing,
) -> Result<Result<PlacedBlock, (Mesh, BlockError)>, Failure> {
    let (stand, origin) = expected(path, side);
    let mesh = judge::read(path)?.moved(origin);
    if placing.as_placed {
        return Ok(match Block::from_mesh(&mesh) {
            Ok(block) => Ok(PlacedBlock { mesh, block, placement: Placement::NONE }),
            Err(error) => Err((mesh, error)),
        });
    }
    let placed = PlacedBlock::find(mesh, stand.as_ref());
    if let (Ok(placed), Some(side)) = (&placed, side) {
        refuse_other_units(&placed.block, &side.bench, path)?;
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
            let seen = examiner.look(&subject, Surface::Spline, Geometry::Displaced).ok()?;
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

/// A block that is another unit's number of times as large as its side file says is another block to everyone who reads its file.
fn refuse_other_units(block: &Block, bench: &BenchRecord, path: &Path) -> Result<(), Failure> {
    let size = block.size_mm();
    let units = [size, size.yx()].into_iter().find_map(|size| diagnosis::unit_of(size / bench.face_mm()));
    let Some((factor, unit)) = units else { return Ok(()) };
    Err(Failure::InvalidMesh {
        what: format!(
            "{}: looks like {unit}: {:.5} x {:.5} mm where its side file says {} x {} mm; scale it by {}, or judge it as it is with \
             --as-placed",
            path.display(),
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

/// What it took to bring a block where it belongs, and what does the same to its file. `None` for nothing.
fn in_words(path: &Path, placed: &PlacedBlock, origin: DVec3, has_side_file: bool) -> Option<String> {
    let Placement { inside_out, turn, shift_mm } = placed.placement;
    let name = path.display();
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
            "{name} does not stand {place}: {}, it does, and so it is judged (--as-placed takes it as it stands)",
            steps.join(", then ")
        ));
    }
    let is_stl = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("stl"));
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
