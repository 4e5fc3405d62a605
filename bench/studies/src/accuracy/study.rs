//! The study of whole motions: its options, settings and plots.

use super::Config;
use super::table::{SHEETS, text};
use crate::cases::Cases;
use crate::options::{
    Backends, Iterations, Quick, Ratios, Segments, Time, number as read, require_positive, sorted,
};
use crate::study::{self, Found, Study, data};
use clap::{Args, FromArgMatches};
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, PRECISION, Plan, error, positive};
use taut_output::settings::{
    Setting, counts, distinct, list, numbers, seconds, set, solvers, step,
};

/// `taut study accuracy`.
pub(crate) const STUDY: Study = Study {
    name: "accuracy",
    title: "error of whole motions against cost",
    about: "Error of whole motions against cost: every scheme, time step, solver and number of refinements",
    examples: &["--quick --segments 4 --ratios 10,1e4"],
    mark: ("records", "horizontal_m"),
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
    iterations: Iterations,
    /// Time steps (s), fractions such as 1/60 too; the first is what all schemes run at
    #[arg(long, value_delimiter = ',', value_name = "S", value_parser = read, allow_negative_numbers = true)]
    dt: Vec<f64>,
    #[command(flatten)]
    time: Time,
    #[command(flatten)]
    quick: Quick,
}

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = options.quick.of(Config::quick);
    let mut ratios: Vec<f64> = config.cases.iter().map(|c| c.mass_ratio).collect();
    options.ratios.replace(&mut ratios)?;
    if !options.ratios.ratios.is_empty() {
        config.choice_ratios.clone_from(&ratios);
    }
    let segments = config.cases.iter().map(|c| c.segments).collect();
    config.cases = super::cases(&sorted(&options.segments.segments, segments), &ratios);
    options.backends.refuse_limits()?;
    options.backends.replace(&mut config.choices)?;
    options.iterations.replace(&mut config.iterations)?;
    if !options.dt.is_empty() {
        config.rates = rates(&options.dt)?;
    }
    options.time.replace(
        &mut config.time,
        1.0 / config.rates[0],
        1,
        "it must be at least one step",
    )?;
    let results = super::run(&config, cases)?;
    let rows = data(&results)?;
    let text = format!(
        "{} s of the hoist, 10 m, segments of 1 kg, YA = 2·10⁷ N{}",
        config.time,
        text(&results, &rows)
    );
    Ok(Found {
        settings: settings(&config),
        text,
        rows,
        ..Found::default()
    })
}

/// Steps a second, ascending, of these time steps \[s].
fn rates(dts: &[f64]) -> Result<Vec<f64>, ExperimentError> {
    require_positive("a number of `--dt`", dts)?;
    let mut rates: Vec<f64> = dts.iter().map(|dt| 1.0 / dt).collect();
    rates.sort_by(f64::total_cmp);
    rates.dedup();
    let first = rates[0];
    let whole = |rate: &f64| ((rate / first).round() - rate / first).abs() < 1e-9;
    if !rates.iter().all(whole) {
        return Err(
            "`--dt`: the largest must be a whole multiple of each of the others, so that they meet"
                .into(),
        );
    }
    Ok(rates)
}

fn settings(config: &Config) -> Vec<Setting> {
    let segments = distinct(config.cases.iter().map(|c| c.segments));
    let ratios = distinct(config.cases.iter().map(|c| c.mass_ratio));
    set([
        ("segments", counts(&segments)),
        ("load/segment", numbers(&ratios)),
        ("Δt", list(&config.rates, |rate| step(1.0 / rate))),
        ("simulated", seconds(config.time)),
        ("steps", list(&config.settings, |s| s.name.to_owned())),
        ("solvers", solvers(&config.choices)),
        ("their load/segment", numbers(&config.choice_ratios)),
        ("iterations", counts(&config.iterations)),
        ("refinements", "1; of direct solvers 0, 1, 2".to_owned()),
    ])
}

const PLOTS: &[Plan] = &[
    Plan {
        id: PRECISION,
        title: "Work against precision of the motion",
        text: "Along a curve: Δt. Lower left is better. A run that was lost is not shown. The cost is the \
                       wall-clock time of all steps of the run over its simulated time: of every phase of a step, \
                       which are linearisation, assembly, factorisation, solve, refinement and update, those that \
                       the guard takes back and redoes with their implicit sub-steps included; not of building the \
                       scene, nor of what is recorded of it. Runs share the machine with others.",
        list: "records",
        panels: &["segments", "mass_ratio", "joint", "drive"],
        series: &["setting"],
        x: error(
            &["horizontal_m"],
            "largest horizontal error of the load (m)",
        ),
        y: positive(
            &["cost"],
            "time of all steps of a simulated second (ms)",
            1e3,
        ),
        only: &[("stable", &["yes"])],
        as_first: &["backend", "refinements", "iterations"],
        ..PLAIN
    },
    Plan {
        id: "orders",
        title: "Order of the default step",
        text: "Error against the time step, all else the same.",
        list: "records",
        panels: &["segments", "joint", "drive"],
        series: &["mass_ratio"],
        x: positive(&["dt"], "Δt (ms)", 1e3),
        y: error(
            &["horizontal_m"],
            "largest horizontal error of the load (m)",
        ),
        only: &[("stable", &["yes"])],
        as_first: &["setting", "backend", "refinements", "iterations"],
        least_places: 2,
        orders: true,
        ..PLAIN
    },
    Plan {
        id: "solvers",
        title: "Solvers",
        text: "The default step with every solver. Along a curve: iterations, or refinements.",
        list: "records",
        panels: &["segments", "mass_ratio"],
        x: error(
            &["horizontal_m"],
            "largest horizontal error of the load (m)",
        ),
        y: positive(&["step_ns"], "whole step (µs)", 1e-3),
        only: &[("stable", &["yes"])],
        as_first: &["setting", "dt", "joint", "drive"],
        least: 2,
        ..PLAIN
    },
];
