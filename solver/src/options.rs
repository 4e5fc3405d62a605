//! The options of the backends.

use crate::SolveError;

/// Parts of the matrix that block Gauss–Seidel solves exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Partition {
    /// Single blocks: the joints of a cable.
    #[default]
    Joints,
    /// The pattern's groups, [SL Algorithm 1].
    Groups,
}

/// Where an iteration starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Start {
    /// From the caller's guess.
    #[default]
    Guess,
    /// From the groups' own solutions, couplings between them left out, [SL Algorithm 1, line 7].
    Trial,
}

/// Options of block Gauss–Seidel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussSeidelOptions {
    /// Parts that are solved exactly.
    pub partition: Partition,
    /// Where it starts.
    pub start: Start,
    /// Most sweeps; from 1 to 10⁷.
    pub iterations: usize,
    /// It stops where ‖b − A x‖₂ is at most this part of ‖b‖₂, which it computes once the residuals met in a sweep are.
    pub tolerance: f64,
}

impl Default for GaussSeidelOptions {
    fn default() -> Self {
        Self {
            partition: Partition::default(),
            start: Start::default(),
            iterations: 100,
            tolerance: 1e-12,
        }
    }
}

/// Preconditioners of the conjugate gradient method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Preconditioner {
    /// The identity.
    None,
    /// The diagonal blocks.
    BlockJacobi,
    /// The diagonal blocks of the pattern's groups, factorised.
    #[default]
    Group,
}

/// Options of the conjugate gradient method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgOptions {
    /// The preconditioner.
    pub preconditioner: Preconditioner,
    /// Most iterations; from 1 to 10⁷.
    pub iterations: usize,
    /// It stops where ‖b − A x‖₂ ≤ tolerance · ‖b‖₂.
    pub tolerance: f64,
}

impl Default for CgOptions {
    fn default() -> Self {
        Self {
            preconditioner: Preconditioner::default(),
            iterations: 1000,
            tolerance: 1e-12,
        }
    }
}

/// Options of MINRES: for indefinite systems, or those that have no Schur form. On those that have, conjugate gradient takes
/// half as many iterations or fewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MinresOptions {
    /// Most iterations; from 1 to 10⁷.
    pub iterations: usize,
    /// It stops where ‖b − A x‖₂ ≤ tolerance · ‖b‖₂. On a KKT matrix ‖A‖ ‖x‖ may be 10⁵ ‖b‖, and rounding of x alone then
    /// leaves 10⁻¹¹ ‖b‖: below that it says that it stalls.
    pub tolerance: f64,
}

impl Default for MinresOptions {
    fn default() -> Self {
        Self {
            iterations: 1000,
            tolerance: 1e-10,
        }
    }
}

/// Options of UMFPACK.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UmfpackOptions {
    /// Most steps of UMFPACK's own iterative refinement (its default is 2).
    pub refinement_steps: u32,
}

impl Default for UmfpackOptions {
    fn default() -> Self {
        Self {
            refinement_steps: 2,
        }
    }
}

/// Factorisations of faer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum FaerFactorization {
    /// Cholesky, positive definite matrices only.
    Llt,
    /// LDLᵀ without pivoting: positive definite or quasi-definite matrices.
    #[default]
    Ldlt,
    /// L B Lᵀ with Bunch–Kaufman pivoting inside the panels of the factor: symmetric matrices of any signs.
    Lblt,
    /// LU with partial pivoting: any nonsingular matrix.
    Lu,
}

/// Options of faer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FaerOptions {
    /// Which factorisation.
    pub factorization: FaerFactorization,
}

/// Arithmetic of the dense solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Precision {
    /// Doubles.
    #[default]
    Double,
    /// Double-double, about 32 digits: the oracle.
    Extended,
}

/// Options of the dense solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DenseOptions {
    /// Its arithmetic.
    pub precision: Precision,
}

/// Most iterations that may be asked for: what does not converge ends in hours, not in ages.
#[allow(dead_code)] // where none is compiled in
pub(crate) const MOST_ITERATIONS: usize = 10_000_000;

/// Checks the options that the iterative backends share.
#[allow(dead_code)] // where none is compiled in
pub(crate) fn check_iteration(iterations: usize, tolerance: f64) -> Result<(), SolveError> {
    if !(1..=MOST_ITERATIONS).contains(&iterations) {
        return Err(SolveError::InvalidOption {
            option: "iterations",
            allowed: "from 1 to 10000000",
        });
    }
    if !(0.0..1.0).contains(&tolerance) {
        return Err(SolveError::InvalidOption {
            option: "tolerance",
            allowed: "from 0 to below 1",
        });
    }
    Ok(())
}
