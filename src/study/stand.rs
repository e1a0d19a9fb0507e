//! How a block stands on its bench, as plain numbers: for drawings, and for light that moves.

use super::material::Spectrum;
use crate::{irradiance::SourceSize, solid::Solid, spec::Settings, surface::HeightField};
use glam::{DVec2, DVec3};
use glasswarp_verify::{Emission, Light, Optics, Scene};
use serde::Serialize;

/// A block on its bench, in the bench's frame, mm and radians.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stand {
    /// None for a mirror.
    pub ior: Option<f64>,
    /// Width and height of the exit face.
    pub face_mm: [f64; 2],
    /// Semi-axes of the face's corners; 0 of a rectangle.
    pub corner_mm: [f64; 2],
    /// Width and height of the whole block.
    pub stock_mm: [f64; 2],
    /// The entry face.
    pub entry_z_mm: f64,
    /// The highest point of the block.
    pub top_z_mm: f64,
    /// From the mean plane of the exit face to the receiver.
    pub distance_mm: f64,
    /// Rotation vector of the receiver.
    pub receiver_turned: [f64; 3],
    /// Width and height of the window on the receiver.
    pub window_mm: [f64; 2],
    /// Its middle, along the receiver's own axes.
    pub window_centre_mm: [f64; 2],
    /// Ideal light.
    pub light: StandingLight,
    /// Semi-axes of the source that the block was designed for: of parallel light in radians, of a
    /// lamp in mm.
    pub source_radius: Option<[f64; 2]>,
    /// How its index follows the wavelength, where that is known.
    pub spectrum: Option<Spectrum>,
    /// What of the light these numbers do not say.
    pub unsaid: Option<&'static str>,
}

/// Ideal light, as plain numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum StandingLight {
    /// Along a unit vector.
    Parallel {
        /// Where it goes.
        direction: [f64; 3],
    },
    /// From a point.
    Point {
        /// Where it comes from.
        position_mm: [f64; 3],
        /// The axis of the lamp, a unit vector.
        axis: [f64; 3],
        /// `isotropic`, `lambertian` or `gaussian`, or `table`, which is not said.
        emission: &'static str,
        /// Of a Gaussian: the angle at which half of the intensity is left.
        half_angle: f64,
    },
}

impl Stand {
    /// A design on its bench.
    pub fn of_design(solid: &Solid, scene: &Scene, settings: &Settings) -> Self {
        let z = (solid.entry_z_mm(), solid.entry_z_mm() + solid.thickness_mm());
        Self::of(solid.surface(), z, solid.stock_extent().as_vec(), scene, Some(settings))
    }

    /// A block of this face on the bench of a scene. `stock_mm` is the size of the whole block.
    pub fn of(
        surface: &HeightField,
        (entry_z_mm, top_z_mm): (f64, f64),
        stock_mm: DVec2,
        scene: &Scene,
        settings: Option<&Settings>,
    ) -> Self {
        let mut unsaid = match scene {
            _ if !scene.before.is_empty() => Some("what stands before the block"),
            _ => scene.profile.is_some().then_some("the measured profile of the beam"),
        };
        let light = match &scene.light {
            Light::Parallel { direction } => StandingLight::Parallel { direction: direction.normalize().to_array() },
            Light::Point { position_mm, emission, axis } => {
                let (emission, half_angle) = match emission {
                    Emission::Isotropic => ("isotropic", 0.0),
                    Emission::Lambertian => ("lambertian", 0.0),
                    Emission::Gaussian { half_angle } => ("gaussian", *half_angle),
                    Emission::Table(_) => {
                        unsaid = Some("the table of the lamp's intensity");
                        ("table", 0.0)
                    }
                };
                // The bench's own axis where the lamp has none.
                let along = if scene.optics == Optics::Reflects { DVec3::NEG_Z } else { DVec3::Z };
                let axis = axis.map_or(along, DVec3::normalize).to_array();
                StandingLight::Point { position_mm: position_mm.to_array(), axis, emission, half_angle }
            }
        };
        let source_radius = settings.and_then(Settings::spread_source).map(|source| match source {
            SourceSize::Angle { diameter } => [0.5 * diameter; 2],
            SourceSize::Disc { diameter_mm } => [0.5 * diameter_mm; 2],
            SourceSize::Rectangle { width_mm, height_mm } => [0.5 * width_mm, 0.5 * height_mm],
        });
        let refracts = scene.optics != Optics::Reflects;
        Self {
            ior: if let Optics::Refracts { ior } = scene.optics { Some(ior) } else { None },
            face_mm: surface.extent().as_vec().to_array(),
            corner_mm: surface.contour().radius_mm().to_array(),
            stock_mm: stock_mm.to_array(),
            entry_z_mm,
            top_z_mm,
            distance_mm: scene.distance_mm,
            receiver_turned: scene.receiver_turned.to_array(),
            window_mm: scene.window.size_mm.to_array(),
            window_centre_mm: scene.window.centre_mm.to_array(),
            light,
            source_radius,
            spectrum: settings.filter(|_| refracts).and_then(Spectrum::of),
            unsaid,
        }
    }
}
