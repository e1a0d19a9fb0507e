//! What the codes of a program mean, and which of them last.

use super::{
    error::ProgramFault,
    geometry::Plane,
    line::{Line, refused},
};

/// How a controller treats corners.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Blending {
    /// The program does not say.
    #[default]
    Unsaid,
    /// G61, G61.1, G9: along the very path.
    Exact,
    /// G64 with P: at most so far off the path, mm.
    Within(f64),
    /// G64 alone: as fast as the machine can, however far off the path.
    Unbounded,
}

/// Motion that goes on until another one is named (group 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    None,
    Rapid,
    Straight,
    Arc { clockwise: bool },
}

/// What a line does besides moving on (group 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Once {
    Dwell,
    /// G28, G30.
    Home(&'static str),
    /// G52.
    Local,
    /// G92.
    Set,
    /// G92.1, G92.2: the former forgets what was set.
    Unset {
        forget: bool,
    },
    /// G92.3.
    Restore,
}

/// The G-codes of a line, by what they are about.
#[derive(Clone, Debug, Default)]
pub(super) struct Codes {
    pub(super) motion: Option<Motion>,
    pub(super) once: Option<Once>,
    pub(super) plane: Option<Plane>,
    pub(super) inch: Option<bool>,
    pub(super) increments: Option<bool>,
    pub(super) centre_absolute: Option<bool>,
    pub(super) inverse_time: Option<bool>,
    pub(super) work_offset: Option<u16>,
    pub(super) blending: Option<Blending>,
    /// G53: this move is in the coordinates of the machine.
    pub(super) machine: bool,
    /// G43: the line may carry H.
    pub(super) length: bool,
    /// Words of the controller's look-ahead take P, Q, R or L.
    pub(super) look_ahead: bool,
}

/// A code as it is written.
pub(super) fn name(letter: char, tenths: u16) -> String {
    match (letter, tenths % 10) {
        ('G', 0) => format!("G{}", tenths / 10),
        ('G', rest) => format!("G{}.{rest}", tenths / 10),
        _ => format!("{letter}{tenths}"),
    }
}

impl Codes {
    /// Sorts the G-codes of a line.
    pub(super) fn of(line: &Line) -> Result<Self, ProgramFault> {
        let mut codes = Self::default();
        let mut groups: [Option<u16>; GROUPS] = [None; GROUPS];
        for &code in &line.g {
            let group = codes.sort(code, line)?;
            if let Some(other) = groups[group as usize].replace(code)
                && group != Group::Harmless
            {
                return Err(ProgramFault::Exclude(name('G', other), name('G', code)));
            }
        }
        Ok(codes)
    }

    /// Takes a code; returns its group.
    fn sort(&mut self, code: u16, line: &Line) -> Result<Group, ProgramFault> {
        let group = match code {
            // Mach's posts cancel cycles and name a motion on one line.
            800 => {
                self.motion = self.motion.or(Some(Motion::None));
                Group::Harmless
            }
            0 | 10 | 20 | 30 => {
                self.motion = Some(match code {
                    0 => Motion::Rapid,
                    10 => Motion::Straight,
                    20 => Motion::Arc { clockwise: true },
                    _ => Motion::Arc { clockwise: false },
                });
                Group::Motion
            }
            40 | 280 | 300 | 520 | 920..=923 => {
                self.once = Some(match code {
                    40 => Once::Dwell,
                    280 => Once::Home("G28"),
                    300 => Once::Home("G30"),
                    520 => Once::Local,
                    920 => Once::Set,
                    923 => Once::Restore,
                    921 => Once::Unset { forget: true },
                    _ => Once::Unset { forget: false },
                });
                Group::Once
            }
            530 => {
                self.machine = true;
                Group::Machine
            }
            170 | 180 | 190 => {
                self.plane = Some([Plane::Xy, Plane::Zx, Plane::Yz][usize::from(code / 10 - 17)]);
                Group::Plane
            }
            200 | 210 => {
                self.inch = Some(code == 200);
                Group::Units
            }
            900 | 910 => {
                self.increments = Some(code == 910);
                Group::Distance
            }
            901 | 911 => {
                self.centre_absolute = Some(code == 901);
                Group::Centre
            }
            930 | 940 => {
                self.inverse_time = Some(code == 930);
                Group::Feed
            }
            540 | 550 | 560 | 570 | 580 | 590..=593 | 1540 => {
                self.work_offset = Some(code);
                Group::WorkOffset
            }
            610 | 611 | 90 => {
                // G9 holds for its line only, and is as good as what lasts.
                self.blending = Some(Blending::Exact).filter(|_| code != 90);
                Group::Path
            }
            640 => {
                self.blending = Some(Blending::Unbounded);
                Group::Path
            }
            430 | 490 => {
                self.length = true;
                Group::Length
            }
            400 => Group::Radius,
            980 | 990 => Group::Return,
            // Cancels what is refused below, or tells how fast to look ahead.
            150 | 500 | 690 | 970 => Group::Harmless,
            50 | 51 | 80 | 1870 if !places(line) => {
                self.look_ahead = true;
                Group::Harmless
            }
            _ => return Err(unknown(code)),
        };
        Ok(group)
    }
}

/// Codes of one group exclude each other on a line.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Group {
    Once,
    Motion,
    Machine,
    Plane,
    Units,
    Distance,
    Centre,
    Feed,
    WorkOffset,
    Path,
    Length,
    Radius,
    Return,
    Harmless,
}

const GROUPS: usize = Group::Harmless as usize + 1;

/// Whether a line names a place.
fn places(line: &Line) -> bool {
    "XYZIJK".chars().any(|letter| line.peek(letter).is_some())
}

fn unknown(code: u16) -> ProgramFault {
    let (what, remedy) = match code {
        410 | 411 | 420 | 421 => {
            ("cutter radius compensation", "post the way of the cutter's own axis, which any simulation needs")
        }
        730 | 740 | 810..=890 => ("a canned cycle", "let the post-processor write its moves"),
        50..=53 | 60..=63 => ("a spline", "let the post-processor write lines or arcs"),
        70 | 80 => ("the diameter mode of a lathe", "this is about milling"),
        320 | 330 | 331 | 700..=720 | 760 => ("a cycle or a thread of a lathe", "this is about milling"),
        960 => ("constant surface speed", "this is about milling"),
        950 => ("feed per turn", "write feeds per minute (G94)"),
        100..=109 => ("a change of the machine's tables", "make it by hand, and keep it out of the program"),
        120 | 130 => ("a pocket cycle", "let the post-processor write its moves"),
        160 => ("polar coordinates", "let the post-processor write x and y"),
        310 | 380..=389 => ("probing", "where it ends nobody knows beforehand: probe by a program of its own"),
        431..=439 => ("a tool length of the program's own", "use G43 and the machine's table"),
        510 | 511 => ("scaling", "let the post-processor write the places that are meant"),
        650..=670 => ("a macro", "post one plain program"),
        680 | 681 => ("a turned coordinate system", "let the post-processor write the places that are meant"),
        _ => return ProgramFault::Unknown(name('G', code)),
    };
    refused(format!("{} ({what})", name('G', code)), remedy)
}

/// What an M-code does, as far as moves go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Does {
    Nothing,
    /// M2, M30.
    End,
    /// M3, M4.
    Turns,
    /// M5.
    Stands,
    /// M6.
    ToolChange,
}

/// What an M-code does.
pub(super) fn misc(code: u16) -> Result<Does, ProgramFault> {
    Ok(match code {
        2 | 30 => Does::End,
        3 | 4 => Does::Turns,
        5 => Does::Stands,
        6 => Does::ToolChange,
        // Pauses, coolant, clamps, orientation, chips, overrides, doors, gears.
        0
        | 1
        | 7..=13
        | 19
        | 21
        | 31..=34
        | 36
        | 40..=44
        | 48..=53
        | 60..=65
        | 68..=69
        | 73
        | 74
        | 80..=85
        | 88
        | 89 => Does::Nothing,
        96..=99 => {
            return Err(refused(format!("M{code} (a subprogram or a jump)"), "post one plain program"));
        }
        _ => return Err(ProgramFault::Unknown(name('M', code))),
    })
}
