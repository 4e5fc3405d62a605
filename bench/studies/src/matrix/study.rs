//! The study of systems from files: its options, settings and plots.

use super::compared;
use super::table::SHEETS;
use crate::study::question::*;
use std::path::PathBuf;
use std::time::Duration;
use taut_ground::Choice;
use taut_ground::matrix::solve::{Config, Results};
use taut_ground::matrix::{System, solve};
use taut_solver::Backend;

/// `taut study matrix`.
pub(crate) const STUDY: Study = Study {
    name: "matrix",
    title: "systems from files",
    about: "Systems from Matrix Market files: every backend, speed against error",
    examples: &["bcsstk14.mtx.gz sherman1.mtx"],
    mark: ("", "about"),
    takes: &["matrices", "backends", "iterations", "quick"],
    options: Own::augment_args,
    reads: |matches| {
        let paths = matches.get_many("matrices");
        paths.into_iter().flatten().cloned().collect()
    },
    run: |matches, reporter| {
        run(
            &Asked::read(matches),
            &Own::from_arg_matches(matches)?,
            reporter.cases,
        )
    },
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Own {
    /// The matrices
    #[arg(value_name = "A.mtx", required = true, value_delimiter = ',')]
    matrices: Vec<PathBuf>,
    /// Backends with options after colons (default: all that accept the matrix)
    #[arg(long, value_delimiter = ',', value_name = "B")]
    backends: Vec<String>,
}

const LEGEND: &str = "\
factor+solve: what a step pays, and its ratio to the fastest that did not run out of iterations; ns/block: the same for
each block row; compon.: componentwise backward error; error: relative error of x in the largest norm; times are minima
of repeats";

/// The backends named; those that are worth a row where none is.
pub fn backends(names: &[String]) -> Result<Config, ExperimentError> {
    let mut config = Config::default();
    if names.is_empty() {
        // Without rows among the solvers of a scene, but one that indefinite matrices may need.
        config.backends.push("faer:lblt".parse()?);
        return Ok(config);
    }
    config.named = true;
    config.backends.clear();
    for name in names {
        if name.contains('/') {
            return Err(
                format!("`{name}`: a matrix has its form, drop what follows the `/`").into(),
            );
        }
        let backend: Backend = name.parse()?;
        backend.create()?;
        if !config.backends.contains(&backend) {
            config.backends.push(backend);
        }
    }
    Ok(config)
}

/// Runs backends on a system.
pub fn measured(system: &System, config: &Config) -> Result<Results, ExperimentError> {
    let results = solve::run(system, config);
    match results.refusal() {
        Some(refusal) => Err(refusal.into()),
        None => Ok(results),
    }
}

fn run(asked: &Asked, own: &Own, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = Config {
        iterations: pick(asked.quick, [vec![10, 100, 1000], vec![10, 100]]),
        budget: Duration::from_millis(pick(asked.quick, [300, 20])),
        ..backends(&own.backends)?
    };
    asked.iterations(&mut config.iterations)?;
    // All are read before any is measured.
    let (mut systems, mut unread) = (Vec::new(), Vec::new());
    for path in &own.matrices {
        match System::read(path, None, None) {
            Ok(system) => systems.push(system),
            Err(e) => unread.push(e),
        }
    }
    if systems.is_empty()
        && let Some(first) = unread.drain(..).next()
    {
        return Err(first.into());
    }
    let places = systems.iter().enumerate();
    let places: Vec<(usize, &str)> = places
        .map(|(k, system)| (k, system.name.as_str()))
        .collect();
    let results = cases.in_turn("systems", &places, |(k, _)| {
        Ok::<_, ExperimentError>(solve::run(&systems[*k], &config))
    })?;
    let results = results.all()?;
    // One that nobody solves is among what is left out; where there is no other, nothing is.
    if let Some(refusal) = results.first().and_then(Results::refusal)
        && results.iter().all(|r| r.records.is_empty())
    {
        return Err(refusal.into());
    }
    let tables: String = results.iter().map(compared).collect();
    Ok(Found {
        settings: settings(&config),
        text: format!("{LEGEND}\n{MARK}\n{tables}{}", not_read(&unread)),
        rows: data(&results)?,
        ..Found::default()
    })
}

/// The files without a table, with the reason.
fn not_read(unread: &[impl std::fmt::Display]) -> String {
    if unread.is_empty() {
        return String::new();
    }
    let lines: String = unread.iter().map(|e| format!("{e}\n")).collect();
    format!("\nFiles left out\n{lines}")
}

fn settings(config: &Config) -> Vec<Setting> {
    let family = |backend: &Backend| Choice::schur(backend.clone()).family();
    set([
        ("solvers", list(&config.backends, family)),
        ("iterations", counts(&config.iterations)),
        ("time of each", seconds(config.budget.as_secs_f64())),
    ])
}

const PLOTS: &[Plan] = &[Plan {
    id: PRECISION,
    title: "Work against precision",
    text: "Factorisation and solve against the relative error of x. Along a curve: iterations. Lower left is \
                   better.",
    list: "records",
    panels: &["matrix"],
    x: error(&["forward_error"], "relative error of x (1)"),
    y: positive(
        &["factorize_ns", "solve_ns"],
        "factorise and solve (µs)",
        1e-3,
    ),
    ..PLAIN
}];
