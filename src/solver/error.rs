use glam::{DVec2, DVec3};

/// Why no surface could be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// Light would have to be bent by more than refraction can.
    #[error(
        "the light would be totally reflected inside the block at x = {:.2} mm, y = {:.2} mm: it would have to be bent by {deflection_deg:.1} degrees, and this material bends by less than {limit_deg:.1} degrees; move the receiver further away, take a smaller window or a higher index",
        at_mm.x, at_mm.y
    )]
    TotalInternalReflection {
        /// Point of the exit face, mm.
        at_mm: DVec2,
        /// Deflection asked for, degrees.
        deflection_deg: f64,
        /// Limit of the material, degrees.
        limit_deg: f64,
    },
    /// A target cell gets no light at all, and this solver divides by it.
    #[error(
        "the darkest part of the picture is {least:.2e} of the mean; this solver needs at least {limit:.0e}: add an offset"
    )]
    TooDark {
        /// Least target irradiance, relative to the mean.
        least: f64,
        /// Least that the solver takes.
        limit: f64,
    },
    /// The surface would touch or pass the receiver.
    #[error(
        "the exit face would rise {height_mm:.1} mm above its mean plane, to the receiver at {distance_mm:.1} mm: move the receiver further away"
    )]
    ReachesReceiver {
        /// Highest point of the face, mm.
        height_mm: f64,
        /// Distance of the receiver, mm.
        distance_mm: f64,
    },
    /// The surface would cut through the entry face of its block, or rise past the source of its
    /// light.
    #[error(
        "the exit face would extend to z = {height_mm:.1} mm, past the {what} at z = {limit_mm:.1} mm: take a thicker block, or move receiver and light further away"
    )]
    ReachesLight {
        /// Lowest point of a face of glass, highest one of a mirror, mm.
        height_mm: f64,
        /// Where the light comes from, mm.
        limit_mm: f64,
        /// What is there.
        what: &'static str,
    },
    /// The light would have to be turned by more than a face between its source and the receiver
    /// can.
    #[error(
        "no face was found that draws this picture with the light source at ({}, {}, {}) mm: move the source further away, take a thicker block, or move the receiver further away",
        position_mm.x, position_mm.y, position_mm.z
    )]
    SourceTooNear {
        /// The source, mm.
        position_mm: DVec3,
    },
    /// The bench asks for something this solver does not do.
    #[error("the {solver} solver does not do {what}; the {able} solver does")]
    Unsupported {
        /// Name of the solver.
        solver: &'static str,
        /// What was asked for.
        what: &'static str,
        /// Name of a solver that does it.
        able: &'static str,
    },
    /// A face that no height field can be.
    #[error(
        "the {solver} solver does not do faces that hang over, as this light would need at x = {:.2} mm, y = {:.2} mm: let the light come closer to the axis",
        at_mm.x, at_mm.y
    )]
    Overhang {
        /// Name of the solver.
        solver: &'static str,
        /// Point of the exit face, mm.
        at_mm: DVec2,
    },
    /// More pictures than this solver can draw at once.
    #[error(
        "the problem has {targets} targets; the {solver} solver draws at most {limit} at once: solve for each of them alone"
    )]
    Targets {
        /// Name of the solver.
        solver: &'static str,
        /// Targets of the problem.
        targets: usize,
        /// Most that the solver draws.
        limit: usize,
    },
    /// More free faces than this solver can find.
    #[error(
        "the problem has {faces} free faces; the {solver} solver finds at most {limit}: leave only the exit face free"
    )]
    FreeFaces {
        /// Name of the solver.
        solver: &'static str,
        /// Free faces of the problem.
        faces: usize,
        /// Most that the solver finds.
        limit: usize,
    },
    /// A grid that holds no picture, or whose indices nobody has tried.
    #[error(
        "the {solver} solver does not do height fields of {nx} x {ny} nodes (both must lie between {least} and {greatest})"
    )]
    Nodes {
        /// Name of the solver.
        solver: &'static str,
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
        /// Fewest along either.
        least: usize,
        /// Most along either.
        greatest: usize,
    },
    /// The caller wants no result any more, see [`Progress::report`](super::Progress::report).
    #[error("the design was cancelled")]
    Cancelled,
    /// The numerics broke down; the result would be wrong.
    #[error("the {solver} solver failed on the level of {nx} x {ny} nodes: {why}")]
    Failed {
        /// Name of the solver.
        solver: &'static str,
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
        /// What happened.
        why: String,
    },
}
