//! The stability map as a study: its options, settings and plots.

use super::Config;
use super::tables::{SHEETS, text_tables};
use crate::cases::Cases;
use crate::options::{Quick, Time};
use crate::study::{self, Found, Study, data};
use clap::{Args, FromArgMatches};
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, Plan, positive, texts};
use taut_output::settings::{Setting, counts, distinct, numbers, seconds, set, step};

/// `taut study stability`.
pub(crate) const STUDY: Study = Study {
    name: "stability",
    title: "largest stable mass ratios",
    about: "Largest stable mass ratio of schemes, stiffness, joints, segments and materials",
    examples: &["--quick"],
    mark: ("", "stable_to"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    #[command(flatten)]
    time: Time,
    #[command(flatten)]
    quick: Quick,
}

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = options.quick.of(Config::quick);
    let needs = "it must be at least one step";
    options
        .time
        .replace(&mut config.time, config.dt, 1, needs)?;
    let records = super::run(&config, cases)?;
    let rows = data(&records)?;
    Ok(Found {
        settings: settings(&config),
        text: text_tables(&rows, &config),
        rows,
        ..Found::default()
    })
}

fn settings(config: &Config) -> Vec<Setting> {
    let segments = distinct(config.cases.iter().map(|c| c.segments));
    set([
        ("cells", config.cases.len().to_string()),
        ("segments", counts(&segments)),
        ("load/segment", numbers(&config.ratios)),
        ("Δt", step(config.dt)),
        ("simulated", seconds(config.time)),
    ])
}

const PLOTS: &[Plan] = &[
    Plan {
        id: "largest",
        title: "Largest stable mass ratio",
        text: "Up to which every ratio of the grid is stable, each run by itself, against the weight α of \
                       the geometric stiffness, a panel for each cable, number of segments and \
                       joint; without the guard. Where a point is missing not even the smallest ratio is stable; the \
                       highest points are where the grid ends. Those of the schemes stand beside each other.",
        panels: &["cable", "segments", "joint"],
        series: &["scheme"],
        x: texts(&["stiffness"], "geometric stiffness α (1)"),
        y: positive(&["stable_to"], "load/segment mass ratio (1)", 1.0),
        as_first: &["guarded", "planar"],
        least_places: 2,
        ..PLAIN
    },
    Plan {
        id: "segments",
        title: "Against the number of segments",
        text: "The same against the number of segments, without geometric stiffness and with the weights 0.4 \
                       and 0.5.",
        panels: &["cable", "joint"],
        series: &["scheme", "stiffness"],
        x: positive(&["segments"], "segments (1)", 1.0),
        y: positive(&["stable_to"], "load/segment mass ratio (1)", 1.0),
        only: &[("stiffness", &["off", "0.4", "0.5"])],
        as_first: &["guarded", "planar"],
        least_places: 2,
        ..PLAIN
    },
];
