use super::Objective;

/// One component of a gradient beside its central difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GradientCheck {
    /// The variable.
    pub(crate) variable: usize,
    /// What the objective says.
    pub(crate) analytic: f64,
    /// What the difference of two values says.
    pub(crate) numeric: f64,
}

impl GradientCheck {
    /// Deviation relative to `scale`, the typical size of a component (a component may be 0 by
    /// symmetry).
    pub(crate) fn relative_error(&self, scale: f64) -> f64 {
        (self.analytic - self.numeric).abs() / scale
    }
}

/// Compares the gradient at `x` with differences of fourth order, `(8 (f(h) - f(-h)) - (f(2h) -
/// f(-2h))) / 12 h`, for the given variables.
pub(crate) fn check_gradient(
    objective: &mut impl Objective,
    x: &[f64],
    variables: impl IntoIterator<Item = usize>,
    step: f64,
) -> Vec<GradientCheck> {
    let mut gradient = vec![0.0; x.len()];
    objective.evaluate(x, &mut gradient);
    let mut moved = x.to_vec();
    let mut scratch = vec![0.0; x.len()];
    variables
        .into_iter()
        .map(|variable| {
            let mut at = |offset: f64| {
                moved[variable] = x[variable] + offset * step;
                objective.evaluate(&moved, &mut scratch)
            };
            let numeric = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step);
            moved[variable] = x[variable];
            GradientCheck { variable, analytic: gradient[variable], numeric }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Quartic {
        factor: f64,
    }

    impl Objective for Quartic {
        fn variables(&self) -> usize {
            3
        }
        fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
            for (g, v) in gradient.iter_mut().zip(x) {
                *g = self.factor * v.powi(3);
            }
            x.iter().map(|v| v.powi(4) / 4.0).sum()
        }
    }

    #[test]
    fn a_right_gradient_passes_and_a_wrong_one_is_seen() {
        let worst = |factor| {
            check_gradient(&mut Quartic { factor }, &[1.0, -2.0, 0.5], 0..3, 1e-3)
                .iter()
                .map(|c| c.relative_error(8.0))
                .fold(0.0, f64::max)
        };
        assert!(worst(1.0) < 1e-11);
        assert!(worst(1.001) > 5e-4);
    }
}
