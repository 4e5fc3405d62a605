//! H46: matrices that are ill-conditioned by themselves, and every backend on them.
//!
//! A direct solver has a small backward error, whatever the condition: η ≤ 10⁻¹⁴, or says that what it returns is no
//! solution; where κ n ε is 1 and more it may refuse with a typed error, as a Cholesky factorisation has to where rounding
//! takes the definiteness.
//! The error of x is then up to κ η; it is reported beside the condition, and nothing claims that it is small. Graded
//! matrices are judged entry by entry, by ω, and so is their x, which ω and the condition of T bound. Iterative
//! backends have rows in the table alone.

pub mod matrices;

use crate::hard::{together, worse};
use indicatif::ProgressBar;
use matrices::{Specimen, specimens};
use rayon::prelude::*;
use std::fmt::Write;
use taut_ground::choice::Choice;
use taut_ground::matrix::Matrix;
use taut_ground::matrix::prepared::Problem;
use taut_ground::matrix::solve::backends;
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};
use taut_output::settings::distinct;
use taut_output::table::{error, text, wrapped};
use taut_solver::{Backend, SolveError, SolveReport, forward_error};

/// Backward error of direct solvers: normwise, of graded matrices componentwise.
pub const BAR: f64 = 1e-14;

/// Largest backward error of an answer that is told to be none, however entries grow.
const NO_DIGIT: f64 = 0.1;

/// Relative bar of the condition numbers.
pub(super) const CONDITION_BAR: f64 = 1e-9;

/// A backend on a matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub matrix: String,
    pub backend: String,
    pub direct: bool,
    /// The backend claims a solution.
    pub claimed: bool,
    /// η, or ω of a graded matrix; none where it refused.
    pub backward_error: Option<f64>,
    /// Error of x, of the largest entry, or of a graded matrix the largest of each entry, relative.
    pub forward_error: Option<f64>,
    /// Status, or the reason for refusing.
    pub status: String,
    /// The refusal is justified.
    pub has_to_refuse: bool,
}

/// x by a backend, and what it says of it.
///
/// # Errors
/// [`SolveError`].
pub fn solve(
    problem: &Problem<'_>,
    backend: &Backend,
    b: &[f64],
) -> Result<(Vec<f64>, SolveReport), SolveError> {
    let mut solver = problem.analyze(backend)?;
    solver.factorize()?;
    let mut x = vec![0.0; b.len()];
    let report = solver.solve(b, &mut x)?;
    Ok((x, report))
}

/// All backends on a matrix.
#[must_use]
pub fn rows(specimen: &Specimen) -> Vec<Row> {
    let problem = Problem::new(&specimen.matrix);
    let compiled = backends().into_iter().filter(Backend::is_compiled);
    let row = |backend: Backend| {
        let solved = solve(&problem, &backend, &specimen.b).and_then(|(x, report)| {
            let errors = specimen.matrix.backward_error(&specimen.b, &x)?;
            Ok((x, report, errors))
        });
        let mut row = Row {
            matrix: specimen.name.clone(),
            direct: !backend.is_iterative(),
            backend: Choice::schur(backend).family(),
            claimed: false,
            backward_error: None,
            forward_error: None,
            status: String::new(),
            has_to_refuse: false,
        };
        match solved {
            Err(e) => {
                row.has_to_refuse = has_to_refuse(specimen, &e);
                row.status = e.to_string();
            }
            Ok((x, report, errors)) => {
                row.claimed = report.is_claim();
                row.status = format!("{:?}", report.status).to_lowercase();
                let graded = specimen.graded.is_some();
                let [backward, forward] = if graded {
                    [errors.componentwise, largest_error(&x, &specimen.x)]
                } else {
                    [errors.normwise, forward_error(&x, &specimen.x)]
                };
                row.backward_error = Some(backward);
                row.forward_error = Some(forward);
            }
        }
        row
    };
    compiled.map(row).collect()
}

/// True if the solver is not to blame: the matrix is not symmetric but must be, or its condition
/// lets rounding take the definiteness or a pivot.
fn has_to_refuse(specimen: &Specimen, e: &SolveError) -> bool {
    match e {
        SolveError::NotSymmetric { .. } => !matches!(specimen.matrix, Matrix::Symmetric(_)),
        SolveError::Singular { .. } | SolveError::NotPositiveDefinite { .. } => {
            specimen.condition * specimen.b.len() as f64 * f64::EPSILON >= 1.0
        }
        _ => false,
    }
}

/// maxᵢ |xᵢ − x*ᵢ| / |x*ᵢ|.
fn largest_error(x: &[f64], exact: &[f64]) -> f64 {
    let each = x.iter().zip(exact).map(|(x, e)| ((x - e) / e).abs());
    each.fold(0.0, worse)
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
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
        let direct = || rows.iter().filter(|r| r.direct);
        let own = direct().map(|r| (r.backend.clone(), judged(r, specimen)));
        checks.extend(together(&specimen.name, own.collect()));
        if let Some(bound) = specimen.graded {
            let own = direct().filter_map(|r| Some((r.backend.clone(), exact(r, bound)?)));
            checks.extend(together(&format!("{}, x", specimen.name), own.collect()));
        }
    }
    let rows = found.concat();
    Ok(Outcome {
        checks,
        text: tables(&specimens, &rows),
        ..Outcome::default()
    })
}

/// The condition number against its formula.
fn condition(specimen: &Specimen) -> Option<Check> {
    let known = specimen.known?;
    let case = format!("{}: κ", specimen.name);
    let check = Check::relative(case, [known, specimen.condition], "", CONDITION_BAR);
    let by = "condition in the 2-norm, by inverse iteration in 32 digits, relative to its formula";
    Some(check.by(by))
}

/// A backward error within the bar, a typed error, or, where the growth of the entries in elimination has taken the
/// digits, which partial pivoting does not promise to prevent (Wilkinson 1961), a status that says so: at its limit.
/// Nothing excuses a claim.
fn judged(row: &Row, specimen: &Specimen) -> Check {
    let (symbol, kind) = match specimen.graded {
        None => ("η", "normwise"),
        Some(_) => ("ω", "componentwise"),
    };
    let reference = format!("{symbol} ≤ 1e-14, or a typed error");
    let (Some(backward), Some(forward)) = (row.backward_error, row.forward_error) else {
        return Check::stated("", reference, "refused", row.has_to_refuse)
            .noting(row.status.as_str());
    };
    let ours = format!("error of x {forward:.0e}");
    let mut check = Check::within("", reference, ours, backward, BAR)
        .by(format!(
            "{kind} backward error with the residual in 32 digits"
        ))
        .algebraic_part(forward);
    if check.verdict == Verdict::Fail {
        check.note = format!("says `{}`", row.status);
        let rounding = specimen.growth * f64::EPSILON;
        if specimen.growth > 1.0 {
            let _ = write!(
                check.note,
                "; entries grow by {:.1e} in the elimination, and rounding with them: ",
                specimen.growth
            );
            if rounding < 1.0 {
                let _ = write!(check.note, "{rounding:.0e}");
            } else {
                check.note.push_str("no digit is left");
            }
        }
        // Where no digit is left η may be anything up to 1, which it is of x = 0 and of b; ours keep more.
        let caused = backward <= rounding.min(NO_DIGIT);
        if caused && !row.claimed {
            check.verdict = Verdict::Limit;
        }
    }
    check
}

/// Check of a graded matrix: each entry of x is as exact as ω ≤ 10⁻¹⁴ makes it. `None` if the
/// backend refused.
fn exact(row: &Row, bound: f64) -> Option<Check> {
    let error = row.forward_error?;
    let ours = format!("each within {error:.0e}");
    let check = Check::within("", "x = D⁻¹ T⁻¹ D⁻¹ b", ours, error, bound * BAR);
    let by = "largest error of an entry, relative; the bar is what ω ≤ 1e-14 leaves, |T⁻¹| (|T| |y| + |c|) / |y| of it";
    Some(check.by(by))
}

/// η and the error of x, a row for each backend, a column for each matrix.
fn tables(specimens: &[Specimen], rows: &[Row]) -> String {
    let mut out = String::new();
    let backends = distinct(rows.iter().map(|r| r.backend.as_str()));
    // As many columns as a line has room for.
    for part in specimens.chunks(4) {
        let head = |s: &Specimen| {
            let by = if s.graded.is_some() { ", ω" } else { "" };
            format!("{}{by} κ {:.1e}", s.name, s.condition)
        };
        let heads: Vec<String> = part.iter().map(head).collect();
        let mut header = vec!["η or ω, error of x"];
        header.extend(heads.iter().map(String::as_str));
        let mut t = wrapped(&header);
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
