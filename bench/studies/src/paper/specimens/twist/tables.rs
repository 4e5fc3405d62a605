//! What was found as text: errors at rest, Greenhill's turns, the runs in motion, the readings of bent joints.

use super::Results;
use super::buckling::{SLENDERNESS, buckling_torque, greenhill, turns};
use crate::paper::specimens::{MATERIALS, SEGMENTS, largest};
use taut_output::table::{error, table, text};

pub(super) fn tables(results: &Results) -> String {
    let mut rest = table(&["at rest", "N", "joint angle error", "total error", "to rad"]);
    for group in results
        .rows
        .chunk_by(|a, b| (&a.material, a.segments, &a.joint) == (&b.material, b.segments, &b.joint))
    {
        let Some(last) = group.last().filter(|r| r.material == MATERIALS[2].0) else {
            continue;
        };
        rest.add_row([
            format!("{}, {}", last.material, last.joint),
            last.segments.to_string(),
            error(Some(largest(group.iter().map(|r| r.angle_error)))),
            error(Some(largest(group.iter().map(|r| r.total_error)))),
            format!("{:.1}", last.twist),
        ]);
    }
    let mut limits = table(&[
        "Greenhill's turns, ends held",
        "N = 3",
        "6",
        "12",
        "24",
        "rod",
    ]);
    let mut cells = vec!["chain of segments".to_owned()];
    cells.extend(SEGMENTS.map(|n| format!("{:.2}", turns(buckling_torque(n, SLENDERNESS, 0.0)))));
    cells.push(format!("{:.2}", turns(greenhill())));
    limits.add_row(cells);
    let mut motion = table(&[
        "steel in motion",
        "N",
        "step",
        "1/Δt Hz",
        "4YI P/T²",
        "disturbed",
        "straight to",
        "to turn",
        "at s",
        "",
        "off axis",
        "redone",
    ]);
    for h in &results.held {
        let end = match (h.straight, h.lost) {
            (true, _) => "straight",
            (_, true) => "lost",
            _ => "wavers",
        };
        motion.add_row([
            h.joint.clone(),
            h.segments.to_string(),
            h.step.clone(),
            format!("{:.0}", 1.0 / h.dt),
            format!("{}", h.tension),
            if h.disturbed { "yes" } else { "no" }.to_owned(),
            format!("{:.2}", h.straight_to),
            format!("{:.2}", h.turns),
            format!("{:.1}", h.time_s),
            end.to_owned(),
            format!("{:.0e}", h.off_axis_m),
            h.redone.to_string(),
        ]);
    }
    let mut leak = table(&[
        "bent by θ",
        "axis from v",
        "cosserat",
        "ordinary",
        "alternative",
    ]);
    for l in &results.leaks {
        leak.add_row([
            format!("{}", l.theta),
            format!("{:.0}°", l.direction_rad.to_degrees()),
            format!("{:.1e}", l.cosserat),
            format!("{:.6}", l.ordinary),
            format!("{:.6}", l.alternative),
        ]);
    }
    let motion = format!(
        "disturbed: by 0.01 N sideways; straight to: last turn within 1e-4 m of the axis; lost: 1e-2 m off it or a joint\n\
         open; wavers: neither; redone: steps that the guard took back; stiffened: linearly implicit, geometric stiffness of\n\
         weight 1; P: tension, T: torque\n{}",
        text(&motion)
    );
    let parts = [text(&rest), text(&limits), motion, text(&leak)];
    parts.join("\n")
}
