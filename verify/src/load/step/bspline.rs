//! Cubic and other B-splines over any knots.

/// Greatest degree that is followed.
pub(super) const GREATEST_DEGREE: usize = 9;

/// Equidistant samples of a curve for a knot, at most.
const FEW: usize = 4;

/// Knots of a B-spline along one parameter.
#[derive(Clone, Debug)]
pub(super) struct Knots {
    degree: usize,
    all: Vec<f64>,
}

impl Knots {
    /// From distinct knots and their multiplicities, for `points` control points; `None` if they do
    /// not fit together.
    pub(super) fn new(degree: usize, multiplicities: &[f64], distinct: &[f64], points: usize) -> Option<Self> {
        let rising = distinct.windows(2).all(|pair| pair[0] < pair[1]) && distinct.iter().all(|knot| knot.is_finite());
        let whole = |m: &f64| (1.0..=(degree + 1) as f64).contains(m) && m.fract() == 0.0;
        if multiplicities.len() != distinct.len() || !rising || !multiplicities.iter().all(whole) {
            return None;
        }
        let all: Vec<f64> =
            multiplicities.iter().zip(distinct).flat_map(|(&m, &knot)| vec![knot; m as usize]).collect();
        let clamped = multiplicities.first().zip(multiplicities.last());
        let ends = (degree + 1) as f64;
        (clamped == Some((&ends, &ends)) && points > degree && all.len() == points + degree + 1)
            .then_some(Self { degree, all })
    }

    /// Parameters at which the not-a-knot cubic through the samples is the spline itself, if its
    /// knots are equidistant but for gaps: a lattice that holds all knots, and none on its second
    /// and last but one place. Otherwise at least two samples between the nearest knots.
    pub(super) fn samples(&self) -> usize {
        let inner = &self.all[self.degree..self.all.len() - self.degree];
        let (start, range) = (inner[0], inner[inner.len() - 1] - inner[0]);
        let gaps = inner.windows(2).map(|pair| pair[1] - pair[0]).filter(|&gap| gap > 0.0);
        let least = gaps.fold(f64::INFINITY, f64::min);
        let cells = (range / least).round().min(1e7);
        let places: Vec<f64> = inner.iter().map(|knot| (knot - start) / range * cells).collect();
        let regular = places.iter().all(|place| (place - place.round()).abs() < 1e-6);
        let not_a_knot = places.iter().all(|place| place.round() != 1.0 && place.round() != cells - 1.0);
        let cells = if regular && not_a_knot && cells >= 3.0 { cells } else { 2.0 * cells.max(2.0) };
        cells as usize + 1
    }

    /// Parameters that show a curve: the equidistant ones of [`samples`](Self::samples) if they are
    /// few, and else the ends, the middle and nothing more of every span.
    pub(super) fn places(&self) -> Vec<f64> {
        let inner = &self.all[self.degree..self.all.len() - self.degree];
        let n = self.samples();
        if n <= FEW * inner.len() {
            return (0..n).map(|k| self.parameter(k, n)).collect();
        }
        let mut places = vec![inner[0]];
        for pair in inner.windows(2).filter(|pair| pair[0] < pair[1]) {
            places.extend([0.5 * (pair[0] + pair[1]), pair[1]]);
        }
        places
    }

    /// The place of sample `k` of `n`.
    pub(super) fn parameter(&self, k: usize, n: usize) -> f64 {
        let (start, end) = (self.all[0], self.all[self.all.len() - 1]);
        let t = k as f64 / (n - 1) as f64;
        start * (1.0 - t) + end * t
    }

    /// The first control point with weight at a parameter, and the weights from there on (de Boor).
    pub(super) fn weights(&self, at: f64) -> (usize, [f64; GREATEST_DEGREE + 1]) {
        let (p, t) = (self.degree, &self.all);
        let last = t.len() - p - 2;
        let mut span = t.partition_point(|&knot| knot <= at).saturating_sub(1).clamp(p, last);
        while span > p && t[span] == t[span + 1] {
            span -= 1;
        }
        let mut weights = [0.0; GREATEST_DEGREE + 1];
        weights[0] = 1.0;
        for d in 1..=p {
            let mut carried = 0.0;
            for k in 0..d {
                let (left, right) = (t[span + 1 + k - d], t[span + 1 + k]);
                let part = weights[k] / (right - left);
                weights[k] = carried + (right - at) * part;
                carried = (at - left) * part;
            }
            weights[d] = carried;
        }
        (span - p, weights)
    }

    pub(super) fn degree(&self) -> usize {
        self.degree
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_bernstein_polynomials_and_sum_to_one() {
        let knots = Knots::new(3, &[4.0, 4.0], &[0.0, 2.0], 4).unwrap();
        let (first, weights) = knots.weights(0.5);
        assert_eq!(first, 0);
        for (weight, wanted) in weights.iter().zip([27.0, 27.0, 9.0, 1.0].map(|w| w / 64.0)) {
            assert!((weight - wanted).abs() < 1e-15);
        }
        let knots = Knots::new(3, &[4.0, 1.0, 2.0, 4.0], &[0.0, 1.0, 2.5, 4.0], 7).unwrap();
        for k in 0..=40 {
            let (first, weights) = knots.weights(0.1 * f64::from(k));
            assert!(first <= 3 && (weights[..4].iter().sum::<f64>() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn knots_that_do_not_fit_are_refused() {
        assert!(Knots::new(3, &[4.0, 4.0], &[0.0, 1.0], 5).is_none());
        assert!(Knots::new(3, &[4.0, 4.0], &[1.0, 0.0], 4).is_none());
        assert!(Knots::new(3, &[3.0, 1.0, 4.0], &[0.0, 1.0, 2.0], 4).is_none());
        assert!(Knots::new(3, &[4.0, 0.5, 4.0], &[0.0, 1.0, 2.0], 4).is_none());
    }

    #[test]
    fn samples_hold_every_knot() {
        let equidistant = Knots::new(3, &[4.0, 1.0, 1.0, 4.0], &[0.0, 1.0, 2.0, 3.0], 6).unwrap();
        assert_eq!(equidistant.samples(), 7);
        let not_a_knot = Knots::new(3, &[4.0, 1.0, 1.0, 4.0], &[0.0, 2.0, 3.0, 5.0], 6).unwrap();
        assert_eq!(not_a_knot.samples(), 6);
    }
}
