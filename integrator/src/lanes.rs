//! The way between lanes and what scenes are stored as: 6 numbers a body, rows one after the other.

use nalgebra::{Matrix3, UnitQuaternion};
use std::array::from_fn;
use taut_lanes::Lanes;
use taut_lanes::vector::{Sym3, Vec3, gather, load, turned};
use taut_model::{ABREAST, Four};

/// What stands for a body that is not there: at rest, immovable.
static NOTHING: [f64; 6] = [0.0; 6];

/// Six numbers of each of four bodies; zeros for the world.
#[inline(always)]
pub(crate) fn of_bodies<V: Lanes>(from: &[[f64; 6]], bodies: [usize; ABREAST]) -> [V; 6] {
    gather(bodies.map(|i| from.get(i).unwrap_or(&NOTHING)))
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

/// The entries of symmetric matrices in the order of [`Sym3`].
#[inline(always)]
pub(crate) fn symmetric<V: Lanes>(at: [&Matrix3<f64>; ABREAST]) -> Sym3<V> {
    const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 0), (2, 0), (1, 1), (2, 1), (2, 2)];
    let mut to = [V::splat(0.0); 6];
    for (to, (i, j)) in to.iter_mut().zip(ENTRIES) {
        *to = V::from_fn(|l| at[l][(i, j)]);
    }
    to
}

/// One lane of a symmetric matrix.
#[inline(always)]
pub(crate) fn matrix(of: &[Four; 6], lane: usize) -> Matrix3<f64> {
    let [xx, yx, zx, yy, zy, zz] = of.map(|x| x[lane]);
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
