//! Programs of machines: the moves that the verifier's reader finds are those of LinuxCNC's own
//! interpreter, and what is wrong with a program is told by its name.

mod common;

use glam::{DVec2, DVec3};
use glasswarp_verify::program::{Arc, Move, Plane, ProgramError, ProgramFault, Run, Way, run};
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
    let output = interpreter.arg("-g").arg(&path).current_dir(folder).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    if !said.contains("PROGRAM_END") {
        return Some(Err(String::from_utf8_lossy(&output.stderr).into_owned()));
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
            (Way::Arc { arc: Arc { plane, centre, angle, .. }, .. }, Canon::Arc { to, centre: their, clockwise, plane: at }) => {
                same(ours.to, *to) && plane == *at && centre.distance(*their) < 2.0 * PRINTED_MM && (angle[1] < 0.0) == *clockwise
            }
            _ => false,
        };
        assert!(fits, "{name}, line {}: {ours:?}\n{theirs:?}", ours.line);
    }
    Some(ours.len())
}

/// All words that are taken, as a shop, a post or a person would write them.
const CORPUS: &[(&str, &str)] = &[
    ("straight", "%\n(a program)\nN10 G21 G90 G17 G40 G49 G80 G94\nN20 G0 Z5.\nG0 X1 Y2 ; to the work\nG1 Z-1 F300\nX10.5 Y-3.25\nM2\n%\n"),
    ("inches", "G20 G90\nG0 X0 Y0 Z.25\nG1 X1.5 Y-.125 Z-.0625 F20\nG21\nG1 X10 F300\nG20\nX1\nM30\n"),
    ("blanks and lower case", "g21\n g0 x 1 . 5 y-2z3\ng1 f 1 0 0 x+2\n\n(only a comment)\nm2\n"),
    ("increments", "G21 G90 G0 X5 Y5 Z5\nG91 G1 X1 Y-1 F100\nZ-2\nG90 X0\nG91\nG0 X2.5 Z2\nM2\n"),
    ("modal", "G21\nG0 X1\nY2\nZ3\nG1 F200 X2\nY3\nG0 Z9\nX0 Y0\nM2\n"),
    ("offset by G92", "G21 G0 X10 Y10 Z10\nG92 X0 Y0\nG1 X5 F100\nG92.2\nX20\nG92.3\nX5 Y5\nG92.1\nX0 Y0\nM2\n"),
    ("local offset", "G21 G0 X10 Y10 Z10\nG52 X3 Y-2 Z1\nG1 X0 Y0 F100\nZ0\nG52 X0 Y0 Z0\nX0 Y0 Z0\nM2\n"),
    ("work offset", "G21 G54 G0 X1 Y1 Z1\nG1 X2 F100\nG54\nX3\nM2\n"),
    ("home", "G21 G90 G0 X10 Y10 Z10\nG1 X5 F100\nG28 Z20\nG0 X1 Y1 Z20\nG91 G28 Z0\nG90\nG0 X3 Y3\nG30 X7\nG0 X0 Y0 Z2\nM2\n"),
    ("inverse time", "G21 G0 X0 Y0 Z0\nG93 G1 X10 F2\nY10 F4\nG94 F500\nX0\nM2\n"),
    ("path modes", "G21 G0 X0 Y0 Z0\nG61 G1 X1 F100\nG61.1 X2\nG64 X3\nG64 P0.05 X4\nG64 P0.1 Q0.1 X5\nM2\n"),
    ("machine functions", "G21 T1 M6\nS12000 M3\nM8\nG0 X0 Y0 Z5\nG4 P0.5\nM7\nG1 Z0 F100\nM9\nM5\nM4 S100\nM5\nM48\nM49\nM1\nM30\n"),
    ("tool length", "G21 T1 M6\nG43 H0\nG0 X0 Y0 Z5\nG1 Z0 F100\nG49\nZ1\nM2\n"),
    ("arcs by centre", "G21 G17 G0 X0 Y0 Z0\nG2 X10 Y0 I5 J0 F100\nG3 X0 Y0 I-5\nG2 X5 Y5 J5 I0\nG3 I3 J3\nG3 X5 Y5 Z-2 I-2 J0\nM2\n"),
    ("arcs by radius", "G21 G17 G0 X0 Y0 Z0\nG2 X10 Y0 R6 F100\nG3 X20 Y0 R6\nG2 X30 Y0 R-6\nG3 X40 Y5 R-20\nG2 X50 Y5 R5\nM2\n"),
    ("arcs in zx", "G21 G18 G0 X0 Y0 Z0\nG2 X10 Z0 I5 K0 F100\nG3 X0 Z0 I-5\nG2 X3 Z4 Y2 R4\nG3 X3 Z4 I2 K2\nM2\n"),
    ("arcs in yz", "G21 G19 G0 X0 Y0 Z0\nG2 Y10 Z0 J5 K0 F100\nG3 Y0 Z0 J-5\nG2 Y3 Z4 X2 R4\nM2\n"),
    ("arcs by absolute centre", "G21 G17 G90 G90.1 G0 X10 Y10 Z0\nG2 X20 Y10 I15 J10 F100\nG92 X0 Y0\nG3 X-10 Y0 I-5 J0\nG91.1\nG2 X0 Y0 I5 J0\nM2\n"),
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
    assert!(count > 110, "{count}");
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
        ("a number that is none", "G21 G0 X--5\nM2\n", "no number"),
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
    // Haas and Fanuc: program number, home by increments of 0, look-ahead, work offset, tool length.
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
