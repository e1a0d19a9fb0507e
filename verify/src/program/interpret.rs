//! Runs a program: lines become moves of the tip.

use super::{
    error::{ProgramError, ProgramFault},
    geometry::{Arc, Centre, Plane},
    line::{Line, MOST_BYTES, Number, refused},
    modal::{Blending, Codes, Does, Motion, Once, misc, name},
    moves::{Move, Way},
};
use glam::{DVec2, DVec3};
use std::io::{self, BufRead};

/// Units of a program that names none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Units {
    /// Millimetres, as after G21.
    Millimetres,
    /// Inches, as after G20.
    Inches,
}

/// What is told of a program while it runs.
pub trait Run {
    /// A move, in the order of the program.
    ///
    /// # Errors
    /// Whatever ends the run.
    fn moved(&mut self, made: &Move) -> Result<(), ProgramFault>;
    /// The text of a comment; bytes that are no text are replaced.
    fn comment(&mut self, _line: u64, _text: &str) {}
    /// A coordinate was written with so many decimals, zeros at its end not counted, in units of so
    /// many mm.
    fn coordinate(&mut self, _decimals: u8, _unit_mm: f64) {}
    /// A dwell, seconds.
    fn dwelt(&mut self, _seconds: f64) {}
    /// Another tool was put into the spindle.
    fn changed_tool(&mut self, _line: u64, _tool: u32) {}
}

/// Greatest magnitude of a coordinate, mm: no machine is larger.
const FARTHEST_MM: f64 = 1e6;
/// Millimetres of an inch.
const INCH: f64 = 25.4;
/// Bytes of a line that errors quote.
const QUOTED: usize = 60;

/// Runs a program as a machine would, and tells `sink` of every move.
///
/// The text is streamed: memory does not depend on its length.
///
/// # Errors
/// Whatever a machine would refuse, and what is not simulated, with the line.
pub fn run(reader: impl BufRead, units: Option<Units>, sink: &mut impl Run) -> Result<(), ProgramError> {
    let mut lines = Lines { reader, bytes: Vec::new(), number: 0 };
    let mut machine = Machine::new(units);
    let mut line = Line::default();
    let mut moved = false;
    loop {
        let more = lines.read();
        let ended = match &more {
            Ok(false) => break,
            Ok(true) => line.read(&lines.bytes).and_then(|()| {
                for &(begin, end) in &line.comments {
                    sink.comment(lines.number, &String::from_utf8_lossy(&lines.bytes[begin..end]));
                }
                machine.line(&mut line, lines.number, sink, &mut moved)
            }),
            Err(fault) => Err(fault.clone()),
        };
        match ended {
            Ok(true) => break,
            Ok(false) => {}
            Err(fault) => return Err(ProgramError { line: lines.number, text: lines.quoted(), fault }),
        }
    }
    if moved {
        Ok(())
    } else {
        Err(ProgramError { line: lines.number, text: String::new(), fault: ProgramFault::Empty })
    }
}

/// The lines of a file, one at a time.
struct Lines<R> {
    reader: R,
    bytes: Vec<u8>,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    /// Reads the next line; `false` at the end.
    fn read(&mut self) -> Result<bool, ProgramFault> {
        self.bytes.clear();
        self.number += 1;
        loop {
            let buffer = match self.reader.fill_buf() {
                Ok(buffer) => buffer,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(ProgramFault::Read(error.to_string())),
            };
            if buffer.is_empty() {
                return Ok(!self.bytes.is_empty());
            }
            let end = buffer.iter().position(|&byte| byte == b'\n');
            let part = &buffer[..end.unwrap_or(buffer.len())];
            if self.bytes.len() + part.len() > MOST_BYTES {
                return Err(ProgramFault::Long { most: MOST_BYTES });
            }
            self.bytes.extend_from_slice(part);
            let used = part.len() + usize::from(end.is_some());
            self.reader.consume(used);
            if end.is_some() {
                return Ok(true);
            }
        }
    }

    /// What errors say stands there.
    fn quoted(&self) -> String {
        let text = String::from_utf8_lossy(&self.bytes[..self.bytes.len().min(QUOTED)]);
        let plain: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let dots = if self.bytes.len() > QUOTED { " ..." } else { "" };
        format!("{}{dots}", plain.trim())
    }
}

/// The state of a controller.
struct Machine {
    /// Millimetres of a unit; `None` until the program says.
    unit_mm: Option<f64>,
    motion: Motion,
    plane: Plane,
    increments: bool,
    centre_absolute: bool,
    inverse_time: bool,
    /// F, in units per minute; 0 for none.
    feed: f64,
    speed: f64,
    turning: bool,
    blending: Blending,
    work_offset: Option<(u16, u32)>,
    tool: u32,
    next_tool: u32,
    /// Where the tip is, mm in the first work offset; not a number where nobody knows.
    at: DVec3,
    /// What G92 and G52 add to the program's numbers, mm.
    set: DVec3,
    local: DVec3,
    /// What G92.2 has put aside.
    aside: DVec3,
    /// A program number is only one before anything else.
    begun: bool,
    /// `%` begins the tape, and ends it.
    tapes: u32,
    /// A program number was written, as Fanuc's controls do, which read a number without a point as
    /// one of micrometres.
    numbered: bool,
}

impl Machine {
    fn new(units: Option<Units>) -> Self {
        Self {
            unit_mm: units.map(|units| if units == Units::Inches { INCH } else { 1.0 }),
            motion: Motion::None,
            plane: Plane::Xy,
            increments: false,
            centre_absolute: false,
            inverse_time: false,
            feed: 0.0,
            speed: 0.0,
            turning: false,
            blending: Blending::Unsaid,
            work_offset: None,
            tool: 0,
            next_tool: 0,
            at: DVec3::NAN,
            set: DVec3::ZERO,
            local: DVec3::ZERO,
            aside: DVec3::ZERO,
            begun: false,
            tapes: 0,
            numbered: false,
        }
    }

    fn unit_mm(&self) -> Result<f64, ProgramFault> {
        self.unit_mm.ok_or(ProgramFault::Units)
    }

    /// Does a line, in the order of RS-274; returns whether the program ends.
    fn line(
        &mut self,
        line: &mut Line,
        number: u64,
        sink: &mut impl Run,
        moved: &mut bool,
    ) -> Result<bool, ProgramFault> {
        if line.tape {
            self.tapes += 1;
            return Ok(self.tapes > 1 || self.begun);
        }
        if line.program {
            if self.begun {
                return Err(refused("a second program (O)", "post one plain program, without subprograms"));
            }
            self.numbered = true;
        }
        let codes = Codes::of(line)?;
        line.take('N');
        self.begun |= !line.g.is_empty() || !line.m.is_empty();
        let does = self.settings(line, &codes, (number, sink))?;
        self.offsets(line, &codes)?;
        self.moves(line, &codes, (number, sink), moved)?;
        if let Some(letter) = line.left() {
            return Err(ProgramFault::Unused(letter));
        }
        Ok(does.contains(&Does::End))
    }

    /// Feed mode, F, S, T, M-codes, dwell, plane, units, modes.
    fn settings(
        &mut self,
        line: &mut Line,
        codes: &Codes,
        (number, sink): (u64, &mut impl Run),
    ) -> Result<Vec<Does>, ProgramFault> {
        for letter in ['A', 'B', 'C', 'U', 'V', 'W'] {
            if let Some(turned) = line.take(letter)
                && turned.value != 0.0
            {
                return Err(refused(
                    format!("the axis {letter} ({letter}{})", turned.value),
                    "only x, y and z move here: post the program for three axes",
                ));
            }
        }
        if let Some(inch) = codes.inch {
            let unit_mm = if inch { INCH } else { 1.0 };
            // A feed lasts, in the units that it was given in.
            self.feed *= self.unit_mm.map_or(1.0, |before| before / unit_mm);
            self.unit_mm = Some(unit_mm);
        }
        if let Some(inverse) = codes.inverse_time {
            // A feed of the one kind is none of the other.
            if inverse != self.inverse_time {
                self.feed = 0.0;
            }
            self.inverse_time = inverse;
        }
        if let Some(feed) = line.peek('F') {
            if feed.value < 0.0 {
                return Err(ProgramFault::Feed);
            }
            self.feed = feed.value;
        }
        if let Some(speed) = line.take('S') {
            self.speed = speed.value.max(0.0);
        }
        if let Some(tool) = line.take('T') {
            self.next_tool = tool.value.round().clamp(0.0, 1e6) as u32;
        }
        let does: Vec<Does> = line.m.iter().map(|&code| misc(code)).collect::<Result<_, _>>()?;
        for done in &does {
            match done {
                Does::ToolChange => {
                    self.tool = self.next_tool;
                    sink.changed_tool(number, self.tool);
                }
                Does::Turns => self.turning = true,
                Does::Stands => self.turning = false,
                Does::End | Does::Nothing => {}
            }
        }
        if codes.length {
            line.take('H');
        }
        if codes.look_ahead || !line.m.is_empty() {
            for letter in ['P', 'Q', 'R', 'L', 'E'] {
                line.take(letter);
            }
        }
        // A number of the machine's table of radii, which only compensation asks for.
        line.take('D');
        if codes.once == Some(Once::Dwell) {
            let seconds = line.take('P').or_else(|| line.take('X')).map_or(0.0, |p| p.value);
            sink.dwelt(seconds.max(0.0));
        }
        self.plane = codes.plane.unwrap_or(self.plane);
        self.increments = codes.increments.unwrap_or(self.increments);
        self.centre_absolute = codes.centre_absolute.unwrap_or(self.centre_absolute);
        if let Some(blending) = codes.blending {
            self.blending = match (blending, line.take('P')) {
                (Blending::Unbounded, Some(p)) => {
                    line.take('Q');
                    Blending::Within((p.value * self.unit_mm()?).max(0.0))
                }
                (other, _) => other,
            };
        }
        Ok(does)
    }

    /// Work offsets and what else shifts the coordinates.
    fn offsets(&mut self, line: &mut Line, codes: &Codes) -> Result<(), ProgramFault> {
        if let Some(code) = codes.work_offset {
            let extended = if code == 1540 { line.take('P').map_or(0, |p| p.value as u32) } else { 0 };
            let called = |(code, p): (u16, u32)| {
                if p > 0 { format!("{} P{p}", name('G', code)) } else { name('G', code) }
            };
            let now = (code, extended);
            // A machine begins in the first one.
            match self.work_offset {
                Some(before) if before != now => {
                    return Err(ProgramFault::WorkOffset { before: called(before), now: called(now) });
                }
                None if self.at.is_nan_mask().all() || code == 540 => self.work_offset = Some(now),
                None => return Err(ProgramFault::WorkOffset { before: "G54".into(), now: called(now) }),
                Some(_) => {}
            }
        }
        match codes.once {
            Some(Once::Local) => {
                let to = self.axis_words(line)?;
                for k in 0..3 {
                    if let Some(number) = to[k] {
                        self.local[k] = number.value * self.unit_mm()?;
                    }
                }
            }
            Some(Once::Set) => {
                let to = self.axis_words(line)?;
                if to.iter().all(Option::is_none) {
                    return Err(ProgramFault::Nowhere("G92"));
                }
                for k in 0..3 {
                    let Some(number) = to[k] else { continue };
                    let value = number.value * self.unit_mm()?;
                    if self.at[k].is_nan() {
                        // Where the machine stands becomes the zero of all that follows.
                        self.set[k] = 0.0;
                        self.at[k] = value + self.local[k];
                    } else {
                        self.set[k] = self.at[k] - self.local[k] - value;
                    }
                }
            }
            Some(Once::Unset { forget }) => {
                self.aside = if forget { DVec3::ZERO } else { self.set };
                self.set = DVec3::ZERO;
            }
            Some(Once::Restore) => self.set = self.aside,
            _ => {}
        }
        Ok(())
    }

    fn axis_words(&self, line: &mut Line) -> Result<[Option<Number>; 3], ProgramFault> {
        let words = ['X', 'Y', 'Z'].map(|letter| line.take(letter));
        for (word, letter) in words.iter().zip(['X', 'Y', 'Z']) {
            let Some(word) = word else { continue };
            if self.numbered && !word.point && word.value != 0.0 {
                return Err(refused(
                    format!("{letter}{} without a decimal point, after a program number (O)", word.value),
                    "controls that number programs read it as micrometres or as millimetres: write the point",
                ));
            }
            if word.value.abs() * self.unit_mm()? > FARTHEST_MM {
                return Err(ProgramFault::Range { letter, value: word.value, most: FARTHEST_MM });
            }
        }
        Ok(words)
    }

    /// The moves of a line.
    fn moves(
        &mut self,
        line: &mut Line,
        codes: &Codes,
        (number, sink): (u64, &mut impl Run),
        moved: &mut bool,
    ) -> Result<(), ProgramFault> {
        if let Some(motion) = codes.motion {
            self.motion = motion;
        }
        let words = self.axis_words(line)?;
        let names_place = words.iter().any(Option::is_some);
        let feed = line.take('F');
        if let Some(Once::Home(home)) = codes.once {
            return self.home(home, words, (number, sink), moved);
        }
        let is_arc = matches!(self.motion, Motion::Arc { .. });
        let centre = is_arc && ['I', 'J', 'K', 'R'].iter().any(|&letter| line.peek(letter).is_some());
        if !names_place && !centre {
            return match codes.motion {
                Some(Motion::Arc { clockwise }) => Err(ProgramFault::Nowhere(if clockwise { "G2" } else { "G3" })),
                // Machines take G0, G1 and G53 alone for a mode.
                _ => Ok(()),
            };
        }
        if self.motion == Motion::None {
            return Err(ProgramFault::Motion);
        }
        let unit = self.unit_mm()?;
        for word in words.iter().flatten() {
            sink.coordinate(word.decimals, unit);
        }
        if codes.machine {
            if self.motion != Motion::Rapid {
                return Err(refused("a feed move in the machine's coordinates (G53)", "write it in those of the work"));
            }
            // Where that is only the machine knows.
            let mut to = self.at;
            (0..3).filter(|&k| words[k].is_some()).for_each(|k| to[k] = f64::NAN);
            return self.make(to, Way::Rapid, (number, sink), moved);
        }
        let to = self.target(words, self.increments)?;
        let way = match self.motion {
            Motion::None | Motion::Rapid => Way::Rapid,
            _ if self.at.is_nan() || to.is_nan() => {
                let from_known = |k: usize| !self.at[k].is_nan() && !to[k].is_nan();
                return Err(ProgramFault::Beginning { axes: axes((0..3).filter(|&k| !from_known(k))) });
            }
            Motion::Straight => Way::Straight { feed: self.feed_of(feed, self.at.distance(to))? },
            Motion::Arc { clockwise } => {
                let arc = self.arc(line, to, clockwise)?;
                Way::Arc { arc, feed: self.feed_of(feed, arc.length_mm())? }
            }
        };
        self.make(to, way, (number, sink), moved)
    }

    /// The arc of a line to a place.
    fn arc(&self, line: &mut Line, to: DVec3, clockwise: bool) -> Result<Arc, ProgramFault> {
        let unit = self.unit_mm()?;
        let [first, second] = self.plane.letters().map(|letter| line.take(letter));
        let radius = line.take('R');
        if let Some(turns) = line.take('P')
            && turns.value != 1.0
        {
            return Err(refused(format!("an arc of several turns (P{})", turns.value), "write every turn by itself"));
        }
        let centre = match (radius, first, second) {
            (Some(radius), None, None) => Centre::Radius(radius.value * unit),
            (Some(_), ..) => return Err(ProgramFault::BothCentres(self.plane.centre_words())),
            (None, None, None) => return Err(ProgramFault::Centre(self.plane.centre_words())),
            (None, first, second) => {
                let value = |word: Option<Number>| word.map(|word| word.value * unit);
                if self.centre_absolute {
                    let (Some(first), Some(second)) = (value(first), value(second)) else {
                        return Err(ProgramFault::Centre(self.plane.centre_words()));
                    };
                    let (shift, _) = self.plane.of(self.set + self.local);
                    Centre::Words { of: DVec2::new(first, second) + shift, absolute: true }
                } else {
                    let of = DVec2::new(value(first).unwrap_or(0.0), value(second).unwrap_or(0.0));
                    Centre::Words { of, absolute: false }
                }
            }
        };
        Arc::through(self.plane, (self.at, to), clockwise, centre)
    }

    /// The feed of a move of this length, mm per minute.
    fn feed_of(&self, word: Option<Number>, length_mm: f64) -> Result<f64, ProgramFault> {
        match (self.inverse_time, word) {
            (true, Some(word)) if word.value > 0.0 => Ok(word.value * length_mm),
            (true, _) => Err(ProgramFault::InverseFeed),
            (false, _) if self.feed > 0.0 => Ok(self.feed * self.unit_mm()?),
            (false, _) => Err(ProgramFault::Feed),
        }
    }

    /// The place that axis words name, mm in the first work offset.
    fn target(&self, words: [Option<Number>; 3], increments: bool) -> Result<DVec3, ProgramFault> {
        let mut to = self.at;
        for k in 0..3 {
            let Some(word) = words[k] else { continue };
            let value = word.value * self.unit_mm()?;
            if increments && self.at[k].is_nan() {
                return Err(ProgramFault::Increment { axes: axes(std::iter::once(k)) });
            }
            to[k] = if increments { self.at[k] + value } else { value + self.set[k] + self.local[k] };
        }
        Ok(to)
    }

    /// To the machine's own place, by way of the one that the line names.
    fn home(
        &mut self,
        home: &'static str,
        words: [Option<Number>; 3],
        (number, sink): (u64, &mut impl Run),
        moved: &mut bool,
    ) -> Result<(), ProgramFault> {
        if self.increments && (0..3).any(|k| words[k].is_some_and(|word| word.value != 0.0) && self.at[k].is_nan()) {
            return Err(refused(format!("{home} by an increment from a place that is not known"), "write G90 first"));
        }
        let named: Vec<usize> = (0..3).filter(|&k| words[k].is_some()).collect();
        if !named.is_empty() {
            // An increment of 0 is no way at all, wherever the tip is.
            let words = words.map(|word| word.filter(|word| !(self.increments && word.value == 0.0)));
            let by = self.target(words, self.increments)?;
            self.make(by, Way::Rapid, (number, sink), moved)?;
        }
        let mut to = self.at;
        (0..3).filter(|k| named.is_empty() || named.contains(k)).for_each(|k| to[k] = f64::NAN);
        self.make(to, Way::Rapid, (number, sink), moved)
    }

    fn make(
        &mut self,
        to: DVec3,
        way: Way,
        (line, sink): (u64, &mut impl Run),
        moved: &mut bool,
    ) -> Result<(), ProgramFault> {
        let from = std::mem::replace(&mut self.at, to);
        let spindle_per_min = if self.turning { self.speed } else { 0.0 };
        *moved = true;
        sink.moved(&Move { line, from, to, way, tool: self.tool, spindle_per_min, blending: self.blending })
    }
}

/// Names of axes.
fn axes(which: impl Iterator<Item = usize>) -> String {
    which.map(|k| ["x", "y", "z"][k]).collect::<Vec<_>>().join(", ")
}
