//! Motions: a scene, the options of its step and a drive, stepped to the end or until the motion is lost. The studies of
//! motions are questions on them: which scenes, which options, what is compared with which reference.
//!
//! A record is a row of JSON; tables and plots are data about its columns.

use nalgebra::Vector3;
use serde_json::Value;
use taut_integrator::{
    GeometricStiffness, Guard, Scheme, StepError, StepOptions, StepReport, Stepper,
};
use taut_measure::errors::worse;
use taut_measure::inputs::Inputs;
use taut_measure::pace;
use taut_measure::trajectory::Failure;
use taut_model::{Linearized, Scene};

/// The default step with this scheme, the weight α of its geometric stiffness, and this Δt (s), guarded or not.
pub(crate) fn step(scheme: Scheme, alpha: f64, dt: f64, guarded: bool) -> StepOptions {
    StepOptions {
        dt,
        scheme,
        stiffness: GeometricStiffness::inertia(alpha),
        guard: guarded.then(Guard::default),
        ..StepOptions::default()
    }
}

/// Goes through so many steps, driven by inputs. `each` sees every step and may end the motion, for a reason; so does a
/// step that fails.
pub(crate) fn follow(
    stepper: &mut Stepper,
    inputs: &Inputs,
    steps: usize,
    mut each: impl FnMut(&Stepper, &StepReport) -> Result<(), String>,
) -> Option<Failure> {
    for _ in 0..steps {
        let stepped = inputs.apply(stepper).and_then(|()| pace::step(stepper));
        let ended = match stepped {
            Ok(report) => each(stepper, &report),
            Err(e) => Err(e.to_string()),
        };
        if let Err(reason) = ended {
            let time = stepper.time();
            return Some(Failure { time, reason });
        }
    }
    None
}

/// [`follow`] of a scene that nothing drives.
pub(crate) fn run(
    scene: Scene,
    options: StepOptions,
    steps: usize,
    each: impl FnMut(&Stepper, &StepReport) -> Result<(), String>,
) -> Result<Option<Failure>, StepError> {
    let mut stepper = Stepper::new(scene, options)?;
    Ok(follow(&mut stepper, &Inputs::default(), steps, each))
}

/// The rows φ of a scene's pose, with their compliances.
pub(crate) fn linearized(scene: &Scene) -> Linearized {
    let mut rows = Linearized::new(scene);
    rows.update(scene, 0.0);
    rows
}

/// The columns of several objects in one row.
pub(crate) fn joined<const N: usize>(parts: [Value; N]) -> Value {
    let objects = parts.into_iter().filter_map(|part| match part {
        Value::Object(row) => Some(row),
        _ => None,
    });
    Value::Object(objects.flatten().collect())
}

/// Largest distance of two paths \[m].
pub(crate) fn apart(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let distances = a.iter().zip(b).map(|(x, y)| (x - y).norm());
    distances.fold(0.0, worse)
}

/// Order of an error in Δt from two \[error, Δt].
pub(crate) fn order([large, coarse]: [f64; 2], [small, fine]: [f64; 2]) -> f64 {
    (large / small).ln() / (coarse / fine).ln()
}
