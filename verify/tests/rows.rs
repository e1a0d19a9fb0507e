//! Blocks in a row, and blocks whose entry face is not planar, against closed forms and against a
//! tracer of polynomials, which a bicubic spline holds to rounding.

mod common;
#[path = "../../tests/common/measured.rs"]
mod measured;

use common::{relief, scene};
use glam::{DMat3, DQuat, DVec2, DVec3};
use glasswarp_verify::{
    Block, Displacement, Emission, End, Fresnel, Geometry, Light, PhotonPlan, Row, RowBlock, Scene, SceneError,
    SourceExtent, Surface, Tracer, Traversal, Window, beams, facet_beams, light_on_plane, photons,
};

const SIZE: DVec2 = DVec2::new(40.0, 30.0);
/// Landing points are asked for to a picometre of a metre.
const MM: f64 = 1e-9;

/// Heights on a grid over [`SIZE`].
fn heights(size: DVec2, (nx, ny): (usize, usize), height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let at = |k: usize, n: usize, size: f64| size * (k as f64 / (n - 1) as f64 - 0.5);
    (0..nx * ny).map(|k| height(at(k % nx, nx, size.x), at(k / nx, ny, size.y))).collect()
}

/// A block with a planar entry face.
fn plate(size: DVec2, nodes: (usize, usize), entry_z: f64, height: impl Fn(f64, f64) -> f64) -> Block {
    Block::from_heights(size, entry_z, nodes, heights(size, nodes, height)).unwrap()
}

/// A block with a relief on both sides.
fn between(
    size: DVec2,
    nodes: (usize, usize),
    entry: impl Fn(f64, f64) -> f64,
    exit: impl Fn(f64, f64) -> f64,
) -> Block {
    plate(size, nodes, -1e3, exit).with_entry_heights(nodes, heights(size, nodes, entry)).unwrap()
}

/// Points within the plan, a part of whose size they are, and on its grid lines.
fn starts(size: DVec2, part: f64) -> impl Iterator<Item = DVec2> {
    (0..=20).flat_map(move |j| {
        (0..=24).map(move |i| DVec2::new(f64::from(i) / 24.0 - 0.5, f64::from(j) / 20.0 - 0.5) * size * part)
    })
}

fn landing(tracer: &Tracer, at: DVec2) -> DVec2 {
    match tracer.path_at(at).end {
        End::Receiver(at) => at,
        other => panic!("{at} ended as {other:?}"),
    }
}

/// A polynomial in x and y, of third degree at most along each.
#[derive(Clone, Copy)]
struct Cubic {
    z: f64,
    terms: [(f64, i32, i32); 5],
}

impl Cubic {
    const fn plane(z: f64) -> Self {
        Self { z, terms: [(0.0, 0, 0); 5] }
    }

    fn height(&self, x: f64, y: f64) -> f64 {
        self.z + self.terms.iter().map(|&(c, i, j)| c * x.powi(i) * y.powi(j)).sum::<f64>()
    }

    fn slopes(&self, x: f64, y: f64) -> DVec2 {
        let by = |c: f64, of: i32, other: f64| if of == 0 { 0.0 } else { c * f64::from(of) * other };
        let along_x = |&(c, i, j): &(f64, i32, i32)| by(c, i, x.powi((i - 1).max(0)) * y.powi(j));
        let along_y = |&(c, i, j): &(f64, i32, i32)| by(c, j, x.powi(i) * y.powi((j - 1).max(0)));
        DVec2::new(self.terms.iter().map(along_x).sum(), self.terms.iter().map(along_y).sum())
    }
}

/// A face of a reference tracer: in its own frame, which stands so in the bench's.
struct Interface {
    face: Cubic,
    turn: DMat3,
    shift: DVec3,
    /// Index before it over that behind it.
    eta: f64,
}

/// Where a ray lands that goes through these faces: found by halving intervals, refracted by
/// keeping the part of the wave vector along the face.
fn reference(mut point: DVec3, mut direction: DVec3, faces: &[Interface], distance: f64) -> DVec2 {
    for Interface { face, turn, shift, eta } in faces {
        let (p, d) = (turn.transpose() * (point - *shift), turn.transpose() * direction);
        let above = |t: f64| {
            let q = p + t * d;
            q.z - face.height(q.x, q.y)
        };
        let about = (face.z - p.z) / d.z;
        let (mut near, mut far) = (about - 12.0, about + 12.0);
        assert!(above(near) < 0.0 && above(far) > 0.0);
        for _ in 0..200 {
            let middle = 0.5 * (near + far);
            if above(middle) < 0.0 { near = middle } else { far = middle }
        }
        let hit = p + 0.5 * (near + far) * d;
        let slopes = face.slopes(hit.x, hit.y);
        let normal = DVec3::new(-slopes.x, -slopes.y, 1.0).normalize();
        let along = *eta * (d - d.dot(normal) * normal);
        let out = along + (1.0 - along.length_squared()).sqrt() * normal;
        (point, direction) = (*turn * hit + *shift, *turn * out);
    }
    (point + direction * ((distance - point.z) / direction.z)).truncate()
}

const ENTRY: Cubic = Cubic { z: -14.0, terms: [(4e-3, 2, 0), (-2e-3, 0, 2), (6e-5, 2, 1), (1e-6, 3, 2), (0.02, 1, 0)] };
const EXIT: Cubic = Cubic { z: 0.1, terms: [(-3e-3, 2, 0), (2e-3, 1, 1), (4e-5, 0, 3), (-1e-6, 2, 3), (0.03, 0, 1)] };
const OTHER: Cubic = Cubic { z: -0.2, terms: [(2e-3, 2, 0), (3e-3, 0, 2), (-5e-5, 3, 0), (2e-6, 1, 3), (0.0, 0, 0)] };

fn of(cubic: Cubic) -> impl Fn(f64, f64) -> f64 {
    move |x, y| cubic.height(x, y)
}

fn at(face: Cubic, z: f64, eta: f64) -> Interface {
    Interface { face, turn: DMat3::IDENTITY, shift: DVec3::new(0.0, 0.0, z), eta }
}

/// Slabs in light along the axis: the second is displaced, and has another index.
#[test]
fn a_tilted_slab_behind_a_slab_shifts_everything_alike() {
    let slab = plate(SIZE, (9, 7), -10.0, |_, _| 0.0);
    let second = plate(2.0 * SIZE, (9, 7), -6.0, |_, _| 0.0);
    for traversal in [Traversal::Bvh, Traversal::Grid] {
        let scene = Scene { traversal, ..scene(SIZE, 32, 100.0) };
        for (tilt, ior) in [(0.0, 1.5), (0.1_f64, 1.5), (0.3, 1.7)] {
            let displaced = Displacement { shift_mm: DVec3::new(1.0, -2.0, 0.5), turned: DVec3::new(0.0, tilt, 0.0) };
            let row = Row::of(&slab).then(25.0, RowBlock { ior: Some(ior), displaced, ..RowBlock::from(&second) });
            let tracer = Tracer::for_row(&row, &scene).unwrap();
            // Parallel faces: the light goes on as it came, beside its way. Towards +x for a turn
            // that takes +z towards +x.
            let inside = (tilt.sin() / ior).asin();
            let shift = DVec2::new(6.0 * (tilt - inside).sin() / inside.cos(), 0.0);
            for start in starts(SIZE, 0.9) {
                let error = (landing(&tracer, start) - start - shift).length();
                assert!(error < MM, "{tilt} {ior} at {start}: {error:e} mm");
            }
        }
    }
}

/// Two plates, the second displaced in all ways.
#[test]
fn a_row_goes_as_a_tracer_of_polynomials_says() {
    let (first, second) = (plate(SIZE, (41, 31), -12.0, of(EXIT)), plate(SIZE, (33, 29), -9.0, of(OTHER)));
    let third = between(SIZE, (21, 25), of(ENTRY), of(EXIT));
    let displaced = Displacement { shift_mm: DVec3::new(0.3, -0.4, 0.2), turned: DVec3::new(0.02, -0.03, 0.05) };
    let middle = RowBlock { ior: Some(1.62), displaced, ..RowBlock::from(&second) };
    let row = Row::of(&first).then(30.0, middle).then(12.0, &third);
    let turn = DMat3::from_quat(DQuat::from_scaled_axis(displaced.turned));
    let light = DVec3::new(0.05, -0.03, 1.0).normalize();
    let places = row.places_mm();
    let entry_z = third.entry_z_mm();
    assert!((entry_z - ENTRY.z).abs() < 1.0 && places[2] == 0.0);
    assert_eq!(places[1], entry_z - 12.0);
    assert_eq!(places[0], places[1] - 9.0 - 30.0);
    let faces = |ior: f64| {
        let stand = displaced.shift_mm + DVec3::new(0.0, 0.0, places[1]);
        [
            at(Cubic::plane(-12.0), places[0], 1.0 / ior),
            at(EXIT, places[0], ior),
            Interface { face: Cubic::plane(-9.0), turn, shift: stand, eta: 1.0 / 1.62 },
            Interface { face: OTHER, turn, shift: stand, eta: 1.62 },
            at(ENTRY, 0.0, 1.0 / ior),
            at(EXIT, 0.0, ior),
        ]
    };
    for traversal in [Traversal::Bvh, Traversal::Grid] {
        let scene = Scene { traversal, light: Light::parallel(light), ..scene(SIZE, 32, 100.0) };
        let tracer = Tracer::for_row(&row, &scene).unwrap();
        let mut landed = 0;
        let mut worst = 0.0_f64;
        for start in starts(SIZE, 0.5) {
            let RayOn { exit, point } = above(start, places[0], EXIT);
            // Back from the exit face to the plane where the ray of the light begins.
            let inside = (light.truncate() / 1.5).extend((1.0 - (light.truncate() / 1.5).length_squared()).sqrt());
            let entered = point - inside * ((exit + 12.0) / inside.z);
            let wanted = reference(entered - 5.0 * light, light, &faces(1.5), 100.0);
            let error = (landing(&tracer, start) - wanted).length();
            worst = worst.max(error);
            landed += 1;
        }
        assert!(worst < MM && landed > 400, "{worst:e} mm");
    }
}

/// A point of a face above a place of its plan, on the bench.
struct RayOn {
    exit: f64,
    point: DVec3,
}

fn above(start: DVec2, place: f64, face: Cubic) -> RayOn {
    let exit = face.height(start.x, start.y);
    RayOn { exit, point: start.extend(exit + place) }
}

/// One block with two reliefs, in straight, oblique and spreading light.
#[test]
fn two_reliefs_go_as_a_tracer_of_polynomials_says() {
    let block = between(SIZE, (37, 33), of(ENTRY), of(EXIT));
    let source = DVec3::new(4.0, -3.0, -160.0);
    let lights = [
        Light::parallel(DVec3::Z),
        Light::parallel(DVec3::new(0.15, -0.1, 1.0)),
        Light::Point { position_mm: source, emission: Emission::Isotropic, axis: None },
    ];
    for light in lights {
        for traversal in [Traversal::Bvh, Traversal::Grid] {
            let scene = Scene { traversal, light: light.clone(), ..scene(SIZE, 32, 90.0) };
            let tracer = Tracer::for_block(&block, &scene).unwrap();
            let mut worst = 0.0_f64;
            for start in starts(SIZE, 0.7) {
                let point = start.extend(ENTRY.height(start.x, start.y));
                let direction = match &light {
                    Light::Parallel { direction } => direction.normalize(),
                    Light::Point { .. } => (point - source).normalize(),
                };
                let faces = [at(ENTRY, 0.0, 1.0 / 1.5), at(EXIT, 0.0, 1.5)];
                let wanted = reference(point - 6.0 * direction, direction, &faces, 90.0);
                worst = worst.max((landing(&tracer, start) - wanted).length());
            }
            assert!(worst < MM, "{light:?}: {worst:e} mm");
        }
    }
}

#[test]
fn a_wedge_below_turns_the_light_before_it_meets_the_exit_face() {
    let slope = 0.1_f64;
    let wedge = between(SIZE, (5, 5), |x, _| slope * x - 10.0, |_, _| 0.0);
    let tracer = Tracer::for_block(&wedge, &scene(SIZE, 8, 100.0)).unwrap();
    // The normal leans towards -x, and light towards it.
    let inside = slope.atan() - (slope.atan().sin() / 1.5).asin();
    let out = (1.5 * inside.sin()).asin();
    for start in starts(SIZE, 0.8) {
        let incidence = tracer.incidence_at(start).unwrap();
        assert!((incidence - inside).abs() < 1e-9, "{incidence} {inside}");
        let through = 10.0 - slope * start.x;
        let wanted = start.x - through * inside.tan() - 100.0 * out.tan();
        assert!((landing(&tracer, start) - DVec2::new(wanted, start.y)).length() < MM);
    }
}

/// The distance along the axis from a focus of an ellipsoid of revolution of eccentricity 1 / n to
/// its points `r` beside the axis, whose vertex is `vertex` away.
fn oval(n: f64, vertex: f64, r: f64) -> f64 {
    let (e, c) = (1.0 / n, vertex * (1.0 - 1.0 / n));
    (c * e + ((c * e).powi(2) - (1.0 - e * e) * (r * r - c * c)).sqrt()) / (1.0 - e * e)
}

/// Light that an ellipsoid collects to its focus is made parallel by another one about the same
/// focus, and the beam is as much narrower as that one is smaller: Cartesian ovals. Turned round,
/// the first spreads the light.
#[test]
fn an_afocal_pair_of_ellipsoids_scales_the_beam() {
    let (n, size, thickness) = (1.5, DVec2::splat(20.0), 20.0);
    let worst = |nodes: usize, narrows: bool| {
        let focal = if narrows { 120.0 } else { 100.0 };
        let behind = if narrows { focal - thickness } else { focal + thickness };
        let sign = if narrows { 1.0 } else { -1.0 };
        // The focus is behind the block, or before it; the exit face's vertex is at z = 0.
        let face = |vertex: f64| move |x: f64, y: f64| sign * (behind - oval(n, vertex, x.hypot(y)));
        let block = between(size, (nodes, nodes), face(focal), face(behind));
        let tracer = Tracer::for_block(&block, &Scene { ..scene(size, 32, 300.0) }).unwrap();
        let scale = behind / focal;
        let starts = starts(size, 0.8).map(|start| start + DVec2::new(0.013, 0.021));
        starts.map(|start| (landing(&tracer, start) - scale * start).length()).fold(0.0, f64::max)
    };
    for narrows in [true, false] {
        let (coarse, fine) = (worst(257, narrows), worst(513, narrows));
        println!("afocal {narrows}: {coarse:e} {fine:e}");
        assert!(fine < 1e-8, "{narrows}: {fine:e} mm");
        assert!((coarse / fine).log2() > 2.5, "third order in the spacing: {coarse:e} to {fine:e}");
    }
}

/// Spheres on both sides, by the sines of a meridional ray.
#[test]
fn two_spheres_refract_as_their_meridians_say() {
    let (n, size, thickness, distance) = (1.5_f64, DVec2::splat(30.0), 15.0, 100.0);
    let (r1, r2) = (300.0, 400.0);
    let worst = |nodes: usize| {
        let entry = |x: f64, y: f64| r1 - thickness - (r1 * r1 - x * x - y * y).sqrt();
        let exit = |x: f64, y: f64| (r2 * r2 - x * x - y * y).sqrt() - r2;
        let block = between(size, (nodes, nodes), entry, exit);
        let tracer = Tracer::for_block(&block, &scene(size, 32, distance)).unwrap();
        let error = |start: DVec2| {
            let r = start.length();
            let (theta, z) = ((r / r1).asin(), entry(r, 0.0));
            // To the axis.
            let bent = theta - (theta.sin() / n).asin();
            let along = DVec2::new(-bent.sin(), bent.cos());
            let from_centre = DVec2::new(r, z + r2);
            let b = from_centre.dot(along);
            let hit = from_centre + along * ((b * b - from_centre.length_squared() + r2 * r2).sqrt() - b);
            let normal = (hit.x / r2).asin();
            // The sine of the angle to the normal, which leans away from the axis.
            let out = (n * (bent + normal).sin()).asin() - normal;
            let lands = hit.x - (distance + r2 - hit.y) * out.tan();
            (landing(&tracer, start) - start * (lands / r)).length()
        };
        let starts = starts(size, 0.9).map(|start| start + DVec2::new(0.013, 0.021));
        starts.map(error).fold(0.0, f64::max)
    };
    let (coarse, fine) = (worst(129), worst(257));
    println!("spheres: {coarse:e} {fine:e}");
    assert!(fine < 1e-8, "{fine:e} mm");
    assert!((coarse / fine).log2() > 2.5, "third order in the spacing: {coarse:e} to {fine:e}");
}

/// A relief as a picture would give it, in its own place on every face.
fn rough(depth: f64, phase: f64) -> impl Fn(f64, f64) -> f64 {
    move |x, y| depth * relief(x + 3.0 * phase, y - 2.0 * phase)
}

/// Rows and blocks of reliefs, on the benches that they are for.
fn benches() -> Vec<(String, Tracer)> {
    let first = plate(SIZE, (81, 61), -10.0, rough(0.8, 0.0));
    let second = plate(1.1 * SIZE, (77, 69), -8.0, rough(0.6, 1.0));
    let lens = between(SIZE, (65, 61), |x, y| rough(0.7, 2.0)(x, y) - 12.0, rough(0.9, 3.0));
    let displaced = Displacement { shift_mm: DVec3::new(0.2, 0.1, 0.0), turned: DVec3::new(0.01, -0.02, 0.03) };
    let two = Row::of(&first).then(30.0, RowBlock { ior: Some(1.6), displaced, ..RowBlock::from(&second) });
    let one = Row::of(&lens);
    let three = Row::of(&lens).then(20.0, &second).then(15.0, &lens);
    let straight = Light::parallel(DVec3::Z);
    let oblique = Light::parallel(DVec3::new(0.08, -0.05, 1.0));
    let lamp = Light::Point {
        position_mm: DVec3::new(5.0, -4.0, -400.0),
        emission: Emission::Gaussian { half_angle: 0.2 },
        axis: None,
    };
    let mut benches = Vec::new();
    for (row, of_row) in [("two plates", two), ("two reliefs", one), ("three blocks", three)] {
        for (light, of_light) in [("straight", &straight), ("oblique", &oblique), ("lamp", &lamp)] {
            for traversal in [Traversal::Bvh, Traversal::Grid] {
                let fresnel = if light == "oblique" { Fresnel::On } else { Fresnel::Off };
                let window = Window { size_mm: 1.6 * SIZE, centre_mm: DVec2::ZERO, nx: 48, ny: 36 };
                let scene = Scene { light: of_light.clone(), traversal, fresnel, ..Scene::new(1.5, 120.0, window) };
                let tracer = Tracer::for_row(&of_row, &scene).unwrap();
                benches.push((format!("{row}, {light}, {traversal:?}"), tracer));
            }
        }
    }
    benches
}

#[test]
fn photons_confirm_beams_and_the_flux_adds_up() {
    for (name, tracer) in benches() {
        let seen = beams(&tracer, 400, 300);
        let tally = photons(&tracer, &PhotonPlan::new(200_000, 11).with_replicates(8)).unwrap();
        for flux in [seen.flux, tally.flux()] {
            assert!((flux.total() - 1.0).abs() < 1e-12 && flux.lost == 0.0, "{name}: {flux:?}");
        }
        let off = tally.agreement(&seen.image).unwrap().standard_errors();
        println!("{name}: {off:.2} {:?}", seen.flux);
        assert!(off < 4.0, "{name}: {off} standard errors");
        assert!(seen.flux.window > 0.6, "{name}: {:?}", seen.flux);
    }
}

#[test]
fn every_number_of_threads_gives_the_same_bits() {
    let seen = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let of_bench = |(_, tracer): (String, Tracer)| {
                let tally = photons(&tracer, &PhotonPlan::new(20_000, 3).with_replicates(4)).unwrap();
                (beams(&tracer, 97, 83), tally)
            };
            benches().into_iter().map(of_bench).collect::<Vec<_>>()
        })
    };
    let one = seen(1);
    assert!(one == seen(2) && one == seen(5));
}

#[test]
fn both_ways_to_find_a_face_give_the_same_bits() {
    let benches = benches();
    for pair in benches.chunks(2) {
        let [(name, bvh), (_, grid)] = pair else { panic!("in pairs") };
        for start in starts(SIZE, 1.0) {
            let (a, b) = (bvh.path_at(start), grid.path_at(start));
            assert_eq!(a, b, "{name} at {start}");
        }
    }
}

#[test]
fn a_row_of_one_is_a_block() {
    let block = plate(SIZE, (81, 61), -10.0, rough(0.8, 0.0));
    let scene = Scene { light: Light::parallel(DVec3::new(0.1, 0.0, 1.0)), ..scene(SIZE, 40, 120.0) };
    let [a, b] = [Tracer::for_block(&block, &scene), Tracer::for_row(&Row::of(&block), &scene)].map(Result::unwrap);
    assert_eq!((beams(&a, 90, 70), a.blocks()), (beams(&b, 90, 70), 1));
}

/// What moves by nothing is a pane: a row with it draws what the block alone draws, a little aside
/// in depth.
#[test]
fn every_model_of_a_surface_goes_through_a_pane_behind_it() {
    let block = plate(SIZE, (41, 31), -10.0, rough(0.8, 0.0));
    let pane = plate(2.0 * SIZE, (5, 5), -4.0, |_, _| 0.0);
    for surface in [Surface::Spline, Surface::Smooth, Surface::Facets] {
        let window = Window { size_mm: 1.6 * SIZE, centre_mm: DVec2::ZERO, nx: 40, ny: 30 };
        let scene = |distance| Scene { surface, traversal: Traversal::Grid, ..Scene::new(1.5, distance, window) };
        let alone = Tracer::for_block(&block, &scene(134.0)).unwrap();
        let row = Row::of(&block).then(30.0, &pane);
        let behind = Tracer::for_row(&row, &scene(100.0)).unwrap();
        for start in starts(SIZE, 0.9) {
            let (a, b) = (landing(&alone, start), landing(&behind, start));
            let along = (a - start) / 134.0;
            // Through the pane at a smaller angle.
            let sin = along.length() / (1.0 + along.length_squared()).sqrt() / 1.5;
            let saved = 4.0 * (along.length() - sin / (1.0 - sin * sin).sqrt());
            let wanted = a - saved * along.normalize_or_zero();
            // The block's own height is not in `along`.
            assert!((b - wanted).length() < 2e-3, "{surface:?} at {start}: {b} {wanted}");
        }
        if surface == Surface::Facets {
            let flux = facet_beams(&behind, &block).flux;
            assert!((flux.total() - 1.0).abs() < 1e-12 && flux.window > 0.99, "{flux:?}");
        }
    }
}

#[test]
fn light_that_a_later_block_does_not_catch_is_told() {
    let wedge = |slope: f64| plate(SIZE, (9, 7), -20.0, move |x, _| slope * x);
    let bends = wedge(0.3);
    let window = Window { size_mm: 3.0 * SIZE, centre_mm: DVec2::ZERO, nx: 30, ny: 20 };
    let scene = Scene::new(1.5, 60.0, window);
    let angle = (1.5 * 0.3_f64.atan().sin()).asin() - 0.3_f64.atan();
    let (gap, slab) = (40.0, plate(SIZE, (5, 5), -5.0, |_, _| 0.0));
    let tracer = Tracer::for_row(&Row::of(&bends).then(gap, &slab), &scene).unwrap();
    // Where the second block begins, rays from x on are beside it; and some leave it by its side.
    let beside = |x: f64| x + (gap - 0.3 * x) * angle.tan() > 20.0;
    let inside = (angle.sin() / 1.5).asin();
    let side = |x: f64| !beside(x) && x + (gap - 0.3 * x) * angle.tan() + 5.0 * inside.tan() > 20.0;
    for k in -99..=99 {
        let x = 0.2 * f64::from(k) + 0.01;
        let path = tracer.path_at(DVec2::new(x, 1.0));
        let wanted = if beside(x) {
            Some(End::Beside)
        } else if side(x) {
            Some(End::Side)
        } else {
            None
        };
        assert!(path.block == 1 && wanted.is_none_or(|end| end == path.end), "{x}: {path:?}");
    }
    let seen = beams(&tracer, 200, 150);
    let exact = (1..20_000).filter(|&k| beside(40.0 * f64::from(k) / 20_000.0 - 20.0)).count() as f64 / 20_000.0;
    assert!((seen.flux.beside - exact).abs() < 1e-3, "{} {exact}", seen.flux.beside);
    assert!((seen.flux.total() - 1.0).abs() < 1e-12 && seen.flux.side > 0.01);
    assert_eq!(seen.losses.len(), 2);
    assert!((seen.losses[1].beside - seen.flux.beside).abs() < 1e-15 && seen.losses[0].beside == 0.0);
    // A steep roof behind: light that enters it straight is totally reflected there, and nowhere else.
    let roof = plate(SIZE, (9, 7), -30.0, |x, _| 1.2 * x);
    let tracer = Tracer::for_row(&Row::of(&slab).then(gap, &roof), &scene).unwrap();
    let seen = beams(&tracer, 40, 30);
    assert!((seen.losses[1].totally_reflected - 1.0).abs() < 1e-12 && seen.losses[0].totally_reflected == 0.0);
}

#[test]
fn spread_light_and_rough_faces_go_through_a_row() {
    let (pane, distance) = (plate(4.0 * SIZE, (5, 5), -4.0, |_, _| 0.0), 400.0_f64);
    let wide = plate(5.0 * SIZE, (5, 5), -4.0, |_, _| 0.0);
    let lens = plate(4.0 * SIZE, (5, 5), -1e3, |_, _| 0.0).with_entry_heights((5, 5), vec![-4.0; 25]).unwrap();
    let window = Window { size_mm: DVec2::splat(60.0), centre_mm: DVec2::ZERO, nx: 40, ny: 40 };
    // Roughness s on k faces that do nothing else: a Gaussian of (n - 1) s for every exit face,
    // (1 - 1 / n) n s for an entry face, over the way to the receiver.
    let s = 0.01_f64;
    for (row, squares) in [
        (
            Row::of(&pane).then(60.0, &wide),
            [distance, distance + 64.0].map(|d| (0.5 * s * d).powi(2)).iter().sum::<f64>(),
        ),
        (Row::of(&lens), [distance, distance + 4.0 / 1.5].map(|d| (0.5 * s * d).powi(2)).iter().sum()),
    ] {
        let scene = Scene { roughness: s, ..Scene::new(1.5, distance, window) };
        // The edge of the light falls off as the Gaussian's integral: at its place half of it is
        // left, and 0.1587 one deviation out, where it is convex over the 2 mm of the window.
        let window = Window { size_mm: DVec2::new(2.0, 60.0), centre_mm: DVec2::new(80.0, 0.0), nx: 1, ny: 1 };
        let beyond = Window { centre_mm: DVec2::new(80.0 + squares.sqrt(), 0.0), ..window };
        let part = |window: Window| {
            let tracer = Tracer::for_row(&row, &Scene { window, ..scene.clone() }).unwrap();
            let tally = photons(&tracer, &PhotonPlan::new(1 << 20, 5).with_replicates(8)).unwrap();
            tally.flux().window * (160.0 * 120.0) / (2.0 * 60.0)
        };
        let (half, beyond) = (part(window), part(beyond));
        let convex = 0.158_655 + 0.241_971 / 6.0 / squares;
        // Four standard errors of so many photons.
        assert!((half - 0.5).abs() < 0.025 && (beyond - convex).abs() < 0.014, "{half} {beyond} {convex}");
    }
    let sun = Scene { spread: SourceExtent::AngularDisc { radius: 0.02 }, ..Scene::new(1.5, distance, window) };
    let tally =
        photons(&Tracer::for_row(&Row::of(&lens).then(20.0, &pane), &sun).unwrap(), &PhotonPlan::new(1 << 16, 2));
    assert!((tally.unwrap().flux().total() - 1.0).abs() < 1e-12);
}

#[test]
fn planes_on_the_way_see_what_a_bench_there_sees() {
    let first = plate(SIZE, (81, 61), -10.0, rough(0.8, 0.0));
    let second = plate(1.1 * SIZE, (77, 69), -8.0, rough(0.6, 1.0));
    let window = Window { size_mm: 1.4 * SIZE, centre_mm: DVec2::ZERO, nx: 40, ny: 30 };
    let scene = |distance| Scene { traversal: Traversal::Grid, ..Scene::new(1.5, distance, window) };
    let row = Row::of(&first).then(30.0, &second);
    let tracer = Tracer::for_row(&row, &scene(100.0)).unwrap();
    let there = tracer.on_plane(47.0, window).unwrap();
    assert_eq!(beams(&there, 120, 90), beams(&Tracer::for_row(&row, &scene(47.0)).unwrap(), 120, 90));
    // 12 mm behind the first block: 30 + 8 mm are from there to the origin.
    let between = tracer.on_plane(12.0 - 38.0, window).unwrap();
    let alone = beams(&Tracer::for_block(&first, &scene(12.0)).unwrap(), 120, 90);
    let seen = beams(&between, 120, 90);
    let off = seen.image.values.iter().zip(&alone.image.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-7 && between.blocks() == 1, "{off:e}");
    for z_mm in [-60.0, -40.0, -8.0, 0.0] {
        assert!(matches!(tracer.on_plane(z_mm, window), Err(SceneError::Plane { .. })), "{z_mm}");
    }
    for z_mm in [f64::NAN, f64::INFINITY] {
        assert!(matches!(tracer.on_plane(z_mm, window), Err(SceneError::Value { .. })), "{z_mm}");
    }
}

#[test]
fn the_peak_on_the_way_is_where_a_lens_has_its_focus() {
    // A paraboloid that collects light at about 100 mm.
    let lens = plate(DVec2::splat(20.0), (41, 41), -6.0, |x, y| -(x * x + y * y) / 100.0);
    let window = Window { size_mm: DVec2::splat(20.0), centre_mm: DVec2::ZERO, nx: 16, ny: 16 };
    let tracer =
        Tracer::for_block(&lens, &Scene { traversal: Traversal::Grid, ..Scene::new(1.5, 300.0, window) }).unwrap();
    let peak = |z: f64| light_on_plane(&tracer, z, (200, 200), 100).unwrap();
    let near = peak(50.0);
    // Half as wide along both axes, in the middle.
    let middle = near.image.values[near.window.ny / 2 * near.window.nx + near.window.nx / 2];
    assert!((middle / 4.0 - 1.0).abs() < 0.01, "{middle}");
    assert!(near.peak > middle && near.peak < 6.0 && near.peak_at_mm.abs().min_element() > 4.0, "{}", near.peak_at_mm);
    assert!(peak(99.0).peak > 100.0 * near.peak && near.flux.missed == 0.0);
}

/// Smooth shading errs by what its triangles miss of the face, on both sides of a block.
#[test]
fn smooth_shading_of_two_reliefs_converges_to_the_spline() {
    let worst = |cells: usize| {
        let block = between(SIZE, (4 * cells + 1, 3 * cells + 1), of(ENTRY), of(EXIT));
        let [smooth, spline] = [Surface::Smooth, Surface::Spline]
            .map(|surface| Tracer::for_block(&block, &Scene { surface, ..scene(SIZE, 32, 90.0) }).unwrap());
        let off = |start| (landing(&smooth, start) - landing(&spline, start)).length();
        starts(SIZE, 0.7).map(|start| off(start + DVec2::new(0.013, 0.021))).fold(0.0, f64::max)
    };
    let (coarse, fine) = (worst(10), worst(20));
    let order = (coarse / fine).log2();
    assert!((1.6..2.6).contains(&order), "order {order} from {coarse:e} to {fine:e}");
}

#[test]
fn what_is_not_handled_is_refused_by_name() {
    let block = plate(SIZE, (9, 7), -10.0, |_, _| 0.0);
    let lens = between(SIZE, (9, 9), of(ENTRY), of(EXIT));
    let scene = scene(SIZE, 8, 100.0);
    let refused = |row: &Row<'_>, scene: &Scene| Tracer::for_row(row, scene).unwrap_err();
    let alone = Row::of(&lens);
    let facets = Scene { surface: Surface::Facets, ..scene.clone() };
    assert!(matches!(refused(&alone, &facets), SceneError::Needs(_)));
    let plane = Scene { geometry: Geometry::NormalMappedPlane, ..scene.clone() };
    assert!(matches!(refused(&alone, &plane), SceneError::Needs(_)));
    let row = Row::of(&block).then(5.0, &block);
    assert!(matches!(refused(&row, &Scene::mirror(100.0, scene.window)), SceneError::Needs(_)));
    assert!(matches!(refused(&Row::of(&block).then(-1.0, &block), &scene), SceneError::Value { .. }));
    assert!(matches!(refused(&Row::of(&block).then(f64::NAN, &block), &scene), SceneError::Value { .. }));
    // The hill of the first block is in the second.
    let hill = plate(SIZE, (9, 7), -10.0, |x, _| 3.0 - 0.01 * x * x);
    let error = refused(&Row::of(&hill).then(2.0, &block), &scene);
    assert!(matches!(error, SceneError::Meet { first: 1, .. }) && error.to_string().contains("3.000 mm"), "{error}");
    let tilted = RowBlock {
        displaced: Displacement { turned: DVec3::new(0.0, 0.4, 0.0), ..Displacement::default() },
        ..RowBlock::from(&block)
    };
    assert!(matches!(refused(&Row::of(&block).then(2.0, tilted), &scene), SceneError::Meet { .. }));
    // Before the first block, not before the last.
    let source = |z| Light::Point { position_mm: DVec3::new(0.0, 0.0, z), emission: Emission::Isotropic, axis: None };
    assert!(matches!(refused(&row, &Scene { light: source(-20.0), ..scene.clone() }), SceneError::Source { .. }));
    assert!(Tracer::for_row(&row, &Scene { light: source(-30.0), ..scene.clone() }).is_ok());
    let many = (0..Row::MOST).fold(Row::of(&block), |row, _| row.then(5.0, &block));
    assert!(matches!(refused(&many, &scene), SceneError::Value { .. }));
    // Faces that meet in the glass.
    let shallow = heights(SIZE, (9, 9), |x, _| 0.2 * x - 3.0);
    let error = block.clone().with_entry_heights((9, 9), shallow).unwrap_err().to_string();
    assert!(error.contains("not above the entry face"), "{error}");
}

#[test]
fn no_light_is_lost_between_the_steepest_faces() {
    let steep = |depth: f64, phase: f64| move |x: f64, y: f64| depth * (0.9 * x + phase).sin() * (0.7 * y).cos();
    let first = plate(SIZE, (81, 61), -15.0, steep(1.4, 0.0));
    let second = plate(1.5 * SIZE, (83, 71), -12.0, steep(1.2, 1.0));
    let lens = between(SIZE, (75, 67), |x, y| steep(1.3, 2.0)(x, y) - 15.0, steep(1.4, 0.5));
    let tilted = Displacement { turned: DVec3::new(0.2, -0.1, 0.3), ..Displacement::default() };
    let tilted = RowBlock { displaced: tilted, ..RowBlock::from(&lens) };
    for row in [Row::of(&first).then(8.0, &second), Row::of(&lens), Row::of(&first).then(15.0, tilted)] {
        for light in [DVec3::Z, DVec3::new(0.4, -0.2, 1.0)] {
            for traversal in [Traversal::Bvh, Traversal::Grid] {
                let light = Light::parallel(light);
                let fresnel = Fresnel::On;
                let scene = Scene { light, traversal, fresnel, ..scene(SIZE, 32, 60.0) };
                let tracer = Tracer::for_row(&row, &scene).unwrap();
                let seen = beams(&tracer, 160, 120).flux;
                let shot = photons(&tracer, &PhotonPlan::new(60_000, 7)).unwrap().flux();
                for flux in [seen, shot] {
                    assert!((flux.total() - 1.0).abs() < 1e-12 && flux.lost == 0.0, "{flux:?}");
                    assert!(flux.window > 0.02 && flux.totally_reflected > 0.001, "{flux:?}");
                }
                // Both count the same ends, as well as beams between torn corners do.
                assert!((seen.totally_reflected - shot.totally_reflected).abs() < 0.02, "{seen:?} {shot:?}");
            }
        }
    }
}
