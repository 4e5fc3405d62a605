//! The net for algebra: small systems of every kind, scaling and rank, every backend and form on them, against 32 digits.
//!
//! A seed draws a [`draw::Drawn`] system, as a file would hold it; [`truth::Truth`] is its solution and its condition by
//! elimination with complete pivoting in double-double arithmetic; [`judge`] says what the program tells wrongly: claims,
//! refusals, conditions and words.
//!
//! The first 10⁴ systems found, unguided: solutions claimed for singular matrices, symmetric or
//! not; refusals of regular ones for their units; conditions that ended in a tie; zeros that made
//! pattern; regular matrices called singular, and singular ones called something else; errors of
//! iterations that found one of many solutions.
//!
//! `cargo test -p taut-tests --test all algebra` draws 500 systems. A longer search, and the system of one seed:
//!
//! ```text
//! TAUT_ALGEBRA=100000 TAUT_ALGEBRA_SEED=1000 cargo test --release -p taut-tests --test all algebra -- --nocapture
//! TAUT_ALGEBRA=1 TAUT_ALGEBRA_SEED=4711 cargo test -p taut-tests --test all algebra
//! ```

pub mod draw;
pub mod exact;
pub mod truth;

use crate::prelude::*;
use draw::{Drawn, Kind};
use std::path::{Path, PathBuf};
use std::time::Duration;
use taut_measure::choice::Omission;
use taut_measure::matrix::exact::condition;
use taut_measure::matrix::prepared::Problem;
use taut_measure::matrix::solve::{CONVERGED, Config, run};
use taut_measure::matrix::{Matrix, RightHandSide, System, matrix_of};
use taut_solver::{GeneralMatrix, RefineScratch, refine};
use truth::{Truth, largest_error, scaled_error};

/// Condition with rows and columns scaled below which whoever exchanges rows has to solve a system.
const SOLVABLE: f64 = 1e12;

/// Condition with rows and columns scaled by largest entries up to which pivots chosen by them have digits.
const SEEN: f64 = 1e15;

/// Condition with rows and columns scaled above which a matrix is singular for doubles, whatever
/// its rounded entries are.
const SINGULAR: f64 = 1e17;

/// Conditions are compared up to here: beyond it the factors that estimate them have no digits.
const COMPARED: f64 = 1e13;

/// Largest error of a solution that may be claimed: one digit is right.
const CLAIMED: f64 = 0.5;

/// Backends that exchange rows as far as is needed.
const PIVOTING: [&str; 5] = [
    "dense:double",
    "dense:extended",
    "faer:lu",
    "umfpack",
    "umfpack:refinement=0",
];

/// Other direct ones, for symmetric matrices.
const ORDERED: [&str; 5] = [
    "banded",
    "faer:llt",
    "faer:ldlt",
    "faer:lblt",
    "nalgebra-sparse",
];

/// Iterative backends.
const ITERATIVE: [&str; 4] = ["cg:none", "cg:jacobi", "minres", "gauss-seidel:joints"];

/// Something that is wrongly claimed of a system.
#[derive(Debug, Clone)]
pub struct Fault {
    pub kind: &'static str,
    /// Who tells what, and what is so.
    pub numbers: String,
}

/// Result of judging one system.
#[derive(Debug, Clone, Default)]
pub struct Judgement {
    /// All that is wrong.
    pub faults: Vec<Fault>,
    /// Each estimate of a condition over the condition.
    pub ratios: Vec<f64>,
    /// Direct solutions claimed.
    pub claims: usize,
}

impl Judgement {
    fn fault(&mut self, kind: &'static str, numbers: String) {
        self.faults.push(Fault { kind, numbers });
    }
}

/// The compiled ones among backends by name.
fn compiled(names: &[&str]) -> Vec<Backend> {
    let backends = names.iter().filter_map(|name| name.parse().ok());
    backends.filter(Backend::is_compiled).collect()
}

/// Judges the claims on the system of a seed.
pub fn judge(seed: u64) -> Judgement {
    let drawn = Drawn::of_seed(seed);
    let mut verdict = Judgement::default();
    let truth = Truth::of(&drawn);
    let path = Path::new("drawn.mtx");
    let (matrix, dropped) = match matrix_of(&drawn.market, path) {
        Ok(read) => read,
        Err(e) => {
            if truth.least < SINGULAR || !e.message.contains("singular") {
                verdict.fault("refused at reading", e.to_string());
            }
            return verdict;
        }
    };
    pattern(&drawn, &matrix, &mut verdict);
    let problem = Problem::new(&matrix);
    conditions(&drawn, &truth, &problem, &mut verdict);
    for backend in compiled(&PIVOTING).into_iter().chain(compiled(&ORDERED)) {
        solve(&drawn, &truth, &problem, &backend, &mut verdict);
        solve_after(&drawn, &truth, &matrix, &backend, &mut verdict);
    }
    if let Matrix::Symmetric(_) = matrix {
        // This matrix again, in the form for matrices that need not be symmetric.
        let whole = GeneralMatrix::from_entries(drawn.dim(), drawn.entries());
        let general = Matrix::General(whole.expect("indices within the dimension"));
        let problem = Problem::new(&general);
        for backend in compiled(&PIVOTING) {
            solve(&drawn, &truth, &problem, &backend, &mut verdict);
        }
    }
    let system = System {
        name: "drawn".to_owned(),
        matrix,
        dropped,
        b: truth.b.clone(),
        from: RightHandSide::File(PathBuf::from("drawn_b.mtx")),
        x: None,
    };
    words((&drawn, &truth), &system, &mut verdict);
    verdict
}

/// Zeros make no pattern.
fn pattern(drawn: &Drawn, matrix: &Matrix, verdict: &mut Judgement) {
    let mut zeros = 0;
    if drawn.market.blocks.is_empty() {
        matrix.for_each(|r, c, a| zeros += usize::from(a == 0.0 && r != c));
    }
    if zeros > 0 {
        verdict.fault("zeros in the pattern", format!("{zeros}"));
    }
}

fn conditions(drawn: &Drawn, truth: &Truth, problem: &Problem<'_>, verdict: &mut Judgement) {
    if truth.scaled > COMPARED || truth.condition > COMPARED {
        return;
    }
    let Some(found) = condition(problem) else {
        verdict.fault("no condition", format!("{:.1e}", truth.condition));
        return;
    };
    let mut compared = vec![(found.of_matrix, truth.condition)];
    if drawn.market.symmetric {
        compared.push((found.scaled, truth.symmetrically_scaled));
    }
    for (found, right) in compared {
        let ratio = found / right;
        verdict.ratios.push(ratio);
        if !(0.1..=1.01).contains(&ratio) {
            verdict.fault("condition", format!("{found:.3e} for {right:.3e}"));
        }
    }
}

/// One direct backend.
fn solve(
    drawn: &Drawn,
    truth: &Truth,
    problem: &Problem<'_>,
    backend: &Backend,
    verdict: &mut Judgement,
) {
    let mut x = vec![0.0; drawn.dim()];
    let solved = problem.analyze(backend).and_then(|mut solver| {
        solver.factorize()?;
        solver.solve(&truth.b, &mut x)
    });
    judge_claim(
        (drawn, truth),
        problem.matrix,
        backend,
        (solved, &x, scaled_error),
        verdict,
    );
}

/// One direct backend on a symmetric matrix after another of this pattern, whose entries are the absolute values: with a
/// judged solution, and with one that is refined once.
fn solve_after(
    drawn: &Drawn,
    truth: &Truth,
    matrix: &Matrix,
    backend: &Backend,
    verdict: &mut Judgement,
) {
    let Matrix::Symmetric(a) = matrix else { return };
    let (n, b) = (drawn.dim(), &truth.b);
    let mut other = a.clone();
    other.values_mut().iter_mut().for_each(|v| *v = v.abs());
    for sweeps in [0, 1] {
        let mut x = vec![0.0; n];
        let solved = backend.create().and_then(|mut solver| {
            solver.analyze(a.pattern())?;
            if solver.factorize(&other).is_ok() {
                // What it tells of the other matrix is judged elsewhere.
                let _ = solver.solve(&other, b, &mut x);
            }
            solver.factorize(a)?;
            if sweeps == 0 {
                return solver.solve(a, b, &mut x);
            }
            let first = solver.solve_unjudged(a, b, &mut x)?;
            let residual = |x: &[f64], r: &mut [f64]| a.subtract_product(b, x, r);
            let mut scratch = RefineScratch::new(n);
            let last = refine(&mut *solver, a, &mut x, &mut scratch, sweeps, residual)?;
            Ok(last.unwrap_or(first))
        });
        let error: ErrorOf = if sweeps == 0 {
            scaled_error
        } else {
            largest_error
        };
        judge_claim(
            (drawn, truth),
            matrix,
            backend,
            (solved, &x, error),
            verdict,
        );
    }
}

/// The condition by which a system has to be solved: what the best units of rows and columns leave, where a factorisation that
/// compares rows by their largest entries can see it.
fn condition_by_units(drawn: &Drawn, truth: &Truth) -> f64 {
    let seen = truth.scaled < SEEN && drawn.kind != Kind::Growth;
    match seen || drawn.kind == Kind::Bidiagonal {
        true => truth.least,
        false => truth.scaled,
    }
}

/// Relative error of a solution, in some norm.
type ErrorOf = fn(&[f64], &Truth) -> Option<f64>;

/// Judges a report and its solution, or a refusal. A refined solution is judged in the largest norm,
/// as [`refine`] compares its corrections.
fn judge_claim(
    (drawn, truth): (&Drawn, &Truth),
    matrix: &Matrix,
    backend: &Backend,
    (solved, x, error_of): (Result<SolveReport, SolveError>, &[f64], ErrorOf),
    verdict: &mut Judgement,
) {
    let form = match matrix {
        Matrix::Symmetric(_) => "",
        Matrix::General(_) => "/general",
    };
    let described = |what: String| {
        format!(
            "{backend}{form}: {what}, condition {:.1e}, scaled {:.1e}, at best {:.1e}",
            truth.condition, truth.scaled, truth.least
        )
    };
    let pivots = PIVOTING.contains(&backend.to_string().as_str()) || backend.name() == "dense";
    let solvable = condition_by_units(drawn, truth) < SOLVABLE && (pivots || drawn.is_definite());
    match solved {
        Ok(report) if report.status == Status::Direct => {
            verdict.claims += 1;
            // Where 32 digits do not confirm it, all digits decide.
            let is_right = |error: &Option<f64>| error.is_some_and(|e| e <= CLAIMED);
            let in_full = || {
                let x_in_full = exact::solution(&drawn.full(), &truth.b);
                let truth = truth.clone().with(|p| p.x = x_in_full);
                error_of(x, &truth)
            };
            if !is_right(&error_of(x, truth))
                && let error = in_full()
                && !is_right(&error)
            {
                verdict.fault("false claim", described(format!("error {error:?}")));
            }
            let left = matrix.backward_error(&truth.b, x);
            let left = left.map_or(f64::NAN, |e| e.normwise);
            if left.is_nan() || left > 1e-13 {
                verdict.fault(
                    "claimed residual",
                    described(format!("backward error {left:.1e}")),
                );
            }
        }
        Ok(report) if solvable && truth.of_solution < SOLVABLE && drawn.kind != Kind::Growth => {
            verdict.fault("no claim", described(format!("{:?}", report.status)));
        }
        Err(e) if solvable => verdict.fault("refused", described(e.to_string())),
        _ => {}
    }
}

/// Checks the words of `taut solve`: whether it calls a matrix singular, and how it refuses.
fn words((drawn, truth): (&Drawn, &Truth), system: &System, verdict: &mut Judgement) {
    let singular = truth.least > SINGULAR;
    if !singular && condition_by_units(drawn, truth) > SOLVABLE {
        return;
    }
    let names = if singular {
        [&ORDERED[..1], &PIVOTING, &ITERATIVE].concat()
    } else {
        ORDERED.to_vec()
    };
    let config =
        Config::default().with(|p| (p.backends, p.budget) = (compiled(&names), Duration::ZERO));
    let results = run(system, &config);
    if !singular {
        let called = |o: &&Omission| o.reason.contains("is singular");
        if let Some(Omission { backend, reason }) = results.omissions.iter().find(called) {
            verdict.fault("called singular", format!("{backend}: {reason}"));
        }
        return;
    }
    let converged = results.records.iter().filter(|r| r.status == CONVERGED);
    // What is singular to rounding may have a solution yet.
    let is_regular = || exact::solution(&drawn.full(), &truth.b).is_some();
    let first = converged.clone().find(|r| r.forward_error.is_some());
    if let Some(first) = first.filter(|_| !is_regular()) {
        let error = first.forward_error;
        verdict.fault(
            "error of one of many",
            format!("{}: {error:?}", first.backend),
        );
    }
    let about = &results.about;
    let is_known = || about.solution.starts_with("refined") && is_regular();
    if converged.count() > 0 && !about.solution.contains("singular") && !is_known() {
        verdict.fault("not said to be singular", results.about.solution.clone());
    }
    // Nobody solved it: the first that is told of has to be that it is singular.
    if let Some(text) = results.refusal()
        && !text.contains("is singular")
    {
        verdict.fault("refusal", text);
    }
}

/// Largest magnitude of the components of x over the scales of their columns.
fn size(x: &[f64], scale: &[f64]) -> f64 {
    norm_inf(&x.iter().zip(scale).map(|(x, c)| x / c).collect::<Vec<_>>())
}
