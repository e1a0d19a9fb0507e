//! What a workshop gets, before programs that workshops use: FreeCAD, Gmsh and truck open the STEP
//! file, PrusaSlicer the 3MF, admesh the STL; and the verifier finds the same optical face in every
//! file and every shape of the block.

mod common;

use common::measured::{at_worst, nothing_but_rounding, within_tenth_of};
use glam::DVec2;
use glasswarp::{
    bench::ExitFace,
    export::{Design, Format, HeightMap, StepTolerance, choose_net, export, write_step},
    fabricate::{Cutter, tool_offset},
    grid::{Extent, Field},
    solid::{Origin, Rim, Shape, Solid, Stock},
    surface::{ControlNet, HeightField},
};
use glasswarp_verify::{Block, Image, Mesh, Scene, Surface, Tracer, Window, beams, load, metrics};
use std::{
    fs,
    io::BufWriter,
    path::{Path, PathBuf},
};
use tempfile::TempDir;

const DISTANCE_MM: f64 = 200.0;

/// Half a step of single precision at so many mm.
fn half_step(mm: f64) -> f64 {
    0.5 * f64::from(f32::EPSILON) * mm.abs()
}

/// A face that bends light by some millimetres, level across its border as that of a block whose
/// picture is as large as it.
fn face(nx: usize, ny: usize) -> HeightField {
    let extent = Extent::new(60.0, 40.0);
    let heights = Field::from_fn(nx, ny, |i, j| {
        let at = extent.node(i, j, nx, ny) / extent.as_vec() * std::f64::consts::PI;
        0.3 * at.x.sin() + 0.2 * (2.0 * at.x).cos() * (2.0 * at.y).cos() + 0.1 * (3.0 * at.y).sin()
    });
    HeightField::new(extent, heights)
}

fn design() -> Design {
    Design { name: "wave".to_owned(), exit_face: ExitFace::Refracts { ior: 1.49 }, distance_mm: DISTANCE_MM }
}

const RAISED: Rim = Rim { width_mm: 8.0, rise_mm: 1.5, mark_mm: Some(5.0) };
const FLANGE: Rim = Rim { width_mm: 10.0, rise_mm: -3.0, mark_mm: None };

/// Plain, with a rim above, with a flange below; each from another origin.
fn shapes() -> [(&'static str, Shape, usize); 4] {
    [
        ("plain", Shape::default(), 6),
        ("raised", Shape { rim: Some(RAISED), origin: Origin::Corner, skirt_mm: 0.0 }, 12),
        ("flange", Shape { rim: Some(FLANGE), origin: Origin::StockTop, skirt_mm: 0.0 }, 11),
        ("table", Shape { rim: None, origin: Origin::Entry, skirt_mm: 0.0 }, 6),
    ]
}

fn solid(surface: &HeightField, shape: Shape) -> Solid {
    Solid::shaped(surface, Stock::of_thickness(12.0), shape).unwrap()
}

/// A block with a sphere for its entry face, aside of the axis, that bulges towards the light or away
/// from it.
fn lens(surface: &HeightField, radius_mm: f64, origin: Origin) -> Solid {
    let (nodes, extent) = (surface.heights_mm(), surface.extent());
    let sphere = Field::from_fn(nodes.nx(), nodes.ny(), |i, j| {
        let at = extent.node(i, j, nodes.nx(), nodes.ny()) - DVec2::new(3.0, -2.0);
        -(radius_mm * radius_mm - at.length_squared()).sqrt().copysign(radius_mm)
    });
    let entry = HeightField::new(extent, sphere);
    Solid::between(surface, &entry, Stock::of_thickness(16.0), Shape { origin, ..Shape::default() }).unwrap()
}

fn lenses(surface: &HeightField) -> [(&'static str, Solid); 2] {
    [("lens", lens(surface, 120.0, Origin::Exit)), ("hollow", lens(surface, -90.0, Origin::Corner))]
}

/// The integral of a net over its face, mm³, by Simpson's rule.
fn under(net: &ControlNet) -> f64 {
    let (nx, ny) = (1201, 801);
    let weight = |k: usize, n: usize| if k == 0 || k == n - 1 { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
    let heights = net.sampled(nx, ny);
    let row = |j: usize| (0..nx).map(|i| weight(i, nx) * heights[(i, j)]).sum::<f64>();
    let sum: f64 = (0..ny).map(|j| weight(j, ny) * row(j)).sum();
    sum * net.extent().area_mm2() / (9 * (nx - 1) * (ny - 1)) as f64
}

/// STEP files of every shape, on a coarse net and on the net of all nodes, with their number of faces
/// and their volume, mm³.
struct StepFiles {
    folder: TempDir,
    files: Vec<(String, usize, f64)>,
}

impl StepFiles {
    fn write() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let surface = face(121, 81);
        let mut files = Vec::new();
        for (name, shape, faces) in shapes() {
            for (density, net) in
                [("coarse", ControlNet::fitted(&surface, (43, 33))), ("full", ControlNet::interpolating(&surface))]
            {
                let name = format!("{name}-{density}.step");
                let solid = solid(&surface, shape);
                let mut file = BufWriter::new(fs::File::create(folder.path().join(&name)).unwrap());
                write_step(&mut file, &solid, &net, None, &design()).unwrap();
                files.push((name, faces, solid.check().unwrap().volume_mm3));
            }
        }
        for (name, solid) in lenses(&surface) {
            let entry = solid.entry_surface().unwrap();
            for (density, net, below) in [
                ("coarse", ControlNet::fitted(&surface, (43, 33)), ControlNet::fitted(entry, (31, 28))),
                ("full", ControlNet::interpolating(&surface), ControlNet::interpolating(entry)),
            ] {
                let name = format!("{name}-{density}.step");
                let mut file = BufWriter::new(fs::File::create(folder.path().join(&name)).unwrap());
                // Without a net, the face is the spline through its nodes.
                write_step(&mut file, &solid, &net, Some(&below).filter(|_| density == "coarse"), &design()).unwrap();
                // Facets cut off what a dome bulges.
                files.push((name, 6, under(&net) - under(&below)));
            }
        }
        // A judge must be able to say no: the shell of this one has lost its entry face.
        let whole = fs::read_to_string(folder.path().join(&files[0].0)).unwrap();
        let shell = whole.find("CLOSED_SHELL('',(#").unwrap();
        let first = whole[shell..].find('#').unwrap() + shell;
        let comma = whole[first..].find(',').unwrap() + first;
        let open = format!("{}{}", &whole[..first], &whole[comma + 1..]);
        fs::write(folder.path().join("open.step"), open).unwrap();
        Self { folder, files }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Holds what a kernel says of every file (name, closed solids, faces, volume) against what was
    /// written.
    fn judge(&self, said: &str, kernel: &str) {
        let said: Vec<Vec<&str>> = said
            .lines()
            .filter_map(|line| line.split_once("JUDGED ").map(|(_, said)| said.split_whitespace().collect()))
            .collect();
        let of = |name: &str| said.iter().find(|words| words[0] == name).unwrap_or_else(|| panic!("{name}: {said:?}"));
        for (name, faces, wanted) in &self.files {
            let words = of(name);
            assert_eq!(words[1], "1", "{kernel}: {name} is no single valid closed solid: {words:?}");
            assert_eq!(words[2], faces.to_string(), "{kernel}: {name}");
            let volume: f64 = words[3].parse().unwrap();
            at_worst(
                2.1e-8,
                (volume / wanted - 1.0).abs(),
                format_args!("{kernel}: {name} has {volume} mm3 for {wanted} mm3"),
            );
        }
        assert_ne!(of("open.step")[1], "1", "{kernel} takes an open shell for a solid");
    }

    fn names(&self) -> Vec<String> {
        self.files.iter().map(|(name, ..)| name.clone()).chain(["open.step".to_owned()]).collect()
    }
}

#[test]
fn freecad_takes_the_step_file_for_one_valid_closed_solid_of_the_meshs_volume() {
    const SCRIPT: &str = "
import os, Part
for name in os.environ['NAMES'].split():
    shape = Part.Shape()
    shape.read(os.path.join(os.environ['FOLDER'], name))
    good = [s for s in shape.Solids if s.isValid() and s.isClosed() and all(k.isClosed() for k in s.Shells)]
    tight = all(e.Tolerance < 1e-6 for e in shape.Edges)
    print('\\nJUDGED', name, len(good) if shape.isValid() and tight else 0, len(shape.Faces), '%.9f' % shape.Volume, flush=True)
";
    let Some(mut freecad) = common::freecad(SCRIPT) else { return };
    let files = StepFiles::write();
    let said = common::output(freecad.env("FOLDER", files.folder.path()).env("NAMES", files.names().join(" ")));
    files.judge(&said, "FreeCAD");
}

#[test]
fn gmsh_takes_the_step_file_for_one_solid_of_the_meshs_volume() {
    const SCRIPT: &str = "
import gmsh, os, sys
gmsh.initialize()
gmsh.option.setNumber('General.Terminal', 0)
for path in sys.argv[1:]:
    gmsh.clear()
    gmsh.model.occ.importShapes(path)
    gmsh.model.occ.synchronize()
    solids = gmsh.model.getEntities(3)
    volume = gmsh.model.occ.getMass(3, solids[0][1]) if solids else 0
    print('JUDGED', os.path.basename(path), len(solids), len(gmsh.model.getEntities(2)), '%.9f' % volume)
";
    let Some(mut gmsh) = common::python(&["gmsh"], SCRIPT) else { return };
    let files = StepFiles::write();
    let paths = files.names().into_iter().map(|name| files.path(&name));
    files.judge(&common::output(gmsh.args(paths)), "Gmsh");
}

#[test]
fn a_kernel_that_is_not_opencascade_finds_the_same_closed_shell() {
    use truck_meshalgo::prelude::*;
    use truck_stepio::r#in::{Table, alias};
    use truck_topology::shell::ShellCondition;

    let files = StepFiles::write();
    let shell_of = |name: &str| {
        let text = fs::read_to_string(files.path(name)).unwrap();
        let exchange = ruststep::parser::parse(&text).unwrap();
        let table = Table::from_data_section(&exchange.data[0]);
        let holder = table.shell.values().next().expect("a shell").clone();
        table.to_compressed_shell(&holder).unwrap()
    };
    for (name, faces, wanted) in &files.files {
        let shell = shell_of(name);
        assert_eq!(shell.faces.len(), *faces, "{name}");
        let topology = truck_topology::Shell::<Point3, alias::Curve3D, alias::Surface>::extract(shell.clone()).unwrap();
        assert_eq!(topology.shell_condition(), ShellCondition::Closed, "{name}");
        // Its triangles stay within 0.005 mm of the faces, and are much nearer in the mean.
        let volume = shell.robust_triangulation(0.005).to_polygon().volume();
        let off_mm = (volume - wanted).abs() / 2400.0;
        // The facets of a dome all lie on one side of it.
        let most = if name.starts_with("lens") || name.starts_with("hollow") { 1.28e-3 } else { 1.02e-5 };
        at_worst(most, off_mm, format_args!("{name}: {volume} mm3 for {wanted} mm3"));
    }
    let open = truck_topology::Shell::<Point3, alias::Curve3D, alias::Surface>::extract(shell_of("open.step")).unwrap();
    assert_ne!(open.shell_condition(), ShellCondition::Closed);
}

/// `name = value` or `name : value` of a report.
fn figure(report: &str, name: &str) -> String {
    let line = report
        .lines()
        .find(|line| line.trim_start().starts_with(name))
        .unwrap_or_else(|| panic!("no {name} in {report}"));
    line.rsplit(['=', ':']).next().unwrap_or_default().trim().to_owned()
}

#[test]
fn prusa_slicer_finds_a_manifold_in_the_3mf_and_slices_it() {
    let Some(_) = common::program("prusa-slicer", "Debian package prusa-slicer") else { return };
    let run = |arguments: &[&Path]| {
        let mut slicer = common::program("prusa-slicer", "Debian package prusa-slicer").unwrap();
        common::output(slicer.env("LC_ALL", "C.UTF-8").args(arguments))
    };
    let folder = tempfile::tempdir().unwrap();
    let surface = face(61, 41);
    let plain = shapes().map(|(name, shape, _)| (name, solid(&surface, shape)));
    for (name, solid) in plain.into_iter().chain(lenses(&surface)) {
        for format in [Format::ThreeMf, Format::Stl] {
            let path = folder.path().join(format!("{name}.{format}"));
            export(&path, &solid, &design()).unwrap();
            let report = run(&[Path::new("--info"), &path]);
            assert_eq!(figure(&report, "manifold"), "yes", "{name}: {report}");
            assert_eq!(figure(&report, "number_of_facets"), solid.triangle_count().to_string());
            assert_eq!(figure(&report, "number_of_parts"), "1");
            let volume: f64 = figure(&report, "volume").parse().unwrap();
            // It sums in single precision.
            at_worst(1.23e-6, (volume / solid.volume_mm3() - 1.0).abs(), format_args!("{name}: {volume}"));
            let width: f64 = figure(&report, "size_x").parse().unwrap();
            assert_eq!(width, solid.stock_extent().width_mm, "{name}");
        }
    }
    let gcode = folder.path().join("plain.gcode");
    run(&[Path::new("-g"), Path::new("--output"), &gcode, &folder.path().join("plain.3mf")]);
    let sliced = fs::read_to_string(&gcode).unwrap();
    assert!(sliced.matches(";LAYER_CHANGE").count() > 30 || sliced.matches("G1 Z").count() > 30, "{}", sliced.len());
}

#[test]
fn admesh_finds_nothing_to_repair_in_any_shape() {
    let Some(_) = common::program("admesh", "Debian package admesh") else { return };
    let folder = tempfile::tempdir().unwrap();
    let surface = face(61, 41);
    let plain = shapes().map(|(name, shape, _)| (name, solid(&surface, shape)));
    for (name, solid) in plain.into_iter().chain(lenses(&surface)) {
        let path = folder.path().join("block.stl");
        export(&path, &solid, &design()).unwrap();
        let mut admesh = common::program("admesh", "Debian package admesh").unwrap();
        let report = common::output(admesh.arg(&path));
        for fault in
            ["Total disconnected facets", "Facets reversed", "Edges fixed", "Facets removed", "Degenerate facets"]
        {
            let figure = figure(&report, fault);
            assert_eq!(figure.split_whitespace().next(), Some("0"), "{name}: {fault}\n{report}");
        }
    }
}

fn read(path: &Path, origin: glam::DVec3) -> Mesh {
    load::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).moved(origin)
}

fn picture(block: &Block) -> Image {
    let window = Window { size_mm: DVec2::new(60.0, 40.0), centre_mm: DVec2::ZERO, nx: 96, ny: 64 };
    let scene = Scene { surface: Surface::Spline, ..Scene::new(1.49, DISTANCE_MM, window) };
    beams(&Tracer::for_block(block, &scene).unwrap(), 480, 320).image
}

#[test]
fn the_verifier_finds_the_same_face_and_picture_in_every_shape_and_format() {
    let folder = tempfile::tempdir().unwrap();
    let surface = face(121, 81);
    let mut plain: Option<Image> = None;
    for (name, shape, _) in shapes() {
        let solid = solid(&surface, shape);
        solid.check().unwrap_or_else(|fault| panic!("{name}: {fault}"));
        for format in Format::ALL {
            let path = folder.path().join(format!("{name}.{format}"));
            export(&path, &solid, &design()).unwrap();
            let block =
                Block::from_mesh(&read(&path, solid.origin_mm())).unwrap_or_else(|e| panic!("{name}.{format}: {e}"));
            assert_eq!(block.size_mm().round(), DVec2::new(60.0, 40.0), "{name}.{format}");
            at_worst(4.1e-7, (block.entry_z_mm() - solid.entry_z_mm()).abs(), format_args!("{name}.{format}: entry"));
            let (rim, wanted) = (block.rim_z_mm(), solid.rim_z_mm());
            assert_eq!(rim.is_some(), wanted.is_some(), "{name}.{format}");
            let off = rim.zip(wanted).map_or(0.0, |(a, b)| (a - b).abs());
            at_worst(2e-7, off, format_args!("{name}.{format}: rim"));
            if format != Format::Step {
                assert_eq!(block.nodes(), (121, 81), "{name}.{format}");
            }
            let seen = picture(&block);
            match &plain {
                // What f32 costs at another origin, and a coarser net: far below what any picture
                // shows.
                Some(plain) => {
                    let moved = metrics::compare(&seen, plain).unwrap().rel_rms;
                    at_worst(1.38e-3, moved, format_args!("{name}.{format} moves the light by"));
                }
                None => plain = Some(seen),
            }
        }
    }
}

#[test]
fn the_verifier_finds_both_faces_of_a_lens_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let surface = face(121, 81);
    for (name, solid) in lenses(&surface) {
        let proof = solid.check();
        assert!(proof.is_ok(), "{name}: {proof:?}");
        let mut first: Option<Image> = None;
        for format in Format::ALL {
            let path = folder.path().join(format!("{name}.{format}"));
            export(&path, &solid, &design()).unwrap();
            let block =
                Block::from_mesh(&read(&path, solid.origin_mm())).unwrap_or_else(|e| panic!("{name}.{format}: {e}"));
            let ((nx, ny), found) = block.entry_heights_mm().unwrap_or_else(|| panic!("{name}.{format} is planar"));
            let entry = solid.entry_surface().unwrap();
            let off = |found: &[f64], wanted: &HeightField| {
                let wanted = wanted.resampled(nx, ny);
                found.iter().zip(wanted.heights_mm().as_slice()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            if format != Format::Step {
                assert_eq!(((nx, ny), block.nodes()), ((121, 81), (121, 81)), "{name}.{format}");
                at_worst(1.3e-6, off(found, entry), format_args!("{name}.{format}: entry face"));
                at_worst(1.3e-6, off(block.heights_mm(), &surface), format_args!("{name}.{format}: exit face"));
            } else {
                at_worst(1e-4, off(found, entry), format_args!("{name}.{format}: entry face"));
            }
            // The net of a STEP file has other nodes.
            let most = if format == Format::Step { 3.64e-3 } else { 1e-6 };
            at_worst(most, (block.min_thickness_mm() - solid.thinnest_mm()).abs(), format_args!("{name}.{format}"));
            let seen = picture(&block);
            match &first {
                Some(first) => {
                    let moved = metrics::compare(&seen, first).unwrap().rel_rms;
                    // The nets of both faces of a strong lens.
                    let most = if format == Format::Step { 5.71e-3 } else { 1.38e-3 };
                    at_worst(most, moved, format_args!("{name}.{format} moves the light by"));
                }
                None => first = Some(seen),
            }
        }
    }
}

#[test]
fn the_step_face_is_read_back_as_it_was_fitted() {
    let folder = tempfile::tempdir().unwrap();
    let surface = face(121, 81);
    let solid = solid(&surface, Shape { rim: None, origin: Origin::Corner, skirt_mm: 0.0 });
    for (points, samples) in [((43, 33), (81, 61)), ((121, 81), (121, 81))] {
        let net = ControlNet::fitted(&surface, points);
        let path = folder.path().join("block.step");
        write_step(&mut fs::File::create(&path).unwrap(), &solid, &net, None, &design()).unwrap();
        let block = Block::from_mesh(&read(&path, solid.origin_mm())).unwrap();
        assert_eq!(block.nodes(), samples);
        let wanted = net.sampled(samples.0, samples.1);
        let worst = block.heights_mm().iter().zip(wanted.as_slice()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Nine decimals, in a sum of sixteen.
        at_worst(4.6e-10, worst, format_args!("{points:?}, mm"));
    }
}

#[test]
fn walls_lower_than_the_border_is_steep_are_read_back_too() {
    let extent = Extent::new(60.0, 40.0);
    let steep = Field::from_fn(61, 41, |i, j| 3.0 * (0.2 * i as f64).sin() * (0.11 * j as f64).cos());
    let surface = HeightField::new(extent, steep);
    let rim = Some(Rim { width_mm: 5.0, rise_mm: 0.06, mark_mm: None });
    let solid = Solid::shaped(&surface, Stock::of_thickness(16.0), Shape { rim, origin: Origin::Entry, skirt_mm: 0.0 })
        .unwrap();
    let path = tempfile::tempdir().unwrap();
    let path = path.path().join("steep.step");
    write_step(&mut fs::File::create(&path).unwrap(), &solid, &ControlNet::interpolating(&surface), None, &design())
        .unwrap();
    let block = Block::from_mesh(&read(&path, solid.origin_mm())).unwrap();
    assert_eq!(block.nodes(), (61, 41));
    at_worst(1.3e-10, (block.rim_z_mm().unwrap() - solid.rim_z_mm().unwrap()).abs(), "the rim, mm");
}

#[test]
fn a_tolerance_gives_the_coarsest_net_that_keeps_it() {
    // With 10 nm of roughness that no fit follows.
    let smooth = face(201, 133);
    let rough = Field::from_fn(201, 133, |i, j| {
        smooth.heights_mm()[(i, j)] + 1e-5 * ((i * 7919 + j * 104_729 + i * j) % 1009) as f64 / 1009.0
    });
    let surface = HeightField::new(smooth.extent(), rough);
    let points = |tolerance| {
        let fit = choose_net(&surface, tolerance, &design()).unwrap();
        (fit.net.points().0, 1e3 * fit.error.greatest_mm)
    };
    let mut last = 0;
    for um in [10.0, 1.0, 0.1, 1e-4] {
        let (points, error) = points(StepTolerance::Micrometres(um));
        assert!(error <= um && points >= last, "{um} um: {points} points, {error} um");
        last = points;
    }
    assert_eq!(last, 201, "1e-4 um needs all nodes");
    for um in [0.0, -1.0, 1e-6, f64::NAN, 1e9] {
        let error = choose_net(&surface, StepTolerance::Micrometres(um), &design()).unwrap_err().to_string();
        assert!(error.contains(&format!("the tolerance of the STEP face is {um} um")), "{error}");
    }
}

#[test]
fn height_maps_give_the_heights_back_within_their_resolution() {
    let folder = tempfile::tempdir().unwrap();
    let surface = face(91, 61);
    let solid = solid(&surface, Shape { rim: Some(FLANGE), origin: Origin::Corner, skirt_mm: 0.0 });
    let heights = surface.heights_mm().as_slice();
    let half_level = 0.5 * surface.relief_mm() / 65535.0;
    for (name, tolerance) in [("map.png", 1.0001 * half_level), ("map.exr", half_step(surface.relief_mm()))] {
        let path = folder.path().join(name);
        HeightMap::of(&solid).write(&path).unwrap();
        let block = Block::from_mesh(&load::read(&path).unwrap()).unwrap();
        assert_eq!(block.nodes(), (91, 61));
        nothing_but_rounding((block.size_mm() - DVec2::new(60.0, 40.0)).abs().max_element(), name);
        nothing_but_rounding(block.entry_z_mm() - solid.entry_z_mm(), name);
        let worst = block.heights_mm().iter().zip(heights).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst <= tolerance, "{name}: {worst} mm");
        // Equal maps are equal files.
        let again = folder.path().join(format!("again.{name}"));
        HeightMap::of(&solid).write(&again).unwrap();
        assert!(fs::read(&again).unwrap() == fs::read(&path).unwrap(), "{name}");
    }
    let layer = exr::prelude::read_first_flat_layer_from_file(folder.path().join("map.exr")).unwrap().layer_data;
    let entries = HeightMap::of(&solid).entries();
    assert_eq!(layer.attributes.other.len(), entries.len());
    for (name, value) in entries {
        let found = layer.attributes.other.get(&exr::prelude::Text::from(name));
        assert_eq!(found, Some(&exr::prelude::AttributeValue::Text(value.as_str().into())), "{name}");
    }
    // What people read: the size to type, the orientation, the meaning of black and white.
    let file = fs::File::open(folder.path().join("map.png")).unwrap();
    let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let text = |name: &str| {
        let chunks = &reader.info().uncompressed_latin1_text;
        chunks.iter().find(|chunk| chunk.keyword == name).unwrap_or_else(|| panic!("no {name}")).text.clone()
    };
    assert_eq!(text("Heights"), "the face itself");
    assert!(text("Orientation").contains("left is -x, top is +y; white is high"));
    let number = |name: &str| text(name).parse::<f64>().unwrap();
    nothing_but_rounding(number("WidthMm") - 60.0 * 91.0 / 90.0, "WidthMm");
    nothing_but_rounding(number("DepthMm") - surface.relief_mm(), "DepthMm");
    let (_, high) = surface.heights_mm().min_max();
    nothing_but_rounding(number("WhiteZMm") - high, "WhiteZMm");
    at_worst(1.72e-7, number("WhiteBelowStockTopMm"), "WhiteBelowStockTopMm");
    let dimensions = reader.info().pixel_dims.unwrap();
    assert_eq!((dimensions.xppu, dimensions.unit), (1500, png::Unit::Meter));
}

#[test]
fn height_maps_for_a_cutter_give_its_tips_back() {
    let folder = tempfile::tempdir().unwrap();
    // A dome of radius 80 mm: the centre of a ball that touches it moves on a sphere of 80 mm and
    // its radius.
    let (extent, (nx, ny)) = (Extent::new(40.0, 30.0), (161, 121));
    let dome = |r: f64| move |i, j| (r * r - extent.node(i, j, nx, ny).length_squared()).sqrt();
    let surface = HeightField::new(extent, Field::from_fn(nx, ny, dome(80.0)));
    let solid = solid(&surface, Shape { rim: None, origin: Origin::Exit, skirt_mm: 0.0 });
    for text in ["ball:d6mm", "bull:d6mm,r1mm"] {
        let cutter: Cutter = text.parse().unwrap();
        let tips = tool_offset(&surface, cutter);
        let map = HeightMap::of_tips(&solid, cutter);
        assert!(map.entries().iter().any(|(name, value)| *name == "Heights" && value.contains(&cutter.in_words())));
        let (low, high) = map.range_mm();
        for (name, tolerance) in
            [("tips.png", 0.500_05 * (high - low) / 65535.0), ("tips.exr", half_step(high.max(-low)))]
        {
            let path = folder.path().join(name);
            map.write(&path).unwrap();
            let read = Block::from_mesh(&load::read(&path).unwrap()).unwrap();
            let pairs = read.heights_mm().iter().zip(tips.as_slice());
            let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst <= tolerance, "{text}, {name}: {worst} mm");
        }
    }
    let tips = tool_offset(&surface, Cutter::ball(3.0).unwrap());
    let zero = surface.heights_mm()[(nx / 2, ny / 2)] - 80.0;
    for (i, j) in [(80, 60), (40, 60), (100, 30), (130, 100)] {
        let wanted = zero + dome(83.0)(i, j) - 3.0;
        // Newton's iteration stops there.
        assert!((tips[(i, j)] - wanted).abs() < 1e-9, "({i}, {j}): {} for {wanted}", tips[(i, j)]);
    }
}

#[test]
fn a_rim_above_the_face_stops_the_light_that_would_hit_it() {
    // A ramp: light leaves it sideways, and what leaves near the rim runs into it.
    const BEAMS: usize = 4000;
    let extent = Extent::new(40.0, 30.0);
    let ramp = HeightField::new(extent, Field::from_fn(9, 9, |i, _| 0.25 * 5.0 * i as f64));
    let lost = |rise_mm: f64| {
        let shape =
            Shape { rim: Some(Rim { width_mm: 5.0, rise_mm, mark_mm: None }), origin: Origin::Exit, skirt_mm: 0.0 };
        let solid = Solid::shaped(&ramp, Stock::of_thickness(40.0), shape).unwrap();
        let path = tempfile::tempdir().unwrap();
        let path = path.path().join("ramp.stl");
        export(&path, &solid, &design()).unwrap();
        let block = Block::from_mesh(&load::read(&path).unwrap()).unwrap();
        let window = Window { size_mm: DVec2::splat(400.0), centre_mm: DVec2::ZERO, nx: 64, ny: 64 };
        beams(&Tracer::for_block(&block, &Scene::new(1.49, 200.0, window)).unwrap(), BEAMS, 8).flux.side
    };
    assert_eq!(lost(-12.0), 0.0);
    // Refraction at slope 1/4: sin b = 1.49 sin a, deflected by b - a towards the high side. At x
    // mm from the wall there the plane of the rim (rise 1) is 1 + x/4 above the face: what starts
    // nearer than its way there is lost.
    let a = 0.25_f64.atan();
    let per_mm = ((1.49 * a.sin()).asin() - a).tan();
    let x = per_mm / (1.0 - 0.25 * per_mm);
    // Of one of the 4000 beams a part falls to either side.
    at_worst(0.448, (lost(1.0) - x / 40.0).abs() * BEAMS as f64, format_args!("{} for {}", lost(1.0), x / 40.0));
}

#[test]
fn freecads_path_workbench_mills_the_step_file() {
    let Some(_) = common::program("freecadcmd", "Debian package freecad") else { return };
    let where_is = "import opencamlib, os; print(os.path.dirname(os.path.dirname(opencamlib.__file__)))";
    let Some(mut python) = common::python(&["opencamlib"], where_is) else { return };
    let packages = common::output(&mut python);
    let folder = tempfile::tempdir().unwrap();
    let surface = face(61, 41);
    let (block, gcode) = (folder.path().join("wave.step"), folder.path().join("wave.ngc"));
    let solid = solid(&surface, Shape { rim: None, origin: Origin::StockTop, skirt_mm: 0.0 });
    export(&block, &solid, &design()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/freecad/mill_block.py");
    let mut freecad = common::freecad(&format!("exec(open({script:?}).read())")).unwrap();
    let said = common::output(freecad.envs([("BLOCK", &block), ("GCODE", &gcode)]).envs([
        ("OCL", packages.trim()),
        ("CUTTER", "3"),
        ("STEPOVER", "2"),
        ("SAMPLE", "2"),
    ]));
    assert!(said.contains("BLOCK wave 60.0000 x 40.0000 x 12.000") && said.contains("6 faces"), "{said}");
    // A ball that touches nothing but the face stays between its lowest and highest place.
    let (mut moves, mut low, mut high) = (0, f64::INFINITY, f64::NEG_INFINITY);
    for line in fs::read_to_string(&gcode).unwrap().lines().filter(|line| line.starts_with("G1")) {
        if let Some(z) = line.split_whitespace().find_map(|word| word.strip_prefix('Z')) {
            let z: f64 = z.parse().unwrap();
            (low, high) = (low.min(z), high.max(z));
            moves += 1;
        }
    }
    within_tenth_of(803.0, f64::from(moves), "moves");
    // The depth is bounded by FreeCAD's box around the face, which is a little larger than it.
    assert!(high <= 0.0, "{high} mm above the face");
    at_worst(1.3e-3, -high, "below its highest place, mm");
    at_worst(1.19e-3, (-low / surface.relief_mm() - 1.0).abs(), format_args!("{low} mm: the hollows"));
}
