//! H45, Painlevé's rod: a rod that slides on its lower end with so much friction that its accelerations have no
//! solution.
//!
//! A thin rod of the mass m and the half length l leans at the angle θ to the floor, its centre at the side +x of the
//! end on which it slides. With c = cos θ, s = sin θ and friction μ N along σ = ±1, against the sliding, the end's
//! acceleration upwards is
//!
//! ```text
//! z̈ = p N/m + …,    p = 1 + 3c² − 3 σ μ s c
//! ```
//!
//! For the sliding that friction opposes towards +x, σ = 1, p < 0 where μ > (1 + 3c²)/(3 s c), whose least value is 4/3
//! at tan θ = 2: the harder the floor pushes, the deeper the end digs in. Rigid bodies then have no acceleration, or
//! two. An impulse in place of the force exists (the rod jams and is thrown over), and a step that solves for impulses
//! with positive definite W has one always. So each run has to end, with finite numbers and no more energy than it
//! began with.

use super::{GRAVITY, Said, ground, put, rough, run};
use crate::hard::{at, either, worse};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;
use taut_model::collide::Shape;
use taut_model::{Body, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

const HALF: f64 = 0.5;
const RADIUS: f64 = 1e-3;
/// Largest gain of energy over that of the start.
const GAINED: f64 = 1e-6;

/// Why the first step may gain.
const JAMS: &str = "in the first step alone: a staggered start takes half of the first impulse back, and the second \
                    one of a rod that jams differs from it by much";

/// A rod on the floor at the angle θ (rad), whose lower end slides with `speed` along x.
fn rod(angle: f64, speed: f64, friction: f64) -> Scene {
    let mut scene = ground("Painlevé's rod", 0.0, rough(friction));
    // The rod's z axis from the vertical to cos θ x + sin θ z.
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2 - angle);
    let centre = turn * Vector3::z() * HALF + Vector3::z() * RADIUS;
    let mut body = Body::rod(2.0 * HALF, RADIUS, 1.0).at(centre).turned(turn);
    body.velocity.x = speed;
    let shape = Shape::Capsule {
        length: 2.0 * HALF,
        radius: RADIUS,
    };
    put(&mut scene, "rod", body, shape, rough(friction));
    scene
}

/// The least friction with which the rod's accelerations are inconsistent.
fn least(angle: f64) -> f64 {
    let (s, c) = angle.sin_cos();
    (1.0 + 3.0 * c * c) / (3.0 * s * c)
}

/// Figures of a slide.
struct Slide {
    /// Largest energy gain, over the energy at the start.
    gained: f64,
    /// Largest gain after the first step, over the energy at the start.
    later: f64,
    said: Said,
    /// Speed of the end upwards at most in the first tenth of a second \[m/s].
    thrown: f64,
}

fn slide(angle: f64, speed: f64, friction: f64, dt: f64) -> Result<Slide, ExperimentError> {
    let scene = rod(angle, speed, friction);
    let start = scene.kinetic_energy() + scene.mass() * GRAVITY * scene.bodies.position[0].z;
    let (mut gained, mut later, mut thrown) = (0.0, 0.0, 0.0_f64);
    let steps = (1.0 / dt).round() as usize;
    let (_, said) = run(scene, at(dt), steps, |stepper, _| {
        let now = stepper.energy().total() / start - 1.0;
        gained = worse(gained, now);
        if stepper.time() > 1.5 * dt {
            later = worse(later, now);
        }
        if stepper.time() < 0.1 {
            let bodies = &stepper.scene().bodies;
            let arm = bodies.orientation[0] * Vector3::z() * -HALF;
            let end = bodies.velocity[0] + bodies.angular_velocity[0].cross(&arm);
            thrown = thrown.max(end.z);
        }
    })?;
    Ok(Slide {
        gained,
        later,
        said,
        thrown,
    })
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let steepest = 2.0_f64.atan();
    let rates: &[f64] = either(quick, &[60.0], &[60.0, 240.0, 1000.0]);
    let mut checks = Vec::new();
    for (angle, friction) in [
        (steepest, 1.3),
        (steepest, 1.4),
        (steepest, 3.0),
        (0.9, 10.0),
    ] {
        for speed in [-3.0, 3.0] {
            let inconsistent = speed < 0.0 && friction > least(angle);
            let (mut gained, mut later, mut undecided, mut thrown) = (0.0, 0.0, 0, 0.0_f64);
            for rate in rates {
                let slide = slide(angle, speed, friction, 1.0 / rate)?;
                gained = worse(gained, slide.gained);
                later = worse(later, slide.later);
                undecided += slide.said.undecided;
                thrown = thrown.max(slide.thrown);
            }
            let kind = either(inconsistent, "inconsistent", "consistent");
            let case = format!("rod at {angle:.3} rad, {speed} m/s, μ = {friction}: {kind}");
            let check = Check::off(case, "no energy gained", gained, "", GAINED);
            let note =
                format!("{undecided} undecided steps; the end is thrown up with {thrown:.2} m/s");
            let check = check
                .by("largest energy over that of the start, less 1")
                .noting(note);
            checks.push(check.limited(later <= GAINED, JAMS));
        }
    }
    Ok(checks.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paradox_begins_at_four_thirds() {
        assert!((least(2.0_f64.atan()) - 4.0 / 3.0).abs() < 1e-14);
        assert!(least(0.9) > 4.0 / 3.0 && least(1.2) > 4.0 / 3.0);
    }
}
