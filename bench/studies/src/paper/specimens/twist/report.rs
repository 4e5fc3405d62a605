//! The specimen beside theory and the paper's claims, at rest, in motion, and what bending leaks into the twist: checks,
//! tables, charts.

use super::FARTHEST;
use super::buckling::{SLENDERNESS, buckling_torque, greenhill, turns};
use crate::paper::specimens::{SEGMENTS, largest, summed, worst};
use crate::paper::words::{self, chart, diagonal, filled, number, series, table, tell, text, with};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_output::plot::{Chart, Mark};

/// Checks, tables, rows and charts of specimens at rest, in motion, and of leaks.
pub fn outcome([rows, held, leaks]: &[Vec<Value>; 3]) -> Result<Outcome, ExperimentError> {
    let mut checks = at_rest(rows);
    checks.extend(in_motion(held));
    checks.extend(of_leaks(leaks));
    let charts = vec![chart_at_rest(rows), chart_of_leaks(leaks)];
    let more_csv = vec![
        ("motion".into(), words::lines(held)?),
        ("leak".into(), words::lines(leaks)?),
    ];
    Ok(Outcome {
        more_csv,
        ..words::outcome(checks, tables(rows, held, leaks), rows, charts)?
    })
}

fn at_rest(rows: &[Value]) -> Vec<Check> {
    let mut checks = Vec::new();
    for group in rows.chunk_by(|a, b| a["material"] == b["material"]) {
        let farthest = worst(group, "twist");
        let row = json!({ "material": group[0]["material"], "farthest": farthest });
        let joint = worst(group, "angle_error");
        checks.push(tell("twist-joint", row.clone()).off(joint));
        checks.push(tell("twist-whole", row).off(worst(group, "total_error")));
    }
    checks
}

/// An untensioned specimen of 24 segments, disturbed.
fn is_loose(held: &Value, joint: &str) -> bool {
    let is_free = held["tension"] == 0.0 && held["disturbed"] == true;
    is_free && held["segments"] == 24 && held["joint"] == joint
}

fn in_motion(held: &[Value]) -> Vec<Check> {
    let exact = greenhill();
    let chain = buckling_torque(96, 1e12, 0.0);
    let said = tell("twist-greenhill", json!({ "turns": turns(exact) }));
    let mut checks = vec![said.beside([exact, chain])];
    let loose = |joint: &'static str| held.iter().filter(move |h| is_loose(h, joint));
    let by = |step| loose("cosserat").find(|h| h["step"] == step);
    let straight_to = |h: &Value| number(h, "straight_to");
    // The quick set has no such row.
    if let Some(measured) = by("paper").map(straight_to) {
        let row = json!({ "to": measured, "pinned": turns(TAU), "clamped": turns(exact) });
        checks.push(tell("twist-long", row).so((2.4 / measured).ln().abs() < 0.1));
    }
    let buckles = turns(buckling_torque(12, SLENDERNESS, 0.0));
    checks.push(tell("twist-short", json!({ "turns": buckles })).so(buckles >= 15.0));
    if let Some(to) = by("default").map(straight_to) {
        let limit = turns(buckling_torque(24, SLENDERNESS, 0.0));
        let all: Vec<String> = loose("cosserat")
            .map(|row| filled("{step} at 1/{dt:per} s: {straight_to:.2}", row))
            .collect();
        let row = json!({ "limit": limit, "to": to, "all": all.join("; ") });
        checks.push(tell("twist-default", row).so(to > 0.95 * limit));
    }
    if let Some(to) = loose("paper, ordinary").next().map(straight_to) {
        checks.push(tell("twist-paper", json!({ "to": to })).so(to >= 2.4));
    }
    let taut = |step| {
        let taut = held.iter().filter(|h| number(h, "tension") > 1.0);
        taut.filter(move |h| h["step"] == step)
    };
    if let Some(h) = taut("paper").next() {
        let said = tell("twist-tension", json!({ "to": straight_to(h) }));
        checks.push(said.so(h["straight"] == true));
    }
    checks.extend(taut("stiffened").map(|h| {
        let error = match h["straight"] == true {
            true => (number(h, "turns_read") * TAU / FARTHEST - 1.0).abs(),
            false => f64::NAN,
        };
        tell("twist-taut", with(h, &json!({ "farthest": FARTHEST }))).off(error)
    }));
    checks
}

fn of_leaks(leaks: &[Value]) -> Vec<Check> {
    let cosserat = leaks.iter().map(|l| number(l, "cosserat").abs());
    let share = |l: &Value, key| number(l, key).abs() / number(l, "theta");
    let [share, ordinary] =
        ["alternative", "ordinary"].map(|key| largest(leaks.iter().map(|l| share(l, key))));
    vec![
        tell("leak-cosserat", json!({})).off(largest(cosserat)),
        tell("leak-alternative", json!({ "share": share })).so(share > 0.5),
        tell("leak-ordinary", json!({ "share": ordinary })).so(ordinary < 1e-9),
    ]
}

fn tables(rows: &[Value], held: &[Value], leaks: &[Value]) -> String {
    let errors = ["angle_error", "total_error"];
    let rest = summed(rows, &["material", "segments", "joint"], &errors);
    let mut limits = json!({ "rod": turns(greenhill()) });
    for n in SEGMENTS {
        limits[n.to_string()] = turns(buckling_torque(n, SLENDERNESS, 0.0)).into();
    }
    let motion = held.iter().map(|h| {
        let end = match ["straight", "lost"].map(|key| h[key] == true) {
            [true, _] => "straight",
            [_, true] => "lost",
            _ => "wavers",
        };
        with(h, &json!({ "end": end }))
    });
    let motion = table("twist-motion", &motion.collect::<Vec<Value>>());
    let parts = [
        table("twist", &rest),
        table("twist-limits", [&limits]),
        text("twist-motion", &json!({ "motion": motion })),
        table("twist-leak", leaks),
    ];
    parts.join("\n")
}

fn chart_at_rest(rows: &[Value]) -> Chart {
    let cosserat = rows.iter().filter(|r| r["joint"] == "cosserat");
    let axes = ["twist", "twist_theory"];
    let mut lines = vec![diagonal("theory", FARTHEST)];
    lines.extend(series(cosserat, "N = {segments}", axes, Mark::Points));
    chart("twist", &Value::Null, lines)
}

/// The leaks that are more than rounding.
fn chart_of_leaks(leaks: &[Value]) -> Chart {
    let mut lines = Vec::new();
    for direction in leaks.chunk_by(|a, b| a["direction_rad"] == b["direction_rad"]) {
        for name in ["ordinary", "alternative"] {
            let row = |l: &Value| with(l, &json!({ "reading": number(l, name).abs() }));
            let rows: Vec<Value> = direction.iter().map(row).collect();
            if worst(&rows, "reading") > 1e-9 {
                let name = format!("{name}, bent {{direction_rad:angle}} from v");
                lines.extend(series(
                    &rows,
                    &name,
                    ["theta", "reading"],
                    Mark::LineAndPoints,
                ));
            }
        }
    }
    chart("twist-leak", &Value::Null, lines)
}
