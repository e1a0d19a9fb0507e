//! What the user should know of a solution: what it reached, where it is weakest, and what would
//! help.

use crate::{
    bench::Bench,
    forward::Caustic,
    grid::Field,
    optim::{Summary, Termination},
};

/// Share of the light in folded beams that is worth a word.
const FOLDED: f64 = 1e-5;
/// Relative RMS error of a picture that is worth a word.
const WEAK: f64 = 0.05;

/// What a surface could not be given.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flaws {
    /// Lens nodes whose ray does not land as planned.
    pub(super) missed: usize,
    /// The closed loop's iteration that led to the surface did not converge.
    pub(super) unconverged: bool,
    /// What softening did.
    pub(super) softened: Option<Softening>,
}

/// How a face was made manufacturable.
#[derive(Clone, Copy, Debug)]
pub(super) struct Softening {
    pub(super) radius_mm: f64,
    /// Nodes that still break a rule.
    pub(super) violations: usize,
}

/// Adds warnings to the summary of a finished run. `unsoftened` is the least error of a face before
/// softening.
pub(super) fn describe(
    seen: &Caustic,
    wanted: &Field<f64>,
    error: f64,
    flaws: &Flaws,
    unsoftened: f64,
    bench: &Bench,
    summary: &mut Summary,
) {
    let mut warnings = Vec::new();
    // Coarse levels are only a start, and rounds of the closed loop that went wrong were taken
    // back.
    let finest = summary.levels.iter().rposition(|level| level.stage == super::level::STAGE);
    let last = summary.levels.len().checked_sub(1).filter(|_| flaws.unconverged);
    for level in [finest, last].into_iter().flatten().map(|k| &summary.levels[k]) {
        if level.termination == Termination::Converged {
            continue;
        }
        let reached = level.iterations.last().map_or(f64::NAN, |iteration| iteration.objective);
        warnings.push(format!(
            "{} on {} x {} receiver nodes did not converge ({}): the residual's root mean square is still {reached:.1e}; a larger offset makes the picture easier",
            level.stage,
            level.nx,
            level.ny,
            level.termination
        ));
    }
    let place = weakest(&seen.irradiance, wanted, bench);
    if seen.folded > FOLDED {
        warnings.push(format!(
            "{:.3} % of the light passes through folds at creases of the face; a larger offset or more nodes remove them",
            100.0 * seen.folded
        ));
    }
    warnings.extend(of_missed(flaws.missed));
    if let Some(Softening { radius_mm, violations }) = flaws.softened {
        warnings.push(format!(
            "a least radius of {radius_mm} mm without folds costs accuracy: the light differs from the picture by {error:.4} of its mean (root mean square), at best by {unsoftened:.4} before softening"
        ));
        if violations > 0 {
            warnings.push(format!(
                "{violations} nodes of the face are still sharper than {radius_mm} mm or folded; take a smaller radius or a larger offset"
            ));
        }
    }
    if error > WEAK {
        warnings.push(format!(
            "the light differs from the picture by {error:.3} of its mean (root mean square), most {place}; more nodes or a larger offset bring it closer"
        ));
    }
    if seen.outside > 1e-3 || seen.reflected > 0.0 {
        warnings.push(format!(
            "{:.2} % of the light misses the window and {:.2} % is totally reflected",
            100.0 * seen.outside,
            100.0 * seen.reflected
        ));
    }
    summary.warnings.extend(warnings);
}

/// What is said of nodes whose ray does not land as planned.
pub(super) fn of_missed(missed: usize) -> Option<String> {
    (missed > 0).then(|| {
        format!(
            "{missed} nodes of the face lie on creases sharper than the grid, where no ray lands as planned; more nodes or a larger offset help"
        )
    })
}

/// Where on the receiver the light is furthest from what is wanted.
fn weakest(seen: &Field<f64>, wanted: &Field<f64>, bench: &Bench) -> String {
    let (nx, ny) = (wanted.nx(), wanted.ny());
    let difference = |k: usize| seen.as_slice()[k] - wanted.as_slice()[k];
    let worst = (0..nx * ny).max_by(|&a, &b| difference(a).abs().total_cmp(&difference(b).abs())).unwrap_or(0);
    let cell = glam::DVec2::new((worst % nx) as f64 + 0.5, (worst / nx) as f64 + 0.5);
    let at = bench.window_centre_mm()
        + bench.window().lower()
        + cell * bench.window().as_vec() / glam::DVec2::new(nx as f64, ny as f64);
    format!(
        "at x = {:.1} mm, y = {:.1} mm of the receiver, where it is {:.2} instead of {:.2}",
        at.x,
        at.y,
        seen.as_slice()[worst],
        wanted.as_slice()[worst]
    )
}
