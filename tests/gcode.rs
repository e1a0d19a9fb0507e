//! Programs of machines: the moves that the verifier's reader finds are those of LinuxCNC's own
//! interpreter, and what is wrong with a program is told by its name.

mod common;

use common::workshop::{FILE, FINE, Outcome, REFUSED, Workshop};
use glam::{DVec2, DVec3};
use glasswarp::{
    fabricate::{Cutter, Direction, Machining, Milled, Pass, Pattern, Place, Post, Program, Roughing, Sense},
    grid::{Extent, Field, Outline},
    surface::HeightField,
};
use glasswarp_verify::{
    cut::{Plan, Sheet, Strokes},
    program::{Arc, Move, Plane, ProgramError, ProgramFault, Run, Tool, Way, run, tools_in},
};
use std::path::Path;

/// All moves of a program.
#[derive(Default)]
struct Moves(Vec<Move>);

impl Run for Moves {
    fn moved(&mut self, made: &Move) -> Result<(), ProgramFault> {
        self.0.push(*made);
        Ok(())
    }
}

fn moves(program: &[u8]) -> Result<Vec<Move>, ProgramError> {
    let mut moves = Moves::default();
    run(program, None, &mut moves)?;
    Ok(moves.0)
}

/// What LinuxCNC says of a move, in millimetres of the first work offset.
#[derive(Debug)]
enum Canon {
    Rapid(DVec3),
    Feed(DVec3),
    Arc { to: DVec3, centre: DVec2, clockwise: bool, plane: Plane },
}

/// Runs LinuxCNC's interpreter; `None` where it is not installed.
fn linuxcnc(program: &[u8], folder: &Path) -> Option<Result<Vec<Canon>, String>> {
    let path = folder.join("program.ngc");
    std::fs::write(&path, program).unwrap();
    let mut interpreter = common::program("rs274", "Debian package linuxcnc-uspace")?;
    interpreter.arg("-g").arg(&path).current_dir(folder);
    let mut output = interpreter.output().unwrap();
    // On a busy machine it sometimes ends before it has said anything: that is no judgement.
    for _ in 0..5 {
        if !output.stdout.is_empty() {
            break;
        }
        output = interpreter.output().unwrap();
    }
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    if !said.contains("PROGRAM_END") {
        let end: String = said.lines().rev().take(5).collect::<Vec<_>>().join("\n");
        return Some(Err(format!("{}{end}", String::from_utf8_lossy(&output.stderr))));
    }
    let (mut unit, mut plane, mut shift) = (1.0, Plane::Xy, DVec3::ZERO);
    let mut canon = Vec::new();
    for line in said.lines() {
        let numbers: Vec<f64> = line
            .split(['(', ')'])
            .nth(1)
            .unwrap_or_default()
            .split(',')
            .filter_map(|number| number.trim().parse().ok())
            .collect();
        let place = |k: usize| unit * DVec3::new(numbers[k], numbers[k + 1], numbers[k + 2]) + shift;
        if line.contains("USE_LENGTH_UNITS") {
            unit = if line.contains("INCHES") { 25.4 } else { 1.0 };
        } else if line.contains("SELECT_PLANE") {
            plane = [("XY", Plane::Xy), ("XZ", Plane::Zx), ("YZ", Plane::Yz)]
                .into_iter()
                .find_map(|(name, plane)| line.contains(name).then_some(plane))
                .unwrap();
        } else if line.contains("SET_G92_OFFSET") {
            shift = unit * DVec3::new(numbers[0], numbers[1], numbers[2]);
        } else if line.contains("STRAIGHT_TRAVERSE") {
            canon.push(Canon::Rapid(place(0)));
        } else if line.contains("STRAIGHT_FEED") {
            canon.push(Canon::Feed(place(0)));
        } else if line.contains("ARC_FEED") {
            // In the order of the plane's axes.
            let v: Vec<f64> = numbers.iter().map(|v| unit * v).collect();
            let back = |first: f64, second: f64, across: f64| match plane {
                Plane::Xy => DVec3::new(first, second, across),
                Plane::Zx => DVec3::new(second, across, first),
                Plane::Yz => DVec3::new(across, first, second),
            };
            let centre = back(v[2], v[3], 0.0) + shift;
            let centre = match plane {
                Plane::Xy => DVec2::new(centre.x, centre.y),
                Plane::Zx => DVec2::new(centre.z, centre.x),
                Plane::Yz => DVec2::new(centre.y, centre.z),
            };
            canon.push(Canon::Arc { to: back(v[0], v[1], v[5]) + shift, centre, clockwise: numbers[4] < 0.0, plane });
        }
    }
    Some(Ok(canon))
}

/// rs274 prints four decimals, of inches after G20.
const PRINTED_MM: f64 = 0.5e-4 * 25.4 + 1e-9;

/// Axes that the program has not said, or that the machine knows alone, are anywhere.
fn same(ours: DVec3, theirs: DVec3) -> bool {
    ours.to_array().iter().zip(theirs.to_array()).all(|(a, b)| a.is_nan() || (a - b).abs() <= PRINTED_MM)
}

/// Holds our moves of a program against LinuxCNC's; returns how many there are.
fn agree(name: &str, program: &[u8], folder: &Path) -> Option<usize> {
    let theirs = linuxcnc(program, folder)?.unwrap_or_else(|said| panic!("{name}: LinuxCNC refuses it\n{said}"));
    let ours = moves(program).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(ours.len(), theirs.len(), "{name}: {ours:?}\n{theirs:?}");
    for (ours, theirs) in ours.iter().zip(&theirs) {
        let fits = match (ours.way, theirs) {
            (Way::Rapid, Canon::Rapid(to)) | (Way::Straight { .. }, Canon::Feed(to)) => same(ours.to, *to),
            (
                Way::Arc { arc: Arc { plane, centre, angle, .. }, .. },
                Canon::Arc { to, centre: their, clockwise, plane: at },
            ) => {
                same(ours.to, *to)
                    && plane == *at
                    && centre.distance(*their) < 2.0 * PRINTED_MM
                    && (angle[1] < 0.0) == *clockwise
            }
            _ => false,
        };
        assert!(fits, "{name}, line {}: {ours:?}\n{theirs:?}", ours.line);
    }
    Some(ours.len())
}

/// All words that are taken, as a shop, a post or a person would write them.
const CORPUS: &[(&str, &str)] = &[
    (
        "straight",
        "%\n(a program)\nN10 G21 G90 G17 G40 G49 G80 G94\nN20 G0 Z5.\nG0 X1 Y2 ; to the work\nG1 Z-1 F300\nX10.5 Y-3.25\nM2\n%\n",
    ),
    ("inches", "G20 G90\nG0 X0 Y0 Z.25\nG1 X1.5 Y-.125 Z-.0625 F20\nG21\nG1 X10 F300\nG20\nX1\nM30\n"),
    ("blanks and lower case", "g21\n g0 x 1 . 5 y-2z3\ng1 f 1 0 0 x+2\n\n(only a comment)\nm2\n"),
    ("increments", "G21 G90 G0 X5 Y5 Z5\nG91 G1 X1 Y-1 F100\nZ-2\nG90 X0\nG91\nG0 X2.5 Z2\nM2\n"),
    ("modal", "G21\nG0 X1\nY2\nZ3\nG1 F200 X2\nY3\nG0 Z9\nX0 Y0\nM2\n"),
    ("offset by G92", "G21 G0 X10 Y10 Z10\nG92 X0 Y0\nG1 X5 F100\nG92.2\nX20\nG92.3\nX5 Y5\nG92.1\nX0 Y0\nM2\n"),
    ("local offset", "G21 G0 X10 Y10 Z10\nG52 X3 Y-2 Z1\nG1 X0 Y0 F100\nZ0\nG52 X0 Y0 Z0\nX0 Y0 Z0\nM2\n"),
    ("work offset", "G21 G54 G0 X1 Y1 Z1\nG1 X2 F100\nG54\nX3\nM2\n"),
    (
        "home",
        "G21 G90 G0 X10 Y10 Z10\nG1 X5 F100\nG28 Z20\nG0 X1 Y1 Z20\nG91 G28 Z0\nG90\nG0 X3 Y3\nG30 X7\nG0 X0 Y0 Z2\nM2\n",
    ),
    ("inverse time", "G21 G0 X0 Y0 Z0\nG93 G1 X10 F2\nY10 F4\nG94 F500\nX0\nM2\n"),
    ("path modes", "G21 G0 X0 Y0 Z0\nG61 G1 X1 F100\nG61.1 X2\nG64 X3\nG64 P0.05 X4\nG64 P0.1 Q0.1 X5\nM2\n"),
    (
        "machine functions",
        "G21 T1 M6\nS12000 M3\nM8\nG0 X0 Y0 Z5\nG4 P0.5\nM7\nG1 Z0 F100\nM9\nM5\nM4 S100\nM5\nM48\nM49\nM1\nM30\n",
    ),
    ("tool length", "G21 T1 M6\nG43 H0\nG0 X0 Y0 Z5\nG1 Z0 F100\nG49\nZ1\nM2\n"),
    (
        "arcs by centre",
        "G21 G17 G0 X0 Y0 Z0\nG2 X10 Y0 I5 J0 F100\nG3 X0 Y0 I-5\nG2 X5 Y5 J5 I0\nG3 I3 J3\nG3 X5 Y5 Z-2 I-2 J0\nM2\n",
    ),
    (
        "arcs by radius",
        "G21 G17 G0 X0 Y0 Z0\nG2 X10 Y0 R6 F100\nG3 X20 Y0 R6\nG2 X30 Y0 R-6\nG3 X40 Y5 R-20\nG2 X50 Y5 R5\nM2\n",
    ),
    ("arcs in zx", "G21 G18 G0 X0 Y0 Z0\nG2 X10 Z0 I5 K0 F100\nG3 X0 Z0 I-5\nG2 X3 Z4 Y2 R4\nG3 X3 Z4 I2 K2\nM2\n"),
    ("arcs in yz", "G21 G19 G0 X0 Y0 Z0\nG2 Y10 Z0 J5 K0 F100\nG3 Y0 Z0 J-5\nG2 Y3 Z4 X2 R4\nM2\n"),
    (
        "arcs by absolute centre",
        "G21 G17 G90 G90.1 G0 X10 Y10 Z0\nG2 X20 Y10 I15 J10 F100\nG92 X0 Y0\nG3 X-10 Y0 I-5 J0\nG91.1\nG2 X0 Y0 I5 J0\nM2\n",
    ),
    ("arcs in increments", "G21 G17 G0 X1 Y1 Z1\nG91 G2 X10 Y0 I5 J0 F100\nG3 X-4 Y4 Z-1 R4\nM2\n"),
    ("arcs in inches", "G20 G17 G0 X0 Y0 Z0\nG2 X1 Y0 I.5 J0 F10\nG3 X0 Y0 R.75\nG21\nG2 X12.7 Y12.7 I12.7 J0\nM2\n"),
    ("arcs of rounded radius", "G21 G17 G0 X0 Y0 Z0\nG2 X10 Y0 I5.003 J0 F100\nG3 X0 Y0 I-4.9985 J0.002\nM2\n"),
];

#[test]
fn moves_are_those_of_linuxcnc_for_all_words_that_are_taken() {
    let folder = tempfile::tempdir().unwrap();
    let mut count = 0;
    for (name, program) in CORPUS {
        let Some(moves) = agree(name, program.as_bytes(), folder.path()) else { return };
        count += moves;
    }
    assert!(count > 90, "{count}");
}

#[test]
fn what_linuxcnc_refuses_is_refused_here_too() {
    let folder = tempfile::tempdir().unwrap();
    for (name, program, word) in [
        ("no feed", "G21 G0 X0 Y0 Z0\nG1 X5\nM2\n", "feed"),
        ("radii that disagree", "G21 G17 F100 G0 X0 Y0 Z0\nG2 X10 Y0 I5.1 J0\nM2\n", "radius"),
        ("a radius that is too small", "G21 G17 F100 G0 X0 Y0 Z0\nG2 X10 Y0 R4\nM2\n", "more than twice"),
        ("an arc without a centre", "G21 G17 F100 G0 X0 Y0 Z0\nG2 X10 Y0\nM2\n", "neither R nor I, J"),
        ("two kinds of motion", "G21 F100 G0 G1 X5\nM2\n", "exclude"),
        ("a word twice", "G21 G0 X5 X6\nM2\n", "twice"),
        ("no feed of its own", "G21 G0 X0 Y0 Z0\nG93 G1 X5\nM2\n", "inverse time"),
        ("a place without motion", "G21\nX5\nM2\n", "how to go there"),
        ("an unknown code", "G21 G17 G12 X5\nM2\n", "G12"),
        ("an open comment", "G21 G0 X5 (open\nM2\n", "not closed"),
        ("a number that is none", "G21 G0 X\nM2\n", "no number"),
    ] {
        let said = moves(program.as_bytes()).unwrap_err();
        assert!(said.to_string().contains(word), "{name}: {said}");
        assert!(said.line >= 1 && !said.text.is_empty(), "{name}: {said}");
        let Some(theirs) = linuxcnc(program.as_bytes(), folder.path()) else { return };
        assert!(theirs.is_err(), "{name}: {theirs:?}");
    }
}

#[test]
fn what_is_not_simulated_is_refused_by_its_name_and_line() {
    for (program, words) in [
        ("G0 X5\n", ["units", "line 1"].as_slice()),
        ("G21\nG0 X0 Y0\nG1 X5 F100\n", &["line 3", "z of its beginning"]),
        ("G21 G91\nG0 X5\n", &["line 2", "increment"]),
        ("G21\n#1 = 5\n", &["parameter", "line 2"]),
        ("G21 G0 X[1+2]\n", &["expression"]),
        ("O100 sub\n", &["O-word"]),
        ("O<start> call\n", &["O-word"]),
        ("G21 G0 X5\nO0002\n", &["second program"]),
        ("G21 G0 X0 Y0 Z0\nM98 P1000\n", &["M98", "subprogram"]),
        ("G21 G0 X0 Y0 Z5\nG81 X1 Y1 Z-5 R2 F100\n", &["G81", "canned cycle"]),
        ("G21 G41 D1\nG0 X5\n", &["G41", "cutter radius compensation"]),
        ("G21 G0 X0 Y0 Z0\nG5 X5 Y5 I1 J1 P1 Q1 F100\n", &["G5", "spline"]),
        ("G7\nG21 G0 X5 Z5\n", &["G7", "lathe"]),
        ("G21 G96 S100\nG0 X5\n", &["G96", "surface speed"]),
        ("G21 G0 X5 A30\n", &["axis A"]),
        ("G21 G0 X5 B-2\n", &["axis B", "three axes"]),
        ("G21 G54 G0 X5\nG55 X6\n", &["G55", "G54"]),
        ("G21 G0 X5\nG59.3 X6\n", &["G59.3", "G54"]),
        ("G21\nG38.2 Z-10 F50\n", &["G38.2", "probing"]),
        ("G21 G10 L2 P1 X5\n", &["G10", "tables"]),
        ("G21 G43.1 Z5\n", &["G43.1", "tool length"]),
        ("G21 G68 R30\n", &["G68", "turned"]),
        ("G21 G51 X2\n", &["G51", "scaling"]),
        ("G21 G95 G0 X5\n", &["G95", "per turn"]),
        ("/G21 G0 X5\n", &["block delete"]),
        ("$H\n", &["GRBL"]),
        ("G21 G0 X5 *71\n", &["checksum"]),
        ("G21 G0 X5 E1\n", &["E belongs to nothing"]),
        ("G21 G0 X2000000\n", &["out of range"]),
        ("O0001 (PART)\nG21 G90\nG0 X5 Y5.\n", &["without a decimal point"]),
        ("G21 M123\nG0 X5\n", &["M123"]),
        ("G21 G17 F9 G0 X0 Y0 Z0\nG2 X0 Y0 R5\n", &["full circle"]),
        ("G21 G17 F9 G0 X0 Y0 Z0\nG3 X5 Y0 I2.5 R3\n", &["both R"]),
        ("G21 G17 F9 G0 X0 Y0 Z0\nG3 I5 P3\n", &["turns"]),
        ("", &["moved nothing"]),
        ("G21\nM2\n", &["moved nothing"]),
        ("\u{89}PNG\r\n", &["no G-code"]),
    ] {
        let said = moves(program.as_bytes()).unwrap_err().to_string();
        for word in words {
            assert!(said.contains(word), "{program:?}: '{word}' is not in\n{said}");
        }
    }
    let endless = vec![b'X'; 1 << 20];
    assert!(moves(&endless).unwrap_err().to_string().contains("16384 bytes"));
}

#[test]
fn what_posts_for_other_controls_write_besides_is_taken() {
    // Haas and Fanuc: program number, home by increments of 0, look-ahead, work offset, tool
    // length.
    let haas = "%\nO01234 (PART)\n(T1 D=6. CR=3. - ZMIN=-4.5 - BALL END MILL)\nN10 G90 G94 G17\nN15 G21\nN20 G53 G0 Z0.\n\
        N25 T1 M6\nN30 S18000 M3\nN35 G54\nN40 G187 P3\nN45 G0 X1. Y2.\nN50 G43 Z5. H1\nG1 Z0. F500.\nX10.\nM5\n\
        G53 G0 Z0.\nG28 G91 X0. Y0.\nM30\n%\n";
    let made = moves(haas.as_bytes()).unwrap();
    let fed: Vec<DVec3> = made.iter().filter(|made| made.feeds()).map(|made| made.to).collect();
    assert_eq!(fed, [DVec3::new(1.0, 2.0, 0.0), DVec3::new(10.0, 2.0, 0.0)]);
    assert!(made[0].to.z.is_nan() && made.last().unwrap().to.x.is_nan());
    let fanuc = "%\n:0007\nG21 G90 G80 G40 G49 G69 G50 G15\nG05.1 Q1\nG00 G90 G54 X0.0 Y0.0\nG43 H01 Z10.0\nG08 P1\nG05 P10000\n\
        G01 Z-1.0 F200.0 S1000 M03\nG05 P0\nG91 G30 Z0.0\nM30\n%\nG0 X99\n";
    assert_eq!(moves(fanuc.as_bytes()).unwrap().iter().filter(|made| made.feeds()).count(), 1);
    let grbl = "G21\nG90\nG17 G94\nM3 S1000\nG0Z3.81\nG0X0.0Y0.0\nG1Z-0.1F254.0\nG1X1.0\nM5\nG0Z3.81\nM2\n";
    assert_eq!(moves(grbl.as_bytes()).unwrap().len(), 5);
    let mach = "( Made using CAM )\nN10G00G21G17G90G40G49G80\nN20G70G91.1\n";
    assert!(moves(mach.as_bytes()).unwrap_err().to_string().contains("G70"));
    let mach = "( Made using CAM )\nN10G00G21G17G90G40G49G80\nN20G91.1\nN30T1M06\nN40G00G43Z20.000H1\nN50S12000M03\nN60G94\n\
        N70X0.000Y0.000F600.0\nN80G1Z-1.000F300.0\nN90G2X10.000Y0.000I5.000J0.000F600.0\nN100M09\nN110M30\n%\n";
    assert_eq!(moves(mach.as_bytes()).unwrap().len(), 4);
}

#[test]
fn moves_are_those_of_linuxcnc_for_what_freecad_posts() {
    let Some(_) = common::program("freecadcmd", "Debian package freecad") else { return };
    let where_is = "import opencamlib, os; print(os.path.dirname(os.path.dirname(opencamlib.__file__)))";
    let Some(mut python) = common::python(&["opencamlib"], where_is) else { return };
    let packages = common::output(&mut python);
    let workshop = Workshop::new();
    let outcome = workshop.run(
        "design picture.png --size 30mm --thickness 8mm --nodes 65 --distance 300mm --origin stock-top -o b.stl -o b.step --no-report",
    );
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/freecad/mill_block.py");
    let mut freecad = common::freecad(&format!("exec(open({script:?}).read())")).unwrap();
    let said =
        common::output(freecad.envs([("BLOCK", workshop.path("b.step")), ("GCODE", workshop.path("b.ngc"))]).envs([
            ("OCL", packages.trim()),
            ("CUTTER", "1.5"),
            ("STEPOVER", "0.3"),
            ("SAMPLE", "0.3"),
        ]));
    let program = std::fs::read(workshop.path("b.ngc")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let Some(count) = agree("FreeCAD", &program, folder.path()) else { return };
    assert!(count > 5000, "{count}\n{said}");
    // And it cuts the block: FreeCAD's own mesh and the path's sampling are what it is off by.
    let outcome = workshop.run("verify b.ngc --tool ball:3mm --json");
    let found = &json(&outcome)["result"];
    let off = found["deviation"]["range_um"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap().abs())
        .fold(0.0, f64::max);
    assert!(off < 1000.0 && found["deviation"]["untouched"].as_f64() < Some(0.01), "{off} um: {found}");
}

fn json(outcome: &Outcome) -> serde_json::Value {
    serde_json::from_str(&outcome.out).unwrap_or_else(|error| panic!("{error}\n{}{}", outcome.out, outcome.err))
}

/// A block, and a program that cuts it: rows across a picture that no turn of itself resembles.
fn block_and_program() -> (Workshop, String) {
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    let outcome = workshop.run(
        "design chiral.png --size 36mm --thickness 9mm --nodes 97 --distance 40mm --offset 0.3 --origin stock-top --cutter ball:d3mm \
         --step-over 0.15mm --chord-error 0.01 -o b.stl -o b.ngc --no-report",
    );
    assert_eq!(outcome.code, FINE, "{}{}", outcome.out, outcome.err);
    let program = std::fs::read_to_string(workshop.path("b.ngc")).unwrap();
    (workshop, program)
}

/// What the verifier says of a changed program: warnings, and the error with which it ends.
fn said_of(workshop: &Workshop, program: &str, flags: &str) -> (String, serde_json::Value) {
    std::fs::write(workshop.path("wrong.ngc"), program).unwrap();
    let outcome = workshop.run(&format!("verify wrong.ngc --bench b.toml --json {flags}"));
    let document = json(&outcome);
    let words = format!("{} {} {}", document["warnings"], document["error"], document["result"]["faults"]);
    (words, document["result"].clone())
}

/// The program with every place changed.
fn placed(program: &str, change: impl Fn(DVec3) -> DVec3) -> String {
    let mut at = DVec3::ZERO;
    let mut text = String::new();
    for line in program.lines() {
        let is_move = line.starts_with("G0 ") || line.starts_with("G1 ");
        if !is_move {
            text += line;
            text.push('\n');
            continue;
        }
        let mut words = Vec::new();
        for word in line.split_whitespace() {
            match (word.chars().next(), word[1..].parse::<f64>()) {
                (Some('X'), Ok(v)) => at.x = v,
                (Some('Y'), Ok(v)) => at.y = v,
                (Some('Z'), Ok(v)) => at.z = v,
                _ => words.push(word.to_owned()),
            }
        }
        let to = change(at);
        // Straight up comes first, as it was.
        if line.starts_with("G0 Z") {
            words.push(format!("Z{:.6}", to.z));
        } else {
            words.extend([format!("X{:.6}", to.x), format!("Y{:.6}", to.y), format!("Z{:.6}", to.z)]);
        }
        text += &words.join(" ");
        text.push('\n');
    }
    text
}

#[test]
fn what_was_done_wrong_is_told_by_its_name() {
    let (workshop, program) = block_and_program();
    let (words, right) = said_of(&workshop, &program, "");
    assert!(words.starts_with("[]") && right["diagnoses"].as_array().unwrap().is_empty(), "{words}");
    let rms = |result: &serde_json::Value| result["deviation"]["rms_um"].as_f64().unwrap();
    assert!(rms(&right) < 1.0, "{right}");
    let mut missing = Vec::new();
    let rounded = |step: f64| placed(&program, |p| (p / step).round() * step);
    for (name, changed, flags, wanted) in [
        ("rounded", rounded(0.001), "", ["rounds to 3 decimals", "set 5 or more"].as_slice()),
        ("mirrored", placed(&program, |p| DVec3::new(-p.x, p.y, p.z)), "", &["mirrored along x"]),
        ("exchanged", placed(&program, |p| DVec3::new(p.x, -p.y, p.z)), "", &["mirrored along y"]),
        ("shifted", placed(&program, |p| p + DVec3::new(0.5, -0.2, 0.0)), "", &["mm beside its place", "origin"]),
        ("too deep", placed(&program, |p| p - DVec3::Z * 0.05), "", &["mm too low (too much is cut)", "correct z"]),
        ("a wrong radius", program.clone(), "--tool ball:r0.9mm", &["mm radius, and the tool has 0.9 mm"]),
        ("inches", program.replace("G21", "G20"), "", &["millimetres, taken for inches", "G21"]),
        ("millimetres", placed(&program, |p| p / 25.4), "", &["inches, taken for millimetres", "G20"]),
        ("another zero", program.clone(), "--origin corner", &["beside the face", "origin"]),
    ] {
        let (words, _) = said_of(&workshop, &changed, flags);
        let lacking: Vec<&&str> = wanted.iter().filter(|word| !words.contains(**word)).collect();
        if !lacking.is_empty() {
            missing.push(format!("{name}: {lacking:?} is not in {words}"));
        }
        if name == "shifted" {
            let said: Vec<f64> =
                words.split(['(', ',', ')']).skip(1).take(2).filter_map(|v| v.trim().parse().ok()).collect();
            assert!(said.len() == 2 && (said[0] - 0.5).abs() < 0.005 && (said[1] + 0.2).abs() < 0.005, "{words}");
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
    // The same program on the zero that it was written for.
    let corner = placed(&program, |p| p + DVec3::new(18.0, 18.0 * 32.0 / 48.0, 9.0));
    let (words, result) = said_of(&workshop, &corner, "--origin corner");
    assert!(words.starts_with("[]") && rms(&result) < 1.0, "{words}");
}

#[test]
fn what_would_do_harm_is_told_with_its_line_and_ends_in_an_error() {
    let (workshop, program) = block_and_program();
    let lines: Vec<&str> = program.lines().collect();
    let end = lines.len() - 4;
    let with = |extra: &str| [&lines[..end], &[extra], &lines[end..]].concat().join("\n") + "\n";
    for (name, changed, flags, wanted) in [
        (
            "a rapid through the stock",
            program.replacen("G1 ", "G0 ", 400),
            "",
            ["rapid goes through the stock"].as_slice(),
        ),
        ("below the stock", with("G0 Z5\nG0 X0 Y0\nG1 Z-9.5 F100\nG0 Z5"), "", &["0.500 mm below the stock"]),
        ("a plunge", with("G0 Z5\nG0 X0 Y0\nG1 Z-5 F100\nG0 Z5"), "", &["straight down into the stock"]),
        ("outside of the machine", program.clone(), "--travel 30x30x30mm", &["more than the machine has"]),
        ("a standing spindle", program.replace("M3", "M5"), "", &["spindle stands"]),
    ] {
        let (words, _) = said_of(&workshop, &changed, flags);
        for word in wanted {
            assert!(words.contains(word), "{name}: '{word}' is not in\n{words}");
        }
        // Stock may have been roughed before, and a spindle turned on by hand.
        let is_harm = !matches!(name, "a plunge" | "a standing spindle");
        assert_eq!(words.contains("must not be run"), is_harm, "{name}: {words}");
    }
}

#[test]
fn a_program_is_refused_where_it_is_not_known_what_it_does() {
    let (workshop, program) = block_and_program();
    std::fs::write(workshop.path("wrong.ngc"), program.replace("ball:d3mm", "a cutter")).unwrap();
    workshop.refuses("verify wrong.ngc --bench b.toml", REFUSED, &["tool 0", "--tool ball:d6mm"]);
    workshop.refuses("verify wrong.ngc --bench b.toml --tool ball:r40mm", REFUSED, &["80 mm across", "stock"]);
    workshop.refuses("verify wrong.ngc --bench b.toml --tool cone:3mm", REFUSED, &["no kind 'cone'"]);
    workshop.refuses("verify wrong.ngc --bench b.toml --tool ball:3mm --tally x.exr", REFUSED, &["--tally"]);
    workshop.refuses("verify b.stl --tool ball:3mm", REFUSED, &["no program"]);
    std::fs::write(workshop.path("wrong.ngc"), "G21\nG0 X0 Y0 Z5\nG1 Z0\n").unwrap();
    workshop.refuses("verify wrong.ngc --bench b.toml --tool ball:3mm", FILE, &["line 3", "feed"]);
    std::fs::write(workshop.path("wrong.ngc"), [0x7f, b'E', b'L', b'F', 0, 1]).unwrap();
    workshop.refuses("verify wrong.ngc --bench b.toml --tool ball:3mm", FILE, &["line 1", "no G-code"]);
    std::fs::remove_file(workshop.path("b.toml")).unwrap();
    workshop.refuses("verify b.ngc", REFUSED, &["side file"]);
}

/// A face of waves that no axis favours.
fn face(seed: u32) -> HeightField {
    let extent = Extent::new(30.0, 24.0);
    let turned = f64::from(seed);
    let heights = Field::from_fn(61, 49, |i, j| {
        let p = extent.node(i, j, 61, 49);
        0.4 * (0.31 * p.x + turned).sin() * (0.23 * p.y - turned).cos() + 0.1 * (0.5 * p.y + 2.0 * turned).sin()
    });
    HeightField::found(extent, Outline::Rectangle, heights)
}

fn machining(post: Post, chord_mm: f64, arcs: bool) -> Machining {
    Machining { feed_mm_per_min: 1000.0, spindle_per_min: 18_000.0, safe_mm: 4.0, chord_mm, arcs, post }
}

/// What a program's feed moves leave of a face, in the frame of the program.
fn cut_by(program: &[u8], tool: Tool, plan: Plan, top: f64) -> Vec<f64> {
    let mut strokes = Strokes::of(&[tool]);
    moves(program).unwrap().iter().filter(|made| made.feeds()).for_each(|made| strokes.add(made, 0));
    let mut sheet = Sheet::level(plan, top).unwrap();
    sheet.cut(&strokes);
    sheet.into_cut().heights
}

#[test]
fn a_program_cuts_what_mill_simulates_of_the_same_rows() {
    let surface = face(1);
    for (direction, arcs) in
        [(Direction::X, false), (Direction::X, true), (Direction::Y, true), (Direction::at(25.0), false)]
    {
        let cutter = Cutter::ball(2.0).unwrap();
        let pass = Pass { direction, ..Pass::finishing(cutter, 0.4) };
        let milled = Milled::of(&surface, pass).unwrap();
        let place = Place { top_mm: 1.0, floor_mm: -6.0, rim_mm: None, origin_mm: DVec3::new(-15.0, -12.0, 1.0) };
        let (pattern, sense, roughing) = (Pattern::Rows, Sense::BothWays, None);
        let machining = machining(Post::LinuxCnc, 1e-6, arcs);
        let program = Program { surface: &surface, pass, pattern, sense, roughing, machining, place };
        let mut text = Vec::new();
        program.write(&mut text, "a face", &[]).unwrap();
        let heights = milled.surface.heights_mm();
        let nodes = (heights.nx(), heights.ny());
        let plan = Plan { lower: DVec2::ZERO, upper: DVec2::new(30.0, 24.0), nodes };
        let cut = cut_by(&text, Tool::ball(2.0), plan, 0.0);
        // Beside a border what is simulated is searched for near the touching cutter only, and may
        // be higher than what the way leaves.
        let at_border = |k: usize| {
            let p = plan.node(k % nodes.0, k / nodes.0);
            p.min(plan.upper - p).min_element() < 0.5
        };
        let off = |k: usize| match cut[k] + 1.0 - heights.as_slice()[k] {
            lower if at_border(k) && lower < 0.0 && lower > -0.01 => 0.0,
            off => off.abs(),
        };
        let at = (0..cut.len()).max_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap();
        let worst = off(at);
        let place = plan.node(at % nodes.0, at / nodes.0);
        eprintln!("{direction}, arcs {arcs}: {} bytes, {:.6} um at {place}", text.len(), 1e3 * worst);
        assert!(worst < 5e-5, "{direction}, arcs {arcs}: {worst} mm");
    }
}

#[test]
fn programs_are_safe_on_any_face_for_every_control_pattern_and_rim() {
    let folder = tempfile::tempdir().unwrap();
    let mut tried = 0;
    for seed in 0..3 {
        let surface = face(seed);
        let (low, high) = surface.range_mm();
        for (k, post) in Post::ALL.into_iter().enumerate() {
            for (n, pattern) in [Pattern::Rows, Pattern::Spiral, Pattern::ContourParallel].into_iter().enumerate() {
                let rim_mm = [None, Some(high + 1.5), Some(low - 1.0)][(seed as usize + k + n) % 3];
                let top_mm = rim_mm.map_or(high, |rim| rim.max(high)) + 0.5;
                let origin_mm = DVec3::new(-15.0, -12.0, top_mm) * f64::from(seed % 2);
                let place = Place { top_mm, floor_mm: low - 2.0, rim_mm, origin_mm };
                let rough = Roughing {
                    cutter: Cutter::flat(3.0).unwrap(),
                    step_over_mm: 2.0,
                    step_down_mm: 0.7,
                    allowance_mm: 0.2,
                };
                let roughing = (post.changes_tools() && n != 1).then_some(rough);
                let direction = [Direction::X, Direction::Y, Direction::at(45.0)][k % 3];
                let pass = Pass { direction, ..Pass::finishing(Cutter::ball(2.0).unwrap(), 1.5) };
                let sense = if seed == 1 { Sense::Climb } else { Sense::BothWays };
                let machining = machining(post, 1e-4, k % 2 == 0);
                let program = Program { surface: &surface, pass, pattern, sense, roughing, machining, place };
                let mut text = Vec::new();
                program.write(&mut text, "part", &["made for a test".to_owned()]).unwrap();
                let name = format!("{post}, {pattern}, seed {seed}");
                check_safe(&name, &text, &place, machining.safe_mm);
                // LinuxCNC reads the dialects that are its own.
                if !matches!(post, Post::Fanuc | Post::Haas) {
                    let Some(count) = agree(&name, &text, folder.path()) else { continue };
                    tried += count;
                }
            }
        }
    }
    assert!(tried > 10_000 || std::env::var_os("GLASSWARP_REQUIRE_TOOLS").is_none(), "{tried}");
}

/// First up; rapids along the clearance or straight up or down to it; nothing below the entry face;
/// nothing of the rim.
fn check_safe(name: &str, text: &[u8], place: &Place, safe_mm: f64) {
    let made = moves(text).unwrap_or_else(|error| panic!("{name}: {error}"));
    let safe = place.top_mm + safe_mm - place.origin_mm.z;
    assert!(!made[0].feeds() && (made[0].to.z - safe).abs() < 1e-4 && made[0].to.x.is_nan(), "{name}: {:?}", made[0]);
    for one in &made {
        let to = one.to + place.origin_mm;
        assert!(to.z.is_nan() || to.z >= place.floor_mm - 1e-4, "{name}: {one:?}");
        if !one.feeds() && !one.to.z.is_nan() {
            assert!((one.to.z - safe).abs() < 1e-4, "{name}: {one:?}");
        }
        assert!(one.tool < 3 && (one.spindle_per_min > 0.0 || !one.feeds()), "{name}: {one:?}");
    }
    assert!(made.iter().filter(|one| one.feeds()).count() > 100, "{name}");
    let Some(rim) = place.rim_mm else { return };
    let tools = tools_of(text);
    let mut strokes = Strokes::of(&tools);
    for one in made.iter().filter(|one| one.feeds()) {
        strokes.add(one, (one.tool.max(1) - 1) as usize % tools.len());
    }
    let plan = Plan { lower: DVec2::new(-20.0, -17.0), upper: DVec2::new(20.0, 17.0), nodes: (161, 137) };
    let shifted =
        Plan { lower: plan.lower - place.origin_mm.truncate(), upper: plan.upper - place.origin_mm.truncate(), ..plan };
    let mut sheet = Sheet::level(shifted, place.top_mm - place.origin_mm.z).unwrap();
    sheet.cut(&strokes);
    let heights = sheet.into_cut().heights;
    for (k, height) in heights.iter().enumerate() {
        let at = plan.node(k % 161, k / 161);
        if at.x.abs() > 15.0 || at.y.abs() > 12.0 {
            assert!(
                height + place.origin_mm.z > rim - 1e-3,
                "{name}: the rim is cut at {at}, {}",
                height + place.origin_mm.z - rim
            );
        }
    }
}

/// The tools that a program's comments tell of, in order.
fn tools_of(text: &[u8]) -> Vec<Tool> {
    String::from_utf8_lossy(text)
        .lines()
        .filter_map(|line| line.strip_prefix('(')?.strip_suffix(')').and_then(|text| tools_in(text, 1.0)))
        .map(|(_, tool)| tool)
        .collect()
}

#[test]
fn a_control_without_tool_changes_gets_no_two_tools() {
    let surface = face(0);
    let rough =
        Roughing { cutter: Cutter::flat(3.0).unwrap(), step_over_mm: 2.0, step_down_mm: 1.0, allowance_mm: 0.2 };
    let place = Place { top_mm: 1.0, floor_mm: -6.0, rim_mm: None, origin_mm: DVec3::ZERO };
    let pass = Pass::finishing(Cutter::ball(2.0).unwrap(), 1.0);
    let machining = machining(Post::Grbl, 1e-4, false);
    let (pattern, sense, roughing) = (Pattern::Rows, Sense::BothWays, Some(rough));
    let program = Program { surface: &surface, pass, pattern, sense, roughing, machining, place };
    let said = program.write(&mut Vec::new(), "part", &[]).unwrap_err().to_string();
    assert!(said.contains("GRBL changes no tools"), "{said}");
}
