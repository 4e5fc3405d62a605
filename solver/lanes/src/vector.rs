//! Vectors of three numbers and small symmetric matrices whose components are lanes, and the way between them and arrays
//! of structures.
//!
//! No closure here, and none in kernels, computes with lanes: a closure has not the instructions of the function that it
//! stands in, and where it is not inlined each of its operations becomes a call.

use crate::Lanes;

/// Three numbers, each in lanes.
pub type Vec3<V> = [V; 3];

/// A symmetric 3×3 matrix: xx, yx, zx, yy, zy, zz.
pub type Sym3<V> = [V; 6];

/// A quaternion x i + y j + z k + w as \[x, y, z, w].
pub type Quaternion<V> = [V; 4];

/// The pair of `row` from `c` on.
#[inline(always)]
fn pair<const N: usize>(row: &[f64; N], c: usize) -> &[f64; 2] {
    row[c..].first_chunk().unwrap_or(&[0.0; 2])
}

/// Component by component from one array a lane.
#[must_use]
#[inline(always)]
pub fn gather<V: Lanes, const L: usize, const N: usize>(from: [&[f64; N]; L]) -> [V; N] {
    let mut to = [V::splat(0.0); N];
    let mut c = 0;
    while c + 2 <= N {
        let [first, second] = V::load_pairs(from.map(|row| pair(row, c)));
        (to[c], to[c + 1]) = (first, second);
        c += 2;
    }
    if c < N {
        to[c] = if c > 0 {
            let [_, last] = V::load_pairs(from.map(|row| pair(row, c - 1)));
            last
        } else {
            V::from_fn(|l| from[l][c])
        };
    }
    to
}

/// Component by component into memory.
#[must_use]
#[inline(always)]
pub fn save<V: Lanes, const L: usize, const N: usize>(from: &[V; N]) -> [[f64; L]; N] {
    let mut to = [[0.0; L]; N];
    for (from, to) in from.iter().zip(&mut to) {
        from.store(to);
    }
    to
}

/// Component by component from memory.
#[must_use]
#[inline(always)]
pub fn load<V: Lanes, const L: usize, const N: usize>(from: &[[f64; L]; N]) -> [V; N] {
    let mut to = [V::splat(0.0); N];
    for (from, to) in from.iter().zip(&mut to) {
        *to = V::load(from);
    }
    to
}

/// `x` in every lane.
#[must_use]
#[inline(always)]
pub fn splat<V: Lanes>(x: [f64; 3]) -> Vec3<V> {
    [V::splat(x[0]), V::splat(x[1]), V::splat(x[2])]
}

/// a + b.
#[must_use]
#[inline(always)]
pub fn add<V: Lanes>(a: &Vec3<V>, b: &Vec3<V>) -> Vec3<V> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b.
#[must_use]
#[inline(always)]
pub fn sub<V: Lanes>(a: &Vec3<V>, b: &Vec3<V>) -> Vec3<V> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a s.
#[must_use]
#[inline(always)]
pub fn scale<V: Lanes>(a: &Vec3<V>, s: V) -> Vec3<V> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// a s + b.
#[must_use]
#[inline(always)]
pub fn scale_add<V: Lanes>(a: &Vec3<V>, s: V, b: &Vec3<V>) -> Vec3<V> {
    [
        a[0].mul_add(s, b[0]),
        a[1].mul_add(s, b[1]),
        a[2].mul_add(s, b[2]),
    ]
}

/// a × b.
#[must_use]
#[inline(always)]
pub fn cross<V: Lanes>(a: &Vec3<V>, b: &Vec3<V>) -> Vec3<V> {
    [
        a[2].neg_mul_add(b[1], a[1] * b[2]),
        a[0].neg_mul_add(b[2], a[2] * b[0]),
        a[1].neg_mul_add(b[0], a[0] * b[1]),
    ]
}

/// a · b.
#[must_use]
#[inline(always)]
pub fn dot<V: Lanes>(a: &Vec3<V>, b: &Vec3<V>) -> V {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// Σ x_i column_i.
#[must_use]
#[inline(always)]
pub fn combine<V: Lanes>(columns: &[Vec3<V>; 3], x: &Vec3<V>) -> Vec3<V> {
    let first = scale(&columns[0], x[0]);
    scale_add(&columns[2], x[2], &scale_add(&columns[1], x[1], &first))
}

/// The columns of a symmetric matrix.
#[must_use]
#[inline(always)]
pub fn columns<V: Lanes>(a: &Sym3<V>) -> [Vec3<V>; 3] {
    [[a[0], a[1], a[2]], [a[1], a[3], a[4]], [a[2], a[4], a[5]]]
}

/// A x.
#[must_use]
#[inline(always)]
pub fn times<V: Lanes>(a: &Sym3<V>, x: &Vec3<V>) -> Vec3<V> {
    combine(&columns(a), x)
}

/// a d − b c.
#[inline(always)]
fn minor<V: Lanes>(a: V, b: V, c: V, d: V) -> V {
    b.neg_mul_add(c, a * d)
}

/// A⁻¹ and det A, by cofactors.
#[must_use]
#[inline(always)]
pub fn inverse<V: Lanes>(a: &Sym3<V>) -> (Sym3<V>, V) {
    let [xx, yx, zx, yy, zy, zz] = *a;
    let mut inverse = [
        minor(yy, zy, zy, zz),
        minor(zx, yx, zz, zy),
        minor(yx, yy, zx, zy),
        minor(xx, zx, zx, zz),
        minor(yx, xx, zy, zx),
        minor(xx, yx, yx, yy),
    ];
    let determinant = dot(&[xx, yx, zx], &[inverse[0], inverse[1], inverse[2]]);
    let reciprocal = V::splat(1.0) / determinant;
    for entry in &mut inverse {
        *entry = *entry * reciprocal;
    }
    (inverse, determinant)
}

/// The vector turned by the rotation of the unit quaternion: e + 2 q × (q × e + w e).
#[must_use]
#[inline(always)]
pub fn turned<V: Lanes>(q: &Quaternion<V>, e: &Vec3<V>) -> Vec3<V> {
    let imaginary = [q[0], q[1], q[2]];
    let inner = scale_add(e, q[3], &cross(&imaginary, e));
    scale_add(&cross(&imaginary, &inner), V::splat(2.0), e)
}

/// Columns of the rotation matrix of the unit quaternion.
#[must_use]
#[inline(always)]
pub fn rotation<V: Lanes>(q: &Quaternion<V>) -> [Vec3<V>; 3] {
    let [x, y, z, w] = *q;
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let one = V::splat(1.0);
    [
        [
            y2.neg_mul_add(y, z2.neg_mul_add(z, one)),
            x2.mul_add(y, z2 * w),
            x2.mul_add(z, -(y2 * w)),
        ],
        [
            x2.mul_add(y, -(z2 * w)),
            x2.neg_mul_add(x, z2.neg_mul_add(z, one)),
            y2.mul_add(z, x2 * w),
        ],
        [
            x2.mul_add(z, y2 * w),
            y2.mul_add(z, -(x2 * w)),
            x2.neg_mul_add(x, y2.neg_mul_add(y, one)),
        ],
    ]
}

/// The product a b: the rotation b, then a.
#[must_use]
#[inline(always)]
pub fn product<V: Lanes>(a: &Quaternion<V>, b: &Quaternion<V>) -> Quaternion<V> {
    let (u, v) = ([a[0], a[1], a[2]], [b[0], b[1], b[2]]);
    let [x, y, z] = scale_add(&v, a[3], &scale_add(&u, b[3], &cross(&u, &v)));
    [x, y, z, a[3] * b[3] - dot(&u, &v)]
}

/// The product ā b: the rotation that takes a to b, in a's axes.
#[must_use]
#[inline(always)]
pub fn relative<V: Lanes>(a: &Quaternion<V>, b: &Quaternion<V>) -> Quaternion<V> {
    let (u, v) = ([a[0], a[1], a[2]], [b[0], b[1], b[2]]);
    let [x, y, z] = scale_add(&v, a[3], &cross(&v, &u));
    [
        u[0].neg_mul_add(b[3], x),
        u[1].neg_mul_add(b[3], y),
        u[2].neg_mul_add(b[3], z),
        a[3].mul_add(b[3], dot(&u, &v)),
    ]
}

/// [`relative`] whose small components keep their digits: sums of two products are rounded once or twice (Kahan's
/// a b + c d with a fused product for what the first one lost).
#[must_use]
#[inline(always)]
pub fn relative_to_digits<V: Lanes>(a: &Quaternion<V>, b: &Quaternion<V>) -> Quaternion<V> {
    let sum = |a: V, b: V, c: V, d: V| {
        let first = a * b;
        let lost = a.mul_add(b, -first);
        c.mul_add(d, first) + lost
    };
    let ([p, q, r, s], [x, y, z, w]) = (*a, *b);
    [
        sum(s, x, -p, w) + sum(r, y, -q, z),
        sum(s, y, -q, w) + sum(p, z, -r, x),
        sum(s, z, -r, w) + sum(q, x, -p, y),
        sum(s, w, p, x) + sum(q, y, r, z),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Isa, Kernel, Level, dispatch};

    struct Identities;

    /// Largest entry.
    #[inline(always)]
    fn size<V: Lanes, const N: usize>(x: [V; N]) -> f64 {
        let mut largest = 0.0_f64;
        for x in x {
            largest = largest.max(x.abs().max_lane());
        }
        largest
    }

    impl Kernel for Identities {
        type Output = f64;

        #[inline(always)]
        fn run<I: Isa>(self) -> f64 {
            let a = [1.0, -2.0, 0.5, 0.25].map(|x| [x, 2.0 * x, x - 1.0, x + 3.0]);
            let [x, y, z, w]: [I::X4; 4] = load(&a);
            let (u, v) = ([x, y, z], [y, w, x]);
            let mut worst = dot(&cross(&u, &v), &u).abs().max_lane();
            // A⁻¹ A e = e.
            let m = [
                w + I::X4::splat(9.0),
                x,
                y,
                z + I::X4::splat(20.0),
                w,
                x + I::X4::splat(15.0),
            ];
            let (i, _) = inverse(&m);
            worst = worst.max(size(sub(&times(&i, &times(&m, &u)), &u)));
            // Matrix and quaternion turn alike, and products one after the other.
            let norm = (x * x + y * y + z * z + w * w).sqrt();
            let q = [x / norm, y / norm, z / norm, w / norm];
            let once = turned(&q, &v);
            worst = worst.max(size(sub(&combine(&rotation(&q), &v), &once)));
            let p = [q[1], q[0], q[3], q[2]];
            let twice = turned(&p, &once);
            worst = worst.max(size(sub(&turned(&product(&p, &q), &v), &twice)));
            let there = turned(&product(&p, &relative(&p, &q)), &v);
            let to_digits = turned(&product(&p, &relative_to_digits(&p, &q)), &v);
            worst = worst.max(size(sub(&to_digits, &once)));
            worst.max(size(sub(&there, &once)))
        }
    }

    #[test]
    fn identities_hold_to_rounding() {
        for level in Level::available() {
            let worst = dispatch(level, Identities);
            assert!(worst < 2e-14, "{level}: {worst}");
        }
    }
}
