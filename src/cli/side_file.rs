//! The file that lies beside every set of outputs, so that nobody has to remember how a block was meant.

mod numbers;

use super::{
    conflicts,
    error::Failure,
    lamp::Emission,
    settings::{Settings, Shift, SolverName, name_of},
    toml_file,
};
use glam::{DVec2, DVec3};
use glasswarp::{
    bench::{Bench, ExitFace},
    export::{HeightMap, HeightMapFormat, write_atomically},
    light::Light,
    solid::Solid,
};
pub(crate) use glasswarp_files::sha256;
use serde::Deserialize;
use std::{
    collections::BTreeMap,
    fmt::Write as _,
    io::{self, Write as _},
    path::{Path, PathBuf},
};

/// What a side file records of the bench; read back by `verify`.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(crate) struct BenchRecord {
    pub(crate) width_mm: f64,
    pub(crate) height_mm: f64,
    pub(crate) entry_z_mm: f64,
    pub(crate) relief_mm: f64,
    pub(crate) thinnest_mm: f64,
    pub(crate) distance_mm: f64,
    pub(crate) window_width_mm: f64,
    pub(crate) window_height_mm: f64,
    /// In the receiver's own coordinates.
    #[serde(default)]
    pub(crate) window_centre_mm: [f64; 2],
    /// A rotation vector, radians, about the receiver's point on the axis.
    #[serde(default)]
    pub(crate) receiver_turned: [f64; 3],
    /// Of the block; 1 for a mirror.
    pub(crate) ior: f64,
    #[serde(default)]
    pub(crate) mirror: bool,
    /// Unit vector along which light travels before it meets the block; from a source, that of its axis.
    #[serde(default = "along_the_axis")]
    pub(crate) light_direction: [f64; 3],
    /// A point source, where there is one.
    pub(crate) source_mm: Option<[f64; 3]>,
    /// How far the exit face goes on beyond `width_mm` and `height_mm`, on every side.
    #[serde(default)]
    pub(crate) skirt_mm: [f64; 2],
}

impl BenchRecord {
    /// The bench alone.
    pub(crate) fn of(bench: &Bench) -> Self {
        let (light_direction, source_mm) = match bench.light() {
            Light::Parallel { .. } => (bench.light_in_air(), None),
            Light::Point { position_mm, thickness_mm, .. } => {
                let middle_z = if bench.exit_face() == ExitFace::Reflects { 0.0 } else { -thickness_mm };
                ((DVec3::Z * middle_z - position_mm).normalize(), Some(position_mm.to_array()))
            }
        };
        Self {
            width_mm: bench.block().width_mm,
            height_mm: bench.block().height_mm,
            entry_z_mm: 0.0,
            relief_mm: 0.0,
            thinnest_mm: 0.0,
            distance_mm: bench.distance_mm(),
            window_width_mm: bench.window().width_mm,
            window_height_mm: bench.window().height_mm,
            window_centre_mm: bench.window_centre_mm().to_array(),
            receiver_turned: bench.receiver().rotation().to_array(),
            ior: bench.exit_face().ior(),
            mirror: bench.exit_face() == ExitFace::Reflects,
            light_direction: light_direction.to_array(),
            source_mm,
            skirt_mm: [0.0; 2],
        }
    }

    /// The same with the block that stands on it.
    pub(crate) fn with(self, solid: &Solid) -> Self {
        let skirt = 0.5 * (solid.surface().extent().as_vec() - DVec2::new(self.width_mm, self.height_mm));
        Self {
            entry_z_mm: solid.entry_z_mm(),
            relief_mm: solid.surface().relief_mm(),
            thinnest_mm: solid.thinnest_mm(),
            skirt_mm: skirt.to_array(),
            ..self
        }
    }

    /// What the exit face does.
    pub(crate) fn exit_face(&self) -> ExitFace {
        if self.mirror { ExitFace::Reflects } else { ExitFace::Refracts { ior: self.ior } }
    }

    /// The share of the exit face that its skirt is.
    pub(crate) fn skirt_share(&self) -> f64 {
        let face = self.face_mm();
        1.0 - self.width_mm * self.height_mm / (face.x * face.y)
    }

    /// Size of the exit face with its skirt, mm.
    pub(crate) fn face_mm(&self) -> DVec2 {
        DVec2::new(self.width_mm, self.height_mm) + 2.0 * DVec2::from(self.skirt_mm)
    }
}

fn along_the_axis() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// Where the coordinates of the files are counted from.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(crate) struct FrameRecord {
    /// In the frame of the bench, mm.
    #[serde(default)]
    pub(crate) origin_mm: [f64; 3],
}

/// A side file as it is read back.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct SideFile {
    pub(crate) design: Settings,
    pub(crate) bench: BenchRecord,
    pub(crate) picture: PictureRecord,
    #[serde(default)]
    pub(crate) frame: FrameRecord,
    #[serde(default)]
    pub(crate) files: BTreeMap<String, String>,
    /// What has been done to the block since it was designed.
    pub(crate) work: Option<WorkRecord>,
}

/// What has been done to a block in simulation.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct WorkRecord {
    pub(crate) done: String,
}

/// Which picture it was.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct PictureRecord {
    pub(crate) sha256: String,
}

/// What messages call a side file.
const KIND: &str = "side file of a block";

/// Where the side file of an output lies: the same name with the extension `toml`.
pub(crate) fn path_beside(output: &Path) -> PathBuf {
    output.with_extension("toml")
}

impl SideFile {
    /// Where the vertices of a file of this block are counted from, in the frame of the bench, mm.
    pub(crate) fn origin_of(&self, file: &Path) -> DVec3 {
        // Height maps have no origin.
        if HeightMapFormat::from_path(file).is_ok() { DVec3::ZERO } else { DVec3::from(self.frame.origin_mm) }
    }

    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let side = toml_file::read::<Self>(path, KIND)?;
        conflicts::check_file(&side.design).map_err(|refusal| toml_file::placed(refusal, path))?;
        Ok(side.placed(path))
    }

    /// What [`read`](Self::read) will find at `path` once this is [written](write) there, but for files that are not made yet.
    pub(crate) fn foresee(path: &Path, record: &Record<'_>) -> Result<Self, Failure> {
        Ok(toml_file::parse::<Self>(&render(path, record)?, path, KIND)?.placed(path))
    }

    /// The same with the paths that it names, which are relative to its own.
    fn placed(mut self, path: &Path) -> Self {
        self.design.resolve_paths(path);
        self
    }

    /// The side file of a block: the one that is named, else the one beside it, if it is there.
    pub(crate) fn find(block: &Path, named: Option<&Path>) -> Result<Option<Self>, Failure> {
        if !block.exists() {
            return Err(Failure::reading(block, io::ErrorKind::NotFound.into()));
        }
        let path = named.map_or_else(|| path_beside(block), Path::to_path_buf);
        match named {
            None if !path.exists() => Ok(None),
            _ => Self::read(&path).map(Some),
        }
    }

    /// The side file of a block, which must have one. `or_else` says what else would do.
    pub(crate) fn of_block(block: &Path, named: Option<&Path>, or_else: &str) -> Result<Self, Failure> {
        Self::find(block, named)?.ok_or_else(|| missing(block, or_else))
    }
}

/// What a command reads that looks at a block, or at a design file: that, its side file, and all that they name.
pub(crate) fn inputs(block: &Path, named: Option<&Path>) -> Result<Vec<PathBuf>, Failure> {
    let mut inputs = vec![block.to_path_buf()];
    if block.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        inputs.extend(Settings::read(block)?.files().map(Path::to_path_buf));
    } else if let Some(side) = SideFile::find(block, named)? {
        inputs.push(named.map_or_else(|| path_beside(block), Path::to_path_buf));
        inputs.extend(side.design.files().map(Path::to_path_buf));
    }
    Ok(inputs)
}

/// There is no side file where there must be one.
pub(crate) fn missing(block: &Path, or_else: &str) -> Failure {
    Failure::Usage(format!(
        "there is no side file {}: name one with --bench, keep the .toml that was written with the block beside it{or_else}",
        path_beside(block).display()
    ))
}

/// What [`write`] needs to know.
pub(crate) struct Record<'a> {
    pub(crate) picture: &'a Path,
    pub(crate) settings: &'a Settings,
    pub(crate) bench: &'a BenchRecord,
    pub(crate) solver: SolverName,
    pub(crate) solid: &'a Solid,
    /// What the height maps among the outputs hold.
    pub(crate) height_map: Option<&'a HeightMap>,
    /// What has been done to the block since it was designed.
    pub(crate) done: Option<&'a str>,
    /// Outputs that share this side file.
    pub(crate) outputs: &'a [(&'a Path, String)],
}

/// Writes the side file at `path`, with hashes of the picture and of every output.
pub(crate) fn write(path: &Path, record: &Record<'_>) -> Result<(), Failure> {
    let text = render(path, record)?;
    write_atomically(path, |out| out.write_all(text.as_bytes())).map_err(Failure::writing)
}

fn render(path: &Path, record: &Record<'_>) -> Result<String, Failure> {
    let Record { settings, bench, .. } = record;
    let beside = |file: &Path| quoted(&relative_to(file, path).to_string_lossy());
    let mut text = String::new();
    let mut line = |args: std::fmt::Arguments<'_>| {
        writeln!(text, "{args}").map_err(|e| Failure::Io { what: "formatting".into(), source: e.into() })
    };
    line(format_args!("# Written by glasswarp {}. All lengths are millimetres.", env!("CARGO_PKG_VERSION")))?;
    let which = if record.done.is_some() { "the block before [work]" } else { "this block" };
    line(format_args!(
        "# `glasswarp design {}` makes {which} again, `glasswarp verify` reads its bench from here.",
        file_name(path)
    ))?;
    line(format_args!("\n[design]"))?;
    line(format_args!("picture = {}", beside(record.picture)))?;
    line(format_args!("size = \"{}mm\"", bench.width_mm))?;
    line(format_args!("distance = \"{}mm\"", bench.distance_mm))?;
    match &settings.material {
        Some(material) => line(format_args!("material = {} # its index is that of [bench]", quoted(material)))?,
        None if bench.mirror => {}
        None => line(format_args!("ior = {:?}", bench.ior))?,
    }
    if let Some(wavelength) = settings.wavelength {
        line(format_args!("wavelength = \"{wavelength}\""))?;
    }
    if let Some(thickness) = settings.thickness {
        line(format_args!("thickness = \"{}mm\"", thickness.mm))?;
    }
    if let Some(window) = settings.window {
        line(format_args!("window = \"{}mm\" # width of the picture on the receiver", window.mm))?;
    }
    if let Some(Shift { right, up }) = settings.shift {
        line(format_args!("shift = \"{}mm,{}mm\" # to the right and up, as seen from the block", right.mm, up.mm))?;
    }
    if let Some(leaning) = settings.receiver_tilt {
        line(format_args!("receiver-tilt = \"{leaning}\" # this side recedes: 0 top, 90 right, 180 bottom, 270 left"))?;
    }
    if settings.is_mirror() {
        line(format_args!("mirror = true"))?;
    }
    line(format_args!("light = {}", quoted(&name_of(settings.light()))))?;
    if let Some(tilt) = settings.tilt {
        line(format_args!(
            "tilt = \"{tilt}\" # the light comes from this side: 0 top, 90 right, 180 bottom, 270 left"
        ))?;
    }
    if let Some(distance) = settings.source_distance {
        line(format_args!("source-distance = \"{}mm\" # to the middle of the entry face", distance.mm))?;
    }
    match &settings.emission {
        Some(Emission::Ies(file)) => line(format_args!("emission = {}", beside(file)))?,
        Some(emission) => line(format_args!("emission = {}", quoted(&emission.to_string())))?,
        None => {}
    }
    if let Some(file) = &settings.beam {
        line(format_args!("beam = {}", beside(file)))?;
    }
    if let Some(source) = settings.source_size {
        line(format_args!("source-size = \"{source}\""))?;
    }
    if let Some(roughness) = settings.roughness {
        line(format_args!("roughness = \"{}\" # standard deviation of the slope along any direction", roughness.0))?;
    }
    if let Some(speck) = &settings.psf {
        let text = format!("{},{}mm", relative_to(&speck.path, path).to_string_lossy(), speck.pixel.mm);
        line(format_args!("psf = {} # and the size of its pixels on the receiver", quoted(&text)))?;
    }
    if let Some(how) = settings.deconvolution {
        line(format_args!("deconvolution = {}", quoted(&name_of(how))))?;
    }
    if let Some(rounds) = settings.deconvolution_rounds {
        line(format_args!("deconvolution-rounds = {rounds}"))?;
    }
    if let Some(mesh) = &settings.caustic_mesh {
        line(format_args!("caustic-mesh = {}", beside(mesh)))?;
    }
    if let Some(outline) = settings.outline {
        line(format_args!("outline = {}", quoted(&outline.to_string())))?;
    }
    if let Some(skirt) = settings.skirt {
        line(format_args!("skirt = \"{}mm\"", skirt.mm))?;
    }
    if let Some(least) = settings.min_thickness {
        line(format_args!("min-thickness = \"{}mm\"", least.mm))?;
    }
    if let Some(nodes) = settings.nodes {
        line(format_args!("nodes = {nodes}"))?;
    }
    if let Some(rim) = settings.rim {
        line(format_args!(
            "rim = \"{}mm,{}mm\" # width, and height of its plane above the highest point of the exit face",
            rim.width.mm, rim.rise.mm
        ))?;
    }
    if let Some(mark) = settings.mark {
        line(format_args!("mark = \"{}mm\"", mark.mm))?;
    }
    if let Some(origin) = settings.origin {
        line(format_args!("origin = {}", quoted(&name_of(origin))))?;
    }
    if let Some(um) = settings.step_tolerance {
        line(format_args!("step-tolerance = {um:?} # um"))?;
    }
    if let Some(margin) = settings.margin {
        line(format_args!("margin = {margin:?} # share of the window that stays dark on every side"))?;
    }
    if let Some(vignette) = settings.vignette {
        line(format_args!("vignette = {}", quoted(&vignette.to_string())))?;
    }
    if let Some(offset) = settings.offset {
        line(format_args!("offset = {offset:?}"))?;
    }
    picture(&mut line, settings)?;
    line(format_args!("solver = {}", quoted(&name_of(record.solver))))?;
    if let Some(quality) = settings.quality {
        line(format_args!("quality = {}", quoted(&name_of(quality))))?;
    }
    if let Some(radius) = settings.min_radius {
        line(format_args!("min-radius = \"{}mm\"", radius.mm))?;
    }
    if let Some(finish) = settings.finish {
        line(format_args!("finish = {}", quoted(&finish.to_string())))?;
    }
    line(format_args!("\n[bench]"))?;
    line(format_args!("mirror = {} # whether the exit face reflects", bench.mirror))?;
    line(format_args!(
        "light-direction = {:?} # {}, before it meets the block",
        bench.light_direction,
        if bench.source_mm.is_some() { "axis of the lamp" } else { "of parallel light" }
    ))?;
    if let Some(source) = bench.source_mm {
        line(format_args!("source-mm = {source:?} # the lamp"))?;
    }
    numbers::emission(&mut line, settings)?;
    line(format_args!("ior = {:?}", bench.ior))?;
    line(format_args!("width-mm = {:?} # along x", bench.width_mm))?;
    line(format_args!("height-mm = {:?} # along y", bench.height_mm))?;
    numbers::face(&mut line, record.solid)?;
    line(format_args!(
        "entry-z-mm = {:?} # the planar face; the mean plane of the exit face is z = 0",
        bench.entry_z_mm
    ))?;
    line(format_args!("relief-mm = {:?} # of the exit face, peak to valley", bench.relief_mm))?;
    line(format_args!("thinnest-mm = {:?}", bench.thinnest_mm))?;
    line(format_args!(
        "distance-mm = {:?} # from the mean plane of the exit face, z = 0, to the receiver",
        bench.distance_mm
    ))?;
    line(format_args!("window-width-mm = {:?} # of the picture on the receiver", bench.window_width_mm))?;
    line(format_args!("window-height-mm = {:?}", bench.window_height_mm))?;
    line(format_args!("window-centre-mm = {:?} # in the receiver's coordinates", bench.window_centre_mm))?;
    line(format_args!(
        "receiver-turned = {:?} # rotation vector, radians, about its point on the axis",
        bench.receiver_turned
    ))?;
    line(format_args!("skirt-mm = {:?} # of the exit face beyond the picture's light, on every side", bench.skirt_mm))?;
    line(format_args!("picture-orientation = \"seen on the receiver from the block's side: left is +x, top is +y\""))?;
    frame(&mut line, record.solid)?;
    if let Some(done) = record.done {
        line(format_args!("\n[work]"))?;
        line(format_args!("done = {}", quoted(done)))?;
    }
    line(format_args!("\n[picture]"))?;
    line(format_args!("sha256 = \"{}\"", hash_of(record.picture)?))?;
    numbers::beam(&mut line, settings)?;
    line(format_args!("\n[files] # sha256"))?;
    for (output, hash) in record.outputs {
        line(format_args!("{} = \"{hash}\"", quoted(&file_name(output))))?;
    }
    for (output, _) in record.outputs.iter().filter(|(output, _)| HeightMapFormat::from_path(output).is_ok()) {
        line(format_args!(
            "\n[height-maps.{}] # the numbers that stand in its metadata too",
            quoted(&file_name(output))
        ))?;
        for (name, value) in record.height_map.map(HeightMap::entries).unwrap_or_default() {
            let value = if value.parse::<f64>().is_ok() { value } else { quoted(&value) };
            line(format_args!("{name} = {value}"))?;
        }
    }
    Ok(text)
}

/// How the picture is read, where that was said, and what is done to it.
fn picture(
    line: &mut impl FnMut(std::fmt::Arguments<'_>) -> Result<(), Failure>,
    settings: &Settings,
) -> Result<(), Failure> {
    if let Some(transfer) = settings.transfer {
        line(format_args!("transfer = {} # whatever the picture's file says", quoted(&name_of(transfer))))?;
    }
    if let Some(background) = settings.background {
        line(format_args!("background = \"{background}\" # behind the picture's transparent parts"))?;
    }
    if let Some(layer) = &settings.layer {
        line(format_args!("layer = {}", quoted(layer)))?;
    }
    if let Some(crop) = settings.crop {
        line(format_args!("crop = \"{crop}\" # x, y, width, height of the part that is used"))?;
    }
    if let Some(rotation) = settings.rotate {
        line(format_args!("rotate = \"{rotation}\" # clockwise"))?;
    }
    if let Some(flip) = settings.flip {
        line(format_args!("flip = \"{flip}\""))?;
    }
    if let Some(levels) = settings.levels {
        line(format_args!("levels = \"{levels}\" # black, white, gamma"))?;
    }
    if let Some(invert) = settings.invert {
        line(format_args!("invert = {invert}"))?;
    }
    Ok(())
}

/// Where the coordinates of the files are counted from, and what stands around the exit face.
fn frame(line: &mut impl FnMut(std::fmt::Arguments<'_>) -> Result<(), Failure>, solid: &Solid) -> Result<(), Failure> {
    let (shape, stock, origin) = (solid.shape(), solid.stock_extent(), solid.origin_mm().to_array());
    line(format_args!("\n[frame] # of the files: millimetres, z up (GLB: metres, y up); height maps keep to [bench]"))?;
    line(format_args!("origin = {} # {}", quoted(shape.origin.name()), shape.origin.place()))?;
    line(format_args!("origin-mm = {origin:?} # in the frame of [bench]"))?;
    line(format_args!("stock-width-mm = {:?} # along x", stock.width_mm))?;
    line(format_args!("stock-height-mm = {:?} # along y", stock.height_mm))?;
    line(format_args!("stock-thickness-mm = {:?} # from the entry face to the highest point", solid.thickness_mm()))?;
    if let (Some(rim), Some(z)) = (shape.rim, solid.rim_z_mm()) {
        line(format_args!("rim-width-mm = {:?} # on every side of the exit face", rim.width_mm))?;
        line(format_args!("rim-z-mm = {z:?} # its plane, in the frame of [bench]"))?;
        if let Some(mark) = rim.mark_mm {
            line(format_args!("mark-mm = {mark:?} # cut off the corner at +x, +y: the picture's top left"))?;
        }
    }
    Ok(())
}

/// The last part of a path.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// The path of `file` as seen from the folder of `from`, absolute where they have no folder in common.
fn relative_to(file: &Path, from: &Path) -> PathBuf {
    let folder = match from.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let (Ok(file), Ok(folder)) = (file.canonicalize(), folder.canonicalize()) else { return file.to_owned() };
    let shared = file.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    if shared <= 1 {
        return file;
    }
    let up = folder.components().skip(shared).map(|_| std::path::Component::ParentDir);
    up.chain(file.components().skip(shared)).collect()
}

/// The SHA-256 of a file; that it cannot be read is a failure.
pub(crate) fn hash_of(path: &Path) -> Result<String, Failure> {
    sha256(path).map_err(|source| Failure::reading(path, source))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_written_relative_to_the_side_file() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        std::fs::create_dir_all(root.join("a/b")).unwrap();
        std::fs::write(root.join("a/p.png"), "x").unwrap();
        let relative = relative_to(&root.join("a/p.png"), &root.join("a/b/block.toml"));
        assert_eq!(relative, Path::new("../p.png"));
        assert_eq!(relative_to(&root.join("a/p.png"), &root.join("a/block.toml")), Path::new("p.png"));
    }
}
