//! The study of shocks: its options, settings and plots.

use super::Config;
use super::table::{SHEETS, text};
use crate::cases::Cases;
use crate::options::{Quick, Ratios, Time};
use crate::study::{self, Found, Study, data};
use clap::{Args, FromArgMatches};
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, Plan, error, positive};
use taut_output::settings::{self, counts, list, numbers, seconds, set, step};

/// `taut study shocks`.
pub(crate) const STUDY: Study = Study {
    name: "shocks",
    title: "kicks, jerks and drops",
    about: "Kicks, jerks and drops: what survives them, how well, at what cost",
    examples: &["--quick --ratios 100 --time 1"],
    mark: ("outcomes", "excess_gap"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    #[command(flatten)]
    ratios: Ratios,
    #[command(flatten)]
    time: Time,
    #[command(flatten)]
    quick: Quick,
}

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = options.quick.of(Config::quick);
    options.ratios.replace(&mut config.ratios)?;
    options.time.replace(
        &mut config.time,
        1.0 / 60.0,
        60,
        "the shocks need at least 1 s",
    )?;
    let results = super::run(&config, cases)?;
    Ok(Found {
        settings: set_to(&config),
        text: text(&results),
        rows: data(&results)?,
        ..Found::default()
    })
}

fn set_to(config: &Config) -> Vec<settings::Setting> {
    set([
        ("shocks", list(&config.shocks, ToString::to_string)),
        ("steps", list(&config.settings, |s| s.name.clone())),
        ("load/segment", numbers(&config.ratios)),
        ("lengths", format!("{} m", numbers(&config.lengths))),
        ("Δt", step(1.0 / 60.0)),
        ("simulated", seconds(config.time)),
        (
            "references",
            format!("{} steps a frame", counts(&config.fineness)),
        ),
        ("timed", format!("{} times", config.repeats)),
    ])
}

const PLOTS: &[Plan] = &[Plan {
    id: "errors",
    title: "Error after a shock",
    text: "Where the load is at the end, against a finer step. A run that was lost is not shown; the motion \
                   after some shocks is chaotic.",
    list: "outcomes",
    only: &[("finite", &["yes"])],
    panels: &["shock", "length"],
    series: &["setting"],
    x: positive(&["ratio"], "load/segment mass ratio (1)", 1.0),
    y: error(&["error_m"], "distance of the load from the reference (m)"),
    ..PLAIN
}];
