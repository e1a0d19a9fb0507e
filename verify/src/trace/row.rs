//! Blocks in a row.

use super::stand::Stand;
use crate::{
    block::Block,
    scene::{Displacement, Scene, SceneError, Standing, in_range},
};
use glam::{DMat3, DVec3};

/// Blocks one behind the other, in the order in which light meets them: it leaves one by its exit
/// face, goes on through air, and enters the next by its entry face. Each is told in its own frame.
///
/// The bench of a row is told in the frame of its last block: the distance of the receiver counts
/// from there. [`Scene::turned`] turns all of the row about its origin.
///
/// ```
/// use glam::DVec2;
/// use glasswarp_verify::{Block, Row, Scene, Tracer, Window, beams};
///
/// let plate = Block::from_heights(DVec2::splat(40.0), -10.0, (5, 5), vec![0.0; 25])?;
/// let window = Window { size_mm: DVec2::splat(40.0), centre_mm: DVec2::ZERO, nx: 16, ny: 16 };
/// // Two plates, 30 mm of air between them.
/// let row = Row::of(&plate).then(30.0, &plate);
/// let seen = beams(&Tracer::for_row(&row, &Scene::new(1.49, 200.0, window))?, 64, 64);
/// assert!((seen.flux.window - 1.0).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Row<'a> {
    blocks: Vec<RowBlock<'a>>,
    /// The air behind every block but the last, mm.
    gaps_mm: Vec<f64>,
}

/// A block in a row.
#[derive(Clone, Copy, Debug)]
pub struct RowBlock<'a> {
    /// The block, in its own frame.
    pub block: &'a Block,
    /// Its refractive index; that of the [bench](crate::Optics::Refracts) unless given.
    pub ior: Option<f64>,
    /// How it stands beside its place, as seen from its own frame; all others stay where they are.
    pub displaced: Displacement,
}

impl<'a> From<&'a Block> for RowBlock<'a> {
    fn from(block: &'a Block) -> Self {
        Self { block, ior: None, displaced: Displacement::default() }
    }
}

impl<'a> From<&'a Standing> for RowBlock<'a> {
    fn from(standing: &'a Standing) -> Self {
        Self { block: &standing.block, ior: Some(standing.ior), displaced: standing.displaced }
    }
}

impl<'a> Row<'a> {
    /// Most blocks in a row.
    pub const MOST: usize = 16;

    /// The block that light meets first.
    pub fn of(first: impl Into<RowBlock<'a>>) -> Self {
        Self { blocks: vec![first.into()], gaps_mm: Vec::new() }
    }

    /// A block, and what stands before it.
    pub fn behind(before: &'a [Standing], last: &'a Block) -> Self {
        let gaps_mm = before.iter().map(|standing| standing.gap_mm).collect();
        let blocks = before.iter().map(RowBlock::from).chain([RowBlock::from(last)]).collect();
        Self { blocks, gaps_mm }
    }

    /// The same row with another block behind it: `gap_mm` of air from the mean exit plane of the
    /// block before to the entry face of this one (to its mean, if it is not planar), both where they
    /// belong.
    #[must_use]
    pub fn then(mut self, gap_mm: f64, next: impl Into<RowBlock<'a>>) -> Self {
        self.gaps_mm.push(gap_mm);
        self.blocks.push(next.into());
        self
    }

    /// The same row of other glass: the index of every block, counted from 0.
    #[must_use]
    pub fn with_iors(&self, ior: impl Fn(usize) -> f64) -> Self {
        let mut row = self.clone();
        row.blocks.iter_mut().enumerate().for_each(|(k, of)| of.ior = Some(ior(k)));
        row
    }

    /// The blocks, as light meets them.
    pub fn blocks(&self) -> &[RowBlock<'a>] {
        &self.blocks
    }

    /// Where the mean exit plane of every block belongs, mm, in the frame of the last.
    pub fn places_mm(&self) -> Vec<f64> {
        let mut places = vec![0.0; self.blocks.len()];
        for k in (0..self.gaps_mm.len()).rev() {
            places[k] = places[k + 1] + self.blocks[k + 1].block.entry_z_mm() - self.gaps_mm[k];
        }
        places
    }

    /// How every block stands in the frame of the row.
    pub(super) fn stands(&self) -> Vec<Stand> {
        let place = |(of, z): (&RowBlock<'_>, f64)| Stand {
            turn: Scene::rotation(of.displaced.turned).unwrap_or(DMat3::IDENTITY),
            shift: of.displaced.shift_mm + DVec3::new(0.0, 0.0, z),
        };
        self.blocks.iter().zip(self.places_mm()).map(place).collect()
    }

    /// The corners of what stands where this says, mm.
    pub(super) fn corners(&self, stands: &[Stand]) -> Vec<[DVec3; 8]> {
        let of_block = |(of, stand): (&RowBlock<'_>, &Stand)| {
            let (lower, upper) = bounds(of.block);
            Scene::corners(lower, upper).map(|corner| stand.point(corner))
        };
        self.blocks.iter().zip(stands).map(of_block).collect()
    }

    /// Refuses blocks that no bench holds so, and those that meet.
    pub(super) fn validate(&self) -> Result<(), SceneError> {
        in_range("the number of blocks in a row", self.blocks.len() as f64, 1.0, Self::MOST as f64)?;
        for gap_mm in &self.gaps_mm {
            in_range("the gap between two blocks (mm)", *gap_mm, 0.0, 1e6)?;
        }
        for of in &self.blocks {
            let Displacement { shift_mm, turned } = of.displaced;
            in_range("the displacement of a block (mm)", shift_mm.length(), 0.0, 1e6)?;
            in_range("the angle by which a block is displaced (radians)", turned.length(), 0.0, 0.5)?;
            if let Some(ior) = of.ior {
                in_range("the refractive index of a block", ior, 1.000_001, 10.0)?;
            }
        }
        let spans: Vec<(f64, f64)> = self.corners(&self.stands()).iter().map(|corners| span(corners)).collect();
        for (k, pair) in spans.windows(2).enumerate() {
            let by_mm = pair[0].1 - pair[1].0;
            if by_mm.is_nan() || by_mm >= 0.0 {
                return Err(SceneError::Meet { first: k + 1, by_mm, least_mm: self.gaps_mm[k] + by_mm });
            }
        }
        Ok(())
    }
}

/// Least and greatest z of some points.
pub(super) fn span(corners: &[DVec3]) -> (f64, f64) {
    corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| (lo.min(p.z), hi.max(p.z)))
}

/// Least and greatest corner of a block, mm.
fn bounds(block: &Block) -> (DVec3, DVec3) {
    let (lower, upper) = block.entry_face_mm();
    (lower.extend(block.lowest_mm()), upper.extend(block.highest_mm()))
}
