//! Signals in numbers: root mean square, peak share, predictability, spectrum and its centroid; and histograms.

use nalgebra::{Matrix2, Vector2};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

pub fn rms(signal: &[f64]) -> f64 {
    let squares: f64 = signal.iter().map(|s| s * s).sum();
    (squares / signal.len() as f64).sqrt()
}

/// Share of the samples within 10 % of the largest size.
pub fn peak_share(signal: &[f64]) -> f64 {
    let largest = signal.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
    let near = signal.iter().filter(|s| s.abs() <= 0.1 * largest).count();
    near as f64 / signal.len() as f64
}

/// R² of the least-squares prediction of each sample from the two before it, 0 for a signal too short or without
/// variation.
pub fn predictability(signal: &[f64]) -> f64 {
    let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    let (mut normal, mut right, mut total) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
    for w in signal.windows(3) {
        let from = Vector2::new(w[1] - mean, w[0] - mean);
        normal += from * from.transpose();
        right += from * (w[2] - mean);
        total += (w[2] - mean).powi(2);
    }
    let Some(weights) = normal.try_inverse().map(|inverse| inverse * right) else {
        return 0.0;
    };
    let residual: f64 = signal
        .windows(3)
        .map(|w| (w[2] - mean - weights.x * (w[1] - mean) - weights.y * (w[0] - mean)).powi(2))
        .sum();
    1.0 - residual / total
}

/// Amplitude spectrum of a signal without its mean, sampled every `dt` (s): (frequency in Hz, amplitude).
pub(super) fn spectrum(signal: &[f64], dt: f64) -> Vec<[f64; 2]> {
    let n = signal.len();
    let mean = signal.iter().sum::<f64>() / n.max(1) as f64;
    let mut buffer: Vec<Complex<f64>> =
        signal.iter().map(|s| Complex::new(s - mean, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(n).process(&mut buffer);
    let line =
        |(k, c): (usize, &Complex<f64>)| [k as f64 / (n as f64 * dt), 2.0 * c.norm() / n as f64];
    buffer
        .iter()
        .enumerate()
        .take(n / 2 + 1)
        .skip(1)
        .map(line)
        .collect()
}

/// Mean frequency of a spectrum of amplitudes, weighted by power \[Hz].
pub(super) fn centroid(spectrum: &[[f64; 2]]) -> f64 {
    let weight: f64 = spectrum.iter().map(|[_, a]| a * a).sum();
    spectrum.iter().map(|[f, a]| f * a * a).sum::<f64>() / weight
}

pub(super) fn histogram(signal: &[f64], bins: usize) -> Vec<[f64; 2]> {
    let low = signal.iter().copied().fold(f64::INFINITY, f64::min);
    let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = (high - low) / bins as f64;
    let mut counts = vec![0_usize; bins];
    for s in signal {
        // The largest sample belongs to the last bin.
        counts[(((s - low) / width) as usize).min(bins - 1)] += 1;
    }
    let centre = |(k, n): (usize, &usize)| [low + (k as f64 + 0.5) * width, *n as f64];
    counts.iter().enumerate().map(centre).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::DT;
    use std::f64::consts::{PI, TAU};

    fn wave(f: f64) -> Vec<f64> {
        (0..1800)
            .map(|k| (TAU * f * k as f64 * DT + 0.3).sin())
            .collect()
    }

    #[test]
    fn numbers_of_a_harmonic_oscillation() {
        let signal = wave(0.7);
        assert!((rms(&signal) - 0.5_f64.sqrt()).abs() < 1e-3);
        let share = 2.0 / PI * 0.1_f64.asin();
        assert!((peak_share(&signal) - share).abs() < 2e-3);
        assert!((predictability(&signal) - 1.0).abs() < 1e-9);
        assert!((centroid(&spectrum(&signal, DT)) - 0.7).abs() < 1e-9);
        let lines = spectrum(&signal, DT);
        let largest = lines.iter().max_by(|a, b| a[1].total_cmp(&b[1]));
        let [f, amplitude] = largest.expect("there are lines");
        assert!((f - 0.7).abs() < 1e-12 && (amplitude - 1.0).abs() < 1e-9);
    }

    #[test]
    fn noise_is_not_predictable() {
        let mut random = taut_measure::random::Random::new(5);
        let signal: Vec<f64> = (0..1800).map(|_| random.uniform()).collect();
        assert!(predictability(&signal).abs() < 0.02);
        assert!((peak_share(&signal) - 0.1).abs() < 0.03);
    }

    #[test]
    fn histograms_count_every_sample() {
        let bins = histogram(&[0.0, 0.1, 0.5, 0.9, 1.0], 2);
        assert_eq!(bins, [[0.25, 2.0], [0.75, 3.0]]);
    }
}
