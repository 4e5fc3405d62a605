//! Dense elimination of a row-major matrix that carries its right-hand side as one more column.

use taut_lanes::{Isa, Kernel, Level, dispatch};

/// What the elimination may rely on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Symmetric and positive definite: LDLᵀ without exchanges, from the upper triangle alone.
    Definite,
    /// Any: LU with exchanges of rows.
    General,
}

/// Solves A y = b for the `m` rows (A b) in `rows`, each of `m + 1` numbers. The solution replaces the last column's
/// first `m` numbers in `solution`; `rows` is overwritten. `false` where a pivot is no number, zero, or of a definite
/// matrix not positive. Allocates nothing.
pub(super) fn solve(m: usize, rows: &mut [f64], kind: Kind, solution: &mut [f64]) -> bool {
    let elimination = Elimination {
        m,
        rows,
        kind,
        solution,
    };
    dispatch(Level::best(), elimination)
}

/// [`eliminate`], with the widest vectors that the processor has.
struct Elimination<'a> {
    m: usize,
    rows: &'a mut [f64],
    kind: Kind,
    solution: &'a mut [f64],
}

impl Kernel for Elimination<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        eliminate(self.m, self.rows, self.kind, self.solution)
    }
}

#[inline(always)]
fn eliminate(m: usize, rows: &mut [f64], kind: Kind, solution: &mut [f64]) -> bool {
    for k in 0..m {
        if kind == Kind::General {
            exchange(m, k, rows);
        }
        let (head, below) = rows.split_at_mut((k + 1) * (m + 1));
        let pivot_row = &head[k * (m + 1) + k..];
        let pivot = pivot_row[0];
        if !pivot.is_finite() || pivot == 0.0 || (kind == Kind::Definite && pivot < 0.0) {
            return false;
        }
        for (j, row) in below.chunks_exact_mut(m + 1).enumerate() {
            // Of a symmetric matrix the column below the pivot is the pivot's row, and what lies left of it is not read.
            let (entry, first) = match kind {
                Kind::Definite => (pivot_row[1 + j], 1 + j),
                Kind::General => (row[k], 1),
            };
            let factor = entry / pivot;
            if factor != 0.0 {
                let target = &mut row[k + first..];
                for (to, &from) in target.iter_mut().zip(&pivot_row[first..]) {
                    *to -= factor * from;
                }
            }
        }
    }
    for k in (0..m).rev() {
        let row = &rows[k * (m + 1)..(k + 1) * (m + 1)];
        let known: f64 = row[k + 1..m]
            .iter()
            .zip(&solution[k + 1..m])
            .map(|(a, y)| a * y)
            .sum();
        solution[k] = (row[m] - known) / row[k];
    }
    solution[..m].iter().all(|y| y.is_finite())
}

/// Exchanges row `k` with the one below that has the largest entry in column `k`.
#[inline(always)]
fn exchange(m: usize, k: usize, rows: &mut [f64]) {
    let entry = |i: usize| rows[i * (m + 1) + k].abs();
    let largest = (k + 1..m).fold(k, |best, i| if entry(i) > entry(best) { i } else { best });
    if largest != k {
        let (upper, lower) = rows.split_at_mut(largest * (m + 1));
        upper[k * (m + 1)..(k + 1) * (m + 1)].swap_with_slice(&mut lower[..=m]);
    }
}
