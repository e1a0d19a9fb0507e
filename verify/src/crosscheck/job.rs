//! A scene on the disk, and running it.

use super::{error::CrosscheckError, renderer::Renderer};
use glam::DVec2;
use glasswarp_files::{WriteError, enter, may_replace, write_atomically};
use std::{
    ffi::OsStr,
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// How pictures say what they mean.
#[derive(Clone, Copy, Debug)]
pub(super) enum Code {
    /// Landing points: red and green run from the first point to the second, blue is 1 where
    /// anything was hit.
    Landings([DVec2; 2]),
    /// Irradiance; a pixel of value `clipped` or more is clipped, light without a block has the
    /// value `exposure`.
    Irradiance { clipped: f64, exposure: f64 },
}

/// One start of a program.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub(super) args: Vec<String>,
    /// File that it writes, in the folder.
    pub(super) output: String,
}

/// Exit status of a script whose package is not installed.
const NO_SUCH_PACKAGE: i32 = 77;

/// A scene in a folder, and how to run it.
#[derive(Clone, Debug)]
pub struct Job {
    pub(super) renderer: Renderer,
    pub(super) folder: PathBuf,
    pub(super) code: Code,
    pub(super) pixels: (usize, usize),
    pub(super) runs: Vec<Run>,
}

impl Job {
    /// Where the scene lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The commands that render it, to be typed in its folder.
    pub fn commands(&self) -> Vec<String> {
        let line = |run: &Run| format!("{} {}", self.renderer.program().to_string_lossy(), run.args.join(" "));
        self.runs.iter().map(line).collect()
    }

    /// Smallest step of a coordinate that the pictures of map mode can tell, mm; 0 if it does not
    /// matter.
    pub fn quantum_mm(&self) -> f64 {
        match (self.renderer, self.code) {
            (Renderer::PovRay, Code::Landings([from, to])) => (to - from).max_element() / f64::from(u16::MAX),
            _ => 0.0,
        }
    }

    /// Renders the scene with `program`, or the renderer's usual executable. What it prints is kept
    /// in the folder.
    ///
    /// # Errors
    /// A program that is missing or fails.
    pub fn run(&self, program: Option<&OsStr>) -> Result<(), CrosscheckError> {
        let program = program.map_or_else(|| self.renderer.program(), OsStr::to_os_string);
        for run in &self.runs {
            let output = self.folder.join(&run.output);
            let log = output.with_extension("log");
            let writing = |path: &Path| {
                let path = path.to_path_buf();
                |source| WriteError::Io { path, source }
            };
            may_replace(&output).and_then(|()| may_replace(&log))?;
            // A picture of an earlier run must not be taken for this one's.
            match fs::remove_file(&output) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => Err(writing(&output)(source))?,
                _ => {}
            }
            let file = File::create(&log).map_err(writing(&log))?;
            let both = file.try_clone().map_err(writing(&log))?;
            let mut command = Command::new(&program);
            // Blender takes its working folder from the shell's variable.
            if let Ok(folder) = self.folder.canonicalize() {
                command.env("PWD", folder);
            }
            command.current_dir(&self.folder).args(&run.args).stdin(Stdio::null()).stdout(file).stderr(both);
            let failed = |what: String| CrosscheckError::Failed {
                renderer: self.renderer,
                what,
                tail: tail(&log),
                log: log.clone(),
            };
            let missing = || CrosscheckError::NotInstalled {
                renderer: self.renderer,
                program: program.to_string_lossy().into_owned(),
                folder: self.folder.clone(),
            };
            let status = command.status();
            // However it ended: the next run may replace what this one has left.
            for left in [&log, &output].into_iter().filter(|left| left.exists()) {
                enter(left)?;
            }
            match status {
                Ok(status) if status.code() == Some(NO_SUCH_PACKAGE) => return Err(missing()),
                Ok(status) if !status.success() => return Err(failed(status.to_string())),
                Ok(_) if !output.exists() => return Err(failed(format!("{} was not written", run.output))),
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    return Err(missing());
                }
                Err(error) => return Err(failed(error.to_string())),
            }
        }
        Ok(())
    }

    pub(super) fn make_folder(&self) -> Result<(), CrosscheckError> {
        let failed = |source| WriteError::Io { path: self.folder.clone(), source };
        Ok(fs::create_dir_all(&self.folder).map_err(failed)?)
    }

    /// Writes a file of the folder.
    pub(super) fn write(
        &self,
        name: &str,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), CrosscheckError> {
        Ok(write_atomically(&self.folder.join(name), |out| content(out))?)
    }

    pub(super) fn write_readme(&self) -> Result<(), CrosscheckError> {
        let what = match self.code {
            Code::Landings(_) => "map: every pixel is the point where one ray of light lands",
            Code::Irradiance { .. } => "image: the caustic on the receiver, twice, with different noise",
        };
        let commands: String = self.commands().iter().map(|line| format!("    {line}\n")).collect();
        self.write("README.txt", |out| {
            write!(
                out,
                "A block of glass as a scene for {}, in millimetres.\nThis is its {what}.\n\nTo render it, in this folder:\n\n{commands}",
                self.renderer.name()
            )
        })
    }
}

/// The last lines of a log.
fn tail(log: &Path) -> String {
    let text = fs::read(log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines[lines.len().saturating_sub(8)..].join("\n")
}
