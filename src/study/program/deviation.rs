//! How far a cut face lies off its design.

use crate::{
    grid::{Extent, Field},
    record::document,
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;
use glasswarp_verify::cut::Cut;
use rayon::prelude::*;

/// Heights of the cut face less those of the design.
#[derive(Clone, Debug)]
pub struct Deviation {
    /// Root of the mean square, um.
    pub rms_um: f64,
    /// The mean, um: above 0 where glass is left.
    pub mean_um: f64,
    /// Between these two lie 99 of 100 places, um.
    pub range_um: (f64, f64),
    /// The greatest one, um, and where it is, mm from the middle of the face.
    pub greatest: (f64, DVec2),
    /// The map, um: means over its cells; 0 beyond the outline.
    pub map: Field<f64>,
    /// Size of the face.
    pub extent: Extent,
    /// Part of the face that is still as high as the stock.
    pub untouched: f64,
}

/// Cells of the map along its longer side.
const CELLS: usize = 400;

impl Deviation {
    /// Compares at every node of the cut face.
    pub(super) fn of(design: &HeightField, cut: &Cut, zero_z: f64) -> Self {
        let (nx, ny) = cut.plan.nodes;
        let (extent, contour) = (design.extent(), design.contour());
        let spline = SurfaceSpline::through(design);
        let lattice = spline.lattice(nx, ny);
        let top = cut.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let longer = extent.width_mm.max(extent.height_mm);
        let cells = |size: f64, nodes: usize| ((CELLS as f64 * size / longer).ceil() as usize).clamp(8, nodes);
        let (wide, high) = (cells(extent.width_mm, nx), cells(extent.height_mm, ny));
        // A row of cells at a time, in order.
        let rows: Vec<Tally> = (0..high)
            .into_par_iter()
            .map(|row| {
                let mut tally = Tally::new(wide);
                let mut scratch = Vec::new();
                for j in row * ny / high..(row + 1) * ny / high {
                    lattice.row(j, &mut scratch, |i, height, _| {
                        let at = extent.node(i, j, nx, ny);
                        if contour.contains(at) {
                            let left = cut.heights[j * nx + i];
                            let flat = left == top && cut.slopes[j * nx + i] == DVec2::ZERO;
                            tally.add(i * wide / nx, 1e3 * (left + zero_z - height), at, flat);
                        }
                    });
                }
                tally
            })
            .collect();
        let mut all = Tally::new(0);
        let mut map = Vec::with_capacity(wide * high);
        for row in &rows {
            map.extend(row.cells.iter().map(|(sum, count)| if *count > 0.0 { sum / count } else { 0.0 }));
            all.join(row);
        }
        let quantile = |part: f64| all.quantile(part);
        Self {
            rms_um: (all.square / all.count).sqrt(),
            mean_um: all.sum / all.count,
            range_um: (quantile(0.005), quantile(0.995)),
            greatest: all.greatest,
            map: Field::from_vec(wide, high, map),
            extent,
            untouched: all.untouched / all.count,
        }
    }

    /// The same for programs.
    pub fn document(&self) -> document::Deviation {
        let (greatest_um, at) = self.greatest;
        document::Deviation {
            rms_um: self.rms_um,
            mean_um: self.mean_um,
            range_um: [self.range_um.0, self.range_um.1],
            greatest_um,
            greatest_at_mm: at.to_array(),
            untouched: self.untouched,
        }
    }
}

struct Tally {
    cells: Vec<(f64, f64)>,
    count: f64,
    sum: f64,
    square: f64,
    greatest: (f64, DVec2),
    untouched: f64,
    /// Counts by sign and magnitude, from a thousandth of a um.
    bins: Vec<f64>,
}

/// Bins of a magnitude, 20 to a decade from 1e-3 um to 1e5 um, for either sign.
const BINS: usize = 160;

impl Tally {
    fn new(wide: usize) -> Self {
        let (count, sum, square, untouched) = (0.0, 0.0, 0.0, 0.0);
        let (cells, bins) = (vec![(0.0, 0.0); wide], vec![0.0; 2 * BINS]);
        Self { cells, count, sum, square, greatest: (0.0, DVec2::ZERO), untouched, bins }
    }

    fn add(&mut self, cell: usize, um: f64, at: DVec2, flat: bool) {
        self.cells[cell].0 += um;
        self.cells[cell].1 += 1.0;
        self.count += 1.0;
        self.sum += um;
        self.square += um * um;
        self.untouched += f64::from(u8::from(flat));
        if um.abs() > self.greatest.0.abs() {
            self.greatest = (um, at);
        }
        let bin = (20.0 * (um.abs() * 1e3).max(1.0).log10()).min((BINS - 1) as f64) as usize;
        self.bins[if um < 0.0 { BINS - 1 - bin } else { BINS + bin }] += 1.0;
    }

    fn join(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.square += other.square;
        self.untouched += other.untouched;
        if other.greatest.0.abs() > self.greatest.0.abs() {
            self.greatest = other.greatest;
        }
        self.bins.iter_mut().zip(&other.bins).for_each(|(bin, more)| *bin += more);
    }

    fn quantile(&self, part: f64) -> f64 {
        let mut sum = 0.0;
        let found = self.bins.iter().position(|count| {
            sum += count;
            sum >= part * self.count
        });
        let bin = found.unwrap_or(BINS);
        let of = |k: usize| 1e-3 * 10f64.powf((k as f64 + 0.5) / 20.0);
        if bin < BINS { -of(BINS - 1 - bin) } else { of(bin - BINS) }
    }
}
