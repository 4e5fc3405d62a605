//! An experiment as a value: its name, its options, how it runs, what its plots show.

use crate::cases::Cases;
use crate::options::taking;
use clap::{ArgMatches, Command};
use serde::Serialize;
use serde_json::Value;
use std::path::PathBuf;
use taut_ground::choice::Omission;
use taut_output::check::ExperimentError;
use taut_output::plan::Plan;
use taut_output::settings::Setting;
use taut_output::sheet::Sheet;

/// An experiment.
#[derive(Debug)]
pub struct Study {
    /// Name on the command line and of the files.
    pub name: &'static str,
    /// Title of the page.
    pub title: &'static str,
    /// Subject in a line, for the help.
    pub about: &'static str,
    /// Further help text; empty for most.
    pub details: &'static str,
    /// Arguments for its help, a line for each call.
    pub examples: &'static [&'static str],
    /// Content of `--json`, as its help names it.
    pub writes: &'static str,
    /// A list of its rows and a column that no other experiment has, by which rows without a name are known. The list
    /// without a name is the data itself. No column where rows alone make no page.
    pub mark: (&'static str, &'static str),
    /// Its options by name, in the order of the help: those that other experiments read too, and its own.
    pub takes: &'static [&'static str],
    /// Adds its own options to a command, all that it has where [`takes`](Self::takes) names none.
    pub options: fn(Command) -> Command,
    /// The files that it reads, by its options.
    pub reads: fn(&ArgMatches) -> Vec<PathBuf>,
    /// Runs it. What it comes to depends on its options and on the records of its cases alone.
    pub run: fn(&ArgMatches, &mut Reporter<'_>) -> Result<Found, ExperimentError>,
    /// The tables of its rows.
    pub sheets: &'static [Sheet],
    /// The plots of its page; an experiment without plots has its tables alone.
    pub plots: &'static [Plan],
}

/// A study that reads no files and finds nothing.
pub const PLAIN: Study = Study {
    name: "",
    title: "",
    about: "",
    details: "",
    examples: &[],
    writes: "all rows",
    mark: ("", ""),
    takes: &[],
    options: |command| command,
    reads: |_| Vec::new(),
    run: |_, _| Ok(Found::default()),
    sheets: &[],
    plots: &[],
};

impl Study {
    /// A command with its options.
    pub fn command(&self, command: Command) -> Command {
        match self.takes {
            [] => (self.options)(command),
            names => taking(command, names, self.options),
        }
    }
}

/// Names that a question is put in.
pub(crate) mod question {
    pub(crate) use super::{Found, Reporter, Study, data};
    pub(crate) use crate::cases::Cases;
    pub(crate) use crate::motions::{self, fixed, joined, scientific};
    pub(crate) use crate::options::{Asked, Refused, pick};
    pub(crate) use crate::study;
    pub(crate) use clap::{Args, FromArgMatches};
    pub(crate) use serde_json::{Value, json};
    pub(crate) use taut_output::check::ExperimentError;
    pub(crate) use taut_output::notation::number;
    pub(crate) use taut_output::plan::{PLAIN, PRECISION, Plan, error, linear, positive, texts};
    pub(crate) use taut_output::plot::Mark;
    pub(crate) use taut_output::row::{
        Row, has_ended, has_no_error, is, iterations, number_of, rows_of, text_of,
    };
    pub(crate) use taut_output::settings::{
        ONE_REFINEMENT, Setting, counts, distinct, list, numbers, seconds, set, solvers, step,
    };
    pub(crate) use taut_output::sheet::{self, Across, Column, Sheet, Show, column, digits};
    pub(crate) use taut_output::table::{self, MARK, nanoseconds, omissions, ratio};
}

/// Where a running experiment reports to.
pub struct Reporter<'a> {
    /// Runner of the cases, with their progress.
    pub cases: &'a Cases,
    pub machine: String,
    /// Prints a part of the experiment's text at once.
    pub say: &'a mut dyn FnMut(&str) -> Result<(), ExperimentError>,
}

/// Results of an experiment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Found {
    /// Settings for the page.
    pub settings: Vec<Setting>,
    /// Its tables with their legend, but for what [`Reporter::say`] has printed.
    pub text: String,
    /// Its rows, as they are written as JSON.
    pub rows: Value,
    /// Content of the page beyond the rows; null for most.
    pub extras: Value,
    pub omissions: Vec<Omission>,
    /// Which bars of ours were missed, in a sentence.
    pub missed: Option<String>,
}

/// Rows as the data of an experiment; numbers that are not finite become null.
pub fn data(rows: &impl Serialize) -> Result<Value, ExperimentError> {
    Ok(serde_json::to_value(rows)?)
}

pub(crate) fn tables(sheets: &[Sheet], data: &Value) -> String {
    sheets.iter().map(|sheet| sheet.text(data)).collect()
}
