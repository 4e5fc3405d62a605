//! `taut hard`: the hard cases, reference beside ours.

use super::checks;
use super::console::Console;
use crate::Failure;
use clap::Args;
use std::collections::HashSet;
use std::path::PathBuf;
use taut_bench::check::{Check, ExperimentError, Outcome, Verdict};
use taut_bench::hard::{self, Case};
use taut_bench::machine::Machine;
use taut_bench::output::{self, Output};
use taut_bench::table;

#[derive(Debug, Args)]
pub(crate) struct HardArgs {
    /// Cases by name, such as H42 (default: all)
    #[arg(value_name = "CASE", value_parser = hard::named)]
    cases: Vec<Case>,
    /// A short form, some seconds altogether
    #[arg(long)]
    quick: bool,
    /// Writes all checks to a file as well (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
}

/// What the columns of the checks are.
const LEGEND: &str = "\
pass, FAIL: our own bar on our error; limit: where something of ours ends, and says so. Numbers at the end of a row:
the notes below the table that it needs";

/// What a case that could not be run to its end comes to.
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

/// Runs the cases, prints their tables. Code 1 where a bar of our own is missed.
pub(crate) fn run(args: &HardArgs, console: Console) -> Result<(), Failure> {
    let [json] = output::open([("--json", args.json.as_deref())], &[])?;
    let only_json = json.as_ref().is_some_and(Output::is_stdout);
    let mut cases = if args.cases.is_empty() {
        hard::cases().collect()
    } else {
        args.cases.clone()
    };
    let mut seen = HashSet::new();
    cases.retain(|case| seen.insert(case.name));
    if !only_json {
        output::print(&format!("{}\n{LEGEND}\n", Machine::current()))?;
    }
    let whole = args.cases.is_empty();
    let mut all = Vec::new();
    for case in cases {
        let bar = console.progress(0).with_message(case.name);
        // The others are still told.
        let outcome = case
            .outcome(args.quick, &bar)
            .unwrap_or_else(|e| failed(&e));
        bar.finish_and_clear();
        if !only_json {
            output::print(&format!(
                "\n{}: {}\n{}",
                case.name,
                case.title,
                table::checks(&outcome, "reference")
            ))?;
        }
        all.extend(outcome.checks);
    }
    if whole {
        let missing = Outcome {
            checks: hard::not_yet(),
            ..Outcome::default()
        };
        if !only_json {
            let rows = table::checks(&missing, "reference");
            output::print(&format!("\nNot yet\n{rows}"))?;
        }
        all.extend(missing.checks);
    }
    if !only_json {
        output::print(&checks::summary(&all))?;
    }
    if let Some(json) = json {
        json.json(&all)?;
    }
    checks::judge(&all)
}
