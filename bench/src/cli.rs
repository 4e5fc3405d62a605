//! Commands of `taut` with a file of their own.

pub(crate) mod bench;
pub(crate) mod checks;
pub(crate) mod console;
pub(crate) mod deliver;
pub(crate) mod hard;
pub(crate) mod matrix;
pub(crate) mod paper;
pub(crate) mod parse;
pub(crate) mod report;
pub(crate) mod run;
pub(crate) mod scene;
pub(crate) mod study;
pub(crate) mod track;
