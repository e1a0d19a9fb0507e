//! The command line as a person types it.

mod common;

use assert_cmd::Command;
use common::{
    measured::{at_worst, nothing_but_rounding, prints_within_tenth_of, within_tenth_of},
    workshop::{FILE, FINE, MESH, REFUSED, SHORT, Workshop},
};
use image::{GrayImage, Luma, LumaA, Rgba};
use std::{fs, path::Path};

#[test]
fn a_picture_becomes_files_of_every_format_with_a_side_file_and_pictures() {
    let workshop = Workshop::new();
    let outcome = workshop
        .run("design -v --pictures picture.png -o block.stl -o block.glb -o block.obj --nodes 97 --transfer linear");
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    for name in [
        "block.stl",
        "block.glb",
        "block.obj",
        "block.toml",
        "block.panel.png",
        "block.caustic.png",
        "block.difference.png",
        "block.budget.png",
        "block.contours.png",
        "block.drawing.png",
    ] {
        assert!(fs::metadata(workshop.path(name)).is_ok_and(|m| m.len() > 100), "{name} of {:?}", workshop.files());
    }
    for word in ["relative RMS", "SSIM", "250 mm", "mean plane of the exit face", "100.00 x 66.67 mm"] {
        assert!(outcome.out.contains(word), "'{word}' is not in\n{}", outcome.out);
    }
    for step in [
        "the solver's own map",
        "the height field in f64: nodes within",
        "block.stl read back, its smooth surface",
        "on the normal-mapped plane (the paper's assumption)",
        "smooth normals",
        "flat triangles",
        "block.glb read back",
        "block.obj read back: the vertices of block.stl, bit by bit",
        "the paper's plane would be wrong by",
    ] {
        assert!(outcome.out.contains(step), "'{step}' is not in\n{}", outcome.out);
    }
    assert!(workshop.files().iter().all(|name| !name.contains(".part")));
}

#[test]
fn a_workshop_gets_its_files_its_frame_and_what_each_of_them_costs() {
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    let outcome = workshop.run(
        "design -v --pictures chiral.png -o block.stl -o block.step -o block.3mf -o block.ply --height-map block.heights.png \
         --height-map block.heights.exr --nodes 97 --thickness 20mm --rim 8mm,2mm --mark 5mm --origin corner \
         --step-tolerance 0.001",
    );
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    for line in [
        "block.step read back",
        "block.3mf read back",
        "block.ply read back: the vertices of block.stl, bit by bit",
        "block.heights.png read back",
        "block.heights.exr read back",
        "control points",
        "116.00 x 82.67 mm in all",
        "at the corner of least x and y in the entry face",
    ] {
        assert!(outcome.out.contains(line), "'{line}' is not in\n{}", outcome.out);
    }
    // Every file draws the picture by itself, from its own origin, to the last digit printed.
    let judged = |name: &str| {
        let judged = workshop.run(&format!("verify {name} --photons 100000"));
        assert!(judged.code == FINE && judged.err.is_empty(), "{name}: {}{}", judged.out, judged.err);
        figure(&judged.out, "relative RMS")
    };
    let stl = judged("block.stl");
    for name in ["block.step", "block.3mf", "block.ply", "block.heights.exr"] {
        at_worst(1e-4, (judged(name) - stl).abs(), name);
    }
    let side: toml::Table = fs::read_to_string(workshop.path("block.toml")).unwrap().parse().unwrap();
    assert_eq!(side["frame"]["origin"].as_str(), Some("corner"));
    assert_eq!(side["frame"]["origin-mm"][0].as_float(), Some(-58.0));
    assert_eq!(side["frame"]["stock-width-mm"].as_float(), Some(116.0));
    assert_eq!(side["design"]["rim"].as_str(), Some("8mm,2mm"));
    let maps: toml::Table = fs::read_to_string(workshop.path("block.heights.toml")).unwrap().parse().unwrap();
    let pitch = maps["height-maps"]["block.heights.png"]["MmPerPixelX"].as_float().unwrap();
    nothing_but_rounding(pitch - 100.0 / 96.0, "pitch");
    // The side file makes the same block again, bit by bit.
    assert_eq!(workshop.run("design block.toml -o again.step -o again.stl --no-verify").code, FINE);
    for format in ["stl", "step"] {
        let [first, again] =
            ["block", "again"].map(|name| fs::read(workshop.path(&format!("{name}.{format}"))).unwrap());
        let (first, again) = if format == "stl" { (&first[84..], &again[84..]) } else { (&first[..], &again[..]) };
        assert!(first == again, "{format}");
    }

    let step = fs::read(workshop.path("block.step")).unwrap();
    fs::write(workshop.path("cut.step"), &step[..step.len() / 2]).unwrap();
    workshop.refuses("verify cut.step --bench block.toml", MESH, &["cut.step", "STEP", "truncated"]);
    workshop.refuses("verify block.panel.png --bench block.toml", MESH, &["block.panel.png", "height map"]);
}

#[test]
fn senseless_rims_origins_and_tolerances_are_refused() {
    let workshop = Workshop::new();
    let line = "design picture.png -o block.step --nodes 65";
    for (flags, words) in [
        ("--step-tolerance 0", ["tolerance of the STEP face is 0 um", "0.00001 um"]),
        ("--step-tolerance -3", ["-3 um", "1000 um"]),
        ("--step-tolerance 1e-9", ["0.000000001 um", "resolution of the file"]),
        ("--step-tolerance fine", ["fine", "--step-tolerance"]),
        ("--rim 200mm,2mm", ["200 mm", "66.6"]),
        ("--rim 0mm,2mm", ["0 mm", "0.5 mm"]),
        ("--rim -5mm,2mm", ["-5 mm", "0.5 mm"]),
        ("--rim 10mm", ["10mm", "10mm,2mm"]),
        ("--rim 10mm,-0.2mm", ["-0.2 mm", "flange"]),
        ("--rim 10mm,-90mm", ["-90 mm", "flange"]),
        ("--rim 10mm,2mm --mark 11mm", ["11 mm", "10 mm"]),
        ("--mark 3mm", ["--mark", "--rim"]),
        ("--origin middle", ["middle", "stock-top"]),
        ("--height-map heights.tif", ["heights.tif", ".exr"]),
    ] {
        workshop.refuses(&format!("{line} {flags}"), REFUSED, &words);
    }
}

/// The number that follows `name` on its line.
fn figure(text: &str, name: &str) -> f64 {
    let line =
        text.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_else(|| panic!("{name}:\n{text}"));
    line.trim_start()[name.len()..].split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn the_budget_tells_the_plane_from_the_surface() {
    let workshop = Workshop::new();
    let near = workshop.run("design -v picture.png -o near.stl --nodes 97 --distance 60").out;
    let far = workshop.run("design -v picture.png -o far.stl --nodes 97 --distance 900").out;
    for out in [&near, &far] {
        // The solver's view of its own surface and the verifier's of the file are one light, and
        // the file has all digits that matter.
        let own = figure(out, "the solver's own map");
        let step = format!("{}.stl read back, its smooth surface", if out == &near { "near" } else { "far" });
        at_worst(1e-4, (figure(out, &step) - own).abs(), format_args!("{step}: {out}"));
        let rounded = out.lines().find(|line| line.contains("the height field in f64")).unwrap();
        let most_um: f64 = rounded.split("light within ").nth(1).unwrap().trim_end_matches(" um").parse().unwrap();
        at_worst(0.7, most_um, rounded);
    }
    let plane = |out| figure(out, "on the normal-mapped plane (the paper's assumption)");
    prints_within_tenth_of(0.1657, plane(&near), "near, on the plane");
    prints_within_tenth_of(0.0006, plane(&far), "far, on the plane");
}

/// Text of a closed plano-convex lens as PLY: a spherical cap of radius 60 mm on a disc of radius
/// 20 mm.
fn lens_ply() -> String {
    let (rings, sectors, radius, rim) = (40, 96, 60.0_f64, 20.0_f64);
    let height = |r: f64| (radius * radius - r * r).sqrt() - (radius * radius - rim * rim).sqrt();
    let mut vertices = vec![(0.0, 0.0, height(0.0)), (0.0, 0.0, 0.0)];
    let mut faces = Vec::new();
    for k in 1..=rings {
        let r = rim * f64::from(k) / f64::from(rings);
        for s in 0..sectors {
            let angle = std::f64::consts::TAU * f64::from(s) / f64::from(sectors);
            vertices.push((r * angle.cos(), r * angle.sin(), height(r)));
        }
    }
    let at = |ring: i32, s: i32| if ring == 0 { 0 } else { 2 + (ring - 1) * sectors + s % sectors };
    for s in 0..sectors {
        faces.push(vec![0, at(1, s), at(1, s + 1)]);
        faces.push(vec![1, at(rings, s + 1), at(rings, s)]);
        (1..rings).for_each(|k| faces.push(vec![at(k, s), at(k + 1, s), at(k + 1, s + 1), at(k, s + 1)]));
    }
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        faces.len()
    );
    vertices.iter().for_each(|(x, y, z)| text += &format!("{x} {y} {z}\n"));
    for face in &faces {
        let indices: Vec<String> = face.iter().map(ToString::to_string).collect();
        text += &format!("{} {}\n", face.len(), indices.join(" "));
    }
    text
}

#[test]
fn a_solid_of_others_is_traced_without_a_side_file() {
    let workshop = Workshop::new();
    fs::write(workshop.path("lens.ply"), lens_ply()).unwrap();
    // Focal length 60 / (1.5 - 1) = 120 mm; the light passes through 39.9 x 39.9 mm minus the
    // corners.
    let line = "verify lens.ply --ior 1.5 --distance 120 --window 8mm --pixels 32 --photons 200000 -o focus.exr";
    let outcome = workshop.run(line);
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    assert!(outcome.out.contains("solid, traced as its flat triangles"), "{}", outcome.out);
    let disc = 100.0 * std::f64::consts::PI / 4.0;
    let (window, beside) = (figure(&outcome.out, "light"), 100.0 - disc);
    at_worst(0.0399, (window - disc).abs(), &outcome.out);
    let passed = outcome.out.lines().find(|line| line.contains("passes beside")).unwrap();
    at_worst(0.0399, (passed.split_whitespace().next().unwrap().parse::<f64>().unwrap() - beside).abs(), passed);
    // A picture may be wanted of it, and then it is judged.
    let judged = workshop.run(&format!("{line} --target picture.png --max-error 0.01"));
    assert_eq!(judged.code, SHORT, "{}", judged.err);
    workshop.refuses("verify lens.ply --ior 1.5", REFUSED, &["side file", "--distance"]);
    workshop.refuses("verify lens.ply --ior 1.5 --distance 2 --pixels 8", REFUSED, &["not beyond the solid"]);
    workshop.refuses("verify lens.ply --ior 0.5 --distance 99 --pixels 8", REFUSED, &["index", "0.5"]);
    workshop.refuses("verify lens.ply --ior 1.5 --distance 99 --window 1x2x3", REFUSED, &["1x2x3"]);
    workshop.refuses(&format!("{line} --max-error 0.01"), REFUSED, &["--target"]);
    let open = lens_ply().replace("element face 3936", "element face 3935");
    assert_ne!(open, lens_ply());
    fs::write(workshop.path("open.ply"), open).unwrap();
    workshop.refuses("verify open.ply --ior 1.5 --distance 120 --pixels 8", MESH, &["open edges"]);
}

#[test]
fn a_file_of_ones_own_is_not_replaced_by_a_side_file() {
    let workshop = Workshop::new();
    let own = "[design]\npicture = \"picture.png\"\nnodes = 65\n";
    fs::write(workshop.path("design.toml"), own).unwrap();
    workshop.refuses(
        "design design.toml -o design.stl",
        REFUSED,
        &["design.toml", "which this command reads", "another name"],
    );
    fs::write(workshop.path("q.toml"), own).unwrap();
    workshop.refuses(
        "design picture.png -o q.stl --nodes 65",
        REFUSED,
        &["q.toml", "was not written by glasswarp", "--force"],
    );
    assert_eq!(fs::read_to_string(workshop.path("design.toml")).unwrap(), own);
    for _ in 0..2 {
        assert_eq!(workshop.run("design design.toml -o other.stl --no-verify").code, FINE, "side files are renewed");
    }
}

#[test]
fn a_gate_that_would_not_run_is_refused() {
    let workshop = Workshop::new();
    for limit in ["1e-7", "nan", "inf", "-1", "much"] {
        workshop.refuses(
            &format!("design picture.png -o b.stl --nodes 33 --no-verify --max-error={limit}"),
            REFUSED,
            &["--max-error"],
        );
    }
    assert_eq!(workshop.run("design picture.png -o b.stl --nodes 33 --no-verify --no-report").code, FINE);
    for line in [
        "verify b.stl --max-error nan",
        "verify b.stl --sweep distance=200..300 --max-error 0.1",
        "mill b.stl --max-error nan",
        "mill b.stl --want-error 0.1",
        "verify merge t.exr --max-error 0.1",
        "crosscheck b.stl --with povray --write-only --max-difference 0.1",
        "crosscheck b.stl --with povray --max-difference nan",
    ] {
        workshop.refuses(line, REFUSED, &["--"]);
    }
    // What chance makes of the photons is said, and a limit is kept to.
    let judged = workshop.run("verify b.stl --photons 200000 --max-error 1e-7");
    assert_eq!(judged.code, SHORT, "{}", judged.err);
    assert!(judged.out.contains("agree: off by"), "{}", judged.out);
    assert!(judged.out.contains("standard errors (up to 2 is expected 19 times in 20)"), "{}", judged.out);
}

#[test]
fn settings_that_exclude_each_other_are_refused_wherever_they_stand() {
    let workshop = Workshop::new();
    let line = |flags: &str| format!("design picture.png -o b.stl --nodes 33 --no-verify --no-report {flags}");
    for (flags, file, words) in [
        ("--ior 1.6 --material pmma", "ior = 1.6\nmaterial = \"pmma\"", ["ior", "material"]),
        ("--ior 1.6 --wavelength 532nm", "ior = 1.6\nwavelength = \"532nm\"", ["ior", "wavelength"]),
        ("--beam x.png --emission lambertian", "beam = \"x.png\"\nemission = \"lambertian\"", ["beam", "emission"]),
        (
            "--light parallel --emission lambertian",
            "light = \"parallel\"\nemission = \"lambertian\"",
            ["light", "emission"],
        ),
        (
            "--light parallel --source-distance 1m",
            "light = \"parallel\"\nsource-distance = \"1m\"",
            ["light", "source-distance"],
        ),
    ] {
        workshop.refuses(&line(flags), REFUSED, &[words[0], words[1], "cannot be used with", "leave one of them out"]);
        let text = format!("[design]\npicture = \"picture.png\"\nnodes = 33\n{file}\n");
        fs::write(workshop.path("d.toml"), text).unwrap();
        let in_file = "design d.toml -o b.stl --no-verify --no-report";
        workshop.refuses(in_file, REFUSED, &[words[0], words[1], "cannot be used with", "d.toml:4:1", "d.toml:5:1"]);
    }
    // Across both, the flag goes before the file, and says so.
    fs::write(
        workshop.path("d.toml"),
        "[design]\npicture = \"picture.png\"\nnodes = 33\nmaterial = \"pmma\"\nlight = \"parallel\"\n",
    )
    .unwrap();
    let outcome = workshop.run("design -v d.toml -o b.stl --no-verify --no-report --ior 1.6 --source-distance 1m");
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    assert!(outcome.out.contains("index 1.6") && outcome.out.contains("a point 1000.0 mm away"), "{}", outcome.out);
    for word in
        ["--ior takes the place of material in d.toml", "--source-distance takes the place of light parallel in d.toml"]
    {
        assert!(outcome.err.contains(word), "{}", outcome.err);
    }
}

#[test]
fn parts_of_a_photon_run_merge_to_the_whole_byte_by_byte() {
    let workshop = Workshop::new();
    assert_eq!(workshop.run("design picture.png -o block.stl --nodes 65 --no-verify").code, FINE);
    let line = "verify block.stl --photons 30000 --seed 7 --pixels 24";
    for part in 1..=3 {
        let outcome = workshop.run(&format!("{line} --shard {part}/3 --tally part{part}.exr"));
        assert_eq!(outcome.code, FINE, "{}", outcome.err);
    }
    assert_eq!(workshop.run(&format!("{line} --tally whole.exr")).code, FINE);
    let outcome =
        workshop.run("verify merge part2.exr part3.exr part1.exr --tally merged.exr -o light.exr -o light.png");
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    assert!(outcome.out.contains("the whole run"), "{}", outcome.out);
    let bytes = |name: &str| fs::read(workshop.path(name)).unwrap();
    assert!(bytes("merged.exr") == bytes("whole.exr"));
    // Judged against the picture, the sum says what one run of all says.
    let verdict = |out: &str| out.split_once("Does the light").expect(out).1.to_owned();
    let offset = "--offset 0.1 --target picture.png";
    let whole = workshop.run(&format!("{line} --tally again.exr {offset}"));
    let sum = workshop.run(&format!("verify merge part3.exr part1.exr part2.exr {offset}"));
    assert!(whole.code == FINE && sum.code == FINE, "{}{}", whole.err, sum.err);
    assert_eq!(verdict(&whole.out), verdict(&sum.out));
    // Another offset is another picture.
    let short = workshop.run("verify merge merged.exr --target picture.png --offset 3 --max-error 0.1");
    assert_eq!(short.code, SHORT, "{}{}", short.out, short.err);
    assert_eq!(workshop.run("verify merge whole.exr -o whole-light.exr").code, FINE);
    assert!(bytes("light.exr") == bytes("whole-light.exr"));

    let half = workshop.run("verify merge part1.exr part2.exr");
    assert!(half.code == FINE && half.out.contains("a part of the run"), "{}", half.out);
    workshop.refuses("verify merge part1.exr part2.exr part1.exr --tally x.exr", REFUSED, &["in both", "part1.exr"]);
    assert_eq!(
        workshop
            .run("verify block.stl --distance 251 --photons 30000 --seed 7 --pixels 24 --shard 3/3 --tally other.exr")
            .code,
        FINE
    );
    workshop.refuses("verify merge part1.exr other.exr", REFUSED, &["another bench", "other.exr"]);
    workshop.refuses("verify merge light.exr", REFUSED, &["light.exr", "no photon tally"]);
    workshop.refuses("verify merge nothing.exr", FILE, &["nothing.exr"]);
    workshop.refuses("verify merge part1.exr -o light.jpg", REFUSED, &[".exr"]);
    workshop.refuses(&format!("{line} --shard 0/3 --tally x.exr"), REFUSED, &["0/3", "1/"]);
    workshop.refuses(&format!("{line} --shard 1/3"), REFUSED, &["--tally"]);
    workshop.refuses(&format!("{line} --shard 1/300 --tally x.exr"), REFUSED, &["shards is 300", "128"]);
}

#[test]
fn a_sweep_gives_numbers_images_and_curves() {
    let workshop = Workshop::new();
    assert_eq!(workshop.run("design picture.png -o block.stl --nodes 65 --no-verify").code, FINE);
    let outcome =
        workshop.run("verify block.stl --sweep distance=80..800 --steps 3 -o sweep.csv -o sweep.exr -o sweep.png");
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    assert!(outcome.out.contains("r = relief / distance"), "{}", outcome.out);
    let columns = |name: &str, wanted: &str| -> Vec<f64> {
        let text = fs::read_to_string(workshop.path(name)).unwrap();
        let mut lines = text.lines();
        let at = lines.next().unwrap().split(',').position(|column| column == wanted).unwrap();
        lines.map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect()
    };
    assert_eq!(columns("sweep.csv", "distance_mm"), [80.0, 252.9822, 800.0]);
    for falls in ["plane_rel_rms", "relief_mm", "plane_moves"] {
        assert!(columns("sweep.csv", falls).windows(2).all(|pair| pair[1] < pair[0]), "{falls}");
    }
    let exr = exr::prelude::read_all_flat_layers_from_file(workshop.path("sweep.exr")).unwrap();
    let names: Vec<String> =
        exr.layer_data.iter().map(|layer| layer.attributes.layer_name.clone().unwrap().to_string()).collect();
    assert_eq!(names.len(), 3 * 4);
    assert!(names[..2] == ["distance_mm=80 displaced", "distance_mm=80 plane"], "{names:?}");
    assert_eq!(image::open(workshop.path("sweep.png")).unwrap().width(), 900);

    // One block away from its bench is wrong; designed anew it is not.
    let off = workshop.run("verify block.stl --sweep distance=125..500 --steps 3 --as-built -o off.csv");
    assert_eq!(off.code, FINE, "{}", off.err);
    let (built, anew) = (columns("off.csv", "displaced_rel_rms"), columns("sweep.csv", "displaced_rel_rms"));
    for (measured, found) in [0.2296, 3.51e-4, 0.7413].into_iter().zip(built) {
        within_tenth_of(measured, found, "as built");
    }
    for (measured, found) in [3.76e-4, 3.51e-4, 3.47e-4].into_iter().zip(anew) {
        within_tenth_of(measured, found, "designed anew");
    }
    for (range, column) in [("size=80..160", "size_mm"), ("index=1.45..1.6", "index"), ("nodes=33..65", "nodes")] {
        let outcome = workshop.run(&format!("verify block.stl --sweep {range} --steps 2 -o one.csv"));
        assert_eq!(outcome.code, FINE, "{}", outcome.err);
        assert_eq!(columns("one.csv", column), columns("one.csv", "value"), "{range}");
    }
    // Light along the axis does not care how thick the block is; a sheet that the relief does not
    // fit into is passed over.
    let outcome = workshop.run("verify block.stl --sweep thickness=3..60 --steps 3 -o thick.csv");
    assert!(outcome.code == FINE && outcome.err.contains("thickness_mm = 3"), "{}", outcome.err);
    let errors = columns("thick.csv", "displaced_rel_rms");
    assert!(errors.len() == 2 && errors[0] == errors[1], "{errors:?}");
    workshop.refuses("verify block.stl --sweep colour=1..2", REFUSED, &["colour", "distance"]);
    workshop.refuses("verify block.stl --sweep nodes=33..65 --as-built", REFUSED, &["--as-built"]);
    workshop.refuses("verify block.stl --sweep distance=1..2 -o x.stl", REFUSED, &[".csv"]);
}

#[test]
fn the_side_file_makes_the_same_block_again_bit_by_bit_on_any_number_of_threads() {
    let workshop = Workshop::new();
    assert_eq!(
        workshop
            .run("design picture.png -o a.stl --nodes 65 --no-verify --size 80mm --material polycarbonate --offset 0.2")
            .code,
        FINE
    );
    for threads in ["1", "3"] {
        let mut command = Command::cargo_bin("glasswarp").unwrap();
        let again = command.current_dir(workshop.root()).env("RAYON_NUM_THREADS", threads);
        again.args(["design", "a.toml", "-o", "b.stl", "--no-verify"]).assert().success();
        assert!(
            fs::read(workshop.path("a.stl")).unwrap() == fs::read(workshop.path("b.stl")).unwrap(),
            "{threads} threads"
        );
    }
}

#[test]
fn verify_reads_the_bench_from_the_side_file_in_every_format() {
    let workshop = Workshop::new();
    assert_eq!(
        workshop.run("design picture.png -o block.stl -o block.obj -o block.glb --nodes 97 --no-verify").code,
        FINE
    );
    let mut errors = Vec::new();
    for block in ["block.stl", "block.obj", "block.glb"] {
        let outcome = workshop.run(&format!("verify {block} --target picture.png --photons 100000"));
        assert_eq!(outcome.code, FINE, "{}", outcome.err);
        assert!(outcome.err.is_empty(), "{}", outcome.err);
        let line = outcome.out.lines().find(|line| line.contains("relative RMS  ")).unwrap();
        errors.push(line.split_whitespace().last().unwrap().parse::<f64>().unwrap());
    }
    prints_within_tenth_of(0.0003, errors[0], "STL");
    errors.iter().for_each(|e| at_worst(1e-4, (e - errors[0]).abs(), format_args!("{errors:?}")));
    let wrong =
        workshop.run("verify block.stl --target picture.png --distance 200mm --max-error 0.05 --photons 100000");
    assert_eq!(wrong.code, SHORT, "{}", wrong.out);
    assert_eq!(workshop.run("verify block.stl -o light.exr -o light.png --photons 100000").code, FINE);
    assert!(workshop.path("light.exr").exists() && workshop.path("light.png").exists());
}

#[test]
fn verify_says_when_a_file_is_not_the_one_that_was_designed() {
    let workshop = Workshop::new();
    assert_eq!(workshop.run("design picture.png -o block.stl --nodes 65 --no-verify").code, FINE);
    let mut bytes = fs::read(workshop.path("block.stl")).unwrap();
    bytes[10] ^= 1; // in the header
    fs::write(workshop.path("block.stl"), &bytes).unwrap();
    let outcome = workshop.run("verify block.stl --photons 100000");
    assert!(outcome.err.contains("changed since"), "{}", outcome.err);
    bytes.truncate(bytes.len() - 1000);
    fs::write(workshop.path("block.stl"), &bytes).unwrap();
    workshop.refuses("verify block.stl", MESH, &["block.stl"]);
    fs::remove_file(workshop.path("block.toml")).unwrap();
    workshop.refuses("verify block.stl", REFUSED, &["side file", "--bench"]);
    workshop.refuses("verify nothing.stl", FILE, &["nothing.stl"]);
}

#[test]
fn pictures_of_every_kind_are_taken() {
    let workshop = Workshop::new();
    let level = |x: u32, y: u32| 60 + 3 * x as u8 + y as u8;
    image::ImageBuffer::from_fn(40, 40, |x, y| Luma([u16::from(level(x, y)) * 257]))
        .save(workshop.path("deep.png"))
        .unwrap();
    image::ImageBuffer::from_fn(40, 24, |x, y| Rgba([level(x, y), 90, 200, if x < 5 { 0 } else { 255 }]))
        .save(workshop.path("colour.png"))
        .unwrap();
    image::ImageBuffer::from_fn(24, 40, |x, y| LumaA([level(x, y), 200])).save(workshop.path("alpha.png")).unwrap();
    image::ImageBuffer::from_fn(33, 47, |x, y| image::Rgb([level(x, y), 90, 200]))
        .save(workshop.path("photo.jpg"))
        .unwrap();
    exr::prelude::write_rgb_file(workshop.path("light.exr"), 40, 40, |x, y| (0.5 + x as f32, 1.0, y as f32)).unwrap();
    for picture in ["deep.png", "colour.png", "alpha.png", "photo.jpg", "light.exr"] {
        let outcome = workshop.run(&format!("design {picture} -o block.stl --nodes 65 --distance 400"));
        assert_eq!(outcome.code, FINE, "{picture}: {}", outcome.err);
    }
}

#[test]
fn pictures_that_make_no_target_are_refused() {
    let workshop = Workshop::new();
    GrayImage::new(1, 1).save(workshop.path("dot.png")).unwrap();
    GrayImage::new(32, 32).save(workshop.path("black.png")).unwrap();
    fs::write(workshop.path("empty.png"), "").unwrap();
    fs::write(workshop.path("text.png"), "this is no picture").unwrap();
    let whole = fs::read(workshop.path("picture.png")).unwrap();
    fs::write(workshop.path("cut.png"), &whole[..whole.len() / 2]).unwrap();
    exr::prelude::write_rgb_file(workshop.path("nan.exr"), 16, 16, |x, _| {
        (if x == 3 { f32::NAN } else { 1.0 }, 1.0, 1.0)
    })
    .unwrap();
    workshop.refuses("design dot.png -o b.stl", REFUSED, &["1 x 1", "between 4 and"]);
    workshop.refuses(
        "design black.png --offset 0 -o b.stl",
        REFUSED,
        &["same light everywhere", "every pixel is black"],
    );
    workshop.refuses("design nan.exr -o b.stl", REFUSED, &["column 3", "NaN"]);
    workshop.refuses("design empty.png -o b.stl", FILE, &["empty.png"]);
    workshop.refuses("design text.png -o b.stl", FILE, &["text.png"]);
    workshop.refuses("design cut.png -o b.stl", FILE, &["cut.png"]);
    workshop.refuses("design nothing.png -o b.stl", FILE, &["nothing.png", "No such file"]);
    workshop.refuses("design . -o b.stl", FILE, &["directory"]);
}

#[test]
fn benches_that_make_no_sense_are_refused_with_the_value_and_its_limit() {
    let workshop = Workshop::new();
    for (flags, words) in [
        ("--distance 0", ["distance to the receiver is 0 mm", "1 mm"]),
        ("--distance -250mm", ["-250 mm", "1 mm"]),
        ("--size 0mm", ["width of the block is 0 mm", "1 mm"]),
        ("--size nan", ["nan", "mm, cm, m or in"]),
        ("--size 3furlongs", ["furlongs", "mm, cm, m or in"]),
        ("--ior 1", ["index is 1", "1.01"]),
        ("--ior 0", ["index is 0", "1.01"]),
        ("--offset -0.5", ["offset is -0.5", "between 0"]),
        ("--offset nan", ["offset is NaN", "between 0"]),
        ("--nodes 2", ["2 height nodes", "between 9"]),
        ("--nodes 99999", ["99999", "8193"]),
        ("--material cheese", ["cheese", "known are pmma"]),
        ("--thickness 2mm", ["2 mm", "--thickness"]),
        ("--thickness -1", ["-1 mm", "between"]),
        ("--solver magic", ["magic", "transport"]),
        ("--solver warping --quality fine", ["--quality", "warping solver"]),
        ("--min-radius -1mm", ["-1 mm", "between"]),
    ] {
        workshop.refuses(&format!("design picture.png -o b.stl {flags}"), REFUSED, &words);
    }
}

#[test]
fn what_physics_forbids_is_refused_with_the_remedy() {
    let workshop = Workshop::new();
    GrayImage::from_fn(64, 64, |x, y| Luma([if x < 8 && y < 8 { 255 } else { 0 }]))
        .save(workshop.path("corner.png"))
        .unwrap();
    for solver in ["warping", "transport"] {
        let line = format!("design corner.png -o b.stl --nodes 65 --distance 20mm --offset 0.01 --solver {solver}");
        workshop.refuses(&line, REFUSED, &["further away"]);
    }
    workshop.refuses(
        "design picture.png -o b.stl --nodes 65 --distance 60 --thickness 4mm",
        REFUSED,
        &["relief", "--thickness"],
    );
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let workshop = Workshop::new();
    workshop.refuses("design picture.png -o block.xyz", REFUSED, &[".xyz", ".stl"]);
    workshop.refuses("design picture.png -o block", REFUSED, &["no extension", ".stl"]);
    workshop.refuses("design picture.png -o nowhere/block.stl", FILE, &["nowhere", "does not exist"]);
    workshop.refuses("design picture.png -o /proc/block.stl", FILE, &["/proc"]);
    workshop.refuses("verify block.stl -o light.jpg", REFUSED, &[".exr"]);
}

#[test]
fn a_full_disk_is_an_error_that_leaves_nothing_half_written() {
    let workshop = Workshop::new();
    let disk = workshop.path("disk");
    fs::create_dir(&disk).unwrap();
    // A disk of 300 kB in a mount namespace of its own; a block of 97 nodes takes 1 MB.
    let script = format!(
        "mount -t tmpfs -o size=300k tmpfs '{0}' && '{1}' design '{2}' -o '{0}/block.stl' --nodes 97 --no-verify; echo code $?; ls -A '{0}'",
        disk.display(),
        Path::new(env!("CARGO_BIN_EXE_glasswarp")).display(),
        workshop.path("picture.png").display(),
    );
    let output = std::process::Command::new("unshare").args(["-rm", "sh", "-c", &script]).output();
    let Some(output) = output.ok().filter(|output| !String::from_utf8_lossy(&output.stderr).contains("not permitted"))
    else {
        println!("NOT RUN: this system lets nobody mount a small disk, so the full disk was not tried");
        return;
    };
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(out.trim(), "code 1", "out: {out}\nerr: {err}");
    assert!(err.contains("No space left"), "{err}");
}

#[cfg(unix)]
#[test]
fn an_interruption_leaves_nothing_half_written() {
    let workshop = Workshop::new();
    GrayImage::from_fn(600, 600, |x, y| Luma([(x / 3 + y / 8) as u8])).save(workshop.path("large.png")).unwrap();
    let before = workshop.files();
    let child = std::process::Command::new(env!("CARGO_BIN_EXE_glasswarp"))
        .current_dir(workshop.root())
        .args(["design", "large.png", "-o", "block.stl", "--nodes", "2049"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(300));
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(workshop.files(), before);
}

#[test]
fn help_shows_units_defaults_and_examples() {
    let workshop = Workshop::new();
    let help = workshop.run("design --help");
    for word in ["--distance <LENGTH>", "250mm", "--offset", "--solver"] {
        assert!(help.out.contains(word), "'{word}' is not in\n{}", help.out);
    }
    assert!(workshop.run("--help").out.contains("glasswarp design portrait.png"));
    assert!(workshop.run("materials").out.contains("pmma"));
    assert_eq!(workshop.run("design").code, REFUSED);
}
