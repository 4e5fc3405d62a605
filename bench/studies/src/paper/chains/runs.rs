//! Perturbed runs of a chain, and the ranges of their numbers.

use super::signal::{centroid, peak_share, predictability, rms, spectrum};
use super::{DT, Sample, samples};
use crate::paper::table1::{Row, letter};
use rayon::prelude::*;
use serde::Serialize;
use taut_model::ChainModel;
use taut_output::check::ExperimentError;
use taut_output::table;

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
    pub runs: usize,
    /// How many of them kept the bar of Table I.
    pub kept: usize,
}

/// Perturbed runs of a chain: that of the paper, and others whose links are longer by micrometres.
pub(super) struct Runs {
    row: Row,
    pub(super) samples: Vec<Vec<Sample>>,
    /// How many of them kept Table I's bar.
    kept: usize,
}

/// Simulated time \[s].
const TIME: f64 = 30.0;

pub(super) fn runs(row: Row, decade: f64, quick: bool) -> Result<Runs, ExperimentError> {
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
    pub(super) fn scalars(&self) -> [Scalars; 2] {
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
    pub(super) fn peaks(&self) -> String {
        span(self.peak_share_min, self.peak_share_max, 2)
    }

    pub(super) fn order(&self) -> String {
        span(self.predictability_min, self.predictability_max, 4)
    }

    pub(super) fn centroids(&self) -> String {
        span(self.centroid_min_hz, self.centroid_max_hz, 2)
    }
}

pub(super) fn text(all: &[Scalars]) -> String {
    let t = table::of_records(
        all,
        &[
            ("chain", &|s| format!("({})", s.model)),
            ("ε bend", &|s| {
                s.added_compliance
                    .map_or_else(String::new, |e| format!("{e}"))
            }),
            ("signal", &|s| s.signal.clone()),
            ("rms", &|s| span(s.rms_min, s.rms_max, 3)),
            ("peak share", &|s| s.peaks()),
            ("R²", &|s| s.order()),
            ("centroid Hz", &|s| s.centroids()),
            ("within 0.2 d", &|s| format!("{} of {}", s.kept, s.runs)),
        ],
    );
    format!(
        "rms in m or rad; R²: prediction of a sample from the two before it; within 0.2 d: runs that keep Table I's bar\n{t}\n"
    )
}
