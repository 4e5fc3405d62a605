//! The exact discrete specimen, a polygon in the plane across the moment; what is measured of a bent one, and the radius
//! in its several senses.
//!
//! ```text
//! through the segments' centres      l/(2 tan ½θ) = R (1 − θ²/12 − …)     second order in N
//! through the joints                 l/(2 sin ½θ) = R (1 + θ²/24 + …)     second order
//! length L over the angle between clamp and last segment, (N − ½) θ       R (1 + 1/(2N − 1)): first order
//! length L over the angle between first and last segment, (N − 1) θ       R (1 + 1/(N − 1)): first order
//! ```
//!
//! The last two leave out the half segments beyond the outer joints, as a cable without end joints does.

use crate::paper::specimens::{MATERIALS, off_exact};
use crate::paper::words::number;
use crate::rest::{Reading, read};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};
use taut_model::{ResolvedSpecimen, Scene, SpecimenParams};

pub(super) fn axis(params: &SpecimenParams) -> Vector3<f64> {
    let (sine, cosine) = params.moment_direction.sin_cos();
    Vector3::new(0.0, sine, cosine)
}

/// Centres and rotations of the exact discrete specimen bent by `angle` about `axis`; the grip comes last.
pub(super) fn polygon(
    specimen: &ResolvedSpecimen,
    axis: &Vector3<f64>,
    angle: f64,
) -> (Vec<Vector3<f64>>, Vec<UnitQuaternion<f64>>) {
    let (n, l) = (specimen.segments, specimen.segment_length);
    let turn = |a: f64| UnitQuaternion::from_scaled_axis(axis * a);
    let (mut positions, mut turns) = (Vec::new(), Vec::new());
    let mut end = Vector3::zeros();
    for i in 0..n {
        let turned = turn(angle * (i as f64 + 0.5) / n as f64);
        let side = turned * Vector3::x() * l;
        positions.push(end + 0.5 * side);
        turns.push(turned);
        end += side;
    }
    positions.push(end);
    turns.push(turn(angle));
    (positions, turns)
}

/// The largest relative error of a joint's angle against M l_j/YI; the distances of the grip from where the polygon leads it
/// and from the end of the continuum's arc, over L; the radius through the segments' centres; and its deviations from YI/M
/// by [`MEASURES`].
pub(super) fn measure(
    scene: &Scene,
    specimen: &ResolvedSpecimen,
    axis: &Vector3<f64>,
    angle: f64,
) -> Value {
    let n = specimen.segments;
    let length = specimen.segment_length * n as f64;
    let joints = read(scene, n);
    let exact = |j: usize| angle * specimen.joint_length(j) / length;
    let tip = scene.bodies.position[n];
    let discrete = polygon(specimen, axis, angle).0[n];
    let radius = length / angle;
    let arc = Vector3::x() * (radius * angle.sin())
        + axis.cross(&Vector3::x()) * (radius * (1.0 - angle.cos()));
    let found = radius_of_centres(&scene.bodies.position[..n]);
    // The angle between two segments is that of the joints between them.
    let between = |joints: &[Reading]| joints.iter().map(|r| r.bend).sum::<f64>();
    let deviation = |found: f64| found / radius - 1.0;
    json!({
        "angle_error": off_exact(&joints, |r| r.bend, exact),
        "tip_error": (tip - discrete).norm() / length,
        "tip_from_arc": (tip - arc).norm() / length,
        "radius_m": found,
        "radius_deviation": deviation(found),
        "half_missing_deviation": deviation(length / between(&joints[..n])),
        "ends_missing_deviation": deviation(length / between(&joints[1..n])),
    })
}

/// Radius of the circle through the three middle ones of some points \[m].
fn radius_of_centres(points: &[Vector3<f64>]) -> f64 {
    // Neighbours: on a full circle the outer points come together.
    let middle = points.len() / 2;
    let (a, b, c) = (points[middle - 1], points[middle], points[middle + 1]);
    let (p, q) = (b - a, c - b);
    let area = p.cross(&q).norm();
    p.norm() * q.norm() * (c - a).norm() / (2.0 * area)
}

/// Deviations of one measure at one angle over N: steel, Cosserat joint, in the plane.
pub fn deviations(rows: &[Value], angle: f64, measure: &str) -> Vec<(usize, f64)> {
    let in_plane = |r: &&Value| r["joint"] == "cosserat" && r["direction_rad"] == 0.0;
    let is_at = |r: &&Value| (number(r, "angle_theory") - angle).abs() < 1e-9;
    let steel = |r: &&Value| r["material"] == MATERIALS[2].0 && is_at(r);
    let rows = rows.iter().filter(in_plane).filter(steel);
    rows.map(|r| (number(r, "segments") as usize, number(r, measure)))
        .collect()
}

/// The measures of the radius: name, key of its deviation, order expected.
pub(super) const MEASURES: [(&str, &str, f64); 3] = [
    ("through the centres", "radius_deviation", 2.0),
    (
        "L/angle, half a segment missing",
        "half_missing_deviation",
        1.0,
    ),
    ("L/angle, both ends missing", "ends_missing_deviation", 1.0),
];
