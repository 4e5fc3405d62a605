//! The study of systems from files, and a graded set of systems to write.

pub mod suite;

use crate::study::question::*;
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;
use taut_ground::Choice;
use taut_ground::matrix::solve::{About, CONVERGED, Config, DIRECT, Record, Results};
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

const SOLVER: Column = column("backend", "solver");
const ITERATIONS: Column = column("iterations", "iter").shown(Show::Row(iterations));
const ANALYSE: Column = sheet::time("analyze_ns", "analyse");
const FACTORISE: Column = sheet::time("factorize_ns", "factorise");
const SOLVE: Column = sheet::time("solve_ns", "solve");
const COMPONENTWISE: Column = sheet::error("backward_error_componentwise", "compon.");
const ERROR: Column = sheet::error("forward_error", "error");
const STATUS: Column = column("status", "status");

/// Rows of `taut study matrix`.
const SHEETS: &[Sheet] = &[Sheet {
    list: "records",
    columns: &[
        SOLVER,
        ITERATIONS,
        column("solve_ns", "factor+solve")
            .shown(Show::Row(shown_total))
            .least_of(total),
        column("ratio", "ratio").shown(Show::Digits(1.0)),
        column("ns_per_block_row", "ns/block")
            .shown(Show::Fixed(0))
            .least(),
        ANALYSE,
        FACTORISE,
        SOLVE,
        COMPONENTWISE,
        ERROR,
        STATUS,
    ],
    counts: ended,
    ..sheet::PLAIN
}];

/// Rows of `taut solve`.
const SOLVED: Sheet = Sheet {
    columns: &[
        SOLVER,
        ANALYSE,
        FACTORISE,
        SOLVE,
        sheet::error("backward_error", "normwise"),
        COMPONENTWISE,
        ERROR,
        ITERATIONS,
        STATUS,
    ],
    counts: ended,
    ..sheet::PLAIN
};

/// Factorisation and solve \[ns].
fn total(row: &Row) -> Option<f64> {
    Some(number_of(row, "factorize_ns")? + number_of(row, "solve_ns")?)
}

fn shown_total(row: &Row) -> String {
    nanoseconds(total(row).unwrap_or(f64::NAN))
}

/// True if the row came to an end of its own, as [`Record::ended`] has it.
fn ended(row: &Row) -> bool {
    [DIRECT, CONVERGED].contains(&text_of(row, "status"))
}

/// Description of a system, in a few lines.
fn heading(about: &About) -> String {
    let kind = if about.symmetric {
        "symmetric"
    } else {
        "not symmetric"
    };
    let mut out = format!(
        "\n{}: {kind}, {} rows in {} blocks, {} entries",
        about.matrix, about.dim, about.blocks, about.entries
    );
    if about.duplicates > 0 {
        let _ = write!(out, " ({} of the file added to others)", about.duplicates);
    }
    if about.zeros > 0 {
        let _ = write!(out, " ({} zeros of the file dropped)", about.zeros);
    }
    if let Some(condition) = about.condition {
        let _ = write!(out, ", condition about {condition:.0e}");
    }
    if let Some(condition) = about.condition_scaled {
        let _ = write!(out, " ({condition:.0e} with rows and columns scaled)");
    }
    if let (Some(order), Some(entries), Some(flops)) =
        (&about.order, about.factor_entries, about.factor_flops)
    {
        let _ = write!(
            out,
            "\neliminated in {order} order by those that keep it: {:.1e} entries, {:.1e} operations",
            entries as f64, flops as f64
        );
    }
    let _ = writeln!(out, "\nb: {}; x: {}", about.right_hand_side, about.solution);
    if let Some(singular) = &about.singular {
        let _ = writeln!(out, "{singular}");
    }
    out
}

/// All rows of a system, in their order.
pub fn solved(results: &Results) -> String {
    whole(results, &marked(SOLVED, results).of(&results.records))
}

/// All rows of a system from the fastest on.
pub fn compared(results: &Results) -> String {
    let mut records: Vec<&Record> = results.records.iter().collect();
    records.sort_by(|a, b| a.total_ns().total_cmp(&b.total_ns()));
    let sheet = marked(SHEETS[0], results);
    whole(results, &sheet.of(&json!({ "records": records })))
}

/// Without marks of the best where the matrix is singular: no row is better than another.
fn marked(sheet: Sheet, results: &Results) -> Sheet {
    match results.about.singular {
        Some(_) => Sheet {
            counts: |_| false,
            ..sheet
        },
        None => sheet,
    }
}

/// The table of a system below its heading, with what was left out.
fn whole(results: &Results, table: &str) -> String {
    let (heading, left_out) = (heading(&results.about), omissions(&results.omissions));
    format!("{heading}{table}{left_out}")
}

const SUITE: Sheet = Sheet {
    columns: &[
        column("topology", "topology"),
        column("size", "N"),
        column("systems", "systems"),
        column("solved", "with x"),
        column("rows", "rows"),
        column("least", "condition from").shown(Show::Error(1)),
        column("most", "to").shown(Show::Error(1)),
        column("least_scaled", "scaled from").shown(Show::Error(1)),
        column("most_scaled", "to").shown(Show::Error(1)),
        column("megabytes", "MB").shown(Show::Fixed(2)),
    ],
    ..sheet::PLAIN
};

/// The graded set by topology and size.
pub fn suite_table(entries: &[Row]) -> String {
    let groups = entries.chunk_by(|a, b| a["topology"] == b["topology"] && a["size"] == b["size"]);
    SUITE.of(&groups.map(of_size).collect::<Vec<_>>())
}

/// Facts common to the systems of a topology and size.
fn of_size(group: &[Row]) -> Value {
    let values = |key| group.iter().filter_map(move |row| number_of(row, key));
    let least = |key| values(key).reduce(f64::min);
    let most = |key| values(key).reduce(f64::max);
    let rows = match (least("dim"), most("dim")) {
        (Some(least), Some(most)) if least < most => format!("{least} … {most}"),
        (least, _) => least.unwrap_or(0.0).to_string(),
    };
    json!({
        "topology": group[0]["topology"],
        "size": group[0]["size"],
        "systems": group.len(),
        "solved": group.iter().filter(|row| is(row, "solution")).count(),
        "rows": rows,
        "least": least("condition"),
        "most": most("condition"),
        "least_scaled": least("condition_scaled"),
        "most_scaled": most("condition_scaled"),
        "megabytes": values("bytes").sum::<f64>() / 1e6,
    })
}
