//! Figs 2–5: what regularised bending does to the motion of a chain \[SL §III].
//!
//! Sampled is the uppermost link of the chains of Table I with 100 (Fig. 5: 150) times a particle's mass as load, once a
//! step for 30 s: its stretch φ_d (m) and the signed angle φ_a (rad) at its lower end. Distributions, return maps and
//! spectra are reduced to numbers:
//!
//! - *peak share*: the share of samples within 10 % of the range around zero. A signal that rests there has a large one,
//!   a slow oscillation, which spends most of its time at its turning points, a small one;
//! - *predictability*: R² of the least-squares prediction of s(t + Δt) from s(t) and s(t − Δt). A harmonic motion obeys
//!   s(t + Δt) = 2 cos(ωΔt) s(t) − s(t − Δt) exactly: its return map is an ellipse, R² = 1;
//! - *centroid* of the amplitude spectrum, Σ f |S| / Σ |S|.
//!
//! Near its limit of stability the chain of links alone is chaotic: runs that differ by 10⁻⁹ m at the start differ in
//! every sample and agree in their statistics only, so that its numbers are ranges over several runs.

use super::table1::{ROWS, Row, chain, drop_chain, options};
use super::{Check, Outcome, PaperError, Verdict, csv};
use crate::plot::{Axis, Chart, Mark, Series};
use crate::table;
use indicatif::ProgressBar;
use nalgebra::{Matrix2, Vector2, Vector3};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use serde::Serialize;
use taut_integrator::Stepper;
use taut_model::ChainModel;

/// One sample of the uppermost link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sample {
    /// Time \[s].
    pub time: f64,
    /// Stretch φ_d \[m].
    pub stretch: f64,
    /// Signed bend angle φ_a at the lower end \[rad].
    pub bend: f64,
}

/// The uppermost link of the chain of `row`, with a load of 10^`decade` particles' masses and its particles moved by
/// about `noise` (m) in the plane, over `time` (s).
///
/// # Errors
/// Scenes that are not sound. A run that ends early has fewer samples.
pub fn samples(row: &Row, decade: f64, noise: f64, time: f64) -> Result<Vec<Sample>, PaperError> {
    let mut samples = Vec::new();
    let mut params = chain(row, decade);
    // A slightly longer link is a perturbation of the plane motion.
    params.spacing += noise;
    drop_chain(&params, options(), 0.0, time, |stepper| {
        samples.push(sample(stepper));
    })?;
    Ok(samples)
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

/// Share of the samples within 10 % of the range (largest minus smallest) around zero.
#[must_use]
pub fn peak_share(signal: &[f64]) -> f64 {
    let low = signal.iter().copied().fold(f64::INFINITY, f64::min);
    let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let within = 0.05 * (high - low);
    let near = signal.iter().filter(|s| s.abs() <= within).count();
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

/// Mean frequency of a spectrum, weighted by amplitude \[Hz].
#[must_use]
pub fn centroid(spectrum: &[[f64; 2]]) -> f64 {
    let weight: f64 = spectrum.iter().map(|[_, a]| a).sum();
    spectrum.iter().map(|[f, a]| f * a).sum::<f64>() / weight
}

/// Row of Table I whose chain is (a), and (e) with the compliance of Figs 3 and 4.
const LINKS: Row = ROWS[0];
const BENDING: Row = ROWS[6];

/// log₁₀ of the load of Figs 2–4, and of Fig. 5.
const LOAD: f64 = 2.0;
const LOAD_OF_SPECTRA: f64 = 2.176_091_259_055_681;

/// Bending compliances of Fig. 5 \[rad/(N m)].
const COMPLIANCES: [f64; 3] = [0.1, 0.005, 1e-4];

/// Which chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Model {
    /// (a)
    Links,
    /// (e)
    Bending,
}

/// The numbers of a sampled signal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scalars {
    /// Letter of the model.
    pub model: String,
    /// Bending compliance \[rad/(N m)]; none for (a).
    pub added_compliance: Option<f64>,
    /// `stretch` (m) or `bend` (rad).
    pub signal: String,
    /// Smallest over the runs, then largest: root of the mean square \[m or rad].
    pub rms: [f64; 2],
    /// Peak share.
    pub peak_share: [f64; 2],
    /// R² of the return map.
    pub predictability: [f64; 2],
    /// Centroid of the spectrum \[Hz].
    pub centroid_hz: [f64; 2],
    /// Samples of the shortest run.
    pub samples: usize,
}

/// A flat row of [`Scalars`] for CSV.
#[derive(Serialize)]
struct Line<'a> {
    model: &'a str,
    added_compliance: Option<f64>,
    signal: &'a str,
    rms_min: f64,
    rms_max: f64,
    peak_share_min: f64,
    peak_share_max: f64,
    predictability_min: f64,
    predictability_max: f64,
    centroid_hz_min: f64,
    centroid_hz_max: f64,
}

fn lines(scalars: &[Scalars]) -> Vec<Line<'_>> {
    let line = |s: &'_ Scalars| Line {
        model: "",
        added_compliance: s.added_compliance,
        signal: "",
        rms_min: s.rms[0],
        rms_max: s.rms[1],
        peak_share_min: s.peak_share[0],
        peak_share_max: s.peak_share[1],
        predictability_min: s.predictability[0],
        predictability_max: s.predictability[1],
        centroid_hz_min: s.centroid_hz[0],
        centroid_hz_max: s.centroid_hz[1],
    };
    let named = scalars.iter().map(|s| Line {
        model: &s.model,
        signal: &s.signal,
        ..line(s)
    });
    named.collect()
}

/// Perturbed runs of a chain: that of the paper, and others that differ from it by nanometres.
fn runs(row: &Row, decade: f64, quick: bool) -> Result<Vec<Vec<Sample>>, PaperError> {
    let count = if quick { 3 } else { 10 };
    (0..count)
        .map(|k| samples(row, decade, 1e-9 * f64::from(k), TIME))
        .collect()
}

/// Simulated time \[s].
const TIME: f64 = 30.0;

/// Time between samples: the paper's step \[s].
const DT: f64 = 1.0 / 60.0;

/// Both signals of the runs in numbers: stretch, then bend.
fn scalars(row: &Row, runs: &[Vec<Sample>]) -> [Scalars; 2] {
    let of = |signal: &str, pick: fn(&Sample) -> f64| {
        let signals: Vec<Vec<f64>> = runs.iter().map(|r| r.iter().map(pick).collect()).collect();
        let range = |f: &dyn Fn(&[f64]) -> f64| {
            let values: Vec<f64> = signals.iter().map(|s| f(s)).collect();
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            [
                low,
                values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ]
        };
        let model = row.model.scene_name().trim_start_matches("particles-");
        Scalars {
            model: model.to_owned(),
            added_compliance: (row.model != ChainModel::Links).then_some(row.added),
            signal: signal.to_owned(),
            rms: range(&rms),
            peak_share: range(&peak_share),
            predictability: range(&predictability),
            centroid_hz: range(&|s| centroid(&spectrum(s, DT))),
            samples: signals.iter().map(Vec::len).min().unwrap_or(0),
        }
    };
    [of("stretch", |s| s.stretch), of("bend", |s| s.bend)]
}

fn span([low, high]: [f64; 2], digits: usize) -> String {
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

fn text(all: &[Scalars]) -> String {
    let mut t = table::table(&[
        "chain",
        "ε bend",
        "signal",
        "rms",
        "peak share",
        "predictability R²",
        "centroid Hz",
    ]);
    for s in all {
        t.add_row([
            format!("({})", s.model),
            s.added_compliance
                .map_or_else(String::new, |e| format!("{e}")),
            s.signal.clone(),
            span(s.rms, 3),
            span(s.peak_share, 2),
            span(s.predictability, 4),
            span(s.centroid_hz, 3),
        ]);
    }
    table::text(&t)
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

/// Fig. 2 or 3.
pub(super) fn distribution(
    model: Model,
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, PaperError> {
    progress.set_length(1);
    let (row, figure) = match model {
        Model::Links => (LINKS, "fig2"),
        Model::Bending => (BENDING, "fig3"),
    };
    let runs = runs(&row, LOAD, quick)?;
    let numbers = scalars(&row, &runs);
    progress.inc(1);
    // Reference values of a prototype of the same chain stand in where the paper prints curves without numbers.
    let peaked = numbers.iter().map(|s| (s.peak_share[0], s.peak_share[1]));
    let mut checks = Vec::new();
    for (s, (low, high)) in numbers.iter().zip(peaked) {
        let case = format!("{figure} {}", s.signal);
        let ours = format!("peak share {}", span(s.peak_share, 2));
        let (printed, holds) = match model {
            Model::Links => ("strongest concentration at 0", low > EVEN_SHARE),
            Model::Bending => ("two peaks, away from 0", high < TWO_PEAKS),
        };
        if model == Model::Bending && s.signal == "stretch" {
            // A taut link is stretched on one side of zero only.
            continue;
        }
        let verdict = if holds {
            Verdict::Holds
        } else {
            Verdict::DoesNotHold
        };
        let note = match model {
            Model::Links => {
                "an even distribution has a share of 0.10; chaotic: range over perturbed runs"
            }
            Model::Bending => {
                "an even distribution has a share of 0.10, a harmonic oscillation 0.064"
            }
        };
        checks.push(Check::claim(case, printed, ours, verdict, note));
    }
    let panel = |signal: &str, unit: &str, pick: fn(&Sample) -> f64| {
        let values: Vec<f64> = runs[0].iter().map(pick).collect();
        Chart {
            title: format!(
                "{figure}: {signal} of the uppermost link, ({})",
                numbers[0].model
            ),
            x: Axis::linear(&format!("{signal} ({unit})")),
            y: Axis::linear("samples"),
            series: vec![Series::new("", histogram(&values, 40), Mark::Bars)],
        }
    };
    Ok(Outcome {
        checks,
        text: text(&numbers) + "\n",
        csv: csv(&runs[0])?,
        charts: vec![
            panel("stretch", "m", |s| s.stretch),
            panel("bend", "rad", |s| s.bend),
        ],
    })
}

/// Peak share of an even distribution over a range that is symmetric about zero.
const EVEN_SHARE: f64 = 0.1;

/// Largest peak share of a distribution with two peaks at its ends: a little above that of a harmonic oscillation,
/// (2/π) asin 0.1 = 0.064.
const TWO_PEAKS: f64 = 0.08;

/// Fig. 4.
pub(super) fn return_maps(quick: bool, progress: &ProgressBar) -> Result<Outcome, PaperError> {
    progress.set_length(2);
    let (mut numbers, mut charts, mut checks) = (Vec::new(), Vec::new(), Vec::new());
    let mut all = Vec::new();
    for (row, printed, holds) in [
        (
            LINKS,
            "irregular, nearly uncorrelated",
            (|r: [f64; 2]| r[1] < 0.5) as fn([f64; 2]) -> bool,
        ),
        (BENDING, "an ellipse", |r| r[0] > 0.999),
    ] {
        let runs = runs(&row, LOAD, quick)?;
        let found = scalars(&row, &runs);
        let bend = &found[1];
        let verdict = if holds(bend.predictability) {
            Verdict::Holds
        } else {
            Verdict::DoesNotHold
        };
        let ours = format!("R² {}", span(bend.predictability, 4));
        let note =
            "R² of predicting a sample of the bend angle from the two before it: 1 for an ellipse";
        checks.push(Check::claim(
            format!("fig4 ({})", bend.model),
            printed,
            ours,
            verdict,
            note,
        ));
        let pairs = runs[0].windows(2).map(|w| [w[0].bend, w[1].bend]).collect();
        charts.push(Chart {
            title: format!("fig4: return map of the bend angle, ({})", bend.model),
            x: Axis::linear("bend at t (rad)"),
            y: Axis::linear("bend at t + Δt (rad)"),
            series: vec![Series::new("", pairs, Mark::Points)],
        });
        numbers.extend(found);
        all.extend(runs.into_iter().next().unwrap_or_default());
        progress.inc(1);
    }
    Ok(Outcome {
        checks,
        text: text(&numbers) + "\n",
        csv: csv(&lines(&numbers))?,
        charts,
    })
}

/// Fig. 5.
pub(super) fn spectra(quick: bool, progress: &ProgressBar) -> Result<Outcome, PaperError> {
    progress.set_length(COMPLIANCES.len() as u64);
    let (mut numbers, mut series) = (Vec::new(), Vec::new());
    for added in COMPLIANCES {
        let row = Row { added, ..BENDING };
        let runs = runs(&row, LOAD_OF_SPECTRA, quick)?;
        let bend: Vec<f64> = runs[0].iter().map(|s| s.bend).collect();
        let name = format!("ε = {added} rad/(N m)");
        series.push(Series::new(name, spectrum(&bend, DT), Mark::Line));
        let [_, bend] = scalars(&row, &runs);
        numbers.push(bend);
        progress.inc(1);
    }
    let falls = numbers
        .windows(2)
        .all(|w| w[1].centroid_hz[1] < w[0].centroid_hz[0]);
    let centroids: Vec<String> = numbers.iter().map(|s| span(s.centroid_hz, 3)).collect();
    let verdict = if falls {
        Verdict::Holds
    } else {
        Verdict::DoesNotHold
    };
    let check = Check::claim(
        "fig5",
        "frequencies fall with the bending compliance",
        format!("centroids {} Hz", centroids.join(", ")),
        verdict,
        "ranges over perturbed runs; at the largest compliance the chain is as chaotic as (a)",
    );
    Ok(Outcome {
        checks: vec![check],
        text: text(&numbers) + "\n",
        csv: csv(&lines(&numbers))?,
        charts: vec![Chart {
            title: "fig5: amplitude spectrum of the bend angle, chain (e)".to_owned(),
            x: Axis::linear("frequency (Hz)"),
            y: Axis::log("amplitude (rad)"),
            series,
        }],
    })
}
