//! The exact discrete specimen: a polygon in the plane across the moment.

use nalgebra::{UnitQuaternion, Vector3};
use taut_model::{ResolvedSpecimen, SpecimenParams};

/// The axis of the moment.
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
