//! H35 and H39: what a rope that goes slack may give back, and what a winch that runs may not add.
//!
//! H35: a load that falls into its rope rises no higher than it fell, whatever Ω = Δt √(EA/(L m)), the stiffness in the
//! step's eyes: apexes by the energy of the free flights, which the step keeps to rounding. Where Ω ≤ 1 the mean is what
//! the scheme's damping leaves of half an oscillation ([`crate::law`]), but for a twentieth. A plate on four ropes, three
//! masses in a row, two masses over two points gain nothing.
//!
//! H39: a load that moves with its rope from the start, hauled in by a winch, has the tension of its weight and swing.

use super::{Gained, worse};
use crate::hard::{at, each_solver};
use crate::law;
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use taut_ground::pace;
use taut_integrator::{Scheme, StepError, StepOptions, Stepper};
use taut_model::{Body, Constraint, Frame, MasslessCable, RowLaw, Scene, Winch};
use taut_output::check::{Check, ExperimentError, Outcome};

const GRAVITY: f64 = 9.81;
const DT: f64 = 1.0 / 60.0;
/// The load that falls \[kg], its rope \[m], and how long it is followed \[s].
const LOAD: f64 = 50.0;
const LENGTH: f64 = 4.0;
const TIME: f64 = 6.0;
const OMEGAS: [f64; 10] = [
    0.5,
    1.0,
    2.0,
    3.0,
    4.0,
    6.0,
    10.0,
    20.0,
    100.0,
    f64::INFINITY,
];
/// Falls between 0.2 and 2 m.
const HEIGHTS: usize = 61;
/// Largest loss of the mean rebound of a soft rope beside the scheme's damping.
const LOSS: f64 = 0.05;
/// Gain over the energy of position that passes: rounding.
const GAIN: f64 = 1e-9;
/// Largest error of the winch's tension, relative, that passes: a start rounded to tenths of a millimetre stretches the
/// rope twice as far as the load does.
const TENSION: f64 = 0.03;

fn scene(name: &str) -> Scene {
    let mut scene = Scene::new(name);
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    scene
}

fn ball(scene: &mut Scene, name: &str, mass: f64, at: Vector3<f64>) -> Frame {
    let body = scene.add_body(name, Body::sphere(0.1, mass).at(at));
    scene.load = Some(body);
    Frame::body(body, Vector3::zeros())
}

fn rope(scene: &mut Scene, through: &[Frame], length: f64, compliance: f64) {
    let law = RowLaw::new(compliance, 0.0);
    let cable = MasslessCable::new(through.to_vec(), length, law);
    let name = format!("rope-{}", scene.constraints.len());
    scene.add_constraint(name, Constraint::MasslessCable(cable), 0);
}

/// Compliance of a rope whose Ω is `omega` at `DT` \[m/N].
fn compliance(omega: f64) -> f64 {
    (DT / omega).powi(2) / LOAD
}

fn falling(height: f64, omega: f64) -> Scene {
    let mut scene = scene("fall into a slack rope");
    let load = ball(&mut scene, "load", LOAD, Vector3::z() * (height - LENGTH));
    let top = Frame::world(Vector3::zeros());
    rope(&mut scene, &[top, load], LENGTH, compliance(omega));
    scene
}

/// Highest apex after the first contact, over the height of the fall.
fn rebound(height: f64, omega: f64, options: StepOptions) -> Result<f64, StepError> {
    let steps = (TIME / options.dt).round() as usize;
    let mut stepper = Stepper::new(falling(height, omega), options)?;
    let (mut caught, mut highest) = (false, 0.0_f64);
    for _ in 0..steps {
        pace::step(&mut stepper)?;
        if stepper.multipliers()[0] < 0.0 {
            caught = true;
        } else if caught {
            let apex = stepper.energy().total() / (LOAD * GRAVITY) + LENGTH;
            highest = worse(highest, apex / height);
        }
    }
    Ok(highest)
}

/// The energy that half an oscillation of Ω leaves, of 1.
fn left_by_damping(omega: f64) -> f64 {
    let roots = law::roots(&law::recurrence(
        Scheme::default(),
        [omega * omega, 0.0],
        0.0,
    ));
    let oscillating = roots.into_iter().find(|[_, phase]| *phase > 0.0);
    oscillating.map_or(f64::NAN, |[modulus, phase]| modulus.powf(TAU / phase))
}

/// The falls with sub-steps of `substeps` in steps of `dt`: the largest rebounds, and the means where Ω ≤ 1.
fn falls(heights: usize, dt: f64, substeps: usize) -> Result<Vec<Check>, ExperimentError> {
    let (mut checks, mut largest, mut told) = (Vec::new(), 0.0, Vec::new());
    let case = format!("falls, 1/{:.0} s, {substeps} sub-steps", 1.0 / dt);
    for omega in OMEGAS {
        let (mut highest, mut mean) = (0.0, 0.0);
        for k in 0..heights {
            let height = 0.2 + 1.8 * k as f64 / (heights - 1) as f64;
            let options = StepOptions {
                dt,
                substeps,
                ..StepOptions::default()
            };
            let found = rebound(height, omega, options)?;
            highest = worse(highest, found);
            mean += found / heights as f64;
        }
        largest = worse(largest, highest);
        told.push(format!("{highest:.3}"));
        let own = omega * dt / DT / substeps as f64;
        if omega <= 1.0 {
            let exact = left_by_damping(own);
            let check = Check::relative(
                format!("{case}, Ω {omega}: mean rebound"),
                [exact, mean],
                "",
                LOSS,
            );
            checks.push(check.by("relative to what the scheme's damping leaves"));
        }
    }
    let check = Check::within(
        format!("{case}: largest rebound"),
        "1 at most",
        told.join(", "),
        largest,
        1.0,
    );
    checks.push(check.by(format!("height over that of the fall, Ω = {OMEGAS:?}")));
    Ok(checks)
}

/// A plate on four ropes that spread, three masses each on a rope from the one above, and two masses over two points, one
/// of which is thrown up.
fn thrown(compliance: f64) -> [Scene; 3] {
    let mut plate = scene("plate on four ropes");
    let body = Body::cuboid(Vector3::new(2.0, 2.0, 0.2), 400.0).at(Vector3::z() * -2.5);
    let body = body.turned(UnitQuaternion::from_euler_angles(0.1, 0.05, 0.0));
    let body = plate.add_body("plate", body);
    plate.load = Some(body);
    for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let top = Frame::world(Vector3::new(1.5 * x, 1.3 * y, 0.0));
        let corner = Frame::body(body, Vector3::new(x, y, 0.0));
        rope(&mut plate, &[top, corner], 3.0, compliance);
    }
    let mut row = scene("three masses in a row");
    let mut above = Frame::world(Vector3::zeros());
    for (k, mass) in [30.0, 5.0, 50.0].into_iter().enumerate() {
        let at = Vector3::z() * (-0.7 * (k + 1) as f64);
        let below = ball(&mut row, &format!("mass-{k}"), mass, at);
        rope(&mut row, &[above, below], 1.2, compliance);
        above = below;
    }
    let mut pair = scene("two masses over two points");
    let [left, right] = [-1.0, 1.0].map(|x| Frame::world(Vector3::x() * x));
    let a = ball(&mut pair, "a", 5.0, Vector3::new(-1.0, 0.0, -40.0));
    let b = ball(&mut pair, "b", 5.2, Vector3::new(1.0, 0.0, -40.0));
    pair.bodies.velocity[0].z = 3.0;
    rope(&mut pair, &[a, left, right, b], 82.0, compliance);
    [plate, row, pair]
}

fn gains() -> Result<Vec<Check>, ExperimentError> {
    let compliances = [1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 0.0];
    let mut checks = Vec::new();
    for dt in [DT, 0.25 * DT] {
        let mut worst = [0.0; 3];
        for compliance in compliances {
            for (worst, scene) in worst.iter_mut().zip(thrown(compliance)) {
                let run = Gained::over(scene, at(dt), 10.0)?;
                if let Some(e) = run.lost {
                    return Err(e.into());
                }
                *worst = worse(*worst, run.largest / run.start.gravity.abs());
            }
        }
        for (worst, scene) in worst.into_iter().zip(thrown(0.0)) {
            let check = Check::off(
                format!("{}, 1/{:.0} s", scene.name, 1.0 / dt),
                "no gain",
                worst,
                "",
                GAIN,
            );
            checks.push(check.by("largest in 10 s, over the energy of position, six compliances"));
        }
    }
    Ok(checks)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let mut scenes = vec![falling(0.6, 100.0)];
    scenes.extend(thrown(1e-6));
    Ok(scenes)
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let heights = if quick { 10 } else { HEIGHTS };
    let mut checks = Vec::new();
    for substeps in [1, 2, 4, 8] {
        checks.extend(falls(heights, DT, substeps)?);
    }
    checks.extend(falls(heights, 0.25 * DT, 1)?);
    checks.extend(gains()?);
    checks.extend(each_solver("a fall at Ω 100, every solver", |choice| {
        let found = rebound(0.6, 100.0, choice.options(DT))?;
        Ok(Check::off("", "1 at most", found, "", 1.0).by("over the height of the fall"))
    })?);
    Ok(checks.into())
}

/// The winch: the load's mass \[kg] and place, the speed \[m/s].
const HAULED: f64 = 33.0;
const SPEED: f64 = -0.45;

pub(super) fn hauled() -> Scene {
    let at = Vector3::new(1.8173, 0.0, -4.9787);
    let mut scene = scene("hauled from the start");
    let load = ball(&mut scene, "load", HAULED, at);
    scene.bodies.velocity[0] = at.normalize() * SPEED;
    let top = Frame::world(Vector3::zeros());
    rope(&mut scene, &[top, load], 5.3, 5.3e-9);
    if let Constraint::MasslessCable(cable) = &mut scene.constraints[0] {
        cable.winch = Some(Winch {
            speed: SPEED,
            ..Winch::new()
        });
    }
    scene
}

pub(super) fn winch(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for dt in [DT, 0.25 * DT] {
        let case = format!("load hauled from the start, 1/{:.0} s", 1.0 / dt);
        checks.extend(each_solver(&case, |choice| {
            let worst = tension_error(choice.options(dt))?;
            let check = Check::off("", "m (g cos θ + v²/l)", worst, "", TENSION);
            Ok(check.by("largest in 1 s, relative"))
        })?);
    }
    Ok(checks.into())
}

/// Largest error of the tension in the first second, relative to what the load's place and speed ask for.
fn tension_error(options: StepOptions) -> Result<f64, StepError> {
    let dt = options.dt;
    let mut stepper = Stepper::new(hauled(), options)?;
    let mut worst = 0.0;
    for _ in 0..(1.0 / dt).round() as usize {
        let x = stepper.scene().bodies.position[0];
        pace::step(&mut stepper)?;
        let v = stepper.scene().bodies.velocity[0];
        let along = x.normalize();
        let across = (v - along * v.dot(&along)).norm_squared();
        let exact = HAULED * (across / x.norm() - along.z * GRAVITY);
        let found = -stepper.multipliers()[0] / dt;
        worst = worse(worst, (found / exact - 1.0).abs());
    }
    Ok(worst)
}
