//! What the light of a block shall be: the picture as the designer reads it, and what becomes of it
//! for light that is not perfect and for caustic meshes.

use super::{
    before::Before,
    bench::{bench_of, linear_picture},
    progress::begin,
};
use crate::{
    bench::Bench,
    failure::Failure,
    irradiance::{
        Border, CausticMesh, CausticMeshError, Deconvolution, Deconvolved, ImperfectLight, PictureError, Psf,
        PsfPicture, TargetIrradiance, Understood, to_picture_order,
    },
    record::SideFile,
    solver::{Event, Progress},
    spec::{DeconvolutionName, Host, Roughness, Settings, SolverName, SpeckFile, name_of},
};
use std::{io::Cursor, path::Path, sync::Arc};

/// Reads a picture, framed, as light plus a constant.
pub fn open_target(
    path: &Path,
    settings: &Settings,
    offset: f64,
    host: &dyn Host,
) -> Result<TargetIrradiance, Failure> {
    open_understood(path, settings, offset, host).map(|(target, ..)| target)
}

/// The same, how the picture was understood, and what to be warned of.
pub fn open_understood(
    path: &Path,
    settings: &Settings,
    offset: f64,
    host: &dyn Host,
) -> Result<(TargetIrradiance, Understood, Option<String>), Failure> {
    let _span = tracing::info_span!("read the picture", file = %path.display()).entered();
    let options = settings.picture_options(host.picture_memory());
    let read = host.read(path).map_err(PictureError::Io).and_then(|bytes| options.read(Cursor::new(bytes)));
    let (picture, understood) = read.map_err(|error| Failure::of_picture(path, error))?;
    let picture = settings.framing()?.apply(&picture).map_err(Failure::refused)?;
    let warning = understood.contrast(&picture).map_err(Failure::refused)?;
    let target = TargetIrradiance::from_picture(&picture, offset).map_err(Failure::refused)?;
    Ok((target, understood, warning))
}

/// Opens the picture of a speck of light.
fn open_speck(speck: &SpeckFile, host: &dyn Host) -> Result<PsfPicture, Failure> {
    let picture = linear_picture(&speck.path, "speck of light", host)?;
    PsfPicture::new(&to_picture_order(picture.values()), speck.pixel.mm).map_err(Failure::refused)
}

/// What is known of the light.
fn imperfect_light(settings: &Settings, host: &dyn Host) -> Result<ImperfectLight, Failure> {
    Ok(ImperfectLight {
        source: settings.spread_source(),
        roughness: settings.roughness.map(Roughness::slope),
        psf: settings.psf.as_ref().map(|speck| open_speck(speck, host)).transpose()?,
    })
}

/// What spreads the light on a bench, on so many cells of its window; none in perfect light.
pub(super) fn psf_of(
    settings: &Settings,
    bench: &Bench,
    cells: (usize, usize),
    host: &dyn Host,
) -> Result<Option<Psf>, Failure> {
    let light = imperfect_light(settings, host)?;
    if light.is_perfect() { Ok(None) } else { light.psf(bench, cells).map(Some).map_err(Failure::refused) }
}

/// The mesh on the receiver, if there is one.
fn caustic_mesh(settings: &Settings, bench: &Bench, host: &dyn Host) -> Result<Option<Arc<CausticMesh>>, Failure> {
    let Some(path) = &settings.caustic_mesh else { return Ok(None) };
    let solver = settings.solver.unwrap_or_default();
    if solver == SolverName::Transport {
        return Err(Failure::Usage(format!(
            "the {} solver has no mesh: it finds by itself which point of the block lights which point of the window; `caustic-mesh` fixes that, and needs `solver` warping or warping-paper",
            name_of(solver)
        )));
    }
    let unreadable = |source| Failure::refused(CausticMeshError::Read { path: path.clone(), source });
    let bytes = host.read(path).map_err(|_| unreadable(tobj::LoadError::OpenFileFailed))?;
    let mesh = CausticMesh::read(&bytes[..]).map_err(|error| match error {
        CausticMeshError::Parse(source) => unreadable(source),
        other => Failure::refused(other),
    })?;
    mesh.check(bench).map_err(Failure::refused)?;
    Ok(Some(Arc::new(mesh)))
}

/// What the light of a block shall be.
pub struct Requirements {
    /// The picture, to be seen in the light that there is.
    pub perceived: TargetIrradiance,
    /// The light to be drawn if light were perfect: `perceived` corrected for the spread.
    pub ideal: TargetIrradiance,
    /// What the solver is given: `ideal`, and with a mesh what lies beside it too.
    pub solver: TargetIrradiance,
    /// The mesh that the picture lies on, if there is one.
    pub mesh: Option<Arc<CausticMesh>>,
    /// The spread of the light, if it is not perfect.
    pub psf: Option<Psf>,
    /// How far the spread can be corrected for, unless that was not asked for.
    pub deconvolved: Option<Deconvolved>,
}

impl Requirements {
    /// What settings make of a picture on a bench.
    ///
    /// # Errors
    /// Files that cannot be read, spread that cannot be corrected for.
    pub fn of(
        picture: TargetIrradiance,
        bench: &Bench,
        settings: &Settings,
        host: &dyn Host,
        progress: &dyn Progress,
    ) -> Result<Self, Failure> {
        let mesh = caustic_mesh(settings, bench, host)?;
        let psf = psf_of(settings, bench, (picture.cells().nx(), picture.cells().ny()), host)?;
        let border = match settings.deconvolution.unwrap_or_default() {
            DeconvolutionName::Window => Some(Border::Dark),
            DeconvolutionName::Paper => Some(Border::Continued),
            DeconvolutionName::Off => None,
        };
        // Light that is said to have no size leaves nothing to do, which a preset cannot know.
        let sizeless = settings.source_size.is_some();
        if psf.is_none() && !sizeless && (settings.deconvolution.is_some() || settings.deconvolution_rounds.is_some()) {
            return Err(Failure::Usage(
                "there is no spread of light to correct for: add `source-size`, `roughness` or `psf` to `deconvolution`".into(),
            ));
        }
        let usual = Deconvolution::default();
        let deconvolved = match (&psf, border) {
            (Some(psf), Some(border)) => {
                let rounds = settings.deconvolution_rounds.unwrap_or(usual.rounds);
                begin(progress, "correcting for the spread of the light", rounds)?;
                let options = usual.with_rounds(rounds).with_border(border);
                let done = options.of_watched(&picture, psf, |done| progress.report(Event::Step { done }));
                Some(done.map_err(Failure::refused)?)
            }
            _ => None,
        };
        let solver = deconvolved.as_ref().map_or(&picture, |done| &done.target).clone();
        let covered = |light: &TargetIrradiance| match &mesh {
            Some(mesh) => mesh.covered(light, bench).map_err(Failure::refused),
            None => Ok(light.clone()),
        };
        Ok(Self { perceived: covered(&picture)?, ideal: covered(&solver)?, solver, psf, deconvolved, mesh })
    }

    /// The same for a block that has been made, by its side file, and the bench that it was made
    /// for.
    ///
    /// # Errors
    /// Those of [`of`](Self::of).
    pub fn of_side(
        picture: TargetIrradiance,
        side: &SideFile,
        before: &Before,
        host: &dyn Host,
        progress: &dyn Progress,
    ) -> Result<(Self, Bench), Failure> {
        let aspect = picture.cells().ny() as f64 / picture.cells().nx() as f64;
        let thickness_mm = -side.bench.entry_z_mm;
        // A row that nobody would design so is looked at nevertheless.
        let bench = bench_of(&side.design, before, aspect, thickness_mm, host)
            .or_else(|_| bench_of(&side.design, &Before::default(), aspect, thickness_mm, host))?;
        Ok((Self::of(picture, &bench, &side.design, host, progress)?, bench))
    }
}
