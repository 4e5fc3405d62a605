//! H56: a cable of thin, short segments lies straight on a floor, across the axes, some segments heavier than others.
//!
//! Nothing moves it, so that nothing may move: each capsule lies on both of its ends, two contacts with six rows for
//! six degrees of freedom, tied to its neighbours by stiff joints. What rounding leaves would show as jitter in all
//! directions, what the regularisation leaves as creep.

use super::{DT, Said, ground, rough, run};
use crate::hard::at;
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_model::{
    Cable, CableEnd, DEFAULT_GROUP, Damping, JointKind, Rest, Scene, SceneError, Segments,
    Stiffness,
};
use taut_output::check::{Check, ExperimentError, Outcome};

const SEGMENTS: usize = 16;
const LENGTH: f64 = 0.08;
const RADIUS: f64 = 1e-3;
/// Angle to the axes \[rad].
const ANGLE: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Largest rms speed that passes \[m/s].
const JITTER: f64 = 1e-9;

/// The cable, of which each fourth segment is so many times heavier.
fn flat(ratio: f64) -> Result<Scene, SceneError> {
    let mut scene = ground("flat cable", 0.0, rough(0.3));
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), ANGLE);
    let end = |part: f64| turn * Vector3::x() * part * LENGTH + Vector3::z() * RADIUS;
    let parts = scene.add_cable(&Cable {
        name: "cable".to_owned(),
        ends: [-0.5, 0.5].map(|part| CableEnd::Free(end(part))),
        points: Vec::new(),
        segments: Segments::Equal(SEGMENTS),
        winch: None,
        resolution: None,
        density: 0.025,
        radius: RADIUS,
        stiffness: Stiffness {
            ea: 6e5,
            ei: 0.15,
            gj: 0.12,
        },
        damping: Damping::Time(0.01),
        joint: JointKind::Cosserat,
        bend: true,
        twist: true,
        rest: Rest::Straight,
        group: 0,
        collide: Some(rough(0.3)),
        groups: DEFAULT_GROUP,
        meets: u32::MAX,
    })?;
    for i in parts.bodies.into_iter().step_by(4) {
        scene.bodies.mass[i] *= ratio;
        scene.bodies.inertia[i] *= ratio;
    }
    Ok(scene)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![flat(1e3)?])
}

/// Rms speed of all segments in the last second, and the way of the farthest in 5 s.
fn lie(ratio: f64) -> Result<([f64; 2], Said), ExperimentError> {
    let scene = flat(ratio)?;
    let first = scene.bodies.position.clone();
    let (mut sum, mut count) = (0.0, 0.0);
    let (stepper, said) = run(scene, at(DT), 300, |stepper, _| {
        if stepper.time() > 4.0 {
            let all = stepper.scene().bodies.velocity.iter();
            sum += all.map(Vector3::norm_squared).sum::<f64>();
            count += SEGMENTS as f64;
        }
    })?;
    let now = stepper.scene().bodies.position.iter().zip(&first);
    let drift = now.map(|(x, x0)| (x - x0).norm()).fold(0.0, f64::max);
    Ok(([(sum / count).sqrt(), drift], said))
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    let ratios: &[f64] = if quick { &[1e3] } else { &[1.0, 1e3, 1e5] };
    for &ratio in ratios {
        let ([jitter, drift], said) = lie(ratio)?;
        let case = format!("thin cable on a floor, each fourth segment × {ratio:e}: jitter");
        let note = format!(
            "drift in 5 s {drift:.1e} m; {} undecided, {} redone steps",
            said.undecided, said.redone
        );
        let check = Check::off(case, "at rest", jitter, "m/s", JITTER);
        checks.push(check.by("rms speed in the fifth second").noting(note));
    }
    Ok(checks.into())
}
