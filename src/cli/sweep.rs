//! `glasswarp verify --sweep`: how the errors change with the bench.

use super::{
    console,
    machine::{Machine, has_extension},
    memory::MemoryArgs,
    progress::TerminalProgress,
    side_files::open_workpiece,
};
use crate::{
    export::write_atomically,
    failure::Failure,
    record::{SideFile, document},
    report::{
        self,
        pages::sweep::{curves, layers, table},
        text,
    },
    solver::{Event, Progress},
    spec::{Quantity, Range},
    study::{
        design::Plan,
        fits,
        placement::Placing,
        sweep::{Law, SweepPoint, Swept},
    },
};
use glasswarp_verify::image_file;
use std::{
    io::Write as _,
    path::{Path, PathBuf},
};

/// Sweeps the design of a side file (and its name, if it was given), or the block `as_built`, and
/// writes what was found.
pub(crate) fn run(
    range: &Range,
    steps: usize,
    (side, named): (&SideFile, Option<&Path>),
    as_built: Option<&Path>,
    (pixels, memory): (usize, MemoryArgs),
    outputs: &[PathBuf],
) -> Result<(), Failure> {
    let outputs = outputs.iter().map(|path| Ok((Output::of(path)?, path))).collect::<Result<Vec<_>, Failure>>()?;
    let picture = side.design.picture.clone();
    let picture = picture.ok_or_else(|| Failure::Usage("the side file names no picture to design for".into()))?;
    Swept::check(range.quantity, side.bench.mirror, as_built.is_some())?;
    let progress = TerminalProgress::new();
    let built = as_built
        .map(|path| open_workpiece(path, named, Placing::Righted, (None, None), pixels, &progress))
        .transpose()?;
    built.iter().try_for_each(|piece| fits::pixels(&piece.examiner, memory.free()))?;
    let fits = |plan: &Plan| fits::look(plan, pixels, memory.free()).map(drop);
    let swept = built.as_ref().map_or(Swept::Design(side, &picture), Swept::AsBuilt);
    let mut points = Vec::new();
    let mut refused = None;
    console::text(&text::sweep::header(range.quantity));
    let values = range.values(steps);
    let places = values.len();
    for (done, value) in values.into_iter().enumerate() {
        progress.begin("sweeping", places);
        progress.advance(done);
        let found = swept.at(range, value, pixels, (&Machine, &progress), &fits);
        progress.finish();
        match found {
            Ok(point) => {
                console::text(&text::sweep::point(&point));
                points.push(point);
            }
            // Some benches cannot draw the picture; the others still can, unless nobody waits for them.
            Err(failure @ (Failure::Refused(_) | Failure::Usage(_)))
                if progress.report(Event::Iteration).is_continue() =>
            {
                console::warn(format_args!("{} = {value}: {failure}", range.quantity.column()));
                refused = Some(failure);
            }
            Err(failure) => return Err(failure),
        }
    }
    if let (true, Some(failure)) = (points.is_empty(), refused) {
        return Err(failure);
    }
    // One block has one relief: its light follows another law.
    if let (None, Some(law)) = (&built, Law::fit(&points)) {
        console::text(&text::sweep::law(&law));
    }
    console::result(document::Result::Sweep(document::Sweep {
        swept: range.quantity.column().to_owned(),
        points: points.iter().map(SweepPoint::document).collect(),
        files: outputs.iter().map(|(_, path)| path.display().to_string()).collect(),
    }));
    for (name, image) in layers(range.quantity, &points) {
        console::light(&name, image);
    }
    for (kind, path) in outputs {
        kind.write(path, range.quantity, &points)?;
    }
    Ok(())
}

/// A file of a sweep, by its extension.
enum Output {
    Csv,
    Exr,
    Png,
}

impl Output {
    fn of(path: &Path) -> Result<Self, Failure> {
        match path {
            path if has_extension(path, "csv") => Ok(Self::Csv),
            path if has_extension(path, "exr") => Ok(Self::Exr),
            path if has_extension(path, "png") => Ok(Self::Png),
            _ => Err(Failure::Usage(format!(
                "{}: a sweep is written as .csv (numbers), .exr (all images as layers) or .png (curves)",
                path.display()
            ))),
        }
    }

    fn write(&self, path: &Path, quantity: Quantity, points: &[SweepPoint]) -> Result<(), Failure> {
        match self {
            Self::Csv => {
                let table = table(quantity, points);
                write_atomically(path, |out| out.write_all(table.as_bytes())).map_err(Failure::writing)
            }
            Self::Exr => image_file::write_exr_layers(path, &layers(quantity, points)).map_err(Failure::writing),
            Self::Png => report::write_png(path, &curves(quantity, points)).map_err(Failure::writing),
        }
    }
}
