//! The two motions that every engine goes through: the cable at rest, and a swing.
//!
//! The swing starts from rest with the straight cable turned aside by θ and stretched as gravity along it asks for,
//! T = g cos θ × (mass below): the load then swings and does not bounce. At rest θ = 0, and the exact elongation is
//! Σ T/k. The chain of point masses puts half a segment's mass at each of its ends, which gives it the same one.

use crate::pace;
use crate::reference;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Hoist, HoistParams, Scene, SceneError};

/// One frame \[s].
pub const FRAME: f64 = 1.0 / 60.0;

/// A start: the hoist straight and at rest, turned aside.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// The hoist, hanging straight down.
    pub params: HoistParams,
    /// Angle from the vertical \[rad], below π/2.
    pub angle: f64,
}

/// The cable as point masses and springs without mass between them; the first point is held.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// Positions at the start, the anchor's first and the load's last \[m].
    pub position: Vec<Vector3<f64>>,
    /// Positions at the start with no spring stretched \[m].
    pub unstretched: Vec<Vector3<f64>>,
    /// Masses; half a segment's at the anchor, where it takes no part \[kg].
    pub mass: Vec<f64>,
    /// Length of a spring without force \[m].
    pub length: f64,
    /// Its stiffness, EA/length \[N/m].
    pub stiffness: f64,
}

impl Motion {
    /// The parameters worked out.
    pub fn hoist(&self) -> Result<Hoist, SceneError> {
        self.params.resolve()
    }

    /// From the body frame of a hanging segment to the world.
    pub fn turn(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(Vector3::y() * self.angle)
    }

    /// Component of gravity along the cable \[m/s²].
    pub fn gravity_along(&self) -> f64 {
        self.params.gravity * self.angle.cos()
    }

    /// The rigid segments and the load at the start.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let along = HoistParams {
            gravity: self.gravity_along(),
            ..self.params.clone()
        };
        let mut scene = along.hanging_equilibrium()?;
        scene.gravity = Vector3::new(0.0, 0.0, -self.params.gravity);
        // A vertical cable keeps exact zeros in x and y.
        if self.angle != 0.0 {
            let turn = self.turn();
            let bodies = &mut scene.bodies;
            for (x, e) in bodies.position.iter_mut().zip(&mut bodies.orientation) {
                *x = turn * *x;
                *e = turn * *e;
            }
        }
        Ok(scene)
    }

    /// The point masses at the start.
    pub fn points(&self) -> Result<Points, SceneError> {
        let hoist = self.hoist()?;
        let n = hoist.segments;
        let (mass, length) = (hoist.segment_mass, hoist.segment_length);
        let stiffness = hoist.stiffness.ea / length;
        let below = self.turn() * -Vector3::z();
        let (mut depth, mut position) = (0.0, vec![Vector3::zeros()]);
        for i in 0..n {
            let hanging = hoist.load_mass + mass * ((n - 1 - i) as f64 + 0.5);
            depth += length + self.gravity_along() * hanging / stiffness;
            position.push(below * depth);
        }
        let mut masses = vec![mass; n + 1];
        masses[0] = 0.5 * mass;
        masses[n] = 0.5 * mass + hoist.load_mass;
        Ok(Points {
            position,
            unstretched: (0..=n).map(|i| below * (i as f64 * length)).collect(),
            mass: masses,
            length,
            stiffness,
        })
    }
}

/// Load positions after each frame of our own model, stepped finely.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Converged {
    /// Sub-steps a frame.
    pub substeps: usize,
    /// Load positions, from the first frame on \[m].
    pub load: Vec<[f64; 3]>,
    /// Largest distance from the same motion with half as many sub-steps \[m].
    pub halved: f64,
}

/// Sub-steps of a frame that the reference takes: its error is then below a ten-thousandth of one step's.
const SUBSTEPS: usize = 128;

/// The motion with the default step at 1/7680 s, and what it differs by from that at 1/3840 s. Kept in a file.
pub fn converged(motion: &Motion, frames: usize) -> Result<Converged, StepError> {
    let key = format!("engines 1 {motion:?} {frames} {SUBSTEPS}");
    crate::cache::cached(&key, || {
        let (coarse, fine) = rayon::join(
            || stepped(motion, SUBSTEPS / 2, frames),
            || stepped(motion, SUBSTEPS, frames),
        );
        let (coarse, fine) = (coarse?, fine?);
        let distances = fine.iter().zip(&coarse).map(|(f, c)| (f - c).norm());
        Ok(Converged {
            substeps: SUBSTEPS,
            halved: distances.fold(0.0, f64::max),
            load: fine.into_iter().map(Into::into).collect(),
        })
    })
}

/// Load positions after each of `frames` frames of `substeps` steps.
fn stepped(
    motion: &Motion,
    substeps: usize,
    frames: usize,
) -> Result<Vec<Vector3<f64>>, StepError> {
    let options = StepOptions {
        dt: FRAME / substeps as f64,
        ..StepOptions::default()
    };
    let mut stepper = Stepper::new(motion.scene()?, options)?;
    let mut load = Vec::with_capacity(frames);
    for _ in 0..frames {
        for _ in 0..substeps {
            pace::step(&mut stepper)?;
        }
        load.push(crate::trajectory::load_position(stepper.scene()));
    }
    Ok(load)
}

/// Distance of a load from where its cable can reach, beyond which a run is lost \[m].
pub fn reach(params: &HoistParams) -> Result<f64, SceneError> {
    Ok(2.0 * (params.length + params.exact_elongation()) + reference::most_gap(params)?)
}
