//! The damping law on single deformation modes: a ball on a spring, and two balls that twist against each other.

use crate::law::{fitted, roots};
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Body, Constraint, Cosserat, Frame, JointLaw, RowLaw, Scene, Spherical};

/// Measured effect of the step on a mode, beside the law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Law {
    /// `stretch`, `twist`.
    pub mode: &'static str,
    /// ωΔt.
    pub frequency: f64,
    /// Factor of the amplitude in a step.
    pub amplitude: f64,
    /// (1 + ω²Δt²)^(−1/2).
    pub amplitude_law: f64,
    /// Phase of a step \[rad].
    pub phase: f64,
    /// arctan ωΔt \[rad].
    pub phase_law: f64,
}

impl Law {
    /// The larger of the two distances from the law.
    pub fn error(&self) -> f64 {
        let amplitude = (self.amplitude - self.amplitude_law).abs();
        amplitude.max((self.phase - self.phase_law).abs())
    }
}

/// 2 kg on a spring of the world, 1 cm off.
fn ball(compliance: f64) -> Scene {
    let mut scene = Scene::new("ball");
    scene.gravity = Vector3::zeros();
    let place = Vector3::new(0.01, 0.0, 0.0);
    let body = scene.add_body("ball", Body::sphere(0.1, MASS).at(place));
    let frames = [
        Frame::world(Vector3::zeros()),
        Frame::body(body, Vector3::zeros()),
    ];
    let stretch = RowLaw::new(compliance, 0.0);
    scene.add_constraint(
        "spring",
        Constraint::Spherical(Spherical { frames, stretch }),
        0,
    );
    scene
}

/// Two free balls with a cable joint halfway, twisted by 0.3 rad.
fn pair(compliance: f64) -> Scene {
    let mut scene = Scene::new("pair");
    scene.gravity = Vector3::zeros();
    let half = Vector3::new(0.0, 0.0, 0.5);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.3));
    let above = scene.add_body("above", Body::sphere(RADIUS, MASS).at(half));
    let below = Body::sphere(RADIUS, MASS).at(-half).turned(turn);
    let below = scene.add_body("below", below);
    let frames = [Frame::body(above, -half), Frame::body(below, half)];
    let other = Some(RowLaw::new(1e-6, 0.0));
    let law = JointLaw {
        stretch: other,
        bend: other,
        twist: Some(RowLaw::new(compliance, 0.0)),
    };
    scene.add_constraint("joint", Constraint::Cosserat(Cosserat::new(frames, law)), 0);
    scene
}

const MASS: f64 = 2.0;
const RADIUS: f64 = 0.1;

/// The stretch and the twist mode with frequency ωΔt = `frequency`, stepped by the paper's step.
pub fn law(frequency: f64, dt: f64) -> Result<[Law; 2], StepError> {
    let square = (frequency / dt).powi(2);
    // ω² = 1/(ε m): the ball's mass; the balls' inertia ⅖ m r², halved, since both turn.
    let twisting = 0.5 * 0.4 * MASS * RADIUS * RADIUS;
    let scenes = [
        ("stretch", ball(1.0 / (square * MASS)), 0),
        ("twist", pair(1.0 / (square * twisting)), 5),
    ];
    let measure = |(mode, scene, row): (&'static str, Scene, usize)| -> Result<Law, StepError> {
        let options = StepOptions {
            dt,
            ..StepOptions::paper()
        };
        let mut stepper = Stepper::new(scene, options)?;
        let mut x = [0.0; 4];
        for sample in &mut x {
            *sample = stepper.linearized().phi[row];
            stepper.step()?;
        }
        let found = roots(&fitted(&x, 2));
        let [amplitude, phase] = found.first().copied().unwrap_or([f64::NAN; 2]);
        Ok(Law {
            mode,
            frequency,
            amplitude,
            amplitude_law: (1.0 + frequency * frequency).sqrt().recip(),
            phase,
            phase_law: frequency.atan(),
        })
    };
    let [stretch, twist] = scenes.map(measure);
    Ok([stretch?, twist?])
}
