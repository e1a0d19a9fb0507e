//! `glasswarp verify --sweep`: how the errors change with the bench.

use super::{
    console::{self, say},
    machine::{Machine, has_extension},
    memory::{self, MemoryArgs},
    progress::TerminalProgress,
    side_files::open_workpiece,
};
use crate::{
    export::write_atomically,
    failure::Failure,
    record::{SideFile, document},
    report::{self, Curve},
    spec::{Quantity, Range},
    study::{
        design::Plan,
        sweep::{Law, SWEEP_VIEWS, SweepPoint, Swept},
    },
};
use glam::DVec2;
use glasswarp_verify::{Image, Scene, image_file};
use std::{
    fmt::Write as _,
    io::Write as _,
    path::{Path, PathBuf},
};

/// Sweeps the design of a side file (and its name, if it was given), or the block `as_built`, and writes what was found.
pub(crate) fn run(
    range: &Range,
    steps: usize,
    (side, named): (&SideFile, Option<&Path>),
    as_built: Option<&Path>,
    (pixels, memory): (usize, MemoryArgs),
    outputs: &[PathBuf],
) -> Result<(), Failure> {
    let outputs = outputs.iter().map(|path| Ok((Output::of(path)?, path))).collect::<Result<Vec<_>, Failure>>()?;
    let picture = side.design.picture.clone();
    let picture = picture.ok_or_else(|| Failure::Usage("the side file names no picture to design for".into()))?;
    Swept::check(range.quantity, side.bench.mirror, as_built.is_some())?;
    let progress = TerminalProgress::new();
    let built = as_built.map(|path| open_workpiece(path, named, (None, None), pixels, &progress)).transpose()?;
    built.iter().try_for_each(|piece| memory::check_pixels(&piece.examiner, memory))?;
    let fits = |plan: &Plan| memory::check_look(plan, pixels, memory).map(drop);
    let swept = built.as_ref().map_or(Swept::Design(side, &picture), Swept::AsBuilt);
    let mut points = Vec::new();
    let mut refused = None;
    print_header(range.quantity);
    for value in range.values(steps) {
        match swept.at(range, value, pixels, &Machine, &fits) {
            Ok(point) => {
                print(&point);
                points.push(point);
            }
            // Some benches cannot draw the picture; the others still can.
            Err(failure @ (Failure::Refused(_) | Failure::Usage(_))) => {
                console::warn(format_args!("{} = {value}: {failure}", range.quantity.column()));
                refused = Some(failure);
            }
            Err(failure) => return Err(failure),
        }
    }
    if let (true, Some(failure)) = (points.is_empty(), refused) {
        return Err(failure);
    }
    // One block has one relief: its light follows another law.
    if let (None, Some(law)) = (&built, Law::fit(&points)) {
        say!(
            "\nThe plane moves the light by {:.2} r / (1 + {:.2} r) of its mean, r = relief / distance, within {:.1} %.",
            law.a,
            law.b,
            100.0 * law.residual
        );
    }
    console::result(document::Result::Sweep(document::Sweep {
        swept: range.quantity.column().to_owned(),
        points: points.iter().map(SweepPoint::document).collect(),
        files: outputs.iter().map(|(_, path)| path.display().to_string()).collect(),
    }));
    for (kind, path) in outputs {
        kind.write(path, range.quantity, &points)?;
    }
    Ok(())
}

fn print_header(quantity: Quantity) {
    say!("{:>12} {:>10}   relative RMS:", quantity.column(), "relief mm");
    say!("{:>23} {:>10} {:>10} {:>10} {:>10}   plane moves by", "", "displaced", "plane", "smooth", "facets");
}

fn print(point: &SweepPoint) {
    let errors = point.views.iter().map(|view| format!(" {:>10.4}", view.rel_rms)).collect::<String>();
    say!("{:>12} {:>10.3}{errors} {:>16.4}", point.value, point.relief_mm, point.plane_moves);
}

/// A file of a sweep, by its extension.
enum Output {
    Csv,
    Exr,
    Png,
}

impl Output {
    fn of(path: &Path) -> Result<Self, Failure> {
        match path {
            path if has_extension(path, "csv") => Ok(Self::Csv),
            path if has_extension(path, "exr") => Ok(Self::Exr),
            path if has_extension(path, "png") => Ok(Self::Png),
            _ => Err(Failure::Usage(format!(
                "{}: a sweep is written as .csv (numbers), .exr (all images as layers) or .png (curves)",
                path.display()
            ))),
        }
    }

    fn write(&self, path: &Path, quantity: Quantity, points: &[SweepPoint]) -> Result<(), Failure> {
        match self {
            Self::Csv => {
                let table = table(quantity, points);
                write_atomically(path, |out| out.write_all(table.as_bytes())).map_err(Failure::writing)
            }
            Self::Exr => {
                let layers: Vec<(String, &Image)> = points
                    .iter()
                    .flat_map(|point| {
                        let name = move |view: &str| format!("{}={} {view}", quantity.column(), point.value);
                        SWEEP_VIEWS.iter().zip(&point.views).map(move |((view, ..), seen)| (name(view), &seen.image))
                    })
                    .collect();
                image_file::write_exr_layers(path, &layers).map_err(Failure::writing)
            }
            Self::Png => {
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
                let plot = report::curves(&x, "relative RMS error", &curves);
                report::write_png(path, &plot).map_err(Failure::writing)
            }
        }
    }
}

/// One line per point; units in the names of the columns, errors without unit.
fn table(quantity: Quantity, points: &[SweepPoint]) -> String {
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
