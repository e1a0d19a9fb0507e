//! Charts whose text keeps its size on every screen: places are percentages, only curves are
//! stretched.

use super::{Cost, data::Px, data::figure};
use crate::optim::Summary;
use askama::Template;

/// Errors as bars over a logarithmic axis.
#[derive(Template)]
#[template(path = "budget.html")]
pub(super) struct BudgetChart {
    ticks: Vec<(Px, String)>,
    bars: Vec<Bar>,
}

struct Bar {
    name: String,
    /// Length in percent, the error, and by how much the step moves the light.
    error: Option<(Px, String, String)>,
}

/// Ends of the axis of errors, as powers of ten.
const DECADES: (i32, i32) = (-4, 0);

impl BudgetChart {
    pub(super) fn of(costs: &[Cost]) -> Self {
        let decades = f64::from(DECADES.1 - DECADES.0);
        let along = |error: f64| 100.0 * ((error.log10() - f64::from(DECADES.0)) / decades).clamp(0.0, 1.0);
        let ticks =
            (DECADES.0..=DECADES.1).map(|power| 10_f64.powi(power)).map(|v| (Px(along(v)), figure(v))).collect();
        let bar = |cost: &Cost| Bar {
            name: cost.name.clone(),
            error: cost.errors.map(|(error, moved)| (Px(along(error)), rounded(error), rounded(moved))),
        };
        Self { ticks, bars: costs.iter().map(bar).collect() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bars.is_empty()
    }
}

fn rounded(error: f64) -> String {
    if error < 1e-3 { format!("{error:.5}") } else { format!("{error:.4}") }
}

/// What the solver did, iteration by iteration.
#[derive(Template)]
#[template(path = "convergence.html")]
pub(super) struct ConvergenceChart {
    curves: Vec<CurveOfLevel>,
    /// Decades: place from the top in percent, and label.
    decades: Vec<(Px, String)>,
    groups: Vec<String>,
    iterations: usize,
}

struct CurveOfLevel {
    stage: String,
    nodes: (usize, usize),
    ended: String,
    /// Which of the groups it belongs to.
    group: usize,
    /// Path in a square of 100.
    path: String,
    points: Vec<(Px, Px)>,
    last: String,
    count: usize,
    seconds: String,
    /// The strip of the chart that is the level's, percent.
    strip: (Px, Px),
}

impl ConvergenceChart {
    /// Nothing for a solver without iterations.
    pub(super) fn of(summary: &Summary) -> Option<Self> {
        let shown = |v: f64| v.is_finite() && v > 0.0;
        let all = summary.levels.iter().flat_map(|level| &level.iterations).map(|iteration| iteration.objective);
        let (low, high) = all
            .filter(|v| shown(*v))
            .map(f64::log10)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        if !low.is_finite() {
            return None;
        }
        let (low, high) = (low.floor(), high.ceil().max(low.floor() + 1.0));
        let down = |objective: f64| 100.0 * (high - objective.log10()) / (high - low);
        let total = summary.iterations().max(1) as f64;
        let mut groups: Vec<String> = Vec::new();
        let mut before = 0_usize;
        let mut curves = Vec::new();
        for level in &summary.levels {
            // Rounds and passes of one kind are one group.
            let kind = level.stage.trim_end_matches(|c: char| c.is_ascii_digit() || c == ' ').to_owned();
            let group = groups.iter().position(|known| *known == kind).unwrap_or_else(|| {
                groups.push(kind);
                groups.len() - 1
            });
            let places = level.iterations.iter().enumerate().filter(|(_, it)| shown(it.objective));
            let points: Vec<(Px, Px)> = places
                .map(|(k, it)| (Px(100.0 * ((before + k) as f64 + 0.5) / total), Px(down(it.objective))))
                .collect();
            let path: Vec<String> = points.iter().map(|(x, y)| format!("{x} {y}")).collect();
            curves.push(CurveOfLevel {
                stage: level.stage.clone(),
                nodes: (level.nx, level.ny),
                ended: level.termination.to_string(),
                group,
                path: if path.is_empty() { String::new() } else { format!("M{}", path.join("L")) },
                points,
                last: level.iterations.last().map_or("–".into(), |it| format!("{:.1e}", it.objective)),
                count: level.iterations.len(),
                seconds: figure(level.elapsed.as_secs_f64()),
                strip: (Px(100.0 * before as f64 / total), Px(100.0 * level.iterations.len() as f64 / total)),
            });
            before += level.iterations.len();
        }
        // At most six labels.
        let step = ((high - low) / 6.0).ceil().max(1.0) as i32;
        let decades = (low as i32..=high as i32)
            .filter(|power| (power - low as i32) % step == 0)
            .map(|power| (Px(down(10_f64.powi(power))), superscript(power)))
            .collect();
        Some(Self { curves, decades, groups, iterations: summary.iterations() })
    }
}

/// A power of ten as people write it.
fn superscript(power: i32) -> String {
    let power = power.to_string();
    let digits = power.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        // Superscript figures but these are in one row.
        digit => char::from_u32(0x2070 + digit as u32 - '0' as u32).unwrap_or(digit),
    });
    "10".chars().chain(digits).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optim::{Iteration, Level, Termination};
    use std::time::Duration;

    #[test]
    fn bars_grow_with_the_logarithm_of_the_error() {
        let cost = |error: f64| Cost { name: "a <step>".into(), errors: Some((error, error)) };
        let same = Cost { name: "the same".into(), errors: None };
        let chart = BudgetChart::of(&[cost(1e-4), cost(1e-2), cost(5.0), same]);
        let lengths: Vec<_> = chart.bars.iter().map(|bar| bar.error.as_ref().map(|error| error.0)).collect();
        assert_eq!(lengths, [Some(Px(0.0)), Some(Px(50.0)), Some(Px(100.0)), None]);
        let html = chart.to_string();
        assert!(html.contains("a &#60;step&#62;") && !html.contains("<step>"), "{html}");
    }

    #[test]
    fn every_iteration_is_a_point_and_rounds_are_one_group() {
        let level = |stage: &str, objectives: &[f64]| Level {
            stage: stage.into(),
            nx: 65,
            ny: 33,
            termination: Termination::Converged,
            iterations: objectives
                .iter()
                .map(|&objective| Iteration { objective, gradient_norm: 0.0, step: 1.0, evaluations: 1 })
                .collect(),
            elapsed: Duration::from_millis(1500),
        };
        let levels =
            vec![level("pyramid", &[1.0, 0.01]), level("closed loop 1", &[1e-3, 0.0]), level("closed loop 2", &[])];
        let summary = Summary { levels, ..Summary::default() };
        let chart = ConvergenceChart::of(&summary).unwrap();
        assert_eq!(chart.groups, ["pyramid", "closed loop"]);
        assert_eq!(chart.curves[0].points, [(Px(12.5), Px(0.0)), (Px(37.5), Px(100.0 * 2.0 / 3.0))]);
        assert_eq!(chart.curves[1].points.len(), 1, "an exact zero has no logarithm");
        assert!(chart.to_string().contains("10⁻³"));
        assert!(ConvergenceChart::of(&Summary::default()).is_none());
    }
}
