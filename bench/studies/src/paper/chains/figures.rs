//! The figures: distributions (Figs 2 and 3), return maps (Fig. 4) and spectra (Fig. 5), with the paper's words on them.

use super::runs::{self, Scalars, text};
use super::signal::{histogram, spectrum};
use super::{BENDING, DT, LINKS, Sample};
use crate::paper::table1::{Row, letter};
use indicatif::ProgressBar;
use serde::Serialize;
use taut_model::ChainModel;
use taut_output::check::{Check, ExperimentError, Outcome, Verdict, csv};
use taut_output::plot::{Axis, Chart, Mark, Series};

/// log₁₀ of the load of Figs 2–4, and of Fig. 5.
const LOAD: f64 = 2.0;
const LOAD_OF_SPECTRA: f64 = 2.176_091_259_055_681;

/// Bending compliances of Fig. 5 \[rad/(N m)].
const COMPLIANCES: [f64; 3] = [0.1, 0.005, 1e-4];

/// A claim that holds or not.
fn says(case: String, printed: &str, ours: String, holds: bool, note: &str) -> Check {
    Check::claim(case, printed, ours, Verdict::of(holds), note)
}

/// Peak share of an even distribution.
const EVEN_SHARE: f64 = 0.1;

const PEAK_NOTE: &str = "peak share: samples below 10 % of the largest; 0.10 for an even distribution, 0.064 for a \
harmonic oscillation; a range is one over perturbed runs";

/// Fig. 2 (links alone) or Fig. 3.
pub(in crate::paper) fn distribution(
    row: Row,
    figure: &str,
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    progress.set_length(1);
    let runs = runs::runs(row, LOAD, quick)?;
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
        let links = runs::runs(LINKS, LOAD, quick)?.scalars();
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

#[derive(Serialize)]
struct SpectralLine {
    added_compliance: f64,
    frequency_hz: f64,
    amplitude_rad: f64,
}

/// Fig. 4.
pub(in crate::paper) fn return_maps(
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    progress.set_length(2);
    let (mut numbers, mut charts, mut checks) = (Vec::new(), Vec::new(), Vec::new());
    let mut points = Vec::new();
    for row in [LINKS, BENDING] {
        let runs = runs::runs(row, LOAD, quick)?;
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
pub(in crate::paper) fn spectra(
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    progress.set_length(COMPLIANCES.len() as u64);
    let (mut numbers, mut series, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    for added in COMPLIANCES {
        let runs = runs::runs(Row { added, ..BENDING }, LOAD_OF_SPECTRA, quick)?;
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
