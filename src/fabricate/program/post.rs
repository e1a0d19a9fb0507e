//! The words of controls: how a program begins and ends, and how numbers, comments and arcs are
//! written.

use std::{fmt, io, io::Write, str::FromStr};

/// A kind of control.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Post {
    /// LinuxCNC, and what else reads RS-274/NGC.
    #[default]
    LinuxCnc,
    /// GRBL: no tape marks, no tool changes, no tool lengths.
    Grbl,
    /// Mach3 and Mach4.
    Mach,
    /// Fanuc: a program number, points in every number.
    Fanuc,
    /// Haas: the same, with a home of its own.
    Haas,
}

impl Post {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::LinuxCnc, Self::Grbl, Self::Mach, Self::Fanuc, Self::Haas];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LinuxCnc => "linuxcnc",
            Self::Grbl => "grbl",
            Self::Mach => "mach",
            Self::Fanuc => "fanuc",
            Self::Haas => "haas",
        }
    }

    /// Whether it calls a tool even if there is only one.
    pub(super) const fn calls_tools(self) -> bool {
        !matches!(self, Self::LinuxCnc | Self::Grbl)
    }

    /// Whether it changes tools.
    pub const fn changes_tools(self) -> bool {
        !matches!(self, Self::Grbl)
    }
}

impl fmt::Display for Post {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Post {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|post| post.name() == text)
            .ok_or_else(|| format!("'{text}' is no control: write linuxcnc, grbl, mach, fanuc or haas"))
    }
}

/// Writes the words of one control.
pub(super) struct Writer<'a, W> {
    pub(super) out: &'a mut W,
    pub(super) post: Post,
    pub(super) decimals: usize,
    /// Whether there is more than one tool. For a single one LinuxCNC need not know of tools: its
    /// zero is set with it.
    pub(super) several: bool,
}

impl<W: Write> Writer<'_, W> {
    /// The beginning, before the first move: units, modes, tolerance of corners.
    pub(super) fn begin(&mut self, title: &str, header: &[String], corner_mm: f64) -> io::Result<()> {
        match self.post {
            Post::LinuxCnc | Post::Mach => writeln!(self.out, "%")?,
            Post::Grbl => {}
            Post::Fanuc => writeln!(self.out, "%\nO0001 ({})", plain(title))?,
            Post::Haas => writeln!(self.out, "%\nO00001 ({})", plain(title))?,
        }
        for line in header {
            writeln!(self.out, "({})", plain(line))?;
        }
        match self.post {
            Post::LinuxCnc => {
                writeln!(self.out, "G21 G90 G94 G17 G40 G49 G80")?;
                writeln!(self.out, "G64 P{corner_mm:.5}")
            }
            Post::Grbl => writeln!(self.out, "G21 G90 G94 G17 G40"),
            Post::Mach => writeln!(self.out, "G21 G90 G91.1 G94 G17 G40 G49 G80"),
            Post::Fanuc => writeln!(self.out, "G21 G90 G94 G17 G40 G49 G80 G54"),
            Post::Haas => writeln!(self.out, "G21 G90 G94 G17 G40 G49 G80 G54\nG187 P3"),
        }
    }

    /// Puts a tool into the spindle, if the control does that, turns it, and goes up.
    pub(super) fn tool(&mut self, number: u32, words: &str, speed: f64, safe: f64) -> io::Result<()> {
        writeln!(self.out, "({})", plain(words))?;
        match self.post {
            Post::LinuxCnc if !self.several => writeln!(self.out, "G0 Z{}", self.number(safe))?,
            Post::Grbl => writeln!(self.out, "G0 Z{}", self.number(safe))?,
            Post::LinuxCnc => {
                writeln!(self.out, "T{number} M6")?;
                writeln!(self.out, "G43")?;
                writeln!(self.out, "G0 Z{}", self.number(safe))?;
            }
            Post::Mach | Post::Fanuc | Post::Haas => {
                writeln!(self.out, "T{number} M6")?;
                writeln!(self.out, "G0 G43 H{number} Z{}", self.number(safe))?;
            }
        }
        writeln!(self.out, "S{speed:.0} M3")
    }

    /// The end, after the last move has gone up.
    pub(super) fn end(&mut self) -> io::Result<()> {
        match self.post {
            Post::LinuxCnc => writeln!(self.out, "M5\nM2\n%"),
            Post::Grbl => writeln!(self.out, "M5\nM2"),
            Post::Mach => writeln!(self.out, "M5\nM30\n%"),
            Post::Fanuc => writeln!(self.out, "M5\nG91 G28 Z0.\nG90\nM30\n%"),
            Post::Haas => writeln!(self.out, "M5\nG53 G0 Z0.\nM30\n%"),
        }
    }

    /// A number with its decimals; `+ 0.0` turns a negative zero into a positive one.
    pub(super) fn number(&self, value: f64) -> String {
        let scale = 10f64.powi(self.decimals as i32);
        let rounded = (value * scale).round() / scale + 0.0;
        format!("{rounded:.*}", self.decimals)
    }
}

/// The text of a comment: 7-bit, and without what would end it.
pub(super) fn plain(text: &str) -> String {
    text.chars()
        .map(|c| match c {
            '(' => '[',
            ')' => ']',
            c if c == ' ' || c.is_ascii_graphic() => c,
            _ => '?',
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_comment_ends_early_or_holds_what_no_control_reads() {
        assert_eq!(plain("a (b) \u{b5}m"), "a [b] ?m");
    }

    #[test]
    fn controls_are_read_as_they_are_written() {
        for post in Post::ALL {
            assert_eq!(post.to_string().parse::<Post>().unwrap(), post);
        }
        assert!("siemens".parse::<Post>().is_err());
    }

    #[test]
    fn numbers_keep_their_decimals_and_no_zero_is_negative() {
        let mut out = Vec::new();
        let writer = Writer { out: &mut out, post: Post::Fanuc, decimals: 5, several: false };
        assert_eq!(writer.number(-1e-7), "0.00000");
        assert_eq!(writer.number(-1.234567), "-1.23457");
    }
}
