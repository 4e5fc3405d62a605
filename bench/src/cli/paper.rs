//! `taut paper`: the paper's tables, figures and claims, ours beside theirs.

use super::checks::{self, Catalogue};
use super::console::Console;
use crate::Failure;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use taut_bench::machine::Machine;
use taut_ground::files;
use taut_output::check::{self, Check};
use taut_studies::paper::Experiment;

#[derive(Debug, Args)]
pub(crate) struct PaperArgs {
    /// What to reproduce: table1, fig2, fig3, fig4, fig5, fig10, fig11, fig12, table2, fig13, fig16, claims (default: all)
    #[arg(value_name = "NAME", value_parser = experiment)]
    names: Vec<Experiment>,
    /// A short form, some seconds altogether
    #[arg(long)]
    quick: bool,
    /// Folder for the CSV, JSON and SVG files
    #[arg(long, value_name = "DIR", default_value = "target/taut/paper")]
    out: PathBuf,
    /// Writes all checks to a file as well (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
}

fn experiment(name: &str) -> Result<Experiment, String> {
    let found = Experiment::ALL.into_iter().find(|e| e.name() == name);
    let names = || Experiment::ALL.map(Experiment::name).join(", ");
    found.ok_or_else(|| format!("choose one of {}; the other figures are drawings", names()))
}

/// What the columns of the checks are.
const LEGEND: &str = "\
pass, FAIL: our own bar on our error; limit: where something of ours ends; holds, holds only if, does not hold: what
the paper says, in our measurement. Numbers at the end of a row: the notes below the table that it needs";

/// What `NAME.json` holds.
#[derive(Serialize)]
struct Record<'a> {
    experiment: &'static str,
    title: &'static str,
    machine: String,
    quick: bool,
    checks: &'a [Check],
}

/// Runs the experiments, prints their tables, writes their files. Code 1 where a bar of our own is missed.
pub(crate) fn run(args: &PaperArgs, console: Console) -> Result<(), Failure> {
    let names = if args.names.is_empty() {
        &Experiment::ALL[..]
    } else {
        &args.names
    };
    // Before minutes of work, not after them.
    files::make_folder(&args.out)?;
    let experiment = |e: &Experiment| {
        let e = *e;
        checks::Experiment {
            name: e.name(),
            title: e.title(),
            run: Box::new(move |quick, bar| e.run(quick, bar)),
        }
    };
    let catalogue = Catalogue {
        name: "paper",
        legend: LEGEND,
        reference: "paper, theory",
        experiments: names.iter().map(experiment).collect(),
        quick: args.quick,
        json: args.json.as_deref(),
    };
    let machine = Machine::current().to_string();
    checks::run(&catalogue, console, &|experiment, outcome| {
        let file = |end: &str| args.out.join(format!("{}{end}", experiment.name));
        files::write_text(&file(".csv"), &outcome.csv)?;
        for (ending, rows) in &outcome.more_csv {
            files::write_text(&file(&format!("-{ending}.csv")), rows)?;
        }
        let record = Record {
            experiment: experiment.name,
            title: experiment.title,
            machine: machine.clone(),
            quick: args.quick,
            checks: &outcome.checks,
        };
        files::write_json(&file(".json"), &record)?;
        if let Some(picture) = check::picture(outcome)? {
            files::write_text(&file(".svg"), &picture)?;
        }
        Ok(())
    })
}
