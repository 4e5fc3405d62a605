//! Commands of `taut` with a file of their own.

pub(crate) mod paper;
pub(crate) mod scene;
pub(crate) mod sweeps;
