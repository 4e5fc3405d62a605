//! The page that every experiment ends in, and `taut report`: the page of a report or of rows that were written before, and
//! the results of several as Markdown.

use super::console::Console;
use super::deliver::Way;
use crate::Failure;
use clap::Args;
use std::path::{Path, PathBuf};
use taut_bench::report::{self, Report};
use taut_ground::files::{self, Output};
use taut_output::settings::Setting;
use taut_studies::ladder::{Config, Results};
use taut_studies::study::Found;

/// What `--help` says below the options.
pub(crate) const AFTER_HELP: &str = "\
Examples:
  taut report target/taut/bench.report.json
  taut bench --json rows.json && taut report rows.json --out rows.html
  taut report target/taut/bench.report.json --picture work-precision.svg
  taut report target/taut/{bench,paper,hard}.report.json --markdown bench/RESULTS.md";

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// A `NAME.report.json`, or the rows of `taut bench --json`, of which the page then holds nothing else; several for
    /// `--markdown`
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
const PAGE: &str = "target/taut/report.html";

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
    let reports = reports.collect::<Result<Vec<_>, _>>()?;
    let written = |what: &str, to: &Output| {
        if to.is_stdout() {
            return Ok(());
        }
        console.note(&format!("{what} written to {}", to.path().display()))
    };
    if let Some(to) = &page {
        report::write(&reports[0], to)?;
        written("report", to)?;
    }
    if let Some(to) = &picture {
        report::write_picture(&reports[0], to)?;
        written("picture", to)?;
    }
    if let Some(to) = &markdown {
        to.text(&report::markdown(&reports))?;
        written("results", to)?;
    }
    Ok(())
}

/// The arguments that the program was called with.
fn arguments() -> Vec<String> {
    let arguments = std::env::args_os().skip(1);
    arguments
        .map(|a| a.to_string_lossy().into_owned())
        .collect()
}

/// Measures what the rows do not hold and writes the page with its data; a note of where it is, unless standard output is
/// for the rows only.
pub(crate) fn of_main_job(
    config: &Config,
    results: &Results,
    settings: Vec<Setting>,
    quick: bool,
    way: Way<'_>,
) -> Result<(), Failure> {
    let bar = way.console.progress(0);
    let extras = report::measure(&config.choices, quick, &bar)?;
    bar.finish_and_clear();
    let report = Report::new(results, extras, &arguments(), settings);
    write(&report, way)
}

/// Writes the page of another experiment, and its data.
pub(crate) fn of_study(name: &str, found: Found, way: Way<'_>) -> Result<(), Failure> {
    write(&Report::of_study(name, found, &arguments()), way)
}

/// Writes page and data. The tables are out by then: a page that cannot be written costs the page only.
fn write(report: &Report, way: Way<'_>) -> Result<(), Failure> {
    let written = Output::open(Path::new(PAGE)).map_err(report::ReportError::from);
    let written = written.and_then(|page| {
        report::write(report, &page)?;
        let data = format!("target/taut/{}.report.json", report.name());
        Ok(files::write_json(Path::new(&data), report)?)
    });
    match written {
        Err(e) => files::complain(&e.to_string()),
        Ok(()) if way.is_rows_alone => {}
        Ok(()) => way.console.note(&format!("report written to {PAGE}"))?,
    }
    Ok(())
}
