//! Tables, checks and the chart of Fig. 16.

use super::{Config, DAMPED, GANTRY, OTHERS, Results, STEPS, samples};
use crate::paper::words::{chart, filled, named_check, number, table, text, with, worst};
use serde_json::{Value, json};
use taut_measure::modes::Mode;
use taut_output::check::{Check, Verdict};
use taut_output::plot::Chart;

/// The losses of all runs, the modes that matter, the law on single modes.
pub fn text_tables(results: &Results, config: &Config) -> String {
    let groups = [STEPS, DAMPED, OTHERS, GANTRY].into_iter();
    let runs = groups.flat_map(|group| results.of(group));
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
        "half": config.moments()[0] as f64 * config.dt,
        "runs": table("swing", runs),
        "modes": table("swing-modes", &modes),
        "laws": table("swing-laws", &results.laws),
    });
    text("swing", &with(config, &more))
}

/// The paper's loss explained, and what other steps lose.
pub fn checks(results: &Results, config: &Config) -> Vec<Check> {
    let modes = json!({ "modes": results.laws.len() });
    let mut checks =
        vec![named_check("deformation-mode", modes).off(worst(&results.laws, "error"))];
    let loss = |run: &Value| number(run, "end");
    for run in results.of(OTHERS) {
        let (mut row, predicted) = (run.clone(), number(run, "end_predicted"));
        checks.push(if filled("{run}", &row).starts_with("clamped") {
            named_check("swing-loss", row).off((loss(run) / predicted - 1.0).abs())
        } else {
            let swing = results.modes.first().map_or(0.0, |m| m.total);
            row["bar"] = (swing * config.dt * config.dt).into();
            named_check("swing-free", row).off((loss(run) - predicted).abs())
        });
    }
    let steps = results.of(STEPS);
    let (ours, paper): (Vec<&Value>, Vec<&Value>) =
        steps.partition(|run| run["end_predicted"].is_null());
    if let [small, large] = paper[..] {
        let near = (loss(small) - config.loss).abs() < 0.1 * config.loss;
        let more = json!({
            "ei": results.ei,
            "loss": loss(small),
            "first_half": number(small, "half") / loss(small),
            "small": small["amplitude"],
            "large": large["amplitude"],
            "large_loss": loss(large),
        });
        checks.push(named_check("swing-published", with(config, &more)).so(near));
    }
    let gantry: Vec<&Value> = results.of(GANTRY).collect();
    if let [paper, default] = gantry[..] {
        let near = (loss(paper) - config.loss).abs() < 0.25 * config.loss;
        let row = with(paper, &json!({ "default": loss(default) }));
        checks.push(named_check("gantry-paper", row).so(near));
        checks.push(named_check("gantry-default", default.clone()).off(loss(default).abs()));
    }
    let damped = results.of(DAMPED);
    let damping: String = damped.map(|run| damping(run, results, config)).collect();
    checks.extend(ours.iter().map(|run| kept(run, &damping)));
    checks
}

/// Effect of damping the rows on the trapezoidal step: it takes τ ω_e² of a mode's energy a second.
fn damping(run: &Value, results: &Results, config: &Config) -> String {
    let Some(mode) = results.modes.first().filter(|_| run["lost"].is_null()) else {
        return filled("{run} is lost too", run);
    };
    let rate = 0.5 * config.dt * mode.elastic;
    let bending = 1.0 - (-rate * config.time).exp();
    text("damping", &with(run, &json!({ "bending": bending })))
}

/// Check of the energy under a step without first-order damping.
fn kept(run: &Value, damping: &str) -> Check {
    if run["lost"].is_null() {
        return named_check("swing-kept", run.clone()).off(number(run, "end").abs());
    }
    // Known of the undamped trapezoidal step; of our own step it would be a failure.
    let is_known = filled("{run}", run).starts_with("Spook");
    let verdict = Verdict::either(is_known, [Verdict::Limit, Verdict::Fail]);
    let row = with(run, &json!({ "damping": damping }));
    named_check("swing-lost", row).judged(verdict)
}

/// The energies over time, small and large swing, and those of the gantry.
pub(super) fn charts(results: &Results, config: &Config) -> Vec<Chart> {
    let drawn = |name, group, amplitude: f64| {
        let own = results.of(group);
        let own = own.filter(|run| run["amplitude"] == amplitude);
        let row = json!({ "amplitude": amplitude });
        chart(name, &row, own.flat_map(samples))
    };
    let [small, large] = config.amplitudes;
    vec![
        drawn("swing", STEPS, small),
        drawn("swing", STEPS, large),
        drawn("swing-gantry", GANTRY, large),
    ]
}
