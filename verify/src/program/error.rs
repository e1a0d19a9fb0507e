//! Why a program is refused.

/// A program that is refused, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}{}: {fault}", quoted(text))]
pub struct ProgramError {
    /// The line, from 1.
    pub line: u64,
    /// What stands there, shortened.
    pub text: String,
    /// What is wrong with it.
    pub fault: ProgramFault,
}

fn quoted(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!(" ({text})") }
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProgramFault {
    /// The file cannot be read on.
    #[error("the file cannot be read on: {0}")]
    Read(String),
    /// More bytes than a line has.
    #[error("the line has more than {most} bytes: this is no G-code")]
    Long {
        /// Most accepted bytes.
        most: usize,
    },
    /// A byte that no program has.
    #[error("the byte {byte:#04x} stands in no program: this is no G-code, or it is damaged")]
    Byte {
        /// The byte.
        byte: u8,
    },
    /// A comment without its end.
    #[error("the comment is not closed by ')'")]
    Comment,
    /// A word without a number.
    #[error("the word {letter} has no number that can be read")]
    Number {
        /// Its letter.
        letter: char,
    },
    /// A number out of range.
    #[error("{letter}{value} is out of range: at most {most} are taken")]
    Range {
        /// The letter.
        letter: char,
        /// The number.
        value: f64,
        /// Greatest magnitude.
        most: f64,
    },
    /// What is understood and not done.
    #[error("{what} is not simulated; {remedy}")]
    Refused {
        /// The word, by its name.
        what: String,
        /// What to do about it.
        remedy: &'static str,
    },
    /// A word of no known meaning.
    #[error("{0} is not known here, and what is not known may move the machine: take it out")]
    Unknown(String),
    /// One word twice on a line.
    #[error("the word {0} stands twice on the line")]
    Twice(char),
    /// Two words of one modal group on a line.
    #[error("{0} and {1} exclude each other on one line")]
    Exclude(String, String),
    /// A word without the one that would use it.
    #[error("the word {0} belongs to nothing on this line")]
    Unused(char),
    /// A place before any kind of motion.
    #[error("a place is named before any of G0, G1, G2, G3 says how to go there")]
    Motion,
    /// A motion without a place.
    #[error("{0} names no place to go to")]
    Nowhere(&'static str),
    /// No units.
    #[error(
        "the program names no units before its first place; write G21 (mm) or G20 (inch) first, or say which with `units`"
    )]
    Units,
    /// No feed.
    #[error("there is no feed above 0 for this move; write F and a number before it")]
    Feed,
    /// An inverse-time move without its own feed.
    #[error("in inverse time (G93) every feed move needs an F of its own, above 0")]
    InverseFeed,
    /// A move from a place that the program has never given.
    #[error(
        "the tool is fed from a place that the program has not given: {axes} of its beginning is not known; go there by a rapid first"
    )]
    Beginning {
        /// The axes.
        axes: String,
    },
    /// An increment from a place that the program has never given.
    #[error("an increment (G91) is counted from a place that the program has not given: {axes}")]
    Increment {
        /// The axes.
        axes: String,
    },
    /// Work offsets of which only the machine knows how they lie.
    #[error(
        "{now} is used after {before}: where they lie to each other stands in the machine; use one of them in a program"
    )]
    WorkOffset {
        /// The first one.
        before: String,
        /// The other one.
        now: String,
    },
    /// An arc without its centre.
    #[error("the arc has neither R nor {0}")]
    Centre(&'static str),
    /// Both of them.
    #[error("the arc has both R and a centre ({0})")]
    BothCentres(&'static str),
    /// An arc of which the radius changes on its way.
    #[error(
        "the arc's radius is {begin_mm:.5} mm at its beginning and {end_mm:.5} mm at its end: they may differ by {most_mm:.5} mm{}",
        if *.absolute { "; they agree if its centre is a place and no distance: write G90.1 first" } else { "; let the post-processor write more decimals" }
    )]
    Radii {
        /// At its beginning, mm.
        begin_mm: f64,
        /// At its end, mm.
        end_mm: f64,
        /// What they may differ by, mm.
        most_mm: f64,
        /// Whether the centre is meant as a place.
        absolute: bool,
    },
    /// A radius that does not reach.
    #[error("the arc's R is {radius_mm:.5} mm, and its ends are {apart_mm:.5} mm apart, more than twice of it")]
    Radius {
        /// The radius, mm.
        radius_mm: f64,
        /// How far its ends are apart, mm.
        apart_mm: f64,
    },
    /// A full circle by its radius.
    #[error("the arc by R ends where it begins: by a radius no full circle can be told, write its centre (I, J, K)")]
    Circle,
    /// Nothing to do.
    #[error("the program ends and has moved nothing")]
    Empty,
}
