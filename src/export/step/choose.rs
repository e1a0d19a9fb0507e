//! How dense the control net must be.

use crate::{
    bench::ExitFace,
    export::Design,
    surface::{ControlNet, FitError, HeightField},
};

/// How near the exit face of a STEP file must be to the height field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum StepTolerance {
    /// As near as the picture needs: the brightness on the receiver changes by about a tenth of a
    /// percent of its mean, rms.
    #[default]
    Picture,
    /// Nowhere further away than this, um.
    Micrometres(f64),
}

/// Why there is no net.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// A tolerance that cannot be met, or bounds nothing.
    #[error(
        "the tolerance of the STEP face is {micrometres} um; it must lie between {least} um, the resolution of the file, and {greatest} um"
    )]
    Tolerance {
        /// What was asked for, um.
        micrometres: f64,
        /// Least accepted value, um.
        least: f64,
        /// Greatest accepted value, um.
        greatest: f64,
    },
}

/// A net and how far it is from the height field.
#[derive(Clone, Debug)]
pub struct NetFit {
    /// The net.
    pub net: ControlNet,
    /// Its distance.
    pub error: FitError,
}

impl StepTolerance {
    /// Accepted tolerances, um. Coordinates have steps of 1e-6 um.
    pub const LIMITS_UM: (f64, f64) = (1e-5, 1000.0);

    /// Refuses tolerances outside of the limits.
    ///
    /// # Errors
    /// [`StepError::Tolerance`].
    pub fn check(self) -> Result<(), StepError> {
        let (least, greatest) = Self::LIMITS_UM;
        match self {
            Self::Micrometres(micrometres) if !(least..=greatest).contains(&micrometres) => {
                Err(StepError::Tolerance { micrometres, least, greatest })
            }
            _ => Ok(()),
        }
    }

    fn is_met(self, error: &FitError, design: &Design) -> bool {
        match self {
            Self::Picture => light_moved(error, design) <= LIGHT,
            Self::Micrometres(most) => 1e3 * error.greatest_mm <= most,
        }
    }
}

/// The change of brightness, relative to the mean, that is allowed for the sake of a smaller file
/// (rms over the face, to first order). On the wall it is more where the light is bright, and less
/// where pixels average over it: between a sixth and twice of this was measured.
const LIGHT: f64 = 1e-3;

/// The relative change of the brightness on the receiver, rms, to first order where the picture is
/// of mean brightness: light is deflected by `n - 1` times the slope, and what spreads or gathers
/// it is the divergence of that.
fn light_moved(error: &FitError, design: &Design) -> f64 {
    let bend = match design.exit_face {
        ExitFace::Refracts { ior } => ior - 1.0,
        ExitFace::Reflects => 2.0,
    };
    bend * design.distance_mm * error.laplacian_rms
}

/// Nodes for a control point, per side, from coarse to fine; beyond stands the net of all nodes.
const RATIOS: [f64; 8] = [16.0, 12.0, 8.0, 6.0, 4.0, 3.0, 2.0, 1.5];

/// The coarsest net of a few that is near enough; the interpolating one, which is the height field
/// itself, if no other is. Beyond the outline it is [level](HeightField::levelled).
///
/// # Errors
/// A tolerance out of range.
pub fn choose_net(surface: &HeightField, tolerance: StepTolerance, design: &Design) -> Result<NetFit, StepError> {
    tolerance.check()?;
    let level = surface.levelled();
    let nodes = level.heights_mm();
    let points = |n: usize, ratio: f64| (((n - 1) as f64 / ratio).ceil() as usize + 3).clamp(ControlNet::LEAST, n);
    let fit = |ratio: f64| {
        let net = ControlNet::fitted(&level, (points(nodes.nx(), ratio), points(nodes.ny(), ratio)));
        NetFit { error: net.error(surface), net }
    };
    // The error falls with the ratio: halve the range.
    let (mut coarse, mut fine) = (0, RATIOS.len());
    let mut best = None;
    while coarse < fine {
        let middle = usize::midpoint(coarse, fine);
        let tried = fit(RATIOS[middle]);
        if tolerance.is_met(&tried.error, design) {
            best = Some(tried);
            fine = middle;
        } else {
            coarse = middle + 1;
        }
    }
    Ok(best.unwrap_or_else(|| {
        let net = ControlNet::interpolating(&level);
        NetFit { error: net.error(surface), net }
    }))
}
