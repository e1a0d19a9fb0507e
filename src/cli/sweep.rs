//! `glasswarp verify --sweep`: how the errors change with the bench.

use super::{
    budget::mesh_of,
    console::{self, say},
    error::Failure,
    json,
    judge::{Examiner, Subject},
    length::Length,
    otherwise::seen_otherwise,
    plan::Plan,
    side_file::SideFile,
    workpiece::Workpiece,
};
use glam::DVec2;
use glasswarp::{
    export::write_atomically,
    report::{self, Curve},
    solver::Silent,
};
use glasswarp_verify::{Geometry, Image, Scene, Surface, image_file, metrics};
use std::{
    borrow::Cow,
    fmt::Write as _,
    io::Write as _,
    path::{Path, PathBuf},
    str::FromStr,
};

/// What is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    Distance,
    Size,
    Thickness,
    Index,
    Nodes,
}

impl Quantity {
    const ALL: [(&'static str, Self); 6] = [
        ("distance", Self::Distance),
        ("size", Self::Size),
        ("thickness", Self::Thickness),
        ("index", Self::Index),
        ("ior", Self::Index),
        ("nodes", Self::Nodes),
    ];

    fn column(self) -> &'static str {
        match self {
            Self::Distance => "distance_mm",
            Self::Size => "size_mm",
            Self::Thickness => "thickness_mm",
            Self::Index => "index",
            Self::Nodes => "nodes",
        }
    }
}

/// What is varied, from where to where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    quantity: Quantity,
    from: f64,
    to: f64,
}

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('=').and_then(|(name, range)| Some((name, range.split_once("..")?)));
        let (name, (from, to)) = parts.ok_or_else(|| format!("'{text}' is no range such as distance=60..1000"))?;
        let quantity = Quantity::ALL.iter().find(|(known, _)| *known == name.trim()).map(|(_, quantity)| *quantity);
        let quantity = quantity
            .ok_or_else(|| format!("'{name}' cannot be swept; distance, size, thickness, index and nodes can"))?;
        let end = |text: &str| match quantity {
            Quantity::Index | Quantity::Nodes => {
                text.trim().parse::<f64>().map_err(|_| format!("'{text}' is no number"))
            }
            _ => text.parse::<Length>().map(|length| length.mm),
        };
        let (from, to) = (end(from)?, end(to)?);
        if from.is_finite() && to.is_finite() && 0.0 < from && from < to {
            Ok(Self { quantity, from, to })
        } else {
            Err(format!("the range goes from {from} to {to}; it must rise from above 0"))
        }
    }
}

impl Range {
    /// Values in equal ratios, the ends included.
    fn values(self, steps: usize) -> Vec<f64> {
        let ratio = self.to / self.from;
        let mut values: Vec<f64> = (0..steps)
            .map(|k| match k {
                0 => self.from,
                k if k + 1 == steps => self.to,
                k => self.from * ratio.powf(k as f64 / (steps - 1) as f64),
            })
            // Round numbers, and whole ones of nodes.
            .map(|v| if self.quantity == Quantity::Nodes { v.round() } else { (v * 1e4).round() / 1e4 })
            .collect();
        values.dedup();
        values
    }
}

/// One place along the range.
struct Point {
    value: f64,
    scene: Scene,
    nodes: (usize, usize),
    thickness_mm: f64,
    relief_mm: f64,
    views: Vec<View>,
    /// Relative RMS difference between the light of the plane and that of the true surface.
    plane_moves: f64,
}

struct View {
    image: Image,
    rel_rms: f64,
    ssim: f64,
}

/// The views, in the order of the columns.
const VIEWS: [(&str, Surface, Geometry); 4] = [
    ("displaced", Surface::Spline, Geometry::Displaced),
    ("plane", Surface::Spline, Geometry::NormalMappedPlane),
    ("smooth", Surface::Smooth, Geometry::Displaced),
    ("facets", Surface::Facets, Geometry::Displaced),
];

/// Sweeps the design of a side file (and its name, if it was given), or the block `as_built`, and writes what was found.
pub(crate) fn run(
    range: &Range,
    steps: usize,
    (side, named): (&SideFile, Option<&Path>),
    as_built: Option<&Path>,
    pixels: usize,
    outputs: &[PathBuf],
) -> Result<(), Failure> {
    let outputs = outputs.iter().map(|path| Ok((Output::of(path)?, path))).collect::<Result<Vec<_>, Failure>>()?;
    let picture = side.design.picture.clone();
    let picture = picture.ok_or_else(|| Failure::Usage("the side file names no picture to design for".into()))?;
    if range.quantity == Quantity::Index && side.bench.mirror {
        return Err(Failure::Usage(
            "this block is a mirror, which light does not enter: its index cannot be swept; distance, size and nodes can".into(),
        ));
    }
    let built = match (as_built, range.quantity) {
        (None, _) => None,
        (Some(path), Quantity::Distance | Quantity::Index) => Some(Workpiece::open(path, named, (None, None), pixels)?),
        (Some(_), _) => {
            return Err(Failure::Usage("--as-built looks from another distance or through another index only".into()));
        }
    };
    let mut points = Vec::new();
    let mut refused = None;
    print_header(range.quantity);
    for value in range.values(steps) {
        let point = match &built {
            Some(piece) => {
                let (ior, distance_mm) = match range.quantity {
                    Quantity::Index => (Some(value), None),
                    _ => (None, Some(value)),
                };
                let subject = Subject::Block(Box::new(piece.block.clone().with_spline()));
                seen_otherwise(piece.scene(), Some(&piece.block), ior, distance_mm)
                    .and_then(|scene| look(value, &piece.examiner.on(scene), &subject))
            }
            None => {
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
                Plan::new(picture.clone(), settings).and_then(|plan| {
                    let block = plan.design(&Silent)?;
                    let subject = Subject::of(Cow::Owned(mesh_of(&block.solid, None)), Path::new("the block"))?;
                    let wanted = plan.wanted()?;
                    look(value, &Examiner::new(plan.scene()?, Some(wanted.in_perfect_light()), pixels), &subject)
                })
            }
        };
        match point {
            Ok(point) => {
                point.print();
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
    console::result(json::Result::Sweep(json::Sweep {
        swept: range.quantity.column().to_owned(),
        points: points.iter().map(Point::to_json).collect(),
        files: outputs.iter().map(|(_, path)| path.display().to_string()).collect(),
    }));
    for (kind, path) in outputs {
        kind.write(path, range.quantity, &points)?;
    }
    Ok(())
}

fn look(value: f64, examiner: &Examiner, subject: &Subject) -> Result<Point, Failure> {
    let Subject::Block(block) = subject else {
        return Err(Failure::Usage("only a block can be seen on the normal-mapped plane".into()));
    };
    let mut views = Vec::new();
    for (_, surface, geometry) in VIEWS {
        let image = examiner.look(subject, surface, geometry)?.image;
        if let Some(metrics) = examiner.compare(&image)? {
            views.push(View { rel_rms: metrics.rel_rms, ssim: metrics.ssim, image });
        }
    }
    let (low, high) = block.height_range_mm();
    let plane_moves = metrics::rel_rms(&views[1].image, &views[0].image).map_err(Failure::refused)?;
    let highest = block.rim_z_mm().map_or(high, |rim| rim.max(high));
    Ok(Point {
        value,
        scene: examiner.scene_for(subject),
        nodes: block.nodes(),
        thickness_mm: highest - block.entry_z_mm(),
        relief_mm: high - low,
        views,
        plane_moves,
    })
}

fn print_header(quantity: Quantity) {
    say!("{:>12} {:>10}   relative RMS:", quantity.column(), "relief mm");
    say!("{:>23} {:>10} {:>10} {:>10} {:>10}   plane moves by", "", "displaced", "plane", "smooth", "facets");
}

impl Point {
    fn to_json(&self) -> json::SweepPoint {
        let view = |k: usize| self.views.get(k).and_then(|view| json::finite(view.rel_rms));
        json::SweepPoint {
            value: self.value,
            relief_mm: self.relief_mm,
            displaced: view(0),
            plane: view(1),
            smooth: view(2),
            facets: view(3),
            plane_moves: json::finite(self.plane_moves),
        }
    }

    fn print(&self) {
        let errors = self.views.iter().map(|view| format!(" {:>10.4}", view.rel_rms)).collect::<String>();
        say!("{:>12} {:>10.3}{errors} {:>16.4}", self.value, self.relief_mm, self.plane_moves);
    }
}

/// How far the plane moves the light: a r / (1 + b r) with r = relief / distance. Proportional to r while the light is moved by
/// less than the details of the picture are wide; two unrelated pictures differ by a certain amount and no more.
struct Law {
    a: f64,
    b: f64,
    /// Root mean square of the relative deviation.
    residual: f64,
}

impl Law {
    /// By least squares of the relative deviation. `None` where r hardly changes, or with fewer than three points.
    fn fit(points: &[Point]) -> Option<Self> {
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

/// A file of a sweep, by its extension.
enum Output {
    Csv,
    Exr,
    Png,
}

impl Output {
    fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        match extension.as_str() {
            "csv" => Ok(Self::Csv),
            "exr" => Ok(Self::Exr),
            "png" => Ok(Self::Png),
            _ => Err(Failure::Usage(format!(
                "{}: a sweep is written as .csv (numbers), .exr (all images as layers) or .png (curves)",
                path.display()
            ))),
        }
    }

    fn write(&self, path: &Path, quantity: Quantity, points: &[Point]) -> Result<(), Failure> {
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
                        VIEWS.iter().zip(&point.views).map(move |((view, ..), seen)| (name(view), &seen.image))
                    })
                    .collect();
                image_file::write_exr_layers(path, &layers).map_err(Failure::writing)
            }
            Self::Png => {
                let through = |name: &str, y: &dyn Fn(&Point) -> f64| Curve {
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
fn table(quantity: Quantity, points: &[Point]) -> String {
    let mut table = String::from(
        "swept,value,distance_mm,size_mm,thickness_mm,index,nodes,relief_mm,relief_over_distance,plane_moves",
    );
    for (name, ..) in VIEWS {
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

#[cfg(test)]
mod tests {
    use super::*;
    use glasswarp_verify::Window;

    #[test]
    fn ranges_are_read_with_their_units() {
        let range: Range = "distance=6cm..1m".parse().unwrap();
        assert_eq!(range, Range { quantity: Quantity::Distance, from: 60.0, to: 1000.0 });
        assert_eq!(range.values(3), [60.0, 244.949, 1000.0]);
        assert_eq!("nodes=65..67".parse::<Range>().unwrap().values(8), [65.0, 66.0, 67.0]);
        assert_eq!("ior=1.4..1.7".parse::<Range>().unwrap().values(2), [1.4, 1.7]);
        for text in
            ["distance", "distance=60", "colour=1..2", "distance=9..3", "index=a..b", "size=0..5", "nodes=nan..9"]
        {
            assert!(text.parse::<Range>().is_err(), "{text}");
        }
    }

    #[test]
    fn the_law_is_found_with_its_residual() {
        let point = |distance_mm: f64, bend: f64| Point {
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
        let bent: Vec<Point> = bends.iter().zip([1.0, 4.0, 16.0, 80.0]).map(|(b, d)| point(d, *b)).collect();
        let bent = Law::fit(&bent).unwrap();
        assert!((0.03..0.12).contains(&bent.residual), "{}", bent.residual);
        assert!(Law::fit(&[point(10.0, 1.0), point(10.0, 1.0), point(10.1, 1.0)]).is_none());
    }
}
