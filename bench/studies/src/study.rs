//! An experiment as a value: its name, its options, how it runs, what its plots show.

use clap::{ArgMatches, Command};
use indicatif::ProgressBar;
use serde::Serialize;
use serde_json::Value;
use std::path::PathBuf;
use taut_ground::choice::Omission;
use taut_output::check::ExperimentError;
use taut_output::plan::Plan;
use taut_output::settings::Setting;
use taut_output::sheet::Sheet;

/// An experiment that `taut study` runs.
#[derive(Debug)]
pub struct Study {
    /// Its name on the command line, and that of its files.
    pub name: &'static str,
    /// What its page is called.
    pub title: &'static str,
    /// What it measures, in a line.
    pub about: &'static str,
    /// Arguments of a small run, for its help.
    pub example: &'static str,
    /// A list of its rows and a column that no other experiment has, by which rows without a name are known. The list
    /// without a name is the data itself.
    pub mark: (&'static str, &'static str),
    /// Adds its options to a command.
    pub options: fn(Command) -> Command,
    /// The files that it reads, by its options.
    pub reads: fn(&ArgMatches) -> Vec<PathBuf>,
    /// Runs it.
    pub run: fn(&ArgMatches, &ProgressBar) -> Result<Found, ExperimentError>,
    /// The tables of its rows.
    pub sheets: &'static [Sheet],
    /// The plots of its page; an experiment without plots has its tables alone.
    pub plots: &'static [Plan],
}

/// What an experiment found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Found {
    /// What it was set to.
    pub settings: Vec<Setting>,
    /// Its tables with their legend.
    pub text: String,
    /// Its rows, as they are written as JSON.
    pub rows: Value,
    /// What it left out.
    pub omissions: Vec<Omission>,
}

/// Rows as the data of an experiment; numbers that are not finite become null.
///
/// # Errors
/// Rows that cannot be written as JSON.
pub fn data(rows: &impl Serialize) -> Result<Value, ExperimentError> {
    Ok(serde_json::to_value(rows)?)
}

/// The tables of the data.
pub(crate) fn tables(sheets: &[Sheet], data: &Value) -> String {
    sheets.iter().map(|sheet| sheet.text(data)).collect()
}

/// Reads no files.
#[must_use]
pub fn no_files(_: &ArgMatches) -> Vec<PathBuf> {
    Vec::new()
}
