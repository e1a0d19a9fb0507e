//! White light: what becomes of a picture in colours that its block bends otherwise.

use super::{judge::Subject, material::no_dispersion};
use crate::{
    failure::Failure,
    materials::{self, D_LINE_NM, Material},
    record::document,
    spec::Settings,
};
use glasswarp_verify::{
    Image, Optics, Scene,
    dispersion::{Dispersed, Fringing, disperse},
};

/// A block in white light.
pub struct WhiteLight {
    /// Red, green and blue, the primaries of sRGB, linear.
    pub rgb: [Image; 3],
    /// How far its colours part.
    pub fringing: Fringing,
    /// The name of its material.
    pub material: &'static str,
    /// The wavelength that it is designed for.
    pub designed_nm: f64,
}

impl WhiteLight {
    /// Traces a block in white light, by so many beams.
    ///
    /// # Errors
    /// Another solid, a mirror, a material of which nothing is known.
    pub fn of(
        subject: &Subject,
        scene: &Scene,
        settings: Option<&Settings>,
        beams: (usize, usize),
    ) -> Result<Self, Failure> {
        let material = Self::material(subject, scene, settings)?;
        let Subject::Block(block) = subject else { unreachable!("other solids have been refused") };
        let index = |nm: f64| material.ior_at(nm).unwrap_or(material.ior);
        let Dispersed { rgb, fringing, .. } = disperse(block, scene, &index, beams).map_err(Failure::refused)?;
        let designed_nm =
            settings.and_then(|settings| settings.wavelength).map_or(D_LINE_NM, |wavelength| wavelength.nm);
        Ok(Self { rgb, fringing, material: material.name, designed_nm })
    }

    /// What a block is made of that can be looked at in white light; asked before any work.
    ///
    /// # Errors
    /// Those of [`of`](Self::of).
    pub fn material(
        subject: &Subject,
        scene: &Scene,
        settings: Option<&Settings>,
    ) -> Result<&'static Material, Failure> {
        if !matches!(subject, Subject::Block(_)) {
            return Err(Failure::Usage("`white` looks at blocks; this is another solid".into()));
        }
        if scene.optics == Optics::Reflects {
            return Err(Failure::Usage(
                "`white`: a mirror reflects all colours alike, there is no dispersion to look at".into(),
            ));
        }
        if !scene.before.is_empty() {
            return Err(Failure::Usage(
                "`white`: this block stands behind another, of whose index in other colours nothing is known here"
                    .into(),
            ));
        }
        let material = settings.and_then(|settings| settings.material.as_deref()).and_then(materials::by_name);
        let material = material.ok_or_else(|| {
            Failure::Usage(
                "`white` needs to know what the block is made of, and its side file names an index only: design it with `material`"
                    .into(),
            )
        })?;
        if material.dispersion.is_none() {
            return Err(no_dispersion(material));
        }
        Ok(material)
    }

    /// The same for programs.
    pub fn document(&self) -> document::White {
        let fringing = &self.fringing;
        document::White {
            ior: fringing.ior,
            parting_rms_mm: document::finite(fringing.rms_mm),
            parting_worst_mm: document::finite(fringing.worst_mm),
            rel_rms: document::finite(fringing.rel_rms),
        }
    }
}
