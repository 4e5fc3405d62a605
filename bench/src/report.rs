//! The report that people look at: one HTML file of speed against error for every solver, with all that belongs to it.
//!
//! What is in it is data ([`Report`], which is written as JSON beside the page and read back by `taut report`). Of
//! the main job `measure` adds to the rows what these do not hold, `score` ranks the solvers, `charts` draws,
//! `main_job` puts them together. Of every other experiment the plots are those of its study, and `sheets` makes tables of its
//! rows. `page` writes, `cells` are its tables, `markdown` writes several reports as one text. `limits` is what the page
//! says of known limits.

mod cells;
mod charts;
mod limits;
mod main_job;
mod markdown;
mod measure;
mod page;
mod score;
mod sheets;

pub use markdown::markdown;
pub use measure::{Extras, measure};
pub use page::{page, picture};

use crate::machine::{self, Machine};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt;
use std::path::{Path, PathBuf};
use taut_ground::choice::Omission;
use taut_ground::files::{self, FileError, Output};
use taut_output::settings::Setting;
use taut_studies::ladder::{Record, Results};
use taut_studies::studies;
use taut_studies::study::Found;

/// All that the page shows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Report {
    /// Version of the program.
    pub version: String,
    /// The command that gives this report again.
    pub command: String,
    /// What machine it was measured on, one line.
    pub machine: String,
    /// The compiler; nothing where that is not known.
    #[serde(default)]
    pub compiler: String,
    /// The commit of the sources, as [`machine::commit`] has it; nothing in files that are older.
    #[serde(default)]
    pub commit: String,
    /// When: seconds since 1970.
    pub unix_time: u64,
    /// What was set.
    #[serde(default)]
    pub settings: Vec<Setting>,
    /// Rows of the main job.
    #[serde(default)]
    pub records: Vec<Record>,
    /// Solvers without rows, and why.
    #[serde(default)]
    pub omissions: Vec<Omission>,
    /// What the rows of the main job do not hold; empty where the report was made from rows alone.
    #[serde(default)]
    pub extras: Extras,
    /// What another benchmark than the main job found.
    #[serde(default)]
    pub other: Option<Other>,
}

/// The results of another benchmark than the main job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Other {
    /// Its name: that of its file of rows.
    pub name: String,
    /// Its rows, as they stand in that file.
    pub rows: Value,
    /// Its tables and their legend, as they are printed.
    #[serde(default)]
    pub printed: String,
}

impl Report {
    /// Of nothing yet, on this machine.
    fn here(arguments: &[String], settings: Vec<Setting>) -> Self {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: machine::command(arguments),
            machine: Machine::current().to_string(),
            compiler: machine::RUSTC.to_owned(),
            commit: machine::commit(),
            settings,
            unix_time: now.map_or(0, |t| t.as_secs()),
            ..Self::default()
        }
    }

    /// Of the results of the main job on this machine, which was called with these arguments.
    #[must_use]
    pub fn new(
        results: &Results,
        extras: Extras,
        arguments: &[String],
        settings: Vec<Setting>,
    ) -> Self {
        Self {
            records: results.records.clone(),
            omissions: results.omissions.clone(),
            extras,
            ..Self::here(arguments, settings)
        }
    }

    /// Of what another experiment found on this machine, called with these arguments.
    #[must_use]
    pub fn of_study(name: &str, found: Found, arguments: &[String]) -> Self {
        Self {
            omissions: found.omissions,
            other: Some(Other {
                name: name.to_owned(),
                rows: found.rows,
                printed: taut_output::table::plain(&found.text),
            }),
            ..Self::here(arguments, found.settings)
        }
    }

    /// The experiment's name, and that of its files.
    #[must_use]
    pub fn name(&self) -> &str {
        self.other.as_ref().map_or("bench", |other| &other.name)
    }

    /// From the text of a file: a report as it was written beside its page, or the rows that a benchmark wrote.
    ///
    /// # Errors
    /// [`ReportError::Read`] for text that is neither, [`ReportError::Empty`] where there is no row.
    pub fn parse(path: &Path, text: &str) -> Result<Self, ReportError> {
        let failed = |reason: serde_json::Error| ReportError::Read {
            path: path.to_owned(),
            reason: reason.to_string(),
        };
        let value: Value = serde_json::from_str(text).map_err(failed)?;
        let is_report = value.get("command").is_some();
        let rows_alone = |report: Self| Self {
            command: "not recorded with the rows".to_owned(),
            machine: "not recorded with the rows".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            ..report
        };
        let report = if is_report {
            serde_json::from_str(text).map_err(failed)?
        } else if let Some(study) = studies::of_rows(&value) {
            rows_alone(Self {
                other: Some(Other {
                    name: study.name.to_owned(),
                    rows: value,
                    printed: String::new(),
                }),
                ..Self::default()
            })
        } else {
            rows_alone(Self {
                records: serde_json::from_str(text).map_err(failed)?,
                ..Self::default()
            })
        };
        let empty = match &report.other {
            None => report.records.is_empty(),
            Some(other) => sheets::sheets(other).is_empty(),
        };
        if empty {
            return Err(ReportError::Empty(path.to_owned()));
        }
        Ok(report)
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
    /// A file without rows.
    Empty(PathBuf),
    /// A report whose benchmark has no plot of work against precision; its name.
    NoPicture(String),
    /// A file that could not be read or written.
    File(FileError),
    /// A chart that could not be drawn.
    Plot(taut_output::plot::PlotError),
}

impl fmt::Display for ReportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read { path, reason } => write!(
                f,
                "`{}` is neither a report nor the rows of a benchmark (`taut bench --json FILE` writes them): {reason}",
                path.display()
            ),
            Self::Empty(path) => write!(
                f,
                "`{}` holds no rows, so there is nothing to show: run the benchmark again with `--json FILE`",
                path.display()
            ),
            Self::NoPicture(name) => write!(
                f,
                "the rows of `{name}` hold no plot of work against precision: give a report of `taut bench`"
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

impl From<taut_output::plot::PlotError> for ReportError {
    fn from(e: taut_output::plot::PlotError) -> Self {
        Self::Plot(e)
    }
}

/// Writes the page.
///
/// # Errors
/// [`ReportError`].
pub fn write(report: &Report, to: &Output) -> Result<(), ReportError> {
    Ok(to.text(&page(report)?)?)
}

/// Writes the plot of work against precision alone, as an SVG file.
///
/// # Errors
/// [`ReportError`].
pub fn write_picture(report: &Report, to: &Output) -> Result<(), ReportError> {
    Ok(to.text(&picture(report)?)?)
}

/// Reads a report or rows from a file.
///
/// # Errors
/// [`ReportError`].
pub fn read(path: &Path) -> Result<Report, ReportError> {
    Report::parse(path, &files::read_text(path)?)
}
