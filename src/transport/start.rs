//! Where the iteration starts, and whether the bench allows any picture at all.

use super::{
    equation::{Equation, State},
    newton::{Criterion, Halt, Newton},
    path::OpticalPath,
    spline::{BorderSlopes, PathSpline, ReceiverGrid},
};
use crate::{
    bench::{Bench, ExitFace},
    grid::Field,
    light::Light,
    solver::{Progress, SolveError},
    surface::HeightField,
};
use glam::DVec2;

/// Refuses a bench on which even the plain map of window to block cannot be drawn.
///
/// # Errors
/// Where light would have to be bent by more than refraction can.
pub(super) fn check(bench: &Bench) -> Result<(), SolveError> {
    const POINTS: usize = 9;
    let (path, light) = (OpticalPath::new(bench), bench.incidence());
    let outline = bench.contour();
    let mut worst: Option<(DVec2, f64)> = None;
    for j in 0..POINTS {
        for i in 0..POINTS {
            let node = bench.block().node(i, j, POINTS, POINTS);
            let (x, y) = (
                if outline.contains(node) { node } else { outline.foot(node) },
                bench.window().node(i, j, POINTS, POINTS) + bench.window_centre_mm(),
            );
            let direction = bench.receiver().point(y) - x.extend(0.0);
            if path.plain_ray(x, y).is_none() {
                let deflection = direction.angle_between(light.at(x.extend(0.0)).direction);
                if worst.is_none_or(|(_, other)| deflection > other) {
                    worst = Some((x, deflection));
                }
            }
        }
    }
    match (worst, bench.exit_face()) {
        (Some((at_mm, deflection)), ExitFace::Refracts { ior }) => Err(SolveError::TotalInternalReflection {
            at_mm,
            deflection_deg: deflection.to_degrees(),
            limit_deg: (1.0 / ior).acos().to_degrees(),
        }),
        _ => Ok(()),
    }
}

/// Names the source where a state's rays do not exist because of it.
pub(super) fn explain(error: SolveError, bench: &Bench) -> SolveError {
    match (error, bench.light()) {
        (SolveError::Failed { .. }, Light::Point { position_mm, .. }) => SolveError::SourceTooNear { position_mm },
        (error, _) => error,
    }
}

/// Refuses a face that cuts through the entry face of its block, or rises past the lamp in front of
/// its mirror.
///
/// # Errors
/// Such a face. Parallel light reaches any.
pub(super) fn check_light_reaches(surface: &HeightField, bench: &Bench) -> Result<(), SolveError> {
    let Light::Point { position_mm, thickness_mm, .. } = bench.light() else { return Ok(()) };
    let (low, high) = surface.range_mm();
    let (height_mm, limit_mm, what, reaches) = match bench.exit_face() {
        ExitFace::Refracts { .. } => (low, -thickness_mm, "entry face", low <= -thickness_mm),
        ExitFace::Reflects => (high, position_mm.z, "light source", high >= position_mm.z),
    };
    if reaches { Err(SolveError::ReachesLight { height_mm, limit_mm, what }) } else { Ok(()) }
}

/// Steps from a rectangle to the outline of the lens.
const ROUNDINGS: usize = 8;

/// Takes a state that fits a rectangle to the outline of the lens, on the coarsest grid: the
/// corners grow step by step. What a step lacks is left to the next.
///
/// # Errors
/// A solve that was cancelled.
pub(super) fn round_corners(
    bench: &Bench,
    grid: ReceiverGrid,
    light: &Field<f64>,
    newton: &mut Newton,
    state: &mut State,
    criterion: Criterion,
    progress: &dyn Progress,
) -> Result<(), SolveError> {
    let (outline, mut equation) = (bench.contour(), Equation::new(bench, grid, light));
    if outline.is_rectangle() {
        return Ok(());
    }
    for step in 1..=ROUNDINGS {
        equation.contour = outline.with_corners(step as f64 / ROUNDINGS as f64);
        state.mu = equation.contour.share_of_extent().ln();
        let mut next = state.clone();
        match newton.run(&equation, &mut next, criterion, progress) {
            Ok(_) => *state = next,
            Err(Halt::NoRays) => {}
            Err(Halt::Cancelled) => return Err(SolveError::Cancelled),
        }
    }
    Ok(())
}

/// A state whose map is close to the plain one of window to the extent of the block: exact along
/// both axes through the centre of the window.
pub(super) fn plain(bench: &Bench, grid: ReceiverGrid) -> State {
    let path = OpticalPath::new(bench);
    let (nx, ny) = grid.nodes();
    let (lens, window) = (bench.block().as_vec(), bench.window().as_vec());
    let centre = bench.window_centre_mm();
    let slope = |offset: DVec2| {
        let y = centre + offset;
        let to = bench.receiver().point(y);
        path.slope_for(y, (to - (offset * lens / window).extend(0.0)).normalize())
    };
    // u is the sum of one function of x and one of y, integrated with Simpson's rule.
    let integrate = |n: usize, step: DVec2, axis: usize| {
        let at = |k: f64| slope(step * (k - (n - 1) as f64 / 2.0))[axis];
        let mut values = vec![0.0; n];
        for k in 1..n {
            let (a, b) = ((k - 1) as f64, k as f64);
            values[k] = values[k - 1] + (at(a) + 4.0 * at(0.5 * (a + b)) + at(b)) / 6.0 * step[axis];
        }
        (values, at(0.0), at((n - 1) as f64))
    };
    let (along_x, left, right) = integrate(nx, DVec2::new(grid.spacing.x, 0.0), 0);
    let (along_y, lower, upper) = integrate(ny, DVec2::new(0.0, grid.spacing.y), 1);
    let slopes =
        BorderSlopes { left: vec![left; ny], right: vec![right; ny], lower: vec![lower; nx], upper: vec![upper; nx] };
    let values = Field::from_fn(nx, ny, |i, j| along_x[i] + along_y[j]);
    State { spline: PathSpline::through(grid, &values, &slopes), slopes, mu: 0.0 }
}
