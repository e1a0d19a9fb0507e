//! What to order for a block: the material, the sheet, and the piece to saw from it.

use crate::{materials, record::SideFile, solid::Solid, solid::Stock, spec::Settings};
use glam::DVec2;

/// What is added to a piece that is sawn, mm: it is then cut to its size with the face.
const SAW_MM: f64 = 1.0;

/// A piece of a sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct StockOrder {
    /// What it is made of, in words.
    pub material: String,
    /// Of the block, from its entry face to its highest point: what the sheet must have everywhere.
    pub thickness_mm: f64,
    /// What is faced off the top of the sheet.
    pub facing_mm: f64,
    /// The standard sheet; none that is thick enough.
    pub sheet_mm: Option<f64>,
    /// Of the block with what stands around its face.
    pub block_mm: DVec2,
    /// Of the piece to saw, in whole millimetres.
    pub sawn_mm: DVec2,
}

impl StockOrder {
    /// For a block that was designed.
    pub fn of_design(solid: &Solid, settings: &Settings) -> Self {
        Self::new(solid.stock_extent().as_vec(), solid.thickness_mm(), settings)
    }

    /// For a block from a file, by its side file.
    pub fn of_side(side: &SideFile) -> Self {
        let frame = &side.frame;
        Self::new(DVec2::new(frame.stock_width_mm, frame.stock_height_mm), frame.stock_thickness_mm, &side.design)
    }

    fn new(block_mm: DVec2, thickness_mm: f64, settings: &Settings) -> Self {
        let facing_mm = settings.facing.map_or(Stock::FACING_MM, |length| length.mm);
        Self {
            material: material_in_words(settings),
            thickness_mm,
            facing_mm,
            sheet_mm: Stock::sheet_for(thickness_mm, facing_mm),
            block_mm,
            // Whole millimetres must not jump up for a rounding error.
            sawn_mm: (block_mm + SAW_MM - 1e-6).ceil(),
        }
    }

    /// The sheet, or what there is instead.
    pub fn sheet_in_words(&self) -> String {
        match self.sheet_mm {
            Some(sheet) => format!("{sheet} mm sheet"),
            None => format!("a slab of at least {:.1} mm: no standard sheet is so thick", self.thickness_mm),
        }
    }

    /// The same for a drawing.
    pub fn notes(&self) -> Vec<String> {
        vec![
            format!("order: {}, sawn {} × {}", self.sheet_in_words(), self.sawn_mm.x, self.sawn_mm.y),
            format!("face the sheet off to {:.3} first", self.thickness_mm),
        ]
    }

    /// What to order, in a line.
    pub fn in_words(&self) -> String {
        format!(
            "{}, {}, sawn to {} x {} mm; {:.3} mm thick everywhere at least",
            self.material,
            self.sheet_in_words(),
            self.sawn_mm.x,
            self.sawn_mm.y,
            self.thickness_mm
        )
    }
}

/// What a block is made of.
fn material_in_words(settings: &Settings) -> String {
    if settings.is_mirror() {
        return "any sheet that takes a polish and a mirror's coat".into();
    }
    let known = settings.material.as_deref().and_then(materials::by_name);
    match (known, settings.ior) {
        (Some(material), _) => {
            let common = material.description.split(',').next().unwrap_or(material.name);
            format!("{common} ({}, index {})", material.name, material.ior)
        }
        (None, Some(ior)) => format!("a material of index {ior}"),
        (None, None) => "a material of known index".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::Length;

    #[test]
    fn the_sheet_is_thicker_than_the_block_and_the_piece_is_sawn_in_whole_millimetres() {
        let settings = Settings { material: Some("pmma".into()), ..Settings::default() };
        let order = StockOrder::new(DVec2::new(155.859, 100.0), 11.5, &settings);
        assert_eq!((order.sheet_mm, order.sawn_mm), (Some(12.0), DVec2::new(157.0, 101.0)));
        assert!(order.in_words().contains("cast acrylic (pmma, index 1.49), 12 mm sheet, sawn to 157 x 101 mm"));
        let settings = Settings { facing: Some(Length { mm: 0.0 }), ior: Some(1.5), ..Settings::default() };
        assert_eq!(StockOrder::new(DVec2::ONE, 12.0, &settings).sheet_mm, Some(12.0));
        let slab = StockOrder::new(DVec2::ONE, 250.0, &settings);
        assert!(slab.sheet_mm.is_none() && slab.in_words().contains("at least 250.0 mm"));
    }
}
