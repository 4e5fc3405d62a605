//! Forward and backward substitution with a step's factor, for any vector.

use super::layout::{get, inverse_at, l_at, per_step, unroll, w_at};
use taut_lanes::Lanes;

/// y = L⁻¹ b.
#[inline(always)]
pub(super) fn lower_solve<V: Lanes, const B: usize>(step: &[f64], b: [V; B]) -> [V; B] {
    let step = &step[..per_step(B) * V::LANES];
    let mut y = b;
    unroll!(j < B, {
        unroll!(i < B, {
            if const { i > j } {
                let l: V = get(step, l_at(B, i, j));
                y[i] = l.neg_mul_add(y[j], y[i]);
            }
        });
    });
    y
}

/// D⁻¹ y.
#[inline(always)]
pub(super) fn scaled<V: Lanes, const B: usize>(step: &[f64], y: [V; B]) -> [V; B] {
    let step = &step[..per_step(B) * V::LANES];
    let mut z = y;
    unroll!(i < B, {
        z[i] = y[i] * get(step, inverse_at(B, i));
    });
    z
}

/// b − W y.
#[inline(always)]
pub(super) fn pass_on<V: Lanes, const B: usize>(step: &[f64], y: [V; B], b: [V; B]) -> [V; B] {
    let step = &step[..per_step(B) * V::LANES];
    let mut next = b;
    unroll!(j < B, {
        unroll!(i < B, {
            next[i] = get::<V>(step, w_at(B, i, j)).neg_mul_add(y[j], next[i]);
        });
    });
    next
}

/// L⁻ᵀ (z − Wᵀ next).
#[inline(always)]
pub(super) fn take_back<V: Lanes, const B: usize>(step: &[f64], z: [V; B], next: [V; B]) -> [V; B] {
    let step = &step[..per_step(B) * V::LANES];
    let mut x = z;
    // The first row of the next block is the last that is known.
    unroll!(i < B, down, {
        unroll!(j < B, {
            x[j] = get::<V>(step, w_at(B, i, j)).neg_mul_add(next[i], x[j]);
        });
    });
    upper_solve(step, x)
}

/// L⁻ᵀ x.
#[inline(always)]
pub(super) fn upper_solve<V: Lanes, const B: usize>(step: &[f64], x: [V; B]) -> [V; B] {
    let step = &step[..per_step(B) * V::LANES];
    let mut x = x;
    unroll!(i < B, down, {
        unroll!(j < i, {
            x[j] = get::<V>(step, l_at(B, i, j)).neg_mul_add(x[i], x[j]);
        });
    });
    x
}
