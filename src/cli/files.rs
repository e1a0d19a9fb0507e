//! The files of a design: each is written, hashed and read back while others still are, and a side
//! file lies beside them.

use super::{
    machine::{Machine, read_bare_mesh, read_mesh},
    outputs,
    side_files::{self, file_name, hash_of},
};
use crate::{
    export::{self, Design, Format, HeightMap, HeightMapError, HeightMapFormat},
    fabricate::Cutter,
    failure::Failure,
    grid::Outline,
    pipeline::DesignedBlock,
    record::SideFile,
    report::{
        pages::drawn::pictures,
        text::design::{height_map_note, step_note},
        write_png,
    },
    spec::Settings,
    study::{
        design::Plan,
        side_record::{height_map_entries, side_file_of_design},
    },
};
use glasswarp_verify::Mesh;
use std::{
    collections::{BTreeMap, BTreeSet},
    io::Write as _,
    path::{Path, PathBuf},
    sync::{
        OnceLock,
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    thread,
};

/// What is written of a design.
pub(crate) struct Task<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) block: &'a DesignedBlock,
    pub(crate) outputs: &'a [PathBuf],
    /// The cutter for which height maps are offset.
    pub(crate) tip: Option<Cutter>,
    /// Whether files are read back.
    pub(crate) verified: bool,
}

/// The files of a design.
pub(crate) struct Files {
    /// What there is to say of them.
    pub(crate) notes: Vec<String>,
    /// Those that are read back but for the [first](First), as read back from disk.
    pub(crate) others: Vec<(PathBuf, Mesh)>,
    /// The side file of the first.
    pub(crate) side: SideFile,
}

/// The file that is judged: the first STL, or without one the first output. It is what a shop would
/// get.
pub(crate) struct First<'a> {
    pub(crate) path: &'a Path,
    /// Its side file as it will be read, which is what a stranger will have.
    pub(crate) side: &'a SideFile,
    mesh: mpsc::Receiver<Mesh>,
}

impl First<'_> {
    /// Waits until it is read back. `None` if it could not be.
    pub(crate) fn mesh(&self) -> Option<Mesh> {
        self.mesh.recv().ok()
    }
}

/// What is written besides the outputs themselves and the report: side files, masks of height maps,
/// and pictures if they are asked for.
pub(crate) fn derived(
    outputs: &[PathBuf],
    settings: &Settings,
    (verified, with_pictures): (bool, bool),
) -> BTreeSet<PathBuf> {
    let side_files = outputs.iter().map(|output| side_files::path_beside(output));
    let has_masks = settings.outline.is_some_and(|outline| outline.0 != Outline::Rectangle);
    let masks = outputs
        .iter()
        .filter(|output| has_masks && HeightMapFormat::from_path(output).is_ok())
        .map(|output| mask_of(output));
    let pictures = if with_pictures { pictures(settings, verified) } else { Vec::new() };
    let pictures = pictures.into_iter().map(|kind| picture_of(&outputs[0], kind));
    side_files.chain(masks).chain(pictures).collect()
}

/// Where a picture of a design lies.
pub(crate) fn picture_of(output: &Path, kind: &str) -> PathBuf {
    output.with_extension(format!("{kind}.png"))
}

/// Where the mask of a height map lies.
fn mask_of(output: &Path) -> PathBuf {
    output.with_extension("mask.png")
}

/// A file that is made.
struct Made {
    note: Option<String>,
    sha256: String,
    mesh: Option<Mesh>,
}

/// Which of the outputs is judged: the first STL, or without one the first.
pub(crate) fn first(outputs: &[PathBuf]) -> usize {
    outputs.iter().position(|path| matches!(Format::from_path(path), Ok(Format::Stl))).unwrap_or(0)
}

/// Which files of a block are written that was designed within this process.
pub struct Saving<'a> {
    /// Where to; their extensions are the formats.
    pub outputs: &'a [PathBuf],
    /// The cutter whose tip goes where height maps say, if they are offset.
    pub tip: Option<Cutter>,
    /// The picture, to be written where the plan has it, if nothing lies there.
    pub picture: Option<&'a [u8]>,
    /// Whether files of others are replaced.
    pub force: bool,
}

/// Writes the files of a block as `glasswarp design` writes them, with their side files; none once
/// nobody `wanted` them any more. Returns what there is to say of them.
///
/// # Errors
/// A format that is none or cannot hold the block, an output that would replace an input or a file
/// of somebody's own, a disk that takes none.
pub fn save(
    plan: &Plan,
    block: &DesignedBlock,
    saving: &Saving<'_>,
    wanted: impl Fn() -> bool + Send + Sync + 'static,
) -> Result<Vec<String>, Failure> {
    let Saving { outputs, tip, picture, force } = *saving;
    for output in outputs {
        if HeightMapFormat::from_path(output).is_err() {
            Format::from_path(output).map_err(Failure::refused)?;
        }
    }
    let derived = derived(outputs, &plan.settings, (false, false));
    let own = Some(&plan.picture);
    let (read, written) = if picture.is_some() { (None, own) } else { (own, None) };
    let _turn = outputs::turn();
    outputs::force(force);
    let inputs = plan.settings.files().chain(read.map(PathBuf::as_path));
    outputs::plan_while(wanted, inputs, outputs.iter().chain(written).cloned().chain(derived))?;
    if let Some(bytes) = picture {
        export::write_atomically(&plan.picture, |out| out.write_all(bytes)).map_err(Failure::writing)?;
    }
    let task = Task { plan, block, outputs, tip, verified: false };
    make(&task, first(outputs), |_| ()).map(|(files, ())| files.notes)
}

/// Writes every file and the side files, and reads back what is judged. Meanwhile the `first` of
/// them can be looked at.
pub(crate) fn make<'a, T>(
    task: &Task<'a>,
    first: usize,
    meanwhile: impl FnOnce(First<'_>) -> T,
) -> Result<(Files, T), Failure> {
    let Task { plan, block, outputs, tip, .. } = *task;
    let wants_map = outputs.iter().any(|output| HeightMapFormat::from_path(output).is_ok());
    let height_map = wants_map.then(|| match tip {
        Some(cutter) => HeightMap::of_tips(&block.solid, cutter),
        None => HeightMap::of(&block.solid),
    });
    let height_map = height_map.as_ref();
    let record = side_file_of_design(plan, block, hash_of, &Machine)?;
    let beside = side_files::path_beside(&outputs[first]);
    let side = SideFile::parse(&side_files::text(&record, &beside)?, &beside)?;
    // Text takes longest, and begins.
    let mut order: Vec<usize> = (0..outputs.len()).collect();
    order.sort_by_key(|&k| !matches!(Format::from_path(&outputs[k]), Ok(Format::Obj | Format::Step)));
    let made: Vec<OnceLock<Result<Made, Failure>>> = outputs.iter().map(|_| OnceLock::new()).collect();
    let (send, mesh) = mpsc::channel();
    let next = AtomicUsize::new(0);
    // Pools of their own: files wait for the disk, and neither for each other nor for whoever looks
    // at the first of them.
    let pool = |_| rayon::ThreadPoolBuilder::new().build();
    let pools = (0..outputs.len().min(rayon::current_num_threads() + 1)).map(pool).collect::<Result<Vec<_>, _>>();
    let pools = pools.map_err(|source| Failure::Io { what: "starting threads".into(), source: source.into() })?;
    let looked = thread::scope(|scope| {
        for pool in &pools {
            let (send, next, order, made) = (send.clone(), &next, &order, &made);
            let work = move || {
                while let Some(&k) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
                    // Of the others the vertices are compared.
                    let read = if k == first { read_mesh } else { read_bare_mesh };
                    let mut outcome = make_one(task, &outputs[k], height_map, read);
                    if let (Ok(Made { mesh, .. }), true) = (&mut outcome, k == first) {
                        // Nobody may wait for it any more.
                        let _ = mesh.take().map(|mesh| send.send(mesh));
                    }
                    let _ = made[k].set(outcome);
                }
            };
            scope.spawn(move || pool.install(work));
        }
        drop(send);
        meanwhile(First { path: &outputs[first], side: &side, mesh })
    });
    let made: Vec<Made> = made.into_iter().filter_map(OnceLock::into_inner).collect::<Result<_, Failure>>()?;
    let (mut notes, mut others) = (Vec::new(), Vec::new());
    let mut sets: BTreeMap<PathBuf, Vec<(&Path, String)>> = BTreeMap::new();
    for (output, Made { note, sha256, mesh }) in outputs.iter().zip(made) {
        notes.extend(note);
        others.extend(mesh.map(|mesh| (output.clone(), mesh)));
        sets.entry(side_files::path_beside(output)).or_default().push((output, sha256));
    }
    if let Some((map, mask)) = height_map.and_then(|map| Some((map, map.mask()?))) {
        let maps = outputs.iter().filter(|output| HeightMapFormat::from_path(output).is_ok());
        let masks: BTreeSet<PathBuf> = maps.map(|map| mask_of(map)).collect();
        for path in masks {
            write_png(&path, &mask).map_err(Failure::writing)?;
            notes.push(format!("{}: white where the block is; beyond it {} goes on", path.display(), map.subject()));
        }
    }
    for (path, outputs) in sets {
        let mut side = record.clone();
        for (output, hash) in outputs {
            if let (Some(map), true) = (height_map, HeightMapFormat::from_path(output).is_ok()) {
                side.height_maps.insert(file_name(output), height_map_entries(map));
            }
            side.files.insert(file_name(output), hash);
        }
        side_files::write(&side, &path)?;
    }
    Ok((Files { notes, others, side }, looked))
}

/// Writes, hashes and reads back one file.
fn make_one(
    task: &Task<'_>,
    output: &Path,
    height_map: Option<&HeightMap>,
    read: fn(&Path) -> Result<Mesh, Failure>,
) -> Result<Made, Failure> {
    let Task { plan, block, tip, verified, .. } = *task;
    let design = plan.export_design();
    let format = Format::from_path(output);
    let note = match (&format, height_map) {
        (Ok(Format::Step), _) => Some(write_step(plan, output, block, &design)?),
        (Err(_), Some(map)) => {
            map.write(output).map_err(|error| match error {
                HeightMapError::Write(error) => Failure::writing(error),
                refused => Failure::refused(refused),
            })?;
            Some(height_map_note(output, map))
        }
        _ => {
            export::export(output, &block.solid, &design).map_err(Failure::exporting)?;
            None
        }
    };
    let sha256 = hash_of(output)?;
    // The way of a tip is no face that light could be traced through.
    let is_judged = verified && (tip.is_none() || format.is_ok());
    let mesh = is_judged.then(|| read(output)).transpose()?;
    Ok(Made { note, sha256, mesh })
}

/// Writes a STEP file; returns how near its face is.
fn write_step(plan: &Plan, output: &Path, block: &DesignedBlock, design: &Design) -> Result<String, Failure> {
    let solid = &block.solid;
    let chosen = |surface| export::choose_net(surface, plan.step, design).map_err(Failure::refused);
    let (fit, entry) = (chosen(solid.surface())?, solid.entry_surface().map(chosen).transpose()?);
    let entry = entry.as_ref().map(|fit| &fit.net);
    export::write_atomically(output, |writer| export::write_step(writer, solid, &fit.net, entry, design))
        .map_err(Failure::writing)?;
    Ok(step_note(output, &fit, plan.nodes))
}
