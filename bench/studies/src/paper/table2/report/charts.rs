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
        let limit = |setting, solver| points(&move |r| find(records, r, setting, solver)?.stable);
        let linear = points(&|r| find(records, r, PAPER, Solver::Direct)?.predicted);
        Chart {
            title: format!("{} segments", rows[0].segments),
            x: Axis::log("Y/ζ (GN)"),
            y: Axis::log("largest stable load/segment mass ratio"),
            series: vec![
                Series::new("paper, as read", points(&|r| Some(r.ratio)), Mark::Points),
                Series::new(
                    "paper's joint, direct",
                    limit(PAPER, Solver::Direct),
                    Mark::LineAndPoints,
                ),
                Series::new("linear theory", linear, Mark::Line),
                Series::new(
                    "20 iterations",
                    limit(PAPER, Solver::Sweeps(20)),
                    Mark::LineAndPoints,
                ),
                Series::new(
                    "3 iterations",
                    limit(PAPER, Solver::Sweeps(3)),
                    Mark::LineAndPoints,
                ),
                Series::new(
                    "geometric stiffness, at least",
                    limit(Setting::Stiffened, Solver::Direct),
                    Mark::LineAndPoints,
                ),
                Series::new(
                    "seeded, ordinary",
                    limit(Setting::ALL[3], Solver::Direct),
                    Mark::LineAndPoints,
                ),
            ],
        }
    };
    vec![panel(&ROWS[..5]), panel(&ROWS[5..])]
}
