//! Blocks with something wrong, and what the commands say of them.

mod common;

use common::{
    measured::at_worst,
    workshop::{FINE, MESH, SHORT, Workshop},
};
use std::fs;

/// A good block, 60 x 40 mm for 150 mm and index 1.5, in `block.stl`.
fn good() -> Workshop {
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    design(&workshop, "block", 150.0, 1.5);
    let line = verify(&workshop, "block");
    assert!(line.0 == FINE && line.1.is_empty(), "{}", line.1);
    workshop
}

fn design(workshop: &Workshop, name: &str, distance: f64, ior: f64) {
    let line = format!(
        "design chiral.png -o {name}.stl --size 60mm --distance {distance}mm --ior {ior} --nodes 129 --no-verify"
    );
    let made = workshop.run(&line);
    assert_eq!(made.code, FINE, "{}", made.err);
}

/// Exit code and standard error of a strict verification on the good block's bench.
fn verify(workshop: &Workshop, name: &str) -> (i32, String) {
    let outcome = workshop.run(&format!("verify {name}.stl --bench block.toml --max-error 0.05 --photons 100000"));
    (outcome.code, outcome.err)
}

/// Writes `wrong.stl`: every triangle of the good block (normal and corners) sent through `change`,
/// and some left out.
fn spoil(workshop: &Workshop, change: impl Fn(usize, [[f32; 3]; 3]) -> Option<[[f32; 3]; 3]>) {
    let bytes = fs::read(workshop.path("block.stl")).unwrap();
    let number = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let count = u32::from_le_bytes(bytes[80..84].try_into().unwrap()) as usize;
    let changed: Vec<_> = (0..count)
        .filter_map(|k| {
            let corner = |c: usize| [0, 1, 2].map(|axis| number(84 + 50 * k + 12 + 12 * c + 4 * axis));
            change(k, [corner(0), corner(1), corner(2)])
        })
        .collect();
    let mut out = bytes[..80].to_vec();
    out.extend((changed.len() as u32).to_le_bytes());
    for triangle in changed {
        out.extend([0; 12]);
        triangle.iter().flatten().for_each(|v| out.extend(v.to_le_bytes()));
        out.extend([0; 2]);
    }
    fs::write(workshop.path("wrong.stl"), out).unwrap();
}

/// Both commands refuse `wrong.stl` as no block, with these words.
fn refused_as_mesh(workshop: &Workshop, words: &[&str]) {
    let block = "wrong.stl --bench block.toml";
    workshop.refuses(&format!("verify {block}"), MESH, words);
    workshop.refuses(&format!("crosscheck {block} --with povray --write-only"), MESH, words);
}

#[test]
fn flipped_normals_are_named() {
    let workshop = good();
    // Of all triangles: there is one way to mean it.
    spoil(&workshop, |_, [a, b, c]| Some([a, c, b]));
    let (code, said) = verify(&workshop, "wrong");
    assert!(code == FINE && said.contains("all triangles of wrong.stl face inwards"), "{said}");
    let outcome = workshop.run("verify wrong.stl --bench block.toml --as-placed");
    assert!(outcome.code == MESH && outcome.err.contains("inside out"), "{}", outcome.err);
    // One triangle of the whole block.
    spoil(&workshop, |k, [a, b, c]| Some(if k == 1000 { [a, c, b] } else { [a, b, c] }));
    refused_as_mesh(&workshop, &["wrong.stl", "opposite orientation"]);
}

#[test]
fn a_missing_triangle_is_named() {
    let workshop = good();
    spoil(&workshop, |k, triangle| (k != 1000).then_some(triangle));
    refused_as_mesh(&workshop, &["wrong.stl", "3 open edges", "triangles are missing"]);
}

#[test]
fn a_truncated_file_is_named() {
    let workshop = good();
    let bytes = fs::read(workshop.path("block.stl")).unwrap();
    fs::write(workshop.path("wrong.stl"), &bytes[..bytes.len() / 2]).unwrap();
    refused_as_mesh(&workshop, &["wrong.stl", "truncated"]);
}

#[test]
fn a_mirrored_picture_is_named() {
    let workshop = good();
    for (axis, name) in [(0, "mirrored left to right"), (1, "mirrored top to bottom")] {
        spoil(&workshop, |_, triangle| {
            let [a, b, c] = triangle.map(|mut v| {
                v[axis] = -v[axis];
                v
            });
            Some([a, c, b])
        });
        let (code, said) = verify(&workshop, "wrong");
        assert!(code == SHORT && said.contains(name), "{axis}: {said}");
    }
    spoil(&workshop, |_, triangle| Some(triangle.map(|[x, y, z]| [-x, -y, z])));
    let (code, said) = verify(&workshop, "wrong");
    assert!(code == SHORT && said.contains("turned by 180 degrees"), "{said}");
}

#[test]
fn other_units_are_named() {
    let workshop = good();
    for (factor, unit, right) in [
        (1.0 / 25.4, "inches taken for millimetres", "scale it by 25.4"),
        (0.001, "metres taken for millimetres", "scale it by 1000"),
        (10.0, "millimetres taken for centimetres", "scale it by 0.1"),
    ] {
        spoil(&workshop, |_, triangle| Some(triangle.map(|v| v.map(|x| x * factor))));
        refused_as_mesh(&workshop, &["wrong.stl", unit, right, "--as-placed"]);
        let outcome = workshop.run("verify wrong.stl --bench block.toml --as-placed --max-error 0.05 --photons 100000");
        assert!(outcome.code != FINE && outcome.err.contains(unit), "{}", outcome.err);
        assert!(!outcome.err.contains("mean of the image"), "{}", outcome.err);
    }
    // Larger by no unit's number: judged as it is, with what it measures.
    spoil(&workshop, |_, triangle| Some(triangle.map(|v| v.map(|x| x * 1.25))));
    let (code, said) = verify(&workshop, "wrong");
    assert!(code == SHORT && said.contains("1.25000 and 1.25000 times what its side file says"), "{said}");
}

#[test]
fn another_index_is_named() {
    let workshop = good();
    // Made for 1.45, examined as 1.5.
    design(&workshop, "wrong", 150.0, 1.45);
    let (code, said) = verify(&workshop, "wrong");
    assert!(code == SHORT, "{said}");
    let index = said.split("index of about ").nth(1).and_then(|s| s.split_whitespace().next()).expect(&said);
    let index: f64 = index.parse().unwrap();
    // Named to the last of three decimals.
    at_worst(1e-3, (index - 1.45).abs(), said);
}

#[test]
fn another_distance_is_named() {
    let workshop = good();
    for distance in [135.0, 165.0] {
        design(&workshop, "wrong", distance, 1.5);
        let (code, said) = verify(&workshop, "wrong");
        assert!(code == SHORT, "{said}");
        let named = said.split("much better at ").nth(1).and_then(|s| s.split_whitespace().next()).expect(&said);
        let named: f64 = named.parse().unwrap();
        // Named to the millimetre.
        at_worst(1.0, (named - distance).abs(), format_args!("made for {distance}: {said}"));
    }
}
