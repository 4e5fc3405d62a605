//! A load on a winch is set down, stands half on its cable, lies with a slack one, and is picked up again.
//!
//! The floor carries what the cable does not: with the tension T and the load's acceleration a upwards
//!
//! ```text
//! N = M (g + a) − T
//! ```
//!
//! in each step, whatever the cable does. The cable stretches by ε M g under the whole load, so that a winch which pays
//! out with w takes ε M g/w to hand it over. On the way back the slack ends with a jerk: the load leaves the floor with
//! no more energy than the winch has spent.

use super::{DT, GRAVITY, borne, ground, put_box, rough};
use crate::hard::{each_solver, worse};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_ground::choice::Choice;
use taut_ground::pace;
use taut_ground::trajectory::ENERGY_TOLERANCE;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Constraint, Frame, MasslessCable, RowLaw, Scene, Winch};
use taut_output::check::{Check, ExperimentError, Outcome};

const MASS: f64 = 1e4;
const HEIGHT: f64 = 10.0;
const EDGE: f64 = 1.0;
/// Height of the load above the floor at first \[m].
const DROP: f64 = 0.05;
/// Stretch of the cable under the whole load \[m].
const STRETCH: f64 = 0.05;
/// Speed of the winch \[m/s].
const SPEED: f64 = 0.1;
/// Largest relative error of the floor's force.
const BAR: f64 = 1e-10;
/// Largest energy from nowhere over that of the cable under the whole load. The balance leaves out half the strain of
/// the winch's work ([`taut_integrator::EnergyBalance`]).
const GAINED: f64 = 5e-3;

/// The load above the floor, at rest in its cable.
fn hanging() -> Scene {
    let mut scene = ground("crane", 0.0, rough(0.5));
    let at = Vector3::z() * (DROP + 0.5 * EDGE);
    let shape = [Vector3::repeat(EDGE), at];
    let load = put_box(
        &mut scene,
        shape,
        UnitQuaternion::identity(),
        MASS,
        rough(0.5),
    );
    scene.load = Some(load);
    let top = Frame::world(Vector3::z() * HEIGHT);
    let hook = Frame::body(load, Vector3::z() * 0.5 * EDGE);
    let law = RowLaw::new(STRETCH / (MASS * GRAVITY), 0.01);
    let length = HEIGHT - DROP - EDGE - STRETCH;
    let mut cable = MasslessCable::new(vec![top, hook], length, law);
    cable.winch = Some(Winch::new());
    scene.add_constraint("rope", Constraint::MasslessCable(cable), 0);
    scene
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![hanging()])
}

/// Figures of a lift.
#[derive(Debug, Clone, Copy, Default)]
struct Lift {
    /// Largest error of the floor's force over the weight.
    force: f64,
    /// Steps in which floor and cable share the load.
    shared: usize,
    /// Tension while the cable is slack, over the weight.
    slack: f64,
    /// Largest tension, over the weight.
    jerk: f64,
    /// Largest energy from nowhere on the way up, over that of the stretched cable.
    gained: f64,
    undecided: usize,
    redone: usize,
    /// Height of the load at the end \[m].
    height: f64,
}

/// Speed of the winch (m/s, > 0 pays out) at a time \[s]: down, half a second's rest with half the load, down, up.
fn speed(time: f64) -> f64 {
    match time {
        t if t < 0.75 => SPEED,
        t if t < 1.25 => 0.0,
        t if t < 2.25 => SPEED,
        t if t < 2.75 => 0.0,
        _ => -SPEED,
    }
}

fn lift(choice: &Choice) -> Result<Lift, StepError> {
    let options = StepOptions {
        energy_tolerance: Some(ENERGY_TOLERANCE),
        ..choice.options(DT)
    };
    let mut stepper = Stepper::new(hanging(), options)?;
    stepper.begin()?;
    let weight = MASS * GRAVITY;
    let mut found = Lift::default();
    let mut winch = Winch::new();
    // Energy of the cable under the whole load; excess of the balance when the way down ends.
    let (taken_up, mut lying) = (0.5 * weight * STRETCH, 0.0);
    for _ in 0..360 {
        let now = speed(stepper.time() + 0.5 * DT);
        if now != winch.speed {
            winch.speed = now;
            stepper.set_winch(0, winch)?;
        }
        let before = stepper.scene().bodies.velocity[0].z;
        let report = pace::step(&mut stepper)?;
        found.undecided += report.undecided;
        found.redone += usize::from(report.redone);
        let excess = report.balance.map_or(f64::NAN, |b| b.gained - b.work);
        if stepper.time() < 2.7 {
            lying = excess;
        }
        found.gained = worse(found.gained, (excess - lying) / taken_up);
        let tension = stepper.tension(0).unwrap_or(f64::NAN);
        found.jerk = found.jerk.max(tension / weight);
        if (2.3..2.7).contains(&stepper.time()) {
            found.slack = worse(found.slack, tension.abs() / weight);
        }
        // The forces of a step that was redone are those of its last part.
        let floor = borne(&stepper).z;
        if report.redone || report.implicit_substeps > 0 || floor == 0.0 {
            continue;
        }
        let gained = MASS * (stepper.scene().bodies.velocity[0].z - before) / DT;
        found.force = worse(
            found.force,
            (floor + tension - weight - gained).abs() / weight,
        );
        found.shared += usize::from(tension > 0.01 * weight);
    }
    found.height = stepper.scene().bodies.position[0].z - 0.5 * EDGE;
    Ok(found)
}

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut worst = Lift::default();
    let mut checks = each_solver(
        "load set down and picked up: N = M (g + a) − T",
        |choice| {
            let found = lift(choice)?;
            worst = Lift {
                gained: worse(worst.gained, found.gained),
                slack: worse(worst.slack, found.slack),
                undecided: worst.undecided + found.undecided,
                redone: worst.redone + found.redone,
                ..found
            };
            let check = Check::off("", "balance", found.force, "M g", BAR);
            Ok(check.by("largest error in any step on the floor"))
        },
    )?;
    let Lift {
        shared,
        height,
        jerk,
        ..
    } = worst;
    checks.push(
        Check::off(
            "load set down: tension of the slack cable",
            "0",
            worst.slack,
            "M g",
            0.0,
        )
        .noting(format!("floor and cable share the load in {shared} steps")),
    );
    checks.push(
        Check::off(
            "load picked up: energy",
            "none gained",
            worst.gained,
            "",
            GAINED,
        )
        .by("energy from nowhere, over that of the cable under the whole load")
        .noting(format!(
            "tension up to {jerk:.3} M g; {height:.3} m above the floor at the end"
        )),
    );
    let undecided = format!("{}, {} redone", worst.undecided, worst.redone);
    checks.push(Check::stated(
        "load: undecided steps",
        "0",
        undecided,
        worst.undecided == 0,
    ));
    Ok(checks.into())
}
