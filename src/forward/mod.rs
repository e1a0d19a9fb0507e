//! Forward caustics (section 2.1 of the paper): cast the photon mesh through a height field and
//! weigh its beams.
//!
//! This is the solvers' own view of the light, used to close their loop. It is fast, without noise,
//! and shares the spline with the surface it looks at; the judgement of an exported file is the
//! verifier's, which shares nothing.

mod splat;
pub(crate) mod two_reliefs;

use crate::{bench::Bench, grid::Field, light::Incoming, optics::Interface, surface::SurfaceSpline};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use splat::{Corner, Film};

/// Where on the block the light is taken to leave it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometry {
    /// On the plane at the mean height, with the normals of the surface: the paper's assumption.
    NormalMappedPlane,
    /// On the surface itself.
    Displaced,
}

impl Geometry {
    /// Where light leaves, for a face of this height over `x`, mm.
    fn point(self, x: DVec2, height_mm: f64) -> DVec3 {
        x.extend(match self {
            Self::NormalMappedPlane => 0.0,
            Self::Displaced => height_mm,
        })
    }
}

/// What the receiver gets.
#[derive(Clone, Debug, PartialEq)]
pub struct Caustic {
    /// Irradiance on the cells of the window; 1 is what every cell would get if all of the flux
    /// were spread evenly over the window.
    pub irradiance: Field<f64>,
    /// Share of the flux that lands beside the window.
    pub outside: f64,
    /// Share of the flux that is totally reflected at the exit face.
    pub reflected: f64,
    /// Share of the flux in beams that are folded over, as between a crease and its image.
    pub folded: f64,
    /// The rows and columns of those beams, ascending.
    pub folds: Vec<(usize, usize)>,
}

impl Caustic {
    /// From the films of bands of rows of `nx` beams, each with its first row. They are added in
    /// order.
    fn of_bands(bands: &[(usize, Film)], cells: (usize, usize), nx: usize) -> Self {
        let mut sum = vec![0.0; cells.0 * cells.1];
        let (mut landed, mut outside, mut reflected, mut folded) = (0.0, 0.0, 0.0, 0.0);
        let mut folds = Vec::new();
        for (begin, film) in bands {
            folds.extend(film.folds.iter().map(|&beam| (begin + beam as usize / nx, beam as usize % nx)));
            film.add_to(&mut sum);
            landed += film.landed;
            outside += film.outside;
            reflected += film.reflected;
            folded += film.folded;
        }
        let total: f64 = landed + outside + reflected;
        let mean = total / sum.len() as f64;
        sum.iter_mut().for_each(|v| *v /= mean);
        folds.sort_unstable();
        folds.dedup();
        Self {
            irradiance: Field::from_vec(cells.0, cells.1, sum),
            outside: outside / total,
            reflected: reflected / total,
            folded: folded / total,
            folds,
        }
    }
}

/// The photon mesh: where on the receiver the beams' corners land, mm, for `nx` by `ny` corners
/// that span the block edge to edge. Not finite where the light is totally reflected.
pub fn photon_mesh(spline: &SurfaceSpline, bench: &Bench, geometry: Geometry, nx: usize, ny: usize) -> Field<DVec2> {
    let (lattice, light) = (spline.lattice(nx, ny), bench.incidence());
    let mut mesh = vec![DVec2::ZERO; nx * ny];
    mesh.par_chunks_mut(nx).enumerate().for_each_init(Vec::new, |scratch, (j, out)| {
        lattice.row(j, scratch, |i, height, slope| {
            let from = geometry.point(bench.block().node(i, j, nx, ny), height);
            out[i] = land(&light.at(from), bench, from, slope);
        });
    });
    Field::from_vec(nx, ny, mesh)
}

/// The irradiance on `cells` of the window, from `beams` beams of light across the block.
///
/// Every beam is the quadrilateral between four neighbouring rays, equations (1) to (3) of the
/// paper: its flux is that of its cross section on the surface, spread over the area that it covers
/// on the receiver. Beams that the outline of the block cuts are cut by it, along a chord.
pub fn irradiance(
    spline: &SurfaceSpline,
    bench: &Bench,
    geometry: Geometry,
    beams: (usize, usize),
    cells: (usize, usize),
) -> Caustic {
    let (nx, ny) = beams;
    let (lattice, light) = (spline.lattice(nx + 1, ny + 1), bench.incidence());
    let scale = DVec2::new(cells.0 as f64, cells.1 as f64) / bench.window().as_vec();
    let origin = bench.window_centre_mm() + bench.window().lower();
    let (outline, beam) = (bench.contour(), bench.block().node_spacing(nx + 1, ny + 1));
    let corner = |at: DVec2, height_mm: f64, slope: DVec2| {
        let from = geometry.point(at, height_mm);
        let incoming = light.at(from);
        Corner { at: (land(&incoming, bench, from, slope) - origin) * scale, flux: incoming.flux(slope) }
    };
    // Bands of beams own a film each; films are added in order, so that the sum is the same for any
    // number of threads.
    let rows_per_band = ny.div_ceil(BANDS);
    let bands: Vec<(usize, Film)> = (0..ny.div_ceil(rows_per_band))
        .into_par_iter()
        .map(|band| {
            let (begin, end) = (band * rows_per_band, ((band + 1) * rows_per_band).min(ny));
            let node = |i: usize, j: usize| bench.block().node(i, j, nx + 1, ny + 1);
            let mut corners = Vec::with_capacity((end - begin + 1) * (nx + 1));
            let mut scratch = Vec::new();
            for j in begin..=end {
                lattice.row(j, &mut scratch, |i, height, slope| corners.push(corner(node(i, j), height, slope)));
            }
            if outline.is_rectangle() {
                return (begin, Film::of_band(&corners, nx + 1, cells, |_, _| true, &[]));
            }
            let inside = |i: usize, j: usize| outline.contains(node(i, j));
            let mut pieces = Vec::new();
            for j in begin..end {
                for i in 0..nx {
                    let around = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                    outline.cut(around.map(|(i, j)| node(i, j)), around.map(|(i, j)| inside(i, j)), |piece| {
                        let area = (piece[1] - piece[0]).perp_dot(piece[2] - piece[0]) / beam.element_product();
                        let corners = piece.map(|at| {
                            let sample = spline.sample(at);
                            let Corner { at, flux } = corner(at, sample.height_mm, sample.slope);
                            Corner { at, flux: flux * area }
                        });
                        pieces.push((((j - begin) * nx + i) as u32, corners));
                    });
                }
            }
            let whole = |i: usize, row: usize| {
                let j = begin + row;
                inside(i, j) && inside(i + 1, j) && inside(i, j + 1) && inside(i + 1, j + 1)
            };
            (begin, Film::of_band(&corners, nx + 1, cells, whole, &pieces))
        })
        .collect();
    Caustic::of_bands(&bands, cells, nx)
}

/// The triangles, points of the block, mm, whose light is the beam in this column and row: two, or
/// the pieces within the outline.
pub(crate) fn triangles(bench: &Bench, beams: (usize, usize), (i, j): (usize, usize), mut f: impl FnMut([DVec2; 3])) {
    let outline = bench.contour();
    let node = |i: usize, j: usize| bench.block().node(i, j, beams.0 + 1, beams.1 + 1);
    let corners = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
    let inside = corners.map(|at| outline.is_rectangle() || outline.contains(at));
    if inside == [true; 4] {
        let [a, b, c, d] = corners;
        f([a, b, c]);
        f([a, c, d]);
    } else {
        outline.cut(corners, inside, f);
    }
}

/// Number of films; a constant, so that results do not depend on the number of threads.
const BANDS: usize = 48;

/// Where the ray that leaves the block at `from` lands, mm; not finite if it is totally reflected.
#[inline(always)]
pub(crate) fn land(incoming: &Incoming, bench: &Bench, from: DVec3, slope: DVec2) -> DVec2 {
    match Interface::new(bench.exit_face(), incoming.direction).exitant(slope) {
        Some(exitant) if exitant.z > 0.0 => bench.receiver().landing(from, exitant),
        _ => DVec2::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;
    use crate::{
        bench::ExitFace,
        grid::{Extent, Outline},
        light::Intensity,
        surface::HeightField,
    };

    const BLOCK: Extent = Extent::new(40.0, 30.0);

    fn bench(exit_face: ExitFace) -> Bench {
        Bench::new(BLOCK, 200.0, exit_face).unwrap()
    }

    fn spline(f: impl Fn(DVec2) -> f64) -> SurfaceSpline {
        let (nx, ny) = (81, 61);
        SurfaceSpline::through(&HeightField::new(BLOCK, Field::from_fn(nx, ny, |i, j| f(BLOCK.node(i, j, nx, ny)))))
    }

    #[test]
    fn a_flat_block_lights_its_window_evenly() {
        let caustic = irradiance(
            &spline(|_| 0.0),
            &bench(ExitFace::Refracts { ior: 1.5 }),
            Geometry::Displaced,
            (97, 83),
            (20, 15),
        );
        assert!(caustic.irradiance.as_slice().iter().all(|v| (v - 1.0).abs() < 1e-12));
        assert!(caustic.outside.abs() < 1e-12 && caustic.reflected == 0.0);
    }

    #[test]
    fn a_flat_disc_lights_a_disc_exactly_by_area() {
        let bench = bench(ExitFace::Refracts { ior: 1.5 }).with_outline(Outline::Circle).unwrap();
        let cells = (20, 15);
        let caustic = irradiance(&spline(|_| 0.0), &bench, Geometry::Displaced, (397, 283), cells);
        let contour = bench.contour();
        let size = BLOCK.as_vec() / DVec2::new(cells.0 as f64, cells.1 as f64);
        for j in 0..cells.1 {
            for i in 0..cells.0 {
                // The share of the cell within the ellipse, by its rows.
                let (left, rows) = (BLOCK.lower() + size * DVec2::new(i as f64, j as f64), 4000);
                let covered: f64 = (0..rows)
                    .map(|k| {
                        let half = contour.half_width_mm(left.y + size.y * (f64::from(k) + 0.5) / f64::from(rows));
                        ((left.x + size.x).min(half) - left.x.max(-half)).max(0.0) / size.x
                    })
                    .sum::<f64>()
                    / f64::from(rows);
                let got = caustic.irradiance[(i, j)] * contour.share_of_extent();
                at_worst(3.6e-5, (got - covered).abs(), format_args!("{i}, {j}: {got} of {covered}"));
            }
        }
        assert!(caustic.outside < 1e-12 && caustic.folded == 0.0);
    }

    #[test]
    fn a_prism_deflects_by_snells_law_on_the_plane_and_on_the_surface() {
        let (slope, ior) = (0.2_f64, 1.5_f64);
        let tilt = slope.atan();
        let deflection = (ior * tilt.sin()).asin() - tilt;
        let prism = spline(|p| slope * p.x);
        let bench = bench(ExitFace::Refracts { ior });
        for (geometry, lever) in [(Geometry::NormalMappedPlane, 0.0), (Geometry::Displaced, slope)] {
            let mesh = photon_mesh(&prism, &bench, geometry, 5, 5);
            for j in 0..5 {
                for i in 0..5 {
                    let from = BLOCK.node(i, j, 5, 5);
                    // The thicker side is at +x; the light is bent towards it.
                    let wanted = from + DVec2::new((200.0 - lever * from.x) * deflection.tan(), 0.0);
                    assert!((mesh[(i, j)] - wanted).length() < 1e-9, "{} against {wanted}", mesh[(i, j)]);
                }
            }
        }
    }

    #[test]
    fn a_flat_mirror_shows_a_point_source_behind_itself() {
        // The image lies 60 mm behind the mirror; its light falls off with the cube of the cosine
        // over the square of the distance.
        let near = Bench::new(BLOCK, 90.0, ExitFace::Reflects).unwrap();
        for (intensity, power) in [(Intensity::Isotropic, 1.5), (Intensity::Lambertian, 2.0)] {
            let source = DVec3::new(12.0, -5.0, 60.0);
            let bench = near.clone().with_point_source(source, 0.0, intensity).unwrap();
            let caustic = irradiance(&spline(|_| 0.0), &bench, Geometry::Displaced, (800, 600), (20, 15));
            let fall_off = |i: usize, j: usize| {
                let at = BLOCK.lower() + DVec2::new(i as f64 + 0.5, j as f64 + 0.5) * 2.0;
                (1.0 + (at - source.truncate()).length_squared() / (150.0 * 150.0)).powf(-power)
            };
            let scale = caustic.irradiance[(10, 7)] / fall_off(10, 7);
            for (i, j) in [(0, 0), (19, 0), (4, 11), (19, 14)] {
                let got = caustic.irradiance[(i, j)] / (scale * fall_off(i, j));
                at_worst(8.7e-6, (got - 1.0).abs(), format_args!("{intensity:?} {i} {j}: {got}"));
            }
        }
    }

    #[test]
    fn a_parabolic_mirror_gathers_all_light_in_its_focus() {
        let focal = 200.0;
        let mesh = photon_mesh(
            &spline(|p| p.length_squared() / (4.0 * focal)),
            &bench(ExitFace::Reflects),
            Geometry::Displaced,
            9,
            9,
        );
        // The node mean is put at 0, so that the focus is a little off the receiver.
        assert!(mesh.as_slice().iter().all(|p| p.length() < 0.05));
    }

    #[test]
    fn flux_is_conserved_where_light_misses_the_window_and_where_it_is_totally_reflected() {
        let steep = spline(|p| 0.03 * p.x * p.x + 0.02 * p.y * p.y);
        let caustic =
            irradiance(&steep, &bench(ExitFace::Refracts { ior: 1.5 }), Geometry::Displaced, (200, 150), (16, 12));
        let inside = caustic.irradiance.mean();
        assert!(caustic.outside > 0.05 && caustic.reflected > 0.05, "{} {}", caustic.outside, caustic.reflected);
        assert!((inside + caustic.outside + caustic.reflected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_smooth_lens_gives_its_analytic_irradiance() {
        // On the plane, h = a x^2 / 2 sends x to x + D tan(asin(n sin t) - t), t = atan(a x): the
        // irradiance follows.
        let (a, ior, distance) = (-6e-4, 1.5, 200.0);
        let bench = bench(ExitFace::Refracts { ior });
        let caustic =
            irradiance(&spline(|p| 0.5 * a * p.x * p.x), &bench, Geometry::NormalMappedPlane, (400, 300), (40, 6));
        let landing = |x: f64| {
            let t: f64 = (a * x).atan();
            x + distance * ((ior * t.sin()).asin() - t).tan()
        };
        let invert = |target: f64| {
            let mut x = target;
            for _ in 0..50 {
                x -= landing(x) - target;
            }
            x
        };
        for cell in 2..38 {
            let (left, right) = (f64::from(cell) - 20.0, f64::from(cell) - 19.0);
            let wanted = invert(right) - invert(left);
            let got = caustic.irradiance[(cell as usize, 3)];
            at_worst(7.3e-10, (got - wanted).abs() / wanted, format_args!("cell {cell}: {got} against {wanted}"));
        }
    }
}
