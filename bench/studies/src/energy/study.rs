//! The study of energy over time: its options, settings and plots.

use super::table::{SHEETS, text_tables};
use super::{Config, Setting};
use crate::cases::Cases;
use crate::options::Quick;
use crate::study::{self, Found, Study, data};
use clap::{Args, FromArgMatches};
use taut_output::check::ExperimentError;
use taut_output::notation::number;
use taut_output::plan::{PLAIN, Plan, error, linear, positive};
use taut_output::plot::Mark;
use taut_output::settings::{self, list, numbers, seconds, set, step};

/// `taut study energy`.
pub(crate) const STUDY: Study = Study {
    name: "energy",
    title: "amplitude, energy and angular momentum over time",
    about: "Swing amplitude over a minute, energy over a million steps, angular momentum of a free cable",
    examples: &["--quick"],
    mark: ("bands", "first_band"),
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
    Ok(Found {
        settings: set_to(&config),
        text: text_tables(&rows, &config),
        rows,
        ..Found::default()
    })
}

fn set_to(config: &Config) -> Vec<settings::Setting> {
    let setting = |(scheme, stiffness): &Setting| format!("{scheme} K {stiffness}");
    set([
        ("segments of swings", config.segments.to_string()),
        ("their load/segment", numbers(&config.ratios)),
        ("schemes", list(&config.settings, setting)),
        ("Δt", step(config.dt)),
        ("finer step", step(config.dt / config.finer as f64)),
        ("amplitudes at", format!("{} s", numbers(&config.moments))),
        ("steps of bands", number(config.steps as f64)),
        ("Δt of spins", list(&config.spin_dts, |dt| step(*dt))),
        ("simulated spins", seconds(config.spin_time)),
    ])
}

const PLOTS: &[Plan] = &[
    Plan {
        id: "amplitude",
        title: "Amplitude of the swing",
        text: "By how much the load's swing has changed from its early to its late amplitude, over the same \
                       of a finer step: what the scheme does, apart from what the motion does by itself.",
        list: "swings",
        series: &["scheme", "stiffness"],
        x: positive(&["mass_ratio"], "load/segment mass ratio (1)", 1.0),
        y: error(
            &["change_over_fine"],
            "|change of the amplitude| over the finer step's (1)",
        ),
        ..PLAIN
    },
    Plan {
        id: "energy",
        title: "Energy over time",
        text: "Mean of each window of steps minus that of the first, over the largest kinetic energy of the \
                       first.",
        list: "bands",
        panels: &["segments", "mass_ratio"],
        series: &["scheme", "stiffness", "guarded"],
        x: linear(&["means_at"], "steps (10³)", 1e-3),
        y: linear(&["means"], "change of the energy (1)", 1.0),
        mark: Mark::Line,
        ..PLAIN
    },
    Plan {
        id: "momentum",
        title: "Angular momentum",
        text: "Of a free, taut, spinning cable about its centre of mass: nothing turns it, so it is to stay. \
                       A run that was lost is not shown.",
        list: "spins",
        series: &["scheme", "stiffness"],
        x: positive(&["dt"], "Δt (ms)", 1e3),
        y: error(&["drift"], "largest |L − L₀|/|L₀| (1)"),
        least_places: 2,
        orders: true,
        ..PLAIN
    },
];
