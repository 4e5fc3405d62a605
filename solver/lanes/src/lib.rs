//! Doubles side by side: a kernel is written once, over [`Lanes`], and runs on whatever vectors the processor has.
//!
//! A [`Kernel`] is generic over an instruction set [`Isa`], which names its vectors of 1, 2, 4 and 8 doubles. Lanes are
//! independent problems: the two ends of a chain, joints of a cable, cables. [`dispatch`] runs a kernel at a [`Level`],
//! of which values exist only where the processor has the instructions; this is what makes the vectors' arithmetic safe
//! to call. No level rounds otherwise than IEEE 754 says, but multiply-adds round once where they are fused
//! (the levels `avx2` and `avx512`) and twice elsewhere.
//!
//! ```
//! use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};
//!
//! /// y ← y + a x.
//! struct Axpy<'a>(f64, &'a [f64], &'a mut [f64]);
//!
//! impl Kernel for Axpy<'_> {
//!     type Output = ();
//!
//!     #[inline(always)] // without it the instructions are not those of the level
//!     fn run<I: Isa>(self) {
//!         let (x, y) = (self.1.chunks_exact(4), self.2.chunks_exact_mut(4));
//!         for (x, y) in x.zip(y) {
//!             I::X4::splat(self.0).mul_add(I::X4::load(x), I::X4::load(y)).store(y);
//!         }
//!     }
//! }
//!
//! let mut y = [1.0, 2.0, 3.0, 4.0];
//! dispatch(Level::best(), Axpy(2.0, &[1.0; 4], &mut y));
//! assert_eq!(y, [3.0, 4.0, 5.0, 6.0]);
//! ```
//!
//! # Mathematics
//! In each lane, for numbers x, a and b, `mul_add` is fl(x a + b) and `neg_mul_add` is fl(b − x a),
//! rounded once or twice as said; `max` and `min` give the second where either is NaN.
//! [`functions`] has x / sin x, arctan, sin x / x and cos near zero, by polynomials; [`vector`] has
//! 3-vectors and symmetric 3×3 matrices of lanes. No number has a unit here: lanes hold the
//! caller's quantities.
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | the root | [`Lanes`], [`Isa`], [`Kernel`], [`dispatch`]: what a kernel is written over; [`WideKernel`], [`dispatch_wide`]: as many lanes as a register holds |
//! | `level` | [`Level`]: what the processor has, and `TAUT_SIMD`, which asks for less |
//! | [`functions`] | elementary functions of lanes |
//! | [`vector`] | vectors and matrices whose components are lanes |
//! | `aligned` | [`Aligned`]: doubles of which one begins a cache line |
//! | `halves` | [`Halves`] and [`Quad`]: vectors that split into two and four |
//! | `twice` | two vectors as one of twice the lanes, where registers are shorter |
//! | `x86` | AVX2 and AVX-512 by intrinsics: the only unsafe code |

mod aligned;
pub mod functions;
mod halves;
mod level;
mod twice;
pub mod vector;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use aligned::Aligned;
pub use halves::{Halves, Quad};
pub use level::{Level, ParseLevelError};

use std::ops::{Add, Div, Mul, Neg, Sub};
use twice::Twice;

/// Some doubles side by side; arithmetic is lane by lane.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Number of lanes.
    const LANES: usize;

    /// `x` in every lane.
    fn splat(x: f64) -> Self;

    /// `f(lane)` in each lane.
    fn from_fn(f: impl FnMut(usize) -> f64) -> Self;

    /// The first lanes' worth of `from`.
    ///
    /// # Panics
    /// Where `from` is shorter.
    fn load(from: &[f64]) -> Self;

    /// Into the first lanes' worth of `to`.
    ///
    /// # Panics
    /// Where `to` is shorter.
    fn store(self, to: &mut [f64]);

    /// The first and the second number of each lane's pair.
    #[must_use]
    #[inline(always)]
    fn load_pairs<const L: usize>(from: [&[f64; 2]; L]) -> [Self; 2] {
        [Self::from_fn(|l| from[l][0]), Self::from_fn(|l| from[l][1])]
    }

    /// Component by component from one array a lane, one after the other. Another `L` does not compile.
    #[must_use]
    #[inline(always)]
    fn load_arrays<const L: usize, const N: usize>(from: &[[f64; N]; L]) -> [Self; N] {
        vector::gather(from.each_ref())
    }

    /// The reverse.
    #[inline(always)]
    fn store_arrays<const L: usize, const N: usize>(from: &[Self; N], to: &mut [[f64; N]; L]) {
        Self::spread(from, to.each_mut());
    }

    /// Each of the `L` lanes of the components into the numbers from its place on, one lane after the other. Another `L`
    /// does not compile.
    ///
    /// # Panics
    /// Where a place is beyond `to`.
    #[inline(always)]
    fn scatter<const L: usize, const N: usize>(from: &[Self; N], to: &mut [f64], at: [usize; L]) {
        const { assert!(L == Self::LANES) };
        let mut lanes = [[0.0; L]; N];
        for (from, lanes) in from.iter().zip(&mut lanes) {
            from.store(lanes);
        }
        for l in 0..L {
            for (to, lanes) in to[at[l]..at[l] + N].iter_mut().zip(&lanes) {
                *to = lanes[l];
            }
        }
    }

    /// Like [`scatter`](Self::scatter), for a multiple of four components; other numbers do not
    /// compile. Stores vectors of four numbers where the instruction set has them: fast if places
    /// are aligned to them.
    ///
    /// # Panics
    /// Where a place is beyond `to`.
    #[inline(always)]
    fn scatter_fours<const L: usize, const N: usize>(
        from: &[Self; N],
        to: &mut [f64],
        at: [usize; L],
    ) {
        const { assert!(N.is_multiple_of(4)) };
        Self::scatter(from, to, at);
    }

    /// Each of the `L` lanes of the components into its own numbers: what [`vector::gather`] takes apart. Another `L` does
    /// not compile.
    #[inline(always)]
    fn spread<const L: usize, const N: usize>(from: &[Self; N], to: [&mut [f64; N]; L]) {
        const { assert!(L == Self::LANES) };
        let mut lanes = [[0.0; L]; N];
        for (from, lanes) in from.iter().zip(&mut lanes) {
            from.store(lanes);
        }
        for (l, to) in to.into_iter().enumerate() {
            for (to, lanes) in to.iter_mut().zip(&lanes) {
                *to = lanes[l];
            }
        }
    }

    /// self · a + b.
    #[must_use]
    fn mul_add(self, a: Self, b: Self) -> Self;

    /// b − self · a.
    #[must_use]
    fn neg_mul_add(self, a: Self, b: Self) -> Self;

    /// |self|.
    #[must_use]
    fn abs(self) -> Self;

    /// The larger of the two; `other` where either is NaN or both are zeros.
    #[must_use]
    fn max(self, other: Self) -> Self;

    /// The smaller of the two; `other` where either is NaN or both are zeros.
    #[must_use]
    fn min(self, other: Self) -> Self;

    /// √self.
    #[must_use]
    fn sqrt(self) -> Self;

    /// True if each lane is less than that of `other`; false if either is NaN in any lane.
    fn all_below(self, other: Self) -> bool;

    /// All lanes but the first, and after them the first of `next`.
    #[must_use]
    fn shift_in(self, next: Self) -> Self;

    /// The first lane.
    #[must_use]
    fn first_lane(self) -> f64;

    /// The largest lane; any lane where one is NaN.
    #[must_use]
    #[inline(always)]
    fn max_lane(self) -> f64 {
        let mut lanes = [f64::NEG_INFINITY; 8];
        self.store(&mut lanes);
        lanes[..Self::LANES]
            .iter()
            .fold(f64::NEG_INFINITY, |a, &b| if a > b { a } else { b })
    }
}

impl Lanes for f64 {
    const LANES: usize = 1;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> f64) -> Self {
        f(0)
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        from[0]
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[0] = self;
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        // Without the instruction a fused one would be a call.
        self * a + b
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        b - self * a
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn all_below(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn shift_in(self, next: Self) -> Self {
        next
    }
    #[inline(always)]
    fn first_lane(self) -> f64 {
        self
    }
}

/// An instruction set: its vectors.
pub trait Isa: Copy + 'static {
    /// One double.
    type X1: Lanes;
    /// Two.
    type X2: Halves<Half = Self::X1>;
    /// Four.
    type X4: Quad<Half = Self::X2>;
    /// Eight.
    type X8: Halves<Half = Self::X4>;
    /// As many as a register holds.
    type Widest: Lanes;
    /// Two of these.
    type Twice: Halves<Half = Self::Widest>;

    /// Runs work with eight lanes where a register holds as many, with four elsewhere.
    #[inline(always)]
    fn wide<K: WideKernel>(kernel: K) -> K::Output {
        kernel.run::<Self::X4, 4>()
    }
}

/// Work that is written once for all instruction sets.
pub trait Kernel {
    /// Result of the work.
    type Output;

    /// The work. It, and what it calls with vectors, must be `#[inline(always)]`.
    fn run<I: Isa>(self) -> Self::Output;
}

/// Work on many things alike, for vectors of four or eight lanes.
pub trait WideKernel {
    /// Result of the work.
    type Output;

    /// The work with vectors of `L` lanes. It, and what it calls with vectors, must be `#[inline(always)]`.
    fn run<V: Lanes, const L: usize>(self) -> Self::Output;
}

/// Plain doubles, which every processor has.
#[derive(Debug, Clone, Copy)]
struct Portable;

impl Isa for Portable {
    type X1 = f64;
    type X2 = Twice<f64>;
    type X4 = Twice<Self::X2>;
    type X8 = Twice<Self::X4>;
    type Widest = Self::X1;
    type Twice = Self::X2;
}

/// Runs a kernel at a level.
#[inline]
pub fn dispatch<K: Kernel>(level: Level, kernel: K) -> K::Output {
    match level {
        #[cfg(target_arch = "x86_64")]
        Level::AVX2 => x86::avx2(level, kernel),
        #[cfg(target_arch = "x86_64")]
        Level::AVX512 => x86::avx512(level, kernel),
        _ => portable(kernel),
    }
}

fn portable<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Portable>()
}

/// Runs a kernel at a level with its own number of lanes.
#[inline]
pub fn dispatch_wide<K: WideKernel>(level: Level, kernel: K) -> K::Output {
    dispatch(level, Wide(kernel))
}

/// Runs a kernel with eight lanes at any level: tests of what runs where registers hold as many.
#[inline]
pub fn dispatch_eight<K: WideKernel>(level: Level, kernel: K) -> K::Output {
    dispatch(level, Eight(kernel))
}

struct Eight<K>(K);

impl<K: WideKernel> Kernel for Eight<K> {
    type Output = K::Output;

    #[inline(always)]
    fn run<I: Isa>(self) -> K::Output {
        self.0.run::<I::X8, 8>()
    }
}

struct Wide<K>(K);

impl<K: WideKernel> Kernel for Wide<K> {
    type Output = K::Output;

    #[inline(always)]
    fn run<I: Isa>(self) -> K::Output {
        I::wide(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All operations on numbers that tell lanes apart.
    struct Everything<'a>(&'a mut Vec<f64>);

    #[inline(always)]
    fn everything<V: Lanes>(out: &mut Vec<f64>) {
        let a: Vec<f64> = (0..V::LANES).map(|i| 1.5 + i as f64 * 0.7).collect();
        let b: Vec<f64> = (0..V::LANES).map(|i| 4.0 - i as f64 * 1.1).collect();
        let (x, y) = (V::load(&a), V::from_fn(|i| b[i]));
        let third = V::splat(1.0 / 3.0);
        let results = [
            x + y,
            x - y,
            x * y,
            x / y,
            -x,
            y.abs(),
            x.max(y),
            x.min(y),
            x.sqrt(),
            x.mul_add(y, third),
            x.neg_mul_add(y, third),
        ];
        let mut lanes = vec![0.0; V::LANES];
        for v in results {
            v.store(&mut lanes);
            out.extend_from_slice(&lanes);
        }
        for (i, (a, b)) in a.iter().zip(&b).enumerate() {
            let exact = [
                a + b,
                a - b,
                a * b,
                a / b,
                -a,
                b.abs(),
                f64::max(*a, *b),
                f64::min(*a, *b),
                a.sqrt(),
                a * b + 1.0 / 3.0,
                1.0 / 3.0 - a * b,
            ];
            for (k, exact) in exact.into_iter().enumerate() {
                let found = out[out.len() - 11 * V::LANES + k * V::LANES + i];
                // Fused multiply-adds differ by the rounding of a product below 32.
                let rounding = if k < 9 { 0.0 } else { 32.0 * f64::EPSILON };
                let off = (found - exact).abs();
                assert!(off <= rounding, "{} lanes, {k}: {found} {exact}", V::LANES);
            }
        }
        assert_eq!(x.max_lane(), a[V::LANES - 1]);
        assert_eq!(y.first_lane(), b[0]);
        x.shift_in(y).store(&mut lanes);
        assert_eq!(lanes, [&a[1..], &b[..1]].concat(), "{} lanes", V::LANES);
    }

    struct Pairs;

    /// `L` pairs, put together and taken apart in every way.
    #[inline(always)]
    fn pairs<V: Lanes, const L: usize>() {
        let from: [[f64; 2]; L] = std::array::from_fn(|l| [1.0, 2.0].map(|x| x + 2.0 * l as f64));
        let [first, second] = V::load_pairs(from.each_ref());
        let [firsts, seconds]: [[f64; L]; 2] = vector::save(&[first, second]);
        assert_eq!(firsts, from.map(|[a, _]| a));
        assert_eq!(seconds, from.map(|[_, b]| b));
        let triples = from.map(|[a, b]| [a, b, -a]);
        let gathered: [V; 3] = vector::gather(triples.each_ref());
        let gathered: [[f64; L]; 3] = vector::save(&gathered);
        assert_eq!(gathered, [firsts, seconds, firsts.map(|a| -a)]);
        let mut to = [0.0; 32];
        let at: [usize; L] = std::array::from_fn(|l| 2 * l);
        V::scatter(&[first, second], &mut to, at);
        assert_eq!(to.as_chunks().0[..L], from);
        let fours = [first, second, second, first, first, first, second, second];
        let mut to_fours = [0.0; 80];
        let at: [usize; L] = std::array::from_fn(|l| 9 * l);
        V::scatter_fours(&fours, &mut to_fours, at);
        for (at, [a, b]) in at.into_iter().zip(from) {
            assert_eq!(to_fours[at..at + 9], [a, b, b, a, a, a, b, b, 0.0]);
        }
        // Where places overlap the last one stays.
        V::scatter(&[first, second, first], &mut to, [5; L]);
        assert_eq!(to[5..8], triples[L - 1].map(f64::abs));
        let mut to = [[0.0; 3]; L];
        V::spread(&[first, second, first], to.each_mut());
        assert_eq!(to, from.map(|[a, b]| [a, b, a]));
        let rows: [[f64; 6]; L] =
            std::array::from_fn(|l| std::array::from_fn(|c| (10 * l + c) as f64));
        let components = V::load_arrays(&rows);
        let lanes: [[f64; L]; 6] = vector::save(&components);
        for (c, lanes) in lanes.into_iter().enumerate() {
            assert_eq!(lanes, rows.map(|row| row[c]));
        }
        let mut to = [[0.0; 6]; L];
        V::store_arrays(&components, &mut to);
        assert_eq!(to, rows);
    }

    impl Kernel for Pairs {
        type Output = ();

        #[inline(always)]
        fn run<I: Isa>(self) {
            pairs::<I::X4, 4>();
            pairs::<I::X8, 8>();
        }
    }

    #[test]
    fn pairs_come_and_go() {
        for level in Level::available() {
            dispatch(level, Pairs);
        }
    }

    impl Kernel for Everything<'_> {
        type Output = ();

        #[inline(always)]
        fn run<I: Isa>(self) {
            everything::<I::X1>(self.0);
            everything::<I::X2>(self.0);
            everything::<I::X4>(self.0);
            everything::<I::X8>(self.0);
        }
    }

    #[test]
    fn every_level_computes_the_same() {
        for level in Level::available() {
            let mut out = Vec::new();
            dispatch(level, Everything(&mut out));
            assert_eq!(out.len(), 11 * (1 + 2 + 4 + 8), "{level}");
            // The lanes of a level agree with each other bit for bit.
            let one = &out[..11];
            let two = &out[11..33];
            let all_hold = one.iter().zip(two.chunks(2)).all(|(a, b)| *a == b[0]);
            assert!(all_hold, "{level}");
        }
    }

    #[test]
    fn wide_kernels_take_the_level_s_own_lanes() {
        struct Width;
        impl WideKernel for Width {
            type Output = usize;
            #[inline(always)]
            fn run<V: Lanes, const L: usize>(self) -> usize {
                assert_eq!(V::LANES, L);
                L
            }
        }
        for level in Level::available() {
            let found = dispatch_wide(level, Width);
            assert_eq!(found, level.widest().max(4), "{level}");
        }
    }

    #[test]
    #[should_panic(expected = "range end index")]
    fn short_slices_are_refused() {
        struct Short;
        impl Kernel for Short {
            type Output = f64;
            #[inline(always)]
            fn run<I: Isa>(self) -> f64 {
                I::X4::load(&[1.0, 2.0]).max_lane()
            }
        }
        dispatch(Level::best(), Short);
    }

    #[test]
    fn comparisons_with_nan_take_the_other() {
        struct Nan;
        impl Kernel for Nan {
            type Output = ();
            #[inline(always)]
            fn run<I: Isa>(self) {
                let (nan, one) = (I::X4::splat(f64::NAN), I::X4::splat(1.0));
                assert_eq!(nan.max(one).max_lane(), 1.0);
                assert_eq!(nan.min(one).max_lane(), 1.0);
                assert!(one.max(nan).max_lane().is_nan() || one.max(nan).max_lane() < 1.0);
            }
        }
        for level in Level::available() {
            dispatch(level, Nan);
        }
    }
}
