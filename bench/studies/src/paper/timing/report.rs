//! Table, checks and charts of Fig. 13.

use super::{Config, LOADED, RATIOS, Record, growth, relative_line, span, totals};
use crate::paper::words::{chart, table, tell, text, with};
use serde_json::{Value, json};
use taut_output::check::Check;
use taut_output::plot::{Chart, Mark, Series};
use taut_output::table::{nanoseconds, ratio};

/// The paper's time for the cable in a step \[ns], and the elements that fit into it there, on a Pentium M, 1.7 GHz.
const PAPER_NS: f64 = 1e7;
const PAPER_ELEMENTS: f64 = 100.0;

/// The times, and the fits below them.
pub fn text_tables(records: &[Record], config: &Config) -> String {
    let share = |r: &Record| with(r, &json!({ "element_ns": r.total_ns / r.elements as f64 }));
    let rows: Vec<Value> = records.iter().map(share).collect();
    let mut row = json!({ "times": table("timing", &rows) });
    for (name, sweeps) in [("iterative", config.sweeps[0]), ("direct", 0)] {
        let [a, b] = relative_line(&totals(records, config, sweeps, |r| r.least));
        let sign = if a < 0.0 { "−" } else { "" };
        let line = format!("{sign}{} + {} N", nanoseconds(a.abs()), nanoseconds(b));
        let power = growth(records, config, sweeps);
        row[name] = format!("{name}: t = {line}, t ∝ N^{power:.3}").into();
    }
    text("timing", &row)
}

/// Linearity, independence of the load, the paper's figure beside ours.
pub fn checks(records: &[Record], config: &Config) -> Vec<Check> {
    let [few, many] = config.sweeps;
    let mut checks = Vec::new();
    let points = totals(records, config, few, |r| r.least);
    let ends = points.first().zip(points.last());
    let elements = ends.map(|(a, b)| format!("{} … {}", a[0], b[0]));
    let ratios: Vec<String> = RATIOS.iter().map(|&r| ratio(r)).collect();
    for (name, sweeps) in [(format!("{few} iterations"), few), ("direct".to_owned(), 0)] {
        let [low, high] = span(records, sweeps, &RATIOS);
        let row = json!({
            "solver": name,
            "span": elements,
            "ratio": config.ratio,
            "low": low,
            "high": high,
            "loaded": LOADED,
            "ratios": ratios.join(", "),
        });
        let said = tell("time-exponent", row.clone());
        checks.push(said.beside([1.0, growth(records, config, sweeps)]));
        checks.push(tell("time-load", row).off(high / low - 1.0));
    }
    let [a, b] = relative_line(&points);
    let fits = between(&points);
    let row = json!({
        "few": few,
        "fits": fits,
        "times": fits / PAPER_ELEMENTS,
        "line": (PAPER_NS - a) / b,
    });
    checks.push(tell("time-paper", row).so(fits > PAPER_ELEMENTS));
    if let Some(r) = records.iter().find(|r| r.sweeps == many) {
        let equal = a + b * PAPER_ELEMENTS;
        let row = json!({ "few": few, "equal": equal, "paper": PAPER_ELEMENTS });
        checks.push(tell("time-many", with(r, &row)).so(r.least <= 1.5 * equal));
    }
    let at = |r: &&Record| r.sweeps == few && r.ratio == config.ratio;
    if let Some(r) = records.iter().rev().find(at) {
        let parts = [r.building_ns, r.factorisation_ns, r.iterations_ns];
        let [a, b, c] = parts.map(|t| 100.0 * t / r.total_ns);
        let said = tell("time-minor", json!({ "a": a, "b": b, "c": c }));
        checks.push(said.so(r.iterations_ns / r.total_ns < 0.25));
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
pub(super) fn charts(records: &[Record], config: &Config) -> Vec<Chart> {
    let few = config.sweeps[0];
    let line = |name: &str, sweeps, of| {
        let points = totals(records, config, sweeps, of).into_iter();
        let points = points.map(|[n, t]| [n, t * 1e-6]).collect();
        Series::new(name, points, Mark::LineAndPoints)
    };
    let parts = vec![
        line("constraint force", few, |r| r.total_ns),
        line("building blocks", few, |r| r.building_ns),
        line("factorisation", few, |r| r.factorisation_ns),
        line("iterations", few, |r| r.iterations_ns),
    ];
    let paper = vec![[PAPER_ELEMENTS, PAPER_NS * 1e-6]];
    let whole = vec![
        line(&format!("{few} iterations"), few, |r| r.total_ns),
        line("direct", 0, |r| r.total_ns),
        Series::new("paper: Pentium M, 1.7 GHz", paper, Mark::Points),
    ];
    let row = json!({ "few": few });
    vec![
        chart("timing-parts", &row, parts),
        chart("timing", &row, whole),
    ]
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
