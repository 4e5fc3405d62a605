//! H46: matrices that are ill-conditioned by themselves, and every backend on them.
//!
//! A direct solver has a small backward error, whatever the condition: η ≤ 10⁻¹⁴, or it refuses with a typed error, as
//! a Cholesky factorisation has to where rounding takes the definiteness. The error of x is then up to κ η; it is
//! reported beside the condition, and nothing claims that it is small. Iterative backends have rows in the table
//! alone.

pub mod matrices;

use crate::check::{Check, ExperimentError, Outcome, Parts, Verdict, csv};
use crate::hard::together;
use crate::matrix::solve::{Config, Record, run};
use crate::matrix::{RightHandSide, System};
use crate::table::{error, table, text};
use indicatif::ProgressBar;
use matrices::{Known, Specimen, specimens};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

/// Normwise backward error of direct solvers.
pub const BAR: f64 = 1e-14;

/// A backend on a matrix.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The matrix.
    pub matrix: String,
    /// The backend.
    pub backend: String,
    /// Whether it is direct.
    pub direct: bool,
    /// η; none where it refused.
    pub backward_error: Option<f64>,
    /// Error of x against 32 digits, where there is such an x.
    pub forward_error: Option<f64>,
    /// What it claims, or why it refused.
    pub status: String,
}

/// All backends on a matrix.
fn rows(specimen: &Specimen) -> Vec<Row> {
    let system = System {
        name: specimen.name.clone(),
        matrix: specimen.matrix.clone(),
        duplicates: 0,
        b: specimen.b.clone(),
        from: RightHandSide::Ones { exact: false },
        x: specimen.x.clone().map(|x| (x, PathBuf::from("32 digits"))),
    };
    let config = Config {
        budget: Duration::ZERO,
        ..Config::default()
    };
    let found = run(&system, &config);
    let direct = |backend: &str| !backend.starts_with("gauss-seidel") && !backend.starts_with("cg");
    let solved = found.records.into_iter().map(|r: Record| Row {
        matrix: specimen.name.clone(),
        direct: direct(&r.backend),
        backend: r.backend,
        backward_error: Some(r.backward_error),
        forward_error: specimen.x.as_ref().and(r.forward_error),
        status: r.status,
    });
    let refused = found.omissions.into_iter().map(|o| Row {
        matrix: specimen.name.clone(),
        direct: direct(&o.backend),
        backend: o.backend,
        backward_error: None,
        forward_error: None,
        status: o.reason,
    });
    solved.chain(refused).collect()
}

/// The checks of H46.
///
/// # Errors
/// A table that cannot be written.
pub fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let specimens = specimens(quick);
    progress.set_length(specimens.len() as u64);
    let found: Vec<Vec<Row>> = specimens
        .par_iter()
        .map(|s| {
            let rows = rows(s);
            progress.inc(1);
            rows
        })
        .collect();
    let mut checks: Vec<Check> = specimens.iter().filter_map(condition).collect();
    for (specimen, rows) in specimens.iter().zip(&found) {
        let direct = rows
            .iter()
            .filter(|r| r.direct && !r.status.contains("not compiled"));
        let own = direct.map(|r| (r.backend.clone(), judged(r, specimen.growth)));
        checks.extend(together(&specimen.name, own.collect()));
    }
    let rows = found.concat();
    Ok(Outcome {
        checks,
        text: tables(&specimens, &rows),
        csv: csv(&rows)?,
        ..Outcome::default()
    })
}

/// The condition number against the published one or the formula.
fn condition(specimen: &Specimen) -> Option<Check> {
    let Known { digits, tolerance } = specimen.known?;
    let error = (specimen.condition / digits - 1.0).abs();
    let case = format!("{}: κ", specimen.name);
    let found = format!("{:.5e}", specimen.condition);
    let check = Check::within(case, format!("{digits:.5e}"), found, error, tolerance);
    Some(check.by("condition in the 2-norm, relative to the digits that are known"))
}

/// What grows in elimination is beyond what partial pivoting promises: up to growth × n u is its own bound (Wilkinson
/// 1961).
fn judged(row: &Row, growth: f64) -> Check {
    let reference = "η ≤ 1e-14, or a typed error";
    match row.backward_error {
        None => Check::claim(
            "",
            reference,
            "refused".to_owned(),
            Verdict::Pass,
            row.status.as_str(),
        ),
        Some(eta) => {
            let ours = match row.forward_error {
                Some(e) => format!("error of x {e:.0e}"),
                None => "no x is known".to_owned(),
            };
            let mut check = Check::within("", reference.to_owned(), ours, eta, BAR)
                .by("normwise backward error with the residual in 32 digits")
                .split(Parts {
                    algebraic: row.forward_error,
                    ..Parts::default()
                });
            let promised = growth * f64::EPSILON;
            if check.verdict == Verdict::Fail && eta <= promised {
                check.verdict = Verdict::Limit;
                check.note = format!(
                    "partial pivoting: entries grow by {growth:.1e} in the elimination, and rounding with them, \
                     {promised:.0e}; the matrix is well-conditioned"
                );
            }
            check
        }
    }
}

/// η and the error of x, a row for each backend, a column for each matrix.
fn tables(specimens: &[Specimen], rows: &[Row]) -> String {
    let mut out = String::new();
    let mut backends: Vec<&str> = Vec::new();
    for r in rows {
        if !backends.contains(&r.backend.as_str()) {
            backends.push(&r.backend);
        }
    }
    // As many columns as a line has room for.
    for part in specimens.chunks(4) {
        let heads: Vec<String> = part
            .iter()
            .map(|s| format!("{} κ {:.1e}", s.name, s.condition))
            .collect();
        let mut header = vec!["η, error of x"];
        header.extend(heads.iter().map(String::as_str));
        let mut t = table(&header);
        for &backend in &backends {
            let mut row = vec![backend.to_owned()];
            for s in part {
                let here = |r: &&Row| r.matrix == s.name && r.backend == backend;
                row.push(match rows.iter().find(here) {
                    Some(Row {
                        backward_error: Some(eta),
                        forward_error: e,
                        ..
                    }) => format!("{eta:.0e}, {}", error(*e)),
                    _ => "refused".to_owned(),
                });
            }
            t.add_row(row);
        }
        let _ = writeln!(out, "{}", text(&t));
    }
    out
}
