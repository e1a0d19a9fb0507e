//! The renderers that are asked.

use crate::scene::Fresnel;
use std::ffi::OsString;

/// An independent program that can follow light through glass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Renderer {
    /// POV-Ray 3.7: rays, and photon maps.
    PovRay,
    /// Blender's Cycles, 3.4 or later: rays, and manifold next-event estimation.
    Blender,
    /// Mitsuba 3, a package of Python: rays, and particle tracing.
    Mitsuba,
    /// LuxCoreRender 2, a package of Python: light tracing. It has no map mode, for each of its
    /// camera rays passes somewhere within its pixel.
    LuxCore,
}

impl Renderer {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::PovRay => "POV-Ray",
            Self::Blender => "Blender",
            Self::Mitsuba => "Mitsuba",
            Self::LuxCore => "LuxCore",
        }
    }

    /// The executable: for packages of Python the interpreter, `$GLASSWARP_PYTHON` or else
    /// `python3`.
    pub fn program(self) -> OsString {
        match self {
            Self::PovRay => "povray".into(),
            Self::Blender => "blender".into(),
            Self::Mitsuba | Self::LuxCore => std::env::var_os("GLASSWARP_PYTHON").unwrap_or_else(|| "python3".into()),
        }
    }

    /// How to get it.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::PovRay => "Debian and Ubuntu: apt-get install povray; else https://www.povray.org",
            Self::Blender => "Debian and Ubuntu: apt-get install blender; else https://www.blender.org",
            Self::Mitsuba => "pip install mitsuba numpy; name the interpreter in GLASSWARP_PYTHON",
            Self::LuxCore => "pip install pyluxcore numpy; name the interpreter in GLASSWARP_PYTHON",
        }
    }

    /// The files of a scene's folder: those that `Comparison` writes, and what the renderer makes
    /// of them. `image` is for image mode.
    pub fn files(self, image: bool) -> Vec<String> {
        let mode = if image { "image" } else { "map" };
        let (mesh, scene, picture): (&[&str], _, _) = match self {
            Self::PovRay => (&["block.inc"], "pov", "png"),
            Self::Blender | Self::Mitsuba | Self::LuxCore => {
                (&["positions.f32", "normals.f32", "triangles.u32"], "py", "exr")
            }
        };
        let runs = if image { vec!["image-1", "image-2"] } else { vec!["map"] };
        let made = runs.iter().flat_map(|run| [format!("{run}.{picture}"), format!("{run}.log")]);
        let fixed = mesh.iter().map(|&name| name.to_owned());
        fixed.chain(["README.txt".to_owned(), format!("{mode}.{scene}")]).chain(made).collect()
    }

    /// Whether this renderer's caustic has Fresnel's losses in it.
    pub(super) fn fresnel(self) -> Fresnel {
        match self {
            Self::PovRay => Fresnel::Off,
            Self::Blender | Self::Mitsuba | Self::LuxCore => Fresnel::On,
        }
    }
}
