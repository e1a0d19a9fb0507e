//! Answers as traffic lights.

/// A traffic light's colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Green.
    Yes,
    /// Yellow.
    But,
    /// Grey: not known.
    Open,
    /// Red.
    No,
}

impl Signal {
    /// Its class in the styles.
    pub fn class(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::But => "but",
            Self::Open => "open",
            Self::No => "no",
        }
    }

    /// The answer that it stands for: colour alone tells nothing to many.
    pub fn word(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::But => "yes, but",
            Self::Open => "not yet asked",
            Self::No => "no",
        }
    }
}

/// A question with its answer.
#[derive(Clone, Debug)]
pub struct TrafficLight {
    /// What was asked.
    pub question: String,
    /// The colour.
    pub answer: Signal,
    /// Why, and what to do.
    pub says: String,
}
