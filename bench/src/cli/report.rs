//! `taut report`: the page of a report or of rows that were written before.

use super::console::Console;
use crate::Failure;
use clap::Args;
use std::path::{Path, PathBuf};
use taut_bench::ladder::{Config, Results};
use taut_bench::output;
use taut_bench::report::{self, Report};

/// What `--help` says below the options.
pub(crate) const AFTER_HELP: &str = "\
Examples:
  taut report target/taut/report.json
  taut bench --json rows.json && taut report rows.json --out rows.html";

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// A `report.json`, or the rows of `taut bench --json`, of which the page then holds nothing else
    #[arg(value_name = "FROM.json")]
    from: PathBuf,
    /// The page
    #[arg(long, value_name = "PATH", default_value = PAGE)]
    out: PathBuf,
}

/// Where the page and its data go.
const PAGE: &str = "target/taut/report.html";
const DATA: &str = "target/taut/report.json";

/// Reads the file, writes the page.
pub(crate) fn run(args: &ReportArgs, console: Console) -> Result<(), Failure> {
    let report = report::read(&args.from)?;
    report::write(&report, &args.out)?;
    if args.out != Path::new("-") {
        console.note(&format!("report written to {}", args.out.display()))?;
    }
    Ok(())
}

/// Measures what the rows do not hold and writes the page with its data; a note of where it is, unless standard output is
/// for the rows only.
pub(crate) fn of_main_job(
    config: &Config,
    results: &Results,
    quick: bool,
    console: Console,
    only_json: bool,
) -> Result<(), Failure> {
    let bar = console.progress(0);
    let extras = report::measure(&config.choices, quick, &bar)?;
    bar.finish_and_clear();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let command = match arguments.join(" ") {
        text if text.is_empty() => "taut bench".to_owned(),
        text => format!("taut {text}"),
    };
    let hoist = config.scene.resolve()?;
    let settings = [
        ("scene", "hoist".to_owned()),
        ("length", format!("{} m", config.scene.length)),
        ("segments of", format!("{} kg", hoist.segment_mass)),
        ("YA", format!("{:.3e} N", hoist.stiffness.ea)),
        ("Δt", format!("1/{:.0} s", 1.0 / config.dt)),
        ("simulated", format!("{} s", config.time)),
        ("anchor moved", format!("{} m", config.scene.move_x)),
    ];
    let settings = settings.map(|(name, value)| (name.to_owned(), value));
    let report = Report::new(results, extras, command, settings.to_vec());
    // The tables are out: a page that cannot be written costs the page only.
    let written = report::write(&report, Path::new(PAGE))
        .and_then(|()| Ok(output::write_json(Path::new(DATA), &report)?));
    match written {
        Err(e) => eprintln!("taut: {e}"),
        Ok(()) if only_json => {}
        Ok(()) => console.note(&format!("report written to {PAGE}"))?,
    }
    Ok(())
}
