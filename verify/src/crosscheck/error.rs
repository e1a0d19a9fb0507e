//! Why a cross-check came to no result.

use super::renderer::Renderer;
use crate::scene::SceneError;
use glasswarp_files::{PlanError, WriteError};
use std::path::PathBuf;

/// Why a cross-check came to no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CrosscheckError {
    /// The scene cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A file in the folder is not this program's to replace.
    #[error(transparent)]
    Owned(#[from] PlanError),
    /// The program is not there.
    #[error("{} is not installed: '{program}' or its package was not found ({}); the scene is in {}", renderer.name(), renderer.remedy(), folder.display())]
    NotInstalled {
        /// Which renderer.
        renderer: Renderer,
        /// What was looked for.
        program: String,
        /// Where the scene lies, ready to be run elsewhere.
        folder: PathBuf,
    },
    /// The program was started, and failed.
    #[error("{} failed ({what}); its last words, of which {} has more:\n{tail}", renderer.name(), log.display())]
    Failed {
        /// Which renderer.
        renderer: Renderer,
        /// Exit status, or what is missing.
        what: String,
        /// Everything it printed.
        log: PathBuf,
        /// The end of that.
        tail: String,
    },
    /// What was rendered cannot be used.
    #[error("{}: {reason}", path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A renderer whose rays cannot be aimed.
    #[error("{} cannot be used in map mode: its rays pass anywhere within their pixels; look at the caustic (--mode image)", .0.name())]
    NoMap(Renderer),
    /// No light to compare.
    #[error("no light arrives on the receiver, so there is nothing to compare")]
    Dark,
    /// A bench that cannot be.
    #[error(transparent)]
    Scene(#[from] SceneError),
}
