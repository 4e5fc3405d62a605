//! Modes and fronts of the chain of masses m and springs k that a bar of rigid rods is along its axis and about it.
//!
//! Joints between rods stand for a rod's length of bar, those at held ends for half of it: held through 2k,
//! u_j = sin((j − ½)θ) with
//!
//! ```text
//! ω = 2 √(k/m) sin ½θ,    free end: θ = (2n − 1)π/(2N),    end mass M: (M/m) sin θ tan Nθ = 1
//! ```
//!
//! exactly, where the continuum has (2n − 1)π/2 and β tan β = N m/M for β = Nθ. A force F that sets in at the free end moves
//! mass j with v_j(t) = Σ_k u_k(j) u_k(N) F sin(ω_k t)/(ω_k m Σ_i u_k(i)²).

use crate::hard::special::root;
use std::f64::consts::{FRAC_PI_2, PI};

/// θ of the first mode of N = `segments` masses with an end mass, the masses together `ratio` times it.
pub(super) fn end_mass(segments: usize, ratio: f64) -> f64 {
    let n = segments as f64;
    let mismatch = |theta: f64| n / ratio * theta.sin() * (n * theta).sin() - (n * theta).cos();
    root(mismatch, 0.0, FRAC_PI_2 / n)
}

/// β of β tan β = `ratio`, 0 < β < ½π.
pub(super) fn end_mass_continuum(ratio: f64) -> f64 {
    root(|b| b * b.sin() - ratio * b.cos(), 0.0, FRAC_PI_2)
}

/// Velocity of mass `j` of `n`, from 1, over that behind the front, at the time `t` √(k/m).
fn response(n: usize, j: usize, t: f64) -> f64 {
    let mode = |k: usize| {
        let theta = (2 * k - 1) as f64 * PI / (2 * n) as f64;
        let u = |i: usize| ((i as f64 - 0.5) * theta).sin();
        let omega = 2.0 * (0.5 * theta).sin();
        let norm: f64 = (1..=n).map(|i| u(i) * u(i)).sum();
        u(j) * u(n) * (omega * t).sin() / (omega * norm)
    };
    (1..=n).map(mode).sum()
}

/// The time √(k/m) at which mass `j` of `n` has a third of the velocity behind the front, seen in steps of 0.05.
pub(super) fn front(n: usize, j: usize) -> f64 {
    let mut before = 0.0;
    for step in 0..40 * n {
        let t = 0.05 * (step as f64 + 0.5);
        let v = response(n, j, t);
        if v >= 1.0 / 3.0 {
            return t - 0.05 * (v - 1.0 / 3.0) / (v - before);
        }
        before = v;
    }
    f64::NAN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn end_masses_as_printed() {
        for (ratio, digits) in [
            (1.0, 0.8603335890),
            (0.1, 0.3110528482),
            (1e-3, 0.0316175071),
        ] {
            assert!((end_mass_continuum(ratio) - digits).abs() < 1e-10);
            let discrete = end_mass(400, ratio) * 400.0;
            assert!((discrete / digits - 1.0).abs() < 1e-5, "{discrete}");
        }
        // One mass m on 2k, and M behind another 2k: det(K − ω²M) = 0.
        let (theta, ratio) = (end_mass(1, 0.5), 0.5);
        let square = (2.0 * (0.5 * theta).sin()).powi(2);
        let end = 1.0 / ratio;
        let determinant = (4.0 - square) * (2.0 - end * square) - 4.0;
        assert!(determinant.abs() < 1e-13, "{determinant}");
    }

    #[test]
    fn the_front_leaves_a_plateau() {
        assert!((response(50, 40, 40.0) - 1.0).abs() < 0.2);
        assert!(response(50, 10, 20.0).abs() < 1e-3);
        // A third at the continuum's front, which starts at the free end, half a segment beyond the last mass.
        assert!((response(50, 10, 40.5) - 1.0 / 3.0).abs() < 0.05);
        assert!((front(50, 25) - 25.5).abs() < 0.1);
    }
}
