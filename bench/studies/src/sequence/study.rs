//! The study of sequences: its options, tables and plots.

use super::{Config, run};
use crate::cases::Cases;
use crate::options::{Backends, Iterations};
use crate::study::{self, Found, Study, data, tables};
use clap::{Args, FromArgMatches};
use std::path::PathBuf;
use taut_ground::matrix::sequence::{self, INDEX};
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, PRECISION, Plan, error, linear, positive};
use taut_output::plot::Mark;
use taut_output::row::{has_ended, has_no_error, iterations};
use taut_output::settings::{counts, set, solvers};
use taut_output::sheet::{self, Sheet, Show, column};
use taut_output::table::{MARK, omissions};

/// `taut study sequence`.
pub(crate) const STUDY: Study = Study {
    name: "sequence",
    title: "sequences of systems",
    about: "Systems of consecutive steps from a folder: one analysis, refactorisation, warm start",
    details: "The folder is one that `taut dump SCENE --steps A..B --out DIR` wrote: sequence.csv has a line a step with its number, its time and the number N of its pattern; FORM_N.mtx, of the forms schur and kkt, is the matrix of the first step of a pattern; FORM_N_values.mtx, FORM_N_rhs.mtx and FORM_N_exact.mtx are arrays with a column a step: the values of all entries in the order of FORM_N.mtx, right-hand sides, and exact solutions, which the study finds itself where they are not there.",
    examples: &["target/sequence --backends banded,cg:group,umfpack/kkt"],
    mark: ("records", "solve_ns_by_step"),
    options: Options::augment_args,
    reads: |matches| {
        let folder = matches.get_one::<PathBuf>("folder");
        folder
            .map(|folder| folder.join(INDEX))
            .into_iter()
            .collect()
    },
    run: |matches, reporter| perform(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    /// Folder of the sequence
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    backends: Backends,
    #[command(flatten)]
    iterations: Iterations,
}

const LEGEND: &str = "\
iter: mean of a step, of the limit; analyse: the pattern, once; factorise, solve: medians of the steps; longest: both in
the longest step; claims: steps whose solver claims a solution; compon.: componentwise backward error; error: relative
error of x in the largest norm; errors are the largest of all steps";

fn perform(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = Config {
        named: !options.backends.backends.is_empty(),
        ..Config::default()
    };
    options.backends.refuse_limits()?;
    options.backends.replace(&mut config.choices)?;
    options.iterations.replace(&mut config.iterations)?;
    let mut sequence = sequence::read(&options.folder)?;
    let results = run(&mut sequence, &config, cases)?;
    let rows = data(&results)?;
    let (steps, patterns) = (sequence.len(), sequence.stretches.len());
    let text = format!(
        "{}: {steps} systems, patterns: {patterns}\n{LEGEND}\n{MARK}\n{}{}",
        options.folder.display(),
        tables(SHEETS, &rows),
        omissions(&results.omissions)
    );
    Ok(Found {
        settings: set([
            ("sequence", options.folder.display().to_string()),
            ("systems", steps.to_string()),
            ("patterns", patterns.to_string()),
            ("solvers", solvers(&config.choices)),
            ("iterations", counts(&config.iterations)),
        ]),
        text,
        rows,
        omissions: results.omissions,
        ..Found::default()
    })
}

const SHEETS: &[Sheet] = &[Sheet {
    list: "records",
    columns: &[
        column("backend", "solver"),
        column("iterations", "iter").shown(Show::Row(iterations)),
        sheet::time("analyze_ns", "analyse"),
        sheet::time("factorize_ns", "factorise"),
        sheet::time("solve_ns", "solve"),
        sheet::time("longest_ns", "longest"),
        column("claimed", "claims"),
        sheet::error("backward_error_componentwise", "compon."),
        sheet::error("forward_error", "error"),
        column("worst_step", "in step"),
    ],
    counts: |row| has_no_error(row) && has_ended(row),
    ..sheet::PLAIN
}];

/// A plot of the steps, a panel for each limit of iterations.
const BY_STEP: Plan = Plan {
    list: "records",
    panels: &["iterations"],
    x: linear(&[], "steps of the sequence (1)", 1.0),
    mark: Mark::Line,
    ..PLAIN
};

const PLOTS: &[Plan] = &[
    Plan {
        id: PRECISION,
        title: "Work against precision",
        text: "Factorisation and solve, medians, against the largest error of the steps. Along a curve: iterations. Lower left \
               is better.",
        list: "records",
        x: error(&["forward_error"], "relative error of x (1)"),
        y: positive(
            &["factorize_ns", "solve_ns"],
            "factorise and solve (µs)",
            1e-3,
        ),
        ..PLAIN
    },
    Plan {
        id: "error-by-step",
        title: "Error by step",
        text: "Relative error of x in the largest norm.",
        y: error(&["forward_error_by_step"], "relative error of x (1)"),
        ..BY_STEP
    },
    Plan {
        id: "factorise-by-step",
        title: "Factorisation by step",
        text: "Refactorisation with the analysis of the first step; the least of the passes.",
        y: positive(&["factorize_ns_by_step"], "factorise (µs)", 1e-3),
        ..BY_STEP
    },
    Plan {
        id: "solve-by-step",
        title: "Solve by step",
        text: "Iterations start from the solution of the step before.",
        y: positive(&["solve_ns_by_step"], "solve (µs)", 1e-3),
        ..BY_STEP
    },
];
