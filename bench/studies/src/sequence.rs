//! Sequences of systems: what every solver costs and how wrong it is, step by step, with one analysis for each pattern.
//!
//! The systems are those of consecutive steps, as [`taut_ground::matrix::sequence`] reads them. A solver analyses each
//! pattern once and factorises the matrix of every step; an iteration starts from its solution of the step before. The
//! whole is done three times, from a cold start each: times are the least of the passes, errors the same in all.

mod study;

pub(crate) use study::STUDY;

use crate::cases::Cases;
use serde::{Deserialize, Serialize};
use std::time::Instant;
use taut_ground::choice::{Choice, Omission};
use taut_ground::errors::worse;
use taut_ground::matrix::sequence::{FORMS, Sequence, Stretch, Systems};
use taut_ground::trajectory::Timing;
use taut_output::check::ExperimentError;
use taut_solver::{SolveError, Status, backward_error, forward_error};

/// Passes through the sequence.
const PASSES: usize = 3;

/// Rows beyond which the dense solver is left out unless it is asked for.
const DENSE_ROWS: usize = 300;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Solvers; iterative ones run over the limits of iterations.
    pub choices: Vec<Choice>,
    /// The solvers were asked for by name.
    pub named: bool,
    pub iterations: Vec<usize>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            choices: Choice::all(),
            named: false,
            iterations: vec![10, 100],
        }
    }
}

/// A solver on a sequence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Backend and form, without iterations.
    pub backend: String,
    /// All options of the backend, as the command line reads them.
    pub options: String,
    /// Limit of iterations; 0 for direct solvers.
    pub iterations: usize,
    /// Mean iterations of a step.
    pub iterations_used: f64,
    /// Steps solved: all of them, or those before the one that failed.
    pub steps: usize,
    /// Analyses, one for each pattern.
    pub analyses: usize,
    /// Analysis, the longest \[ns].
    pub analyze_ns: f64,
    /// Factorisation, median of the steps \[ns].
    pub factorize_ns: f64,
    /// Solve, median of the steps \[ns].
    pub solve_ns: f64,
    /// Factorisation and solve, the longest of the steps \[ns].
    pub longest_ns: f64,
    /// Steps whose solver claims a solution.
    pub claimed: usize,
    /// Normwise backward error, largest of the steps.
    pub backward_error: f64,
    /// Componentwise backward error, largest of the steps.
    pub backward_error_componentwise: f64,
    /// ‖x − x*‖∞ / ‖x*‖∞, largest of the steps; none where x* is not known.
    pub forward_error: Option<f64>,
    /// The step with this error.
    pub worst_step: Option<u64>,
    /// Factorisation of each step \[ns].
    pub factorize_ns_by_step: Vec<f64>,
    /// Solve of each step \[ns].
    pub solve_ns_by_step: Vec<f64>,
    /// Iterations of each step; none of direct solvers.
    pub iterations_by_step: Option<Vec<usize>>,
    pub forward_error_by_step: Option<Vec<f64>>,
    /// Why it ended before the last step.
    pub error: Option<String>,
}

/// All rows, and what is missing.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    /// Rows, solvers in the order asked for, iterations ascending.
    pub records: Vec<Record>,
    #[serde(skip)]
    pub omissions: Vec<Omission>,
}

/// Runs all solvers through a sequence, one after the other. What is not known of the exact solutions is found before the first.
///
/// # Errors
/// Errors of the cases; a solver's own failure is a row.
pub fn run(
    sequence: &mut Sequence,
    config: &Config,
    cases: &Cases,
) -> Result<Results, ExperimentError> {
    let mut omissions = Vec::new();
    let mut tasks = Vec::new();
    for choice in &config.choices {
        if let Some(reason) = left_out(sequence, choice, config.named) {
            omissions.push(Omission {
                backend: choice.family(),
                reason,
            });
        } else if choice.backend.is_iterative() {
            tasks.extend(config.iterations.iter().map(|&limit| (choice, limit)));
        } else {
            tasks.push((choice, 0));
        }
    }
    let mut is_solved = false;
    let records = cases.in_turn("solvers", &tasks, |&(choice, limit)| {
        if !std::mem::replace(&mut is_solved, true) {
            let systems = sequence.stretches.iter_mut().flat_map(|s| &mut s.systems);
            systems.for_each(Systems::solve_exactly);
        }
        Ok::<_, ExperimentError>(row(sequence, choice, limit))
    })?;
    Ok(Results {
        records: records.all()?,
        omissions,
    })
}

fn left_out(sequence: &Sequence, choice: &Choice, named: bool) -> Option<String> {
    if let Err(e) = choice.check() {
        return Some(e.to_string());
    }
    let stretches = sequence.stretches.iter();
    let rows = stretches.map(|stretch| systems(stretch, choice).first().dim());
    let rows = rows.max().unwrap_or(0);
    let is_slow = choice.backend.name() == "dense" && rows > DENSE_ROWS && !named;
    is_slow.then(|| format!("cubic cost at {rows} rows; ask for it with --backends"))
}

/// The systems that a solver is given.
fn systems<'a>(stretch: &'a Stretch, choice: &Choice) -> &'a Systems {
    let form = FORMS.iter().position(|form| *form == choice.form);
    &stretch.systems[form.unwrap_or_default()]
}

/// Measurements of a solver, step by step.
#[derive(Default)]
struct Steps {
    analyze_ns: Vec<f64>,
    factorize_ns: Vec<f64>,
    solve_ns: Vec<f64>,
    iterations: Vec<usize>,
    claimed: usize,
    normwise: f64,
    componentwise: f64,
    errors: Option<Vec<f64>>,
}

fn row(sequence: &Sequence, choice: &Choice, limit: usize) -> Record {
    let choice = Choice {
        backend: match limit {
            0 => choice.backend.clone(),
            _ => choice.backend.with_iterations(limit),
        },
        form: choice.form,
    };
    let mut steps = Steps::default();
    let told = |e: SolveError, steps: &Steps| {
        let step = sequence.first + steps.solve_ns.len() as u64;
        format!("step {step}: {e}")
    };
    let mut failed = go_through(sequence, &choice, &mut steps)
        .err()
        .map(|e| told(e, &steps));
    for _ in 1..PASSES {
        let mut again = Steps::default();
        let result = go_through(sequence, &choice, &mut again);
        failed = failed.or(result.err().map(|e| told(e, &again)));
        let shorten = |times: &mut [f64], again: &[f64]| {
            times
                .iter_mut()
                .zip(again)
                .for_each(|(a, b)| *a = a.min(*b));
        };
        shorten(&mut steps.analyze_ns, &again.analyze_ns);
        shorten(&mut steps.factorize_ns, &again.factorize_ns);
        shorten(&mut steps.solve_ns, &again.solve_ns);
    }
    record(&choice, limit, sequence.first, steps, failed)
}

/// One pass: the steps until one fails.
fn go_through(sequence: &Sequence, choice: &Choice, steps: &mut Steps) -> Result<(), SolveError> {
    let since = |start: Instant| start.elapsed().as_nanos() as f64;
    for stretch in &sequence.stretches {
        let systems = systems(stretch, choice);
        let mut matrix = systems.first();
        let mut solver = choice.backend.create()?;
        let start = Instant::now();
        solver.analyze(matrix.pattern())?;
        steps.analyze_ns.push(since(start));
        let mut x = vec![0.0; matrix.dim()];
        for (step, b) in systems.rhs.iter().enumerate() {
            systems.put(step, &mut matrix);
            let start = Instant::now();
            solver.factorize(&matrix)?;
            let factorized = since(start);
            let start = Instant::now();
            let report = solver.solve(&matrix, b, &mut x)?;
            steps.solve_ns.push(since(start));
            steps.factorize_ns.push(factorized);
            steps.iterations.push(report.iterations);
            steps.claimed +=
                usize::from(matches!(report.status, Status::Direct | Status::Converged));
            let errors = backward_error(&matrix, b, &x)?;
            steps.normwise = worse(steps.normwise, errors.normwise);
            steps.componentwise = worse(steps.componentwise, errors.componentwise);
            if let Some(exact) = &systems.exact {
                let error = forward_error(&x, &exact[step]);
                steps.errors.get_or_insert_default().push(error);
            }
        }
    }
    Ok(())
}

fn record(
    choice: &Choice,
    limit: usize,
    first: u64,
    steps: Steps,
    error: Option<String>,
) -> Record {
    let count = steps.solve_ns.len();
    let median = |times: &[f64]| {
        let nanoseconds = times.iter().map(|ns| *ns as u64);
        Timing::of(nanoseconds.map(std::time::Duration::from_nanos)).median
    };
    let both = steps.factorize_ns.iter().zip(&steps.solve_ns);
    let largest = |all: &[f64]| all.iter().copied().reduce(worse);
    // A stretch without exact solutions leaves the steps of others without their places.
    let errors = steps.errors.filter(|errors| errors.len() == count);
    let forward_error = errors.as_deref().and_then(largest);
    let worst = |errors: &Vec<f64>| errors.iter().position(|e| Some(*e) == forward_error);
    let worst_step = errors.as_ref().and_then(worst);
    let iterations: usize = steps.iterations.iter().sum();
    Record {
        backend: choice.family(),
        options: choice.to_string(),
        iterations: limit,
        iterations_used: iterations as f64 / count.max(1) as f64,
        steps: count,
        analyses: steps.analyze_ns.len(),
        analyze_ns: largest(&steps.analyze_ns).unwrap_or(f64::NAN),
        factorize_ns: median(&steps.factorize_ns),
        solve_ns: median(&steps.solve_ns),
        longest_ns: both.map(|(a, b)| a + b).reduce(worse).unwrap_or(f64::NAN),
        claimed: steps.claimed,
        backward_error: steps.normwise,
        backward_error_componentwise: steps.componentwise,
        forward_error,
        worst_step: worst_step.map(|at| first + at as u64),
        factorize_ns_by_step: steps.factorize_ns,
        solve_ns_by_step: steps.solve_ns,
        iterations_by_step: (limit > 0).then_some(steps.iterations),
        forward_error_by_step: errors,
        error,
    }
}
