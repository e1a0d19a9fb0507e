//! The files of a page, and the block that was designed last.

use crate::{
    files::{Hashes, light_png, sha256},
    host::PageHost,
    made::Made,
    page_progress::PageProgress,
    reply::{Reply, told},
    settings, shop,
};
use glasswarp::{
    failure::Failure,
    glam::DVec3,
    irradiance::{TargetIrradiance, to_picture_order},
    memory::Bytes,
    record::{SideFile, document},
    report::{Exposure, FileRecord, irradiance_picture},
    solver::{Event, Progress},
    spec::{OFFSET, QualityName, Settings, SolverName},
    study::{
        budget::BudgetStep, design::Plan, fits, judge::flux_document, placement::Placing,
        requirements::open_understood, verification::DesignVerification, workpiece::Workpiece,
    },
};
use glasswarp_verify::{Geometry, Light, Mesh, Optics, Scene, Surface, load};
use js_sys::{Date, Float32Array, Float64Array, Function};
use serde::{Deserialize, Serialize};
use std::{path::Path, time::Duration};
use wasm_bindgen::prelude::*;

/// Memory that a design may take: what 32 bits address, less what the page's files and the module
/// itself take.
const MEMORY: Bytes = Bytes(3_400_000_000);

/// The files of a page, and the block that was designed last.
#[wasm_bindgen]
#[derive(Default)]
pub struct Studio {
    host: PageHost,
    made: Option<Made>,
    hashes: Hashes,
    /// Of the last block: the report with what the verifier says, and the sheet for maker and shop.
    report: Option<String>,
    sheet: Option<String>,
}

/// How a picture was understood.
#[derive(Serialize)]
struct PictureFacts {
    /// Of the light, in pixels.
    size: [usize; 2],
    /// Of the picture here.
    shown: [usize; 2],
    line: Option<String>,
    rows: Vec<(&'static str, String)>,
    warnings: Vec<String>,
}

/// Another bench for the block that was designed last; what is not given stays.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
#[derive(Default)]
struct Pose {
    ior: Option<f64>,
    distance_mm: Option<f64>,
    /// Rotation vectors, radians.
    receiver_turned: Option<[f64; 3]>,
    block_turned: Option<[f64; 3]>,
    /// Of parallel light.
    direction: Option<[f64; 3]>,
    /// Of a source.
    position_mm: Option<[f64; 3]>,
}

#[derive(Serialize)]
struct PoseFacts {
    pixels: [usize; 2],
    light: document::Light,
}

#[derive(Serialize)]
struct Verified {
    verdict: document::Verdict,
    judgement: document::Judgement,
    agreement: String,
    budget: Vec<document::BudgetStep>,
    faults: Vec<(&'static str, Option<f64>)>,
    seen: Option<(String, Option<f64>, Option<f64>)>,
    pixels: [usize; 2],
    file: String,
}

#[wasm_bindgen]
impl Studio {
    /// An empty one.
    #[wasm_bindgen(constructor)]
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a file that settings may name.
    pub fn put(&mut self, name: String, bytes: Vec<u8>) {
        self.host.files.insert(name, bytes);
    }

    /// Forgets a file.
    pub fn forget(&mut self, name: &str) {
        self.host.files.remove(name);
    }

    /// The light that the picture of these settings asks for on fewer pixels, `across` at most, as a
    /// linear picture: what a large photograph is replaced by.
    ///
    /// # Errors
    /// What makes no picture.
    pub fn reduced(&self, settings: &str, across: usize) -> Result<Vec<u8>, JsValue> {
        let reduced = || {
            let (settings, picture) = settings::read(settings, &self.host)?;
            let (target, ..) = open_understood(&picture, &settings, 0.0, &self.host)?;
            let [nx, ny] = shrunk(&target, across);
            light_png(&to_picture_order(target.resampled(nx, ny).cells()))
        };
        reduced().map_err(|failure: Failure| told(&failure))
    }

    /// The light that the picture of these settings asks for, at most so many pixels across, as a
    /// picture.
    ///
    /// # Errors
    /// What makes no picture.
    pub fn picture(&self, settings: &str, across: usize) -> Result<JsValue, JsValue> {
        self.show_picture(settings, across).map_err(|failure| told(&failure))?
    }

    fn show_picture(&self, text: &str, across: usize) -> Result<Result<JsValue, JsValue>, Failure> {
        let (settings, picture) = settings::read(text, &self.host)?;
        let offset = settings.offset.unwrap_or(OFFSET);
        let (target, understood, warning) = open_understood(&picture, &settings, offset, &self.host)?;
        let (nx, ny) = (target.cells().nx(), target.cells().ny());
        let shown = shrunk(&target, across);
        let exposure =
            Exposure::of(&target, settings.transfer.map_or(glasswarp::irradiance::Transfer::Srgb, Into::into));
        let light = target.resampled(shown[0], shown[1]);
        let mut reply = Reply::new();
        reply.picture("light", &irradiance_picture(&to_picture_order(light.cells()), exposure));
        let warnings = self.host.take_warnings().into_iter().chain(warning).collect();
        Ok(reply.with_facts(&PictureFacts {
            size: [nx, ny],
            shown,
            line: understood.line(),
            rows: understood.rows(),
            warnings,
        }))
    }

    /// Designs a draft of so many nodes across, looked at with so many pixels; with the face at
    /// `mesh` x `mesh` places.
    ///
    /// # Errors
    /// Everything that makes no design, and that the listener wants no more.
    pub fn draft(
        &mut self,
        settings: &str,
        nodes: usize,
        pixels: usize,
        mesh: usize,
        listener: &Function,
    ) -> Result<JsValue, JsValue> {
        let draft = |mut settings: Settings| {
            settings.nodes = Some(nodes);
            if settings.solver.unwrap_or_default() == SolverName::Transport {
                settings.quality = Some(QualityName::Draft);
            }
            settings
        };
        self.designed(settings, draft, (pixels, mesh), listener)
    }

    /// Designs the block that is to be made.
    ///
    /// # Errors
    /// Everything that makes no design, and that the listener wants no more.
    pub fn make(
        &mut self,
        settings: &str,
        pixels: usize,
        mesh: usize,
        listener: &Function,
    ) -> Result<JsValue, JsValue> {
        self.designed(settings, |settings| settings, (pixels, mesh), listener)
    }

    /// What is wrong with the program of a page is no failure of the library: hence a result in a
    /// result.
    fn designed(
        &mut self,
        text: &str,
        changed: impl FnOnce(Settings) -> Settings,
        (pixels, mesh): (usize, usize),
        listener: &Function,
    ) -> Result<JsValue, JsValue> {
        let progress = PageProgress { listener };
        self.made = None;
        self.hashes.clear();
        (self.report, self.sheet) = (None, None);
        let work = || -> Result<Made, Failure> {
            let (settings, picture) = settings::read(text, &self.host)?;
            let asked = (settings.nodes, settings.quality);
            let mut plan = Plan::new(picture, changed(settings), &self.host, &progress)?;
            fits::look(&plan, pixels, Some(MEMORY))?;
            let began = Date::now();
            let block = plan.design(&progress)?;
            let solved = Duration::from_millis((Date::now() - began) as u64);
            // What is written down is what was asked for, and not what a draft made of it.
            (plan.settings.nodes, plan.settings.quality) = (asked.0.or(plan.settings.nodes), asked.1);
            let _ = progress.report(Event::Stage { name: "looking at the light", steps: 0 });
            Made::of(plan, (block, solved), pixels)
        };
        let made = work().map_err(|failure| told(&failure))?;
        let mut reply = Reply::new();
        let facts = made.facts(&mut reply, mesh).map_err(|failure| told(&failure))?;
        self.made = Some(made);
        reply.with_facts(&facts)
    }

    fn last(&self) -> Result<&Made, Failure> {
        self.made.as_ref().ok_or_else(|| Failure::Usage("there is no block yet".into()))
    }

    /// Heights of the last block's exit face, mm, rows along +y.
    ///
    /// # Errors
    /// There is none.
    pub fn heights(&self) -> Result<Float64Array, JsValue> {
        self.last().map(Made::heights).map_err(|failure| told(&failure))
    }

    /// The light of the last block on another bench, by the verifier's beams: mean irradiance in
    /// every pixel, row by row from the top.
    ///
    /// # Errors
    /// A bench that cannot be.
    pub fn pose(&self, pose: &str, pixels: usize) -> Result<JsValue, JsValue> {
        self.posed(pose, pixels).map_err(|failure| told(&failure))?
    }

    fn posed(&self, pose: &str, pixels: usize) -> Result<Result<JsValue, JsValue>, Failure> {
        let made = self.last()?;
        let pose: Pose = serde_json::from_str(pose).map_err(|error| Failure::Usage(error.to_string()))?;
        let mut scene: Scene = made.plan.scene.clone();
        if let (Some(ior), Optics::Refracts { .. }) = (pose.ior, scene.optics) {
            scene.optics = Optics::Refracts { ior };
        }
        scene.distance_mm = pose.distance_mm.unwrap_or(scene.distance_mm);
        scene.receiver_turned = pose.receiver_turned.map_or(scene.receiver_turned, DVec3::from);
        scene.turned = pose.block_turned.map_or(scene.turned, DVec3::from);
        match &mut scene.light {
            Light::Parallel { direction } => *direction = pose.direction.map_or(*direction, DVec3::from),
            Light::Point { position_mm, .. } => *position_mm = pose.position_mm.map_or(*position_mm, DVec3::from),
        }
        let examiner = glasswarp::study::judge::Examiner::new(scene, made.examiner.target(), pixels);
        let seen = examiner.trace(&made.subject, Surface::Spline, Geometry::Displaced)?;
        let mut reply = Reply::new();
        let values: Vec<f32> = seen.image.values.iter().map(|&value| value as f32).collect();
        reply.array("light", Float32Array::from(values.as_slice()));
        let facts = PoseFacts { pixels: [seen.image.nx, seen.image.ny], light: flux_document(&seen.flux) };
        Ok(reply.with_facts(&facts))
    }

    /// A file of the last block; its extension is the format. It is remembered for the side file.
    ///
    /// # Errors
    /// What the format cannot hold.
    pub fn file(&mut self, name: &str) -> Result<Vec<u8>, JsValue> {
        let bytes = self.last().and_then(|made| made.file(name)).map_err(|failure| told(&failure))?;
        self.hashes.insert(name.to_owned(), sha256(&bytes));
        Ok(bytes)
    }

    /// The side file of the files that were made of the last block, which will have this name.
    ///
    /// # Errors
    /// A picture that is gone.
    pub fn side_file(&self, name: &str) -> Result<String, JsValue> {
        let text = self.last().and_then(|made| made.side_file(name, &self.hashes, &self.host));
        text.map_err(|failure| told(&failure))
    }

    /// The STL of this name and its side file, from their own bytes.
    fn read_back(&self, made: &Made, name: &str) -> Result<(SideFile, Mesh, FileRecord), Failure> {
        let toml = Path::new(name).with_extension("toml").to_string_lossy().into_owned();
        let side = SideFile::parse(&made.side_file(&toml, &self.hashes, &self.host)?, Path::new(&toml))?;
        let bytes = made.file(name)?;
        let mesh = load::parse_stl(&bytes).map_err(Failure::refused)?;
        Ok((side, mesh, FileRecord::new(name.to_owned(), bytes.len() as u64, sha256(&bytes))))
    }

    /// Reads the STL of this name back from its own bytes and traces light through it, as the
    /// command line does.
    ///
    /// # Errors
    /// A file that is no closed solid, two readings of the picture that differ.
    pub fn verify(&mut self, name: &str, listener: &Function) -> Result<JsValue, JsValue> {
        self.verified(name, listener).map_err(|failure| told(&failure))?
    }

    fn verified(&mut self, name: &str, listener: &Function) -> Result<Result<JsValue, JsValue>, Failure> {
        let progress = PageProgress { listener };
        let stage = |name: &str| {
            let _ = progress.report(Event::Stage { name, steps: 0 });
        };
        let made = self.last()?;
        stage("reading the picture again");
        let target = made.plan.target_light(&self.host)?;
        stage("reading the file back");
        let (side, mesh, record) = self.read_back(made, name)?;
        let mesh = mesh.moved(side.frame.origin_mm());
        stage("tracing light through it");
        let about = (name, &side.bench, &side.design);
        let found = DesignVerification::of(&made.plan, &target, &made.block, about, || Some(mesh), &self.host)?;
        let found = found.ok_or_else(|| Failure::Usage("the file could not be read back".into()))?;
        found.judgement.demand_agreement()?;
        let verdict = found.verdict(&made.plan, &made.block);
        stage("writing the report");
        let report = made.report(Some(&found), (stem(name), vec![record]), &self.host)?;
        let (light, wanted) = match &found.seen {
            Some(seen) => (&seen.image, &seen.target),
            None => (&found.judgement.caustic, &found.target),
        };
        let mut reply = Reply::new();
        reply.compared(light, wanted, made.exposure());
        let finite = document::finite;
        let reply = reply.with_facts(&Verified {
            verdict: verdict.document(str::to_owned),
            judgement: found.judgement.document(),
            agreement: found.judgement.agreement_in_words(),
            budget: found.steps.iter().map(BudgetStep::document).collect(),
            faults: found.faults.iter().map(|fault| (fault.name, finite(fault.rel_rms))).collect(),
            seen: found
                .seen
                .as_ref()
                .map(|seen| (seen.what.clone(), finite(seen.likeness.rel_rms), finite(seen.likeness.ssim))),
            pixels: [light.nx, light.ny],
            file: name.to_owned(),
        });
        self.report = Some(report);
        Ok(reply)
    }

    /// The report of the last block, a page of HTML. It says what the verifier found if that was
    /// asked.
    ///
    /// # Errors
    /// A picture that is gone.
    pub fn report(&self, title: &str) -> Result<String, JsValue> {
        let report = || match &self.report {
            Some(report) => Ok(report.clone()),
            None => self.last()?.report(None, (title.to_owned(), Vec::new()), &self.host),
        };
        report().map_err(|failure: Failure| told(&failure))
    }

    /// Whether the STL of this name is ready to be made, as `glasswarp ready` asks: checked, milled,
    /// polished, looked at in the light that there is, and with a bench that is a little off.
    ///
    /// # Errors
    /// A cutter that does not fit, a file that is no closed solid, and that the listener wants no
    /// more.
    pub fn ready(&mut self, name: &str, asked: &str, listener: &Function) -> Result<JsValue, JsValue> {
        self.asked_if_ready(name, asked, listener).map_err(|failure| told(&failure))?
    }

    fn asked_if_ready(
        &mut self,
        name: &str,
        asked: &str,
        listener: &Function,
    ) -> Result<Result<JsValue, JsValue>, Failure> {
        let progress = PageProgress { listener };
        let asked = shop::Asked::parse(asked)?;
        let made = self.last()?;
        let (side, mesh, record) = self.read_back(made, name)?;
        let command = settings::in_shell("ready", asked.flags(name));
        let placed = (side.frame.origin_mm(), Placing::AsPlaced);
        let piece = Workpiece::of((mesh, name), placed, side, (None, None), READY_PIXELS, (&self.host, &progress))?;
        let (reply, sheet) = shop::ready(&asked, &piece, (&stem(name), record, command), &self.host, &progress)?;
        self.sheet = Some(sheet);
        Ok(reply)
    }

    /// The sheet for maker and shop, a page of HTML to print.
    ///
    /// # Errors
    /// That nobody has asked whether the block is ready.
    pub fn sheet(&self) -> Result<String, JsValue> {
        let missing = || told(&Failure::Usage("ask first whether the block is ready".into()));
        self.sheet.clone().ok_or_else(missing)
    }
}

/// Pixels across at which it is judged whether a block is ready, as by the command line.
const READY_PIXELS: usize = 512;

/// Pixels of a light that has at most so many across.
fn shrunk(target: &TargetIrradiance, across: usize) -> [usize; 2] {
    let sides = [target.cells().nx(), target.cells().ny()];
    let scale = (across as f64 / sides[0].max(sides[1]) as f64).min(1.0);
    sides.map(|side| ((side as f64 * scale).round() as usize).max(1))
}

/// The name of a file without its extension.
fn stem(name: &str) -> String {
    Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
