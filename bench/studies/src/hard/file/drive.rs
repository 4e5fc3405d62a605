//! What drives a run.

use super::run::dt;
use super::text::Names;
use super::{CaseError, Load, Run};
use nalgebra::Vector3;
use taut_integrator::{StepError, Stepper};
use taut_model::Scene;
use taut_output::check::ExperimentError;
use toml::Value;

/// What drives a scene: the value of a control, or the velocity (m/s) of a driven body.
#[derive(PartialEq)]
pub(super) enum Input {
    Control(usize, f64),
    Velocity(usize, Vector3<f64>),
    /// Force and torque on a body.
    Load(usize, Vector3<f64>, Vector3<f64>),
}

/// Inputs at a time (s).
pub(super) fn inputs(
    run: &Run,
    names: &mut Names,
    scene: &Scene,
    time: f64,
) -> Result<Vec<Input>, ExperimentError> {
    if run.drive.is_empty() && run.load.is_empty() {
        return Ok(Vec::new());
    }
    names.values.set("time", time);
    names.values.set("dt", dt(run, names)?);
    let input = |(name, value): (&String, &Value)| {
        Ok(match value {
            Value::Array(parts) => Input::Velocity(scene.body(name)?, vector(parts, names)?),
            value => Input::Control(scene.control(name)?, names.number(value)?),
        })
    };
    let load = |(name, load): (&String, &Load)| {
        let body = scene.body(name)?;
        let (force, torque) = (vector(&load.force, names)?, vector(&load.torque, names)?);
        let lever = scene.bodies.orientation[body] * Vector3::from(load.at);
        Ok(Input::Load(body, force, lever.cross(&force) + torque))
    };
    let driven = run.drive.iter().map(input);
    driven.chain(run.load.iter().map(load)).collect()
}

fn vector(parts: &[Value], names: &Names) -> Result<Vector3<f64>, CaseError> {
    let mut vector = Vector3::zeros();
    for (x, part) in vector.iter_mut().zip(parts) {
        *x = names.number(part)?;
    }
    Ok(vector)
}

/// Sets them.
pub(super) fn set(stepper: &mut Stepper, inputs: &[Input]) -> Result<(), StepError> {
    for input in inputs {
        match *input {
            Input::Control(control, value) => stepper.set_control(control, value)?,
            Input::Velocity(body, velocity) => {
                stepper.set_velocity(body, velocity, Vector3::zeros())?;
            }
            Input::Load(body, force, torque) => stepper.set_load(body, force, torque)?,
        }
    }
    Ok(())
}
