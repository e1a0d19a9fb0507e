//! Looks at a mesh that anybody made: `cargo run --release --example verify_mesh`.

use glam::DVec2;
use glasswarp_verify::{
    Block, PhotonPlan, Scene, Surface, Tracer, Window, beams,
    load::{self, Format},
    photons, solid,
};

/// A plate of 40 x 40 x 5 mm as text, one triangle after the other.
fn plate() -> String {
    let corner = |k: usize| [[-20, 20][k & 1], [-20, 20][k >> 1 & 1], [-5, 0][k >> 2 & 1]];
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut text = "solid plate\n".to_owned();
    for [a, b, c, d] in faces {
        for triangle in [[a, b, c], [a, c, d]] {
            text += "facet normal 0 0 0\nouter loop\n";
            for [x, y, z] in triangle.map(corner) {
                text += &format!("vertex {x} {y} {z}\n");
            }
            text += "endloop\nendfacet\n";
        }
    }
    text + "endsolid plate\n"
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh = load::parse(Format::Stl, plate().as_bytes())?;
    println!("{}", solid::check(&mesh));

    // Parallel light through it onto a window of 50 x 50 mm, 10 cm away.
    let window = Window { size_mm: DVec2::splat(50.0), centre_mm: DVec2::ZERO, nx: 50, ny: 50 };
    let scene = Scene::new(1.5, 100.0, window);
    // A regular grid over a planar face is a block, and its face is smooth; everything else is
    // traced as its flat triangles.
    let tracer = match Block::from_mesh(&mesh) {
        Ok(block) => Tracer::for_block(&block, &scene)?,
        Err(_) => Tracer::for_solid(&mesh, &Scene { surface: Surface::Facets, ..scene })?,
    };
    let image = beams(&tracer, 200, 200).image;
    let tally = photons(&tracer, &PhotonPlan::new(100_000, 1))?;
    println!("mean irradiance {:.3}, {:.3} of the light in the window", image.mean(), tally.flux().window);
    // A plate bends no light: all of it falls into the middle, 40 x 40 of 50 x 50 pixels.
    assert_eq!(tally.flux().lost, 0.0);
    assert!((tally.flux().window - 1.0).abs() < 1e-6);
    Ok(())
}
