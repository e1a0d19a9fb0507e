//! The pages of reports, made of what a study found.

pub(crate) mod common;
pub(crate) mod coupon;
pub(crate) mod design;
pub(crate) mod found;
pub(crate) mod maps;
pub(crate) mod preview;
pub(crate) mod ready;
pub(crate) mod sweep;
