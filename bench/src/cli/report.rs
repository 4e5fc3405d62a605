//! The page that every experiment ends in, and `taut report`: the page of a report or of rows that were written before, and
//! the results of several as Markdown.

use super::Failure;
use super::console::Console;
use super::study::failed;
use crate::report::{self, Report};
use clap::Args;
use std::path::{Path, PathBuf};
use taut_measure::files::{self, Output};
use taut_output::check::ExperimentError;
use taut_studies::study::{Found, Study};

pub(crate) const AFTER_HELP: &str = "\
Examples:
  taut report target/taut/bench.report.json
  taut bench --json rows.json && taut report rows.json --out rows.html
  taut report target/taut/bench.report.json --picture work-precision.svg
  taut report track.jsonl --out track.html
  taut report target/taut/{bench,paper,hard}.report.json --markdown bench/RESULTS.md";

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// A `NAME.report.json`, the rows of `taut bench --json`, of which the page then holds nothing else, or a FILE.jsonl of
    /// `taut track --history`; several for `--markdown`
    #[arg(value_name = "FROM.json", required = true)]
    from: Vec<PathBuf>,
    /// The page (default: target/taut/report.html, or none beside other outputs)
    #[arg(long, value_name = "PATH")]
    out: Option<PathBuf>,
    /// The plot of work against precision alone
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
    /// What all of the runs found, as one Markdown file
    #[arg(long, value_name = "FILE.md")]
    markdown: Option<PathBuf>,
}

/// Where the page goes.
pub(crate) const PAGE: &str = "target/taut/report.html";

/// Reads the file, writes the page, the picture, or both.
pub(crate) fn run(args: &ReportArgs, console: Console) -> Result<(), Failure> {
    let page = match (&args.out, &args.picture, &args.markdown) {
        (None, None, None) => Some(Path::new(PAGE)),
        (out, ..) => out.as_deref(),
    };
    if (page.is_some() || args.picture.is_some()) && args.from.len() > 1 {
        return Err(Failure::Input(
            "a page or a picture is of one file: give one, or `--markdown` alone".to_owned(),
        ));
    }
    let read: Vec<&Path> = args.from.iter().map(PathBuf::as_path).collect();
    let options = [
        ("--out", page),
        ("--picture", args.picture.as_deref()),
        ("--markdown", args.markdown.as_deref()),
    ];
    let [page, picture, markdown] = files::open(options, &read)?;
    let reports = read.iter().map(|path| report::read(path));
    let reports = reports
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| failed(&e))?;
    let written = |what: &str, to: &Output| {
        if to.is_stdout() {
            return Ok(());
        }
        console.note(&format!("{what} written to {}", to.path().display()))
    };
    if let Some(to) = &page {
        to.text(&report::page(&reports[0]).map_err(|e| failed(&e))?)?;
        written("report", to)?;
    }
    if let Some(to) = &picture {
        to.text(&report::picture(&reports[0]).map_err(|e| failed(&e))?)?;
        written("picture", to)?;
    }
    if let Some(to) = &markdown {
        to.text(&report::markdown(&reports))?;
        written("results", to)?;
    }
    Ok(())
}

/// The arguments that the program was called with.
pub(crate) fn arguments() -> Vec<String> {
    let arguments = std::env::args_os().skip(1);
    arguments
        .map(|a| a.to_string_lossy().into_owned())
        .collect()
}

/// Writes the page of an experiment, and its data. The tables are out by then: a page that cannot be written costs the page
/// only.
pub(crate) fn write(
    study: &Study,
    found: Found,
    machine: String,
    arguments: &[String],
    console: Console,
) -> Result<(), Failure> {
    let write = || {
        let report = Report::new(study, found, machine, arguments)?;
        files::write_text(Path::new(PAGE), &report::page(&report)?)?;
        let data = format!("target/taut/{}.report.json", study.name);
        Ok::<(), ExperimentError>(files::write_json(Path::new(&data), &report)?)
    };
    match write() {
        Err(e) => files::complain(&e.to_string()),
        Ok(()) => console.note(&format!("report written to {PAGE}"))?,
    }
    Ok(())
}
