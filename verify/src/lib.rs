//! Traces light through an exported block of glass and judges the picture it draws.
