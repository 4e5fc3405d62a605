//! The specimen beside theory and the paper's numbers: checks, tables, charts.

use super::Row;
use super::plane::stability_of_the_plane;
use super::shape::{MEASURES, deviations};
use crate::paper::specimens::{Joint, MATERIALS, SEGMENTS, largest, order, summed, worst};
use crate::paper::words::{self, chart, diagonal, rows as rows_of, series, table, tell, with};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use taut_output::check::{Check, ExperimentError, Outcome, csv};
use taut_output::plot::{Chart, Mark, Series};

/// The paper's deviations of N = 6 and N = 24.
const PUBLISHED: [(usize, f64); 2] = [(6, 0.10), (24, 0.025)];

/// Checks, tables, rows and charts.
pub fn outcome(rows: &[Row]) -> Result<Outcome, ExperimentError> {
    let mut checks = against_theory(rows);
    checks.extend(published(rows));
    checks.push(stability_of_the_plane()?);
    Ok(words::outcome(
        checks,
        tables(rows),
        csv(rows)?,
        charts(rows),
    ))
}

/// The specimens beside the exact polygon and the circle.
fn against_theory(rows: &[Row]) -> Vec<Check> {
    let all = rows_of(rows);
    let mut checks = Vec::new();
    let straight = |row: &Value| row["direction_rad"] == 0.0;
    for (material, _) in MATERIALS {
        let mut say = |name, takes: &dyn Fn(&Value) -> bool, key| {
            let own = all.iter().filter(|row| row["material"] == material);
            let error = worst(own.filter(|row| takes(row)), key);
            checks.push(tell(name, json!({ "material": material })).off(error));
        };
        say("bend-angle", &|_| true, "angle_error");
        say("bend-end", &straight, "tip_error");
        say("bend-diagonal", &|row| !straight(row), "tip_error");
    }
    let is_full = |r: &&Row| (r.angle_theory - TAU).abs() < 1e-9 && r.direction_rad == 0.0;
    let closing = largest(rows.iter().filter(is_full).map(|r| r.tip_from_arc));
    checks.push(tell("bend-closes", json!({})).off(closing));
    for (name, measure, expected) in MEASURES {
        let found = finest(&deviations(rows, 0.25 * TAU, measure)).unwrap_or(f64::NAN);
        let said = tell("bend-order", json!({ "measure": name }));
        checks.push(said.beside([expected, found]));
    }
    checks
}

/// Order in N of the two finest specimens' deviations.
fn finest(all: &[(usize, f64)]) -> Option<f64> {
    let finest: Vec<_> = all.iter().copied().filter(|d| d.0 >= 12).collect();
    order(&finest)
}

/// The deviation at N of a measure at the full circle.
fn at(rows: &[Row], measure: fn(&Row) -> f64, n: usize) -> f64 {
    let all = deviations(rows, TAU, measure);
    all.iter().find(|d| d.0 == n).map_or(f64::NAN, |d| d.1)
}

fn published(rows: &[Row]) -> Vec<Check> {
    let size = |measure, n: usize| at(rows, measure, n).abs();
    let deviation = |(n, printed): (usize, f64)| {
        let values = [printed, size(MEASURES[0].1, n)].map(|d| 100.0 * d);
        tell("bend-deviation", json!({ "n": n })).beside(values)
    };
    let mut checks = PUBLISHED.map(deviation).to_vec();
    let misfit = |measure| {
        let ratios = PUBLISHED.map(|(n, printed)| (size(measure, n) / printed).ln().abs());
        ratios[0].max(ratios[1])
    };
    let mut measures = MEASURES;
    measures.sort_by(|a, b| misfit(a.1).total_cmp(&misfit(b.1)));
    let (name, measure, _) = measures[0];
    let [a, b] = PUBLISHED.map(|(n, _)| 100.0 * size(measure, n));
    let said = tell("bend-nearest", json!({ "measure": name, "a": a, "b": b }));
    checks.push(said.so(misfit(measure).exp() <= 1.2));
    checks
}

fn tables(rows: &[Row]) -> String {
    let radius = MEASURES.map(|(name, measure, _)| {
        let mut row = json!({ "measure": name });
        for n in SEGMENTS {
            row[n.to_string()] = (100.0 * at(rows, measure, n)).into();
        }
        row["order"] = finest(&deviations(rows, TAU, measure)).into();
        row
    });
    let same = ["material", "segments", "joint", "direction_rad"];
    let steel = summed(rows, &same, &["angle_error", "tip_error"]);
    let [radius, steel] = [table("bend-radius", &radius), table("bend", &steel)];
    format!("{radius}\nsteel, largest over all loads\n{steel}")
}

fn charts(rows: &[Row]) -> Vec<Chart> {
    let end = largest(rows.iter().map(|r| r.angle_theory));
    let plane = |r: &&Row| r.direction_rad == 0.0 && r.joint == Joint::Cosserat.name();
    let curved = |r: &Row| with(r, &json!({ "curvature": 1.0 / r.radius_m }));
    let curved: Vec<Value> = rows.iter().filter(plane).map(curved).collect();
    let mut torque = vec![diagonal("theory", end)];
    let axes = ["curvature", "angle_theory"];
    torque.extend(series(&curved, "N = {segments}", axes, Mark::Points));
    let line = |(name, measure, _): (&str, fn(&Row) -> f64, f64)| {
        let all = deviations(rows, TAU, measure);
        let points = all.iter().map(|&(n, d)| [n as f64, d.abs()]).collect();
        Series::new(name, points, Mark::LineAndPoints)
    };
    let mut deviation = MEASURES.map(line).to_vec();
    let printed = PUBLISHED.map(|(n, d)| [n as f64, d]).to_vec();
    deviation.push(Series::new("paper", printed, Mark::Points));
    vec![
        chart("bend", &Value::Null, torque),
        chart("bend-deviation", &Value::Null, deviation),
    ]
}
