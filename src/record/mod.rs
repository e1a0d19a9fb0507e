//! What is written down about a block: its side file, and the documents that programs read. Plain
//! data; whoever finds it out fills it in.

mod annotated;
pub mod document;
#[cfg(test)]
mod hostile_toml;
mod side_file;
mod stack_file;

pub use side_file::{BenchRecord, EmissionRecord, FrameRecord, PictureRecord, SideFile, WorkRecord};
pub use stack_file::StackFile;
