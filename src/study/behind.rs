//! Opens the blocks that settings say stand before another one.

use super::{
    before::{self, Before, ROWS},
    placement::{Expected, Placing, origin_of, place_block},
};
use crate::{
    failure::Failure,
    record::SideFile,
    spec::{BeforeFile, Emission, Host, Settings, conflicts::check_file},
};
use glasswarp_verify::{Row, Standing};
use std::path::Path;

/// Refuses light that is spread, of which nobody knows what becomes of it on its way through other blocks.
///
/// # Errors
/// Such light.
pub(super) fn refuse_spread(settings: &Settings) -> Result<(), Failure> {
    if !settings.has_spread() {
        return Ok(());
    }
    Err(Failure::Usage(
        "light that is spread (`source-size`, `roughness`, `psf`) cannot be corrected for behind another block yet: leave it out, or say `source-size` none".into(),
    ))
}

/// Opens the block that settings name, and what stands before that by its side file.
///
/// # Errors
/// Files that cannot be read or hold no block, blocks without a side file or in light that does not
/// go through several blocks, more blocks than can stand in a row.
pub fn open(settings: &Settings, host: &dyn Host) -> Result<Before, Failure> {
    let Some(first) = &settings.behind else { return Ok(Before::default()) };
    if !ROWS {
        host.solid(&first.path)?;
        return Err(Failure::Usage("no block can stand before another one here (`behind`)".into()));
    }
    // What a preset says of the light, too.
    check_file(settings)?;
    refuse_spread(settings)?;
    let mut before = Before::default();
    let mut next = settings.behind.clone();
    while let Some(BeforeFile { path, gap }) = next.take() {
        if before.standing.len() + 1 == Row::MOST {
            return Err(Failure::Usage(format!(
                "{} stands before {} other blocks, and at most {} stand in a row (`behind`): is one behind itself?",
                path.display(),
                Row::MOST - 1,
                Row::MOST
            )));
        }
        let side_path = path.with_extension("toml");
        let side = SideFile::parse(&host.text(&side_path)?, &side_path)?;
        refuse(&path, &side.design)?;
        before.standing.insert(0, standing(&path, gap.mm, &side, host)?);
        next.clone_from(&side.design.behind);
        before.bench.get_or_insert(side.bench);
    }
    Ok(before)
}

/// The same of a block with a side file; nothing stands before one without.
///
/// # Errors
/// Those of [`open`].
pub fn of_side(side: Option<&SideFile>, host: &dyn Host) -> Result<Before, Failure> {
    side.map_or_else(|| Ok(Before::default()), |side| open(&side.design, host))
}

/// Refuses a block whose light does not go on to another one.
fn refuse(path: &Path, design: &Settings) -> Result<(), Failure> {
    let lamp = design.emission.as_ref().is_some_and(|emission| !matches!(emission, Emission::Isotropic));
    let what = match design {
        _ if design.is_mirror() => "is a mirror",
        _ if design.beam.is_some() => "is made for a measured beam (`beam`)",
        _ if lamp => "is made for a lamp that does not shine the same in all directions (`emission`)",
        _ => return Ok(()),
    };
    Err(Failure::Usage(format!(
        "{} {what}, behind which no other block can be designed yet (`behind`): take parallel light, or a source without `emission`",
        path.display()
    )))
}

/// Opens a block.
fn standing(path: &Path, gap_mm: f64, side: &SideFile, host: &dyn Host) -> Result<Standing, Failure> {
    let mesh = host.solid(path)?;
    let expected = Expected { bench: &side.bench, origin_mm: origin_of(side, path) };
    let (_, block, warnings) = place_block(mesh, &path.display().to_string(), Some(expected), Placing::Righted)?;
    warnings.iter().for_each(|warning| host.warn(warning));
    before::standing(block, side.bench.ior, gap_mm, &path.display().to_string())
}
