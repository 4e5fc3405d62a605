//! The report that people look at: one HTML file of speed against error for every solver, with all that belongs to it.
//!
//! What is in it is data ([`Report`], which is written as JSON beside the page and read back by `taut report`); `measure`
//! adds to the rows of the main job what these do not hold, `score` ranks the solvers, `charts` draws, `page` writes.

mod charts;
mod measure;
mod page;
mod score;

pub use measure::{Extras, measure};
pub use page::page;

use crate::ladder::{Omission, Record, Results};
use crate::machine::Machine;
use crate::output::{self, FileError};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};

/// All that the page shows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Report {
    /// Version of the program.
    pub version: String,
    /// The command that gives this report again.
    pub command: String,
    /// What machine it was measured on, one line.
    pub machine: String,
    /// When: seconds since 1970.
    pub unix_time: u64,
    /// What was set, as (name, value with unit).
    pub settings: Vec<(String, String)>,
    /// Rows of the main job.
    pub records: Vec<Record>,
    /// Solvers without rows, and why.
    pub omissions: Vec<Omission>,
    /// What the rows do not hold; empty where the report was made from rows alone.
    #[serde(default)]
    pub extras: Extras,
}

impl Report {
    /// Of the results of the main job on this machine.
    #[must_use]
    pub fn new(
        results: &Results,
        extras: Extras,
        command: String,
        settings: Vec<(String, String)>,
    ) -> Self {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command,
            machine: Machine::current().to_string(),
            unix_time: now.map_or(0, |t| t.as_secs()),
            settings,
            records: results.records.clone(),
            omissions: results.omissions.clone(),
            extras,
        }
    }

    /// From the text of a file: a report as it was written beside its page, or the rows of a `bench.json`.
    ///
    /// # Errors
    /// [`ReportError::Read`] for text that is neither.
    pub fn parse(path: &Path, text: &str) -> Result<Self, ReportError> {
        let failed = |reason: serde_json::Error| ReportError::Read {
            path: path.to_owned(),
            reason: reason.to_string(),
        };
        if text.trim_start().starts_with('[') {
            let records = serde_json::from_str(text).map_err(failed)?;
            return Ok(Self {
                command: "taut bench".to_owned(),
                machine: "not recorded with the rows".to_owned(),
                version: env!("CARGO_PKG_VERSION").to_owned(),
                records,
                ..Self::default()
            });
        }
        serde_json::from_str(text).map_err(failed)
    }
}

/// A report that could not be made.
#[derive(Debug)]
pub enum ReportError {
    /// A file that is no report and holds no rows.
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A file that could not be read or written.
    File(FileError),
    /// A chart that could not be drawn.
    Plot(crate::plot::PlotError),
}

impl fmt::Display for ReportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read { path, reason } => write!(
                f,
                "`{}` is neither a report nor the rows of a benchmark (`taut bench --json FILE` writes them): {reason}",
                path.display()
            ),
            Self::File(e) => e.fmt(f),
            Self::Plot(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for ReportError {}

impl From<FileError> for ReportError {
    fn from(e: FileError) -> Self {
        Self::File(e)
    }
}

impl From<crate::plot::PlotError> for ReportError {
    fn from(e: crate::plot::PlotError) -> Self {
        Self::Plot(e)
    }
}

/// Writes the page to `path`.
///
/// # Errors
/// [`ReportError`].
pub fn write(report: &Report, path: &Path) -> Result<(), ReportError> {
    Ok(output::write_text(path, &page(report)?)?)
}

/// Reads a report or rows from a file.
///
/// # Errors
/// [`ReportError`].
pub fn read(path: &Path) -> Result<Report, ReportError> {
    Report::parse(path, &output::read_text(path)?)
}
