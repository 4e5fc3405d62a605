//! SuiteSparse UMFPACK: multifrontal LU with row exchanges, for any nonsingular matrix.
//!
//! **UMFPACK is GPL-2.0-or-later**: a binary with this backend is a combined work under the GPL.
//!
//! UMFPACK looks at values as well as at the pattern when it chooses how to order. Here it has a pattern of ones, so that
//! the order does not depend on which matrix comes first, and a run that is taken up again goes on with the same bits;
//! rows are exchanged anew for each matrix. `factorize` allocates: UMFPACK makes its factors anew every time. `solve`
//! allocates nothing, iterative refinement included.

use super::csc::{Csc, Triangle, diagnose};
use super::direct::{Common, Direct};
use crate::block_ldlt::Pivots;
use crate::condition::Scales;
use crate::{AnalyzeReport, BlockPattern, FactorReport, GeneralMatrix, SolveError};
use crate::{SymBlockMatrix, UmfpackOptions};
use std::sync::Arc;
use taut_umfpack::{Error, FactorInfo, Numeric, Options, Symbolic};

/// The `umfpack` backend.
#[derive(Debug, Default)]
pub(crate) struct Umfpack {
    options: UmfpackOptions,
    common: Common,
    /// `None` before `analyze`, and for a system without rows, which UMFPACK refuses.
    work: Option<Work>,
}

#[derive(Debug)]
struct Work {
    options: Options,
    /// The matrix, both triangles, as of the last factorisation: refinement takes its residuals from it.
    csc: Csc<i32>,
    /// Its rows and columns are scaled, before UMFPACK scales rows: sums of rows are those of their largest columns alone.
    scales: Scales,
    /// A right-hand side, scaled.
    scaled: Vec<f64>,
    symbolic: Symbolic,
    /// Replaced in place: it keeps the memory for solves.
    numeric: Option<Numeric>,
}

impl Umfpack {
    pub(crate) fn new(options: UmfpackOptions) -> Self {
        Self {
            options,
            ..Self::default()
        }
    }
}

impl Direct for Umfpack {
    const NAME: &'static str = "umfpack";

    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn prepare(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        self.work = match pattern.dim() {
            0 => None,
            _ => {
                let csc = Csc::new(pattern, Triangle::Full)?;
                Some(Work::new(self.options, csc).map_err(|e| of_pattern(&e))?)
            }
        };
        Ok(AnalyzeReport::default())
    }

    fn eliminate(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        a.check_finite()?;
        let mut report = FactorReport::default();
        if let Some(work) = &mut self.work {
            let info = work.factorize(a.values()).map_err(|e| named(&e, a))?;
            // UMFPACK refuses exact zeros only. Of a matrix that is singular to rounding its estimate is at roundoff, and
            // also where all that holds something is small: the rule tells which.
            if info.rcond < f64::EPSILON {
                // The pivot that vanishes without exchanges tells more than the largest part of a null vector.
                self.check_doubt(a, |e| singular(a).unwrap_or(e))?;
            }
            report.reciprocal_condition = Some(info.rcond);
        }
        Ok(report)
    }

    /// Entries may grow by 2ⁿ⁻¹.
    fn is_stable(&self) -> bool {
        false
    }

    fn pivot_ratio(&self) -> Option<f64> {
        let numeric = self.work.as_ref()?.numeric.as_ref()?;
        Some(numeric.info().rcond)
    }

    fn substitute(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError> {
        match &mut self.work {
            Some(work) => work.solve(b, x, false).map_err(|e| named(&e, a)),
            None => Ok(()),
        }
    }
}

impl Work {
    fn new(options: UmfpackOptions, csc: Csc<i32>) -> Result<Self, Error> {
        let options = Options {
            refinement_steps: options.refinement_steps,
            ..Options::default()
        };
        let n = csc.column_start.len() - 1;
        // It looks for zeros on the diagonal; without any values its order costs a fifth more.
        let ones = vec![1.0; csc.row.len()];
        Ok(Self {
            symbolic: Symbolic::new(n, &csc.column_start, &csc.row, Some(&ones), &options)?,
            options,
            csc,
            scales: Scales::new(n),
            scaled: vec![0.0; n],
            numeric: None,
        })
    }

    fn factorize(&mut self, values: &[f64]) -> Result<FactorInfo, Error> {
        self.csc.gather(values);
        self.scale();
        let Csc {
            column_start,
            row,
            values,
            ..
        } = &self.csc;
        match &mut self.numeric {
            Some(numeric) => numeric.refactor(&self.symbolic, column_start, row, values),
            None => {
                let symbolic = &self.symbolic;
                let numeric = Numeric::new(symbolic, column_start, row, values, &self.options)?;
                Ok(self.numeric.insert(numeric).info())
            }
        }
    }

    /// Scales rows and columns of the matrix where their sizes are far apart.
    fn scale(&mut self) {
        let Csc {
            column_start,
            row,
            values,
            ..
        } = &mut self.csc;
        let columns = column_start.windows(2).enumerate();
        let at = columns.flat_map(|(c, at)| (at[0] as usize..at[1] as usize).map(move |e| (e, c)));
        let entries = at.clone().map(|(e, c)| (row[e] as usize, c, values[e]));
        if self.scales.of_uneven(entries) {
            for (e, c) in at {
                values[e] = self.scales.at(row[e] as usize, c, values[e]);
            }
        }
    }

    fn solve(&mut self, b: &[f64], x: &mut [f64], transposed: bool) -> Result<(), Error> {
        let Csc {
            column_start,
            row,
            values,
            ..
        } = &self.csc;
        let numeric = self.numeric.as_mut().ok_or(Error::InvalidNumericObject)?;
        let Scales { rows, columns } = &self.scales;
        let [before, after] = if transposed {
            [columns, rows]
        } else {
            [rows, columns]
        };
        for ((scaled, b), s) in self.scaled.iter_mut().zip(b).zip(before) {
            *scaled = b * s;
        }
        let solved = if transposed {
            numeric.solve_transposed(column_start, row, values, &self.scaled, x)
        } else {
            numeric.solve(column_start, row, values, &self.scaled, x)
        };
        x.iter_mut().zip(after).for_each(|(x, s)| *x *= s);
        solved?;
        match x.iter().position(|x| !x.is_finite()) {
            Some(index) => Err(Error::NonFinite { what: "x", index }),
            None => Ok(()),
        }
    }
}

/// UMFPACK on a matrix that need not be symmetric. It refuses exact zeros only: whoever calls it looks at the condition.
#[derive(Debug)]
pub(crate) struct General(Work);

impl General {
    /// For a matrix with at least one row.
    pub(crate) fn new(options: UmfpackOptions, a: &GeneralMatrix) -> Result<Self, SolveError> {
        let work = Work::new(options, Csc::of_general(a)?).map_err(|e| of_pattern(&e))?;
        Ok(Self(work))
    }

    /// Which pivot is noise it does not tell.
    pub(crate) fn factorize(&mut self, values: &[f64]) -> Result<Option<usize>, SolveError> {
        let factorized = self.0.factorize(values);
        factorized.map(|_| None).map_err(|e| match e {
            // Which column it does not tell.
            Error::SingularMatrix { .. } => SolveError::Singular { block: 0 },
            e => library(&e),
        })
    }

    /// Largest pivot that elimination made of scaled rows.
    pub(crate) fn growth(&self) -> f64 {
        let numeric = self.0.numeric.as_ref();
        numeric.map_or(1.0, |numeric| numeric.info().largest_pivot)
    }

    pub(crate) fn solve(
        &mut self,
        b: &[f64],
        x: &mut [f64],
        transposed: bool,
    ) -> Result<(), SolveError> {
        self.0.solve(b, x, transposed).map_err(|e| match e {
            // A finite right-hand side that overflows where it is scaled.
            Error::NonFinite {
                what: "x" | "b",
                index,
            } => SolveError::NonFinite {
                what: "solution",
                block: index,
            },
            e => library(&e),
        })
    }
}

fn library(e: &Error) -> SolveError {
    SolveError::Library {
        library: "UMFPACK",
        message: e.to_string(),
    }
}

/// The block at which `a` is singular, if the project's own factorisation, which exchanges no rows, finds one.
fn singular(a: &SymBlockMatrix) -> Option<SolveError> {
    diagnose(a, Pivots::Nonzero).filter(|e| matches!(e, SolveError::Singular { .. }))
}

/// The error of a pattern's analysis.
fn of_pattern(e: &Error) -> SolveError {
    match *e {
        Error::IndexOverflow { what, value } => SolveError::TooLarge {
            size: value,
            limit: i32::MAX as usize,
            what: if what == "n" { "rows" } else { "entries" },
        },
        _ => library(e),
    }
}

/// The error in terms of blocks.
fn named(e: &Error, a: &SymBlockMatrix) -> SolveError {
    let found = match *e {
        // UMFPACK does not tell the row.
        Error::SingularMatrix { .. } => singular(a),
        Error::NonFinite {
            what: "x" | "b",
            index,
        } => Some(SolveError::NonFinite {
            what: "solution",
            block: a.pattern().block_of_row(index),
        }),
        _ => None,
    };
    found.unwrap_or_else(|| of_pattern(e))
}

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use crate::{BlockPattern, LinearSolver};

    #[test]
    fn condition_is_estimated_and_bad_scaling_is_not_singular() {
        let pattern = Arc::new(BlockPattern::new(&[1, 1], &[(0, 1)]).unwrap());
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        let mut solver = Umfpack::default();
        solver.analyze(&pattern).unwrap();
        for (values, estimate) in [
            ([4.0, 0.0, 1.0], 0.5..=1.0),
            // The estimate is that of the matrix with scaled rows and columns.
            ([1.0, 1e-20, 1e-38], 0.1..=1.0),
            ([1.0, 1.0, 1.0 + 1e-12], 0.0..=1e-11),
        ] {
            a.values_mut().copy_from_slice(&values);
            let found = solver.factorize(&a).unwrap().reciprocal_condition.unwrap();
            assert!(estimate.contains(&found), "{found}");
            testing::solves(&mut solver, &a);
        }
    }

    #[test]
    fn errors_are_in_terms_of_blocks() {
        let a = testing::positive_definite(&testing::patterns()[0], 1);
        let limit = i32::MAX as usize;
        let cases = [
            (
                Error::IndexOverflow {
                    what: "n",
                    value: 9,
                },
                SolveError::TooLarge {
                    size: 9,
                    limit,
                    what: "rows",
                },
            ),
            (
                Error::IndexOverflow {
                    what: "row_idx",
                    value: 9,
                },
                SolveError::TooLarge {
                    size: 9,
                    limit,
                    what: "entries",
                },
            ),
            (
                Error::NonFinite {
                    what: "x",
                    index: 13,
                },
                SolveError::NonFinite {
                    what: "solution",
                    block: 2,
                },
            ),
        ];
        for (from, to) in cases {
            assert_eq!(named(&from, &a), to);
        }
        for e in [Error::OutOfMemory, Error::SingularMatrix { rcond: 0.0 }] {
            let message = e.to_string();
            let expected = SolveError::Library {
                library: "UMFPACK",
                message,
            };
            assert_eq!(named(&e, &a), expected);
        }
    }
}
