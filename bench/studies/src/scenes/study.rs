//! The study of branches and loops: its options, settings and plots.

use super::Config;
use super::table::{LEGEND, SHEETS, bar};
use crate::cases::Cases;
use crate::options::{Backends, Iterations, Quick, Ratios, Refused, Segments, sorted};
use crate::study::{self, Found, Study, data, tables};
use clap::{Args, FromArgMatches};
use taut_model::Network;
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, PRECISION, Plan, error, positive};
use taut_output::settings::{
    ONE_REFINEMENT, Setting, counts, list, numbers, seconds, set, solvers, step,
};
use taut_output::table::{MARK, omissions};

/// `taut study scenes`.
pub(crate) const STUDY: Study = Study {
    name: "scenes",
    title: "branches and loops",
    about: "Cables with branches and loops: every solver, cost against size",
    examples: &["--scene ring --quick --segments 8,12"],
    mark: ("records", "solve_ns_per_row"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
pub struct Options {
    /// Cables with branches and loops: ring, junction, cranes, ladder, net; `--segments` are the ladder's cables, the
    /// net's rows and columns
    #[arg(long = "scene", value_delimiter = ',', value_name = "NAME")]
    pub scenes: Vec<String>,
    /// Numbers of segments
    #[command(flatten)]
    pub segments: Segments,
    /// Mass ratios
    #[command(flatten)]
    pub ratios: Ratios,
    /// Solvers
    #[command(flatten)]
    pub backends: Backends,
    /// Limits of iterations
    #[command(flatten)]
    pub iterations: Iterations,
    /// Whether it is short
    #[command(flatten)]
    pub quick: Quick,
}

fn network(name: &str) -> Result<Network, Refused> {
    let names = || Network::ALL.map(Network::name).join(", ");
    let found = Network::named(name);
    found.ok_or_else(|| Refused(format!("`--scene {name}`: choose one of {}", names())))
}

/// Runs it.
///
/// # Errors
/// Bad options, and scenes that cannot be run.
pub fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut networks = Vec::new();
    for name in &options.scenes {
        let network = network(name)?;
        if !networks.contains(&network) {
            networks.push(network);
        }
    }
    let sizes = sorted(&options.segments.segments, Vec::new());
    let mut config = options.quick.of(Config::quick).with(&networks, &sizes);
    options.ratios.replace(&mut config.ratios)?;
    options.iterations.replace(&mut config.iterations)?;
    options.backends.refuse_limits()?;
    config.choices = options.backends.choices()?;
    let results = super::run(&config, cases)?;
    let rows = data(&results)?;
    let text = format!(
        "cables of 10 m, segments of 1 kg, Δt = 1/{:.0} s; {}\n{LEGEND}\n{MARK}\n{}{}",
        1.0 / config.dt,
        bar(),
        tables(SHEETS, &rows),
        omissions(&results.omissions)
    );
    Ok(Found {
        settings: settings(&config),
        text,
        rows,
        omissions: results.omissions,
        ..Found::default()
    })
}

fn settings(config: &Config) -> Vec<Setting> {
    let sizes = |(network, sizes): &(Network, Vec<usize>)| {
        format!("{} of {}", network.name(), counts(sizes))
    };
    set([
        ("scenes", list(&config.sizes, sizes)),
        ("load/segment", numbers(&config.ratios)),
        ("solvers", solvers(&config.choices)),
        ("iterations", counts(&config.iterations)),
        ("refinements", ONE_REFINEMENT.to_owned()),
        ("Δt", step(config.dt)),
        ("simulated", seconds(config.time)),
    ])
}

const PLOTS: &[Plan] = &[
    Plan {
        id: PRECISION,
        title: "Work against precision",
        text: "A step's time against the error of the multipliers against 32 digits. Along a curve: \
                       iterations. Lower left is better.",
        list: "records",
        panels: &["scene", "size", "mass_ratio"],
        x: error(&["forward_error"], "relative error of the multipliers (1)"),
        y: positive(&["step_ns"], "whole step (µs)", 1e-3),
        ..PLAIN
    },
    Plan {
        id: "sizes",
        title: "Time against size",
        text: "Of iterations those that converged, with the limit that costs least.",
        list: "records",
        only: &[("status", &["direct", "converged"])],
        panels: &["scene", "mass_ratio"],
        x: positive(&["rows"], "rows of S (1)", 1.0),
        y: positive(&["solve_ns"], "linear solve (µs)", 1e-3),
        lowest: true,
        ..PLAIN
    },
];
