//! The specimen beside theory and the paper's claims, at rest, in motion, and what bending leaks into the twist: checks,
//! tables, charts.

use super::{FARTHEST, SLENDERNESS, buckling_torque, greenhill, turns};
use crate::paper::specimens::{SEGMENTS, summed};
use crate::paper::words::{
    self, chart, filled, judged, largest, named_check, number, table, text, with, worst,
};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_output::plot::Chart;

/// Checks, tables, rows and charts of specimens at rest, in motion, and of leaks.
pub fn outcome([rows, held, leaks]: &[Vec<Value>; 3]) -> Result<Outcome, ExperimentError> {
    let mut checks = judged(rows, "material", &["twist-joint", "twist-whole"]);
    checks.extend(in_motion(held));
    checks.extend(of_leaks(leaks));
    let charts = vec![chart("twist", &Value::Null, rows), chart_of_leaks(leaks)];
    let more_csv = vec![
        ("motion".into(), words::lines(held)?),
        ("leak".into(), words::lines(leaks)?),
    ];
    Ok(Outcome {
        more_csv,
        ..words::outcome(checks, tables(rows, held, leaks), rows, charts)?
    })
}

/// An untensioned specimen of 24 segments, disturbed.
fn is_loose(held: &Value, joint: &str) -> bool {
    let is_free = held["tension"] == 0.0 && held["disturbed"] == true;
    is_free && held["segments"] == 24 && held["joint"] == joint
}

fn in_motion(held: &[Value]) -> Vec<Check> {
    let exact = greenhill();
    let chain = buckling_torque(96, 1e12, 0.0);
    let said = named_check("twist-greenhill", json!({ "turns": turns(exact) }));
    let mut checks = vec![said.compared_with([exact, chain])];
    let loose = |joint: &'static str| held.iter().filter(move |h| is_loose(h, joint));
    let taut = |step| {
        let taut = held.iter().filter(|h| number(h, "tension") > 1.0);
        taut.filter(move |h| h["step"] == step)
    };
    let by = |step| loose("cosserat").find(|h| h["step"] == step);
    let straight_to = |h: &Value| number(h, "straight_to");
    let is_straight = |h: &Value| h["straight"] == true;
    let ends = json!({ "pinned": turns(TAU), "clamped": turns(exact) });
    // The quick set has no such row.
    checks.extend(by("paper").map(|h| {
        let is_near = (2.4 / straight_to(h)).ln().abs() < 0.1;
        named_check("twist-long", with(h, &ends)).so(is_near)
    }));
    let buckles = turns(buckling_torque(12, SLENDERNESS, 0.0));
    checks.push(named_check("twist-short", json!({ "turns": buckles })).so(buckles >= 15.0));
    let limit = turns(buckling_torque(24, SLENDERNESS, 0.0));
    let all = loose("cosserat").map(|h| filled("{step} at 1/{dt:per} s: {straight_to:.2}", h));
    let row = json!({ "limit": limit, "all": all.collect::<Vec<_>>().join("; ") });
    let default =
        by("default").map(|h| (named_check("twist-default", with(h, &row)), straight_to(h)));
    checks.extend(default.map(|(said, to)| said.so(to > 0.95 * limit)));
    let own = loose("paper, ordinary").take(1);
    checks.extend(own.map(|h| named_check("twist-paper", h.clone()).so(straight_to(h) >= 2.4)));
    let tense = taut("paper").take(1);
    checks.extend(tense.map(|h| named_check("twist-tension", h.clone()).so(is_straight(h))));
    checks.extend(taut("stiffened").map(|h| {
        let error = match is_straight(h) {
            true => (number(h, "turns_read") * TAU / FARTHEST - 1.0).abs(),
            false => f64::NAN,
        };
        named_check("twist-taut", with(h, &json!({ "farthest": FARTHEST }))).off(error)
    }));
    checks
}

fn of_leaks(leaks: &[Value]) -> Vec<Check> {
    let cosserat = leaks.iter().map(|l| number(l, "cosserat").abs());
    let share = |l: &Value, key| number(l, key).abs() / number(l, "theta");
    let [share, ordinary] =
        ["alternative", "ordinary"].map(|key| largest(leaks.iter().map(|l| share(l, key))));
    vec![
        named_check("leak-cosserat", json!({})).off(largest(cosserat)),
        named_check("leak-alternative", json!({ "share": share })).so(share > 0.5),
        named_check("leak-ordinary", json!({ "share": ordinary })).so(ordinary < 1e-9),
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

/// The leaks that are more than rounding.
fn chart_of_leaks(leaks: &[Value]) -> Chart {
    let mut rows = Vec::new();
    for direction in leaks.chunk_by(|a, b| a["direction_rad"] == b["direction_rad"]) {
        for angle in ["ordinary", "alternative"] {
            let row = |l: &Value| {
                with(
                    l,
                    &json!({ "angle": angle, "reading": number(l, angle).abs() }),
                )
            };
            let own: Vec<Value> = direction.iter().map(row).collect();
            if worst(&own, "reading") > 1e-9 {
                rows.extend(own);
            }
        }
    }
    chart("twist-leak", &Value::Null, &rows)
}
