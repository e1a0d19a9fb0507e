//! The settings that help against the errors of stages, which know of none.

use crate::{
    bench::BenchError,
    export::{ExportError, StepError},
    irradiance::{CausticMeshError, FramingError, PictureError},
    pipeline::DesignError,
    solid::SolidError,
    solver::SolveError,
};
use std::{error::Error, fmt};

/// An error in words, with the setting that helps.
pub(super) fn in_words(error: &(dyn Error + 'static)) -> String {
    match setting_of(error) {
        Some(setting) => format!("{error} ({setting})"),
        None => error.to_string(),
    }
}

/// An error of the library with the setting that helps.
#[derive(Debug)]
pub(super) struct Advised {
    error: Box<dyn Error + Send + Sync>,
    setting: String,
}

impl Advised {
    /// The error as it is, or with the setting that helps, if there is one.
    pub(super) fn by_setting(error: Box<dyn Error + Send + Sync>) -> Box<dyn Error + Send + Sync> {
        match setting_of(&*error) {
            Some(setting) => Box::new(Self { error, setting }),
            None => error,
        }
    }
}

impl fmt::Display for Advised {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.error, self.setting)
    }
}

impl Error for Advised {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.error.source()
    }
}

fn setting_of(error: &(dyn Error + 'static)) -> Option<String> {
    if let Some(error) = error.downcast_ref::<DesignError>() {
        return match error {
            DesignError::Nodes { .. } => Some("`nodes`".into()),
            DesignError::Solve(error) => setting_of(error),
            DesignError::Solid(error) => setting_of(error),
            DesignError::Trapped { .. } => Some("`distance`, `offset`".into()),
            _ => None,
        };
    }
    let setting = if let Some(error) = error.downcast_ref::<SolveError>() {
        match error {
            SolveError::TooDark { .. } => "`offset` 0.1",
            SolveError::Unsupported { able, .. } => return Some(format!("`solver` {able}")),
            _ => return None,
        }
    } else if let Some(error) = error.downcast_ref::<SolidError>() {
        match error {
            SolidError::TooManyNodes { .. } | SolidError::TooFine { .. } => "`nodes`",
            SolidError::Skirt { .. } => "`skirt`",
            SolidError::TooThin { enough_mm, .. } => return Some(format!("`thickness` {enough_mm}mm")),
            SolidError::TooDeep { .. } => "`thickness`",
            SolidError::RimWidth { .. } | SolidError::RimHeight { .. } => "`rim` WIDTH,HEIGHT",
            SolidError::Mark { .. } => "`mark`",
            _ => return None,
        }
    } else if let Some(error) = error.downcast_ref::<BenchError>() {
        match error {
            BenchError::Corners { .. } => "`outline` rounded:RADIUS, `outline` circle",
            _ => return None,
        }
    } else if let Some(error) = error.downcast_ref::<ExportError>() {
        match error {
            ExportError::TooManyForGlb { .. } => "`nodes`",
            _ => return None,
        }
    } else if let Some(error) = error.downcast_ref::<StepError>() {
        match error {
            StepError::Tolerance { .. } => "`step-tolerance`",
        }
    } else if let Some(error) = error.downcast_ref::<CausticMeshError>() {
        match error {
            CausticMeshError::BeyondWindow { .. } => "`window`",
            _ => return None,
        }
    } else if let Some(error) = error.downcast_ref::<FramingError>() {
        match error {
            FramingError::Margin { .. } => "`margin`",
            FramingError::Soft(_) => "`vignette` circle:SHARE",
        }
    } else {
        match error.downcast_ref::<PictureError>()? {
            PictureError::Coded { .. } => "`transfer`",
            PictureError::Layers { .. }
            | PictureError::NoLayer { .. }
            | PictureError::NoColour { .. }
            | PictureError::NotLayered { .. } => "`layer`",
            PictureError::Crop { x, y, width, height, .. } => {
                return Some(format!("`crop` {x},{y},{width},{height}"));
            }
            _ => return None,
        }
    };
    Some(setting.into())
}
