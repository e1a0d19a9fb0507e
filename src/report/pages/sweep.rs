//! A sweep as a table, as layers of a picture, and as curves.

use crate::{
    report::curves::{Curve, curves as plot},
    spec::Quantity,
    study::sweep::{SWEEP_VIEWS, SweepPoint},
};
use glam::DVec2;
use glasswarp_verify::{Image, Scene};
use image::GrayImage;
use std::fmt::Write as _;

/// The light of every place in every view, by its name.
pub(crate) fn layers(quantity: Quantity, points: &[SweepPoint]) -> Vec<(String, &Image)> {
    let mut layers = Vec::new();
    for point in points {
        for ((view, ..), seen) in SWEEP_VIEWS.iter().zip(&point.views) {
            layers.push((format!("{}={} {view}", quantity.column(), point.value), &seen.image));
        }
    }
    layers
}

/// The errors along the range.
pub(crate) fn curves(quantity: Quantity, points: &[SweepPoint]) -> GrayImage {
    let through = |name: &str, y: &dyn Fn(&SweepPoint) -> f64| Curve {
        name: name.into(),
        points: points.iter().map(|point| DVec2::new(point.value, y(point))).collect(),
    };
    let curves = [
        through("displaced surface", &|p| p.views[0].rel_rms),
        through("normal-mapped plane", &|p| p.views[1].rel_rms),
        through("smooth normals", &|p| p.views[2].rel_rms),
        through("flat facets", &|p| p.views[3].rel_rms),
        through("relief / distance", &|p| p.relief_mm / p.scene.distance_mm),
    ];
    let x = quantity.column().replace("_mm", ", mm");
    plot(&x, "relative RMS error", &curves).raster()
}

/// One line per point; units in the names of the columns, errors without unit.
pub(crate) fn table(quantity: Quantity, points: &[SweepPoint]) -> String {
    let mut table = String::from(
        "swept,value,distance_mm,size_mm,thickness_mm,index,nodes,relief_mm,relief_over_distance,plane_moves",
    );
    for (name, ..) in SWEEP_VIEWS {
        let _ = write!(table, ",{name}_rel_rms,{name}_ssim");
    }
    for point in points {
        let Scene { distance_mm, window, .. } = &point.scene;
        let ior = point.scene.ior();
        let _ = write!(
            table,
            "\n{},{},{distance_mm},{},{:.4},{ior},{},{:.6},{:.6},{:.6}",
            quantity.column(),
            point.value,
            window.size_mm.x,
            point.thickness_mm,
            point.nodes.0,
            point.relief_mm,
            point.relief_mm / distance_mm,
            point.plane_moves
        );
        for view in &point.views {
            let _ = write!(table, ",{:.6},{:.6}", view.rel_rms, view.ssim);
        }
    }
    table.push('\n');
    table
}
