//! Interchangeable solvers for symmetric block-sparse linear systems A x = b.
//!
//! A system is a [`BlockPattern`] (made once for a topology), a [`SymBlockMatrix`] (its values, new at every step) and
//! a right-hand side. A backend implements [`LinearSolver`]: `analyze` the pattern, `factorize` the values, `solve` for
//! a right-hand side. [`Backend`] names all of them, compiled in or not, and makes one:
//!
//! ```
//! use std::sync::Arc;
//! use taut_solver::{Backend, BlockPattern, SymBlockMatrix};
//!
//! let pattern = Arc::new(BlockPattern::new(&[1, 1], &[(1, 0)])?);
//! let mut a = SymBlockMatrix::zeros(pattern.clone());
//! a.values_mut().copy_from_slice(&[2.0, -1.0, 2.0]); // [2 −1; −1 2]
//!
//! let mut solver = Backend::preferred()?.create()?;
//! solver.analyze(&pattern)?;
//! solver.factorize(&a)?;
//! let mut x = [0.0, 0.0];
//! solver.solve(&a, &[1.0, 0.0], &mut x)?;
//! assert!((x[0] - 2.0 / 3.0).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Mathematics
//! A is n × n, symmetric, in blocks: of a cable, S = J M⁻¹ Jᵀ + Σ (positive definite) or the KKT matrix \[M Jᵀ; J −Σ]
//! (quasi-definite). The direct solvers eliminate, P A Pᵀ = L D Lᵀ in blocks, L Lᵀ or L U; the iterative ones sweep over
//! parts α of x, x_α ← x_α + A_αα⁻¹ (b − A x)_α, or minimise over Krylov spaces: ½ xᵀA x − bᵀx (conjugate gradient) or
//! the residual (MINRES).
//! [`refine`] repeats x ← x + A⁻¹ r(x). How wrong an x is: η = ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞) and ‖x − x*‖∞ / ‖x*‖∞
//! ([`backward_error`], [`forward_error`]). Nothing here has a unit: numbers are in whatever units the caller's are.
//!
//! # Add a backend
//! In a crate of yours it takes three steps; `tests/skyline` is such a crate, to copy:
//! 1. Implement [`LinearSolver`] (`analyze` a pattern, `factorize` values, `solve`), with [`Phases`] for the checks of its
//!    input, and give it to [`agreement::check`] with what it claims: random systems against 32 digits, analyses and
//!    factorisations used again, bad input refused, nothing wrong called a solution. This needs `taut-solver` alone.
//! 2. Say in a [`Foreign`] what it is called, what it can do, and how it is made from its options.
//! 3. Let `main` be `taut_bench::command_line(&[…])`: that is the program `taut`, with your solver in every table and under
//!    its name wherever solvers are named. Its rows say what it does wrong, and the run goes on ([`Checked`]).
//!    `Stepper::with_solver` steps with it in programs of yours.
//!
//! Into this crate it goes as follows:
//! 1. Write `src/backends/NAME.rs` and declare it in `src/backends.rs`; add the feature NAME, with its licence, to
//!    `Cargo.toml`, and pass it on in the manifests that the structure test names.
//! 2. Write its [`Entry`] (`src/entry.rs`): name, licence, the variants worth a row, colour. Add the variant to [`Backend`],
//!    where the compiler asks for the rest, and to `Backend::built_in`. Every table, default and page reads these; the tests
//!    of this crate hold it to [`agreement::check`].
//! 3. Add its measured errors to `tests/agrees/systems.rs`, its refusals to `tests/refuses/backends.rs`, a tracked case
//!    to `bench/src/track/cases.rs`, NAME to the feature combinations in `.ci/run`, and its row to the README.
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `pattern`, `matrix` | what a system is |
//! | `general`, `convert` | square matrices that are not symmetric, and who solves them; matrices of other libraries |
//! | `backend`, `options`, `backends/` | the choice of a backend; its options; one file for each |
//! | `entry`, `foreign`, `checked` | how a solver is listed; solvers of other crates; a guard around them |
//! | `phases`, `error` | the checks that all of them make of their input; what can go wrong |
//! | [`agreement`] | what every backend has to get right, for backends from elsewhere too |
//! | `chain` | chains of small blocks, eliminated from both ends in the lanes of vectors |
//! | `slices` | matrices and vectors four block rows abreast, for products |
//! | [`clock`] | times that are measured |
//! | `groups` | exact solves inside groups of blocks |
//! | `block_ldlt` | the block factorisation that the direct, the group and the reference solvers share |
//! | `singularity` | whether a factor with weak pivots is that of a singular matrix |
//! | `condition` | scaling of rows and columns; how ill-conditioned what was factorised is, and which condition is too large |
//! | `claim` | whether what a direct solver made is a solution |
//! | `refine`, `accuracy`, `reference` | iterative refinement; backward and forward errors; extended-precision solutions |
//! | `ordering` | what an elimination order costs, and the order of minimum degree |
//! | `kernels`, `double_double` | small dense blocks; extended-precision numbers |
//! | [`coulomb`] | contact problems with Coulomb's exact friction cone, on a dense operator |
//! | `serde_forms` (feature `serde`) | numbers that may be NaN, backends as text |
//!
//! # Left out
//! - feral 0.22 (MIT, multifrontal L B Lᵀ): it fails [`agreement::check`]. It factorises a matrix of zeros as a regular
//!   one, and a build with debug assertions panics inside it where numbers of a finite matrix overflow.
//! - QDLDL: there is no crate of it by itself; Clarabel holds one as a part of its conic solver.
//! - CHOLMOD: the bindings need a build of SuiteSparse, and its supernodal part is GPL.
//!
//! # Features
//! One for each backend, additive: `banded`, `gauss-seidel`, `cg` (default), `minres`, `faer`, `nalgebra-sparse`,
//! `umfpack`.
//! The dense solver is always there. **UMFPACK is GPL-2.0-or-later**: a binary built with that feature is a combined
//! work under the GPL; the source of this crate stays MIT OR Apache-2.0.
//!
//! Besides these `serde`, on reports and errors of solutions, and on [`Backend`] as its text.

mod accuracy;
pub mod agreement;
mod backend;
mod backends;
mod block_ldlt;
mod chain;
mod checked;
mod claim;
pub mod clock;
mod condition;
mod convert;
pub mod coulomb;
mod double_double;
mod entry;
mod error;
mod foreign;
mod general;
#[allow(dead_code)] // where no backend that uses it is compiled in
mod groups;
mod kernels;
mod matrix;
mod options;
mod ordering;
mod pattern;
mod phases;
mod reference;
mod refine;
#[cfg(feature = "serde")]
mod serde_forms;
#[allow(dead_code)] // where no backend that uses it is compiled in
mod singularity;
#[allow(dead_code)] // where no backend that uses it is compiled in
mod slices;

pub use accuracy::{
    BackwardError, backward_error, backward_error_general, forward_error, norm_inf, residual,
};
pub use backend::{Backend, ParseBackendError};
pub use checked::{Checked, Fault};
pub use condition::inverse_norm;
pub use convert::ConvertError;
pub use double_double::DoubleDouble;
pub use entry::Entry;
pub use error::SolveError;
pub use foreign::{Capabilities, Foreign, RegisterError, register};
pub use general::{GeneralMatrix, GeneralSolver, solve_general};
pub use matrix::SymBlockMatrix;
pub use options::{
    CgOptions, DenseOptions, FaerFactorization, FaerOptions, GaussSeidelOptions, MinresOptions,
    Partition, Precision, Preconditioner, Start, UmfpackOptions,
};
pub use ordering::{
    EliminationCost, elimination_cost, factor_pattern, minimum_degree, minimum_degree_within,
};
pub use pattern::BlockPattern;
pub use phases::Phases;
pub use reference::reference_solution;
pub use refine::{RefineScratch, refine};

use std::sync::Arc;

/// A solver of symmetric block-sparse systems, used in phases: analyse once for a pattern, factorise for each matrix,
/// solve for each right-hand side.
pub trait LinearSolver: Send {
    /// The backend's name, as on the command line.
    fn name(&self) -> &'static str;

    /// Returns true if [`solve`](Self::solve) starts from the guess in `x`. If false, callers need
    /// not gather a guess and may leave anything in `x`: direct backends overwrite it.
    fn takes_guess(&self) -> bool {
        true
    }

    /// Prepares for matrices of `pattern`: ordering, fill, index maps, buffers. May allocate.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`], [`SolveError::InvalidOption`] and what a library reports.
    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError>;

    /// Prepares for solves with the values of `a`. The project's own backends allocate nothing here.
    ///
    /// # Errors
    /// [`SolveError::Singular`], [`SolveError::NotPositiveDefinite`], [`SolveError::NonFinite`],
    /// [`SolveError::PatternChanged`], [`SolveError::OutOfOrder`] and what a library reports.
    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError>;

    /// Solves A x = b, with `a` as last factorised; `b` and `x` of length `a.dim()`. `x` holds the guess when called
    /// (direct backends ignore it) and the solution on return. A direct backend says [`Status::Direct`] only where the
    /// backward error of `x` is at roundoff: guaranteed by its elimination, or seen in a residual.
    ///
    /// # Errors
    /// As above, and [`SolveError::Dimension`]: there is then no solution in `x`. Running out of iterations is not an
    /// error but [`Status::IterationLimit`].
    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError>;

    /// Solves A x = b without a residual. Where the elimination guarantees nothing it reports
    /// [`Status::Unjudged`], which claims nothing of `x`. For callers that [`refine`] it: they
    /// compute residuals anyway and judge by them.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    fn solve_unjudged(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.solve(a, b, x)
    }

    /// Judges the factors of `a`, factorised last, for callers that [`refine`]: [`Status::Direct`] where a solution whose
    /// residual is at roundoff may be claimed, [`Status::Stalled`] where none may, as the matrix is singular to rounding,
    /// [`Status::Unjudged`] where [`solve`](Self::solve) alone can tell. `evidence`: the last correction was a small part
    /// of the solution. Solvers other than the project's own direct ones leave it at [`Status::Direct`].
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    fn claims(&mut self, a: &SymBlockMatrix, evidence: bool) -> Result<Status, SolveError> {
        let _ = (a, evidence);
        Ok(Status::Direct)
    }

    /// A bound of the relative error of the solution `x` of A x = b, whose residual is `r`, by the factors of `a` that
    /// [`claims`](Self::claims) left unjudged; 0 where a residual at roundoff is enough.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    fn error_bound(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &[f64],
        r: &[f64],
    ) -> Result<f64, SolveError> {
        let _ = (a, b, x, r);
        Ok(0.0)
    }

    /// Solves A X = B, with `a` as last factorised: `b` and `x` hold one or more columns of `a.dim()` numbers, one after
    /// the other. The report is that of [`solve`](Self::solve) for all columns: the first status that is no claim, if any,
    /// the most iterations and the largest residual.
    ///
    /// # Errors
    /// As [`solve`](Self::solve), at the first column without a solution, and [`SolveError::Dimension`] where `b` is not
    /// whole columns or `x` is not as long.
    fn solve_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        let dim = a.dim();
        error::expect_columns(dim, b, x)?;
        let mut report = self.solve(a, &b[..dim], &mut x[..dim])?;
        for (b, x) in error::columns(dim, b, x).skip(1) {
            report = report.and(self.solve(a, b, x)?);
        }
        Ok(report)
    }
}

/// Result of an analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AnalyzeReport {
    /// Scalar entries that the factor will hold, where the backend factorises and knows it beforehand.
    pub factor_entries: Option<usize>,
}

/// Result of a factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FactorReport {
    /// Estimate of the reciprocal condition number, 0 … 1 without unit, where the backend makes one.
    pub reciprocal_condition: Option<f64>,
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Status {
    /// A direct backend solved the system, to a backward error ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞) at roundoff.
    Direct,
    /// A direct backend made an x that nothing is known of yet ([`LinearSolver::solve_unjudged`]).
    Unjudged,
    /// The iteration met its tolerance, by its own test.
    Converged,
    /// The iteration ran out of iterations; `x` is its last iterate.
    IterationLimit,
    /// The iteration makes no more progress above its tolerance (roundoff), or corrections of a direct solution do not
    /// bring its backward error to roundoff; `x` is the last iterate.
    Stalled,
}

/// Result of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SolveReport {
    /// How it ended.
    pub status: Status,
    /// Iterations made; 0 for direct backends.
    pub iterations: usize,
    /// ‖b − A x‖₂ / ‖b‖₂, where the iteration stopped before its limit from the product A x; what Gauss–Seidel leaves at
    /// its limit has the norm of the residuals that the last sweep met. NaN for direct backends, which do not compute it.
    #[cfg_attr(feature = "serde", serde(with = "serde_forms::number_or_none"))]
    pub residual: f64,
}

impl SolveReport {
    /// Report of an iterative backend for A x = 0.
    #[allow(dead_code)] // where none is compiled in
    pub(crate) const ZERO: Self = Self {
        status: Status::Converged,
        iterations: 0,
        residual: 0.0,
    };

    /// Returns true if the report claims that x is a solution: direct, or converged.
    #[must_use]
    pub fn is_claim(&self) -> bool {
        matches!(self.status, Status::Direct | Status::Converged)
    }

    /// The report of two solves as one: the first status that is no claim, the larger numbers.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let status = if self.is_claim() {
            other.status
        } else {
            self.status
        };
        Self {
            status,
            iterations: self.iterations.max(other.iterations),
            residual: self.residual.max(other.residual),
        }
    }

    /// The report of a direct solve.
    pub const DIRECT: Self = Self {
        status: Status::Direct,
        iterations: 0,
        residual: f64::NAN,
    };
}
