use super::*;
use crate::{
    bench::{Bench, ExitFace},
    grid::Extent,
};
use glam::{DMat2, DVec2, DVec3};

fn waves() -> Vec<PointWave> {
    let block = Extent::new(50.0, 40.0);
    let glass = Bench::new(block, 120.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
    let mirror = Bench::new(block, 120.0, ExitFace::Reflects).unwrap();
    let mut waves = Vec::new();
    for intensity in [Intensity::Isotropic, Intensity::Lambertian] {
        for (bench, at) in [
            (glass.clone(), DVec3::new(0.0, 0.0, -70.0)),
            (glass.clone(), DVec3::new(15.0, -25.0, -60.0)),
            (mirror.clone(), DVec3::new(-10.0, 30.0, 80.0)),
        ] {
            waves.push(bench.with_point_source(at, 12.0, intensity).unwrap().wave().unwrap());
        }
    }
    waves
}

#[test]
fn the_ray_is_refracted_at_the_entry_face_and_hits_the_point() {
    let bench = Bench::new(Extent::new(50.0, 40.0), 120.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
    let source = DVec3::new(15.0, -25.0, -60.0);
    let wave = bench.with_point_source(source, 12.0, Intensity::Isotropic).unwrap().wave().unwrap();
    let to = DVec3::new(-24.0, 19.0, 1.7);
    let arrival = wave.at(to.truncate(), to.z).unwrap();
    let inside = arrival.tangential.extend(arrival.axial);
    assert!((inside.length() - 1.5).abs() < 1e-14);
    let entry = to - inside * ((to.z + 12.0) / inside.z);
    let outside = (entry - source).normalize();
    assert!((outside.truncate() - inside.truncate()).length() < 1e-14);
    // The phase is the optical length, less that of the axial ray to the mean plane.
    let length = (entry - source).length() + 1.5 * (to - entry).length();
    assert!((arrival.phase_mm - (length - 48.0 - 1.5 * 12.0)).abs() < 1e-12);
}

#[test]
fn the_phase_has_the_direction_as_its_gradient_and_bends_with_it() {
    for wave in waves() {
        let (x, z) = (DVec2::new(11.0, -17.0), -0.8);
        let at = wave.at(x, z).unwrap();
        let step = 1e-4;
        let slope = |d: DVec3| {
            let phase = |s: f64| wave.at(x + s * d.truncate(), z + s * d.z).unwrap().phase_mm;
            (phase(step) - phase(-step)) / (2.0 * step)
        };
        let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
        assert!((gradient - at.tangential.extend(at.axial)).length() < 1e-9, "{wave:?}");
        for (axis, d) in [DVec2::X, DVec2::Y].into_iter().enumerate() {
            let m = |s: f64| wave.at(x + s * d, z).unwrap().tangential;
            let bend = (m(step) - m(-step)) / (2.0 * step);
            assert!((bend - wave.bend(&at).col(axis)).length() < 1e-10, "{wave:?}");
        }
    }
}

#[test]
fn the_footprint_measures_solid_angle() {
    for wave in waves() {
        let x = DVec2::new(11.0, -17.0);
        let at = wave.at(x, 0.0).unwrap();
        // The flux per area of the plane, from the directions in air: dOmega = dm_x dm_y / cos.
        let cos = (1.0 - at.mu).sqrt();
        let weight = match wave.intensity {
            Intensity::Isotropic => 1.0 / cos,
            Intensity::Lambertian => 1.0,
        };
        let wanted = wave.bend(&at).determinant() * weight * wave.scale_mm * wave.scale_mm;
        assert!((wave.footprint(&at).determinant() / wanted - 1.0).abs() < 1e-13);
        assert!((wave.footprint(&at).matrix().determinant() / wanted - 1.0).abs() < 1e-13);
    }
}

#[test]
fn the_footprint_varies_as_finite_differences_say() {
    let q = DMat2::from_cols(DVec2::new(0.7, -0.2), DVec2::new(0.3, 1.2));
    for wave in waves() {
        let at = wave.at(DVec2::new(11.0, -17.0), -0.8).unwrap();
        let value = |dm: DVec2, dz: f64| {
            let m = at.tangential + dm;
            let depth_mm = at.depth_mm + wave.sense * dz;
            let b = wave.footprint(&PointArrival { tangential: m, mu: m.length_squared(), depth_mm, ..at }).matrix();
            q.col(0).dot(b.col(0)) + q.col(1).dot(b.col(1))
        };
        let (by_m, by_z) = wave.footprint(&at).variation(q);
        let step = 1e-5;
        let slope = |dm: DVec2, dz: f64| (value(dm * step, dz * step) - value(-dm * step, -dz * step)) / (2.0 * step);
        let got = [by_m.x, by_m.y, by_z];
        let wanted = [slope(DVec2::X, 0.0), slope(DVec2::Y, 0.0), slope(DVec2::ZERO, 1.0)];
        for (got, wanted) in got.into_iter().zip(wanted) {
            assert!((got - wanted).abs() < 1e-8 * (1.0 + wanted.abs()), "{wave:?}: {got} against {wanted}");
        }
    }
}
