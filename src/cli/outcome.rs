//! How a failure is told and what it exits with, and the limits that gates keep.

use crate::{failure::Failure, record::document::FaultKind};
use std::{collections::BTreeSet, sync::OnceLock};

/// A limit of an error, as a person writes it: one that could hold.
pub(crate) fn error_limit(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(limit) if limit.is_finite() && limit >= 0.0 => Ok(limit),
        Ok(limit) => Err(format!("a limit of {limit} says nothing; it must be a number from 0 up")),
        Err(_) => Err(format!("'{text}' is no number")),
    }
}

/// The exit code: 1 input, output or internal, 2 refused, 3 below a threshold, 4 mesh.
pub(super) fn code(failure: &Failure) -> u8 {
    match kind(failure) {
        FaultKind::File => 1,
        FaultKind::Refused => 2,
        FaultKind::FellShort => 3,
        FaultKind::InvalidMesh => 4,
    }
}

/// The kind, for programs.
pub(super) fn kind(failure: &Failure) -> FaultKind {
    match failure {
        Failure::Io { .. } | Failure::Write(_) | Failure::Unreadable(_) => FaultKind::File,
        Failure::Usage(_) | Failure::Refused(_) => FaultKind::Refused,
        Failure::BelowThreshold(_) => FaultKind::FellShort,
        Failure::InvalidMesh { .. } => FaultKind::InvalidMesh,
    }
}

/// Fails if a relative RMS error exceeds the limit that the user set with --max-error; `which`
/// names it.
pub(super) fn unless_within(limit: Option<f64>, error: f64, which: &str, when: &str) -> Result<(), Failure> {
    match limit {
        Some(limit) if error.is_nan() || error > limit => Err(Failure::BelowThreshold(format!(
            "{which} relative RMS error is {error:.4}{when}, above the limit of {limit} (--max-error)"
        ))),
        _ => Ok(()),
    }
}

/// The names of all flags.
static FLAGS: OnceLock<BTreeSet<String>> = OnceLock::new();

/// Learns the flags of all commands, which settings in messages become.
pub(super) fn learn_flags(command: &clap::Command) {
    let flags = command.get_subcommands().flat_map(clap::Command::get_arguments);
    let _ = FLAGS.set(flags.filter_map(|flag| flag.get_long()).map(str::to_owned).collect());
}

/// A message of the library, its settings, which stand in backticks, as flags.
pub(super) fn with_flags(text: &str) -> String {
    let is_flag = |name: &str| FLAGS.get().is_some_and(|flags| flags.contains(name));
    if !text.contains('`') {
        return text.to_owned();
    }
    let mut flags = String::new();
    let mut parts = text.split('`');
    flags += parts.next().unwrap_or_default();
    while let Some(quoted) = parts.next() {
        let name = quoted.split(' ').next().unwrap_or_default();
        if parts.clone().next().is_some() && is_flag(name) {
            flags += &format!("--{quoted}");
        } else {
            flags += &format!("`{quoted}");
            flags += if parts.clone().next().is_some() { "`" } else { "" };
        }
        flags += parts.next().unwrap_or_default();
    }
    flags
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_become_flags_and_other_words_stay() {
        learn_flags(&clap::Command::new("all").subcommand(
            clap::Command::new("one").args(["ior", "max-slope", "light"].map(|name| clap::Arg::new(name).long(name))),
        ));
        assert_eq!(with_flags("leave `ior` out (`max-slope`)"), "leave --ior out (--max-slope)");
        assert_eq!(with_flags("`light parallel` cannot be"), "--light parallel cannot be");
        assert_eq!(with_flags("missing field `design`"), "missing field `design`");
        assert_eq!(with_flags("one ` alone"), "one ` alone");
    }
}
