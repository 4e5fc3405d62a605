//! Chains: block-tridiagonal symmetric matrices, eliminated from both ends at once.
//!
//! The rows of a cable's joints couple to their neighbours only. With diagonal blocks Aₖ and couplings Eₖ = Aₖ₊₁,ₖ the
//! block LDLᵀ from the first block on is, for k = 0, 1, …
//!
//! ```text
//! Sₖ = Lₖ Dₖ Lₖᵀ      Wₖ = Eₖ Lₖ⁻ᵀ Dₖ⁻¹      Sₖ₊₁ = Aₖ₊₁ − Wₖ Dₖ Wₖᵀ
//! ```
//!
//! and nothing but the order of the blocks says which end it starts from. The *twisted* factorisation starts from both:
//! one elimination runs up from the first block, another down from the last (its couplings are the Eₖᵀ), and they meet
//! in the middle block, which receives the Schur complements of both. It is the LDLᵀ of another order of the blocks,
//! without fill and of the same cost, and as stable; but the two eliminations are independent, so that they are the two
//! lanes of a vector and their chains of divisions run at the same time. A solve goes both ways too: forward from the
//! ends to the middle, backward from there.
//!
//! All blocks of a chain are worked on as B×B blocks, B ∈ {3, 5, 6}: smaller ones (the anchor, the load; 1, 2 and 4
//! rows) are padded with rows of the identity, missing couplings (several chains) with zeros, and where the number of
//! blocks is even the second elimination begins with a block of padding alone.
//!
//! Matrices that are not positive definite are refused, and so are those with a pivot that is weak beside its diagonal
//! entry, or below 1e-120: the backend has a general way.
//!
//! Left out, for they lost where they were measured (AVX2, blocks of 5 rows):
//!
//! - Two threads, an end each. One end alone takes 1.7 times what both take in the lanes of a vector, for it waits for its
//!   divisions, so that two threads could gain 15 %; to hand them their halves takes more than that, at 4000 blocks too.
//! - Pieces of one chain in the four lanes of a vector. All but the first fill towards the block before them, 2.4 times the
//!   arithmetic, while four lanes cost 0.6 to 0.7 of two ends in two lanes for each block.
//! - Chains of equal pattern side by side, one in each lane: 0.90 to 1.06 of the time one by one.
//! - A factor in single precision. Refined from the pieces that S is made of it gains three digits a sweep (hoist of 100
//!   segments, mass ratios 1, 10³, 10⁵: 4 or 5 sweeps to the accuracy that this factor has after one), and a sweep costs
//!   two thirds of the whole factorisation in doubles.
//!
//! Files: `block` one step of the elimination for any vector, `substitution` the same of a solve, `layout` what is stored
//! of a step; `twisted` the two eliminations, `schedule` where their blocks lie; `bordered` chains with a few rows besides;
//! `leaves` blocks that go first, so that the others are one of these; `overlay` the matrix that these leave.

mod block;
#[allow(dead_code)] // where the backend is not compiled in
pub(crate) mod bordered;
mod layout;
#[allow(dead_code)] // where the backend is not compiled in
pub(crate) mod leaves;
pub(crate) mod overlay;
mod schedule;
mod substitution;
mod twisted;

use crate::BlockPattern;
use crate::kernels::Scalar;
use crate::singularity::WEAK;
use block::ScratchOfTwo;
use overlay::{Offsets, Overlay};
use schedule::Schedule;
use taut_lanes::Aligned;
use taut_lanes::{Level, dispatch};
use twisted::{Backward, Factorize, Forward, SolveTwo};

/// Runs a kernel of the constant block size, with a further parameter where one is written.
macro_rules! with_size {
    ($size:expr, $level:expr, $kernel:ident $(<$rest:tt>)? { $($field:ident $(: $value:expr)?),* $(,)? }) => {
        match $size {
            3 => dispatch($level, $kernel::<3 $(, $rest)?> { $($field $(: $value)?),* }),
            5 => dispatch($level, $kernel::<5 $(, $rest)?> { $($field $(: $value)?),* }),
            _ => dispatch($level, $kernel::<6 $(, $rest)?> { $($field $(: $value)?),* }),
        }
    };
}
use with_size;

/// Twisted factor of a chain.
#[derive(Debug, Clone)]
pub(crate) struct Chain {
    schedule: Schedule,
    level: Level,
    /// Steps of both eliminations, then the middle block; see `block` for what a step stores.
    factor: Aligned,
    scratch: Box<ScratchOfTwo>,
    /// D⁻¹ L⁻¹ b between the forward and the backward pass.
    half: Vec<f64>,
    /// D⁻¹ L⁻¹ B of two right-hand sides.
    half_of_two: Vec<f64>,
}

impl Chain {
    /// Returns true if the block rows `blocks` (ascending) of matrices of `pattern` are a chain.
    #[allow(dead_code)] // where the backend is not compiled in
    pub(crate) fn is(blocks: &[usize], pattern: &BlockPattern) -> bool {
        schedule::size_of_chain(pattern, blocks).is_some()
    }

    /// Prepares for the block rows `blocks` (ascending) of matrices of a pattern, if these are a
    /// chain, or several, of blocks of at most six rows. Allocates all that is needed.
    pub(crate) fn of<'a>(
        blocks: &[usize],
        offsets: impl Into<Offsets<'a>>,
        level: Level,
    ) -> Option<Self> {
        let schedule = Schedule::new(offsets.into(), blocks)?;
        let (steps, size) = (schedule.steps(), schedule.size);
        Some(Self {
            factor: Aligned::new(2 * (steps + 1) * layout::per_step(size)),
            scratch: Box::new(ScratchOfTwo::new()),
            half: vec![0.0; 2 * (steps + 1) * size],
            half_of_two: vec![0.0; 4 * (steps + 1) * size],
            schedule,
            level,
        })
    }

    /// Factorises `a`, of the pattern of [`of`](Self::of), if that is positive definite: whether all pivots are
    /// positive and at least `least` units of roundoff of what they were made from. Allocates nothing.
    pub(crate) fn factorize<'a>(&mut self, a: impl Into<Overlay<'a>>, least: f64) -> bool {
        let a = a.into();
        match a.patches.is_empty() {
            true => self.eliminate::<false>(a, least),
            false => self.eliminate::<true>(a, least),
        }
    }

    fn eliminate<const PATCHED: bool>(&mut self, values: Overlay<'_>, least: f64) -> bool {
        with_size!(
            self.schedule.size,
            self.level,
            Factorize<PATCHED> {
                schedule: &self.schedule,
                values: values,
                factor: &mut *self.factor,
                scratch: &mut self.scratch,
                least: least,
            }
        )
    }

    /// Returns true if every pivot of a patched block exceeds WEAK u times the magnitude that its
    /// row was computed from. `magnitudes` has one number for each row of the matrix: the matrix
    /// itself no longer shows them.
    #[allow(dead_code)] // where no backend that uses it is compiled in
    pub(crate) fn is_sound(&self, magnitudes: &[f64]) -> bool {
        let size = self.schedule.size;
        let inverse = 2 * layout::inverse_at(size, 0)..2 * layout::inverse_at(size, size);
        let per_step = 2 * layout::per_step(size);
        self.schedule.patched.iter().all(|&t| {
            let (factor, step) = (&self.factor[per_step * t..], &self.schedule.steps[t]);
            step.ends.iter().enumerate().all(|(end, place)| {
                let inverse = factor[inverse.clone()].chunks_exact(2);
                let rows = &magnitudes[place.row..place.row + place.size];
                let mut pivots = inverse.zip(rows);
                pivots.all(|(d, from)| WEAK * f64::ROUNDOFF * from * d[end] < 1.0)
            })
        })
    }

    /// Solves A x = b, of which the rows of the chain are read and written. Allocates nothing.
    pub(crate) fn solve(&mut self, b: &[f64], x: &mut [f64]) {
        self.forward::<false>(b, &[], &mut []);
        self.backward::<false>(&[], &[], x);
    }

    /// Solves for two right-hand sides with 0.61 of the instructions of two solves (AVX2; 1.2 in
    /// plain doubles; chains of 1 … 101 blocks).
    #[allow(dead_code)] // where no backend that uses it is compiled in
    pub(crate) fn solve_two(&mut self, b: [&[f64]; 2], x: [&mut [f64]; 2]) {
        with_size!(
            self.schedule.size,
            self.level,
            SolveTwo {
                schedule: &self.schedule,
                factor: &*self.factor,
                b: b,
                z: &mut self.half_of_two,
                x: x,
            }
        );
    }

    /// The forward pass; where there is a border it adds Uᵀ y to `sums`.
    fn forward<const BORDER: bool>(&mut self, b: &[f64], u: &[f64], sums: &mut [f64]) {
        with_size!(
            self.schedule.size,
            self.level,
            Forward<BORDER> {
                schedule: &self.schedule,
                factor: &*self.factor,
                b: b,
                z: &mut self.half,
                u: u,
                sums: sums,
            }
        );
    }

    /// The backward pass, of what is left without U `s` where there is a border.
    fn backward<const BORDER: bool>(&self, u: &[f64], s: &[f64], x: &mut [f64]) {
        with_size!(
            self.schedule.size,
            self.level,
            Backward<BORDER> {
                schedule: &self.schedule,
                factor: &*self.factor,
                z: &*self.half,
                u: u,
                s: s,
                x: x,
            }
        );
    }
}

#[cfg(test)]
mod tests;
