//! Blocks that were moved, turned or mirrored, and what the commands make of them.

mod common;

use common::workshop::{FINE, REFUSED, SHORT, Workshop};
use glam::{DMat3, DVec3};
use std::{f64::consts::FRAC_PI_2, fs};

/// Photons that suffice here.
const FEW: &str = "--photons 100000";

/// A block for 150 mm and index 1.5 of this picture in `block.stl`, judged to be good.
fn good(picture: &str) -> Workshop {
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    if picture == "square.png" {
        let chiral = image::open(workshop.path("chiral.png")).unwrap();
        chiral.crop_imm(0, 0, 32, 32).save(workshop.path(picture)).unwrap();
    }
    let line = format!("design {picture} -o block.stl --size 60mm --distance 150mm --ior 1.5 --nodes 129 --no-verify");
    let made = workshop.run(&line);
    assert_eq!(made.code, FINE, "{}", made.err);
    let found = workshop.run(&format!("verify block.stl --max-error 0.05 {FEW}"));
    assert!(found.code == FINE && found.err.is_empty(), "{}", found.err);
    workshop
}

/// Writes `moved.stl`: every corner of the block sent through `place`, triangles turned round where
/// that mirrors.
fn moved(workshop: &Workshop, place: impl Fn(DVec3) -> DVec3) {
    let mut bytes = fs::read(workshop.path("block.stl")).unwrap();
    let mirrors = (place(DVec3::X) - place(DVec3::ZERO))
        .cross(place(DVec3::Y) - place(DVec3::ZERO))
        .dot(place(DVec3::Z) - place(DVec3::ZERO))
        < 0.0;
    let count = (bytes.len() - 84) / 50;
    for record in (0..count).map(|k| 84 + 50 * k) {
        let number = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
        let corner = |c: usize| DVec3::from_array([0, 1, 2].map(|axis| number(record + 12 * (c + 1) + 4 * axis)));
        let mut corners = [place(corner(0)), place(corner(1)), place(corner(2))];
        if mirrors {
            corners.swap(1, 2);
        }
        for (k, value) in corners.iter().flat_map(DVec3::to_array).enumerate() {
            bytes[record + 12 + 4 * k..][..4].copy_from_slice(&(value as f32).to_le_bytes());
        }
    }
    fs::write(workshop.path("moved.stl"), bytes).unwrap();
}

/// The words of a verification of `moved.stl` on the block's bench that must succeed with the light
/// of the block.
fn righted(workshop: &Workshop, what: &str) -> String {
    let found = workshop.run(&format!("verify moved.stl --bench block.toml --max-error 0.05 {FEW}"));
    assert_eq!(found.code, FINE, "{what}: {}{}", found.out, found.err);
    assert!(found.err.contains("does not stand where its side file has it"), "{what}: {}", found.err);
    found.err
}

#[test]
fn blocks_that_were_moved_or_turned_are_judged_where_they_belong_with_a_word() {
    let workshop = good("chiral.png");
    moved(&workshop, |v| v + DVec3::new(300.0, 200.0, 50.0));
    let said = righted(&workshop, "moved");
    assert!(said.contains("moved by (-300, -200, -50) mm"), "{said}");
    moved(&workshop, |v| v + DVec3::Z * 12.0);
    assert!(righted(&workshop, "along the light").contains("moved by (0, 0, -12) mm"));
    moved(&workshop, |v| DVec3::new(v.x, v.z, -v.y));
    assert!(righted(&workshop, "y up").contains("turned by 90 degrees about x, it does"));
    let turn = |axis: DVec3, degrees: f64| DMat3::from_axis_angle(axis, degrees.to_radians());
    for (axis, degrees) in [
        (DVec3::X, 180.0),
        (DVec3::Y, 180.0),
        (DVec3::Y, 90.0),
        (DVec3::X, -90.0),
        (DVec3::Z, 10.0),
        (DVec3::X, 10.0),
        (DVec3::new(2.0, -1.0, 2.0).normalize(), 70.0),
    ] {
        moved(&workshop, |v| turn(axis, degrees) * v);
        let said = righted(&workshop, &format!("{degrees} about {axis}"));
        assert!(said.contains("turned by"), "{said}");
    }
    // A quarter turn about the light swaps the sides, and which way it went is seen by the picture.
    for degrees in [90.0, -90.0] {
        moved(&workshop, |v| turn(DVec3::Z, degrees) * v);
        let said = righted(&workshop, "about z");
        assert!(said.contains(&format!("turned by {} degrees about z", -degrees)), "{said}");
    }
}

#[test]
fn the_command_that_is_named_rights_the_file() {
    let workshop = good("chiral.png");
    let Some(_) = common::program("admesh", "Debian package admesh") else { return };
    for turn in [
        DMat3::from_axis_angle(DVec3::X, FRAC_PI_2),
        DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7),
    ] {
        moved(&workshop, |v| turn * v + DVec3::new(5.0, -7.0, 20.0));
        let said = righted(&workshop, "turned and moved");
        let command = said.split("this rights it: ").nth(1).unwrap().lines().next().unwrap();
        let mut words = command.split_whitespace();
        let mut admesh = common::program(words.next().unwrap(), "Debian package admesh").unwrap();
        common::output(admesh.args(words).current_dir(workshop.root()));
        let found = workshop.run(&format!("verify righted.stl --bench block.toml --max-error 0.05 {FEW}"));
        assert!(found.code == FINE && !found.err.contains("does not stand"), "{command}: {}", found.err);
    }
}

#[test]
fn a_picture_in_a_mirror_or_on_its_side_is_named() {
    let workshop = good("square.png");
    for (place, name) in [
        (DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)), "mirrored left to right"),
        (DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)), "mirrored top to bottom"),
        (DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0)), "turned by 180 degrees"),
        (DMat3::from_axis_angle(DVec3::Z, FRAC_PI_2), "turned by 90 degrees"),
        (DMat3::from_axis_angle(DVec3::Z, -FRAC_PI_2), "turned by 90 degrees"),
        (DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::Z), "mirrored and turned by 90 degrees"),
        // Lying on its side and mirrored: righted as far as turning goes.
        (DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y), "mirrored"),
    ] {
        moved(&workshop, |v| place * v);
        let found = workshop.run(&format!("verify moved.stl --bench block.toml --max-error 0.05 {FEW}"));
        assert!(found.code == SHORT && found.err.contains(name), "{name}: {}{}", found.out, found.err);
    }
    // Which of the four ways a block on its side was turned is seen by the picture.
    for quarters in 0..4 {
        let about = DMat3::from_axis_angle(DVec3::Z, FRAC_PI_2 * f64::from(quarters));
        moved(&workshop, |v| DMat3::from_axis_angle(DVec3::Y, FRAC_PI_2) * about * v);
        righted(&workshop, "on its side");
    }
}

#[test]
fn blocks_are_found_without_a_side_file_too() {
    let workshop = good("chiral.png");
    let bare =
        format!("verify moved.stl --ior 1.5 --distance 150mm --target chiral.png --offset 0.1 --max-error 0.05 {FEW}");
    moved(&workshop, |v| DVec3::new(v.x, v.z, -v.y) + DVec3::new(40.0, 30.0, 90.0));
    let found = workshop.run(&bare);
    assert!(found.code == FINE && found.err.contains("does not stand on the axis as blocks do"), "{}", found.err);
    // A size that nobody means, with what it would be.
    moved(&workshop, |v| v / 1000.0);
    let found = workshop.run(&bare);
    assert!(found.err.contains("if its numbers are metres, it is 60.00 x 40.00 mm large"), "{}", found.err);
    moved(&workshop, |v| v / 25.4);
    let found = workshop.run(&bare);
    assert!(found.err.contains("if its numbers are inches, it is 60.00 x 40.00 mm large"), "{}", found.err);
    assert!(!found.err.contains("mean of the image"), "{}", found.err);
}

#[test]
fn a_block_is_taken_as_it_stands_if_that_is_meant() {
    let workshop = good("chiral.png");
    let literally = format!("verify moved.stl --bench block.toml --as-placed --max-error 0.05 {FEW}");
    moved(&workshop, |v| v + DVec3::Z * 12.0);
    let found = workshop.run(&literally);
    assert!(found.err.contains("mean exit plane is at z = 12.000 mm"), "{}", found.err);
    moved(&workshop, |v| v + DVec3::new(30.0, 0.0, 0.0));
    assert_eq!(workshop.run(&literally).code, SHORT);
    for place in [DVec3::new(3000.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 140.0)] {
        moved(&workshop, |v| v + place);
        let found = workshop.run(&literally);
        assert!(found.code != FINE && !found.err.contains("mean of the image"), "{}", found.err);
    }
    moved(&workshop, |v| v + DVec3::new(3000.0, 0.0, 0.0));
    assert!(workshop.run(&literally).err.contains("no light falls into the window"));
}

/// The number on the line of this text that begins with these words.
fn number(out: &str, words: &str) -> f64 {
    let line =
        out.lines().find_map(|line| line.trim().strip_prefix(words)).unwrap_or_else(|| panic!("{words}:\n{out}"));
    line.split_whitespace().find_map(|word| word.parse().ok()).unwrap_or_else(|| panic!("no number in {line}"))
}

#[test]
fn checks_and_milling_take_a_block_as_it_stands_too() {
    let workshop = good("chiral.png");
    // Nearer to the receiver, or beside its place: the error is that of a look at the file.
    for place in [DVec3::Z * 12.0, DVec3::new(4.0, 0.0, 0.0)] {
        moved(&workshop, |v| v + place);
        let bench = "moved.stl --bench block.toml --as-placed";
        let seen = number(&workshop.run(&format!("verify {bench} {FEW}")).out, "relative RMS");
        let milled = workshop.run(&format!("mill {bench} --step-over 0.5mm"));
        let checked = workshop.run(&format!("check {bench} --polish 0.2mm --tolerance --source-size 0.53deg"));
        for found in [&milled, &checked] {
            assert!(!found.err.contains("does not stand where"), "{}", found.err);
            assert!(found.err.contains("mean exit plane") || place.z == 0.0, "{}", found.err);
            let error = number(&found.out, "as designed");
            assert!((error - seen).abs() < 2e-4, "{place}: {error}, and {seen} is seen\n{}", found.out);
        }
        let righted = workshop.run("mill moved.stl --bench block.toml --step-over 0.5mm");
        assert!(number(&righted.out, "as designed") < 0.1 * seen, "{place}: {}", righted.out);
    }
    workshop.refuses(
        "mill moved.stl --bench block.toml --as-placed -o milled.stl",
        REFUSED,
        &["--as-placed", "written"],
    );
    fs::write(workshop.path("design.toml"), "[design]\npicture = \"chiral.png\"\nnodes = 65\n").unwrap();
    workshop.refuses("check design.toml --as-placed", REFUSED, &["--as-placed", "not about a design"]);
}

/// A STEP file with every point and direction in space sent through a turn, points moved then.
fn turned_step(text: &str, turn: DMat3, shift: DVec3) -> String {
    let (mut turned, mut rest) = (String::new(), text);
    while let Some(at) = ["CARTESIAN_POINT('',(", "DIRECTION('',("]
        .iter()
        .filter_map(|kind| rest.find(kind).map(|at| at + kind.len()))
        .min()
    {
        let end = at + rest[at..].find(')').unwrap();
        let numbers: Vec<f64> = rest[at..end].split(',').map(|word| word.parse().unwrap()).collect();
        turned += &rest[..at];
        match numbers[..] {
            [x, y, z] => {
                let is_point = rest[..at].ends_with("POINT('',(");
                let [x, y, z] = (turn * DVec3::new(x, y, z) + if is_point { shift } else { DVec3::ZERO }).to_array();
                turned += &format!("{x:?},{y:?},{z:?}");
            }
            // In the plane of parameters.
            _ => turned += &rest[at..end],
        }
        rest = &rest[end..];
    }
    turned + rest
}

#[test]
fn step_files_are_found_however_they_are_turned() {
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    let turn = |axis: DVec3, degrees: f64| DMat3::from_axis_angle(axis, degrees.to_radians());
    let oblique = DVec3::new(2.0, -1.0, 2.0).normalize();
    let some = [(DVec3::X, -90.0), (DVec3::Z, 90.0), (oblique, 70.0)];
    let more = [(DVec3::X, 90.0), (DVec3::X, 180.0), (DVec3::Y, 90.0), (DVec3::Z, 10.0)];
    // Around a curve more beams are traced, which takes longer.
    for (outline, turns) in [
        ("", [&some[..], &more].concat()),
        ("--outline circle", some.to_vec()),
        ("--outline rounded:8mm --rim 6mm,1mm --mark 3mm --origin corner", some[2..].to_vec()),
    ] {
        let design = "--size 60mm --distance 150mm --ior 1.5 --nodes 65 --no-verify --no-report --force";
        let made = workshop.run(&format!("design chiral.png -o block.step {design} {outline}"));
        assert_eq!(made.code, FINE, "{}", made.err);
        let plain = workshop.run(&format!("verify block.step {FEW}"));
        assert!(plain.code == FINE && !plain.err.contains("does not stand"), "{}", plain.err);
        let error = number(&plain.out, "relative RMS");
        let text = fs::read_to_string(workshop.path("block.step")).unwrap();
        for (axis, degrees) in turns {
            let turned = turned_step(&text, turn(axis, degrees), DVec3::new(5.0, -7.0, 20.0));
            fs::write(workshop.path("moved.step"), turned).unwrap();
            let found = workshop.run(&format!("verify moved.step --bench block.toml {FEW}"));
            let what = format!("{outline}, {degrees} about {axis}: {}{}", found.out, found.err);
            assert!(found.code == FINE && found.err.contains("turned by"), "{what}");
            // The same light, but for the last decimal that is printed: by the face itself, and not by
            // a fit through nodes of it.
            assert!((number(&found.out, "relative RMS") - error).abs() < 1.0001e-4, "{error}, {what}");
        }
        let literally = workshop.run(&format!("verify moved.step --bench block.toml --as-placed {FEW}"));
        assert!(!literally.err.contains("does not stand where"), "{outline}: {}", literally.err);
        assert!(literally.code != FINE || number(&literally.out, "relative RMS") > 0.05, "{}", literally.out);
    }
}

#[test]
fn all_commands_find_a_moved_block() {
    let workshop = good("chiral.png");
    moved(&workshop, |v| DVec3::new(v.x, v.z, -v.y) + DVec3::new(10.0, 20.0, 30.0));
    for line in [
        "mill moved.stl --bench block.toml --cutter ball:3mm --step-over 0.5mm --pixels 64",
        "check moved.stl --bench block.toml --min-thickness 0.5mm",
        "crosscheck moved.stl --bench block.toml --with povray --write-only --pixels 64",
    ] {
        let (found, plain) = (workshop.run(line), workshop.run(&line.replace("moved.stl", "block.stl")));
        assert!(found.err.contains("does not stand where its side file has it"), "{line}: {}", found.err);
        assert_eq!(found.code, plain.code, "{line}: {}{}", found.err, plain.err);
        // In single precision the moved block is a rounding off.
        let lines = |out: &str| out.lines().filter(|line| !line.starts_with("Will it work?")).nth(1).map(str::to_owned);
        let first = |out: &str| lines(out).unwrap_or_default().chars().take(10).collect::<String>();
        assert_eq!(first(&found.out), first(&plain.out), "{line}");
    }
}

#[test]
fn a_ribbon_takes_no_more_time_than_a_block_of_its_size() {
    let workshop = Workshop::new();
    // 4 nodes across, 6000 along, each 1/3 mm from the next.
    let (across, along) = (4, 6000);
    let place = |i: usize, j: usize| DVec3::new(i as f64, j as f64, 0.03 * (j as f64).cos()) / 3.0;
    let node = |i: usize, j: usize| j * across + i;
    let mut vertices: Vec<DVec3> = (0..across * along).map(|k| place(k % across, k / across)).collect();
    let mut faces = Vec::new();
    for j in 0..along - 1 {
        for i in 0..across - 1 {
            faces.push(vec![node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]);
        }
    }
    let mut border: Vec<usize> = (0..across - 1).map(|i| node(i, 0)).collect();
    border.extend((0..along - 1).map(|j| node(across - 1, j)));
    border.extend((1..across).rev().map(|i| node(i, along - 1)));
    border.extend((1..along).rev().map(|j| node(0, j)));
    let first = vertices.len();
    let floor: Vec<DVec3> = border.iter().map(|&v| vertices[v].truncate().extend(-2.0)).collect();
    vertices.extend(floor);
    let n = border.len();
    faces.extend((0..n).map(|k| vec![first + k, first + (k + 1) % n, border[(k + 1) % n], border[k]]));
    faces.push((0..n).rev().map(|k| first + k).collect());
    let mut text = format!("OFF\n{} {} 0\n", vertices.len(), faces.len());
    vertices.iter().for_each(|v| text += &format!("{} {} {}\n", v.x, v.y, v.z));
    for face in faces {
        text += &format!("{} {}\n", face.len(), face.iter().map(usize::to_string).collect::<Vec<_>>().join(" "));
    }
    fs::write(workshop.path("ribbon.off"), text).unwrap();
    let found = workshop.run("verify ribbon.off --ior 1.5 --distance 100mm --pixels 256 --photons 10000");
    assert_eq!(found.code, FINE, "{}", found.err);
    // As many pixels as in a square window, or twice as many, however long the ribbon is.
    let pixels = found.out.split("go? (").nth(1).unwrap().split(" pixels").next().unwrap();
    let (wide, high) = pixels.split_once(" x ").unwrap();
    let pixels = wide.parse::<usize>().unwrap() * high.parse::<usize>().unwrap();
    assert!(pixels <= 2 * 256 * 256, "{wide} x {high}");
}
