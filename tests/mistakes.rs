//! Runs the commands of docs/mistakes.md, and compares what is answered.

#[path = "common/workshop.rs"]
mod workshop;

use std::{fs, path::Path};
use workshop::{FINE, Workshop};

#[test]
fn mistakes_are_answered_as_the_page_says() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/mistakes.md")).unwrap();
    let shop = Workshop::new();
    fs::rename(shop.path("picture.png"), shop.path("portrait.png")).unwrap();
    let made = shop.run("design portrait.png --nodes 33 --no-report -o portrait.stl");
    assert_eq!(made.code, FINE, "{}", made.err);
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| `glasswarp")).collect();
    assert!(rows.len() >= 20, "{} mistakes", rows.len());
    for row in rows {
        let [command, code, says] =
            row.trim_matches('|').split('|').map(str::trim).collect::<Vec<_>>().try_into().unwrap();
        let line = command.replace('`', "").trim_start_matches("glasswarp").trim().to_owned();
        shop.refuses(&line, code.parse().unwrap(), &[says]);
    }
}
