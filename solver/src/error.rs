//! What can go wrong in a solve, as data: block and row numbers that the caller turns into names of its own.

use crate::Fault;
use std::fmt;

/// Why there is no solution to use. Running out of iterations is not among these: see [`crate::Status`].
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SolveError {
    /// The backend exists but was not compiled in.
    NotCompiled {
        /// Name of the backend.
        backend: &'static str,
        /// Cargo feature that brings it.
        feature: &'static str,
    },
    /// A phase was called before the one that it needs.
    OutOfOrder {
        /// The call that came too early.
        called: &'static str,
        /// The call that has to come first.
        needs: &'static str,
    },
    /// The matrix has another block pattern than the one analysed.
    PatternChanged,
    /// A slice has the wrong length.
    Dimension {
        /// Which argument.
        what: &'static str,
        /// Length needed.
        expected: usize,
        /// Length given.
        found: usize,
    },
    /// A NaN or an infinity.
    NonFinite {
        /// Where it stands: `"matrix"`, `"right-hand side"` (or its norm), `"guess"`, `"factor"` or `"solution"`.
        what: &'static str,
        /// Block row of the first one.
        block: usize,
    },
    /// A pivot of this block vanished to rounding, as it does where rows depend on others; or it is weak and the matrix,
    /// scaled by what its diagonal entries were made from, has an eigenvalue below about 10⁻¹⁵ (its condition is as large or
    /// larger).
    Singular {
        /// Block row.
        block: usize,
    },
    /// A pivot or a curvature was negative where the backend needs a positive definite matrix.
    NotPositiveDefinite {
        /// Block row.
        block: usize,
    },
    /// Numbers of this block, or of its Schur complement, are too small or too large: eliminations and inner products square
    /// them.
    OutOfRange {
        /// Block row.
        block: usize,
    },
    /// The matrix is not symmetric, and the backend is for symmetric matrices.
    NotSymmetric {
        /// Name of the backend.
        backend: &'static str,
    },
    /// The system is larger than the backend, or memory, can hold.
    TooLarge {
        /// Rows (or stored entries) of the system.
        size: usize,
        /// The backend's limit. Where `size` is within it there is no memory for them.
        limit: usize,
        /// The limited quantity: `"rows"`, `"entries"`, `"entries in its factor in this order"`, `"blocks in its factor"`, or operations.
        what: &'static str,
    },
    /// An option's value is out of its range.
    InvalidOption {
        /// Name of the option.
        option: &'static str,
        /// The limit.
        allowed: &'static str,
    },
    /// A solver of another crate did what none may do.
    Misbehaved {
        /// Its name.
        solver: &'static str,
        /// The breach.
        fault: Fault,
    },
    /// The solver was handed over as a value, and no other of its kind can be made.
    NotRegistered,
    /// A library reported a failure that none of the variants above describes.
    Library {
        /// Its name.
        library: &'static str,
        /// Its message.
        message: String,
    },
}

impl fmt::Display for SolveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotCompiled { backend, feature } => {
                write!(
                    f,
                    "backend `{backend}` is not compiled in: build with `--features {feature}`"
                )
            }
            Self::OutOfOrder { called, needs } => {
                write!(
                    f,
                    "`{called}` was called before `{needs}`: call `{needs}` first"
                )
            }
            Self::PatternChanged => {
                write!(
                    f,
                    "the matrix has another block pattern than the one analysed: call `analyze` again"
                )
            }
            Self::Dimension {
                what,
                expected,
                found,
            } => {
                write!(f, "{what} has length {found}, {expected} needed")
            }
            Self::NonFinite { what, block } if what.starts_with("norm") => {
                write!(f, "{what} overflows at block {block}: scale the system")
            }
            Self::NonFinite { what, block } => {
                write!(f, "{what} holds a NaN or an infinity in block {block}")
            }
            Self::Singular { block } => {
                write!(
                    f,
                    "the matrix is singular to rounding at block {block}, whose pivot lost all digits: where its rows depend \
                     on others remove them or add compliance; what exchanges no rows may end there in a regular matrix too, \
                     which umfpack, faer:lu and dense solve"
                )
            }
            Self::NotPositiveDefinite { block } => {
                write!(
                    f,
                    "the matrix is not positive definite at block {block}: choose a backend for indefinite systems \
                     (umfpack, faer:lu, minres, dense; banded and faer:ldlt where it is quasi-definite)"
                )
            }
            Self::OutOfRange { block } => {
                write!(
                    f,
                    "numbers of block {block} are too small or too large to be squared: scale the matrix or the \
                     right-hand side, or take a cable by itself with `banded`"
                )
            }
            Self::NotSymmetric { backend } => {
                write!(
                    f,
                    "backend `{backend}` is for symmetric matrices and this one is not: choose one of umfpack, faer:lu, dense"
                )
            }
            Self::TooLarge { size, limit, what } if size <= limit => {
                write!(f, "there is no memory for the {size} {what} of the system")
            }
            Self::TooLarge { size, limit, what } => {
                write!(
                    f,
                    "the system has {size} {what}, the backend holds {limit}: choose another backend"
                )
            }
            Self::InvalidOption { option, allowed } => {
                write!(f, "option `{option}` is out of range: {allowed}")
            }
            Self::Misbehaved { solver, fault } => write!(f, "solver `{solver}` {fault}"),
            Self::NotRegistered => f.write_str(
                "the solver was handed over as a value, and no other can be made: register it and choose it by its name",
            ),
            Self::Library { library, message } => write!(f, "{library}: {message}"),
        }
    }
}

impl std::error::Error for SolveError {}

/// Fails with [`SolveError::TooLarge`] where there is no memory for that many numbers: before an allocation that would
/// abort.
pub(crate) fn expect_room<T>(numbers: usize) -> Result<(), SolveError> {
    let room = Vec::<T>::new().try_reserve_exact(numbers);
    room.map_err(|_| SolveError::TooLarge {
        size: numbers,
        limit: usize::MAX,
        what: "entries",
    })
}

/// Fails with [`SolveError::Dimension`] unless `b` is one or more columns of `dim` numbers and `x` is as long.
pub(crate) fn expect_columns(dim: usize, b: &[f64], x: &[f64]) -> Result<(), SolveError> {
    let whole = b.len().div_ceil(dim.max(1)).max(1).saturating_mul(dim);
    expect_len("right-hand sides", whole, b.len())?;
    expect_len("solutions", b.len(), x.len())
}

/// The columns of `b` and `x`, of `dim` numbers each.
pub(crate) fn columns<'a>(
    dim: usize,
    b: &'a [f64],
    x: &'a mut [f64],
) -> impl Iterator<Item = (&'a [f64], &'a mut [f64])> {
    b.chunks(dim.max(1)).zip(x.chunks_mut(dim.max(1)))
}

/// Fails with [`SolveError::Dimension`] unless `found == expected`.
pub(crate) fn expect_len(
    what: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), SolveError> {
    if found == expected {
        Ok(())
    } else {
        Err(SolveError::Dimension {
            what,
            expected,
            found,
        })
    }
}
