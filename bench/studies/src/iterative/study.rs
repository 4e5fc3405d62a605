//! The study of iterations: its options, settings and plots.

use super::table::{SHEETS, conclusions};
use super::{ANGLE, Config, WARM_UP};
use crate::cases::Cases;
use crate::options::{Backends, Quick, Ratios, Segments, count};
use crate::study::{self, Found, Study, data, tables};
use clap::{Args, FromArgMatches};
use taut_model::Network;
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, PRECISION, Plan, error, positive};
use taut_output::settings::{Setting, counts, list, numbers, set, solvers, step};
use taut_output::table::{MARK, omissions};

/// `taut study iterative`.
pub(crate) const STUDY: Study = Study {
    name: "iterative",
    title: "time of iterations to an error",
    about: "Time and iterations of the iterative solvers to given errors, cold and warm, against the direct solver",
    examples: &["--quick --backends cg:group"],
    mark: ("", "target"),
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
    /// Most iterations tried
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    iterations: Option<usize>,
    #[command(flatten)]
    quick: Quick,
}

const LEGEND: &str = "\
Each cell: fewest iterations that reach the error of the multipliers against extended precision (∞-norm): µs from the
pieces to the multipliers (assembly, factorisation, solve), × the direct solver's time over it: above 1 it wins. First
row: the direct solver, r0 without, r1 with one refinement. cold: from zero; warm: from the step before; no: not
reached; guess: the step before is as near as that";

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let config = config(options)?;
    let results = super::run(&config, cases)?;
    let rows = data(&results.records)?;
    let text = format!(
        "hoist at {ANGLE} rad and networks, state after {WARM_UP} steps of 1/{:.0} s, up to {} iterations\n\
         {LEGEND}\n{MARK}\n{}{}{}",
        1.0 / config.dt,
        config.limit,
        tables(SHEETS, &rows),
        conclusions(&results.records, config.limit),
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

fn config(options: &Options) -> Result<Config, ExperimentError> {
    let mut config = options.quick.of(Config::quick);
    if !options.segments.segments.is_empty() || !options.ratios.ratios.is_empty() {
        // Both are the hoist's.
        config.networks.clear();
    }
    options.segments.replace(&mut config.segments);
    options.ratios.replace(&mut config.ratios)?;
    options.backends.replace(&mut config.choices)?;
    if let Some(direct) = config.choices.iter().find(|c| !c.backend.is_iterative()) {
        return Err(format!(
            "`--backends {direct}`: `taut study iterative` takes iterative solvers, gauss-seidel, cg and minres"
        )
        .into());
    }
    if let Some(name) = options.backends.backends.iter().find(|b| b.contains('=')) {
        return Err(format!(
            "`{name}`: the study looks for the iterations itself, without a tolerance; use `--iterations`"
        )
        .into());
    }
    config.limit = options.iterations.unwrap_or(config.limit);
    if config.limit == 0 {
        return Err("`--iterations` is 0: it must be at least 1".into());
    }
    Ok(config)
}

fn settings(config: &Config) -> Vec<Setting> {
    let network = |(network, size): &(Network, usize)| format!("{} of {size}", network.name());
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("networks", list(&config.networks, network)),
        ("solvers", solvers(&config.choices)),
        ("errors", numbers(&config.targets)),
        ("iterations at most", config.limit.to_string()),
        ("Δt", step(config.dt)),
        ("steps before", WARM_UP.to_string()),
    ])
}

const PLOTS: &[Plan] = &[Plan {
    id: PRECISION,
    title: "Work against precision",
    text: "Least time from the pieces to multipliers within the error, iterations from zero (cold) or from the \
                   step before (warm), beside the direct solver. Lower left is better.",
    panels: &["scene", "size", "mass_ratio", "start"],
    x: error(&["target"], "relative error of the multipliers (1)"),
    y: positive(&["ns"], "assembly, factorisation, solve (µs)", 1e-3),
    ..PLAIN
}];
