//! What one solve costs, a table for each case.

use super::{error, mark_columns, ratio, table, text};
use crate::kernels::{Record, Results};
use std::fmt::Write;

/// A table for each case, then what was left out.
#[must_use]
pub fn kernels(results: &Results) -> String {
    let mut out = String::new();
    let cases = results.records.chunk_by(|a, b| {
        (a.segments, a.joint_rows) == (b.segments, b.joint_rows) && a.mass_ratio == b.mass_ratio
    });
    for case in cases {
        let r = &case[0];
        let _ = writeln!(
            out,
            "\n{} segments, {} joints of {} rows, mass ratio {}",
            r.segments,
            r.joints,
            r.joint_rows,
            ratio(r.mass_ratio)
        );
        out.push_str(&rows(case));
    }
    out.push_str(&super::omissions(&results.omissions));
    out
}

/// Nanoseconds or a ratio in three digits.
fn digits(x: f64) -> String {
    match x {
        x if x.is_nan() => "-".to_owned(),
        x if x < 10.0 => format!("{x:.2}"),
        x if x < 100.0 => format!("{x:.1}"),
        x => format!("{x:.0}"),
    }
}

fn rows(case: &[Record]) -> String {
    let mut t = table(&[
        "solver",
        "ns/joint",
        "median ns",
        "× banded",
        "median ×",
        "samples",
        "normwise",
        "compon.",
        "error",
    ]);
    for r in case {
        let number = |x: f64| error(r.error.is_none().then_some(x));
        let times = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), digits);
        let least = match r.error {
            Some(_) => "failed".to_owned(),
            None => digits(r.ns_per_joint),
        };
        t.add_row([
            r.solver.clone(),
            least,
            digits(r.ns_per_joint_median),
            times(r.ratio),
            times(r.ratio_median),
            r.samples.to_string(),
            number(r.backward_error),
            number(r.backward_error_componentwise),
            number(r.forward_error),
        ]);
    }
    mark_columns(
        &mut t,
        case,
        |r| r.error.is_none(),
        &[
            (1, |r| Some(r.ns_per_joint)),
            (2, |r| Some(r.ns_per_joint_median)),
            (6, |r| Some(r.backward_error)),
            (7, |r| Some(r.backward_error_componentwise)),
            (8, |r| Some(r.forward_error)),
        ],
    );
    let mut out = text(&t);
    for (r, reason) in case.iter().filter_map(|r| Some((r, r.error.as_ref()?))) {
        let _ = writeln!(out, "  {}: {reason}", r.solver);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{Config, run};
    use crate::table::plain;
    use indicatif::ProgressBar;
    use std::time::Duration;

    #[test]
    fn the_tables_fit_into_120_columns() {
        let config = Config {
            segments: vec![5],
            share: Duration::from_micros(100),
            ..Config::default()
        };
        let results = run(&config, &ProgressBar::hidden()).unwrap();
        let shown = plain(&kernels(&results));
        let width = shown.lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{width:?}\n{shown}");
        assert!(shown.contains("5 segments, 6 joints of 3 rows, mass ratio 1000"));
    }

    #[test]
    fn a_failure_is_told_with_its_reason() {
        let rivals = vec!["dense".parse().unwrap()];
        let config = Config {
            segments: vec![3],
            rivals,
            share: Duration::ZERO,
            ..Config::default()
        };
        let mut results = run(&config, &ProgressBar::hidden()).unwrap();
        results.records[0].error = Some("too hot".to_owned());
        let shown = plain(&kernels(&results));
        assert!(
            shown.contains("failed") && shown.contains("dense:double: too hot"),
            "{shown}"
        );
    }
}
