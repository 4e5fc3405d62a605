//! Fig. 12, and the deviation of the radius over N.

use super::Row;
use super::measures::{MEASURES, PUBLISHED, deviations};
use crate::paper::specimens::{Joint, SEGMENTS, largest};
use std::f64::consts::TAU;
use taut_output::plot::{Axis, Chart, Mark, Series};

pub(super) fn charts(rows: &[Row]) -> Vec<Chart> {
    let end = largest(rows.iter().map(|r| r.angle_theory));
    let plane = |r: &&Row| r.direction_rad == 0.0 && r.joint == Joint::Cosserat.name();
    let mut torque = vec![Series::new(
        "theory",
        vec![[0.0, 0.0], [end, end]],
        Mark::Line,
    )];
    let mut deviation = Vec::new();
    for n in SEGMENTS {
        let of = rows.iter().filter(plane).filter(|r| r.segments == n);
        let points = of.map(|r| [1.0 / r.radius_m, r.angle_theory]).collect();
        torque.push(Series::new(format!("N = {n}"), points, Mark::Points));
    }
    for (name, measure, _) in MEASURES {
        let all = deviations(rows, TAU, measure);
        let points = all.iter().map(|&(n, d)| [n as f64, d.abs()]).collect();
        deviation.push(Series::new(name, points, Mark::LineAndPoints));
    }
    let printed = PUBLISHED.map(|(n, d)| [n as f64, d]).to_vec();
    deviation.push(Series::new("paper", printed, Mark::Points));
    vec![
        Chart {
            title: "Bend: rubber, nylon and steel".to_owned(),
            x: Axis::linear("1/R through the centres (1/m)"),
            y: Axis::linear("M L/YI"),
            series: torque,
        },
        Chart {
            title: "Deviation of the radius at the full circle".to_owned(),
            x: Axis::log("N"),
            y: Axis::log("|R M/YI − 1|"),
            series: deviation,
        },
    ]
}
