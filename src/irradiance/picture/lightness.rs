//! From numbers to luminance, by curves or by a table of a profile.

use super::curve::Curve;
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// How numbers become luminance.
pub(super) enum Lightness {
    Grey(Curve),
    Rgb { curves: [Curve; 3], weights: [f64; 3] },
    Table(Arc<Table>),
}

impl Lightness {
    /// One curve for all three colours.
    pub(super) fn alike(curve: &Curve, weights: [f64; 3]) -> Self {
        Self::Rgb { curves: [curve.clone(), curve.clone(), curve.clone()], weights }
    }
}

/// Colours on a grid, with curves before and behind it.
pub(super) struct Table {
    pub(super) before: Vec<Curve>,
    /// Points along each channel; the first varies most slowly.
    pub(super) grid: Vec<usize>,
    pub(super) colours: Vec<[f32; 3]>,
    /// What follows the grid, where that mixes the channels.
    pub(super) mixing: Option<Mixing>,
    pub(super) last: [Curve; 3],
    pub(super) space: Space,
}

/// Curves and a matrix behind them.
pub(super) struct Mixing {
    pub(super) curves: [Curve; 3],
    pub(super) matrix: DMat3,
    pub(super) offset: DVec3,
}

/// How the connection space is written as numbers from 0 to 1.
#[derive(Clone, Copy)]
pub(super) enum Space {
    /// Y, and what is 1 of it.
    Xyz,
    /// L*, and what is 100 of it.
    Lab { white: f64 },
}

impl Table {
    /// Luminance of a colour, each of its channels 0 to 1.
    pub(super) fn light(&self, colour: &[f64]) -> f64 {
        let found = self.between(colour);
        let channel = match self.space {
            Space::Xyz => 1,
            Space::Lab { .. } => 0,
        };
        let mixed = match &self.mixing {
            None => found[channel],
            Some(Mixing { curves, matrix, offset }) => {
                (*matrix * DVec3::from([0, 1, 2].map(|k| curves[k].light(found[k]))) + *offset)[channel]
            }
        };
        let value = self.last[channel].light(mixed);
        match self.space {
            Space::Xyz => value.max(0.0) * (1.0 + 32767.0 / 32768.0),
            Space::Lab { white } => Curve::Lightness.light(value / white),
        }
    }

    /// Between the points of the grid, linear along every channel.
    fn between(&self, colour: &[f64]) -> [f64; 3] {
        const MOST: usize = 4;
        let channels = self.grid.len();
        let (mut cell, mut part) = ([0; MOST], [0.0; MOST]);
        for k in 0..channels {
            let at = self.before[k].light(colour[k].clamp(0.0, 1.0)).clamp(0.0, 1.0) * (self.grid[k] - 1) as f64;
            cell[k] = (at as usize).min(self.grid[k].saturating_sub(2));
            part[k] = at - cell[k] as f64;
        }
        let mut sum = [0.0; 3];
        for corner in 0..1_usize << channels {
            let (mut weight, mut index) = (1.0, 0);
            for k in 0..channels {
                let up = corner >> k & 1;
                weight *= if up == 1 { part[k] } else { 1.0 - part[k] };
                index = index * self.grid[k] + (cell[k] + up).min(self.grid[k] - 1);
            }
            if weight > 0.0 {
                let found = self.colours[index];
                for c in 0..3 {
                    sum[c] += weight * f64::from(found[c]);
                }
            }
        }
        sum
    }
}
