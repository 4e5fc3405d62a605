//! What the twist row reads of bending, by definition of the angle.

use crate::paper::specimens::{Joint, MATERIALS, params, read};
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use taut_model::Specimen;
use taut_output::check::ExperimentError;

/// What the twist row of a bent, untwisted joint reads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Leak {
    /// Bend angle θ \[rad].
    pub theta: f64,
    /// Direction of the bend axis, from v to w \[rad].
    pub direction_rad: f64,
    /// Cosserat joint \[rad].
    pub cosserat: f64,
    /// The paper's ordinary angle \[rad].
    pub ordinary: f64,
    /// The paper's alternative angle \[rad].
    pub alternative: f64,
}

/// Readings of a bent joint for bends about v, w and between them.
///
/// # Errors
/// A scene that cannot be built.
pub fn leaks() -> Result<Vec<Leak>, ExperimentError> {
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
            leaks.push(Leak {
                theta,
                direction_rad,
                cosserat: reading(Joint::Cosserat)?,
                ordinary: reading(Joint::Ordinary)?,
                alternative: reading(Joint::Alternative)?,
            });
        }
    }
    Ok(leaks)
}
