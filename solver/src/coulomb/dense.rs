//! Dense elimination of a row-major matrix that carries its right-hand side as one more column.
//!
//! [`PANEL`] pivots are eliminated together: each row below them is read and written once for all of them.

use std::array;
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// Pivots of a panel.
const PANEL: usize = 8;

/// What the elimination may rely on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Symmetric and positive definite: LDLᵀ without exchanges, from the upper triangle alone.
    Definite,
    /// Any: LU with exchanges of rows.
    General,
}

/// The elimination's workspace.
#[derive(Debug, Default)]
pub(super) struct Dense {
    /// Rows of a panel, vector by vector: of each in turn as many columns as a vector has lanes.
    panel: Vec<f64>,
}

impl Dense {
    /// Solves A y = b for the `m` rows (A b) in `rows`, each of `m + 1` numbers. The solution replaces the last column's
    /// first `m` numbers in `solution`; `rows` is overwritten. `false` where a pivot is no number, zero, or of a definite
    /// matrix not positive. Allocates nothing for matrices no larger than those before.
    pub(super) fn solve(
        &mut self,
        m: usize,
        rows: &mut [f64],
        kind: Kind,
        solution: &mut [f64],
    ) -> bool {
        let elimination = Elimination {
            m,
            rows,
            kind,
            panel: &mut self.panel,
        };
        dispatch(Level::best(), elimination) && substitute(m, rows, solution)
    }
}

/// [`eliminate`], with the widest vectors that the processor has.
struct Elimination<'a> {
    m: usize,
    rows: &'a mut [f64],
    kind: Kind,
    panel: &'a mut Vec<f64>,
}

impl Kernel for Elimination<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        eliminate::<I::Widest>(self.m, self.rows, self.kind, self.panel)
    }
}

/// Rows become those of U and the right-hand side L⁻¹ b. Of L a general matrix keeps the columns, a symmetric one none.
#[inline(always)]
fn eliminate<V: Lanes>(m: usize, rows: &mut [f64], kind: Kind, panel: &mut Vec<f64>) -> bool {
    let width = m + 1;
    for first in (0..m).step_by(PANEL) {
        let last = (first + PANEL).min(m);
        for k in first..last {
            if kind == Kind::General {
                complete_column(first, k, width, rows);
                exchange(m, k, rows);
            }
            if !pivot(first, k, width, rows, kind) {
                return false;
            }
        }
        if last == m {
            break;
        }
        let (head, below) = rows.split_at_mut(last * width);
        pack::<V>(&head[first * width..], last, width, panel);
        for (pair, two) in below.chunks_mut(2 * width).enumerate() {
            let i = last + 2 * pair;
            // What lies left of a symmetric matrix's diagonal is not read.
            let vectors = if kind == Kind::Definite {
                (i - last) / V::LANES
            } else {
                0
            };
            let packed = &panel[vectors * PANEL * V::LANES..];
            let from = last + vectors * V::LANES;
            let factors = |row: &[f64], i: usize| -> [f64; PANEL] {
                array::from_fn(|p| factor(head, row, (first + p, i), width, kind))
            };
            let (a, b) = two.split_at_mut(width);
            let of_a = factors(a, i);
            if b.is_empty() {
                subtract::<V, 1>([&of_a], packed, [&mut a[from..]]);
            } else {
                let of_b = factors(b, i + 1);
                subtract::<V, 2>([&of_a, &of_b], packed, [&mut a[from..], &mut b[from..]]);
            }
        }
    }
    true
}

/// The panel's rows from column `last` on, filled up with zeros to whole vectors.
#[inline(always)]
fn pack<V: Lanes>(pivots: &[f64], last: usize, width: usize, panel: &mut Vec<f64>) {
    let vectors = (width - last).div_ceil(V::LANES);
    panel.clear();
    panel.resize(vectors * PANEL * V::LANES, 0.0);
    for (p, row) in pivots.chunks_exact(width).enumerate() {
        let to = panel.chunks_exact_mut(PANEL * V::LANES);
        for (to, from) in to.zip(row[last..].chunks(V::LANES)) {
            to[p * V::LANES..][..from.len()].copy_from_slice(from);
        }
    }
}

/// The entry of L in row `i` and column `p`: of a symmetric matrix it is that of U over the pivot.
#[inline(always)]
fn factor(head: &[f64], row: &[f64], (p, i): (usize, usize), width: usize, kind: Kind) -> f64 {
    match kind {
        Kind::Definite => head[p * width + i] / head[p * width + p],
        Kind::General => row[p],
    }
}

/// Column `k` of a general matrix from row `k` on, by the pivots from `first` on.
#[inline(always)]
fn complete_column(first: usize, k: usize, width: usize, rows: &mut [f64]) {
    let (head, below) = rows.split_at_mut(k * width);
    for row in below.chunks_exact_mut(width) {
        let done = (first..k).map(|p| row[p] * head[p * width + k]);
        row[k] -= done.sum::<f64>();
    }
}

/// Row `k` becomes one of U by the pivots from `first` on. `false` where its own is of no use.
#[inline(always)]
fn pivot(first: usize, k: usize, width: usize, rows: &mut [f64], kind: Kind) -> bool {
    let (head, rest) = rows.split_at_mut(k * width);
    let (row, below) = rest.split_at_mut(width);
    // A general matrix's column is complete.
    let from = if kind == Kind::Definite { k } else { k + 1 };
    for p in first..k {
        let factor = factor(head, row, (p, k), width, kind);
        let upper = &head[p * width + from..(p + 1) * width];
        for (to, u) in row[from..].iter_mut().zip(upper) {
            *to -= factor * u;
        }
    }
    let pivot = row[k];
    if !pivot.is_finite() || pivot == 0.0 || (kind == Kind::Definite && pivot < 0.0) {
        return false;
    }
    if kind == Kind::General {
        for row in below.chunks_exact_mut(width) {
            row[k] /= pivot;
        }
    }
    true
}

/// row −= Σ factorₚ pivotₚ for R rows.
#[inline(always)]
fn subtract<V: Lanes, const R: usize>(
    factors: [&[f64; PANEL]; R],
    packed: &[f64],
    rows: [&mut [f64]; R],
) {
    let wide = factors.map(|of| of.map(V::splat));
    let length = rows[0].len();
    let mut rows = rows.map(|row| row[..length].chunks_exact_mut(V::LANES));
    let mut packed = packed.chunks_exact(PANEL * V::LANES);
    for _ in 0..length / V::LANES {
        let Some(pivots) = packed.next() else { return };
        let mut to = rows.each_mut().map(|row| row.next().unwrap_or_default());
        let mut sums = to.each_ref().map(|to| V::load(to));
        for p in 0..PANEL {
            let pivot = V::load(&pivots[p * V::LANES..]);
            for (sum, wide) in sums.iter_mut().zip(&wide) {
                *sum = wide[p].neg_mul_add(pivot, *sum);
            }
        }
        for (to, sum) in to.iter_mut().zip(sums) {
            sum.store(to);
        }
    }
    let Some(pivots) = packed.next() else { return };
    for (row, factors) in rows.into_iter().zip(factors) {
        for (lane, to) in row.into_remainder().iter_mut().enumerate() {
            for (p, factor) in factors.iter().enumerate() {
                *to -= factor * pivots[p * V::LANES + lane];
            }
        }
    }
}

/// U y = b.
#[inline(always)]
fn substitute(m: usize, rows: &[f64], solution: &mut [f64]) -> bool {
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
