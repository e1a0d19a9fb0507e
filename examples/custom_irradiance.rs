//! Light that no picture holds: any positive function of the place on the wall, in any unit.
//! `cargo run --release --example custom_irradiance`.

use glasswarp::{
    bench::{Bench, ExitFace},
    forward,
    grid::{Extent, Field},
    irradiance::TargetIrradiance,
    solver::{Problem, Silent, Solver},
    surface::SurfaceSpline,
    transport::Transport,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // In the frame: column along +x, row along +y. A spot of light in lux; only its shape matters.
    let lux = Field::from_fn(96, 96, |i, j| {
        let (x, y) = (i as f64 / 48.0 - 1.0, j as f64 / 48.0 - 1.0);
        120.0 + 400.0 * (-4.0 * (x * x + y * y)).exp()
    });
    let target = TargetIrradiance::new(lux)?;
    let bench = Bench::new(Extent::new(50.0, 50.0), 200.0, ExitFace::Refracts { ior: 1.5 })?;
    let solution = Transport::draft().solve(&Problem::new(&bench, &target), (129, 129), &Silent)?;

    // Cast light forward through the face, and compare with what was wanted.
    let spline = SurfaceSpline::through(&solution.exit);
    let seen = forward::irradiance(&spline, &bench, forward::Geometry::Displaced, (384, 384), (96, 96));
    let difference = |(a, b): (&f64, &f64)| (a - b).powi(2);
    let pairs = seen.irradiance.as_slice().iter().zip(target.cells().as_slice());
    let rms = (pairs.map(difference).sum::<f64>() / 9216.0).sqrt();
    println!("relative RMS error {rms:.4}");
    assert!(rms < 0.02);
    Ok(())
}
