//! The way between lanes and what scenes are stored as: 6 numbers a body, rows one after the other.

use nalgebra::{Matrix3, UnitQuaternion};
use std::array::from_fn;
use taut_lanes::Lanes;
use taut_lanes::vector::{Vec3, gather, load, turned};
use taut_model::{ABREAST, Four, Joint};

/// What stands for a body that is not there: at rest, immovable.
static NOTHING: [f64; 6] = [0.0; 6];

/// Six numbers of each of four bodies; zeros for the world.
#[inline(always)]
pub(crate) fn of_bodies<V: Lanes>(from: &[[f64; 6]], bodies: [usize; ABREAST]) -> [V; 6] {
    gather(bodies.map(|i| from.get(i).unwrap_or(&NOTHING)))
}

/// Where each lane's six numbers are on a side's body; those of the world come after the last body's.
#[inline(always)]
pub(crate) fn places(joints: &[Joint; ABREAST], side: usize) -> [usize; ABREAST] {
    joints.each_ref().map(|j| 6 * j.bodies[side])
}

/// Up to six consecutive numbers of each lane from `start`; zeros beyond `count`.
#[inline(always)]
pub(crate) fn of_rows<V: Lanes>(
    from: &[f64],
    start: [usize; ABREAST],
    count: [usize; ABREAST],
) -> [V; 6] {
    if count == [6; ABREAST] {
        return gather(start.map(|s| from[s..].first_chunk().unwrap_or(&NOTHING)));
    }
    let rows: [[f64; 6]; ABREAST] = from_fn(|l| {
        let mut row = NOTHING;
        row[..count[l]].copy_from_slice(&from[start[l]..start[l] + count[l]]);
        row
    });
    gather(rows.each_ref())
}

/// The six numbers of a symmetric matrix, xx, yx, zx, yy, zy, zz.
pub(crate) fn packed(a: &Matrix3<f64>) -> [f64; 6] {
    [a.m11, a.m21, a.m31, a.m22, a.m32, a.m33]
}

/// The matrix of six numbers.
pub(crate) fn unpacked([xx, yx, zx, yy, zy, zz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, yx, zx, yx, yy, zy, zx, zy, zz)
}

/// An axis of four bodies in the world frame.
#[inline(always)]
pub(crate) fn axis<V: Lanes>(
    orientation: [&UnitQuaternion<f64>; ABREAST],
    axis: &[Four; 3],
) -> Vec3<V> {
    turned(&gather(orientation.map(|q| q.coords.as_ref())), &load(axis))
}
