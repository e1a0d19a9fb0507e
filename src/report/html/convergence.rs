//! What the solver did, as a chart and a table.

use super::data::figure;
use crate::{
    optim::Summary,
    report::curves::{Chart, Curve},
};
use askama::Template;
use glam::DVec2;

/// What the solver did, iteration by iteration.
#[derive(Template)]
#[template(path = "convergence.html")]
pub(super) struct Convergence {
    levels: Vec<Level>,
    /// The chart as an element.
    chart: String,
}

/// A row of the table.
struct Level {
    stage: String,
    nodes: (usize, usize),
    ended: String,
    last: String,
    count: usize,
    seconds: String,
}

/// Height of the chart, pixels.
const HEIGHT: f64 = 300.0;

impl Convergence {
    /// Nothing for a solver without iterations.
    pub(super) fn of(summary: &Summary) -> Option<Self> {
        let (groups, curves) = curves(summary);
        if curves.iter().all(|(_, curve)| curve.points.is_empty()) {
            return None;
        }
        // Every second grid is a strip; an iteration is a whole number.
        let ends = summary.levels.iter().scan(0.5, |end, level| {
            let begin = *end;
            *end += level.iterations.len() as f64;
            Some((begin, *end))
        });
        let strips: Vec<(f64, f64)> = ends.skip(1).step_by(2).collect();
        let names = ["iteration", "residual or objective"];
        let chart = Chart { names, log_x: false, strips: &strips, groups: &groups, curves: &curves }.draw(HEIGHT);
        let words = format!(
            "Residual or objective of the solver over its {} iterations, grid by grid, on a logarithmic scale",
            summary.iterations()
        );
        let levels = summary.levels.iter().map(|level| Level {
            stage: level.stage.clone(),
            nodes: (level.nx, level.ny),
            ended: level.termination.to_string(),
            last: level.iterations.last().map_or("–".into(), |it| format!("{:.1e}", it.objective)),
            count: level.iterations.len(),
            seconds: figure(level.elapsed.as_secs_f64()),
        });
        let chart = chart.element(&format!("class=\"paper ink\" role=\"img\" aria-label=\"{words}\""));
        Some(Self { levels: levels.collect(), chart })
    }
}

/// A curve for every grid, in groups.
fn curves(summary: &Summary) -> (Vec<String>, Vec<(usize, Curve)>) {
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
        let iterations = level.iterations.iter().enumerate();
        let points = iterations
            .map(|(k, it)| DVec2::new((before + k + 1) as f64, it.objective))
            .filter(|point| point.y.is_finite() && point.y > 0.0)
            .collect();
        let name = format!("{}, {} × {} nodes", level.stage, level.nx, level.ny);
        curves.push((group, Curve { name, points }));
        before += level.iterations.len();
    }
    (groups, curves)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optim::{Iteration, Level, Termination};
    use std::time::Duration;

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
        let (groups, curves) = curves(&summary);
        assert_eq!(groups, ["pyramid", "closed loop"]);
        assert_eq!(curves[0].1.points, [DVec2::new(1.0, 1.0), DVec2::new(2.0, 0.01)]);
        assert_eq!(curves[1].1.points, [DVec2::new(3.0, 1e-3)], "an exact zero has no logarithm");
        let html = Convergence::of(&summary).unwrap().to_string();
        assert!(html.contains(">0.001<") && html.contains("closed loop 1, 65 × 33 nodes"), "{html}");
        assert!(Convergence::of(&Summary::default()).is_none());
    }
}
