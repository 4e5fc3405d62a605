//! The matrices of H46, with their solutions and conditions, all by formula.
//!
//! | matrix | what it is | condition in the 2-norm |
//! |---|---|---|
//! | Hilbert n | 1/(i + j + 1), times the common multiple of these | largest eigenvalue times that of the inverse, which has integers for entries |
//! | bending N | D D′ of second differences D of N segments' N − 1 joints, the ends clamped | from the roots of its frequency equation, below; ~ 16 N⁴/4.7300⁴ |
//! | Laplacian n | 2 and −1 | cot²(π/2(n + 1)) |
//! | graded n | D T D, T the Laplacian and 2, D of powers of two from 10⁻⁷⁵ to 10⁷⁵ | that of the entries, 10³⁰⁰ |
//! | Wilkinson n | 1, −15/16 below, 1 in the last column: not symmetric; it grows by (31/16)ⁿ⁻¹ in elimination | ~ n |
//!
//! Entries are integers, or of few binary digits, so that A x is exact for an x of small integers, and b is made of it.
//! The solution of the graded matrices is x = D⁻¹ T⁻¹ D⁻¹ b, where scaling by powers of two is exact: norms, which see the
//! largest entries alone, mean nothing there, and each entry has to be as exact as T's condition leaves it.
//!
//! The eigenvalues of the bending matrix, 6, −4 and 1, are λ = 16 sin⁴ θ/2 with θ a root of (uⱼ = 0 at both places
//! beyond either end; cosh φ = 2 − cos θ; p = (n + 1)/2, q = (n + 3)/2)
//!
//! ```text
//! cos θp cosh φq = cos θq cosh φp   or   sin θp sinh φq = sin θq sinh φp
//! ```

use crate::hard::numerics::extended_solution;
use nalgebra::DMatrix;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use taut_ground::matrix::Matrix;
use taut_solver::{BlockPattern, GeneralMatrix, SymBlockMatrix};

/// A matrix with what is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Specimen {
    pub name: String,
    /// A.
    pub matrix: Matrix,
    /// b.
    pub b: Vec<f64>,
    /// x, exactly.
    pub x: Vec<f64>,
    /// κ in the 2-norm, as the matrix has it.
    pub condition: f64,
    /// κ by the formula of the matrix, if there is one.
    pub known: Option<f64>,
    /// For a graded matrix, which is judged entry by entry: amplification of the componentwise
    /// backward error in x, maxᵢ (|A⁻¹| (|A| |x| + |b|))ᵢ / |xᵢ|.
    pub graded: Option<f64>,
    /// Growth of the entries in elimination with partial pivoting; 1 without growth.
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

/// The smallest eigenvalue of a positive definite matrix, by inverse iteration in 32 digits; NaN if
/// a solve fails.
fn smallest_eigenvalue(a: &SymBlockMatrix) -> f64 {
    // Not orthogonal to any mode, and growing to one side.
    let mut v: Vec<f64> = (0..a.dim()).map(|i| 1.0 + 0.1 * (i as f64).sin()).collect();
    let mut value = f64::NAN;
    for _ in 0..60 {
        let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        v.iter_mut().for_each(|v| *v /= length);
        let Ok(next) = extended_solution(a, &v) else {
            return f64::NAN;
        };
        let before = value;
        value = 1.0 / v.iter().zip(&next).map(|(v, next)| v * next).sum::<f64>();
        v = next;
        if (value - before).abs() <= 1e-15 * value {
            break;
        }
    }
    value
}

/// A symmetric matrix of integers with the solution 1.
fn with_ones(name: String, n: usize, entry: impl Fn(usize, usize) -> f64, known: f64) -> Specimen {
    let a = symmetric(n, &entry);
    let b = (0..n).map(|r| (0..n).map(|c| entry(r, c)).sum()).collect();
    Specimen {
        name,
        condition: largest_eigenvalue(n, entry) / smallest_eigenvalue(&a),
        matrix: Matrix::Symmetric(a),
        b,
        x: vec![1.0; n],
        known: Some(known),
        graded: None,
        growth: 1.0,
    }
}

/// The least common multiple of 1 … n.
fn common_multiple(n: u64) -> u64 {
    let divisor = |mut a: u64, mut b: u64| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    (1..=n).fold(1, |m, k| m / divisor(m, k) * k)
}

/// κ₂ of the Hilbert matrix.
fn hilbert_condition(n: usize) -> f64 {
    let entry = |i: usize, j: usize| 1.0 / (i + j + 1) as f64;
    let inverse = |i, j| hilbert_inverse(n, i, j);
    largest_eigenvalue(n, entry) * largest_eigenvalue(n, inverse)
}

fn hilbert(n: usize) -> Specimen {
    let multiple = common_multiple(2 * n as u64 - 1);
    let entry = |i: usize, j: usize| (multiple / (i + j + 1) as u64) as f64;
    with_ones(format!("Hilbert {n}"), n, entry, hilbert_condition(n))
}

/// A zero of `f` between places where its signs differ.
fn zero(f: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2]) -> f64 {
    let positive = f(low) > 0.0;
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let to = if (f(middle) > 0.0) == positive {
            &mut low
        } else {
            &mut high
        };
        *to = middle;
    }
    0.5 * (low + high)
}

/// κ₂ of the bending matrix of dimension n: its first mode is symmetric, its last changes sign at every place.
fn bending_condition(n: usize) -> f64 {
    let m = n as f64;
    let [p, q] = [0.5 * (m + 1.0), 0.5 * (m + 3.0)];
    // cosh φp / cosh φq, or the same of sinh.
    let ratio = |theta: f64, sign: f64| {
        let phi = 2.0 * (0.5 * theta).sin().asinh();
        let fading = |p: f64| 1.0 + sign * (-2.0 * phi * p).exp();
        (-phi).exp() * fading(p) / fading(q)
    };
    let lambda = |theta: f64| 16.0 * (0.5 * theta).sin().powi(4);
    let first = |theta: f64| (theta * p).cos() - (theta * q).cos() * ratio(theta, 1.0);
    let sign = if n.is_multiple_of(2) { -1.0 } else { 1.0 };
    // θ = π − δ.
    let last = |delta: f64| (delta * p).cos() + (delta * q).cos() * ratio(PI - delta, sign);
    let theta = zero(first, [1.2, 1.7].map(|r| r * PI / (m + 2.0)));
    let delta = zero(last, [m + 3.0, m + 1.0].map(|d| PI / d));
    lambda(PI - delta) / lambda(theta)
}

fn bending(segments: usize) -> Specimen {
    let n = segments - 1;
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 6.0,
        1 => -4.0,
        2 => 1.0,
        _ => 0.0,
    };
    with_ones(
        format!("bending {segments}"),
        n,
        entry,
        bending_condition(n),
    )
}

fn laplacian(n: usize) -> Specimen {
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    };
    let known = (FRAC_PI_2 / (n + 1) as f64).tan().powi(-2);
    with_ones(format!("Laplacian {n}"), n, entry, known)
}

/// Powers of two from 10⁻⁷⁵ to 10⁷⁵.
fn grade(i: usize, n: usize) -> f64 {
    2_f64.powi((498 * i / (n - 1)) as i32 - 249)
}

/// dᵢ T dⱼ with T strongly diagonal, and d over 150 orders.
fn graded(n: usize, rising: bool) -> Specimen {
    let d = |i: usize| grade(if rising { i } else { n - 1 - i }, n);
    let middle = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 4.0,
        1 => -1.0,
        _ => 0.0,
    };
    let y = |i: usize| (1 + 3 * i % 5) as f64;
    let sum = |r: usize, part: &dyn Fn(f64) -> f64| -> f64 {
        (0..n).map(|c| part(middle(r, c)) * y(c)).sum()
    };
    let c: Vec<f64> = (0..n).map(|r| sum(r, &|a| a)).collect();
    // T⁻¹ has no negative entry.
    let terms: Vec<f64> = (0..n).map(|r| sum(r, &f64::abs) + c[r].abs()).collect();
    let bound = extended_solution(&symmetric(n, middle), &terms);
    let bound = bound.map_or(f64::NAN, |z| {
        (0..n).map(|i| z[i] / y(i)).fold(0.0, f64::max)
    });
    let way = if rising { "rising" } else { "falling" };
    Specimen {
        name: format!("graded {n} {way}"),
        matrix: Matrix::Symmetric(symmetric(n, |i, j| d(i) * middle(i, j) * d(j))),
        b: c.iter().enumerate().map(|(i, c)| d(i) * c).collect(),
        x: (0..n).map(|i| y(i) / d(i)).collect(),
        condition: (grade(n - 1, n) / grade(0, n)).powi(2),
        known: None,
        graded: Some(bound),
        growth: 1.0,
    }
}

/// Entries below the diagonal, negated. Below 1 no row is exchanged, and the growing entries take
/// ever more digits, which are rounded.
const BELOW: f64 = 15.0 / 16.0;

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
    let x: Vec<f64> = (0..n).map(|i| (7 * i % 11) as f64 - 5.0).collect();
    Specimen {
        name: format!("Wilkinson {n}"),
        matrix: Matrix::General(a),
        b: (0..n)
            .map(|r| (0..n).map(|c| entry(r, c) * x[c]).sum())
            .collect(),
        x,
        condition: values.max() / values.min(),
        known: None,
        graded: None,
        growth: (1.0 + BELOW).powi(n as i32 - 1),
    }
}

/// The matrices; the smaller ones if `quick`.
#[must_use]
pub fn specimens(quick: bool) -> Vec<Specimen> {
    let mut all = vec![
        hilbert(5),
        hilbert(8),
        hilbert(10),
        hilbert(12),
        bending(24),
        laplacian(24),
        graded(31, true),
        graded(31, false),
        wilkinson(24),
        wilkinson(60),
    ];
    if !quick {
        all.splice(5..5, [bending(100)]);
        all.splice(7..7, [laplacian(400)]);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_solver::{DoubleDouble, solve_general};

    #[test]
    fn the_inverse_of_the_hilbert_matrix_is_its_inverse() {
        for (i, j, exact) in [(0, 0, 25.0), (1, 0, -300.0), (4, 4, 44100.0)] {
            assert_eq!(hilbert_inverse(5, i, j), exact);
        }
    }

    /// The digits that are published, to the last of them.
    #[test]
    fn formulas_have_the_known_digits() {
        let hilbert = [
            (5, 4.76607e5),
            (8, 1.52576e10),
            (10, 1.60263e13),
            (12, 1.71323e16),
        ];
        for (n, digits) in hilbert {
            let found = hilbert_condition(n);
            assert!((found / digits - 1.0).abs() < 5e-6, "{n}: {found:e}");
        }
        for (segments, digits) in [(24, 1.24e4), (100, 3.32e6)] {
            let found = bending_condition(segments - 1);
            assert!((found / digits - 1.0).abs() < 5e-3, "{segments}: {found:e}");
        }
        // [6 −4; −4 6] has the eigenvalues 2 and 10.
        assert!((bending_condition(2) - 5.0).abs() < 1e-13);
        assert_eq!(common_multiple(10), 2520);
    }

    /// A x = b to the last digit, and no entry of b rounded.
    #[test]
    fn solutions_are_exact() {
        for s in specimens(true) {
            let mut r: Vec<DoubleDouble> = s.b.iter().map(|&b| b.into()).collect();
            s.matrix
                .for_each(|i, j, a| r[i] = r[i] - DoubleDouble::product(a, s.x[j]));
            assert!(r.iter().all(|r| r.to_f64() == 0.0), "{}", s.name);
            if let Matrix::General(a) = &s.matrix {
                let extended = "dense:extended".parse().expect("a backend");
                let (x, _) = solve_general(&extended, a, &s.b).expect("solvable");
                let off = |(x, exact): (&f64, &f64)| (x - exact).abs();
                assert!(x.iter().zip(&s.x).map(off).fold(0.0, f64::max) < 1e-13);
            }
        }
    }
}
