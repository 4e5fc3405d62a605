//! Every method on a contact problem, with every direct backend for the joints: what it takes and how wrong it is.
//!
//! All start from r = 0. The conditions are judged by u of the pieces, with the measure of [`taut_solver::coulomb`]: the
//! largest residual of a contact over the largest |q| and |ρ r|. Where a method has solved the dense problem, what W is inexact
//! by goes through it again, as in the step. Times are minima of repeats.

use super::condensed::Condensed;
use super::files::Info;
use super::{ContactProblem, ContactSolution};
use crate::choice::{Choice, Omission};
use crate::matrix::market::MarketError;
use crate::matrix::prepared::{Prepared, Problem};
use crate::matrix::solve::{Config, left_out};
use crate::matrix::{Dropped, RightHandSide, System};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;
use taut_integrator::ContactMethod;
use taut_solver::coulomb::{ConeMethod, ConeSolver, Contacts, violation};
use taut_solver::{SolveError, forward_error, norm_inf};

/// Solutions through W at most, and the violation that needs no further one.
const PASSES: (usize, f64) = (6, 1e-10);

/// Backend name for a problem without joints.
pub const NO_JOINTS: &str = "none";

/// The methods that have a row.
#[must_use]
pub fn methods() -> Vec<ContactMethod> {
    let sweeps = |sweeps| ConeMethod::GaussSeidel {
        sweeps,
        tolerance: PASSES.1,
    };
    let mut methods = vec![ContactMethod::default()];
    let more = [10, 100, 1000].map(|n| ContactMethod::Condensed(sweeps(n)));
    methods.extend(more);
    methods.push(ContactMethod::Staggered { sweeps: 10 });
    methods
}

/// A method with a backend.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The method, as the command line reads it; without the tolerance.
    pub method: String,
    /// The backend that the joints are factorised by.
    pub backend: String,
    /// Factorisation of the joints and W, minimum \[ns].
    pub condense_ns: f64,
    /// Solution of the dense problem, with all passes, minimum \[ns].
    pub solve_ns: f64,
    /// Factorisations of dense problems.
    pub pivots: usize,
    /// Sweeps over contacts, those of the island with the most.
    pub sweeps: usize,
    /// Solutions through W.
    pub passes: usize,
    /// Largest violation of the conditions, over the largest rate.
    pub complementarity: f64,
    /// Largest |r_T| − μ r_N over the largest |r|.
    pub cone: f64,
    /// Distance of v from the reference in the largest norm, over v of the reference or without impulses, whichever is
    /// larger, so that a body at rest counts by what its weight does in a step; where there is one.
    pub velocity_error: Option<f64>,
    /// Distance of r, over r of the reference.
    pub impulse_error: Option<f64>,
}

/// All methods on a problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Description of the problem.
    pub about: Info,
    /// A row a backend and method.
    pub records: Vec<Record>,
    /// Backends without rows, and why.
    pub omissions: Vec<Omission>,
}

/// Runs all methods with the direct ones of the backends.
///
/// # Errors
/// [`MarketError`] of a problem that has no W.
pub fn run(
    problem: &ContactProblem,
    info: &Info,
    folder: &Path,
    config: &Config,
) -> Result<Results, MarketError> {
    let condensed = Condensed::new(problem, folder)?;
    let mut results = Results {
        about: info.clone(),
        records: Vec::new(),
        omissions: Vec::new(),
    };
    let mut add = |backend: String, rows: Result<Vec<Record>, String>| match rows {
        Ok(rows) => results.records.extend(rows),
        Err(reason) => results.omissions.push(Omission { backend, reason }),
    };
    let Some(matrix) = &condensed.joints else {
        let rows = Bench::new(problem, &condensed, None, config).rows(NO_JOINTS);
        add(NO_JOINTS.to_owned(), rows.map_err(|e| e.to_string()));
        return Ok(results);
    };
    let schur = Problem::new(matrix);
    let system = System {
        name: info.title.clone(),
        matrix: matrix.clone(),
        dropped: Dropped::default(),
        b: Vec::new(),
        from: RightHandSide::Ones { exact: false },
        x: None,
    };
    for backend in &config.backends {
        let name = Choice::schur(backend.clone()).family();
        if backend.is_iterative() {
            if config.named {
                let reason = "is iterative: W needs a factor of the joints".to_owned();
                add(name, Err(reason));
            }
            continue;
        }
        let rows = match left_out(&system, backend, config) {
            Some(reason) => Err(reason),
            None => factorized(&schur, backend).map_or_else(
                |e| Err(e.to_string()),
                |factor| {
                    let mut bench = Bench::new(problem, &condensed, Some(factor), config);
                    bench.rows(&name).map_err(|e| e.to_string())
                },
            ),
        };
        add(name, rows);
    }
    Ok(results)
}

fn factorized<'a>(
    schur: &'a Problem<'_>,
    backend: &taut_solver::Backend,
) -> Result<Prepared<'a>, SolveError> {
    let mut factor = schur.analyze(backend)?;
    factor.factorize()?;
    Ok(factor)
}

/// A problem with a factor of its joints.
struct Bench<'a> {
    problem: &'a ContactProblem,
    condensed: &'a Condensed<'a>,
    factor: Option<Prepared<'a>>,
    config: &'a Config,
}

/// Solutions of the dense problems of all islands.
struct Dense {
    pivots: usize,
    sweeps: usize,
    solved: bool,
}

/// Solution of one method, with its effort.
struct Outcome {
    solution: ContactSolution,
    pivots: usize,
    sweeps: usize,
    passes: usize,
    complementarity: f64,
}

impl<'a> Bench<'a> {
    fn new(
        problem: &'a ContactProblem,
        condensed: &'a Condensed<'a>,
        factor: Option<Prepared<'a>>,
        config: &'a Config,
    ) -> Self {
        Self {
            problem,
            condensed,
            factor,
            config,
        }
    }

    fn rows(&mut self, backend: &str) -> Result<Vec<Record>, SolveError> {
        let (condense_ns, w) = self.least(Self::condense)?;
        let none = vec![0.0; self.problem.contact_rates.len()];
        let free = self.condensed.solution(None, &none)?.velocities;
        let mut rows = Vec::new();
        for method in methods() {
            let staggered = matches!(method, ContactMethod::Staggered { .. });
            let (condense_ns, (solve_ns, outcome)) = if staggered {
                let (ns, alone) = self.least(|bench| bench.condensed.operator(None))?;
                (ns, self.least(|bench| bench.staggered(method, &alone, &w))?)
            } else {
                (condense_ns, self.least(|bench| bench.together(method, &w))?)
            };
            let mut row = self.record(method, backend, &outcome);
            (row.condense_ns, row.solve_ns) = (condense_ns, solve_ns);
            row.velocity_error = self.problem.solution.as_ref().map(|reference| {
                let own = outcome.solution.velocities.iter();
                let apart = own.zip(&reference.velocities).map(|(a, b)| (a - b).abs());
                let size = norm_inf(&reference.velocities).max(norm_inf(&free));
                apart.fold(0.0, f64::max) / size
            });
            rows.push(row);
        }
        Ok(rows)
    }

    /// The shortest of repeats \[ns], and what the last one made.
    fn least<T>(
        &mut self,
        mut work: impl FnMut(&mut Self) -> Result<T, SolveError>,
    ) -> Result<(f64, T), SolveError> {
        let (begin, mut least) = (Instant::now(), f64::INFINITY);
        loop {
            let time = Instant::now();
            let made = work(self)?;
            least = least.min(time.elapsed().as_nanos() as f64);
            if begin.elapsed() >= self.config.budget {
                return Ok((least, made));
            }
        }
    }

    /// Factor and W.
    fn condense(&mut self) -> Result<Vec<f64>, SolveError> {
        if let Some(factor) = &mut self.factor {
            factor.factorize()?;
        }
        self.condensed.operator(self.factor.as_mut())
    }

    /// Impulses for u = W r + q, from those given.
    fn dense(
        &self,
        method: ContactMethod,
        (w, q): (&[f64], &[f64]),
        r: &mut [f64],
    ) -> Result<Dense, SolveError> {
        let sigma = self.problem.contact_regularization.as_chunks::<3>().0;
        let mut all = Dense {
            pivots: 0,
            sweeps: 0,
            solved: true,
        };
        let mut solver = ConeSolver::new();
        for island in islands(w, r.len()) {
            let rows: Vec<usize> = island.iter().flat_map(|i| 3 * i..3 * i + 3).collect();
            let of_row = |k: &usize| rows.iter().map(|l| w[k * r.len() + l]).collect::<Vec<_>>();
            let operator: Vec<f64> = rows.iter().flat_map(of_row).collect();
            let picked = |from: &[f64]| rows.iter().map(|k| from[*k]).collect::<Vec<_>>();
            let friction: Vec<f64> = island.iter().map(|i| self.problem.friction[*i]).collect();
            let least = |i: &usize| sigma[*i][0].min(sigma[*i][1]).min(sigma[*i][2]);
            let contacts = Contacts {
                operator: &operator,
                rates: &picked(q),
                friction: &friction,
                regularization: &island.iter().map(least).collect::<Vec<_>>(),
            };
            let mut own = picked(r);
            let report = solver.solve(&contacts, method.of_dense_problems(), &mut own)?;
            rows.iter().zip(own).for_each(|(k, p)| r[*k] = p);
            all.pivots += report.pivots;
            all.sweeps = all.sweeps.max(report.sweeps);
            all.solved &= report.solved;
        }
        Ok(all)
    }

    /// v, λ and u of impulses.
    fn evaluate(&mut self, r: &[f64]) -> Result<(ContactSolution, Vec<f64>), SolveError> {
        let solution = self.condensed.solution(self.factor.as_mut(), r)?;
        let rates = self.condensed.rates(&solution);
        Ok((solution, rates))
    }

    /// Contacts and joints together.
    fn together(&mut self, method: ContactMethod, w: &[f64]) -> Result<Outcome, SolveError> {
        let mut r = vec![0.0; self.problem.contact_rates.len()];
        let (_, free) = self.evaluate(&r)?;
        let (mut q, mut pivots, mut sweeps, mut passes) = (free.clone(), 0, 0, 0);
        loop {
            let report = self.dense(method, (w, &q), &mut r)?;
            (pivots, sweeps) = (pivots + report.pivots, sweeps + report.sweeps);
            passes += 1;
            let (solution, rates) = self.evaluate(&r)?;
            let complementarity = self.violation(w, &free, &r, &rates);
            if complementarity <= PASSES.1 || !report.solved || passes == PASSES.0 {
                return Ok(Outcome {
                    solution,
                    pivots,
                    sweeps,
                    passes,
                    complementarity,
                });
            }
            let moved = w.chunks_exact(r.len()).map(|row| dot(row, &r));
            q = rates
                .iter()
                .zip(moved)
                .map(|(u, moved)| u - moved)
                .collect();
        }
    }

    /// Contacts on bodies without joints, whose W is `alone`, then the joints.
    fn staggered(
        &mut self,
        method: ContactMethod,
        alone: &[f64],
        w: &[f64],
    ) -> Result<Outcome, SolveError> {
        let mut r = vec![0.0; self.problem.contact_rates.len()];
        let (_, free) = self.evaluate(&r)?;
        let unjoined = self.condensed.solution(None, &r)?;
        let q = self.condensed.rates(&unjoined);
        let report = self.dense(method, (alone, &q), &mut r)?;
        let (solution, rates) = self.evaluate(&r)?;
        Ok(Outcome {
            complementarity: self.violation(w, &free, &r, &rates),
            solution,
            pivots: report.pivots,
            sweeps: report.sweeps,
            passes: 1,
        })
    }

    /// Largest residual of a contact, over the largest |q| and |ρ r|.
    fn violation(&self, w: &[f64], q: &[f64], r: &[f64], u: &[f64]) -> f64 {
        let m = r.len();
        let mut size = q.iter().fold(0.0, |size: f64, q| size.max(q.abs()));
        let mut worst = 0.0_f64;
        for (i, &mu) in self.problem.friction.iter().enumerate() {
            let rows = [3 * i, 3 * i + 1, 3 * i + 2];
            let rho = rows.map(|k| w[k * (m + 1)]).iter().sum::<f64>() / 3.0;
            let inert = rows.map(|k| rho * r[k]);
            size = inert.iter().fold(size, |size, x| size.max(x.abs()));
            worst = worst.max(violation(inert, rows.map(|k| u[k]), mu));
        }
        if size > 0.0 { worst / size } else { worst }
    }

    /// All but times and the error of the velocities.
    fn record(&self, method: ContactMethod, backend: &str, outcome: &Outcome) -> Record {
        let r = &outcome.solution.contacts;
        let largest = norm_inf(r);
        let contacts = r.as_chunks::<3>().0.iter().zip(&self.problem.friction);
        let beyond = contacts.map(|(r, mu)| (r[1].hypot(r[2]) - mu * r[0]) / largest);
        let reference = self.problem.solution.as_ref();
        let name = method.to_string();
        Record {
            method: name.split(":tolerance").next().unwrap_or(&name).to_owned(),
            backend: backend.to_owned(),
            condense_ns: f64::NAN,
            solve_ns: f64::NAN,
            pivots: outcome.pivots,
            sweeps: outcome.sweeps,
            passes: outcome.passes,
            complementarity: outcome.complementarity,
            cone: beyond.fold(0.0, f64::max),
            velocity_error: None,
            impulse_error: reference.map(|s| forward_error(r, &s.contacts)),
        }
    }
}

/// Contacts that W couples, island by island, as the step solves them.
fn islands(w: &[f64], m: usize) -> Vec<Vec<usize>> {
    let n = m / 3;
    let couples = |i: usize, j: usize| {
        let mut rows = (3 * i..3 * i + 3).map(|k| &w[k * m + 3 * j..k * m + 3 * j + 3]);
        rows.any(|row| row.iter().any(|w| *w != 0.0))
    };
    let (mut left, mut islands): (Vec<usize>, _) = ((0..n).rev().collect(), Vec::new());
    while let Some(first) = left.pop() {
        let (mut island, mut next) = (vec![first], 0);
        while next < island.len() {
            let (coupled, others) = left.iter().partition(|j| couples(island[next], **j));
            left = others;
            let coupled: Vec<usize> = coupled;
            island.extend(coupled.into_iter().rev());
            next += 1;
        }
        island.sort_unstable();
        islands.push(island);
    }
    islands
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
