//! The backends, one file each.

#[cfg(feature = "banded")]
pub(crate) mod banded;
#[cfg(feature = "cg")]
pub(crate) mod conjugate_gradient;
#[cfg(any(feature = "faer", feature = "nalgebra-sparse", feature = "umfpack"))]
mod csc;
pub(crate) mod dense;
mod direct;
#[cfg(feature = "faer")]
pub(crate) mod faer;
#[cfg(feature = "gauss-seidel")]
pub(crate) mod gauss_seidel;
#[cfg(test)]
mod ill;
#[cfg(any(feature = "cg", feature = "gauss-seidel", feature = "minres"))]
#[allow(dead_code)] // where not all of these are compiled in
mod iteration;
#[cfg(feature = "minres")]
pub(crate) mod minres;
#[cfg(feature = "nalgebra-sparse")]
pub(crate) mod nalgebra_sparse;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests_iterations;
#[cfg(feature = "umfpack")]
pub(crate) mod umfpack;

use crate::kernels::Scalar;
use crate::matrix::check_finite;
use crate::{DoubleDouble, GeneralMatrix, SolveError, SymBlockMatrix};
use dense::Dense;

/// A backend at work on a matrix that need not be symmetric.
pub(crate) enum General {
    Dense(Dense<f64>),
    Extended(Dense<DoubleDouble>),
    #[cfg(feature = "faer")]
    Faer(Box<faer::Lu>),
    #[cfg(feature = "umfpack")]
    Umfpack(Box<umfpack::General>),
}

impl General {
    /// The column of the first pivot that is noise, if any.
    pub(crate) fn factorize(&mut self, a: &GeneralMatrix) -> Result<Option<usize>, SolveError> {
        match self {
            Self::Dense(work) => work.factorize_general(a),
            Self::Extended(work) => work.factorize_general(a),
            #[cfg(feature = "faer")]
            Self::Faer(work) => work.factorize(a.values(), |column| column),
            #[cfg(feature = "umfpack")]
            Self::Umfpack(work) => work.factorize(a.values()),
        }
    }

    /// Unit roundoff of the factors.
    pub(crate) fn roundoff(&self) -> f64 {
        match self {
            Self::Extended(work) => work.roundoff_left(),
            _ => f64::ROUNDOFF,
        }
    }

    /// Largest number that elimination made over the largest that it began with; UMFPACK scales that to 1.
    pub(crate) fn growth(&self) -> f64 {
        match self {
            Self::Dense(work) => work.growth(),
            Self::Extended(work) => work.growth(),
            #[cfg(feature = "faer")]
            Self::Faer(work) => work.growth(),
            #[cfg(feature = "umfpack")]
            Self::Umfpack(work) => work.growth(),
        }
    }

    /// x = A⁻¹ b, or A⁻ᵀ b.
    pub(crate) fn solve(
        &mut self,
        b: &[f64],
        x: &mut [f64],
        transposed: bool,
    ) -> Result<(), SolveError> {
        match self {
            Self::Dense(work) => work.solve_rows(b, x, transposed),
            Self::Extended(work) => work.solve_rows(b, x, transposed),
            #[cfg(feature = "faer")]
            Self::Faer(work) => {
                x.copy_from_slice(b);
                work.solve(x, transposed);
            }
            #[cfg(feature = "umfpack")]
            Self::Umfpack(work) => work.solve(b, x, transposed)?,
        }
        Ok(())
    }
}

/// Fails where the solution is not finite: overflow in a nearly singular system.
pub(crate) fn check_solution(a: &SymBlockMatrix, x: &[f64]) -> Result<(), SolveError> {
    check_finite(a.pattern(), "solution", x)
}
