//! Designs: a block in memory, and what is known of it.

use crate::{arrays, fault, work};
use clap::{Args as _, FromArgMatches as _};
use glasswarp::{
    cli::{self, Machine, Saving},
    fabricate::Cutter,
    failure::Failure,
    grid::Field,
    irradiance::to_picture_order,
    optim::{Iteration, Level, Summary, Termination},
    pipeline::DesignedBlock,
    report::{BlockDrawings, DesignPage},
    solver::Solution,
    spec::{self, Host, Settings},
    study::{
        behind,
        bench::{bench_document, bench_of},
        budget::mesh_of,
        design::Plan,
        fits,
    },
    surface::HeightField,
};
use glasswarp_verify::{Image, Mesh, image_file};
use numpy::{PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::{exceptions::PyRuntimeError, prelude::*, types::PyBytes};
use serde_json::json;
use sha2::{Digest, Sha256};
use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError, RwLock},
    time::{Duration, Instant},
};

/// The name of a picture that was given as an array.
const LIGHT: &str = "light.exr";

/// The machine's files, each read once and kept: a block can be taken to another machine.
#[derive(Default)]
struct Desk {
    kept: Mutex<BTreeMap<PathBuf, Vec<u8>>>,
    warnings: Mutex<Vec<String>>,
}

impl Desk {
    fn with(kept: BTreeMap<PathBuf, Vec<u8>>) -> Self {
        Self { kept: Mutex::new(kept), warnings: Mutex::default() }
    }

    fn kept(self) -> BTreeMap<PathBuf, Vec<u8>> {
        self.kept.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    fn warnings(&self) -> Vec<String> {
        std::mem::take(&mut self.warnings.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Host for Desk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bytes) = kept.get(path) {
            return Ok(bytes.clone());
        }
        let bytes = Machine.read(path)?;
        kept.insert(path.to_owned(), bytes.clone());
        Ok(bytes)
    }

    fn solid(&self, path: &Path) -> Result<Mesh, Failure> {
        Machine.solid(path)
    }

    fn picture_memory(&self) -> u64 {
        Machine.picture_memory()
    }

    fn warn(&self, warning: &str) {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner).push(warning.to_owned());
    }
}

/// What flags of `glasswarp design` ask for, and whether memory does not matter.
fn asked(words: &[String]) -> Result<(Settings, bool), clap::Error> {
    let ignore = clap::Arg::new("ignore-memory").long("ignore-memory").action(clap::ArgAction::SetTrue);
    let command = Settings::augment_args(clap::Command::new("design").no_binary_name(true)).arg(ignore);
    let found = command.try_get_matches_from(words)?;
    Ok((Settings::from_arg_matches(&found)?, found.get_flag("ignore-memory")))
}

fn broken(error: impl ToString) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// A block that was designed, in memory.
#[pyclass(frozen, module = "glasswarp._glasswarp")]
pub(crate) struct Design {
    made: Arc<Made>,
}

/// What it is made of; work that goes on shares it.
struct Made {
    /// What it was asked with.
    words: Vec<String>,
    named: PathBuf,
    /// The files that were read, by name.
    kept: BTreeMap<PathBuf, Vec<u8>>,
    /// The picture's place changes where it is written with the block.
    plan: RwLock<Plan>,
    /// The picture as it was named.
    picture: PathBuf,
    block: DesignedBlock,
    solved: Duration,
    warnings: Vec<String>,
}

type Levels = Vec<(String, usize, usize, String, Vec<(f64, f64, f64, usize)>, f64)>;
type Told = (Levels, Vec<String>, Vec<String>);

/// Everything of a design that is kept: what it was asked with and the files that were read, the
/// nodes of its face along x and their heights, its light as the solver sees it likewise, what the
/// solver told, and its seconds.
type State<'py> = (
    Vec<String>,
    PathBuf,
    Vec<(PathBuf, Bound<'py, PyBytes>)>,
    Bound<'py, PyArray2<f64>>,
    Vec<Bound<'py, PyArray2<f64>>>,
    Told,
    f64,
);

/// The same as Python gives it back.
type Kept<'py> = (
    Vec<String>,
    PathBuf,
    Vec<(PathBuf, Vec<u8>)>,
    PyReadonlyArray2<'py, f64>,
    Vec<PyReadonlyArray2<'py, f64>>,
    Told,
    f64,
);
/// Vertices and triangles.
type Corners<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

/// Designs a block. `words` are flags of `glasswarp design`, `named` is a picture or a design file,
/// or `light` the light itself, with the top row first.
#[pyfunction]
#[pyo3(signature = (words, named, light=None, progress=None))]
pub(crate) fn design<'py>(
    py: Python<'py>,
    words: Vec<String>,
    named: Option<PathBuf>,
    light: Option<PyReadonlyArray2<'py, f64>>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Design> {
    let (flags, ignores_memory) = asked(&words).map_err(|error| fault::misused(py, &error))?;
    let named = named.unwrap_or_else(|| LIGHT.into());
    let light = match &light {
        Some(light) => Some(Image::new(light.shape()[1], light.shape()[0], light.as_slice()?.to_vec())),
        None => None,
    };
    let made = work::done(py, progress.as_ref(), move |watch| -> Result<_, Failure> {
        let mut kept = BTreeMap::new();
        if let Some(image) = light {
            kept.insert(named.clone(), image_file::exr_bytes(&named, &image).map_err(Failure::writing)?);
        }
        let desk = Desk::with(kept);
        let (settings, picture) = spec::settings(&named, &flags, &desk)?;
        let plan = Plan::new(picture.clone(), settings, &desk, &*watch)?;
        fits::design(&plan, None, Machine::free_memory().filter(|_| !ignores_memory))?;
        let began = Instant::now();
        let block = plan.design(&*watch)?;
        let warnings = desk.warnings();
        let (kept, plan) = (desk.kept(), RwLock::new(plan));
        Ok(Made { words, named, kept, plan, picture, block, solved: began.elapsed(), warnings })
    })?;
    made.map(Design::of).map_err(|failure| fault::raised(py, &failure))
}

/// A design from what [`Design::state`] gave: the same to the last bit.
#[pyfunction]
pub(crate) fn restore<'py>(py: Python<'py>, kept: Kept<'py>) -> PyResult<Design> {
    let (words, named, kept, heights, lights, told, seconds) = kept;
    let (flags, _) = asked(&words).map_err(|error| fault::misused(py, &error))?;
    let field = |array: &PyReadonlyArray2<'py, f64>| -> PyResult<Field<f64>> {
        Ok(Field::from_vec(array.shape()[1], array.shape()[0], array.as_slice()?.to_vec()))
    };
    let heights = field(&heights)?;
    if heights.nx() < 4 || heights.ny() < 4 {
        return Err(fault::refused(py, "this is no block that was kept: its face has no nodes".into()));
    }
    let lights = lights.iter().map(field).collect::<PyResult<Vec<_>>>()?;
    let summary = summary_of(told).map_err(|what| fault::refused(py, what))?;
    let made = work::done(py, None, move |watch| -> Result<_, Failure> {
        let desk = Desk::with(kept.into_iter().collect());
        let (settings, picture) = spec::settings(&named, &flags, &desk)?;
        let plan = Plan::new(picture.clone(), settings, &desk, &*watch)?;
        let contour = plan.bench.contour();
        // As they were, to the last bit: their mean is what it is.
        let face = HeightField::found(contour.extent(), plan.bench.outline(), heights);
        let block = plan.close(Solution::new(face, summary).with_light(lights))?;
        let (kept, plan) = (desk.kept(), RwLock::new(plan));
        let solved = Duration::from_secs_f64(seconds.max(0.0));
        Ok(Made { words, named, kept, plan, picture, block, solved, warnings: Vec::new() })
    })?;
    made.map(Design::of).map_err(|failure| fault::raised(py, &failure))
}

fn summary_of((levels, notes, warnings): Told) -> Result<Summary, String> {
    let known = [Termination::Converged, Termination::IterationLimit, Termination::Stalled, Termination::Cancelled];
    let level = |(stage, nx, ny, ended, iterations, seconds): (String, usize, usize, String, Vec<_>, f64)| {
        let termination = known.into_iter().find(|one| one.to_string() == ended);
        let iteration =
            |(objective, gradient_norm, step, evaluations)| Iteration { objective, gradient_norm, step, evaluations };
        Ok(Level {
            stage,
            nx,
            ny,
            termination: termination.ok_or_else(|| format!("'{ended}' is no way in which a level ends"))?,
            iterations: iterations.into_iter().map(iteration).collect(),
            elapsed: Duration::from_secs_f64(seconds.max(0.0)),
        })
    };
    let levels = levels.into_iter().map(level).collect::<Result<_, String>>()?;
    Ok(Summary { levels, notes, warnings })
}

impl Design {
    fn of(made: Made) -> Self {
        Self { made: Arc::new(made) }
    }
}

impl Made {
    fn plan(&self) -> std::sync::RwLockReadGuard<'_, Plan> {
        self.plan.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets the picture lie where files of the block can name it: where it was, if it is still there,
    /// or else beside `first` of them. Returns its bytes if they have to be written.
    fn place_picture(&self, plan: &mut Plan, first: &Path) -> Option<&[u8]> {
        let bytes = self.kept.get(&self.picture)?;
        let is_there = |path: &Path| fs::read(path).is_ok_and(|found| found == *bytes);
        if is_there(&self.picture) {
            plan.picture.clone_from(&self.picture);
            return None;
        }
        let own = [first.file_stem(), self.picture.file_name()].map(|name| name.unwrap_or_default().to_string_lossy());
        plan.picture = first.with_file_name(own.join("."));
        (!is_there(&plan.picture)).then_some(bytes)
    }
}

#[pymethods]
impl Design {
    /// Heights of the exit face at its nodes, mm: `heights[j, i]`, j along +y, i along +x. It
    /// belongs to the design, and cannot be written to.
    fn heights<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::lent(slf, |design| design.made.block.surface.heights_mm())
    }

    /// The light as the solver sees it, top row first; none from solvers that do not look.
    fn predicted<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.made.block.light.first().map(|light| picture(py, light)).transpose()
    }

    /// The light that is wanted, top row first, mean 1.
    fn target<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        picture(py, self.made.plan().target.cells())
    }

    /// Block, bench and settings as JSON, as documents of the command have them.
    fn described(&self) -> PyResult<String> {
        let plan = self.made.plan();
        let described = json!({
            "block": plan.document(&self.made.block),
            "bench": bench_document(&plan.scene, self.made.block.solid.entry_z_mm()),
            "settings": plan.settings,
            "picture": self.made.picture,
            "solver": plan.solver.to_string(),
        });
        serde_json::to_string(&described).map_err(broken)
    }

    /// What the solver told: its levels (stage, nodes along x and y, how it ended, iterations as
    /// objective, norm of the gradient, step, evaluations; seconds), notes, warnings.
    fn told(&self) -> Told {
        let iteration = |one: &Iteration| (one.objective, one.gradient_norm, one.step, one.evaluations);
        let Summary { levels, notes, warnings } = &self.made.block.summary;
        let level = |level: &Level| {
            let iterations = level.iterations.iter().map(iteration).collect();
            let ended = level.termination.to_string();
            (level.stage.clone(), level.nx, level.ny, ended, iterations, level.elapsed.as_secs_f64())
        };
        (levels.iter().map(level).collect(), notes.clone(), warnings.clone())
    }

    /// What was warned of besides.
    fn warnings(&self) -> Vec<String> {
        self.made.warnings.clone()
    }

    /// Seconds that the solver took.
    fn seconds(&self) -> f64 {
        self.made.solved.as_secs_f64()
    }

    /// The closed solid in the frame of the bench: vertices, mm, and triangles that face outwards.
    fn mesh<'py>(&self, py: Python<'py>) -> PyResult<Corners<'py>> {
        let made = Arc::clone(&self.made);
        let mesh = work::done(py, None, move |_| mesh_of(&made.block.solid, None))?;
        let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
        let corners = mesh.vertices.iter().flat_map(|vertex| vertex.to_array()).collect();
        let triangles =
            numpy::ndarray::Array2::from_shape_vec((triangles, 3), mesh.triangles.into_flattened()).map_err(broken)?;
        Ok((arrays::taken(py, (3, vertices), corners)?, PyArray2::from_owned_array(py, triangles)))
    }

    /// Writes files as `glasswarp design` does, with their side files. Returns what there is to say
    /// of them.
    #[pyo3(signature = (outputs, cutter=None, force=false))]
    fn save(&self, py: Python<'_>, outputs: Vec<PathBuf>, cutter: Option<&str>, force: bool) -> PyResult<Vec<String>> {
        let Some(first) = outputs.first() else {
            return Err(fault::refused(py, "there is no file to write: name one".into()));
        };
        let cutter = cutter.map(|cutter| cutter.parse::<Cutter>()).transpose();
        let cutter = cutter.map_err(|error| fault::refused(py, error.to_string()))?;
        let (made, first) = (Arc::clone(&self.made), first.clone());
        let saved = work::done(py, None, move |watch| {
            let mut plan = made.plan.write().unwrap_or_else(PoisonError::into_inner);
            let picture = made.place_picture(&mut plan, &first);
            let saving = Saving { outputs: &outputs, tip: cutter, picture, force };
            cli::save(&plan, &made.block, &saving, move || watch.goes_on())
        })?;
        saved.map_err(|failure| fault::raised(py, &failure))
    }

    /// The report, a page of HTML: pictures, figures and the model that turns.
    fn report(&self, py: Python<'_>, title: String) -> PyResult<String> {
        let made = Arc::clone(&self.made);
        work::done(py, None, move |_| {
            let (plan, block) = (made.plan(), &made.block);
            let bytes = made.kept.get(&made.picture).map_or(&[][..], Vec::as_slice);
            let sha256 = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
            let words = ["glasswarp", "design", &made.named.to_string_lossy()].map(str::to_owned);
            let words: Vec<String> = words.into_iter().chain(made.words.iter().cloned()).collect();
            let page = DesignPage {
                plan: &plan,
                title,
                picture: (made.picture.to_string_lossy().into_owned(), sha256),
                files: Vec::new(),
                command: shlex::try_join(words.iter().map(String::as_str)).unwrap_or_else(|_| words.join(" ")),
                block,
                drawings: &BlockDrawings::of(block, &plan),
                verification: None,
                verdict: &plan.unverified(),
                in_flags: str::to_owned,
                notes: &[],
                solved: made.solved,
            };
            page.html()
        })
    }

    /// Everything that [`restore`] makes the same design of.
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<State<'py>> {
        let (py, design) = (slf.py(), slf.get());
        let made = &design.made;
        let kept = made.kept.iter().map(|(path, bytes)| (path.clone(), PyBytes::new(py, bytes))).collect();
        let light = |field: &Field<f64>| arrays::taken(py, (field.nx(), field.ny()), field.as_slice().to_vec());
        let lights = made.block.light.iter().map(light).collect::<PyResult<_>>()?;
        Ok((made.words.clone(), made.named.clone(), kept, Self::heights(slf)?, lights, design.told(), design.seconds()))
    }
}

fn picture<'py>(py: Python<'py>, light: &Field<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let light = to_picture_order(light);
    arrays::taken(py, (light.nx(), light.ny()), light.into_vec())
}

/// What a bench of these flags is, as JSON: its settings with those of its preset, and the figures
/// that no picture and no block decides.
#[pyfunction]
pub(crate) fn bench(py: Python<'_>, words: Vec<String>) -> PyResult<String> {
    let (flags, _) = asked(&words).map_err(|error| fault::misused(py, &error))?;
    let described = || -> Result<_, Failure> {
        let (settings, _) = spec::settings(Path::new(LIGHT), &flags, &Machine)?;
        // A square picture, and any thickness: none of these figures is theirs.
        let bench = bench_of(&settings, &behind::open(&settings, &Machine)?, 1.0, 10.0, &Machine)?;
        Ok(json!({
            "settings": settings,
            "size_mm": bench.block().width_mm,
            "distance_mm": bench.distance_mm(),
            "ior": (!settings.is_mirror()).then(|| bench.exit_face().ior()),
            "mirror": settings.is_mirror(),
        }))
    };
    described().map_err(|failure| fault::raised(py, &failure)).map(|described| described.to_string())
}
