//! A picture whose right light is known by construction, through the whole command: what arrives on
//! the wall is compared with the numbers of the chart (`common/chart.rs`), and with no reader's
//! opinion of the file.

#[path = "common/chart.rs"]
mod chart;
mod common;

use chart::{Case, NX, NY, WEDGE, cases, light};
use common::workshop::{FILE, FINE, REFUSED, SHORT, Workshop};
use std::fs;

const OFFSET: f64 = 0.1;

/// The light that a block draws, by pixels, its mean that of the chart with its constant.
fn drawn(workshop: &Workshop, name: &str) -> Vec<f64> {
    let layer = exr::prelude::read_first_flat_layer_from_file(workshop.path(name)).unwrap().layer_data;
    assert_eq!((layer.size.x(), layer.size.y()), (NX, NY));
    let values: Vec<f64> = layer.channel_data.list[0].sample_data.values_as_f32().map(f64::from).collect();
    let scale = (0..NX * NY).map(wanted).sum::<f64>() / values.iter().sum::<f64>();
    values.iter().map(|v| scale * v).collect()
}

fn wanted(k: usize) -> f64 {
    light(k % NX, k / NX) + OFFSET
}

/// Mean over a rectangle.
fn mean(values: &[f64], columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> f64 {
    let count = columns.len() * rows.len();
    rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| values[y * NX + x]).sum::<f64>() / count as f64
}

/// The part of the chart whose light is most wrong, by how much, and in words.
fn worst_part(found: &[f64]) -> (f64, String) {
    let mut worst = (0.0, String::new());
    let mut near = |what: &str, found: f64, right: f64| {
        let off = (found - right).abs();
        if off > worst.0 {
            worst = (off, format!("{what} is {found:.3} instead of {right:.3}"));
        }
    };
    // The F: its stem, its bars, and the ground on either side of it, a pixel from every edge.
    let bright = 1.0 + OFFSET;
    near("the stem", mean(found, 5..7, 5..27), bright);
    near("the upper bar", mean(found, 9..19, 5..7), bright);
    near("the lower bar", mean(found, 9..15, 15..17), bright);
    for (what, columns, rows) in
        [("left of the F", 1..3, 4..28), ("between the bars", 10..18, 9..13), ("right of the foot", 10..22, 20..30)]
    {
        near(what, mean(found, columns, rows), 0.1 + OFFSET);
    }
    for (k, grey) in WEDGE.iter().enumerate() {
        let left = 24 + 4 * k;
        near(&format!("step {k} of the wedge"), mean(found, left + 1..left + 3, 2..14), grey + OFFSET);
    }
    for third in 0..3 {
        let columns = 25 + 8 * third..31 + 8 * third;
        let right = columns.clone().map(|x| (x - 23) as f64 / 24.0).sum::<f64>() / columns.len() as f64;
        near(&format!("part {third} of the ramp"), mean(found, columns, 18..30), right + OFFSET);
    }
    worst
}

/// Measured: 0.0140 (the fourth step of the wedge, 97 nodes); half a step of 8 bits is up to 0.0046
/// more; and a tenth.
const WITHIN: f64 = 0.020;

/// Designs and verifies a file; `None` if a reader refuses it by name, or the two of them disagree
/// about it.
fn through_the_command(case: &Case) -> Option<(f64, String)> {
    let workshop = Workshop::new();
    let picture = format!("chart.{}", case.extension);
    fs::write(workshop.path(&picture), &case.bytes).unwrap();
    let design = format!("design {picture} -o block.stl --nodes 97 --quality draft --no-report --offset {OFFSET}");
    let made = workshop.run(&design);
    let disagree = made.code == SHORT && made.err.contains("THE TWO READERS DISAGREE");
    if disagree || matches!(made.code, FILE | REFUSED) {
        eprintln!("{}: {}", case.name, made.err.trim());
        return None;
    }
    assert_eq!(made.code, FINE, "{}: {}", case.name, made.err);
    let seen = workshop.run("verify block.stl -o light.exr --photons 65536");
    assert_eq!(seen.code, FINE, "{}: {}", case.name, seen.err);
    Some(worst_part(&drawn(&workshop, "light.exr")))
}

#[test]
fn what_arrives_on_the_wall_is_the_chart_from_every_kind_of_file() {
    let all = cases();
    let (mut wrong, mut read) = (Vec::new(), 0);
    for case in &all {
        match through_the_command(case) {
            // Never a wrong picture without a word.
            None => {}
            Some((off, part)) => {
                read += 1;
                eprintln!("{}: {part}", case.name);
                if off > WITHIN {
                    wrong.push(format!("{}: {part}", case.name));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(read, all.len(), "files that both readers read");
}
