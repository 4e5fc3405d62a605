//! H62: a cabin lands, and the weight of its pulley lifts it again.
//!
//! A cabin and a lighter weight with the share k of both masses hang on a rigid rope over two points. The cabin goes down
//! with (1 − 2k) g and lands after h. The weight flies on and falls back into its rope with the speed that it had; the rope
//! then shares its momentum, and both are slowed down by the same acceleration as before:
//!
//! ```text
//! v² = 2 (1 − 2k) g h,    v⁺ = k v,    rise = (k v)²/(2 (1 − 2k) g) = k² h
//! ```

use super::{DT, ground, put_box, rough, run};
use crate::hard::{at, either, worse};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_integrator::{StepError, StepOptions};
use taut_model::{Body, Constraint, Frame, MasslessCable, RowLaw, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Cabin and weight together \[kg].
const MASS: f64 = 1000.0;
/// Shares of the weight, heights of the fall \[m].
const FALLS: [[f64; 2]; 3] = [[5.0 / 12.0, 2.0], [0.3, 1.7], [0.46, 2.3]];
/// Sub-steps, damping of the rope \[s].
const WAYS: [(usize, f64); 3] = [(1, 0.0), (1, 0.05), (4, 0.0)];
/// Largest relative error.
const BAR: f64 = 0.02;

fn pulley([share, height]: [f64; 2], damping: f64) -> Scene {
    let mut scene = ground("pulley", 0.0, rough(0.5));
    let place = Vector3::new(-1.0, 0.0, height + 0.5);
    let shape = [Vector3::repeat(1.0), place];
    let turn = UnitQuaternion::identity();
    let cabin = put_box(&mut scene, shape, turn, (1.0 - share) * MASS, rough(0.5));
    scene.load = Some(cabin);
    let other = Vector3::new(1.0, 0.0, 0.8);
    let weight = scene.add_body("weight", Body::particle(share * MASS).at(other));
    let over = [-1.0, 1.0].map(|x| Vector3::new(x, 0.0, 12.0));
    let frames = vec![
        Frame::body(cabin, Vector3::zeros()),
        Frame::world(over[0]),
        Frame::world(over[1]),
        Frame::body(weight, Vector3::zeros()),
    ];
    let length = (over[0] - place).norm() + 2.0 + (over[1] - other).norm();
    let rope = MasslessCable::new(frames, length, RowLaw::new(0.0, damping));
    scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
    scene
}

/// How high the cabin rises from the ground, and the steps that were divided.
fn rise(fall: [f64; 2], (substeps, damping): (usize, f64)) -> Result<(f64, usize), StepError> {
    let options = StepOptions { substeps, ..at(DT) };
    let (mut landed, mut highest, mut divided) = (false, 0.0, 0);
    run(pulley(fall, damping), options, 360, |stepper, report| {
        let above = stepper.scene().bodies.position[0].z - 0.5;
        landed |= above < 1e-3;
        highest = if landed { worse(highest, above) } else { 0.0 };
        divided += report.divided;
    })?;
    Ok((highest, divided))
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![pulley(FALLS[0], 0.05)])
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for fall in &FALLS[..either(quick, 1, 3)] {
        for way in WAYS {
            let [share, height] = *fall;
            let (found, divided) = rise(*fall, way)?;
            let case = format!(
                "share {share:.3}, {height} m, {} sub-steps, τ = {} s: rise",
                way.0, way.1
            );
            let check = Check::relative(case, [share * share * height, found], "m", BAR);
            checks.push(check.noting(format!("{divided} of 360 steps divided")));
        }
    }
    Ok(checks.into())
}
