use super::*;
use crate::{bench::ExitFace, grid::Extent};
