//! The study of the hard cases: its options, and the cases that it runs.

use super::{Case, cases, named};
use crate::checks::{self, Catalogue, Experiment};
use crate::study::{self, Found, Reporter, Study};
use clap::{Args, FromArgMatches};
use taut_output::check::ExperimentError;

/// `taut hard`.
pub(crate) const STUDY: Study = Study {
    name: "hard",
    title: "hard cases with known answers",
    about: "Hard cases with known answers, or a known absence of one: reference, ours, error, bar, verdict",
    examples: &["H42 --json hard.json"],
    writes: "all checks",
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter),
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    /// Cases by name, such as H42 (default: all)
    #[arg(value_name = "CASE", value_parser = named)]
    cases: Vec<Case>,
    /// A short form, some seconds altogether
    #[arg(long)]
    quick: bool,
}

const LEGEND: &str = "\
pass, FAIL: our own bar on our error; limit: where something of ours ends, and says so. Numbers at the end of a row:
the notes below the table that it needs";

fn run(options: &Options, reporter: &mut Reporter<'_>) -> Result<Found, ExperimentError> {
    let mut experiments: Vec<Experiment> = options.cases.iter().map(Case::experiment).collect();
    if experiments.is_empty() {
        experiments.extend(cases().map(|case| case.experiment()));
    }
    let catalogue = Catalogue {
        legend: LEGEND,
        reference: "reference",
        experiments,
        quick: options.quick,
    };
    checks::run(&catalogue, reporter, &|_, _| Ok(()))
}
