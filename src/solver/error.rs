use glam::{DVec2, DVec3};

/// Why no two free faces draw two pictures.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TwoFacesError {
    /// A bench for which two free faces are not solved for.
    #[error("two free faces are solved for {able} only: {remedy}")]
    Bench {
        /// What is solved for.
        able: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A problem with one free face.
    #[error("this solver is for two free faces, and the problem leaves one: take the transport solver")]
    OneFree,
    /// Not two pictures.
    #[error(
        "two free faces draw two pictures, and the problem has {targets}: give two, or leave only the exit face free"
    )]
    Pictures {
        /// Targets of the problem.
        targets: usize,
    },
    /// Receivers in the wrong order.
    #[error(
        "the second picture's receiver, at {far_mm} mm, does not stand behind the first one's, at {near_mm} mm: give the nearer one first"
    )]
    Order {
        /// Distances from the block, mm.
        near_mm: f64,
        /// The same.
        far_mm: f64,
    },
    /// A thickness that no block has.
    #[error("a block of {thickness_mm} mm; its thickness must lie between {least_mm} mm and {greatest_mm} mm")]
    Thickness {
        /// Between the mean planes, mm.
        thickness_mm: f64,
        /// Limits, mm.
        least_mm: f64,
        /// The same.
        greatest_mm: f64,
    },
    /// The light between the receivers would leave the block beyond its border.
    #[error(
        "light that fills windows of these sizes would leave the block on {width_mm:.1} mm x {height_mm:.1} mm, more than the block: take a smaller first or a larger second window, or a larger block"
    )]
    Beyond {
        /// Size of what is lit of the exit face, mm.
        width_mm: f64,
        /// The same.
        height_mm: f64,
    },
    /// Light that gathers before the first receiver.
    #[error(
        "the light of these two pictures would gather before the first receiver (it keeps {margin:.2} of its width at the block, and less than nothing is a focus): move the second receiver from {far_mm:.0} mm to {wanted_mm:.0} mm or further, the first nearer to the block, or raise the offset"
    )]
    Focus {
        /// The narrowest width of the light at the block, in units of that on the first receiver.
        margin: f64,
        /// Where the second receiver stands, mm.
        far_mm: f64,
        /// Where it would be well, mm.
        wanted_mm: f64,
    },
    /// Faces that are too steep.
    #[error(
        "a block of {thickness_mm:.0} mm is too thin to carry the light of these two pictures from one face to the other: take one of {wanted_mm:.0} mm, or raise the offset"
    )]
    Thin {
        /// Between the mean planes, mm.
        thickness_mm: f64,
        /// What would be well, mm.
        wanted_mm: f64,
    },
    /// Faces that cut each other.
    #[error(
        "the two faces of a block of {thickness_mm:.0} mm would leave {glass_mm:.1} mm of glass at the thinnest place: take one of {wanted_mm:.0} mm, or raise the offset"
    )]
    Cuts {
        /// Between the mean planes, mm.
        thickness_mm: f64,
        /// Least glass, mm; below nothing they cut.
        glass_mm: f64,
        /// What would be well, mm.
        wanted_mm: f64,
    },
}

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
    /// Two pictures that two free faces cannot draw as asked.
    #[error(transparent)]
    TwoFaces(TwoFacesError),
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
