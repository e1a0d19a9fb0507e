//! What is wrong with such a file.

use crate::load::error::LoadError;

pub(super) fn malformed(reason: impl Into<String>) -> LoadError {
    LoadError::malformed("glTF", reason)
}
