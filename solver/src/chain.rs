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
//! Files: `block` one step of the elimination for any vector, `twisted` the two eliminations, `places` where their blocks
//! lie; `batch` chains side by side, of which each is eliminated from one end.

pub(crate) mod batch;
mod block;
mod places;
mod twisted;

use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::{BlockPattern, SolveError, SymBlockMatrix};
use places::Places;
use taut_lanes::{Level, dispatch};
use twisted::{Factorize, Solve};

/// Runs a kernel of the constant block size.
macro_rules! with_size {
    ($size:expr, $level:expr, $kernel:ident { $($field:ident: $value:expr),* $(,)? }) => {
        match $size {
            3 => dispatch($level, $kernel::<3> { $($field: $value),* }),
            5 => dispatch($level, $kernel::<5> { $($field: $value),* }),
            _ => dispatch($level, $kernel::<6> { $($field: $value),* }),
        }
    };
}
use with_size;

/// Twisted factor of a chain.
#[derive(Debug, Clone)]
pub(crate) struct Chain {
    places: Places,
    level: Level,
    /// Steps of both eliminations, then the middle block; see `block` for what a step stores.
    factor: Vec<f64>,
    /// D⁻¹ L⁻¹ b between the forward and the backward pass.
    half: Vec<f64>,
}

impl Chain {
    /// For matrices of `pattern`, if it is a chain in its order, or several, of blocks of at most six rows. Allocates
    /// all that is needed.
    pub(crate) fn new(pattern: &BlockPattern, level: Level) -> Option<Self> {
        let places = Places::new(pattern)?;
        let (steps, size) = (places.steps(), places.size);
        Some(Self {
            factor: vec![0.0; 2 * ((steps + 1) * block::triangle(size) + steps * size * size)],
            half: vec![0.0; 2 * steps * size],
            places,
            level,
        })
    }

    /// Factorises `a`, of the pattern of [`new`](Self::new). Pivots may be negative. Allocates nothing where it
    /// succeeds.
    ///
    /// # Errors
    /// [`SolveError::Singular`], [`SolveError::NonFinite`] with the block.
    pub(crate) fn factorize(&mut self, a: &SymBlockMatrix) -> Result<(), SolveError> {
        let accepted = with_size!(
            self.places.size,
            self.level,
            Factorize {
                places: &self.places,
                values: a.values(),
                factor: &mut self.factor,
            }
        );
        if accepted { Ok(()) } else { Err(self.blame(a)) }
    }

    /// Solves A x = b, both of length `dim`. Allocates nothing.
    pub(crate) fn solve(&mut self, b: &[f64], x: &mut [f64]) {
        with_size!(
            self.places.size,
            self.level,
            Solve {
                places: &self.places,
                factor: &self.factor,
                half: &mut self.half,
                b: b,
                x: x,
            }
        );
    }

    /// The block to blame for a pivot that was refused: the first in the order of the pattern whose rows depend on
    /// those before it, as an elimination in that order finds it; where that one gets through, the block of the
    /// pivot that lost most.
    fn blame(&self, a: &SymBlockMatrix) -> SolveError {
        let pattern = a.pattern();
        let in_order = BlockLdlt::<f64>::new(pattern, pattern)
            .and_then(|mut factor| factor.factorize(a, Pivots::Nonzero));
        in_order.err().unwrap_or_else(|| self.worst(a))
    }

    fn worst(&self, a: &SymBlockMatrix) -> SolveError {
        let (pattern, mut worst, mut block) = (a.pattern(), 0.0, 0);
        for j in 0..pattern.blocks() {
            let (n, diagonal) = (pattern.size(j), a.block(pattern.column(j).start));
            for c in 0..n {
                let inverse = self.places.inverse_pivot(&self.factor, j, c);
                let loss = (diagonal[c * (n + 1)] * inverse).abs();
                if !inverse.is_finite() || inverse == 0.0 {
                    let what = "factor";
                    return SolveError::NonFinite { what, block: j };
                }
                if loss > worst {
                    (worst, block) = (loss, j);
                }
            }
        }
        SolveError::Singular { block }
    }
}

#[cfg(test)]
mod tests;
