//! Storage of a step of the elimination, each number for all lanes: W by columns, its last row apart where the
//! number of rows is odd; L (strictly lower triangle, by rows); 1/D. The mathematics is in the module above.

use std::slice::ChunksExact;
use taut_lanes::{Halves, Lanes};

/// Entries of a triangle of this many rows, with its diagonal.
const fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}

/// Vectors of a step: W, L and 1/D. An even number, so that pairs are aligned in all steps if they are in one.
pub(super) const fn per_step(size: usize) -> usize {
    (size * size + triangle(size)).next_multiple_of(2)
}

/// Where 1/Dᵢ is among the vectors of a step.
pub(super) const fn inverse_at(size: usize, i: usize) -> usize {
    size * size + triangle(size) - size + i
}

/// Where L_ij is, i > j.
pub(super) const fn l_at(size: usize, i: usize, j: usize) -> usize {
    size * size + y_at(i, j)
}

/// Where entry (i, j) is in a strictly lower triangle by rows.
pub(super) const fn y_at(i: usize, j: usize) -> usize {
    i * (i - 1) / 2 + j
}

/// Where W_ij is.
pub(super) const fn w_at(size: usize, i: usize, j: usize) -> usize {
    let paired = size / 2 * 2;
    if i < paired {
        j * paired + i
    } else {
        size * paired + j
    }
}

/// Where column `c` of step `t` begins in U, the columns of a border (`bordered`): its rows of the step, each for both
/// ends.
pub(super) const fn u_at(size: usize, columns: usize, t: usize, c: usize) -> usize {
    2 * size * (columns * t + c)
}

/// The columns of step `t` of U.
#[inline(always)]
pub(super) fn columns_of(u: &[f64], size: usize, columns: usize, t: usize) -> ChunksExact<'_, f64> {
    let of_step = u_at(size, columns, t, 0)..u_at(size, columns, t + 1, 0);
    u[of_step].chunks_exact(2 * size)
}

/// The body for i = 0, 1, … below a bound of at most six, written out; i and the bound are constants, so that nothing is
/// compiled of the bodies beyond it.
macro_rules! unroll {
    ($i:ident < $bound:expr, $body:block) => {
        $crate::chain::layout::unroll!(@ $i, $bound, $body, 0 1 2 3 4 5)
    };
    ($i:ident < $bound:expr, down, $body:block) => {
        $crate::chain::layout::unroll!(@ $i, $bound, $body, 5 4 3 2 1 0)
    };
    ($i:ident < $bound:expr, pairs, $body:block) => {
        $crate::chain::layout::unroll!(@ $i, $bound, $body, 0 1 2)
    };
    (@ $i:ident, $bound:expr, $body:block, $($value:literal)*) => {$(
        #[allow(non_upper_case_globals, unused_comparisons, clippy::absurd_extreme_comparisons)]
        {
            const $i: usize = $value;
            if const { $i < $bound } {
                $body
            }
        }
    )*};
}
pub(super) use unroll;

/// Number `at` of a list of vectors.
#[inline(always)]
pub(super) fn get<V: Lanes>(v: &[f64], at: usize) -> V {
    V::load(&v[at * V::LANES..])
}

/// Vector of two halves from a list of halves, beginning with half `at`.
#[inline(always)]
pub(super) fn pair<Q: Halves>(v: &[f64], at: usize) -> Q {
    Q::load(&v[at * Q::Half::LANES..])
}

#[inline(always)]
pub(super) fn put<V: Lanes>(x: V, v: &mut [f64], at: usize) {
    x.store(&mut v[at * V::LANES..]);
}

#[inline(always)]
pub(super) fn put_pair<Q: Halves>(x: Q, v: &mut [f64], at: usize) {
    x.store(&mut v[at * Q::Half::LANES..]);
}
