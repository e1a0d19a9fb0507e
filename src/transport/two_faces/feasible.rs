//! Whether two pictures can be drawn from two receivers so far apart by a block so thick, and what
//! would make them possible.

use super::{
    margins::{Margins, narrowest},
    solve::{Solved, Task},
};
use crate::{
    optim::Summary,
    solver::{SolveError, TwoFacesError},
    transport::{map::Map, spline::PathSpline},
};
use rayon::prelude::*;

/// What is left at the exit face of the narrowest stretch of the light, at least: 0 is a focus on the
/// face.
const LEAST_MARGIN: f64 = 0.05;
/// The margin that is advised.
const GOOD_MARGIN: f64 = 0.4;
/// Least glass along the axis, as a share of the thickness.
const LEAST_GLASS: f64 = 0.02;
/// Nodes at which the glass of a coarse solution is looked at.
const ROUGHLY: (usize, usize) = (49, 49);
/// Steepest slope of a face.
const MOST_SLOPE: f64 = 2.0;
/// The slope that is advised.
const GOOD_SLOPE: f64 = 0.5;

impl Solved {
    /// What the rays of all nodes leave; none where there is no ray.
    fn margins(&self, task: &Task<'_>) -> Option<Margins> {
        let map = self.exit_map(task);
        let spline = &self.exit.state.spline;
        let (_, ny) = spline.grid.nodes();
        let rows: Option<Vec<Margins>> = (0..ny)
            .into_par_iter()
            .map(|j| {
                let (mut row, mut real, mut nearby) = (Margins::NONE, true, None);
                spline.row_jets(j, |i, jet| {
                    match map.ray(spline.grid.node(i, j), jet.value, jet.slope, nearby.as_ref()) {
                        Some(ray) => {
                            row = row.with(&map.margins(&ray));
                            nearby = Some(ray);
                        }
                        None => real = false,
                    }
                });
                real.then_some(row)
            })
            .collect();
        Some(rows?.iter().fold(Margins::NONE, Margins::with))
    }
}

impl Margins {
    /// Tells what a solution leaves.
    pub(super) fn describe(&self, summary: &mut Summary) {
        let Self { stretch, slope, .. } = self;
        summary.notes.push(format!(
            "at the block the light keeps at least {stretch:.2} of its width on the first receiver (0 would be a focus), and the exit face is at most {slope:.2} steep"
        ));
        if *stretch < GOOD_MARGIN {
            summary.warnings.push(format!(
                "between block and first receiver the light gathers to {stretch:.2} of its width: hot spots on the way, and narrow tolerances; more than {GOOD_MARGIN} is advised: move the second receiver further away, or raise the offset"
            ));
        }
    }
}

impl Task<'_> {
    /// Refuses what a coarse solution shows to be impossible, before the finer ones; returns what it
    /// leaves.
    ///
    /// # Errors
    /// [`TwoFacesError`], with what would make it possible.
    pub(super) fn check(&self, solved: &Solved, converged: bool) -> Result<Margins, SolveError> {
        let phase = &solved.phase.state.spline;
        if self.margin(phase) < LEAST_MARGIN {
            return Err(self.too_near(phase));
        }
        let Some(margins) = solved.margins(self) else { return Err(self.too_thin(f64::INFINITY)) };
        tracing::debug!(?margins, converged, "what two free faces leave");
        if margins.highest_mm >= self.distances_mm[0] {
            return Err(SolveError::ReachesReceiver {
                height_mm: margins.highest_mm,
                distance_mm: self.distances_mm[0],
            });
        }
        if !converged || margins.slope > MOST_SLOPE {
            return Err(self.too_thin(margins.slope));
        }
        let glass_mm = self.faces(solved, ROUGHLY).least_glass_mm();
        if glass_mm.is_nan() || glass_mm < LEAST_GLASS * self.thickness_mm {
            return Err(self.cuts(glass_mm));
        }
        Ok(margins)
    }

    /// What is left at the mean exit plane of the narrowest stretch of the light.
    fn margin(&self, phase: &PathSpline) -> f64 {
        let (nx, ny) = phase.grid.nodes();
        let solved = |k: usize| super::outgoing::stretch(&phase.node_jet(k % nx, k / nx), self.distances_mm[0]);
        (0..nx * ny).map(|k| narrowest(solved(k))).fold(f64::INFINITY, f64::min)
    }

    /// That light gathers too much before the first receiver.
    pub(super) fn too_near(&self, phase: &PathSpline) -> SolveError {
        let [near_mm, far_mm] = self.distances_mm;
        let margin = self.margin(phase);
        // 1 - margin is the distance over that between the receivers, times what the pictures ask for.
        let wanted_mm = near_mm + (far_mm - near_mm) * (1.0 - margin) / (1.0 - GOOD_MARGIN);
        SolveError::TwoFaces(TwoFacesError::Focus { margin, far_mm, wanted_mm })
    }

    /// That the faces would be too steep.
    pub(super) fn too_thin(&self, slope: f64) -> SolveError {
        // Slopes are inverse to the thickness.
        let wanted_mm = self.thickness_mm * (slope / GOOD_SLOPE).clamp(2.0, 10.0);
        SolveError::TwoFaces(TwoFacesError::Thin { thickness_mm: self.thickness_mm, wanted_mm })
    }

    /// That one face would cut the other.
    pub(super) fn cuts(&self, glass_mm: f64) -> SolveError {
        let wanted_mm = self.thickness_mm - glass_mm.min(0.0) + 0.1 * self.thickness_mm;
        SolveError::TwoFaces(TwoFacesError::Cuts { thickness_mm: self.thickness_mm, glass_mm, wanted_mm })
    }
}
