//! What a person says of programs: of one that is read and its machine, and of how one is written.

use super::{Feed, Length, NumberedTool, SmallLength, StockSize, Travel, UnitsName, ZeroPlace};
use crate::fabricate::{Cutter, Direction, Pattern, Post};
use std::path::PathBuf;

const HEADING: &str = "Programs of machines (.ngc, .nc, .tap, .gcode, .cnc)";

/// What is said of a program that is read, and of the machine that shall run it.
#[derive(clap::Args, Clone, Debug)]
pub struct ProgramArgs {
    /// A tool: ball:d6mm (its diameter) or ball:r3mm, flat:d12mm, bull:d12mm,r1mm, vee:60deg,d6mm,
    /// taper:r1mm,5deg,d6mm; one of several with its number, as in 2=flat:d6mm. May be given
    /// several times [default: as comments of the program say]
    #[arg(long, value_name = "TOOL", help_heading = HEADING)]
    pub tool: Vec<NumberedTool>,

    /// The block's own file, which the cut face is compared with [default: the one that the side
    /// file names]
    #[arg(long, value_name = "FILE", help_heading = HEADING)]
    pub design: Option<PathBuf>,

    /// The program's zero: exit, entry, stock-top or corner, or X,Y,Z in the frame of the bench
    /// [default: the side file's]
    #[arg(long, value_name = "PLACE", allow_hyphen_values = true, help_heading = HEADING)]
    pub origin: Option<ZeroPlace>,

    /// The stock: its thickness, or WIDTHxHEIGHTxTHICKNESS [default: the side file's]
    #[arg(long, value_name = "SIZE", help_heading = HEADING)]
    pub stock: Option<StockSize>,

    /// How far the machine's axes go, as in 300x200x80mm: what is larger is told
    #[arg(long, value_name = "SIZE", help_heading = HEADING)]
    pub travel: Option<Travel>,

    /// The machine's acceleration, per square second; without it time is that of feeds alone
    #[arg(long, value_name = "LENGTH", help_heading = HEADING)]
    pub acceleration: Option<Length>,

    /// The machine's speed of rapids
    #[arg(long, value_name = "FEED", default_value = "5000mm/min", help_heading = HEADING)]
    pub rapid: Feed,

    /// Units of a program that names none
    #[arg(long, value_name = "UNIT", help_heading = HEADING)]
    pub units: Option<UnitsName>,

    /// Polish the cut face: the standard deviation of the Gaussian that blurs its heights
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, help_heading = HEADING)]
    pub polish: Option<Length>,

    /// Write NAME.cut.png beside the program: the light after every step, and a map of what the cut
    /// face lies off the design
    #[arg(long, help_heading = HEADING)]
    pub pictures: bool,
}

const WRITING: &str = "Writing a program (.ngc, .nc, .tap, .gcode, .cnc)";

/// How a program is written.
#[derive(clap::Args, Clone, Debug)]
pub struct WriteArgs {
    /// How the way lies on the face: rows, spiral (from the middle outwards) or contour-parallel
    #[arg(long, value_name = "PATTERN", default_value_t, hide_short_help = true, help_heading = WRITING)]
    pub pattern: Pattern,

    /// Cut all rows in the sense in which the cutter climbs, instead of to and fro
    #[arg(long, hide_short_help = true, help_heading = WRITING)]
    pub climb: bool,

    /// Rough in levels before, with this cutter
    #[arg(long, value_name = "CUTTER", hide_short_help = true, help_heading = WRITING)]
    pub rough: Option<Cutter>,

    /// From level to level of roughing [default: a quarter of its cutter's diameter]
    #[arg(long, value_name = "LENGTH", requires = "rough", hide_short_help = true, help_heading = WRITING)]
    pub step_down: Option<Length>,

    /// What roughing leaves, along the normal
    #[arg(long, value_name = "LENGTH", default_value = "0.3mm", hide_short_help = true, help_heading = WRITING)]
    pub rough_allowance: Length,

    /// The control: linuxcnc, grbl, mach, fanuc or haas
    #[arg(long, value_name = "NAME", default_value_t, hide_short_help = true, help_heading = WRITING)]
    pub post: Post,

    /// Speed of the spindle, per minute
    #[arg(long, value_name = "SPEED", default_value_t = 18_000.0, allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    pub spindle: f64,

    /// How far above the stock the tip goes between cuts
    #[arg(long, value_name = "LENGTH", default_value = "5mm", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    pub safe_height: Length,

    /// How far strokes may lie off the face, in um [default: 0.001]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    pub chord_error: Option<SmallLength>,

    /// Write rows along x or y as arcs: a third of the words, for controls that look ahead little
    #[arg(long, hide_short_help = true, help_heading = WRITING)]
    pub arcs: bool,
}

/// The pass of a program that is written of a design.
#[derive(clap::Args, Clone, Debug)]
pub struct PassArgs {
    /// The finishing cutter: ball:d6mm (its diameter) or ball:r3mm, flat:d12mm, bull:d12mm,r1mm
    #[arg(long, value_name = "CUTTER", default_value = "ball:d6mm", hide_short_help = true, help_heading = WRITING)]
    pub cutter: Cutter,

    /// From row to row
    #[arg(long, value_name = "LENGTH", default_value = "0.1mm", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    pub step_over: Length,

    /// Direction of the rows: x, y or an angle such as 45deg
    #[arg(long, value_name = "DIRECTION", default_value = "x", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    pub direction: Direction,

    /// Feed of the cutter
    #[arg(long, value_name = "FEED", default_value = "2000mm/min", allow_hyphen_values = true, hide_short_help = true, help_heading = WRITING)]
    pub feed: Feed,

    /// How the program is written.
    #[command(flatten)]
    pub write: WriteArgs,
}

impl ProgramArgs {
    /// Whether something is said that only programs have.
    pub fn is_given(&self) -> bool {
        let of_machine = self.origin.is_some() || self.stock.is_some() || self.travel.is_some();
        of_machine
            || !self.tool.is_empty()
            || self.design.is_some()
            || self.acceleration.is_some()
            || self.units.is_some()
            || self.polish.is_some()
            || self.pictures
    }
}
