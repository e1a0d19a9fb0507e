//! How the exit face of a solid is understood, and how rays find it.

/// How the exit face is understood between its vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Surface {
    /// The not-a-knot bicubic spline through the vertices of a regular grid. Only for a
    /// [`Block`](crate::Block).
    #[default]
    Spline,
    /// Flat triangles with normals interpolated linearly between vertices, as renderers shade; of a
    /// block whose [slopes](crate::Block::with_sloped_face) are known, with these.
    Smooth,
    /// Flat triangles with their own normals: the geometry of the file taken literally.
    Facets,
}

/// Where the light leaves the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Geometry {
    /// From the surface where it really is.
    #[default]
    Displaced,
    /// From the mean exit plane z = 0 with the normals of the surface: the assumption of the
    /// paper's section 2.1. Only for a [`Block`](crate::Block).
    NormalMappedPlane,
}

/// How the crossing of a ray with the exit face is found. Both ways give the same landing points,
/// to the last bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Traversal {
    /// By a bounding volume hierarchy over the face, as for any mesh.
    #[default]
    Bvh,
    /// Light along the axis is tried on the cell above it, which in a height field on a grid is the
    /// one that it meets, and other rays that are steeper than the face on the cells where they are
    /// as high as it; the rest goes through the hierarchy. Only for a
    /// [`Block`](crate::Block); two to three times as fast.
    Grid,
}
