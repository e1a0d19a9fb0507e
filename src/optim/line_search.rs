//! Moré and Thuente, "Line search algorithms with guaranteed sufficient decrease", ACM TOMS 20
//! (1994).
//!
//! Finds a step that meets the strong Wolfe conditions
//! `phi(a) <= phi(0) + c1 a phi'(0)` and `|phi'(a)| <= c2 |phi'(0)|`.

/// A point of the line: step, value, slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    pub(crate) step: f64,
    pub(crate) value: f64,
    pub(crate) slope: f64,
}

/// The two constants of the Wolfe conditions, and a limit on the work.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wolfe {
    pub(crate) c1: f64,
    pub(crate) c2: f64,
    pub(crate) evaluation_limit: usize,
}

/// How a search ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Found {
    /// Both conditions hold at this point, the last one that was evaluated.
    Wolfe(Sample),
    /// Only this decrease was found (not the last point evaluated).
    Decrease(Sample),
    /// Nothing better than the start.
    Nothing,
}

impl Wolfe {
    /// Searches from `origin` (step 0, slope below 0), trying `first` first. Returns the result and
    /// the evaluations made.
    pub(crate) fn search(&self, origin: Sample, first: f64, mut phi: impl FnMut(f64) -> (f64, f64)) -> (Found, usize) {
        let decrease_slope = self.c1 * origin.slope;
        let (mut best, mut other) = (origin, origin);
        let mut bracketed = false;
        let mut modified = true; // stage 1 works on psi(a) = phi(a) - phi(0) - c1 a phi'(0)
        let (mut least, mut greatest) = (0.0, 5.0 * first);
        let mut width = [f64::INFINITY; 2];
        let mut step = first;
        for evaluations in 1..=self.evaluation_limit {
            let (value, slope) = phi(step);
            if !(value.is_finite() && slope.is_finite()) {
                // Outside of the domain: come back towards the best point known.
                greatest = step;
                step = best.step + 0.25 * (step - best.step);
                continue;
            }
            let trial = Sample { step, value, slope };
            let sufficient = value <= origin.value + step * decrease_slope;
            if sufficient && slope.abs() <= self.c2 * origin.slope.abs() {
                return (Found::Wolfe(trial), evaluations);
            }
            if modified && sufficient && slope >= 0.0 {
                modified = false;
            }
            let tilt = if modified && value <= best.value && !sufficient { decrease_slope } else { 0.0 };
            let bend = |s: Sample| Sample { value: s.value - s.step * tilt, slope: s.slope - tilt, ..s };
            let unbend = |s: Sample| Sample { value: s.value + s.step * tilt, slope: s.slope + tilt, ..s };
            let (mut near, mut far) = (bend(best), bend(other));
            step = update(&mut near, &mut far, bend(trial), &mut bracketed, least, greatest);
            (best, other) = (unbend(near), unbend(far));
            if bracketed {
                let length = (other.step - best.step).abs();
                if length >= 0.66 * width[1] {
                    step = best.step + 0.5 * (other.step - best.step);
                }
                width = [length, width[0]];
                (least, greatest) = (best.step.min(other.step), best.step.max(other.step));
                if length <= 1e-12 * greatest {
                    break;
                }
            } else {
                least = step + 1.1 * (step - best.step);
                greatest = step + 4.0 * (step - best.step);
            }
        }
        let found = if best.step > 0.0 && best.value < origin.value { Found::Decrease(best) } else { Found::Nothing };
        (found, self.evaluation_limit)
    }
}

/// The safeguarded step of section 4 of the paper: updates the interval `(near, far)` by `trial`,
/// returns the next step.
fn update(near: &mut Sample, far: &mut Sample, trial: Sample, bracketed: &mut bool, least: f64, greatest: f64) -> f64 {
    let (x, t) = (*near, trial);
    let opposite = t.slope * x.slope.signum() < 0.0;
    // Minimum of the cubic through two samples; `root` is clamped where rounding or the case makes
    // it imaginary.
    let cubic = |a: Sample, b: Sample| {
        let theta = 3.0 * (a.value - b.value) / (b.step - a.step) + a.slope + b.slope;
        let scale = theta.abs().max(a.slope.abs()).max(b.slope.abs());
        let root = scale * ((theta / scale).powi(2) - a.slope / scale * (b.slope / scale)).max(0.0).sqrt();
        (theta, root)
    };
    let secant = || t.step + t.slope / (t.slope - x.slope) * (x.step - t.step);
    let next;
    if t.value > x.value {
        // Case 1: higher, so there is a minimum between.
        let (theta, root) = cubic(x, t);
        let root = if t.step < x.step { -root } else { root };
        let r = ((root - x.slope) + theta) / (((root - x.slope) + root) + t.slope);
        let by_cubic = x.step + r * (t.step - x.step);
        let by_parabola =
            x.step + x.slope / ((x.value - t.value) / (t.step - x.step) + x.slope) / 2.0 * (t.step - x.step);
        next = if (by_cubic - x.step).abs() < (by_parabola - x.step).abs() {
            by_cubic
        } else {
            by_cubic + (by_parabola - by_cubic) / 2.0
        };
        *bracketed = true;
    } else if opposite {
        // Case 2: lower with the slope turned, so there is a minimum between.
        let (theta, root) = cubic(x, t);
        let root = if t.step > x.step { -root } else { root };
        let r = ((root - t.slope) + theta) / (((root - t.slope) + root) + x.slope);
        let by_cubic = t.step + r * (x.step - t.step);
        let by_secant = secant();
        next = if (by_cubic - t.step).abs() > (by_secant - t.step).abs() { by_cubic } else { by_secant };
        *bracketed = true;
    } else if t.slope.abs() < x.slope.abs() {
        // Case 3: lower, flatter: extrapolate, where the cubic has a minimum that way.
        let (theta, root) = cubic(x, t);
        let root = if t.step > x.step { -root } else { root };
        let r = ((root - t.slope) + theta) / ((root + (x.slope - t.slope)) + root);
        let by_cubic = if r < 0.0 && root != 0.0 {
            t.step + r * (x.step - t.step)
        } else if t.step > x.step {
            greatest
        } else {
            least
        };
        let by_secant = secant();
        let cubic_is_nearer = (by_cubic - t.step).abs() < (by_secant - t.step).abs();
        if *bracketed {
            let step = if cubic_is_nearer { by_cubic } else { by_secant };
            let bound = t.step + 0.66 * (far.step - t.step);
            next = if t.step > x.step { step.min(bound) } else { step.max(bound) };
        } else {
            next = (if cubic_is_nearer { by_secant } else { by_cubic }).clamp(least, greatest);
        }
    } else if *bracketed {
        // Case 4: lower, not flatter.
        let (theta, root) = cubic(t, *far);
        let root = if t.step > far.step { -root } else { root };
        let r = ((root - t.slope) + theta) / (((root - t.slope) + root) + far.slope);
        next = t.step + r * (far.step - t.step);
    } else {
        next = if t.step > x.step { greatest } else { least };
    }
    if t.value > x.value {
        *far = t;
    } else {
        if opposite {
            *far = x;
        }
        *near = t;
    }
    next
}

#[cfg(test)]
mod tests {
    use super::*;

    const WOLFE: Wolfe = Wolfe { c1: 1e-4, c2: 0.2, evaluation_limit: 30 };

    fn assert_wolfe(name: &str, phi: impl Fn(f64) -> (f64, f64), first: f64) -> usize {
        let (value, slope) = phi(0.0);
        let origin = Sample { step: 0.0, value, slope };
        let (found, evaluations) = WOLFE.search(origin, first, &phi);
        let Found::Wolfe(at) = found else { panic!("{name} from {first}: {found:?}") };
        assert!(at.value <= value + 1e-4 * at.step * slope, "{name}: decrease");
        assert!(at.slope.abs() <= 0.2 * slope.abs(), "{name}: curvature");
        assert_eq!((at.value, at.slope), phi(at.step));
        evaluations
    }

    #[test]
    fn both_conditions_hold_from_near_and_far_first_steps() {
        // The first three are problems 1, 2 and 3 of the paper's section 5 (the third has many
        // local minima).
        for first in [1e-3, 1e-1, 10.0, 1e3] {
            assert_wolfe("quotient", |a| (-a / (a * a + 2.0), (a * a - 2.0) / (a * a + 2.0).powi(2)), first);
            let b = 0.004;
            let quintic =
                |a: f64| ((a + b).powi(5) - 2.0 * (a + b).powi(4), 5.0 * (a + b).powi(4) - 8.0 * (a + b).powi(3));
            assert_wolfe("quintic", quintic, first);
            assert_wolfe("quartic", |a| ((a - 1.0).powi(4) - a, 4.0 * (a - 1.0).powi(3) - 1.0), first);
            assert_wolfe("cosh", |a| ((a - 3.0).cosh(), (a - 3.0).sinh()), first.min(100.0));
        }
    }

    #[test]
    fn a_parabola_takes_two_evaluations_at_most() {
        for first in [0.9, 1.1, 0.3, 2.0, 7.0] {
            assert!(assert_wolfe("parabola", |a| ((a - 1.0).powi(2), 2.0 * (a - 1.0)), first) <= 2, "{first}");
        }
    }

    #[test]
    fn values_outside_of_the_domain_are_retreated_from() {
        let barrier = |a: f64| (-(1.0 - a).ln() - 3.0 * a, 1.0 / (1.0 - a) - 3.0);
        assert_wolfe("barrier", barrier, 50.0);
    }

    #[test]
    fn a_line_without_descent_is_reported() {
        let origin = Sample { step: 0.0, value: 0.0, slope: -1.0 };
        let (found, _) = WOLFE.search(origin, 1.0, |_| (1.0, 1.0));
        assert_eq!(found, Found::Nothing);
    }
}
