//! H50: a cable of N segments between two points that are farther apart than it is long.
//!
//! Straight, without gravity, its joints' compliances add up to L/EA. Held at the distance (1 + s) L it carries the
//! tension EA s, exactly so for any N. With ε = 0 there is no state that meets the constraints, and S has no full rank:
//! what a run does is recorded. It must end in a typed error; one that stays finite and still, and says at every step
//! that it has not converged, is at its limit.

use crate::hard::{solvers, together, worse};
use indicatif::ProgressBar;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use taut_ground::choice::Choice;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{
    Body, Constraint, Cosserat, Frame, JointLaw, Material, RowLaw, Scene, SceneError, Spherical,
    Stiffness,
};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};

/// Relative bar of the tension.
pub const BAR: f64 = 1e-8;

/// Strain s of the cable.
pub(super) const STRAIN: f64 = 0.01;

/// Speed beyond which a body of the rigid cable jitters \[m/s].
pub(super) const STILL: f64 = 1e-3;

const DT: f64 = 1.0 / 60.0;
const SEGMENTS: usize = 5;
const LENGTH: f64 = 10.0;
const EA: f64 = 2e7;

/// The cable with axial stiffness `ea` (N), rigid in all rows for `None`; all rows damped by `damping` (s).
///
/// # Errors
/// Parameters out of range.
pub fn scene(ea: Option<f64>, damping: f64) -> Result<Scene, SceneError> {
    let l = LENGTH / SEGMENTS as f64;
    let radius = Material::STEEL.round_radius(ea.unwrap_or(EA));
    let law = |length: f64| match ea {
        Some(ea) => {
            let stiffness = Stiffness::of_round(ea, radius, Material::STEEL.poisson, [None; 2]);
            stiffness.joint_law(length, damping)
        }
        None => JointLaw {
            stretch: Some(RowLaw::RIGID),
            bend: Some(RowLaw::RIGID),
            twist: Some(RowLaw::RIGID),
        },
    };
    let mut scene = Scene::new("overstretched");
    // A quarter turn takes the rod's −z to +x.
    let turn = UnitQuaternion::from_scaled_axis(-Vector3::y() * std::f64::consts::FRAC_PI_2);
    for i in 0..SEGMENTS {
        let centre = Vector3::new(l * (i as f64 + 0.5), 0.0, 0.0);
        let rod = Body::rod(l, radius, 1.0).at(centre).turned(turn);
        scene.add_body(format!("segment-{}", i + 1), rod);
    }
    let half = Vector3::new(0.0, 0.0, 0.5 * l);
    let end = Vector3::new(LENGTH * (1.0 + STRAIN), 0.0, 0.0);
    let held = |frames, length: f64| {
        Constraint::Spherical(Spherical {
            frames,
            stretch: law(length).stretch.unwrap_or_default(),
        })
    };
    let world = |point| Frame::world(point).with_axes(Matrix3::identity());
    let first = held([world(Vector3::zeros()), Frame::body(0, half)], 0.5 * l);
    scene.add_constraint("start", first, 0);
    for i in 1..SEGMENTS {
        let frames = [Frame::body(i - 1, -half), Frame::body(i, half)];
        let joint = Constraint::Cosserat(Cosserat::new(frames, law(l)));
        scene.add_constraint(format!("joint-{i}"), joint, 0);
    }
    let last = held([Frame::body(SEGMENTS - 1, -half), world(end)], 0.5 * l);
    scene.add_constraint("end", last, 0);
    scene.validate()?;
    Ok(scene)
}

/// The cable with compliance and without.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let mut rigid = scene(None, 0.0)?;
    rigid.name.push_str(", ε = 0");
    Ok(vec![scene(Some(EA), 0.0)?, rigid])
}

/// Largest relative error of the tension of all joints, against EA s.
fn tension_error(stepper: &Stepper) -> f64 {
    let rows = stepper.linearized();
    let dt = stepper.options().dt;
    let tension = |c: usize| {
        let mu = &stepper.multipliers()[rows.row_range(c)];
        (mu[0].hypot(mu[1]).hypot(mu[2]) / dt - EA * STRAIN).abs() / (EA * STRAIN)
    };
    (0..rows.constraints()).map(tension).fold(0.0, worse)
}

/// The error of the tension in static equilibrium, or after `seconds` of a damped run from the unstrained cable, which
/// is straight, so that its steps are linear and need no guard.
///
/// # Errors
/// A step that fails.
pub fn compliant(choice: &Choice, seconds: Option<f64>) -> Result<f64, StepError> {
    let damping = if seconds.is_some() { 0.05 } else { 0.0 };
    let mut cable = scene(Some(EA), damping)?;
    cable.start_in_equilibrium = seconds.is_none();
    let mut stepper = Stepper::new(cable, choice.plain_options(DT))?;
    let steps = seconds.map_or(1, |s| taut_ground::trajectory::steps_in(s, DT));
    for _ in 0..steps {
        stepper.step()?;
    }
    Ok(tension_error(&stepper))
}

/// Fate of a run without compliance.
#[derive(Debug, Clone, PartialEq)]
pub enum Rigid {
    /// It ends in a typed error.
    Refused {
        /// When \[s].
        time: f64,
        /// A typed error of the solve, which names the joint, ended it. Otherwise the state was
        /// lost.
        typed: bool,
        message: String,
    },
    /// It goes on.
    Runs {
        /// Largest speed of a body in the last second \[m/s].
        speed: f64,
        /// Largest gap of a joint at the end \[m].
        gap: f64,
        /// Largest multiplier at the end \[N].
        force: f64,
        /// Implicit sub-steps of the guard that did not converge.
        unconverged: usize,
        /// Steps whose system the solver claims to have solved.
        claimed: usize,
    },
}

/// Runs the cable without compliance for `seconds`.
///
/// # Errors
/// A scene that cannot be built.
pub fn rigid(choice: &Choice, seconds: f64, plain: bool) -> Result<Rigid, StepError> {
    let mut options: StepOptions = choice.options(DT);
    if plain {
        options.guard = None;
    }
    let mut stepper = Stepper::new(scene(None, 0.0)?, options)?;
    let steps = taut_ground::trajectory::steps_in(seconds, DT);
    let (mut speed, mut unconverged, mut claimed) = (0.0_f64, 0, 0);
    for step in 0..steps {
        match stepper.step() {
            Ok(report) => {
                unconverged += report.unconverged_substeps;
                let claims = report.solve.is_claim();
                claimed += usize::from(claims);
            }
            Err(e) => {
                return Ok(Rigid::Refused {
                    time: stepper.time(),
                    typed: matches!(e, StepError::Solve { .. }),
                    message: e.to_string(),
                });
            }
        }
        if step + 60 >= steps {
            let bodies = &stepper.scene().bodies;
            let fastest = bodies.velocity.iter().map(Vector3::norm);
            speed = fastest.fold(speed, |m, v| if v > m || v.is_nan() { v } else { m });
        }
    }
    let size = |m: f64, x: f64| if x > m || x.is_nan() { x } else { m };
    Ok(Rigid::Runs {
        speed,
        gap: taut_ground::trajectory::gaps(&stepper).fold(0.0, size),
        force: stepper
            .multipliers()
            .iter()
            .map(|mu| mu.abs() / DT)
            .fold(0.0, size),
        unconverged,
        claimed,
    })
}

/// Iterations that the iterative solvers have in each solve of the rigid cable, which has no answer to converge to.
const RIGID_ITERATIONS: usize = 200;

/// Simulated time of the damped run \[s]: forty damping times.
const DAMPED_TIME: f64 = 2.0;

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let seconds = if quick { 2.0 } else { 10.0 };
    let choices = solvers();
    progress.set_length(choices.len() as u64);
    let found: Vec<[Check; 4]> = choices
        .par_iter()
        .map(|choice| {
            let checks = [
                drawn(choice, None),
                drawn(choice, Some(DAMPED_TIME)),
                without_compliance(choice, seconds, false)?,
                without_compliance(choice, seconds, true)?,
            ];
            progress.inc(1);
            Ok(checks)
        })
        .collect::<Result<_, StepError>>()?;
    let cases = [
        "ε > 0, at rest",
        "ε > 0, damped run",
        "ε = 0",
        "ε = 0, no guard",
    ];
    let mut checks = Vec::new();
    for (k, case) in cases.iter().enumerate() {
        let own = choices.iter().zip(&found);
        let own = own.map(|(choice, found)| (choice.family(), found[k].clone()));
        checks.extend(together(case, own.collect()));
    }
    Ok(checks.into())
}

fn drawn(choice: &Choice, seconds: Option<f64>) -> Check {
    let reference = format!("T = EA s = {:.0} N", EA * STRAIN);
    match compliant(choice, seconds) {
        Ok(error) => {
            Check::off("", reference, error, "", BAR).by("largest of all joints, relative")
        }
        Err(e) => Check::failed("", reference, &e),
    }
}

fn without_compliance(choice: &Choice, seconds: f64, plain: bool) -> Result<Check, StepError> {
    let reference = "a typed error, or finite and still";
    let backend = if choice.backend.is_iterative() {
        choice.backend.with_iterations(RIGID_ITERATIONS)
    } else {
        choice.backend.clone()
    };
    let choice = Choice {
        backend,
        form: choice.form,
    };
    Ok(match rigid(&choice, seconds, plain)? {
        Rigid::Refused {
            time,
            typed,
            message,
        } => {
            let ours = format!("refused at {time:.2} s");
            let verdict = if typed { Verdict::Pass } else { Verdict::Fail };
            Check::claim("", reference, ours, verdict, message)
        }
        Rigid::Runs {
            speed,
            gap,
            force,
            unconverged,
            claimed,
        } => {
            let ours = format!("{seconds} s; gap {gap:.2e} m, force {force:.0e} N");
            let finite = speed.is_finite() && gap.is_finite() && force.is_finite();
            let mut check = Check::within("", reference, ours, speed, STILL)
                .by("speed of a body in the last second [m/s]");
            check.note = format!(
                "claims {claimed} of its solves; {unconverged} sub-steps of the guard did not converge"
            );
            // No solution exists to converge to.
            check.verdict = if finite && claimed == 0 && speed <= STILL {
                Verdict::Limit
            } else {
                Verdict::Fail
            };
            check
        }
    })
}
