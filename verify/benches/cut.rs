//! A program of a million moves: read, and swept over a face of 100 x 100 mm.
#![allow(missing_docs)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use glasswarp_verify::{
    cut::{Plan, Sheet, Strokes},
    program::{Dynamics, Move, ProgramFault, Run, SurveyLimits, Tool, run, survey},
};
use std::{fmt::Write as _, hint::black_box};

const ROWS: u32 = 1000;
const PER_ROW: u32 = 1000;

/// Rows 0.1 mm apart, each of a thousand strokes, over waves.
fn program() -> String {
    let mut text = String::from("G21 G90 G17\nG0 Z5\nG0 X-50 Y-50\nG1 Z0 F2000\n");
    for row in 0..ROWS {
        let y = 0.1 * f64::from(row) - 50.0;
        for k in 0..PER_ROW {
            let k = if row % 2 == 0 { k } else { PER_ROW - 1 - k };
            let x = 0.1 * f64::from(k) - 50.0;
            let z = 2.0 * (0.11 * x).sin() * (0.07 * y).cos() - 3.0;
            writeln!(text, "G1 X{x:.5} Y{y:.5} Z{z:.6}").expect("a string takes all text");
        }
    }
    text + "G0 Z5\nM2\n"
}

/// Cuts as the program is read.
struct Cutting {
    sheet: Sheet,
    strokes: Strokes,
}

const BATCH: usize = 1 << 18;

impl Run for Cutting {
    fn moved(&mut self, made: &Move) -> Result<(), ProgramFault> {
        if made.feeds() {
            self.strokes.add(made, 0);
        }
        if self.strokes.len() >= BATCH {
            self.sheet.cut(&self.strokes);
            self.strokes.clear();
        }
        Ok(())
    }
}

fn million(criterion: &mut Criterion) {
    let text = program();
    let mut group = criterion.benchmark_group("program");
    group.sample_size(10).throughput(Throughput::Elements(u64::from(ROWS * PER_ROW)));
    let face = (DVec2::splat(-50.0), DVec2::splat(50.0));
    let limits = SurveyLimits { face, top_mm: 0.0 };
    let dynamics = Dynamics { acceleration: 500.0, rapid_feed: 5000.0, corner_mm: 0.01 };
    group.bench_function("survey", |bencher| {
        bencher.iter(|| survey(black_box(text.as_bytes()), None, limits, dynamics).expect("a sound program"));
    });
    group.bench_function("sweep", |bencher| {
        bencher.iter(|| {
            let plan = Plan { lower: face.0, upper: face.1, nodes: (2049, 7620) };
            let sheet = Sheet::level(plan, 0.0).expect("a sound plan");
            let mut cutting = Cutting { sheet, strokes: Strokes::of(&[Tool::ball(3.0)]) };
            run(black_box(text.as_bytes()), None, &mut cutting).expect("a sound program");
            cutting.sheet.cut(&cutting.strokes);
            cutting.sheet.into_cut()
        });
    });
    group.finish();
}

criterion_group!(benches, million);
criterion_main!(benches);
