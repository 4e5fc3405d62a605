//! Claimed against verified: what every solver says of its solves in the scenes of all hard cases and of the matrices of
//! H46, beside a check that shares as little with it as can be ([`mod@verify`] says what).
//!
//! The reference solver steps each scene. At some instants every solver, at its defaults, the iterative ones with other
//! tolerances and limits of iterations besides, solves the system of the next step, in a stepper of its own. Its claim
//! is its status: direct, or converged. Verified is the residual r of what came out, computed from the pieces M̃, J,
//! Σ, c and not from the S that was formed of them, in double-double arithmetic. A claim is true where
//!
//! ```text
//! ‖r‖₂ ≤ τ ‖b‖₂   or   η = ‖r‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞) ≤ 10⁻¹⁴
//! ```
//!
//! with the tolerance τ of an iteration, which is what it stops by; a direct solver has the second alone, and an
//! iteration may have it, since what rounds the entries of A and x is more than its residual then. A good η goes with
//! a poor x where A is ill-conditioned: the largest error of the multipliers against 32 digits among the claims stands
//! beside. Counted apart are the claims of iterations that are false by the letter, the first inequality alone: where
//! rounding leaves a residual above τ ‖b‖, the iteration's own estimate cannot see it. The residual that an iteration
//! reports of its claims is not to be below ‖r‖₂/‖b‖₂ by more than rounding.

mod matrices;
mod report;
pub mod verify;

use crate::hard;
use crate::hard::numerics::ill_conditioned::matrices::specimens;
use crate::scenes::reference_choice;
use indicatif::ProgressBar;
use rayon::prelude::*;
use taut_ground::choice::Choice;
use taut_ground::claim::{ROUNDING, over, over_letter};
use taut_ground::reference::Snapshot;
use taut_integrator::{Form, StepError, StepOptions, Stepper};
use taut_model::Scene;
use taut_output::check::{ExperimentError, Outcome};
use taut_solver::{Backend, forward_error};
use verify::{Verified, verify};

/// Rows of a scene beyond which it has no part in this.
const MOST_ROWS: usize = 3000;

/// Rows beyond which the reference in 32 digits and the dense solver are left out.
const SMALL_ROWS: usize = 400;

const DT: f64 = 1.0 / 60.0;

/// Truth of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// Claimed, and so.
    True,
    /// Claimed, and not so.
    False,
    /// Not claimed, though it would have been true.
    Modest,
    /// Not claimed, and not so.
    Honest,
    /// A typed error, no answer.
    Refused,
}

/// One solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Solve {
    /// Hard case and scene.
    pub scene: String,
    /// Steps before it.
    pub step: usize,
    /// Rows of the scene.
    pub rows: usize,
    /// Solver without iterations and tolerance.
    pub backend: String,
    /// Its tolerance or limit where that is not the default.
    pub variant: String,
    /// Status that the solver reports.
    pub status: String,
    /// ‖r‖₂/‖b‖₂ as it says.
    pub claimed_residual: Option<f64>,
    /// ‖r‖₂/‖b‖₂ as it is.
    pub residual: f64,
    /// η as it is.
    pub backward_error: f64,
    /// The residual over what was claimed of it: at most 1 where the claim is true.
    pub over_claim: f64,
    /// Excess of the true residual over the one reported, as a backward error in units of
    /// [`ROUNDING`]. 0 without excess; above 1 rounding does not excuse it.
    pub over_told: Option<f64>,
    /// By the letter, without the excuse of rounding: for an iteration ‖r‖₂/‖b‖₂ over its
    /// tolerance.
    pub over_letter: f64,
    /// ‖μ − μ*‖∞/‖μ*‖∞ against 32 digits, for small scenes.
    pub forward_error: Option<f64>,
    /// For a false claim of a direct solver: relative change of x by one more refinement. Where it
    /// does not contract the matrix is singular to rounding, which elimination without pivoting did
    /// not see.
    pub next_change: Option<f64>,
    pub finding: Finding,
}

/// The solvers of steps.
fn choices() -> Vec<(Choice, String)> {
    variants(Choice::all().into_iter())
}

/// Solvers at their defaults, and the iterative ones with other tolerances and limits.
fn variants(all: impl Iterator<Item = Choice>) -> Vec<(Choice, String)> {
    let mut choices = Vec::new();
    for choice in all.filter(|c| c.check().is_ok()) {
        let with = |backend: Backend| Choice {
            backend,
            form: choice.form,
        };
        let backend = &choice.backend;
        if backend.is_iterative() {
            for tolerance in [1e-4, 1e-8] {
                let loose = with(backend.with_tolerance(tolerance));
                choices.push((loose, format!("tolerance {tolerance:.0e}")));
            }
            for limit in [1, 10] {
                let short = with(backend.with_iterations(limit));
                choices.push((short, format!("{limit} iterations")));
            }
        }
        choices.push((choice, String::new()));
    }
    choices
}

/// Residual of a solution over the limit that a claim of `backend` sets: at most 1 if the claim is
/// true.
#[must_use]
pub fn over_claim(seen: &Verified, backend: &Backend) -> f64 {
    over(seen.residual, seen.backward_error, backend.tolerance())
}

/// Solves of some scenes and matrices, and scenes that ended early.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Audit {
    pub audited: Vec<String>,
    pub solves: Vec<Solve>,
    /// Scenes that ended before their last instant, and how.
    pub ended: Vec<String>,
}

/// Audits a scene after those numbers of steps, ascending.
#[must_use]
pub fn audit(name: &str, scene: &Scene, instants: &[usize]) -> Audit {
    let mut found = Audit {
        audited: vec![name.to_owned()],
        ..Audit::default()
    };
    if let Err(e) = follow(name, scene, instants, &mut found) {
        found.ended.push(format!("{name}: {e}"));
    }
    found
}

fn follow(
    name: &str,
    scene: &Scene,
    instants: &[usize],
    found: &mut Audit,
) -> Result<(), StepError> {
    let mut stepper = Stepper::new(scene.clone(), reference_choice().options(DT))?;
    let rows = stepper.multipliers().len();
    if rows > MOST_ROWS {
        found
            .ended
            .push(format!("{name}: {rows} rows, too many for all solvers"));
        return Ok(());
    }
    let mut step = 0;
    for &instant in instants {
        while step < instant {
            stepper.step()?;
            step += 1;
        }
        let state = State::of(&stepper)?;
        for (choice, variant) in choices() {
            if rows > SMALL_ROWS && choice.backend.name() == "dense" {
                continue;
            }
            let solve = state.solve(&choice);
            let place = Place { name, step, rows };
            let mut solve = Solve::of(&place, &choice, variant, &solve);
            if solve.finding == Finding::False {
                solve.next_change = state.next_change(&choice);
            }
            found.solves.push(solve);
        }
    }
    Ok(())
}

/// Where a solve was made.
struct Place<'a> {
    name: &'a str,
    step: usize,
    rows: usize,
}

impl Solve {
    fn of(
        place: &Place<'_>,
        choice: &Choice,
        variant: String,
        solved: &Result<Done, String>,
    ) -> Self {
        let (status, told, seen, finding) = match solved {
            Ok(s) => (s.status.as_str(), s.told, s.seen, s.finding(choice)),
            Err(e) => (e.as_str(), None, Seen::NONE, Finding::Refused),
        };
        let tolerance = choice.backend.tolerance();
        Self {
            scene: place.name.to_owned(),
            step: place.step,
            rows: place.rows,
            backend: choice.family(),
            variant,
            status: status.to_owned(),
            claimed_residual: told,
            residual: seen.residual,
            backward_error: seen.backward_error,
            over_claim: seen.over(tolerance),
            over_told: told.map(|told| {
                let beyond = 1.0 - told / seen.residual;
                if seen.residual <= told {
                    0.0
                } else {
                    beyond * seen.backward_error / ROUNDING
                }
            }),
            over_letter: seen.over_letter(tolerance),
            forward_error: seen.forward_error,
            next_change: None,
            finding,
        }
    }

    /// Where it was, and by what.
    fn place(&self) -> String {
        let solver = format!("{} {}", self.backend, self.variant);
        format!("{}, step {}, {}", self.scene, self.step, solver.trim_end())
    }

    fn is_claim(&self) -> bool {
        matches!(self.finding, Finding::True | Finding::False)
    }

    /// True for a claim that is false by the letter or whose excess is NaN.
    fn is_false_by_the_letter(&self) -> bool {
        self.is_claim() && (self.over_letter.is_nan() || self.over_letter > 1.0)
    }
}

/// The common state of an instant.
struct State {
    scene: Scene,
    state: Snapshot,
    guess: Vec<f64>,
    /// The exact multipliers, of a small scene that has them.
    exact: Option<Vec<f64>>,
}

/// A solve that came to an end.
struct Done {
    status: String,
    claimed: bool,
    told: Option<f64>,
    seen: Seen,
}

/// Errors that the check found.
#[derive(Debug, Clone, Copy)]
struct Seen {
    residual: f64,
    backward_error: f64,
    forward_error: Option<f64>,
}

impl Seen {
    const NONE: Self = Self {
        residual: f64::NAN,
        backward_error: f64::NAN,
        forward_error: None,
    };

    fn over(&self, tolerance: Option<f64>) -> f64 {
        over(self.residual, self.backward_error, tolerance)
    }

    fn over_letter(&self, tolerance: Option<f64>) -> f64 {
        over_letter(self.residual, self.backward_error, tolerance)
    }
}

impl Done {
    fn finding(&self, choice: &Choice) -> Finding {
        let good = self.seen.over(choice.backend.tolerance()) <= 1.0;
        match (self.claimed, good) {
            (true, true) => Finding::True,
            (true, false) => Finding::False,
            (false, true) => Finding::Modest,
            (false, false) => Finding::Honest,
        }
    }
}

impl State {
    fn of(stepper: &Stepper) -> Result<Self, StepError> {
        let mut state = Self {
            scene: stepper.scene().clone(),
            state: Snapshot::of(stepper),
            guess: stepper.multipliers().to_vec(),
            exact: None,
        };
        if state.guess.len() <= SMALL_ROWS {
            let mut twin = state.stepper(reference_choice().plain_options(DT))?;
            // A scene without a unique solution has none to compare with.
            state.exact = twin.reference_multipliers().ok();
        }
        Ok(state)
    }

    fn stepper(&self, options: StepOptions) -> Result<Stepper, StepError> {
        let mut stepper = Stepper::new(self.scene.clone(), options)?;
        self.state.put(&mut stepper)?;
        stepper.set_multipliers(&self.guess)?;
        Ok(stepper)
    }

    /// One solve and its check, or its typed error in words.
    fn solve(&self, choice: &Choice) -> Result<Done, String> {
        self.tried(choice).map_err(|e| e.to_string())
    }

    /// By how much one more refinement changes the multipliers of a direct solver, relative.
    fn next_change(&self, choice: &Choice) -> Option<f64> {
        let solved = |more: usize| {
            let options = choice.plain_options(DT);
            let refinements = options.refinements + more;
            let mut stepper = self
                .stepper(StepOptions {
                    refinements,
                    ..options
                })
                .ok()?;
            stepper.solve().ok()?;
            Some(stepper.multipliers().to_vec())
        };
        if choice.backend.is_iterative() {
            return None;
        }
        Some(forward_error(&solved(1)?, &solved(0)?))
    }

    fn tried(&self, choice: &Choice) -> Result<Done, StepError> {
        let mut stepper = self.stepper(choice.plain_options(DT))?;
        let report = stepper.solve()?;
        let x = stepper.system().2.to_vec();
        let (a, b) = stepper.assembled(choice.form)?;
        let verified = match choice.form {
            Form::Kkt => verify::whole(&a, &b, &x),
            _ => {
                let (pieces, impulses) = stepper.assembled(Form::Kkt)?;
                verify(&a, &b, (&pieces, &impulses), &x)
            }
        };
        let exact = self.exact.as_deref();
        Ok(Done {
            status: format!("{:?}", report.solve.status),
            claimed: report.solve.is_claim(),
            told: Some(report.solve.residual).filter(|r| r.is_finite()),
            seen: Seen {
                residual: verified.residual,
                backward_error: verified.backward_error,
                forward_error: exact.map(|e| forward_error(stepper.multipliers(), e)),
            },
        })
    }
}

/// Audits all scenes of all cases, or one of each, and the matrices of H46; `progress` advances once for each of them.
///
/// # Errors
/// A case whose scenes cannot be built.
pub fn run(quick: bool, progress: &ProgressBar) -> Result<Audit, ExperimentError> {
    let mut scenes = Vec::new();
    for case in hard::cases() {
        let all = case.scenes()?;
        let some = if quick { 1 } else { all.len() };
        let named = all.into_iter().take(some);
        for scene in named {
            let name = format!("{} {}", case.name(), scene.name);
            let twins = scenes.iter().filter(|(known, _): &&(String, Scene)| {
                known == &name || known.starts_with(&format!("{name} ("))
            });
            let name = match twins.count() {
                0 => name,
                n => format!("{name} ({})", n + 1),
            };
            scenes.push((name, scene));
        }
    }
    let instants: &[usize] = if quick { &[0, 3] } else { &[0, 1, 10, 40, 300] };
    let specimens = specimens(quick);
    progress.set_length((scenes.len() + specimens.len()) as u64);
    let audits: Vec<Audit> = scenes
        .par_iter()
        .with_max_len(1)
        .map(|(name, scene)| {
            let found = audit(name, scene, instants);
            progress.inc(1);
            found
        })
        .collect();
    let mut whole = Audit::default();
    for part in audits {
        whole.audited.extend(part.audited);
        whole.solves.extend(part.solves);
        whole.ended.extend(part.ended);
    }
    whole.audited.extend(specimens.iter().map(matrices::name));
    let alone: Vec<Vec<Solve>> = specimens
        .par_iter()
        .map(|specimen| {
            let found = matrices::audit(specimen);
            progress.inc(1);
            found
        })
        .collect();
    whole.solves.extend(alone.into_iter().flatten());
    Ok(whole)
}

/// The case `claims`.
pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let audit = run(quick, progress)?;
    Ok(Outcome {
        checks: report::checks(&audit),
        text: report::tables(&audit),
        ..Outcome::default()
    })
}
