//! The side file of a block that was made, filled in.

use super::{
    bench::{PICTURE_ORIENTATION, record_of, record_with},
    design::Plan,
    lamp::Lamp,
};
use crate::{
    export::HeightMap,
    failure::Failure,
    pipeline::DesignedBlock,
    record::{BenchRecord, FrameRecord, PictureRecord, SideFile},
    solid::Solid,
    spec::{Emission, Host, Length, Settings},
};
use std::path::Path;

/// The side file of a design, without its files. `hash_of` is the SHA-256 of a file.
///
/// # Errors
/// Those of [`side_file`].
pub fn side_file_of_design(
    plan: &Plan,
    block: &DesignedBlock,
    hash_of: impl Fn(&Path) -> Result<String, Failure>,
    host: &dyn Host,
) -> Result<SideFile, Failure> {
    let settings = Settings { picture: Some(plan.picture.clone()), solver: Some(plan.solver), ..plan.settings.clone() };
    side_file(&settings, record_with(record_of(&plan.bench), &block.solid), &block.solid, hash_of, host)
}

/// The side file of a block on its bench, which is recorded with it, without its files. `settings`
/// name the picture, and their paths are those to be written; `hash_of` is the SHA-256 of a file.
///
/// # Errors
/// A picture, a beam or a lamp's file that cannot be read.
pub fn side_file(
    settings: &Settings,
    bench: BenchRecord,
    solid: &Solid,
    hash_of: impl Fn(&Path) -> Result<String, Failure>,
    host: &dyn Host,
) -> Result<SideFile, Failure> {
    let picture = PictureRecord {
        sha256: settings.picture.as_deref().map_or_else(|| Ok(String::new()), &hash_of)?,
        beam_sha256: settings.beam.as_deref().map(&hash_of).transpose()?,
        behind_sha256: settings.behind.as_ref().map(|before| hash_of(&before.path)).transpose()?,
    };
    let is_lamp = bench.source_mm.is_some() && settings.beam.is_none();
    let emission = match is_lamp {
        true => Some(Lamp::read(settings.emission.as_ref().unwrap_or(&Emission::Isotropic), host)?.record()),
        false => None,
    };
    let design = Settings {
        preset: None,
        size: Some(Length { mm: bench.width_mm }),
        distance: Some(Length { mm: bench.distance_mm }),
        ior: (settings.material.is_none() && !bench.mirror).then_some(bench.ior),
        mirror: bench.mirror.then_some(true),
        // Behind another block the light is that block's.
        light: settings.behind.is_none().then(|| settings.light()),
        solver: Some(settings.solver.unwrap_or_default()),
        ..settings.clone()
    };
    Ok(SideFile {
        design,
        bench: BenchRecord { emission, picture_orientation: PICTURE_ORIENTATION, ..bench },
        frame: frame(solid),
        work: None,
        picture,
        files: Default::default(),
        height_maps: Default::default(),
    })
}

/// Where the coordinates of a solid's files are counted from, and what stands around its exit face.
fn frame(solid: &Solid) -> FrameRecord {
    let (shape, stock) = (solid.shape(), solid.stock_extent());
    let rim = shape.rim.zip(solid.rim_z_mm());
    FrameRecord {
        origin: shape.origin.name(),
        origin_mm: solid.origin_mm().to_array(),
        stock_width_mm: stock.width_mm,
        stock_height_mm: stock.height_mm,
        stock_thickness_mm: solid.thickness_mm(),
        rim_width_mm: rim.map(|(rim, _)| rim.width_mm),
        rim_z_mm: rim.map(|(_, z)| z),
        mark_mm: rim.and_then(|(rim, _)| rim.mark_mm),
    }
}

/// The numbers that stand in the metadata of a height map, as a side file holds them.
pub fn height_map_entries(map: &HeightMap) -> indexmap::IndexMap<String, toml::Value> {
    let value = |text: String| text.parse().map_or_else(|_| toml::Value::String(text), toml::Value::Float);
    map.entries().into_iter().map(|(name, text)| (name.to_owned(), value(text))).collect()
}
