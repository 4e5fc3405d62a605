//! The study of the paper: its options, the experiments that it runs, the files that each writes.

use super::{experiments, named};
use crate::checks::{self, Catalogue, Experiment};
use crate::question;
use crate::study::{self, Found, Reporter, Study};
use clap::{Args, FromArgMatches};
use serde_json::json;
use std::path::PathBuf;
use taut_measure::files;
use taut_output::check::{self, ExperimentError, Outcome};

pub(crate) const STUDY: Study = Study {
    name: "paper",
    question: question!("paper", &[]),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter),
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    /// What to reproduce: table1, fig2, fig3, fig4, fig5, fig9, fig10, fig11, fig12, table2, fig13, fig14, fig15, fig16, claims (default: all)
    #[arg(value_name = "NAME", value_parser = named)]
    names: Vec<Experiment>,
    /// A short form, some seconds altogether
    #[arg(long)]
    quick: bool,
    /// Folder for the CSV, JSON, SVG and PNG files
    #[arg(long, value_name = "DIR", default_value = "target/taut/paper")]
    out: PathBuf,
}

fn run(options: &Options, reporter: &mut Reporter<'_>) -> Result<Found, ExperimentError> {
    // Before minutes of work, not after them.
    files::make_folder(&options.out)?;
    let mut chosen = options.names.clone();
    if chosen.is_empty() {
        chosen.extend(experiments());
    }
    let catalogue = Catalogue {
        legend: STUDY.question().legend,
        reference: "paper, theory",
        experiments: chosen,
        quick: options.quick,
    };
    let machine = reporter.machine.clone();
    checks::run(&catalogue, reporter, &|experiment, outcome| {
        write(options, &machine, experiment, outcome)
    })
}

/// Writes the rows, checks, charts and pictures of an experiment.
fn write(
    options: &Options,
    machine: &str,
    experiment: &Experiment,
    outcome: &Outcome,
) -> Result<(), ExperimentError> {
    let file = |end: &str| options.out.join(format!("{}{end}", experiment.name));
    if !outcome.csv.is_empty() {
        files::write_text(&file(".csv"), &outcome.csv)?;
    }
    for (ending, rows) in &outcome.more_csv {
        files::write_text(&file(&format!("-{ending}.csv")), rows)?;
    }
    let record = json!({
        "experiment": experiment.name,
        "title": experiment.title,
        "machine": machine,
        "quick": options.quick,
        "checks": outcome.checks,
    });
    files::write_json(&file(".json"), &record)?;
    for (ending, picture) in &outcome.pictures {
        files::write_bytes(&file(&format!("-{ending}.png")), picture)?;
    }
    if let Some(picture) = check::picture(outcome)? {
        files::write_text(&file(".svg"), &picture)?;
    }
    Ok(())
}
