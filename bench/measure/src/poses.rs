//! Hoists in poses that ask something of a solver: a cable that hangs straight is a chain of scalar systems, a bent one
//! couples all its rows.

use crate::random::Random;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::fmt;
use taut_model::{HoistParams, Scene, SceneError};

/// The pose of a hoist.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pose {
    /// Hanging in equilibrium, with the random angular velocities of the parameters.
    Straight,
    /// On a space curve that turns by about 0.1 rad a joint, under the tension of the hanging cable, with random
    /// velocities.
    Bent,
}

impl fmt::Display for Pose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Straight => "straight",
            Self::Bent => "bent",
        })
    }
}

const BENT_SEED: u64 = 11;

pub fn hoist(params: &HoistParams, pose: Pose) -> Result<Scene, SceneError> {
    match pose {
        Pose::Straight => params.hanging_equilibrium(),
        Pose::Bent => {
            let mut scene = params.build()?;
            let cable = params.resolve()?;
            let gaps: Vec<f64> = cable.gaps(params.gravity).collect();
            bend(&mut scene, cable.segment_length, &gaps, BENT_SEED);
            Ok(scene)
        }
    }
}

/// Lays the cable of an unstrained hoist along a space curve, with gaps along it, and gives all bodies velocities.
fn bend(scene: &mut Scene, segment: f64, gaps: &[f64], seed: u64) {
    let mut random = Random::new(seed);
    let bodies = &mut scene.bodies;
    let (mut end, mut turn) = (Vector3::zeros(), UnitQuaternion::identity());
    let load = bodies.len() - 1;
    for (i, gap) in gaps.iter().enumerate() {
        turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.02, 0.1, 0.01)) * turn;
        let down = turn * -Vector3::z();
        let half = if i == load { 0.0 } else { 0.5 * segment };
        bodies.position[i] = end + down * (gap + half);
        bodies.orientation[i] = turn;
        bodies.velocity[i] = random.vector(0.3);
        bodies.angular_velocity[i] = random.vector(0.3);
        end += down * (gap + 2.0 * half);
    }
}
