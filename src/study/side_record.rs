//! The side file of a block that was made, filled in.

use super::{bench::PICTURE_ORIENTATION, lamp::Lamp};
use crate::{
    export::HeightMap,
    failure::Failure,
    record::{BenchRecord, FrameRecord, PictureRecord, SideFile},
    solid::Solid,
    spec::{Emission, Host, Length, LightName, Settings},
};

/// The side file of a block on its bench, which is recorded with it, without its files. `settings`
/// name the picture, and their paths are those to be written; `sources` are its hashes.
///
/// # Errors
/// A lamp's file that cannot be read.
pub fn side_file(
    settings: &Settings,
    bench: BenchRecord,
    solid: &Solid,
    sources: PictureRecord,
    emission: Option<&Emission>,
    host: &dyn Host,
) -> Result<SideFile, Failure> {
    let is_lamp = settings.light() == LightName::Point && settings.beam.is_none();
    let emission = match is_lamp {
        true => Some(Lamp::read(emission.unwrap_or(&Emission::Isotropic), host)?.record()),
        false => None,
    };
    let design = Settings {
        preset: None,
        size: Some(Length { mm: bench.width_mm }),
        distance: Some(Length { mm: bench.distance_mm }),
        ior: (settings.material.is_none() && !bench.mirror).then_some(bench.ior),
        mirror: bench.mirror.then_some(true),
        light: Some(settings.light()),
        solver: Some(settings.solver.unwrap_or_default()),
        ..settings.clone()
    };
    Ok(SideFile {
        design,
        bench: BenchRecord { emission, picture_orientation: PICTURE_ORIENTATION, ..bench },
        frame: frame(solid),
        work: None,
        picture: sources,
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
