//! From structures to lanes and back: transpositions by pairs of doubles, and by fours.

use super::{FusedEight, FusedFour};
use crate::{Halves, Lanes};
use std::arch::x86_64::*;

/// Lanes that are put together and taken apart by pairs and fours.
pub(super) trait Transpose<const L: usize>: Copy {
    /// The first and the second number of each pair.
    fn join(from: [&[f64; 2]; L]) -> [Self; 2];

    /// The pair of each lane.
    fn split(first: Self, second: Self) -> [__m128d; L];

    /// The numbers of each lane, a multiple of four, into memory from its place on.
    fn scatter(from: &[Self], to: &mut [f64], at: [usize; L]);
}

/// The methods of [`crate::Lanes`] that such lanes have of their own.
macro_rules! fours {
    () => {
        #[inline(always)]
        fn load_pairs<const L: usize>(from: [&[f64; 2]; L]) -> [Self; 2] {
            const { assert!(L == Self::LANES) };
            let mut all = [&[0.0; 2]; Self::LANES];
            for (all, from) in all.iter_mut().zip(from) {
                *all = from;
            }
            $crate::x86::transpose::Transpose::join(all)
        }

        #[inline(always)]
        fn scatter<const L: usize, const N: usize>(
            from: &[Self; N],
            to: &mut [f64],
            at: [usize; L],
        ) {
            const { assert!(L == Self::LANES) };
            let pairs = $crate::x86::transpose::split_all::<_, { Self::LANES }, N>(from);
            for (lane, at) in at.into_iter().enumerate() {
                $crate::x86::transpose::put(&pairs, lane, &mut to[at..at + N]);
            }
        }

        #[inline(always)]
        fn spread<const L: usize, const N: usize>(from: &[Self; N], to: [&mut [f64; N]; L]) {
            const { assert!(L == Self::LANES) };
            let pairs = $crate::x86::transpose::split_all::<_, { Self::LANES }, N>(from);
            for (lane, to) in to.into_iter().enumerate() {
                $crate::x86::transpose::put(&pairs, lane, to);
            }
        }

        #[inline(always)]
        fn scatter_fours<const L: usize, const N: usize>(
            from: &[Self; N],
            to: &mut [f64],
            at: [usize; L],
        ) {
            const { assert!(L == Self::LANES && N.is_multiple_of(4)) };
            let mut places = [0; Self::LANES];
            places.copy_from_slice(&at);
            $crate::x86::transpose::Transpose::scatter(from, to, places);
        }
    };
}
pub(super) use fours;

/// The methods that eight lanes have of their own: arrays of six numbers, as joints have rows, fill six registers.
macro_rules! sixes {
    () => {
        #[inline(always)]
        fn load_arrays<const L: usize, const N: usize>(from: &[[f64; N]; L]) -> [Self; N] {
            let flat = from.as_flattened();
            if N == 6
                && let (vectors, []) = flat.as_chunks::<8>()
                && let [a, b, c, d, e, f] = vectors
            {
                let six = $crate::x86::transpose::join_six([a, b, c, d, e, f]);
                let mut to = [Self::splat(0.0); N];
                for (to, from) in to.iter_mut().zip(six) {
                    *to = from;
                }
                return to;
            }
            $crate::vector::gather(from.each_ref())
        }

        #[inline(always)]
        fn store_arrays<const L: usize, const N: usize>(from: &[Self; N], to: &mut [[f64; N]; L]) {
            if N == 6
                && let Some(six) = from.first_chunk::<6>()
            {
                let (vectors, _) = to.as_flattened_mut().as_chunks_mut::<8>();
                for (to, from) in vectors
                    .iter_mut()
                    .zip($crate::x86::transpose::split_six(six))
                {
                    from.store(to);
                }
                return;
            }
            Self::spread(from, to.each_mut());
        }
    };
}
pub(super) use sixes;

/// A pair as a vector.
#[inline(always)]
fn pair(from: &[f64; 2]) -> __m128d {
    // SAFETY: every x86-64 has the instruction; the pair has the two doubles that are read, and no alignment is needed.
    unsafe { _mm_loadu_pd(from.as_ptr()) }
}

impl Transpose<4> for FusedFour {
    #[inline(always)]
    fn join([a, b, c, d]: [&[f64; 2]; 4]) -> [Self; 2] {
        // SAFETY: the processor has the instructions: only kernels that run with them use these lanes.
        unsafe {
            let even = _mm256_castpd128_pd256(pair(a));
            let even = _mm256_insertf128_pd::<1>(even, pair(c));
            let odd = _mm256_castpd128_pd256(pair(b));
            let odd = _mm256_insertf128_pd::<1>(odd, pair(d));
            [
                Self(_mm256_unpacklo_pd(even, odd)),
                Self(_mm256_unpackhi_pd(even, odd)),
            ]
        }
    }

    #[inline(always)]
    fn split(Self(first): Self, Self(second): Self) -> [__m128d; 4] {
        // SAFETY: as above.
        unsafe {
            let even = _mm256_unpacklo_pd(first, second);
            let odd = _mm256_unpackhi_pd(first, second);
            [
                _mm256_castpd256_pd128(even),
                _mm256_castpd256_pd128(odd),
                _mm256_extractf128_pd::<1>(even),
                _mm256_extractf128_pd::<1>(odd),
            ]
        }
    }

    #[inline(always)]
    fn scatter(from: &[Self], to: &mut [f64], at: [usize; 4]) {
        for (c, four) in from.as_chunks::<4>().0.iter().enumerate() {
            for (lane, at) in split_four(*four).into_iter().zip(at) {
                put_four(lane, &mut to[at + 4 * c..]);
            }
        }
    }
}

/// The four numbers of each lane.
#[inline(always)]
fn split_four(
    [FusedFour(a), FusedFour(b), FusedFour(c), FusedFour(d)]: [FusedFour; 4],
) -> [__m256d; 4] {
    // SAFETY: as above.
    unsafe {
        let (ab, cd) = (_mm256_unpacklo_pd(a, b), _mm256_unpacklo_pd(c, d));
        let (ab_odd, cd_odd) = (_mm256_unpackhi_pd(a, b), _mm256_unpackhi_pd(c, d));
        [
            _mm256_permute2f128_pd::<0x20>(ab, cd),
            _mm256_permute2f128_pd::<0x20>(ab_odd, cd_odd),
            _mm256_permute2f128_pd::<0x31>(ab, cd),
            _mm256_permute2f128_pd::<0x31>(ab_odd, cd_odd),
        ]
    }
}

impl Transpose<8> for FusedEight {
    #[inline(always)]
    fn join([a, b, c, d, e, f, g, h]: [&[f64; 2]; 8]) -> [Self; 2] {
        // SAFETY: as above.
        unsafe {
            let even = _mm512_castpd128_pd512(pair(a));
            let even = _mm512_insertf64x2::<1>(even, pair(c));
            let even = _mm512_insertf64x2::<2>(even, pair(e));
            let even = _mm512_insertf64x2::<3>(even, pair(g));
            let odd = _mm512_castpd128_pd512(pair(b));
            let odd = _mm512_insertf64x2::<1>(odd, pair(d));
            let odd = _mm512_insertf64x2::<2>(odd, pair(f));
            let odd = _mm512_insertf64x2::<3>(odd, pair(h));
            [
                Self(_mm512_unpacklo_pd(even, odd)),
                Self(_mm512_unpackhi_pd(even, odd)),
            ]
        }
    }

    #[inline(always)]
    fn split(Self(first): Self, Self(second): Self) -> [__m128d; 8] {
        // SAFETY: as above.
        unsafe {
            let even = _mm512_unpacklo_pd(first, second);
            let odd = _mm512_unpackhi_pd(first, second);
            [
                _mm512_castpd512_pd128(even),
                _mm512_castpd512_pd128(odd),
                _mm512_extractf64x2_pd::<1>(even),
                _mm512_extractf64x2_pd::<1>(odd),
                _mm512_extractf64x2_pd::<2>(even),
                _mm512_extractf64x2_pd::<2>(odd),
                _mm512_extractf64x2_pd::<3>(even),
                _mm512_extractf64x2_pd::<3>(odd),
            ]
        }
    }

    #[inline(always)]
    fn scatter(from: &[Self], to: &mut [f64], at: [usize; 8]) {
        let (eights, four) = from.as_chunks::<8>();
        for (c, eight) in eights.iter().enumerate() {
            for (lane, at) in split_eight(*eight).into_iter().zip(at) {
                lane.store(&mut to[at + 8 * c..]);
            }
        }
        if let Some([a, b, c, d]) = four.first_chunk() {
            let lower = split_four([a.lower(), b.lower(), c.lower(), d.lower()]);
            let upper = split_four([a.upper(), b.upper(), c.upper(), d.upper()]);
            for (lane, at) in lower.into_iter().chain(upper).zip(at) {
                put_four(lane, &mut to[at + 8 * eights.len()..]);
            }
        }
    }
}

/// The eight numbers of each lane.
#[inline(always)]
fn split_eight(from: [FusedEight; 8]) -> [FusedEight; 8] {
    let [a, b, c, d, e, f, g, h] = from.map(|x| x.0);
    // SAFETY: as above.
    unsafe {
        let even = blocks([
            _mm512_unpacklo_pd(a, b),
            _mm512_unpacklo_pd(c, d),
            _mm512_unpacklo_pd(e, f),
            _mm512_unpacklo_pd(g, h),
        ]);
        let odd = blocks([
            _mm512_unpackhi_pd(a, b),
            _mm512_unpackhi_pd(c, d),
            _mm512_unpackhi_pd(e, f),
            _mm512_unpackhi_pd(g, h),
        ]);
        [
            FusedEight(even[0]),
            FusedEight(odd[0]),
            FusedEight(even[1]),
            FusedEight(odd[1]),
            FusedEight(even[2]),
            FusedEight(odd[2]),
            FusedEight(even[3]),
            FusedEight(odd[3]),
        ]
    }
}

/// The six components of eight arrays of six numbers, one after the other.
#[inline(always)]
pub(super) fn join_six(from: [&[f64; 8]; 6]) -> [FusedEight; 6] {
    let [a, b, c, d, e, f] = from.map(|from| FusedEight::load(from).0);
    // SAFETY: as above.
    unsafe {
        // Pairs of components of lanes 0 … 3 and 4 … 7: the first and the second; the third and, of the next lane, the
        // first; the second and the third of that.
        let first = [
            _mm512_shuffle_f64x2::<0xe4>(a, b),
            _mm512_shuffle_f64x2::<0x4e>(a, c),
            _mm512_shuffle_f64x2::<0xe4>(b, c),
        ];
        let second = [
            _mm512_shuffle_f64x2::<0xe4>(d, e),
            _mm512_shuffle_f64x2::<0x4e>(d, f),
            _mm512_shuffle_f64x2::<0xe4>(e, f),
        ];
        let even = [
            _mm512_shuffle_f64x2::<0x88>(first[0], second[0]),
            _mm512_shuffle_f64x2::<0xdd>(first[0], second[0]),
            _mm512_shuffle_f64x2::<0x88>(first[1], second[1]),
        ];
        let odd = [
            _mm512_shuffle_f64x2::<0xdd>(first[1], second[1]),
            _mm512_shuffle_f64x2::<0x88>(first[2], second[2]),
            _mm512_shuffle_f64x2::<0xdd>(first[2], second[2]),
        ];
        [
            FusedEight(_mm512_unpacklo_pd(even[0], odd[0])),
            FusedEight(_mm512_unpackhi_pd(even[0], odd[0])),
            FusedEight(_mm512_unpacklo_pd(even[1], odd[1])),
            FusedEight(_mm512_unpackhi_pd(even[1], odd[1])),
            FusedEight(_mm512_unpacklo_pd(even[2], odd[2])),
            FusedEight(_mm512_unpackhi_pd(even[2], odd[2])),
        ]
    }
}

/// The reverse of [`join_six`].
#[inline(always)]
pub(super) fn split_six(from: &[FusedEight; 6]) -> [FusedEight; 6] {
    let [a, b, c, d, e, f] = from.map(|x| x.0);
    // SAFETY: as above.
    unsafe {
        let (lower, upper) = (
            _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11),
            _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15),
        );
        let even = [
            _mm512_unpacklo_pd(a, b),
            _mm512_unpacklo_pd(c, d),
            _mm512_unpacklo_pd(e, f),
        ];
        let odd = [
            _mm512_unpackhi_pd(a, b),
            _mm512_unpackhi_pd(c, d),
            _mm512_unpackhi_pd(e, f),
        ];
        let first = [
            _mm512_permutex2var_pd(even[0], lower, even[1]),
            _mm512_permutex2var_pd(even[2], lower, odd[0]),
            _mm512_permutex2var_pd(odd[1], lower, odd[2]),
        ];
        let second = [
            _mm512_permutex2var_pd(even[0], upper, even[1]),
            _mm512_permutex2var_pd(even[2], upper, odd[0]),
            _mm512_permutex2var_pd(odd[1], upper, odd[2]),
        ];
        [
            FusedEight(_mm512_shuffle_f64x2::<0x44>(first[0], first[1])),
            FusedEight(_mm512_shuffle_f64x2::<0xe4>(first[2], first[0])),
            FusedEight(_mm512_shuffle_f64x2::<0xee>(first[1], first[2])),
            FusedEight(_mm512_shuffle_f64x2::<0x44>(second[0], second[1])),
            FusedEight(_mm512_shuffle_f64x2::<0xe4>(second[2], second[0])),
            FusedEight(_mm512_shuffle_f64x2::<0xee>(second[1], second[2])),
        ]
    }
}

/// The transpose of four rows of four pairs.
#[inline(always)]
fn blocks([a, b, c, d]: [__m512d; 4]) -> [__m512d; 4] {
    // SAFETY: as above.
    unsafe {
        let (ab, ab_odd) = (
            _mm512_shuffle_f64x2::<0x88>(a, b),
            _mm512_shuffle_f64x2::<0xdd>(a, b),
        );
        let (cd, cd_odd) = (
            _mm512_shuffle_f64x2::<0x88>(c, d),
            _mm512_shuffle_f64x2::<0xdd>(c, d),
        );
        [
            _mm512_shuffle_f64x2::<0x88>(ab, cd),
            _mm512_shuffle_f64x2::<0x88>(ab_odd, cd_odd),
            _mm512_shuffle_f64x2::<0xdd>(ab, cd),
            _mm512_shuffle_f64x2::<0xdd>(ab_odd, cd_odd),
        ]
    }
}

/// The pairs of all lanes, for as many numbers as there are components; the last one twice where their number is odd.
#[inline(always)]
pub(super) fn split_all<V: Transpose<L>, const L: usize, const N: usize>(
    from: &[V; N],
) -> [[__m128d; L]; N] {
    let mut pairs = [V::split(from[0], from[0]); N];
    for c in (0..N).step_by(2) {
        pairs[c / 2] = V::split(from[c], from[(c + 1).min(N - 1)]);
    }
    pairs
}

/// One lane of [`split_all`] into memory.
#[inline(always)]
pub(super) fn put<const L: usize, const N: usize>(
    pairs: &[[__m128d; L]; N],
    lane: usize,
    to: &mut [f64],
) {
    let (even, odd) = to[..N].as_chunks_mut::<2>();
    for (to, pairs) in even.iter_mut().zip(pairs) {
        // SAFETY: every x86-64 has the instruction; there is room for the two doubles, and no alignment is needed.
        unsafe { _mm_storeu_pd(to.as_mut_ptr(), pairs[lane]) };
    }
    if let Some(to) = odd.first_mut() {
        // SAFETY: as above.
        *to = unsafe { _mm_cvtsd_f64(pairs[N / 2][lane]) };
    }
}

/// A lane of four numbers into memory.
#[inline(always)]
pub(super) fn put_four(lane: __m256d, to: &mut [f64]) {
    let to = &mut to[..4];
    // SAFETY: that there are such lanes shows that there are their instructions; there is room for the four doubles, and no
    // alignment is needed.
    unsafe { _mm256_storeu_pd(to.as_mut_ptr(), lane) }
}
