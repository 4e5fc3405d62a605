//! One step of the elimination of a chain, for any vector: its lanes are chains of their own.
//!
//! A step factorises a diagonal block, S = L D Lᵀ, and eliminates it. With its coupling E to the next block A, the
//! columns X = E L⁻ᵀ and W = X D⁻¹ follow, and A − X Wᵀ is what the next step begins with. The work is ordered pivot by
//! pivot. While the reciprocal of one is on its way, which takes as long as dozens of products, its columns of L D and
//! of X are formed; with it those of L and W, and what they take away from the next block. A pivot d − y² (1/d′) waits
//! for the reciprocal before it with one multiply-add only, since the square is formed beforehand; so does the first
//! pivot of the next block.
//!
//! In W and in the next block two rows stand side by side in a vector of twice the lanes ([`Halves`]), the last one
//! alone where their number is odd: half the instructions, or where there are no such vectors, every factor is loaded
//! once for two rows. The next block is kept as the diagonals and the antidiagonals of blocks of two rows and columns,
//! for then two rows of X and two of W make two products with one exchange of halves.
//!
//! Loads are nearly free beside all this, stores are not: one takes the time of a multiply-add or two (measured on AMD
//! Zen 3). So registers hold the next block until it is done, and L D lies in memory besides what is stored anyway
//! ([`Scratch`]). The compiler would rather carry everything in registers, and store what there are no registers for:
//! at a [`fence`] it gives that up. All loops are written out ([`unroll`]), so that it sees indices into local arrays as
//! constants.

use super::layout::{get, inverse_at, l_at, pair, per_step, put, put_pair, unroll, w_at, y_at};
use crate::kernels::Scalar;
use std::sync::atomic::{Ordering, compiler_fence};
use taut_lanes::{Halves, Lanes};

/// Below this the squares that pivots are made of lose digits to underflow.
const TINY: f64 = 1e-120;

/// Where a step finds its blocks: rows i and i + 1 side by side, or one alone.
pub(super) trait Blocks<Q: Halves, const B: usize> {
    /// Diagonal entry i of the block that is eliminated, before anything was subtracted from it.
    fn own(&self, i: usize) -> Q::Half;
    /// Entry (i, j) of the lower triangle of the next diagonal block.
    fn row(&self, i: usize, j: usize) -> Q::Half;
    /// Entries (i, j) and (i + 1, j) of it; that above the diagonal is not used.
    fn rows(&self, i: usize, j: usize) -> Q;
    /// Entries (i, j) and (i, j + 1) of it, below the diagonal.
    fn columns(&self, i: usize, j: usize) -> Q;
    /// Entry (i, j) of the coupling: row of the next block, column of the one that is eliminated.
    fn coupling(&self, i: usize, j: usize) -> Q::Half;
    /// Entries (i, j) and (i + 1, j) of it.
    fn couplings(&self, i: usize, j: usize) -> Q;
}

/// Memory that steps work in: `LEFT` doubles for the Schur complement of a diagonal block ([`left_len`] vectors), `BELOW` for L D
/// below the diagonal.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Scratch<const LEFT: usize, const BELOW: usize> {
    /// Schur complement of a diagonal block ([`left_at`]).
    left: [f64; LEFT],
    /// L D below the diagonal, by rows.
    y: [f64; BELOW],
    /// Schur complement of the next block where a pivot is refused: not read. Without it the compiler would put off all
    /// products to the end of a step, and store their factors until then.
    refused: [f64; LEFT],
}

/// For blocks of at most six rows and vectors of two lanes.
pub(super) type ScratchOfTwo = Scratch<{ 2 * left_len(6) }, { 2 * y_at(6, 0) }>;

impl<const LEFT: usize, const BELOW: usize> Scratch<LEFT, BELOW> {
    pub(super) fn new() -> Self {
        Self {
            left: [0.0; _],
            y: [0.0; _],
            refused: [0.0; _],
        }
    }

    /// The vectors of the Schur complement of a diagonal block.
    pub(super) fn left_mut<V: Lanes, const B: usize>(&mut self) -> &mut [f64] {
        &mut self.left[..left_len(B) * V::LANES]
    }
}

/// Entries of the Schur complement of a diagonal block.
pub(super) const fn left_len(size: usize) -> usize {
    size / 2 * (size / 2 + 1) * 2 + size % 2 * size
}

/// BlockSlot of entry (i, j) in the Schur complement of a diagonal block: the blocks of two rows and columns by rows, of each its
/// diagonal, then its antidiagonal; the last row of an odd number by itself.
const fn left_at(size: usize, i: usize, j: usize) -> usize {
    let before = i / 2 * (i / 2 + 1) * 2;
    if size % 2 == 1 && i + 1 == size {
        before + j
    } else {
        before + j / 2 * 4 + (i + j) % 2 * 2 + i % 2
    }
}

/// A hint to read from memory what was stored before; without it the same is computed, slower.
#[inline(always)]
fn fence() {
    compiler_fence(Ordering::SeqCst);
}

/// Returns true if, in all lanes, `d` exceeds `least` u times `own` plus `TINY`: a pivot of a
/// positive definite matrix that is clear of rounding. `d` is the remainder of the diagonal entry
/// `own`. False for NaN and for infinite `own`.
#[inline(always)]
fn is_pivot<V: Lanes>(d: V, own: V, least: f64) -> bool {
    let least = V::splat(least * f64::ROUNDOFF);
    own.mul_add(least, V::splat(TINY)).all_below(d)
}

/// A diagonal block, from which products are subtracted.
struct Next<Q: Halves, const B: usize> {
    /// Entries (2p, 2q) and (2p + 1, 2q + 1), and (2p, 2q + 1) and (2p + 1, 2q), with q ≤ p.
    pairs: [[[Q; 2]; 3]; 3],
    /// Entries (B − 1, 2q) and (B − 1, 2q + 1), and the last one, where B is odd.
    last: [Q; 3],
    corner: Q::Half,
}

impl<Q: Halves, const B: usize> Next<Q, B> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            pairs: [[[Q::splat(0.0); 2]; 3]; 3],
            last: [Q::splat(0.0); 3],
            corner: Q::Half::splat(0.0),
        }
    }

    #[inline(always)]
    fn load(blocks: &impl Blocks<Q, B>) -> Self {
        let mut next = Self::zero();
        unroll!(p < B / 2, pairs, {
            unroll!(q < p + 1, pairs, {
                let even = blocks.rows(2 * p, 2 * q);
                let odd = blocks.rows(2 * p, 2 * q + 1);
                next.pairs[p][q] = [
                    Q::join(even.lower(), odd.upper()),
                    Q::join(odd.lower(), even.upper()),
                ];
            });
            if const { B % 2 == 1 } {
                next.last[p] = blocks.columns(B - 1, 2 * p);
            }
        });
        if const { B % 2 == 1 } {
            next.corner = blocks.row(B - 1, B - 1);
        }
        next
    }

    #[inline(always)]
    fn store(&self, to: &mut [f64]) {
        unroll!(p < B / 2, pairs, {
            unroll!(q < p + 1, pairs, {
                let [diagonal, other] = self.pairs[p][q];
                put_pair(diagonal, to, left_at(B, 2 * p, 2 * q));
                put_pair(other, to, left_at(B, 2 * p, 2 * q + 1));
            });
            if const { B % 2 == 1 } {
                put_pair(self.last[p], to, left_at(B, B - 1, 2 * p));
            }
        });
        if const { B % 2 == 1 } {
            put(self.corner, to, left_at(B, B - 1, B - 1));
        }
    }

    /// Subtracts x wᵀ.
    #[inline(always)]
    fn subtract(&mut self, x: &Column<Q>, w: &Column<Q>) {
        unroll!(q < B / 2, pairs, {
            let w = w.pairs[q];
            let exchanged = Q::join(w.upper(), w.lower());
            unroll!(p < B / 2, pairs, {
                if const { p >= q } {
                    let [diagonal, other] = &mut self.pairs[p][q];
                    *diagonal = x.pairs[p].neg_mul_add(w, *diagonal);
                    *other = x.pairs[p].neg_mul_add(exchanged, *other);
                }
            });
        });
        if const { B % 2 == 1 } {
            let both = Q::both(x.last);
            unroll!(q < B / 2, pairs, {
                self.last[q] = w.pairs[q].neg_mul_add(both, self.last[q]);
            });
            self.corner = x.last.neg_mul_add(w.last, self.corner);
        }
    }
}

/// A column of X or W.
struct Column<Q: Halves> {
    /// Rows 2p and 2p + 1.
    pairs: [Q; 3],
    /// The last of an odd number.
    last: Q::Half,
}

impl<Q: Halves> Column<Q> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            pairs: [Q::splat(0.0); 3],
            last: Q::Half::splat(0.0),
        }
    }

    /// Column K of X, with those of W before it and row K of L D in memory.
    #[inline(always)]
    fn of_x<const K: usize, const B: usize>(
        blocks: &impl Blocks<Q, B>,
        step: &[f64],
        y: &[f64],
    ) -> Self {
        let mut x = Self::zero();
        unroll!(p < B / 2, pairs, {
            x.pairs[p] = blocks.couplings(2 * p, K);
        });
        if const { B % 2 == 1 } {
            x.last = blocks.coupling(B - 1, K);
        }
        unroll!(m < K, {
            let y: Q::Half = get(y, y_at(K, m));
            let both = Q::both(y);
            unroll!(p < B / 2, pairs, {
                let w: Q = pair(step, w_at(B, 2 * p, m));
                x.pairs[p] = w.neg_mul_add(both, x.pairs[p]);
            });
            if const { B % 2 == 1 } {
                let w: Q::Half = get(step, w_at(B, B - 1, m));
                x.last = w.neg_mul_add(y, x.last);
            }
        });
        x
    }

    /// Column K of W from that of X, also into `step`.
    #[inline(always)]
    fn scaled<const K: usize, const B: usize>(&self, inverse: Q::Half, step: &mut [f64]) -> Self {
        let (mut w, both) = (Self::zero(), Q::both(inverse));
        unroll!(p < B / 2, pairs, {
            w.pairs[p] = self.pairs[p] * both;
            put_pair(w.pairs[p], step, w_at(B, 2 * p, K));
        });
        if const { B % 2 == 1 } {
            w.last = self.last * inverse;
            put(w.last, step, w_at(B, B - 1, K));
        }
        w
    }
}

impl<const LEFT: usize, const BELOW: usize> Scratch<LEFT, BELOW> {
    /// Column K of L D below the diagonal; its first entry. `l` is the entry of L to the left of its pivot.
    #[inline(always)]
    fn column<V: Lanes, const K: usize, const B: usize>(&mut self, l: V, step: &[f64]) -> V {
        let mut first = l;
        unroll!(i < B, {
            if const { i > K } {
                let mut y: V = get(&self.left, left_at(B, i, K));
                unroll!(m < K, {
                    let l = if const { m + 1 < K } {
                        get(step, l_at(B, K, m))
                    } else {
                        l
                    };
                    y = get::<V>(&self.y, y_at(i, m)).neg_mul_add(l, y);
                });
                put(y, &mut self.y, y_at(i, K));
                if const { i == K + 1 } {
                    first = y;
                }
            }
        });
        first
    }

    /// The pivot after K, with the first entry of column K of L D.
    #[inline(always)]
    fn pivot_after<V: Lanes, const K: usize, const B: usize>(
        &self,
        (first, inverse): (V, V),
        step: &[f64],
    ) -> V {
        let mut d = inverse;
        unroll!(i < B, {
            if const { i == K + 1 } {
                d = get(&self.left, left_at(B, i, i));
                unroll!(m < K, {
                    let l = get(step, l_at(B, i, m));
                    d = get::<V>(&self.y, y_at(i, m)).neg_mul_add(l, d);
                });
                // The square first, for the reciprocal comes last.
                d = (first * first).neg_mul_add(inverse, d);
            }
        });
        d
    }

    /// Column K of L into `step`; its first entry.
    #[inline(always)]
    fn scale<V: Lanes, const K: usize, const B: usize>(
        &self,
        first: V,
        inverse: V,
        step: &mut [f64],
    ) -> V {
        let l = first * inverse;
        unroll!(i < B, {
            if const { i == K + 1 } {
                put(l, step, l_at(B, i, K));
            } else if const { i > K } {
                put(get::<V>(&self.y, y_at(i, K)) * inverse, step, l_at(B, i, K));
            }
        });
        l
    }
}

/// Begins with the diagonal block that `blocks` have as the next one; its first pivot.
#[inline(always)]
pub(super) fn begin<Q: Halves, const B: usize, const LEFT: usize, const BELOW: usize>(
    scratch: &mut Scratch<LEFT, BELOW>,
    blocks: &impl Blocks<Q, B>,
) -> Q::Half {
    Next::load(blocks).store(&mut scratch.left);
    blocks.row(0, 0)
}

/// Eliminates the block whose first pivot is given, into the [`per_step`] vectors of `step`; the first pivot of the
/// next one. `None` where a pivot is not positive, or at most `least` units of roundoff of its diagonal entry.
#[inline(always)]
#[allow(unused_assignments)] // in the last turn, of what the next one would use
pub(super) fn eliminate<Q: Halves, const B: usize, const LEFT: usize, const BELOW: usize>(
    pivot: Q::Half,
    scratch: &mut Scratch<LEFT, BELOW>,
    blocks: &impl Blocks<Q, B>,
    least: f64,
    step: &mut [f64],
) -> Option<Q::Half> {
    let step = &mut step[..per_step(B) * Q::Half::LANES];
    let one = Q::Half::splat(1.0);
    let (mut d, mut inverse, mut l) = (pivot, one / pivot, one);
    let mut next = Next::zero();
    unroll!(k < B, {
        let (pivot, known) = (d, inverse);
        if const { k > 0 } && !is_pivot(pivot, blocks.own(k), least) {
            next.store(&mut scratch.refused);
            return None;
        }
        put(known, step, inverse_at(B, k));
        fence();
        let first = scratch.column::<_, k, B>(l, step);
        if const { k + 1 < B } {
            d = scratch.pivot_after::<_, k, B>((first, known), step);
            inverse = one / d;
        }
        l = scratch.scale::<_, k, B>(first, known, step);
        fence();
        if const { k == 0 } {
            next = Next::load(blocks);
        }
        if const { k == 0 } && !is_pivot(pivot, blocks.own(k), least) {
            next.store(&mut scratch.refused);
            return None;
        }
        let x = Column::of_x::<k, B>(blocks, step, &scratch.y);
        if const { k + 1 == B } {
            let x = x.pairs[0].lower();
            let [diagonal, _] = next.pairs[0][0];
            d = (x * x).neg_mul_add(known, diagonal.lower());
        }
        next.subtract(&x, &x.scaled::<k, B>(known, step));
    });
    next.store(&mut scratch.left);
    Some(d)
}

/// Factorises the last block, whose first pivot is given and whose diagonal entries were `own` before anything was
/// subtracted: the part of a step that [`eliminate`] makes of L and D. `None` as there.
#[inline(always)]
#[allow(unused_assignments)] // as above
pub(super) fn finish<V: Lanes, const B: usize, const LEFT: usize, const BELOW: usize>(
    pivot: V,
    scratch: &mut Scratch<LEFT, BELOW>,
    own: [V; B],
    least: f64,
    step: &mut [f64],
) -> Option<()> {
    let step = &mut step[..per_step(B) * V::LANES];
    let (mut d, mut l) = (pivot, pivot);
    unroll!(k < B, {
        if !is_pivot(d, own[k], least) {
            return None;
        }
        let inverse = V::splat(1.0) / d;
        put(inverse, step, inverse_at(B, k));
        let first = scratch.column::<_, k, B>(l, step);
        d = scratch.pivot_after::<_, k, B>((first, inverse), step);
        l = scratch.scale::<_, k, B>(first, inverse, step);
    });
    Some(())
}
