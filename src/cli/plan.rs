//! What settings mean: validated once, then trusted.

use super::{
    error::Failure,
    settings::{QualityName, Settings, SolverName, TransferName, name_of},
};
use glam::DVec2;
use glasswarp::{
    bench::{Bench, ExitFace},
    export::StepTolerance,
    grid::Extent,
    materials,
    pipeline::{self, Block, DesignError},
    solid::{Rim, Shape, Stock},
    solver::{Progress, Solver},
    target::{Picture, PictureError, TargetIrradiance, Transfer},
    transport::{Options, Quality, Transport},
    warp::{Warping, WarpingPaper},
};
use std::path::{Path, PathBuf};

/// A block that can be designed.
pub(crate) struct Plan {
    pub(crate) picture: PathBuf,
    pub(crate) target: TargetIrradiance,
    pub(crate) bench: Bench,
    pub(crate) nodes: (usize, usize),
    pub(crate) stock: Stock,
    pub(crate) shape: Shape,
    pub(crate) step: StepTolerance,
    pub(crate) solver: SolverName,
    pub(crate) transfer: TransferName,
    /// The settings with every default filled in that must not change when the block is made again.
    pub(crate) settings: Settings,
}

impl Plan {
    /// Reads the picture and validates the settings.
    pub(crate) fn new(picture: PathBuf, mut settings: Settings) -> Result<Self, Failure> {
        let offset = settings.offset.unwrap_or(0.1);
        let target = open_target(&picture, settings.transfer.map(Transfer::from), offset)?;
        let (nx, ny) = (target.cells().nx(), target.cells().ny());
        let width_mm = settings.size.map_or(100.0, |length| length.mm);
        let ior = match (&settings.material, settings.ior) {
            (Some(name), _) => materials::by_name(name).map(|material| material.ior).ok_or_else(|| {
                Failure::Usage(format!(
                    "there is no material '{name}'; `glasswarp materials` lists those known, --ior takes any index"
                ))
            })?,
            (None, ior) => ior.unwrap_or(1.5),
        };
        let block = Extent::new(width_mm, width_mm * ny as f64 / nx as f64);
        let distance_mm = settings.distance.map_or(250.0, |length| length.mm);
        let mut bench = Bench::new(block, distance_mm, ExitFace::Refracts { ior }).map_err(Failure::refused)?;
        if let Some(window) = settings.window {
            let window = Extent::new(window.mm, window.mm * ny as f64 / nx as f64);
            bench = bench.with_window(window, DVec2::ZERO).map_err(Failure::refused)?;
        }
        let across = settings.nodes.unwrap_or_else(|| pipeline::default_nodes(nx));
        let nodes = pipeline::node_grid(block, across).map_err(Failure::refused)?;
        let mut stock = settings.thickness.map_or_else(Stock::thinnest_sheet, |length| Stock::of_thickness(length.mm));
        if let Some(least) = settings.min_thickness {
            stock = stock.leaving_at_least(least.mm);
        }
        let shape = shape(&settings)?;
        stock.check().and_then(|()| shape.check(block)).map_err(|error| Failure::refused(DesignError::from(error)))?;
        let step = settings.step_tolerance.map_or(StepTolerance::Picture, StepTolerance::Micrometres);
        step.check().map_err(Failure::refused)?;
        (settings.nodes, settings.offset) = (Some(across), Some(offset));
        let is_exr = picture.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        let transfer = settings.transfer.unwrap_or(if is_exr { TransferName::Linear } else { TransferName::Srgb });
        let solver = settings.solver.unwrap_or_default();
        Ok(Self { picture, target, bench, nodes, stock, shape, step, solver, transfer, settings })
    }

    /// Solves for the block.
    pub(crate) fn design(&self, progress: &dyn Progress) -> Result<Block, Failure> {
        let solver = self.solver()?;
        pipeline::design_shaped(
            &self.target,
            &self.bench,
            self.nodes,
            solver.as_ref(),
            (self.stock, self.shape),
            progress,
        )
        .map_err(Failure::refused)
    }

    /// The solver that was chosen, with its options.
    fn solver(&self) -> Result<Box<dyn Solver>, Failure> {
        let Settings { quality, min_radius, finish, .. } = self.settings;
        if self.solver != SolverName::Transport && (quality.is_some() || min_radius.is_some() || finish.is_some()) {
            return Err(Failure::Usage(format!(
                "--quality, --min-radius and --finish are options of the transport solver; the {} solver has none",
                name_of(self.solver)
            )));
        }
        Ok(match self.solver {
            SolverName::Transport => {
                let options = Options {
                    quality: match quality.unwrap_or_default() {
                        QualityName::Draft => Quality::Draft,
                        QualityName::Normal => Quality::Normal,
                        QualityName::Fine => Quality::Fine,
                    },
                    finish: finish.and_then(|finish| finish.polish),
                    // A face without sharper hollows is what the cutter leaves of it.
                    min_radius_mm: min_radius
                        .map(|length| length.mm)
                        .or(finish.and_then(|finish| finish.cutter).map(|cutter| cutter.corner_mm())),
                    ..Options::default()
                };
                options.validate().map_err(Failure::refused)?;
                Box::new(Transport { options })
            }
            SolverName::Warping => Box::new(Warping::default()),
            SolverName::WarpingPaper => Box::new(WarpingPaper::default()),
        })
    }
}

/// Rim, mark and origin.
fn shape(settings: &Settings) -> Result<Shape, Failure> {
    let rim = settings.rim.map(|rim| Rim {
        width_mm: rim.width.mm,
        rise_mm: rim.rise.mm,
        mark_mm: settings.mark.map(|length| length.mm),
    });
    if rim.is_none() && settings.mark.is_some() {
        return Err(Failure::Usage(
            "--mark cuts off a corner of the rim, and there is none: add --rim WIDTH,HEIGHT".into(),
        ));
    }
    Ok(Shape { rim, origin: settings.origin.unwrap_or_default().into() })
}

/// Reads a picture as light plus a constant.
pub(crate) fn open_target(path: &Path, transfer: Option<Transfer>, offset: f64) -> Result<TargetIrradiance, Failure> {
    TargetIrradiance::from_picture(&open_picture(path, transfer)?, offset).map_err(Failure::refused)
}

/// Reads a picture, with the failure's kind: a file that cannot be read is another matter than one that makes no target.
fn open_picture(path: &Path, transfer: Option<Transfer>) -> Result<Picture, Failure> {
    Picture::open(path, transfer).map_err(|error| match error {
        PictureError::Io(_) | PictureError::Decode(_) | PictureError::Exr(_) => {
            Failure::Io { what: format!("{} is not a readable picture", path.display()), source: error.into() }
        }
        refused => Failure::refused(refused),
    })
}
