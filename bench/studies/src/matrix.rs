//! The study of systems from files, and a graded set of systems to write.

mod study;
pub mod suite;
mod table;

pub(crate) use study::STUDY;
pub use study::{backends, measured};
pub use table::{compared, solved, suite as suite_table};
