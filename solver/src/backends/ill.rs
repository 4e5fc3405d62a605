//! Matrices far nearer to singular than their pivots tell: no backend claims a solution of them that is none.

use crate::{
    Backend, BlockPattern, LinearSolver, RefineScratch, SolveError, Status, SymBlockMatrix, refine,
};
use std::sync::Arc;

const DIRECT: [&str; 8] = [
    "banded",
    "faer:llt",
    "faer:ldlt",
    "faer:lblt",
    "faer:lu",
    "nalgebra-sparse",
    "umfpack",
    "dense",
];

fn compiled() -> impl Iterator<Item = Backend> {
    let backends = DIRECT.map(|name| name.parse::<Backend>().expect("a backend"));
    backends.into_iter().filter(Backend::is_compiled)
}

/// Sizes of 0 … 1 that look random.
fn noise(seed: usize) -> f64 {
    ((seed * 7919 + 13) as f64).sin().abs()
}

/// L Lᵀ with 1 on the diagonal of L and −`below(r, c)` below it, in blocks of one row, coupled up to `band` rows apart.
fn product(n: usize, band: usize, below: impl Fn(usize, usize) -> f64) -> SymBlockMatrix {
    let l = |r: usize, c: usize| match r.cmp(&c) {
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater if r - c <= band => -below(r, c),
        _ => 0.0,
    };
    let couplings: Vec<_> = (0..n)
        .flat_map(|r| (r.saturating_sub(band)..r).map(move |c| (c, r)))
        .collect();
    let pattern = Arc::new(BlockPattern::new(&vec![1; n], &couplings).expect("a pattern"));
    let mut a = SymBlockMatrix::zeros(pattern.clone());
    for c in 0..n {
        for k in pattern.column(c) {
            let r = pattern.row(k);
            a.block_mut(k)[0] = (0..=c).map(|k| l(r, k) * l(c, k)).sum();
        }
    }
    a
}

fn solver(backend: &Backend, a: &SymBlockMatrix) -> Box<dyn LinearSolver> {
    let mut solver = backend.create().expect("compiled");
    solver.analyze(a.pattern()).expect("analysed");
    solver
}

/// The status and x, of one solve or of one refined by `sweeps`; `None` where the matrix is refused.
fn solved(
    solver: &mut dyn LinearSolver,
    a: &SymBlockMatrix,
    b: &[f64],
    sweeps: usize,
) -> Option<(Status, Vec<f64>)> {
    let mut x = vec![0.0; b.len()];
    // Some libraries name neither a singular matrix nor an indefinite one.
    solver.factorize(a).ok()?;
    let report = match sweeps {
        0 => solver.solve(a, b, &mut x),
        _ => solver.solve_unjudged(a, b, &mut x),
    };
    let mut status = match report {
        Err(SolveError::Singular { .. }) => return None,
        report => report.expect("a solution").status,
    };
    let mut scratch = RefineScratch::new(b.len());
    let residual = |x: &[f64], r: &mut [f64]| a.subtract_product(b, x, r);
    match refine(solver, a, &mut x, &mut scratch, sweeps, residual) {
        Err(SolveError::Singular { .. }) => return None,
        report => status = report.expect("refined").map_or(status, |r| r.status),
    }
    Some((status, x))
}

/// Relative error in the largest norm, against 32 digits; infinite where those do not suffice.
fn error(x: &[f64], a: &SymBlockMatrix, b: &[f64]) -> f64 {
    let right = crate::reference_solution(a, b);
    right.map_or(f64::INFINITY, |right| crate::forward_error(x, &right))
}

#[test]
fn products_of_unit_triangles_are_claimed_only_where_a_digit_is_right() {
    let mut claims = 0;
    for n in [10, 24, 31, 35, 45] {
        for (band, low) in [(n, 0.6), (1, 1.6), (2, 1.0)] {
            let a = product(n, band, |r, c| low + 0.8 * noise(r * n + c));
            let b: Vec<f64> = (0..n).map(|r| (r as f64).cos()).collect();
            for backend in compiled() {
                for sweeps in [0, 1, 2] {
                    let mut solver = solver(&backend, &a);
                    let Some((Status::Direct, x)) = solved(&mut *solver, &a, &b, sweeps) else {
                        continue;
                    };
                    claims += 1;
                    let off = error(&x, &a, &b);
                    assert!(
                        off <= 0.3,
                        "{backend}, {n} {band}, {sweeps} sweeps: {off:.1e}"
                    );
                }
            }
        }
    }
    // Those of 10 rows at least.
    assert!(claims >= 3 * 3 * compiled().count(), "{claims}");
}

/// With the signs of L turned the pivots stay: only the condition changes, from some 10³ to 10²⁰.
#[test]
fn a_second_matrix_of_one_pattern_is_judged_by_itself() {
    let n = 36;
    for band in [1, n] {
        let sound = product(n, band, |r, c| -0.05 - 0.1 * noise(r * n + c));
        let ill = product(n, band, |r, c| 1.6 + 0.8 * noise(r * n + c));
        let b: Vec<f64> = (0..n).map(|r| 1.0 + (r as f64).sin()).collect();
        for backend in compiled() {
            for sweeps in [0, 1] {
                let mut solver = solver(&backend, &sound);
                let first = solved(&mut *solver, &sound, &b, sweeps).expect("regular");
                assert_eq!(first.0, Status::Direct, "{backend}");
                if let Some((Status::Direct, x)) = solved(&mut *solver, &ill, &b, sweeps) {
                    let off = error(&x, &ill, &b);
                    assert!(off <= 0.3, "{backend}, band {band}, {sweeps}: {off:.1e}");
                }
                let again = solved(&mut *solver, &sound, &b, sweeps).expect("regular");
                assert_eq!(again, first, "{backend}");
            }
        }
    }
}

/// [ε 0 1; 0 ε 1; 1 1 0]: of b = 0 and of a b with a solution without rounding.
#[test]
fn a_residual_of_exactly_zero_is_a_solution() {
    for small in [1e-30, 1e-22] {
        let pattern = BlockPattern::new(&[1; 3], &[(0, 2), (1, 2)]).expect("a pattern");
        let mut a = SymBlockMatrix::zeros(Arc::new(pattern));
        a.values_mut()
            .copy_from_slice(&[small, 1.0, small, 1.0, 0.0]);
        for backend in compiled() {
            for (b, right) in [([0.0; 3], [0.0; 3]), ([1.0, 1.0, 0.0], [0.0, 0.0, 1.0])] {
                for sweeps in [0, 1] {
                    let mut solver = solver(&backend, &a);
                    if let Some((status, x)) = solved(&mut *solver, &a, &b, sweeps) {
                        let place = format!("{backend} {small} {b:?} {sweeps}: {x:?}");
                        assert!(status == Status::Direct || x != right, "{place} {status:?}");
                    }
                }
            }
        }
    }
}
