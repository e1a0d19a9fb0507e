//! What a terminal, a script and a shell get to see.

#[path = "common/workshop.rs"]
mod workshop;

use serde_json::Value;
use std::{collections::BTreeSet, fs, path::Path, process::Command};
use workshop::{FINE, MESH, Outcome, REFUSED, SHORT, Workshop};

fn schema() -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/glasswarp.schema.json");
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// The document on standard output, which holds nothing else and keeps to the schema.
fn document(outcome: &Outcome) -> Value {
    let document: Value = serde_json::from_str(&outcome.out).unwrap_or_else(|e| panic!("{e}:\n{}", outcome.out));
    let validator = jsonschema::validator_for(&schema()).unwrap();
    let faults: Vec<String> = validator.iter_errors(&document).map(|e| format!("{}: {e}", e.instance_path())).collect();
    assert!(faults.is_empty(), "{faults:#?}\n{document:#}");
    assert_eq!(document["exit_code"], outcome.code);
    document
}

#[test]
fn every_command_prints_one_document_that_keeps_to_the_schema() {
    let shop = Workshop::new();
    let said = |line: &str, code: i32| {
        let outcome = shop.run(line);
        assert_eq!(outcome.code, code, "{line}\n{}", outcome.err);
        document(&outcome)
    };
    let design = said("design picture.png --nodes 33 -o b.stl -o b.obj --json", FINE);
    assert_eq!(design["command"], "design");
    assert_eq!(design["result"]["files"], serde_json::json!(["b.stl", "b.obj"]));
    assert!(design["result"]["judgement"]["picture"]["rel_rms"].as_f64().unwrap() < 0.2);
    let steps = design["result"]["budget"].as_array().unwrap();
    assert!(steps.iter().any(|step| step["rel_rms"].is_null()) && steps.len() > 4, "{steps:#?}");
    let finished = said("design picture.png --nodes 33 --finish polish=0.5mm -o f.stl --json", FINE);
    assert!(finished["result"]["finished"]["rel_rms"].is_number());

    let verify = said("verify b.stl --photons 20000 --json", FINE);
    assert_eq!(verify["result"]["kind"], "block");
    said("verify b.stl --photons 20000 --max-error 1e-9 --json", SHORT);
    said("verify b.stl --photons 20000 --tally t.exr --json", FINE);
    assert_eq!(said("verify merge t.exr --json", FINE)["result"]["complete"], true);
    assert_eq!(
        said("verify b.stl --sweep distance=200..300 --steps 2 --json", FINE)["result"]["points"]
            .as_array()
            .unwrap()
            .len(),
        2
    );
    let check = shop.run("check b.stl --step-over 0.1mm --tolerance --pixels 32 --json");
    assert!(document(&check)["result"]["tolerances"]["cases"].as_array().unwrap().len() > 5);
    let mill = said("mill b.stl --cutter ball:3mm --step-over 1mm --polish 0.5mm --pixels 32 --json", FINE);
    assert_eq!(mill["result"]["steps"].as_array().unwrap().len(), 4);
    let scene = said("crosscheck b.stl --with povray --write-only --json", FINE);
    assert_eq!(scene["result"]["renderer"], "POV-Ray");
    said("preview picture.png --json", FINE);
    said("materials --json", FINE);
    said("presets --json", FINE);
    said("presets desk-demo --json", FINE);
    said("completions fish --json", FINE);
    said("man --json", FINE);

    fs::write(shop.path("broken.stl"), "solid x\n").unwrap();
    let failed = said("verify broken.stl --ior 1.5 --distance 100 --json", MESH);
    assert_eq!(failed["error"]["kind"], "invalid-mesh");
    assert!(!failed["error"]["causes"].as_array().unwrap().is_empty());
    assert_eq!(said("design nothing.png --json", 1)["error"]["kind"], "file");
    assert_eq!(said("design picture.png --nodse 3 --json", REFUSED)["error"]["kind"], "refused");
}

#[test]
fn the_page_about_json_names_every_key() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/json.md")).unwrap();
    fn keys(value: &Value, found: &mut BTreeSet<String>) {
        if let Some(properties) = value.get("properties").and_then(Value::as_object) {
            found.extend(properties.keys().cloned());
        }
        match value {
            Value::Object(map) => map.values().for_each(|value| keys(value, found)),
            Value::Array(list) => list.iter().for_each(|value| keys(value, found)),
            _ => {}
        }
    }
    let mut found = BTreeSet::new();
    keys(&schema(), &mut found);
    let missing: Vec<_> = found.iter().filter(|key| !page.contains(&format!("`{key}`"))).collect();
    assert!(missing.is_empty() && found.len() > 50, "{missing:?}");
}

#[test]
fn help_fits_a_screen_and_begins_with_an_example() {
    let shop = Workshop::new();
    let help = shop.run("--help");
    assert_eq!(help.code, FINE);
    assert!(help.out.starts_with("Example:\n  glasswarp design "), "{}", help.out);
    let lines = help.out.lines().count();
    assert!((20..=30).contains(&lines), "{lines} lines:\n{}", help.out);
    assert!(help.out.lines().all(|line| line.chars().count() <= 100), "{}", help.out);
    assert_eq!(shop.run("-h").out, help.out);
    for command in
        ["design", "preview", "verify", "check", "mill", "crosscheck", "materials", "presets", "completions", "man"]
    {
        assert!(help.out.contains(&format!("\n  {command}")), "{command}");
        assert_eq!(shop.run(&format!("{command} --help")).code, FINE);
    }
}

#[test]
fn shells_and_man_get_their_pages() {
    let shop = Workshop::new();
    for (shell, words) in [("bash", "_glasswarp()"), ("zsh", "#compdef glasswarp"), ("fish", "complete -c glasswarp")] {
        let script = shop.run(&format!("completions {shell}"));
        assert!(script.code == FINE && script.out.contains(words) && script.out.contains("preset"), "{shell}");
    }
    assert!(shop.run("man").out.contains(".TH glasswarp 1"));
    assert_eq!(shop.run("man -o .").code, FINE);
    let pages: Vec<_> = shop.files().into_iter().filter(|name| name.ends_with(".1")).collect();
    assert_eq!(pages.len(), 12, "{pages:?}");
    let page = fs::read_to_string(shop.path("glasswarp-design.1")).unwrap();
    assert!(page.contains("receiver") && page.contains("preset"));
}

#[test]
fn traces_go_to_standard_error_and_only_when_asked_for() {
    let shop = Workshop::new();
    let quiet = shop.run("design picture.png --nodes 17 --no-verify -o a.stl");
    assert!(!quiet.err.contains("time.busy") && !quiet.err.contains('\u{1b}') && !quiet.out.contains('\u{1b}'));
    let told = shop.run("design picture.png --nodes 17 -o a.stl -v");
    for stage in ["read the picture", "solve", "close the solid", "write", "read back", "trace photons", "error budget"]
    {
        assert!(told.err.contains(stage), "{stage} is not in\n{}", told.err);
    }
    assert!(told.err.contains("time.busy") && !told.err.contains("level done"));
    assert!(!told.out.contains("time.busy"));
    assert!(shop.run("design picture.png --nodes 17 --no-verify -o a.stl -vv").err.contains("level done"));
}

#[test]
fn colours_are_for_those_who_want_them() {
    let shop = Workshop::new();
    let said = |variable: &str| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("glasswarp"));
        command.args(["design", "nothing.png"]).current_dir(shop.root()).env_remove("NO_COLOR");
        String::from_utf8(command.env(variable, "1").output().unwrap().stderr).unwrap()
    };
    assert!(said("CLICOLOR_FORCE").contains("\u{1b}["));
    assert!(!said("NO_COLOR").contains('\u{1b}'));
    assert!(!said("IRRELEVANT").contains('\u{1b}'));
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_reason_to_panic() {
    let shop = Workshop::new();
    let output = Command::new("sh")
        .args(["-c", "\"$0\" completions bash | head -n 1; \"$0\" materials | true"])
        .arg(assert_cmd::cargo::cargo_bin!("glasswarp"))
        .current_dir(shop.root())
        .output()
        .unwrap();
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn presets_give_way_to_design_files_and_these_to_flags() {
    let shop = Workshop::new();
    let size = |line: &str| {
        let outcome = shop.run(&format!("{line} --nodes 17 --no-verify -o p.stl --json"));
        assert_eq!(outcome.code, FINE, "{}", outcome.err);
        let document = document(&outcome);
        let bench = &document["result"]["bench"];
        (
            document["result"]["block"]["width_mm"].as_f64().unwrap(),
            bench["distance_mm"].as_f64().unwrap(),
            bench["ior"].clone(),
        )
    };
    assert_eq!(size("design picture.png --preset desk-demo"), (60.0, 200.0, 1.49.into()));
    fs::write(shop.path("d.toml"), "[design]\npicture = \"picture.png\"\npreset = \"desk-demo\"\ndistance = 300\n")
        .unwrap();
    assert_eq!(size("design d.toml"), (60.0, 300.0, 1.49.into()));
    assert_eq!(size("design d.toml --size 50 --ior 1.6"), (50.0, 300.0, 1.6.into()));
    for preset in ["sunlit-window", "torch-on-table", "wall-mirror"] {
        size(&format!("design picture.png --preset {preset}"));
    }
}

#[test]
fn mistakes_in_a_design_file_are_shown_in_it() {
    let shop = Workshop::new();
    let refused = |text: &str, words: &[&str]| {
        fs::write(shop.path("d.toml"), text).unwrap();
        shop.refuses("design d.toml -o e.stl", REFUSED, words);
    };
    refused(
        "[design]\npicture = \"picture.png\"\ndistanse = 250\n",
        &["d.toml:3:1", "^^^^^^^^", "did you mean 'distance'?"],
    );
    refused("[design]\npicture = \"picture.png\"\nmaterial = \"pmmma\"\n", &["d.toml:3:1", "did you mean 'pmma'?"]);
    refused("[design]\npicture = \"picture.png\"\n\ndistance = -20\n", &["d.toml:4:1", "distance = -20"]);
    refused("[design]\npicture = \"picture.png\"\nnodes = 2\n", &["d.toml:3:1", "nodes = 2"]);
}

#[test]
fn a_side_file_makes_its_block_again_bit_for_bit_on_any_number_of_threads() {
    // The report tells the time that it took, the side file its own place.
    let made_again = |name: &str| name.starts_with("block.") && !name.ends_with(".toml") && !name.ends_with(".html");
    for options in ["--rim 10mm,1mm --mark 3mm --origin stock-top", "--preset torch-on-table", "--preset wall-mirror"] {
        let shop = Workshop::new();
        let made = shop
            .run(&format!("design picture.png --nodes 49 {options} -o block.stl -o block.step --height-map block.exr"));
        assert_eq!(made.code, FINE, "{}", made.err);
        for threads in ["1", "2", "3"] {
            fs::create_dir(shop.path(threads)).unwrap();
            let mut command = Command::new(assert_cmd::cargo::cargo_bin!("glasswarp"));
            command.args([
                "design",
                "../block.toml",
                "-o",
                "block.stl",
                "-o",
                "block.step",
                "--height-map",
                "block.exr",
            ]);
            command.current_dir(shop.path(threads)).env("RAYON_NUM_THREADS", threads);
            assert!(command.output().unwrap().status.success());
            for name in shop.files().into_iter().filter(|name| made_again(name)) {
                let again = fs::read(shop.path(threads).join(&name)).unwrap();
                assert!(again == fs::read(shop.path(&name)).unwrap(), "{options}: {name} differs on {threads} threads");
            }
        }
    }
}

#[test]
fn a_design_that_would_not_fit_into_memory_is_refused_with_a_remedy() {
    let shop = Workshop::new();
    let said = |line: &str| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("glasswarp"));
        let output =
            command.args(line.split(' ')).current_dir(shop.root()).env("GLASSWARP_MEMORY", "54").output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, text) = said("design picture.png --nodes 257 -o b.stl");
    assert_eq!(code, Some(REFUSED), "{text}");
    for words in ["54 MB are free", "--nodes 21", "--no-verify", "--ignore-memory"] {
        assert!(text.contains(words), "'{words}' is not in\n{text}");
    }
    assert!(!shop.files().contains(&"b.stl".to_owned()));
    let (code, text) = said("design picture.png --nodes 257 -o b.stl --no-verify --quality draft --ignore-memory");
    assert_eq!(code, Some(FINE), "{text}");
}

#[test]
fn light_without_a_size_is_warned_of_and_any_size_answers() {
    let shop = Workshop::new();
    let said = |line: &str| {
        let outcome = shop.run(&format!("design picture.png --nodes 17 --no-verify -o p.stl --json {line}"));
        assert_eq!(outcome.code, FINE, "{}", outcome.err);
        let warnings = document(&outcome)["warnings"].as_array().unwrap().clone();
        warnings.into_iter().map(|warning| warning.as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let sun = |warnings: &[String]| warnings.iter().position(|warning| warning.contains("0.53 degrees"));
    // A block of 100 x 66.67 mm, a receiver at 250 mm, on which the sun's disc is 2.31 mm wide.
    let warned = said("--force");
    assert_eq!(sun(&warned), Some(0), "{warned:?}");
    for words in ["2.31 mm", "3.5 %", "--distance 72mm", "--source-size sun", "--source-size none"] {
        assert!(warned[0].contains(words), "'{words}' is not in {}", warned[0]);
    }
    for answer in ["--source-size none", "--source-size sun", "--source-size 0.1deg", "--light point"] {
        assert_eq!(sun(&said(&format!("--force {answer}"))), None, "{answer}");
    }
    for preset in ["desk-demo", "sunlit-window", "torch-on-table", "wall-mirror"] {
        assert_eq!(sun(&said(&format!("--force --preset {preset}"))), None, "{preset}");
    }
}
