//! H14: a cantilever under a small load at its tip, of segments of any lengths h_i and stiffnesses EI_i.
//!
//! Joint j at the distance s_j from the tip has the moment F s_j, so that the tip goes by F Σ s_j² ε_j: exact for the
//! chain as far as the load is small. A joint has the compliance of the halves that meet in it,
//! ½ h_i/EI_i + ½ h_{i+1}/EI_{i+1}; the clamp that of half the first segment.

use super::rod::{Compliance, Rod};
use crate::hard::{alike, counted, either};
use crate::paper::specimens::settle;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_ground::random::Random;
use taut_model::Scene;
use taut_output::check::{Check, ExperimentError, Outcome};

/// Bar against the exact chain.
const UNEVEN_BAR: f64 = 1e-6;

/// Deflection over length: its square is what the linear answer leaves out.
const SMALL: f64 = 1e-5;

/// F Σ s_j² ε_j: how far the tip goes \[m].
fn deflection(rod: &Rod) -> f64 {
    let tip = rod.nodes[rod.segments()].x;
    let levers = rod.nodes.iter().zip(&rod.joints);
    rod.force.y
        * levers
            .map(|(p, c)| (tip - p.x).powi(2) * c.bend)
            .sum::<f64>()
}

/// How far the tip went \[m].
fn tip(scene: &Scene) -> f64 {
    scene.load.map_or(f64::NAN, |i| scene.bodies.position[i].y)
}

fn check(rod: &Rod, ours: f64, limit: f64, bar: f64) -> Check {
    let exact = deflection(rod);
    Check::relative("", [exact / limit, ours / limit], "", bar)
        .by("way of the tip over the beam's, relative to the exact chain's")
        .algebraic()
        .space_part((exact / limit - 1.0).abs())
}

/// EI from the clamp to [`SHARE`] of the length \[N m²].
const STIFF: f64 = 1.0;
/// EI of the rest \[N m²].
const SOFT: f64 = 0.05;
/// Stiff part of the length.
const SHARE: f64 = 0.4;

/// 1 m of cable, stiff from the clamp and soft beyond, in `n` segments of random lengths that differ by up to ten
/// times; both parts have as many.
pub(super) fn uneven(n: usize, seed: u64) -> Rod {
    let mut random = Random::new(seed);
    let half = n / 2;
    let mut lengths: Vec<f64> = (0..n).map(|_| random.log_uniform(0.1, 1.0)).collect();
    for (part, whole) in [(0..half, SHARE), (half..n, 1.0 - SHARE)] {
        let sum: f64 = lengths[part.clone()].iter().sum();
        for length in &mut lengths[part] {
            *length *= whole / sum;
        }
    }
    let stiffness = |i: usize| if i < half { STIFF } else { SOFT };
    let of_half = |i: usize| 0.5 * lengths[i] / stiffness(i);
    let joints = (0..n).map(|j| {
        let bend = of_half(j) + if j > 0 { of_half(j - 1) } else { 0.0 };
        Compliance {
            stretch: 0.0,
            bend,
            twist: bend,
        }
    });
    let joints: Vec<Compliance> = joints.collect();
    let mut rod = Rod::straight(0.0, &lengths, joints);
    rod.force = Vector3::y() * SMALL;
    rod
}

/// F ∫ s²/EI ds of the two materials.
fn beam(force: f64) -> f64 {
    let soft = 1.0 - SHARE;
    force / 3.0 * (soft.powi(3) / SOFT + (1.0 - soft.powi(3)) / STIFF)
}

/// H14.
pub(super) fn random(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let (counts, seeds): (&[usize], u64) = either(quick, (&[8, 32], 2), (&[8, 16, 32, 64, 128], 5));
    let mut checks = Vec::new();
    let mut errors = Vec::new();
    for &n in counted(progress, counts) {
        let (mut small, mut large) = (Vec::new(), Vec::new());
        let mut mean = 0.0;
        for seed in 1..=seeds {
            let mut rod = uneven(n, seed);
            let limit = beam(rod.force.y);
            mean += (deflection(&rod) / limit - 1.0).abs() / seeds as f64;
            let ours = tip(&settle(rod.scene()?)?);
            small.push((format!("seed {seed}"), check(&rod, ours, limit, UNEVEN_BAR)));
            // A load that bends the rod through is compared with the exact chain.
            rod.force = Vector3::new(0.0, 0.3, 0.1);
            large.push((format!("seed {seed}"), bent_through(&rod)?));
        }
        for (load, found) in [("small", small), ("large", large)] {
            checks.extend(alike(&format!("N = {n}, {load} load"), "seeds", found));
        }
        errors.push((n, mean));
    }
    checks.extend(super::order("random lengths, mean of the seeds", &errors));
    Ok(checks.into())
}

/// Tip of a rod that is bent far, against the exact chain's.
fn bent_through(rod: &Rod) -> Result<Check, ExperimentError> {
    let ours = rod.settled()?.tip();
    let exact = rod.exact(20).map_or(Vector3::repeat(f64::NAN), |s| s.tip());
    let check = Check::vector(
        "",
        [exact.as_slice(), ours.as_slice()],
        "m",
        [(ours - exact).norm(), UNEVEN_BAR],
    );
    Ok(check
        .by("distance of the tip from the exact chain's, over L")
        .algebraic())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_segments_fill_the_cable() {
        let rod = uneven(32, 7);
        assert!((rod.nodes[32].x - 1.0).abs() < 1e-13);
        let error = deflection(&rod) / beam(rod.force.y) - 1.0;
        assert!(error.abs() < 0.02, "{error}");
    }
}
