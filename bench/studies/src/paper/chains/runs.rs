//! Perturbed runs of a chain, and the ranges of their numbers.

use super::signal::{centroid, peak_share, predictability, rms, spectrum};
use super::{DT, Sample, samples};
use crate::paper::table1::{Row, TIME, letter};
use crate::paper::words::{table, text};
use rayon::prelude::*;
use serde_json::{Value, json};
use taut_model::ChainModel;
use taut_output::check::ExperimentError;

/// A number of a signal: its smallest and its largest value over perturbed runs.
pub(super) type Range = [f64; 2];

/// The numbers of a sampled signal.
pub(super) struct Scalars {
    row: Row,
    /// `stretch` (m) or `bend` (rad).
    pub(super) signal: &'static str,
    /// Root of the mean square \[m or rad].
    pub(super) rms: Range,
    pub(super) peak_share: Range,
    /// R² of the prediction from two samples.
    pub(super) predictability: Range,
    /// Centroid of the power spectrum \[Hz].
    pub(super) centroid: Range,
    pub(super) runs: usize,
    /// How many of them kept the bar of Table I.
    pub(super) kept: usize,
}

/// Perturbed runs of a chain: that of the paper, and others whose links are longer by micrometres.
pub(super) struct Runs {
    row: Row,
    pub(super) samples: Vec<Vec<Sample>>,
    /// How many of them kept Table I's bar.
    kept: usize,
}

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

    fn scalars_of(&self, signal: &'static str, pick: fn(&Sample) -> f64) -> Scalars {
        let pick = |run: &Vec<Sample>| -> Vec<f64> { run.iter().map(pick).collect() };
        let signals: Vec<Vec<f64>> = self.samples.iter().map(pick).collect();
        let range = |f: &dyn Fn(&[f64]) -> f64| {
            let ends = [f64::INFINITY, f64::NEG_INFINITY];
            let values = signals.iter().map(|s| f(s));
            values.fold(ends, |[low, high], v| [low.min(v), high.max(v)])
        };
        Scalars {
            row: self.row,
            signal,
            rms: range(&rms),
            peak_share: range(&peak_share),
            predictability: range(&predictability),
            centroid: range(&|s| centroid(&spectrum(s, DT))),
            runs: signals.len(),
            kept: self.kept,
        }
    }
}

/// A range in text, one number where its ends look the same.
pub(super) fn span(ends: Range, digits: usize) -> String {
    let [low, high] = ends.map(|x| match x != 0.0 && x.abs() < 0.01 {
        true => format!("{x:.digits$e}"),
        false => format!("{x:.digits$}"),
    });
    if low == high {
        low
    } else {
        format!("{low} – {high}")
    }
}

pub(super) fn tables(all: &[Scalars]) -> String {
    let row = |s: &Scalars| {
        json!({
            "chain": letter(s.row.model),
            "bend": (s.row.model != ChainModel::Links).then_some(s.row.added),
            "signal": s.signal,
            "rms": span(s.rms, 3),
            "peaks": span(s.peak_share, 2),
            "order": span(s.predictability, 4),
            "centroid": span(s.centroid, 2),
            "kept": s.kept,
            "runs": s.runs,
        })
    };
    let rows: Vec<Value> = all.iter().map(row).collect();
    text("chains", &json!({ "rows": table("chains", &rows) }))
}
