//! Exact solves inside groups of blocks, the couplings between them left out: what the group preconditioner does for all
//! groups and block Gauss–Seidel for one after the other, [SL Algorithm 1].
//!
//! Groups of a cable's joints are chains, which are eliminated from both ends (`chain`); where one is none, or a pivot is
//! not positive there, all are eliminated in the order of the pattern (`block_ldlt`), which also says what is wrong.

use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::chain::Chain;
use crate::singularity::WEAK;
use crate::{BlockPattern, SolveError, SymBlockMatrix};
use taut_lanes::Level;

/// Factors of the groups' own parts of a matrix.
#[derive(Debug)]
pub(crate) struct Groups {
    /// Block rows of all groups, group after group, ascending inside each.
    members: Vec<usize>,
    /// First member of each group, and their number at the end.
    start: Vec<usize>,
    /// One for each group; none where one of them is no chain.
    chains: Option<Vec<Chain>>,
    in_order: BlockLdlt<f64>,
    /// True if the last factorisation is `in_order`.
    ordered: bool,
    /// First scalar row of each block row, and the dimension at the end.
    row: Vec<usize>,
}

impl Groups {
    /// For matrices of `pattern`, whose blocks are in the groups `of(block)`. Allocates all that is needed.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`] where the fill overflows.
    pub(crate) fn new(
        pattern: &BlockPattern,
        of: impl Fn(usize) -> usize,
    ) -> Result<Self, SolveError> {
        let blocks = pattern.blocks();
        let mut members: Vec<usize> = (0..blocks).collect();
        members.sort_by_key(|&i| (of(i), i));
        let mut start: Vec<usize> = (0..blocks)
            .filter(|&m| m == 0 || of(members[m]) != of(members[m - 1]))
            .collect();
        start.push(blocks);
        let inside = pattern.restricted(|i, j| of(i) == of(j))?;
        // A single block has nothing to gain from being a chain.
        let few = start.len() <= 1 + blocks / 2;
        let level = Level::best();
        let chains = start
            .windows(2)
            .map(|w| Chain::of(&members[w[0]..w[1]], pattern, level));
        Ok(Self {
            chains: if few { chains.collect() } else { None },
            in_order: BlockLdlt::new(pattern, &inside)?,
            ordered: false,
            row: (0..blocks)
                .map(|i| pattern.rows(i).start)
                .chain([pattern.dim()])
                .collect(),
            members,
            start,
        })
    }

    /// Number of groups.
    pub(crate) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// Block rows of group `g`, ascending.
    pub(crate) fn members(&self, g: usize) -> &[usize] {
        &self.members[self.start[g]..self.start[g + 1]]
    }

    /// Stored values of the factors in the order of the pattern.
    pub(crate) fn factor_values(&self) -> usize {
        self.in_order.factor_values()
    }

    /// Factorises the groups' parts of `a`. Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::Singular`] or [`SolveError::NotPositiveDefinite`] with the block.
    pub(crate) fn factorize(&mut self, a: &SymBlockMatrix) -> Result<(), SolveError> {
        let chains = self.chains.as_mut();
        self.ordered =
            !chains.is_some_and(|chains| chains.iter_mut().all(|c| c.factorize(a, WEAK)));
        if self.ordered {
            self.in_order.factorize(a, Pivots::Positive)?;
        }
        Ok(())
    }

    /// The rows of group `g` of x from those of b, A_gg x_g = b_g, both of length `dim`. Allocates nothing.
    pub(crate) fn solve_group(&mut self, g: usize, b: &[f64], x: &mut [f64]) {
        if let Some(chains) = &mut self.chains
            && !self.ordered
        {
            return chains[g].solve(b, x);
        }
        let members = &self.members[self.start[g]..self.start[g + 1]];
        for &i in members {
            let rows = self.row[i]..self.row[i + 1];
            x[rows.clone()].copy_from_slice(&b[rows]);
        }
        self.in_order.solve_blocks(members.iter().copied(), x);
    }

    /// Solves A x = b in all groups.
    pub(crate) fn solve(&mut self, b: &[f64], x: &mut [f64]) {
        if self.ordered {
            x.copy_from_slice(b);
            return self.in_order.solve(x);
        }
        for g in 0..self.len() {
            self.solve_group(g, b, x);
        }
    }
}
