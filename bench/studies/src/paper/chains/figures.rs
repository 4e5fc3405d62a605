//! The figures: distributions (Figs 2 and 3), return maps (Fig. 4) and spectra (Fig. 5), with the paper's words on them.

use super::signal::{histogram, spectrum};
use super::{BENDING, LINKS, runs, tables, values};
use crate::paper::DT;
use crate::paper::table1::{Row, letter};
use crate::paper::words::{self, chart, filled, named_check, number, with};
use indicatif::ProgressBar;
use serde_json::{Value, json};
use taut_model::ChainModel;
use taut_output::check::{ExperimentError, Outcome};

/// log₁₀ of the load of Figs 2–4, and of Fig. 5.
const LOAD: f64 = 2.0;
const LOAD_OF_SPECTRA: f64 = 2.176_091_259_055_681;

/// Bending compliances of Fig. 5 \[rad/(N m)].
const COMPLIANCES: [f64; 3] = [0.1, 0.005, 1e-4];

/// Peak share of an even distribution.
const EVEN_SHARE: f64 = 0.1;

/// Fig. 2 (links alone) or Fig. 3.
pub(in crate::paper) fn distribution(
    row: Row,
    figure: &str,
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    let (samples, numbers) = runs(row, LOAD, quick, progress)?;
    let said = |name, s: &Value| named_check(name, with(s, &json!({ "figure": figure })));
    let checks = if row.model == ChainModel::Links {
        let peaked =
            |s: &Value| said("peaked", s).so(number(s, "peak_share_low") > 2.0 * EVEN_SHARE);
        numbers.each_ref().map(peaked)
    } else {
        // The link chain with the same load, for the sizes.
        let (_, links) = runs(LINKS, LOAD, quick, progress)?;
        let [stretch, bent] =
            [0, 1].map(|i| number(&links[i], "rms_low") / number(&numbers[i], "rms_high"));
        let bend = &numbers[1];
        let sizes = json!({ "figure": figure, "bend": bent, "stretch": stretch });
        [
            said("two-valued", bend).so(number(bend, "peak_share_high") < EVEN_SHARE),
            named_check("chain-sizes", sizes).so(bent > 10.0 && stretch < bent / 10.0),
        ]
    };
    let panel = |signal: &str, unit: &str| {
        let values = values(&samples, &format!("{signal}_{unit}"));
        let bar = |[value, count]: [f64; 2]| json!({ "value": value, "count": count });
        let bars: Vec<Value> = histogram(&values, 40).into_iter().map(bar).collect();
        let row = json!({ "signal": signal, "unit": unit, "chain": letter(row.model) });
        chart("distribution", &row, &bars)
    };
    let charts = vec![panel("stretch", "m"), panel("bend", "rad")];
    words::outcome(checks.to_vec(), tables(&numbers), &samples, charts)
}

pub(in crate::paper) fn return_maps(
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    let (mut numbers, mut charts, mut checks) = (Vec::new(), Vec::new(), Vec::new());
    let mut points = Vec::new();
    for row in [LINKS, BENDING] {
        let (samples, found) = runs(row, LOAD, quick, progress)?;
        let model = letter(row.model);
        let order = |end: &str| number(&found[0], &format!("predictability_{end}"));
        let (name, holds) = match row.model {
            ChainModel::Links => ("irregular", order("high") < 0.5),
            _ => ("ellipse", order("low") > 0.999),
        };
        let said = json!({ "chain": model, "order": found[0]["predictability"] });
        checks.push(named_check(name, said.clone()).so(holds));
        let pairs = samples.windows(2);
        let own = pairs.map(|w| {
            json!({
                "model": model,
                "time_s": w[0]["time_s"],
                "stretch_m": w[0]["stretch_m"],
                "next_stretch_m": w[1]["stretch_m"],
            })
        });
        let own: Vec<Value> = own.collect();
        charts.push(chart("return-map", &said, &own));
        points.extend(own);
        numbers.extend(found);
    }
    words::outcome(checks, tables(&numbers), &points, charts)
}

pub(in crate::paper) fn spectra(
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    let (mut numbers, mut lines) = (Vec::new(), Vec::new());
    for added in COMPLIANCES {
        let row = Row { added, ..BENDING };
        let (samples, [_, found]) = runs(row, LOAD_OF_SPECTRA, quick, progress)?;
        let bend = values(&samples, "bend_rad");
        let line = |[frequency, amplitude]: [f64; 2]| {
            json!({
                "added_compliance": added,
                "frequency_hz": frequency,
                "amplitude_rad": amplitude,
            })
        };
        lines.extend(spectrum(&bend, DT).into_iter().map(line));
        numbers.push(found);
    }
    let falls = |w: &[Value]| number(&w[1], "centroid_high") < number(&w[0], "centroid_low");
    let centroids = numbers.iter().map(|s| filled("{centroid}", s));
    let centroids: Vec<String> = centroids.collect();
    let least = |key: &str| numbers.iter().filter_map(|s| s[key].as_u64()).min();
    let [kept, count] = ["kept", "runs"].map(|key| least(key).unwrap_or(0));
    let row = json!({ "centroids": centroids.join(", "), "kept": kept, "count": count });
    let checks = vec![
        named_check("spectra", row.clone()).so(numbers.windows(2).all(falls)),
        named_check("spectra-stability", row).so(kept == count),
    ];
    let charts = vec![chart("spectra", &Value::Null, &lines)];
    words::outcome(checks, tables(&numbers), &lines, charts)
}
