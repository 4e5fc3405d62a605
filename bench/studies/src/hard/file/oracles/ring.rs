//! A straight elastic rod, bent to a ring and twisted, leaves its plane at the twist Θ = 2π √3 EI/GJ (Michell;
//! Zajac), in the mode of two waves: of n waves √(n² − 1).
//!
//! The ring of N segments, with the bend β = 2π/N and the twist Ω = Θ/N in every joint, is an equilibrium for any Ω.
//! Its second variation is that of Σ E(R_k, R_{k+1}) + Λ·Σ h t_k, with the force Λ that keeps the ring closed and
//! along its axis. All segments being alike, turned to their own place, tilts of the form q e^{2πi n k/N} decouple,
//! and the ring buckles where the 3 × 3 matrix of n = 2 gets singular. Its entries are differences of E, which is
//! written here from the swing and the twist of the relative rotation.

use crate::hard::special::root;
use nalgebra::{Complex, Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// GJ/EI.
const RATIO: f64 = 3.0;

/// Michell's twist in turns for a mode of `waves` ≥ 2 waves.
fn michell(waves: usize) -> f64 {
    ((waves * waves) as f64 - 1.0).sqrt() / RATIO
}

/// The joint's energy for small turns `a`, `b` of its sides, each in the frame of its own segment (tangent, across in
/// the plane, axis of the ring), over EI/h.
fn energy(a: &Vector3<f64>, b: &Vector3<f64>, beta: f64, omega: f64) -> f64 {
    let (a, b) = (
        Rotation3::from_scaled_axis(*a),
        Rotation3::from_scaled_axis(*b),
    );
    let bend = Rotation3::from_scaled_axis(Vector3::z() * beta);
    let twist = Rotation3::from_scaled_axis(Vector3::x() * omega);
    // Side b's frame is turned on by the twist, about its own tangent.
    let relative = a.inverse() * bend * b * twist;
    let q = UnitQuaternion::from_rotation_matrix(&relative);
    let cosine = relative.matrix()[(0, 0)];
    let sine = relative.matrix()[(1, 0)].hypot(relative.matrix()[(2, 0)]);
    let theta = sine.atan2(cosine);
    let mut found = 2.0 * q.i.atan2(q.w);
    found -= TAU * ((found - omega) / TAU).round();
    0.5 * (theta * theta + RATIO * found * found)
}

/// The smallest twist in turns at which the ring of `n` segments leaves its plane in a mode of `waves` waves.
pub(super) fn chain(n: usize, waves: usize) -> f64 {
    let beta = TAU / n as f64;
    let determinant = |turns: f64| stability(beta, TAU * turns / n as f64, waves as f64 * beta);
    let guess = michell(waves);
    root(determinant, 0.7 * guess, 1.3 * guess)
}

/// Determinant of the second variation for the phase `alpha` a segment.
fn stability(beta: f64, omega: f64, alpha: f64) -> f64 {
    const H: f64 = 2e-3;
    // Turns (of a, of b) along two of the six coordinates.
    let at = |i: usize, x: f64, j: usize, y: f64| {
        let mut turns = [Vector3::zeros(); 2];
        turns[i / 3][i % 3] += x;
        turns[j / 3][j % 3] += y;
        energy(&turns[0], &turns[1], beta, omega)
    };
    let slope = |i: usize| {
        let d = |h: f64| (at(i, h, i, 0.0) - at(i, -h, i, 0.0)) / (2.0 * h);
        (4.0 * d(H) - d(2.0 * H)) / 3.0
    };
    let second = |i: usize, j: usize| {
        let d = |h: f64| {
            let corners = at(i, h, j, h) - at(i, h, j, -h) - at(i, -h, j, h) + at(i, -h, j, -h);
            corners / (4.0 * h * h)
        };
        (4.0 * d(H) - d(2.0 * H)) / 3.0
    };
    // θ·(g + h t × Λ) = 0 with Λ along z: h Λ = g·y, since t × z = −y.
    let force = slope(1) + slope(4);
    let (forward, back) = (Complex::cis(alpha), Complex::cis(-alpha));
    let matrix = Matrix3::from_fn(|i, j| {
        let own = second(i, j) + second(3 + i, 3 + j);
        // ½ Λ·(θ × (θ × h t)) = ½ h Λ θ_z θ_t.
        let closing = if i + j == 2 && i != j {
            0.5 * force
        } else {
            0.0
        };
        let (there, here) = (second(i, 3 + j), second(j, 3 + i));
        Complex::from(own + closing) + forward * there + back * here
    });
    matrix.determinant().re
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ring_of_segments_has_the_known_twists() {
        for (n, printed, error) in [(24, 0.5826, 2e-4), (48, 0.5786, 6e-5), (96, 0.5777, 6e-5)] {
            let found = chain(n, 2);
            assert!((found - printed).abs() < error, "{n}: {found}");
        }
        assert!((chain(192, 3) / michell(3) - 1.0).abs() < 2e-3);
    }
}
