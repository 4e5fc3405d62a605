//! The study of estimates: its options, settings, tables and plot.

use super::{Config, FACTOR, FINE, LEAST, Results, score};
use crate::cases::Cases;
use crate::options::Quick;
use crate::study::{self, Found, Study, data};
use clap::{Args, FromArgMatches};
use std::fmt::Write;
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, Plan, error, positive};
use taut_output::settings::{counts, seconds, set};
use taut_output::sheet::{self, Sheet, Show, column};

/// `taut study estimate`.
pub(crate) const STUDY: Study = Study {
    name: "estimate",
    title: "estimates of the load's error",
    about: "The estimate of the load's error against the error, and what it costs",
    examples: &["--quick"],
    mark: ("estimates", "of_error"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    #[command(flatten)]
    quick: Quick,
}

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let config = options.quick.of(Config::quick);
    let results = super::run(&config, cases)?;
    let rows = data(&results)?;
    let (verdict, missed) = verdict(&results, &config);
    Ok(Found {
        settings: set([
            (
                "companions",
                format!("{} steps a step", counts(&config.every)),
            ),
            ("references", format!("{FINE} sub-steps")),
            ("simulated", seconds(config.time)),
        ]),
        text: format!("{}\n{verdict}", study::tables(SHEETS, &rows)),
        rows,
        missed,
        ..Found::default()
    })
}

/// How many estimates are right, and what the companion of two steps misses.
fn verdict(results: &Results, config: &Config) -> (String, Option<String>) {
    let mut text = String::new();
    let mut missed = None;
    for &every in &config.every {
        let (all, right, least) = score(&results.estimates, every);
        let part = 100.0 * right as f64 / all.max(1) as f64;
        let _ = writeln!(
            text,
            "companion of {every} steps: {right} of {all} estimates ({part:.0} %) within a factor {FACTOR} of the error, the least {least:.2} of it"
        );
        if every == config.every[0] && (part < 90.0 || least < LEAST) {
            missed = Some(format!(
                "{part:.0} % of the estimates are right, the least is {least:.2} of its error"
            ));
        }
    }
    (text, missed)
}

const SHEETS: &[Sheet] = &[
    Sheet {
        list: "estimates",
        columns: &[
            column("scene", "scene"),
            column("every", "k"),
            column("extent_mm", "moves")
                .unit("mm")
                .shown(Show::Error(1)),
            column("error_mm", "error").unit("mm").shown(Show::Error(1)),
            column("estimate_mm", "estimate")
                .unit("mm")
                .shown(Show::Error(1)),
            column("of_error", "of it").shown(Show::Fixed(2)),
            column("parted", "parted"),
            column("segments_error_mm", "segments")
                .unit("mm")
                .shown(Show::Error(0)),
            column("segments_mm", "shape")
                .unit("mm")
                .shown(Show::Error(0)),
            column("algebra_mm", "algebra")
                .unit("mm")
                .shown(Show::Error(0)),
        ],
        ..sheet::PLAIN
    },
    Sheet {
        list: "costs",
        columns: &[
            column("scene", "scene"),
            column("every", "k"),
            column("cost", "time over that without").shown(Show::Fixed(2)),
        ],
        ..sheet::PLAIN
    },
];

const PLOTS: &[Plan] = &[Plan {
    id: "estimates",
    title: "Estimates against errors",
    text: "The largest estimate of a run against its largest error: on the diagonal they are the same.",
    list: "estimates",
    series: &["every"],
    x: positive(&["error_mm"], "error of the load (mm)", 1.0),
    y: error(&["estimate_mm"], "estimate (mm)"),
    ..PLAIN
}];
