//! What blocks are made of.

/// A transparent material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Name on the command line.
    pub name: &'static str,
    /// What a supplier calls it.
    pub description: &'static str,
    /// Refractive index at the yellow d line (587.6 nm) against air.
    pub ior: f64,
}

/// The materials known by name. Indices are the usual catalogue values; batches differ by some units of the third decimal.
pub const MATERIALS: &[Material] = &[
    Material { name: "pmma", description: "cast acrylic, Plexiglas, Perspex", ior: 1.49 },
    Material { name: "polycarbonate", description: "Makrolon, Lexan", ior: 1.585 },
    Material { name: "polystyrene", description: "clear polystyrene", ior: 1.59 },
    Material { name: "petg", description: "Vivak", ior: 1.57 },
    Material { name: "bk7", description: "Schott N-BK7 optical crown glass", ior: 1.5168 },
    Material { name: "soda-lime", description: "float or window glass", ior: 1.523 },
    Material { name: "fused-silica", description: "synthetic quartz glass", ior: 1.4585 },
];

/// The material of this name, without regard to case.
pub fn by_name(name: &str) -> Option<&'static Material> {
    MATERIALS.iter().find(|material| material.name.eq_ignore_ascii_case(name))
}
