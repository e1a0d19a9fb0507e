//! What verification costs: recognising a block, building the hierarchy, rays and photons per
//! second.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{block, relief, scene};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use glasswarp_verify::{Block, PhotonPlan, Scene, Surface, Tracer, Traversal, beams, photons};

const NODES: usize = 641;
const SIZE: DVec2 = DVec2::splat(100.0);

fn trace(c: &mut Criterion) {
    let mesh = block(NODES, NODES, SIZE, -15.0, relief);
    let recognised = Block::from_mesh(&mesh).expect("a block");
    let straight = scene(SIZE, 512, 250.0);
    let mut group = c.benchmark_group("verify");
    group.sample_size(10);

    group.bench_function("recognise a block of 641 x 641 nodes", |b| b.iter(|| Block::from_mesh(&mesh)));
    group.throughput(Throughput::Elements((NODES as u64 - 1).pow(2)));
    group.bench_function("hierarchy over its exit face", |b| {
        b.iter_batched(
            || Tracer::for_block(&recognised, &straight).expect("a bench"),
            // The first ray builds it.
            |tracer| tracer.path(DVec2::ZERO),
            BatchSize::PerIteration,
        );
    });
    let facets = Scene { surface: Surface::Facets, ..straight.clone() };
    let large = block(1001, 1001, SIZE, -15.0, relief);
    group.throughput(Throughput::Elements(large.triangles.len() as u64));
    group.bench_function("hierarchy over a whole solid of 2 million triangles", |b| {
        b.iter(|| Tracer::for_solid(&large, &facets));
    });

    let plan = PhotonPlan::new(1_000_000, 1);
    let mut tracers = Vec::new();
    for traversal in [Traversal::Grid, Traversal::Bvh] {
        for surface in [Surface::Spline, Surface::Facets] {
            let scene = Scene { surface, traversal, ..straight.clone() };
            let tracer = Tracer::for_block(&recognised, &scene).expect("a bench");
            tracers.push((format!("{traversal:?}, {surface:?}"), tracer));
        }
    }
    tracers.push(("Bvh, full solid".into(), Tracer::for_solid(&mesh, &facets).expect("a bench")));
    for (name, tracer) in &tracers {
        let count = photons(tracer, &plan).expect("a plan").photons();
        group.throughput(Throughput::Elements(count));
        group.bench_function(format!("photons, {name}"), |b| b.iter(|| photons(tracer, &plan)));
    }
    group.throughput(Throughput::Elements(2048 * 2048));
    group.bench_function("beams, 4 x 4 per pixel of 512 x 512", |b| b.iter(|| beams(&tracers[0].1, 2048, 2048)));
    group.finish();
}

criterion_group!(benches, trace);
criterion_main!(benches);
