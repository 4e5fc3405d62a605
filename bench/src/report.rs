//! The report that people look at: one HTML file of speed against error for every solver, with all that belongs to it.
//!
//! The content is data, [`Report`]; it is written as JSON beside the page, and `taut report` reads
//! it back. For the main job `score` ranks the solvers, `charts` draws, `main_job` combines both.
//! Any other experiment has the plots of its study, and `sheets` makes tables of its rows. `page`
//! writes HTML with the tables of `cells`; `markdown` writes several reports as one text. `limits`
//! lists the known limits for the page.

mod cells;
mod charts;
mod limits;
mod main_job;
mod markdown;
mod page;
mod score;
mod sheets;

pub use markdown::markdown;
pub use page::{page, picture};

use crate::machine;
use crate::track::{self, HISTORY};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::Path;
use taut_measure::choice::Omission;
use taut_measure::files;
use taut_output::check::ExperimentError;
use taut_output::settings::Setting;
use taut_studies::ladder::{Extras, LadderRow};
use taut_studies::studies::{self, BENCH};
use taut_studies::study::{Found, Study};

/// All that the page shows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Report {
    /// Version of the program.
    pub version: String,
    /// The command that gives this report again.
    pub command: String,
    /// Machine, in one line.
    pub machine: String,
    /// The compiler; nothing where that is not known.
    #[serde(default)]
    pub compiler: String,
    /// The commit of the sources, as [`machine::commit`] has it; nothing in files that are older.
    #[serde(default)]
    pub commit: String,
    /// When: seconds since 1970.
    pub unix_time: u64,
    #[serde(default)]
    pub settings: Vec<Setting>,
    /// Rows of the main job.
    #[serde(default)]
    pub records: Vec<LadderRow>,
    /// Solvers without rows, and why.
    #[serde(default)]
    pub omissions: Vec<Omission>,
    /// Measurements of the main job beside its rows; empty in a report made from rows alone.
    #[serde(default)]
    pub extras: Extras,
    /// Results of an experiment other than the main job.
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
    /// Report on the results of an experiment on one or several machines, called with `arguments`.
    pub fn new(
        study: &Study,
        found: Found,
        machine: String,
        arguments: &[String],
    ) -> Result<Self, ExperimentError> {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        let report = Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: machine::command(arguments),
            machine,
            compiler: machine::RUSTC.to_owned(),
            commit: machine::commit(),
            settings: found.settings,
            unix_time: now.map_or(0, |t| t.as_secs()),
            omissions: found.omissions,
            ..Self::default()
        };
        let mut report = report.holding(study.name, found.rows)?;
        if let Some(other) = &mut report.other {
            other.printed = taut_output::table::plain(&found.text);
        }
        if !found.extras.is_null() {
            report.extras = serde_json::from_value(found.extras)?;
        }
        Ok(report)
    }

    /// Adds the rows of an experiment: records for the main job, [`Other`] else.
    fn holding(mut self, name: &str, rows: Value) -> serde_json::Result<Self> {
        if name == BENCH.name {
            self.records = serde_json::from_value(rows)?;
        } else {
            self.other = Some(Other {
                name: name.to_owned(),
                rows,
                printed: String::new(),
            });
        }
        Ok(self)
    }

    /// The experiment's name, and that of its files.
    pub fn name(&self) -> &str {
        self.other.as_ref().map_or(BENCH.name, |other| &other.name)
    }

    /// From the text of a file: a report as it was written beside its page, or the rows that a benchmark wrote.
    pub fn parse(path: &Path, text: &str) -> Result<Self, ExperimentError> {
        let name = path.display();
        let failed = |reason: serde_json::Error| {
            format!(
                "`{name}` is neither a report nor the rows of a benchmark (`taut bench --json FILE` writes them): {reason}"
            )
        };
        let value: Value = serde_json::from_str(text).map_err(failed)?;
        let report = if value.get("command").is_some() {
            serde_json::from_str(text)
        } else {
            let name = studies::of_rows(&value).unwrap_or(BENCH).name;
            let alone = Self {
                command: "not recorded with the rows".to_owned(),
                machine: "not recorded with the rows".to_owned(),
                version: env!("CARGO_PKG_VERSION").to_owned(),
                ..Self::default()
            };
            alone.holding(name, value)
        };
        let report = report.map_err(failed)?;
        let is_empty = match &report.other {
            None => report.records.is_empty(),
            Some(other) => sheets::sheets(other).is_empty(),
        };
        if is_empty {
            return Err(empty(path));
        }
        Ok(report)
    }
}

/// A file without rows.
fn empty(path: &Path) -> ExperimentError {
    format!(
        "`{}` holds no rows, so there is nothing to show: run the benchmark again with `--json FILE`",
        path.display()
    )
    .into()
}

/// Reads a report or rows from a file, or from one whose name ends in `.jsonl` the runs of a history.
pub fn read(path: &Path) -> Result<Report, ExperimentError> {
    if path.extension().is_some_and(|e| e == "jsonl") {
        return of_history(path);
    }
    Report::parse(path, &files::read_text(path)?)
}

/// The figures of a history, run by run.
fn of_history(path: &Path) -> Result<Report, ExperimentError> {
    let runs = track::read(path)?;
    let Some(last) = runs.last() else {
        return Err(empty(path));
    };
    let report = Report {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: format!("taut track --history {}", path.display()),
        machine: last.machine.clone(),
        compiler: last.toolchain.clone(),
        commit: last.commit.clone(),
        unix_time: last.unix_time,
        settings: vec![("runs".to_owned(), runs.len().to_string())],
        ..Report::default()
    };
    Ok(report.holding(HISTORY.name, track::data(&runs))?)
}

/// The study of that name: an experiment, or the history of `taut track`.
fn study(name: &str) -> Option<&'static Study> {
    studies::named(name).or_else(|| (name == HISTORY.name).then_some(&HISTORY))
}
