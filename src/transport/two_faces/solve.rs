//! What two free faces are solved for, coarse to fine.

use super::{
    between::Between,
    exit::{Exit, Spread},
    film::Film,
    outgoing::Outgoing,
};
use crate::transport::{
    TransportOptions, TransportOptionsError,
    equation::{Equation, State},
    level::{FORCING, STAGE, record},
    light,
    map::Map,
    newton::{Criterion, Halt, Newton},
    spline::{BorderSlopes, PathSpline, ReceiverGrid},
};
use crate::{
    bench::{Bench, ExitFace},
    grid::{Contour, Extent, Field, Outline, area_resample},
    irradiance::TargetIrradiance,
    light::Light,
    optim::{Summary, Termination},
    solver::{Event, FreeFaces, Problem, Progress, Solution, SolveError, Solver, TwoFacesError, check_nodes},
};
use glam::{DVec2, DVec3};
use std::array;

/// The solver for two free faces: draws two pictures, on receivers one behind the other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TwoFaces {
    options: TransportOptions,
}

impl TwoFaces {
    /// A solver with these options, of which a finish and a least radius are for one free face.
    ///
    /// # Errors
    /// An option outside of its limits, or one that is for one free face.
    pub fn new(options: TransportOptions) -> Result<Self, TransportOptionsError> {
        options.validate()?;
        if options.finish.is_some() || options.min_radius_mm.is_some() {
            return Err(TransportOptionsError::OneFace);
        }
        Ok(Self { options })
    }
}

impl Solver for TwoFaces {
    fn solve(
        &self,
        problem: &Problem<'_>,
        nodes: (usize, usize),
        progress: &dyn Progress,
    ) -> Result<Solution, SolveError> {
        check_nodes(NAME, nodes)?;
        Task::of(problem)?.solve(&self.options, nodes, progress)
    }
}

/// What is solved for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task<'a> {
    pub(super) block: Extent,
    pub(super) ior: f64,
    /// Between the mean planes of both faces, mm.
    pub(super) thickness_mm: f64,
    /// From the mean exit plane to both receivers, mm.
    pub(super) distances_mm: [f64; 2],
    pub(super) windows: [Extent; 2],
    pub(super) targets: [&'a TargetIrradiance; 2],
}

/// The solver's name in messages.
pub(super) const NAME: &str = "two-faces";
/// Least distance between the receivers, mm.
const LEAST_GAP_MM: f64 = 1.0;
/// Coarsest grid, cells along its shorter side.
const COARSEST: usize = 12;
/// Most grid cells per pixel, if nothing else is said.
const FINEST: usize = 4;
/// Residual, root mean square, at which a level is solved.
pub(super) const RMS: f64 = 3e-4;
/// Most Newton steps on a level.
const STEPS: usize = 30;
/// Steps from the lit part of the exit face to the whole entry face.
const WIDENINGS: u32 = 8;

/// The light that is asked for, and what is known of the block.
#[derive(Debug)]
pub(super) struct Solved {
    /// The targets as far as the lens can draw them.
    pub(super) cells: [Field<f64>; 2],
    /// Grid cells per target cell along x and y.
    pub(super) per_cell: [(usize, usize); 2],
    /// The light at the nodes of the receivers' grids that was solved for.
    pub(super) films: [Film; 2],
    /// Phase on the first receiver.
    pub(super) phase: Unknown,
    /// The exit face.
    pub(super) exit: Unknown,
    pub(super) constant_mm: f64,
}

/// An unknown with the memory of its iteration.
#[derive(Debug)]
pub(super) struct Unknown {
    pub(super) state: State,
    pub(super) newton: Newton,
}

impl Unknown {
    fn new(state: State) -> Self {
        Self { newton: Newton::new(&state), state }
    }

    fn on(coarse: &State, grid: ReceiverGrid) -> Self {
        let (spline, slopes) = coarse.spline.on(grid);
        Self::new(State { spline, slopes, mu: 0.0 })
    }
}

impl<'a> Task<'a> {
    /// What a problem asks for.
    ///
    /// # Errors
    /// A bench that this is not solved for.
    fn of(problem: &Problem<'a>) -> Result<Self, SolveError> {
        let bench = problem.bench();
        let FreeFaces::EntryAndExit { thickness_mm } = problem.free_faces() else {
            return Err(SolveError::TwoFaces(TwoFacesError::OneFree));
        };
        let &[first, second] = problem.targets() else {
            return Err(SolveError::TwoFaces(TwoFacesError::Pictures { targets: problem.targets().len() }));
        };
        let refused = |able, remedy| Err(SolveError::TwoFaces(TwoFacesError::Bench { able, remedy }));
        let ExitFace::Refracts { ior } = bench.exit_face() else {
            return refused("blocks of glass", "a mirror has one face, which draws one picture");
        };
        if bench.light() != (Light::Parallel { direction: DVec3::Z }) || bench.profile().is_some() {
            return refused("even light along the axis", "leave out what tilts, spreads or places the light");
        }
        if !bench.known_faces().is_empty() {
            return refused("light that has passed nothing yet", "leave out what stands before the block");
        }
        if bench.outline() != Outline::Rectangle {
            return refused("rectangular blocks", "leave out the outline");
        }
        let receivers = [first.receiver, second.receiver];
        if receivers.iter().any(|receiver| receiver.is_turned() || receiver.window_centre_mm() != DVec2::ZERO) {
            return refused("receivers across the axis with their windows on it", "leave out lean and shift");
        }
        let [near_mm, far_mm] = receivers.map(|receiver| receiver.distance_mm());
        if far_mm - near_mm < LEAST_GAP_MM {
            return Err(SolveError::TwoFaces(TwoFacesError::Order { near_mm, far_mm }));
        }
        let (least_mm, greatest_mm) = Bench::THICKNESS_LIMITS_MM;
        if !(least_mm..=greatest_mm).contains(&thickness_mm) {
            return Err(SolveError::TwoFaces(TwoFacesError::Thickness { thickness_mm, least_mm, greatest_mm }));
        }
        let task = Self {
            block: bench.block(),
            ior,
            thickness_mm,
            distances_mm: [near_mm, far_mm],
            windows: receivers.map(|receiver| receiver.window()),
            targets: [first.irradiance, second.irradiance],
        };
        let (lit, block) = (task.lit(), bench.block());
        let fits = |lit: f64, block: f64| lit > 0.0 && lit <= block * (1.0 + 1e-9);
        if !(fits(lit.width_mm, block.width_mm) && fits(lit.height_mm, block.height_mm)) {
            let (width_mm, height_mm) = (lit.width_mm, lit.height_mm);
            return Err(SolveError::TwoFaces(TwoFacesError::Beyond { width_mm, height_mm }));
        }
        Ok(task)
    }
}

impl Task<'_> {
    /// Solves on the nodes of both faces.
    ///
    /// # Errors
    /// Pictures that these receivers and this thickness do not allow, and a solve that was cancelled.
    fn solve(
        &self,
        options: &TransportOptions,
        nodes: (usize, usize),
        progress: &dyn Progress,
    ) -> Result<Solution, SolveError> {
        let mut summary = Summary::default();
        let solved = self.pyramid(options, nodes, progress, &mut summary)?;
        self.close(options, solved, nodes, progress, summary)
    }

    /// The lit part of the mean exit plane: the outermost rays go from the border of the first window
    /// to that of the second.
    pub(super) fn lit(&self) -> Extent {
        let [near, far] = self.distances_mm;
        let [first, second] = self.windows.map(Extent::as_vec);
        let lit = first - (second - first) * (near / (far - near));
        Extent::new(lit.x, lit.y)
    }

    pub(super) fn spread(&self) -> Spread {
        let [near, far] = self.distances_mm;
        let [first, second] = self.windows.map(Extent::as_vec);
        let lit = self.lit();
        Spread {
            beta: (second - first) / (lit.as_vec() * (far - near)),
            share: lit.area_mm2() / self.windows[0].area_mm2(),
        }
    }

    /// Coarse to fine.
    fn pyramid(
        &self,
        options: &TransportOptions,
        nodes: (usize, usize),
        progress: &dyn Progress,
        summary: &mut Summary,
    ) -> Result<Solved, SolveError> {
        let divided = self.targets.map(|target| options.divide((target.cells().nx(), target.cells().ny()), nodes));
        // What is narrow on one receiver is wide on the other.
        let finer = |per_cell: usize, nodes: usize, cells: usize| match options.cells_per_pixel {
            None if options.per_cell() > 1 => per_cell.max(((nodes - 1) / cells).min(FINEST)),
            _ => per_cell,
        };
        let per_cell = divided.map(|(cells, (px, py))| (finer(px, nodes.0, cells.0), finer(py, nodes.1, cells.1)));
        let mut sizes = vec![divided.map(|(cells, _)| cells)];
        loop {
            let last = sizes[sizes.len() - 1];
            let along = |k: usize| (last[k].0 * per_cell[k].0).min(last[k].1 * per_cell[k].1);
            let least = last.iter().map(|size| size.0.min(size.1)).min().unwrap_or(0);
            if along(0).min(along(1)) < 2 * COARSEST || least < 2 * TargetIrradiance::LEAST_CELLS {
                break;
            }
            sizes.push(last.map(|(nx, ny)| (nx.div_ceil(2), ny.div_ceil(2))));
        }
        progress.tell(Event::Stage { name: "transport", steps: sizes.len() })?;
        let mut coarser: Option<Solved> = None;
        for (done, size) in sizes.iter().rev().enumerate() {
            let cells = array::from_fn(|k| area_resample(self.targets[k].cells(), size[k].0, size[k].1));
            let films = array::from_fn(|k| {
                let mut light = light::nodal(&cells[k], per_cell[k], options.floor());
                light::normalise(&mut light);
                let (px, py) = per_cell[k];
                Film { grid: ReceiverGrid::across(self.windows[k], (size[k].0 * px, size[k].1 * py)), light }
            });
            let mut solved = self.start(cells, per_cell, films, coarser.take());
            let criterion = Criterion { rms: RMS, steps: STEPS, forcing: FORCING };
            solved.phase(self, criterion, progress, summary, STAGE)?;
            if done == 0 {
                self.straight(&mut solved)?;
                solved.widen(self, criterion, progress)?;
            }
            let converged = solved.exit(self, criterion, progress, summary, STAGE).map_err(|error| match error {
                SolveError::Failed { .. } => self.too_thin(f64::INFINITY),
                other => other,
            })?;
            // Coarse grids tell already what is impossible.
            let margins = self.check(&solved, converged)?;
            progress.tell(Event::Step { done: done + 1 })?;
            if done + 1 == sizes.len() {
                margins.describe(summary);
                return Ok(solved);
            }
            coarser = Some(solved);
        }
        unreachable!("the finest level is always there")
    }

    fn start(
        &self,
        cells: [Field<f64>; 2],
        per_cell: [(usize, usize); 2],
        films: [Film; 2],
        coarser: Option<Solved>,
    ) -> Solved {
        let grid = films[0].grid;
        let lit = ReceiverGrid::across(self.lit(), grid.cells);
        let (phase, exit, constant_mm) = match coarser {
            Some(coarse) => {
                (Unknown::on(&coarse.phase.state, grid), Unknown::on(&coarse.exit.state, lit), coarse.constant_mm)
            }
            None => (Unknown::new(self.plain(grid)), Unknown::new(State::zero(lit)), 0.0),
        };
        Solved { cells, per_cell, films, phase, exit, constant_mm }
    }

    /// The phase on the first receiver whose rays go to the like places of the second.
    fn plain(&self, grid: ReceiverGrid) -> State {
        let [near, far] = self.distances_mm;
        let [first, second] = self.windows.map(Extent::as_vec);
        let (nx, ny) = grid.nodes();
        let aside = |i: usize, j: usize| grid.node(i, j) * (second / first - 1.0);
        let slopes = BorderSlopes::of((nx, ny), |i, j| aside(i, j) / aside(i, j).length().hypot(far - near));
        // The slopes are nearly those of this.
        let values = Field::from_fn(nx, ny, |i, j| 0.5 * grid.node(i, j).dot(aside(i, j)) / (far - near));
        State { spline: PathSpline::through(grid, &values, &slopes), slopes, mu: 0.0 }
    }

    /// The exit face that light along the axis would need in the glass: every ray keeps its place.
    ///
    /// # Errors
    /// Light that crosses itself before the first receiver.
    fn straight(&self, solved: &mut Solved) -> Result<(), SolveError> {
        let grid = solved.exit.state.spline.grid;
        let (nx, ny) = grid.nodes();
        let (n, t) = (self.ior, self.thickness_mm);
        let outgoing = solved.exit_map(self).outgoing;
        let failed = || self.too_near(&solved.phase.state.spline);
        let mean = {
            let phases: Option<Vec<f64>> = (0..nx * ny)
                .map(|k| outgoing.through(grid.node(k % nx, k / nx), 0.0, None).map(|ray| ray.phase_mm))
                .collect();
            let phases = phases.ok_or_else(failed)?;
            phases.iter().sum::<f64>() / phases.len() as f64
        };
        // n h + (n - 1) t = W + constant.
        let constant_mm = (n - 1.0) * t - mean;
        let mut heights = Field::filled(nx, ny, 0.0);
        let mut slopes = Field::filled(nx, ny, DVec2::ZERO);
        for j in 0..ny {
            for i in 0..nx {
                let x = grid.node(i, j);
                let mut h = 0.0;
                let mut ray = outgoing.through(x, h, None).ok_or_else(failed)?;
                for _ in 0..20 {
                    let miss = n * h + (n - 1.0) * t - ray.phase_mm - constant_mm;
                    h -= miss / (n - ray.c);
                    ray = outgoing.through(x, h, Some(&ray)).ok_or_else(failed)?;
                    if miss.abs() < 1e-9 {
                        break;
                    }
                }
                heights[(i, j)] = h;
                slopes[(i, j)] = ray.s / (n - ray.c);
            }
        }
        let slopes = BorderSlopes::of((nx, ny), |i, j| slopes[(i, j)]);
        solved.constant_mm = constant_mm;
        let spline = PathSpline::through(grid, &heights, &slopes);
        solved.exit = Unknown::new(State { spline, slopes, mu: 0.0 });
        Ok(())
    }
}

impl Solved {
    /// Solves for the phase on the first receiver.
    ///
    /// # Errors
    /// A solve that broke down or was cancelled.
    pub(super) fn phase(
        &mut self,
        task: &Task<'_>,
        criterion: Criterion,
        progress: &dyn Progress,
        summary: &mut Summary,
        stage: &str,
    ) -> Result<bool, SolveError> {
        let [first, second] = &self.films;
        let [near, far] = task.distances_mm;
        let map = Between { gap_mm: far - near, second };
        let equation = Equation::of(map, first.grid, &first.light, rectangle(task.windows[1]));
        run(&equation, &mut self.phase, criterion, progress, summary, format!("{stage}, phase"))
    }

    /// Solves for the exit face.
    ///
    /// # Errors
    /// A solve that broke down or was cancelled.
    pub(super) fn exit(
        &mut self,
        task: &Task<'_>,
        criterion: Criterion,
        progress: &dyn Progress,
        summary: &mut Summary,
        stage: &str,
    ) -> Result<bool, SolveError> {
        let even = self.even();
        // Not through a method, which would borrow the exit face too.
        let map = exit(task, &self.phase.state.spline, &self.films[0], self.constant_mm);
        let equation = Equation::of(map, self.exit.state.spline.grid, &even, rectangle(task.block));
        run(&equation, &mut self.exit, criterion, progress, summary, format!("{stage}, faces"))
    }

    /// Takes the exit face from light that enters the lit part of the block to light that fills it,
    /// step by step. What a step lacks is left to the next.
    ///
    /// # Errors
    /// A solve that was cancelled.
    fn widen(&mut self, task: &Task<'_>, criterion: Criterion, progress: &dyn Progress) -> Result<(), SolveError> {
        let (from, to) = (task.lit().as_vec(), task.block.as_vec());
        if (from - to).abs().max_element() < 1e-9 * to.max_element() {
            return Ok(());
        }
        let even = self.even();
        let map = exit(task, &self.phase.state.spline, &self.films[0], self.constant_mm);
        for step in 1..WIDENINGS {
            let entered = from.lerp(to, f64::from(step) / f64::from(WIDENINGS));
            let contour = rectangle(Extent::new(entered.x, entered.y));
            let equation = Equation::of(map, self.exit.state.spline.grid, &even, contour);
            let mut next = self.exit.state.clone();
            match self.exit.newton.run(&equation, &mut next, criterion, progress) {
                Ok(_) => self.exit.state = next,
                Err(Halt::NoRays) => {}
                Err(Halt::Cancelled) => return Err(SolveError::Cancelled),
            }
        }
        Ok(())
    }

    fn even(&self) -> Field<f64> {
        let (nx, ny) = self.exit.state.spline.grid.nodes();
        Field::filled(nx, ny, 1.0)
    }

    pub(super) fn exit_map<'a>(&'a self, task: &Task<'_>) -> Exit<'a> {
        exit(task, &self.phase.state.spline, &self.films[0], self.constant_mm)
    }
}

pub(super) fn rectangle(extent: Extent) -> Contour {
    Outline::Rectangle.within(extent)
}

fn exit<'a>(task: &Task<'_>, phase: &'a PathSpline, first: &'a Film, constant_mm: f64) -> Exit<'a> {
    let outgoing = Outgoing { phase, first, distance_mm: task.distances_mm[0] };
    Exit { outgoing, ior: task.ior, constant_mm, spread: task.spread() }
}

/// Runs an iteration; whether it converged.
fn run(
    equation: &Equation<'_, impl Map>,
    unknown: &mut Unknown,
    criterion: Criterion,
    progress: &dyn Progress,
    summary: &mut Summary,
    stage: String,
) -> Result<bool, SolveError> {
    let began = progress.clock();
    let (nx, ny) = equation.grid.nodes();
    let outcome = unknown.newton.run(equation, &mut unknown.state, criterion, progress).map_err(|halt| match halt {
        Halt::Cancelled => SolveError::Cancelled,
        Halt::NoRays => SolveError::Failed { solver: NAME, nx, ny, why: format!("{stage}: no rays") },
    })?;
    let converged = outcome.termination == Termination::Converged;
    summary.levels.push(record(stage, equation.grid, outcome, progress.clock().saturating_sub(began)));
    if let Some(level) = summary.levels.last() {
        tracing::debug!(?level, "level done");
    }
    Ok(converged)
}
