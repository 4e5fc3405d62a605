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

use super::DT;
use super::table1::{BAR, ROWS, Row, TIME, chain, drop_chain, letter};
use super::words::{extremes, number, table, text};
use crate::checks::each;
use crate::options::pick;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use serde_json::{Value, json};
use signal::{centroid, spectrum};
use taut_model::ChainModel;
use taut_output::check::ExperimentError;

/// Rows of Table I: chain (a), and (e) with the compliance of Figs 3 and 4.
pub(super) const LINKS: Row = ROWS[0];
pub(super) const BENDING: Row = ROWS[6];

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
    let (violation, _) = drop_chain(&params, 0.0, (time, f64::INFINITY), |stepper| {
        let x = &stepper.scene().bodies.position;
        let (d1, d2) = (x[0], x[1] - x[0]);
        samples.push(json!({
            "time_s": stepper.time(),
            "stretch_m": stepper.linearized().phi[0],
            "bend_rad": d1.cross(&d2).dot(&Vector3::y()).atan2(d1.dot(&d2)),
        }));
        Ok(())
    })?;
    Ok((samples, violation < BAR))
}

pub fn values(samples: &[Value], key: &str) -> Vec<f64> {
    samples.iter().map(|s| number(s, key)).collect()
}

/// The paper's run of a chain, and its stretch and its bend in numbers: root of the mean square (m or rad), peak share, R² of the
/// prediction from two samples, centroid of the power spectrum (Hz). Each is the smallest and the largest value over that
/// run and others whose links are longer by micrometres, of which `kept` keep Table I's bar.
fn runs(
    row: Row,
    decade: f64,
    quick: bool,
    progress: &ProgressBar,
) -> Result<(Vec<Value>, [Value; 2]), ExperimentError> {
    let count = pick(quick, [10, 3]);
    let noises: Vec<f64> = (0..count).map(|k| 1e-6 * f64::from(k)).collect();
    let mut runs = each(&noises, progress, |noise| {
        samples(&row, decade, *noise, TIME)
    })?;
    let kept = runs.iter().filter(|(_, kept)| *kept).count();
    let numbers = |signal: &str, key: &str| {
        let signals = runs.iter().map(|(run, _)| values(run, key));
        let signals: Vec<Vec<f64>> = signals.collect();
        let mut found = json!({
            "chain": letter(row.model),
            "bend": (row.model != ChainModel::Links).then_some(row.added),
            "signal": signal,
            "kept": kept,
            "runs": signals.len(),
        });
        let mut add = |name: &str, digits, measure: &dyn Fn(&[f64]) -> f64| {
            let [low, high] = extremes(signals.iter().map(|s| measure(s)));
            found[format!("{name}_low")] = low.into();
            found[format!("{name}_high")] = high.into();
            found[name] = span([low, high], digits).into();
        };
        add("rms", 3, &rms);
        add("peak_share", 2, &peak_share);
        add("predictability", 4, &predictability);
        add("centroid", 2, &|s| centroid(&spectrum(s, DT)));
        found
    };
    let numbers = [numbers("stretch", "stretch_m"), numbers("bend", "bend_rad")];
    Ok((runs.swap_remove(0).0, numbers))
}

/// A range in text, one number where its ends look the same.
fn span(ends: [f64; 2], digits: usize) -> String {
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

fn tables(all: &[Value]) -> String {
    text("chains", &json!({ "rows": table("chains", all) }))
}
