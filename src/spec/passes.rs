//! The finishing pass, as every command that simulates it is told.

use super::Length;
use crate::fabricate::{Cutter, Direction, Pass};

/// What cuts, and how dense.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct CutterArgs {
    /// The finishing cutter: ball:d6mm (its diameter) or ball:r3mm (its radius, as is a size without
    /// a letter), flat:d12mm, bull:d12mm,r1mm (its corner's radius last)
    #[arg(long, value_name = "CUTTER", default_value = "ball:d6mm")]
    pub cutter: Cutter,

    /// From row to row
    #[arg(long, value_name = "LENGTH", default_value = "0.1mm", allow_hyphen_values = true)]
    pub step_over: Length,
}

/// The rows of a pass.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct RowsArgs {
    /// What cuts, and how dense.
    #[command(flatten)]
    pub tool: CutterArgs,

    /// Direction of the rows: x, y or an angle such as 45deg
    #[arg(long, value_name = "DIRECTION", default_value = "x", allow_hyphen_values = true)]
    pub direction: Direction,
}

impl RowsArgs {
    /// The pass that leaves nothing on the face.
    pub fn pass(&self) -> Pass {
        Pass { direction: self.direction, ..Pass::finishing(self.tool.cutter, self.tool.step_over.mm) }
    }
}
