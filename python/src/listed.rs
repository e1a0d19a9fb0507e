//! Every command and flag, as data.

use clap::{Arg, ArgAction, Args as _, Command};
use glasswarp::{
    cli,
    spec::{
        Angle, Feed, Inclination, Length, RimSize, Settings, Shift, SmallLength, StockSize, Travel, Wavelength,
        WindowSize,
    },
};
use serde_json::{Value, json};
use std::any::TypeId;

/// The unit of a bare number, for values that are one.
fn unit(argument: &Arg) -> Option<&'static str> {
    let is = |of: TypeId| argument.get_value_parser().type_id() == of;
    [
        ("mm", TypeId::of::<Length>()),
        ("mm", TypeId::of::<Shift>()),
        ("mm", TypeId::of::<RimSize>()),
        ("mm", TypeId::of::<WindowSize>()),
        ("mm", TypeId::of::<Travel>()),
        ("mm", TypeId::of::<StockSize>()),
        ("um", TypeId::of::<SmallLength>()),
        ("deg", TypeId::of::<Angle>()),
        ("deg", TypeId::of::<Inclination>()),
        ("nm", TypeId::of::<Wavelength>()),
        ("mm_per_min", TypeId::of::<Feed>()),
    ]
    .into_iter()
    .find_map(|(unit, of)| is(of).then_some(unit))
}

/// What stands between several numbers that are one value.
fn separator(argument: &Arg) -> &'static str {
    let is = |of: TypeId| argument.get_value_parser().type_id() == of;
    let by_times = [TypeId::of::<WindowSize>(), TypeId::of::<Travel>(), TypeId::of::<StockSize>()];
    if by_times.into_iter().any(is) { "x" } else { "," }
}

fn kind(argument: &Arg) -> &'static str {
    let is = |of: TypeId| argument.get_value_parser().type_id() == of;
    let is_whole = [TypeId::of::<u32>(), TypeId::of::<u64>(), TypeId::of::<usize>()].into_iter().any(is);
    match argument.get_action() {
        ArgAction::SetTrue => "flag",
        ArgAction::Count => "count",
        ArgAction::Help | ArgAction::Version | ArgAction::HelpShort | ArgAction::HelpLong => "help",
        _ if is(TypeId::of::<bool>()) => "switch",
        _ if is_whole => "whole",
        _ if is(TypeId::of::<f64>()) => "number",
        _ if is(TypeId::of::<std::path::PathBuf>()) || is(TypeId::of::<std::ffi::OsString>()) => "path",
        _ => "text",
    }
}

fn argument(argument: &Arg) -> Value {
    json!({
        "name": argument.get_id().as_str(),
        "flag": argument.get_long(),
        "kind": kind(argument),
        "unit": unit(argument),
        "separator": separator(argument),
        "several": matches!(argument.get_action(), ArgAction::Append)
            || argument.get_num_args().is_some_and(|count| count.max_values() > 1),
        "choices": argument
            .get_possible_values()
            .iter()
            .filter(|_| kind(argument) == "text")
            .map(|value| value.get_name().to_owned())
            .collect::<Vec<_>>(),
        "default": argument.get_default_values().first().map(|value| value.to_string_lossy().into_owned()),
        "help": argument.get_long_help().or(argument.get_help()).map(ToString::to_string),
    })
}

fn command(command: &Command) -> Value {
    json!({
        "name": command.get_name(),
        "about": command.get_about().map(ToString::to_string),
        "arguments": command.get_arguments().map(argument).collect::<Vec<_>>(),
        "commands": command
            .get_subcommands()
            .filter(|one| one.get_name() != "help")
            .map(self::command)
            .collect::<Vec<_>>(),
    })
}

/// Every command with its flags, and the names of those that are settings of a block, as JSON. Nothing is said twice: kinds, units, defaults and words are
/// those of the command line.
#[pyo3::pyfunction]
pub(crate) fn listed() -> String {
    let settings = Settings::augment_args(Command::new("design"));
    let settings: Vec<&str> = settings.get_arguments().map(|argument| argument.get_id().as_str()).collect();
    json!({ "command": command(&cli::command()), "settings": settings }).to_string()
}
