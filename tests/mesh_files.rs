//! Mesh files as people really have them: every kind that other programs write, and what becomes of
//! it.
//!
//! All are made here from one block. `tests/corpus/meshes.md` is the log: kind, where such files
//! come from, outcome; renewed with `GLASSWARP_BLESS=1 cargo test --release --test mesh_files`.

#[path = "mesh_files/gltf.rs"]
mod gltf;
#[path = "mesh_files/moved.rs"]
mod moved;
#[path = "mesh_files/packages.rs"]
mod packages;
#[path = "mesh_files/polygons.rs"]
mod polygons;
#[path = "mesh_files/stl.rs"]
mod stl;

use glam::DVec3;
use glasswarp::{
    bench::ExitFace,
    export::{self, Design},
    grid::{Extent, Field},
    solid::{Solid, Stock},
    surface::HeightField,
};
use glasswarp_verify::{
    Block, ExpectedPose, Mesh, PlacedBlock,
    load::{Format, parse},
};
use std::{fmt::Write as _, fs, path::Path};

/// What shall become of a file.
enum Outcome {
    /// The block as it was made, with nodes within this many millimetres.
    Block(f64),
    /// The same after it has been brought where it belongs: turned round, turned, moved.
    Righted(&'static str),
    /// The block seen in a mirror.
    Mirrored,
    /// An error with these words.
    Refused(&'static str),
}

struct Case {
    kind: String,
    /// Programs that write such files.
    from: &'static str,
    format: Format,
    bytes: Vec<u8>,
    outcome: Outcome,
}

fn case(kind: &str, from: &'static str, format: Format, bytes: impl Into<Vec<u8>>, outcome: Outcome) -> Case {
    Case { kind: kind.into(), from, format, bytes: bytes.into(), outcome }
}

/// Rounding to single precision, mm.
const EXACT: f64 = 2e-6;

/// The block that all files are of.
struct Original {
    solid: Solid,
    mesh: Mesh,
    block: Block,
}

impl Original {
    fn new() -> Self {
        let heights = (0..99).map(|k| 0.1 * f64::from(k % 11) + 0.05 * f64::from(7 * k % 31).sin()).collect();
        let surface = HeightField::new(Extent::new(20.0, 16.0), Field::from_vec(11, 9, heights));
        let solid = Solid::new(&surface, Stock::thinnest_sheet()).unwrap();
        let mesh = parse(Format::Stl, &exported(&solid, "stl")).unwrap();
        let block = Block::from_mesh(&mesh).unwrap();
        Self { solid, mesh, block }
    }

    fn exported(&self, extension: &str) -> Vec<u8> {
        exported(&self.solid, extension)
    }

    fn triangles(&self) -> Vec<[DVec3; 3]> {
        (0..self.mesh.triangles.len()).map(|k| self.mesh.corners(k)).collect()
    }

    fn stand(&self) -> ExpectedPose {
        ExpectedPose { face_mm: self.block.size_mm(), entry_z_mm: self.block.entry_z_mm() }
    }

    /// How far the nodes of a block are from those of this one, mm, at most; seen in a mirror if it
    /// is one.
    fn distance(&self, other: &Block, mirrored: bool) -> f64 {
        if other.nodes() != self.block.nodes() {
            return f64::INFINITY;
        }
        let (nx, _) = self.block.nodes();
        let place = |k: usize| if mirrored { k / nx * nx + nx - 1 - k % nx } else { k };
        let heights = (self.block.heights_mm(), other.heights_mm());
        let off = (0..heights.0.len()).map(|k| (heights.0[k] - heights.1[place(k)]).abs());
        let size = (self.block.size_mm() - other.size_mm()).abs().max_element();
        off.fold(size.max((self.block.entry_z_mm() - other.entry_z_mm()).abs()), f64::max)
    }
}

fn exported(solid: &Solid, extension: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("block.{extension}"));
    let design = Design { name: "block".into(), exit_face: ExitFace::Refracts { ior: 1.5 }, distance_mm: 250.0 };
    export::export(&path, solid, &design).unwrap();
    fs::read(path).unwrap()
}

/// What became of a file, in words; an error if it is something else than it should be.
fn judged(original: &Original, case: &Case) -> Result<String, String> {
    let stand = original.stand();
    let found = match parse(case.format, &case.bytes) {
        Ok(mesh) => PlacedBlock::find(mesh, Some(&stand)).map_err(|other| other.1.to_string()),
        Err(error) => Err(error.to_string()),
    };
    match (&case.outcome, found) {
        (Outcome::Refused(words), Err(said)) if said.contains(words) => Ok(format!("refused: {said}")),
        (Outcome::Block(within), Ok(placed)) => {
            let off = original.distance(&placed.block, false);
            let moved = placed.placement;
            if off <= *within && moved == glasswarp_verify::Placement::NONE {
                Ok("the block as it was made".into())
            } else {
                Err(format!("off by {off:.1e} mm, {moved:?}"))
            }
        }
        (Outcome::Righted(what), Ok(placed)) => {
            let half = placed.clone().turned_by_quarters(2, Some(&stand)).unwrap();
            let off = original.distance(&placed.block, false).min(original.distance(&half.block, false));
            if off <= 2e-5 && placed.placement != glasswarp_verify::Placement::NONE {
                Ok(format!("the block, {what}"))
            } else {
                Err(format!("off by {off:.1e} mm, {:?}", placed.placement))
            }
        }
        (Outcome::Mirrored, Ok(placed)) => {
            let off = original.distance(&placed.block, true);
            if off <= EXACT {
                Ok("the block in a mirror: its picture is diagnosed".into())
            } else {
                Err(format!("off by {off:.1e} mm"))
            }
        }
        (_, Ok(_)) => Err("taken".into()),
        (_, Err(said)) => Err(said),
    }
}

#[test]
fn every_kind_of_mesh_file_becomes_what_it_should() {
    let original = Original::new();
    let cases: Vec<Case> = [
        stl::cases(&original),
        polygons::cases(&original),
        gltf::cases(&original),
        packages::cases(&original),
        moved::cases(&original),
    ]
    .into_iter()
    .flatten()
    .collect();
    assert!(cases.len() >= 80, "{}", cases.len());
    let mut log = String::from(
        "# Mesh files and what becomes of them\n\nMade from one block by `tests/mesh_files.rs`, which judges each and renews this \
         page.\n\n| file | where such files come from | outcome |\n|---|---|---|\n",
    );
    let mut wrong = Vec::new();
    for case in &cases {
        match judged(&original, case) {
            Ok(outcome) => {
                writeln!(log, "| {:?}: {} | {} | {} |", case.format, case.kind, case.from, outcome.replace('|', "/"))
                    .unwrap();
            }
            Err(said) => wrong.push(format!("{:?}, {}: {said}", case.format, case.kind)),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/meshes.md");
    if std::env::var_os("GLASSWARP_BLESS").is_some() {
        fs::write(&path, &log).unwrap();
    }
    assert_eq!(fs::read_to_string(&path).unwrap(), log, "renew tests/corpus/meshes.md with GLASSWARP_BLESS=1");
}
