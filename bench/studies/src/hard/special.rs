//! Special functions of the cases' references, and roots.
//!
//! Elliptic integrals by the modulus k, as F(φ, k) = ∫₀^φ (1 − k² sin²t)^−½ dt and E(φ, k) = ∫₀^φ (1 − k² sin²t)^½ dt,
//! from Carlson's symmetric forms: B. C. Carlson, *Numerical computation of real or complex elliptic integrals*,
//! Numer. Algorithms 10 (1995). Bessel functions by Miller's recurrence downwards: W. Gautschi, *Computational
//! aspects of three-term recurrence relations*, SIAM Review 9 (1967). Laguerre's zeros as eigenvalues of their
//! recurrence.

use nalgebra::DMatrix;
use std::f64::consts::FRAC_PI_2;

/// Carlson's R_F(x, y, z) for non-negative arguments, at most one of them 0. NaN beyond.
pub(super) fn carlson_rf(x: f64, y: f64, z: f64) -> f64 {
    let (mut x, mut y, mut z) = (x, y, z);
    if !(x >= 0.0 && y >= 0.0 && z >= 0.0 && (x + y + z).is_finite()) {
        return f64::NAN;
    }
    for _ in 0..100 {
        let mean = (x + y + z) / 3.0;
        let off = [x, y, z].map(|a| 1.0 - a / mean);
        if off.iter().all(|d| d.abs() < 1e-3) {
            let e2 = off[0] * off[1] - off[2] * off[2];
            let e3 = off[0] * off[1] * off[2];
            let sum = 1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0;
            return sum / mean.sqrt();
        }
        ([x, y, z], _) = nearer([x, y, z]);
    }
    f64::NAN
}

/// A step of Carlson's duplication: arguments a quarter as far apart, and λ.
fn nearer(xyz: [f64; 3]) -> ([f64; 3], f64) {
    let [a, b, c] = xyz.map(f64::sqrt);
    let lambda = a * b + b * c + c * a;
    (xyz.map(|x| 0.25 * (x + lambda)), lambda)
}

/// Carlson's R_D(x, y, z) for non-negative x and y, at most one of them 0, and z > 0. NaN beyond.
pub(super) fn carlson_rd(x: f64, y: f64, z: f64) -> f64 {
    let (mut x, mut y, mut z) = (x, y, z);
    if !(x >= 0.0 && y >= 0.0 && z > 0.0 && (x + y + z).is_finite()) {
        return f64::NAN;
    }
    let (mut sum, mut weight) = (0.0, 1.0);
    for _ in 0..100 {
        let mean = (x + y + 3.0 * z) / 5.0;
        let [p, q, r] = [x, y, z].map(|a| 1.0 - a / mean);
        if [p, q, r].iter().all(|d| d.abs() < 1e-3) {
            let (pq, rr) = (p * q, r * r);
            let e2 = pq - 6.0 * rr;
            let e3 = (3.0 * pq - 8.0 * rr) * r;
            let e4 = 3.0 * (pq - rr) * rr;
            let e5 = pq * rr * r;
            let series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0
                - 3.0 * e4 / 22.0
                - 9.0 * e2 * e3 / 52.0
                + 3.0 * e5 / 26.0;
            return 3.0 * sum + weight * series / (mean * mean.sqrt());
        }
        let (next, lambda) = nearer([x, y, z]);
        sum += weight / (z.sqrt() * (z + lambda));
        weight *= 0.25;
        [x, y, z] = next;
    }
    f64::NAN
}

/// Legendre's F(φ, k) of the first kind for |φ| ≤ ½π and k² sin²φ < 1. NaN beyond.
pub(super) fn elliptic_f(phi: f64, k: f64) -> f64 {
    if phi.is_nan() || phi.abs() > FRAC_PI_2 {
        return f64::NAN;
    }
    let (s, c) = phi.sin_cos();
    s * carlson_rf(c * c, (1.0 - k * s) * (1.0 + k * s), 1.0)
}

/// Legendre's E(φ, k) of the second kind for |φ| ≤ ½π and k² sin²φ < 1. NaN beyond.
pub(super) fn elliptic_e(phi: f64, k: f64) -> f64 {
    if phi.is_nan() || phi.abs() > FRAC_PI_2 {
        return f64::NAN;
    }
    let (s, c) = phi.sin_cos();
    let (x, y) = (c * c, (1.0 - k * s) * (1.0 + k * s));
    s * carlson_rf(x, y, 1.0) - k * k * s.powi(3) / 3.0 * carlson_rd(x, y, 1.0)
}

/// The complete integral of the first kind, K(k), |k| < 1. NaN beyond.
pub(super) fn complete_k(k: f64) -> f64 {
    carlson_rf(0.0, (1.0 - k) * (1.0 + k), 1.0)
}

/// The complete integral of the second kind, E(k), |k| < 1. NaN beyond.
pub(super) fn complete_e(k: f64) -> f64 {
    let y = (1.0 - k) * (1.0 + k);
    carlson_rf(0.0, y, 1.0) - k * k / 3.0 * carlson_rd(0.0, y, 1.0)
}

/// The Bessel function of the first kind without its leading factor, Γ(ν + 1) (2/x)^ν J_ν(x): 1 at x = 0, with the
/// zeros of J_ν. Orders ν > −1, 0 ≤ x ≤ 10⁴; NaN beyond.
pub(super) fn bessel_reduced(order: f64, x: f64) -> f64 {
    if !(order > -1.0 && (0.0..=1e4).contains(&x)) {
        return f64::NAN;
    }
    if x < 1e-8 {
        return 1.0;
    }
    // Downwards J is the solution that grows: started far above x, it is met to rounding. Neumann's sum
    // Σ (ν + 2k) Γ(ν + k)/k! J_{ν+2k}(x) = (x/2)^ν gives the scale.
    let top = 2 * ((x + 12.0 * x.cbrt() + 40.0) as usize / 2);
    // Γ(ν + k)/(Γ(ν + 1) k!) for k = 1, 2, …
    let half = top / 2;
    let mut weights = vec![1.0; half + 1];
    for k in 2..=half {
        weights[k] = weights[k - 1] * (order + k as f64 - 1.0) / k as f64;
    }
    let (mut above, mut at, mut sum) = (0.0, 1e-300, 0.0);
    for n in (1..=top).rev() {
        if n % 2 == 0 {
            sum += (order + n as f64) * weights[n / 2] * at;
        }
        let below = 2.0 * (order + n as f64) / x * at - above;
        (above, at) = (at, below);
        if at.abs() > 1e250 {
            (above, at, sum) = (above * 1e-250, at * 1e-250, sum * 1e-250);
        }
    }
    at / (sum + at)
}

/// The zero j_{ν,k}, k = 1, 2, …, of J_ν for ν ≥ −½. NaN for k = 0 and for zeros beyond 10⁴.
pub(super) fn bessel_zero(order: f64, k: usize) -> f64 {
    if k == 0 || order.is_nan() || order < -0.5 {
        return f64::NAN;
    }
    // Neighbouring zeros are at least 2.9 apart, and the first one is beyond ½π.
    let (mut low, mut found) = (0.5, 0);
    let step = 0.5;
    while low < 1e4 {
        let high = low + step;
        if bessel_reduced(order, low) * bessel_reduced(order, high) <= 0.0 {
            found += 1;
            if found == k {
                return root(|x| bessel_reduced(order, x), low, high);
            }
        }
        low = high;
    }
    f64::NAN
}

/// The zeros of Laguerre's polynomial L_n, ascending.
pub(super) fn laguerre_zeros(n: usize) -> Vec<f64> {
    if n == 0 {
        return Vec::new();
    }
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => (2 * i + 1) as f64,
        1 => i.max(j) as f64,
        _ => 0.0,
    };
    let values = DMatrix::from_fn(n, n, entry).symmetric_eigenvalues();
    let mut zeros: Vec<f64> = values.iter().copied().collect();
    zeros.sort_by(f64::total_cmp);
    zeros
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
        assert!(
            (ours - reference).abs() <= error * reference.abs(),
            "{ours} {reference}"
        );
    }

    #[test]
    fn elliptic_integrals_at_known_places() {
        near(complete_k(0.0), FRAC_PI_2, 1e-15);
        near(complete_e(0.0), FRAC_PI_2, 1e-15);
        // Legendre's relation at k = sin 40°.
        let (k, k1) = (40_f64.to_radians().sin(), 40_f64.to_radians().cos());
        let left = complete_e(k) * complete_k(k1) + complete_e(k1) * complete_k(k)
            - complete_k(k) * complete_k(k1);
        near(left, FRAC_PI_2, 2e-15);
        // The period of a pendulum.
        for (degrees, ratio) in [
            (30.0_f64, 1.0174087976),
            (90.0, 1.1803405990),
            (179.0, 3.9010651604),
        ] {
            let k = (0.5 * degrees.to_radians()).sin();
            near(complete_k(k) / FRAC_PI_2, ratio, 1e-10);
        }
        near(elliptic_f(FRAC_PI_2, 0.6), complete_k(0.6), 1e-15);
        near(elliptic_e(FRAC_PI_2, 0.6), complete_e(0.6), 1e-15);
        assert!(complete_k(1.5).is_nan() && elliptic_f(2.0, 0.5).is_nan());
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
            near(elliptic_f(phi, k), first, 1e-12);
            near(elliptic_e(phi, k), second, 1e-12);
        }
    }

    #[test]
    fn bessel_functions_and_zeros() {
        // Order ½ is sin x/x, order −½ cos x.
        for x in [0.01, 1.0, 7.3, 30.0, 200.0] {
            assert!((bessel_reduced(0.5, x) - x.sin() / x).abs() < 1e-14, "{x}");
            assert!((bessel_reduced(-0.5, x) - x.cos()).abs() < 1e-12, "{x}");
        }
        near(bessel_zero(0.5, 5), 5.0 * PI, 1e-14);
        for (k, half) in [(1, 1.2024127788), (2, 2.7600390551), (3, 4.3268639565)] {
            near(0.5 * bessel_zero(0.0, k), half, 1e-10);
        }
        near(2.25 * bessel_zero(-1.0 / 3.0, 1).powi(2), 7.837347439, 1e-9);
        assert!(bessel_zero(0.0, 0).is_nan() && bessel_reduced(0.0, f64::NAN).is_nan());
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
        assert!(laguerre_zeros(0).is_empty());
    }

    #[test]
    fn roots_by_bisection() {
        near(root(f64::cos, 1.0, 2.0), FRAC_PI_2, 1e-15);
        assert!(root(|x| x * x + 1.0, 0.0, 1.0).is_nan());
    }
}
