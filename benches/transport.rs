//! The whole transport solve, beside the cosine transform it is made of: divide the one by the
//! other for a figure that does not depend on the machine. `GLASSWARP_BENCH_LARGE=1` adds 2049 and
//! 4097 nodes.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glasswarp::{
    bench::{Bench, ExitFace},
    grid::{
        Extent, Field,
        dct::{CosineFilter, Symmetry},
    },
    irradiance::TargetIrradiance,
    solver::{Problem, Silent, Solver},
    transport::{Quality, Transport, TransportOptions},
};

/// Smooth parts, edges and a dark corner.
fn target(pixels: usize) -> TargetIrradiance {
    let cells = Field::from_fn(pixels, pixels, |i, j| {
        let (x, y) = (i as f64 / pixels as f64, j as f64 / pixels as f64);
        let disc = (x - 0.4).hypot(y - 0.6) < 0.2;
        0.1 + 0.5 * (9.0 * x + 5.0 * y * y).sin().abs() + if disc { 0.4 } else { 0.0 }
    });
    TargetIrradiance::new(cells).expect("a picture with light")
}

fn cosine_pair(criterion: &mut Criterion) {
    let n = 1025;
    let mut filter = CosineFilter::new(Symmetry::Nodes, n, n);
    let mut field = Field::from_fn(n, n, |i, j| ((i * 7 + j * 13) % 101) as f64);
    criterion.bench_function("pair of cosine transforms, 1025 x 1025", |b| {
        b.iter(|| filter.apply(&mut field, |_, _| 1.0));
    });
}

fn solve(criterion: &mut Criterion) {
    let bench = Bench::new(Extent::new(100.0, 100.0), 250.0, ExitFace::Refracts { ior: 1.5 }).expect("a usual bench");
    let mut sizes = vec![257, 513, 641, 1025];
    if std::env::var_os("GLASSWARP_BENCH_LARGE").is_some() {
        sizes.extend([2049, 4097]);
    }
    for (name, quality) in [("draft", Quality::Draft), ("normal", Quality::Normal)] {
        let mut group = criterion.benchmark_group(format!("transport, {name}"));
        group.sample_size(10);
        for &nodes in &sizes {
            let target = target((nodes / 2).min(512));
            let solver = Transport::new(TransportOptions::new(quality)).expect("options in range");
            group.bench_function(BenchmarkId::from_parameter(nodes), |b| {
                b.iter(|| solver.solve(&Problem::new(&bench, &target), (nodes, nodes), &Silent).expect("a solution"));
            });
        }
    }
}

criterion_group!(transport, cosine_pair, solve);
criterion_main!(transport);
