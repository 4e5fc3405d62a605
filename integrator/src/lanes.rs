//! The way between lanes and rows, which stand one after the other.

use crate::six::Group;
use nalgebra::{Matrix3, UnitQuaternion};
use std::array::from_fn;
use taut_lanes::Lanes;
use taut_lanes::vector::{Vec3, gather, load, save, turned};
use taut_model::{ABREAST, Four, Places};

static NOTHING: [f64; 6] = [0.0; 6];

/// The bodies of one side of four joints.
#[inline(always)]
pub(crate) fn side(places: &Places, side: usize) -> Group {
    Group::new(places.bodies[side], places.neighbours[side])
}

/// The rows of four joints; zeros for those that they do not have.
#[inline(always)]
pub(crate) fn of_rows<V: Lanes>(from: &[f64], places: &Places) -> [V; 6] {
    if places.six {
        return gather(
            places
                .row
                .map(|s| from[s..s + 6].first_chunk().unwrap_or(&NOTHING)),
        );
    }
    let rows: [[f64; 6]; ABREAST] = from_fn(|l| {
        let mut row = NOTHING;
        let (start, count) = (places.row[l], places.rows[l]);
        row[..count].copy_from_slice(&from[start..start + count]);
        row
    });
    gather(rows.each_ref())
}

/// Writes the rows of four joints.
#[inline(always)]
pub(crate) fn write_rows<V: Lanes>(from: &[V; 6], rows: &mut [f64], places: &Places) {
    if places.six {
        return V::scatter(from, rows, places.row);
    }
    let from: [Four; 6] = save(from);
    for lane in 0..ABREAST {
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
