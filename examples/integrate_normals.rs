//! Only the integration: normals of any origin, photometric stereo for instance, become heights.
//! `cargo run --release --example integrate_normals`.

use glam::{DVec2, DVec3};
use glasswarp::{
    grid::{Extent, Field},
    optics::slopes_of_normal,
    surface::{EdgeRule, heights_of_slopes},
};

fn main() {
    // Normals of a wave of 1 mm on nodes that span 60 x 40 mm, not normalised.
    let (extent, nx, ny) = (Extent::new(60.0, 40.0), 121, 81);
    let wave = |at: DVec2| (0.2 * at.x).sin() * (0.15 * at.y).cos();
    let normals = Field::from_fn(nx, ny, |i, j| {
        let at = extent.node(i, j, nx, ny);
        let along_x = 0.2 * (0.2 * at.x).cos() * (0.15 * at.y).cos();
        let along_y = -0.15 * (0.2 * at.x).sin() * (0.15 * at.y).sin();
        DVec3::new(-along_x, -along_y, 1.0)
    });
    let surface = heights_of_slopes(&normals.map(|&normal| slopes_of_normal(normal)), extent, EdgeRule::FourPoint);

    // Heights are known but for a constant: their mean is 0.
    let truth = Field::from_fn(nx, ny, |i, j| wave(extent.node(i, j, nx, ny)));
    let mean = truth.mean();
    let pairs = surface.heights_mm().as_slice().iter().zip(truth.as_slice());
    let worst = pairs.map(|(found, wanted)| (found - (wanted - mean)).abs()).fold(0.0, f64::max);
    println!("heights within {worst:.4} mm");
    assert!(worst < 0.01);
}
