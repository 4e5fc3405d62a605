//! Figs 2–5: what regularised bending does to the motion of a chain \[SL §III].
//!
//! Sampled is the uppermost link of the chains of Table I with 100 (Fig. 5: 150) times a particle's mass as load, once a
//! step for 30 s: its stretch φ_d (m) and the signed angle φ_a (rad) at its lower end. Distributions, return maps and
//! spectra are reduced to numbers:
//!
//! - *peak share*: the share of samples below 10 % of the largest. A signal that rests at zero has a large one; an even
//!   distribution has 0.1; a harmonic oscillation, which spends most of its time at its turning points, has
//!   (2/π) asin 0.1 = 0.064;
//! - *predictability*: R² of the least-squares prediction of s(t + Δt) from s(t) and s(t − Δt). A harmonic motion obeys
//!   s(t + Δt) = 2 cos(ωΔt) s(t) − s(t − Δt) exactly: its return map is an ellipse, R² = 1;
//! - *centroid* of the power spectrum, Σ f |S|² / Σ |S|².
//!
//! Near its limit of stability the chain of links alone is chaotic: runs that differ by micrometres at the start
//! differ in every sample and agree in their statistics only, so that its numbers are ranges over several runs.

use super::table1::{BAR, ROWS, Row, chain, drop_chain, letter, options};
use crate::check::{Check, ExperimentError, Outcome, Verdict, csv};
use crate::plot::{Axis, Chart, Mark, Series};
use crate::table;
use indicatif::ProgressBar;
use nalgebra::{Matrix2, Vector2, Vector3};
use rayon::prelude::*;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use serde::Serialize;
use taut_integrator::Stepper;
use taut_model::ChainModel;

/// One sample of the uppermost link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sample {
    /// Time \[s].
    #[serde(rename = "time_s")]
    pub time: f64,
    /// Stretch φ_d \[m].
    #[serde(rename = "stretch_m")]
    pub stretch: f64,
    /// Signed bend angle φ_a at the lower end \[rad].
    #[serde(rename = "bend_rad")]
    pub bend: f64,
}

/// The uppermost link of the chain of `row`, with a load of 10^`decade` particles' masses and links longer by `noise`
/// (m), over `time` (s) or as long as all is finite, whatever the violations; and whether they kept Table I's bar.
///
/// # Errors
/// Scenes that are not sound.
pub fn samples(
    row: &Row,
    decade: f64,
    noise: f64,
    time: f64,
) -> Result<(Vec<Sample>, bool), ExperimentError> {
    let mut samples = Vec::new();
    let mut params = chain(row, decade);
    // Slightly longer links perturb the motion within its plane.
    params.spacing += noise;
    let fate = drop_chain(&params, options(), 0.0, (time, f64::INFINITY), |stepper| {
        samples.push(sample(stepper));
        Ok(())
    })?;
    Ok((samples, fate.violation < BAR))
}

fn sample(stepper: &Stepper) -> Sample {
    let x = &stepper.scene().bodies.position;
    let (d1, d2) = (x[0], x[1] - x[0]);
    Sample {
        time: stepper.time(),
        stretch: stepper.linearized().phi[0],
        bend: d1.cross(&d2).dot(&Vector3::y()).atan2(d1.dot(&d2)),
    }
}

/// Root of the mean square.
#[must_use]
pub fn rms(signal: &[f64]) -> f64 {
    let squares: f64 = signal.iter().map(|s| s * s).sum();
    (squares / signal.len() as f64).sqrt()
}

/// Share of the samples within 10 % of the largest size.
#[must_use]
pub fn peak_share(signal: &[f64]) -> f64 {
    let largest = signal.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
    let near = signal.iter().filter(|s| s.abs() <= 0.1 * largest).count();
    near as f64 / signal.len() as f64
}

/// R² of the least-squares prediction of each sample from the two before it, 0 for a signal too short or without
/// variation.
#[must_use]
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
#[must_use]
pub fn spectrum(signal: &[f64], dt: f64) -> Vec<[f64; 2]> {
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
#[must_use]
pub fn centroid(spectrum: &[[f64; 2]]) -> f64 {
    let weight: f64 = spectrum.iter().map(|[_, a]| a * a).sum();
    spectrum.iter().map(|[f, a]| f * a * a).sum::<f64>() / weight
}

/// Rows of Table I: chain (a), and (e) with the compliance of Figs 3 and 4.
pub(super) const LINKS: Row = ROWS[0];
pub(super) const BENDING: Row = ROWS[6];

/// log₁₀ of the load of Figs 2–4, and of Fig. 5.
const LOAD: f64 = 2.0;
const LOAD_OF_SPECTRA: f64 = 2.176_091_259_055_681;

/// Bending compliances of Fig. 5 \[rad/(N m)].
const COMPLIANCES: [f64; 3] = [0.1, 0.005, 1e-4];

/// The numbers of a sampled signal: smallest and largest over perturbed runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scalars {
    /// Letter of the model.
    pub model: String,
    /// Bending compliance \[rad/(N m)]; none for (a).
    pub added_compliance: Option<f64>,
    /// `stretch` (m) or `bend` (rad).
    pub signal: String,
    /// Root of the mean square, smallest \[m or rad].
    pub rms_min: f64,
    /// Largest.
    pub rms_max: f64,
    /// Peak share, smallest.
    pub peak_share_min: f64,
    /// Largest.
    pub peak_share_max: f64,
    /// R² of the prediction from two samples, smallest.
    pub predictability_min: f64,
    /// Largest.
    pub predictability_max: f64,
    /// Centroid of the power spectrum, smallest \[Hz].
    pub centroid_min_hz: f64,
    /// Largest.
    pub centroid_max_hz: f64,
    /// Runs.
    pub runs: usize,
    /// How many of them kept the bar of Table I.
    pub kept: usize,
}

/// Perturbed runs of a chain: that of the paper, and others whose links are longer by micrometres.
struct Runs {
    row: Row,
    samples: Vec<Vec<Sample>>,
    /// How many of them kept Table I's bar.
    kept: usize,
}

/// Simulated time \[s].
const TIME: f64 = 30.0;

/// Time between samples: the paper's step \[s].
const DT: f64 = 1.0 / 60.0;

fn runs(row: Row, decade: f64, quick: bool) -> Result<Runs, ExperimentError> {
    let count = if quick { 3 } else { 10 };
    let runs: Vec<_> = (0..count)
        .into_par_iter()
        .map(|k| samples(&row, decade, 1e-6 * f64::from(k), TIME))
        .collect::<Result<_, _>>()?;
    let kept = runs.iter().filter(|(_, kept)| *kept).count();
    let samples = runs.into_iter().map(|(samples, _)| samples).collect();
    Ok(Runs { row, samples, kept })
}

impl Runs {
    /// Both signals in numbers: stretch, then bend.
    fn scalars(&self) -> [Scalars; 2] {
        [
            self.scalars_of("stretch", |s| s.stretch),
            self.scalars_of("bend", |s| s.bend),
        ]
    }

    fn scalars_of(&self, signal: &str, pick: fn(&Sample) -> f64) -> Scalars {
        let pick = |run: &Vec<Sample>| -> Vec<f64> { run.iter().map(pick).collect() };
        let signals: Vec<Vec<f64>> = self.samples.iter().map(pick).collect();
        let range = |f: &dyn Fn(&[f64]) -> f64| {
            let values = signals.iter().map(|s| f(s));
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            values.fold(ends, |(low, high), v| (low.min(v), high.max(v)))
        };
        let (rms_min, rms_max) = range(&rms);
        let (peak_share_min, peak_share_max) = range(&peak_share);
        let (predictability_min, predictability_max) = range(&predictability);
        let (centroid_min_hz, centroid_max_hz) = range(&|s| centroid(&spectrum(s, DT)));
        Scalars {
            model: letter(self.row.model).to_owned(),
            added_compliance: (self.row.model != ChainModel::Links).then_some(self.row.added),
            signal: signal.to_owned(),
            rms_min,
            rms_max,
            peak_share_min,
            peak_share_max,
            predictability_min,
            predictability_max,
            centroid_min_hz,
            centroid_max_hz,
            runs: signals.len(),
            kept: self.kept,
        }
    }
}

/// A range in text, one number where its ends look the same.
fn span(low: f64, high: f64, digits: usize) -> String {
    let number = |x: f64| {
        if x != 0.0 && x.abs() < 0.01 {
            format!("{x:.digits$e}")
        } else {
            format!("{x:.digits$}")
        }
    };
    let (low, high) = (number(low), number(high));
    if low == high {
        low
    } else {
        format!("{low} – {high}")
    }
}

impl Scalars {
    fn peaks(&self) -> String {
        span(self.peak_share_min, self.peak_share_max, 2)
    }

    fn order(&self) -> String {
        span(self.predictability_min, self.predictability_max, 4)
    }

    fn centroids(&self) -> String {
        span(self.centroid_min_hz, self.centroid_max_hz, 2)
    }
}

fn text(all: &[Scalars]) -> String {
    let mut t = table::table(&[
        "chain",
        "ε bend",
        "signal",
        "rms",
        "peak share",
        "R²",
        "centroid Hz",
        "within 0.2 d",
    ]);
    for s in all {
        t.add_row([
            format!("({})", s.model),
            s.added_compliance
                .map_or_else(String::new, |e| format!("{e}")),
            s.signal.clone(),
            span(s.rms_min, s.rms_max, 3),
            s.peaks(),
            s.order(),
            s.centroids(),
            format!("{} of {}", s.kept, s.runs),
        ]);
    }
    format!(
        "rms in m or rad; R²: prediction of a sample from the two before it; within 0.2 d: runs that keep Table I's bar\n{}\n",
        table::text(&t)
    )
}

fn histogram(signal: &[f64], bins: usize) -> Vec<[f64; 2]> {
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

/// A claim that holds or not.
fn says(case: String, printed: &str, ours: String, holds: bool, note: &str) -> Check {
    let verdict = Verdict::of(holds);
    Check::claim(case, printed, ours, verdict, note)
}

/// Peak share of an even distribution.
const EVEN_SHARE: f64 = 0.1;

const PEAK_NOTE: &str = "peak share: samples below 10 % of the largest; 0.10 for an even distribution, 0.064 for a \
harmonic oscillation; a range is one over perturbed runs";

/// Fig. 2 (links alone) or Fig. 3.
pub(super) fn distribution(
    row: Row,
    figure: &str,
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    progress.set_length(1);
    let runs = runs(row, LOAD, quick)?;
    let numbers = runs.scalars();
    progress.inc(1);
    let [stretch, bend] = &numbers;
    let case = |s: &Scalars| format!("{figure} {}", s.signal);
    let checks = if row.model == ChainModel::Links {
        let peaked = |s: &Scalars| {
            let holds = s.peak_share_min > 2.0 * EVEN_SHARE;
            let ours = format!("peak share {}", s.peaks());
            says(
                case(s),
                "strongest concentration at 0",
                ours,
                holds,
                PEAK_NOTE,
            )
        };
        vec![peaked(stretch), peaked(bend)]
    } else {
        let holds = bend.peak_share_max < EVEN_SHARE;
        let ours = format!("peak share {}", bend.peaks());
        let two = says(
            case(bend),
            "two-valued: more time bent than straight",
            ours,
            holds,
            PEAK_NOTE,
        );
        // The link chain with the same load, for the sizes.
        let links = self::runs(LINKS, LOAD, quick)?.scalars();
        let smaller = |ours: &Scalars, links: &Scalars| links.rms_min / ours.rms_max;
        let factors = [smaller(stretch, &links[0]), smaller(bend, &links[1])];
        let sizes = says(
            format!("{figure} size"),
            "large decrease of the bend, minor one of the stretch",
            format!(
                "bend {:.0} times less, stretch {:.1}",
                factors[1], factors[0]
            ),
            factors[1] > 10.0 && factors[0] < factors[1] / 10.0,
            "root of the mean square of (a) over that of (e)",
        );
        vec![two, sizes]
    };
    let panel = |signal: &str, unit: &str, pick: fn(&Sample) -> f64| {
        let values: Vec<f64> = runs.samples[0].iter().map(pick).collect();
        Chart {
            title: format!(
                "{signal} of the uppermost link, chain ({})",
                letter(row.model)
            ),
            x: Axis::linear(&format!("{signal} ({unit})")),
            y: Axis::linear("samples"),
            series: vec![Series::new("", histogram(&values, 40), Mark::Bars)],
        }
    };
    Ok(Outcome {
        checks,
        text: text(&numbers),
        csv: csv(&runs.samples[0])?,
        charts: vec![
            panel("stretch", "m", |s| s.stretch),
            panel("bend", "rad", |s| s.bend),
        ],
        ..Outcome::default()
    })
}

/// A point of a return map.
#[derive(Serialize)]
struct Return {
    model: &'static str,
    time_s: f64,
    stretch_m: f64,
    next_stretch_m: f64,
}

/// A line of a spectrum.
#[derive(Serialize)]
struct SpectralLine {
    added_compliance: f64,
    frequency_hz: f64,
    amplitude_rad: f64,
}

/// Fig. 4.
pub(super) fn return_maps(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    progress.set_length(2);
    let (mut numbers, mut charts, mut checks) = (Vec::new(), Vec::new(), Vec::new());
    let mut points = Vec::new();
    for row in [LINKS, BENDING] {
        let runs = runs(row, LOAD, quick)?;
        let found = runs.scalars();
        let stretch = &found[0];
        let (printed, holds) = if row.model == ChainModel::Links {
            let holds = stretch.predictability_max < 0.5;
            ("irregular, nearly uncorrelated", holds)
        } else {
            ("an ellipse", stretch.predictability_min > 0.999)
        };
        let case = format!("fig4 ({})", letter(row.model));
        let ours = format!("R² {}", stretch.order());
        let note = "R² of predicting the stretch from the two samples before it: 1 for an ellipse";
        checks.push(says(case, printed, ours, holds, note));
        let pairs = runs.samples[0].windows(2);
        points.extend(pairs.clone().map(|w| Return {
            model: letter(row.model),
            time_s: w[0].time,
            stretch_m: w[0].stretch,
            next_stretch_m: w[1].stretch,
        }));
        charts.push(Chart {
            title: format!("return map of the stretch, chain ({})", letter(row.model)),
            x: Axis::linear("stretch at t (m)"),
            y: Axis::linear("stretch at t + Δt (m)"),
            series: vec![Series::new(
                "",
                pairs.map(|w| [w[0].stretch, w[1].stretch]).collect(),
                Mark::Points,
            )],
        });
        numbers.extend(found);
        progress.inc(1);
    }
    Ok(Outcome {
        checks,
        text: text(&numbers),
        csv: csv(&points)?,
        charts,
        ..Outcome::default()
    })
}

/// Fig. 5.
pub(super) fn spectra(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    progress.set_length(COMPLIANCES.len() as u64);
    let (mut numbers, mut series, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    for added in COMPLIANCES {
        let runs = runs(Row { added, ..BENDING }, LOAD_OF_SPECTRA, quick)?;
        let bend: Vec<f64> = runs.samples[0].iter().map(|s| s.bend).collect();
        let name = format!("ε = {added} rad/(N m)");
        let spectrum = spectrum(&bend, DT);
        lines.extend(
            spectrum
                .iter()
                .map(|&[frequency_hz, amplitude_rad]| SpectralLine {
                    added_compliance: added,
                    frequency_hz,
                    amplitude_rad,
                }),
        );
        series.push(Series::new(name, spectrum, Mark::Line));
        let [_, bend] = runs.scalars();
        numbers.push(bend);
        progress.inc(1);
    }
    let fall = |w: &[Scalars]| w[1].centroid_max_hz < w[0].centroid_min_hz;
    let centroids: Vec<String> = numbers.iter().map(Scalars::centroids).collect();
    let lower = says(
        "fig5".to_owned(),
        "lower frequencies with less compliance",
        format!("centroids {} Hz", centroids.join(", ")),
        numbers.windows(2).all(fall),
        "ranges over perturbed runs, which are chaotic at the largest compliance",
    );
    let kept = numbers.iter().map(|s| s.kept).min().unwrap_or(0);
    let count = numbers.iter().map(|s| s.runs).min().unwrap_or(0);
    let stable = says(
        "fig5 stability".to_owned(),
        "stable at mass ratio 150",
        format!("{kept} of {count} runs at the largest compliance"),
        kept == count,
        "stable by the criterion of Table I; links alone are lost at 10^2.1 there",
    );
    Ok(Outcome {
        checks: vec![lower, stable],
        text: text(&numbers),
        csv: csv(&lines)?,
        charts: vec![Chart {
            title: "amplitude spectrum of the bend angle, chain (e)".to_owned(),
            x: Axis::linear("frequency (Hz)"),
            y: Axis::log("amplitude (rad)"),
            series,
        }],
        ..Outcome::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
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
        let mut random = crate::random::Random::new(5);
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
