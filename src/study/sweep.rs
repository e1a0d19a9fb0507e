//! How the errors change with the bench.

use super::{
    budget::mesh_of,
    changed::changed_bench,
    design::Plan,
    judge::{Examiner, Subject},
    workpiece::Workpiece,
};
use crate::{
    failure::Failure,
    record::{SideFile, document},
    solver::{Event, Progress},
    spec::{Host, Length, Quantity, Range},
};
use glasswarp_verify::{Geometry, Image, Scene, Surface, metrics};
use std::{borrow::Cow, ops::ControlFlow, path::Path};

/// One place along the range.
pub struct SweepPoint {
    /// Of the quantity.
    pub value: f64,
    /// The bench.
    pub scene: Scene,
    /// Height nodes along x and y.
    pub nodes: (usize, usize),
    /// Of the block.
    pub thickness_mm: f64,
    /// Of the face.
    pub relief_mm: f64,
    /// The light, seen in every one of [`SWEEP_VIEWS`].
    pub views: Vec<SweepView>,
    /// Relative RMS difference between the light of the plane and that of the true surface.
    pub plane_moves: f64,
}

/// The light of one place, seen in one way.
pub struct SweepView {
    /// Irradiance.
    pub image: Image,
    /// Relative RMS error.
    pub rel_rms: f64,
    /// Structural similarity.
    pub ssim: f64,
}

/// The views, in the order of the columns.
pub const SWEEP_VIEWS: [(&str, Surface, Geometry); 4] = [
    ("displaced", Surface::Spline, Geometry::Displaced),
    ("plane", Surface::Spline, Geometry::NormalMappedPlane),
    ("smooth", Surface::Smooth, Geometry::Displaced),
    ("facets", Surface::Facets, Geometry::Displaced),
];

/// Asks whether to go on within a step of a study, whose own stages are nobody's concern.
struct Within<'a>(&'a dyn Progress);

impl Progress for Within<'_> {
    fn report(&self, _: Event<'_>) -> ControlFlow<()> {
        self.0.report(Event::Iteration)
    }
}

/// Blocks along a range: the design of a side file made anew at every place, or one block as it was
/// built.
pub enum Swept<'a> {
    /// The design, and its picture.
    Design(&'a SideFile, &'a Path),
    /// This very block.
    AsBuilt(&'a Workpiece),
}

impl Swept<'_> {
    /// Refuses a range that means nothing for these blocks.
    ///
    /// # Errors
    /// The index of a mirror, a quantity of which a block that was built has but one.
    pub fn check(quantity: Quantity, is_mirror: bool, as_built: bool) -> Result<(), Failure> {
        if quantity == Quantity::Index && is_mirror {
            return Err(Failure::Usage(
                "this block is a mirror, which light does not enter: its index cannot be swept; distance, size and nodes can".into(),
            ));
        }
        if as_built && !matches!(quantity, Quantity::Distance | Quantity::Index) {
            return Err(Failure::Usage("`as-built` looks from another distance or through another index only".into()));
        }
        Ok(())
    }

    /// What is seen at one place of a range. `progress` may end the work; `approve` may refuse a plan before work is done for
    /// it.
    ///
    /// # Errors
    /// A bench that cannot draw the picture.
    pub fn at(
        &self,
        range: &Range,
        value: f64,
        pixels: usize,
        (host, progress): (&dyn Host, &dyn Progress),
        approve: &dyn Fn(&Plan) -> Result<(), Failure>,
    ) -> Result<SweepPoint, Failure> {
        let within = Within(progress);
        match self {
            Self::AsBuilt(piece) => {
                let (ior, distance_mm) = match range.quantity {
                    Quantity::Index => (Some(value), None),
                    _ => (None, Some(value)),
                };
                let subject = Subject::Block(Box::new(piece.block.clone().with_spline()));
                let scene = changed_bench(piece.scene(), Some(&piece.block), ior, distance_mm)?;
                point(value, &piece.examiner.on(scene), &subject)
            }
            Self::Design(side, picture) => {
                let mut settings = side.design.clone();
                match range.quantity {
                    Quantity::Distance => settings.distance = Some(Length { mm: value }),
                    Quantity::Size => settings.size = Some(Length { mm: value }),
                    Quantity::Thickness => settings.thickness = Some(Length { mm: value }),
                    // What the index follows from is left out.
                    Quantity::Index => {
                        (settings.ior, settings.material, settings.wavelength) = (Some(value), None, None);
                    }
                    Quantity::Nodes => settings.nodes = Some(value as usize),
                }
                let plan = Plan::new(picture.to_path_buf(), settings, host, &within)?;
                approve(&plan)?;
                let block = plan.design(&within)?;
                let subject = Subject::of(Cow::Owned(mesh_of(&block.solid, None)), "the block")?;
                let target = plan.target_light(host)?;
                let examiner = Examiner::new(plan.scene.clone(), Some(target.in_perfect_light()), pixels);
                point(value, &examiner, &subject)
            }
        }
    }
}

fn point(value: f64, examiner: &Examiner, subject: &Subject) -> Result<SweepPoint, Failure> {
    let Subject::Block(block) = subject else {
        return Err(Failure::Usage("only a block can be seen on the normal-mapped plane".into()));
    };
    let mut views = Vec::new();
    for (_, surface, geometry) in SWEEP_VIEWS {
        let image = examiner.trace(subject, surface, geometry)?.image;
        if let Some(metrics) = examiner.compare(&image)? {
            views.push(SweepView { rel_rms: metrics.rel_rms, ssim: metrics.ssim, image });
        }
    }
    let (low, high) = block.height_range_mm();
    let plane_moves = metrics::rel_rms(&views[1].image, &views[0].image).map_err(Failure::refused)?;
    let highest = block.rim_z_mm().map_or(high, |rim| rim.max(high));
    Ok(SweepPoint {
        value,
        scene: examiner.scene_for(subject),
        nodes: block.nodes(),
        thickness_mm: highest - block.entry_z_mm(),
        relief_mm: high - low,
        views,
        plane_moves,
    })
}

impl SweepPoint {
    /// The same for programs.
    pub fn document(&self) -> document::SweepPoint {
        let view = |k: usize| self.views.get(k).and_then(|view| document::finite(view.rel_rms));
        document::SweepPoint {
            value: self.value,
            relief_mm: self.relief_mm,
            displaced: view(0),
            plane: view(1),
            smooth: view(2),
            facets: view(3),
            plane_moves: document::finite(self.plane_moves),
        }
    }
}

/// How far the plane moves the light: a r / (1 + b r) with r = relief / distance. Proportional to r
/// while the light is moved by less than the details of the picture are wide; two unrelated
/// pictures differ by a certain amount and no more.
pub struct Law {
    /// Its slope at small reliefs.
    pub a: f64,
    /// How soon it levels off.
    pub b: f64,
    /// Root mean square of the relative deviation.
    pub residual: f64,
}

impl Law {
    /// By least squares of the relative deviation. `None` where r hardly changes, or with fewer
    /// than three points.
    pub fn fit(points: &[SweepPoint]) -> Option<Self> {
        let data: Vec<(f64, f64)> = points
            .iter()
            .map(|point| (point.relief_mm / point.scene.distance_mm, point.plane_moves))
            .filter(|(r, moved)| r.is_finite() && moved.is_finite() && *r > 0.0 && *moved > 0.0)
            .collect();
        let range = data.iter().fold((f64::INFINITY, 0.0f64), |(lo, hi), &(r, _)| (lo.min(r), hi.max(r)));
        if data.len() < 3 || range.1 < 1.5 * range.0 {
            return None;
        }
        // moved (1 + b r) / (a r) = 1 is linear in 1 / a and b / a.
        let [mut uu, mut uv, mut vv, mut u1, mut v1] = [0.0; 5];
        for &(r, moved) in &data {
            let (u, v) = (moved / r, moved);
            (uu, uv, vv, u1, v1) = (uu + u * u, uv + u * v, vv + v * v, u1 + u, v1 + v);
        }
        let determinant = uu * vv - uv * uv;
        let (p, q) = ((u1 * vv - v1 * uv) / determinant, (v1 * uu - u1 * uv) / determinant);
        if !(p.is_finite() && q.is_finite() && p > 0.0) {
            return None;
        }
        let squares: f64 = data.iter().map(|&(r, moved)| (p * moved / r + q * moved - 1.0).powi(2)).sum();
        Some(Self { a: 1.0 / p, b: q / p, residual: (squares / data.len() as f64).sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use glasswarp_verify::Window;

    #[test]
    fn the_law_is_found_with_its_residual() {
        let point = |distance_mm: f64, bend: f64| SweepPoint {
            value: distance_mm,
            scene: Scene::mirror(
                distance_mm,
                Window { size_mm: DVec2::splat(9.0), centre_mm: DVec2::ZERO, nx: 9, ny: 9 },
            ),
            nodes: (9, 9),
            thickness_mm: 9.0,
            relief_mm: 1.0,
            views: Vec::new(),
            plane_moves: 2.0 / distance_mm / (1.0 + 3.0 / distance_mm) * bend,
        };
        let law = Law::fit(&[point(1.0, 1.0), point(4.0, 1.0), point(80.0, 1.0)]).unwrap();
        assert!((law.a - 2.0).abs() < 1e-9 && (law.b - 3.0).abs() < 1e-9 && law.residual < 1e-12);
        let bends = [1.1, 0.9, 1.1, 0.9];
        let bent: Vec<SweepPoint> = bends.iter().zip([1.0, 4.0, 16.0, 80.0]).map(|(b, d)| point(d, *b)).collect();
        let bent = Law::fit(&bent).unwrap();
        assert!((0.03..0.12).contains(&bent.residual), "{}", bent.residual);
        assert!(Law::fit(&[point(10.0, 1.0), point(10.0, 1.0), point(10.1, 1.0)]).is_none());
    }
}
