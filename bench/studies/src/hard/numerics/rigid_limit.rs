//! H51: what stiff joints come to as ε → 0, and ε = 0.
//!
//! Where J has full rank nothing is singular at ε = 0, and multipliers differ from the rigid ones by a multiple of ε, which
//! `tests/agreement/dependent.rs` holds every solver to. So does the place of the load of a bent hoist after a second of
//! swing, measured here over ten decades of ε.

use crate::hard::{counted, either, grid};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_ground::pace;
use taut_ground::trajectory::{load_position, steps_in};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Constraint, HoistParams, JointKind, RowLaw, Scene, SceneError};
use taut_output::check::{Check, ExperimentError, Measure, Outcome};
use taut_output::table::error;

/// How far the order of the difference in ε may be from 1.
const ORDER_BAR: f64 = 0.05;

/// Distances of the load between which decades of ε have an order: below is rounding \[m].
const RESOLVED: std::ops::Range<f64> = 1e-11..1e-2;

/// The hoist with spherical joints of that compliance (m/N), unstrained, turned aside, in motion.
///
/// # Errors
/// Parameters out of range.
pub fn scene(compliance: f64) -> Result<Scene, SceneError> {
    let params = HoistParams {
        segments: 6,
        mass_ratio: 20.0,
        joint: JointKind::Spherical,
        initial_angle: 0.5,
        seed: 5,
        ..HoistParams::default()
    };
    let mut scene = params.build()?;
    for constraint in &mut scene.constraints {
        if let Constraint::Spherical(joint) = constraint {
            joint.stretch = RowLaw::new(compliance, 0.0);
        }
    }
    scene.name = format!("ε = {compliance:.0e}");
    scene.validate()?;
    Ok(scene)
}

/// Hoists that are stiff, stiffer, rigid.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let all = [1e-8, 1e-12, 1e-16, 0.0].into_iter().map(scene);
    Ok(all.collect::<Result<_, _>>()?)
}

/// The load after a second.
fn place(compliance: f64) -> Result<Vector3<f64>, StepError> {
    let mut stepper = Stepper::new(scene(compliance)?, StepOptions::default())?;
    for _ in 0..steps_in(1.0, stepper.options().dt) {
        pace::step(&mut stepper)?;
    }
    Ok(load_position(stepper.scene()))
}

/// The slope of the distances between the compliances that are resolved, farthest from 1.
fn order(ways: &[(f64, f64)]) -> f64 {
    let clear: Vec<_> = ways.iter().filter(|w| RESOLVED.contains(&w.1)).collect();
    let slopes = clear
        .windows(2)
        .map(|w| (w[0].1 / w[1].1).ln() / (w[0].0 / w[1].0).ln());
    slopes
        .max_by(|a, b| (a - 1.0).abs().total_cmp(&(b - 1.0).abs()))
        .unwrap_or(f64::NAN)
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let rigid = place(0.0)?;
    let compliances = (6..=16)
        .map(|k| 10_f64.powi(-k))
        .step_by(either(quick, 2, 1));
    let compliances: Vec<f64> = compliances.collect();
    let ways = counted(progress, compliances).map(|c| Ok((c, (place(c)? - rigid).norm())));
    let ways: Vec<(f64, f64)> = ways.collect::<Result<_, StepError>>()?;
    let heads: Vec<String> = ways.iter().map(|w| format!("{:.0e}", w.0)).collect();
    let cells = ways.iter().map(|w| error(Some(w.1))).collect();
    let case = "load after 1 s: order in ε";
    let check = Check::number(case, [1.0, order(&ways)], "", Measure::Absolute, ORDER_BAR);
    Ok(Outcome {
        checks: vec![check.by(
            "slope of the distance from the rigid run between decades of ε, the farthest from 1",
        )],
        text: grid("ε", &heads, [("load after 1 s [m]".to_owned(), cells)]) + "\n",
        ..Outcome::default()
    })
}
