//! Frequencies of small oscillations from equally spaced samples.
//!
//! A sum of K undamped oscillations about a mean obeys a symmetric recurrence (Prony): with s_k = x_{n+km} + x_{n−km} and
//! u = 2 cos(ω m Δt), one oscillation has s_1 = u x + c, two have s_2 = p s_1 + q x + c where u² − p u − (q + 2) = 0. The
//! coefficients are fitted by least squares over all samples; the stride m is chosen by the caller so that ω m Δt is about
//! 1 for the fastest of them.

use nalgebra::{DMatrix, DVector};

/// Angular frequency \[rad/s] of one oscillation in `samples`, which are `interval` (s) apart. NaN where there is none.
#[must_use]
pub fn single(samples: &[f64], interval: f64, stride: usize) -> f64 {
    let fit = fit(samples, stride, 1);
    fit.map_or(f64::NAN, |c| angle(c[0]) / (interval * stride as f64))
}

/// The two angular frequencies \[rad/s] of two oscillations in `samples`, ascending. NaN where there are none.
#[must_use]
pub fn pair(samples: &[f64], interval: f64, stride: usize) -> [f64; 2] {
    let Some(c) = fit(samples, stride, 2) else {
        return [f64::NAN; 2];
    };
    let (half, root) = (0.5 * c[0], (0.25 * c[0] * c[0] + c[1] + 2.0).sqrt());
    // The larger cosine is the slower one.
    [half + root, half - root].map(|u| angle(u) / (interval * stride as f64))
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
    let sum =
        |n: usize, k: usize| samples[n + reach + k * stride] + samples[n + reach - k * stride];
    let matrix = DMatrix::from_fn(middle, count + 1, |n, column| {
        match count - 1 - column.min(count - 1) {
            _ if column == count => 1.0,
            0 => samples[n + reach],
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
