//! One line of a program as its words.

use super::error::ProgramFault;

/// Most bytes of a line that are read.
pub(super) const MOST_BYTES: usize = 1 << 14;
/// Most G-codes, and most M-codes, on a line.
const MOST_CODES: usize = 16;
/// Greatest number of a word.
const GREATEST: f64 = 1e9;

/// A number, and how many decimals it was written with, zeros at its end not counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Number {
    pub(super) value: f64,
    pub(super) decimals: u8,
    /// Whether it was written with a decimal point.
    pub(super) point: bool,
}

/// The words of a line. It is used again for every line.
#[derive(Debug, Default)]
pub(super) struct Line {
    words: [Option<Number>; 26],
    /// G-codes in tenths: G92.1 is 921.
    pub(super) g: Vec<u16>,
    pub(super) m: Vec<u16>,
    /// A program's number (O or :).
    pub(super) program: bool,
    /// The line is `%`.
    pub(super) tape: bool,
    /// Where comments lie in the line.
    pub(super) comments: Vec<(usize, usize)>,
}

impl Line {
    /// Reads the words of a line without its end.
    pub(super) fn read(&mut self, bytes: &[u8]) -> Result<(), ProgramFault> {
        self.words = [None; 26];
        self.g.clear();
        self.m.clear();
        self.comments.clear();
        (self.program, self.tape) = (false, false);
        let mut at = 0;
        while let Some(&byte) = bytes.get(at) {
            match byte {
                b' ' | b'\t' | b'\r' => at += 1,
                b'(' => {
                    let end = bytes[at..].iter().position(|&b| b == b')').ok_or(ProgramFault::Comment)?;
                    self.comments.push((at + 1, at + end));
                    at += end + 1;
                }
                b';' => {
                    self.comments.push((at + 1, bytes.len()));
                    at = bytes.len();
                }
                b'%' => {
                    self.tape = true;
                    // What stands behind it is for the tape's reader.
                    at = bytes.len();
                }
                b':' => {
                    at = number(bytes, at + 1, 'O')?.1;
                    self.program = true;
                }
                b'a'..=b'z' | b'A'..=b'Z' => at = self.word(bytes, at)?,
                _ => return Err(unreadable(byte)),
            }
        }
        Ok(())
    }

    fn word(&mut self, bytes: &[u8], at: usize) -> Result<usize, ProgramFault> {
        let letter = bytes[at].to_ascii_uppercase() as char;
        if letter == 'O' && !next(bytes, at + 1).is_some_and(|b| b.is_ascii_digit()) {
            return Err(o_word());
        }
        let (number, end) = number(bytes, at + 1, letter)?;
        match letter {
            'G' | 'M' => {
                let (tenths, codes) =
                    if letter == 'G' { (10.0 * number.value, &mut self.g) } else { (number.value, &mut self.m) };
                let code = tenths.round();
                if (tenths - code).abs() > 1e-6 || !(0.0..=9999.0).contains(&code) || codes.len() == MOST_CODES {
                    return Err(ProgramFault::Unknown(format!("{letter}{}", number.value)));
                }
                codes.push(code as u16);
            }
            // O100 sub, O100 while: a word follows that no number does.
            'O' if next(bytes, end).is_some_and(|byte| byte.is_ascii_alphabetic()) => return Err(o_word()),
            'O' => self.program = true,
            _ => {
                let slot = &mut self.words[(letter as u8 - b'A') as usize];
                if slot.is_some() {
                    return Err(ProgramFault::Twice(letter));
                }
                *slot = Some(number);
            }
        }
        Ok(end)
    }

    /// The number of a word, taken from the line.
    pub(super) fn take(&mut self, letter: char) -> Option<Number> {
        self.words[(letter as u8 - b'A') as usize].take()
    }

    /// The number of a word.
    pub(super) fn peek(&self, letter: char) -> Option<Number> {
        self.words[(letter as u8 - b'A') as usize]
    }

    /// A word that nothing has taken.
    pub(super) fn left(&self) -> Option<char> {
        self.words.iter().position(Option::is_some).map(|k| (b'A' + k as u8) as char)
    }
}

/// The next byte that is no blank.
fn next(bytes: &[u8], at: usize) -> Option<u8> {
    bytes[at..].iter().copied().find(|byte| !matches!(byte, b' ' | b'\t'))
}

pub(super) fn refused(what: impl Into<String>, remedy: &'static str) -> ProgramFault {
    ProgramFault::Refused { what: what.into(), remedy }
}

fn o_word() -> ProgramFault {
    refused("an O-word (a subprogram or a loop)", "post one plain program")
}

fn unreadable(byte: u8) -> ProgramFault {
    match byte {
        b'#' => refused("the parameter #", "let the post-processor write numbers"),
        b'[' | b']' => refused("an expression in [ ]", "let the post-processor write numbers"),
        b'/' => refused(
            "block delete (/)",
            "whether the line is run hangs on a switch of the machine: take the line out, or the stroke before it",
        ),
        b'$' => refused("a command of GRBL's own ($)", "send it by hand, and keep it out of the program"),
        b'*' => refused("a checksum (*)", "post the program for a milling machine"),
        byte => ProgramFault::Byte { byte },
    }
}

/// Reads a number, in which blanks mean nothing, from `at`; returns where it ends.
fn number(bytes: &[u8], at: usize, letter: char) -> Result<(Number, usize), ProgramFault> {
    let unread = || ProgramFault::Number { letter };
    let mut end = at;
    let (mut negative, mut begun, mut point) = (false, false, false);
    let (mut mantissa, mut digits, mut decimals, mut significant) = (0u64, 0u32, 0u8, 0u8);
    while let Some(&byte) = bytes.get(end) {
        match byte {
            b' ' | b'\t' => {}
            b'+' | b'-' if !begun => (negative, begun) = (byte == b'-', true),
            b'.' if !point => (point, begun) = (true, true),
            b'0'..=b'9' => {
                begun = true;
                if digits >= 18 {
                    // Beyond these digits nothing counts but how large the number is.
                    if !point {
                        return Err(ProgramFault::Range { letter, value: mantissa as f64, most: GREATEST });
                    }
                } else {
                    mantissa = 10 * mantissa + u64::from(byte - b'0');
                    digits += u32::from(mantissa > 0);
                    if point {
                        decimals = decimals.saturating_add(1);
                        if byte != b'0' {
                            significant = decimals;
                        }
                    }
                }
            }
            b'#' | b'[' => return Err(unreadable(byte)),
            _ => break,
        }
        end += 1;
    }
    let any = bytes[at..end].iter().any(u8::is_ascii_digit);
    if !any {
        return Err(unread());
    }
    // Exact for up to 15 digits: one division of two numbers that are represented exactly.
    let magnitude = mantissa as f64 / 10f64.powi(i32::from(decimals));
    if magnitude > GREATEST {
        return Err(ProgramFault::Range { letter, value: magnitude, most: GREATEST });
    }
    let value = if negative { -magnitude } else { magnitude };
    Ok((Number { value, decimals: significant, point }, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_however_they_are_spaced() {
        let mut line = Line::default();
        for text in
            ["N10 G1 X-1.250 Y.5 Z+3 (a) F1000 ; b", "n10g1x-1.25y0.5z3f1 000", "G01 X - 1 . 2 5 Y .5 Z3. F1000"]
        {
            line.read(text.as_bytes()).unwrap();
            assert_eq!(line.g, [10]);
            let value = |letter| line.peek(letter).unwrap().value;
            assert_eq!(['X', 'Y', 'Z', 'F'].map(value), [-1.25, 0.5, 3.0, 1000.0], "{text}");
            assert_eq!(line.peek('X').unwrap().decimals, 2);
        }
        line.read(b"G92.1 G0 M6 T12").unwrap();
        assert_eq!((line.g.as_slice(), line.m.as_slice()), ([921, 0].as_slice(), [6].as_slice()));
        line.read(b"%").unwrap();
        assert!(line.tape);
        line.read(b"O0001 (name)").unwrap();
        assert!(line.program && line.comments == [(7, 11)]);
    }

    #[test]
    fn numbers_are_the_nearest_that_there_are() {
        let mut line = Line::default();
        for text in ["0.1", "-12.34567", "99999.99999", "0.00001", "123456789012.25", "000.3", "3.1415926535897932384"]
        {
            let read = line.read(format!("X{text}").as_bytes());
            match text.parse::<f64>().unwrap() {
                value if value.abs() > 1e9 => assert!(matches!(read, Err(ProgramFault::Range { .. })), "{text}"),
                value => {
                    let got = line.peek('X').unwrap().value;
                    assert!((got - value).abs() <= 1e-15 * value.abs(), "{text}: {got}");
                    assert!(text.len() > 12 || got == value, "{text}: {got}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_word_is_refused_by_its_name() {
        let mut line = Line::default();
        let mut refused = |text: &str| line.read(text.as_bytes()).unwrap_err().to_string();
        for (text, word) in [
            ("G1 X#5", "parameter"),
            ("#5 = 3", "parameter"),
            ("G1 X[1+2]", "expression"),
            ("o100 sub", "subprogram"),
            ("o<name> call", "subprogram"),
            ("/G1 X1", "block delete"),
            ("$H", "GRBL"),
            ("X", "X has no number"),
            ("X-", "X has no number"),
            ("X.", "X has no number"),
            ("X1 X2", "twice"),
            ("G1.25", "G1.25"),
            ("(open", "not closed"),
            ("\u{89}PNG", "0x"),
            ("X99999999999999999999", "out of range"),
        ] {
            assert!(refused(text).contains(word), "{text}: {}", refused(text));
        }
    }
}
