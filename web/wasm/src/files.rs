//! The files of a block, as bytes.

use crate::made::Made;
use glasswarp::{
    export::{Format, HeightMap, HeightMapFormat, choose_net, write_step},
    failure::Failure,
    grid::Field,
    spec::Host,
    study::side_record::{height_map_entries, side_file_of_design},
};
use png::{BitDepth, ColorType, Encoder, EncodingError, ScaledFloat};
use sha2::{Digest, Sha256};
use std::{collections::BTreeMap, path::Path};

/// The files that were made of a block, by name, and their hashes.
pub(crate) type Hashes = BTreeMap<String, String>;

/// What is written of a block.
pub(crate) enum Kind {
    Solid(Format),
    Heights(HeightMapFormat),
}

impl Kind {
    /// The kind that a file's extension names.
    ///
    /// # Errors
    /// An extension that is none of a block.
    pub(crate) fn of(name: &str) -> Result<Self, Failure> {
        let path = Path::new(name);
        match HeightMapFormat::from_path(path) {
            Ok(format) => Ok(Self::Heights(format)),
            Err(_) => Format::from_path(path).map(Self::Solid).map_err(Failure::refused),
        }
    }
}

/// Light as a picture that says that it is linear: grey, 16 bits. `light` in picture order.
///
/// # Errors
/// None: memory is all that it writes to.
pub(crate) fn light_png(light: &Field<f64>) -> Result<Vec<u8>, Failure> {
    let (_, brightest) = light.min_max();
    let written = |bytes: &mut Vec<u8>| -> Result<(), EncodingError> {
        let mut encoder = Encoder::new(bytes, light.nx() as u32, light.ny() as u32);
        encoder.set_color(ColorType::Grayscale);
        encoder.set_depth(BitDepth::Sixteen);
        encoder.set_source_gamma(ScaledFloat::new(1.0));
        let level = |&value: &f64| (65535.0 * value / brightest).round() as u16;
        let levels: Vec<u8> = light.as_slice().iter().flat_map(|value| level(value).to_be_bytes()).collect();
        encoder.write_header()?.write_image_data(&levels)
    };
    let mut bytes = Vec::new();
    written(&mut bytes).map_err(|error| Failure::writing(std::io::Error::other(error)))?;
    Ok(bytes)
}

pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Made {
    /// A file of this name.
    ///
    /// # Errors
    /// What the format cannot hold.
    pub(crate) fn file(&self, name: &str) -> Result<Vec<u8>, Failure> {
        let (solid, design) = (&self.block.solid, self.plan.export_design());
        let mut bytes = Vec::new();
        match Kind::of(name)? {
            Kind::Heights(format) => {
                bytes = HeightMap::of(solid).to_bytes(format).map_err(Failure::writing)?;
            }
            Kind::Solid(Format::Step) => {
                let fit = choose_net(solid.surface(), self.plan.step, &design).map_err(Failure::refused)?;
                write_step(&mut bytes, solid, &fit.net, None, &design).map_err(Failure::writing)?;
            }
            Kind::Solid(format) => {
                format.check(solid).map_err(Failure::exporting)?;
                format.write(&mut bytes, solid, &design).map_err(Failure::writing)?;
            }
        }
        Ok(bytes)
    }

    /// The side file, with these files.
    ///
    /// # Errors
    /// A picture or lamp that is gone.
    pub(crate) fn side_file(&self, name: &str, files: &Hashes, host: &dyn Host) -> Result<String, Failure> {
        let Self { plan, block, .. } = self;
        let hash_of = |path: &Path| host.bytes(path).map(|bytes| sha256(&bytes));
        let mut side = side_file_of_design(plan, block, hash_of, host)?;
        for (file, hash) in files {
            if let Ok(Kind::Heights(_)) = Kind::of(file) {
                side.height_maps.insert(file.clone(), height_map_entries(&HeightMap::of(&block.solid)));
            }
            side.files.insert(file.clone(), hash.clone());
        }
        side.to_text(name)
    }
}
