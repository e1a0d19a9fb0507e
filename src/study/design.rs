//! A block that can be designed: settings validated once, then trusted.

use super::{
    before::Before,
    behind,
    bench::{bench_of, block_document, light_in_words, record_of, scene_of, warnings},
    imperfect::if_it_is_the_sun,
    requirements::{Requirements, open_understood},
    target_light::TargetLight,
    verdict::{Answer, Verdict},
};
use crate::{
    bench::Bench,
    export::{self, StepTolerance},
    failure::Failure,
    grid::Outline,
    irradiance::{TargetIrradiance, Understood},
    light::Light,
    memory::Method,
    pipeline::{self, DesignError, DesignedBlock},
    record::document,
    solid::{Blank, Rim, STANDARD_SHEETS_MM, Shape, Solid, SolidError, Stock},
    solver::{Problem, Progress, Silent, Solution, SolveError, Solver},
    spec::{DRAWING_NODES, Host, Length, OFFSET, QualityName, Settings, SolverName, TransferName, name_of},
    surface::{Finish, HeightField},
    transport::{Quality, Transport, TransportOptions},
    warp::{Warping, WarpingPaper},
};
use glam::DVec2;
use glasswarp_verify::Scene;
use std::{path::PathBuf, sync::Arc};

/// Thickness of a block, from its entry face to the mean plane of its exit face, until its relief
/// is known, mm.
pub(super) const NOMINAL_MM: f64 = 10.0;
/// Nodes across of the draft that tells the relief, and by how much it may be wrong, mm.
const DRAFT_NODES: usize = 129;
const DRAFT_MM: f64 = 0.1;
/// Most skirts that are tried.
const SKIRTS: usize = 6;
/// Most of the picture's light that may be lost at the side walls.
const MOST_VIGNETTED: f64 = 0.1;

/// A block that can be designed.
pub struct Plan {
    /// The picture.
    pub picture: PathBuf,
    /// How the picture was understood.
    pub understood: Understood,
    /// The light to draw: what the block is judged by in perfect light.
    pub target: TargetIrradiance,
    /// What is behind the target, where light is not perfect or falls on a mesh.
    pub requirements: Requirements,
    /// The bench.
    pub bench: Bench,
    /// What stands before the block.
    pub before: Before,
    /// The scene in which the verifier will look at the block.
    pub scene: Scene,
    /// Height nodes along x and y.
    pub nodes: (usize, usize),
    /// The stock.
    pub stock: Stock,
    /// What stands around the exit face.
    pub shape: Shape,
    /// How near a STEP face keeps to the heights.
    pub step: StepTolerance,
    /// How the surface is found.
    pub solver: SolverName,
    /// How light is shown as a picture.
    pub transfer: TransferName,
    /// The settings with every default filled in that must not change when the block is made again.
    pub settings: Settings,
    /// What may not be meant so.
    warnings: Vec<String>,
}

impl Plan {
    /// Reads the picture and validates the settings.
    ///
    /// # Errors
    /// Files that cannot be read, everything that makes no design.
    pub fn new(
        picture: PathBuf,
        settings: Settings,
        host: &dyn Host,
        progress: &dyn Progress,
    ) -> Result<Self, Failure> {
        let before = behind::open(&settings, host)?;
        Self::behind(picture, settings, before, host, progress)
    }

    /// The same behind blocks that are open already.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn behind(
        picture: PathBuf,
        mut settings: Settings,
        before: Before,
        host: &dyn Host,
        progress: &dyn Progress,
    ) -> Result<Self, Failure> {
        let offset = settings.offset.unwrap_or(OFFSET);
        let (perceived, understood, warning) = open_understood(&picture, &settings, offset, host)?;
        let (nx, ny) = (perceived.cells().nx(), perceived.cells().ny());
        let aspect = ny as f64 / nx as f64;
        let thickness_mm = settings.thickness.map_or(NOMINAL_MM, |length| length.mm);
        let bench = bench_of(&settings, &before, aspect, thickness_mm, host)?;
        let (block, light) = (bench.block(), bench.light());
        let across = settings.nodes.unwrap_or_else(|| {
            // However much of a drawing is used, it is drawn for these.
            if understood.is_drawing() { DRAWING_NODES } else { pipeline::default_nodes(nx) }
        });
        let nodes =
            pipeline::node_grid(block, pipeline::nodes_within(&bench.contour(), across)).map_err(Failure::refused)?;
        let mut stock = settings.thickness.map_or_else(Stock::thinnest_sheet, |length| Stock::of_thickness(length.mm));
        if let Some(least) = settings.min_thickness {
            stock = stock.leaving_at_least(least.mm);
        }
        let facing_mm = settings.facing.map_or(Stock::FACING_MM, |length| length.mm);
        stock = stock.faced(facing_mm);
        let shape = shape(&settings)?;
        stock.check().and_then(|()| shape.check(block)).map_err(|error| Failure::refused(DesignError::from(error)))?;
        let step =
            settings.step_tolerance.map_or(StepTolerance::Picture, |length| StepTolerance::Micrometres(length.um));
        step.check().map_err(Failure::refused)?;
        (settings.nodes, settings.offset) = (Some(across), Some(offset));
        settings.facing = Some(Length { mm: facing_mm });
        let transfer = settings.transfer.unwrap_or(TransferName::Srgb);
        let solver = settings.solver.unwrap_or_default();
        let requirements = Requirements::of(perceived.clone(), &bench, &settings, host, progress)?;
        let target = requirements.ideal.clone();
        let scene = scene_of(&record_of(&bench), &settings, &before, host)?;
        let mut plan = Self {
            picture,
            understood,
            target,
            requirements,
            bench,
            before,
            scene,
            nodes,
            stock,
            shape,
            step,
            solver,
            transfer,
            settings,
            warnings: warning.into_iter().collect(),
        };
        plan.fit_to_light(aspect, host)?;
        if plan.requirements.psf.is_some() && plan.bench.light() != light {
            // The spread is that of the lamp's true distance.
            plan.requirements = Requirements::of(perceived, &plan.bench, &plan.settings, host, progress)?;
            plan.target = plan.requirements.ideal.clone();
        }
        plan.scene = scene_of(&record_of(&plan.bench), &plan.settings, &plan.before, host)?;
        let sun = if_it_is_the_sun(&plan.bench, &plan.settings);
        plan.warnings.splice(0..0, sun);
        Ok(plan)
    }

    /// What may not be meant so, known before a block is made.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Whether a block will work whose files nobody has looked at.
    pub fn unverified(&self) -> Verdict {
        let mut verdict = Verdict::default();
        verdict.say("picture", Answer::NotAsked, "the picture (nothing was traced)");
        self.say_open(&mut verdict);
        verdict
    }

    /// Says what a design leaves open: the size of the light, the cutter, the polish.
    pub fn say_open(&self, verdict: &mut Verdict) {
        verdict.say_light(if_it_is_the_sun(&self.bench, &self.settings).is_none());
        let finish = self.settings.finish;
        let open: Vec<&str> = [
            ("cutter", finish.is_some_and(|finish| finish.cutter.is_some())),
            ("polish", finish.is_some_and(|finish| finish.polish.is_some())),
        ]
        .into_iter()
        .filter_map(|(what, asked)| (!asked).then_some(what))
        .collect();
        if !open.is_empty() {
            verdict.say("finish", Answer::NotAsked, format!("{} ('glasswarp ready' asks)", open.join(" and ")));
        }
    }

    /// The light of the bench in words. `entry_z_mm` is the entry face of the block that was made.
    pub fn light_in_words(&self, entry_z_mm: f64) -> String {
        light_in_words(&self.scene, entry_z_mm)
    }

    /// The picture by the verifier's own reader, which must agree with the designer's.
    ///
    /// # Errors
    /// A picture that the verifier cannot read, or reads otherwise.
    pub fn target_light(&self, host: &dyn Host) -> Result<TargetLight, Failure> {
        TargetLight::of(&self.picture, &self.settings, &self.requirements, &self.bench, host)
    }

    /// What files of its block say of it.
    pub fn export_design(&self) -> export::Design {
        let name = self.picture.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        export::Design { name, exit_face: self.bench.exit_face(), distance_mm: self.bench.distance_mm() }
    }

    /// A block of this plan for programs.
    pub fn document(&self, block: &DesignedBlock) -> document::Block {
        block_document(&block.solid, block.surface.relief_mm(), self.nodes)
    }

    /// A draft of the face.
    fn draft(&mut self, aspect: f64, host: &dyn Host) -> Result<HeightField, Failure> {
        let nodes = pipeline::node_grid(self.bench.block(), self.nodes.0.min(DRAFT_NODES)).map_err(Failure::refused)?;
        let solver = Transport::draft();
        let mut thickness_mm = NOMINAL_MM;
        loop {
            match solver.solve(&Problem::new(&self.bench, &self.target), nodes, &Silent) {
                // A sheet that nobody chose may be thicker.
                Err(SolveError::ReachesLight { .. })
                    if self.settings.thickness.is_none()
                        && thickness_mm < STANDARD_SHEETS_MM[STANDARD_SHEETS_MM.len() - 1] =>
                {
                    thickness_mm *= 2.0;
                    self.bench = bench_of(&self.settings, &self.before, aspect, thickness_mm, host)?;
                }
                solved => return Ok(solved.map_err(Failure::refused)?.exit),
            }
        }
    }

    /// Light that does not come straight from far away asks how thick the block is, which its
    /// relief decides: a draft of the face tells, and with it the sheet, the place of the entry
    /// face, and how far the face must go on for light from the side.
    fn fit_to_light(&mut self, aspect: f64, host: &dyn Host) -> Result<(), Failure> {
        let straight = match self.bench.light() {
            Light::Parallel { direction } => direction.truncate() == DVec2::ZERO && self.before.standing.is_empty(),
            Light::Point { .. } => false,
        };
        if straight || self.settings.is_mirror() {
            return Ok(());
        }
        // Its skirt is as long in nodes as that of the face.
        let surface = self.draft(aspect, host)?.resampled(self.nodes.0, self.nodes.1);
        // The draft's relief is not quite that of the face.
        let stock = match self.settings.thickness {
            Some(_) => self.stock,
            None => self.stock.leaving_at_least(self.stock.least_mm() + DRAFT_MM),
        };
        let mut overshoot_mm = 0.0;
        let mut built_for_mm = None;
        // A skirt makes the relief deeper, a deeper relief takes a thicker sheet, and a thicker
        // sheet asks for more of a skirt.
        for _ in 0..SKIRTS {
            let solid =
                Solid::shaped(&surface, stock, self.shape).map_err(|e| Failure::refused(DesignError::from(e)))?;
            let thickness_mm = -solid.entry_z_mm();
            self.stock = Stock::of_thickness(solid.thickness_mm())
                .leaving_at_least(self.stock.least_mm())
                .faced(self.stock.facing_mm());
            // Light through other blocks takes a while.
            if built_for_mm.replace(thickness_mm) != Some(thickness_mm) {
                self.bench = bench_of(&self.settings, &self.before, aspect, thickness_mm, host)?;
            }
            overshoot_mm = pipeline::overshoot_mm(&surface, &self.bench, -thickness_mm);
            let enough = overshoot_mm <= self.shape.skirt_mm;
            if enough || self.settings.skirt.is_some() {
                break;
            }
            self.shape.skirt_mm = overshoot_mm + DRAFT_MM;
            self.shape.check(self.bench.block()).map_err(|e| Failure::refused(DesignError::from(e)))?;
        }
        let missing_mm = overshoot_mm - self.shape.skirt_mm;
        if missing_mm > 1e-6 {
            let share = missing_mm / self.bench.block().as_vec().min_element();
            let what = format!(
                "a skirt of {} mm is too narrow for this light, which enters the block up to {overshoot_mm:.2} mm beside the face: about {:.1} % of the light of the picture would have to come through a side wall",
                self.shape.skirt_mm,
                100.0 * share
            );
            if share > MOST_VIGNETTED {
                let remedy = format!("make it {:.1}mm or wider, or leave `skirt` out", overshoot_mm + DRAFT_MM);
                return Err(Failure::Usage(format!(
                    "{what}; at most {} % are accepted: {remedy}",
                    100.0 * MOST_VIGNETTED
                )));
            }
            self.warnings.push(what);
        }
        Ok(())
    }

    /// Solves for the block.
    pub fn design(&self, progress: &dyn Progress) -> Result<DesignedBlock, Failure> {
        let solver = self.solver()?;
        pipeline::design(
            &Problem::new(&self.bench, &self.requirements.solver),
            self.nodes,
            solver.as_ref(),
            &self.blank(),
            progress,
        )
        .map(|mut block| {
            let known = self.warnings.iter().cloned().chain(warnings(&self.bench));
            block.summary.warnings.splice(0..0, known);
            block
        })
        .map_err(|error| match (&error, self.settings.distance) {
            // Who has not said where the receiver is may not know where it stands.
            (
                DesignError::Trapped { .. }
                | DesignError::Solve(SolveError::TotalInternalReflection { .. })
                | DesignError::Solid(SolidError::TooDeep { .. }),
                None,
            ) => {
                Failure::Usage(format!(
                    "{error} (`distance`, `offset`); nothing was said of the distance, and the receiver stands at {} mm, which is too near for a block {} mm wide",
                    self.bench.distance_mm(),
                    self.bench.block().width_mm
                ))
            }
            _ => Failure::refused(error),
        })
    }

    /// The block under a face that was found for this plan before, with everything that was said of
    /// it.
    ///
    /// # Errors
    /// Everything that makes no block of it.
    pub fn close(&self, solution: Solution) -> Result<DesignedBlock, Failure> {
        pipeline::close(solution, &self.bench, &self.blank()).map_err(Failure::refused)
    }

    fn blank(&self) -> Blank {
        Blank::new(self.stock).with_shape(self.shape)
    }

    /// What the solver's memory goes by, for so many pixels and nodes along x and y.
    pub fn memory_of_solver(&self, pixels: (usize, usize), nodes: (usize, usize)) -> Method {
        match self.solver {
            SolverName::Transport => {
                let options = TransportOptions::new(self.quality());
                Method::transport(options.receiver_cells(pixels, nodes))
            }
            SolverName::Warping | SolverName::WarpingPaper => Method::Warping,
        }
    }

    fn quality(&self) -> Quality {
        match self.settings.quality.unwrap_or_default() {
            QualityName::Draft => Quality::Draft,
            QualityName::Normal => Quality::Normal,
            QualityName::Fine => Quality::Fine,
        }
    }

    /// The solver that was chosen, with its options.
    fn solver(&self) -> Result<Box<dyn Solver>, Failure> {
        let Settings { quality, min_radius, finish, .. } = self.settings;
        if self.solver != SolverName::Transport && (quality.is_some() || min_radius.is_some() || finish.is_some()) {
            return Err(Failure::Usage(format!(
                "`quality`, `min-radius` and `finish` are options of the transport solver; the {} solver has none",
                name_of(self.solver)
            )));
        }
        if finish.is_some_and(|finish| finish.polish.is_some()) && self.bench.outline() != Outline::Rectangle {
            return Err(Failure::Usage(
                "a face is designed for its polish on rectangular blocks only (`outline` rectangle): next to a curved outline it may lose more light than it gains; milling it in simulation tells what the polish takes from it"
                    .into(),
            ));
        }
        Ok(match self.solver {
            SolverName::Transport => {
                let mut options = TransportOptions::new(self.quality());
                let corner_mm = finish.and_then(|finish| finish.cutter).map(|cutter| cutter.corner_mm());
                options.finish = finish.and_then(|finish| {
                    let polished = Finish::new(finish.polish?);
                    let rows_mm = finish.step_over_mm.unwrap_or(0.0);
                    Some(corner_mm.map_or(polished, |radius_mm| polished.with_ball(radius_mm, rows_mm)))
                });
                // Without a polish, a face without sharper hollows is what the cutter leaves of it.
                let unpolished = corner_mm.filter(|_| options.finish.is_none());
                options.min_radius_mm = min_radius.map(|length| length.mm).or(unpolished);
                Box::new(Transport::new(options).map_err(Failure::refused)?)
            }
            SolverName::Warping => Box::new(match &self.requirements.mesh {
                Some(mesh) => Warping::default().onto(Arc::clone(mesh)),
                None => Warping::default(),
            }),
            SolverName::WarpingPaper => Box::new(match &self.requirements.mesh {
                Some(mesh) => WarpingPaper::default().onto(Arc::clone(mesh)),
                None => WarpingPaper::default(),
            }),
        })
    }
}

/// Rim, mark and origin.
pub fn shape(settings: &Settings) -> Result<Shape, Failure> {
    let rim = settings.rim.map(|rim| Rim {
        width_mm: rim.width.mm,
        rise_mm: rim.rise.mm,
        mark_mm: settings.mark.map(|length| length.mm),
    });
    if rim.is_none() && settings.mark.is_some() {
        return Err(Failure::Usage(
            "`mark` cuts off a corner of the rim, and there is none: add `rim` WIDTH,HEIGHT".into(),
        ));
    }
    let skirt_mm = settings.skirt.map_or(0.0, |length| length.mm);
    Ok(Shape { skirt_mm, rim, origin: settings.origin.unwrap_or_default().into() })
}
