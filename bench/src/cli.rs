//! Commands of `taut` with a file of their own.

pub(crate) mod against;
pub(crate) mod console;
pub(crate) mod matrix;
pub(crate) mod parse;
pub(crate) mod report;
pub(crate) mod run;
pub(crate) mod scene;
pub(crate) mod study;
pub(crate) mod track;
