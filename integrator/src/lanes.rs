//! Small vectors whose components are lanes, and the way between them and arrays of structures.

use nalgebra::UnitQuaternion;
use std::array::from_fn;
use taut_lanes::Lanes;
use taut_model::{ABREAST, Four};

/// Three numbers, each in lanes.
pub(crate) type Vec3<V> = [V; 3];

/// A symmetric 3×3 matrix: xx, yx, zx, yy, zy, zz.
pub(crate) type Sym3<V> = [V; 6];

/// What stands for a body that is not there: at rest, immovable.
pub(crate) static NOTHING: [f64; 6] = [0.0; 6];

/// Six numbers of each of four bodies; zeros for the world.
#[inline(always)]
pub(crate) fn of_bodies<V: Lanes>(from: &[[f64; 6]], bodies: [usize; ABREAST]) -> [V; 6] {
    gather(bodies.map(|i| from.get(i).unwrap_or(&NOTHING)))
}

/// Component by component from one array a lane.
#[inline(always)]
pub(crate) fn gather<V: Lanes, const N: usize>(from: [&[f64; N]; ABREAST]) -> [V; N] {
    from_fn(|c| V::from_fn(|l| from[l][c]))
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

#[inline(always)]
pub(crate) fn save<V: Lanes, const N: usize>(from: &[V; N]) -> [Four; N] {
    from_fn(|i| {
        let mut to = [0.0; ABREAST];
        from[i].store(&mut to);
        to
    })
}

#[inline(always)]
pub(crate) fn load<V: Lanes, const N: usize>(from: &[Four; N]) -> [V; N] {
    from_fn(|i| V::load(&from[i]))
}

/// a × b.
#[inline(always)]
pub(crate) fn cross<V: Lanes>(a: &Vec3<V>, b: &Vec3<V>) -> Vec3<V> {
    let minor = |i: usize, j: usize| a[j].neg_mul_add(b[i], a[i] * b[j]);
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

#[inline(always)]
pub(crate) fn dot<V: Lanes>(a: &Vec3<V>, b: &Vec3<V>) -> V {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// A x.
#[inline(always)]
pub(crate) fn times<V: Lanes>(a: &Sym3<V>, x: &Vec3<V>) -> Vec3<V> {
    let row = |i: usize, j: usize, k: usize| a[k].mul_add(x[2], a[j].mul_add(x[1], a[i] * x[0]));
    [row(0, 1, 2), row(1, 3, 4), row(2, 4, 5)]
}

/// R e for a constant vector e and the rotation R of the quaternion w + xi + yj + zk: e + 2 q × (q × e + w e).
#[inline(always)]
pub(crate) fn turned<V: Lanes>(q: &[V; 4], e: &Vec3<V>) -> Vec3<V> {
    let [x, y, z, w] = *q;
    let q = [x, y, z];
    let inner = cross(&q, e);
    let inner: Vec3<V> = from_fn(|i| w.mul_add(e[i], inner[i]));
    let outer = cross(&q, &inner);
    from_fn(|i| (outer[i] + outer[i]) + e[i])
}

/// An axis of four bodies in the world frame.
#[inline(always)]
pub(crate) fn axis<V: Lanes>(
    orientation: [&UnitQuaternion<f64>; ABREAST],
    axis: &[Four; 3],
) -> Vec3<V> {
    let q: [V; 4] = from_fn(|c| V::from_fn(|l| orientation[l].coords[c]));
    turned(&q, &load(axis))
}

/// A⁻¹ and det A, by cofactors.
#[inline(always)]
pub(crate) fn inverse<V: Lanes>(a: &Sym3<V>) -> (Sym3<V>, V) {
    let [xx, yx, zx, yy, zy, zz] = *a;
    let minor = |a: V, b: V, c: V, d: V| b.neg_mul_add(c, a * d);
    let cofactors = [
        minor(yy, zy, zy, zz),
        minor(zx, yx, zz, zy),
        minor(yx, yy, zx, zy),
        minor(xx, zx, zx, zz),
        minor(yx, xx, zy, zx),
        minor(xx, yx, yx, yy),
    ];
    let determinant = zx.mul_add(cofactors[2], yx.mul_add(cofactors[1], xx * cofactors[0]));
    let reciprocal = V::splat(1.0) / determinant;
    (cofactors.map(|c| c * reciprocal), determinant)
}
