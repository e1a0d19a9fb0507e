//! The two costs that brightness warping is made of: one evaluation of its objective with gradient,
//! and one set of heights from slopes.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec2;
use glasswarp::{
    bench::{Bench, ExitFace},
    grid::{Extent, Field},
    optim::Objective,
    surface::{EdgeRule, heights_of_slopes},
    warp::{WarpMesh, WarpObjective},
};
use std::hint::black_box;

const BLOCK: Extent = Extent::new(100.0, 100.0);

fn objective_and_gradient(criterion: &mut Criterion) {
    let bench = Bench::new(BLOCK, 250.0, ExitFace::Refracts { ior: 1.5 }).expect("a usual bench");
    let quads = (640, 640);
    let cells = Field::from_fn(quads.0, quads.1, |i, j| 1.5 + (i as f64 * 0.1).sin() * (j as f64 * 0.07).cos());
    let weight = WarpObjective::balanced_weight_mm2(&bench, quads);
    let mut objective = WarpObjective::new(&bench, &cells, weight);
    let mesh = WarpMesh::regular(BLOCK, quads);
    let u = mesh.unknowns();
    let mut gradient = vec![0.0; u.len()];
    criterion.bench_function("objective and gradient, 640 x 640 quads", |b| {
        b.iter(|| objective.evaluate(black_box(u), &mut gradient));
    });
}

fn heights(criterion: &mut Criterion) {
    let n = 641;
    let slopes = Field::from_fn(n, n, |i, j| DVec2::new((i as f64 * 0.02).sin(), (j as f64 * 0.03).cos()));
    criterion.bench_function("heights from slopes, 641 x 641 nodes", |b| {
        b.iter(|| heights_of_slopes(black_box(&slopes), BLOCK, EdgeRule::FourPoint));
    });
}

criterion_group! {
    name = solve;
    config = Criterion::default().sample_size(20);
    targets = objective_and_gradient, heights
}
criterion_main!(solve);
