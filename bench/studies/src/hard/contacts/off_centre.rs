//! H65: boxes and cylinders of any masses rest on each other, off their middles.
//!
//! As long as the middle of all that stands above a face lies within it, a pile at rest stays so: it sinks by its surfaces'
//! compliance, and drifts nowhere after that. Its energy is never above that of the start.

use super::{DT, ground, put, put_box, rough, run};
use crate::hard::{at, counted, either, worse};
use indicatif::ProgressBar;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use taut_integrator::{StepError, Stepper};
use taut_model::collide::Shape;
use taut_model::{Body, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Piles from below: b a box, c a cylinder; their masses \[kg].
const PILES: [(&str, &[f64]); 8] = [
    ("cb", &[1.0, 1.0]),
    ("cb", &[1e5, 1e5]),
    ("cb", &[1e6, 1e6]),
    ("cb", &[1.0, 1e5]),
    ("cb", &[1e6, 1.0]),
    ("bc", &[1e5, 1e5]),
    ("bcb", &[3e4, 1.0, 3e4]),
    ("bcb", &[1e5, 1.0, 1e5]),
];
/// How far every second one is off \[m].
const OFFSETS: [f64; 3] = [3e-3, 0.03, 0.1];
const BOX: Vector3<f64> = Vector3::new(0.8, 0.7, 0.4);
/// Length and radius of the cylinders \[m].
const CYLINDER: [f64; 2] = [0.3, 0.4];
/// Largest drift \[m]: within the first steps, as nothing moves later.
const DRIFT: f64 = 1e-4;
/// Largest energy above that of the start over the energy of position, rounding.
const GAIN: f64 = 1e-9;

fn pile((kinds, masses): (&str, &[f64]), off: f64) -> Scene {
    let mut scene = ground("pile", 0.0, rough(0.5));
    let mut top = 0.0;
    for (k, (kind, mass)) in kinds.chars().zip(masses).enumerate() {
        let [length, radius] = CYLINDER;
        let height = if kind == 'b' { BOX.z } else { length };
        let place = Vector3::new((k % 2) as f64 * off, 0.0, top + 0.5 * height);
        if kind == 'b' {
            put_box(
                &mut scene,
                [BOX, place],
                UnitQuaternion::identity(),
                *mass,
                rough(0.5),
            );
        } else {
            let across = (3.0 * radius * radius + length * length) / 12.0;
            let inertia = Vector3::new(across, across, 0.5 * radius * radius) * *mass;
            let body = Body::new(*mass, Matrix3::from_diagonal(&inertia)).at(place);
            let shape = Shape::Cylinder { length, radius };
            put(
                &mut scene,
                &format!("cylinder-{k}"),
                body,
                shape,
                rough(0.5),
            );
        }
        top += height;
    }
    scene
}

/// Figures of a pile.
#[derive(Debug, Clone, Copy, Default)]
struct Rest {
    /// Largest drift \[m], and what it comes to in the second half of the time.
    drift: f64,
    later: f64,
    /// Largest energy above that of the start over that of position.
    gained: f64,
}

fn rest(scene: Scene, time: f64) -> Result<Rest, StepError> {
    let (start, mut places) = (scene.potential_energy(), scene.bodies.position.clone());
    let first = places.clone();
    let away = |stepper: &Stepper, from: &[Vector3<f64>]| {
        let now = stepper.scene().bodies.position.iter();
        now.zip(from)
            .fold(0.0, |most, (a, b)| worse(most, (a - b).xy().norm()))
    };
    let mut found = Rest::default();
    let steps = (time / DT).round() as usize;
    run(scene, at(DT), steps, |stepper, _| {
        let scene = stepper.scene();
        let energy = scene.kinetic_energy() + scene.potential_energy();
        found.gained = worse(found.gained, energy / start - 1.0);
        found.drift = worse(found.drift, away(stepper, &first));
        if stepper.time() < 0.5 * time {
            places.clone_from(&scene.bodies.position);
        }
        found.later = worse(found.later, away(stepper, &places));
    })?;
    Ok(found)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![pile(PILES[1], OFFSETS[1])])
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let time = either(quick, 0.25, 1.5);
    let mut checks = Vec::new();
    for (kinds, masses) in counted(progress, PILES) {
        let mut worst = Rest::default();
        for off in OFFSETS {
            let found = rest(pile((kinds, masses), off), time)?;
            worst.drift = worse(worst.drift, found.drift);
            worst.later = worse(worst.later, found.later);
            worst.gained = worse(worst.gained, found.gained);
        }
        let masses: Vec<String> = masses.iter().map(|m| format!("{m:e}")).collect();
        let case = format!("{kinds} of {} kg", masses.join(", "));
        let check = Check::off(format!("{case}: drift"), "rests", worst.drift, "m", DRIFT);
        let check = check.by(format!("in {time} s, largest of offsets of {OFFSETS:?} m"));
        let cause = "its contacts yield by their compliance at first";
        let cause = format!("{cause}; {:.0e} m in the second half", worst.later);
        checks.push(check.limited(worst.later < DRIFT, cause));
        let case = format!("{case}: energy");
        let check = Check::off(case, "none gained", worst.gained, "", GAIN);
        checks.push(check.by("above the start, over the energy of position"));
    }
    Ok(checks.into())
}
