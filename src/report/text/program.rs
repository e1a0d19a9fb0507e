//! A program of a machine.

use super::{mill::steps_table, put};
use crate::study::program::ProgramStudy;

/// What a program does, and what its cut face draws; times with an acceleration, mm/s2, and the
/// corners that it cuts, mm, if these are known.
pub(crate) fn program(name: &str, study: &ProgramStudy, machine: Option<(f64, f64)>) -> String {
    let mut text = String::new();
    let survey = &study.survey;
    let tools: Vec<String> = study
        .tools
        .iter()
        .map(|(number, tool)| if *number == 0 { tool.in_words() } else { format!("T{number}: {}", tool.in_words()) })
        .collect();
    put!(text, "{name}: {} moves, cut with {}", survey.moves, tools.join("; "));
    put!(text, "  way            {:.1} m fed, {:.1} m of rapids", 1e-3 * survey.feed_mm, 1e-3 * survey.rapid_mm);
    let how = match machine {
        Some((acceleration, corner_mm)) => {
            format!("with {acceleration} mm/s2; corners {}", study.corners_in_words(corner_mm))
        }
        None => "by feeds alone (`acceleration` tells more)".to_owned(),
    };
    put!(text, "  time           {:.1} min {how}", survey.seconds / 60.0);
    let feeds: Vec<f64> = survey.feeds.iter().map(|(feed, _)| *feed).collect();
    if let (Some(least), Some(most)) = (feeds.iter().copied().reduce(f64::min), feeds.iter().copied().reduce(f64::max))
    {
        let range = if least == most { format!("{least}") } else { format!("{least} to {most}") };
        put!(text, "  feed           {range} mm/min, changed {} times", survey.feed_changes);
    }
    let (low, high) = survey.bounds;
    put!(
        text,
        "  reaches        x {:.3} to {:.3}, y {:.3} to {:.3}, z {:.3} to {:.3} mm",
        low.x,
        high.x,
        low.y,
        high.y,
        low.z,
        high.z
    );
    if let Some((depth, line)) = study.faults.deepest {
        put!(text, "  deepest cut    {depth:.3} mm, in line {line}");
    }
    let off = &study.deviation;
    put!(
        text,
        "  off the design {:.3} um rms, mean {:+.3}; 99 of 100 places within {:.3} and {:+.3} um",
        off.rms_um,
        off.mean_um,
        off.range_um.0,
        off.range_um.1
    );
    let (greatest, at) = off.greatest;
    put!(
        text,
        "                 at most {greatest:+.3} um, at ({:.2}, {:.2}) mm from the middle of the face",
        at.x,
        at.y
    );
    if off.untouched > 0.0 {
        put!(text, "  untouched      {:.1} % of the face is as high as the stock", 100.0 * off.untouched);
    }
    text += &steps_table(&study.steps, "");
    text
}
