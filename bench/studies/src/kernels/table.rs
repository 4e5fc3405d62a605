//! Cost of one linear solve, a table for each case.

use taut_output::row::{Row, has_no_error, number_of};
use taut_output::sheet::{self, Sheet, Show, column};

pub(super) const SHEETS: &[Sheet] = &[Sheet {
    list: "records",
    shared: &[
        column("segments", "{} segments"),
        column("joint_rows", "{}").shown(Show::Row(joints)),
        column("mass_ratio", "mass ratio {}").shown(Show::Ratio),
    ],
    columns: &[
        column("solver", "solver"),
        column("ns_per_joint", "ns/joint")
            .shown(Show::Digits(1.0))
            .least(),
        column("ns_per_joint_median", "median")
            .unit("ns")
            .shown(Show::Digits(1.0))
            .least(),
        column("ratio", "× banded").shown(Show::Digits(1.0)),
        column("ratio_median", "median ×").shown(Show::Digits(1.0)),
        column("samples", "samples"),
        sheet::error("backward_error", "normwise"),
        sheet::error("backward_error_componentwise", "compon."),
        sheet::error("forward_error", "error"),
    ],
    counts: has_no_error,
    ..sheet::PLAIN
}];

fn joints(row: &Row) -> String {
    let count = |key| number_of(row, key).unwrap_or(f64::NAN);
    format!("{} joints of {} rows", count("joints"), count("joint_rows"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::Cases;
    use crate::kernels::{Config, run};
    use crate::study::{data, tables};
    use std::time::Duration;
    use taut_output::table::plain;

    #[test]
    fn the_tables_fit_into_120_columns() {
        let config = Config {
            segments: vec![5],
            share: Duration::from_micros(100),
            ..Config::default()
        };
        let results = run(&config, &Cases::default()).unwrap();
        let shown = plain(&tables(SHEETS, &data(&results).unwrap()));
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
        let mut results = run(&config, &Cases::default()).unwrap();
        results.records[0].error = Some("too hot".to_owned());
        let shown = plain(&tables(SHEETS, &data(&results).unwrap()));
        assert!(shown.contains("dense:double failed: too hot"), "{shown}");
    }
}
