//! `taut hard`: the hard cases, reference beside ours.

use super::checks::{self, Catalogue, Experiment};
use super::console::Console;
use crate::Failure;
use clap::Args;
use std::path::PathBuf;
use taut_output::check::Outcome;
use taut_studies::hard::{self, Case};

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

/// Runs the cases, prints their tables. Code 1 where a bar of our own is missed.
pub(crate) fn run(args: &HardArgs, console: Console) -> Result<(), Failure> {
    let whole = args.cases.is_empty();
    let cases: Vec<Case> = if whole {
        hard::cases().collect()
    } else {
        args.cases.clone()
    };
    let experiment = |case: Case| Experiment {
        name: case.name,
        title: case.title,
        run: Box::new(move |quick, bar| case.outcome(quick, bar)),
    };
    let mut experiments: Vec<Experiment<'_>> = cases.into_iter().map(experiment).collect();
    if whole {
        experiments.push(Experiment {
            name: "later",
            title: "cases whose scenes cannot be built yet",
            run: Box::new(|_, _| {
                Ok(Outcome {
                    checks: hard::not_yet(),
                    ..Outcome::default()
                })
            }),
        });
    }
    let catalogue = Catalogue {
        name: "hard",
        legend: LEGEND,
        reference: "reference",
        experiments,
        quick: args.quick,
        json: args.json.as_deref(),
    };
    checks::run(&catalogue, console, &|_, _| Ok(()))
}
