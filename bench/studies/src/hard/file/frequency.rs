//! Frequencies of small oscillations from equally spaced samples.
//!
//! A sum of K undamped oscillations about a mean obeys a symmetric recurrence (Prony): with s_k = x_{n+km} + x_{n−km}
//! and u = 2 cos(ω m Δt), one oscillation has s_1 = u x + c, two have s_2 = p s_1 + q x + c where u² − p u − (q + 2) =
//! 0. The coefficients are fitted by least squares over all samples; the stride m is chosen by the caller so that ω m
//! Δt is about 1 for the fastest of them.

use crate::hard::special::root;
use nalgebra::{DMatrix, DVector};

/// Steps of `interval` (s) over which an oscillation of `frequency` (rad/s) advances by about 1 rad.
pub(in crate::hard) fn stride(frequency: f64, interval: f64) -> usize {
    ((1.0 / (frequency * interval)) as usize).max(1)
}

/// Angular frequency \[rad/s] of one oscillation in `samples`, which are `interval` (s) apart. NaN
/// if no oscillation fits.
pub(in crate::hard) fn single(samples: &[f64], interval: f64, stride: usize) -> f64 {
    let fit = fit(samples, stride, 1);
    fit.map_or(f64::NAN, |c| angle(c[0]) / (interval * stride as f64))
}

/// The two angular frequencies \[rad/s] of two oscillations in `samples`, ascending. NaN if none
/// fit.
pub(in crate::hard) fn pair(samples: &[f64], interval: f64, stride: usize) -> [f64; 2] {
    let Some(c) = fit(samples, stride, 2) else {
        return [f64::NAN; 2];
    };
    let (half, root) = (0.5 * c[0], (0.25 * c[0] * c[0] + c[1] + 2.0).sqrt());
    // The larger cosine is the slower one.
    [half + root, half - root].map(|u| angle(u) / (interval * stride as f64))
}

/// Sign changes of the samples, in intervals from the first one, by the cubic through four
/// neighbours. With `upwards` only rising ones; jumps above `jump` do not count.
pub(in crate::hard) fn passages(samples: &[f64], upwards: bool, jump: f64) -> Vec<f64> {
    let mut found = Vec::new();
    for n in 1..samples.len().saturating_sub(2) {
        let [a, b, c, d] = [n - 1, n, n + 1, n + 2].map(|i| samples[i]);
        let rises = b < 0.0 && c >= 0.0;
        let falls = b > 0.0 && c <= 0.0;
        if !(rises || (falls && !upwards)) || (c - b).abs() > jump {
            continue;
        }
        // Lagrange's cubic on −1, 0, 1, 2, in differences from b on.
        let (first, second) = (c - b, a - 2.0 * b + c);
        let third = d - 3.0 * c + 3.0 * b - a;
        let value =
            |t: f64| b + t * first + t * (t - 1.0) * (0.5 * second + (t + 1.0) * third / 6.0);
        found.push(n as f64 + root(value, 0.0, 1.0));
    }
    found
}

/// θ of u = 2 cos θ.
fn angle(u: f64) -> f64 {
    (0.5 * u).acos()
}

/// Coefficients of s_K on s_{K−1}, …, s_1, x and 1.
fn fit(samples: &[f64], stride: usize, count: usize) -> Option<DVector<f64>> {
    let reach = stride * count;
    let middle = samples
        .len()
        .checked_sub(2 * reach)
        .filter(|n| *n > count)?;
    // A mean much larger than the oscillation would be all but parallel to the constant.
    let rest = samples[0];
    let x = |n: usize| samples[n] - rest;
    let sum = |n: usize, k: usize| x(n + reach + k * stride) + x(n + reach - k * stride);
    let matrix = DMatrix::from_fn(middle, count + 1, |n, column| {
        match count - 1 - column.min(count - 1) {
            _ if column == count => 1.0,
            0 => x(n + reach),
            k => sum(n, k),
        }
    });
    let right = DVector::from_fn(middle, |n, _| sum(n, count));
    matrix.svd(true, true).solve(&right, f64::EPSILON).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passages_of_a_wave() {
        let wave = (0..300).map(|n| (0.05 * f64::from(n) - 0.02).sin());
        let wave: Vec<f64> = wave.collect();
        for (upwards, period) in [(true, std::f64::consts::TAU), (false, std::f64::consts::PI)] {
            let found = passages(&wave, upwards, 1.0);
            // The first one is too close to the start.
            let first = found[0] * 0.05 - 0.02;
            for (k, t) in found.iter().enumerate() {
                let exact = (first + 0.02 + period * k as f64) / 0.05;
                assert!((t - exact).abs() < 1e-5, "{t} {exact}");
            }
            assert!(
                (first / std::f64::consts::PI - (first / std::f64::consts::PI).round()).abs()
                    < 1e-6
            );
        }
    }

    #[test]
    fn frequencies_of_known_sums() {
        let samples = |waves: &[(f64, f64)]| -> Vec<f64> {
            let at = |n: usize| {
                let t = 0.01 * n as f64;
                let of = |(a, w): &(f64, f64)| a * (w * t + 0.3).sin();
                5.0 + waves.iter().map(of).sum::<f64>()
            };
            (0..2000).map(at).collect()
        };
        let one = single(&samples(&[(1e-3, 1.7)]), 0.01, 60);
        assert!((one / 1.7 - 1.0).abs() < 1e-7, "{one}");
        let two = pair(&samples(&[(1e-3, 1.3), (2e-4, 6.5)]), 0.01, 15);
        assert!((two[0] / 1.3 - 1.0).abs() < 1e-7, "{two:?}");
        assert!((two[1] / 6.5 - 1.0).abs() < 1e-7, "{two:?}");
        assert!(single(&[1.0, 2.0], 0.01, 60).is_nan());
    }
}
