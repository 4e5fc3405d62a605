//! H55: a cable of segments with heavy loads on both ends, over a fixed round edge without friction.
//!
//! The edge is a cylinder of the radius R across the cable, whose segments are capsules of the radius r. Its axis lies
//! on a polygon about the circle of ρ = R + r: n joints turn by δ = π/n each, and the segments h = 2 ρ tan(δ/2) touch
//! with their middles. The loads hang straight down from the first and the last joint.
//!
//! The pulls on a segment are as far off its axis on both sides, β and then δ − β of the next: with legs that hang
//! straight down, β is 0 and δ in turns, and each second segment hardly presses on the edge.
//!
//! # The segments' rocking
//! A segment that rocks by θ about its place touches ρ θ further along, where the normal is turned by θ: the moment
//! −N ρ θ brings it back, beside −2 T ½h θ of its neighbours' pulls. With N = 2 T sin ½δ and ½h = ρ tan ½δ both are of one
//! size, and both are in the geometric stiffness: without the first one the default α = 0.4 would be ½ α of their sum,
//! which has to be above ¼, and what rocks would grow by 3 a step.
//!
//! Sliding by t takes more cable about the edge, 2 atan((½h + t)/ρ) + 2 atan((½h − t)/ρ) < 4 atan(½h/ρ), so that this
//! is where it stays. At rest the edge carries all weight, and of the segment on top, with the pulls T of its
//! neighbours,
//!
//! ```text
//! Σ N = g (2 M + Σ m),    N − m g = 2 T sin(½ ∠(T, T'))
//! ```

use super::{borne, cylinder, rough, run};
use crate::hard::{DT, GRAVITY, at, either, solvers, together, under_gravity, worse};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::PI;
use taut_ground::trajectory::ENERGY_TOLERANCE;
use taut_integrator::{ContactForce, StepOptions, Stepper};
use taut_model::{
    Body, Cable, CableEnd, Damping, Frame, JointKind, Material, Scene, SceneError, Segments,
    Stiffness,
};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Radii of edge, cable and loads \[m].
pub(super) const EDGE: f64 = 0.2;
pub(super) const RADIUS: f64 = 0.01;
const BALL: f64 = 0.3;
/// Mass of a segment \[kg].
const SEGMENT: f64 = 0.01;
/// Largest relative error of a force.
const BAR: f64 = 1e-8;
/// Largest energy from nowhere over the motion's own.
const GAINED: f64 = 1e-3;

/// A cable over a cylinder.
#[derive(Debug, Clone, Copy)]
pub(super) struct Over {
    /// Joints that turn.
    pub(super) joints: usize,
    /// Angle from each joint to the next, and that of the first one from the horizontal \[rad].
    pub(super) turn: f64,
    pub(super) first: f64,
    /// Segments on each side that hang.
    pub(super) legs: usize,
    /// Masses of a segment and of the loads \[kg].
    pub(super) segment: f64,
    pub(super) loads: [f64; 2],
    pub(super) friction: f64,
}

impl Over {
    /// Joints that all turn by as much, without friction.
    pub(super) fn even(joints: usize) -> Self {
        let turn = PI / joints as f64;
        Self {
            joints,
            turn,
            first: 0.5 * turn,
            legs: 8,
            segment: SEGMENT,
            loads: [SEGMENT; 2],
            friction: 0.0,
        }
    }

    /// Length of a segment \[m].
    fn length(&self) -> f64 {
        2.0 * (EDGE + RADIUS) * (0.5 * self.turn).tan()
    }

    /// The ends of the segments, from the end at +x.
    fn points(&self) -> Vec<Vector3<f64>> {
        let (d, h) = (self.turn, self.length());
        let rho = (EDGE + RADIUS) / (0.5 * d).cos();
        let on = |k: usize| {
            let angle = self.first + k as f64 * d;
            Vector3::new(angle.cos(), 0.0, angle.sin()) * rho
        };
        let down = |k: usize| Vector3::z() * (h * k as f64);
        let [first, last] = [on(0), on(self.joints - 1)];
        let one = (1..=self.legs).rev().map(|k| first - down(k));
        let other = (1..=self.legs).map(|k| last - down(k));
        one.chain((0..self.joints).map(on)).chain(other).collect()
    }

    pub(super) fn build(&self) -> Result<Scene, SceneError> {
        let mut scene = under_gravity("cable over an edge");
        scene.add_collider(cylinder("edge", self.friction, 4.0, EDGE));
        let points = self.points();
        let ends = [points[0], points[points.len() - 1]];
        let mut held = Vec::new();
        for (k, end) in ends.iter().enumerate() {
            let ball = Body::sphere(BALL, self.loads[k]).at(end - Vector3::z() * BALL);
            let load = scene.add_body(format!("load-{}", k + 1), ball);
            held.push(CableEnd::Pinned(Frame::body(load, Vector3::z() * BALL)));
        }
        let segments = points.len() - 1;
        scene.add_cable(&Cable {
            points: points[1..segments].to_vec(),
            segments: Segments::Equal(segments),
            density: self.segment / self.length(),
            stiffness: Stiffness {
                ea: 1e6 * GRAVITY * self.loads[0].max(self.loads[1]),
                ei: 1.0,
                gj: 1.0,
            },
            damping: Damping::Time(0.02),
            joint: JointKind::Spherical,
            bend: false,
            twist: false,
            collide: Some(rough(self.friction)),
            ..Cable::round("cable", &Material::NYLON, RADIUS, [held[0], held[1]])
        })?;
        Ok(scene)
    }
}

/// Without friction, with loads of that many segments.
fn smooth(ratio: f64) -> Over {
    Over {
        loads: [SEGMENT * ratio; 2],
        ..Over::even(8)
    }
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    let (mut carried, mut tops) = (Vec::new(), Vec::new());
    let steps = either(quick, 120, 300);
    // Iterations would be 10⁵ of tension over inertia away from an answer.
    for choice in solvers().into_iter().filter(|c| !c.backend.is_iterative()) {
        let [sum, top] = rest(choice.options(DT), steps)?;
        carried.push((choice.family(), sum));
        tops.push((choice.family(), top));
    }
    checks.extend(together("loads of 10⁵ segments over an edge: Σ N", carried));
    checks.extend(together("segment on top: N − m g = 2 T sin(½ ∠)", tops));
    for finer in [1, 4] {
        let swings = swings(DT / finer as f64, finer * steps)?;
        let known = finer == 1;
        checks.extend(swings.into_iter().map(|check| check.limited(known, SWINGS)));
    }
    Ok(checks.into())
}

/// Why energy comes from nowhere for a while.
const SWINGS: &str = "energy comes from nowhere for some steps at 60 steps a second and goes again; at 240 there is none";

/// Checks of the edge's load and of the segment on top, after `steps` steps.
fn rest(options: StepOptions, steps: usize) -> Result<[Check; 2], ExperimentError> {
    let scene = smooth(1e5).build()?;
    let weight = scene.mass() * GRAVITY;
    let (stepper, said) = run(scene, options, steps, |_, _| {})?;
    let sum = Check::relative("", [weight, borne(&stepper).z], "N", BAR);
    let top = Check::relative("", top(&stepper), "N", BAR);
    Ok([sum.noting(said), top])
}

/// 2 T sin(½ ∠) and N − m g of the segment on top.
fn top(stepper: &Stepper) -> [f64; 2] {
    let scene = stepper.scene();
    let parts = &scene.cables[0];
    let middle = parts.bodies.len() / 2;
    let pull = |joint: usize, side: usize| {
        let wrench = stepper.force_on(parts.joints[joint], side);
        wrench.map_or(Vector3::repeat(f64::NAN), |w| w.force)
    };
    let pulls = [pull(middle, 1), pull(middle + 1, 0)];
    let [a, b] = pulls.map(|p| p.norm());
    // Angle between one pull and the reverse of the other.
    let across = pulls[0].angle(&-pulls[1]);
    let body = parts.bodies[middle];
    let of = |c: &ContactForce| c.bodies.contains(&Some(body));
    let force: Vector3<f64> = stepper.contacts().filter(of).map(|c| c.force).sum();
    let weight = scene.bodies.mass[body] * GRAVITY;
    [(a + b) * (0.5 * across).sin(), force.norm() - weight]
}

/// Loads that swing in the plane of the cable and along the edge keep their energy.
fn swings(dt: f64, steps: usize) -> Result<Vec<Check>, ExperimentError> {
    let mut checks = Vec::new();
    for (name, speeds) in [
        ("in the plane", [Vector3::x(), Vector3::x()]),
        ("along the edge", [Vector3::y(), -Vector3::y()]),
    ] {
        let mut scene = smooth(1e5).build()?;
        for (load, speed) in speeds.iter().enumerate() {
            scene.bodies.velocity[load] = speed * 0.5;
        }
        let watched = StepOptions {
            energy_tolerance: Some(ENERGY_TOLERANCE),
            ..at(dt)
        };
        let kinetic = scene.kinetic_energy();
        let (mut gained, mut last) = (0.0, 0.0);
        let (_, said) = run(scene, watched, steps, |_, report| {
            let balance = report.balance.unwrap_or_default();
            gained = worse(gained, balance.excess);
            last = (balance.gained - balance.work) / kinetic;
        })?;
        let case = format!("loads swing {name}, {:.0} steps a second: energy", 1.0 / dt);
        let note = format!("{last:+.1e} of the kinetic energy at the end; {said}");
        let check = Check::off(case, "none gained", gained, "", GAINED);
        checks.push(
            check
                .by("energy from nowhere over the motion's own")
                .noting(note),
        );
    }
    Ok(checks)
}
