//! Every backend on a system: what its phases take and how wrong its solution is.
//!
//! Times are minima of repeats, each phase by itself: analysis, factorisation, solve. Errors are those of the last
//! solve: η and ω of the module `accuracy` in the solver crate, and the forward error against x of the file, else
//! against the solution in extended precision ([`super::exact`]) where there is one.

use super::exact::{Regularity, exchanges_rows, regularity, solution};
use super::prepared::Problem;
use super::{Matrix, RightHandSide, System};
use crate::choice::{Choice, Omission};
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};
use taut_solver::{Backend, FaerFactorization, SolveError, Status, forward_error};

/// Rows beyond which the dense solver has no rows unless it is asked for.
pub const DENSE_ROWS: usize = 1500;

/// Rows beyond which nalgebra-sparse, whose analysis is quadratic, has no rows unless asked for.
pub const NALGEBRA_ROWS: usize = 30_000;

/// Claim of a direct backend.
pub const DIRECT: &str = "direct";

/// Claim of an iteration that met its tolerance.
pub const CONVERGED: &str = "converged";

/// Status of a solution of which nothing is claimed.
pub const STALLED: &str = "stalled";

/// Claim of an iteration that ran out of iterations.
const LIMIT: &str = "limit";

/// How a solve ended, as rows say it.
pub fn status(of: Status) -> &'static str {
    match of {
        Status::Direct => DIRECT,
        Status::Converged => CONVERGED,
        Status::IterationLimit => LIMIT,
        _ => STALLED,
    }
}

/// Factorisations and solves for each analysis.
const REUSES: usize = 4;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Backends; those that cannot or need not run are left out, with the reason.
    pub backends: Vec<Backend>,
    /// The backends were asked for by name.
    pub named: bool,
    /// Limits of iterations for the iterative backends; empty keeps their own.
    pub iterations: Vec<usize>,
    /// Time that the repeats of one row aim at.
    pub budget: Duration,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            backends: backends(),
            named: false,
            iterations: Vec::new(),
            budget: Duration::from_millis(200),
        }
    }
}

/// Every backend that is worth a row, whether compiled in or not.
pub fn backends() -> Vec<Backend> {
    let mut backends: Vec<Backend> = Vec::new();
    for choice in Choice::all() {
        let backend = refining(choice.backend);
        if !backends.contains(&backend) {
            backends.push(backend);
        }
    }
    backends
}

/// The backend; UMFPACK as it is by default, with the refinement that it has no use for where the pieces refine.
pub fn refining(backend: Backend) -> Backend {
    match backend {
        Backend::Umfpack(_) => Backend::Umfpack(taut_solver::UmfpackOptions::default()),
        other => other,
    }
}

/// A system and what is known of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    pub matrix: String,
    pub dim: usize,
    /// Block rows.
    pub blocks: usize,
    /// Entries of both triangles.
    pub entries: usize,
    /// Entries of the file that were added to earlier ones at the same place.
    pub duplicates: usize,
    /// Zeros of the file, which were dropped.
    pub zeros: usize,
    pub symmetric: bool,
    /// Order in which those backends eliminate that keep it: `natural`, `minimum-degree`; none for general matrices and
    /// where the fill is out of reach.
    pub order: Option<String>,
    /// Entries of the block factor in this order.
    pub factor_entries: Option<u64>,
    /// Floating-point operations of that factorisation.
    pub factor_flops: Option<u64>,
    /// Estimate of the condition number in the ∞-norm.
    pub condition: Option<f64>,
    /// Condition number after scaling rows and columns to one size.
    pub condition_scaled: Option<f64>,
    /// Origin of b, in words.
    pub right_hand_side: String,
    /// Reference of the forward errors, in words.
    pub solution: String,
    /// Why it is singular, where it is.
    pub singular: Option<String>,
}

/// One row: a backend on a system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SystemRow {
    pub matrix: String,
    /// Backend without iterations and tolerance.
    pub backend: String,
    /// All its options, as the command line reads them.
    pub options: String,
    pub dim: usize,
    /// Block rows.
    pub blocks: usize,
    /// Limit of iterations; 0 for direct backends.
    pub iterations: usize,
    /// Iterations made.
    pub iterations_used: usize,
    /// Claim of the backend: `direct`, `converged`, `limit`, `stalled`.
    pub status: String,
    /// Analysis of the pattern, minimum \[ns].
    pub analyze_ns: f64,
    /// Factorisation, minimum \[ns].
    pub factorize_ns: f64,
    /// Solve, minimum \[ns].
    pub solve_ns: f64,
    /// Factorisation and solve over the number of block rows \[ns].
    pub ns_per_block_row: f64,
    /// Factorisation and solve over those of the fastest on this matrix that did not run out of iterations.
    pub ratio: f64,
    /// Repeats that the minima are of.
    pub repeats: usize,
    /// ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞).
    pub backward_error: f64,
    /// maxᵢ |b − A x|ᵢ / (|A| |x| + |b|)ᵢ.
    pub backward_error_componentwise: f64,
    /// ‖x − x*‖∞ / ‖x*‖∞, where x* is known.
    pub forward_error: Option<f64>,
    /// Entries of the factor, where the backend knows it beforehand.
    pub factor_entries: Option<usize>,
}

impl SystemRow {
    /// Factorisation and solve \[ns].
    pub fn total_ns(&self) -> f64 {
        self.factorize_ns + self.solve_ns
    }

    /// True if the backend is direct or its iteration converged.
    pub fn ended(&self) -> bool {
        [DIRECT, CONVERGED].contains(&self.status.as_str())
    }
}

/// Measurements of one system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// The system.
    pub about: About,
    /// Its rows, in the order of the backends.
    pub records: Vec<SystemRow>,
    pub omissions: Vec<Omission>,
}

impl Results {
    /// Why there is no row at all, where there is none: that it is singular, or the first reason that is more than that a
    /// backend is for symmetric matrices.
    pub fn refusal(&self) -> Option<String> {
        let first = self.omissions.first().filter(|_| self.records.is_empty())?;
        if let Some(singular) = &self.about.singular {
            return Some(format!("{}: {singular}", self.about.matrix));
        }
        let telling = |o: &&Omission| !o.reason.contains("is for symmetric matrices");
        let omission = self.omissions.iter().find(telling).unwrap_or(first);
        Some(format!(
            "{}: no backend solves it. {}: {}",
            self.about.matrix, omission.backend, omission.reason
        ))
    }
}

/// Runs all backends on a system, one after the other. A backend that fails is an omission with its reason.
pub fn run(system: &System, config: &Config) -> Results {
    let problem = Problem::new(&system.matrix);
    let regularity = regularity(&problem);
    let singular = (regularity == Regularity::Singular).then(|| singular(&system.matrix));
    let (exact, provenance) = match (&singular, &system.x) {
        (Some(_), Some((x, path))) => (
            Some(x.clone()),
            format!(
                "{}; the matrix is singular to rounding: others may solve it too",
                path.display()
            ),
        ),
        (Some(_), None) => (
            None,
            "not determined in doubles, the matrix is singular to rounding: errors mean nothing"
                .to_owned(),
        ),
        (None, _) => exact_solution(system, &problem),
    };
    let mut about = about(system, &problem, regularity, provenance);
    about.singular = singular;
    let (mut records, mut omissions) = (Vec::new(), Vec::new());
    for backend in &config.backends {
        let name = Choice::schur(backend.clone()).family();
        let mut omit = |reason: String| {
            omissions.push(Omission {
                backend: name.clone(),
                reason,
            });
        };
        if let Some(reason) = left_out(system, backend, config) {
            omit(reason);
            continue;
        }
        for limit in limits(backend, config) {
            let backend = match limit {
                0 => backend.clone(),
                limit => backend.with_iterations(limit),
            };
            match row(system, &problem, &backend, exact.as_deref(), config.budget) {
                Ok(row) => {
                    let done = row.iterations_used < limit;
                    records.push(row);
                    if done {
                        break;
                    }
                }
                Err(e) => {
                    omit(refusal(&e, &problem, &backend, regularity));
                    break;
                }
            }
        }
    }
    let none_ended = records.iter().all(|r| r.status == LIMIT);
    let fastest = records
        .iter()
        .filter(|r| none_ended || r.status != LIMIT)
        .map(SystemRow::total_ns)
        .fold(f64::INFINITY, f64::min);
    for record in &mut records {
        record.ratio = record.total_ns() / fastest;
    }
    Results {
        about,
        records,
        omissions,
    }
}

/// Why a matrix is singular, with rows and columns counted from 1.
fn singular(a: &Matrix) -> String {
    let mut full = [(); 2].map(|()| vec![false; a.dim()]);
    a.for_each(|r, c, value| {
        if value != 0.0 {
            (full[0][r], full[1][c]) = (true, true);
        }
    });
    let empty = |full: &[bool]| full.iter().position(|full| !full);
    match (empty(&full[0]), empty(&full[1])) {
        (Some(row), _) => format!("the matrix is singular, row {} holds nothing", row + 1),
        (_, Some(column)) => format!("the matrix is singular, column {} holds nothing", column + 1),
        _ => "the matrix is singular to rounding: rows depend on others, remove them or add compliance"
            .to_owned(),
    }
}

/// Message of a backend's refusal. Rows, or blocks of several rows, are counted as in the file. If
/// a pivot vanishes though the matrix is regular, the message says so and suggests other backends.
fn refusal(
    e: &SolveError,
    problem: &Problem<'_>,
    backend: &Backend,
    regularity: Regularity,
) -> String {
    let block = match e {
        SolveError::Singular { block }
        | SolveError::NotPositiveDefinite { block }
        | SolveError::NonFinite { block, .. }
        | SolveError::OutOfRange { block } => *block,
        _ => return e.to_string(),
    };
    let place = problem.place(backend, block);
    let order = match backend {
        Backend::Faer(o) if o.factorization == FaerFactorization::Lblt => {
            "where pivots are sought within panels only"
        }
        _ => "in this order",
    };
    match (e, regularity) {
        // Another solves it: which of them is right stays open.
        (SolveError::Singular { .. }, Regularity::Regular(_)) if exchanges_rows(backend) => {
            format!("at {place} it is nearer to a singular matrix than rounding tells apart")
        }
        (SolveError::Singular { .. }, Regularity::Regular(_)) if backend.is_iterative() => {
            "the right-hand side lies along what it takes for the null space, though the matrix is regular: choose a direct backend".to_owned()
        }
        (SolveError::Singular { .. }, Regularity::Regular(_)) => format!(
            "a pivot of {place} vanishes {order} though the matrix is regular: choose a backend that exchanges rows \
             (umfpack, faer:lu, dense)"
        ),
        (SolveError::Singular { .. }, Regularity::Unknown) if !exchanges_rows(backend) => format!(
            "a pivot of {place} vanishes {order}: choose a backend that exchanges rows (umfpack, faer:lu, dense)"
        ),
        (SolveError::Singular { .. }, Regularity::Singular) => {
            format!("the matrix is singular to rounding at {place}")
        }
        _ => e.to_string().replace(&format!("block {block}"), &place),
    }
}

fn about(
    system: &System,
    problem: &Problem<'_>,
    regularity: Regularity,
    solution: String,
) -> About {
    let ordered = problem.ordered.as_ref().and_then(|o| o.as_ref().ok());
    let condition = match regularity {
        Regularity::Regular(condition) => Some(condition),
        _ => None,
    };
    About {
        matrix: system.name.clone(),
        dim: system.matrix.dim(),
        blocks: system.matrix.blocks(),
        entries: system.matrix.entries(),
        duplicates: system.dropped.duplicates,
        zeros: system.dropped.zeros,
        singular: None,
        symmetric: matches!(system.matrix, Matrix::Symmetric(_)),
        order: ordered.map(|ordered| ordered.name().to_owned()),
        factor_entries: ordered.map(|o| o.cost.entries),
        factor_flops: ordered.map(|o| o.cost.flops),
        condition: condition.map(|c| c.of_matrix),
        condition_scaled: condition.map(|c| c.scaled),
        right_hand_side: match &system.from {
            RightHandSide::File(path) => path.display().to_string(),
            RightHandSide::Ones { exact: true } => "A·1, exactly".to_owned(),
            RightHandSide::Ones { exact: false } => "A·1, rounded".to_owned(),
        },
        solution,
    }
}

/// The solution that errors refer to, and what it is.
fn exact_solution(system: &System, problem: &Problem<'_>) -> (Option<Vec<f64>>, String) {
    if let Some((x, path)) = &system.x {
        return (Some(x.clone()), path.display().to_string());
    }
    let ones = vec![1.0; system.b.len()];
    if system.from == (RightHandSide::Ones { exact: true }) {
        return (Some(ones), "1, exactly".to_owned());
    }
    match (solution(problem, &system.b), &system.from) {
        (Some((x, by)), RightHandSide::Ones { .. }) => {
            let off = forward_error(&x, &ones);
            let about = format!(
                "1 but for {off:.1e}, from the rounding of b: refined in 32 digits by {by}"
            );
            (Some(x), about)
        }
        (Some((x, by)), RightHandSide::File(_)) => {
            (Some(x), format!("refined in 32 digits by {by}"))
        }
        (None, _) => {
            let about = match &problem.ordered {
                Some(Err(_)) => "not known: the matrix fills beyond reach",
                _ => {
                    "not known: no refinement in 32 digits contracts, as for a matrix that is nearly singular or whose scales differ too much"
                }
            };
            (None, about.to_owned())
        }
    }
}

/// Why a backend is not run.
fn left_out(system: &System, backend: &Backend, config: &Config) -> Option<String> {
    if let Err(e) = backend.create() {
        return Some(e.to_string());
    }
    let symmetric = match &system.matrix {
        Matrix::General(_) if !backend.accepts_unsymmetric() => {
            let backend = backend.name();
            return Some(SolveError::NotSymmetric { backend }.to_string());
        }
        Matrix::General(_) => None,
        Matrix::Symmetric(a) => Some(a),
    };
    if config.named {
        return None;
    }
    let of_one = |groups: &[u32]| groups.iter().all(|g| *g == groups[0]);
    if backend.factorizes_groups() && symmetric.is_some_and(|a| of_one(a.pattern().groups())) {
        return Some("the matrix has one group only: it would be a direct solver".to_owned());
    }
    let most = match backend {
        Backend::Dense(_) => DENSE_ROWS,
        Backend::NalgebraSparse => NALGEBRA_ROWS,
        _ => usize::MAX,
    };
    let rows = system.b.len();
    (rows > most).then(|| {
        format!("takes too long at {rows} rows, more than {most}: ask for it with --backends")
    })
}

/// The limits of iterations that a backend is run with; 0 for its own.
fn limits(backend: &Backend, config: &Config) -> Vec<usize> {
    if backend.is_iterative() && !config.iterations.is_empty() {
        config.iterations.clone()
    } else {
        vec![0]
    }
}

fn row(
    system: &System,
    problem: &Problem<'_>,
    backend: &Backend,
    exact: Option<&[f64]>,
    budget: Duration,
) -> Result<SystemRow, SolveError> {
    let n = system.matrix.dim();
    let mut x = vec![0.0; n];
    let mut shortest = [f64::INFINITY; 3];
    let begin = Instant::now();
    let mut repeats = 0;
    let mut shorter = |phase: usize, since: Instant| {
        shortest[phase] = shortest[phase].min(since.elapsed().as_nanos() as f64);
    };
    let (report, factor_entries) = 'measured: loop {
        let time = Instant::now();
        let mut prepared = problem.analyze(backend)?;
        shorter(0, time);
        // Some libraries end their analysis in the first factorisation.
        for _ in 0..REUSES {
            let time = Instant::now();
            prepared.factorize()?;
            shorter(1, time);
            // The first solution by a factor may estimate its condition.
            x.fill(0.0);
            prepared.solve(&system.b, &mut x)?;
            x.fill(0.0);
            let time = Instant::now();
            let report = prepared.solve(&system.b, &mut x)?;
            shorter(2, time);
            repeats += 1;
            if begin.elapsed() >= budget {
                break 'measured (report, prepared.report.factor_entries);
            }
        }
    };
    let errors = system.matrix.backward_error(&system.b, &x)?;
    let [analyze_ns, factorize_ns, solve_ns] = shortest;
    Ok(SystemRow {
        matrix: system.name.clone(),
        backend: Choice::schur(backend.clone()).family(),
        options: backend.to_string(),
        dim: n,
        blocks: system.matrix.blocks(),
        iterations: backend.iterations().unwrap_or(0),
        iterations_used: report.iterations,
        status: status(report.status).to_owned(),
        analyze_ns,
        factorize_ns,
        solve_ns,
        ns_per_block_row: (factorize_ns + solve_ns) / system.matrix.blocks() as f64,
        ratio: f64::NAN,
        repeats,
        backward_error: errors.normwise,
        backward_error_componentwise: errors.componentwise,
        forward_error: exact.map(|exact| forward_error(&x, exact)),
        factor_entries,
    })
}
