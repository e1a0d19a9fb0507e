//! Who may import whom: no file imports in a circle, and folders import as `docs/ARCHITECTURE.md`
//! says.

#[path = "import_rules/sources.rs"]
mod sources;

use sources::{Graph, Package, Sources};
use std::{collections::BTreeMap, fmt::Write as _};

const FILES: Package = Package { name: "glasswarp_files", folder: "files/src", roots: &["lib.rs"] };
const VERIFY: Package = Package { name: "glasswarp_verify", folder: "verify/src", roots: &["lib.rs"] };

const DESIGNER: Package = Package { name: "glasswarp", folder: "src", roots: &["lib.rs", "main.rs"] };

/// The stages of the designer, and what stands on them, each with what it may import besides
/// itself.
const DESIGNER_LAYERS: &[(&str, &[&str])] = &[
    ("main", &["cli"]),
    ("materials", &[]),
    ("optics", &["bench"]),
    ("optim", &["grid"]),
    ("grid", &[]),
    ("bench", &["grid", "light"]),
    ("light", &["bench", "grid", "optics", "surface"]),
    ("surface", &["grid"]),
    ("irradiance", &["bench", "grid", "light", "optics", "surface"]),
    ("forward", &["bench", "grid", "light", "optics", "surface"]),
    ("solver", &["bench", "grid", "irradiance", "optim", "surface"]),
    ("transport", &["bench", "forward", "grid", "irradiance", "light", "optics", "optim", "solver", "surface"]),
    ("warp", &["bench", "forward", "grid", "irradiance", "light", "optics", "optim", "solver", "surface"]),
    ("solid", &["grid", "surface"]),
    ("fabricate", &["grid", "surface"]),
    ("export", &["bench", "fabricate", "grid", "solid", "surface"]),
    ("memory", &["grid", "solid", "transport"]),
    ("pipeline", &["bench", "grid", "irradiance", "light", "optics", "optim", "solid", "solver", "surface"]),
    ("failure", &["bench", "export", "irradiance", "pipeline", "solid", "solver"]),
    ("spec", &["failure", "fabricate", "grid", "irradiance", "materials", "solid", "surface"]),
    ("record", &["failure", "solid", "spec"]),
    (
        "study",
        &[
            "bench",
            "export",
            "fabricate",
            "failure",
            "forward",
            "grid",
            "irradiance",
            "light",
            "materials",
            "memory",
            "optics",
            "optim",
            "pipeline",
            "record",
            "solid",
            "solver",
            "spec",
            "surface",
            "transport",
            "warp",
        ],
    ),
    (
        "report",
        &[
            "bench",
            "export",
            "fabricate",
            "failure",
            "forward",
            "grid",
            "irradiance",
            "light",
            "materials",
            "optim",
            "pipeline",
            "record",
            "solid",
            "solver",
            "spec",
            "study",
            "surface",
        ],
    ),
    (
        "cli",
        &[
            "export",
            "fabricate",
            "failure",
            "grid",
            "irradiance",
            "materials",
            "memory",
            "optim",
            "pipeline",
            "record",
            "report",
            "solid",
            "solver",
            "spec",
            "study",
            "surface",
        ],
    ),
];

/// The layers of the verifier, each with what it may import besides itself. A file beside the
/// folders is one of its own; `lib.rs` is the front of all.
const VERIFY_LAYERS: &[(&str, &[&str])] = &[
    ("image", &[]),
    ("random", &[]),
    ("spline", &[]),
    ("mesh", &[]),
    ("solid", &["mesh"]),
    ("exr_blocks", &[]),
    ("image_file", &["exr_blocks", "image"]),
    ("reference", &["exr_blocks", "image"]),
    ("scene", &["block", "image", "random"]),
    ("block", &["mesh", "solid", "spline"]),
    ("load", &["image_file", "mesh", "spline"]),
    ("trace", &["block", "mesh", "random", "scene", "spline"]),
    ("estimate", &["block", "image", "image_file", "random", "scene", "trace"]),
    ("crosscheck", &["block", "estimate", "image", "mesh", "scene", "trace"]),
    ("program", &[]),
    ("cut", &["program"]),
];

#[test]
fn no_file_of_files_imports_in_a_circle_and_it_knows_of_neither_side() {
    let sources = Sources::read(&FILES);
    assert_no_circles(&FILES, &sources.graph());
    assert_foreign(&sources, &["glasswarp", "glasswarp_verify"]);
}

#[test]
fn no_file_of_the_verifier_imports_in_a_circle_and_it_knows_nothing_of_the_designer() {
    let sources = Sources::read(&VERIFY);
    let graph = sources.graph();
    assert_no_circles(&VERIFY, &graph);
    assert_layers(&VERIFY, &graph, VERIFY_LAYERS);
    assert_foreign(&sources, &["glasswarp"]);
}

#[test]
fn no_file_of_the_designer_imports_in_a_circle_and_stages_know_nothing_above_them() {
    let graph = Sources::read(&DESIGNER).graph();
    assert_no_circles(&DESIGNER, &graph);
    assert_layers(&DESIGNER, &graph, DESIGNER_LAYERS);
}

/// Fails with the files of every circle, and the names by which they hang together.
fn assert_no_circles(package: &Package, graph: &Graph) {
    let circles = circles(graph);
    let mut text = String::new();
    for (k, circle) in circles.iter().enumerate() {
        writeln!(text, "circle {} of {} files:", k + 1, circle.len()).unwrap();
        for file in circle {
            for (other, names) in graph[*file].iter().filter(|(other, _)| circle.contains(&other.as_str())) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                writeln!(text, "  {file} -> {other}: {}", names.join(", ")).unwrap();
            }
        }
    }
    assert!(circles.is_empty(), "{} imports in circles\n{text}", package.folder);
}

/// Fails with every import that the table does not allow, and every folder that it does not name.
fn assert_layers(package: &Package, graph: &Graph, layers: &[(&str, &[&str])]) {
    let allowed: BTreeMap<&str, &[&str]> = layers.iter().copied().collect();
    let mut text = String::new();
    for (file, others) in graph.iter().filter(|(file, _)| *file != "lib.rs") {
        let layer = layer(file);
        let Some(may) = allowed.get(layer) else {
            writeln!(text, "  {file}: the table has no row for {layer}").unwrap();
            continue;
        };
        for (other, names) in others.iter().filter(|(other, _)| self::layer(other) != layer) {
            if !may.contains(&self::layer(other)) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                writeln!(text, "  {file} -> {other}: {}", names.join(", ")).unwrap();
            }
        }
    }
    for (row, _) in layers {
        if !graph.keys().any(|file| layer(file) == *row) {
            writeln!(text, "  nothing is called {row}").unwrap();
        }
    }
    assert!(text.is_empty(), "{} does not keep to its layers\n{text}", package.folder);
}

/// Fails if files name one of these packages.
fn assert_foreign(sources: &Sources, packages: &[&str]) {
    for package in packages {
        let files = sources.foreign(package);
        assert!(files.is_empty(), "{package} is named by {files:?}");
    }
}

/// The folder of a file, or its own name where it stands beside the folders.
fn layer(file: &str) -> &str {
    file.split_once('/').map_or_else(|| file.trim_end_matches(".rs"), |(folder, _)| folder)
}

/// Files that all lead to each other, by Tarjan's strongly connected components.
fn circles(graph: &Graph) -> Vec<Vec<&str>> {
    #[derive(Default)]
    struct Search<'a> {
        index: BTreeMap<&'a str, usize>,
        low: BTreeMap<&'a str, usize>,
        stack: Vec<&'a str>,
        found: Vec<Vec<&'a str>>,
    }
    fn visit<'a>(graph: &'a Graph, file: &'a str, search: &mut Search<'a>) {
        let number = search.index.len();
        search.index.insert(file, number);
        search.low.insert(file, number);
        search.stack.push(file);
        for other in graph.get(file).into_iter().flat_map(BTreeMap::keys) {
            let reached = match search.index.get(other.as_str()) {
                None => {
                    visit(graph, other, search);
                    search.low[other.as_str()]
                }
                Some(&index) if search.stack.contains(&other.as_str()) => index,
                Some(_) => continue,
            };
            let low = search.low[file].min(reached);
            search.low.insert(file, low);
        }
        if search.low[file] == number {
            let begin = search.stack.iter().position(|&other| other == file).unwrap();
            let mut component = search.stack.split_off(begin);
            if component.len() > 1 {
                component.sort_unstable();
                search.found.push(component);
            }
        }
    }
    let mut search = Search::default();
    for file in graph.keys() {
        if !search.index.contains_key(file.as_str()) {
            visit(graph, file, &mut search);
        }
    }
    search.found
}

#[test]
fn circles_are_found_through_facades_globs_and_renames() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("lib.rs", "mod a; mod b; mod c; mod facade;");
    write(
        "a.rs",
        "use crate::facade::Inner as Renamed; pub struct A(Renamed); #[cfg(test)] mod tests { use crate::c::C; }",
    );
    write("b.rs", "use super::*; pub fn of() -> a::A { todo!() }");
    write("c.rs", "pub struct C; fn f() { println!(\"{}\", crate::b::of()) }");
    write("facade/mod.rs", "mod inner; pub use inner::Inner;");
    write("facade/inner.rs", "pub struct Inner; fn f() { let _ = crate::b::of(); }");
    let path: &'static str = folder.path().to_str().unwrap().to_owned().leak();
    let graph = Sources::read(&Package { name: "sample", folder: path, roots: &["lib.rs"] }).graph();
    assert_eq!(circles(&graph), [["a.rs", "b.rs", "facade/inner.rs"]]);
    assert!(graph["c.rs"].contains_key("b.rs") && !graph["a.rs"].contains_key("c.rs"));
}
