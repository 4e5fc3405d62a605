//! H52: degenerate input: what each ends in.
//!
//! Input that means nothing (no mass, no length, NaN, ∞, indefinite inertias) is refused with a typed error that names
//! the body, joint or option before anything is stepped. Input that is only strange (one body, no joints, nothing that
//! moves, parts that do not hang together, joints that come and go, 10⁵ segments) runs, finite. Numbers at the ends of
//! the range of doubles may do either, but neither panic nor go on with NaN.

mod inputs;
mod subject;

use crate::hard::{solvers, together};
use crate::scenes::reference_choice;
use indicatif::ProgressBar;
use inputs::{INPUTS, Input, Make};
use nalgebra::Vector3;
use rayon::prelude::*;
use taut_ground::choice::Choice;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{HoistParams, JointKind, Scene};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};
use taut_solver::{SolveError, SolveReport};

const DT: f64 = 1.0 / 60.0;

/// Iterations of a solve: what has no solution has none after more.
const ITERATIONS: usize = 200;

/// Steps of each run.
const STEPS: usize = 60;

/// What an input has to end in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Expected {
    /// A typed error, in which the field that holds what it is about ([`subject::of`]) has this.
    Refused(&'static str),
    /// A run that stays finite.
    Sound,
    /// One of both: an error that has such a field, or finite.
    Either,
}

/// What it ended in.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    /// Nothing was built or stepped.
    Refused(Fault),
    /// The first step failed: the solver finds the matrix singular, and the error names the joint or body.
    Singular(Fault),
    /// A step failed after some that did not.
    Stopped(usize, Fault),
    /// It ran.
    Finite,
    /// It ran, and something is not a number.
    NotFinite,
}

/// A typed error.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// What it is about, by its fields.
    subject: Option<String>,
    /// Its words.
    text: String,
}

impl Fault {
    fn of(e: &StepError) -> Self {
        Self {
            subject: subject::of(e),
            text: e.to_string(),
        }
    }
}

/// Whether all that a stepper holds is finite.
fn finite(stepper: &Stepper) -> bool {
    let bodies = &stepper.scene().bodies;
    let vectors = bodies.position.iter().chain(&bodies.velocity);
    let mut vectors = vectors.chain(&bodies.angular_velocity);
    let mut turns = bodies.orientation.iter();
    let mut multipliers = stepper.multipliers().iter();
    vectors.all(|v| v.iter().all(|x| x.is_finite()))
        && turns.all(|q| q.coords.iter().all(|x| x.is_finite()))
        && multipliers.all(|mu| mu.is_finite())
}

/// Runs a scene for some steps with a solver.
fn run(scene: Scene, options: StepOptions, steps: usize) -> Found {
    let mut stepper = match Stepper::new(scene, options) {
        Ok(stepper) => stepper,
        Err(e) => return Found::Refused(Fault::of(&e)),
    };
    for step in 0..steps {
        if let Err(e) = stepper.step() {
            let singular = matches!(
                e,
                StepError::Solve {
                    source: SolveError::Singular { .. },
                    culprit: Some(_),
                    ..
                }
            );
            return match step {
                0 if singular => Found::Singular(Fault::of(&e)),
                0 => Found::Refused(Fault::of(&e)),
                _ => Found::Stopped(step, Fault::of(&e)),
            };
        }
    }
    if finite(&stepper) {
        Found::Finite
    } else {
        Found::NotFinite
    }
}

impl Input {
    /// What it ends in with a solver.
    fn end(&self, choice: &Choice) -> Found {
        let options = choice.options(DT);
        match self.make {
            Make::Scene(make) => match make() {
                Ok(scene) => run(scene, options, STEPS),
                Err(e) => Found::Refused(Fault::of(&e.into())),
            },
            Make::Options(change) => {
                let mut options = options;
                change(&mut options);
                match inputs::small() {
                    Ok(scene) => run(scene, options, STEPS),
                    Err(e) => Found::Refused(Fault::of(&e.into())),
                }
            }
            Make::State(spoil) => spoiled(options, spoil),
        }
    }
}

/// A sound stepper that is put into a bad state.
fn spoiled(options: StepOptions, spoil: fn(&mut taut_model::Bodies)) -> Found {
    let stepped = || -> Result<Stepper, StepError> {
        let mut stepper = Stepper::new(inputs::small()?, options)?;
        stepper.step()?;
        let mut bodies = stepper.scene().bodies.clone();
        spoil(&mut bodies);
        stepper.set_state(&bodies, 0.0)?;
        for _ in 0..STEPS {
            stepper.step()?;
        }
        Ok(stepper)
    };
    match stepped() {
        Ok(stepper) if finite(&stepper) => Found::Finite,
        Ok(_) => Found::NotFinite,
        Err(e) => Found::Refused(Fault::of(&e)),
    }
}

fn judged(expected: Expected, found: &Found) -> Check {
    let reference = match expected {
        Expected::Refused(what) => format!("a typed error that names {what}"),
        Expected::Sound => "runs, finite".to_owned(),
        Expected::Either => "a typed error, or finite".to_owned(),
    };
    let names_it = |e: &Fault| match expected {
        Expected::Refused(what) => e.subject.as_ref().is_some_and(|s| s.contains(what)),
        Expected::Sound => false,
        Expected::Either => e.subject.is_some(),
    };
    let pass = |good: bool| if good { Verdict::Pass } else { Verdict::Fail };
    let (ours, verdict, note) = match found {
        Found::Refused(e) | Found::Singular(e) => {
            ("refused".to_owned(), pass(names_it(e)), e.text.clone())
        }
        Found::Stopped(step, e) => (
            format!("refused at step {step}"),
            pass(expected == Expected::Either && names_it(e)),
            e.text.clone(),
        ),
        Found::Finite => (
            format!("{STEPS} steps"),
            pass(!matches!(expected, Expected::Refused(_))),
            String::new(),
        ),
        Found::NotFinite => ("NaN or ∞".to_owned(), Verdict::Fail, String::new()),
    };
    Check::claim("", &reference, ours, verdict, note)
}

/// The scenes that run.
///
/// # Errors
/// Parameters out of range.
pub fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let sound = INPUTS.iter().filter(|i| i.expected == Expected::Sound);
    let mut scenes = Vec::new();
    for input in sound {
        if let Make::Scene(make) = input.make {
            let mut scene = make()?;
            input.name.clone_into(&mut scene.name);
            scenes.push(scene);
        }
    }
    Ok(scenes)
}

/// The checks of H52.
///
/// # Errors
/// None: what cannot be built is what is looked for.
pub fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let choices: Vec<Choice> = solvers()
        .into_iter()
        .map(|choice| Choice {
            backend: choice.backend.with_iterations(ITERATIONS),
            form: choice.form,
        })
        .collect();
    progress.set_length((INPUTS.len() + choices.len()) as u64);
    let found: Vec<Vec<Check>> = INPUTS
        .par_iter()
        .map(|input| {
            // A scene that is refused gets as far as no solver.
            let reference = [reference_choice()];
            let own = match (input.expected, input.make) {
                (Expected::Refused(_), Make::Scene(_) | Make::Options(_)) => &reference[..],
                _ => &choices,
            };
            let ends = own.iter().map(|choice| {
                let end = input.end(choice);
                let singular = matches!(end, Found::Singular(_));
                let mut check = judged(input.expected, &end);
                // A sound scene whose matrix a solver, not the reference, finds singular at a joint that it names: it does
                // not go on with what is wrong.
                let sound = input.expected == Expected::Sound && *choice != reference_choice();
                if check.verdict == Verdict::Fail && sound && singular {
                    check.verdict = Verdict::Limit;
                }
                (choice.family(), check)
            });
            let checks = together(input.name, ends.collect());
            progress.inc(1);
            checks
        })
        .collect();
    let mut checks = found.concat();
    let own = choices
        .iter()
        .map(|c| (c.family(), judged(Expected::Sound, &changing(c))));
    checks.extend(together("other joints at every step", own.collect()));
    let size = if quick { 10_000 } else { 100_000 };
    checks.extend(many(size, &choices, progress));
    Ok(Outcome {
        checks,
        ..Outcome::default()
    })
}

/// A ball on a rope of rods: at each step a rod is hung on below, or all but one fall off, and a new stepper goes on.
fn changing(choice: &Choice) -> Found {
    let mut scene = match inputs::small() {
        Ok(scene) => scene,
        Err(e) => return Found::Refused(Fault::of(&e.into())),
    };
    let joints = scene.constraints.clone();
    let names = scene.constraint_names.clone();
    let groups = scene.groups.clone();
    for step in 0..STEPS {
        let kept = 1 + step % joints.len();
        scene.constraints = joints[..kept].to_vec();
        scene.constraint_names = names[..kept].to_vec();
        scene.groups = groups[..kept].to_vec();
        let mut stepper = match Stepper::new(scene, choice.options(DT)) {
            Ok(stepper) => stepper,
            Err(e) => return Found::Stopped(step, Fault::of(&e)),
        };
        if let Err(e) = stepper.step() {
            return Found::Stopped(step, Fault::of(&e));
        }
        if !finite(&stepper) {
            return Found::NotFinite;
        }
        scene = stepper.into_scene();
        // What fell off comes back where it was.
        if kept == 1
            && let Ok(fresh) = inputs::small()
        {
            scene.bodies = fresh.bodies;
        }
    }
    Found::Finite
}

/// A hanging cable of very many segments: every solver runs it, but the dense one, which says that it is too large.
fn many(segments: usize, choices: &[Choice], progress: &ProgressBar) -> Vec<Check> {
    let case = format!("{segments} segments");
    let params = HoistParams {
        segments,
        length: 0.01 * segments as f64,
        segment_mass: Some(0.01),
        load_mass: Some(1000.0),
        joint: JointKind::Cosserat,
        ..HoistParams::default()
    };
    let scene = match params.hanging_equilibrium() {
        Ok(scene) => scene,
        Err(e) => {
            return vec![Check::claim(
                case,
                "",
                String::new(),
                Verdict::Fail,
                e.to_string(),
            )];
        }
    };
    let weight = scene.mass() * params.gravity;
    let dense = Choice::schur(taut_solver::Backend::Dense(
        taut_solver::DenseOptions::default(),
    ));
    let refused = match Stepper::new(scene.clone(), dense.options(DT)) {
        Err(StepError::Solve {
            source: source @ SolveError::TooLarge { .. },
            ..
        }) => Check::claim(
            format!("{case}: dense"),
            "too large",
            "refused".to_owned(),
            Verdict::Pass,
            source.to_string(),
        ),
        other => {
            let ours = other.map_or_else(|e| e.to_string(), |_| "accepted".to_owned());
            Check::claim(
                format!("{case}: dense"),
                "too large",
                ours,
                Verdict::Fail,
                "",
            )
        }
    };
    let mut own = Vec::new();
    for choice in choices.iter().filter(|c| c.backend.name() != "dense") {
        own.push((choice.family(), held(&scene, weight, choice)));
        progress.inc(1);
    }
    let mut checks = together(&case, own);
    checks.push(refused);
    checks
}

/// The force on the anchor after some steps at rest.
fn held(scene: &Scene, weight: f64, choice: &Choice) -> Check {
    let tried = || -> Result<(f64, SolveReport), StepError> {
        let mut stepper = Stepper::new(scene.clone(), choice.plain_options(DT))?;
        stepper.step()?;
        let said = stepper.step()?.solve;
        let force = Vector3::from_column_slice(&stepper.multipliers()[..3]) / DT;
        Ok(((force.norm() / weight - 1.0).abs(), said))
    };
    let reference = "carries its weight";
    match tried() {
        Ok((error, said)) => Check::within(
            "",
            reference.to_owned(),
            format!("(1 ± {error:.0e}) m g"),
            error,
            1e-8,
        )
        .by("force on the anchor after 2 steps at rest, relative")
        .unless_claimed(&said),
        Err(e) => Check::claim("", reference, "failed".into(), Verdict::Fail, e.to_string()),
    }
}
