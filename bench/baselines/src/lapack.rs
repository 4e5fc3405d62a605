//! The system's LAPACK (BSD-3-Clause): Cholesky factorisation of a band, dpbtrf, and its solve, dpbtrs. A baseline to
//! compare with, no solver of anything else here.
//!
//! Whatever LAPACK relies on is checked or held here: a [`Band`] owns its array and knows its sizes, and lengths are
//! compared before a pointer is passed. Integers are LAPACK's default ones, 32 bits.
#![allow(unsafe_code)]

use std::ffi::c_char;
use std::sync::Arc;
use taut_measure::matrix::Triangle;
use taut_solver::{BlockPattern, SolveError, SymBlockMatrix};

#[link(name = "lapack")]
unsafe extern "C" {
    // The last argument is the length of `uplo`, which Fortran passes beside it.
    fn dpbtrf_(
        uplo: *const c_char,
        n: *const i32,
        kd: *const i32,
        ab: *mut f64,
        ldab: *const i32,
        info: *mut i32,
        uplo_len: usize,
    );
    fn dpbtrs_(
        uplo: *const c_char,
        n: *const i32,
        kd: *const i32,
        nrhs: *const i32,
        ab: *const f64,
        ldab: *const i32,
        b: *mut f64,
        ldb: *const i32,
        info: *mut i32,
        uplo_len: usize,
    );
}

/// A symmetric positive definite band matrix and its factor. Column j of the array, `below + 1` long, holds column j of
/// the lower triangle from its diagonal entry on, or that of the upper one down to it.
pub struct Band {
    pattern: Arc<BlockPattern>,
    uplo: c_char,
    n: i32,
    /// Diagonals below the main one.
    below: i32,
    /// The matrix.
    values: Vec<f64>,
    /// The matrix, then its factor.
    factor: Vec<f64>,
    factorized: bool,
}

impl Band {
    /// The matrix as a band. Allocates.
    pub fn new(a: &SymBlockMatrix, triangle: Triangle) -> Result<Self, SolveError> {
        let n = a.dim();
        let mut below = 0;
        a.for_each_lower(|r, c, _| below = below.max(r - c));
        let limit = i32::MAX as usize;
        let size = n.saturating_mul(below + 1);
        // LAPACK forms n + 1, and some libraries the number of entries.
        if size >= limit {
            return Err(SolveError::TooLarge {
                size,
                limit,
                what: "entries",
            });
        }
        let mut values = vec![0.0; size];
        a.for_each_lower(|r, c, value| {
            let place = match triangle {
                Triangle::Lower => c * (below + 1) + (r - c),
                Triangle::Upper => r * (below + 1) + below - (r - c),
            };
            values[place] = value;
        });
        let uplo = match triangle {
            Triangle::Lower => b'L',
            Triangle::Upper => b'U',
        };
        Ok(Self {
            pattern: a.pattern().clone(),
            uplo: uplo as c_char,
            n: n as i32,
            below: below as i32,
            factor: values.clone(),
            values,
            factorized: false,
        })
    }

    /// Puts the matrix back to where its factor was. Allocates nothing.
    pub fn refill(&mut self) {
        self.factor.copy_from_slice(&self.values);
        self.factorized = false;
    }

    /// Factorises the matrix in its place.
    pub fn factorize(&mut self) -> Result<(), SolveError> {
        if self.factorized {
            let (called, needs) = ("factorize", "refill");
            return Err(SolveError::OutOfOrder { called, needs });
        }
        let (leading, mut info) = (self.below + 1, 0);
        // SAFETY: `factor` holds n columns of `leading` = below + 1 numbers, as dpbtrf wants them, and nothing else
        // refers to it; `uplo` is one character, L or U; all pointers are valid during the call.
        unsafe {
            dpbtrf_(
                &self.uplo,
                &self.n,
                &self.below,
                self.factor.as_mut_ptr(),
                &leading,
                &mut info,
                1,
            );
        }
        self.factorized = info == 0;
        match usize::try_from(info) {
            Ok(0) => Ok(()),
            // The order of the first minor that is not positive.
            Ok(row) => Err(SolveError::NotPositiveDefinite {
                block: self.pattern.block_of_row(row - 1),
            }),
            Err(_) => Err(refused("dpbtrf", info)),
        }
    }

    /// Solves A x = b with the factor.
    pub fn solve(&mut self, b: &[f64], x: &mut [f64]) -> Result<(), SolveError> {
        if !self.factorized {
            let (called, needs) = ("solve", "factorize");
            return Err(SolveError::OutOfOrder { called, needs });
        }
        for (what, found) in [("right-hand side", b.len()), ("solution", x.len())] {
            let expected = self.pattern.dim();
            if found != expected {
                return Err(SolveError::Dimension {
                    what,
                    expected,
                    found,
                });
            }
        }
        x.copy_from_slice(b);
        let (leading, columns, mut info) = (self.below + 1, 1, 0);
        // The leading dimension of a system without rows is 1 too.
        let rows = self.n.max(1);
        // SAFETY: `factor` is what dpbtrf left for the same `uplo`, `n` and `below`; `x` holds one column of n numbers,
        // as compared above; all pointers are valid during the call.
        unsafe {
            dpbtrs_(
                &self.uplo,
                &self.n,
                &self.below,
                &columns,
                self.factor.as_ptr(),
                &leading,
                x.as_mut_ptr(),
                &rows,
                &mut info,
                1,
            );
        }
        if info != 0 {
            return Err(refused("dpbtrs", info));
        }
        match x.iter().position(|x| !x.is_finite()) {
            None => Ok(()),
            Some(row) => Err(SolveError::NonFinite {
                what: "solution",
                block: self.pattern.block_of_row(row),
            }),
        }
    }
}

/// LAPACK's word for a mistake of this module.
fn refused(routine: &str, info: i32) -> SolveError {
    SolveError::Library {
        library: "LAPACK",
        message: format!("{routine} returned {info}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_integrator::{StepOptions, Stepper};
    use taut_model::HoistParams;
    use taut_solver::{Backend, DenseOptions, backward_error};

    const BOTH: [Triangle; 2] = [Triangle::Lower, Triangle::Upper];

    #[test]
    fn both_triangles_solve() {
        let hoist = HoistParams {
            segments: 5,
            mass_ratio: 10.0,
            ..HoistParams::default()
        };
        let options = StepOptions {
            backend: Backend::Dense(DenseOptions::default()),
            ..StepOptions::default()
        };
        let mut stepper = Stepper::new(hoist.build().unwrap(), options).unwrap();
        stepper.solve().unwrap();
        let (a, b, _) = stepper.system();
        for triangle in BOTH {
            let mut band = Band::new(a, triangle).unwrap();
            let mut x = vec![0.0; b.len()];
            assert_eq!(band.below, 11);
            for _ in 0..2 {
                band.refill();
                band.factorize().unwrap();
                band.solve(b, &mut x).unwrap();
                let error = backward_error(a, b, &x).unwrap();
                assert!(error.componentwise < 1e-14, "{error:?}");
            }
        }
    }

    #[test]
    fn mistakes_are_errors() {
        let pattern = Arc::new(BlockPattern::new(&[1, 2], &[(1, 0)]).unwrap());
        let mut a = SymBlockMatrix::zeros(pattern);
        let values = [1.0, 0.5, 0.5, 2.0, 0.0, 0.0, -1.0];
        a.values_mut().copy_from_slice(&values);
        for triangle in BOTH {
            let mut band = Band::new(&a, triangle).unwrap();
            let mut x = [0.0; 3];
            let early = band.solve(&[0.0; 3], &mut x);
            assert!(matches!(early, Err(SolveError::OutOfOrder { .. })));
            let negative = Err(SolveError::NotPositiveDefinite { block: 1 });
            assert_eq!(band.factorize(), negative);
            *band.values.iter_mut().find(|v| **v == -1.0).unwrap() = 1.0;
            band.refill();
            assert_eq!(band.factorize(), Ok(()));
            let again = band.factorize();
            assert!(matches!(again, Err(SolveError::OutOfOrder { .. })));
            let short = band.solve(&[0.0; 2], &mut x);
            assert!(matches!(short, Err(SolveError::Dimension { .. })));
            let lost = band.solve(&[0.0, f64::NAN, 0.0], &mut x);
            assert!(matches!(lost, Err(SolveError::NonFinite { .. })));
        }
    }
}
