//! A scene on the disk, and running it.

use super::Renderer;
use crate::{film::Image, scene::SceneError};
use glam::DVec2;
use glasswarp_files::{PlanError, WriteError, enter, may_replace, write_atomically};
use std::{
    ffi::OsStr,
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// Why a cross-check came to no result.
#[derive(Debug, thiserror::Error)]
pub enum CrosscheckError {
    /// The scene cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A file in the folder is not this program's to replace.
    #[error(transparent)]
    Owned(#[from] PlanError),
    /// The program is not there.
    #[error("{} is not installed: '{program}' or its package was not found ({}); the scene is in {}", renderer.name(), renderer.remedy(), folder.display())]
    NotInstalled {
        /// Which renderer.
        renderer: Renderer,
        /// What was looked for.
        program: String,
        /// Where the scene lies, ready to be run elsewhere.
        folder: PathBuf,
    },
    /// The program was started, and failed.
    #[error("{} failed ({what}); its last words, of which {} has more:\n{tail}", renderer.name(), log.display())]
    Failed {
        /// Which renderer.
        renderer: Renderer,
        /// Exit status, or what is missing.
        what: String,
        /// Everything it printed.
        log: PathBuf,
        /// The end of that.
        tail: String,
    },
    /// What was rendered cannot be used.
    #[error("{}: {reason}", path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A renderer whose rays cannot be aimed.
    #[error("{} cannot be used in map mode: its rays pass anywhere within their pixels; look at the caustic (--mode image)", .0.name())]
    NoMap(Renderer),
    /// No light to compare.
    #[error("no light arrives on the receiver, so there is nothing to compare")]
    Dark,
    /// A bench that cannot be.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// How pictures say what they mean.
#[derive(Clone, Copy, Debug)]
pub(super) enum Code {
    /// Landing points: red and green run from the first point to the second, blue is 1 where anything was hit.
    Landings([DVec2; 2]),
    /// Irradiance; a pixel of value `clipped` or more is clipped, light without a block has the value `exposure`.
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

    /// Smallest step of a coordinate that the pictures of map mode can tell, mm; 0 if it does not matter.
    pub fn quantum_mm(&self) -> f64 {
        match (self.renderer, self.code) {
            (Renderer::PovRay, Code::Landings([from, to])) => (to - from).max_element() / f64::from(u16::MAX),
            _ => 0.0,
        }
    }

    /// Renders the scene with `program`, or the renderer's usual executable. What it prints is kept in the folder.
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

    fn read(&self, output: &str) -> Result<Vec<[f32; 3]>, CrosscheckError> {
        let path = self.folder.join(output);
        let wrong = |reason: String| CrosscheckError::Picture { path: path.clone(), reason };
        let (size, pixels) = match self.renderer {
            Renderer::PovRay => super::povray::read(&path),
            Renderer::Blender | Renderer::Mitsuba | Renderer::LuxCore => super::scripted::read(&path),
        }
        .map_err(wrong)?;
        if size != self.pixels {
            return Err(wrong(format!("it has {size:?} pixels instead of {:?}", self.pixels)));
        }
        Ok(pixels)
    }

    /// Landing points that were rendered, in the order of the pixels.
    pub(super) fn read_landings(&self, nx: usize, ny: usize) -> Result<Vec<Option<DVec2>>, CrosscheckError> {
        let Code::Landings([from, to]) = self.code else { return Err(self.not_such("map")) };
        debug_assert_eq!(self.pixels, (nx, ny));
        let decode = |&[r, g, b]: &[f32; 3]| {
            // Blue is 1 wherever the receiver was hit: it takes out whatever the glass may have absorbed.
            (b > 0.5).then(|| from + (to - from) * DVec2::new(f64::from(r / b), f64::from(g / b)))
        };
        Ok(self.read(&self.runs[0].output)?.iter().map(decode).collect())
    }

    /// Irradiance that was rendered, one image for every run.
    pub(super) fn read_images(&self, nx: usize, ny: usize) -> Result<Vec<Image>, CrosscheckError> {
        let Code::Irradiance { clipped, .. } = self.code else { return Err(self.not_such("image")) };
        let image = |run: &Run| {
            let values: Vec<f64> = self.read(&run.output)?.iter().map(|p| f64::from(p[1])).collect();
            let over = values.iter().filter(|&&v| v >= clipped).count();
            if over > 0 {
                let path = self.folder.join(&run.output);
                return Err(CrosscheckError::Picture { path, reason: format!("{over} pixels are clipped") });
            }
            Ok(Image::new(nx, ny, values))
        };
        self.runs.iter().map(image).collect()
    }

    fn not_such(&self, mode: &str) -> CrosscheckError {
        CrosscheckError::Picture { path: self.folder.clone(), reason: format!("this is no scene of {mode} mode") }
    }
}

/// The last lines of a log.
fn tail(log: &Path) -> String {
    let text = fs::read(log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines[lines.len().saturating_sub(8)..].join("\n")
}
