//! Effect of a scheme on one mode: the roots of its characteristic polynomial.
//!
//! With Ω_e² = ω_e²Δt² of the elastic part, Ω_g² of the geometric one (tension and gravity, which the step treats
//! explicitly), θ = τ/Δt and the weights (p, q, s) of [`Scheme`] a mode's coordinate obeys
//!
//! ```text
//! x_{n+1} − 2x_n + x_{n−1} + Ω_g² x_n + Ω_e² [φ̄ + θ (x_{n+1} − x_n)] = 0
//! φ̄ = x_n + p (x_{n+1} − x_n) − q (x_n − x_{n−1}) + s (x_{n−1} − x_{n−2})
//! ```
//!
//! For the linearly implicit scheme and Ω_g = 0 the roots are (1 ± iΩ)/(1 + Ω²): modulus (1 + Ω²)^(−1/2), phase arctan
//! Ω. For Ω_e = 0 all schemes are the leapfrog: modulus 1, 2 sin(phase/2) = Ω. Geometric stiffness as inertia gives Ω_g² weights
//! as well.

use nalgebra::{DMatrix, DVector};
use taut_integrator::{Scheme, Weights};

/// Coefficients c of x_{n+k} = Σ c_j x_{n+j} for a mode, from \[Ω_e², Ω_g²] and θ = τ/Δt: two, or three with a third
/// difference.
pub(crate) fn recurrence(scheme: Scheme, [elastic, geometric]: [f64; 2], theta: f64) -> Vec<f64> {
    mixed(&[
        (elastic, scheme.weights(), theta),
        (geometric, Weights::default(), 0.0),
    ])
}

/// [`recurrence`] of an elastic mode by p, q and s, Ω and θ.
pub(crate) fn weighed(&[next, now, before, omega, theta]: &[f64; 5]) -> Vec<f64> {
    let weights = Weights { next, now, before };
    mixed(&[(omega * omega, weights, theta)])
}

/// How far the largest root of the recurrence that fits samples is from that of the one expected: its modulus, relative,
/// plus its phase \[rad].
pub(crate) fn distance(samples: &[f64], expected: &[f64]) -> f64 {
    // The first steps have no past to look back on, and what has decayed is rounding.
    let first = if expected.len() == 3 { 3 } else { 1 };
    let start = samples.first().map_or(0.0, |x| x.abs());
    let last = samples.iter().rposition(|x| x.abs() > 1e-6 * start);
    let lasting = samples.get(first..=last.unwrap_or(0)).unwrap_or_default();
    if lasting.len() <= expected.len() {
        return f64::NAN;
    }
    let found = roots(&fitted(lasting, expected.len()));
    let (Some(found), Some(own)) = (found.first().copied(), roots(expected).first().copied())
    else {
        return f64::NAN;
    };
    // Two real roots close to each other part into a pair by rounding: their phase says nothing.
    let phase = if own[1] == 0.0 {
        0.0
    } else {
        (found[1] - own[1]).abs()
    };
    (found[0] / own[0] - 1.0).abs() + phase
}

/// [`recurrence`] of a mode whose Ω² has several parts, each with its weights and its θ.
pub(crate) fn mixed(parts: &[(f64, Weights, f64)]) -> Vec<f64> {
    let sum = |of: &dyn Fn(Weights, f64) -> f64| -> f64 {
        parts
            .iter()
            .map(|(square, w, theta)| square * of(*w, *theta))
            .sum()
    };
    let lead = 1.0 + sum(&|w, theta| w.next + theta);
    let now = -2.0 + sum(&|w, theta| 1.0 - w.next - w.now - theta);
    let before = 1.0 + sum(&|w, _| w.now + w.before);
    let first = -sum(&|w, _| w.before);
    let all = [first, before, now].map(|c| -c / lead);
    all[usize::from(first == 0.0)..].to_vec()
}

/// Coefficients of the recurrence of order `k` that fits samples best.
pub(crate) fn fitted(x: &[f64], k: usize) -> Vec<f64> {
    let rows = x.len().saturating_sub(k);
    // Decaying samples weigh alike.
    let scale = |i: usize| x[i..=i + k].iter().map(|x| x.abs()).fold(0.0, f64::max);
    if !(0..rows).all(|i| scale(i) > 0.0 && scale(i).is_finite()) {
        return vec![f64::NAN; k];
    }
    let a = DMatrix::from_fn(rows, k, |i, j| x[i + j] / scale(i));
    let b = DVector::from_fn(rows, |i, _| x[i + k] / scale(i));
    let found = a.svd(true, true).solve(&b, 0.0);
    found.map_or_else(|_| vec![f64::NAN; k], |c| c.iter().copied().collect())
}

/// Roots of z^k = Σ c_j z^j as \[modulus, |phase|], the largest first; none where a coefficient is not finite.
pub(crate) fn roots(c: &[f64]) -> Vec<[f64; 2]> {
    let k = c.len();
    if c.is_empty() || !c.iter().all(|c| c.is_finite()) {
        return Vec::new();
    }
    let companion = DMatrix::from_fn(k, k, |i, j| {
        if i + 1 == k {
            c[j]
        } else {
            f64::from(u8::from(j == i + 1))
        }
    });
    let z = companion.complex_eigenvalues();
    let mut roots: Vec<_> = z.iter().map(|z| [z.norm(), z.arg().abs()]).collect();
    roots.sort_by(|a, b| b[0].total_cmp(&a[0]).then(b[1].total_cmp(&a[1])));
    roots
}

/// Factor of the amplitude of an elastic mode with ω Δt = `phase` in a step.
pub(crate) fn modulus(scheme: Scheme, phase: f64) -> f64 {
    let roots = roots(&recurrence(scheme, [phase * phase, 0.0], 0.0));
    roots.first().map_or(f64::NAN, |[modulus, _]| *modulus)
}

/// The frequency \[rad/s] at which a scheme runs a mode of frequency `omega` (rad/s) that is elastic alone.
pub(crate) fn elastic_frequency(scheme: Scheme, omega: f64, dt: f64) -> f64 {
    let square = (omega * dt).powi(2);
    let roots = roots(&recurrence(scheme, [square, 0.0], 0.0));
    roots.first().map_or(f64::NAN, |[_, phase]| phase / dt)
}

/// The frequency \[rad/s] at which every scheme runs a mode of frequency `omega` (rad/s) that tension or gravity holds:
/// the leapfrog's.
pub(crate) fn geometric_frequency(omega: f64, dt: f64) -> f64 {
    2.0 / dt * (0.5 * omega * dt).asin()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_roots() {
        let third = Scheme::THIRD_DIFFERENCE;
        for omega in [0.05_f64, 0.2, 1.0, 3.0] {
            let elastic = |scheme| roots(&recurrence(scheme, [omega * omega, 0.0], 0.0))[0];
            let [modulus, phase] = elastic(Scheme::LinearlyImplicit);
            assert!((modulus - (1.0 + omega * omega).powf(-0.5)).abs() < 1e-14);
            assert!((phase - omega.atan()).abs() < 1e-13);
            assert!((elastic(Scheme::Spook)[0] - 1.0).abs() < 1e-14);
            let lost = 1.0 - elastic(third)[0];
            assert!(lost > 0.0 && lost < omega, "{omega}: {lost}");
        }
        let geometric = roots(&recurrence(third, [0.0, 0.04], 0.0));
        let largest = geometric.iter().find(|z| z[0] > 0.5).unwrap();
        assert!((largest[1] - geometric_frequency(0.2, 1.0)).abs() < 1e-12);
        // At infinite frequency the default keeps 0.64 of an amplitude in a step.
        let [last, _] = roots(&recurrence(third, [1e12, 0.0], 0.0))[0];
        assert!((last - 0.64).abs() < 5e-3, "{last}");
        assert!((elastic_frequency(third, 2.0, 1e-3) / 2.0 - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_recurrence_is_found_in_its_samples() {
        let x = (0..20).map(|n| 0.9_f64.powi(n) * (0.3 * f64::from(n)).cos());
        let x: Vec<f64> = x.collect();
        let [modulus, phase] = roots(&fitted(&x, 2))[0];
        assert!((modulus - 0.9).abs() < 1e-12 && (phase - 0.3).abs() < 1e-12);
    }
}
