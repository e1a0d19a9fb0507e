//! What `--json` prints. The doc comments here become `docs/glasswarp.schema.json`, which a test compares; docs/json.md explains.

#[cfg(test)]
use schemars::JsonSchema;
use serde::Serialize;

/// Grows when a key is removed or changes its meaning; new keys may appear without that.
pub const SCHEMA: u32 = 1;

/// Declares records that are written as JSON; their schema is made in tests only.
macro_rules! records {
    ($($(#[$about:meta])* $name:ident { $($(#[$field_about:meta])* $field:ident: $kind:ty,)* })*) => {
        $(
            $(#[$about])*
            #[derive(Clone, Debug, Serialize)]
            #[cfg_attr(test, derive(JsonSchema), schemars(deny_unknown_fields))]
            pub struct $name { $($(#[$field_about])* pub $field: $kind,)* }
        )*
    };
}

records! {
    /// The one document that a command prints with --json. Lengths are millimetres, angles degrees, errors and shares of light have
    /// no unit; null stands for what is not known or not finite.
    Document {
        /// Version of this schema: it grows when a key is removed or changes its meaning.
        schema: u32,
        /// Version of glasswarp.
        version: String,
        /// The command: design, verify, check, ...
        command: String,
        /// 0 fine, 1 file or internal error, 2 refused, 3 fell short, 4 the mesh is no closed solid.
        exit_code: u8,
        /// What went well and may not be what was meant.
        warnings: Vec<String>,
        /// Why the exit code is not 0.
        error: Option<Fault>,
        /// What was found or made; also with exit code 3.
        result: Option<Result>,
    }
    /// Why a command failed.
    Fault {
        /// The kind, which decides the exit code.
        kind: FaultKind,
        /// What happened.
        message: String,
        /// Why, the nearest cause first.
        causes: Vec<String>,
    }
    /// Whether a block will work, from everything that was asked.
    Verdict {
        /// yes; yes, but; not yet asked; or no.
        answer: String,
        /// The same with its reasons.
        says: String,
        /// What it rests on.
        concerns: Vec<Concern>,
    }
    /// One thing that decides whether a block will work.
    Concern {
        /// What was asked: picture, light, cutter, ...
        question: String,
        /// yes; yes, but; not yet asked; or no.
        answer: String,
        /// Why, and what to do.
        says: String,
    }
    /// Plates in a row.
    Stack {
        /// The file that names them.
        file: String,
        /// The plates, in the order of the light.
        plates: Vec<Design>,
    }
    /// What was found of plates in a row.
    StackLight {
        /// Every plate with those before it, in the order of the light.
        plates: Vec<Verify>,
    }
    /// A design.
    Design {
        /// Whether it will work, as far as it was asked.
        verdict: Verdict,
        /// The files of the block and its height maps.
        files: Vec<String>,
        /// The pictures and pages drawn beside them.
        pictures: Vec<String>,
        /// The block.
        block: Block,
        /// The bench.
        bench: Bench,
        /// How the face was found.
        solver: Solver,
        /// What there is to say of single files.
        notes: Vec<String>,
        /// The light through the file as read back; null with --no-verify.
        judgement: Option<Judgement>,
        /// What each step from the solver to the files does to the light.
        budget: Vec<BudgetStep>,
        /// The light after the finish that the face is designed for.
        finished: Option<Finished>,
        /// The light that there is, from a source with a size or through a rough face; null where light is perfect.
        imperfect: Option<Imperfect>,
        /// The most memory that the run was expected to take, bytes.
        expected_memory: u64,
        /// Programs written, each read back and run over the block.
        programs: Vec<Program>,
    }
    /// A test coupon.
    Coupon {
        /// Files written.
        files: Vec<String>,
        /// The block.
        block: Block,
        /// Refractive index that it is planned for.
        ior: f64,
        /// From its flat face to the sheet on which it is read.
        distance_mm: f64,
        /// From the lamp to its flat face.
        lamp_distance_mm: f64,
        /// Diameter of the lamp.
        lamp_diameter_mm: f64,
        /// The finishing cutter.
        cutter: String,
        /// Radius of the sharpest hollow.
        sharpest_mm: f64,
        /// The ladder, from its coarsest ruling.
        rulings: Vec<CouponRuling>,
        /// How far apart the two uprights stand on the sheet, by the index.
        uprights: Vec<CouponUprights>,
        /// By how much the index is read too high for a millimetre that the sheet is too far away.
        ior_per_mm: f64,
        /// What is read from the traced light of the coupon after some work on it.
        readings: Vec<CouponReading>,
    }
    /// A ruling of a test coupon.
    CouponRuling {
        /// Its number, from 1.
        number: usize,
        /// Period of its wave.
        period_mm: f64,
        /// Amplitude of its wave.
        amplitude_mm: f64,
        /// Standard deviation of the polish that makes its bar as long as the marks.
        sigma_mm: f64,
    }
    /// Where the uprights of a test coupon stand.
    CouponUprights {
        /// Refractive index.
        ior: f64,
        /// How far apart they stand.
        apart_mm: f64,
    }
    /// A test coupon, read by the rules of its page.
    CouponReading {
        /// What was done to it, in words.
        state: String,
        /// Its refractive index.
        ior: f64,
        /// The index that is read; null where the sheet cannot be read.
        ior_read: Option<f64>,
        /// The polish that is read, standard deviation; null where the ladder cannot be read, and below it while rows show.
        polish_read_mm: Option<f64>,
        /// The step-over that is read; null without a streak.
        step_over_read_mm: Option<f64>,
        /// The direction of the rows that is read, degrees from x towards y; null without a streak.
        rows_read_deg: Option<f64>,
    }
    /// A preview.
    Preview {
        /// Files written.
        files: Vec<String>,
        /// The coarse block.
        block: Block,
        /// The bench.
        bench: Bench,
        /// Relative root mean square error of the draft.
        rel_rms: Option<f64>,
        /// Structural similarity of the draft.
        ssim: Option<f64>,
    }
    /// A block of glass, or a mirror.
    Block {
        /// Width of the exit face.
        width_mm: f64,
        /// Height of the exit face.
        height_mm: f64,
        /// From the entry face to the highest point.
        thickness_mm: f64,
        /// Of the exit face, peak to valley.
        relief_mm: f64,
        /// The thinnest place.
        thinnest_mm: f64,
        /// Height nodes along x and y.
        nodes: [usize; 2],
    }
    /// Where the block stands.
    Bench {
        /// Refractive index; null for a mirror.
        ior: Option<f64>,
        /// The light in words.
        light: String,
        /// From the mean plane of the exit face, along the axis.
        distance_mm: f64,
        /// Width and height of the picture on the receiver.
        window_mm: [f64; 2],
        /// Its middle, in the coordinates of the receiver.
        window_centre_mm: [f64; 2],
    }
    /// How a face was found.
    Solver {
        /// Name of the solver.
        name: String,
        /// Iterations on all levels.
        iterations: usize,
        /// Wall-clock time, seconds.
        seconds: f64,
        /// Levels that stopped at their limit of iterations.
        levels_at_limit: usize,
        /// What the solver has to say.
        notes: Vec<String>,
    }
    /// The light through a block or solid, judged.
    Verify {
        /// The file.
        file: String,
        /// What it holds: block, or solid (traced as flat triangles).
        kind: String,
        /// Its size along x and y.
        size_mm: [f64; 2],
        /// The bench.
        bench: Bench,
        /// The constant added to the light of the picture.
        offset: Option<f64>,
        /// The light.
        judgement: Judgement,
        /// What other views of the same file do to the light.
        budget: Vec<BudgetStep>,
        /// The light after the finish that the face is designed for.
        finished: Option<Finished>,
        /// The light that there is, from a source with a size or through a rough face; null where light is perfect.
        imperfect: Option<Imperfect>,
        /// The light of all colours, with --white.
        white: Option<White>,
        /// Files written.
        files: Vec<String>,
    }
    /// A program of a machine, run over its block.
    Program {
        /// The file.
        file: String,
        /// Moves in it.
        moves: u64,
        /// Those of them that feed.
        feed_moves: u64,
        /// Their length.
        feed_mm: f64,
        /// Length of the rapids, as far as their ends are known.
        rapid_mm: f64,
        /// Time with feeds and acceleration.
        minutes: f64,
        /// Its tools, as number=shape.
        tools: Vec<String>,
        /// The finest decimal of its coordinates; null where there are none.
        resolution_mm: Option<f64>,
        /// The face as designed, as the program cuts it, and polished, each with its light; only the first where the block is cut through.
        steps: Vec<MillStep>,
        /// How far the cut face lies off the design.
        deviation: Deviation,
        /// What would harm the machine, the cutter or the block.
        faults: Vec<String>,
        /// What is likely wrong with the program, and what to do.
        diagnoses: Vec<String>,
        /// Files written.
        files: Vec<String>,
    }
    /// Heights of a cut face less those of the design, micrometres.
    Deviation {
        /// Root of the mean square.
        rms_um: f64,
        /// The mean; above 0 where glass is left.
        mean_um: f64,
        /// Between these two lie 99 of 100 places.
        range_um: [f64; 2],
        /// The greatest one.
        greatest_um: f64,
        /// Where it is, from the middle of the face.
        greatest_at_mm: [f64; 2],
        /// Share of the face that is still as high as the stock.
        untouched: f64,
    }
    /// The light of a file.
    Judgement {
        /// Pixels along x and y.
        pixels: [usize; 2],
        /// How well it draws the picture, where there is one.
        picture: Option<Picture>,
        /// Photons traced to confirm the beams.
        photons: u64,
        /// Relative RMS difference between the images by photons and by beams, less the noise.
        photons_differ: Option<f64>,
        /// Standard error of that difference.
        photons_differ_error: Option<f64>,
        /// Standard errors between photons and beams; beyond 4 the exit code is 3.
        photons_off: Option<f64>,
        /// Where the light went.
        light: Light,
    }
    /// How well light draws a picture.
    Picture {
        /// Relative root mean square error.
        rel_rms: Option<f64>,
        /// Peak signal to noise ratio, dB.
        psnr_db: Option<f64>,
        /// Structural similarity, 1 for the same picture.
        ssim: Option<f64>,
        /// Width of edges from 10 % to 90 %; null without edges.
        edge_width_mm: Option<f64>,
        /// The same in the picture.
        picture_edge_width_mm: Option<f64>,
        /// Darkest light as a part of the mean.
        black_level: Option<f64>,
        /// The same in the picture.
        picture_black_level: Option<f64>,
        /// Ratio of brightest and darkest light.
        contrast: Option<f64>,
        /// The same in the picture.
        picture_contrast: Option<f64>,
        /// The photons' own opinion of rel_rms, less their noise.
        photons_rel_rms: Option<f64>,
    }
    /// Where light went, as parts of all that was sent out.
    Light {
        /// Into the window.
        window: f64,
        /// Onto the receiver beside the window.
        missed: f64,
        /// Totally reflected inside.
        totally_reflected: f64,
        /// To a side wall, or into the solid again.
        side: f64,
        /// Partially reflected.
        reflected: f64,
        /// Past the solid.
        beside: f64,
        /// Lost by the tracer, which never should be.
        lost: f64,
    }
    /// One step of the error budget.
    BudgetStep {
        /// What it is.
        name: String,
        /// Relative root mean square error; null if the name says that it equals another step.
        rel_rms: Option<f64>,
        /// Structural similarity.
        ssim: Option<f64>,
        /// Relative RMS difference from the light of the true surface of the file: what this step alone does.
        moved: Option<f64>,
    }
    /// The light after a finish.
    Finished {
        /// Relative root mean square error.
        rel_rms: Option<f64>,
        /// Structural similarity.
        ssim: Option<f64>,
        /// rel_rms after a polish a tenth weaker and a tenth stronger than planned.
        if_off: Option<[Option<f64>; 2]>,
    }
    /// The light that there is.
    Imperfect {
        /// Relative root mean square error, without the noise of photons where that is known.
        rel_rms: Option<f64>,
        /// Its standard error; null without photons.
        rel_rms_error: Option<f64>,
        /// Structural similarity, of the beams' light spread on the receiver.
        ssim: Option<f64>,
        /// Photons traced.
        photons: u64,
        /// Relative RMS difference between the images by photons and by the beams' light spread on the receiver, less the noise.
        photons_differ: Option<f64>,
    }
    /// White light.
    White {
        /// Indices of blue (486.1 nm) and red (656.3 nm).
        ior: [f64; 2],
        /// Distance between their landing points, root mean square.
        parting_rms_mm: Option<f64>,
        /// The greatest such distance.
        parting_worst_mm: Option<f64>,
        /// Relative root mean square difference of the brightness from the light of one colour.
        rel_rms: Option<f64>,
    }
    /// A photon run, a part of one, or the sum of parts.
    Tally {
        /// Photons traced.
        photons: u64,
        /// Whether these are all photons of the run.
        complete: bool,
        /// Noise of a pixel, as a part of the mean irradiance.
        noise: Option<f64>,
        /// Where the light went.
        light: Light,
        /// Relative root mean square error less its noise, where there is a picture.
        rel_rms: Option<f64>,
        /// Standard error of that.
        rel_rms_error: Option<f64>,
    }
    /// Errors along a range.
    Sweep {
        /// What was varied, with its unit.
        swept: String,
        /// What was found at every place.
        points: Vec<SweepPoint>,
        /// Files written.
        files: Vec<String>,
    }
    /// One place along a range.
    SweepPoint {
        /// The varied quantity.
        value: f64,
        /// Relief of the face.
        relief_mm: f64,
        /// rel_rms of the displaced surface.
        displaced: Option<f64>,
        /// rel_rms on the normal-mapped plane.
        plane: Option<f64>,
        /// rel_rms of triangles with smooth normals.
        smooth: Option<f64>,
        /// rel_rms of flat triangles.
        facets: Option<f64>,
        /// Relative RMS difference between plane and displaced surface.
        plane_moves: Option<f64>,
    }
    /// Whether a block can be made.
    Check {
        /// The file.
        file: String,
        /// Whether every line has passed.
        makeable: bool,
        /// Whether it will work, as far as it was asked.
        verdict: Verdict,
        /// The lines of the verdict.
        lines: Vec<CheckLine>,
        /// What tolerances do to the picture, with --tolerance.
        tolerances: Option<Tolerances>,
    }
    /// Whether a block is ready to be made.
    Ready {
        /// The block.
        file: String,
        /// Whether it will work.
        verdict: Verdict,
        /// Relative RMS error of what the eye gets: of the finished face, in the real light.
        rel_rms: Option<f64>,
        /// Structural similarity of the same.
        ssim: Option<f64>,
        /// Of the finishing cutter, minutes.
        minutes: f64,
        /// The standard sheet to order; null if none is thick enough.
        sheet_mm: Option<f64>,
        /// The piece to saw from it, along x and y.
        sawn_mm: [f64; 2],
        /// Files written.
        files: Vec<String>,
    }
    /// A line of a verdict.
    CheckLine {
        /// What was checked.
        what: String,
        /// Whether it passed.
        passed: bool,
        /// What was found, in words and with units.
        says: String,
    }
    /// What tolerances do to a picture.
    Tolerances {
        /// rel_rms as designed.
        designed: Option<f64>,
        /// What can be off.
        cases: Vec<Tolerance>,
        /// What means nothing on this bench.
        left_out: Vec<String>,
        /// The depth of focus.
        focus: Focus,
    }
    /// What is off, and what the picture is then, looked at where it falls.
    Tolerance {
        /// What it is.
        name: String,
        /// Relative root mean square error; null where no light falls into the window.
        rel_rms: Option<f64>,
        /// Structural similarity.
        ssim: Option<f64>,
        /// Relative RMS difference from the picture of the block as it was designed.
        moved: Option<f64>,
        /// How far the whole picture moves on the receiver.
        picture_moved_mm: [f64; 2],
        /// Its width and height, as parts of those of the design.
        picture_growth: [f64; 2],
    }
    /// Distances between which a picture is in focus.
    Focus {
        /// The relative RMS error up to which it counts.
        limit: f64,
        /// The nearest; null if it is nearer than was looked.
        near_mm: Option<f64>,
        /// The furthest; null if it is further than was looked.
        far_mm: Option<f64>,
    }
    /// A block milled in simulation.
    Mill {
        /// The block.
        file: String,
        /// Whether it will work, as far as it was asked.
        verdict: Verdict,
        /// The cutter.
        cutter: String,
        /// From row to row.
        step_over_mm: f64,
        /// Rows of the pass.
        rows: usize,
        /// Way of the cutter.
        length_mm: f64,
        /// Time at the feed that was given, without acceleration.
        minutes: f64,
        /// The picture after every step.
        steps: Vec<MillStep>,
        /// Files written.
        files: Vec<String>,
        /// Programs written, each read back and run over the block.
        programs: Vec<Program>,
    }
    /// The picture after a step of the work.
    MillStep {
        /// What was done.
        name: String,
        /// Relative root mean square error.
        rel_rms: Option<f64>,
        /// Structural similarity.
        ssim: Option<f64>,
        /// Height nodes along x and y.
        nodes: [usize; 2],
    }
    /// What an independent renderer sees.
    Crosscheck {
        /// The renderer.
        renderer: String,
        /// Folder of the scene.
        scene: String,
        /// Distances between landing points, in map mode.
        map: Option<MapAgreement>,
        /// Differences between caustics by number of pixels, in image mode.
        image: Vec<ImageLevel>,
    }
    /// How landing points agree.
    MapAgreement {
        /// Rays that land by both.
        rays: usize,
        /// Rays that land by one of both only.
        contested: usize,
        /// Distances with the same interpolated normals.
        smooth: Distances,
        /// Distances with the verifier's spline surface.
        spline: Distances,
    }
    /// Distances between landing points.
    Distances {
        /// Root mean square.
        rms_mm: Option<f64>,
        /// Greatest.
        worst_mm: Option<f64>,
    }
    /// How caustics agree at one number of pixels.
    ImageLevel {
        /// Pixels across.
        pixels: usize,
        /// Relative RMS difference of one run.
        rel_rms: Option<f64>,
        /// The noise of one run.
        noise: Option<f64>,
        /// The difference without it.
        without_noise: Option<f64>,
    }
    /// The materials known by name.
    Materials {
        /// All of them.
        materials: Vec<Material>,
    }
    /// A material.
    Material {
        /// What --material takes.
        name: String,
        /// Refractive index.
        ior: f64,
        /// What it is.
        description: String,
        /// Where the index is from.
        source: String,
    }
    /// The presets.
    Presets {
        /// All of them.
        presets: Vec<Preset>,
    }
    /// A preset.
    Preset {
        /// What --preset takes.
        name: String,
        /// What it is for.
        about: String,
        /// The preset as a design file.
        design: String,
    }
    /// Text for another program: a man page, shell completions, a preset.
    Text {
        /// The text.
        text: String,
    }
}

/// The kind of a failure.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(test, derive(JsonSchema))]
pub enum FaultKind {
    /// A file could not be read or written, or something broke inside: exit code 1.
    File,
    /// The request makes no sense, or physics forbids it: exit code 2.
    Refused,
    /// A check or verification fell short of what was asked: exit code 3.
    FellShort,
    /// The mesh is no closed solid: exit code 4.
    InvalidMesh,
}

/// The result of a command.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
#[cfg_attr(test, derive(JsonSchema))]
pub enum Result {
    /// A design.
    Design(Box<Design>),
    /// Plates in a row.
    Stack(Box<Stack>),
    /// A judgement.
    Verify(Box<Verify>),
    /// verify, of plates in a row.
    StackLight(Box<StackLight>),
    /// A preview.
    Preview(Preview),
    /// A photon run.
    Tally(Tally),
    /// A range of benches.
    Sweep(Sweep),
    /// Whether a block can be made.
    Check(Check),
    /// A block milled in simulation.
    Mill(Mill),
    /// verify, of a program.
    Program(Box<Program>),
    /// Whether a block is ready to be made.
    Ready(Ready),
    /// What another renderer sees.
    Crosscheck(Crosscheck),
    /// A test coupon.
    Coupon(Box<Coupon>),
    /// Materials.
    Materials(Materials),
    /// Presets.
    Presets(Presets),
    /// Text.
    Text(Text),
}

/// A number that JSON has, or null.
pub fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Paths as text.
pub fn texts(paths: &[std::path::PathBuf]) -> Vec<String> {
    paths.iter().map(|path| path.display().to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the schema in docs/ with the records; `GLASSWARP_BLESS=1` writes it.
    #[test]
    fn the_schema_in_docs_is_that_of_the_records() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/glasswarp.schema.json");
        let mut schema = schemars::schema_for!(Document).to_value();
        schema["title"] = "glasswarp --json".into();
        let schema = serde_json::to_string_pretty(&schema).unwrap() + "\n";
        if std::env::var_os("GLASSWARP_BLESS").is_some() {
            std::fs::write(&path, &schema).unwrap();
        }
        assert!(
            std::fs::read_to_string(&path).unwrap_or_default() == schema,
            "GLASSWARP_BLESS=1 writes {}",
            path.display()
        );
    }
}
