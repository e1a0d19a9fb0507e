//! Will it work: the one line that a person reads before paying for a slab, and what it rests on.
//!
//! Every command that knows something of a block answers the [questions](Concern::question) that
//! it can; what nobody has asked yet is said to be open, never taken for granted.

use super::judge::Judgement;
use crate::record::document;
use glasswarp_verify::metrics::Likeness;

/// An answer to one question, or to all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It will do.
    Yes,
    /// It will do, with something to know.
    But,
    /// It is not known, because something was not said.
    NotAsked,
    /// It will not do.
    No,
}

impl Answer {
    /// A word for tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::But => "yes, but",
            Self::NotAsked => "not yet asked",
            Self::No => "no",
        }
    }
}

/// One thing that decides whether a block will work.
#[derive(Clone, Debug)]
pub struct Concern {
    /// What was asked: picture, light, cutter, ...
    pub question: &'static str,
    /// The answer.
    pub answer: Answer,
    /// Why, and what to do. Settings stand in backticks.
    pub says: String,
}

/// Whether a block will work, from everything that was asked.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    concerns: Vec<Concern>,
}

/// Structural similarities from which on the picture is spoken of like this, the best first. They
/// are those of the light on the receiver to the picture, in linear irradiance, at no more pixels
/// than the picture has ([`Metrics::ssim`](glasswarp_verify::metrics::Metrics::ssim)).
pub const BANDS: [(f64, Answer, &str); 5] = [
    (0.95, Answer::Yes, "the eye will hardly see the difference"),
    (0.85, Answer::Yes, "plainly the picture, a little softer or grainier"),
    (0.70, Answer::But, "the picture is known at once, with its fine detail soft or grainy"),
    (0.50, Answer::But, "the picture is recognised, with much of its detail lost"),
    (f64::NEG_INFINITY, Answer::No, "little of the picture is left"),
];

/// What the eye makes of a picture of this structural similarity.
pub fn seen_in_words(ssim: f64) -> (Answer, &'static str) {
    // Not a number is no picture either.
    let band = BANDS.into_iter().find(|(least, ..)| ssim >= *least);
    band.map_or((Answer::No, "there is no picture"), |(_, answer, words)| (answer, words))
}

/// Contrast of a picture below which it looks pale: a newspaper has ten times.
const LEAST_CONTRAST: f64 = 3.0;

impl Verdict {
    /// Adds an answer.
    pub fn say(&mut self, question: &'static str, answer: Answer, says: impl Into<String>) {
        self.concerns.push(Concern { question, answer, says: says.into() });
    }

    /// Everything that was answered, in the order of the questions.
    pub fn concerns(&self) -> &[Concern] {
        &self.concerns
    }

    /// The answer to all questions together.
    pub fn answer(&self) -> Answer {
        let answers = || self.concerns.iter().map(|concern| concern.answer);
        [Answer::No, Answer::NotAsked, Answer::But]
            .into_iter()
            .find(|worst| answers().any(|answer| answer == *worst))
            .unwrap_or(Answer::Yes)
    }

    /// The line: "yes: ...", "yes, but ...", "no: ...", and what was not asked. Settings stand in
    /// backticks.
    pub fn in_words(&self) -> String {
        let of = |answer: Answer| -> Vec<&str> {
            let with = self.concerns.iter().filter(|concern| concern.answer == answer);
            with.map(|concern| concern.says.as_str()).collect()
        };
        let (no, but, open) = (of(Answer::No), of(Answer::But), of(Answer::NotAsked));
        if !no.is_empty() {
            return format!("no: {}", no.join("; "));
        }
        let first = of(Answer::Yes).first().map(|says| format!(": {says}")).unwrap_or_default();
        let known = match but.is_empty() {
            true => format!("yes{first}"),
            false => format!("yes, but {}", but.join("; ")),
        };
        match open.is_empty() {
            true => known,
            false if self.concerns.len() == open.len() => format!("not yet asked: {}", open.join("; ")),
            false => format!("so far {known}; not yet asked: {}", open.join("; ")),
        }
    }

    /// What the eye gets. `what` tells of which face, in which light.
    pub fn say_picture(&mut self, likeness: Likeness, what: &str) {
        let (answer, words) = seen_in_words(likeness.ssim);
        let says = format!("{words} (SSIM {:.3}, relative RMS {:.3}){what}", likeness.ssim, likeness.rel_rms);
        self.say("picture", answer, says);
    }

    /// Whether enough contrast is left of the picture by its offset: the light of its brightest parts
    /// against its darkest, of the target.
    pub fn say_contrast(&mut self, contrast: f64, offset: f64) {
        if contrast < LEAST_CONTRAST {
            self.say(
                "contrast",
                Answer::But,
                format!(
                    "the picture is pale: its brightest parts get only {contrast:.1} times the light of its darkest (`offset` {offset}; a smaller one has more)"
                ),
            );
        }
    }

    /// Whether the size of the light is known, as far as it matters.
    pub fn say_light(&mut self, is_known: bool) {
        if is_known {
            self.say("light", Answer::Yes, "the light is that of the design");
        } else {
            let size = "the size of the light (`source-size` sun, 0.5deg, or none for a laser)";
            self.say("light", Answer::NotAsked, size);
        }
    }

    /// Whether photons and beams agree, without which no figure counts, and whether all light
    /// arrives. `skirt` is the share of the face beyond the part that draws.
    pub fn say_judgement(&mut self, judgement: &Judgement, skirt: f64) {
        if judgement.is_contradicted() {
            self.say("figures", Answer::No, format!("photons and beams {}", judgement.agreement_in_words()));
        }
        if let Some(astray) = judgement.astray_in_words(skirt) {
            self.say("stray light", Answer::But, astray);
        }
    }

    /// The same for programs.
    pub fn document(&self, with_flags: impl Fn(&str) -> String) -> document::Verdict {
        document::Verdict {
            answer: self.answer().word().to_owned(),
            says: with_flags(&self.in_words()),
            concerns: self
                .concerns
                .iter()
                .map(|Concern { question, answer, says }| document::Concern {
                    question: (*question).to_owned(),
                    answer: answer.word().to_owned(),
                    says: with_flags(says),
                })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_answer_is_the_verdict_and_what_is_open_is_said() {
        let mut verdict = Verdict::default();
        verdict.say("picture", Answer::Yes, "sharp");
        assert_eq!((verdict.answer(), verdict.in_words().as_str()), (Answer::Yes, "yes: sharp"));
        verdict.say("stray light", Answer::But, "some light is lost");
        assert_eq!(verdict.in_words(), "yes, but some light is lost");
        verdict.say("cutter", Answer::NotAsked, "cutter (`cutter`)");
        assert_eq!(verdict.answer(), Answer::NotAsked);
        assert_eq!(verdict.in_words(), "so far yes, but some light is lost; not yet asked: cutter (`cutter`)");
        verdict.say("relief", Answer::No, "too deep");
        assert_eq!((verdict.answer(), verdict.in_words().as_str()), (Answer::No, "no: too deep"));
        let mut open = Verdict::default();
        open.say("cutter", Answer::NotAsked, "cutter");
        assert_eq!(open.in_words(), "not yet asked: cutter");
    }

    #[test]
    fn every_similarity_has_its_words() {
        for (ssim, answer) in [
            (1.0, Answer::Yes),
            (0.85, Answer::Yes),
            (0.849, Answer::But),
            (0.5, Answer::But),
            (0.398, Answer::No),
            (-1.0, Answer::No),
            (f64::NAN, Answer::No),
        ] {
            assert_eq!(seen_in_words(ssim).0, answer, "{ssim}");
        }
    }
}
