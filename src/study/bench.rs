//! From settings to a bench, from a bench to its record, and from the record to the scene in which
//! the verifier looks at its block: the one place where these become each other.

use super::{
    before::{self, Before},
    lamp::Lamp,
    material::ior_of,
};
use crate::{
    bench::{Bench, ExitFace},
    failure::Failure,
    grid::{Extent, Field},
    irradiance::{Picture, PictureError, PictureOptions, Transfer, to_picture_order},
    light::{Intensity, Light, Profile},
    record::{BenchRecord, document},
    solid::Solid,
    spec::{Emission, Host, LightName, OutlineName, Settings, Shift},
};
use glam::{DVec2, DVec3};
use glasswarp_verify::{self as verify, Image, Optics, Scene, Window};
use std::{io::Cursor, path::Path};

/// How far away the receiver is if nobody says, mm.
pub const DISTANCE_MM: f64 = 250.0;
/// Where a point source stands if nobody says, from the entry face, mm.
const SOURCE_MM: f64 = 500.0;
/// Greatest angle of incidence, degrees.
const STEEPEST_DEG: f64 = 75.0;

/// The bench that settings describe, behind what stands before it, for a picture of `ny / nx` =
/// `aspect`. `thickness_mm` counts from the entry face to the mean exit plane; only light from a point
/// and light that comes through another block look at it.
///
/// # Errors
/// Everything that makes no bench.
pub fn bench_of(
    settings: &Settings,
    before: &Before,
    aspect: f64,
    thickness_mm: f64,
    host: &dyn Host,
) -> Result<Bench, Failure> {
    let size = |width_mm: f64| Extent::new(width_mm, width_mm * aspect);
    let exit_face =
        if settings.is_mirror() { ExitFace::Reflects } else { ExitFace::Refracts { ior: ior_of(settings)? } };
    let distance_mm = settings.distance.map_or(DISTANCE_MM, |length| length.mm);
    let block = size(settings.size.map_or(100.0, |length| length.mm));
    let mut bench = Bench::new(block, distance_mm, exit_face).map_err(Failure::refused)?;
    if let Some(OutlineName(outline)) = settings.outline {
        bench = bench.with_outline(outline).map_err(Failure::refused)?;
    }
    if let Some(leaning) = settings.receiver_tilt {
        // Its side that the inclination names recedes.
        let towards = leaning.towards();
        let axis = DVec3::new(towards.y, -towards.x, 0.0);
        bench = bench.with_receiver_turned(axis * leaning.by.radians()).map_err(Failure::refused)?;
    }
    bench = before.stand_before(lit(bench, settings, thickness_mm, host)?, thickness_mm)?;
    let window = settings.window.map_or_else(|| undisturbed_window(&bench), |width| size(width.mm));
    let Shift { right, up } = settings.shift.unwrap_or_default();
    let centre = bench.undisturbed_landing_mm().map_err(Failure::refused)? + DVec2::new(-right.mm, up.mm);
    bench.with_window(window, centre).map_err(Failure::refused)
}

/// The size of picture that needs least of the block: as large as the light of a flat one, and of
/// the picture's aspect.
fn undisturbed_window(bench: &Bench) -> Extent {
    let spread = match bench.light() {
        Light::Parallel { .. } => 1.0,
        Light::Point { position_mm, thickness_mm, .. } => {
            let to_face = match bench.exit_face() {
                ExitFace::Refracts { ior } => -thickness_mm - position_mm.z + thickness_mm / ior,
                ExitFace::Reflects => position_mm.z,
            };
            1.0 + bench.distance_mm() / to_face
        }
    };
    Extent::new(spread * bench.block().width_mm, spread * bench.block().height_mm)
}

/// The bench with its light.
fn lit(bench: Bench, settings: &Settings, thickness_mm: f64, host: &dyn Host) -> Result<Bench, Failure> {
    // Light comes from `towards`, against which it travels.
    let (deg, towards) = settings.tilt.map_or((0.0, DVec2::ZERO), |tilt| (tilt.by.deg, tilt.towards()));
    if !(0.0..=STEEPEST_DEG).contains(&deg) {
        return Err(Failure::Usage(format!(
            "the tilt of the light (`tilt`) is {deg} degrees; it must lie between 0 and {STEEPEST_DEG} degrees"
        )));
    }
    let (sin, cos) = deg.to_radians().sin_cos();
    // +z into glass, -z onto a mirror.
    let sense = if settings.is_mirror() { -1.0 } else { 1.0 };
    let bench = match settings.light() {
        LightName::Parallel => {
            // `+ 0.0` turns a negative zero into a positive one.
            let across = towards * -sin + 0.0;
            bench.with_light_in_air(across.extend(sense * cos)).map_err(Failure::refused)?
        }
        LightName::Point => {
            let away_mm = settings.source_distance.map_or(SOURCE_MM, |length| length.mm);
            let entry_z = if settings.is_mirror() { 0.0 } else { -thickness_mm };
            let position_mm = (towards * (sin * away_mm)).extend(entry_z - sense * cos * away_mm);
            let lamp = Lamp::open(settings.emission.as_ref().unwrap_or(&Emission::Isotropic), host)?;
            // What the library knows in closed form needs no table.
            let straight = deg == 0.0 && lamp == Lamp::Lambertian;
            let intensity = if straight { Intensity::Lambertian } else { Intensity::Isotropic };
            let bench = bench.with_point_source(position_mm, thickness_mm, intensity).map_err(Failure::refused)?;
            if straight || lamp == Lamp::Isotropic || settings.beam.is_some() {
                bench
            } else {
                let axis = (DVec3::Z * entry_z - position_mm).normalize();
                let profile =
                    Profile::of(&bench, thickness_mm, |ray| lamp.intensity(ray.direction.angle_between(axis)));
                bench.with_profile(profile.map_err(Failure::refused)?)
            }
        }
    };
    let Some(path) = &settings.beam else { return Ok(bench) };
    let beam = to_picture_order(open_beam(path, host)?.values());
    let profile = Profile::measured(&bench, thickness_mm, &beam).map_err(Failure::refused)?;
    Ok(bench.with_profile(profile))
}

fn open_beam(path: &Path, host: &dyn Host) -> Result<Picture, Failure> {
    linear_picture(path, "beam", host)
}

/// A picture of light, whose numbers are linear; `what` says of what it is one.
pub fn linear_picture(path: &Path, what: &str, host: &dyn Host) -> Result<Picture, Failure> {
    let options = PictureOptions::default().with_transfer(Some(Transfer::Linear));
    let read = host.read(path).map_err(PictureError::Io).and_then(|bytes| options.read(Cursor::new(bytes)));
    read.map(|(picture, _)| picture).map_err(|error| Failure::Io {
        what: format!("{} is no picture of a {what}", path.display()),
        source: error.into(),
    })
}

/// The record of a bench alone.
pub fn record_of(bench: &Bench) -> BenchRecord {
    let (light_direction, source_mm) = match bench.light() {
        Light::Parallel { .. } => (bench.light_in_air(), None),
        Light::Point { position_mm, thickness_mm, .. } => {
            let middle_z = if bench.exit_face() == ExitFace::Reflects { 0.0 } else { -thickness_mm };
            ((DVec3::Z * middle_z - position_mm).normalize(), Some(position_mm.to_array()))
        }
    };
    BenchRecord {
        width_mm: bench.block().width_mm,
        height_mm: bench.block().height_mm,
        distance_mm: bench.distance_mm(),
        window_width_mm: bench.window().width_mm,
        window_height_mm: bench.window().height_mm,
        window_centre_mm: bench.window_centre_mm().to_array(),
        receiver_turned: bench.receiver().rotation().to_array(),
        ior: bench.exit_face().ior(),
        mirror: bench.exit_face() == ExitFace::Reflects,
        light_direction: light_direction.to_array(),
        source_mm,
        ..BenchRecord::default()
    }
}

/// The same with the block that stands on it.
pub fn record_with(record: BenchRecord, solid: &Solid) -> BenchRecord {
    let (surface, drawn_mm) = (solid.surface(), DVec2::new(record.width_mm, record.height_mm));
    let heights = surface.heights_mm();
    BenchRecord {
        entry_z_mm: solid.entry_z_mm(),
        relief_mm: surface.relief_mm(),
        thinnest_mm: solid.thinnest_mm(),
        skirt_mm: (0.5 * (surface.extent().as_vec() - drawn_mm)).to_array(),
        nodes: [heights.nx(), heights.ny()],
        corner_radius_mm: surface.contour().radius_mm().to_array(),
        ..record
    }
}

/// The exit face of a record.
pub fn exit_face(record: &BenchRecord) -> ExitFace {
    if record.mirror { ExitFace::Reflects } else { ExitFace::Refracts { ior: record.ior } }
}

/// Which way round every picture lies.
pub(super) const PICTURE_ORIENTATION: &str = "seen on the receiver from the block's side: left is +x, top is +y";

/// What the exit face of a scene does.
pub fn exit_face_of(scene: &Scene) -> ExitFace {
    match scene.optics {
        Optics::Refracts { ior } => ExitFace::Refracts { ior },
        Optics::Reflects => ExitFace::Reflects,
    }
}

/// A block for programs: its solid, the relief of the part of its face that draws, and the nodes
/// of that along x and y.
pub fn block_document(solid: &Solid, relief_mm: f64, (nx, ny): (usize, usize)) -> document::Block {
    let extent = solid.extent();
    document::Block {
        width_mm: extent.width_mm,
        height_mm: extent.height_mm,
        thickness_mm: solid.thickness_mm(),
        relief_mm,
        thinnest_mm: solid.thinnest_mm(),
        nodes: [nx, ny],
    }
}

/// A bench for programs. `entry_z_mm` is the entry face of its block.
pub fn bench_document(scene: &Scene, entry_z_mm: f64) -> document::Bench {
    document::Bench {
        ior: match scene.optics {
            Optics::Refracts { ior } => Some(ior),
            Optics::Reflects => None,
        },
        light: light_in_words(scene, entry_z_mm),
        distance_mm: scene.distance_mm,
        window_mm: scene.window.size_mm.to_array(),
        window_centre_mm: scene.window.centre_mm.to_array(),
    }
}

/// What the block is optically, in words.
pub fn exit_face_in_words(exit_face: ExitFace) -> String {
    match exit_face {
        ExitFace::Refracts { ior } => format!("index {ior}"),
        ExitFace::Reflects => "its exit face a mirror".to_owned(),
    }
}

/// The middle of what light meets first, mm: of the entry face, or of the mirror.
pub fn first_met(scene: &Scene, entry_z_mm: f64) -> DVec3 {
    match scene.optics {
        Optics::Refracts { .. } => DVec3::Z * entry_z_mm,
        Optics::Reflects => DVec3::ZERO,
    }
}

/// The light of a bench in words. `entry_z_mm` is the entry face of its block.
pub fn light_in_words(scene: &Scene, entry_z_mm: f64) -> String {
    let onto = match scene.optics {
        Optics::Refracts { .. } => "the planar entry face",
        Optics::Reflects => "the mirror, from the receiver's side",
    };
    let measured = if scene.profile.is_some() { ", its beam as measured" } else { "" };
    let through = match scene.before.len() {
        0 => String::new(),
        1 => ", through another block".to_owned(),
        others => format!(", through {others} other blocks"),
    };
    let words = match &scene.light {
        verify::Light::Parallel { direction } => {
            let sin = direction.normalize_or_zero().truncate();
            if sin == DVec2::ZERO {
                format!("parallel, straight onto {onto}{measured}")
            } else {
                format!("parallel, {} onto {onto}{measured}", from_the_side(sin.length().asin(), -sin))
            }
        }
        verify::Light::Point { position_mm, emission, .. } => {
            let away = *position_mm - first_met(scene, entry_z_mm);
            let side = away.truncate();
            let place = if side == DVec2::ZERO {
                "straight in front of".to_owned()
            } else {
                format!("{} of", from_the_side((side.length() / away.length()).asin(), side))
            };
            let how = match emission {
                _ if scene.profile.is_some() => measured.to_owned(),
                verify::Emission::Isotropic => ", the same in all directions".to_owned(),
                verify::Emission::Lambertian => ", a small flat emitter (Lambertian)".to_owned(),
                verify::Emission::Gaussian { half_angle } => {
                    format!(", a Gaussian beam, half as bright {:.1} degrees from its axis", half_angle.to_degrees())
                }
                verify::Emission::Table(_) => ", a lamp as its maker measured it (IES)".to_owned(),
            };
            format!("a point {:.1} mm away, {place} the middle of {onto}{how}", away.length())
        }
    };
    words + &through
}

fn from_the_side(angle: f64, towards: DVec2) -> String {
    let clock = (-towards.x).atan2(towards.y).to_degrees().rem_euclid(360.0);
    let side = ["the top", "the right", "the bottom", "the left"][(clock / 90.0).round() as usize % 4];
    format!("{:.1} degrees from {side} (side {clock:.0})", angle.to_degrees())
}

/// The receiver of a bench in words. `highest_mm` is the highest point of the exit face.
pub fn receiver_in_words(bench: &Bench, highest_mm: f64) -> String {
    let (window, centre) = (bench.window(), bench.window_centre_mm());
    let mut words = format!(
        "{} mm from the mean plane of the exit face ({:.2} mm from its highest point), picture {:.2} x {:.2} mm",
        bench.distance_mm(),
        bench.distance_mm() - highest_mm,
        window.width_mm,
        window.height_mm
    );
    let away = |mm: f64, positive: &str, negative: &str| match mm {
        mm if mm.abs() < 0.005 => None,
        mm => Some(format!("{:.2} mm {}", mm.abs(), if mm > 0.0 { positive } else { negative })),
    };
    let places: Vec<String> =
        [away(-centre.x, "to the right", "to the left"), away(centre.y, "up", "down")].into_iter().flatten().collect();
    if !places.is_empty() {
        words += &format!(", its middle {} of the block's axis as seen from the block", places.join(" and "));
    }
    let lean = bench.receiver().axes().z_axis;
    if bench.receiver().is_turned() {
        let back = -lean.truncate();
        let angle = lean.z.clamp(-1.0, 1.0).acos();
        let clock = (-back.x).atan2(back.y).to_degrees().rem_euclid(360.0);
        words += &format!(", leaning by {:.1} degrees (side {clock:.0} is further away)", angle.to_degrees());
    }
    words
}

/// The scene in which a block is looked at, by what its side file says; its pixels are whoever's
/// who looks.
///
/// # Errors
/// A lamp's or beam's file that cannot be read.
pub fn scene_of(record: &BenchRecord, settings: &Settings, before: &Before, host: &dyn Host) -> Result<Scene, Failure> {
    let window = Window {
        size_mm: DVec2::new(record.window_width_mm, record.window_height_mm),
        centre_mm: DVec2::from(record.window_centre_mm),
        nx: 1,
        ny: 1,
    };
    let mut scene = if record.mirror {
        Scene::mirror(record.distance_mm, window)
    } else {
        Scene::new(record.ior, record.distance_mm, window)
    };
    scene.receiver_turned = DVec3::from(record.receiver_turned);
    scene.before.clone_from(&before.standing);
    let direction = DVec3::from(record.light_direction);
    scene.light = match record.source_mm {
        None => verify::Light::parallel(direction),
        Some(source) => {
            let lamp = settings.emission.as_ref().map(|emission| Lamp::open(emission, host)).transpose()?;
            let emission = match lamp {
                None | Some(Lamp::Isotropic) => verify::Emission::Isotropic,
                Some(Lamp::Lambertian) => verify::Emission::Lambertian,
                Some(Lamp::Gaussian(half_angle)) => verify::Emission::Gaussian { half_angle },
                Some(Lamp::Measured(lamp)) => {
                    let table: Vec<(f64, f64)> = lamp.table().collect();
                    verify::Emission::Table(verify::IntensityTable::new(&table).map_err(Failure::refused)?)
                }
            };
            verify::Light::Point { position_mm: DVec3::from(source), emission, axis: Some(direction) }
        }
    };
    if let Some(path) = &settings.beam {
        let picture = open_beam(path, host)?;
        let values = picture.values();
        // Light from the side enters beside the face, where nobody measured: what is nearest stands
        // for it.
        let (nx, ny) = (values.nx(), values.ny());
        let wide =
            Field::from_fn(3 * nx, 3 * ny, |i, j| values[(i.clamp(nx, 2 * nx - 1) - nx, j.clamp(ny, 2 * ny - 1) - ny)]);
        let size_mm = 3.0 * DVec2::new(record.width_mm, record.height_mm);
        let image = Image::new(3 * nx, 3 * ny, wide.into_vec());
        scene.profile = Some(verify::BeamProfile::new(image, size_mm, DVec2::ZERO).map_err(Failure::refused)?);
    }
    Ok(scene)
}

/// The bench of a scene for drawings, with the part of its block's face that draws: where rays run,
/// however much light they carry.
///
/// # Errors
/// Everything that makes no bench.
pub fn drawn_bench(scene: &Scene, drawing: Extent, entry_z_mm: f64) -> Result<Bench, Failure> {
    let build = || {
        let mut bench = Bench::new(drawing, scene.distance_mm, exit_face_of(scene))?;
        if scene.receiver_turned != DVec3::ZERO {
            bench = bench.with_receiver_turned(scene.receiver_turned)?;
        }
        bench = match &scene.light {
            verify::Light::Parallel { direction } => bench.with_light_in_air(*direction)?,
            verify::Light::Point { position_mm, .. } => {
                bench.with_point_source(*position_mm, -entry_z_mm, Intensity::Isotropic)?
            }
        };
        let size = scene.window.size_mm;
        bench.with_window(Extent::new(size.x, size.y), scene.window.centre_mm)
    };
    let bench = build().map_err(Failure::refused)?;
    // Where light does not come through everywhere, rays are drawn as if nothing stood before.
    before::passing(bench.clone(), &scene.before, -entry_z_mm).or(Ok(bench))
}

/// What a user should know of a bench before a block is made for it.
pub fn warnings(bench: &Bench) -> Vec<String> {
    let mut warnings = Vec::new();
    if let (ExitFace::Reflects, Light::Parallel { direction }) = (bench.exit_face(), bench.light()) {
        let comes_from = direction.truncate() * (bench.distance_mm() / direction.z);
        let apart = (comes_from - bench.window_centre_mm()).abs();
        let both = 0.5 * (bench.block().as_vec() + bench.window().as_vec());
        if apart.cmplt(both).all() {
            let least = (0.5 * both.min_element() / bench.distance_mm()).atan().to_degrees();
            warnings.push(format!(
                "the light for this mirror comes through the very place of its picture, where a receiver would shade it; `tilt` {:.0}deg or more keeps them apart",
                least.ceil()
            ));
        }
    }
    warnings
}
