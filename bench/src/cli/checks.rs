//! What `taut hard` and `taut paper` share: experiments that end in checks are run, told, written, counted, judged.

use super::console::Console;
use super::deliver::{self, Way};
use crate::Failure;
use indicatif::ProgressBar;
use serde::Serialize;
use std::collections::HashSet;
use std::fmt::Write;
use std::path::Path;
use taut_bench::machine::Machine;
use taut_ground::files::{self, Output};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};
use taut_output::table;
use taut_studies::study::{Found, data};

/// An experiment that ends in checks.
pub(crate) struct Experiment<'a> {
    pub(crate) name: &'static str,
    pub(crate) title: &'static str,
    /// Runs it, whole or quick.
    pub(crate) run: Box<Run<'a>>,
}

type Run<'a> = dyn Fn(bool, &ProgressBar) -> Result<Outcome, ExperimentError> + 'a;

/// Experiments that are told together.
pub(crate) struct Catalogue<'a> {
    /// Its name, and that of its files.
    pub(crate) name: &'static str,
    /// What the columns of its checks are, and what ours is compared with.
    pub(crate) legend: &'static str,
    pub(crate) reference: &'static str,
    pub(crate) experiments: Vec<Experiment<'a>>,
    pub(crate) quick: bool,
    pub(crate) json: Option<&'a Path>,
}

/// A check as it is written.
#[derive(Serialize)]
struct Row {
    experiment: &'static str,
    title: &'static str,
    #[serde(flatten)]
    check: Check,
}

/// What an experiment that could not be run to its end comes to.
fn failed(e: &ExperimentError) -> Outcome {
    let ended = Check::claim(
        "the case itself",
        "runs to its end",
        "an error".to_owned(),
        Verdict::Fail,
        e.to_string(),
    );
    Outcome {
        checks: vec![ended],
        ..Outcome::default()
    }
}

/// Runs the experiments, each once, prints their tables, gives each outcome to `write`, writes rows and page. Code 1 where
/// a bar of our own is missed.
pub(crate) fn run(
    study: &Catalogue<'_>,
    console: Console,
    write: &dyn Fn(&Experiment<'_>, &Outcome) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let [json] = files::open([("--json", study.json)], &[])?;
    let way = Way {
        console,
        json: json.as_ref(),
        is_rows_alone: json.as_ref().is_some_and(Output::is_stdout),
    };
    let mut text = String::new();
    let mut tell = |part: String| {
        text.push_str(&part);
        text.push('\n');
        if way.is_rows_alone {
            return Ok(());
        }
        files::print(&part)
    };
    tell(format!("{}\n{}\n", Machine::current(), study.legend))?;
    let mut seen = HashSet::new();
    let mut rows: Vec<Row> = Vec::new();
    for experiment in &study.experiments {
        let (name, title) = (experiment.name, experiment.title);
        if !seen.insert(name) {
            continue;
        }
        let bar = console.progress(0).with_message(name);
        // The others are still told.
        let outcome = (experiment.run)(study.quick, &bar).unwrap_or_else(|e| failed(&e));
        bar.finish_and_clear();
        write(experiment, &outcome)?;
        let shown = table::checks(&outcome, study.reference);
        tell(format!("\n{name}: {title}\n{shown}"))?;
        rows.extend(outcome.checks.into_iter().map(|check| Row {
            experiment: name,
            title,
            check,
        }));
    }
    tell(summary(&rows))?;
    let count = rows.len();
    let failed = rows.iter().filter(|r| r.check.verdict == Verdict::Fail);
    let failed = failed.count();
    deliver::write(study.name, &rows, way)?;
    let found = Found {
        settings: vec![("quick".to_owned(), study.quick.to_string())],
        text,
        rows: data(&rows).map_err(|e| Failure::Input(e.to_string()))?,
        omissions: Vec::new(),
    };
    super::report::of_study(study.name, found, way)?;
    if failed == 0 {
        return Ok(());
    }
    Err(Failure::Check(format!(
        "{failed} of {count} checks miss their bar"
    )))
}

/// How many checks came to what.
fn summary(rows: &[Row]) -> String {
    let mut out = format!("\n{} checks:", rows.len());
    for verdict in Verdict::ALL {
        let own = || rows.iter().filter(|r| r.check.verdict == verdict);
        let count = own().count();
        if count > 0 {
            let _ = write!(out, " {count} {verdict}");
            let beyond = own().filter(|r| r.check.is_beyond()).count();
            if verdict == Verdict::Limit && beyond > 0 {
                let _ = write!(out, " ({beyond} beyond the catalogue's bar)");
            }
            out.push(',');
        }
    }
    out.trim_end_matches(',').to_owned()
}
