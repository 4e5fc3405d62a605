//! The radius of steel at the full circle, and the errors of its joints and its end, as text.

use super::Row;
use super::measures::{MEASURES, deviations};
use crate::paper::specimens::{MATERIALS, SEGMENTS, largest, order};
use std::f64::consts::TAU;
use taut_output::table::{error, table, text};

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
