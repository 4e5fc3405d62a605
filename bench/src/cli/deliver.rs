//! What every benchmark ends in: its tables, its rows, its page.

use super::console::Console;
use crate::Failure;
use serde::Serialize;
use std::path::PathBuf;
use taut_bench::ladder::Omission;
use taut_bench::output::{self, Output};
use taut_bench::report::settings::Setting;

/// Where results go besides their files below `target/taut`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way<'a> {
    pub(crate) console: Console,
    /// The file of rows that was asked for.
    pub(crate) json: Option<&'a Output>,
}

impl Way<'_> {
    /// Whether the rows go to standard output, where they stand alone.
    pub(crate) fn is_rows_alone(self) -> bool {
        self.json.is_some_and(Output::is_stdout)
    }
}

/// What a benchmark found.
#[derive(Debug)]
pub(crate) struct Found<'a, R> {
    /// The benchmark's name, and that of its file of rows.
    pub(crate) name: &'a str,
    /// What it was set to.
    pub(crate) settings: Vec<Setting>,
    /// Its tables with their legend.
    pub(crate) text: String,
    pub(crate) rows: &'a R,
    /// What it left out.
    pub(crate) omissions: &'a [Omission],
}

impl<R: Serialize> Found<'_, R> {
    /// Prints the tables, writes the rows and the page.
    pub(crate) fn deliver(self, way: Way<'_>) -> Result<(), Failure> {
        self.deliver_rows(way)?;
        super::report::of_rows(self, way)
    }

    /// Prints the tables, writes the rows.
    pub(crate) fn deliver_rows(&self, way: Way<'_>) -> Result<(), Failure> {
        if !way.is_rows_alone() {
            output::print(&self.text)?;
        }
        self.write(way)
    }

    /// Writes the rows to the file asked for, and a copy to `target/taut/`.
    pub(crate) fn write(&self, way: Way<'_>) -> Result<(), Failure> {
        if let Some(json) = way.json {
            json.json(self.rows)?;
        }
        let copy = PathBuf::from(format!("target/taut/{}.json", self.name));
        if let Err(e) = output::write_json(&copy, self.rows) {
            // The table is out and the file asked for is written: this costs the copy only.
            output::complain(&e.to_string());
            return Ok(());
        }
        if way.is_rows_alone() {
            return Ok(());
        }
        way.console
            .note(&format!("\nrows written to {}", copy.display()))
    }
}
