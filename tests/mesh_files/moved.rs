//! Blocks that were moved, turned or mirrored.

use super::{Case, Original, Outcome, case, stl::binary};
use glam::{DMat3, DVec3};
use glasswarp_verify::load::Format::Stl;
use std::f64::consts::{FRAC_PI_2, PI};

pub(super) fn cases(original: &Original) -> Vec<Case> {
    let triangles = original.triangles();
    let changed = |change: &dyn Fn(DVec3) -> DVec3| -> Vec<[DVec3; 3]> {
        triangles.iter().map(|corners| corners.map(change)).collect()
    };
    let righted = |kind: &str, from, change: &dyn Fn(DVec3) -> DVec3, what| {
        case(kind, from, Stl, binary("", &changed(change)), Outcome::Righted(what))
    };
    let turned = |kind: &str, from, axis: DVec3, angle: f64| {
        let turn = DMat3::from_axis_angle(axis.normalize(), angle);
        righted(kind, from, &|v| turn * v, "turned back")
    };
    let mirrored = |kind: &str, wound: bool| {
        let mut triangles = changed(&|v| DVec3::new(-v.x, v.y, v.z));
        if wound {
            triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        case(kind, "mirrored in a CAD program", Stl, binary("", &triangles), Outcome::Mirrored)
    };
    vec![
        righted("moved aside", "placed on a printer's bed", &|v| v + DVec3::new(30.0, 20.0, 5.0), "moved back"),
        righted("moved along the light", "placed on its entry face", &|v| v + DVec3::Z * 10.0, "moved back"),
        righted("y up", "Blender, game engines", &|v| DVec3::new(v.x, v.z, -v.y), "turned back"),
        turned("upside down", "slicers", DVec3::X, PI),
        turned("upside down the other way", "slicers", DVec3::Y, PI),
        turned("a quarter turn about z", "nesting programs", DVec3::Z, FRAC_PI_2),
        turned("a quarter turn about z, the other way", "nesting programs", DVec3::Z, -FRAC_PI_2),
        turned("lying on its side", "slicers", DVec3::Y, FRAC_PI_2),
        turned("10 degrees about z", "scenes", DVec3::Z, 10f64.to_radians()),
        turned("a degree about x", "scenes", DVec3::X, 1f64.to_radians()),
        turned("40 degrees about a diagonal", "scenes", DVec3::new(1.0, 2.0, -1.0), 40f64.to_radians()),
        righted(
            "y up, moved, tilted",
            "scenes",
            &|v| DMat3::from_axis_angle(DVec3::X, 1.0) * v + DVec3::new(7.0, -3.0, 11.0),
            "turned and moved back",
        ),
        mirrored("mirrored, its triangles turned round", true),
        mirrored("mirrored, its triangles left inside out", false),
    ]
}
