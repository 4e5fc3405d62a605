//! H28: a pendulum on a cable that is slowly hauled in, without mass or of segments.
//!
//! θ̈ + 2 (L̇/L) θ̇ + (g/L) θ = 0: for a slow hoist the action E/ω is kept, and the amplitude grows as L^(−3/4). What a
//! hoist of finite speed does is the solution of that equation, integrated here by the classical Runge–Kutta method in
//! steps that leave nothing of their own.

use crate::hard::{at, worse};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_integrator::Stepper;
use taut_model::{
    Body, Cable, CableEnd, Constraint, Frame, MasslessCable, Material, RowLaw, Scene, Segments,
    Stiffness, Winch,
};
use taut_output::check::{Check, ExperimentError, Outcome};

const GRAVITY: f64 = 9.81;
const DT: f64 = 1.0 / 60.0;
/// Lengths before and after \[m].
const LENGTHS: [f64; 2] = [10.0, 5.0];
/// Angle at the start, at rest \[rad].
const ANGLE: f64 = 1e-3;
/// Largest relative error of the amplitude that passes.
const BAR: f64 = 5e-3;
/// The massless cable, and one of segments.
const KINDS: [Option<usize>; 2] = [None, Some(20)];
/// Mass per length of the segments \[kg/m]: a load of 10⁵ of them.
const DENSITY: f64 = 0.02;
/// All but inextensible.
const STIFFNESS: Stiffness = Stiffness {
    ea: 1e9,
    ei: 10.0,
    gj: 8.0,
};

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let speeds: &[f64] = if quick { &[0.5] } else { &[0.5, 0.05, 0.01] };
    let adiabatic = (LENGTHS[0] / LENGTHS[1]).powf(0.75);
    let mut checks = Vec::new();
    for (&speed, of) in speeds.iter().flat_map(|speed| KINDS.map(|of| (speed, of))) {
        let [exact, law_exact] = of_equation(speed);
        let (exact, [ours, law]) = (exact / ANGLE, of_cable(speed, scene(of)?)?);
        let of = of.map_or("", |_| ", segments");
        let ours = ours / ANGLE;
        checks.push(
            Check::relative(
                format!("hoist at {speed} m/s{of}: growth of the amplitude"),
                [exact, ours],
                "",
                BAR,
            )
            .by("relative, against the pendulum of variable length")
            .noting(format!(
                "over the adiabatic {adiabatic:.5}: exact {:.5}, ours {:.5}",
                exact / adiabatic,
                ours / adiabatic
            )),
        );
        checks.push(
            Check::within(
                format!("hoist at {speed} m/s{of}: amplitude × L^(3/4)"),
                "kept",
                format!("× {law:.5}, the equation's × {law_exact:.5}"),
                (law - 1.0).abs(),
                BAR,
            )
            .by("from start to end of the hoist, of the oscillation of θ L^(3/4), whose rate the haul is part of"),
        );
    }
    Ok(checks.into())
}

/// Amplitude of a pendulum of constant length from its angle and rate.
fn amplitude(angle: f64, rate: f64, length: f64) -> f64 {
    angle.hypot(rate / (GRAVITY / length).sqrt())
}

/// Adiabatic invariant of a slow hoist: the amplitude of x = θ L^(3/4) at the frequency of the
/// present length, while the cable is hauled at `speed` (m/s).
fn adiabatic(angle: f64, rate: f64, length: f64, speed: f64) -> f64 {
    let scale = length.powf(0.75);
    amplitude(
        angle * scale,
        (rate - 0.75 * speed / length * angle) * scale,
        length,
    )
}

/// Amplitude after the hoist, by the equation, and what has become of the adiabatic one during it.
fn of_equation(speed: f64) -> [f64; 2] {
    let time = (LENGTHS[0] - LENGTHS[1]) / speed;
    let steps = (time * 2000.0).ceil();
    let h = time / steps;
    let rates = |t: f64, [angle, rate]: [f64; 2]| {
        let length = LENGTHS[0] - speed * t;
        [rate, (2.0 * speed * rate - GRAVITY * angle) / length]
    };
    let moved = |y: [f64; 2], k: [f64; 2], h: f64| [y[0] + h * k[0], y[1] + h * k[1]];
    let mut y = [ANGLE, 0.0];
    for n in 0..steps as usize {
        let t = n as f64 * h;
        let a = rates(t, y);
        let b = rates(t + 0.5 * h, moved(y, a, 0.5 * h));
        let c = rates(t + 0.5 * h, moved(y, b, 0.5 * h));
        let d = rates(t + h, moved(y, c, h));
        for k in 0..2 {
            y[k] += h / 6.0 * (a[k] + 2.0 * (b[k] + c[k]) + d[k]);
        }
    }
    let [before, after] = LENGTHS;
    let start = adiabatic(ANGLE, 0.0, before, speed);
    [
        amplitude(y[0], y[1], after),
        adiabatic(y[0], y[1], after, speed) / start,
    ]
}

/// A load on a cable with a winch, without mass or of so many segments at first.
fn scene(segments: Option<usize>) -> Result<Scene, ExperimentError> {
    let mut scene = Scene::new("hoisted pendulum");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    let place = Vector3::new(ANGLE.sin(), 0.0, -ANGLE.cos()) * LENGTHS[0];
    let load = scene.add_body("load", Body::particle(1000.0).at(place));
    scene.load = Some(load);
    let frames = [
        Frame::world(Vector3::zeros()),
        Frame::body(load, Vector3::zeros()),
    ];
    let winch = Some(Winch {
        shortest: LENGTHS[1],
        ..Winch::new()
    });
    if let Some(segments) = segments {
        scene.add_cable(&Cable {
            segments: Segments::Equal(segments),
            density: DENSITY,
            stiffness: STIFFNESS,
            winch,
            ..Cable::round(
                "cable",
                &Material::STEEL,
                0.01,
                frames.map(CableEnd::Pinned),
            )
        })?;
    } else {
        let cable = MasslessCable {
            winch,
            ..MasslessCable::new(frames.to_vec(), LENGTHS[0], RowLaw::RIGID)
        };
        scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    }
    scene.controls.push(super::hauling("hoist"));
    Ok(scene)
}

/// The hoists at their beginning, at the largest speed.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let hauled = KINDS.map(|of| {
        let mut scene = scene(of)?;
        scene.set_control(0, 0.5, 0.0);
        Ok(scene)
    });
    hauled.into_iter().collect()
}

/// Amplitude of the load on its cable, from the two periods after the hoist, and the ratio of the
/// adiabatic one to that at the start.
fn of_cable(speed: f64, scene: Scene) -> Result<[f64; 2], ExperimentError> {
    let options = at(DT);
    let mut stepper = Stepper::new(scene, options)?;
    stepper.set_control(0, speed)?;
    let hoisted = ((LENGTHS[0] - LENGTHS[1]) / speed / DT).ceil() as usize;
    let angle = |stepper: &Stepper| {
        let x = stepper.scene().bodies.position[0];
        (x.x / -x.z).atan()
    };
    // Angles of the last three instants at which the cable still runs.
    let mut last = [0.0; 3];
    for _ in 1..hoisted {
        stepper.step()?;
        last = [last[1], last[2], angle(&stepper)];
    }
    let length = LENGTHS[0] - speed * DT * (hoisted - 2) as f64;
    let rate = (last[2] - last[0]) / (2.0 * DT);
    let kept = adiabatic(last[1], rate, length, speed) / adiabatic(ANGLE, 0.0, LENGTHS[0], speed);
    stepper.step()?;
    let period = std::f64::consts::TAU * (LENGTHS[1] / GRAVITY).sqrt();
    let mut largest = 0.0_f64;
    for _ in 0..(2.0 * period / DT) as usize {
        stepper.step()?;
        largest = worse(largest, angle(&stepper).abs());
    }
    Ok([largest, kept])
}
