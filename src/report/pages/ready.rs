//! The sheet of a block that is ready to be made, or not.

use super::common::{light_of, light_view, mm, program, row, stock_facts, target_view, traffic_light};
use crate::{
    report::{
        drawing::Drawing,
        html::{Facts, FileRecord, ReadySheet, ready_sheet},
        pictures::Exposure,
    },
    spec::Feed,
    study::{
        check::Shop,
        judge,
        ready::ReadyStudy,
        verdict::{Concern, seen_in_words},
        workpiece::Workpiece,
    },
};

/// What the sheet is made of.
pub struct ReadyPage<'a> {
    /// The name of the block.
    pub title: String,
    /// What was found out.
    pub study: &'a ReadyStudy,
    /// Of this block.
    pub piece: &'a Workpiece,
    /// In this shop.
    pub shop: &'a Shop,
    /// Of the cutter.
    pub feed: Feed,
    /// How its light is shown.
    pub exposure: Exposure,
    /// What to send.
    pub files: Vec<FileRecord>,
    /// The command that made it.
    pub command: String,
    /// Settings in messages as a person writes them.
    pub in_flags: fn(&str) -> String,
}

/// Faults of the bench that are listed, at most: the worst.
const MOST_FAULTS: usize = 6;

impl ReadyPage<'_> {
    /// The sheet, a page of HTML.
    pub fn html(self) -> String {
        let (study, piece) = (self.study, self.piece);
        let (seen, target) = &study.seen;
        let note = format!(
            "{}. SSIM {:.3}, relative RMS {:.3}. {}, {}.",
            capital(seen_in_words(seen.metrics.ssim).1),
            seen.metrics.ssim,
            seen.metrics.rel_rms,
            capital(&study.mill.done_in_words()),
            study.light
        );
        let light = |Concern { question, answer, says }: &Concern| light_of(question, *answer, (self.in_flags)(says));
        let page = ReadySheet {
            verdict: traffic_light(&study.verdict, self.in_flags),
            lights: study.verdict.concerns().iter().map(light).collect(),
            pictures: vec![
                target_view(&judge::field_of(target), self.exposure),
                light_view("What the eye will get", &judge::field_of(&seen.image), self.exposure, note),
            ],
            drawing: Drawing::of(&study.solid, &piece.bench, &study.order.notes()),
            facts: self.facts(),
            title: self.title,
            files: self.files,
            command: self.command,
            program: program(),
        };
        ready_sheet(&page)
    }

    fn facts(&self) -> Vec<Facts> {
        let (study, shop) = (self.study, self.shop);
        let order = &study.order;
        let cost = &study.mill.cost;
        let polish = match shop.polish.sigma_mm() {
            sigma if sigma > 0.0 => format!("as strong as a blur of {} mm (standard deviation)", mm(sigma)),
            _ => "none".to_owned(),
        };
        let mut work = vec![
            row("Finishing cutter", shop.cutter.in_words()),
            row(
                "Step-over",
                format!("{} mm, {} rows along {}", mm(shop.step_over_mm), cost.rows, study.mill.pass.direction),
            ),
            row(
                "Time",
                format!(
                    "{:.0} min for {:.1} m at {}, without roughing and acceleration",
                    cost.minutes(self.feed.mm_per_minute),
                    1e-3 * cost.length_mm,
                    self.feed
                ),
            ),
            row("Polish", polish),
        ];
        if let Some((scallop, thrown_mm)) = &study.mill.scallop {
            let scallop =
                format!("{:.2} µm high before the polish, throw light {thrown_mm:.2} mm", 1e3 * scallop.height_mm);
            work.push(row("Scallops", scallop));
        }
        let arrival = vec![
            row("Thickness", format!("nowhere below {:.2} mm, else send it back", order.thickness_mm)),
            row(
                "Lower face",
                "flat, clear and without scratches: it stays as it is, and light enters there".to_owned(),
            ),
            row("Index", "of this batch, with a test coupon ('glasswarp coupon')".to_owned()),
            row("Masking film", "off the upper face only".to_owned()),
            row("After milling", format!("highest point {} mm above the lower face", mm(order.thickness_mm))),
        ];
        let faults = study.faults.iter().take(MOST_FAULTS).map(|(name, likeness)| {
            let says = match likeness {
                Some(likeness) => format!("SSIM {:.3}: {}", likeness.ssim, seen_in_words(likeness.ssim).1),
                None => "no picture at all".to_owned(),
            };
            row(name, says)
        });
        vec![
            stock_facts(order),
            Facts { title: "Work".into(), rows: work },
            Facts { title: "Measure on arrival".into(), rows: arrival },
            Facts { title: "If something is off".into(), rows: faults.collect() },
        ]
    }
}

/// A sentence's first letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
