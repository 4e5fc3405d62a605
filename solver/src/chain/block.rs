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

/// Vectors of a step: the factor of its block and W.
pub(super) const fn per_step(size: usize) -> usize {
    triangle(size) + size * size
}

/// The body for i = 0, 1, … below a bound of at most six, written out; i and the bound are constants, so that nothing is
/// compiled of the bodies beyond it.
macro_rules! unroll {
    ($i:ident < $bound:expr, $body:block) => {
        $crate::chain::block::unroll!(@ $i, $bound, $body, 0 1 2 3 4 5)
    };
    ($i:ident < $bound:expr, down, $body:block) => {
        $crate::chain::block::unroll!(@ $i, $bound, $body, 5 4 3 2 1 0)
    };
    ($i:ident < $bound:expr, pairs, $body:block) => {
        $crate::chain::block::unroll!(@ $i, $bound, $body, 0 1 2)
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

/// Where a step finds its blocks: rows i and i + 1 side by side, or one alone.
pub(super) trait Blocks<Q: Halves, const B: usize> {
    /// Entry (i, j) of the lower triangle of a diagonal block.
    fn row(&self, i: usize, j: usize) -> Q::Half;
    /// Entries (i, j) and (i + 1, j) of a diagonal block; that above the diagonal is not used.
    fn rows(&self, i: usize, j: usize) -> Q;
    /// Row i of a coupling: row of the next block, columns of this one.
    fn coupling(&self, i: usize) -> [Q::Half; B];
    /// Rows i and i + 1 of a coupling.
    fn couplings(&self, i: usize) -> [Q; B];
}

/// Whether pivot `d`, made from numbers of magnitude `scale`, is more than noise in all lanes; not so for NaN. Asked
/// row by row: the branches also keep the compiler from moving the divisions together, behind the products.
#[inline(always)]
fn is_pivot<V: Lanes>(d: V, scale: V) -> bool {
    (scale * V::splat(NOISE * f64::ROUNDOFF)).all_below(d.abs())
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

    /// Row i from the block's row i, made from numbers of magnitude `scale` on its diagonal, and into `to`; whether its
    /// pivot is accepted. `largest` receives the largest pivot.
    #[inline(always)]
    fn row<const I: usize>(
        &mut self,
        (row, scale): (&[V; B], V),
        to: &mut [f64],
        largest: &mut V,
    ) -> bool {
        let to = &mut to[..triangle(B) * V::LANES];
        let mut y = [V::splat(0.0); B];
        let mut d = row[I];
        unroll!(j < I, {
            y[j] = row[j];
            unroll!(k < j, {
                y[j] = y[k].neg_mul_add(self.l[j][k], y[j]);
            });
            self.l[I][j] = y[j] * self.inverse[j];
            if j + 1 < I {
                d = y[j].neg_mul_add(self.l[I][j], d);
            } else {
                // The square first, for the reciprocal comes last.
                d = (y[j] * y[j]).neg_mul_add(self.inverse[j], d);
            }
            self.l[I][j].store(&mut to[lower(I, j) * V::LANES..]);
        });
        self.inverse[I] = V::splat(1.0) / d;
        self.inverse[I].store(&mut to[(triangle(B) - B + I) * V::LANES..]);
        *largest = largest.max(d.abs());
        is_pivot(d, scale)
    }
}

/// Place of L_ij, i > j.
#[inline(always)]
const fn lower(i: usize, j: usize) -> usize {
    i * (i - 1) / 2 + j
}

/// Zero, which the compiler does not know, so that it loads again what it has loaded or stored before. It would
/// otherwise keep more than there are registers, and spend more stores on that than are needed in all.
#[inline(always)]
fn read_again(_: &[f64]) -> usize {
    std::hint::black_box(0)
}

/// Rows of X = E L⁻ᵀ, from those of E, and those of W into `w`, whose columns are B vectors of half the lanes apart.
/// `factor` is of half the lanes too; `widen` makes a number of it one of a row.
#[inline(always)]
fn coupling_rows<V: Lanes, H: Lanes, const B: usize>(
    mut x: [V; B],
    factor: &[f64],
    w: &mut [f64],
    widen: impl Fn(H) -> V,
) -> [V; B] {
    let factor = &factor[..triangle(B) * H::LANES];
    let w = &mut w[..(B * (B - 1)) * H::LANES + V::LANES];
    unroll!(j < B, {
        unroll!(k < j, {
            let l = widen(H::load(&factor[lower(j, k) * H::LANES..]));
            x[j] = x[k].neg_mul_add(l, x[j]);
        });
        let inverse = widen(H::load(&factor[(triangle(B) - B + j) * H::LANES..]));
        (x[j] * inverse).store(&mut w[j * B * H::LANES..]);
    });
    x
}

/// a − Σₖ xₖ w_jk.
#[inline(always)]
fn subtract_row<V: Lanes, H: Lanes, const B: usize>(
    a: V,
    x: &[V; B],
    w: &[f64],
    widen: impl Fn(H) -> V,
) -> V {
    let w = &w[..(B * (B - 1) + 1) * H::LANES];
    let mut sum = a;
    unroll!(k < B, {
        sum = x[k].neg_mul_add(widen(H::load(&w[k * B * H::LANES..])), sum);
    });
    sum
}

/// Factorises a first diagonal block into the first [`triangle`] vectors of `to`; `None` where a pivot is noise.
/// `largest` receives the largest pivot.
#[inline(always)]
pub(super) fn first<Q: Halves, const B: usize>(
    blocks: &impl Blocks<Q, B>,
    to: &mut [f64],
    largest: &mut Q::Half,
) -> Option<()> {
    let mut factored = Factored::<Q::Half, B>::new();
    unroll!(i < B, {
        let mut row = [Q::Half::splat(0.0); B];
        unroll!(j < i + 1, {
            row[j] = blocks.row(i, j);
        });
        if !factored.row::<i>((&row, row[i].abs()), to, largest) {
            return None;
        }
    });
    Some(())
}

/// Eliminates a block that is factorised at the head of `here`: its W is stored behind that, and the next block, less
/// what is taken away from it, is factorised into the first [`triangle`] vectors of `next`. `None` where a pivot is
/// noise; `largest` receives the largest pivot. `meet` adds up and takes the largest of what several chains contribute
/// to a row and its magnitude, where they end in the same block.
#[inline(always)]
pub(super) fn eliminate<Q: Halves, const B: usize>(
    blocks: &impl Blocks<Q, B>,
    here: &mut [f64],
    next: &mut [f64],
    largest: &mut Q::Half,
    meet: &impl Meet<Q::Half>,
) -> Option<()> {
    let lanes = Q::Half::LANES;
    let (factor, w) = here.split_at_mut(triangle(B) * lanes);
    let zero = Q::Half::splat(0.0);
    let mut factored = Factored::<Q::Half, B>::new();
    unroll!(p < B / 2, pairs, {
        const i: usize = 2 * p;
        let x = blocks.couplings(i);
        let factor = &factor[read_again(factor)..];
        let x = coupling_rows::<Q, Q::Half, B>(x, factor, &mut w[i * lanes..], Q::both);
        let w = &w[read_again(w)..];
        let (mut rows, mut scale) = ([[zero; B]; 2], [zero; 2]);
        unroll!(j < i + 2, {
            let a = blocks.rows(i, j);
            let sum = subtract_row(a, &x, &w[j * lanes..], Q::both);
            rows[0][j] = meet.sum(sum.lower());
            rows[1][j] = meet.sum(sum.upper());
            if j == i {
                scale[0] = magnitude(a.lower(), sum.lower());
            } else if j > i {
                scale[1] = magnitude(a.upper(), sum.upper());
            }
        });
        let row = (&rows[0], meet.largest(scale[0]));
        if !factored.row::<i>(row, next, largest) {
            return None;
        }
        let row = (&rows[1], meet.largest(scale[1]));
        if !factored.row::<{ i + 1 }>(row, next, largest) {
            return None;
        }
    });
    unroll!(i < B, {
        if const { B % 2 == 1 && i + 1 == B } {
            let x = blocks.coupling(i);
            let factor = &factor[read_again(factor)..];
            let x = coupling_rows::<Q::Half, Q::Half, B>(x, factor, &mut w[i * lanes..], |l| l);
            let w = &w[read_again(w)..];
            let (mut row, mut scale) = ([zero; B], zero);
            unroll!(j < B, {
                let a = blocks.row(i, j);
                let sum = subtract_row(a, &x, &w[j * lanes..], |w| w);
                row[j] = meet.sum(sum);
                if j == i {
                    scale = magnitude(a, sum);
                }
            });
            if !factored.row::<i>((&row, meet.largest(scale)), next, largest) {
                return None;
            }
        }
    });
    Some(())
}

/// The larger of what a diagonal entry was and of what was subtracted from it.
#[inline(always)]
fn magnitude<V: Lanes>(a: V, after: V) -> V {
    a.abs().max((a - after).abs())
}

/// How lanes come together in a block.
pub(super) trait Meet<V> {
    /// The sum of those that contribute to the block.
    fn sum(&self, v: V) -> V;
    /// The largest of these.
    fn largest(&self, v: V) -> V;
}

/// They do not: every lane has its own block.
pub(super) struct Apart;

impl<V: Lanes> Meet<V> for Apart {
    #[inline(always)]
    fn sum(&self, v: V) -> V {
        v
    }
    #[inline(always)]
    fn largest(&self, v: V) -> V {
        v
    }
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
