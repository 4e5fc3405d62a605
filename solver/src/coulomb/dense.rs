//! Dense elimination of a row-major matrix that carries its right-hand side as one more column.
//!
//! The leading rows and columns may be a symmetric positive definite block, which takes half the work: its rows keep no
//! factors, which are those of U over the pivots. The other rows exchange places for their pivots.
//!
//! [`PANEL`] pivots are eliminated together: each row below them is read and written once for all of them.

use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// Pivots of a panel.
const PANEL: usize = 8;

/// Numbers of a cache line: no vector has more. Rows are padded to whole ones with zeros, and begin where one does.
const LINE: usize = 8;

/// The elimination's rows and workspace.
#[derive(Debug, Default)]
pub(super) struct Dense {
    memory: Vec<f64>,
    /// Rows of a panel, vector by vector: of each in turn as many columns as a vector has lanes.
    panel: Vec<f64>,
}

impl Dense {
    /// Rows (A b) for `m` unknowns, all zero, and the numbers of each, of which the first `m + 1` count.
    pub(super) fn begin(&mut self, m: usize) -> (&mut [f64], usize) {
        let Size { width, .. } = Size::new(m, m, m);
        self.memory.clear();
        self.memory.resize(m * width + LINE, 0.0);
        (aligned(&mut self.memory, m * width), width)
    }

    /// Solves A y = b for the `m` rows that [`begin`](Self::begin) gave; of the `symmetric` leading ones nothing left of the
    /// diagonal is read. They are overwritten. `false` where a pivot is no number, zero, or of the symmetric block not
    /// positive. Allocates nothing for matrices no larger than those before.
    pub(super) fn solve(&mut self, (m, symmetric): (usize, usize), solution: &mut [f64]) -> bool {
        let size = Size::new(m, symmetric, m);
        self.eliminate(size) && self.substitute(size, solution)
    }

    /// Eliminates the `leading` first of `m` unknowns, with all rows symmetric. `false` where a pivot is not positive. The
    /// other [`rows`](Self::rows) then have what is left, right of the diagonal.
    pub(super) fn lead(&mut self, m: usize, leading: usize) -> bool {
        self.eliminate(Size::new(m, m, leading))
    }

    /// The unknowns that [`lead`](Self::lead) eliminated, into the beginning of `solution`, for the others in the rest of it.
    pub(super) fn follow(&mut self, leading: usize, solution: &mut [f64]) -> bool {
        let m = solution.len();
        self.substitute(Size::new(m, m, leading), solution)
    }

    /// The rows of `m` unknowns as they are.
    pub(super) fn rows(&mut self, m: usize) -> impl Iterator<Item = &[f64]> {
        let Size { width, .. } = Size::new(m, m, m);
        aligned(&mut self.memory, m * width).chunks_exact(width)
    }

    fn eliminate(&mut self, size: Size) -> bool {
        let elimination = Elimination {
            size,
            rows: aligned(&mut self.memory, size.m * size.width),
            panel: &mut self.panel,
        };
        dispatch(Level::best(), elimination)
    }

    fn substitute(&mut self, size: Size, solution: &mut [f64]) -> bool {
        let rows = aligned(&mut self.memory, size.m * size.width);
        let substitution = Substitution {
            size,
            rows,
            solution,
        };
        dispatch(Level::best(), substitution)
    }
}

/// The part of `memory` that begins a cache line.
fn aligned(memory: &mut [f64], length: usize) -> &mut [f64] {
    let skipped = memory.as_ptr().align_offset(LINE * size_of::<f64>());
    &mut memory[skipped.min(LINE)..][..length]
}

/// Rows, numbers in each, leading ones that are symmetric, and leading ones that are eliminated or substituted.
#[derive(Debug, Clone, Copy)]
struct Size {
    m: usize,
    width: usize,
    symmetric: usize,
    pivots: usize,
}

impl Size {
    fn new(m: usize, symmetric: usize, pivots: usize) -> Self {
        let width = (m + 1).next_multiple_of(LINE);
        Self {
            m,
            width,
            symmetric,
            pivots,
        }
    }
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

/// [`substitute`], with the same.
struct Substitution<'a> {
    size: Size,
    rows: &'a [f64],
    solution: &'a mut [f64],
}

impl Kernel for Substitution<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        substitute::<I::Widest>(self.size, self.rows, self.solution)
    }
}

/// Rows become those of U and the right-hand side L⁻¹ b. What is left of the diagonal is of no further use.
#[inline(always)]
fn eliminate<V: Lanes>(size: Size, rows: &mut [f64], panel: &mut Vec<f64>) -> bool {
    let Size {
        m,
        width,
        symmetric,
        pivots,
    } = size;
    let mut first = 0;
    while first < pivots {
        let end = if first < symmetric { symmetric } else { m };
        let end = end.min(pivots);
        let last = (first + PANEL).min(end);
        for k in first..last {
            complete_column(first, k, size, rows);
            if k >= symmetric {
                exchange(m, k, rows, width);
            }
            if !pivot(first, k, size, rows) {
                return false;
            }
        }
        let (head, below) = rows.split_at_mut(last * width);
        let begin = last / V::LANES * V::LANES;
        pack::<V>(&head[first * width..], begin, width, panel);
        let mut inverse = [0.0; PANEL];
        for (to, p) in inverse.iter_mut().zip(first..last) {
            *to = 1.0 / head[p * width + p];
        }
        for (pair, two) in below.chunks_mut(2 * width).enumerate() {
            let i = last + 2 * pair;
            let from = if i + 1 < symmetric {
                i / V::LANES * V::LANES
            } else {
                begin
            };
            let packed = &panel[(from - begin) * PANEL..];
            let (a, b) = two.split_at_mut(width);
            let of = |row: &[f64], i: usize| {
                if i < symmetric {
                    factors_of_column::<V>(packed, i - from, &inverse)
                } else {
                    factors_of_row(&row[first..last])
                }
            };
            let of_a = of(a, i);
            if b.is_empty() {
                subtract::<V, 1>([&of_a], packed, [&mut a[from..]]);
            } else {
                let of_b = of(b, i + 1);
                subtract::<V, 2>([&of_a, &of_b], packed, [&mut a[from..], &mut b[from..]]);
            }
        }
        first = last;
    }
    true
}

/// The panel's rows from column `begin` on, vector by vector; missing rows are zero.
#[inline(always)]
fn pack<V: Lanes>(pivots: &[f64], begin: usize, width: usize, panel: &mut Vec<f64>) {
    panel.clear();
    panel.resize((width - begin) * PANEL, 0.0);
    for (p, row) in pivots.chunks_exact(width).enumerate() {
        let to = panel.chunks_exact_mut(PANEL * V::LANES);
        for (to, from) in to.zip(row[begin..].chunks_exact(V::LANES)) {
            to[p * V::LANES..][..V::LANES].copy_from_slice(from);
        }
    }
}

/// The panel's factors of a symmetric row: what its pivots have in column `at` of `packed`, over the pivots.
#[inline(always)]
fn factors_of_column<V: Lanes>(packed: &[f64], at: usize, inverse: &[f64; PANEL]) -> [f64; PANEL] {
    let block = &packed[at / V::LANES * PANEL * V::LANES..][..PANEL * V::LANES];
    std::array::from_fn(|p| block[p * V::LANES + at % V::LANES] * inverse[p])
}

/// The panel's factors of an unsymmetric row, which stores them.
#[inline(always)]
fn factors_of_row(row: &[f64]) -> [f64; PANEL] {
    let mut factors = [0.0; PANEL];
    factors[..row.len()].copy_from_slice(row);
    factors
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
    let mut rows = rows.map(|row| row.chunks_exact_mut(V::LANES));
    for pivots in packed.chunks_exact(PANEL * V::LANES) {
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
}

/// U y = b.
#[inline(always)]
fn substitute<V: Lanes>(size: Size, rows: &[f64], solution: &mut [f64]) -> bool {
    let Size {
        m, width, pivots, ..
    } = size;
    for k in (0..pivots).rev() {
        let row = &rows[k * width..k * width + m];
        let (row, y) = (&row[k + 1..], &solution[k + 1..m]);
        let mut sums = V::splat(0.0);
        let whole = row.len() / V::LANES * V::LANES;
        for (a, y) in row.chunks_exact(V::LANES).zip(y.chunks_exact(V::LANES)) {
            sums = V::load(a).mul_add(V::load(y), sums);
        }
        let rest = row[whole..].iter().zip(&y[whole..]).map(|(a, y)| a * y);
        let mut lanes = [0.0; LINE];
        sums.store(&mut lanes);
        let known = rest.sum::<f64>() + lanes.iter().sum::<f64>();
        solution[k] = (rows[k * width + m] - known) / rows[k * width + k];
    }
    solution[..m].iter().all(|y| y.is_finite())
}

/// Exchanges row `k` with the one below that has the largest entry in column `k`.
#[inline(always)]
fn exchange(m: usize, k: usize, rows: &mut [f64], width: usize) {
    let entry = |i: usize| rows[i * width + k].abs();
    let largest = (k + 1..m).fold(k, |best, i| if entry(i) > entry(best) { i } else { best });
    if largest != k {
        let (upper, lower) = rows.split_at_mut(largest * width);
        upper[k * width..(k + 1) * width].swap_with_slice(&mut lower[..width]);
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

    /// The rows, without what is left of the diagonal in the symmetric ones.
    fn put(dense: &mut Dense, m: usize, rows: &[f64], symmetric: usize) {
        let (to, width) = dense.begin(m);
        for (i, row) in rows.chunks_exact(m + 1).enumerate() {
            let to = &mut to[i * width..i * width + m + 1];
            to.copy_from_slice(row);
            to[..if i < symmetric { i } else { 0 }].fill(f64::NAN);
        }
    }

    #[test]
    fn systems_of_all_sizes_with_any_part_symmetric_are_solved() {
        let mut dense = Dense::default();
        for m in 1..40 {
            for symmetric in [0, 1, m / 3, m / 2, m - 1, m] {
                let symmetric = symmetric.min(m);
                let rows = system(m, symmetric, &mut Random::new(m as u64));
                let mut y = vec![0.0; m];
                put(&mut dense, m, &rows, symmetric);
                assert!(dense.solve((m, symmetric), &mut y));
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
        let mut solve = |rows: [f64; 6], symmetric: usize| {
            put(&mut dense, 2, &rows, symmetric);
            dense.solve((2, symmetric), &mut y).then_some(y)
        };
        assert_eq!(solve([1e-20, 1.0, 1.0, 1.0, 1.0, 3.0], 0), Some([2.0, 1.0]));
        assert_eq!(solve([1.0, 1.0, 1.0, 1.0, 1.0, 3.0], 0), None);
        assert_eq!(solve([1.0, 2.0, 1.0, 2.0, 1.0, 3.0], 2), None);
    }
}
