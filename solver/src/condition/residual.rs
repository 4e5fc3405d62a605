//! Tests of a solution by residuals in double-double arithmetic: those that are exactly zero, such as that of 0 for b = 0,
//! make a solution whatever the condition; and the corrections that they lead to are an estimate of the error that no
//! rounding of |A| |x| hides, however poor the factors: e of (I − B A)ᵏ is left of an error by k solutions with B.

use super::{BOUND, Rule};
use crate::{DoubleDouble, SolveError};

/// Least product whose two halves are normal numbers: 2⁻¹⁰²² over 2⁻¹⁰⁶.
pub(crate) const LEAST: f64 = f64::MIN_POSITIVE / f64::EPSILON / f64::EPSILON;

/// True if a x is below `least` and has digits, or all of them, below the normal numbers. `least` is at most 2⁻⁹⁰⁰.
pub(super) fn is_lost(a: f64, x: f64, least: f64) -> bool {
    let product = a * x;
    if a == 0.0 || x == 0.0 || product.abs() >= least {
        return false;
    }
    let up = 2.0_f64.powi(300);
    let wide = (a * up) * x;
    let rest = (a * up).mul_add(x, -wide);
    wide == 0.0 || rest != 0.0 || product * up != wide
}

/// Least and largest number of corrections that add up to an error.
const CORRECTIONS: [usize; 2] = [3, 8];

/// Corrections, over x, that need not get smaller.
const SMALL: f64 = 1e-3;

impl Rule {
    /// Returns true if b − A x is zero in double-double arithmetic. `residual` writes b − A x in doubles, which may be
    /// zero by rounding. Allocates nothing.
    pub(crate) fn solves_exactly(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        x: &[f64],
        [r, d]: [&mut [f64]; 2],
        mut residual: impl FnMut(&[f64], &mut [f64]),
    ) -> bool {
        residual(x, r);
        let lost = |(_, c, a): (usize, usize, f64)| is_lost(a, x[c], LEAST);
        if r.iter().any(|r| *r != 0.0) || entries.clone().any(lost) {
            return false;
        }
        self.estimate.columns[..x.len()].fill(0.0);
        self.residual(entries, x, [r, d], residual);
        let mut both = self.sums.iter().zip(&self.estimate.largest);
        both.all(|(high, low)| *high == 0.0 && *low == 0.0)
    }

    /// Sum of some corrections of x over x, or the last of them where that is larger, over the scales that equilibrate the
    /// largest entries of columns; infinite where they do not settle, or numbers overflow. `residual` is b − A x, and left
    /// in `r`; `solve` is x ← A⁻¹ x. Allocates nothing.
    ///
    /// # Errors
    /// The errors of `solve`.
    pub(super) fn corrections(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        x: &[f64],
        [r, d]: [&mut [f64]; 2],
        mut residual: impl FnMut(&[f64], &mut [f64]),
        mut solve: impl FnMut(&[f64], &mut [f64]) -> Result<(), SolveError>,
    ) -> Result<f64, SolveError> {
        let n = x.len();
        self.estimate.columns[..n].fill(0.0);
        let size = self.even.by(x, false);
        let [mut before, mut last] = [f64::INFINITY; 2];
        // Not by chance: they get smaller, or are small by far.
        let settles = |before: f64, last: f64| {
            last <= BOUND * size && last <= (0.5 * before).max(SMALL * size)
        };
        for done in 0..CORRECTIONS[1] {
            if done >= CORRECTIONS[0] && settles(before, last) {
                break;
            }
            self.residual(entries, x, [r, d], &mut residual);
            match solve(&self.sums, d) {
                Err(SolveError::NonFinite { .. }) => return Ok(f64::INFINITY),
                solved => solved?,
            }
            let error = self.estimate.columns[..n].iter_mut();
            error.zip(&*d).for_each(|(e, d)| *e += d);
            (before, last) = (last, self.even.by(d, false));
        }
        residual(x, r);
        let error = self.even.by(&self.estimate.columns[..n], false);
        if !settles(before, last) {
            return Ok(f64::INFINITY);
        }
        let off = if last <= error { error } else { last };
        // A NaN, which is no bound, stays.
        Ok(off / size)
    }

    /// b − A (x + e) in two parts, `sums` and `largest`; e is the first of the columns.
    fn residual(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        x: &[f64],
        [r, zero]: [&mut [f64]; 2],
        mut residual: impl FnMut(&[f64], &mut [f64]),
    ) {
        // b is the residual of 0.
        zero.fill(0.0);
        residual(zero, r);
        let (high, low) = (&mut self.sums, &mut self.estimate.largest);
        let error = &self.estimate.columns;
        high.copy_from_slice(r);
        low.fill(0.0);
        entries.clone().for_each(|(r, c, a)| {
            let x = DoubleDouble::from(x[c]) + error[c].into();
            let product = DoubleDouble::from(a) * x;
            let sum = DoubleDouble::from(high[r]) + low[r].into() - product;
            let rounded = sum.to_f64();
            (high[r], low[r]) = (rounded, (sum - rounded.into()).to_f64());
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Backend, GeneralMatrix, Status, SymBlockMatrix, solve_general};

    #[test]
    fn products_that_lose_digits_below_the_normal_numbers_are_lost() {
        let two = |power: i32| 2.0_f64.powi(power);
        let odd = 1.0 + f64::EPSILON;
        for (a, x, lost) in [
            (two(-600), two(-350), false),
            (two(-600), two(-470), false),
            (two(-600), two(-480), true),
            (odd * two(-540), odd * two(-500), true),
            (odd * two(-500), odd * two(-300), false),
            (0.0, two(-1000), false),
        ] {
            assert_eq!(is_lost(a, x, two(-900)), lost, "{a:e} {x:e}");
            assert_eq!(is_lost(x, a, two(-900)), lost, "{x:e} {a:e}");
        }
    }

    /// The error of a solution, from factors that are right to a part; none where they are worse.
    #[test]
    fn corrections_that_settle_add_up_to_the_error() {
        let (diagonal, b) = ([2.0, 3.0, 4.0], [2.0, 6.0, -4.0]);
        let entries = (0..3).map(|i| (i, i, diagonal[i]));
        let off = |error: f64, part: f64| {
            let x = [1.0, 2.0, -1.0].map(|x| x * (1.0 + error));
            let residual = |x: &[f64], r: &mut [f64]| {
                (0..3).for_each(|i| r[i] = b[i] - diagonal[i] * x[i]);
            };
            let solve = |r: &[f64], d: &mut [f64]| {
                (0..3).for_each(|i| d[i] = part * r[i] / diagonal[i]);
                Ok(())
            };
            let (mut r, mut d) = ([0.0; 3], [0.0; 3]);
            let found = Rule::new(3).corrections(&entries, &x, [&mut r, &mut d], residual, solve);
            found.expect("solves")
        };
        for part in [1.0, 0.99, 1.2] {
            let found = off(1e-9, part);
            assert!((found / 1e-9 - 1.0).abs() < 1e-2, "{part}: {found}");
        }
        // Each correction is larger than the one before.
        assert_eq!(off(1e-2, 2.5), f64::INFINITY);
    }

    /// The line −1 2 −1 for right-hand sides among the subnormal numbers, which no factor solves to a digit.
    #[test]
    fn definite_solutions_below_the_normal_numbers_are_judged() {
        let n = 12;
        let beside = (1..n).flat_map(|i| [(i, i - 1, -1.0), (i - 1, i, -1.0)]);
        let entries = (0..n).map(|i| (i, i, 2.0)).chain(beside).collect();
        let a = GeneralMatrix::from_entries(n, entries).expect("sound");
        let a = SymBlockMatrix::from_symmetric(&a, &[1; 12]).expect("symmetric");
        for (size, claimed) in [(1e-323, false), (1e-280, true), (1e-200, true)] {
            let b: Vec<f64> = (0..n).map(|i| size * (1 + i % 3) as f64).collect();
            let direct = Backend::all().into_iter();
            let direct = direct.filter(|b| b.is_compiled() && !b.is_iterative());
            for backend in direct {
                let mut x = vec![0.0; n];
                let mut solver = backend.create().expect("compiled");
                solver.analyze(a.pattern()).expect("sound");
                solver.factorize(&a).expect("definite");
                let status = solver.solve(&a, &b, &mut x).expect("solves").status;
                assert_eq!(status == Status::Direct, claimed, "{backend} {size:e}");
            }
        }
    }

    /// [a 2a; 3a a] of a subnormal a, whose products with thirds are rounded to multiples of it.
    #[test]
    fn residuals_that_vanish_below_the_normal_numbers_prove_nothing() {
        for (a, claimed) in [
            (5e-324, false),
            (1e-322, false),
            (1e-300, true),
            (1e-200, true),
        ] {
            let entries = vec![(0, 0, a), (0, 1, 2.0 * a), (1, 0, 3.0 * a), (1, 1, a)];
            let matrix = GeneralMatrix::from_entries(2, entries).expect("sound");
            for backend in ["dense:double", "dense:extended"] {
                let backend = backend.parse().expect("a backend");
                let solved = solve_general(&backend, &matrix, &[a, a]);
                let is_direct = solved.is_ok_and(|(_, report)| report.status == Status::Direct);
                assert_eq!(is_direct, claimed, "{backend} {a:e}");
            }
        }
    }

    /// A condition of 7·10¹⁴, rows and columns scaled, and residuals that are small beside |A| |x|: x may have no digit.
    #[test]
    fn small_residuals_of_rows_make_no_claim_beyond_the_condition() {
        let lower = [
            (0, 0, 2.220446049250313e-16),
            (1, 1, 1.661534994731145e35),
            (2, 1, -8.112963841460668e32),
            (2, 2, 32768.0),
            (3, 0, -2.3384026197294447e49),
            (3, 3, 3.602879701896397e16),
            (4, 1, 2.8003770703545734e49),
            (4, 2, -1.0857823013812522e49),
            (4, 4, 2.220446049250313e-16),
            (5, 1, -16777216.0),
            (5, 2, 0.0009765625),
            (5, 5, 4.9039857307708443e55),
            (6, 1, -8192.0),
            (6, 2, -0.25),
            (6, 4, 549755813888.0),
            (6, 5, 3.831238852164722e53),
            (6, 6, 7.205759403792794e16),
        ];
        let b = [
            2.3384026197294447e49,
            2.8003770703545557e49,
            -1.0857823013812521e49,
            2.3384026197294447e49,
            -5.846006549323612e48,
            1.9615942923083377e56,
            3.831238852164722e53,
        ];
        let upper = lower.iter().filter(|(r, c, _)| r != c);
        let upper: Vec<_> = upper.map(|&(r, c, a)| (c, r, a)).collect();
        let a = GeneralMatrix::from_entries(7, [&lower[..], &upper].concat()).expect("sound");
        let solve = |name: &str| {
            let backend: Backend = name.parse().expect("a backend");
            solve_general(&backend, &a, &b)
        };
        let (right, _) = solve("dense:extended").expect("regular");
        // In the units of the columns.
        let size = |v: &[f64]| v[..6].iter().fold(v[6] / 128.0, |m: f64, v| m.max(v.abs()));
        for name in ["dense:double", "faer:lu", "umfpack", "umfpack:refinement=0"] {
            if let Ok((x, report)) = solve(name)
                && report.status == Status::Direct
            {
                let off: Vec<f64> = x.iter().zip(&right).map(|(x, y)| (x - y).abs()).collect();
                let off = size(&off) / size(&right);
                assert!(off <= 0.3, "{name}: {off:.1e}");
            }
        }
    }
}
