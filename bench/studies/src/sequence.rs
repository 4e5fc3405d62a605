//! Sequences of systems: what every solver costs and how wrong it is, step by step, with one analysis for each pattern.

use crate::study::question::*;
use crate::systems::{StudyResult, at_rung, entrants, rungs};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use taut_measure::choice::Choice;
use taut_measure::errors::worse;
use taut_measure::matrix::sequence::{self, FORMS, Sequence, Stretch, Systems};
use taut_measure::trajectory::Timing;
use taut_solver::{SolveError, backward_error, forward_error};

const PASSES: usize = 3;

/// Rows beyond which the dense solver is left out unless it is asked for.
const DENSE_ROWS: usize = 300;

fn systems<'a>(stretch: &'a Stretch, choice: &Choice) -> &'a Systems {
    let form = FORMS.iter().position(|form| *form == choice.form);
    &stretch.systems[form.unwrap_or_default()]
}

/// Measurements of a solver, step by step; times in ns.
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
    /// Why it ended before the last step.
    failure: Option<String>,
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
            steps.claimed += usize::from(report.is_claim());
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

impl Steps {
    /// One pass.
    fn of(sequence: &Sequence, choice: &Choice) -> Self {
        let mut steps = Self::default();
        if let Err(e) = go_through(sequence, choice, &mut steps) {
            let step = sequence.first + steps.solve_ns.len() as u64;
            steps.failure = Some(format!("step {step}: {e}"));
        }
        steps
    }

    /// With the least times of this pass and another.
    fn or_faster(mut self, other: Self) -> Self {
        for (times, others) in [
            (&mut self.analyze_ns, &other.analyze_ns),
            (&mut self.factorize_ns, &other.factorize_ns),
            (&mut self.solve_ns, &other.solve_ns),
        ] {
            let both = times.iter_mut().zip(others);
            both.for_each(|(time, other)| *time = time.min(*other));
        }
        self.failure = self.failure.or(other.failure);
        self
    }
}

/// The row of a solver: medians and the longest of the steps' times, the largest of their errors, then step by step.
fn row(sequence: &Sequence, choice: &Choice, limit: usize) -> Value {
    let passes = (0..PASSES).map(|_| Steps::of(sequence, choice));
    let steps = passes.reduce(Steps::or_faster).unwrap_or_default();
    let count = steps.solve_ns.len();
    let median = |times: &[f64]| {
        let durations = times.iter().map(|ns| Duration::from_nanos(*ns as u64));
        Timing::of(durations).median
    };
    let both = steps.factorize_ns.iter().zip(&steps.solve_ns);
    let largest = |all: &[f64]| all.iter().copied().reduce(worse);
    // A stretch without exact solutions leaves the steps of others without their places.
    let errors = steps.errors.filter(|errors| errors.len() == count);
    let forward_error = errors.as_deref().and_then(largest);
    let worst = |errors: &Vec<f64>| errors.iter().position(|e| Some(*e) == forward_error);
    let worst = errors.as_ref().and_then(worst);
    let iterations: usize = steps.iterations.iter().sum();
    json!({
        "backend": choice.family(),
        "options": choice.to_string(),
        "iterations": limit,
        "iterations_used": iterations as f64 / count.max(1) as f64,
        "steps": count,
        "analyses": steps.analyze_ns.len(),
        "analyze_ns": largest(&steps.analyze_ns),
        "factorize_ns": median(&steps.factorize_ns),
        "solve_ns": median(&steps.solve_ns),
        "longest_ns": both.map(|(a, b)| a + b).reduce(worse),
        "claimed": steps.claimed,
        "backward_error": steps.normwise,
        "backward_error_componentwise": steps.componentwise,
        "forward_error": forward_error,
        "worst_step": worst.map(|at| sequence.first + at as u64),
        "factorize_ns_by_step": steps.factorize_ns,
        "solve_ns_by_step": steps.solve_ns,
        "iterations_by_step": (limit > 0).then_some(steps.iterations),
        "forward_error_by_step": errors,
        "error": steps.failure,
    })
}

pub(crate) const STUDY: Study = Study {
    name: "sequence",
    question: question!("sequence", FUNCTIONS),
    options: Own::augment_args,
    reads: |matches| read_by(matches, "folder", sequence::files),
    run: |matches, reporter| {
        let folder = Own::from_arg_matches(matches)?.folder;
        ask(&Asked::read(matches), &folder, reporter.cases)
    },
};

const FUNCTIONS: Functions = &[(
    "rows_counts",
    Holds(|row| has_no_error(row) && has_ended(row)),
)];

#[derive(Debug, Args)]
struct Own {
    /// Folder of the sequence
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Runs all solvers through a sequence, one after the other. What is not known of the exact solutions is found before the
/// first.
fn ask(asked: &Asked, folder: &Path, cases: &Cases) -> Result<Found, ExperimentError> {
    asked.refuse_limits()?;
    let choices = asked.choices()?;
    let mut limits = vec![10, 100];
    asked.iterations(&mut limits)?;
    let mut sequence = sequence::read(folder)?;
    let (steps, patterns) = (sequence.len(), sequence.stretches.len());
    let rows = |choice: &Choice| {
        let stretches = sequence.stretches.iter();
        let rows = stretches.map(|stretch| systems(stretch, choice).first().dim());
        rows.max().unwrap_or(0)
    };
    let is_named = !asked.backends.is_empty();
    let most_dense = if is_named { usize::MAX } else { DENSE_ROWS };
    let (present, omissions) = entrants(&choices, most_dense, rows);
    let tasks: Vec<(Choice, usize)> = present
        .iter()
        .flat_map(|choice| {
            rungs(choice, &limits)
                .into_iter()
                .map(|rung| (at_rung(choice, rung), rung))
        })
        .collect();
    let mut is_solved = false;
    let records = cases.in_turn("solvers", &tasks, |(choice, limit)| {
        if !std::mem::replace(&mut is_solved, true) {
            let systems = sequence.stretches.iter_mut().flat_map(|s| &mut s.systems);
            systems.for_each(Systems::solve_exactly);
        }
        Ok::<_, ExperimentError>(row(&sequence, choice, *limit))
    })?;
    let folder = folder.display();
    let result = StudyResult {
        settings: set([
            ("sequence", folder.to_string()),
            ("systems", steps.to_string()),
            ("patterns", patterns.to_string()),
            ("solvers", solvers(&choices)),
            ("iterations", counts(&limits)),
        ]),
        heading: format!("{folder}: {steps} systems, patterns: {patterns}"),
        study: &STUDY,
        rows: json!({ "records": records.all()? }),
        conclusion: String::new(),
        omissions,
    };
    Ok(result.into())
}
