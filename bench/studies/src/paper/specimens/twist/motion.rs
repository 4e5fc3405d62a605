//! The specimen in motion under a torque that rises, and how long it stays straight.
//!
//! The step has a limit of its own beside the rod's: the change of the joints' torques with rotation is explicit, and by
//! the mirror symmetry of the term ±½T it stiffens modes of one handedness as much as it softens those of the other.
//! The dynamic runs hold the grip in a bearing, which lets it turn about the axis only: a fixed torque on a *free* end
//! does not buckle but flutters, at any torque if nothing damps it (Nikolai).

use super::specimen;
use crate::paper::specimens::{Joint, MATERIALS};
use crate::paper::words::{largest, with};
use crate::rest::read;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use taut_integrator::{GeometricStiffness, StepOptions, Stepper};
use taut_measure::pace;
use taut_model::SpecimenParams;
use taut_output::check::ExperimentError;

/// Distance from the axis at which a specimen of 1 m counts as no longer straight \[m]: a thousand times the sag
/// under [`PUSH`].
const OFF_AXIS: f64 = 1e-4;

/// Distance from the axis at which it counts as lost \[m]. The ends cannot come nearer to each other: a buckled
/// specimen is a helix of radius 2 (I/A)^½ ≈ 6 mm, and what is wider is no motion of steel.
const LOST: f64 = 1e-2;

/// Size of the disturbance, a sideways force on a segment that turns by an irregular angle every step \[N]. Seeds at the
/// start alone would be damped to nothing long before the torque is large.
const PUSH: f64 = 1e-2;

/// Turn of the disturbance in a step \[rad]: the golden angle.
const PUSH_TURN: f64 = 2.399_963_229_728_653;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Step {
    Paper,
    /// The default, with geometric stiffness and guard.
    Default,
    /// The paper's scheme with geometric stiffness of weight 1.
    Stiffened,
}

impl Step {
    fn options(self) -> StepOptions {
        match self {
            Self::Paper => StepOptions::paper(),
            Self::Default => StepOptions::default(),
            Self::Stiffened => StepOptions {
                stiffness: GeometricStiffness::inertia(1.0),
                ..StepOptions::paper()
            },
        }
    }
}

/// A dynamic run of steel: the torque rises to `turns` in `ramp` seconds and stays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    pub joint: Joint,
    pub segments: usize,
    pub step: Step,
    /// Δt \[s].
    pub dt: f64,
    /// Tension over T²/(4YI) of the largest torque; 0 leaves the specimen untensioned.
    pub tension: f64,
    /// A small sideways force disturbs it; otherwise it stays exactly straight.
    pub disturbed: bool,
    /// T L/(2π GJ) at the end of the ramp.
    #[serde(skip_serializing)]
    pub turns: f64,
    /// Time of the ramp \[s].
    #[serde(skip_serializing)]
    pub ramp: f64,
    /// Time after it \[s].
    #[serde(skip_serializing)]
    pub hold: f64,
}

/// How a dynamic run ended: the turns of the load, T L/(2π GJ), up to which it was straight, and when it was lost or at the
/// end; the turns read from the joints; the largest distance from the axis; the steps that the guard redid.
pub(super) fn in_motion(motion: &Motion) -> Result<Value, ExperimentError> {
    let n = motion.segments;
    let base = specimen(MATERIALS[2], n, motion.joint)?;
    let stiffness = base.resolve()?.stiffness;
    let torque = motion.turns * TAU * stiffness.gj / base.length;
    let params = SpecimenParams {
        bearing: true,
        force: Some(motion.tension * torque * torque / (4.0 * stiffness.ei)),
        equilibrium: motion.tension > 0.0,
        ..base
    };
    let options = StepOptions {
        dt: motion.dt,
        ..motion.step.options()
    };
    let mut stepper = Stepper::new(params.build()?, options)?;
    let (mut turns, mut straight_to, mut time, mut off_axis) = (0.0, 0.0, 0.0, 0.0_f64);
    let (mut straight, mut lost, mut redone) = (true, false, 0);
    let steps = ((motion.ramp + motion.hold) / motion.dt).round() as usize;
    for k in 1..=steps {
        let share = (k as f64 * motion.dt / motion.ramp).min(1.0);
        stepper.set_load(n, Vector3::zeros(), Vector3::x() * (share * torque))?;
        if motion.disturbed {
            let (sine, cosine) = (PUSH_TURN * k as f64).sin_cos();
            let push = Vector3::new(0.0, 1.0 + cosine, sine) * PUSH;
            stepper.set_load(n / 3, push, Vector3::zeros())?;
        }
        let step = pace::step(&mut stepper);
        turns = share * motion.turns;
        time = k as f64 * motion.dt;
        let bodies = &stepper.scene().bodies;
        let off = largest(bodies.position.iter().map(|x| x.y.hypot(x.z)));
        off_axis = off_axis.max(off);
        straight &= off <= OFF_AXIS;
        if straight {
            straight_to = turns;
        }
        lost = step.is_err() || off.is_nan() || off > LOST;
        if lost {
            break;
        }
        redone += usize::from(step.is_ok_and(|report| report.redone));
    }
    let joints = read(stepper.scene(), n);
    let ended = json!({
        "straight_to": straight_to,
        "turns": turns,
        "time_s": time,
        "straight": straight,
        "lost": lost,
        "turns_read": joints.iter().map(|r| r.twist).sum::<f64>() / TAU,
        "off_axis_m": off_axis,
        "redone": redone,
    });
    Ok(with(motion, &ended))
}
