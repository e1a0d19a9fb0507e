//! STEP files of blocks that are not rectangular: a face that its outline trims, before FreeCAD,
//! Gmsh, truck and the verifier.

mod common;

use common::measured::{at_worst, prints_within_tenth_of};
use common::workshop::{FINE, MESH, Workshop};
use glam::{DVec2, DVec3};
use glasswarp::{
    bench::ExitFace,
    export::{Design, StepTolerance, choose_net, write_step},
    grid::{Contour, Extent, Field, Outline},
    solid::{Origin, Rim, Shape, Solid, Stock},
    surface::{ControlNet, HeightField},
};
use glasswarp_verify::{Block, End, Mesh, Scene, Tracer, Window, beams, load, solid};
use std::{
    f64::consts::PI,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};
use tempfile::TempDir;

const DISTANCE_MM: f64 = 150.0;

/// A wavy face, whose nodes beyond the outline are as a solver leaves them.
fn face(extent: Extent, outline: Outline, (nx, ny): (usize, usize)) -> HeightField {
    let h = |p: DVec2| 0.3 * (0.31 * p.x).sin() * (0.27 * p.y + 0.4).cos() - 0.004 * p.length_squared();
    let (contour, near) = (outline.within(extent), 1.5 * extent.node_spacing(nx, ny).max_element());
    let is_near = |p: DVec2| (0..16).any(|k| contour.contains(p + near * DVec2::from_angle(f64::from(k) * 0.125 * PI)));
    let height = |p: DVec2| if is_near(p) { h(p) } else { f64::NAN };
    HeightField::outlined(extent, outline, Field::from_fn(nx, ny, |i, j| height(extent.node(i, j, nx, ny))))
}

fn design() -> Design {
    Design { name: "wave".to_owned(), exit_face: ExitFace::Refracts { ior: 1.5 }, distance_mm: DISTANCE_MM }
}

/// A written file and what it was made of.
struct Written {
    name: String,
    solid: Solid,
    net: ControlNet,
    faces: usize,
    /// Area of the plan around the exit face, mm².
    rim_mm2: f64,
}

struct Files {
    folder: TempDir,
    files: Vec<Written>,
}

impl Files {
    /// Every kind of outline, on the net of all nodes and on a coarse one, from every origin; with
    /// a rim and without.
    fn write() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (square, wide) = (Extent::new(40.0, 40.0), Extent::new(50.0, 36.0));
        let raised = Rim { width_mm: 6.0, rise_mm: 1.0, mark_mm: Some(3.0) };
        let flange = Rim { width_mm: 5.0, rise_mm: -4.5, mark_mm: None };
        // A disc of 26 mm less what the mark cuts off, about the face; and a rectangle with corners
        // of 11.3 mm about one with 6.3 mm.
        let flat = 26.0 - 3.0 * std::f64::consts::FRAC_1_SQRT_2;
        let segment = 676.0 * (flat / 26.0).acos() - flat * (676.0 - flat * flat).sqrt();
        let corners = (4.0 - PI) * (11.3 * 11.3 - 6.3 * 6.3);
        let (plain, around_disc, around_rounded) =
            (0.0, PI * (676.0 - 400.0) - segment, 60.0 * 46.0 - 50.0 * 36.0 - corners);
        let mut files = Vec::new();
        for (name, extent, outline, origin, rim, faces, rim_mm2) in [
            ("disc", square, Outline::Circle, Origin::Exit, None, 6, plain),
            ("lying", wide, Outline::Circle, Origin::Corner, None, 6, plain),
            ("standing", Extent::new(36.0, 50.0), Outline::Circle, Origin::Entry, None, 6, plain),
            ("rounded", wide, Outline::Rounded { radius_mm: 6.3 }, Origin::StockTop, None, 10, plain),
            ("stadium", wide, Outline::Rounded { radius_mm: 18.0 }, Origin::Exit, None, 8, plain),
            ("raised", square, Outline::Circle, Origin::Corner, Some(raised), 13, around_disc),
            ("flange", wide, Outline::Rounded { radius_mm: 6.3 }, Origin::Exit, Some(flange), 19, around_rounded),
        ] {
            let surface = face(extent, outline, (61, 45));
            let shape = Shape { origin, rim, ..Shape::default() };
            let solid = Solid::shaped(&surface, Stock::of_thickness(12.0), shape).unwrap();
            let nets =
                [("coarse", ControlNet::fitted(&surface, (23, 20))), ("full", ControlNet::interpolating(&surface))];
            for (density, net) in nets {
                let name = format!("{name}-{density}.step");
                let mut bytes = Vec::new();
                write_step(&mut bytes, &solid, &net, None, &design()).unwrap();
                fs::write(folder.path().join(&name), bytes).unwrap();
                files.push(Written { name, solid: solid.clone(), net, faces, rim_mm2 });
            }
        }
        Self { folder, files }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn names(&self) -> String {
        self.files.iter().map(|file| file.name.as_str()).collect::<Vec<_>>().join(" ")
    }

    /// Holds what a kernel says of every file (name, closed solids, faces, volume) against what was
    /// written; returns what else it says.
    fn judge<'a>(&'a self, said: &'a str, kernel: &str) -> Vec<(&'a Written, Vec<&'a str>)> {
        let said: Vec<Vec<&str>> = said
            .lines()
            .filter_map(|line| line.split_once("JUDGED ").map(|(_, said)| said.split_whitespace().collect()))
            .collect();
        self.files
            .iter()
            .map(|file| {
                let name = &file.name;
                let words = said.iter().find(|words| words[0] == name).unwrap_or_else(|| panic!("{name}: {said:?}"));
                assert_eq!(words[1], "1", "{kernel}: {name} is no single valid closed solid: {words:?}");
                assert_eq!(words[2], file.faces.to_string(), "{kernel}: {name}");
                let (volume, wanted) = (words[3].parse::<f64>().unwrap(), file.volume_mm3());
                at_worst(
                    7.2e-7,
                    (volume / wanted - 1.0).abs(),
                    format_args!("{kernel}: {name} has {volume} mm3 for {wanted} mm3"),
                );
                (file, words[4..].to_vec())
            })
            .collect()
    }
}

/// Places and weights of Gauss and Legendre's rule with five points on an interval, cut into 100.
fn rule(from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
    const POINTS: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let half = 0.5 * (to - from) / 100.0;
    (0..100).flat_map(move |k| {
        let middle = from + half * f64::from(2 * k + 1);
        POINTS.map(|(at, weight)| (middle + half * at, half * weight))
    })
}

impl Written {
    /// The volume between the net, or the rim, and the entry face, by quadrature over the chords of
    /// the outline. Where corners are round, the angle takes the ordinate's place: in it chords
    /// have no vertical tangents.
    fn volume_mm3(&self) -> f64 {
        let contour = self.solid.contour().unwrap();
        let (half, radius) = (0.5 * contour.extent().height_mm, contour.radius_mm().y);
        let strip = |y: f64| -> f64 {
            let end = contour.half_width_mm(y);
            rule(-end, end)
                .map(|(x, weight)| weight * (self.net.sample(DVec2::new(x, y)).0 - self.solid.entry_z_mm()))
                .sum()
        };
        let middle: f64 = rule(radius - half, half - radius).map(|(y, weight)| weight * strip(y)).sum();
        let ends: f64 = rule(0.0, 0.5 * PI)
            .map(|(angle, weight)| {
                let y = half - radius + radius * angle.sin();
                weight * radius * angle.cos() * (strip(y) + strip(-y))
            })
            .sum();
        let rim_mm = self.solid.rim_z_mm().map_or(0.0, |z| z - self.solid.entry_z_mm());
        middle + ends + self.rim_mm2 * rim_mm
    }

    /// Places of the plan, from the middle to beyond the outline.
    fn places(&self, count: u32) -> impl Iterator<Item = DVec2> + use<> {
        let size = self.solid.extent().as_vec();
        (0..count).map(move |k| {
            let share = |step: f64| (f64::from(k) * step).fract() - 0.5;
            size * DVec2::new(share(0.754_877_666), share(0.569_840_290))
        })
    }
}

/// Whether the curve passes within 0.01 mm.
fn near_the_curve(contour: &Contour, at: DVec2) -> bool {
    let here = contour.contains(at);
    (0..8).any(|k| contour.contains(at + 0.01 * DVec2::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_4)) != here)
}

#[test]
fn freecad_takes_it_for_one_valid_closed_solid_and_its_exit_face_for_the_spline() {
    const SCRIPT: &str = "
import os, FreeCAD, Part
for name in os.environ['NAMES'].split():
    shape = Part.Shape()
    shape.read(os.path.join(os.environ['FOLDER'], name))
    good = [s for s in shape.Solids if s.isValid() and s.isClosed() and all(k.isClosed() for k in s.Shells)]
    tight = all(e.Tolerance < 1e-6 for e in shape.Edges) and all(v.Tolerance < 1e-6 for v in shape.Vertexes)
    face = [f for f in shape.Faces if type(f.Surface).__name__ == 'BSplineSurface'][0]
    (u0, u1, v0, v1), surface = face.Surface.bounds(), face.Surface
    low, high = surface.value(u0, v0), surface.value(u1, v1)
    off, wrong = 0, 0
    for line in open(os.path.join(os.environ['FOLDER'], name + '.txt')):
        x, y, z, inside = line.split()
        at = FreeCAD.Vector(float(x), float(y), float(z))
        u = u0 + (u1 - u0) * (at.x - low.x) / (high.x - low.x)
        v = v0 + (v1 - v0) * (at.y - low.y) / (high.y - low.y)
        off = max(off, (surface.value(u, v) - at).Length)
        wrong += face.isPartOfDomain(u, v) != (inside == 'true')
    print('\\nJUDGED', name, len(good) if shape.isValid() and tight else 0, len(shape.Faces), '%.9f' % shape.Volume, '%.3e' % off, wrong,
          sorted(set(type(f.Surface).__name__ for f in shape.Faces)), flush=True)
    shape.exportStep(os.path.join(os.environ['FOLDER'], 'again-' + name))
";
    let Some(mut freecad) = common::freecad(SCRIPT) else { return };
    let files = Files::write();
    for file in &files.files {
        let contour = file.solid.contour().unwrap();
        let mut points = String::new();
        for at in file.places(100).filter(|&at| !near_the_curve(&contour, at)) {
            let [x, y, z] = (at.extend(file.net.sample(at).0) - file.solid.origin_mm()).to_array();
            writeln!(points, "{x:?} {y:?} {z:?} {}", contour.contains(at)).unwrap();
        }
        fs::write(files.path(&format!("{}.txt", file.name)), points).unwrap();
    }
    let said = common::output(freecad.env("FOLDER", files.folder.path()).env("NAMES", files.names()));
    for (file, words) in files.judge(&said, "FreeCAD") {
        let off: f64 = words[0].parse().unwrap();
        // Nine decimals.
        at_worst(5.74e-10, off, format_args!("{}: a point of the spline beside the face, mm", file.name));
        assert_eq!(words[1], "0", "{}: points within the outline and beyond it are taken for the other", file.name);
        let round = file.solid.contour().unwrap().radius_mm();
        let wall = if round.x == round.y { "'Cylinder'" } else { "'SurfaceOfExtrusion'" };
        assert!(words[2..].concat().contains(wall), "{}: {words:?}", file.name);
        // What FreeCAD writes of it is the same block to the verifier.
        let [ours, theirs] =
            [file.name.clone(), format!("again-{}", file.name)].map(|name| read(&files.path(&name), file));
        let (ours, theirs) = (Block::from_mesh(&ours).unwrap(), Block::from_mesh(&theirs).unwrap());
        assert_eq!(ours.nodes(), theirs.nodes());
        assert!(ours.heights_mm() == theirs.heights_mm(), "{}", file.name);
    }
}

#[test]
fn gmsh_takes_it_for_one_solid_and_fills_it_with_tetrahedra() {
    const SCRIPT: &str = "
import gmsh, os, sys
gmsh.initialize()
gmsh.option.setNumber('General.Terminal', 0)
gmsh.option.setNumber('Mesh.MeshSizeMax', 4)
for path in sys.argv[1:]:
    gmsh.clear()
    gmsh.model.occ.importShapes(path)
    gmsh.model.occ.synchronize()
    solids = gmsh.model.getEntities(3)
    volume = gmsh.model.occ.getMass(3, solids[0][1]) if solids else 0
    gmsh.model.mesh.generate(3)
    elements = gmsh.model.mesh.getElementsByType(4)[0]
    sizes = gmsh.model.mesh.getElementQualities(elements, 'volume')
    print('JUDGED', os.path.basename(path), len(solids), len(gmsh.model.getEntities(2)), '%.9f' % volume, min(sizes), sum(sizes))
";
    let Some(mut gmsh) = common::python(&["gmsh"], SCRIPT) else { return };
    let files = Files::write();
    let said = common::output(gmsh.args(files.files.iter().map(|file| files.path(&file.name))));
    for (file, words) in files.judge(&said, "Gmsh") {
        let [least, sum]: [f64; 2] = [words[0].parse().unwrap(), words[1].parse().unwrap()];
        // Chords of 4 mm on a circle of 20 mm, or on ends twice as sharp.
        let share = sum / file.volume_mm3();
        assert!(least > 0.0, "{}: {least}", file.name);
        at_worst(5.75e-3, (share - 1.0).abs(), format_args!("{}: {share} of the volume", file.name));
    }
}

#[test]
fn a_kernel_that_is_not_opencascade_finds_the_same_closed_shell() {
    use truck_stepio::r#in::{Table, alias};
    use truck_topology::shell::ShellCondition;

    let files = Files::write();
    for file in &files.files {
        let text = fs::read_to_string(files.path(&file.name)).unwrap();
        let exchange = ruststep::parser::parse(&text).unwrap();
        let table = Table::from_data_section(&exchange.data[0]);
        let holder = table.shell.values().next().expect("a shell").clone();
        let shell = table.to_compressed_shell(&holder).unwrap();
        assert_eq!(shell.faces.len(), file.faces, "{}", file.name);
        let topology =
            truck_topology::Shell::<truck_meshalgo::prelude::Point3, alias::Curve3D, alias::Surface>::extract(shell)
                .unwrap();
        assert_eq!(topology.shell_condition(), ShellCondition::Closed, "{}", file.name);
    }
}

/// A file in the library's frame.
fn read(path: &Path, file: &Written) -> Mesh {
    load::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).moved(file.solid.origin_mm())
}

/// Where straight light lands that leaves the net above this point.
fn landing(net: &ControlNet, at: DVec2) -> DVec2 {
    let (height, slope) = net.sample(at);
    let normal = (-slope).extend(1.0).normalize();
    let refracted = 1.5 * DVec3::Z + ((1.0 - 2.25 * (1.0 - normal.z * normal.z)).sqrt() - 1.5 * normal.z) * normal;
    at + refracted.truncate() * ((DISTANCE_MM - height) / refracted.z)
}

#[test]
fn the_verifier_traces_the_spline_itself_up_to_the_outline() {
    let files = Files::write();
    for file in &files.files {
        let name = &file.name;
        let mesh = read(&files.path(name), file);
        let report = solid::check(&mesh);
        assert!(report.is_sound(), "{name}: {report}");
        let block = Block::from_mesh(&mesh).unwrap();
        // What triangles on cells of this size miss of the face: a twelfth of its second
        // derivatives, 0.067 per mm in all.
        let cell = block.size_mm() / DVec2::new((block.nodes().0 - 1) as f64, (block.nodes().1 - 1) as f64);
        let missed = 0.067 / 12.0 * cell.max_element().powi(2) * file.solid.contour().unwrap().area_mm2();
        let off = (report.volume_mm3 - file.volume_mm3()).abs();
        at_worst(0.448, off / missed, format_args!("{name}: {off} of {} mm3, {missed} expected", file.volume_mm3()));
        let (contour, size) = (file.solid.contour().unwrap(), file.solid.extent().as_vec());
        assert!(!block.is_rectangular());
        assert_eq!(block.size_mm(), size, "{name}");
        at_worst(4.78e-10, (block.entry_z_mm() - file.solid.entry_z_mm()).abs(), format_args!("{name}: entry, mm"));
        let (rim, wanted) = (block.rim_z_mm(), file.solid.rim_z_mm());
        assert_eq!(rim.is_some(), wanted.is_some(), "{name}");
        at_worst(3.3e-10, rim.zip(wanted).map_or(0.0, |(a, b)| (a - b).abs()), format_args!("{name}: rim, mm"));
        // Light that a rim is in the way of ends there.
        let is_free = wanted.is_none_or(|z| z < file.solid.surface().range_mm().0);
        let (nx, ny) = block.nodes();
        let wanted = file.net.sampled(nx, ny);
        let pairs = block.heights_mm().iter().zip(wanted.as_slice());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Nine decimals, in a sum of sixteen.
        at_worst(4.8e-10, worst, format_args!("{name}: heights, mm"));
        let window = Window { size_mm: 2.0 * size, centre_mm: DVec2::ZERO, nx: 40, ny: 40 };
        let tracer = Tracer::for_block(&block, &Scene::new(1.5, DISTANCE_MM, window)).unwrap();
        let mut inside = 0;
        for at in file.places(2000).filter(|&at| !near_the_curve(&contour, at)) {
            assert_eq!(block.covers(at), contour.contains(at), "{name} at {at}");
            if contour.contains(at) && is_free {
                let End::Receiver(got) = tracer.path(at).end else { panic!("{name}: no landing at {at}") };
                let off = (got - landing(&file.net, at)).length();
                at_worst(9.5e-8, off, format_args!("{name} at {at}, mm"));
                inside += 1;
            }
        }
        let share = f64::from(inside) / 2000.0 / contour.share_of_extent();
        assert!(!is_free || (0.98..1.02).contains(&share), "{name}: {share} of the places are on the face");
        let seen = beams(&tracer, 200, 200);
        assert!(seen.flux.beside == 0.0 && (seen.flux.lost == 0.0 || !is_free), "{name}: {:?}", seen.flux);
    }
}

#[test]
fn the_net_may_be_coarser_where_there_is_no_glass() {
    let extent = Extent::new(60.0, 60.0);
    let smooth = |p: DVec2| 0.01 * p.x + 0.002 * p.y * p.y;
    // A kink far beyond the outline.
    let heights = |beyond: f64| {
        Field::from_fn(121, 121, |i, j| {
            let p = extent.node(i, j, 121, 121);
            smooth(p) + beyond * (p.length() - 40.0).max(0.0)
        })
    };
    let points = |outline: Outline, beyond: f64| {
        let surface = HeightField::outlined(extent, outline, heights(beyond));
        choose_net(&surface, StepTolerance::Micrometres(0.5), &design()).unwrap().net.points().0
    };
    let [plain, within, whole] =
        [points(Outline::Circle, 0.0), points(Outline::Circle, 1.0), points(Outline::Rectangle, 1.0)];
    assert!(plain <= within && 2 * within < whole, "{plain}, {within}, {whole}");
}

/// Demands that a changed file is refused with these words.
fn refused(whole: &str, from: &str, to: &str, words: &str) {
    assert!(whole.contains(from), "{from}");
    let changed = whole.replacen(from, to, 1);
    let error = match load::parse(load::Format::Step, changed.as_bytes()) {
        Ok(mesh) => Block::from_mesh(&mesh).map(|_| ()).unwrap_err().to_string(),
        Err(error) => error.to_string(),
    };
    assert!(error.contains(words), "{from} to {to}: {error}");
}

#[test]
fn trimmed_faces_that_do_not_fit_their_walls_are_refused_by_name() {
    let extent = Extent::new(40.0, 30.0);
    let text = |outline: Outline, extent: Extent| {
        let surface = face(extent, outline, (21, 17));
        let solid = Solid::new(&surface, Stock::of_thickness(12.0)).unwrap();
        let mut bytes = Vec::new();
        write_step(&mut bytes, &solid, &ControlNet::interpolating(&surface), None, &design()).unwrap();
        String::from_utf8(bytes).unwrap()
    };
    let disc = text(Outline::Circle, Extent::new(40.0, 40.0));
    refused(&disc, ",20.);", ",20.01);", "beside it");
    refused(&disc, ",20.);", ",-20.);", "semi-axes");
    refused(&disc, ",20.);", ",nan);", "semi-axes");
    refused(&disc, "CYLINDRICAL_SURFACE", "CONICAL_SURFACE", "CONICAL_SURFACE");
    refused(&disc, "DIRECTION('',(0.,0.,1.))", "DIRECTION('',(0.,0.,0.))", "no frame");
    refused(&disc, "SURFACE_CURVE('',#", "SURFACE_CURVE('',$,#", "parameters of its kind");
    // A control point at the middle of the east side lifts the face off its edge; one in a corner
    // is nothing of the glass, but the face must be a height field there too.
    let ellipse = text(Outline::Circle, extent);
    let moved = |number: usize, x: f64| {
        let start = ellipse.find(&format!("#{number}=CARTESIAN_POINT('',(")).unwrap();
        let end = start + ellipse[start..].find(";").unwrap();
        format!("{}#{number}=CARTESIAN_POINT('',({x:?},0.,9.)){}", &ellipse[..start], &ellipse[end..])
    };
    refused(&moved(8 * 21 + 21, 20.0), "DATA", "DATA", "beside it");
    refused(&moved(1, -19.0), "DATA", "DATA", "no height field");
    refused(&ellipse, "ELLIPSE('',", "ELLIPSE('',$,", "parameters of its kind");
    refused(&ellipse, "ELLIPSE('',", "PARABOLA('',", "PARABOLA");
    let vector = ellipse.find("VECTOR('',#").map(|at| &ellipse[at..at + ellipse[at..].find(',').unwrap() + 8]).unwrap();
    refused(&ellipse, vector, "VECTOR('',#999999999", "no entity #999999999");
}

/// The error of the picture that a verification prints.
fn rel_rms(out: &str) -> f64 {
    let line = out.lines().find_map(|line| line.trim().strip_prefix("relative RMS")).expect(out);
    line.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn a_round_block_is_made_as_step_judged_and_judged_again() {
    let workshop = Workshop::new();
    let made = workshop.run(
        "design -v picture.png -o round.stl -o round.step --nodes 65 --transfer linear --outline circle --origin corner --no-report",
    );
    assert_eq!(made.code, FINE, "{}", made.err);
    assert!(made.out.contains("round.step") && made.out.contains("control points"), "{}", made.out);
    let judged = workshop.run("verify round.step");
    assert_eq!(judged.code, FINE, "{}\n{}", judged.out, judged.err);
    prints_within_tenth_of(0.0082, rel_rms(&judged.out), "round");
    let step = fs::read(workshop.path("round.step")).unwrap();
    fs::write(workshop.path("cut.step"), &step[..step.len() / 2]).unwrap();
    workshop.refuses("verify cut.step --bench round.toml", MESH, &["cut.step", "STEP", "truncated"]);
}

#[test]
fn mirrors_and_rounded_blocks_are_made_as_step_too() {
    let workshop = Workshop::new();
    let made = workshop.run(
        "design picture.png -o mirror.step --nodes 65 --transfer linear --outline rounded:9mm --mirror --step-tolerance 0.2 --no-report",
    );
    assert_eq!(made.code, FINE, "{}", made.err);
    let judged = workshop.run("verify mirror.step");
    assert_eq!(judged.code, FINE, "{}\n{}", judged.out, judged.err);
    prints_within_tenth_of(0.0021, rel_rms(&judged.out), "mirror");
}
