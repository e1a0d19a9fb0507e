use super::*;
use crate::measured::at_worst;

const BLOCK: Extent = Extent::new(60.0, 40.0);
const INDEX: f64 = 1.49;

fn wavy() -> Arc<SurfaceSpline> {
    // Larger than the block, so that oblique light comes through it everywhere.
    let (plate, (nx, ny)) = (Extent::new(90.0, 66.0), (181, 133));
    let height = |p: DVec2| 0.3 * (0.21 * p.x).sin() * (0.17 * p.y + 0.4).cos() + 0.05 * (0.5 * p.x + 0.3 * p.y).sin();
    Arc::new(SurfaceSpline::interpolating(plate, &Field::from_fn(nx, ny, |i, j| height(plate.node(i, j, nx, ny)))))
}

/// A given entry face, a plate before the block, in every light.
fn ways() -> Vec<(Beginning, Vec<KnownFace>)> {
    let face = |shape, z_mm, index_behind| KnownFace { shape, z_mm, index_behind };
    let sphere = vec![face(FaceShape::Sphere { radius_mm: 200.0 }, -12.0, INDEX)];
    let cylinder = vec![face(FaceShape::Cylinder { radius_mm: -150.0, along_x: true }, -12.0, INDEX)];
    let plate = vec![
        face(FaceShape::Plane, -38.0, 1.6),
        face(FaceShape::Heights(wavy()), -30.0, 1.0),
        face(FaceShape::Plane, -10.0, INDEX),
    ];
    let lights = [
        Beginning::Parallel(DVec3::Z),
        Beginning::Parallel(DVec3::new(0.1, -0.07, 1.0).normalize()),
        Beginning::Point(DVec3::new(10.0, -5.0, -400.0), Intensity::Isotropic),
        Beginning::Point(DVec3::new(-6.0, 15.0, -300.0), Intensity::Lambertian),
    ];
    let faces = [sphere, cylinder, plate];
    lights.into_iter().flat_map(|light| faces.clone().map(|faces| (light, faces))).collect()
}

#[test]
fn a_sphere_refracts_as_in_closed_form() {
    let (radius, z, at) = (300.0, -15.0, DVec2::new(23.0, -11.0));
    let faces = [KnownFace { shape: FaceShape::Sphere { radius_mm: radius }, z_mm: z, index_behind: INDEX }];
    let way = Way { beginning: Beginning::Parallel(DVec3::Z), faces: &faces };
    let bundle = way.follow(at).unwrap();
    // In the plane of incidence: the angle to the radius, before and behind.
    let rho = at.length();
    let angle = (rho / radius).asin();
    let turned = angle - (rho / radius / INDEX).asin();
    let sagitta = radius - (radius * radius - rho * rho).sqrt();
    let crossing = rho + (z + sagitta) * turned.tan();
    assert!((bundle.at.truncate() - at * (crossing / rho)).length() < 1e-11);
    let direction = (-at * (turned.sin() / rho)).extend(turned.cos());
    assert!((bundle.direction - direction).length() < 1e-14);
    let phase = z + sagitta - INDEX * (z + sagitta) / turned.cos();
    assert!((bundle.phase_mm - phase).abs() < 1e-11, "{} {phase}", bundle.phase_mm);
}

/// The greatest of each kind of figure.
#[derive(Default)]
struct Worst(std::collections::BTreeMap<&'static str, f64>);

impl Worst {
    fn see(&mut self, what: &'static str, found: f64) {
        let worst = self.0.entry(what).or_default();
        *worst = if found.is_nan() { f64::INFINITY } else { worst.max(found) };
    }

    fn is(&self, measured: &[(&str, f64)]) {
        assert_eq!(self.0.len(), measured.len());
        measured
            .iter()
            .for_each(|&(what, measured)| at_worst(measured, self.0[what], format_args!("{what} of {:?}", self.0)));
    }
}

#[test]
fn rays_have_the_derivatives_that_differences_tell_and_cross_the_wave_at_right_angles() {
    let mut worst = Worst::default();
    for (beginning, faces) in ways() {
        let way = Way { beginning, faces: &faces };
        let label = way.start(DVec2::new(7.3, -4.1));
        let bundle = way.follow(label).unwrap();
        let step = 1e-4 * label.length();
        for (k, unit) in [DVec2::X, DVec2::Y].into_iter().enumerate() {
            let [a, b] = [-step, step].map(|step| way.follow(label + unit * step).unwrap());
            let at_by = (b.at - a.at) / (2.0 * step);
            let direction_by = (b.direction - a.direction) / (2.0 * step);
            let phase_by = (b.phase_mm - a.phase_mm) / (2.0 * step);
            worst.see("places", (at_by - bundle.at_by[k]).length() / at_by.length());
            worst.see("directions", (direction_by - bundle.direction_by[k]).length() * 100.0 / at_by.length());
            // Malus and Dupin.
            let along = bundle.index * bundle.direction.dot(bundle.at_by[k]);
            worst.see("phase", (phase_by - along).abs() / at_by.length());
        }
    }
    worst.is(&[("places", 6e-8), ("directions", 6e-6), ("phase", 6e-8)]);
}

#[test]
fn the_wave_is_that_of_its_rays_before_and_behind_its_plane() {
    let mut worst = Worst::default();
    for (beginning, faces) in ways() {
        let wave = passed(beginning, &faces, BLOCK).unwrap();
        let way = Way { beginning, faces: &faces };
        let middle = wave.near(DVec2::ZERO, 0.0, None).unwrap();
        let scale = {
            let label = wave.carried_label(&middle).matrix().determinant();
            let node = way.through(DVec2::ZERO, way.start(DVec2::ZERO)).unwrap();
            (label / node.by_place.determinant()).sqrt()
        };
        for (at, z) in [(DVec2::new(11.0, -7.0), 0.0), (DVec2::new(-21.3, 14.2), 1.3), (DVec2::new(28.0, -19.0), -2.1)]
        {
            let crossing = wave.near(at, z, None).unwrap();
            // The traced ray through the same point.
            let node = way.through(crossing.at, way.start(crossing.at)).unwrap();
            let bundle = way.follow(node.label).unwrap();
            let incident = crossing.tangential.extend(crossing.axial);
            worst.see("direction", (incident - bundle.direction * bundle.index).length());
            let point = bundle.at + bundle.direction * (z / bundle.direction.z);
            worst.see("place", (point - at.extend(z)).length());
            let by_place = wave.carried_label(&wave.near(crossing.at, 0.0, None).unwrap()).matrix();
            let error = (by_place - node.by_place * scale).to_cols_array().iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            // The label bends where the second derivatives of a face do, between the nodes of the plane too.
            worst.see("label", error);
        }
    }
    worst.is(&[("direction", 1.13e-6), ("place", 1.59e-6), ("label", 1.11e-3)]);
}

#[test]
fn what_the_wave_tells_of_its_derivatives_is_what_differences_tell() {
    let mut worst = Worst::default();
    for (beginning, faces) in ways() {
        let wave = passed(beginning, &faces, BLOCK).unwrap();
        let (at, z, step) = (DVec2::new(11.03, -7.02), 1.7, 1e-3);
        let here = wave.near(at, z, None).unwrap();
        let incident = here.tangential.extend(here.axial);
        let w = DMat2::from_cols(DVec2::new(0.3, -0.8), DVec2::new(0.5, 1.1));
        let contracted = |b: DMat2| w.x_axis.dot(b.x_axis) + w.y_axis.dot(b.y_axis);
        let label = wave.carried_label(&here);
        let (by_place, by_z) = label.variation(w);
        for (k, unit) in [DVec2::X, DVec2::Y].into_iter().enumerate() {
            let [a, b] = [-step, step].map(|step| wave.near(at + unit * step, z, None).unwrap());
            worst.see("gradient", ((b.phase_mm - a.phase_mm) / (2.0 * step) - incident[k]).abs());
            let bend = wave.bend(&here).col(k);
            worst.see("bend", ((b.tangential - a.tangential) / (2.0 * step) - bend).length());
            let [a, b] = [a, b].map(|near| contracted(wave.carried_label(&near).matrix()));
            // What is left out: how the spread of the rays changes across them.
            worst.see("label across the ray", ((b - a) / (2.0 * step) - by_place[k]).abs());
        }
        let along = here.tangential / here.axial;
        let [a, b] = [-step, step].map(|step| wave.near(at + along * step, z + step, None).unwrap());
        let slope = (b.phase_mm - a.phase_mm) / (2.0 * step);
        worst.see("gradient along", (slope - incident.dot(along.extend(1.0))).abs());
        let [a, b] = [a, b].map(|near| contracted(wave.carried_label(&near).matrix()));
        worst.see("label along the ray", ((b - a) / (2.0 * step) - by_z).abs());
    }
    let across = [("bend", 2.03e-7), ("gradient", 1.69e-9), ("label across the ray", 8e-3)];
    worst.is(&[across[0], across[1], across[2], ("gradient along", 8e-13), ("label along the ray", 2.58e-7)]);
}

#[test]
fn light_that_does_not_come_through_is_refused() {
    let face = |shape, z_mm, index_behind| KnownFace { shape, z_mm, index_behind };
    // A ball smaller than the block; a lens whose focus lies before the block; a plate smaller than the
    // light that it would have to send.
    let small = [face(FaceShape::Sphere { radius_mm: 25.0 }, -40.0, INDEX)];
    assert!(matches!(passed(Beginning::Parallel(DVec3::Z), &small, BLOCK), Err(PassageError::Dark { face: 1, .. })));
    let lens = [face(FaceShape::Sphere { radius_mm: 100.0 }, -900.0, INDEX)];
    let error = passed(Beginning::Parallel(DVec3::Z), &lens, BLOCK).unwrap_err();
    assert!(matches!(error, PassageError::Folded { .. } | PassageError::Dark { .. }), "{error}");
    let narrow = Arc::new(SurfaceSpline::interpolating(Extent::new(50.0, 40.0), &Field::filled(51, 41, 0.0)));
    let plate = [
        face(FaceShape::Plane, -50.0, INDEX),
        face(FaceShape::Heights(narrow), -40.0, 1.0),
        face(FaceShape::Plane, -10.0, INDEX),
    ];
    let error = passed(Beginning::Parallel(DVec3::Z), &plate, BLOCK).unwrap_err();
    assert!(matches!(error, PassageError::Beside { face: 2, .. }), "{error}");
    assert!(error.to_string().contains("5.0"), "{error}");
}
