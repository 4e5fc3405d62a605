//! The preconditioner of MINRES: of [M Jᵀ; J −Σ] the blocks of M and the diagonal blocks of Ŝ = J M⁻¹ Jᵀ + Σ.
//!
//! A diagonal block that is positive definite counts as one of M. Any other is replaced by its part of Ŝ, and where that
//! is not definite either, as in a matrix that is not quasi-definite, by a multiple of the identity. So every symmetric
//! matrix has a preconditioner; of a positive definite one it is that of `cg:jacobi`.

use crate::block_ldlt::{Pivots, factor_diagonal};
use crate::kernels::{
    OneByOne, by_size, by_sizes, panel_solve, unit_lower_solve, unit_upper_solve, update_diagonal,
};
use crate::{BlockPattern, SolveError, SymBlockMatrix, norm_inf};
use std::sync::Arc;

/// The diagonal blocks, factorised.
pub(super) struct DiagonalBlocks {
    /// One block a row and no others: L D Lᵀ of each.
    blocks: SymBlockMatrix,
    /// 1/D, length `dim`.
    inverse_pivots: Vec<f64>,
    /// Largest magnitude that each pivot was made from, length `dim`.
    scale: Vec<f64>,
    /// True for each diagonal block that is positive definite.
    definite: Vec<bool>,
    /// The other blocks of each block row and column: its index, and that of the stored block.
    neighbours: Vec<Vec<(usize, usize)>>,
    /// J and J L⁻ᵀ of one block of J.
    panels: [Vec<f64>; 2],
}

impl DiagonalBlocks {
    /// For matrices of `pattern`. Allocates all that is needed.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`].
    pub(super) fn new(pattern: &BlockPattern) -> Result<Self, SolveError> {
        let mut neighbours = vec![Vec::new(); pattern.blocks()];
        let mut largest = 0;
        for j in 0..pattern.blocks() {
            for k in pattern.column(j).skip(1) {
                neighbours[pattern.row(k)].push((j, k));
                neighbours[j].push((pattern.row(k), k));
                largest = largest.max(pattern.values(k).len());
            }
        }
        let diagonal = pattern.restricted(|i, j| i == j)?;
        Ok(Self {
            blocks: SymBlockMatrix::try_zeros(Arc::new(diagonal))?,
            inverse_pivots: vec![0.0; pattern.dim()],
            scale: vec![0.0; pattern.dim()],
            definite: vec![false; pattern.blocks()],
            neighbours,
            panels: [(); 2].map(|()| vec![0.0; largest]),
        })
    }

    /// Values of the factors.
    pub(super) fn factor_values(&self) -> usize {
        self.blocks.values().len()
    }

    /// Makes the preconditioner of `a`. Allocates nothing.
    pub(super) fn factorize(&mut self, a: &SymBlockMatrix) {
        for i in 0..self.definite.len() {
            self.take(i, a);
            self.definite[i] = self.factor(i);
        }
        for i in 0..self.definite.len() {
            if self.definite[i] {
                continue;
            }
            self.take(i, a);
            self.subtract_schur(i, a);
            self.blocks.block_mut(i).iter_mut().for_each(|v| *v = -*v);
            if !self.factor(i) {
                self.take_size(i, a);
            }
        }
    }

    /// Copies diagonal block `i` of `a`.
    fn take(&mut self, i: usize, a: &SymBlockMatrix) {
        let (p, rows) = (a.pattern(), a.pattern().rows(i));
        let block = self.blocks.block_mut(i);
        block.copy_from_slice(a.block(p.column(i).start));
        let pivots = block.iter().step_by(rows.len() + 1);
        let scale = self.scale[rows].iter_mut().zip(pivots);
        scale.for_each(|(scale, pivot)| *scale = pivot.abs());
    }

    /// Factorises block `i`; whether it is positive definite.
    fn factor(&mut self, i: usize) -> bool {
        let rows = self.blocks.pattern().rows(i);
        let (inverse, scale) = (
            &mut self.inverse_pivots[rows.clone()],
            &mut self.scale[rows.clone()],
        );
        let block = self.blocks.block_mut(i);
        let pivots = Pivots::Positive;
        by_size!(rows.len(), |n| factor_diagonal::<OneByOne, _, _>(
            n, block, inverse, scale, pivots
        ))
        .is_ok()
    }

    /// Block `i`, −Σ, less J M⁻¹ Jᵀ over the definite blocks that it is coupled to, which are factorised.
    fn subtract_schur(&mut self, i: usize, a: &SymBlockMatrix) {
        let m = a.pattern().size(i);
        let own = self.blocks.pattern().values(i);
        for &(j, k) in &self.neighbours[i] {
            if !self.definite[j] {
                continue;
            }
            let (n, block) = (a.pattern().size(j), a.block(k));
            let [l, x] = &mut self.panels;
            let (l, x) = (&mut l[..m * n], &mut x[..m * n]);
            for (at, l) in l.iter_mut().enumerate() {
                // Stored is what stands below the diagonal.
                *l = if i > j {
                    block[at]
                } else {
                    block[at / m + n * (at % m)]
                };
            }
            let of_j = self.blocks.pattern().values(j);
            let values = self.blocks.values_mut();
            let inverse = &self.inverse_pivots[a.pattern().rows(j)];
            by_sizes!(m, n, |m, n| panel_solve::<OneByOne, _, _, _>(
                m,
                n,
                &values[of_j],
                inverse,
                l,
                x
            ));
            let (target, scale) = (
                &mut values[own.clone()],
                &mut self.scale[a.pattern().rows(i)],
            );
            by_sizes!(m, n, |m, n| update_diagonal::<OneByOne, _, _, _>(
                m, n, target, x, l, scale
            ));
        }
    }

    /// Replaces block `i` by the largest entry of its block row, times the identity.
    fn take_size(&mut self, i: usize, a: &SymBlockMatrix) {
        let own = norm_inf(a.block(a.pattern().column(i).start));
        let others = self.neighbours[i]
            .iter()
            .map(|&(_, k)| norm_inf(a.block(k)));
        let inverse = 1.0 / others.fold(own, f64::max);
        let inverse = if inverse.is_finite() { inverse } else { 1.0 };
        self.inverse_pivots[a.pattern().rows(i)].fill(inverse);
        self.blocks.block_mut(i).fill(0.0);
    }

    /// z = P⁻¹ r. Allocates nothing.
    pub(super) fn solve(&self, r: &[f64], z: &mut [f64]) {
        z.copy_from_slice(r);
        for i in 0..self.definite.len() {
            let rows = self.blocks.pattern().rows(i);
            let (n, l) = (rows.len(), self.blocks.block(i));
            let z = &mut z[rows.clone()];
            by_size!(n, |n| unit_lower_solve(n, l, z));
            for (z, inverse) in z.iter_mut().zip(&self.inverse_pivots[rows]) {
                *z *= inverse;
            }
            by_size!(n, |n| unit_upper_solve(n, l, z));
        }
    }
}
