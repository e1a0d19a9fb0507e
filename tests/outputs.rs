//! What a command writes over: its own files of before, and nothing else.

#[path = "common/workshop.rs"]
mod workshop;

use std::{fs, process::Command};
use workshop::{FINE, REFUSED, Workshop};

/// A shop with a block of few nodes in it, and what goes into its report.
fn furnished() -> Workshop {
    let shop = Workshop::new();
    assert_eq!(shop.run("design picture.png --nodes 33 --no-verify --no-report -o b.stl").code, FINE);
    shop
}

#[test]
fn every_command_repeats_itself_and_replaces_nothing_of_anybody_else() {
    let shop = furnished();
    for (line, outputs) in [
        (
            "design --pictures picture.png --nodes 33 -o d.stl -o d.obj --height-map d.png",
            &["d.stl", "d.obj", "d.png", "d.toml", "d.panel.png", "d.drawing.png", "d.report.html"][..],
        ),
        ("design --pictures picture.png --nodes 33 --no-verify -o n.stl", &["n.weakness.png", "n.report.html"]),
        ("design picture.png --nodes 33 --outline circle --no-verify --height-map h.exr -o h.stl", &["h.mask.png"]),
        ("design --pictures picture.png --nodes 33 --finish polish=0.5mm -o f.stl", &["f.perfect.png"]),
        ("preview picture.png --nodes 33 -o p.html -o p.png", &["p.html", "p.png"]),
        ("verify b.stl --photons 20000 --pixels 16 -o v.exr -o v.png --report v.html", &["v.exr", "v.png", "v.html"]),
        ("verify b.stl --photons 20000 --pixels 16 --tally t.exr", &["t.exr"]),
        ("verify b.stl --sweep distance=200..300 --steps 2 --pixels 16 -o s.csv -o s.png", &["s.csv", "s.png"]),
        ("verify merge t.exr --tally m.exr -o m.png", &["m.exr", "m.png"]),
        ("check b.stl --max-slope 80deg --cutter ball:0.1mm --step-over 0.01mm -o c.png", &["c.png"]),
        (
            "mill b.stl --step-over 2mm --polish 2mm --pixels 16 -o w.stl -o w.obj -o w.png --report w.html",
            &["w.stl", "w.obj", "w.png", "w.html", "w.toml"],
        ),
        ("crosscheck b.stl --with povray --write-only --scene x", &["x/README.txt", "x/map.pov", "x/block.inc"]),
        ("crosscheck b.stl --with blender --write-only --scene y", &["y/map.py", "y/positions.f32"]),
        ("man -o .", &["glasswarp.1", "glasswarp-design.1"]),
    ] {
        let codes = [FINE, 3];
        let twice = [shop.run(line), shop.run(line)];
        assert!(twice.iter().all(|outcome| codes.contains(&outcome.code)), "{line}\n{}{}", twice[0].err, twice[1].err);
        for output in outputs {
            let path = shop.path(output);
            let record = path.with_file_name(".glasswarp.sha256");
            let ours = fs::read(&path).unwrap_or_else(|error| panic!("{line}: {output}: {error}"));
            let known = fs::read_to_string(&record).unwrap();
            fs::write(&path, "somebody's").unwrap();
            shop.refuses(line, REFUSED, &[output, "has been changed since glasswarp wrote it", "--force"]);
            assert_eq!(fs::read_to_string(&path).unwrap(), "somebody's", "{line}: {output}");
            // As if it had come from elsewhere: the folder knows nothing of it.
            let name = format!("  {}", path.file_name().unwrap().to_str().unwrap());
            let others = known.lines().filter(|line| !line.ends_with(&name)).map(|line| format!("{line}\n"));
            fs::write(&record, others.collect::<String>()).unwrap();
            shop.refuses(line, REFUSED, &[output, "was not written by glasswarp", "--force"]);
            fs::write(&path, ours).unwrap();
            fs::write(&record, known).unwrap();
        }
        outputs.iter().for_each(|output| fs::write(shop.path(output), "somebody's").unwrap());
        assert!(codes.contains(&shop.run(&format!("{line} --force")).code), "{line}");
        for output in outputs {
            assert_ne!(fs::read(shop.path(output)).unwrap(), b"somebody's", "{line}: {output}");
        }
    }
}

#[test]
fn inputs_are_never_replaced() {
    let shop = furnished();
    fs::copy(shop.path("b.stl"), shop.path("other.stl")).unwrap();
    fs::copy(shop.path("picture.png"), shop.path("q.caustic.png")).unwrap();
    fs::write(shop.path("design.toml"), "[design]\npicture = \"picture.png\"\nnodes = 33\n").unwrap();
    fs::write(shop.path("beam.toml"), "[design]\npicture = \"picture.png\"\nbeam = \"beam.png\"\nnodes = 33\n")
        .unwrap();
    fs::copy(shop.path("picture.png"), shop.path("beam.png")).unwrap();
    fs::create_dir(shop.path("sub")).unwrap();
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("picture.png", shop.path("link.png")).unwrap();
        fs::hard_link(shop.path("picture.png"), shop.path("hard.png")).unwrap();
    }
    let before: Vec<(String, Vec<u8>)> = shop
        .files()
        .into_iter()
        .filter(|name| shop.path(name).is_file())
        .map(|name| (name.clone(), fs::read(shop.path(&name)).unwrap()))
        .collect();
    for (line, input) in [
        ("design picture.png --nodes 33 -o q.stl --height-map picture.png", "picture.png"),
        ("design picture.png --nodes 33 -o q.stl --height-map ./picture.png", "picture.png"),
        ("design picture.png --nodes 33 -o q.stl --height-map sub/../picture.png", "picture.png"),
        ("design picture.png --nodes 33 -o q.stl --height-map link.png", "picture.png"),
        ("design picture.png --nodes 33 -o q.stl --height-map hard.png", "picture.png"),
        ("design --pictures q.caustic.png --nodes 33 -o q.stl", "q.caustic.png"),
        ("design design.toml -o design.stl", "design.toml"),
        ("design beam.toml -o q.stl --height-map beam.png", "beam.png"),
        ("design b.toml -o b.stl", "b.toml"),
        ("preview picture.png --nodes 33 -o picture.png", "picture.png"),
        ("verify b.stl --photons 20000 --pixels 16 -o picture.png", "picture.png"),
        (
            "verify b.stl --photons 20000 --pixels 16 --tally t.exr --target q.caustic.png -o q.caustic.png",
            "q.caustic.png",
        ),
        ("check b.stl -o picture.png", "picture.png"),
        ("mill b.stl --step-over 2mm -o b.stl", "b.stl"),
        ("mill b.stl --step-over 2mm -o b.obj", "b.toml"),
        ("mill other.stl --bench b.toml --step-over 2mm -o b.obj", "b.toml"),
    ] {
        for line in [line.to_owned(), format!("{line} --force")] {
            shop.refuses(&line, REFUSED, &["would replace", input, "which this command reads"]);
        }
    }
    for (name, bytes) in before {
        assert_eq!(fs::read(shop.path(&name)).unwrap(), bytes, "{name}");
    }
}

#[test]
fn outputs_that_are_one_file_and_names_that_cannot_be_recorded_are_refused() {
    let shop = furnished();
    for (line, words) in [
        ("design picture.png --nodes 33 -o q.stl -o ./q.stl", "the same file"),
        ("design picture.png --nodes 33 -o q.stl -o Q.stl", "upper and lower case"),
        ("design --pictures picture.png --nodes 33 -o q.stl --height-map q.caustic.png", "the same file"),
        ("verify b.stl --photons 20000 -o v.png --white v.png", "the same file"),
        ("mill b.stl --step-over 2mm -o w.png -o w.png", "the same file"),
    ] {
        shop.refuses(line, REFUSED, &[words, "another name"]);
    }
    let run = |arguments: &[&std::ffi::OsStr]| {
        let output = Command::new(assert_cmd::cargo::cargo_bin!("glasswarp"))
            .current_dir(shop.root())
            .args(arguments)
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let before = shop.files();
    for name in [
        std::ffi::OsStr::new("a\nb.stl"),
        #[cfg(unix)]
        std::os::unix::ffi::OsStrExt::from_bytes(b"a\xffb.stl"),
    ] {
        for arguments in [
            &["design".as_ref(), "picture.png".as_ref(), "--nodes".as_ref(), "33".as_ref(), "-o".as_ref(), name][..],
            &["mill".as_ref(), "b.stl".as_ref(), "-o".as_ref(), name],
        ] {
            let (code, said) = run(arguments);
            assert_eq!(code, Some(REFUSED), "{said}");
            assert!(said.contains("side files, reports and JSON could not name it"), "{said}");
        }
    }
    assert_eq!(shop.files(), before);
}

#[test]
fn a_side_file_of_milled_files_lists_them_all() {
    let shop = furnished();
    let outcome = shop.run("mill b.stl --step-over 2mm --polish 2mm --pixels 16 -o w.stl -o w.obj -o other.glb");
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    for (side, names) in [("w.toml", &["w.obj", "w.stl"][..]), ("other.toml", &["other.glb"])] {
        let side: toml::Table = fs::read_to_string(shop.path(side)).unwrap().parse().unwrap();
        let files = side["files"].as_table().unwrap();
        let mut listed: Vec<&String> = files.keys().collect();
        listed.sort();
        assert_eq!(listed, names);
        for (name, hash) in files {
            assert_eq!(hash.as_str().unwrap(), glasswarp_files::sha256(&shop.path(name)).unwrap());
        }
    }
    for name in ["w.stl", "w.obj", "other.glb"] {
        let judged = shop.run(&format!("verify {name} --photons 20000 --pixels 16"));
        assert!(judged.code == FINE && judged.err.is_empty(), "{name}: {}{}", judged.out, judged.err);
    }
}

/// Files have the permissions that the user's mask leaves, whoever writes them; those that are
/// replaced keep theirs, and a link stays a link.
#[cfg(unix)]
#[test]
fn permissions_and_links_are_the_users() {
    use std::os::unix::fs::PermissionsExt;
    let shop = furnished();
    let line = "verify b.stl --photons 20000 --pixels 16 -o v.exr -o v.png --report v.html";
    let masked = |mask: &str| {
        let script = format!("umask {mask}; exec \"$0\" \"$@\"");
        let program = assert_cmd::cargo::cargo_bin!("glasswarp");
        let mut command = Command::new("sh");
        command.args(["-c", &script]).arg(program).args(line.split(' ')).current_dir(shop.root());
        assert!(command.output().unwrap().status.success());
    };
    let modes =
        || ["v.exr", "v.png", "v.html"].map(|n| fs::metadata(shop.path(n)).unwrap().permissions().mode() & 0o777);
    masked("077");
    assert_eq!(modes(), [0o600; 3]);
    fs::set_permissions(shop.path("v.png"), fs::Permissions::from_mode(0o664)).unwrap();
    masked("022");
    assert_eq!(modes(), [0o600, 0o664, 0o600]);
    fs::rename(shop.path("v.exr"), shop.path("there.exr")).unwrap();
    std::os::unix::fs::symlink("there.exr", shop.path("v.exr")).unwrap();
    shop.refuses(line, REFUSED, &["v.exr", "was not written by glasswarp"]);
    assert_eq!(shop.run(&format!("{line} --force")).code, FINE);
    assert!(shop.path("v.exr").is_symlink());
    assert_eq!(shop.run(line).code, FINE, "what a link points at is known by its own name");
}
