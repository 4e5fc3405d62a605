//! The matrices of H46, with their solutions and conditions.
//!
//! | matrix | what it is | condition in the 2-norm |
//! |---|---|---|
//! | Hilbert n | 1/(i + j + 1) | largest eigenvalue times that of the inverse, which has integers for entries |
//! | bending N | D D′ of second differences D of N segments' N − 1 joints, the ends clamped | ~ 16 N⁴/4.7300⁴ |
//! | Laplacian n | 2 and −1 | cot²(π/2(n + 1)) |
//! | graded n | d T d, T the Laplacian and 2, d from 10⁻⁷⁵ to 10⁷⁵ | that of the entries, 10³⁰⁰ |
//! | Wilkinson n | 1, −0.95 below, 1 in the last column: not symmetric; it grows by 1.95ⁿ⁻¹ in elimination | ~ n |

use crate::hard::numerics::extended_solution;
use crate::matrix::Matrix;
use nalgebra::DMatrix;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;
use taut_solver::{BlockPattern, GeneralMatrix, SymBlockMatrix, solve_general};

/// What a condition number is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// κ₂.
    pub digits: f64,
    /// Its relative precision.
    pub tolerance: f64,
}

/// A matrix with what is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Specimen {
    /// Its name.
    pub name: String,
    /// A.
    pub matrix: Matrix,
    /// b.
    pub b: Vec<f64>,
    /// x in 32 digits, rounded; `None` where there is none.
    pub x: Option<Vec<f64>>,
    /// κ in the 2-norm.
    pub condition: f64,
    /// What κ is published or known to be.
    pub known: Option<Known>,
    /// By what elimination with partial pivoting makes its entries grow; 1 where it does not.
    pub growth: f64,
}

/// A symmetric matrix of scalar blocks by its entries; zeros are not stored.
fn symmetric(n: usize, a: impl Fn(usize, usize) -> f64) -> SymBlockMatrix {
    let below = |i: usize| (0..i).map(move |j| (i, j));
    let entries: Vec<_> = (0..n).flat_map(below).collect();
    let couplings: Vec<_> = entries
        .into_iter()
        .filter(|&(i, j)| a(i, j) != 0.0)
        .collect();
    // Sizes of 1 and couplings below n make a pattern.
    let pattern =
        BlockPattern::new(&vec![1; n], &couplings).unwrap_or_else(|e| unreachable!("{e}"));
    let pattern = Arc::new(pattern);
    let mut matrix = SymBlockMatrix::zeros(pattern.clone());
    for j in 0..n {
        for k in pattern.column(j) {
            matrix.block_mut(k)[0] = a(pattern.row(k), j);
        }
    }
    matrix
}

fn largest_eigenvalue(n: usize, a: impl Fn(usize, usize) -> f64) -> f64 {
    let dense = DMatrix::from_fn(n, n, a);
    dense.symmetric_eigenvalues().amax()
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k)
        .fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64)
        .round()
}

/// Entry of the inverse of the Hilbert matrix.
fn hilbert_inverse(n: usize, i: usize, j: usize) -> f64 {
    let sign = if (i + j).is_multiple_of(2) { 1.0 } else { -1.0 };
    let first = binomial(n + i, n - j - 1) * binomial(n + j, n - i - 1);
    sign * (i + j + 1) as f64 * first * binomial(i + j, i).powi(2)
}

fn with_ones(name: String, a: SymBlockMatrix, condition: f64, known: Option<Known>) -> Specimen {
    // A·1 in the order of the columns: rounded, where it is.
    let mut b = vec![0.0; a.dim()];
    a.for_each_lower(|r, c, v| {
        b[r] += v;
        if r != c {
            b[c] += v;
        }
    });
    Specimen {
        name,
        x: extended_solution(&a, &b).ok(),
        matrix: Matrix::Symmetric(a),
        b,
        condition,
        known,
        growth: 1.0,
    }
}

fn hilbert(n: usize, digits: f64) -> Specimen {
    let entry = |i: usize, j: usize| 1.0 / (i + j + 1) as f64;
    let inverse = |i, j| hilbert_inverse(n, i, j);
    let condition = largest_eigenvalue(n, entry) * largest_eigenvalue(n, inverse);
    let known = Known {
        digits,
        tolerance: 5e-6,
    };
    with_ones(
        format!("Hilbert {n}"),
        symmetric(n, entry),
        condition,
        Some(known),
    )
}

/// Ratio of the largest to the smallest eigenvalue.
fn spread(n: usize, a: impl Fn(usize, usize) -> f64) -> f64 {
    let values = DMatrix::from_fn(n, n, a).symmetric_eigenvalues();
    let least = values.iter().map(|v| v.abs()).fold(f64::INFINITY, f64::min);
    values.amax() / least
}

fn bending(segments: usize, digits: f64) -> Specimen {
    let n = segments - 1;
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 6.0,
        1 => -4.0,
        2 => 1.0,
        _ => 0.0,
    };
    let known = Known {
        digits,
        tolerance: 5e-3,
    };
    with_ones(
        format!("bending {segments}"),
        symmetric(n, entry),
        spread(n, entry),
        Some(known),
    )
}

fn second_difference(i: usize, j: usize) -> f64 {
    match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    }
}

fn laplacian(n: usize) -> Specimen {
    let exact = (FRAC_PI_2 / (n + 1) as f64).tan().powi(-2);
    let known = Known {
        digits: exact,
        tolerance: 1e-9,
    };
    with_ones(
        format!("Laplacian {n}"),
        symmetric(n, second_difference),
        spread(n, second_difference),
        Some(known),
    )
}

/// dᵢ T dⱼ with T strongly diagonal, and d over 150 orders.
fn graded(n: usize, rising: bool) -> Specimen {
    let d = |i: usize| {
        let i = if rising { i } else { n - 1 - i };
        10_f64.powf(150.0 * i as f64 / (n - 1) as f64 - 75.0)
    };
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 4.0 * d(i) * d(i),
        1 => -d(i) * d(j),
        _ => 0.0,
    };
    let way = if rising { "rising" } else { "falling" };
    let condition = entry(0, 0).max(entry(n - 1, n - 1)) / entry(0, 0).min(entry(n - 1, n - 1));
    let a = symmetric(n, entry);
    with_ones(format!("graded {n} {way}"), a, condition, None)
}

/// What stands below the diagonal, with a minus: less than 1, so that no row is exchanged, and no double of few
/// digits, so that what grows is rounded.
const BELOW: f64 = 0.95;

fn wilkinson(n: usize) -> Specimen {
    let entry = |i: usize, j: usize| {
        if i == j || j == n - 1 {
            1.0
        } else if i > j {
            -BELOW
        } else {
            0.0
        }
    };
    let places = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let entries: Vec<_> = places
        .map(|(i, j)| (i, j, entry(i, j)))
        .filter(|e| e.2 != 0.0)
        .collect();
    // Indices below n make a matrix.
    let a = GeneralMatrix::from_entries(n, entries).unwrap_or_else(|e| unreachable!("{e}"));
    let values = DMatrix::from_fn(n, n, entry).singular_values();
    // One that no growth leaves as it is.
    let b: Vec<f64> = (0..n).map(|i| ((i * i) as f64).sin()).collect();
    let extended = "dense:extended".parse().ok();
    Specimen {
        name: format!("Wilkinson {n}"),
        x: extended.and_then(|backend| solve_general(&backend, &a, &b).ok()),
        matrix: Matrix::General(a),
        b,
        condition: values.max() / values.min(),
        known: None,
        growth: (1.0 + BELOW).powi(n as i32 - 1),
    }
}

/// The matrices; the smaller ones if `quick`.
#[must_use]
pub fn specimens(quick: bool) -> Vec<Specimen> {
    let mut all = vec![
        hilbert(5, 4.76607e5),
        hilbert(8, 1.52576e10),
        hilbert(10, 1.60263e13),
        hilbert(12, 1.71323e16),
        bending(24, 1.24e4),
        bending(100, 3.32e6),
        laplacian(24),
        laplacian(if quick { 100 } else { 400 }),
        graded(31, true),
        graded(31, false),
        wilkinson(24),
        wilkinson(60),
    ];
    if quick {
        all.retain(|s| s.b.len() <= 60);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_of_the_hilbert_matrix_is_its_inverse() {
        for (i, j, exact) in [(0, 0, 25.0), (1, 0, -300.0), (4, 4, 44100.0)] {
            assert_eq!(hilbert_inverse(5, i, j), exact);
        }
    }

    /// Every specimen but the graded ones, beyond any number of digits, has a solution; that of integers is 1 exactly.
    #[test]
    fn solutions_are_known() {
        let graded = |s: &Specimen| s.name.starts_with("graded");
        for s in specimens(true).into_iter().filter(|s| !graded(s)) {
            let x = s.x.as_ref().unwrap_or_else(|| panic!("{}", s.name));
            assert!(x.iter().all(|x| x.is_finite()), "{}", s.name);
            if s.name.starts_with("bending") || s.name.starts_with("Laplacian") {
                assert!(x.iter().all(|x| *x == 1.0), "{}", s.name);
            }
        }
    }
}
