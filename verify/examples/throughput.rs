//! Rays per second of one core, for the comparison in `benches/embree.py`.
//!
//! Takes a block and a file of starting points (pairs of little-endian f64, mm), follows every ray
//! from the entry plane to the receiver, and prints one line for each way of tracing: its name, the
//! seconds of CPU, and the sum of the landing points.

use glam::DVec2;
use glasswarp_verify::{Block, End, Scene, Surface, Tracer, Traversal, Window, load};
use std::{env, error::Error, fs, path::Path, time::Instant};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().collect();
    let [_, block, starts] = &arguments[..] else { return Err("usage: throughput BLOCK STARTS".into()) };
    let mesh = load::read(Path::new(block))?;
    let block = Block::from_mesh(&mesh)?;
    let bytes = fs::read(starts)?;
    let number = |bytes: &[u8]| bytes.try_into().map(f64::from_le_bytes);
    let starts = bytes
        .chunks_exact(16)
        .map(|pair| Ok(DVec2::new(number(&pair[..8])?, number(&pair[8..])?)))
        .collect::<Result<Vec<_>, std::array::TryFromSliceError>>()?;

    let window = Window { size_mm: block.size_mm(), centre_mm: DVec2::ZERO, nx: 512, ny: 512 };
    let facets = Scene { surface: Surface::Facets, ..Scene::new(1.5, 250.0, window) };
    let spline = Scene { surface: Surface::Spline, ..facets.clone() };
    for (name, tracer) in [
        ("block, hierarchy, facets", Tracer::for_block(&block, &facets)?),
        ("block, hierarchy, spline", Tracer::for_block(&block, &spline)?),
        ("block, grid, spline", Tracer::for_block(&block, &Scene { traversal: Traversal::Grid, ..spline })?),
        ("any solid, hierarchy, facets", Tracer::for_solid(&mesh, &facets)?),
    ] {
        // The first ray builds the hierarchy.
        tracer.path(DVec2::ZERO);
        let begin = cpu_seconds();
        let mut sum = DVec2::ZERO;
        for &start in &starts {
            if let End::Receiver(at) = tracer.path(start).end {
                sum += at;
            }
        }
        println!("{name}\t{}\t{}", cpu_seconds() - begin, sum.x + sum.y);
    }
    Ok(())
}

/// Seconds that this thread has run, where the system counts them; others may use the machine.
fn cpu_seconds() -> f64 {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    let counted = fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = counted.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| START.get_or_init(Instant::now).elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}
