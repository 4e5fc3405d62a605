//! The specimen at rest under torques that rise, each joint beside T l_j/GJ; and what the twist row reads of bending, by
//! definition of the angle.

use super::specimen;
use crate::paper::specimens::{Joint, MATERIALS, off_exact, params};
use crate::rest::{read, settle};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use taut_model::{Scene, Specimen};
use taut_output::check::ExperimentError;

/// Largest turn of a joint in a load step \[rad], below half a turn.
const LARGEST_TURN: f64 = 2.5;

/// A specimen at rest under torques that rise in equal steps to a twist of `farthest` (rad); for each the twist T L/GJ of
/// theory and the joints' sum; relative errors, the largest of a joint against T l_j/GJ and that of the whole.
pub(in crate::paper) fn at_rest(
    material: (&str, f64),
    n: usize,
    joint: Joint,
    farthest: f64,
) -> Result<(Scene, Vec<Value>), ExperimentError> {
    let params = specimen(material, n, joint)?;
    let found = params.resolve()?;
    let mut scene = params.build()?;
    let steps = (farthest / n as f64 / LARGEST_TURN).ceil().max(24.0) as usize;
    let stiffness = found.stiffness.gj / params.length;
    let exact = |angle: f64, j: usize| angle * found.joint_length(j) / params.length;
    if joint == Joint::Alternative {
        // Its angle has no gradient where it is zero: it starts from half the first load's twist.
        let half = 0.5 * farthest / steps as f64;
        let mut turned = 0.0;
        for i in 0..=n {
            turned += exact(half, i);
            scene.bodies.orientation[i] = UnitQuaternion::from_scaled_axis(Vector3::x() * turned);
        }
    }
    let mut rows = Vec::new();
    for k in 1..=steps {
        let angle = farthest * k as f64 / steps as f64;
        scene.bodies.torque[n].x = stiffness * angle;
        scene = settle(scene)?;
        let joints = read(&scene, n);
        let twist: f64 = joints.iter().map(|r| r.twist).sum();
        rows.push(json!({
            "material": material.0,
            "segments": n,
            "joint": joint,
            "torque_nm": stiffness * angle,
            "twist_theory": angle,
            "twist": twist,
            "angle_error": off_exact(&joints, |r| r.twist, |j| exact(angle, j)),
            "total_error": (twist / angle - 1.0).abs(),
        }));
    }
    Ok((scene, rows))
}

/// Twist angles (rad) read from a bent, untwisted joint by definition of the angle, for bends of θ about v, w and between
/// them.
pub fn leaks() -> Result<Vec<Value>, ExperimentError> {
    let mut leaks = Vec::new();
    for direction_rad in [0.0, FRAC_PI_4, FRAC_PI_2] {
        for theta in [0.01, 0.03, 0.1, 0.3, 1.0] {
            let (sine, cosine) = f64::sin_cos(direction_rad);
            let axis = Vector3::new(0.0, cosine, sine);
            let reading = |joint| -> Result<f64, ExperimentError> {
                let mut scene = params(Specimen::Bend, MATERIALS[2], 1, joint).build()?;
                scene.bodies.orientation[0] = UnitQuaternion::from_scaled_axis(axis * theta);
                Ok(read(&scene, 1)[0].twist)
            };
            leaks.push(json!({
                "theta": theta,
                "direction_rad": direction_rad,
                "cosserat": reading(Joint::Cosserat)?,
                "ordinary": reading(Joint::Ordinary)?,
                "alternative": reading(Joint::Alternative)?,
            }));
        }
    }
    Ok(leaks)
}
