//! H05: the elastica, a cantilever bent far by a dead load P across its tip, α = P L²/EI.
//!
//! With the tip's slope θ and k² = (1 + sin θ)/2, sin φ = 1/(k √2):
//!
//! ```text
//! √α = K(k) − F(φ, k),   x/L = (2 sin θ/α)^½,   y/L = 1 − 2 (E(k) − E(φ, k))/√α
//! ```
//!
//! The chain has its joints in the middle of the lengths that they stand for; its exact answer is that of
//! [`super::rod`].

use super::rod::Rod;
use crate::hard::either;
use crate::hard::special::{elliptic, root};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;
use taut_output::check::{Check, ExperimentError, Outcome};

/// Bar of the tip and its slope at N = 64.
pub(super) const BAR: f64 = 1e-4;
/// Bar against the exact chain.
pub(super) const CHAIN_BAR: f64 = 1e-8;

/// The loads α.
pub(super) const LOADS: [f64; 9] = [0.25, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0];

/// The tip of the elastica of length 1: x, y and slope (rad).
pub(super) fn elastica(alpha: f64) -> [f64; 3] {
    let modulus = |slope: f64| (0.5 * (1.0 + slope.sin())).sqrt();
    let amplitude = |k: f64| (1.0 / (k * 2.0_f64.sqrt())).min(1.0).asin();
    let beyond = |slope: f64, kind: usize| {
        let k = modulus(slope);
        elliptic(FRAC_PI_2, k)[kind] - elliptic(amplitude(k), k)[kind]
    };
    let load = |slope: f64| beyond(slope, 0) - alpha.sqrt();
    let slope = root(load, 1e-12, FRAC_PI_2 - 1e-6);
    [
        (2.0 * slope.sin() / alpha).sqrt(),
        1.0 - 2.0 * beyond(slope, 1) / alpha.sqrt(),
        slope,
    ]
}

/// The chain of `n` joints under the load α.
pub(super) fn rod(n: usize, alpha: f64) -> Rod {
    let mut rod = Rod::midpoints(n);
    rod.force = Vector3::y() * alpha;
    rod
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let (counts, loads): (&[usize], &[f64]) =
        either(quick, (&[16, 64], &[1.0, 10.0]), (&[8, 16, 32, 64], &LOADS));
    progress.set_length((counts.len() * loads.len()) as u64);
    let mut checks = Vec::new();
    for &alpha in loads {
        let curve = elastica(alpha);
        let mut errors = Vec::new();
        for &n in counts {
            let rod = rod(n, alpha);
            let measure = |shape: super::rod::Shape| {
                let (tip, along) = (shape.tip(), shape.tangent);
                [tip.x, tip.y, along.y.atan2(along.x)]
            };
            let ours = measure(rod.settled()?);
            let exact = rod.exact(20).map_or([f64::NAN; 3], measure);
            // The tip, without its slope: the last half segment is straight.
            let distance = |a: [f64; 3], b: [f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
            let (error, bar, reference, case) = if n == 64 {
                (distance(ours, curve), BAR, curve, "the elastica")
            } else {
                (distance(ours, exact), CHAIN_BAR, exact, "the exact chain")
            };
            errors.push((n, distance(exact, curve)));
            checks.push(
                Check::vector(
                    format!("α = {alpha}, N = {n}"),
                    [&reference, &ours],
                    "",
                    [error, bar],
                )
                .by(format!(
                    "distance of the tip from {case}, over L; shown: its place over L, its slope in rad"
                ))
                .algebraic_part(distance(ours, exact))
                .space_part(distance(exact, curve)),
            );
            progress.inc(1);
        }
        checks.extend(super::order(&format!("α = {alpha}"), &errors));
    }
    Ok(checks.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_elastica_has_the_known_numbers() {
        for (alpha, x, y, slope) in [
            (0.25, 0.9958821816, 0.0827459154, 7.121432),
            (1.0, 0.9435667637, 0.3017207738, 26.433520),
            (4.0, 0.6710587578, 0.6699641813, 64.242282),
            (10.0, 0.4450044022, 0.8106090249, 81.949325),
        ] {
            let [a, b, c] = elastica(alpha);
            assert!(
                (a - x).abs() < 2e-10 && (b - y).abs() < 2e-10,
                "{alpha}: {a} {b}"
            );
            assert!((c.to_degrees() - slope).abs() < 1e-6, "{alpha}: {c}");
        }
    }

    #[test]
    fn the_exact_chain_nears_the_elastica() {
        let tip = rod(64, 5.0).exact(20).expect("a shape").tip();
        let [x, y, _] = elastica(5.0);
        assert!(
            (tip.x - x - 1.18e-5).abs() < 1e-7 && (tip.y - y + 6.84e-5).abs() < 1e-7,
            "{tip}"
        );
    }
}
