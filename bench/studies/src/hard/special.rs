//! Special functions of the cases' references, and roots.
//!
//! Elliptic integrals from Carlson's symmetric forms R_F and R_D: B. C. Carlson, *Numerical computation of real or complex
//! elliptic integrals*, Numer. Algorithms 10 (1995). Zeros of Laguerre's polynomials and of Bessel functions as eigenvalues
//! of their recurrences: Y. Ikebe, Y. Kikuchi, I. Fujishiro, *Computing zeros and orders of Bessel functions*,
//! J. Comput. Appl. Math. 38 (1991).

use nalgebra::DMatrix;
use std::f64::consts::FRAC_PI_2;

/// Carlson's R_F(x, y, z) and R_D(x, y, z). NaN for negative arguments.
fn carlson(mut xyz: [f64; 3]) -> [f64; 2] {
    let (mut sum, mut weight) = (0.0, 1.0);
    // Each duplication brings the arguments four times nearer to each other: after 30 they are one number.
    for _ in 0..30 {
        let [a, b, c] = xyz.map(f64::sqrt);
        let lambda = a * b + b * c + c * a;
        sum += weight / (c * (xyz[2] + lambda));
        weight *= 0.25;
        xyz = xyz.map(|x| 0.25 * (x + lambda));
    }
    let root = xyz[2].sqrt();
    [root.recip(), 3.0 * sum + weight / root.powi(3)]
}

/// Legendre's ∫₀^φ (1 − k² sin²t)^−½ dt and ∫₀^φ (1 − k² sin²t)^½ dt for |φ| ≤ ½π and k² sin²φ < 1. NaN beyond.
pub(super) fn elliptic(phi: f64, k: f64) -> [f64; 2] {
    if phi.is_nan() || phi.abs() > FRAC_PI_2 {
        return [f64::NAN; 2];
    }
    let (s, c) = phi.sin_cos();
    let [first, second] = carlson([c * c, (1.0 - k * s) * (1.0 + k * s), 1.0]);
    [s * first, s * first - k * k * s.powi(3) / 3.0 * second]
}

/// Eigenvalues of a symmetric matrix of `n` rows with these entries (i, i) and (i, i + 1), ascending.
fn tridiagonal(n: usize, own: impl Fn(f64) -> f64, next: impl Fn(f64) -> f64) -> Vec<f64> {
    if n == 0 {
        return Vec::new();
    }
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => own(i as f64),
        1 => next(i.min(j) as f64),
        _ => 0.0,
    };
    let values = DMatrix::from_fn(n, n, entry).symmetric_eigenvalues();
    let mut values: Vec<f64> = values.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The zero j_{ν,k}, k = 1, 2, …, of the Bessel function J_ν, ν > −1.
///
/// With m = ν + 2, ν + 4, … the recurrence is that of an eigenvector of 4/j²:
/// J_{m−2}/(m (m − 1)) + 2 J_m/((m − 1)(m + 1)) + J_{m+2}/(m (m + 1)) = 4/j² J_m. Beyond m = j the terms vanish fast.
pub(super) fn bessel_zero(order: f64, k: usize) -> f64 {
    let m = |i: f64| order + 2.0 * (i + 1.0);
    let own = |i: f64| 2.0 / ((m(i) - 1.0) * (m(i) + 1.0));
    let next = |i: f64| 1.0 / ((m(i) + 1.0) * (m(i) * (m(i) + 2.0)).sqrt());
    let inverse = tridiagonal(4 * k + 20, own, next);
    let found = inverse.len().checked_sub(k).and_then(|i| inverse.get(i));
    found.map_or(f64::NAN, |square| 2.0 / square.sqrt())
}

/// The zeros of Laguerre's polynomial L_n, ascending.
pub(super) fn laguerre_zeros(n: usize) -> Vec<f64> {
    tridiagonal(n, |i| 2.0 * i + 1.0, |i| i + 1.0)
}

/// The root of a function that changes sign between `low` and `high`, by bisection to the last bit. NaN where the
/// signs are alike.
pub(super) fn root(f: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let (mut low, mut high) = (low, high);
    let (below, above) = (f(low), f(high));
    if below == 0.0 {
        return low;
    }
    if above == 0.0 {
        return high;
    }
    if below.is_nan() || above.is_nan() || below.signum() == above.signum() {
        return f64::NAN;
    }
    loop {
        let middle = low.midpoint(high);
        if middle <= low.min(high) || middle >= low.max(high) {
            return middle;
        }
        let at = f(middle);
        if at == 0.0 {
            return middle;
        }
        if at * below > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn near(ours: f64, reference: f64, error: f64) {
        let off = (ours - reference).abs();
        assert!(off <= error * reference.abs(), "{ours} {reference}");
    }

    #[test]
    fn elliptic_integrals_at_known_places() {
        let complete = |k| elliptic(FRAC_PI_2, k);
        assert!(
            complete(0.0)
                .iter()
                .all(|x| (x / FRAC_PI_2 - 1.0).abs() < 1e-15)
        );
        // Legendre's relation at k = sin 40°.
        let [[k, e], [k1, e1]] =
            [40_f64.to_radians().sin(), 40_f64.to_radians().cos()].map(complete);
        near(e * k1 + e1 * k - k * k1, FRAC_PI_2, 2e-15);
        // The period of a pendulum.
        for (degrees, ratio) in [
            (30.0_f64, 1.0174087976),
            (90.0, 1.1803405990),
            (179.0, 3.9010651604),
        ] {
            let k = (0.5 * degrees.to_radians()).sin();
            near(complete(k)[0] / FRAC_PI_2, ratio, 1e-10);
        }
        assert!(complete(1.5)[0].is_nan() && elliptic(2.0, 0.5)[0].is_nan());
    }

    #[test]
    fn incomplete_elliptic_integrals_are_their_sums() {
        for (phi, k) in [(0.3, 0.9), (1.2, 0.5), (-0.8, 0.99)] {
            // Gauss–Legendre with two points on many parts.
            let parts = 2000;
            let h = phi / f64::from(parts);
            let nodes = [0.5 - 0.5 / 3_f64.sqrt(), 0.5 + 0.5 / 3_f64.sqrt()];
            let (mut first, mut second) = (0.0, 0.0);
            for i in 0..parts {
                for node in nodes {
                    let delta = (1.0 - (k * ((f64::from(i) + node) * h).sin()).powi(2)).sqrt();
                    first += 0.5 * h / delta;
                    second += 0.5 * h * delta;
                }
            }
            let [ours, other] = elliptic(phi, k);
            near(ours, first, 1e-12);
            near(other, second, 1e-12);
        }
    }

    #[test]
    fn zeros_of_bessel_functions() {
        // Order ½ is sin x/x, order −½ cos x.
        near(bessel_zero(0.5, 5), 5.0 * PI, 1e-13);
        near(bessel_zero(-0.5, 20), 19.5 * PI, 1e-13);
        for (k, half) in [(1, 1.2024127788), (2, 2.7600390551), (3, 4.3268639565)] {
            near(0.5 * bessel_zero(0.0, k), half, 1e-10);
        }
        near(2.25 * bessel_zero(-1.0 / 3.0, 1).powi(2), 7.837347439, 1e-9);
    }

    #[test]
    fn laguerre_zeros_of_order_five() {
        let printed = [
            0.2635603197,
            1.4134030591,
            3.5964257710,
            7.0858100059,
            12.6408008443,
        ];
        for (ours, reference) in laguerre_zeros(5).iter().zip(printed) {
            near(*ours, reference, 1e-9);
        }
    }

    #[test]
    fn roots_by_bisection() {
        near(root(f64::cos, 1.0, 2.0), FRAC_PI_2, 1e-15);
        assert!(root(|x| x * x + 1.0, 0.0, 1.0).is_nan());
    }
}
