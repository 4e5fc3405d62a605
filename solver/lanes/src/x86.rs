//! Vectors of x86-64 and the functions that may use them.
#![allow(unsafe_code)] // intrinsics and calls into functions with more instructions than the build's

mod halves;
mod transpose;

use crate::twice::Twice;
use crate::{Isa, Kernel, Lanes, Level, WideKernel};
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// AVX2 and FMA.
#[derive(Debug, Clone, Copy)]
struct Avx2;

impl Isa for Avx2 {
    type X1 = FusedOne;
    type X2 = FusedTwo;
    type X4 = FusedFour;
    type X8 = Twice<Self::X4>;
    type Widest = Self::X4;
    type Twice = Self::X8;
}

/// AVX-512: eight lanes, and 32 registers for fewer.
#[derive(Debug, Clone, Copy)]
struct Avx512;

impl Isa for Avx512 {
    type X1 = FusedOne;
    type X2 = FusedTwo;
    type X4 = FusedFour;
    type X8 = FusedEight;
    type Widest = Self::X8;
    type Twice = Twice<Self::X8>;

    #[inline(always)]
    fn wide<K: WideKernel>(kernel: K) -> K::Output {
        kernel.run::<Self::X8, 8>()
    }
}

pub(crate) fn avx2<K: Kernel>(level: Level, kernel: K) -> K::Output {
    #[target_feature(enable = "avx2,fma")]
    fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx2>()
    }
    debug_assert!(level >= Level::AVX2);
    // SAFETY: a `Level` of at least AVX2 exists only where the processor has AVX2 and FMA.
    unsafe { run(kernel) }
}

pub(crate) fn avx512<K: Kernel>(level: Level, kernel: K) -> K::Output {
    #[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
    fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx512>()
    }
    debug_assert!(level >= Level::AVX512);
    // SAFETY: the level AVX512 exists only where the processor has all of these.
    unsafe { run(kernel) }
}

/// One double whose multiply-adds are fused.
#[derive(Debug, Clone, Copy)]
struct FusedOne(f64);

macro_rules! one {
    ($($trait:ident $method:ident),*) => {$(
        impl $trait for FusedOne {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($trait::$method(self.0, other.0))
            }
        }
    )*};
}
one!(Add add, Sub sub, Mul mul, Div div);

impl Neg for FusedOne {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Lanes for FusedOne {
    const LANES: usize = 1;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(x)
    }
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> f64) -> Self {
        Self(f(0))
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Self(from[0])
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[0] = self.0;
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(f64::mul_add(self.0, a.0, b.0))
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self(f64::mul_add(-self.0, a.0, b.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(Lanes::max(self.0, other.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(Lanes::min(self.0, other.0))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    #[inline(always)]
    fn all_below(self, other: Self) -> bool {
        self.0 < other.0
    }
    #[inline(always)]
    fn shift_in(self, next: Self) -> Self {
        next
    }
    #[inline(always)]
    fn first_lane(self) -> f64 {
        self.0
    }
}

/// A vector from its intrinsics. What each block relies on: values of the type exist only inside kernels that
/// [`crate::dispatch`] runs at a level with the instructions, for the instruction sets are private to this crate.
macro_rules! vector {
    ($(#[$doc:meta])* $name:ident, $inner:ty, $lanes:literal, set $set:ident($($lane:literal)*), splat $splat:ident, load $load:ident, store $store:ident,
     add $add:ident, sub $sub:ident, mul $mul:ident, div $div:ident, max $max:ident, min $min:ident, sqrt $sqrt:ident,
     below |$g:ident, $h:ident| $below:expr, neg |$n:ident| $neg:expr, abs |$p:ident| $abs:expr,
     shift |$q:ident, $r:ident| $shift:expr, first |$s:ident| $first:expr,
     mul_add |$a:ident, $b:ident, $c:ident| $fma:expr, neg_mul_add |$d:ident, $e:ident, $f:ident| $fnma:expr
     $(, more { $($more:tt)* })?) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy)]
        struct $name($inner);

        vector!(@binary $name, Add add $add, Sub sub $sub, Mul mul $mul, Div div $div);

        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                let $n = self.0;
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $neg })
            }
        }

        impl Lanes for $name {
            const LANES: usize = $lanes;

            $($($more)*)?

            #[inline(always)]
            fn splat(x: f64) -> Self {
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $splat(x) })
            }
            #[inline(always)]
            fn from_fn(mut f: impl FnMut(usize) -> f64) -> Self {
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $set($(f($lane)),*) })
            }
            #[inline(always)]
            fn load(from: &[f64]) -> Self {
                let from = &from[..$lanes];
                // SAFETY: as in `vector`; the slice has as many doubles as are read, and no alignment is needed.
                Self(unsafe { $load(from.as_ptr()) })
            }
            #[inline(always)]
            fn store(self, to: &mut [f64]) {
                let to = &mut to[..$lanes];
                // SAFETY: as in `vector`; the slice has as many doubles as are written, and no alignment is needed.
                unsafe { $store(to.as_mut_ptr(), self.0) }
            }
            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                let ($a, $b, $c) = (self.0, a.0, b.0);
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $fma })
            }
            #[inline(always)]
            fn neg_mul_add(self, a: Self, b: Self) -> Self {
                let ($d, $e, $f) = (self.0, a.0, b.0);
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $fnma })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                let $p = self.0;
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $abs })
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $max(self.0, other.0) })
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $min(self.0, other.0) })
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn all_below(self, other: Self) -> bool {
                let ($g, $h) = (self.0, other.0);
                // SAFETY: the processor has the instructions, see `vector`.
                unsafe { $below }
            }
            #[inline(always)]
            fn shift_in(self, next: Self) -> Self {
                let ($q, $r) = (self.0, next.0);
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $shift })
            }
            #[inline(always)]
            fn first_lane(self) -> f64 {
                let $s = self.0;
                // SAFETY: the processor has the instructions, see `vector`.
                unsafe { $first }
            }
        }
    };
    (@binary $name:ident, $($trait:ident $method:ident $intrinsic:ident),*) => {$(
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )*};
}

vector!(
    /// Two lanes with fused multiply-adds.
    FusedTwo, __m128d, 2, set _mm_setr_pd(0 1), splat _mm_set1_pd, load _mm_loadu_pd, store _mm_storeu_pd,
    add _mm_add_pd, sub _mm_sub_pd, mul _mm_mul_pd, div _mm_div_pd, max _mm_max_pd, min _mm_min_pd, sqrt _mm_sqrt_pd,
    below |a, b| _mm_movemask_pd(_mm_cmplt_pd(a, b)) == 0b11,
    neg |x| _mm_xor_pd(x, _mm_set1_pd(-0.0)), abs |x| _mm_andnot_pd(_mm_set1_pd(-0.0), x),
    shift |x, y| _mm_shuffle_pd::<1>(x, y), first |x| _mm_cvtsd_f64(x),
    mul_add |a, b, c| _mm_fmadd_pd(a, b, c), neg_mul_add |a, b, c| _mm_fnmadd_pd(a, b, c)
);
vector!(
    /// Four lanes with fused multiply-adds.
    FusedFour, __m256d, 4, set _mm256_setr_pd(0 1 2 3), splat _mm256_set1_pd, load _mm256_loadu_pd, store _mm256_storeu_pd,
    add _mm256_add_pd, sub _mm256_sub_pd, mul _mm256_mul_pd, div _mm256_div_pd, max _mm256_max_pd,
    min _mm256_min_pd, sqrt _mm256_sqrt_pd,
    below |a, b| _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(a, b)) == 0b1111,
    neg |x| _mm256_xor_pd(x, _mm256_set1_pd(-0.0)), abs |x| _mm256_andnot_pd(_mm256_set1_pd(-0.0), x),
    shift |x, y| _mm256_shuffle_pd::<0b0101>(x, _mm256_permute2f128_pd::<0x21>(x, y)),
    first |x| _mm256_cvtsd_f64(x),
    mul_add |a, b, c| _mm256_fmadd_pd(a, b, c), neg_mul_add |a, b, c| _mm256_fnmadd_pd(a, b, c),
    more { transpose::fours!(); }
);
vector!(
    /// Eight lanes with fused multiply-adds.
    FusedEight, __m512d, 8, set _mm512_setr_pd(0 1 2 3 4 5 6 7), splat _mm512_set1_pd, load _mm512_loadu_pd, store _mm512_storeu_pd,
    add _mm512_add_pd, sub _mm512_sub_pd, mul _mm512_mul_pd, div _mm512_div_pd, max _mm512_max_pd,
    min _mm512_min_pd, sqrt _mm512_sqrt_pd,
    below |a, b| _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b) == 0xff,
    neg |x| _mm512_xor_pd(x, _mm512_set1_pd(-0.0)), abs |x| _mm512_abs_pd(x),
    shift |x, y| _mm512_castsi512_pd(_mm512_alignr_epi64::<1>(_mm512_castpd_si512(y), _mm512_castpd_si512(x))),
    first |x| _mm512_cvtsd_f64(x),
    mul_add |a, b, c| _mm512_fmadd_pd(a, b, c), neg_mul_add |a, b, c| _mm512_fnmadd_pd(a, b, c),
    more { transpose::fours!(); transpose::sixes!(); }
);
