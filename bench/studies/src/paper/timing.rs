//! Fig. 13: what a step costs over the number of elements \[SL §VII-C].
//!
//! The paper's solver, Gauss–Seidel over the groups with three iterations, and a banded factorisation beside it, on the
//! hoist under a load of a hundred segments, one run after the other. The phases of a step are those of the figure:
//! building the blocks (Jacobians, matrix, right-hand side), factorising the groups, iterating; their sum is the figure's
//! constraint force, and the update of the bodies is left out of it, as there.
//!
//! Over the elements N the total is fitted by a line and by a power,
//!
//! ```text
//! t = a + b N   (weights 1/t: the same relative error everywhere),      t = c N^p
//! ```
//!
//! from the least times, since other work on the machine only adds time; the cells take turns ([`turns`]).

use super::words::{self, chart, extremes, named_check, number, table, text, with};
use crate::fit::{exponent, relative_line};
use crate::options::pick;
use crate::systems::turns::{self, Time, Work};
use indicatif::ProgressBar;
use serde_json::{Value, json};
use std::time::Duration;
use taut_integrator::{Phase, StepError, StepOptions, Stepper};
use taut_model::HoistParams;
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_output::plot::Chart;
use taut_output::table::{nanoseconds, ratio};
use taut_solver::{Backend, ParseBackendError};

/// Mass ratio load/element at which the elements are timed.
const RATIO: f64 = 100.0;

/// Sweeps of the paper's solver; the second for the comparison at a mass ratio of 10⁵.
const FEW: usize = 3;
const MANY: usize = 20;

/// Other mass ratios, and the number of elements for these.
const RATIOS: [f64; 3] = [10.0, 1e3, 1e5];
const LOADED: usize = 100;

/// Elements, mass ratio, and sweeps or 0 for the direct solver.
type Cell = (usize, f64, usize);

/// Steps of a cell, each from the hanging cable: what one costs does not depend on whether a motion with this solver would
/// last. Told apart are the whole, building the blocks, and their factors.
fn work<'a>((elements, ratio, sweeps): Cell, backend: Backend) -> Result<Work<'a>, StepError> {
    let options = StepOptions {
        refinements: usize::from(sweeps == 0),
        backend,
        ..StepOptions::paper()
    };
    let params = HoistParams {
        segments: elements,
        mass_ratio: ratio,
        ..HoistParams::default()
    };
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    let start = stepper.scene().bodies.clone();
    let mut step = move || {
        stepper.set_state(&start, 0.0)?;
        let times = stepper.step()?.phases;
        let building = times.of(Phase::Linearize) + times.of(Phase::Assemble);
        let factors = times.of(Phase::Factorize);
        let iterations = times.of(Phase::Solve) + times.of(Phase::Refine);
        Ok([building + factors + iterations, building, factors])
    };
    Ok(Box::new(move |passes| turns::sum(passes, &mut step)))
}

/// Times of a step \[ns]: medians, those of the iterations as what is left, and the least of the whole. Samples are of one
/// step or of several short ones.
fn record((elements, ratio, sweeps): Cell, [total, building, factors]: [Time; 3]) -> Value {
    json!({
        "solver": solver(sweeps),
        "sweeps": sweeps,
        "elements": elements,
        "ratio": ratio,
        "steps": total.samples,
        "building_ns": building.median,
        "factorisation_ns": factors.median,
        "iterations_ns": total.median - building.median - factors.median,
        "total_ns": total.median,
        "least_ns": total.least,
    })
}

fn solver(sweeps: usize) -> String {
    match sweeps {
        0 => "direct".to_owned(),
        n => format!("{n} iterations"),
    }
}

/// Times all cells, which take turns.
pub fn run(quick: bool, progress: &ProgressBar) -> Result<Vec<Value>, ExperimentError> {
    let all = vec![10, 30, 100, 300, 1000, 3000, 10_000];
    let elements = pick(quick, [all, vec![30, 100, 300, 1000]]);
    let mut cells: Vec<Cell> = Vec::new();
    for sweeps in [FEW, 0] {
        cells.extend(elements.iter().map(|&n| (n, RATIO, sweeps)));
        cells.extend(RATIOS.map(|ratio| (LOADED, ratio, sweeps)));
    }
    cells.push((PAPER_MANY.0, PAPER_MANY.1, MANY));
    progress.set_length(1);
    // Of the steps of a cell.
    let share = Duration::from_secs_f64(pick(quick, [0.32, 0.08]));
    // The solver of the paper's Algorithm 1, or the direct one.
    let backends = cells.iter().map(|(_, _, sweeps)| match sweeps {
        0 => Ok(Backend::Banded),
        n => format!("gauss-seidel:groups:trial:iterations={n}").parse(),
    });
    let backends: Vec<Backend> = backends.collect::<Result<_, ParseBackendError>>()?;
    let works = cells.iter().zip(backends);
    let times = turns::times(works.map(|(&cell, backend)| work(cell, backend)), share);
    progress.inc(1);
    let cells = cells.into_iter().zip(times);
    cells
        .map(|(cell, times)| Ok(record(cell, times?)))
        .collect()
}

/// Elements and mass ratio at which the paper needs 20 iterations in its 0.01 s.
const PAPER_MANY: (usize, f64) = (50, 1e5);

/// Cells of a solver at the figure's mass ratio.
fn cells(records: &[Value], sweeps: usize) -> impl DoubleEndedIterator<Item = &Value> {
    let at = move |r: &&Value| r["sweeps"] == sweeps && r["ratio"] == RATIO;
    records.iter().filter(at)
}

/// Least times of a step over the elements at the figure's mass ratio.
fn least(records: &[Value], sweeps: usize) -> Vec<[f64; 2]> {
    let point = |r| ["elements", "least_ns"].map(|key| number(r, key));
    cells(records, sweeps).map(point).collect()
}

/// Exponent of the least times over the elements.
pub fn growth(records: &[Value], sweeps: usize) -> f64 {
    exponent(&least(records, sweeps))
}

/// The paper's time for the cable in a step \[ns], and the elements that fit into it there, on a Pentium M, 1.7 GHz.
const PAPER_NS: f64 = 1e7;
const PAPER_ELEMENTS: f64 = 100.0;

/// The times, and the fits below them.
pub fn text_tables(records: &[Value]) -> String {
    let per_element = |r: &Value| Some(r["total_ns"].as_f64()? / r["elements"].as_f64()?);
    let share = |r: &Value| with(r, &json!({ "element_ns": per_element(r) }));
    let rows: Vec<Value> = records.iter().map(share).collect();
    let mut row = json!({ "times": table("timing", &rows) });
    for (name, sweeps) in [("iterative", FEW), ("direct", 0)] {
        let [a, b] = relative_line(&least(records, sweeps));
        let sign = if a < 0.0 { "−" } else { "" };
        let line = format!("{sign}{} + {} N", nanoseconds(a.abs()), nanoseconds(b));
        let power = growth(records, sweeps);
        row[name] = format!("{name}: t = {line}, t ∝ N^{power:.3}").into();
    }
    text("timing", &row)
}

/// Linearity in the elements and independence of the load, by these names, over the least times of a solver.
fn laws(
    records: &[Value],
    sweeps: usize,
    ratios: &[f64],
    [elements, load]: [&str; 2],
) -> [Check; 2] {
    let points = least(records, sweeps);
    let is_loaded = |r: &&Value| {
        let is_among = ratios.iter().any(|ratio| r["ratio"] == *ratio);
        is_among && r["sweeps"] == sweeps && r["elements"] == LOADED
    };
    let loaded = records.iter().filter(is_loaded);
    let [low, high] = extremes(loaded.map(|r| number(r, "least_ns")));
    let row = json!({
        "solver": solver(sweeps),
        "first": points.first().map(|p| p[0]),
        "last": points.last().map(|p| p[0]),
        "ratio": RATIO,
        "low": low,
        "high": high,
        "apart": 100.0 * (high / low - 1.0),
        "loaded": LOADED,
        "ratios": RATIOS.map(ratio).join(", "),
    });
    [
        named_check(elements, row.clone()).compared_with([1.0, exponent(&points)]),
        named_check(load, row).off(high / low - 1.0),
    ]
}

/// The paper's claims on what a step costs.
pub(super) fn cost(records: &[Value]) -> [Check; 2] {
    let ratios = [&RATIOS[..], &[RATIO]].concat();
    laws(records, FEW, &ratios, ["cost-elements", "cost-load"])
}

/// The laws of both solvers, the paper's figure beside ours.
fn checks(records: &[Value]) -> Vec<Check> {
    let names = ["time-exponent", "time-load"];
    let solvers = [FEW, 0].map(|sweeps| laws(records, sweeps, &RATIOS, names));
    let mut checks = solvers.concat();
    let points = least(records, FEW);
    let [a, b] = relative_line(&points);
    let fits = between(&points);
    let row = json!({
        "few": FEW,
        "fits": fits,
        "times": fits / PAPER_ELEMENTS,
        "line": (PAPER_NS - a) / b,
    });
    checks.push(named_check("time-paper", row).so(fits > PAPER_ELEMENTS));
    if let Some(r) = records.iter().find(|r| r["sweeps"] == MANY) {
        let equal = a + b * PAPER_ELEMENTS;
        let row = json!({ "few": FEW, "equal": equal, "paper": PAPER_ELEMENTS });
        let said = named_check("time-many", with(r, &row));
        checks.push(said.so(number(r, "least_ns") <= 1.5 * equal));
    }
    if let Some(r) = cells(records, FEW).next_back() {
        let parts = ["building_ns", "factorisation_ns", "iterations_ns"];
        let [a, b, c] = parts.map(|key| 100.0 * number(r, key) / number(r, "total_ns"));
        checks.push(named_check("time-minor", json!({ "a": a, "b": b, "c": c })).so(c < 25.0));
    }
    checks
}

/// The number of elements that take the paper's time, by a power between the measured ones around it.
fn between(points: &[[f64; 2]]) -> f64 {
    let around = points
        .windows(2)
        .find(|w| w[1][1] >= PAPER_NS)
        .or_else(|| points.windows(2).last());
    let Some(&[[n, t], [more, longer]]) = around.and_then(|w| w.first_chunk()) else {
        return f64::NAN;
    };
    let power = (more / n).ln() / (longer / t).ln();
    n * (PAPER_NS / t).powf(power)
}

/// The paper's figure, and the totals of both solvers.
fn charts(records: &[Value]) -> Vec<Chart> {
    ["timing-parts", "timing"]
        .map(|name| chart(name, &Value::Null, records))
        .to_vec()
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let records = run(quick, progress)?;
    let (checks, text) = (checks(&records), text_tables(&records));
    words::outcome(checks, text, &records, charts(&records))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_counted_between_the_measured_ones() {
        let points = [100.0, 1e3, 1e4].map(|n| [n, 30.0 * n * n]);
        assert!((between(&points) / (PAPER_NS / 30.0).sqrt() - 1.0).abs() < 1e-12);
        assert!((between(&points[..2]) / (PAPER_NS / 30.0).sqrt() - 1.0).abs() < 1e-12);
        assert!(between(&points[..1]).is_nan());
    }
}
