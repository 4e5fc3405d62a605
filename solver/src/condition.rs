//! Scaling of rows and columns, the condition that is left, and the rule of every elimination without a guarantee: no
//! solution is claimed of a matrix of n rows whose condition, scaled, is beyond 1/(4 √n u), nor where the factors do not solve
//! for the vector that shows the condition and for one of all rows. Elimination makes the factors of A + E, about √n u away where rows are exchanged,
//! further away where entries grow: y = (A + E)⁻¹ eⱼ of a singular A with uᵀ A = 0 leaves eⱼ − A y = E y with uᵀ E y = uⱼ, of
//! a ‖·‖₁ of about 1 for the j with the longest y, whatever E is.
//!
//! R A C with powers of two, rows first, has a largest entry of 1 to 2 in each row and column (LAPACK's `xGEEQUB`): what is
//! left of the condition is no matter of units. Partial pivoting, which compares the numbers of a column, needs the scaled rows;
//! ‖(R A C)⁻¹‖₁ is estimated from below by the factors (Higham and
//! Tisseur, *A Block Algorithm for Matrix 1-Norm Estimation*, 2000): starts of random signs, since a start of equal numbers
//! may end in a tie at a vector of mostly zeros. LAPACK's `xGESVX` and `UMFPACK`'s callers judge by the same number.

use crate::agreement::split_mix;
use crate::claim::Judge;
use crate::kernels::Scalar;
use crate::{SolveError, Status, norm_inf};

/// Columns of the estimate.
const COLUMNS: usize = 4;

/// Sweeps of the estimate at most: seldom more than two.
const SWEEPS: usize = 5;

/// Rows up to which ‖A⁻¹‖₁ is computed from all columns, which takes no longer.
const SMALL: usize = 16;

/// ‖v − A y‖ over ‖v‖, sum and largest component, beyond which the factors do not solve for v.
const UNSOLVED: f64 = 0.05;

/// Solutions and corrections after which the factors are given up.
const CORRECTIONS: usize = 8;

/// Sweeps that scale rows and columns by the inverse.
const BALANCES: usize = 4;

/// Bound of the relative error that is claimed where the bound is all that is known: estimates are seldom a third of it.
const BOUND: f64 = 0.1;

/// Reciprocal condition below which factors that do not solve are those of a singular matrix.
const GROWTH: f64 = 1e-10;

/// ‖A⁻¹‖₁ of a matrix of dimension `dim`, exactly for a few rows, else an estimate from below that is seldom off by more than
/// a factor of 3: `solve(x, false)` is x ← A⁻¹ x, `solve(x, true)` is x ← A⁻ᵀ x. Allocates.
///
/// # Errors
/// Those of `solve`.
pub fn inverse_norm(
    dim: usize,
    solve: impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
) -> Result<f64, SolveError> {
    Ok(Estimate::new(dim).run(solve)?.norm)
}

/// Higham's last vector: of signs that alternate, with ‖x‖₁ = 1.
fn alternate(x: &mut [f64]) {
    let n = x.len() as f64;
    for (i, x) in x.iter_mut().enumerate() {
        let weight = (1.0 + i as f64 / (n - 1.0).max(1.0)) / (1.5 * n);
        *x = if i % 2 == 0 { weight } else { -weight };
    }
}

/// What an estimate shows.
#[derive(Debug, Clone, Copy, Default)]
struct Longest {
    /// ‖y‖₁ of the longest product y.
    norm: f64,
    /// Row of its largest component.
    row: usize,
    /// The unit vector with the longest product.
    unit: usize,
    /// The length of that.
    of_unit: f64,
}

impl Longest {
    /// Takes a product, of a unit vector or another; NaN is longer than all.
    fn take(&mut self, y: &[f64], unit: Option<usize>) {
        let norm: f64 = y.iter().map(|y| y.abs()).sum();
        if let Some(unit) = unit.filter(|_| norm > self.of_unit) {
            (self.unit, self.of_unit) = (unit, norm);
        }
        if norm <= self.norm || self.norm.is_nan() {
            return;
        }
        let row = (0..y.len()).max_by(|&i, &j| y[i].abs().total_cmp(&y[j].abs()));
        (self.norm, self.row) = (norm, row.unwrap_or(0));
    }
}

/// Room of an estimate.
#[derive(Debug, Clone, Default)]
struct Estimate {
    dim: usize,
    /// Columns x or signs of the products, and the signs of the sweep before.
    columns: Vec<f64>,
    signs: Vec<f64>,
    /// Rows whose unit vectors were tried.
    tried: Vec<bool>,
    /// Largest component of each row of A⁻ᵀ S.
    largest: Vec<f64>,
    /// Row of each column that is a unit vector.
    units: [Option<usize>; COLUMNS],
}

impl Estimate {
    fn new(dim: usize) -> Self {
        Self {
            dim,
            columns: vec![0.0; COLUMNS * dim],
            signs: vec![0.0; COLUMNS * dim],
            tried: vec![false; dim],
            largest: vec![0.0; dim],
            units: [None; COLUMNS],
        }
    }

    /// Allocates nothing.
    fn run(
        &mut self,
        mut solve: impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Longest, SolveError> {
        let n = self.dim;
        let mut longest = Longest::default();
        if n <= SMALL {
            for at in 0..n {
                let x = &mut self.columns[..n];
                unit(x, at);
                solve(x, false)?;
                longest.take(x, Some(at));
            }
            return Ok(longest);
        }
        let mut bits = split_mix(n as u64);
        let mut random = || if bits() >> 63 == 0 { 1.0 } else { -1.0 };
        let part = 1.0 / n as f64;
        self.columns.iter_mut().for_each(|x| *x = part * random());
        self.tried.fill(false);
        self.signs.fill(0.0);
        self.units = [None; COLUMNS];
        for sweep in 0..SWEEPS {
            let before = longest.norm;
            for (x, unit) in self.columns.chunks_mut(n).zip(self.units) {
                solve(x, false)?;
                longest.take(x, unit);
            }
            if sweep > 0 && longest.norm <= before {
                break;
            }
            if !self.turn_to_signs(&mut random) {
                break;
            }
            self.largest.fill(0.0);
            for x in self.columns.chunks_mut(n) {
                solve(x, true)?;
                let rows = self.largest.iter_mut().zip(&*x);
                rows.for_each(|(largest, x)| *largest = largest.max(x.abs()));
            }
            if !self.next_units() {
                break;
            }
        }
        // For what the gradient does not see.
        let x = &mut self.columns[..n];
        alternate(x);
        solve(x, false)?;
        longest.take(x, None);
        Ok(longest)
    }

    /// The signs of the columns, none parallel to those of the sweep before or to another, in which case random ones take its
    /// place; `false` where all were there before.
    fn turn_to_signs(&mut self, random: &mut impl FnMut() -> f64) -> bool {
        let n = self.dim;
        let parallel = |a: &[f64], b: &[f64]| {
            let product: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            product.abs() >= n as f64
        };
        let mut new = false;
        for at in 0..COLUMNS {
            let (done, rest) = self.columns.split_at_mut(at * n);
            let x = &mut rest[..n];
            x.iter_mut().for_each(|x| *x = 1.0_f64.copysign(*x));
            let known = self.signs.chunks(n).any(|s| parallel(s, x));
            new |= !known;
            if known || done.chunks(n).any(|s| parallel(s, x)) {
                x.iter_mut().for_each(|x| *x = random());
            }
        }
        self.signs.copy_from_slice(&self.columns);
        new
    }

    /// Unit vectors of the rows with the largest products that were not tried; `false` where the largest was.
    fn next_units(&mut self) -> bool {
        let n = self.dim;
        for at in 0..COLUMNS {
            let rows = (0..n).filter(|&r| at == 0 || !self.tried[r]);
            let row = rows.max_by(|&i, &j| self.largest[i].total_cmp(&self.largest[j]));
            let Some(row) = row else { break };
            if self.tried[row] {
                return false;
            }
            self.tried[row] = true;
            self.units[at] = Some(row);
            unit(&mut self.columns[at * n..(at + 1) * n], row);
        }
        true
    }
}

fn unit(x: &mut [f64], at: usize) {
    x.fill(0.0);
    x[at] = 1.0;
}

/// R and C of R A C.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scales {
    /// Scale of each row, a power of two.
    pub(crate) rows: Vec<f64>,
    /// Scale of each column, a power of two.
    pub(crate) columns: Vec<f64>,
}

impl Scales {
    /// Room for matrices of a dimension. Allocates.
    pub(crate) fn new(dim: usize) -> Self {
        Self {
            rows: vec![1.0; dim],
            columns: vec![1.0; dim],
        }
    }

    /// Scales a matrix of these entries (row, column, value). Allocates nothing.
    pub(crate) fn of(&mut self, entries: impl Iterator<Item = (usize, usize, f64)> + Clone) {
        self.rows.fill(0.0);
        for (r, _, a) in entries.clone() {
            self.rows[r] = self.rows[r].max(a.abs());
        }
        self.rows.iter_mut().for_each(|r| *r = over(*r));
        self.columns.fill(0.0);
        for (r, c, a) in entries {
            self.columns[c] = self.columns[c].max(a.abs() * self.rows[r]);
        }
        self.columns.iter_mut().for_each(|c| *c = over(*c));
    }

    /// The same for a factorisation, which leaves rows and columns of sizes within a million of each other as they are:
    /// scaling would exchange other rows for nothing. Whether it scales.
    pub(crate) fn of_uneven(
        &mut self,
        entries: impl Iterator<Item = (usize, usize, f64)> + Clone,
    ) -> bool {
        self.of(entries);
        let even = [&self.rows, &self.columns].into_iter().all(|scales| {
            let least = scales.iter().copied().fold(f64::INFINITY, f64::min);
            norm_inf(scales) <= 1048576.0 * least
        });
        if even {
            self.rows.fill(1.0);
            self.columns.fill(1.0);
        }
        !even
    }

    /// x ← (R A C)⁻¹ x, or (R A C)⁻ᵀ x, by what solves with A.
    fn solve(
        &self,
        x: &mut [f64],
        transposed: bool,
        solve: &mut impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<(), SolveError> {
        let divide = |x: &mut [f64], by: &[f64]| x.iter_mut().zip(by).for_each(|(x, s)| *x /= s);
        let [before, after] = if transposed {
            [&self.columns, &self.rows]
        } else {
            [&self.rows, &self.columns]
        };
        divide(x, before);
        solve(x, transposed)?;
        divide(x, after);
        Ok(())
    }

    /// ‖R v‖∞ of a residual, ‖C⁻¹ v‖∞ of a solution.
    fn by(&self, v: &[f64], is_residual: bool) -> f64 {
        let scales = if is_residual {
            &self.rows
        } else {
            &self.columns
        };
        let of = |(v, s): (&f64, &f64)| if is_residual { v * s } else { v / s };
        // What is no number stays.
        v.iter().zip(scales).map(of).fold(0.0, |most: f64, v| {
            if most.is_nan() || v.abs() <= most {
                most
            } else {
                v.abs()
            }
        })
    }

    /// R A C at an entry.
    #[inline]
    pub(crate) fn at(&self, r: usize, c: usize, a: f64) -> f64 {
        a * self.rows[r] * self.columns[c]
    }
}

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

/// What the rule says of a matrix that is not singular.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Verdict {
    /// 1/(‖R A C‖₁ ‖(R A C)⁻¹‖₁).
    pub(crate) reciprocal: f64,
    /// What its factors are worth.
    pub(crate) factors: Factors,
}

impl Verdict {
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
    /// Those of equal largest entries, where the others are not.
    even: Scales,
    sums: Vec<f64>,
    estimate: Estimate,
}

impl Rule {
    /// Room for matrices of a dimension. Allocates.
    pub(crate) fn new(dim: usize) -> Self {
        Self {
            scales: Scales::new(dim),
            even: Scales::new(dim),
            sums: vec![0.0; dim],
            estimate: Estimate::new(dim),
        }
    }

    /// What is so of A of these entries; `roundoff` is that of the arithmetic that made its factors, `solve` is that of [`inverse_norm`]. Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::Singular`] with a scalar row as its block, the one with the largest part in the null vector.
    pub(crate) fn check(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        roundoff: f64,
        mut solve: impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Verdict, SolveError> {
        if self.sums.is_empty() {
            return Ok(Verdict {
                reciprocal: 1.0,
                factors: Factors::Good,
            });
        }
        self.scales.of(entries.clone());
        let found = self.check_scaled(entries, roundoff, &mut solve);
        // With more digits than x holds there is nothing to see whether a solution is right.
        if roundoff < f64::ROUNDOFF || !matches!(found, Err(SolveError::Singular { .. })) {
            return found;
        }
        self.even.columns.copy_from_slice(&self.scales.columns);
        self.scale_by_inverse(entries, &mut solve)?;
        match self.check_scaled(entries, roundoff, &mut solve) {
            Ok(Verdict { factors, .. }) if factors == Factors::Useless => found,
            Ok(verdict) => Ok(Verdict {
                factors: Factors::Graded,
                ..verdict
            }),
            Err(SolveError::Singular { .. }) => found,
            other => other,
        }
    }

    /// What is so with rows and columns scaled as they are now.
    fn check_scaled(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        roundoff: f64,
        solve: &mut impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Verdict, SolveError> {
        self.sums.fill(0.0);
        for (r, c, a) in entries.clone() {
            self.sums[c] += self.scales.at(r, c, a).abs();
        }
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
        let singular = SolveError::Singular { block: longest.row };
        let rows = self.sums.len() as f64;
        if reciprocal.is_nan() || reciprocal < 4.0 * rows.sqrt() * roundoff {
            return Err(singular);
        }
        // Of more digits than x holds nothing would be seen.
        let factors = if roundoff < f64::ROUNDOFF {
            Factors::Good
        } else {
            let hardest = self.solves(entries, Some(longest.unit), solve)?;
            let mut all = hardest.max(self.solves(entries, None, solve)?);
            let mut bits = split_mix(self.sums.len() as u64);
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
        Ok(Verdict {
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
            for (r, c, a) in entries.clone() {
                left[r] -= self.scales.at(r, c, a) * y[c];
            }
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

    /// How many corrections bring the solution of R A C y = R A C s near an s of signs: of a singular matrix none does, since
    /// what is in s of the null vector is not in the right-hand side; and s takes part in what is not hardest too.
    fn finds(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        bits: &mut impl FnMut() -> u64,
        solve: &mut impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Factors, SolveError> {
        // s − y.
        let (error, left) = (&mut self.estimate.largest, &mut self.sums);
        let signs = error.iter_mut();
        signs.for_each(|s| *s = if bits() >> 63 == 0 { 1.0 } else { -1.0 });
        for solution in 0..=CORRECTIONS {
            left.fill(0.0);
            for (r, c, a) in entries.clone() {
                left[r] += self.scales.at(r, c, a) * error[c];
            }
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
            // c ← |(R A C)⁻¹| 1, about, from products with random signs.
            let sizes = &mut self.estimate.largest;
            sizes.fill(0.0);
            for _ in 0..COLUMNS {
                let x = &mut self.estimate.columns[..n];
                x.iter_mut()
                    .for_each(|x| *x = if bits() >> 63 == 0 { 1.0 } else { -1.0 });
                match self.scales.solve(x, false, solve) {
                    Err(SolveError::NonFinite { .. }) => return Ok(()),
                    solved => solved?,
                }
                let rows = sizes.iter_mut().zip(&*x);
                rows.for_each(|(size, x)| *size = size.max(x.abs()));
            }
            let largest = norm_inf(sizes);
            for (column, size) in self.scales.columns.iter_mut().zip(&*sizes) {
                *column /= over((size / largest).max(f64::EPSILON));
            }
        }
        self.balance_rows(entries);
        Ok(())
    }

    /// R = 1/(|A| c), to a power of two.
    fn balance_rows(&mut self, entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone)) {
        let Scales { rows, columns } = &mut self.scales;
        rows.fill(0.0);
        for (r, c, a) in entries.clone() {
            rows[r] += a.abs() * columns[c];
        }
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
        for (r, c, a) in entries.clone() {
            counts[r] += 1.0;
            sums[r] += self.scales.at(r, c, a).abs();
        }
        Judge::new(norm_inf(counts), norm_inf(sums))
    }

    /// Judges x, which factors of this worth made of b, and corrects it; `judge` is that of the matrix, or [`Rule::judge`]
    /// where they are not good; `residual` and `solve` are those of [`Judge::settle`] with transposes. Allocates nothing.
    ///
    /// # Errors
    /// Those of `solve`.
    pub(crate) fn settle(
        &mut self,
        (judge, factors): (Judge, Factors),
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        x: &mut [f64],
        [r, d]: [&mut [f64]; 2],
        residual: impl FnMut(&[f64], &mut [f64]),
        mut solve: impl FnMut(&[f64], &mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Status, SolveError> {
        let (first, scales) = (f64::INFINITY, &self.scales);
        let correct = |r: &[f64], d: &mut [f64]| solve(r, d, false);
        let status = if matches!(factors, Factors::Good | Factors::Useless) {
            judge.settle(x, [&mut *r, &mut *d], first, residual, correct)?
        } else {
            let sizes = |r: &[f64], x: &[f64]| [scales.by(r, true), scales.by(x, false)];
            let buffers = [&mut *r, &mut *d];
            judge.settle_by(sizes, x, buffers, first, residual, correct)?
        };
        Ok(match factors {
            Factors::Useless => Status::Stalled,
            Factors::Graded if status == Status::Direct => {
                let solve = |x: &mut [f64], transposed: bool| {
                    d.copy_from_slice(x);
                    solve(d, x, transposed)
                };
                match self.error(entries, x, r, solve)? <= BOUND {
                    true => status,
                    false => Status::Stalled,
                }
            }
            _ => status,
        })
    }

    /// A bound of the error of x, with residual r, over x, both over the scales of their columns: of |A⁻¹| (|r| + (k + 2) u (|A|
    /// |x|)) with k entries in the longest row (Higham, 7.27).
    fn error(
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
        for (r, c, a) in entries.clone() {
            counts[r] += 1.0;
            rounded[r] += (a * x[c]).abs();
        }
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

/// The power of two that brings x to 1 … 2; 1 of zero and of what is no number.
fn over(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return 1.0;
    }
    let exponent = (x.to_bits() >> 52).clamp(1, 2045);
    f64::from_bits((2046 - exponent) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_powers_of_two_over_the_size() {
        for x in [1.0, 1.5, 1e-300, 1e300, f64::MIN_POSITIVE, 3.0, 0.7] {
            let scaled = x * over(x);
            assert!(
                (1.0..2.0).contains(&scaled) && over(x).log2().fract() == 0.0,
                "{x}"
            );
        }
        assert!(over(f64::MAX) > 0.0 && over(5e-324).is_finite());
        assert_eq!([over(0.0), over(f64::INFINITY)], [1.0; 2]);
    }

    /// Of a line of neighbours without a diagonal, and with shifts: A⁻¹ is of ±1 and zeros, so that starts of equal numbers end
    /// in a tie.
    #[test]
    fn the_estimate_is_near_the_norm() {
        let dense = "dense:double".parse().expect("a backend");
        for n in [4, 8, 20, 100, 200] {
            for diagonal in [0.0, 1e-3, 3.0] {
                let beside = (1..n).flat_map(|i| [(i, i - 1, 1.0), (i - 1, i, 1.0)]);
                let entries = (0..n).map(|i| (i, i, diagonal)).chain(beside).collect();
                let a = crate::GeneralMatrix::from_entries(n, entries).expect("sound");
                let mut solver = crate::GeneralSolver::analyze(&dense, &a).expect("sound");
                solver.factorize(&a).expect("regular");
                let mut solve = |x: &mut [f64], _| {
                    let b = x.to_vec();
                    solver.solve(&a, &b, x).map(|_| ())
                };
                let mut exact = 0.0_f64;
                let mut x = vec![0.0; n];
                for at in 0..n {
                    unit(&mut x, at);
                    solve(&mut x, false).expect("solves");
                    exact = exact.max(x.iter().map(|x| x.abs()).sum());
                }
                let found = inverse_norm(n, solve).expect("solves") / exact;
                assert!(
                    (1.0 / 3.0..1.001).contains(&found),
                    "{n} {diagonal}: {found}"
                );
            }
        }
    }
}
