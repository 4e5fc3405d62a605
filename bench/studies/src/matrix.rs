//! The study of systems from files, and a graded set of systems to write.

pub mod suite;

use crate::study::question::*;
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;
use taut_measure::Choice;
use taut_measure::matrix::solve::{About, CONVERGED, Config, DIRECT, Results, SystemRow};
use taut_measure::matrix::{self, System, solve};
use taut_solver::Backend;

pub(crate) const STUDY: Study = Study {
    name: "matrix",
    question: question!("matrix", FUNCTIONS),
    options: Own::augment_args,
    reads: |matches| read_by(matches, "matrices", matrix::files),
    run: |matches, reporter| {
        run(
            &Asked::read(matches),
            &Own::from_arg_matches(matches)?,
            reporter.cases,
        )
    },
};

const FUNCTIONS: Functions = &[
    ("shown_total", Text(shown_total)),
    ("total", Worth(total)),
    ("ended", Holds(ended)),
];

#[derive(Debug, Args)]
struct Own {
    /// The matrices
    #[arg(value_name = "A.mtx", required = true, value_delimiter = ',')]
    matrices: Vec<PathBuf>,
    /// Backends with options after colons (default: all that accept the matrix)
    #[arg(long, value_delimiter = ',', value_name = "B")]
    backends: Vec<String>,
}

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
        text: format!(
            "{}\n{MARK}\n{tables}{}",
            STUDY.question().legend,
            not_read(&unread)
        ),
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

/// Factorisation and solve \[ns].
fn total(row: &Row) -> Option<f64> {
    Some(number_of(row, "factorize_ns")? + number_of(row, "solve_ns")?)
}

fn shown_total(row: &Row) -> String {
    nanoseconds(total(row).unwrap_or(f64::NAN))
}

/// True if the row came to an end of its own, as [`SystemRow::ended`] has it.
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
    whole(
        results,
        &marked(STUDY.sheet("solved"), results).of(&results.records),
    )
}

/// All rows of a system from the fastest on.
pub fn compared(results: &Results) -> String {
    let mut records: Vec<&SystemRow> = results.records.iter().collect();
    records.sort_by(|a, b| a.total_ns().total_cmp(&b.total_ns()));
    let sheet = marked(&STUDY.question().sheets[0], results);
    whole(results, &sheet.of(&json!({ "records": records })))
}

/// Without marks of the best where the matrix is singular: no row is better than another.
fn marked(sheet: &Sheet, results: &Results) -> Sheet {
    match results.about.singular {
        Some(_) => Sheet {
            counts: |_| false,
            ..*sheet
        },
        None => *sheet,
    }
}

/// The table of a system below its heading, with what was left out.
fn whole(results: &Results, table: &str) -> String {
    let (heading, left_out) = (heading(&results.about), omissions(&results.omissions));
    format!("{heading}{table}{left_out}")
}

/// The graded set by topology and size.
pub fn suite_table(entries: &[Row]) -> String {
    let groups = entries.chunk_by(|a, b| a["topology"] == b["topology"] && a["size"] == b["size"]);
    STUDY
        .sheet("suite")
        .of(&groups.map(of_size).collect::<Vec<_>>())
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
