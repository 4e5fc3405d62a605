//! The way between lanes and rows, which stand one after the other.

use crate::six::Group;
use nalgebra::{Matrix3, UnitQuaternion};
use taut_lanes::Lanes;
use taut_lanes::vector::{Vec3, gather, load, save, turned};
use taut_model::{ABREAST, Four, Places};

/// Rows of four joints that have 6 each.
const RUN: usize = 6 * ABREAST;

/// The bodies of one side of four joints.
#[inline(always)]
pub(crate) fn side(places: &Places, side: usize) -> Group {
    Group::new(places.bodies[side], places.neighbours[side])
}

/// The rows of four joints; zeros for those that they do not have.
#[inline(always)]
pub(crate) fn of_rows<V: Lanes>(from: &[f64], places: &Places) -> [V; 6] {
    if let Some(first) = places.run
        && let Some(rows) = from[first..].first_chunk::<RUN>()
        && let ([a, b, c, d], []) = rows.as_chunks::<6>()
    {
        return gather([a, b, c, d]);
    }
    let mut lanes = [[0.0; ABREAST]; 6];
    for lane in 0..places.count {
        let rows = &from[places.row[lane]..][..places.rows[lane]];
        for (to, from) in lanes.iter_mut().zip(rows) {
            to[lane] = *from;
        }
    }
    let last = places.count - 1;
    for number in &mut lanes {
        let copied = number[last];
        number[last..].fill(copied);
    }
    load(&lanes)
}

/// Writes the rows of four joints.
#[inline(always)]
pub(crate) fn write_rows<V: Lanes>(from: &[V; 6], rows: &mut [f64], places: &Places) {
    if let Some(first) = places.run
        && let Some(rows) = rows[first..].first_chunk_mut::<RUN>()
    {
        return V::scatter(from, rows, [0, 6, 12, 18]);
    }
    let from: [Four; 6] = save(from);
    for lane in 0..places.count {
        let rows = &mut rows[places.row[lane]..][..places.rows[lane]];
        for (r, from) in rows.iter_mut().zip(&from) {
            *r = from[lane];
        }
    }
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
