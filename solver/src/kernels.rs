//! Products and solves with small dense blocks, column-major.
//!
//! Each kernel is written once, over loop bounds that are constants for the sizes that joints and bodies have and
//! run-time numbers for all others. A column is kept in registers while it is worked on, a strip of at most [`STRIP`]
//! rows at a time: 1.5 to 3 times faster than in place. What holds a strip are the [`Strips`]: a local array of any
//! number ([`OneByOne`]), or for doubles one or two vectors ([`InVectors`]).

use crate::DoubleDouble;
use std::marker::PhantomData;
use std::ops::{Add, Mul, Neg, Sub};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// Arithmetic that the factorisation needs.
pub(crate) trait Scalar:
    Copy
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + std::ops::Div<Output = Self>
{
    /// The nearest double: what pivots are judged by.
    fn to_f64(self) -> f64;
    /// Unit roundoff: a pivot below a few of these, relative to what was subtracted from it, is noise.
    const ROUNDOFF: f64;
    /// Runs work on blocks with the fastest strips that there are.
    fn run<W: BlockWork<Self>>(work: W) -> W::Output;
}

/// Work on blocks that is written once for all kinds of strips.
pub(crate) trait BlockWork<T: Scalar> {
    type Output;

    /// The work. It, and what it calls with strips, must be `#[inline(always)]`.
    fn run<S: Strips<T>>(self) -> Self::Output;
}

/// A piece of a column that is kept in registers.
pub(crate) trait Strips<T> {
    /// y −= A x for an m×n block and entries x(c).
    fn subtract(m: usize, n: usize, a: &[T], x: impl Fn(usize) -> T, y: &mut [T]);
}

/// Numbers of any kind, one by one.
pub(crate) struct OneByOne;

impl<T: Scalar> Strips<T> for OneByOne {
    #[inline(always)]
    fn subtract(m: usize, n: usize, a: &[T], x: impl Fn(usize) -> T, y: &mut [T]) {
        if m <= STRIP {
            return subtract_strip(0, m, m, n, a, &x, y);
        }
        for first in (0..m).step_by(STRIP) {
            subtract_strip(first, STRIP.min(m - first), m, n, a, &x, y);
        }
    }
}

/// Doubles, several in a vector.
pub(crate) struct InVectors<I>(PhantomData<I>);

impl<I: Isa> Strips<f64> for InVectors<I> {
    #[inline(always)]
    fn subtract(m: usize, n: usize, a: &[f64], x: impl Fn(usize) -> f64, y: &mut [f64]) {
        let mut first = 0;
        while m - first >= 6 {
            subtract_rows::<I::X4, I::X2>(first, m, n, a, &x, y);
            first += 6;
        }
        match m - first {
            0 => {}
            1 => subtract_vector::<I::X1>(first, m, n, a, &x, y),
            2 => subtract_vector::<I::X2>(first, m, n, a, &x, y),
            3 => subtract_rows::<I::X2, I::X1>(first, m, n, a, &x, y),
            4 => subtract_vector::<I::X4>(first, m, n, a, &x, y),
            _ => subtract_rows::<I::X4, I::X1>(first, m, n, a, &x, y),
        }
    }
}

/// The rows from `first` on, as many as two vectors hold.
#[inline(always)]
fn subtract_rows<V: Lanes, W: Lanes>(
    first: usize,
    m: usize,
    n: usize,
    a: &[f64],
    x: &impl Fn(usize) -> f64,
    y: &mut [f64],
) {
    let rows = V::LANES + W::LANES;
    let (a, y) = (&a[..m * n], &mut y[first..first + rows]);
    let (mut upper, mut lower) = (V::load(y), W::load(&y[V::LANES..]));
    for c in 0..n {
        let (x, column) = (x(c), &a[first + m * c..first + m * c + rows]);
        upper = V::load(column).neg_mul_add(V::splat(x), upper);
        lower = W::load(&column[V::LANES..]).neg_mul_add(W::splat(x), lower);
    }
    upper.store(y);
    lower.store(&mut y[V::LANES..]);
}

/// The rows from `first` on, as many as one vector holds.
#[inline(always)]
fn subtract_vector<V: Lanes>(
    first: usize,
    m: usize,
    n: usize,
    a: &[f64],
    x: &impl Fn(usize) -> f64,
    y: &mut [f64],
) {
    let (a, y) = (&a[..m * n], &mut y[first..first + V::LANES]);
    let mut sum = V::load(y);
    for c in 0..n {
        sum = V::load(&a[first + m * c..]).neg_mul_add(V::splat(x(c)), sum);
    }
    sum.store(y);
}

/// Work on blocks of doubles as what has instructions of its own.
struct Dispatched<W>(W);

impl<W: BlockWork<f64>> Kernel for Dispatched<W> {
    type Output = W::Output;

    #[inline(always)]
    fn run<I: Isa>(self) -> W::Output {
        self.0.run::<InVectors<I>>()
    }
}

impl Scalar for f64 {
    fn to_f64(self) -> f64 {
        self
    }
    const ROUNDOFF: f64 = f64::EPSILON / 2.0;
    fn run<W: BlockWork<Self>>(work: W) -> W::Output {
        dispatch(Level::best(), Dispatched(work))
    }
}

impl Scalar for DoubleDouble {
    fn to_f64(self) -> f64 {
        self.to_f64()
    }
    const ROUNDOFF: f64 = f64::EPSILON * f64::EPSILON;
    fn run<W: BlockWork<Self>>(work: W) -> W::Output {
        work.run::<OneByOne>()
    }
}

/// Runs the expression with a constant bound for the sizes that joints and bodies have.
macro_rules! by_size {
    ($n:expr, |$v:ident| $body:expr) => {
        match $n {
            3 => {
                let $v = $crate::kernels::Fixed::<3>;
                $body
            }
            5 => {
                let $v = $crate::kernels::Fixed::<5>;
                $body
            }
            6 => {
                let $v = $crate::kernels::Fixed::<6>;
                $body
            }
            $v => $body,
        }
    };
}

/// Binds two block sizes, constant where both are one of the usual sizes.
macro_rules! by_sizes {
    ($m:expr, $n:expr, |$v:ident, $w:ident| $body:expr) => {
        match ($m, $n) {
            (3, 3) => {
                let ($v, $w) = ($crate::kernels::Fixed::<3>, $crate::kernels::Fixed::<3>);
                $body
            }
            (5, 5) => {
                let ($v, $w) = ($crate::kernels::Fixed::<5>, $crate::kernels::Fixed::<5>);
                $body
            }
            (6, 6) => {
                let ($v, $w) = ($crate::kernels::Fixed::<6>, $crate::kernels::Fixed::<6>);
                $body
            }
            ($v, $w) => $body,
        }
    };
}
pub(crate) use {by_size, by_sizes};

/// A loop bound: known at compile time ([`Fixed`]) or not (`usize`).
pub(crate) trait Bound: Copy {
    fn get(self) -> usize;
}

#[derive(Clone, Copy)]
pub(crate) struct Fixed<const N: usize>;

impl<const N: usize> Bound for Fixed<N> {
    #[inline(always)]
    fn get(self) -> usize {
        N
    }
}

impl Bound for usize {
    #[inline(always)]
    fn get(self) -> usize {
        self
    }
}

/// Most rows that are worked on at a time.
const STRIP: usize = 6;

/// y −= A x for `rows` rows of an m×n block from `first` on.
#[inline(always)]
fn subtract_strip<T: Scalar>(
    first: usize,
    rows: usize,
    m: usize,
    n: usize,
    a: &[T],
    x: &impl Fn(usize) -> T,
    y: &mut [T],
) {
    let (a, y) = (&a[..m * n], &mut y[first..first + rows]);
    let mut sum = [T::from(0.0); STRIP];
    sum[..rows].copy_from_slice(y);
    for c in 0..n {
        let (x, column) = (x(c), &a[first + m * c..first + m * c + rows]);
        for r in 0..rows {
            sum[r] = sum[r] - column[r] * x;
        }
    }
    y.copy_from_slice(&sum[..rows]);
}

/// Solves X Lᵀ = A for the m×n block A (unit lower L): `x` receives X = L_ik D, `a` becomes L_ik.
#[inline(always)]
pub(crate) fn panel_solve<S: Strips<T>, T: Scalar, M: Bound, N: Bound>(
    m: M,
    n: N,
    l: &[T],
    inverse: &[T],
    a: &mut [T],
    x: &mut [T],
) {
    let (m, n) = (m.get(), n.get());
    let (l, inverse) = (&l[..n * n], &inverse[..n]);
    let (a, x) = (&mut a[..m * n], &mut x[..m * n]);
    for c in 0..n {
        let (done, rest) = x.split_at_mut(m * c);
        let (column, a) = (&mut rest[..m], &mut a[m * c..m * (c + 1)]);
        column.copy_from_slice(a);
        S::subtract(m, c, done, |s| l[c + n * s], column);
        for (a, x) in a.iter_mut().zip(column) {
            *a = *x * inverse[c];
        }
    }
}

/// A −= X Lᵀ for an m×n block A, X m×k, L n×k.
#[inline(always)]
pub(crate) fn update<S: Strips<T>, T: Scalar, M: Bound, N: Bound, K: Bound>(
    m: M,
    n: N,
    k: K,
    a: &mut [T],
    x: &[T],
    l: &[T],
) {
    let (m, n, k) = (m.get(), n.get(), k.get());
    let (a, l) = (&mut a[..m * n], &l[..n * k]);
    for c in 0..n {
        S::subtract(m, k, x, |s| l[c + n * s], &mut a[m * c..m * (c + 1)]);
    }
}

/// Updates a diagonal block and records the magnitude of the terms subtracted from its diagonal.
#[inline(always)]
pub(crate) fn update_diagonal<S: Strips<T>, T: Scalar, N: Bound, K: Bound>(
    n: N,
    k: K,
    a: &mut [T],
    x: &[T],
    l: &[T],
    scale: &mut [f64],
) {
    let (n, k) = (n.get(), k.get());
    let (a, l, scale) = (&mut a[..n * n], &l[..n * k], &mut scale[..n]);
    for c in 0..n {
        let column = &mut a[n * c..n * (c + 1)];
        let before = column[c];
        S::subtract(n, k, x, |s| l[c + n * s], column);
        scale[c] = scale[c].max((before - column[c]).to_f64().abs());
    }
}

/// x ← L⁻¹ x for the unit lower triangle of an n×n block.
#[inline(always)]
pub(crate) fn unit_lower_solve<T: Scalar, N: Bound>(n: N, l: &[T], x: &mut [T]) {
    let n = n.get();
    let (l, x) = (&l[..n * n], &mut x[..n]);
    for c in 0..n {
        for r in c + 1..n {
            x[r] = x[r] - l[r + n * c] * x[c];
        }
    }
}

/// x ← L⁻ᵀ x.
#[inline(always)]
pub(crate) fn unit_upper_solve<T: Scalar, N: Bound>(n: N, l: &[T], x: &mut [T]) {
    let n = n.get();
    let (l, x) = (&l[..n * n], &mut x[..n]);
    for c in (0..n).rev() {
        for r in c + 1..n {
            x[c] = x[c] - l[r + n * c] * x[r];
        }
    }
}

/// y −= A x for an m×n block.
#[inline(always)]
pub(crate) fn subtract_product<S: Strips<T>, T: Scalar, M: Bound, N: Bound>(
    m: M,
    n: N,
    a: &[T],
    x: &[T],
    y: &mut [T],
) {
    let (m, n) = (m.get(), n.get());
    let x = &x[..n];
    S::subtract(m, n, a, |c| x[c], y);
}

/// y −= Aᵀ x for an m×n block.
#[inline(always)]
pub(crate) fn subtract_transposed<T: Scalar, M: Bound, N: Bound>(
    m: M,
    n: N,
    a: &[T],
    x: &[T],
    y: &mut [T],
) {
    let (m, n) = (m.get(), n.get());
    let (a, x, y) = (&a[..m * n], &x[..m], &mut y[..n]);
    for c in 0..n {
        let mut sum = y[c];
        for r in 0..m {
            sum = sum - a[r + m * c] * x[r];
        }
        y[c] = sum;
    }
}

/// y −= A x for a symmetric n×n block, of which the lower triangle is read.
#[inline(always)]
pub(crate) fn subtract_symmetric<T: Scalar, N: Bound>(n: N, a: &[T], x: &[T], y: &mut [T]) {
    let n = n.get();
    let (a, x, y) = (&a[..n * n], &x[..n], &mut y[..n]);
    for c in 0..n {
        let mut sum = y[c] - a[c + n * c] * x[c];
        for r in c + 1..n {
            y[r] = y[r] - a[r + n * c] * x[c];
            sum = sum - a[r + n * c] * x[r];
        }
        y[c] = sum;
    }
}
