//! Effect of a step on a scene's own slow oscillations: predicted by the scheme's law, and
//! measured.
//!
//! The scene rests in its equilibrium and is moved by a small part of a mode φ. Its coordinate x = φᵀM (q − q₀) then obeys the
//! recurrence of the module `law`, undamped, with Ω_e² of the elastic rows and Ω_g² of the tension, of which φᵀKφ has the weights
//! of the geometric stiffness K. The largest root |z| e^(iψ) of that, and of the recurrence that fits the motion, gives
//!
//! ```text
//! phase error = ψ/(ωΔt) − 1,      damping = 1 − |z| a sub-step
//! ```

use super::Setup;
use crate::{law, motions};
use nalgebra::Vector3;
use serde::Serialize;
use taut_integrator::{GeometricStiffness, Stepper, Weights};
use taut_measure::modes::{Natural, natural};
use taut_model::{Bodies, Constraint, Motion, Scene, Side};

/// Most bodies of a scene whose modes are found: the matrices are dense.
const MOST: usize = 80;

const TOLD: usize = 3;

/// Largest displacement (m) or rotation (rad).
const AMPLITUDE: f64 = 1e-5;

/// Steps that a motion takes to become the mode's own, and most steps that are fitted.
const STEPS: [usize; 2] = [30, 3000];

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// ω \[rad/s].
    pub omega: f64,
    /// Phase error and damping of a sub-step by the law; `None` where the options or the scene have more than it knows: damping,
    /// limits of force, friction, links with transverse rows, torques.
    pub predicted: Option<[f64; 2]>,
    /// Phase error and damping as measured.
    pub measured: [f64; 2],
}

/// The slowest modes of a setup, at rest and undriven; or why there are none.
pub(super) fn rows(setup: &Setup) -> Result<Vec<Row>, String> {
    let mut scene = setup.source.build().map_err(|e| e.to_string())?;
    if !scene.colliders.is_empty() {
        return Err("where shapes touch, modes are not of the scene alone".into());
    }
    if scene.bodies.len() > MOST {
        return Err(format!(
            "more than {MOST} bodies: make it coarser by `--set segments`"
        ));
    }
    let frames = scene
        .constraints
        .iter_mut()
        .flat_map(Constraint::frames_mut);
    for frame in frames.filter(|frame| matches!(frame.side, Side::World(_))) {
        frame.side = Side::World(Motion::default());
    }
    scene.start_in_equilibrium = true;
    let mut resting = Stepper::new(scene, setup.options.clone()).map_err(|e| e.to_string())?;
    resting.solve().map_err(|e| e.to_string())?;
    let mut scene = resting.scene().clone();
    scene.start_in_equilibrium = false;
    let still = Vector3::zeros();
    scene.bodies.velocity.fill(still);
    scene.bodies.angular_velocity.fill(still);
    let all = natural(&scene, &[0, 1, 2, 3, 4, 5]).ok_or("its rows are degenerate")?;
    let mut rows: Vec<Row> = Vec::new();
    for k in 0..all.squares.len() {
        let omega = all.frequency(k);
        let last = rows.last().map_or(0.0, |row| row.omega);
        // Motions without restoring force, the second of two alike, and what no frame resolves.
        let apart = omega > 1e-2 && omega > (1.0 + 1e-3) * last;
        if rows.len() == TOLD || !apart || omega * setup.options.dt > 1.0 {
            continue;
        }
        rows.push(row(setup, &resting, &scene, &all, k)?);
    }
    Ok(rows)
}

fn row(
    setup: &Setup,
    resting: &Stepper,
    scene: &Scene,
    all: &Natural,
    k: usize,
) -> Result<Row, String> {
    let (omega, dt) = (
        all.frequency(k),
        setup.options.dt / setup.options.substeps as f64,
    );
    let of = |c: &[f64]| {
        let [modulus, phase] = law::roots(c).first().copied().unwrap_or([f64::NAN; 2]);
        [phase / (omega * dt) - 1.0, 1.0 - modulus]
    };
    let parts = [all.elastic[k], turning(resting, all, k), all.squares[k]];
    let predicted = predicted(setup, resting, parts.map(|w| w * dt * dt)).map(|c| of(&c));
    let samples = motion(setup, scene, all, k)?;
    let measured = of(&law::fitted(&samples, 2));
    Ok(Row {
        omega,
        predicted,
        measured,
    })
}

/// The recurrence of a mode with Ω_e², the part of the stiffened rotations and Ω²; `None` where there is more to it.
fn predicted(
    setup: &Setup,
    resting: &Stepper,
    [elastic, turning, all]: [f64; 3],
) -> Option<Vec<f64>> {
    let (options, scene, rows) = (&setup.options, resting.scene(), resting.linearized());
    let tension = match options.stiffness {
        GeometricStiffness::Off => Weights::default(),
        GeometricStiffness::Inertia { alpha } => options.scheme.tension_weights(alpha),
        _ => return None,
    };
    let more = rows.damping.iter().any(|damping| *damping != 0.0)
        || !rows.transverse.is_empty()
        || !rows.bounds.iter().all(|b| b.lower == 0.0 || b.upper == 0.0)
        || !scene.capstans.is_empty()
        || scene.bodies.torque.iter().any(|torque| torque.norm() > 0.0);
    if more {
        return None;
    }
    Some(law::mixed(&[
        (elastic, options.scheme.weights(), 0.0),
        (turning, tension, 0.0),
        (all - elastic - turning, Weights::default(), 0.0),
    ]))
}

/// φᵀKφ of the geometric stiffness K that the step adds to inertia \[1/s²].
fn turning(resting: &Stepper, all: &Natural, k: usize) -> f64 {
    let shape = all.shapes.column(k);
    let of = |i: usize| {
        let turn = Vector3::new(shape[6 * i + 3], shape[6 * i + 4], shape[6 * i + 5]);
        let k = resting.geometric_stiffness(i);
        k.map_or(0.0, |k| turn.dot(&(k * turn)))
    };
    (0..resting.scene().bodies.len()).map(of).sum()
}

/// The mode's coordinate after each sub-step of a motion that begins displaced by it.
fn motion(setup: &Setup, scene: &Scene, all: &Natural, k: usize) -> Result<Vec<f64>, String> {
    let rest = scene.bodies.clone();
    let mut scene = scene.clone();
    all.displace(&mut scene, k, AMPLITUDE);
    let mut options = setup.options.clone();
    options.dt /= options.substeps as f64;
    options.substeps = 1;
    let period = std::f64::consts::TAU / (all.frequency(k) * options.dt);
    let [settle, most] = STEPS;
    let steps = ((3.0 * period) as usize).clamp(2 * settle, most);
    let mut samples = Vec::with_capacity(settle + steps);
    let failure = motions::run(scene, options, settle + steps, |stepper, _| {
        samples.push(coordinate(&stepper.scene().bodies, &rest, all, k));
        Ok(())
    });
    match failure.map_err(|e| e.to_string())? {
        Some(failure) => Err(failure.reason),
        None => Ok(samples.split_off(settle)),
    }
}

/// φᵀM (q − q₀).
fn coordinate(bodies: &Bodies, rest: &Bodies, all: &Natural, k: usize) -> f64 {
    let shape = all.shapes.column(k);
    let of = |i: usize| {
        let part = |c: usize| Vector3::new(shape[c], shape[c + 1], shape[c + 2]);
        let moved = bodies.position[i] - rest.position[i];
        let turned = (bodies.orientation[i] * rest.orientation[i].inverse()).scaled_axis();
        bodies.mass[i] * part(6 * i).dot(&moved)
            + part(6 * i + 3).dot(&(rest.inertia_world(i) * turned))
    };
    let moving = (0..bodies.len()).filter(|i| bodies.is_dynamic(*i));
    moving.map(of).sum()
}
