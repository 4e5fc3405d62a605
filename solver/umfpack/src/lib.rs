//! Sparse LU by the real SuiteSparse UMFPACK, as the yardstick for the solvers of this project.
//!
//! The wrapper covers square systems of `f64` with `i32` indices in compressed columns: analyse the
//! pattern once ([`Symbolic`]), factorise as often as the values change ([`Numeric`]), solve. All
//! input is checked before it reaches C, and nothing panics.
//!
//! ```
//! use taut_umfpack::{Numeric, Options, Symbolic};
//!
//! // | 4 1 |
//! // | 1 3 |
//! let (col_ptr, row_idx, values) = ([0, 2, 4], [0, 1, 0, 1], [4.0, 1.0, 1.0, 3.0]);
//! let options = Options::default();
//! let symbolic = Symbolic::new(2, &col_ptr, &row_idx, Some(&values), &options)?;
//! let mut numeric = Numeric::new(&symbolic, &col_ptr, &row_idx, &values, &options)?;
//! let mut x = [0.0; 2];
//! numeric.solve(&col_ptr, &row_idx, &values, &[6.0, 7.0], &mut x)?;
//! assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
//! # Ok::<(), taut_umfpack::Error>(())
//! ```
//!
//! # Mathematics
//!
//! A square A of n rows, scaled by rows with R, is factorised as P R A Q = L U. The analysis
//! chooses Q to keep fill small, the factorisation chooses P for stability. Then x = Q U⁻¹ L⁻¹ P R
//! b, refined by x ← x + A⁻¹(b − A x). Numbers have no unit.
//!
//! # Map
//!
//! | module | holds |
//! |---|---|
//! | the root | [`Symbolic`], [`Numeric`], [`Options`], [`Error`]: checked input, owned handles |
//! | `ffi` | the C interface; the only unsafe code |
//! | `build.rs` | finds the library or compiles it; leaves its constants to `ffi` |
//!
//! # Arrays
//!
//! A matrix of dimension `n` is three arrays: `col_ptr` of length `n + 1` starts at 0, does not
//! decrease and ends at the number of entries; `row_idx` and `values` hold the entries of column
//! `j` at `col_ptr[j]..col_ptr[j + 1]`, with the rows strictly increasing.
//!
//! # How the library is found
//!
//! 1. The installed library: through pkg-config (`UMFPACK` or `umfpack`, 5.7 or newer), or else in
//!    the default folders of the C compiler.
//! 2. Otherwise UMFPACK and AMD are compiled by the C compiler, without BLAS, from the sources in
//!    the registry package `suitesparse_sys`. Cargo pins and downloads that package, but its own
//!    code is never compiled. `SUITESPARSE_SRC` names (absolutely) another folder with the sources
//!    of SuiteSparse 7.
//!
//! `TAUT_UMFPACK=system` or `TAUT_UMFPACK=source` in the environment of the build allows only the
//! one way. [`build_info`] tells what was taken. The choice stands until `cargo clean`, or until
//! one of these variables changes.
//!
//! # Licence
//!
//! UMFPACK is under the GPL, version 2 or later, and so is this package. A binary that links it,
//! statically or not, is a combined work: whoever distributes it has to do so under the GPL, with
//! the sources (under its version 3 where code under Apache-2.0 is in it). That is why nothing else
//! in the project depends on this package by default.

mod ffi;

use std::fmt;

/// Where the linked library comes from.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildInfo {
    /// The version of UMFPACK, such as `6.3.3`, as its header gave it to the build.
    pub version: &'static str,
    /// `system` or `source`.
    pub origin: &'static str,
}

/// Which UMFPACK the build found.
#[must_use]
pub fn build_info() -> BuildInfo {
    BuildInfo {
        version: env!("TAUT_UMFPACK_VERSION"),
        origin: env!("TAUT_UMFPACK_ORIGIN"),
    }
}

/// How UMFPACK orders and pivots.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// UMFPACK decides by the pattern and the diagonal.
    #[default]
    Auto,
    /// COLAMD of the columns, pivots by size.
    Unsymmetric,
    /// AMD of the pattern of `A + Aᵀ`, pivots on the diagonal where they are large enough.
    Symmetric,
}

/// Divisor of each row before the factorisation.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scaling {
    /// Nothing.
    None,
    /// The sum of its absolute values.
    #[default]
    Sum,
    /// Its largest absolute value.
    Max,
}

/// Settings; the default ones are UMFPACK's own.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The most steps of iterative refinement in a solve; it ends earlier where nothing improves.
    pub refinement_steps: u32,
    /// Ordering and pivoting.
    pub strategy: Strategy,
    /// Row scaling.
    pub scaling: Scaling,
    /// The least size of a pivot relative to the largest entry of its column, from 0 to 1; UMFPACK
    /// takes 0.1. The diagonal pivots of [`Strategy::Symmetric`] keep their own, lower threshold.
    pub pivot_tolerance: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            refinement_steps: 2,
            strategy: Strategy::Auto,
            scaling: Scaling::Sum,
            pivot_tolerance: None,
        }
    }
}

/// The fill-reducing order and symbolic factorisation of a pattern.
pub struct Symbolic(ffi::Analysis);

impl Symbolic {
    /// Analyses the pattern of an `n` by `n` matrix; see the [crate] for the shapes. The values, as
    /// many as `row_idx` has rows, only help to choose the strategy.
    ///
    /// # Errors
    ///
    /// [`Error::IndexOverflow`], [`Error::NonPositiveDimension`], [`Error::InvalidMatrix`],
    /// [`Error::DimensionMismatch`], [`Error::NonFinite`] and [`Error::InvalidOption`] name what is
    /// wrong with the arguments; [`Error::OutOfMemory`] and UMFPACK's other statuses may follow.
    pub fn new(
        n: usize,
        col_ptr: &[i32],
        row_idx: &[i32],
        values: Option<&[f64]>,
        options: &Options,
    ) -> Result<Self, Error> {
        let control = ffi::Control::new(options)?;
        let pattern = ffi::Pattern::new(n, col_ptr, row_idx)?;
        ffi::Analysis::new(pattern, values, &control).map(Self)
    }

    /// The dimension of the matrix.
    #[must_use]
    pub fn n(&self) -> usize {
        self.0.pattern.n()
    }
}

impl fmt::Debug for Symbolic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Symbolic")
            .field("n", &self.n())
            .finish_non_exhaustive()
    }
}

/// Size, work and pivots of a factorisation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FactorInfo {
    /// The entries of L, with its diagonal.
    pub lnz: u64,
    /// The entries of U, with its diagonal.
    pub unz: u64,
    /// A rough estimate of the reciprocal condition: the smallest by the largest pivot.
    pub rcond: f64,
    /// The largest pivot of the matrix whose rows are scaled.
    pub largest_pivot: f64,
    /// Floating-point operations.
    pub flops: f64,
    /// The most memory in bytes that analysis and factorisation held at once.
    pub peak_memory: u64,
}

/// Work and backward errors of a solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveInfo {
    /// Steps of iterative refinement that were taken.
    pub refinement_steps_taken: u32,
    /// The componentwise backward error over the rows where it is well-defined, if refinement was
    /// allowed.
    pub omega1: Option<f64>,
    /// The backward error over the remaining rows, whose right side and residual are nearly zero,
    /// if refinement was allowed.
    pub omega2: Option<f64>,
    /// As in [`FactorInfo`].
    pub rcond: f64,
    /// Floating-point operations.
    pub flops: f64,
}

/// The LU factors of a matrix, with the memory that solves need.
pub struct Numeric {
    factors: ffi::Factors,
    control: ffi::Control,
    info: FactorInfo,
}

impl Numeric {
    /// Factorises a matrix of the analysed pattern; see the [crate] for the shapes.
    ///
    /// # Errors
    ///
    /// [`Error::SingularMatrix`], [`Error::OutOfMemory`]; [`Error::DifferentPattern`] where
    /// `col_ptr` or `row_idx` are not those of `symbolic`; [`Error::DimensionMismatch`],
    /// [`Error::NonFinite`] for `values`, [`Error::InvalidOption`], and UMFPACK's other statuses.
    pub fn new(
        symbolic: &Symbolic,
        col_ptr: &[i32],
        row_idx: &[i32],
        values: &[f64],
        options: &Options,
    ) -> Result<Self, Error> {
        let mut numeric = Self {
            factors: ffi::Factors::new(&symbolic.0.pattern)?,
            control: ffi::Control::new(options)?,
            info: FactorInfo::default(),
        };
        numeric.refactor(symbolic, col_ptr, row_idx, values)?;
        Ok(numeric)
    }

    /// Replaces the factors by those of another matrix, with the options that they had. The memory
    /// for solves is kept where the dimension is the same.
    ///
    /// # Errors
    ///
    /// As [`Numeric::new`]. Arguments that do not fit leave the old factors in place; where UMFPACK
    /// fails, as with a singular matrix, none are left.
    pub fn refactor(
        &mut self,
        symbolic: &Symbolic,
        col_ptr: &[i32],
        row_idx: &[i32],
        values: &[f64],
    ) -> Result<FactorInfo, Error> {
        let matrix = (col_ptr, row_idx, values);
        let info = self.factors.factorise(&symbolic.0, matrix, &self.control)?;
        self.info = FactorInfo {
            lnz: count(info[ffi::LNZ]),
            unz: count(info[ffi::UNZ]),
            rcond: info[ffi::RCOND],
            largest_pivot: info[ffi::UMAX],
            flops: info[ffi::FLOPS],
            peak_memory: count(info[ffi::PEAK_MEMORY] * info[ffi::SIZE_OF_UNIT]),
        };
        Ok(self.info)
    }

    /// Solves `A x = b` for `b` and `x` of length `n`, without allocating. The matrix is the one that
    /// was factorised: the refinement takes its residuals from it.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidNumericObject`] where [`Numeric::refactor`] has left no factors;
    /// [`Error::DifferentPattern`], [`Error::DimensionMismatch`], [`Error::NonFinite`] for the
    /// arguments, the last one also for an `x` that overflows; UMFPACK's other statuses. `x` is
    /// unspecified after an error.
    pub fn solve(
        &mut self,
        col_ptr: &[i32],
        row_idx: &[i32],
        values: &[f64],
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveInfo, Error> {
        self.solve_system(ffi::A, (col_ptr, row_idx, values), b, x)
    }

    /// Solves `Aᵀ x = b`.
    ///
    /// # Errors
    ///
    /// As [`Numeric::solve`].
    pub fn solve_transposed(
        &mut self,
        col_ptr: &[i32],
        row_idx: &[i32],
        values: &[f64],
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveInfo, Error> {
        self.solve_system(ffi::AT, (col_ptr, row_idx, values), b, x)
    }

    fn solve_system(
        &mut self,
        system: i32,
        matrix: (&[i32], &[i32], &[f64]),
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveInfo, Error> {
        let info = self.factors.solve(system, matrix, b, x, &self.control)?;
        // UMFPACK writes -1 where it has computed nothing.
        let omega = |index: usize| Some(info[index]).filter(|omega| *omega >= 0.0);
        Ok(SolveInfo {
            refinement_steps_taken: u32::try_from(count(info[ffi::IR_TAKEN])).unwrap_or(u32::MAX),
            omega1: omega(ffi::OMEGA1),
            omega2: omega(ffi::OMEGA2),
            rcond: self.info.rcond,
            flops: info[ffi::SOLVE_FLOPS],
        })
    }

    /// Size, work and pivots of the last factorisation that succeeded.
    #[must_use]
    pub fn info(&self) -> FactorInfo {
        self.info
    }
}

impl fmt::Debug for Numeric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Numeric")
            .field("info", &self.info)
            .finish_non_exhaustive()
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "UMFPACK counts in whole doubles"
)]
fn count(info: f64) -> u64 {
    info as u64
}

/// Why a call failed: first the statuses of UMFPACK, then the findings of this wrapper.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// Memory ran out, or the problem is too large for 32-bit indices.
    OutOfMemory,
    /// A pivot is zero, or not a number after an overflow.
    SingularMatrix {
        /// UMFPACK's estimate of the reciprocal condition: zero or not a number.
        rcond: f64,
    },
    /// The determinant is too small for `f64`.
    DeterminantUnderflow,
    /// The determinant is too large for `f64`.
    DeterminantOverflow,
    /// There are no factors.
    InvalidNumericObject,
    /// There is no symbolic factorisation.
    InvalidSymbolicObject,
    /// UMFPACK misses an argument.
    ArgumentMissing,
    /// The dimension is not positive.
    NonPositiveDimension,
    /// The arrays are not a matrix in compressed columns.
    InvalidMatrix {
        /// The first column with a `col_ptr` that decreases or leads outside of `row_idx`, or with
        /// rows out of range or not strictly increasing, if known.
        column: Option<usize>,
    },
    /// The pattern is not the analysed one.
    DifferentPattern,
    /// The kind of system is unknown, or its matrix is not square.
    InvalidSystem,
    /// A permutation is invalid.
    InvalidPermutation,
    /// A file could not be read or written.
    FileIo,
    /// The ordering method failed.
    OrderingFailed,
    /// UMFPACK has found a fault of its own.
    InternalError,
    /// Serialised factors are invalid.
    InvalidBlob,
    /// A status that this wrapper does not know.
    Unknown {
        /// The status.
        status: i32,
    },
    /// A number does not fit 32-bit indices.
    IndexOverflow {
        /// `n`, or the array whose length it is.
        what: &'static str,
        /// The number.
        value: usize,
    },
    /// A slice has the wrong length.
    DimensionMismatch {
        /// The argument.
        what: &'static str,
        /// The length that fits.
        expected: usize,
        /// Its length.
        found: usize,
    },
    /// A number is infinite or not a number.
    NonFinite {
        /// The argument.
        what: &'static str,
        /// The first such position.
        index: usize,
    },
    /// A setting is out of its range.
    InvalidOption {
        /// The field of [`Options`].
        name: &'static str,
        /// Its value.
        value: f64,
    },
}

impl Error {
    fn check(status: i32, rcond: f64) -> Result<(), Self> {
        Err(match status {
            ffi::OK => return Ok(()),
            ffi::WARNING_SINGULAR_MATRIX => Self::SingularMatrix { rcond },
            ffi::WARNING_DETERMINANT_UNDERFLOW => Self::DeterminantUnderflow,
            ffi::WARNING_DETERMINANT_OVERFLOW => Self::DeterminantOverflow,
            ffi::ERROR_OUT_OF_MEMORY => Self::OutOfMemory,
            ffi::ERROR_INVALID_NUMERIC_OBJECT => Self::InvalidNumericObject,
            ffi::ERROR_INVALID_SYMBOLIC_OBJECT => Self::InvalidSymbolicObject,
            ffi::ERROR_ARGUMENT_MISSING => Self::ArgumentMissing,
            ffi::ERROR_N_NONPOSITIVE => Self::NonPositiveDimension,
            ffi::ERROR_INVALID_MATRIX => Self::InvalidMatrix { column: None },
            ffi::ERROR_DIFFERENT_PATTERN => Self::DifferentPattern,
            ffi::ERROR_INVALID_SYSTEM => Self::InvalidSystem,
            ffi::ERROR_INVALID_PERMUTATION => Self::InvalidPermutation,
            ffi::ERROR_FILE_IO => Self::FileIo,
            ffi::ERROR_ORDERING_FAILED => Self::OrderingFailed,
            ffi::ERROR_INTERNAL_ERROR => Self::InternalError,
            ffi::ERROR_INVALID_BLOB => Self::InvalidBlob,
            status => Self::Unknown { status },
        })
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OutOfMemory => "out of memory, or too large for 32-bit indices",
            Self::SingularMatrix { rcond } => {
                return write!(f, "the matrix is singular (reciprocal condition {rcond:e})");
            }
            Self::DeterminantUnderflow => "the determinant underflows",
            Self::DeterminantOverflow => "the determinant overflows",
            Self::InvalidNumericObject => "there are no numeric factors",
            Self::InvalidSymbolicObject => "there is no symbolic factorisation",
            Self::ArgumentMissing => "UMFPACK misses an argument",
            Self::NonPositiveDimension => "the dimension is not positive",
            Self::InvalidMatrix { column: None } => "the matrix is invalid",
            Self::InvalidMatrix { column: Some(j) } => {
                return write!(
                    f,
                    "column {j} of the matrix has an invalid range, or rows out of range or not \
                     strictly increasing"
                );
            }
            Self::DifferentPattern => "the pattern is not the analysed one",
            Self::InvalidSystem => "the system is unknown or not square",
            Self::InvalidPermutation => "a permutation is invalid",
            Self::FileIo => "a file could not be read or written",
            Self::OrderingFailed => "the ordering failed",
            Self::InternalError => "internal error of UMFPACK",
            Self::InvalidBlob => "the serialised factors are invalid",
            Self::Unknown { status } => return write!(f, "unknown status {status} of UMFPACK"),
            Self::IndexOverflow { what, value } => {
                return write!(f, "{what}: {value} does not fit 32-bit indices");
            }
            Self::DimensionMismatch {
                what,
                expected,
                found,
            } => return write!(f, "{what} has length {found} instead of {expected}"),
            Self::NonFinite { what, index } => return write!(f, "{what}[{index}] is not finite"),
            Self::InvalidOption { name, value } => {
                return write!(f, "option {name} is out of range: {value}");
            }
        })
    }
}

impl std::error::Error for Error {}

#[cfg(test)]
mod tests;
