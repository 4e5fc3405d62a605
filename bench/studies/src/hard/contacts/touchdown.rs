//! A cable that hangs from a tug, lies on a rough floor with its rest, and is dragged.
//!
//! The cable of the length L and the weight w per length leaves the floor with the horizontal pull H and reaches the
//! tug h higher after the length s. On the floor friction takes μ w of it per length, until nothing is left at the free
//! end:
//!
//! ```text
//! s = √(h² + 2 h H/w),    H(x) = H − μ w x,    H = μ w (L − s)
//! ⇒  s = √(h² (1 + μ²) + 2 μ h L) − μ h
//! ```

use super::{rough, run};
use crate::hard::{DT, GRAVITY, at, either, under_gravity, worse};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_model::collide::{Collider, Shape};
use taut_model::{
    Body, Cable, CableEnd, Damping, Frame, JointKind, Material, Mobility, Scene, SceneError,
    Segments, Stiffness,
};
use taut_output::check::{Check, ExperimentError, Outcome};

const LENGTH: f64 = 10.0;
const HEIGHT: f64 = 2.0;
const DENSITY: f64 = 1.0;
const RADIUS: f64 = 0.01;
const MU: f64 = 0.5;
/// Speed of the tug \[m/s].
const SPEED: f64 = 0.2;
/// Steps of a drag.
const STEPS: usize = 240;
/// Largest deviation of the order from 2.
const ORDER: f64 = 0.2;
/// Largest relative error that passes.
const BAR: f64 = 1e-2;

/// The length s that hangs \[m].
fn hanging() -> f64 {
    let square = HEIGHT * HEIGHT * (1.0 + MU * MU) + 2.0 * MU * HEIGHT * LENGTH;
    square.sqrt() - MU * HEIGHT
}

/// Points of the continuum, from the free end to the tug, the touchdown at the origin.
fn route() -> Vec<Vector3<f64>> {
    let s = hanging();
    let a = MU * (LENGTH - s);
    let on = |part: f64| {
        let x = a * (s * part / a).asinh();
        Vector3::new(x, 0.0, RADIUS + a * ((x / a).cosh() - 1.0))
    };
    let start = Vector3::new(s - LENGTH, 0.0, RADIUS);
    let hung = (0..=200).map(|k| on(f64::from(k) / 200.0));
    std::iter::once(start).chain(hung).collect()
}

fn dragged(segments: usize) -> Result<Scene, SceneError> {
    let mut scene = under_gravity("dragged cable");
    scene.add_collider(Collider {
        surface: rough(MU),
        ..Collider::new("ground", None, Shape::HalfSpace)
    });
    let points = route();
    let last = points.len() - 1;
    let mut tug = Body::fixed().at(points[last]);
    tug.mobility = Mobility::Driven;
    tug.velocity.x = SPEED;
    let tug = scene.add_body("tug", tug);
    let ends = [
        CableEnd::Free(points[0]),
        CableEnd::Pinned(Frame::body(tug, Vector3::zeros())),
    ];
    let parts = scene.add_cable(&Cable {
        points: points[1..last].to_vec(),
        segments: Segments::Equal(segments),
        density: DENSITY,
        stiffness: Stiffness {
            ea: 1e6,
            ei: 1.0,
            gj: 1.0,
        },
        damping: Damping::Time(0.02),
        joint: JointKind::Spherical,
        bend: false,
        twist: false,
        collide: Some(rough(MU)),
        ..Cable::round("cable", &Material::NYLON, RADIUS, ends)
    })?;
    for i in parts.bodies {
        scene.bodies.velocity[i].x = SPEED;
    }
    Ok(scene)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![dragged(12)?])
}

/// Means over the second half of a drag: the tug's horizontal pull over that of the continuum, and the largest error of the
/// tension along the floor, over H; and what the steps said.
fn drag(segments: usize) -> Result<([f64; 2], String), ExperimentError> {
    let weight = DENSITY * GRAVITY;
    let h = MU * weight * (LENGTH - hanging());
    let element = LENGTH / segments as f64;
    let mut mean = vec![0.0; segments];
    let mut carried = 0.0;
    let half = 0.5 * STEPS as f64 * DT;
    let mut failed = Ok(());
    let (_, said) = run(dragged(segments)?, at(DT), STEPS, |stepper, report| {
        if stepper.time() < half {
            return;
        }
        carried += report.contacts.load;
        for (i, mean) in mean.iter_mut().enumerate() {
            match stepper.tension_in("cable", i) {
                Ok(tension) => *mean += tension,
                Err(e) => failed = Err(e),
            }
        }
    })?;
    failed?;
    let count = (STEPS / 2) as f64;
    let mut along = 0.0;
    for (i, tension) in mean.iter().enumerate() {
        let x = (i as f64 + 0.5) * element;
        if x + element < LENGTH - hanging() {
            along = worse(along, (tension / count - MU * weight * x).abs() / h);
        }
    }
    Ok(([MU * carried / count / h, along], said))
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let counts: &[usize] = either(quick, &[10, 20], &[10, 20, 40]);
    let exact = LENGTH - hanging();
    let (mut checks, mut errors) = (Vec::new(), Vec::new());
    for &segments in counts {
        let ([pull, along], note) = drag(segments)?;
        let case = format!("dragged cable, {segments} segments: length on the floor L − s");
        let check = Check::relative(case, [exact, exact * pull], "m", BAR);
        checks.push(check.by("relative, from the mean friction").noting(note));
        let case = format!("dragged cable, {segments} segments: tension on the floor");
        let check = Check::off(case, "H − μ w x", along, "H", BAR);
        checks.push(check.by("largest error of a mean"));
        errors.push((pull - 1.0).abs());
    }
    let order =
        (errors[0] / errors[errors.len() - 1]).ln() / 2.0_f64.powi(errors.len() as i32 - 1).ln();
    let check = Check::second_order("dragged cable: order in N of L − s", order, ORDER);
    checks.push(check.noting("first and last N"));
    Ok(checks.into())
}
