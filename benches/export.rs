//! Export of a block into memory, by format.
#![allow(missing_docs)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glasswarp::{
    bench::ExitFace,
    export::{Design, Format},
    grid::{Extent, Field},
    solid::{Solid, Stock},
    surface::HeightField,
};
use std::hint::black_box;

fn surface(n: usize) -> HeightField {
    let extent = Extent::new(100.0, 100.0);
    let height = |i, j| {
        let at = extent.node(i, j, n, n);
        0.6 * (0.11 * at.x + 0.3).sin() * (0.07 * at.y - 0.2).cos() + 0.002 * at.x * at.y
    };
    HeightField::new(extent, Field::from_fn(n, n, height))
}

fn export(criterion: &mut Criterion) {
    let design =
        Design { name: "benchmark".to_owned(), exit_face: ExitFace::Refracts { ior: 1.49 }, distance_mm: 250.0 };
    for n in [641, 1025] {
        let surface = surface(n);
        let mut group = criterion.benchmark_group(format!("export {n} x {n}"));
        group.sample_size(10).throughput(Throughput::Elements((n * n) as u64));
        group.bench_function("solid", |bencher| {
            bencher.iter(|| Solid::new(black_box(&surface), Stock::default()));
        });
        let solid = Solid::new(&surface, Stock::default()).expect("a shallow relief");
        group.bench_function("check", |bencher| bencher.iter(|| black_box(&solid).check()));
        for format in Format::ALL {
            let mut bytes = Vec::new();
            group.bench_function(format.extension(), |bencher| {
                bencher.iter(|| {
                    bytes.clear();
                    format.write(&mut bytes, black_box(&solid), &design)
                });
            });
        }
    }
}

criterion_group!(benches, export);
criterion_main!(benches);
