//! What a command reads and writes, said and examined before it begins.

use crate::{
    atomic,
    error::PlanError,
    guard::{Guard, Wanted, check_owner, guard},
    identity::{Identity, stamp},
};
use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::Arc,
};

/// The files that a command reads, and all that it will write.
#[derive(Clone, Default)]
#[must_use = "a plan holds once it is approved"]
pub struct Plan {
    inputs: Vec<PathBuf>,
    outputs: Vec<PathBuf>,
    force: bool,
    wanted: Option<Wanted>,
}

impl Plan {
    /// A plan that replaces files of others only with `force`. Inputs are never replaced.
    pub fn new(force: bool) -> Self {
        Self { force, ..Self::default() }
    }

    /// Adds a file that is read.
    pub fn reads(mut self, path: impl Into<PathBuf>) -> Self {
        self.inputs.push(path.into());
        self
    }

    /// Adds a file that will be written.
    pub fn writes(mut self, path: impl Into<PathBuf>) -> Self {
        self.outputs.push(path.into());
        self
    }

    /// Refuses to write anything more from when `wanted` says that nobody waits for it any longer.
    pub fn as_long_as(mut self, wanted: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        self.wanted = Some(Arc::new(wanted));
        self
    }

    /// Examines the plan. From then on files are recorded, and files that were not foreseen here
    /// are held to the same rule as they are written.
    ///
    /// # Errors
    /// The first output that must not or cannot be written; nothing has been touched then.
    pub fn approve(self) -> Result<(), PlanError> {
        self.inputs.iter().chain(&self.outputs).try_for_each(|path| check_name(path))?;
        let inputs: Vec<(Identity, PathBuf)> =
            self.inputs.into_iter().map(|path| (Identity::of(&path), path)).collect();
        let mut outputs: Vec<(Identity, &PathBuf)> = Vec::new();
        for path in &self.outputs {
            let identity = Identity::of(path);
            if let Some((_, input)) = inputs.iter().find(|(input, _)| input.is(&identity)) {
                return Err(PlanError::Input { output: path.clone(), input: input.clone() });
            }
            for (other, first) in &outputs {
                let (first, second) = ((*first).clone(), path.clone());
                if other.is(&identity) {
                    return Err(PlanError::Same { first, second });
                }
                if other.differs_in_case_only(&identity) {
                    return Err(PlanError::Case { first, second });
                }
            }
            outputs.push((identity, path));
        }
        let mut examined = HashMap::new();
        for (identity, path) in outputs {
            atomic::probe(path)?;
            if let Some(stamp) = stamp(path) {
                if !self.force {
                    check_owner(path, &identity.path)?;
                }
                examined.insert(identity.path, stamp);
            }
        }
        *guard() = Some(Guard { inputs, force: self.force, examined, wanted: self.wanted });
        Ok(())
    }
}

/// Names go into side files, JSON and pages, and come back from there.
fn check_name(path: &Path) -> Result<(), PlanError> {
    let what = match path.to_str() {
        None => "is no UTF-8",
        Some(text) if text.chars().any(char::is_control) => "holds a line break or another control character",
        Some(_) => return Ok(()),
    };
    Err(PlanError::Name { shown: format!("{path:?}"), what })
}
