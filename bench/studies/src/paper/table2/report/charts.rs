//! The limits of joints, steps and solvers over Y/ζ, one panel a number of segments.

use super::{PAPER, find};
use crate::paper::table2::{ROWS, Record, Row, Setting, Solver};
use taut_output::plot::{Axis, Chart, Mark, Series};

/// The limits over Y/ζ, for 24 and for 6 segments.
pub fn charts(records: &[Record]) -> Vec<Chart> {
    let panel = |rows: &[Row]| {
        let points = |value: &dyn Fn(&Row) -> Option<f64>| -> Vec<[f64; 2]> {
            let point = |r: &Row| Some([r.young / r.zeta, value(r)?]);
            rows.iter().filter_map(point).collect()
        };
        let linear = points(&|r| find(records, r, PAPER, Solver::Direct)?.predicted);
        let found = [
            ("paper's joint, direct", PAPER, Solver::Direct),
            ("20 iterations", PAPER, Solver::Sweeps(20)),
            ("3 iterations", PAPER, Solver::Sweeps(3)),
            (
                "geometric stiffness, at least",
                Setting::Stiffened,
                Solver::Direct,
            ),
            ("seeded, ordinary", Setting::ALL[3], Solver::Direct),
        ];
        let limit = |(name, setting, solver)| {
            let points = points(&move |r| find(records, r, setting, solver)?.stable);
            Series::new(name, points, Mark::LineAndPoints)
        };
        let mut series: Vec<Series> = found.into_iter().map(limit).collect();
        series.insert(
            0,
            Series::new("paper, as read", points(&|r| Some(r.ratio)), Mark::Points),
        );
        series.insert(2, Series::new("linear theory", linear, Mark::Line));
        Chart {
            title: format!("{} segments", rows[0].segments),
            x: Axis::log("Y/ζ (GN)"),
            y: Axis::log("largest stable load/segment mass ratio"),
            series,
        }
    };
    vec![panel(&ROWS[..5]), panel(&ROWS[5..])]
}
