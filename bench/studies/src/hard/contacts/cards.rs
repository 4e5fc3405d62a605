//! H45, two cards that lean on each other.
//!
//! Two cards of the half length l and the half thickness b stand on a floor, each at the angle α to the vertical, and
//! touch with the upper edges of their inner faces. By symmetry they exchange a horizontal force H there, the floor
//! pushes with the weight W of a card, and friction with H against the card's lower inner edge. The moments about that
//! edge, with the centre l along the face and b off it, are
//!
//! ```text
//! H 2l cos α = W (l sin α − b cos α),    H ≤ μ W    ⇒    tan α − b/l ≤ 2μ
//! ```
//!
//! The contact above has the normal of one of the faces, so that H lies at α to it: the cards' own friction is above
//! tan α. With μ_c on both cards and μ²/μ_c on the floor, card and floor have √(μ_c μ²/μ_c) = μ.

use super::{DT, ground, put_box, rough, run};
use crate::hard::at;
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_model::Scene;
use taut_output::check::{Check, ExperimentError, Outcome};

/// Half length, half thickness and width \[m].
const HALF: [f64; 2] = [0.5, 0.01];
const WIDTH: f64 = 0.4;
/// Friction of the cards on each other.
const CARDS: f64 = 2.0;
/// Part by which what stands and what falls are apart.
const APART: f64 = 1e-2;

/// Two cards at the angle α (rad) on a floor with friction μ.
fn house(angle: f64, friction: f64) -> Scene {
    let mut scene = ground("two cards", 0.0, rough(friction * friction / CARDS));
    let [length, thick] = HALF;
    let size = Vector3::new(2.0 * thick, WIDTH, 2.0 * length);
    for side in [1.0, -1.0] {
        // The card at +x leans to −x.
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -side * angle);
        let inner = turn * Vector3::new(-side * thick, 0.0, length);
        let foot = turn * Vector3::new(-side * thick, 0.0, -length);
        let at = Vector3::new(-inner.x, 0.0, -foot.z);
        put_box(&mut scene, [size, at], turn, 1.0, rough(CARDS));
    }
    scene
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![house(0.5, 0.3)])
}

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for friction in [0.1, 0.3] {
        let limit = 2.0 * friction + HALF[1] / HALF[0];
        let mut moved = [0.0; 2];
        let mut undecided = 0;
        for (moved, part) in moved.iter_mut().zip([1.0 - APART, 1.0 + APART]) {
            let scene = house((limit * part).atan(), friction);
            let first = scene.bodies.position.clone();
            let (stepper, said) = run(scene, at(DT), 60, |_, _| {})?;
            let now = stepper.scene().bodies.position.iter().zip(&first);
            *moved = now.map(|(x, x0)| (x - x0).norm()).fold(0.0, f64::max);
            undecided += said.undecided;
        }
        let [stands, falls] = moved;
        let case = format!("two cards, μ = {friction}, tan α = (1 ∓ {APART}) (2μ + b/l)");
        let ours = format!("{stands:.1e} and {falls:.1e} m in 1 s");
        let good = stands < 1e-6 && falls > 1e-3;
        let check = Check::stated(case, "stands and falls", ours, good);
        checks.push(check.noting(format!("{undecided} undecided steps")));
    }
    Ok(checks.into())
}
