//! The study of whole engines: its options, settings and plots.

use super::Config;
use super::table::{SHEETS, text};
use crate::cases::Cases;
use crate::options::{Quick, Ratios, Segments, Time};
use crate::study::{self, Found, Study, data};
use clap::{Args, FromArgMatches};
use taut_ground::engine::motion::FRAME;
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, PRECISION, Plan, error, positive};
use taut_output::plot::Mark;
use taut_output::settings::{Setting, counts, numbers, seconds, set, step};

/// `taut study engines`.
pub(crate) const STUDY: Study = Study {
    name: "engines",
    title: "whole engines",
    about: "Whole engines on the hoist and on the ground: what a frame costs, how wrong the motion is; with the feature \
            `rapier` Rapier's too",
    details: "`--segments`, `--ratios` and `--time` are those of the hoist; the scenes on the ground are always the same.",
    examples: &["--quick --segments 4 --ratios 10"],
    mark: ("records", "over_ours"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    #[command(flatten)]
    segments: Segments,
    #[command(flatten)]
    ratios: Ratios,
    #[command(flatten)]
    time: Time,
    #[command(flatten)]
    quick: Quick,
}

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = options.quick.of(Config::quick);
    options.segments.replace(&mut config.segments);
    options.ratios.replace(&mut config.ratios)?;
    options.time.replace(
        &mut config.time,
        FRAME,
        1,
        "it must be at least one frame of 1/60 s",
    )?;
    let results = super::run(&config, cases)?;
    let rows = data(&results)?;
    Ok(Found {
        settings: settings(&config),
        text: text(&rows, &results, &config),
        rows,
        ..Found::default()
    })
}

fn settings(config: &Config) -> Vec<Setting> {
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("swing from", format!("{} rad", config.angle)),
        ("frame", step(FRAME)),
        ("simulated", seconds(config.time)),
        ("error within", format!("{} of the length", config.bar)),
        ("ratios on the ground", numbers(&config.ground)),
    ])
}

const PLOTS: &[Plan] = &[Plan {
    id: PRECISION,
    title: "Work against precision",
    text: "What a frame costs against the largest error of the swinging load. Lower left is better.",
    list: "records",
    panels: &["segments", "mass_ratio"],
    series: &["engine"],
    x: error(&["load_error"], "error of the load over the length (1)"),
    y: positive(&["frame_ns_min"], "a frame (µs)", 1e-3),
    mark: Mark::Points,
    ..PLAIN
}];
