//! The specimen at rest under torques that rise, each joint beside T l_j/GJ.

use super::specimen;
use crate::paper::specimens::{Joint, largest, read, settle};
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;
use taut_output::check::ExperimentError;

/// Largest turn of a joint in a load step \[rad], below half a turn.
const LARGEST_TURN: f64 = 2.5;

/// A specimen at rest under one torque.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Material.
    pub material: String,
    /// Segments.
    pub segments: usize,
    /// Joint.
    pub joint: String,
    /// T \[N m].
    pub torque_nm: f64,
    /// T L/GJ \[rad].
    pub twist_theory: f64,
    /// Sum of the joints' twists \[rad].
    pub twist: f64,
    /// Largest relative error of a joint's twist against T l_j/GJ.
    pub angle_error: f64,
    /// Relative error of the whole against T L/GJ.
    pub total_error: f64,
}

/// A specimen at rest under torques that rise in equal steps to the twist `farthest` (rad).
///
/// # Errors
/// A scene that cannot be built, or an equilibrium that is not found.
pub fn at_rest(
    material: (&str, f64),
    n: usize,
    joint: Joint,
    farthest: f64,
) -> Result<Vec<Row>, ExperimentError> {
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
        let errors = joints.iter().enumerate();
        let errors = errors.map(|(j, r)| (r.twist / exact(angle, j) - 1.0).abs());
        let twist: f64 = joints.iter().map(|r| r.twist).sum();
        rows.push(Row {
            material: material.0.to_owned(),
            segments: n,
            joint: joint.name().to_owned(),
            torque_nm: stiffness * angle,
            twist_theory: angle,
            twist,
            angle_error: largest(errors),
            total_error: (twist / angle - 1.0).abs(),
        });
    }
    Ok(rows)
}
