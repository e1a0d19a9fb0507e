//! By how much things may be off, as a person says it.

use super::{Angle, Length, SourceName};

/// By how much things may be off, and whether that is asked.
#[derive(clap::Args, Clone, Debug)]
pub struct ToleranceArgs {
    /// Trace what index, distance, tilt, form, thickness and the size of the light do to the
    /// picture, and find the depth of focus. Needs a side file
    #[arg(long)]
    pub tolerance: bool,

    /// The index is off by this, to either side
    #[arg(long, value_name = "N", default_value_t = 0.01, requires = "tolerance")]
    pub index_off: f64,

    /// The distance is off by this, to either side
    #[arg(long, value_name = "LENGTH", default_value = "5mm", requires = "tolerance")]
    pub distance_off: Length,

    /// The block is turned by this about x and about y
    #[arg(long, value_name = "ANGLE", default_value = "1deg", requires = "tolerance", allow_hyphen_values = true)]
    pub tilt_off: Angle,

    /// Form error of low order (power, astigmatism), peak to valley over the block
    #[arg(long, value_name = "LENGTH", default_value = "50um", requires = "tolerance", allow_hyphen_values = true)]
    pub form_error: Length,

    /// The stock is thicker by this, and the receiver stands at its distance from the entry face
    #[arg(long, value_name = "LENGTH", default_value = "0.5mm", requires = "tolerance")]
    pub thickness_off: Length,

    /// The block before this one stands aside by this along x and y, and nearer and further
    #[arg(long, value_name = "LENGTH", default_value = "0.2mm", requires = "tolerance")]
    pub place_off: Length,

    /// Angular diameter of the light as seen from the block: sun (0.53deg), or 1.15deg for a torch
    /// of 20 mm a metre away. May be given several times [default: sun and 1.15deg]
    #[arg(long, value_name = "SIZE", requires = "tolerance", allow_hyphen_values = true)]
    pub source_size: Vec<SourceName>,

    /// The relative RMS error up to which a picture counts as in focus [default: twice that of the
    /// block]
    #[arg(long, value_name = "ERROR", requires = "tolerance")]
    pub focus_error: Option<f64>,
}
