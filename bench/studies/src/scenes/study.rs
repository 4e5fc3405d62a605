//! The study of branches and loops: its options, settings and plots.

use super::{BAR, Config};
use crate::study::question::*;
use crate::systems::StudyResult;
use taut_model::Network;

pub(crate) const STUDY: Study = Study {
    name: "scenes",
    question: question!("scenes", FUNCTIONS),
    options: Own::augment_args,
    run: |matches, reporter| {
        let names = Own::from_arg_matches(matches)?.scenes;
        run(&Asked::read(matches), &names, reporter.cases)
    },
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[
    ("size", Text(size)),
    ("solver", Text(solver)),
    ("mark", Text(mark)),
    ("compares", Holds(compares)),
    ("closing", Text(closing)),
    ("least", Worth(least)),
    ("closes_a_loop", Holds(closes_a_loop)),
];

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
    let result = StudyResult {
        settings: settings(&config),
        heading: format!(
            "cables of 10 m, segments of 1 kg, Δt = 1/{:.0} s; bar of the direct solvers, error and load: {BAR:.0e}",
            1.0 / config.dt
        ),
        study: &STUDY,
        rows: data(&results)?,
        conclusion: String::new(),
        omissions: results.omissions,
    };
    Ok(result.into())
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
