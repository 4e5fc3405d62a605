//! The study of branches and loops: its options, settings and plots.

use super::{BAR, Config};
use crate::study::question::*;
use crate::systems::Told;
use taut_model::Network;

/// `taut study scenes`.
pub(crate) const STUDY: Study = Study {
    name: "scenes",
    title: "branches and loops",
    about: "Cables with branches and loops: every solver, cost against size",
    examples: &["--scene ring --quick --segments 8,12"],
    mark: ("records", "solve_ns_per_row"),
    takes: &[
        "scenes",
        "segments",
        "ratios",
        "backends",
        "iterations",
        "quick",
    ],
    options: Own::augment_args,
    run: |matches, reporter| {
        let names = Own::from_arg_matches(matches)?.scenes;
        run(&Asked::read(matches), &names, reporter.cases)
    },
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Own {
    /// Cables with branches and loops: ring, junction, cranes, ladder, net; `--segments` are the ladder's cables, the
    /// net's rows and columns
    #[arg(long = "scene", value_delimiter = ',', value_name = "NAME")]
    scenes: Vec<String>,
}

fn network(name: &str) -> Result<Network, Refused> {
    let names = || Network::ALL.map(Network::name).join(", ");
    let found = Network::named(name);
    found.ok_or_else(|| Refused(format!("`--scene {name}`: choose one of {}", names())))
}

fn run(asked: &Asked, names: &[String], cases: &Cases) -> Result<Found, ExperimentError> {
    let networks = names.iter().map(|name| network(name));
    let networks = distinct(networks.collect::<Result<Vec<_>, _>>()?.into_iter());
    let mut sizes = Vec::new();
    asked.segments(&mut sizes);
    let mut config = Config::new(asked.quick).with(&networks, &sizes);
    asked.ratios(&mut config.ratios)?;
    asked.iterations(&mut config.iterations)?;
    asked.refuse_limits()?;
    config.choices = asked.choices()?;
    let results = super::run(&config, cases)?;
    let told = Told {
        settings: settings(&config),
        heading: format!(
            "cables of 10 m, segments of 1 kg, Δt = 1/{:.0} s; bar of the direct solvers, error and load: {BAR:.0e}",
            1.0 / config.dt
        ),
        legend: LEGEND,
        sheets: SHEETS,
        rows: data(&results)?,
        conclusion: String::new(),
        omissions: results.omissions,
    };
    Ok(told.into())
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

const SOLVER: Column = column("backend", "solver").shown(Show::Row(solver));
const ITERATIONS: Column = column("iterations", "iter").shown(Show::Row(iterations));
const RATIO: Column = column("mass_ratio", "load/segment mass ratio {}").shown(Show::Ratio);

/// A table for each case, one for the closing of loops, the growth of cost with size.
pub(super) const SHEETS: &[Sheet] = &[
    Sheet {
        list: "records",
        shared: &[
            column("scene", "{}"),
            column("size", "{}").shown(Show::Row(size)),
            RATIO,
            column("bodies", "{} bodies"),
            column("rows", "{} rows"),
        ],
        columns: &[
            SOLVER,
            ITERATIONS,
            column("status", "claims"),
            sheet::time("step_ns", "step"),
            sheet::time("solve_ns", "solve"),
            sheet::time("solve_ns_min", "min"),
            column("solve_ns_per_row", "ns/row")
                .shown(Show::Fixed(0))
                .least(),
            sheet::error("forward_error", "error"),
            sheet::error("forward_error_unrefined", "at r0"),
            sheet::error("load_difference", "load"),
            column("factor_entries", "entries"),
            column("within_bar", "bar").shown(Show::Row(mark)),
        ],
        counts: compares,
        ..sheet::PLAIN
    },
    Sheet {
        list: "records",
        title: "Closing a loop: error of the multipliers and linear solve (minimum), ring of N segments",
        shared: &[RATIO],
        columns: &[SOLVER, column("iterations", "iter")],
        across: Some(Across {
            by: &[column("size", "N = {}")],
            cells: &[column("solve_ns_min", "")
                .shown(Show::Row(closing))
                .least_of(least)],
            several: false,
            most: 5,
        }),
        takes: closes_a_loop,
        counts: compares,
        ..sheet::PLAIN
    },
    Sheet {
        list: "growth",
        title: "Growth of the linear solve: exponent of its time over the number of rows",
        shared: &[RATIO],
        columns: &[SOLVER, column("iterations", "iter")],
        across: sheet::across(
            &[column("scene", "{}")],
            &[column("exponent", "").shown(Show::Fixed(2))],
        ),
        ..sheet::PLAIN
    },
];

/// The solver; the longest name of an order would make the table too wide.
fn solver(row: &Row) -> String {
    text_of(row, "backend").replace("minimum-degree", "min-deg")
}

fn size(row: &Row) -> String {
    let size = number_of(row, "size").unwrap_or(f64::NAN);
    match Network::named(text_of(row, "scene")) {
        Some(Network::Ladder) => format!("{size} cables"),
        Some(Network::Net) => format!("{size} × {size} nodes"),
        _ => format!("{size} segments"),
    }
}

/// True for a row to compare: it did not fail, miss the bar or run out of iterations.
fn compares(row: &Row) -> bool {
    mark(row).is_empty() && has_ended(row)
}

fn mark(row: &Row) -> String {
    let missed = row["within_bar"].is_boolean() && !is(row, "within_bar");
    match (has_no_error(row), missed) {
        (false, _) => "failed",
        (true, true) => "MISSED",
        _ => "",
    }
    .to_owned()
}

/// True for rows of the ring by solvers that close the loop: border rows, other orders, solvers
/// that order by themselves, groups.
fn closes_a_loop(row: &Row) -> bool {
    let kept = ["banded", "faer", "umfpack", "gauss-seidel:groups"];
    let is_kept = kept.iter().any(|k| text_of(row, "backend").starts_with(k));
    text_of(row, "scene") == Network::Ring.name() && is_kept
}

fn closing(row: &Row) -> String {
    let time = nanoseconds(least(row).unwrap_or(f64::NAN));
    format!("{} {time}", table::error(number_of(row, "forward_error")))
}

fn least(row: &Row) -> Option<f64> {
    number_of(row, "solve_ns_min")
}

const LEGEND: &str = "\
step: median time of a whole step; solve, min: median and minimum of its linear solve with refinement; error: of the
multipliers against extended precision (r0: without refinement); load: distance of the load from that of the reference
solver, over the scene's extent (-: lost on the way); entries: of the factor; bar: where a direct solver misses it";
