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

mod figures;
mod signal;

pub(super) use figures::{distribution, return_maps, spectra};
pub use signal::{peak_share, predictability, rms};

use super::table1::{BAR, ROWS, Row, TIME, chain, drop_chain, letter, options};
use super::words::{number, table, text, with};
use nalgebra::Vector3;
use rayon::prelude::*;
use serde_json::{Value, json};
use signal::{centroid, spectrum};
use taut_integrator::Stepper;
use taut_model::ChainModel;
use taut_output::check::ExperimentError;

/// Rows of Table I: chain (a), and (e) with the compliance of Figs 3 and 4.
pub(super) const LINKS: Row = ROWS[0];
pub(super) const BENDING: Row = ROWS[6];

/// Time between samples: the paper's step \[s].
const DT: f64 = 1.0 / 60.0;

/// The uppermost link of the chain of `row`, with a load of 10^`decade` particles' masses and links longer by `noise`
/// (m), over `time` (s) or as long as all is finite, whatever the violations: its stretch φ_d and the signed bend angle φ_a at
/// its lower end; and whether they kept Table I's bar.
pub fn samples(
    row: &Row,
    decade: f64,
    noise: f64,
    time: f64,
) -> Result<(Vec<Value>, bool), ExperimentError> {
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

fn sample(stepper: &Stepper) -> Value {
    let x = &stepper.scene().bodies.position;
    let (d1, d2) = (x[0], x[1] - x[0]);
    json!({
        "time_s": stepper.time(),
        "stretch_m": stepper.linearized().phi[0],
        "bend_rad": d1.cross(&d2).dot(&Vector3::y()).atan2(d1.dot(&d2)),
    })
}

/// The values of one key of samples.
pub fn values(samples: &[Value], key: &str) -> Vec<f64> {
    samples.iter().map(|s| number(s, key)).collect()
}

/// The paper's run of a chain, and its stretch and its bend in numbers: root of the mean square (m or rad), peak share, R² of the
/// prediction from two samples, centroid of the power spectrum (Hz). Each is the smallest and the largest value over that
/// run and others whose links are longer by micrometres, of which `kept` keep Table I's bar.
fn runs(row: Row, decade: f64, quick: bool) -> Result<(Vec<Value>, [Value; 2]), ExperimentError> {
    let count = if quick { 3 } else { 10 };
    let mut runs: Vec<_> = (0..count)
        .into_par_iter()
        .map(|k| samples(&row, decade, 1e-6 * f64::from(k), TIME))
        .collect::<Result<_, _>>()?;
    let kept = runs.iter().filter(|(_, kept)| *kept).count();
    let numbers = |signal: &str, key: &str| {
        let signals = runs.iter().map(|(run, _)| values(run, key));
        let signals: Vec<Vec<f64>> = signals.collect();
        let range = |f: &dyn Fn(&[f64]) -> f64| {
            let ends = [f64::INFINITY, f64::NEG_INFINITY];
            let values = signals.iter().map(|s| f(s));
            values.fold(ends, |[low, high], v| [low.min(v), high.max(v)])
        };
        json!({
            "chain": letter(row.model),
            "bend": (row.model != ChainModel::Links).then_some(row.added),
            "signal": signal,
            "rms": range(&rms),
            "peak_share": range(&peak_share),
            "predictability": range(&predictability),
            "centroid": range(&|s| centroid(&spectrum(s, DT))),
            "kept": kept,
            "runs": signals.len(),
        })
    };
    let numbers = [numbers("stretch", "stretch_m"), numbers("bend", "bend_rad")];
    Ok((runs.swap_remove(0).0, numbers))
}

/// The smallest and the largest value of a number over the runs.
fn ends(numbers: &Value, key: &str) -> [f64; 2] {
    [0, 1].map(|i| numbers[key][i].as_f64().unwrap_or(f64::NAN))
}

/// A range in text, one number where its ends look the same.
fn span(numbers: &Value, key: &str, digits: usize) -> String {
    let [low, high] = ends(numbers, key).map(|x| match x != 0.0 && x.abs() < 0.01 {
        true => format!("{x:.digits$e}"),
        false => format!("{x:.digits$}"),
    });
    if low == high {
        low
    } else {
        format!("{low} – {high}")
    }
}

fn tables(all: &[Value]) -> String {
    let row = |s: &Value| {
        let ranges = json!({
            "rms": span(s, "rms", 3),
            "peak_share": span(s, "peak_share", 2),
            "predictability": span(s, "predictability", 4),
            "centroid": span(s, "centroid", 2),
        });
        with(s, &ranges)
    };
    let rows: Vec<Value> = all.iter().map(row).collect();
    text("chains", &json!({ "rows": table("chains", &rows) }))
}
