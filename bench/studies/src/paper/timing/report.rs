//! Table, checks and charts of Fig. 13.

use super::{Config, PAPER_MANY, Record, exponent, relative_line};
use std::fmt::Write;
use taut_output::check::{Check, Measure};
use taut_output::plot::{Axis, Chart, Mark, Series};
use taut_output::table::{nanoseconds, of_records, ratio};

/// The paper's time for the cable in a step \[ns], the elements that fit into it there, and its processor.
const PAPER_NS: f64 = 1e7;
const PAPER_ELEMENTS: f64 = 100.0;
const PAPER_MACHINE: &str = "Pentium M, 1.7 GHz";

/// Totals over the elements at the figure's mass ratio.
fn totals(
    records: &[Record],
    config: &Config,
    sweeps: usize,
    of: fn(&Record) -> f64,
) -> Vec<[f64; 2]> {
    let at = |r: &&Record| r.sweeps == sweeps && r.ratio == config.ratio;
    let cells = records.iter().filter(at);
    cells.map(|r| [r.elements as f64, of(r)]).collect()
}

/// The times, and the fits below them.
pub fn text_tables(records: &[Record], config: &Config) -> String {
    let mut out = "Median times of a step, one run after the other\n".to_owned();
    let t = of_records(
        records,
        &[
            ("solver", &|r| r.solver.clone()),
            ("elements", &|r| r.elements.to_string()),
            ("M/m", &|r| ratio(r.ratio)),
            ("building", &|r| nanoseconds(r.building)),
            ("factors", &|r| nanoseconds(r.factorisation)),
            ("iterations", &|r| nanoseconds(r.iterations)),
            ("total", &|r| nanoseconds(r.total)),
            ("a element", &|r| nanoseconds(r.total / r.elements as f64)),
            ("least", &|r| nanoseconds(r.least)),
        ],
    );
    out.push_str(&t);
    for (name, sweeps) in [("iterative", config.sweeps[0]), ("direct", 0)] {
        let points = totals(records, config, sweeps, |r| r.least);
        let [a, b] = relative_line(&points);
        let _ = writeln!(
            out,
            "{name}: t = {}{} + {} N, t ∝ N^{:.3}",
            if a < 0.0 { "−" } else { "" },
            nanoseconds(a.abs()),
            nanoseconds(b),
            exponent(&points)
        );
    }
    out
}

/// Linearity, independence of the load, the paper's figure beside ours.
pub fn checks(records: &[Record], config: &Config) -> Vec<Check> {
    let [few, many] = config.sweeps;
    let mut checks = Vec::new();
    for (name, sweeps) in [(format!("{few} iterations"), few), ("direct".to_owned(), 0)] {
        let points = totals(records, config, sweeps, |r| r.least);
        let p = exponent(&points);
        let (first, last) = (points.first().copied(), points.last().copied());
        let span = first
            .zip(last)
            .map_or_else(String::new, |(a, b)| format!("{} … {}", a[0], b[0]));
        let note =
            "a smaller exponent is the constant part of short cables, a larger one the caches' end";
        checks.push(
            Check::number(
                format!("exponent, {name}"),
                [1.0, p],
                "",
                Measure::Absolute,
                0.1,
            )
            .published()
            .by(format!(
                "difference of the log–log exponent over {span} elements, mass ratio {}",
                config.ratio
            ))
            .noting(note),
        );
        checks.push(load(records, config, sweeps, &name));
    }
    let points = totals(records, config, few, |r| r.least);
    let [a, b] = relative_line(&points);
    let fits = between(&points);

    let note = format!(
        "{few} iterations; {PAPER_MACHINE} there; between the measured times, {:.0} times as many; {:.0} by the line",
        fits / PAPER_ELEMENTS,
        (PAPER_NS - a) / b
    );
    let case = "elements in 0.01 s";
    checks.push(
        Check::stated(
            case,
            "more than 100",
            format!("{fits:.0}"),
            fits > PAPER_ELEMENTS,
        )
        .published()
        .noting(note),
    );
    if let Some(r) = records.iter().find(|r| r.sweeps == many) {
        let equal = a + b * PAPER_ELEMENTS;

        let ours = format!("{} against {}", nanoseconds(r.least), nanoseconds(equal));
        let note = format!(
            "time of {many} iterations with {} elements against the line's of {few} with {PAPER_ELEMENTS}; the same: less than half as much again",
            PAPER_MANY.0
        );
        let case = format!("{many} sweeps, 50 elements");
        let same = r.least <= 1.5 * equal;
        checks.push(
            Check::stated(case, "as 100 with 3", ours, same)
                .published()
                .noting(note),
        );
    }
    if let Some(r) = records
        .iter()
        .rev()
        .find(|r| r.sweeps == few && r.ratio == config.ratio)
    {
        let share = r.iterations / r.total;
        let parts = [r.building, r.factorisation, r.iterations].map(|t| 100.0 * t / r.total);
        let ours = format!("{:.0} %, {:.0} %, {:.0} %", parts[0], parts[1], parts[2]);

        let note = "building, factorisation, iterations at the largest number of elements; minor: below a quarter";
        let minor = Check::stated("iterations a minor part", "yes", ours, share < 0.25);
        checks.push(minor.published().noting(note));
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

/// Largest distance of the times at other loads from their mean.
fn load(records: &[Record], config: &Config, sweeps: usize, name: &str) -> Check {
    let cells = records.iter().filter(|r| {
        r.sweeps == sweeps && r.elements == config.loaded && config.ratios.contains(&r.ratio)
    });
    let times: Vec<f64> = cells.map(|r| r.least).collect();
    let (low, high) = times
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(a, b), &t| (a.min(t), b.max(t)));
    let ours = format!("{} … {}", nanoseconds(low), nanoseconds(high));
    let ratios: Vec<String> = config.ratios.iter().map(|&r| ratio(r)).collect();
    let by = format!(
        "largest of the least times over the smallest, less 1, {} elements, mass ratios {}",
        config.loaded,
        ratios.join(", ")
    );
    Check::within(
        format!("load, {name}"),
        "independent",
        ours,
        high / low - 1.0,
        0.25,
    )
    .published()
    .by(by)
}

/// The paper's figure, and the totals of both solvers.
pub fn charts(records: &[Record], config: &Config) -> Vec<Chart> {
    let few = config.sweeps[0];
    let milli = |sweeps, of| -> Vec<[f64; 2]> {
        let points = totals(records, config, sweeps, of);
        points.into_iter().map(|[n, t]| [n, t * 1e-6]).collect()
    };
    let series = |name: &str, sweeps, of| Series::new(name, milli(sweeps, of), Mark::LineAndPoints);
    let chart = |title: String, series| Chart {
        title,
        x: Axis::log("elements"),
        y: Axis::log("time a step (ms)"),
        series,
    };
    vec![
        chart(
            format!("{few} iterations: parts of the step"),
            vec![
                series("constraint force", few, |r| r.total),
                series("building blocks", few, |r| r.building),
                series("factorisation", few, |r| r.factorisation),
                series("iterations", few, |r| r.iterations),
            ],
        ),
        chart(
            "constraint force".to_owned(),
            vec![
                series(&format!("{few} iterations"), few, |r| r.total),
                series("direct", 0, |r| r.total),
                Series::new(
                    format!("paper: {PAPER_MACHINE}"),
                    vec![[PAPER_ELEMENTS, PAPER_NS * 1e-6]],
                    Mark::Points,
                ),
            ],
        ),
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
