//! A block on another bench than the one that it was made for: where its picture goes, and how far
//! a slope throws light there.

use super::{before::Before, bench::scene_of};
use crate::{failure::Failure, record::SideFile, spec::Host};
use glam::DVec2;
use glasswarp_verify::{Block, End, Image, Optics, Scene, Surface, Tracer, Window};

/// A changed bench, with the window where the picture has gone.
pub struct Followed {
    /// The changed bench.
    pub scene: Scene,
    /// How far the picture has moved on the receiver, mm.
    pub moved_mm: DVec2,
    /// How much larger it has become along x and y, as a ratio.
    pub growth: DVec2,
}

/// Parts of the face's size, from its middle, where the light of a flat face is followed: well
/// within any outline.
const PLACES: [(f64, f64); 4] = [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)];

/// Puts the window of a bench, on which its block (`from`) stands, where and as large as the light
/// of a flat block carries it on a changed one: where a picture is and how large it is says whoever
/// hangs it, and no change of that spoils it.
///
/// # Errors
/// A bench that cannot be, or on which no such light arrives.
pub fn follow_picture((before, from): (&Block, &Scene), (after, mut to): (&Block, Scene)) -> Result<Followed, Failure> {
    let (before, after) = (footprint(before, from)?, footprint(after, &to)?);
    let (moved_mm, growth) = (after.middle_mm - before.middle_mm, after.size_mm / before.size_mm);
    to.window.centre_mm = after.middle_mm + growth * (from.window.centre_mm - before.middle_mm);
    to.window.size_mm = growth * from.window.size_mm;
    Ok(Followed { scene: to, moved_mm, growth })
}

/// Where the light of a flat block falls.
struct Footprint {
    middle_mm: DVec2,
    /// Of its part between the [places](PLACES).
    size_mm: DVec2,
}

fn footprint(block: &Block, scene: &Scene) -> Result<Footprint, Failure> {
    let flat = flat(block, scene, DVec2::ZERO)?;
    let size = block.size_mm();
    let landing = |at: DVec2| match flat.path_at(at).end {
        End::Receiver(landing) => Ok(landing),
        _ => Err(Failure::Usage(format!(
            "on this bench the light of a flat block does not come to the receiver from its place ({:.1}, {:.1}) mm",
            at.x, at.y
        ))),
    };
    let [a, b, c, d] = PLACES.map(|(x, y)| landing(DVec2::new(x, y) * size));
    let [a, b, c, d] = [a?, b?, c?, d?];
    let spans = DVec2::new((b - a).x + (d - c).x, (c - a).y + (d - b).y);
    Ok(Footprint { middle_mm: landing(DVec2::ZERO)?, size_mm: 0.5 * spans.abs() })
}

/// A flat block whose face turns light as if it had this slope. What stands before it carries its
/// light there flat as well: where a picture goes as a whole does not depend on pictures.
fn flat(block: &Block, scene: &Scene, slope: DVec2) -> Result<Tracer, Failure> {
    let level = vec![block.mean_exit_z_mm(); 16];
    let leaning = block.clone().with_sloped_face((4, 4), level, vec![slope; 16]).map_err(Failure::refused)?;
    Tracer::for_block(&leaning, &Scene { surface: Surface::Smooth, before: Vec::new(), ..scene.clone() })
        .map_err(Failure::refused)
}

/// How far, mm, light of a flat block goes astray at most on a bench where its face leans by a
/// slope, along one of these unit vectors, to either side. Infinite where it does not arrive any
/// more.
///
/// # Errors
/// A bench that cannot be.
pub fn deflection_mm(block: &Block, scene: &Scene, slope: f64, along: &[DVec2]) -> Result<f64, Failure> {
    let level = flat(block, scene, DVec2::ZERO)?;
    let mut most = 0.0_f64;
    for lean in along.iter().flat_map(|&along| [slope * along, -slope * along]) {
        let leaning = flat(block, scene, lean)?;
        for at in PLACES.iter().map(|&(x, y)| DVec2::new(x, y) * block.size_mm()).chain([DVec2::ZERO]) {
            most = most.max(match (level.path_at(at).end, leaning.path_at(at).end) {
                (End::Receiver(level), End::Receiver(landing)) => landing.distance(level),
                (End::Receiver(_), _) => f64::INFINITY,
                _ => 0.0,
            });
        }
    }
    Ok(most)
}

/// The bench of a block, or of another solid (`None`), at another distance or through another
/// index, the window where the picture then is.
///
/// # Errors
/// An index for a mirror; a bench that cannot be.
pub fn changed_bench(
    scene: Scene,
    block: Option<&Block>,
    ior: Option<f64>,
    distance_mm: Option<f64>,
) -> Result<Scene, Failure> {
    let mut changed = scene.clone();
    changed.distance_mm = distance_mm.unwrap_or(scene.distance_mm);
    if let Some(ior) = ior {
        if scene.optics == Optics::Reflects {
            return Err(Failure::Usage(format!(
                "this block is a mirror, which light does not enter: an index of {ior} means nothing there, leave `ior` out"
            )));
        }
        changed.optics = Optics::Refracts { ior };
    }
    match block {
        Some(block) if changed != scene => Ok(follow_picture((block, &scene), (block, changed))?.scene),
        _ => Ok(changed),
    }
}

/// The bench of a block from a file, or of another solid (`None`) of this size: that of its side
/// file, at another distance or through another index if these are given; without one, in straight
/// light, if both are.
///
/// # Errors
/// A bench that cannot be; without a side file, `missing` of what is not given.
pub fn scene_of_file(
    block: Option<&Block>,
    size_mm: DVec2,
    side: Option<(&SideFile, &Before)>,
    (ior, distance_mm): (Option<f64>, Option<f64>),
    host: &dyn Host,
    missing: impl Fn(&str) -> Failure,
) -> Result<Scene, Failure> {
    let scene = match (side, ior, distance_mm) {
        (Some((side, before)), ..) => scene_of(&side.bench, &side.design, before, host)?,
        (None, Some(ior), Some(distance_mm)) => {
            Scene::new(ior, distance_mm, Window { size_mm, centre_mm: DVec2::ZERO, nx: 1, ny: 1 })
        }
        (None, None, _) => return Err(missing("`ior`")),
        (None, _, None) => return Err(missing("`distance`")),
    };
    changed_bench(scene, block, ior, distance_mm)
}

/// A bench with another window around the same middle: of this width, and of this height or else
/// that which the picture, or the window so far, has at this width.
pub fn with_window(mut scene: Scene, width_mm: f64, height_mm: Option<f64>, target: Option<&Image>) -> Scene {
    let natural = scene.window.size_mm;
    let aspect = target.map_or(natural.y / natural.x, |target| target.ny as f64 / target.nx as f64);
    scene.window.size_mm = DVec2::new(width_mm, height_mm.unwrap_or(width_mm * aspect));
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use glasswarp_verify::{Emission, Light};

    fn block() -> Block {
        Block::from_heights(DVec2::new(80.0, 60.0), -10.0, (4, 4), vec![0.0; 16]).unwrap()
    }

    fn window() -> Window {
        Window { size_mm: DVec2::new(80.0, 60.0), centre_mm: DVec2::new(3.0, -2.0), nx: 8, ny: 8 }
    }

    #[test]
    fn slopes_throw_light_as_snells_law_and_the_mirrors_say() {
        let slope = 0.0167_f64;
        let straight = Scene::new(1.49, 500.0, window());
        let wanted = 500.0 * ((1.49 * slope.atan().sin()).asin() - slope.atan()).tan();
        let mirror = 300.0 * (2.0 * slope.atan()).tan();
        for (scene, wanted) in [(straight.clone(), wanted), (Scene::mirror(300.0, window()), mirror)] {
            let thrown = deflection_mm(&block(), &scene, slope, &[DVec2::X, DVec2::Y]).unwrap();
            assert!((thrown - wanted).abs() < 1e-9, "{thrown} for {wanted}");
        }
        // To first order in the slope, light at an angle is thrown across its plane by the longer
        // way times the change of its tangential part, and along it by 1 / cos^2 more; the second
        // order is below the slope.
        let (sin, cos) = (0.5_f64, 0.75_f64.sqrt());
        let tilted = Scene { light: Light::parallel(DVec3::new(0.0, -sin, cos)), ..straight };
        let [across, along] = [DVec2::X, DVec2::Y].map(|a| deflection_mm(&block(), &tilted, slope, &[a]).unwrap());
        let first_order = 500.0 / cos * ((1.49_f64.powi(2) - sin * sin).sqrt() - cos) * slope;
        assert!((across / first_order - 1.0).abs() < 2.0 * slope, "{across} {first_order}");
        assert!((along / across * cos * cos - 1.0).abs() < 2.0 * slope, "{along} {across}");
    }

    #[test]
    fn the_window_goes_where_the_picture_goes() {
        let straight = Scene::new(1.5, 200.0, window());
        let further = |scene: &Scene| {
            let to = Scene { distance_mm: scene.distance_mm + 10.0, ..scene.clone() };
            follow_picture((&block(), scene), (&block(), to)).unwrap()
        };
        // Nothing changes in straight light, to the last bit.
        let same = further(&straight);
        assert_eq!((same.scene.window, same.moved_mm, same.growth), (window(), DVec2::ZERO, DVec2::ONE));
        let tilted = Scene { light: Light::parallel(DVec3::new(0.6, 0.0, 0.8)), ..straight.clone() };
        let aside = further(&tilted);
        assert!((aside.moved_mm - DVec2::new(7.5, 0.0)).length() < 1e-9 && (aside.growth - 1.0).length() < 1e-12);
        assert!((aside.scene.window.centre_mm - DVec2::new(10.5, -2.0)).length() < 1e-9);
        // A point source, whose rays seem to come from 90 + 10 / 1.5 mm before the face to first
        // order.
        let light =
            Light::Point { position_mm: DVec3::new(0.0, 0.0, -100.0), emission: Emission::Isotropic, axis: None };
        let larger = further(&Scene { light, ..straight });
        let wanted = 1.0 + 10.0 / (200.0 + 90.0 + 10.0 / 1.5);
        assert!((larger.growth - wanted).abs().max_element() < 1e-3, "{} {wanted}", larger.growth);
        // A mirror turned by an angle sends its picture away by twice that.
        let mirror = Scene::mirror(300.0, window());
        let turned = Scene { turned: DVec3::new(0.0, 0.01, 0.0), ..mirror.clone() };
        let away = follow_picture((&block(), &mirror), (&block(), turned)).unwrap();
        assert!((away.moved_mm.x - 300.0 * 0.02_f64.tan()).abs() < 1e-9, "{}", away.moved_mm);
    }

    #[test]
    fn a_mirror_has_no_index() {
        let error = changed_bench(Scene::mirror(300.0, window()), Some(&block()), Some(1.5), None).unwrap_err();
        assert!(error.to_string().contains("`ior`"), "{error}");
    }
}
