//! One step of the elimination of a chain, for any vector: its lanes are chains of their own.
//!
//! What is stored of a block, each number for all lanes: L (strictly lower triangle, by rows), 1/D ([`triangle`] vectors
//! together), then W = E L⁻ᵀ D⁻¹ by columns.
//!
//! What sets the pace is the chain of divisions, B of them in each block, each waiting for the pivot before it. So a block
//! is factorised row by row, and as soon as a pivot is there, its column of W is made and subtracted from the next
//! block: that is the work which fills the time of the next division. A pivot d − y² (1/d′) waits for the reciprocal
//! before it with one multiply-add only, since the square is formed beforehand; so does the first pivot of the next
//! block. In W and in the next block two rows stand side by side in a vector of twice the lanes ([`Halves`]), the last
//! one alone where their number is odd: half the instructions, or where there are no such vectors, every factor is
//! loaded once for two rows. All loops are written out ([`unroll`]), so that the compiler sees indices into local arrays
//! as constants and keeps these in registers.

use crate::block_ldlt::NOISE;
use crate::kernels::Scalar;
use taut_lanes::{Halves, Lanes};

/// Vectors of a factored diagonal block of B rows: its strictly lower triangle and its reciprocal pivots.
pub(super) const fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}

/// The body for i = 0, 1, … below a bound of at most six, written out.
macro_rules! unroll {
    ($i:ident < $bound:expr, $body:block) => {
        unroll!(@ $i, $bound, $body, 0 1 2 3 4 5)
    };
    ($i:ident < $bound:expr, down, $body:block) => {
        unroll!(@ $i, $bound, $body, 5 4 3 2 1 0)
    };
    ($i:ident < $bound:expr, pairs, $body:block) => {
        unroll!(@ $i, $bound, $body, 0 1 2)
    };
    (@ $i:ident, $bound:expr, $body:block, $($value:literal)*) => {$(
        #[allow(unused_comparisons)]
        if $value < $bound {
            let $i: usize = $value;
            $body
        }
    )*};
}
pub(super) use unroll;

/// Where a step finds its blocks.
pub(super) trait Blocks<V> {
    /// Entry (i, j) of the lower triangle of the diagonal block.
    fn diagonal(&self, i: usize, j: usize) -> V;
    /// Entry (i, j) of the coupling to the next block: row of that one, column of this one.
    fn coupling(&self, i: usize, j: usize) -> V;
}

/// Whether pivot `d`, made from numbers of magnitude `scale`, is more than noise in all lanes; not so for NaN. Asked
/// row by row: the branches also keep the compiler from moving the divisions together, behind the products.
#[inline(always)]
fn is_pivot<V: Lanes>(d: V, scale: V) -> bool {
    (scale * V::splat(NOISE * f64::ROUNDOFF)).all_below(d.abs())
}

/// Pairs of rows of the largest block.
const PAIRS: usize = 3;

/// What a block takes away from the one after it: X Wᵀ with X = W D, both by columns.
#[derive(Clone, Copy)]
pub(super) struct Taken<'a> {
    pub(super) x: &'a [f64],
    pub(super) w: &'a [f64],
}

/// Two rows of a diagonal block, or the last one, less what was taken away; and the largest magnitudes that their
/// diagonals were made from.
struct Rows<V, const B: usize> {
    rows: [[V; B]; 2],
    scale: [V; 2],
}

/// Rows i and i + 1 of the diagonal block, as far as they are there.
#[inline(always)]
fn rows<Q: Halves, const B: usize>(
    i: usize,
    blocks: &impl Blocks<Q::Half>,
    taken: Taken<'_>,
) -> Rows<Q::Half, B> {
    let lanes = Q::Half::LANES;
    let (x, w) = (&taken.x[..B * B * lanes], &taken.w[..B * B * lanes]);
    let zero = Q::Half::splat(0.0);
    let mut result = Rows {
        rows: [[zero; B]; 2],
        scale: [zero; 2],
    };
    if i + 1 < B {
        unroll!(j < i + 2, {
            let a = Q::join(blocks.diagonal(i, j), blocks.diagonal(i + 1, j));
            let mut sum = a;
            unroll!(k < B, {
                let both = Q::both(Q::Half::load(&w[(k * B + j) * lanes..]));
                sum = Q::load(&x[(k * B + i) * lanes..]).neg_mul_add(both, sum);
            });
            result.rows[0][j] = sum.lower();
            result.rows[1][j] = sum.upper();
            if j >= i {
                let scale = a.abs().max((a - sum).abs());
                result.scale[j - i] = if j == i { scale.lower() } else { scale.upper() };
            }
        });
    } else {
        unroll!(j < B, {
            let a = blocks.diagonal(i, j);
            let mut sum = a;
            unroll!(k < B, {
                let w = Q::Half::load(&w[(k * B + j) * lanes..]);
                sum = Q::Half::load(&x[(k * B + i) * lanes..]).neg_mul_add(w, sum);
            });
            result.rows[0][j] = sum;
            if j == i {
                result.scale[0] = a.abs().max((a - sum).abs());
            }
        });
    }
    result
}

/// A diagonal block on the way to its factor: the rows before some row are there.
struct Factored<V, const B: usize> {
    l: [[V; B]; B],
    inverse: [V; B],
}

impl<V: Lanes, const B: usize> Factored<V, B> {
    #[inline(always)]
    fn new() -> Self {
        let zero = V::splat(0.0);
        Self {
            l: [[zero; B]; B],
            inverse: [zero; B],
        }
    }

    /// Row i from the block's row i, and into `to`; its pivot.
    #[inline(always)]
    fn row(&mut self, i: usize, row: &[V; B], to: &mut [f64]) -> V {
        let to = &mut to[..triangle(B) * V::LANES];
        let mut y = [V::splat(0.0); B];
        let mut d = row[i];
        unroll!(j < i, {
            y[j] = row[j];
            unroll!(k < j, {
                y[j] = y[k].neg_mul_add(self.l[j][k], y[j]);
            });
            self.l[i][j] = y[j] * self.inverse[j];
            if j + 1 < i {
                d = y[j].neg_mul_add(self.l[i][j], d);
            } else {
                // The square first, for the reciprocal comes last.
                d = (y[j] * y[j]).neg_mul_add(self.inverse[j], d);
            }
            self.l[i][j].store(&mut to[lower(i, j) * V::LANES..]);
        });
        self.inverse[i] = V::splat(1.0) / d;
        self.inverse[i].store(&mut to[(triangle(B) - B + i) * V::LANES..]);
        d
    }
}

/// Place of L_ij, i > j.
#[inline(always)]
const fn lower(i: usize, j: usize) -> usize {
    i * (i - 1) / 2 + j
}

/// X = E L⁻ᵀ, two rows in a vector, on its way: the columns before some column are there.
struct Coupling<Q: Halves, const B: usize> {
    pairs: [[Q; B]; PAIRS],
    /// The last row, where their number is odd.
    odd: [Q::Half; B],
}

impl<Q: Halves, const B: usize> Coupling<Q, B> {
    #[inline(always)]
    fn new() -> Self {
        Self {
            pairs: [[Q::splat(0.0); B]; PAIRS],
            odd: [Q::Half::splat(0.0); B],
        }
    }

    /// Column c, also into `x`, and column c of W into `w`.
    #[inline(always)]
    fn column(
        &mut self,
        c: usize,
        blocks: &impl Blocks<Q::Half>,
        factored: &Factored<Q::Half, B>,
        x: &mut [f64],
        w: &mut [f64],
    ) {
        let lanes = Q::Half::LANES;
        let (x, w) = (&mut x[..B * B * lanes], &mut w[..B * B * lanes]);
        unroll!(p < B / 2, pairs, {
            self.pairs[p][c] = Q::join(blocks.coupling(2 * p, c), blocks.coupling(2 * p + 1, c));
        });
        if B % 2 == 1 {
            self.odd[c] = blocks.coupling(B - 1, c);
        }
        unroll!(k < c, {
            let l = factored.l[c][k];
            let both = Q::both(l);
            unroll!(p < B / 2, pairs, {
                self.pairs[p][c] = self.pairs[p][k].neg_mul_add(both, self.pairs[p][c]);
            });
            if B % 2 == 1 {
                self.odd[c] = self.odd[k].neg_mul_add(l, self.odd[c]);
            }
        });
        let inverse = factored.inverse[c];
        let both = Q::both(inverse);
        unroll!(p < B / 2, pairs, {
            let at = (c * B + 2 * p) * lanes;
            self.pairs[p][c].store(&mut x[at..]);
            (self.pairs[p][c] * both).store(&mut w[at..]);
        });
        if B % 2 == 1 {
            let at = (c * B + B - 1) * lanes;
            self.odd[c].store(&mut x[at..]);
            (self.odd[c] * inverse).store(&mut w[at..]);
        }
    }
}

/// Eliminates a block: what was taken away from it by the one before is subtracted, it is factorised into `to`, and
/// what it takes away from the next is left in `x` and behind its factor in `to`. `None` where a pivot is noise;
/// `largest` receives the largest pivot.
#[inline(always)]
pub(super) fn eliminate<Q: Halves, const B: usize>(
    blocks: &impl Blocks<Q::Half>,
    taken: Taken<'_>,
    to: &mut [f64],
    x: &mut [f64],
    largest: &mut Q::Half,
) -> Option<()> {
    let (to, w) = to.split_at_mut(triangle(B) * Q::Half::LANES);
    let mut factored = Factored::<Q::Half, B>::new();
    let mut coupling = Coupling::<Q, B>::new();
    unroll!(p < B.div_ceil(2), pairs, {
        let i = 2 * p;
        let rows = rows::<Q, B>(i, blocks, taken);
        let d = factored.row(i, &rows.rows[0], to);
        *largest = largest.max(d.abs());
        if !is_pivot(d, rows.scale[0]) {
            return None;
        }
        coupling.column(i, blocks, &factored, x, w);
        if i + 1 < B {
            let d = factored.row(i + 1, &rows.rows[1], to);
            *largest = largest.max(d.abs());
            if !is_pivot(d, rows.scale[1]) {
                return None;
            }
            coupling.column(i + 1, blocks, &factored, x, w);
        }
    });
    Some(())
}

/// Factorises the block where eliminations meet, after which there is none: `meet` adds the lanes up, `larger` takes the
/// largest.
#[inline(always)]
pub(super) fn meet<Q: Halves, const B: usize>(
    blocks: &impl Blocks<Q::Half>,
    taken: Taken<'_>,
    to: &mut [f64],
    largest: &mut Q::Half,
    (add, larger): (impl Fn(Q::Half) -> Q::Half, impl Fn(Q::Half) -> Q::Half),
) -> Option<()> {
    let mut factored = Factored::<Q::Half, B>::new();
    unroll!(p < B.div_ceil(2), pairs, {
        let mut rows = rows::<Q, B>(2 * p, blocks, taken);
        unroll!(r < 2, {
            let i = 2 * p + r;
            if i < B {
                unroll!(j < i + 1, {
                    rows.rows[r][j] = add(rows.rows[r][j]);
                });
                let d = factored.row(i, &rows.rows[r], to);
                *largest = largest.max(d.abs());
                if !is_pivot(d, larger(rows.scale[r])) {
                    return None;
                }
            }
        });
    });
    Some(())
}

/// y = L⁻¹ b.
#[inline(always)]
pub(super) fn lower_solve<V: Lanes, const B: usize>(factor: &[f64], b: [V; B]) -> [V; B] {
    let factor = &factor[..triangle(B) * V::LANES];
    let mut y = b;
    unroll!(j < B, {
        unroll!(i < B, {
            if i > j {
                let l = V::load(&factor[lower(i, j) * V::LANES..]);
                y[i] = l.neg_mul_add(y[j], y[i]);
            }
        });
    });
    y
}

/// D⁻¹ y.
#[inline(always)]
pub(super) fn scaled<V: Lanes, const B: usize>(factor: &[f64], y: [V; B]) -> [V; B] {
    let factor = &factor[..triangle(B) * V::LANES];
    let mut z = y;
    unroll!(i < B, {
        z[i] = y[i] * V::load(&factor[(triangle(B) - B + i) * V::LANES..]);
    });
    z
}

/// b − W y.
#[inline(always)]
pub(super) fn pass_on<V: Lanes, const B: usize>(w: &[f64], y: [V; B], b: [V; B]) -> [V; B] {
    let w = &w[..B * B * V::LANES];
    let mut next = b;
    unroll!(j < B, {
        unroll!(i < B, {
            next[i] = V::load(&w[(j * B + i) * V::LANES..]).neg_mul_add(y[j], next[i]);
        });
    });
    next
}

/// L⁻ᵀ (z − Wᵀ next).
#[inline(always)]
pub(super) fn take_back<V: Lanes, const B: usize>(
    factor: &[f64],
    z: [V; B],
    next: [V; B],
) -> [V; B] {
    let w = &factor[triangle(B) * V::LANES..(triangle(B) + B * B) * V::LANES];
    let mut x = z;
    // The first row of the next block is the last that is known.
    unroll!(i < B, down, {
        unroll!(j < B, {
            x[j] = V::load(&w[(j * B + i) * V::LANES..]).neg_mul_add(next[i], x[j]);
        });
    });
    upper_solve(factor, x)
}

/// L⁻ᵀ x.
#[inline(always)]
pub(super) fn upper_solve<V: Lanes, const B: usize>(factor: &[f64], x: [V; B]) -> [V; B] {
    let factor = &factor[..triangle(B) * V::LANES];
    let mut x = x;
    unroll!(i < B, down, {
        unroll!(j < i, {
            x[j] = V::load(&factor[lower(i, j) * V::LANES..]).neg_mul_add(x[i], x[j]);
        });
    });
    x
}
