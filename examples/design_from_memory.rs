//! A picture that is in no file becomes a block: `cargo run --release --example
//! design_from_memory`.

use glasswarp::{
    bench::{Bench, ExitFace},
    export::{self, Design},
    grid::{Extent, Field},
    irradiance::{Picture, TargetIrradiance},
    pipeline,
    solid::Stock,
    solver::{Problem, Silent},
    transport::Transport,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Light on a 0..1 scale, row 0 on top: a disc that grows darker to its right.
    let light = Field::from_fn(64, 48, |column, row| {
        let (x, y) = (column as f64 / 32.0 - 1.0, row as f64 / 32.0 - 0.75);
        if x * x + y * y < 0.4 { 0.8 - 0.3 * x } else { 0.2 }
    });
    let target = TargetIrradiance::from_picture(&Picture::from_values(light)?, 0.1)?;

    // 80 mm of acrylic, the wall 30 cm away. Heights at 129 x 97 nodes.
    let block = Extent::new(80.0, 60.0);
    let bench = Bench::new(block, 300.0, ExitFace::Refracts { ior: 1.49 })?;
    let nodes = pipeline::node_grid(block, 129)?;
    let block = pipeline::design(
        &Problem::new(&bench, &target),
        nodes,
        &Transport::default(),
        &Stock::thinnest_sheet().into(),
        &Silent,
    )?;
    println!("relief {:.3} mm, thinnest {:.3} mm", block.surface.relief_mm(), block.solid.thinnest_mm());
    for warning in &block.summary.warnings {
        println!("warning: {warning}");
    }

    let design = Design { name: "disc".into(), exit_face: bench.exit_face(), distance_mm: bench.distance_mm() };
    export::export(&std::env::temp_dir().join("disc.stl"), &block.solid, &design)?;
    Ok(())
}
