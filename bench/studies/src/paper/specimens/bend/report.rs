//! The specimen beside theory and the paper's numbers: checks, tables, charts.

use super::Row;
use super::plane::stability_of_the_plane;
use super::shape::{MEASURES, PUBLISHED, deviations};
use crate::paper::specimens::{BAR, Joint, MATERIALS, SEGMENTS, largest, order};
use std::f64::consts::TAU;
use taut_output::check::{Check, ExperimentError, Measure, Verdict};
use taut_output::plot::{Axis, Chart, Mark, Series};
use taut_output::table::{error, table, text};

/// The specimens beside the exact polygon, the circle and the paper's deviations.
pub(super) fn checks(rows: &[Row]) -> Result<Vec<Check>, ExperimentError> {
    let mut checks = Vec::new();
    for (material, _) in MATERIALS {
        let of = |measure: fn(&Row) -> f64| {
            largest(rows.iter().filter(|r| r.material == material).map(measure))
        };
        let row = |what: &str, reference: &str, error: f64| {
            let case = format!("bend, {material}: {what}");
            Check::off(case, reference, error, "", BAR).by(
                "largest error over N, joints, directions of the moment and loads to the circle",
            )
        };
        checks.push(row("angle of a joint", "M l/YI", of(|r| r.angle_error)));
        // A zero takes the rows of the other directions out of the maximum.
        checks.push(row("end of the cable, over L", "polygon", {
            of(|r| {
                if r.direction_rad == 0.0 {
                    r.tip_error
                } else {
                    0.0
                }
            })
        }));
        checks.push(row("end, moment at 45°, to ¾ circle", "polygon", {
            of(|r| {
                if r.direction_rad == 0.0 {
                    0.0
                } else {
                    r.tip_error
                }
            })
        }));
    }
    let closing = largest(
        rows.iter()
            .filter(|r| (r.angle_theory - TAU).abs() < 1e-9 && r.direction_rad == 0.0)
            .map(|r| r.tip_from_arc),
    );
    checks.push(
        Check::off(
            "bend: M = 2π YI/L closes",
            "a closed circle",
            closing,
            "L",
            BAR,
        )
        .by("distance of the ends over L, for every N, moment along an axis of the section"),
    );
    let full = |measure: fn(&Row) -> f64| deviations(rows, TAU, measure);
    let quarter = |measure: fn(&Row) -> f64| deviations(rows, 0.25 * TAU, measure);
    for (name, measure, expected) in MEASURES {
        let finest: Vec<_> = quarter(measure).into_iter().filter(|d| d.0 >= 12).collect();
        let found = order(&finest).unwrap_or(f64::NAN);
        checks.push(
            Check::number(
                format!("bend: order in N, {name}"),
                [expected, found],
                "",
                Measure::Absolute,
                0.1,
            )
            .by("order of the radius' deviation from YI/M, N = 12 to 24, a quarter of a circle"),
        );
    }
    checks.extend(published(&full));
    checks.push(stability_of_the_plane()?);
    Ok(checks)
}

fn published(full: &impl Fn(fn(&Row) -> f64) -> Vec<(usize, f64)>) -> Vec<Check> {
    let at = |measure, n: usize| {
        let all = full(measure);
        all.iter()
            .find(|d| d.0 == n)
            .map_or(f64::NAN, |d| d.1.abs())
    };
    let mut checks = Vec::new();
    for (n, printed) in PUBLISHED {
        let ours = at(MEASURES[0].1, n);
        let note = "the deviation depends on where the radius is measured; see the orders";
        checks.push(
            Check::relative(format!("bend: deviation at N = {n}"), [printed, ours].map(|d| 100.0 * d), "%", 0.25)
            .published()
            .by("relative difference of the deviations; radius through the segments' centres at the full circle")
            .noting(note),
        );
    }
    let misfit = |measure| {
        let ratios = PUBLISHED.map(|(n, printed)| (at(measure, n) / printed).ln().abs());
        ratios[0].max(ratios[1])
    };
    let best = MEASURES
        .iter()
        .min_by(|a, b| misfit(a.1).total_cmp(&misfit(b.1)));
    if let Some((name, measure, _)) = best {
        let [a, b] = PUBLISHED.map(|(n, _)| 100.0 * at(*measure, n));
        let factor = misfit(*measure).exp();
        let verdict = Verdict::either(factor <= 1.2, [Verdict::HoldsOnlyIf, Verdict::DoesNotHold]);
        checks.push(Check::claim(
            "bend: the measure nearest to the paper's",
            "10 %, 2.5 % at N = 6, 24",
            format!("{name}: {a:.1} %, {b:.2} %"),
            verdict,
            "10 % to 2.5 % over four times the segments is first order: the cable's end half segments are left out of \
             the bending; with end joints of half a segment's compliance the deviation is of second order",
        ));
    }
    checks
}

pub(super) fn tables(rows: &[Row]) -> String {
    let mut t = table(&[
        "radius of steel at the full circle",
        "N = 3",
        "6",
        "12",
        "24",
        "order, 12 to 24",
    ]);
    for (name, measure, _) in MEASURES {
        let found = deviations(rows, TAU, measure);
        let mut cells = vec![name.to_owned()];
        for n in SEGMENTS {
            let cell = found.iter().find(|d| d.0 == n);
            cells.push(cell.map_or_else(String::new, |d| format!("{:+.2} %", 100.0 * d.1)));
        }
        let finest: Vec<_> = found.into_iter().filter(|d| d.0 >= 12).collect();
        cells.push(order(&finest).map_or_else(String::new, |p| format!("{p:.2}")));
        t.add_row(cells);
    }
    let mut e = table(&[
        "joint",
        "N",
        "direction",
        "joint angle error",
        "tip error / L",
    ]);
    for group in rows.chunk_by(|a, b| {
        (&a.material, a.segments, &a.joint, a.direction_rad)
            == (&b.material, b.segments, &b.joint, b.direction_rad)
    }) {
        let Some(last) = group.last().filter(|r| r.material == MATERIALS[2].0) else {
            continue;
        };
        e.add_row([
            last.joint.clone(),
            last.segments.to_string(),
            format!("{:.0}°", last.direction_rad.to_degrees()),
            error(Some(largest(group.iter().map(|r| r.angle_error)))),
            error(Some(largest(group.iter().map(|r| r.tip_error)))),
        ]);
    }
    format!("{}\nsteel, largest over all loads\n{}", text(&t), text(&e))
}

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
