//! What a caller may choose.

use crate::{grid::Contour, surface::Polish};

/// How much work a solution is worth. Times are those of a 512 pixel photograph on two cores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// One receiver cell per pixel and no closed loop: a few tenths of a second, for looking.
    Draft,
    /// Two receiver cells per pixel and two rounds of the closed loop, four on a smooth outline, six where the picture starts far off, as white lines on
    /// black do: seconds.
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
pub struct Options {
    /// How much work is done where the other options leave it open.
    pub quality: Quality,
    /// Receiver cells per pixel along each axis; by quality unless given.
    pub cells_per_pixel: Option<usize>,
    /// Most rounds of the closed loop; by quality unless given.
    pub rounds: Option<usize>,
    /// The least light that a black part of the picture gets.
    pub floor: BlackFloor,
    /// The polish that follows the cutting: the face is made such that its light is right after it.
    pub finish: Option<Polish>,
    /// The manufacturable variant: no beam folded, and no radius of curvature below this, mm. What that costs in accuracy
    /// is stated among the warnings.
    pub min_radius_mm: Option<f64>,
}

/// Options that no solver can work with.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OptionsError {
    /// Too few or too many receiver cells.
    #[error("{0} receiver cells per pixel; there must be between 1 and {limit}", limit = Options::MOST_CELLS_PER_PIXEL)]
    CellsPerPixel(usize),
    /// Too many rounds.
    #[error("{0} rounds of the closed loop; at most {limit} are of any use", limit = Options::MOST_ROUNDS)]
    Rounds(usize),
    /// A floor that leaves no black or no light.
    #[error("a floor of black of {0} of the mean; it must lie between {least} and {most}", least = Options::FLOOR_LIMITS.0, most = Options::FLOOR_LIMITS.1)]
    Floor(f64),
    /// A radius that is none.
    #[error("a least radius of curvature of {0} mm; it must lie between {least} mm and {most} mm", least = Options::RADIUS_LIMITS_MM.0, most = Options::RADIUS_LIMITS_MM.1)]
    Radius(f64),
}

impl Options {
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

    /// Refuses what cannot work.
    ///
    /// # Errors
    /// A number outside of its limits.
    pub fn validate(&self) -> Result<(), OptionsError> {
        if let Some(cells) = self.cells_per_pixel.filter(|n| !(1..=Self::MOST_CELLS_PER_PIXEL).contains(n)) {
            return Err(OptionsError::CellsPerPixel(cells));
        }
        if let Some(rounds) = self.rounds.filter(|&n| n > Self::MOST_ROUNDS) {
            return Err(OptionsError::Rounds(rounds));
        }
        let (least, most) = Self::RADIUS_LIMITS_MM;
        if let Some(radius) = self.min_radius_mm.filter(|radius| !(least..=most).contains(radius)) {
            return Err(OptionsError::Radius(radius));
        }
        match self.floor {
            BlackFloor::Relative(floor) if !(Self::FLOOR_LIMITS.0..=Self::FLOOR_LIMITS.1).contains(&floor) => {
                Err(OptionsError::Floor(floor))
            }
            _ => Ok(()),
        }
    }

    /// Rounds of the closed loop. A smooth outline wants more: where it squeezes the map, they must be gentle.
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
