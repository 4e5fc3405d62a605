//! Matrices that are ill-conditioned by themselves, with solutions by formula.
//!
//! Entries are integers, or of few binary digits, so that b = A x is exact. A direct solver has a small backward error,
//! whatever the condition κ, or says that what it returns is no solution; where κ n ε is 1 and more it may refuse, as a
//! Cholesky factorisation has to where rounding takes the definiteness. Graded matrices D T D, D of powers of two over
//! 150 orders, are judged entry by entry, where norms see the largest alone.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;
use taut_measure::claim::ROUNDING;
use taut_measure::errors::worse;
use taut_measure::matrix::Matrix;
use taut_measure::matrix::prepared::Problem;
use taut_measure::matrix::solve::backends;
use taut_solver::GeneralMatrix;
use taut_tests::claims::{Solve, alone, variants};
use taut_tests::prelude::*;

struct Specimen {
    name: String,
    a: DMatrix<f64>,
    x: Vec<f64>,
    condition: f64,
    /// For a graded matrix maxᵢ (|A⁻¹| (|A| |x| + |b|))ᵢ / |xᵢ|, the part of ω that x may have.
    graded: Option<f64>,
}

/// A banded matrix of these entries on and beside its diagonal.
fn banded(n: usize, entries: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(n, n, |i, j| {
        entries.get(i.abs_diff(j)).copied().unwrap_or(0.0)
    })
}

/// 1/(i + j + 1), times the common multiple of these.
fn hilbert(n: usize, condition: f64) -> Specimen {
    let divisor = |mut a: u64, mut b: u64| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let multiple = (1..2 * n as u64).fold(1, |m, k| m / divisor(m, k) * k);
    let entry = |i, j| (multiple / (i + j + 1) as u64) as f64;
    solved_by_ones(
        format!("Hilbert {n}"),
        DMatrix::from_fn(n, n, entry),
        condition,
    )
}

fn solved_by_ones(name: String, a: DMatrix<f64>, condition: f64) -> Specimen {
    Specimen {
        name,
        x: vec![1.0; a.nrows()],
        a,
        condition,
        graded: None,
    }
}

fn graded(n: usize, rising: bool) -> Specimen {
    let d =
        |i: usize| 2_f64.powi((498 * if rising { i } else { n - 1 - i } / (n - 1)) as i32 - 249);
    let t = banded(n, &[4.0, -1.0]);
    let y = DMatrix::from_fn(n, 1, |i, _| (1 + 3 * i % 5) as f64);
    let terms = t.abs() * &y + (&t * &y).abs();
    let spread = t.clone().try_inverse().expect("diagonally dominant").abs() * terms;
    Specimen {
        name: format!("graded {n}, rising: {rising}"),
        a: DMatrix::from_fn(n, n, |i, j| d(i) * t[(i, j)] * d(j)),
        x: (0..n).map(|i| y[i] / d(i)).collect(),
        condition: 1.0,
        graded: Some(spread.component_div(&y).max()),
    }
}

/// 1 on the diagonal and in the last column, −15/16 below: entries grow by 31/16 a row in elimination.
fn wilkinson(n: usize) -> Specimen {
    let a = DMatrix::from_fn(n, n, |i, j| match i > j {
        true => -15.0 / 16.0,
        false => f64::from(u8::from(i == j || j == n - 1)),
    });
    let x = (0..n).map(|i| (7 * i % 11) as f64 - 5.0).collect();
    solved_by_ones(format!("Wilkinson {n}"), a, n as f64).with(|p| p.x = x)
}

/// With the conditions in the 2-norm that are published; that of bending is ~ 16 N⁴/4.7300⁴.
fn specimens() -> Vec<Specimen> {
    let laplacian = |n: usize| {
        let condition = (FRAC_PI_2 / (n + 1) as f64).tan().powi(-2);
        solved_by_ones(format!("Laplacian {n}"), banded(n, &[2.0, -1.0]), condition)
    };
    let bending = |n: usize, condition| {
        let a = banded(n - 1, &[6.0, -4.0, 1.0]);
        solved_by_ones(format!("bending {n}"), a, condition)
    };
    vec![
        hilbert(5, 4.76607e5),
        hilbert(8, 1.52576e10),
        hilbert(10, 1.60263e13),
        hilbert(12, 1.71323e16),
        bending(24, 1.24e4),
        bending(100, 3.32e6),
        laplacian(24),
        laplacian(400),
        graded(31, true),
        graded(31, false),
        wilkinson(24),
        wilkinson(60),
    ]
}

/// The matrix as the program holds it, and its right-hand side.
fn stored(s: &Specimen) -> (Matrix, Vec<f64>) {
    let (a, n) = (&s.a, s.x.len());
    let b = (0..n).map(|r| (0..n).map(|c| a[(r, c)] * s.x[c]).sum());
    let b = b.collect();
    let stored = |&(i, j): &(usize, usize)| a[(i, j)] != 0.0;
    let places = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let places: Vec<_> = places.filter(stored).collect();
    if *a != a.transpose() {
        let entries = places.into_iter().map(|(i, j)| (i, j, a[(i, j)])).collect();
        let general = GeneralMatrix::from_entries(n, entries).expect("indices below n");
        return (Matrix::General(general), b);
    }
    let below: Vec<_> = places.into_iter().filter(|(i, j)| i > j).collect();
    let pattern = Arc::new(BlockPattern::new(&vec![1; n], &below).expect("sound"));
    let mut symmetric = SymBlockMatrix::zeros(pattern.clone());
    for j in 0..n {
        for k in pattern.column(j) {
            symmetric.block_mut(k)[0] = a[(pattern.row(k), j)];
        }
    }
    (Matrix::Symmetric(symmetric), b)
}

/// True if the solver is not to blame.
fn may_refuse(s: &Specimen, matrix: &Matrix, e: &SolveError) -> bool {
    match e {
        SolveError::NotSymmetric { .. } => matches!(matrix, Matrix::General(_)),
        SolveError::Singular { .. } | SolveError::NotPositiveDefinite { .. } => {
            s.condition * s.x.len() as f64 * f64::EPSILON >= 1.0
        }
        _ => false,
    }
}

#[test]
fn ill_conditioned_matrices_are_solved_or_refused() {
    for s in specimens() {
        let (matrix, b) = stored(&s);
        assert_eq!(alone(&matrix, &b, &s.x).residual, 0.0, "{}", s.name);
        let problem = Problem::new(&matrix);
        let mut exact = vec![0.0; b.len()];
        let mut oracle = problem.analyze(&oracle()).expect("always there");
        oracle
            .factorize()
            .and_then(|_| oracle.solve(&b, &mut exact))
            .expect("regular");
        assert!(forward_error(&exact, &s.x) < 1e-13, "{}: 32 digits", s.name);
        let mut right = 0;
        for one in variants(backends().into_iter().map(Choice::schur)) {
            let (backend, place) = (&one.0.backend, format!("{}, {}, {}", s.name, one.0, one.1));
            let mut x = vec![0.0; b.len()];
            let solved = problem.analyze(backend).and_then(|mut solver| {
                solver.factorize()?;
                solver.solve(&b, &mut x)
            });
            let refused = solved.as_ref().err();
            let refused = refused.map(|e| (may_refuse(&s, &matrix, e), e.to_string()));
            let seen = solved.map(|report| (report, alone(&matrix, &b, &x)));
            let solve = Solve::of(0, &one, seen.map_err(|e| e.to_string()));
            assert!(!solve.is_wrong(), "{place}: {solve:?}");
            if backend.is_iterative() {
                continue;
            }
            if let Some((may, told)) = refused {
                assert!(may, "{place}: {told}");
                continue;
            }
            let errors = matrix.backward_error(&b, &x).expect("lengths fit");
            let each = x.iter().zip(&s.x).map(|(x, e)| ((x - e) / e).abs());
            let error = match s.graded {
                None => errors.normwise,
                // NaN is beyond every bar.
                Some(spread) => each.fold(errors.componentwise, |m, e| worse(m, e / spread)),
            };
            assert!(error <= ROUNDING, "{place}: {error:e}");
            right += 1;
        }
        assert!(right > 0, "{}: nobody solves it", s.name);
    }
}
