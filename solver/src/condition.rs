//! Scaling of rows and columns, the condition that is left, and the rule of every elimination without a guarantee: no
//! solution is claimed of a matrix of n rows whose condition, scaled, is beyond 1/(4 √n u), nor where the factors do not solve
//! for the vector that shows the condition, for one of all rows, and for some whose solutions are known. Elimination makes the
//! factors of A + E, about √n u away where rows are exchanged, further away where entries grow: y = (A + E)⁻¹ eⱼ of a singular A
//! with uᵀ A = 0 leaves eⱼ − A y = E y with uᵀ E y = uⱼ, of a ‖·‖₁ of about 1 for the j with the longest y, whatever E is; and
//! what is in s of the null vector is not in A s.
//!
//! R A C with powers of two, rows first, has a largest entry of 1 to 2 in each row and column (LAPACK's `xGEEQUB`): what is
//! left of the condition is no matter of units. Partial pivoting, which compares the numbers of a column, needs the scaled rows;
//! ‖(R A C)⁻¹‖₁ is estimated from below by the factors (Higham and Tisseur, *A Block Algorithm for Matrix 1-Norm Estimation*,
//! 2000): starts of random signs and sizes, since equal numbers may end in a tie at a vector of mostly zeros. LAPACK's
//! `xGESVX` and `UMFPACK`'s callers judge by the same number. Where that says singular the nearly best scaling has the last word:
//! what it finds regular is claimed with a bound of the error of each solution.

mod estimate;
mod probe;
mod residual;
mod scales;

pub use estimate::inverse_norm;
pub(crate) use probe::Probe;
use probe::noise;
pub(crate) use residual::LEAST;
pub(crate) use scales::Scales;

use crate::agreement::split_mix;
use crate::claim::Judge;
use crate::kernels::Scalar;
use crate::{SolveError, Status, norm_inf};
use estimate::{COLUMNS, Estimate, Longest, alternate, unit};
use residual::is_lost;
use scales::over;

/// ‖v − A y‖ over ‖v‖, sum and largest component, beyond which the factors do not solve for v.
const UNSOLVED: f64 = 0.05;

/// Solutions and corrections after which the factors are given up.
const CORRECTIONS: usize = 8;

/// Sweeps that scale rows and columns by the inverse.
const BALANCES: usize = 4;

/// Least part of the largest scale that a sweep gives a column.
const SPAN: f64 = 1e-250;

/// Bound of the relative error that is claimed where the bound is all that is known: estimates are seldom a third of it.
const BOUND: f64 = 0.1;

/// Largest part of |A| |x| that is left in a row of a solution whose norms tell nothing.
const COMPONENTWISE: f64 = 1e-12;

/// ‖(R A C)⁻¹‖ beyond which the rounding of a residual may be a digit of x.
const DOUBTFUL: f64 = 1e12;

/// Reciprocal condition below which factors that do not solve are those of a singular matrix.
const GROWTH: f64 = 1e-10;

/// How factors solve for what is hardest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) enum Factors {
    /// At once.
    #[default]
    Good,
    /// After corrections: entries grew in the elimination, and a residual that is small beside ‖A‖ ‖x‖ tells nothing of rows
    /// and columns that are small beside others.
    Poor,
    /// With rows and columns scaled by the inverse alone: each solution is judged by a bound of its error.
    Graded,
    /// Not at all: nothing is claimed.
    Useless,
}

/// Result of the rule for a matrix that is not singular.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Assessment {
    /// 1/(‖R A C‖₁ ‖(R A C)⁻¹‖₁).
    pub(crate) reciprocal: f64,
    /// Quality of its factors.
    pub(crate) factors: Factors,
}

impl Assessment {
    /// Where entries grew so much that nothing can be told.
    pub(crate) const UNKNOWN: Self = Self {
        reciprocal: 0.0,
        factors: Factors::Useless,
    };
}

/// The rule, for matrices of one dimension.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rule {
    scales: Scales,
    /// Column scales that equilibrate the largest entries, kept when `scales` are replaced by those
    /// from the inverse. Its row scales are not used.
    even: Scales,
    /// ‖(R A C)⁻¹‖ of the last check or probe, about.
    inverse: f64,
    sums: Vec<f64>,
    estimate: Estimate,
}

/// max |r|ᵢ / (|A| |x|)ᵢ, with room for |A| |x| in `rows`.
fn componentwise(
    entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
    rows: &mut [f64],
    r: &[f64],
    x: &[f64],
) -> f64 {
    rows.fill(0.0);
    entries.clone().for_each(|(r, c, a)| {
        rows[r] += (a * x[c]).abs();
    });
    let parts = r.iter().zip(rows).filter(|(r, _)| **r != 0.0);
    // A NaN, which no comparison admits, stays.
    parts
        .map(|(r, size)| r.abs() / *size)
        .fold(0.0, |most: f64, part| {
            if most.is_nan() || part <= most {
                most
            } else {
                part
            }
        })
}

impl Rule {
    /// Room for matrices of a dimension. Allocates.
    pub(crate) fn new(dim: usize) -> Self {
        Self {
            scales: Scales::new(dim),
            even: Scales::new(dim),
            inverse: 1.0,
            sums: vec![0.0; dim],
            estimate: Estimate::new(dim),
        }
    }

    /// Tests A, given by its entries, for singularity, and the quality of its factors. `roundoff`
    /// is the unit roundoff of the arithmetic that made the factors; `solve` is that of
    /// [`inverse_norm`]. Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::Singular`] with a scalar row as its block, the one with the largest part in the null vector.
    pub(crate) fn check(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        roundoff: f64,
        mut solve: impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Assessment, SolveError> {
        if self.sums.is_empty() {
            return Ok(Assessment {
                reciprocal: 1.0,
                factors: Factors::Good,
            });
        }
        self.scales.of(entries.clone());
        let found = self.check_scaled(entries, roundoff, &mut solve);
        if !matches!(found, Err(SolveError::Singular { .. })) {
            return found;
        }
        self.even.columns.copy_from_slice(&self.scales.columns);
        self.scale_by_inverse(entries, &mut solve)?;
        // Whatever the digits of the factors, those of x have to do.
        match self.check_scaled(entries, f64::ROUNDOFF, &mut solve) {
            Ok(Assessment {
                factors: Factors::Useless,
                ..
            }) => found,
            Ok(verdict) => Ok(Assessment {
                factors: Factors::Graded,
                ..verdict
            }),
            Err(SolveError::Singular { .. }) => found,
            other => other,
        }
    }

    /// Tests A and its factors with the current scales of rows and columns.
    fn check_scaled(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        roundoff: f64,
        solve: &mut impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Assessment, SolveError> {
        self.sums.fill(0.0);
        entries.clone().for_each(|(r, c, a)| {
            self.sums[c] += self.scales.at(r, c, a).abs();
        });
        let scales = &self.scales;
        let longest = match self
            .estimate
            .run(|x, transposed| scales.solve(x, transposed, solve))
        {
            // Where numbers overflow there is no inverse to speak of.
            Err(SolveError::NonFinite { block, .. }) => Longest {
                norm: f64::INFINITY,
                row: block,
                ..Longest::default()
            },
            found => found?,
        };
        let reciprocal = 1.0 / (norm_inf(&self.sums) * longest.norm);
        self.inverse = longest.norm;
        let singular = SolveError::Singular { block: longest.row };
        let rows = self.sums.len() as f64;
        if reciprocal.is_nan() || reciprocal < 4.0 * rows.sqrt() * roundoff {
            return Err(singular);
        }
        // The rounding of x, in doubles, hides the error of factors with more digits.
        let factors = if roundoff < f64::ROUNDOFF {
            Factors::Good
        } else {
            let hardest = self.solves(entries, Some(longest.unit), solve)?;
            let mut all = hardest.max(self.solves(entries, None, solve)?);
            // Others than those which the estimate starts with.
            let mut bits = split_mix(!(self.sums.len() as u64));
            for _ in 0..COLUMNS {
                all = all.max(self.finds(entries, &mut bits, solve)?);
                // Corrections may hide what is singular from the vectors before, not from several.
                if all != Factors::Poor {
                    break;
                }
            }
            all
        };
        if factors == Factors::Useless && reciprocal < GROWTH {
            return Err(singular);
        }
        Ok(Assessment {
            reciprocal: reciprocal.min(1.0),
            factors,
        })
    }

    /// How many corrections bring v − R A C y down; v is a unit vector or one of all rows. Of a singular matrix no correction
    /// takes uᵀ v away.
    fn solves(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        of: Option<usize>,
        solve: &mut impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Factors, SolveError> {
        let (y, left) = (&mut self.estimate.largest, &mut self.sums);
        let correction = &mut self.estimate.columns[..y.len()];
        y.fill(0.0);
        for solution in 0..=CORRECTIONS {
            match of {
                Some(at) => unit(left, at),
                None => alternate(left),
            }
            let largest = norm_inf(left);
            entries.clone().for_each(|(r, c, a)| {
                left[r] -= self.scales.at(r, c, a) * y[c];
            });
            let sum: f64 = left.iter().map(|r| r.abs()).sum();
            if sum <= UNSOLVED && norm_inf(left) <= UNSOLVED * largest {
                return Ok(if solution > 1 {
                    Factors::Poor
                } else {
                    Factors::Good
                });
            }
            correction.copy_from_slice(left);
            match self.scales.solve(correction, false, solve) {
                Err(SolveError::NonFinite { .. }) => return Ok(Factors::Useless),
                solved => solved?,
            }
            y.iter_mut().zip(&*correction).for_each(|(y, d)| *y += d);
        }
        Ok(Factors::Useless)
    }

    /// How many corrections bring the solution of R A C y = R A C s near an s of noise: of a singular matrix none does, since
    /// what is in s of the null vector is not in the right-hand side; and s takes part in what is not hardest too.
    fn finds(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        bits: &mut impl FnMut() -> u64,
        solve: &mut impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Factors, SolveError> {
        // s − y.
        let (error, left) = (&mut self.estimate.largest, &mut self.sums);
        noise(error, bits);
        for solution in 0..=CORRECTIONS {
            left.fill(0.0);
            entries.clone().for_each(|(r, c, a)| {
                left[r] += self.scales.at(r, c, a) * error[c];
            });
            match self.scales.solve(left, false, solve) {
                Err(SolveError::NonFinite { .. }) => break,
                solved => solved?,
            }
            error.iter_mut().zip(&*left).for_each(|(e, y)| *e -= y);
            if error.iter().all(|e| e.abs() <= UNSOLVED) {
                return Ok(if solution > 0 {
                    Factors::Poor
                } else {
                    Factors::Good
                });
            }
        }
        Ok(Factors::Useless)
    }

    /// Scales rows and columns nearly as well as can be. The condition in the ∞-norm of R A C is at least the spectral radius
    /// of |A⁻¹| |A|, and is that where the diagonal of C is its eigenvector c, and that of R 1/(|A| c) (Bauer, *Optimally
    /// scaled matrices*, 1963). Equal largest entries are far from it where a small entry is all that holds something,
    /// such as a mass of 10⁻³⁰ beside joints of 1.
    fn scale_by_inverse(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        solve: &mut impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<(), SolveError> {
        let n = self.sums.len();
        let mut bits = split_mix(n as u64);
        for _ in 0..BALANCES {
            self.balance_rows(entries);
            // c ← |(R A C)⁻¹| 1, about, from products with noise: equal sizes may cancel.
            let sizes = &mut self.estimate.largest;
            sizes.fill(0.0);
            for _ in 0..COLUMNS {
                let x = &mut self.estimate.columns[..n];
                noise(x, &mut bits);
                match self.scales.solve(x, false, solve) {
                    Err(SolveError::NonFinite { .. }) => return Ok(()),
                    solved => solved?,
                }
                let rows = sizes.iter_mut().zip(&*x);
                rows.for_each(|(size, x)| *size = size.max(x.abs()));
            }
            let largest = norm_inf(sizes);
            for (column, size) in self.scales.columns.iter_mut().zip(&*sizes) {
                *column = (*column / over((size / largest).max(SPAN))).max(f64::MIN_POSITIVE);
            }
        }
        self.balance_rows(entries);
        Ok(())
    }

    /// R = 1/(|A| c), to a power of two.
    fn balance_rows(&mut self, entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone)) {
        let Scales { rows, columns } = &mut self.scales;
        rows.fill(0.0);
        entries.clone().for_each(|(r, c, a)| {
            rows[r] += a.abs() * columns[c];
        });
        rows.iter_mut().for_each(|r| *r = over(*r));
    }

    /// The judge of solutions by factors that are not good, of residuals and solutions with rows and columns scaled as in the
    /// last check.
    pub(crate) fn judge(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
    ) -> Judge {
        let (counts, sums) = (&mut self.estimate.largest, &mut self.sums);
        counts.fill(0.0);
        sums.fill(0.0);
        entries.clone().for_each(|(r, c, a)| {
            counts[r] += 1.0;
            sums[r] += self.scales.at(r, c, a).abs();
        });
        Judge::new(norm_inf(counts), norm_inf(sums))
    }

    /// Judges x, which factors of this worth made of b, and corrects it; `judge` is that of the matrix, or [`Rule::judge`]
    /// where they are not good; `residual` and `solve` are those of [`Judge::settle`] with transposes. An x without any residual
    /// needs no bound. Allocates nothing.
    ///
    /// # Errors
    /// The errors of `solve`.
    pub(crate) fn settle(
        &mut self,
        (judge, factors): (Judge, Factors),
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        x: &mut [f64],
        [r, d]: [&mut [f64]; 2],
        mut residual: impl FnMut(&[f64], &mut [f64]),
        solve: impl FnMut(&[f64], &mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Status, SolveError> {
        let by = (judge, factors);
        let buffers = [&mut *r, &mut *d];
        let status = self.settle_by_bounds(by, entries, x, buffers, &mut residual, solve)?;
        if status == Status::Direct && !self.is_told(entries, r, x) {
            return Ok(Status::Stalled);
        }
        let exact = status == Status::Stalled && self.solves_exactly(entries, x, [r, d], residual);
        let unique = factors != Factors::Useless || x.iter().all(|x| *x == 0.0);
        Ok(if exact && unique {
            Status::Direct
        } else {
            status
        })
    }

    /// [`settle`](Self::settle) by residuals and bounds of errors.
    fn settle_by_bounds(
        &mut self,
        (judge, factors): (Judge, Factors),
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        x: &mut [f64],
        [r, d]: [&mut [f64]; 2],
        mut residual: impl FnMut(&[f64], &mut [f64]),
        mut solve: impl FnMut(&[f64], &mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Status, SolveError> {
        let first = f64::INFINITY;
        let mut status = Status::Stalled;
        let by_norms = matches!(factors, Factors::Good | Factors::Useless);
        if by_norms {
            let correct = |r: &[f64], d: &mut [f64]| solve(r, d, false);
            status = judge.settle(x, [&mut *r, &mut *d], first, &mut residual, correct)?;
        }
        // A residual that is small beside the largest rows tells nothing of the others.
        if factors == Factors::Good && status == Status::Direct && !self.is_near(entries, r, x) {
            let rows = &mut self.sums;
            let sizes = |r: &[f64], x: &[f64]| [componentwise(entries, rows, r, x), 1.0];
            let correct = |r: &[f64], d: &mut [f64]| solve(r, d, false);
            let buffers = [&mut *r, &mut *d];
            let judge = Judge::at(COMPONENTWISE);
            status = judge.settle_by(sizes, x, buffers, first, &mut residual, correct)?;
        }
        if !by_norms {
            let scales = &self.scales;
            let sizes = |r: &[f64], x: &[f64]| [scales.by(r, true), scales.by(x, false)];
            let correct = |r: &[f64], d: &mut [f64]| solve(r, d, false);
            let buffers = [&mut *r, &mut *d];
            status = judge.settle_by(sizes, x, buffers, first, &mut residual, correct)?;
        }
        // What is small beside |A| |x| may be large beside what the condition leaves of x, and so may its rounding.
        let is_doubtful = self.inverse > DOUBTFUL || !self.is_close(r, x);
        let is_open = matches!(factors, Factors::Good | Factors::Poor);
        if is_open && status == Status::Direct && is_doubtful {
            self.even.columns.copy_from_slice(&self.scales.columns);
            let correct = |r: &[f64], d: &mut [f64]| solve(r, d, false);
            let off = self.corrections(entries, x, [&mut *r, &mut *d], &mut residual, correct)?;
            // A NaN is no bound.
            if off.is_nan() || off > BOUND {
                status = Status::Stalled;
            }
        }
        Ok(match factors {
            Factors::Useless => Status::Stalled,
            Factors::Graded if status == Status::Direct => {
                // Further corrections, where they take off more: the bound is reported for x.
                let rows = &mut self.sums;
                let sizes = |r: &[f64], x: &[f64]| [componentwise(entries, rows, r, x), 1.0];
                let correct = |r: &[f64], d: &mut [f64]| solve(r, d, false);
                let buffers = [&mut *r, &mut *d];
                let judge = judge.by_rows();
                judge.settle_by(sizes, x, buffers, first, &mut residual, correct)?;
                let by_factors = |x: &mut [f64], transposed: bool| {
                    d.copy_from_slice(x);
                    solve(d, x, transposed)
                };
                let bound = self.error(entries, x, r, by_factors)?;
                let correct = |r: &[f64], d: &mut [f64]| solve(r, d, false);
                // The bound is that of factors which may themselves be wrong.
                let is_right = bound <= BOUND
                    && self.corrections(entries, x, [r, d], residual, correct)? <= BOUND;
                if is_right { status } else { Status::Stalled }
            }
            _ => status,
        })
    }

    /// True if ‖(R A C)⁻¹‖ times the residual `r` is a small part of x, both scaled.
    fn is_close(&self, r: &[f64], x: &[f64]) -> bool {
        let scales = &self.scales;
        self.inverse * scales.by(r, true) <= BOUND * scales.by(x, false)
    }

    /// True if x is close; and, where norms and scaled norms differ by more digits than there are, if each row of its residual
    /// `r` is small.
    fn is_near(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        r: &[f64],
        x: &[f64],
    ) -> bool {
        let even = self.scales.spread() * f64::ROUNDOFF <= 1.0;
        let is_small = |rows: &mut [f64]| componentwise(entries, rows, r, x) <= COMPONENTWISE;
        self.is_close(r, x) && (even || is_small(&mut self.sums))
    }

    /// True if the residual `r` of x tells the error in spite of what products lose that are no normal numbers: each up to
    /// the least number of all.
    fn is_told(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        r: &[f64],
        x: &[f64],
    ) -> bool {
        let least = f64::from_bits(1);
        let is_lost = |&(_, c, a): &(usize, usize, f64)| is_lost(a, x[c], f64::MIN_POSITIVE);
        let mut lost = entries.clone().filter(is_lost);
        let Some((first, ..)) = lost.next() else {
            return true;
        };
        let rows = &mut self.sums;
        rows.iter_mut().zip(r).for_each(|(row, r)| *row = r.abs());
        rows[first] += least;
        lost.for_each(|(r, ..)| rows[r] += least);
        self.inverse * self.scales.by(rows, true) <= BOUND * self.scales.by(x, false)
    }

    /// A bound of the error of x, with residual r, over x, both over the scales of their columns: |A⁻¹| (|r| + 2 (k + 2) u |A|
    /// |x|) with k entries in the longest row (Higham, 7.27).
    ///
    /// # Errors
    /// The errors of `solve`.
    pub(crate) fn error(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        x: &[f64],
        r: &[f64],
        mut solve: impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<f64, SolveError> {
        let counts = &mut self.estimate.largest;
        let (rounded, columns) = (&mut self.sums, &self.even.columns);
        counts.fill(0.0);
        rounded.fill(0.0);
        entries.clone().for_each(|(r, c, a)| {
            counts[r] += 1.0;
            rounded[r] += (a * x[c]).abs();
        });
        let part = (norm_inf(counts) + 2.0) * f64::EPSILON;
        for (rounded, r) in rounded.iter_mut().zip(r) {
            *rounded = part * *rounded + r.abs();
        }
        // ‖C⁻¹ A⁻¹ G‖∞ is ‖G A⁻ᵀ C⁻¹‖₁.
        let longest = self.estimate.run(|x, transposed| {
            let times = |x: &mut [f64]| x.iter_mut().zip(&*rounded).for_each(|(x, g)| *x *= g);
            let over = |x: &mut [f64]| x.iter_mut().zip(columns).for_each(|(x, c)| *x /= c);
            if transposed {
                times(x);
                solve(x, false)?;
                over(x);
            } else {
                over(x);
                solve(x, true)?;
                times(x);
            }
            Ok(())
        });
        match longest {
            Err(SolveError::NonFinite { .. }) => Ok(f64::INFINITY),
            longest => Ok(longest?.norm / self.even.by(x, false)),
        }
    }
}
