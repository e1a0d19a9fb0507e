//! What a person asks for: every setting of a design, how it is written, and where it comes from.
//!
//! [`Settings`] is declared once; flags, design files and side files follow from it. The files that
//! settings name are read through a [`Host`].

mod angle;
mod choices;
pub(crate) mod conflicts;
mod cutters;
mod finish;
mod flags;
mod forms;
mod host;
mod lamp;
pub(crate) mod layers;
mod length;
mod machine;
pub(crate) mod mistakes;
mod passes;
mod presets;
mod program;
mod quantity;
mod range;
mod settings;
mod shard;
mod source;
mod tolerances;
mod wavelength;

pub use angle::{Angle, Inclination};
pub use choices::{OriginName, QualityName, SolverName, SurfaceName, TransferName};
pub use cutters::{CutterEntry, CutterList};
pub use finish::FinishPlan;
pub use forms::{OutlineName, RimSize, Shift, VignetteName, WindowSize};
pub use host::Host;
pub use lamp::{Emission, LightName};
pub use layers::{parse, preset, read, settings};
pub use length::{Feed, Length, SmallLength};
pub use machine::{NumberedTool, StockSize, Travel, UnitsName, ZeroPlace};
pub use passes::{CutterArgs, RowsArgs};
pub use presets::PresetName;
pub use program::{PassArgs, ProgramArgs, WriteArgs};
pub use quantity::name_of;
pub(crate) use quantity::nearest;
pub use range::{Quantity, Range};
pub use settings::{DRAWING_NODES, DesignFile, OFFSET, Settings};
pub use shard::Shard;
pub use source::{BeforeFile, DeconvolutionName, Roughness, SourceName, SpeckFile};
pub use tolerances::ToleranceArgs;
pub use wavelength::{VISIBLE_NM, Wavelength};
