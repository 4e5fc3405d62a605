//! Square matrices that need not be symmetric: by compressed columns, and the backends that solve them.
//!
//! The trait [`LinearSolver`](crate::LinearSolver) is for symmetric block matrices, which is what the step needs. Here
//! is the small rest: LU with row exchanges by UMFPACK, faer and the dense solver, with the code that these have
//! anyway. All other backends answer with [`SolveError::NotSymmetric`]. What they return is judged by its backward error,
//! and corrected where that is not small (module `claim`): where that does not help the report says so.
//!
//! ```
//! use taut_solver::{Backend, GeneralMatrix, Status, solve_general};
//!
//! let a = GeneralMatrix::from_entries(2, vec![(0, 0, 2.0), (0, 1, 1.0), (1, 1, 4.0)])?; // [2 1; 0 4]
//! let (x, report) = solve_general(&"dense".parse::<Backend>()?, &a, &[4.0, 8.0])?;
//! assert_eq!((x, report.status), (vec![1.0, 2.0], Status::Direct));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::backends::General;
use crate::claim::Judge;
use crate::condition::{Assessment, Factors, Rule};
use crate::error::expect_len;
use crate::{Backend, FactorReport, FaerFactorization, SolveError, SolveReport};

/// A square sparse matrix by compressed columns, rows ascending in each column, no entry twice.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneralMatrix {
    /// First entry of each column, and the number of entries at the end; length `dim + 1`.
    column_start: Vec<usize>,
    row: Vec<usize>,
    values: Vec<f64>,
}

impl GeneralMatrix {
    /// The matrix of dimension `dim` with those entries (row, column, value), in any order; entries at the same place
    /// are added in theirs. Allocates.
    ///
    /// # Errors
    /// [`SolveError::Dimension`] where an index is not below `dim`, [`SolveError::TooLarge`] where there is no memory for as
    /// many columns.
    pub fn from_entries(
        dim: usize,
        mut entries: Vec<(usize, usize, f64)>,
    ) -> Result<Self, SolveError> {
        if let Some(largest) = entries.iter().map(|&(r, c, _)| r.max(c)).max()
            && largest >= dim
        {
            return Err(SolveError::Dimension {
                what: "index of an entry",
                expected: dim,
                found: largest,
            });
        }
        entries.sort_by_key(|&(r, c, _)| (c, r));
        let mut column_start = Vec::new();
        if column_start
            .try_reserve_exact(dim.saturating_add(1))
            .is_err()
        {
            return Err(SolveError::TooLarge {
                size: dim,
                limit: isize::MAX as usize / size_of::<usize>(),
                what: "rows",
            });
        }
        column_start.resize(dim + 1, 0);
        let mut a = Self {
            column_start,
            row: Vec::with_capacity(entries.len()),
            values: Vec::with_capacity(entries.len()),
        };
        let mut last = None;
        for (r, c, value) in entries {
            match a.values.last_mut() {
                Some(sum) if last == Some((r, c)) => *sum += value,
                _ => {
                    a.row.push(r);
                    a.values.push(value);
                    a.column_start[c + 1] += 1;
                    last = Some((r, c));
                }
            }
        }
        for c in 0..dim {
            a.column_start[c + 1] += a.column_start[c];
        }
        Ok(a)
    }

    /// Drops the entries that are zero, and says how many.
    pub fn drop_zeros(&mut self) -> usize {
        let (before, mut kept, mut from) = (self.values.len(), 0, 0);
        for c in 0..self.dim() {
            for e in from..self.column_start[c + 1] {
                if self.values[e] != 0.0 {
                    (self.row[kept], self.values[kept]) = (self.row[e], self.values[e]);
                    kept += 1;
                }
            }
            from = std::mem::replace(&mut self.column_start[c + 1], kept);
        }
        self.row.truncate(kept);
        self.values.truncate(kept);
        before - kept
    }

    /// Takes columns that were checked.
    pub(crate) fn of_columns(column_start: Vec<usize>, row: Vec<usize>, values: Vec<f64>) -> Self {
        Self {
            column_start,
            row,
            values,
        }
    }

    /// Entry at row `r` and column `c`; zero where nothing is stored. O(log n).
    #[must_use]
    pub fn get(&self, r: usize, c: usize) -> f64 {
        let column = self.column_start[c]..self.column_start[c + 1];
        let at = self.row[column.clone()].binary_search(&r);
        at.map_or(0.0, |at| self.values[column.start + at])
    }

    /// Dimension of the matrix.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.column_start.len() - 1
    }

    /// First entry of each column, and the number of entries at the end; length `dim + 1`.
    #[must_use]
    pub fn column_start(&self) -> &[usize] {
        &self.column_start
    }

    /// Row of each entry.
    #[must_use]
    pub fn rows(&self) -> &[usize] {
        &self.row
    }

    /// Value of each entry.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Calls `f(r, c, a_rc)` for each stored entry, columns in order.
    pub fn for_each(&self, mut f: impl FnMut(usize, usize, f64)) {
        for c in 0..self.dim() {
            for e in self.column_start[c]..self.column_start[c + 1] {
                f(self.row[e], c, self.values[e]);
            }
        }
    }

    /// Stored entries (row, column, value), columns in order.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + Clone + '_ {
        let columns = self.column_start.windows(2).enumerate();
        columns.flat_map(move |(c, at)| {
            let entry = move |e: usize| (self.row[e], c, self.values[e]);
            (at[0]..at[1]).map(entry)
        })
    }

    /// Aᵀ. Allocates.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let entries = self.entries().map(|(r, c, a)| (c, r, a)).collect();
        // The indices are within the dimension.
        Self::from_entries(self.dim(), entries).unwrap_or_else(|_| self.clone())
    }

    /// Returns true if aᵢⱼ = aⱼᵢ for all entries; entries that are not stored are zero. Allocates.
    #[must_use]
    pub fn is_symmetric(&self) -> bool {
        // Columns of the transpose come in the order of this matrix's columns, row by row.
        let mut next = self.column_start.clone();
        let mut symmetric = true;
        self.for_each(|r, c, value| {
            if value == 0.0 || !symmetric {
                return;
            }
            let end = self.column_start[r + 1];
            let at = &mut next[r];
            while *at < end && (self.row[*at] < c || self.values[*at] == 0.0) {
                symmetric &= self.row[*at] >= c || self.values[*at] == 0.0;
                *at += 1;
            }
            symmetric &= *at < end && self.row[*at] == c && self.values[*at] == value;
            *at += 1;
        });
        symmetric
    }

    /// Infinity norm ‖A‖∞ = maxᵢ Σⱼ |aᵢⱼ|. Allocates.
    #[must_use]
    pub fn norm_inf(&self) -> f64 {
        self.norm_inf_in(&mut vec![0.0; self.dim()])
    }

    /// ‖A‖∞, with `sums` as room for one number a row.
    pub(crate) fn norm_inf_in(&self, sums: &mut [f64]) -> f64 {
        sums.fill(0.0);
        self.for_each(|r, _, a| sums[r] += a.abs());
        sums.iter().copied().fold(0.0, f64::max)
    }
}

impl Backend {
    /// Returns true if it solves matrices that are not symmetric.
    #[must_use]
    pub fn accepts_unsymmetric(&self) -> bool {
        match self {
            Self::Umfpack(_) | Self::Dense(_) => true,
            Self::Faer(o) => o.factorization == FaerFactorization::Lu,
            Self::Banded | Self::NalgebraSparse | Self::Foreign { .. } => false,
            Self::GaussSeidel(_) | Self::ConjugateGradient(_) | Self::Minres(_) => false,
            Self::Auto => false,
        }
    }
}

/// Growth of the largest number in the elimination beyond which it may have lost the entries.
const GROWN: f64 = 1e8;

/// A backend at work on general matrices of one pattern: analysed once, factorised for each matrix, solved for each
/// right-hand side, as a [`LinearSolver`](crate::LinearSolver) is.
pub struct GeneralSolver {
    /// `None` for a system without rows, which no library is to be asked about.
    work: Option<General>,
    column_start: Vec<usize>,
    row: Vec<usize>,
    factorized: bool,
    /// Judge of the matrix last factorised.
    judge: Option<Judge>,
    rule: Rule,
    factors: Factors,
    /// A residual and its correction.
    buffers: [Vec<f64>; 2],
}

impl GeneralSolver {
    /// Prepares for matrices with the pattern of `a`. Allocates.
    ///
    /// # Errors
    /// [`SolveError::NotCompiled`], [`SolveError::NotSymmetric`] where the backend is for symmetric matrices only,
    /// [`SolveError::TooLarge`] and what a library reports.
    pub fn analyze(backend: &Backend, a: &GeneralMatrix) -> Result<Self, SolveError> {
        backend.create()?;
        if !backend.accepts_unsymmetric() {
            return Err(SolveError::NotSymmetric {
                backend: backend.name(),
            });
        }
        let work = match a.dim() {
            0 => None,
            _ => Some(backend.create_general(a)?),
        };
        Ok(Self {
            work,
            column_start: a.column_start.clone(),
            row: a.row.clone(),
            factorized: false,
            judge: None,
            rule: Rule::new(a.dim()),
            factors: Factors::Good,
            buffers: [(); 2].map(|()| vec![0.0; a.dim()]),
        })
    }

    /// Prepares for solves with the values of `a`, and estimates its condition with rows and columns scaled.
    ///
    /// # Errors
    /// [`SolveError::Singular`] (its block is a column) where that is beyond 1/(4 √n u) of n rows or a pivot vanishes,
    /// [`SolveError::NonFinite`], [`SolveError::PatternChanged`] and what a library reports.
    pub fn factorize(&mut self, a: &GeneralMatrix) -> Result<FactorReport, SolveError> {
        self.factorized = false;
        self.check_pattern(a)?;
        if let Some(block) = a.values.iter().position(|v| !v.is_finite()) {
            return Err(SolveError::NonFinite {
                what: "matrix",
                block: a.row[block],
            });
        }
        let report = match &mut self.work {
            None => FactorReport::default(),
            Some(work) => {
                let doubt = work.factorize(a)?;
                let (roundoff, [b, _]) = (work.roundoff(), &mut self.buffers);
                let judged = self.rule.check(&a.entries(), roundoff, |x, transposed| {
                    b.copy_from_slice(x);
                    work.solve(b, x, transposed)
                });
                let verdict = match (judged, doubt) {
                    (Err(SolveError::Singular { .. }), Some(block)) => {
                        return Err(SolveError::Singular { block });
                    }
                    // After such growth the factors are those of another matrix: they do not show
                    // that A is singular.
                    (Err(SolveError::Singular { .. }), None) if work.growth() > GROWN => {
                        Assessment::UNKNOWN
                    }
                    (judged, _) => judged?,
                };
                self.factors = verdict.factors;
                FactorReport {
                    reciprocal_condition: Some(verdict.reciprocal),
                }
            }
        };
        self.judge = Some(match self.factors {
            Factors::Good | Factors::Useless => Judge::of_general(a, &mut self.buffers[0]),
            Factors::Poor | Factors::Graded => self.rule.judge(&a.entries()),
        });
        self.factorized = true;
        Ok(report)
    }

    fn check_pattern(&self, a: &GeneralMatrix) -> Result<(), SolveError> {
        if (&self.column_start, &self.row) == (&a.column_start, &a.row) {
            Ok(())
        } else {
            Err(SolveError::PatternChanged)
        }
    }

    /// Solves A x = b with `a` as last factorised; `b` and `x` of length `dim`. The status is
    /// [`Status::Direct`](crate::Status) where the backward error of `x` is at roundoff, 2 (k + 2) u with k entries in the
    /// longest row, if need be after some corrections, and [`Status::Stalled`](crate::Status) where it cannot be brought
    /// there: entries grew in the elimination until their rounding was larger than what was to be solved.
    ///
    /// # Errors
    /// [`SolveError::OutOfOrder`], [`SolveError::PatternChanged`], [`SolveError::Dimension`], [`SolveError::NonFinite`]
    /// and what a library reports.
    pub fn solve(
        &mut self,
        a: &GeneralMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        let dim = self.column_start.len() - 1;
        if !self.factorized {
            return Err(SolveError::OutOfOrder {
                called: "solve",
                needs: "factorize",
            });
        }
        self.check_pattern(a)?;
        expect_len("right-hand side", dim, b.len())?;
        expect_len("solution", dim, x.len())?;
        check_finite("right-hand side", b)?;
        let (Some(work), Some(judge)) = (&mut self.work, self.judge) else {
            return Ok(SolveReport::DIRECT);
        };
        work.solve(b, x, false)?;
        check_finite("solution", x)?;
        let [r, d] = &mut self.buffers;
        let residual = |x: &[f64], r: &mut [f64]| {
            r.copy_from_slice(b);
            a.for_each(|row, column, a| r[row] -= a * x[column]);
        };
        let (judge, solve) = (
            (judge, self.factors),
            |b: &[f64], x: &mut [f64], transposed: bool| work.solve(b, x, transposed),
        );
        let (rule, entries) = (&mut self.rule, &a.entries());
        let status = rule.settle(judge, entries, x, [r, d], residual, solve)?;
        check_finite("solution", x)?;
        Ok(SolveReport {
            status,
            ..SolveReport::DIRECT
        })
    }
}

/// x of A x = b by `backend`, and whether it is claimed: all phases at once. Allocates.
///
/// # Errors
/// The errors of [`GeneralSolver`].
pub fn solve_general(
    backend: &Backend,
    a: &GeneralMatrix,
    b: &[f64],
) -> Result<(Vec<f64>, SolveReport), SolveError> {
    let mut solver = GeneralSolver::analyze(backend, a)?;
    solver.factorize(a)?;
    let mut x = vec![0.0; a.dim()];
    let report = solver.solve(a, b, &mut x)?;
    Ok((x, report))
}

fn check_finite(what: &'static str, v: &[f64]) -> Result<(), SolveError> {
    let bad = v.iter().position(|x| !x.is_finite());
    bad.map_or(Ok(()), |block| Err(SolveError::NonFinite { what, block }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Status, backward_error_general, forward_error};

    /// A convection and diffusion: −u″ + p u′ on a line, upwind, and a permuted row so that no pivot order is natural.
    fn upwind(n: usize) -> GeneralMatrix {
        let mut entries = Vec::new();
        for i in 0..n {
            let row = (i * 7 + 3) % n;
            entries.push((row, i, 4.0 + 1.0 / (i + 1) as f64));
            entries.extend((i > 0).then(|| (row, i - 1, -3.0)));
            entries.extend((i + 1 < n).then(|| (row, i + 1, -1.0)));
        }
        GeneralMatrix::from_entries(n, entries).unwrap()
    }

    fn all() -> Vec<Backend> {
        let names = ["umfpack", "faer:lu", "dense", "dense:extended"];
        let backends = names.map(|n| n.parse::<Backend>().unwrap());
        backends.into_iter().filter(Backend::is_compiled).collect()
    }

    #[test]
    fn all_that_can_solve_an_unsymmetric_matrix_agree() {
        let a = upwind(50); // gcd(7, 50) = 1: a permutation
        assert!(!a.is_symmetric());
        let exact: Vec<f64> = (0..50).map(|i| 1.0 + (i % 3) as f64).collect();
        let mut b = vec![0.0; 50];
        a.for_each(|r, c, v| b[r] += v * exact[c]);
        for backend in all() {
            let (x, report) = solve_general(&backend, &a, &b).unwrap();
            assert_eq!(report.status, Status::Direct, "{backend}");
            let error = backward_error_general(&a, &b, &x).unwrap();
            assert!(error.componentwise < 1e-15, "{backend}: {error:?}");
            assert!(forward_error(&x, &exact) < 1e-13, "{backend}");
        }
    }

    #[test]
    fn factors_are_made_anew_for_new_values() {
        let entries = |s: f64| vec![(0, 1, s), (1, 0, 2.0 * s), (1, 1, 1.0)];
        let a = |s| GeneralMatrix::from_entries(2, entries(s)).unwrap();
        for backend in all() {
            let mut solver = GeneralSolver::analyze(&backend, &a(1.0)).unwrap();
            let mut x = [0.0; 2];
            assert!(matches!(
                solver.solve(&a(1.0), &[1.0, 1.0], &mut x),
                Err(SolveError::OutOfOrder { .. })
            ));
            for s in [1.0, 4.0] {
                solver.factorize(&a(s)).unwrap();
                solver.solve(&a(s), &[s, 2.0 * s + 1.0], &mut x).unwrap();
                assert!(forward_error(&x, &[1.0, 1.0]) < 1e-15, "{backend} {x:?}");
            }
            let other = GeneralMatrix::from_entries(2, vec![(0, 0, 1.0), (1, 1, 1.0)]).unwrap();
            let changed = solver.solve(&other, &[1.0, 1.0], &mut x);
            assert_eq!(changed.map(|_| ()), Err(SolveError::PatternChanged));
            assert_eq!(solver.factorize(&other), Err(SolveError::PatternChanged));
            assert!(solver.solve(&a(1.0), &[1.0, 1.0], &mut x).is_err());
        }
    }

    #[test]
    fn what_cannot_be_solved_is_refused() {
        let singular = GeneralMatrix::from_entries(2, vec![(0, 0, 1.0), (0, 1, 2.0)]).unwrap();
        let dependent = [(0, 0, 1.0), (0, 1, 2.0), (1, 0, 0.5), (1, 1, 1.0)];
        let dependent = GeneralMatrix::from_entries(2, dependent.to_vec()).unwrap();
        for backend in all() {
            for a in [&singular, &dependent] {
                let holds = solve_general(&backend, a, &[1.0, 1.0]).is_err();
                assert!(holds, "{backend}");
            }
        }
        let nan = GeneralMatrix::from_entries(1, vec![(0, 0, f64::NAN)]).unwrap();
        let dense = "dense".parse().unwrap();
        assert!(matches!(
            solve_general(&dense, &nan, &[1.0]),
            Err(SolveError::NonFinite { .. })
        ));
        assert!(solve_general(&dense, &upwind(9), &[1.0]).is_err());
        assert!(GeneralMatrix::from_entries(2, vec![(2, 0, 1.0)]).is_err());
        for backend in Backend::all() {
            if backend.is_compiled() && !backend.accepts_unsymmetric() {
                let e = solve_general(&backend, &upwind(9), &[1.0; 9]).unwrap_err();
                let expected = SolveError::NotSymmetric {
                    backend: backend.name(),
                };
                assert_eq!(e, expected);
                assert!(e.to_string().contains("umfpack, faer:lu, dense"), "{e}");
            }
        }
        let none = GeneralMatrix::from_entries(0, vec![]).unwrap();
        let (x, report) = solve_general(&dense, &none, &[]).unwrap();
        assert!(x.is_empty() && report.status == Status::Direct);
    }

    #[test]
    fn symmetry_is_exact_and_knows_zeros() {
        let a = |entries: &[(usize, usize, f64)]| {
            GeneralMatrix::from_entries(3, entries.to_vec()).unwrap()
        };
        assert!(a(&[(0, 1, 2.0), (1, 0, 2.0), (2, 2, 1.0)]).is_symmetric());
        assert!(a(&[(0, 1, 0.0), (2, 0, 3.0), (0, 2, 3.0), (1, 2, -0.0)]).is_symmetric());
        assert!(!a(&[(0, 1, 2.0), (1, 0, 2.0_f64.next_up())]).is_symmetric());
        assert!(!a(&[(0, 1, 2.0)]).is_symmetric());
        assert!(!a(&[(1, 0, 2.0), (2, 0, 1.0), (0, 2, 1.0)]).is_symmetric());
        // Entries at one place are added.
        assert!(a(&[(0, 1, 1.0), (1, 0, 2.0), (0, 1, 1.0)]).is_symmetric());
    }
}
