//! Halves of vectors, joined, taken apart and filled from two places.

use super::{FusedEight, FusedFour, FusedOne, FusedTwo};
use crate::{Halves, Quad};
use std::arch::x86_64::*;

/// The halves of a vector from its intrinsics; what the blocks rely on is as in `vector`.
macro_rules! halves {
    ($name:ident of $half:ident, join |$v:ident, $x:ident| $join:expr, lower |$y:ident| $lower:expr,
     upper |$z:ident| $upper:expr) => {
        impl Halves for $name {
            type Half = $half;

            #[inline(always)]
            fn join(lower: $half, upper: $half) -> Self {
                let ($v, $x) = (lower.0, upper.0);
                // SAFETY: the processor has the instructions, see `vector`.
                Self(unsafe { $join })
            }
            #[inline(always)]
            fn lower(self) -> $half {
                let $y = self.0;
                // SAFETY: the processor has the instructions, see `vector`.
                $half(unsafe { $lower })
            }
            #[inline(always)]
            fn upper(self) -> $half {
                let $z = self.0;
                // SAFETY: the processor has the instructions, see `vector`.
                $half(unsafe { $upper })
            }
        }
    };
}

/// The lane of a vector of one.
#[inline(always)]
fn first(x: __m128d) -> f64 {
    // SAFETY: SSE2 is in every x86-64 processor.
    unsafe { _mm_cvtsd_f64(x) }
}

impl Halves for FusedTwo {
    type Half = FusedOne;

    #[inline(always)]
    fn join(lower: FusedOne, upper: FusedOne) -> Self {
        // SAFETY: SSE2 is in every x86-64 processor.
        Self(unsafe { _mm_setr_pd(lower.0, upper.0) })
    }
    #[inline(always)]
    fn lower(self) -> FusedOne {
        FusedOne(first(self.0))
    }
    #[inline(always)]
    fn upper(self) -> FusedOne {
        // SAFETY: SSE2 is in every x86-64 processor.
        FusedOne(first(unsafe { _mm_unpackhi_pd(self.0, self.0) }))
    }
}

halves!(
    FusedFour of FusedTwo,
    join |x, y| _mm256_setr_m128d(x, y),
    lower |x| _mm256_castpd256_pd128(x),
    upper |x| _mm256_extractf128_pd::<1>(x)
);
halves!(
    FusedEight of FusedFour,
    join |x, y| _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(x), y),
    lower |x| _mm512_castpd512_pd256(x),
    upper |x| _mm512_extractf64x4_pd::<1>(x)
);

/// Both halves from the same two doubles: a load, unlike [`Halves::both`].
#[inline(always)]
fn twice(from: &[f64; 2]) -> __m256d {
    // SAFETY: as in `vector`; there are as many doubles as are read, and no alignment is needed.
    unsafe {
        let half = _mm_loadu_pd(from.as_ptr());
        _mm256_setr_m128d(half, half)
    }
}

impl Quad for FusedFour {
    #[inline(always)]
    fn interleave(p: &[f64; 2], q: &[f64; 2]) -> Self {
        // SAFETY: the processor has the instructions, see `vector`.
        Self(unsafe { _mm256_shuffle_pd::<0b1100>(twice(p), twice(q)) })
    }
}
