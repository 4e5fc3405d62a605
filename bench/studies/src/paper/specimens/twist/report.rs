//! The specimen beside theory and the paper's claims, at rest, in motion, and what bending leaks into the twist: checks,
//! tables, charts.

use super::buckling::{SLENDERNESS, buckling_torque, greenhill, turns};
use super::{FARTHEST, Held, Leak, Results, Row};
use crate::paper::specimens::{Joint, SEGMENTS, largest, summed, worst};
use crate::paper::words::{
    self, chart, diagonal, filled, rows as rows_of, series, table, tell, text, with,
};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use taut_output::check::{Check, ExperimentError, Outcome, csv};
use taut_output::plot::{Chart, Mark};

/// Checks, tables, rows and charts.
pub fn outcome(results: &Results) -> Result<Outcome, ExperimentError> {
    let mut checks = at_rest(&results.rows);
    checks.extend(in_motion(&results.held));
    checks.extend(of_leaks(&results.leaks));
    let charts = vec![chart_at_rest(&results.rows), chart_of_leaks(&results.leaks)];
    let more_csv = vec![
        ("motion".into(), csv(&results.held)?),
        ("leak".into(), csv(&results.leaks)?),
    ];
    Ok(Outcome {
        more_csv,
        ..words::outcome(checks, tables(results), csv(&results.rows)?, charts)
    })
}

fn at_rest(rows: &[Row]) -> Vec<Check> {
    let all = rows_of(rows);
    let mut checks = Vec::new();
    for group in all.chunk_by(|a, b| a["material"] == b["material"]) {
        let farthest = worst(group, "twist");
        let row = json!({ "material": group[0]["material"], "farthest": farthest });
        let joint = worst(group, "angle_error");
        checks.push(tell("twist-joint", row.clone()).off(joint));
        checks.push(tell("twist-whole", row).off(worst(group, "total_error")));
    }
    checks
}

/// An untensioned specimen of 24 segments, disturbed.
fn is_loose(held: &Held, joint: Joint) -> bool {
    let is_free = held.tension == 0.0 && held.disturbed;
    is_free && held.segments == 24 && held.joint == joint.name()
}

fn in_motion(held: &[Held]) -> Vec<Check> {
    let exact = greenhill();
    let chain = buckling_torque(96, 1e12, 0.0);
    let said = tell("twist-greenhill", json!({ "turns": turns(exact) }));
    let mut checks = vec![said.beside([exact, chain])];
    let by = |step| {
        let is_its = move |h: &&Held| is_loose(h, Joint::Cosserat) && h.step == step;
        held.iter().find(is_its)
    };
    // The quick set has no such row.
    if let Some(measured) = by("paper").map(|h| h.straight_to) {
        let row = json!({ "to": measured, "pinned": turns(TAU), "clamped": turns(exact) });
        checks.push(tell("twist-long", row).so((2.4 / measured).ln().abs() < 0.1));
    }
    let buckles = turns(buckling_torque(12, SLENDERNESS, 0.0));
    checks.push(tell("twist-short", json!({ "turns": buckles })).so(buckles >= 15.0));
    if let Some(default) = by("default") {
        let limit = turns(buckling_torque(24, SLENDERNESS, 0.0));
        let loose = held.iter().filter(|h| is_loose(h, Joint::Cosserat));
        let all: Vec<String> = rows_of(loose)
            .iter()
            .map(|row| filled("{step} at 1/{dt:per} s: {straight_to:.2}", row))
            .collect();
        let row = json!({ "limit": limit, "to": default.straight_to, "all": all.join("; ") });
        checks.push(tell("twist-default", row).so(default.straight_to > 0.95 * limit));
    }
    if let Some(h) = held.iter().find(|h| is_loose(h, Joint::Ordinary)) {
        let said = tell("twist-paper", json!({ "to": h.straight_to }));
        checks.push(said.so(h.straight_to >= 2.4));
    }
    let is_taut = |h: &&Held| h.tension > 1.0;
    if let Some(h) = held.iter().filter(is_taut).find(|h| h.step == "paper") {
        let said = tell("twist-tension", json!({ "to": h.straight_to }));
        checks.push(said.so(h.straight));
    }
    let stiffened = held
        .iter()
        .filter(is_taut)
        .filter(|h| h.step == "stiffened");
    checks.extend(stiffened.map(|h| {
        let error = match h.straight {
            true => (h.turns_read * TAU / FARTHEST - 1.0).abs(),
            false => f64::NAN,
        };
        tell("twist-taut", with(h, &json!({ "farthest": FARTHEST }))).off(error)
    }));
    checks
}

fn of_leaks(leaks: &[Leak]) -> Vec<Check> {
    let cosserat = largest(leaks.iter().map(|l| l.cosserat.abs()));
    let share = largest(leaks.iter().map(|l| l.alternative.abs() / l.theta));
    let ordinary = largest(leaks.iter().map(|l| l.ordinary.abs() / l.theta));
    vec![
        tell("leak-cosserat", json!({})).off(cosserat),
        tell("leak-alternative", json!({ "share": share })).so(share > 0.5),
        tell("leak-ordinary", json!({ "share": ordinary })).so(ordinary < 1e-9),
    ]
}

fn tables(results: &Results) -> String {
    let errors = ["angle_error", "total_error"];
    let rest = summed(&results.rows, &["material", "segments", "joint"], &errors);
    let mut limits = json!({ "rod": turns(greenhill()) });
    for n in SEGMENTS {
        limits[n.to_string()] = turns(buckling_torque(n, SLENDERNESS, 0.0)).into();
    }
    let motion = results.held.iter().map(|h| {
        let end = match (h.straight, h.lost) {
            (true, _) => "straight",
            (_, true) => "lost",
            _ => "wavers",
        };
        with(h, &json!({ "end": end }))
    });
    let motion = table("twist-motion", &motion.collect::<Vec<Value>>());
    let parts = [
        table("twist", &rest),
        table("twist-limits", [&limits]),
        text("twist-motion", &json!({ "motion": motion })),
        table("twist-leak", &rows_of(&results.leaks)),
    ];
    parts.join("\n")
}

fn chart_at_rest(rows: &[Row]) -> Chart {
    let cosserat = rows.iter().filter(|r| r.joint == Joint::Cosserat.name());
    let axes = ["twist", "twist_theory"];
    let mut lines = vec![diagonal("theory", FARTHEST)];
    lines.extend(series(
        &rows_of(cosserat),
        "N = {segments}",
        axes,
        Mark::Points,
    ));
    chart("twist", &Value::Null, lines)
}

/// The leaks that are more than rounding.
fn chart_of_leaks(leaks: &[Leak]) -> Chart {
    let mut lines = Vec::new();
    for direction in leaks.chunk_by(|a, b| a.direction_rad == b.direction_rad) {
        for (name, reading) in [
            ("ordinary", (|l| l.ordinary.abs()) as fn(&Leak) -> f64),
            ("alternative", |l| l.alternative.abs()),
        ] {
            let row = |l: &Leak| with(l, &json!({ "reading": reading(l) }));
            let rows: Vec<Value> = direction.iter().map(row).collect();
            if direction.iter().any(|l| reading(l) > 1e-9) {
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
