//! H41: ten boxes on each other, heavier and heavier, and one that is as heavy as all that.
//!
//! Boxes of the edge a = 1 m stand on each other. Their masses rise from 1 kg by equal factors up to r kg, or all are 1
//! kg but for the topmost. The interface below box k carries the weight of what stands on it,
//!
//! ```text
//! N_k = g Σ_{j ≥ k} m_j
//! ```
//!
//! Each interface has four points of which each takes a quarter: with the compliance ε = 2·10⁻¹⁰ m/N of two default
//! surfaces it yields by ε N_k/4. Ratios of 10⁵ are what makes sweeps over the contacts crawl: a light box between
//! heavy ones passes on what the heavy ones exchange.

use super::{DT, GRAVITY, Said, ground, put_box, rough, run};
use crate::hard::{each_solver, either, worse};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_ground::choice::Choice;
use taut_integrator::{StepError, Stepper};
use taut_model::Scene;
use taut_output::check::{Check, ExperimentError, Outcome};

const BOXES: usize = 10;
const EDGE: f64 = 1.0;
/// Largest relative error of an interface's force.
const BAR: f64 = 1e-8;
/// Largest penetration, over the edge.
const DEEPEST: f64 = 1e-4;
/// Largest violation of the conditions on contacts.
const EXACT: f64 = 1e-10;

/// Masses that rise up to a ratio.
fn rising(ratio: f64) -> Vec<f64> {
    let part = |k: usize| k as f64 / (BOXES - 1) as f64;
    (0..BOXES).map(|k| ratio.powf(part(k))).collect()
}

/// Equal masses below one.
fn topped(ratio: f64) -> Vec<f64> {
    let mut masses = vec![1.0; BOXES];
    masses[BOXES - 1] = ratio;
    masses
}

fn stack(masses: &[f64]) -> Scene {
    let mut scene = ground("stack", 0.0, rough(0.5));
    for (k, mass) in masses.iter().enumerate() {
        let at = Vector3::z() * EDGE * (0.5 + k as f64);
        let shape = [Vector3::repeat(EDGE), at];
        put_box(
            &mut scene,
            shape,
            UnitQuaternion::identity(),
            *mass,
            rough(0.5),
        );
    }
    scene
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![stack(&rising(1e3))])
}

/// Figures of a stack's run.
struct Stood {
    /// Largest relative error of an interface's normal force.
    force: f64,
    said: Said,
}

/// Largest relative error of the interfaces' normal forces.
fn off(stepper: &Stepper, masses: &[f64]) -> f64 {
    let mut found = vec![0.0; masses.len()];
    for contact in stepper.contacts() {
        // The higher body of the two: the ground is collider 0, box k collider k + 1.
        let upper = contact.colliders[1] - 1;
        found[upper] += contact.force.dot(&contact.normal);
    }
    let above = |k: usize| GRAVITY * masses[k..].iter().sum::<f64>();
    let errors = found.iter().enumerate();
    errors.fold(0.0, |all, (k, n)| worse(all, (n / above(k) - 1.0).abs()))
}

fn stand(masses: &[f64], choice: &Choice) -> Result<Stood, StepError> {
    let (stepper, said) = run(stack(masses), choice.options(DT), 60, |_, _| {})?;
    let force = off(&stepper, masses);
    Ok(Stood { force, said })
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    let all = [
        ("masses 1", rising(1.0)),
        ("masses 1 … 10", rising(10.0)),
        ("masses 1 … 10³", rising(1e3)),
        ("masses 1 … 10⁵", rising(1e5)),
        ("10⁵ on nine of 1", topped(1e5)),
    ];
    let some = either(quick, 3, 0);
    for (name, masses) in &all[some..] {
        let mut worst = Said::default();
        checks.extend(each_solver(&format!("{name}: interfaces"), |choice| {
            let stood = stand(masses, choice)?;
            worst.undecided += stood.said.undecided;
            worst.fallbacks += stood.said.fallbacks;
            worst.deepest = worse(worst.deepest, stood.said.deepest);
            worst.complementarity = worse(worst.complementarity, stood.said.complementarity);
            worst.cone = worse(worst.cone, stood.said.cone);
            let by = "largest relative error of a normal force after 60 steps";
            Ok(Check::off("", "weight above", stood.force, "", BAR).by(by))
        })?);
        checks.extend(conditions(name, &worst));
    }
    Ok(checks.into())
}

/// Checks of the contact conditions over all solvers' runs.
fn conditions(name: &str, worst: &Said) -> [Check; 3] {
    let decided = format!("{} undecided", worst.undecided);
    let fallbacks = format!("{} steps beyond Newton's method", worst.fallbacks);
    [
        Check::off(
            format!("{name}: penetration"),
            "none",
            worst.deepest / EDGE,
            "edges",
            DEEPEST,
        ),
        Check::off(
            format!("{name}: complementarity and cone"),
            "kept",
            worse(worst.complementarity, worst.cone),
            "",
            EXACT,
        )
        .by("largest violation in any step"),
        Check::stated(
            format!("{name}: steps"),
            "none undecided",
            decided,
            worst.undecided == 0,
        )
        .noting(fallbacks),
    ]
}
