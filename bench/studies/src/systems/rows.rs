//! One solve of a system after another: each solver with each of its limits and refinements, or with the fewest that reach an error.

use super::{Fewest, Start, State, at_rung, entrants, rungs, turns};
use serde::{Deserialize, Serialize};
use std::time::Duration;
use taut_integrator::StepOptions;
use taut_measure::choice::{Choice, Omission};
use taut_measure::matrix::solve::status;

/// Rows beyond which the dense solver, whose cost is cubic, would outlast all others together.
const DENSE_ROWS: usize = 300;

/// What is asked of a system.
#[derive(Debug, Clone, PartialEq)]
pub struct Asking {
    /// Solvers; those that are not compiled in have no rows.
    pub choices: Vec<Choice>,
    pub limits: Vec<usize>,
    /// Refinement sweeps: from the pieces on S, with b − A x on the KKT matrix.
    pub refinements: Vec<usize>,
    /// Errors of the multipliers to be reached with the fewest iterations, or refinements of a direct solver, up to the largest of
    /// the above; a row for each limit and each number of refinements where there are none.
    pub targets: Vec<f64>,
    /// What iterations begin with.
    pub starts: Vec<Start>,
    /// The step whose system is solved: Δt, scheme, geometric stiffness.
    pub step: StepOptions,
    /// Time that the timing of a row aims at; none times no row.
    pub budget: Option<Duration>,
}

/// One solve, with what the rows of its system share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveRow<S> {
    #[serde(flatten)]
    pub of: S,
    /// Backend and form, without iterations.
    pub backend: String,
    /// All options of the backend, as the command line reads them.
    pub options: String,
    /// Where it starts; none for a direct solver.
    pub start: Option<Start>,
    /// Limit of iterations; 0 for direct solvers, and where the guess is within the target.
    pub iterations: usize,
    /// Those of the solve with its refinements.
    pub iterations_used: usize,
    pub refinements: usize,
    pub target: Option<f64>,
    /// False where the target is not reached within the largest limit.
    pub reached: bool,
    pub status: Option<String>,
    /// ‖μ − μ*‖∞ / ‖μ*‖∞ of the multipliers against extended precision; NaN where the solver failed.
    pub forward_error: f64,
    /// Normwise backward error on the assembled system, S or the KKT matrix; NaN where the solver failed.
    pub backward_error: f64,
    pub backward_error_componentwise: f64,
    /// Time from the pieces to the multipliers, the least \[ns].
    pub system_ns: Option<f64>,
    /// That of the fastest direct solver that reaches the same target \[ns].
    pub direct_ns: Option<f64>,
    /// Why numbers are missing, which are null in JSON.
    pub error: Option<String>,
}

/// A row before it is solved.
struct Task {
    choice: Choice,
    start: Option<Start>,
    iterations: usize,
    target: Option<f64>,
    reached: bool,
    step: StepOptions,
}

impl Task {
    /// Where it starts, if that is within the target already.
    fn guess(&self) -> Option<Start> {
        self.start.filter(|_| self.iterations == 0)
    }

    fn is_timed(&self) -> bool {
        self.reached && self.guess().is_none()
    }

    fn row<S: Clone>(&self, of: &S, state: &State) -> SolveRow<S> {
        let solved = state.solve(self.step.clone(), self.start.unwrap_or_default());
        let guess = self.guess();
        let known = solved.as_ref().ok().filter(|_| guess.is_none());
        let (backward, guessed) = (known.map(|s| s.backward), guess.map(|s| state.guessed(s)));
        SolveRow {
            of: of.clone(),
            backend: self.choice.family(),
            options: self.choice.to_string(),
            start: self.start,
            iterations: self.iterations,
            iterations_used: known.map_or(0, |s| s.iterations),
            refinements: self.step.refinements,
            target: self.target,
            reached: self.reached,
            status: match (self.reached, known) {
                (false, _) => Some("not reached".to_owned()),
                (true, Some(s)) => Some(status(s.report.status).to_owned()),
                (true, None) => guess.map(|_| "guess".to_owned()),
            },
            forward_error: known.map(|s| s.forward).or(guessed).unwrap_or(f64::NAN),
            backward_error: backward.map_or(f64::NAN, |b| b.normwise),
            backward_error_componentwise: backward.map_or(f64::NAN, |b| b.componentwise),
            system_ns: None,
            direct_ns: None,
            error: solved.as_ref().err().map(ToString::to_string),
        }
    }
}

impl Asking {
    /// The rows of a system, and which solvers have none.
    pub fn rows<S: Clone>(&self, of: &S, state: &State) -> (Vec<SolveRow<S>>, Vec<Omission>) {
        let (choices, omissions) = entrants(&self.choices, DENSE_ROWS, |_| state.rows());
        let mut tasks = Vec::new();
        for choice in &choices {
            let direct = !choice.backend.is_iterative();
            let starts = self.starts.iter().copied().map(Some);
            let starts: Vec<_> = if direct { vec![None] } else { starts.collect() };
            for start in starts {
                match self.targets.is_empty() {
                    true => tasks.extend(self.each(choice, start)),
                    false => tasks.extend(self.fewest(state, choice, start)),
                }
            }
        }
        let timed = tasks.iter().filter(|task| task.is_timed());
        let times = self.budget.map(|budget| {
            let work = |task: &Task| state.work(task.step.clone(), task.start.unwrap_or_default());
            turns::times(timed.map(work), budget)
        });
        let mut times = times.unwrap_or_default().into_iter();
        let mut rows: Vec<SolveRow<S>> = tasks
            .iter()
            .map(|task| {
                let mut row = task.row(of, state);
                match task.is_timed().then(|| times.next()).flatten() {
                    Some(Ok([time, ..])) => row.system_ns = Some(time.least),
                    Some(Err(e)) => row.error = Some(e.to_string()),
                    None => {}
                }
                row
            })
            .collect();
        let direct = rows.iter().filter(|row| row.start.is_none());
        let direct: Vec<_> = direct.map(|row| (row.target, row.system_ns)).collect();
        for row in rows.iter_mut().filter(|row| row.target.is_some()) {
            let own = direct.iter().filter(|(target, _)| *target == row.target);
            row.direct_ns = own.filter_map(|(_, ns)| *ns).reduce(f64::min);
        }
        (rows, omissions)
    }

    fn step(&self, choice: &Choice, refinements: usize) -> StepOptions {
        StepOptions {
            form: choice.form,
            backend: choice.backend.clone(),
            refinements,
            ..self.step.clone()
        }
    }

    /// A row for each limit and each number of refinements.
    fn each(&self, choice: &Choice, start: Option<Start>) -> Vec<Task> {
        let task = |iterations: usize| {
            let choice = at_rung(choice, iterations);
            let refinements = self.refinements.iter();
            refinements.map(move |&refinements| Task {
                step: self.step(&choice, refinements),
                choice: choice.clone(),
                start,
                iterations,
                target: None,
                reached: true,
            })
        };
        rungs(choice, &self.limits)
            .into_iter()
            .flat_map(task)
            .collect()
    }

    /// A row for each error to be reached.
    fn fewest(&self, state: &State, choice: &Choice, start: Option<Start>) -> Vec<Task> {
        let most = if start.is_some() {
            &self.limits
        } else {
            &self.refinements
        };
        let most = most.iter().copied().max().unwrap_or(0).max(1);
        // Whatever error they leave, so many iterations are made.
        let step = |k: usize| match start {
            None => self.step(choice, k),
            Some(_) => {
                let mut choice = at_rung(choice, k);
                choice.backend = choice.backend.with_tolerance(0.0);
                self.step(&choice, 0)
            }
        };
        let error = |k| Ok(state.solve(step(k), start.unwrap_or_default())?.forward);
        let mut search = Fewest::new(most, usize::MAX, error);
        let task = |&target: &f64| {
            let nothing = start.map_or_else(|| search.error(0), |start| Ok(state.guessed(start)));
            let found = match nothing {
                Ok(error) if error <= target => Ok(Some(0)),
                Ok(_) => search.within(target),
                Err(e) => Err(e),
            };
            // What fails says so in its row.
            let reached = found.unwrap_or(None);
            let k = reached.unwrap_or(most);
            Task {
                choice: choice.clone(),
                start,
                iterations: if start.is_some() { k } else { 0 },
                target: Some(target),
                reached: reached.is_some(),
                step: step(k.max(usize::from(start.is_some()))),
            }
        };
        self.targets.iter().map(task).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::asked::tests::asking;
    use taut_integrator::Stepper;
    use taut_model::HoistParams;

    #[test]
    fn rows_reach_what_they_say_and_no_fewer_iterations_do() {
        let params = HoistParams {
            segments: 6,
            mass_ratio: 1e3,
            initial_angle: 0.3,
            ..HoistParams::default()
        };
        let all = Choice::all().into_iter().filter(|c| c.check().is_ok());
        let asking = Asking {
            choices: all.collect(),
            limits: vec![60],
            targets: vec![1e-2, 1e-4, 1e-8],
            starts: Start::ALL.to_vec(),
            ..asking()
        };
        let scene = params.build().expect("a hoist");
        let state = State::after(30, scene, asking.step.clone()).expect("a state");
        let (rows, _) = asking.rows(&(), &state);
        for r in &rows {
            assert_eq!(r.error, None, "{r:?}");
            let target = r.target.expect("a target");
            assert_eq!(r.reached, r.forward_error <= target, "{r:?}");
            // A guess that is near enough takes no time.
            assert_eq!(
                r.system_ns.is_some(),
                r.reached && (r.start.is_none() || r.iterations > 0),
                "{r:?}"
            );
            assert!(r.direct_ns.is_some(), "a direct solver reaches all: {r:?}");
            if r.reached && r.iterations > 1 {
                let choice: Choice = r.options.parse().expect("a solver");
                let mut fewer = at_rung(&choice, r.iterations - 1);
                fewer.backend = fewer.backend.with_tolerance(0.0);
                let fewer = state.solve(asking.step(&fewer, 0), r.start.expect("iterates"));
                assert!(fewer.expect("a solve").forward > target, "{r:?}");
            }
        }
        assert!(rows.iter().any(|r| !r.reached) && rows.iter().any(|r| r.iterations > 1));
        // The system is that of a step from there.
        assert!(Stepper::new(state.scene().clone(), asking.step).is_ok());
    }
}
