//! The pages of reports, made of what a study found.

pub(crate) mod common;
#[cfg(feature = "cli")]
pub(crate) mod coupon;
pub(crate) mod design;
#[cfg(feature = "cli")]
pub(crate) mod drawn;
#[cfg(feature = "cli")]
pub(crate) mod found;
#[cfg(feature = "cli")]
pub(crate) mod maps;
#[cfg(feature = "cli")]
pub(crate) mod preview;
pub(crate) mod ready;
#[cfg(feature = "cli")]
pub(crate) mod sweep;
