//! Tables, checks and the chart of Fig. 16.

use super::{Config, Results, Run, samples};
use crate::paper::specimens::worst;
use crate::paper::words::{chart, filled, series, table, tell, text, with};
use serde_json::{Value, json};
use taut_ground::modes::Mode;
use taut_ground::trajectory::steps_in;
use taut_output::check::{Check, Verdict};
use taut_output::plot::{Chart, Mark, Series};

/// Samples at half of the time and at its end.
fn moments(config: &Config) -> [usize; 2] {
    let last = steps_in(config.time, config.dt);
    [last / 2, last]
}

/// Losses of a run by half of the time and by its end.
fn row(run: &Run, config: &Config) -> Value {
    let [half, end] = moments(config);
    let lost = run.failure.as_ref().map(|f| format!("{:.2} s", f.time));
    json!({
        "run": run.name,
        "ei": run.ei,
        "amplitude": run.amplitude,
        "half": run.loss(half),
        "half_predicted": run.predicted_loss(half),
        "end": run.loss(end),
        "end_predicted": run.predicted_loss(end),
        "lost": lost,
        "size": if run.amplitude == config.amplitudes[0] { "small" } else { "large" },
    })
}

/// The losses of all runs, the modes that matter, the law on single modes.
pub fn text_tables(results: &Results, config: &Config) -> String {
    let runs = results.runs.iter().chain([&results.damped]);
    let runs = runs.chain(&results.others).chain(&results.gantry);
    let runs: Vec<Value> = runs.map(|run| row(run, config)).collect();
    let all: f64 = results.modes.iter().map(|m| m.energy).sum();
    let mode = |m: &Mode| {
        json!({
            "share": m.energy / all,
            "total": m.total.max(0.0).sqrt(),
            "elastic": m.elastic.max(0.0).sqrt(),
            "kept": 1.0 / (1.0 + m.elastic * config.dt * config.dt),
        })
    };
    let modes: Vec<Value> = results.modes.iter().take(4).map(mode).collect();
    let more = json!({
        "ei": results.ei,
        "bend": results.ei / (config.length / config.segments as f64),
        "half": moments(config)[0] as f64 * config.dt,
        "runs": table("swing", &runs),
        "modes": table("swing-modes", &modes),
        "laws": table("swing-laws", &results.laws),
    });
    text("swing", &with(config, &more))
}

/// The paper's loss explained, and what other steps lose.
pub fn checks(results: &Results, config: &Config) -> Vec<Check> {
    let last = moments(config)[1];
    let modes = json!({ "modes": results.laws.len() });
    let mut checks = vec![tell("deformation-mode", modes).off(worst(&results.laws, "error"))];
    for run in &results.others {
        let (measured, predicted) = (run.loss(last), run.predicted_loss(last));
        let mut row = row(run, config);
        checks.push(if run.name.starts_with("clamped") {
            tell("swing-loss", row).off((measured / predicted - 1.0).abs())
        } else {
            let swing = results.modes.first().map_or(0.0, |m| m.total);
            row["bar"] = (swing * config.dt * config.dt).into();
            tell("swing-free", row).off((measured - predicted).abs())
        });
    }
    let [paper, ours] = [false, true].map(|is_ours| {
        let runs = results.runs.iter();
        let runs = runs.filter(move |r| r.predicted.is_empty() == is_ours);
        runs.collect::<Vec<&Run>>()
    });
    if let [small, large] = paper[..] {
        checks.push(published(config, results, [small, large]));
    }
    let [paper, default] = results.gantry.each_ref();
    let mut on_gantry = row(paper, config);
    on_gantry["default"] = default.loss(last).into();
    let near = (paper.loss(last) - config.loss).abs() < 0.25 * config.loss;
    checks.push(tell("gantry-paper", on_gantry).so(near));
    let said = tell("gantry-default", row(default, config));
    checks.push(said.off(default.loss(last).abs()));
    let damping = damping(results, config);
    checks.extend(ours.iter().map(|run| kept(run, config, &damping)));
    checks
}

/// Effect of damping the rows on the trapezoidal step: it takes τ ω_e² of a mode's energy a second.
fn damping(results: &Results, config: &Config) -> String {
    let mut row = row(&results.damped, config);
    let is_lost = results.damped.failure.is_some();
    let Some(mode) = results.modes.first().filter(|_| !is_lost) else {
        return filled("{run} is lost too", &row);
    };
    let rate = 0.5 * config.dt * mode.elastic;
    row["bending"] = (1.0 - (-rate * config.time).exp()).into();
    text("damping", &row)
}

/// Check of the energy under a step without first-order damping.
fn kept(run: &Run, config: &Config, damping: &str) -> Check {
    let mut row = row(run, config);
    let Some(failure) = &run.failure else {
        return tell("swing-kept", row).off(run.loss(moments(config)[1]).abs());
    };
    row["reason"] = failure.reason.as_str().into();
    row["damping"] = damping.into();
    // Known of the undamped trapezoidal step; of our own step it would be a failure.
    let is_known = run.name.starts_with("Spook");
    let verdict = Verdict::either(is_known, [Verdict::Limit, Verdict::Fail]);
    tell("swing-lost", row).judged(verdict)
}

fn published(config: &Config, results: &Results, [small, large]: [&Run; 2]) -> Check {
    let [half, last] = moments(config);
    let loss = small.loss(last);
    let more = json!({
        "ei": results.ei,
        "loss": loss,
        "first_half": small.loss(half) / loss,
        "small": small.amplitude,
        "large": large.amplitude,
        "large_loss": large.loss(last),
    });
    let near = (loss - config.loss).abs() < 0.1 * config.loss;
    tell("swing-published", with(config, &more)).so(near)
}

/// The energies over time, small and large swing.
pub(super) fn charts(results: &Results, config: &Config) -> Vec<Chart> {
    let lines = |runs: &[&Run], name: &str, y: &str| -> Vec<Series> {
        let rows = runs.iter().map(|run| samples(run, config.dt));
        series(
            &rows.collect::<Vec<_>>().concat(),
            name,
            ["time_s", y],
            Mark::Line,
        )
    };
    let panel = |amplitude: f64| {
        let runs = results.runs.iter().filter(|r| r.amplitude == amplitude);
        let runs: Vec<&Run> = runs.collect();
        let (predicted, _): (Vec<&Run>, Vec<&Run>) =
            runs.iter().partition(|r| !r.predicted.is_empty());
        let mut all = lines(&runs, "{run}", "energy_share");
        all.extend(lines(&predicted, "predicted from modes", "predicted"));
        chart("swing", &json!({ "amplitude": amplitude }), all)
    };
    let gantry = lines(&results.gantry.each_ref(), "{run}", "energy_share");
    let mut charts = config.amplitudes.map(panel).to_vec();
    let row = json!({ "amplitude": config.amplitudes[1] });
    charts.push(chart("swing-gantry", &row, gantry));
    charts
}
