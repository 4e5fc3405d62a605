//! Dense elimination of a row-major matrix that carries its right-hand side as one more column.
//!
//! The leading rows and columns may be a symmetric positive definite block, which takes half the work: its rows keep no
//! factors, which are those of U over the pivots. The other rows exchange places for their pivots.
//!
//! [`PANEL`] pivots are eliminated together: each row below them is read and written once for all of them.

use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// Pivots of a panel.
const PANEL: usize = 8;

/// The elimination's workspace.
#[derive(Debug, Default)]
pub(super) struct Dense {
    /// Rows of a panel, vector by vector: of each in turn as many columns as a vector has lanes.
    panel: Vec<f64>,
}

impl Dense {
    /// Solves A y = b for the `m` rows (A b) in `rows`, each of `m + 1` numbers; of the `symmetric` leading ones nothing left
    /// of the diagonal is read. `rows` is overwritten. `false` where a pivot is no number, zero, or of the symmetric block not
    /// positive. Allocates nothing for matrices no larger than those before.
    pub(super) fn solve(
        &mut self,
        (m, symmetric): (usize, usize),
        rows: &mut [f64],
        solution: &mut [f64],
    ) -> bool {
        let elimination = Elimination {
            size: Size {
                m,
                width: m + 1,
                symmetric,
            },
            rows,
            panel: &mut self.panel,
        };
        dispatch(Level::best(), elimination) && substitute(m, rows, solution)
    }
}

/// Rows, numbers in each, and leading ones that are symmetric.
#[derive(Debug, Clone, Copy)]
struct Size {
    m: usize,
    width: usize,
    symmetric: usize,
}

/// [`eliminate`], with the widest vectors that the processor has.
struct Elimination<'a> {
    size: Size,
    rows: &'a mut [f64],
    panel: &'a mut Vec<f64>,
}

impl Kernel for Elimination<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        eliminate::<I::Widest>(self.size, self.rows, self.panel)
    }
}

/// Rows become those of U and the right-hand side L⁻¹ b.
#[inline(always)]
fn eliminate<V: Lanes>(size: Size, rows: &mut [f64], panel: &mut Vec<f64>) -> bool {
    let Size {
        m,
        width,
        symmetric,
    } = size;
    let mut first = 0;
    while first < m {
        let end = if first < symmetric { symmetric } else { m };
        let last = (first + PANEL).min(end);
        for k in first..last {
            complete_column(first, k, size, rows);
            if k >= symmetric {
                exchange(m, k, rows);
            }
            if !pivot(first, k, size, rows) {
                return false;
            }
        }
        let (head, below) = rows.split_at_mut(last * width);
        pack::<V>(&head[first * width..], last, width, panel);
        for (pair, two) in below.chunks_mut(2 * width).enumerate() {
            let i = last + 2 * pair;
            let skipped = if i + 1 < symmetric {
                (i - last) / V::LANES
            } else {
                0
            };
            let packed = &panel[skipped * PANEL * V::LANES..];
            let from = last + skipped * V::LANES;
            let factors = |row: &[f64], i: usize| {
                let mut factors = [0.0; PANEL];
                for (to, p) in factors.iter_mut().zip(first..last) {
                    *to = factor(head, row, (p, i), size);
                }
                factors
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
        first = last;
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

/// The entry of L in row `i` and column `p`: of a symmetric row that of U over the pivot.
#[inline(always)]
fn factor(head: &[f64], row: &[f64], (p, i): (usize, usize), size: Size) -> f64 {
    if i < size.symmetric {
        let upper = &head[p * size.width..(p + 1) * size.width];
        upper[i] / upper[p]
    } else {
        row[p]
    }
}

/// Column `k` of the rows without symmetry from row `k` on, by the pivots from `first` on.
#[inline(always)]
fn complete_column(first: usize, k: usize, size: Size, rows: &mut [f64]) {
    let (head, below) = rows.split_at_mut(k.max(size.symmetric) * size.width);
    for row in below.chunks_exact_mut(size.width) {
        let done = (first..k).map(|p| row[p] * head[p * size.width + k]);
        row[k] -= done.sum::<f64>();
    }
}

/// Row `k` becomes one of U by the pivots from `first` on, and the completed column below it one of L. `false` where the
/// pivot is of no use.
#[inline(always)]
fn pivot(first: usize, k: usize, size: Size, rows: &mut [f64]) -> bool {
    let (width, symmetric) = (size.width, size.symmetric);
    let (head, rest) = rows.split_at_mut(k * width);
    let (row, below) = rest.split_at_mut(width);
    // The column of a row without symmetry is complete.
    let from = if k < symmetric { k } else { k + 1 };
    for p in first..k {
        let factor = factor(head, row, (p, k), size);
        let upper = &head[p * width + from..(p + 1) * width];
        for (to, u) in row[from..].iter_mut().zip(upper) {
            *to -= factor * u;
        }
    }
    let pivot = row[k];
    if !pivot.is_finite() || pivot == 0.0 || (k < symmetric && pivot < 0.0) {
        return false;
    }
    let general = symmetric.saturating_sub(k + 1);
    for row in below.chunks_exact_mut(width).skip(general) {
        row[k] /= pivot;
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

#[cfg(test)]
mod tests {
    use super::super::tests::Random;
    use super::Dense;

    /// A matrix that is dominated by its diagonal, with its leading block symmetric, and a right-hand side.
    fn system(m: usize, symmetric: usize, random: &mut Random) -> Vec<f64> {
        let mut rows: Vec<f64> = (0..m * (m + 1)).map(|_| random.signed()).collect();
        for i in 0..m {
            rows[i * (m + 1) + i] += 2.0 * m as f64;
            for j in 0..i.min(symmetric) {
                if i < symmetric {
                    rows[i * (m + 1) + j] = rows[j * (m + 1) + i];
                }
            }
        }
        rows
    }

    #[test]
    fn systems_of_all_sizes_with_any_part_symmetric_are_solved() {
        let mut dense = Dense::default();
        for m in 1..40 {
            for symmetric in [0, 1, m / 3, m / 2, m - 1, m] {
                let symmetric = symmetric.min(m);
                let rows = system(m, symmetric, &mut Random::new(m as u64));
                let mut read = rows.clone();
                for i in 0..symmetric {
                    read[i * (m + 1)..i * (m + 1) + i].fill(f64::NAN);
                }
                let mut y = vec![0.0; m];
                assert!(dense.solve((m, symmetric), &mut read, &mut y));
                for row in rows.chunks_exact(m + 1) {
                    let sum: f64 = row.iter().zip(&y).map(|(a, y)| a * y).sum();
                    assert!((sum - row[m]).abs() < 1e-13 * m as f64, "{m} {symmetric}");
                }
            }
        }
    }

    #[test]
    fn small_pivots_are_exchanged_and_none_is_told() {
        let mut dense = Dense::default();
        let mut y = [0.0; 2];
        let mut rows = [1e-20, 1.0, 1.0, 1.0, 1.0, 3.0];
        assert!(dense.solve((2, 0), &mut rows, &mut y));
        assert_eq!(y, [2.0, 1.0]);
        assert!(!dense.solve((2, 0), &mut [1.0, 1.0, 1.0, 1.0, 1.0, 3.0], &mut y));
        assert!(!dense.solve((2, 2), &mut [1.0, 2.0, 1.0, 2.0, 1.0, 3.0], &mut y));
    }
}
