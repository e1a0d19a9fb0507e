//! Plates in a row: `glasswarp design a.png --then b.png` and `glasswarp verify stack.toml`.

use super::{
    console::{self, say},
    design::{self, DesignArgs},
    machine::Machine,
    outputs,
    progress::TerminalProgress,
    side_files::{file_name, path_beside},
};
use crate::{
    export::write_atomically,
    failure::Failure,
    record::{
        StackFile,
        document::{self, Stack},
    },
    spec::{self, BeforeFile, Host as _},
    study::stack,
};
use std::{
    io::Write as _,
    path::{Path, PathBuf},
};

/// The air between plates if nobody says, mm.
const GAP_MM: f64 = 30.0;

/// Designs plates that draw the picture, and then one more with every other plate.
pub(super) fn run(args: &DesignArgs) -> Result<(), Failure> {
    let (settings, first) = spec::settings(&args.picture, &args.settings, &Machine)?;
    let asked = design::outputs(args, &args.picture, &first);
    let stack_file = path_beside(&args.within(&asked[0]));
    let of_plate = |k: usize| asked.iter().map(move |output| numbered(output, k));
    let pictures: Vec<PathBuf> = std::iter::once(first).chain(args.then.iter().cloned()).collect();
    args.make_folder()?;
    // Before any work: everything that will be written but for what stands beside it.
    let written =
        (1..=pictures.len()).flat_map(of_plate).map(|output| args.within(&output)).chain([stack_file.clone()]);
    outputs::plan(pictures.iter().map(PathBuf::as_path).chain([args.picture.as_path()]), written)?;
    let progress = TerminalProgress::new();
    let usual = [spec::Length { mm: GAP_MM }];
    let gaps = if args.gap.is_empty() { &usual } else { args.gap.as_slice() };
    let plates = stack::plates(&pictures, gaps, &settings, &Machine, &progress)?;
    progress.finish();
    let mut designs = Vec::new();
    let short = each(
        &plates,
        |plate| &plate.picture,
        |k, plate| {
            let behind = (k > 0).then(|| BeforeFile {
                path: args.within(&numbered(&asked[0], k)),
                gap: spec::Length { mm: plate.gap_mm },
            });
            let mut own = args.clone();
            own.picture.clone_from(&plate.picture);
            own.settings = plate.settings.clone();
            (own.settings.picture, own.settings.behind) = (None, behind.or(own.settings.behind));
            own.output = of_plate(k + 1).collect();
            own.height_map.iter_mut().chain(&mut own.report).for_each(|file| *file = numbered(file, k + 1));
            own.then.clear();
            own.gap.clear();
            design::make(&own, &mut |design| designs.push(design))
        },
    )?;
    let file = StackFile { stack: (1..=plates.len()).map(|k| file_name(&numbered(&asked[0], k))).collect() };
    let text = file.to_text()?;
    write_atomically(&stack_file, |out| out.write_all(text.as_bytes())).map_err(Failure::writing)?;
    say!(
        "\nthe stack is {}: 'glasswarp verify {}' looks at its plates, one after the other",
        stack_file.display(),
        stack_file.display()
    );
    let file = stack_file.display().to_string();
    console::result(document::Result::Stack(Box::new(Stack { file, plates: designs })));
    short.map_or(Ok(()), Err)
}

/// Does the same with one plate after the other. Returns the first failure of one that fell short, which does not keep the others
/// from it.
///
/// # Errors
/// The first other failure, which does.
pub(super) fn each<T>(
    plates: &[T],
    named: impl Fn(&T) -> &Path,
    mut work: impl FnMut(usize, &T) -> Result<(), Failure>,
) -> Result<Option<Failure>, Failure> {
    let mut short = None;
    for (k, plate) in plates.iter().enumerate() {
        let apart = if k == 0 { "" } else { "\n" };
        say!("{apart}plate {} of {}: {}", k + 1, plates.len(), named(plate).display());
        match work(k, plate) {
            Err(failure @ Failure::BelowThreshold(_)) => _ = short.get_or_insert(failure),
            done => done?,
        }
    }
    Ok(short)
}

/// The plates of a stack that a file names, if it is one.
pub(super) fn plates(file: &Path) -> Result<Option<Vec<PathBuf>>, Failure> {
    if !spec::mistakes::is_toml(file) {
        return Ok(None);
    }
    let Some(stack) = StackFile::parse(&Machine.text(file)?, file)? else { return Ok(None) };
    let folder = file.parent().unwrap_or(Path::new(""));
    Ok(Some(stack.stack.iter().map(|name| folder.join(name)).collect()))
}

/// `stack.stl` of the second plate is `stack.2.stl`.
fn numbered(output: &Path, plate: usize) -> PathBuf {
    let extension = output.extension().unwrap_or_default().to_string_lossy().into_owned();
    output.with_extension(format!("{plate}.{extension}"))
}
