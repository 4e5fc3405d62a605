//! An experiment as a value: its name, its options, how it runs, what its plots show.

use crate::cases::Cases;
use crate::options::taking;
use crate::question::Question;
use clap::{ArgMatches, Command};
use serde::Serialize;
use serde_json::Value;
use std::path::PathBuf;
use taut_measure::choice::Omission;
use taut_output::check::ExperimentError;
use taut_output::settings::Setting;
use taut_output::sheet::Sheet;

#[derive(Debug)]
pub struct Study {
    /// Name on the command line and of the files.
    pub name: &'static str,
    /// What it is called and takes, its tables and its plots.
    pub question: fn() -> &'static Question,
    /// Adds its own options to a command, all that it has where its question names none.
    pub options: fn(Command) -> Command,
    /// All files that it reads by its options, those among them that other files name.
    pub reads: fn(&ArgMatches) -> Vec<PathBuf>,
    /// Runs it. What it comes to depends on its options and on the records of its cases alone.
    pub run: fn(&ArgMatches, &mut Reporter<'_>) -> Result<Found, ExperimentError>,
}

/// A study that reads no files and finds nothing.
pub const PLAIN: Study = Study {
    name: "",
    question: || panic!("a study without a question"),
    options: |command| command,
    reads: |_| Vec::new(),
    run: |_, _| Ok(Found::default()),
};

impl Study {
    pub fn question(&self) -> &'static Question {
        (self.question)()
    }

    pub(crate) fn sheet(&self, name: &str) -> &'static Sheet {
        self.question().sheet(name)
    }

    /// All tables of its page.
    pub(crate) fn tables(&self, data: &Value) -> String {
        let sheets = self.question().sheets.iter();
        sheets.map(|sheet| sheet.text(data)).collect()
    }

    /// A command with its options.
    pub fn command(&self, command: Command) -> Command {
        match &self.question().takes[..] {
            [] => (self.options)(command),
            names => taking(command, names, self.options),
        }
    }
}

/// Names that a question is put in.
pub(crate) mod question {
    pub(crate) use super::{Found, Reporter, Study, data};
    pub(crate) use crate::cases::Cases;
    pub(crate) use crate::motions::{self, joined};
    pub(crate) use crate::options::{Asked, Refused, pick, read_by};
    pub(crate) use crate::question;
    pub(crate) use crate::question::Function::{Holds, Text, Worth};
    pub(crate) use crate::question::Functions;
    pub(crate) use crate::study;
    pub(crate) use clap::{Args, FromArgMatches};
    pub(crate) use serde_json::{Value, json};
    pub(crate) use taut_output::check::ExperimentError;
    pub(crate) use taut_output::notation::number;
    pub(crate) use taut_output::row::{
        Row, has_ended, has_no_error, is, number_of, rows_of, text_of,
    };
    pub(crate) use taut_output::settings::{
        ONE_REFINEMENT, Setting, counts, distinct, list, numbers, seconds, set, solvers, step,
    };
    pub(crate) use taut_output::sheet::{Sheet, digits};
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
