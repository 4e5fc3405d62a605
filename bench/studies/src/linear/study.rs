//! The study of forward errors: its options, settings and plots.

use super::table::{SHEETS, bars};
use super::{Config, patient, verdicts};
use crate::cases::Cases;
use crate::options::{Backends, Quick, Ratios, Segments, choice};
use crate::study::{self, Found, Study, data, tables};
use clap::{Args, FromArgMatches};
use taut_output::check::ExperimentError;
use taut_output::notation::number;
use taut_output::plan::{PLAIN, Plan, error, positive};
use taut_output::settings::{Setting, counts, list, numbers, set, solvers, step};
use taut_output::table::{MARK, omissions};

/// `taut study linear`.
pub(crate) const STUDY: Study = Study {
    name: "linear",
    title: "errors of the multipliers against mass ratio",
    about: "Forward errors of the multipliers with 0, 1 and 2 refinements, mass ratios 1 to 10¹²",
    examples: &["--segments 24"],
    mark: ("", "pose"),
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
    backends: Backends,
    #[command(flatten)]
    quick: Quick,
}

const LEGEND: &str = "\
Each cell: relative errors of the multipliers against extended precision, ∞-norm, with 0, 1, 2 refinements, compared by
the last. Iterative solvers start from zero, and each of their solves has at most 1000 iterations, unless they name
their own, to 1e-12";

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = options.quick.of(Config::quick);
    options.segments.replace(&mut config.segments);
    options.ratios.replace(&mut config.ratios)?;
    let named = &options.backends.backends;
    if !named.is_empty() {
        config.choices.clear();
        for name in named {
            let choice = choice(name)?;
            let choice = if name.contains("iterations=") {
                choice
            } else {
                patient(&choice)
            };
            if !config.choices.contains(&choice) {
                config.choices.push(choice);
            }
        }
    }
    let records = super::run(&config, cases)?;
    let rows = data(&records)?;
    let text = format!(
        "hoist: strain of at most {} (steel, made stiffer with the load), Δt = 1/{:.0} s, {}\n\
         {LEGEND}\n{MARK}\n{}{}{}",
        config.max_strain,
        1.0 / config.step.dt,
        config.step.scheme,
        tables(SHEETS, &rows),
        bars(&verdicts(&records)),
        omissions(&config.omissions())
    );
    Ok(Found {
        settings: settings(&config),
        text,
        rows,
        omissions: config.omissions(),
        ..Found::default()
    })
}

fn settings(config: &Config) -> Vec<Setting> {
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("poses", list(&config.poses, ToString::to_string)),
        ("solvers", solvers(&config.choices)),
        ("refinements", counts(&config.refinements)),
        ("largest strain", number(config.max_strain)),
        ("scheme", config.step.scheme.to_string()),
        ("Δt", step(config.step.dt)),
    ])
}

const PLOTS: &[Plan] = &[Plan {
    id: "mass-ratios",
    title: "Error against mass ratio",
    text: "What forming S loses, about roundoff × mass ratio, refinement from the pieces brings back.",
    panels: &["pose", "segments", "refinements"],
    x: positive(&["mass_ratio"], "load/segment mass ratio (1)", 1.0),
    y: error(&["forward_error"], "relative error of the multipliers (1)"),
    ..PLAIN
}];
