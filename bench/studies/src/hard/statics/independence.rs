//! H13: where a cable comes to rest depends neither on what damps it, nor on the time step, the solver or the order of
//! bodies and constraints.
//!
//! A cantilever of 1 m with EI = 1 N m² sags under its own weight and a load at its tip; it is let go straight and
//! swings until it is at rest. Its exact discrete shape is known ([`super::rod`]).

use super::rod::Rod;
use crate::hard::{DT, alike, either, solvers};
use crate::paper::specimens::largest;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use rayon::prelude::*;
use taut_ground::choice::Choice;
use taut_ground::random::Random;
use taut_ground::trajectory::steps_in;
use taut_integrator::{StepOptions, Stepper};
use taut_model::{Scene, Side};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Bar of the shape, over L.
pub(super) const BAR: f64 = 1e-8;

/// Circular frequency of the first mode of the straight cantilever is 3.5 rad/s: 0.3 s damp it to half critical.
const DAMPING: f64 = 0.3;
/// In half a minute what is left of it is below rounding.
const SECONDS: f64 = 25.0;

/// The cantilever with `n` segments and a damping time (s).
fn rod(n: usize, damping: f64) -> Rod {
    Rod {
        gravity: Vector3::new(0.0, 0.0, -2.0),
        damping,
        ..Rod::midpoints(n)
    }
}

/// The scene with its bodies and its constraints in another order; and which body now is number i.
fn permuted(scene: &Scene, seed: u64) -> (Scene, Vec<usize>) {
    let mut random = Random::new(seed);
    let bodies = random.permutation(scene.bodies.len());
    let constraints = random.permutation(scene.constraints.len());
    let mut place = vec![0; bodies.len()];
    let mut new = Scene {
        gravity: scene.gravity,
        ..Scene::new(scene.name.clone())
    };
    for (now, &before) in bodies.iter().enumerate() {
        place[before] = now;
        new.add_body(scene.body_names[before].clone(), scene.bodies.get(before));
    }
    for &c in &constraints {
        let mut constraint = scene.constraints[c].clone();
        for frame in constraint.frames_mut() {
            if let Side::Body(i) = &mut frame.side {
                *i = place[*i];
            }
        }
        new.add_constraint(
            scene.constraint_names[c].clone(),
            constraint,
            scene.groups[c],
        );
    }
    new.load = scene.load.map(|i| place[i]);
    (new, place)
}

/// A way to rest.
struct Way {
    name: String,
    options: StepOptions,
    /// Damping time \[s].
    damping: f64,
    /// Seed of the order of bodies and constraints; 0 is their natural order.
    order: u64,
    /// Simulated time \[s].
    seconds: f64,
}

/// Largest distance of an end of a segment from its place in the exact shape, over L, after the
/// run; NaN without an exact shape. Then the speed that is left \[m/s].
fn distance(n: usize, way: &Way) -> Result<[f64; 2], ExperimentError> {
    let rod = rod(n, way.damping);
    let scene = rod.scene()?;
    let (scene, place) = match way.order {
        0 => (scene.clone(), (0..scene.bodies.len()).collect()),
        seed => permuted(&scene, seed),
    };
    let mut stepper = Stepper::new(scene, way.options.clone())?;
    for _ in 0..steps_in(way.seconds, way.options.dt) {
        stepper.step()?;
    }
    let speed = largest(stepper.scene().bodies.velocity.iter().map(Vector3::norm));
    // In their natural order again.
    let mut bodies = taut_model::Bodies::new();
    for &now in &place {
        bodies.push(stepper.scene().bodies.get(now));
    }
    let at_rest = Scene {
        bodies,
        ..Scene::default()
    };
    let ours = rod.read(&at_rest);
    let off = rod.exact(10).map_or(f64::NAN, |exact| {
        let pairs = ours.ends.iter().zip(&exact.ends);
        largest(pairs.map(|(a, b)| (a - b).norm()))
    });
    Ok([off, speed])
}

fn ways(quick: bool) -> Vec<(&'static str, Vec<Way>)> {
    let all = solvers();
    let way = |name: String, choice: &Choice, dt: f64| Way {
        name,
        options: choice.plain_options(dt),
        damping: DAMPING,
        order: 0,
        seconds: SECONDS,
    };
    let direct = &all[0];
    let plain = |name: String| way(name, direct, DT);
    let fractions: &[f64] = either(quick, &[30.0, 240.0], &[30.0, 60.0, 120.0, 240.0, 960.0]);
    let steps = fractions
        .iter()
        .map(|f| way(format!("1/{f} s"), direct, 1.0 / f));
    let dampings: &[f64] = either(quick, &[0.15, 0.6], &[0.1, 0.15, 0.3, 0.6, 1.2]);
    let dampings = dampings.iter().map(|&damping| Way {
        damping,
        // Where it is more than critical the slowest motion takes the damping time.
        seconds: SECONDS * (damping / DAMPING).max(DAMPING / damping),
        ..plain(format!("{damping} s"))
    });
    let orders = (1..=if quick { 2 } else { 8 }).map(|order| Way {
        order,
        ..plain(format!("seed {order}"))
    });
    let schemes = [
        ("third difference", StepOptions::default()),
        ("linearly implicit", StepOptions::paper()),
    ];
    let schemes = schemes.map(|(name, options)| Way {
        options,
        ..plain(name.to_owned())
    });
    let chosen = all.iter().filter(|c| !quick || !c.backend.is_iterative());
    let by_solver = chosen.map(|choice| way(choice.family(), choice, DT));
    vec![
        ("solvers", by_solver.collect()),
        ("time steps", steps.collect()),
        ("damping times", dampings.collect()),
        ("orders of bodies and constraints", orders.collect()),
        ("schemes", schemes.into()),
    ]
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let n = if quick { 4 } else { 6 };
    let groups = ways(quick);
    progress.set_length(groups.iter().map(|(_, ways)| ways.len() as u64).sum());
    let mut checks = Vec::new();
    for (what, ways) in groups {
        let found: Vec<(String, Check)> = ways
            .par_iter()
            .map(|way| {
                let [off, speed] = distance(n, way)?;
                progress.inc(1);
                let ours = format!("{off:.1e} L from it, {speed:.0e} m/s left");
                let check = Check::within("", "the exact chain", ours, off, BAR)
                    .by("largest distance of an end of a segment, over L")
                    .algebraic();
                Ok((way.name.clone(), check))
            })
            .collect::<Result<_, ExperimentError>>()?;
        let noun = if what == "solvers" { what } else { "of them" };
        checks.extend(alike(&format!("N = {n}, {what}"), noun, found));
    }
    Ok(checks.into())
}

/// The cantilever as it starts, in its natural order and in another.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let scene = rod(6, DAMPING).scene()?;
    let other = permuted(&scene, 1).0;
    Ok(vec![scene, other])
}
