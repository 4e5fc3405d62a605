//! H44, the block: it holds or slides on an incline, stops on a floor, and tips.
//!
//! On a plane that rises by α a block holds for tan α ≤ μ and else slides with a = g (sin α − μ cos α). On a level
//! floor one of speed v stops after v²/(2 μ g). A block of the half width b and the half height h that friction holds
//! tips about its lower edge as soon as its weight passes beyond it, tan α > b/h; from its rest it then turns with
//!
//! ```text
//! θ̈ = g (h sin α − b cos α) / (4/3 (b² + h²))
//! ```
//!
//! The step's sliding is exact up to its last steps: friction is constant, so that velocities are. It stops at the end
//! of a step, which the way is in error by at most v_last Δt for.

use super::{DT, GRAVITY, ground, put_box, rising, rough, run};
use crate::hard::at;
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_integrator::StepError;
use taut_model::Scene;
use taut_output::check::{Check, ExperimentError, Outcome};

const MU: f64 = 0.3;
/// Relative distance in tan α between a case that holds and one that slides.
const APART: f64 = 1e-3;
/// Relative distance in tan α between a case that stands and one that tips.
const TIPS: f64 = 1e-2;
/// Largest relative error of an acceleration.
const BAR: f64 = 1e-6;
/// Fastest that a block which holds may creep \[m/s].
const CREEP: f64 = 1e-9;

/// A block of half sizes b, ½, h on a plane.
fn block(slope: f64, [half_width, half_height]: [f64; 2], friction: f64) -> Scene {
    let turn = rising(slope);
    let mut scene = ground("block", slope, rough(friction));
    let size = Vector3::new(2.0 * half_width, 1.0, 2.0 * half_height);
    let at = turn * Vector3::z() * half_height;
    put_box(&mut scene, [size, at], turn, 3.0, rough(friction));
    scene
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![block(0.4, [0.5, 0.5], MU)])
}

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = incline()?;
    checks.push(stop()?);
    checks.push(tip()?);
    Ok(checks.into())
}

/// Speeds down the plane after a tenth, half a second and one.
fn speeds(slope: f64) -> Result<[f64; 2], StepError> {
    let down = rising(slope) * -Vector3::x();
    let mut all = Vec::new();
    run(block(slope, [0.5, 0.5], MU), at(DT), 60, |stepper, _| {
        all.push(stepper.scene().bodies.velocity[0].dot(&down));
    })?;
    Ok([all[5], all[59]])
}

fn incline() -> Result<Vec<Check>, ExperimentError> {
    let [_, creep] = speeds((MU * (1.0 - APART)).atan())?;
    let case = format!("incline, tan α = (1 − {APART}) μ");
    let mut checks =
        vec![Check::off(case, "holds", creep.abs(), "m/s", CREEP).by("speed after 1 s")];
    for factor in [1.0 + APART, 1.2, 2.0] {
        let slope = (MU * factor).atan();
        let exact = GRAVITY * (slope.sin() - MU * slope.cos());
        let [first, last] = speeds(slope)?;
        let ours = (last - first) / (54.0 * DT);
        let case = format!("incline, tan α = {factor} μ: slides");
        checks.push(Check::relative(case, [exact, ours], "m/s²", BAR));
    }
    Ok(checks)
}

fn stop() -> Result<Check, ExperimentError> {
    let speed = 2.0;
    let mut scene = block(0.0, [0.5, 0.5], MU);
    scene.bodies.velocity[0].x = speed;
    let (stepper, _) = run(scene, at(DT), 90, |_, _| {})?;
    let ours = stepper.scene().bodies.position[0].x;
    let exact = speed * speed / (2.0 * MU * GRAVITY);
    let left = stepper.scene().bodies.velocity[0].norm();
    let check = Check::relative("2 m/s on a floor: stops after", [exact, ours], "m", 1e-2);
    Ok(check.noting(format!("creeps with {left:.1e} m/s then")))
}

/// By how much a block that friction holds has turned after half a second \[rad].
fn turned(slope: f64, half: [f64; 2]) -> Result<f64, StepError> {
    let scene = block(slope, half, 2.0);
    let (stepper, _) = run(scene, at(DT), 30, |_, _| {})?;
    let level: UnitQuaternion<f64> = rising(slope);
    Ok(stepper.scene().bodies.orientation[0].angle_to(&level))
}

fn tip() -> Result<Check, ExperimentError> {
    let half = [0.5, 1.0];
    let least = half[0] / half[1];
    let [below, above] = [1.0 - TIPS, 1.0 + TIPS].map(|part| (least * part).atan());
    let (stands, tips) = (turned(below, half)?, turned(above, half)?);
    let moment = half[1] * above.sin() - half[0] * above.cos();
    let inertia = 4.0 / 3.0 * (half[0] * half[0] + half[1] * half[1]);
    // Half of θ̈ t² and more, for it grows.
    let least_turn = 0.125 * GRAVITY * moment / inertia;
    let good = stands < 1e-6 && tips > least_turn;
    let ours = format!("{stands:.1e} and {tips:.1e} rad in ½ s");
    let reference = format!("0 and more than {least_turn:.1e} rad");
    let case = format!("box at tan α = (1 ∓ {TIPS}) b/h: stands and tips");
    Ok(Check::stated(case, reference, ours, good))
}
