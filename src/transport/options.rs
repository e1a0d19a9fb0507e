//! What a caller may choose.

use crate::{grid::Contour, irradiance::TargetIrradiance, surface::Finish};

/// How much work a solution is worth. Times are those of a 512 pixel photograph on two cores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// One receiver cell per pixel and no closed loop: a few tenths of a second, for looking.
    Draft,
    /// Two receiver cells per pixel and two rounds of the closed loop, four on a smooth outline,
    /// six where the picture starts far off, as white lines on black do: seconds.
    #[default]
    Normal,
    /// As normal with up to five rounds: what the grid can give, in a few times the time.
    Fine,
}

/// The least light that a black part of the picture gets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum BlackFloor {
    /// 0.005 of the mean, or 0.002 with [`Quality::Fine`].
    #[default]
    Automatic,
    /// This share of the mean irradiance.
    Relative(f64),
}

/// Options of the [transport solver](super::Transport).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TransportOptions {
    /// How much work is done where the other options leave it open.
    pub quality: Quality,
    /// Receiver cells per pixel along each axis; by quality unless given.
    pub cells_per_pixel: Option<usize>,
    /// Most rounds of the closed loop; by quality unless given.
    pub rounds: Option<usize>,
    /// The least light that a black part of the picture gets.
    pub floor: BlackFloor,
    /// How the face is cut and polished: it is made such that its light is right after the work.
    pub finish: Option<Finish>,
    /// The manufacturable variant: no beam folded, and no radius of curvature below this, mm. What
    /// that costs in accuracy is stated among the warnings.
    pub min_radius_mm: Option<f64>,
}

/// Least receiver cells along the shorter side of the finest grid, so that tiny pictures have edges
/// too.
const LEAST: usize = 64;
/// Most receiver cells along a side: 16 million nodes take about 3 GB.
const MOST: usize = 4096;

/// Options that no solver can work with.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TransportOptionsError {
    /// Too few or too many receiver cells.
    #[error("{0} receiver cells per pixel; there must be between 1 and {limit}", limit = TransportOptions::MOST_CELLS_PER_PIXEL)]
    CellsPerPixel(usize),
    /// Too many rounds.
    #[error("{0} rounds of the closed loop; at most {limit} are of any use", limit = TransportOptions::MOST_ROUNDS)]
    Rounds(usize),
    /// An option for one free face, given to a solver for two.
    #[error("a finish and a least radius of curvature are designed for with one free face only: leave them out")]
    OneFace,
    /// A floor that leaves no black or no light.
    #[error("a floor of black of {0} of the mean; it must lie between {least} and {most}", least = TransportOptions::FLOOR_LIMITS.0, most = TransportOptions::FLOOR_LIMITS.1)]
    Floor(f64),
    /// A radius that is none.
    #[error("a least radius of curvature of {0} mm; it must lie between {least} mm and {most} mm", least = TransportOptions::RADIUS_LIMITS_MM.0, most = TransportOptions::RADIUS_LIMITS_MM.1)]
    Radius(f64),
}

impl TransportOptions {
    /// Greatest number of receiver cells per pixel.
    pub const MOST_CELLS_PER_PIXEL: usize = 16;
    /// Greatest number of rounds.
    pub const MOST_ROUNDS: usize = 50;
    /// Accepted floors of black, relative to the mean.
    pub const FLOOR_LIMITS: (f64, f64) = (1e-4, 0.5);

    /// Accepted least radii of curvature, mm.
    pub const RADIUS_LIMITS_MM: (f64, f64) = (0.001, 1000.0);

    /// The defaults of a quality.
    pub fn new(quality: Quality) -> Self {
        Self { quality, ..Self::default() }
    }

    /// The same with so many receiver cells per pixel along each axis.
    #[must_use]
    pub fn with_cells_per_pixel(self, cells: usize) -> Self {
        Self { cells_per_pixel: Some(cells), ..self }
    }

    /// The same with so many rounds of the closed loop at most.
    #[must_use]
    pub fn with_rounds(self, rounds: usize) -> Self {
        Self { rounds: Some(rounds), ..self }
    }

    /// The same with another least light of black parts.
    #[must_use]
    pub fn with_floor(self, floor: BlackFloor) -> Self {
        Self { floor, ..self }
    }

    /// The same for a face that will be cut and polished.
    #[must_use]
    pub fn with_finish(self, finish: Finish) -> Self {
        Self { finish: Some(finish), ..self }
    }

    /// The same without folds and without radii of curvature below this, mm.
    #[must_use]
    pub fn with_min_radius_mm(self, radius_mm: f64) -> Self {
        Self { min_radius_mm: Some(radius_mm), ..self }
    }

    /// Refuses what cannot work.
    ///
    /// # Errors
    /// A number outside of its limits.
    pub(super) fn validate(&self) -> Result<(), TransportOptionsError> {
        if let Some(cells) = self.cells_per_pixel.filter(|n| !(1..=Self::MOST_CELLS_PER_PIXEL).contains(n)) {
            return Err(TransportOptionsError::CellsPerPixel(cells));
        }
        if let Some(rounds) = self.rounds.filter(|&n| n > Self::MOST_ROUNDS) {
            return Err(TransportOptionsError::Rounds(rounds));
        }
        let (least, most) = Self::RADIUS_LIMITS_MM;
        if let Some(radius) = self.min_radius_mm.filter(|radius| !(least..=most).contains(radius)) {
            return Err(TransportOptionsError::Radius(radius));
        }
        match self.floor {
            BlackFloor::Relative(floor) if !(Self::FLOOR_LIMITS.0..=Self::FLOOR_LIMITS.1).contains(&floor) => {
                Err(TransportOptionsError::Floor(floor))
            }
            _ => Ok(()),
        }
    }

    /// Cells of the finest receiver grid on which the solver works for a picture of so many pixels
    /// and a face of so many nodes, along x and y: what its memory and its time are made of.
    pub fn receiver_cells(&self, pixels: (usize, usize), nodes: (usize, usize)) -> (usize, usize) {
        let (cells, per_cell) = self.divide(pixels, nodes);
        (cells.0 * per_cell.0, cells.1 * per_cell.1)
    }

    /// How the picture is divided on the finest grid: its cells, and receiver cells per cell.
    pub(super) fn divide(&self, pixels: (usize, usize), nodes: (usize, usize)) -> ((usize, usize), (usize, usize)) {
        let axis = |pixels: usize, nodes: usize| pixels.min(nodes.saturating_sub(1).max(TargetIrradiance::LEAST_CELLS));
        let cells = (axis(pixels.0, nodes.0).max(1), axis(pixels.1, nodes.1).max(1));
        let least = LEAST.div_ceil(cells.0.min(cells.1)).max(self.per_cell());
        let per_cell = |n: usize| least.min((MOST / n).max(1));
        (cells, (per_cell(cells.0), per_cell(cells.1)))
    }

    /// Rounds of the closed loop. A smooth outline wants more: where it squeezes the map, they must
    /// be gentle.
    pub(super) fn rounds(&self, outline: &Contour) -> usize {
        self.rounds.unwrap_or(match (self.quality, outline.is_rectangle()) {
            (Quality::Draft, _) => 0,
            (Quality::Normal, true) => 2,
            (Quality::Normal, false) => 4,
            (Quality::Fine, _) => 5,
        })
    }

    /// Rounds for pictures that start far off, as white lines on black do.
    pub(super) fn hard_rounds(&self) -> usize {
        match (self.rounds, self.quality) {
            (Some(rounds), _) => rounds,
            (None, Quality::Draft) => 0,
            (None, Quality::Normal | Quality::Fine) => 6,
        }
    }

    /// Beams per lens cell along each axis of the closed loop's view.
    pub(super) fn beams(&self) -> usize {
        match self.quality {
            Quality::Draft => 1,
            Quality::Normal => 2,
            Quality::Fine => 3,
        }
    }

    pub(super) fn per_cell(&self) -> usize {
        self.cells_per_pixel.unwrap_or(match self.quality {
            Quality::Draft => 1,
            Quality::Normal | Quality::Fine => 2,
        })
    }

    pub(super) fn floor(&self) -> f64 {
        match (self.floor, self.quality) {
            (BlackFloor::Relative(floor), _) => floor,
            (BlackFloor::Automatic, Quality::Fine) => 0.002,
            (BlackFloor::Automatic, Quality::Draft | Quality::Normal) => 0.005,
        }
    }
}
