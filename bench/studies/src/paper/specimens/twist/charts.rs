//! Fig. 11 at rest, and the twist that bending reads as.

use super::{FARTHEST, Leak, Row};
use crate::paper::specimens::{Joint, SEGMENTS};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use taut_output::plot::{Axis, Chart, Mark, Series};

pub(super) fn at_rest(rows: &[Row]) -> Chart {
    let line = vec![[0.0, 0.0], [FARTHEST, FARTHEST]];
    let mut series = vec![Series::new("theory", line, Mark::Line)];
    for n in SEGMENTS {
        let of = rows
            .iter()
            .filter(|r| r.segments == n && r.joint == Joint::Cosserat.name());
        let points = of.map(|r| [r.twist, r.twist_theory]).collect();
        series.push(Series::new(format!("N = {n}"), points, Mark::Points));
    }
    Chart {
        title: "Twist at rest".to_owned(),
        x: Axis::linear("Ω (rad)"),
        y: Axis::linear("T L/GJ (rad)"),
        series,
    }
}

pub(super) fn of_leaks(leaks: &[Leak]) -> Chart {
    let mut series = Vec::new();
    for direction in [0.0, FRAC_PI_4, FRAC_PI_2] {
        let of: Vec<&Leak> = leaks
            .iter()
            .filter(|l| l.direction_rad == direction)
            .collect();
        let degrees = direction.to_degrees();
        for (name, reading) in [
            ("ordinary", (|l| l.ordinary.abs()) as fn(&Leak) -> f64),
            ("alternative", |l| l.alternative.abs()),
        ] {
            let points: Vec<[f64; 2]> = of.iter().map(|l| [l.theta, reading(l)]).collect();
            if points.iter().any(|p| p[1] > 1e-9) {
                let name = format!("{name}, bent {degrees:.0}° from v");
                series.push(Series::new(name, points, Mark::LineAndPoints));
            }
        }
    }
    Chart {
        title: "Bending in the twist angle".to_owned(),
        x: Axis::log("θ (rad)"),
        y: Axis::log("|Ω| (rad)"),
        series,
    }
}
