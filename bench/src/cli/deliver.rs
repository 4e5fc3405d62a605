//! What every benchmark ends in: its tables, its rows, its page.

use super::console::Console;
use crate::Failure;
use serde::Serialize;
use std::path::PathBuf;
use taut_bench::machine::Machine;
use taut_ground::files::{self, Output};
use taut_studies::study::Found;

/// Where results go besides their files below `target/taut`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way<'a> {
    pub(crate) console: Console,
    /// The file of rows that was asked for.
    pub(crate) json: Option<&'a Output>,
    /// Whether rows go to standard output, where they stand alone.
    pub(crate) is_rows_alone: bool,
}

/// Prints the machine and the tables, writes the rows and the page of the experiment of that name.
pub(crate) fn deliver(name: &str, mut found: Found, way: Way<'_>) -> Result<(), Failure> {
    found.text = format!("{}\n{}", Machine::current(), found.text);
    if !way.is_rows_alone {
        files::print(&found.text)?;
    }
    write(name, &found.rows, way)?;
    super::report::of_study(name, found, way)
}

/// Writes the rows to the file asked for, and a copy to `target/taut/`.
pub(crate) fn write(name: &str, rows: &impl Serialize, way: Way<'_>) -> Result<(), Failure> {
    if let Some(json) = way.json {
        json.json(rows)?;
    }
    let copy = PathBuf::from(format!("target/taut/{name}.json"));
    if let Err(e) = files::write_json(&copy, rows) {
        // The table is out and the file asked for is written: this costs the copy only.
        files::complain(&e.to_string());
        return Ok(());
    }
    if way.is_rows_alone {
        return Ok(());
    }
    way.console
        .note(&format!("\nrows written to {}", copy.display()))
}
