//! Forward and backward substitution with a step's factor, for any vector.

use super::layout::{inverse_at, l_at, per_step, unroll, w_at};
use taut_lanes::{Halves, Lanes};

/// The numbers of a step, as vectors.
pub(super) trait Numbers<V>: Copy {
    /// The numbers before index `end`. One bounds check then serves all of them.
    fn until(self, end: usize) -> Self;

    /// The number at that place.
    fn get(self, at: usize) -> V;
}

/// A number for each lane.
impl<V: Lanes> Numbers<V> for &[f64] {
    #[inline(always)]
    fn until(self, end: usize) -> Self {
        &self[..end * V::LANES]
    }
    #[inline(always)]
    fn get(self, at: usize) -> V {
        super::layout::get(self, at)
    }
}

/// A number for each lane of a half, the same in both.
#[derive(Debug, Clone, Copy)]
pub(super) struct InBoth<'a>(pub(super) &'a [f64]);

impl<V: Halves> Numbers<V> for InBoth<'_> {
    #[inline(always)]
    fn until(self, end: usize) -> Self {
        Self(&self.0[..end * V::Half::LANES])
    }
    #[inline(always)]
    fn get(self, at: usize) -> V {
        V::both(super::layout::get(self.0, at))
    }
}

/// y = L⁻¹ b.
#[inline(always)]
pub(super) fn lower_solve<V: Lanes, const B: usize>(step: impl Numbers<V>, b: [V; B]) -> [V; B] {
    let step = step.until(per_step(B));
    let mut y = b;
    unroll!(j < B, {
        unroll!(i < B, {
            if const { i > j } {
                y[i] = step.get(l_at(B, i, j)).neg_mul_add(y[j], y[i]);
            }
        });
    });
    y
}

/// D⁻¹ y.
#[inline(always)]
pub(super) fn scaled<V: Lanes, const B: usize>(step: impl Numbers<V>, y: [V; B]) -> [V; B] {
    let step = step.until(per_step(B));
    let mut z = y;
    unroll!(i < B, {
        z[i] = y[i] * step.get(inverse_at(B, i));
    });
    z
}

/// b − W y.
#[inline(always)]
pub(super) fn pass_on<V: Lanes, const B: usize>(
    step: impl Numbers<V>,
    y: [V; B],
    b: [V; B],
) -> [V; B] {
    let step = step.until(per_step(B));
    let mut next = b;
    unroll!(j < B, {
        unroll!(i < B, {
            next[i] = step.get(w_at(B, i, j)).neg_mul_add(y[j], next[i]);
        });
    });
    next
}

/// L⁻ᵀ (z − Wᵀ next).
#[inline(always)]
pub(super) fn take_back<V: Lanes, const B: usize>(
    step: impl Numbers<V>,
    z: [V; B],
    next: [V; B],
) -> [V; B] {
    let step = step.until(per_step(B));
    let mut x = z;
    // The first row of the next block is the last that is known.
    unroll!(i < B, down, {
        unroll!(j < B, {
            x[j] = step.get(w_at(B, i, j)).neg_mul_add(next[i], x[j]);
        });
    });
    upper_solve(step, x)
}

/// L⁻ᵀ x.
#[inline(always)]
pub(super) fn upper_solve<V: Lanes, const B: usize>(step: impl Numbers<V>, x: [V; B]) -> [V; B] {
    let step = step.until(per_step(B));
    let mut x = x;
    unroll!(i < B, down, {
        unroll!(j < i, {
            x[j] = step.get(l_at(B, i, j)).neg_mul_add(x[i], x[j]);
        });
    });
    x
}
