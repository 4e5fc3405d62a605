//! What drives a run.

use super::run::dt;
use super::text::Names;
use super::{CaseError, Load, Run};
use nalgebra::Vector3;
use taut_integrator::{StepError, Stepper};
use taut_model::Scene;
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
) -> Result<Vec<Input>, CaseError> {
    if run.drive.is_empty() && run.load.is_empty() {
        return Ok(Vec::new());
    }
    names.values.set("time", time);
    names.values.set("dt", dt(run, names)?);
    let input = |(name, value): (&String, &Value)| {
        let controls = scene.controls.iter().map(|control| &control.name);
        Ok::<_, CaseError>(match value {
            Value::Array(parts) => Input::Velocity(body(scene, name)?, vector(parts, names)?),
            value => Input::Control(numbered("control", name, controls)?, names.number(value)?),
        })
    };
    let load = |(name, load): (&String, &Load)| {
        let body = body(scene, name)?;
        let (force, torque) = (vector(&load.force, names)?, vector(&load.torque, names)?);
        let lever = scene.bodies.orientation[body] * Vector3::from(load.at);
        Ok::<_, CaseError>(Input::Load(body, force, lever.cross(&force) + torque))
    };
    let driven = run
        .drive
        .iter()
        .map(|entry| input(entry).map_err(|e| e.inside(entry.0).inside(&"drive")));
    let loads = run
        .load
        .iter()
        .map(|entry| load(entry).map_err(|e| e.inside(entry.0).inside(&"load")));
    driven.chain(loads).collect()
}

/// Number of the body of that name.
pub(super) fn body(scene: &Scene, name: &str) -> Result<usize, CaseError> {
    numbered("body", name, scene.body_names.iter())
}

/// Number of a name among those that there are.
pub(super) fn numbered<'a>(
    kind: &'static str,
    name: &str,
    mut known: impl Iterator<Item = &'a String> + Clone,
) -> Result<usize, CaseError> {
    let all = known.clone().map(String::as_str);
    let found = known.position(|known| known == name);
    found.ok_or_else(|| CaseError::unknown(kind, name, all))
}

fn vector(parts: &[Value], names: &Names) -> Result<Vector3<f64>, CaseError> {
    if parts.len() != 3 {
        let message = format!("a vector has three numbers, not {}", parts.len());
        return Err(CaseError::message(&message));
    }
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
