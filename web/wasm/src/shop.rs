//! Whether a block is ready to be made, in the words of a shop.

use crate::reply::Reply;
use glasswarp::{
    fabricate::{Cutter, Direction, Pass},
    failure::Failure,
    record::{
        SideFile,
        document::{self, finite},
    },
    report::{FileRecord, ReadyPage, exposure_of, irradiance_picture},
    solver::Progress,
    spec::{Feed, Host, Length, SourceName},
    study::{
        check::{CheckLine, FaceForm},
        judge,
        mill::MillStep,
        ready::{Question, ReadyStudy},
        workpiece::Workpiece,
    },
    surface::Polish,
};
use serde::{Deserialize, Serialize};
use std::{fmt::Display, str::FromStr};
use wasm_bindgen::JsValue;

/// What `glasswarp ready` is asked with, as a person writes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(crate) struct Asked {
    cutter: String,
    step_over: String,
    direction: String,
    polish: String,
    source_size: Option<String>,
    feed: String,
}

fn read<T: FromStr<Err: Display>>(name: &str, text: &str) -> Result<T, Failure> {
    text.trim().parse().map_err(|error| Failure::Usage(format!("`{name}`: {error}")))
}

impl Asked {
    pub(crate) fn parse(text: &str) -> Result<Self, Failure> {
        serde_json::from_str(text).map_err(|error| Failure::Usage(error.to_string()))
    }

    /// The same for the command line, of a file of this name.
    pub(crate) fn flags(&self, name: &str) -> Vec<String> {
        let Self { cutter, step_over, direction, polish, feed, source_size } = self;
        let mut flags = vec![
            name.to_owned(),
            format!("--cutter={cutter}"),
            format!("--step-over={step_over}"),
            format!("--direction={direction}"),
            format!("--polish={polish}"),
            format!("--feed={feed}"),
        ];
        flags.extend(source_size.iter().map(|size| format!("--source-size={size}")));
        flags
    }

    fn question(&self, side: &SideFile) -> Result<Question, Failure> {
        let (polish, step_over): (Length, Length) =
            (read("polish", &self.polish)?, read("step-over", &self.step_over)?);
        let direction = read::<Direction>("direction", &self.direction)?;
        let pass = Pass { direction, ..Pass::finishing(read::<Cutter>("cutter", &self.cutter)?, step_over.mm) };
        let source = self.source_size.as_deref().map(|size| read::<SourceName>("source-size", size)).transpose()?;
        Ok(Question { source, ..Question::of(pass, Polish::new(polish.mm).map_err(Failure::refused)?, side) })
    }
}

/// What a page shows of it.
#[derive(Serialize)]
struct ReadyFacts {
    verdict: document::Verdict,
    lines: Vec<document::CheckLine>,
    /// The face as designed and after every step, in perfect light; pictures `step0`, ...
    steps: Vec<document::MillStep>,
    /// What is off, and the SSIM that it leaves, the worst first.
    faults: Vec<(String, Option<f64>)>,
    light: String,
    order: String,
    rows: usize,
    minutes: f64,
    pixels: [usize; 2],
}

/// Asks everything, and draws the sheet for maker and shop.
pub(crate) fn ready(
    asked: &Asked,
    piece: &Workpiece,
    (name, file, command): (&str, FileRecord, String),
    host: &dyn Host,
    progress: &dyn Progress,
) -> Result<(Result<JsValue, JsValue>, String), Failure> {
    let question = asked.question(&piece.side)?;
    let feed: Feed = read("feed", &asked.feed)?;
    let study = ReadyStudy::of(&question, piece, FaceForm::Triangles, host, progress)?;
    let exposure = exposure_of(&piece.perceived, piece);
    let mut reply = Reply::new();
    let (seen, target) = &study.seen;
    reply.compared(&seen.image, target, exposure);
    let perfect = exposure_of(&piece.ideal, piece);
    for (k, step) in study.mill.steps.iter().enumerate() {
        reply.picture(&format!("step{k}"), &irradiance_picture(&judge::field_of(&step.view.image), perfect));
    }
    let facts = ReadyFacts {
        verdict: study.verdict.document(str::to_owned),
        lines: study.check.lines.iter().map(CheckLine::document).collect(),
        steps: study.mill.steps.iter().map(MillStep::document).collect(),
        faults: study
            .faults
            .iter()
            .map(|(name, likeness)| (name.clone(), likeness.and_then(|likeness| finite(likeness.ssim))))
            .collect(),
        light: study.light.clone(),
        order: study.order.in_words(),
        rows: study.mill.cost.rows,
        minutes: study.mill.cost.minutes(feed.mm_per_minute),
        pixels: [seen.image.nx, seen.image.ny],
    };
    let sheet = ReadyPage {
        title: name.to_owned(),
        study: &study,
        piece,
        shop: &question.shop,
        feed,
        exposure,
        files: vec![file],
        command,
        in_flags: plain_words,
    };
    Ok((reply.with_facts(&facts), sheet.html()))
}

/// Settings stand in backticks, which a printed page does without.
pub(crate) fn plain_words(text: &str) -> String {
    text.replace('`', "")
}
