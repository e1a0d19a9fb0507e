//! Nonlinear conjugate gradients: Polak-Ribière with restarts (PR+), strong Wolfe line search.

use super::{
    Iteration, Termination,
    line_search::{Found, Sample, Wolfe},
    vector::{Sums, step_along, turn},
};
use std::ops::ControlFlow;

/// A differentiable function of many variables.
pub trait Objective {
    /// Number of variables.
    fn variables(&self) -> usize;

    /// Value at `x`; the gradient goes to `gradient`. A value that is not finite says that `x` is
    /// outside of the domain.
    fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64;
}

/// When to stop, and how carefully to search. See [`minimise`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MinimiserOptions {
    /// Iterations at most; default 200.
    pub iteration_limit: usize,
    /// Converged when `|g| <= gradient_tolerance * |g_0|`, the norm at the start; default 1e-8, at
    /// least 0, below 1.
    pub gradient_tolerance: f64,
    /// Converged when ten iterations together lower the objective by no more than this part of it:
    /// `f_(k-10) - f_k <= decrease_tolerance * |f_k|`; default 1e-10, at least 0, below 1.
    pub decrease_tolerance: f64,
    /// Largest change of any variable in the very first trial step, in the unit of the variables;
    /// above 0. `None`, the default, tries the step that would lower the objective by its own value
    /// to first order, which suits well-scaled problems only: a first step far too long may end in
    /// another valley.
    pub first_move: Option<f64>,
    /// Constant of the sufficient decrease condition; default 1e-4, between 0 and `curvature`.
    pub sufficient_decrease: f64,
    /// Constant of the curvature condition; default 0.2, above `sufficient_decrease`, below 1/2 so
    /// that conjugate directions descend.
    pub curvature: f64,
}

impl Default for MinimiserOptions {
    fn default() -> Self {
        Self {
            iteration_limit: 200,
            gradient_tolerance: 1e-8,
            decrease_tolerance: 1e-10,
            first_move: None,
            sufficient_decrease: 1e-4,
            curvature: 0.2,
        }
    }
}

/// An option outside of its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the option {name} is {value}; it must lie between {least} and {greatest}")]
pub struct OptionError {
    /// Which option.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Least accepted value.
    pub least: f64,
    /// Greatest accepted value.
    pub greatest: f64,
}

impl OptionError {
    /// Accepts a value inside of `[least, greatest]`.
    ///
    /// # Errors
    /// A value outside, or not a number.
    pub fn check(name: &'static str, value: f64, least: f64, greatest: f64) -> Result<(), Self> {
        if (least..=greatest).contains(&value) { Ok(()) } else { Err(Self { name, value, least, greatest }) }
    }
}

impl MinimiserOptions {
    /// Checks every option against its range.
    ///
    /// # Errors
    /// The first option outside of its range.
    pub fn validate(&self) -> Result<(), OptionError> {
        let below_one = 1.0 - f64::EPSILON;
        OptionError::check("gradient_tolerance", self.gradient_tolerance, 0.0, below_one)?;
        OptionError::check("decrease_tolerance", self.decrease_tolerance, 0.0, below_one)?;
        OptionError::check("first_move", self.first_move.unwrap_or(1.0), f64::MIN_POSITIVE, f64::MAX)?;
        OptionError::check("curvature", self.curvature, f64::MIN_POSITIVE, 0.5)?;
        OptionError::check("sufficient_decrease", self.sufficient_decrease, 0.0, self.curvature)
    }
}

/// How a minimisation went.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Why it ended.
    pub termination: Termination,
    /// The objective at the result.
    pub objective: f64,
    /// Evaluations of objective and gradient, the one at the start included.
    pub evaluations: usize,
    /// Every iteration.
    pub iterations: Vec<Iteration>,
}

const EVALUATIONS_PER_SEARCH: usize = 20;
const DECREASE_WINDOW: usize = 10;

/// Minimises `objective` from `x`, which holds the best point found in the end. `watch` sees every
/// iteration, and may end it all.
///
/// Bit-identical for any number of threads if the objective is.
///
/// # Errors
/// An option outside of its range.
///
/// # Panics
/// If `x` has another length than the objective has variables.
pub fn minimise(
    objective: &mut impl Objective,
    x: &mut Vec<f64>,
    options: &MinimiserOptions,
    mut watch: impl FnMut(usize, &Iteration) -> ControlFlow<()>,
) -> Result<Outcome, OptionError> {
    options.validate()?;
    let n = objective.variables();
    assert_eq!(x.len(), n, "one value for each variable");
    let wolfe =
        Wolfe { c1: options.sufficient_decrease, c2: options.curvature, evaluation_limit: EVALUATIONS_PER_SEARCH };
    let mut sums = Sums::default();
    let (mut g, mut trial_x, mut trial_g) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut value = objective.evaluate(x, &mut g);
    let mut gg = sums.dot(&g, &g);
    let mut outcome =
        Outcome { termination: Termination::IterationLimit, objective: value, evaluations: 1, iterations: Vec::new() };
    let enough = options.gradient_tolerance * gg.sqrt();
    if !(value.is_finite() && gg.is_finite()) {
        outcome.termination = Termination::Stalled;
        return Ok(outcome);
    }
    let mut d: Vec<f64> = g.iter().map(|v| -v).collect();
    let mut slope = -gg;
    let mut downhill = true; // d is the steepest descent
    let first_step = |g: &[f64], value: f64, gg: f64| match options.first_move {
        Some(length) => length / g.iter().fold(f64::MIN_POSITIVE, |m: f64, v| m.max(v.abs())),
        None => value.abs().max(f64::MIN_POSITIVE) / gg.max(f64::MIN_POSITIVE),
    };
    let mut first = first_step(&g, value, gg);
    while outcome.iterations.len() < options.iteration_limit {
        if gg.sqrt() <= enough {
            outcome.termination = Termination::Converged;
            break;
        }
        let origin = Sample { step: 0.0, value, slope };
        let (found, mut evaluations) = wolfe.search(origin, first, |step| {
            step_along(&mut trial_x, x, step, &d);
            let value = objective.evaluate(&trial_x, &mut trial_g);
            (value, sums.dot(&trial_g, &d))
        });
        outcome.evaluations += evaluations;
        let accepted = match found {
            Found::Wolfe(sample) => sample,
            Found::Decrease(sample) => {
                step_along(&mut trial_x, x, sample.step, &d);
                let value = objective.evaluate(&trial_x, &mut trial_g);
                outcome.evaluations += 1;
                evaluations += 1;
                Sample { value, ..sample }
            }
            Found::Nothing if downhill => {
                outcome.termination = Termination::Stalled;
                break;
            }
            Found::Nothing => {
                turn(&mut d, 0.0, &g);
                (slope, downhill, first) = (-gg, true, first_step(&g, value, gg));
                continue;
            }
        };
        std::mem::swap(x, &mut trial_x);
        std::mem::swap(&mut g, &mut trial_g);
        value = accepted.value;
        let [new_gg, overlap] = sums.dot2(&g, &g, &trial_g);
        let beta = ((new_gg - overlap) / gg).max(0.0);
        gg = new_gg;
        turn(&mut d, beta, &g);
        let old_slope = slope;
        slope = sums.dot(&g, &d);
        downhill = beta == 0.0;
        if slope >= 0.0 || slope.is_nan() {
            turn(&mut d, 0.0, &g);
            (slope, downhill) = (-gg, true);
        }
        // The same decrease to first order as in the last iteration (Nocedal and Wright, 3.60).
        first = if slope < 0.0 { accepted.step * (old_slope / slope).min(10.0) } else { accepted.step };
        let iteration = Iteration { objective: value, gradient_norm: gg.sqrt(), step: accepted.step, evaluations };
        outcome.iterations.push(iteration);
        let done = outcome.iterations.len();
        if watch(done, &iteration).is_break() {
            outcome.termination = Termination::Cancelled;
            break;
        }
        if done > DECREASE_WINDOW {
            let before = outcome.iterations[done - 1 - DECREASE_WINDOW].objective;
            if before - value <= options.decrease_tolerance * value.abs() {
                outcome.termination = Termination::Converged;
                break;
            }
        }
    }
    outcome.objective = value;
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley in many dimensions.
    struct Valley(usize);

    impl Objective for Valley {
        fn variables(&self) -> usize {
            self.0
        }
        fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
            gradient.fill(0.0);
            let mut value = 0.0;
            for k in (0..x.len()).step_by(2) {
                let (a, b) = (x[k], x[k + 1]);
                value += 100.0 * (b - a * a).powi(2) + (1.0 - a).powi(2);
                gradient[k] = -400.0 * a * (b - a * a) - 2.0 * (1.0 - a);
                gradient[k + 1] = 200.0 * (b - a * a);
            }
            value
        }
    }

    /// A convex parabola whose Hessian has the eigenvalues 1..=n.
    struct Bowl(usize);

    impl Objective for Bowl {
        fn variables(&self) -> usize {
            self.0
        }
        fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
            let mut value = 0.0;
            for (k, (x, g)) in x.iter().zip(gradient).enumerate() {
                *g = (k + 1) as f64 * (x - 1.0);
                value += 0.5 * *g * (x - 1.0);
            }
            value
        }
    }

    #[test]
    fn the_valley_is_followed_to_its_end() {
        let mut x = [-1.2, 1.0].repeat(50);
        let options = MinimiserOptions { iteration_limit: 500, ..MinimiserOptions::default() };
        let outcome = minimise(&mut Valley(100), &mut x, &options, |_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!(outcome.termination, Termination::Converged);
        assert!(x.iter().all(|v| (v - 1.0).abs() < 1e-5), "{outcome:?}");
        assert!(outcome.iterations.windows(2).all(|w| w[1].objective <= w[0].objective));
        let counted: usize = outcome.iterations.iter().map(|i| i.evaluations).sum();
        assert_eq!(counted + 1, outcome.evaluations);
    }

    #[test]
    fn a_parabola_converges_at_the_rate_of_conjugate_gradients() {
        // Bound 2 ((sqrt k - 1)/(sqrt k + 1))^m for the error with condition k = 400: below 1e-6
        // after 145 steps.
        let mut x = vec![0.0; 400];
        let options = MinimiserOptions { iteration_limit: 145, decrease_tolerance: 0.0, ..MinimiserOptions::default() };
        let outcome = minimise(&mut Bowl(400), &mut x, &options, |_, _| ControlFlow::Continue(())).unwrap();
        assert!(outcome.objective < 1e-6 * 400.0 * 401.0 / 4.0, "{}", outcome.objective);
        assert!(outcome.evaluations < 3 * outcome.iterations.len());
    }

    #[test]
    fn the_limit_is_reported_and_bad_options_are_refused() {
        let mut x = vec![0.0; 400];
        let options = MinimiserOptions { iteration_limit: 3, ..MinimiserOptions::default() };
        let mut seen = 0;
        let outcome = minimise(&mut Bowl(400), &mut x, &options, |k, _| {
            seen = k;
            ControlFlow::Continue(())
        })
        .unwrap();
        assert_eq!((outcome.termination, seen), (Termination::IterationLimit, 3));
        let options = MinimiserOptions { curvature: 0.9, ..MinimiserOptions::default() };
        let error = minimise(&mut Bowl(400), &mut x, &options, |_, _| ControlFlow::Continue(())).unwrap_err();
        assert_eq!((error.name, error.value), ("curvature", 0.9));
    }

    #[test]
    fn whoever_watches_may_end_it() {
        let mut x = vec![0.0; 400];
        let stop = |k: usize| if k == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let outcome = minimise(&mut Bowl(400), &mut x, &MinimiserOptions::default(), |k, _| stop(k)).unwrap();
        assert_eq!((outcome.termination, outcome.iterations.len()), (Termination::Cancelled, 3));
    }

    #[test]
    fn a_start_at_the_minimum_is_converged() {
        let mut x = vec![1.0; 10];
        let outcome =
            minimise(&mut Bowl(10), &mut x, &MinimiserOptions::default(), |_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!((outcome.termination, outcome.iterations.len()), (Termination::Converged, 0));
    }
}
