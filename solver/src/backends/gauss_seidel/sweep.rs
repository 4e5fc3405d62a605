//! The sweep over block rows that are stored row by row, both triangles, each number read once and in order.
//!
//! A column of a block of 3, 5 or 6 rows is two vectors, of 2 + 1, 4 + 1 and 4 + 2 doubles; blocks of other sizes are
//! worked on number by number. What a row waits for is the block changed last: its product comes last, and every second
//! column is summed apart, so that the chain of additions is short.

use crate::kernels::{Bound, OneByOne, by_size, by_sizes, subtract_product};
use crate::{BlockPattern, SymBlockMatrix};
use std::ops::Range;
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// A symmetric matrix by block rows.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    level: Level,
    /// Size of most blocks: 3, 5 or 6.
    size: usize,
    /// First scalar row of each block row, and the dimension at the end.
    row: Vec<usize>,
    /// First entry of each block row, and their number at the end.
    start: Vec<usize>,
    entries: Vec<Entry>,
    /// Values of the entries, column-major.
    values: Vec<f64>,
}

/// A block of a block row.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// Block column.
    column: usize,
    /// Stored block that it is, or is the transpose of.
    stored: usize,
    /// First value in [`Rows::values`].
    at: usize,
    /// First scalar column, and their number.
    first: usize,
    columns: usize,
}

/// Inverses of diagonal blocks, column-major, each padded to `size` rows and columns.
pub(super) struct Inverses<'a> {
    pub(super) size: usize,
    pub(super) values: &'a [f64],
}

impl Inverses<'_> {
    fn of(&self, i: usize) -> &[f64] {
        &self.values[self.size * self.size * i..][..self.size * self.size]
    }
}

impl Rows {
    /// For matrices of `pattern`. Allocates all that is needed.
    pub(super) fn new(pattern: &BlockPattern) -> Self {
        let blocks = pattern.blocks();
        let mut rows: Vec<Vec<(usize, usize)>> = vec![Vec::new(); blocks];
        for j in 0..blocks {
            for k in pattern.column(j) {
                let i = pattern.row(k);
                rows[i].push((j, k));
                if i != j {
                    rows[j].push((i, k));
                }
            }
        }
        let (mut start, mut entries, mut at) = (vec![0], Vec::new(), 0);
        for (i, row) in rows.iter_mut().enumerate() {
            // Sweeps go up: the largest column before i is the one that was changed last.
            row.sort_unstable_by_key(|&(column, _)| (column < i, column));
            for &mut (column, stored) in row {
                let columns = pattern.size(column);
                entries.push(Entry {
                    column,
                    stored,
                    at,
                    first: pattern.rows(column).start,
                    columns,
                });
                at += pattern.size(i) * columns;
            }
            start.push(entries.len());
        }
        let of_size = |n: &usize| (0..blocks).filter(|&i| pattern.size(i) == *n).count();
        Self {
            level: Level::best(),
            size: [3, 5, 6].into_iter().max_by_key(of_size).unwrap_or(6),
            row: (0..blocks)
                .map(|i| pattern.rows(i).start)
                .chain([pattern.dim()])
                .collect(),
            start,
            entries,
            values: vec![0.0; at],
        }
    }

    /// Scalar rows of block row `i`.
    pub(super) fn of(&self, i: usize) -> Range<usize> {
        self.row[i]..self.row[i + 1]
    }

    /// Copies the matrix.
    pub(super) fn gather(&mut self, a: &SymBlockMatrix) {
        for i in 0..self.row.len() - 1 {
            let m = self.row[i + 1] - self.row[i];
            for entry in &self.entries[self.start[i]..self.start[i + 1]] {
                let (n, block) = (entry.columns, a.block(entry.stored));
                let to = &mut self.values[entry.at..entry.at + m * n];
                match entry.column.cmp(&i) {
                    std::cmp::Ordering::Less => to.copy_from_slice(block),
                    std::cmp::Ordering::Equal => by_size!(m, |m| mirrored(m, block, to)),
                    std::cmp::Ordering::Greater => {
                        by_sizes!(m, n, |m, n| transposed(m, n, block, to));
                    }
                }
            }
        }
    }

    /// b − A x in the rows of some block rows; the sum of squares.
    pub(super) fn residual(&self, blocks: &[usize], b: &[f64], x: &[f64], r: &mut [f64]) -> f64 {
        let kernel = Residual {
            rows: self,
            blocks,
            b,
            x,
            r,
        };
        dispatch(self.level, kernel)
    }

    /// One pass over all blocks in their order; the sum of squares of the residuals met.
    pub(super) fn sweep(&self, inverses: &Inverses<'_>, b: &[f64], x: &mut [f64]) -> f64 {
        let kernel = Sweep {
            rows: self,
            inverses,
            b,
            x,
        };
        dispatch(self.level, kernel)
    }

    /// x_i = A_ii⁻¹ b_i.
    pub(super) fn solve_blocks(&self, inverses: &Inverses<'_>, b: &[f64], x: &mut [f64]) {
        x.fill(0.0);
        for i in 0..self.row.len() - 1 {
            add_product(
                inverses.size,
                inverses.of(i),
                &b[self.of(i)],
                &mut x[self.of(i)],
            );
        }
    }

    /// b − A x in the rows of block row `i`, number by number.
    fn residual_of(&self, i: usize, b: &[f64], x: &[f64], r: &mut [f64]) {
        let m = r.len();
        r.copy_from_slice(&b[self.of(i)]);
        for entry in &self.entries[self.start[i]..self.start[i + 1]] {
            let n = entry.columns;
            let block = &self.values[entry.at..entry.at + m * n];
            let x = &x[entry.first..entry.first + n];
            subtract_product::<OneByOne, _, _, _>(m, n, block, x, r);
        }
    }
}

/// A full block from its lower triangle.
#[inline(always)]
fn mirrored(n: impl Bound, block: &[f64], to: &mut [f64]) {
    let n = n.get();
    let (block, to) = (&block[..n * n], &mut to[..n * n]);
    for c in 0..n {
        for r in c..n {
            let entry = block[r + n * c];
            (to[r + n * c], to[c + n * r]) = (entry, entry);
        }
    }
}

/// The m×n transpose of a block.
#[inline(always)]
fn transposed(m: impl Bound, n: impl Bound, block: &[f64], to: &mut [f64]) {
    let (m, n) = (m.get(), n.get());
    let (block, to) = (&block[..m * n], &mut to[..m * n]);
    for r in 0..m {
        for c in 0..n {
            to[r + m * c] = block[c + n * r];
        }
    }
}

/// y += A x for the corner of a square block of `size` rows.
fn add_product(size: usize, a: &[f64], x: &[f64], y: &mut [f64]) {
    for (column, x) in a.chunks_exact(size).zip(x) {
        for (y, a) in y.iter_mut().zip(column) {
            *y += a * x;
        }
    }
}

/// The rows of a block as two vectors.
#[derive(Clone, Copy)]
struct Column<V, W>(V, W);

impl<V: Lanes, W: Lanes> Column<V, W> {
    #[inline(always)]
    fn zero() -> Self {
        Self(V::splat(0.0), W::splat(0.0))
    }

    #[inline(always)]
    fn load<const B: usize>(from: &[f64; B]) -> Self {
        Self(V::load(from), W::load(&from[V::LANES..]))
    }

    #[inline(always)]
    fn store<const B: usize>(self, to: &mut [f64; B]) {
        self.0.store(to);
        self.1.store(&mut to[V::LANES..]);
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }

    /// self − a x.
    #[inline(always)]
    fn subtract<const B: usize>(self, a: &[f64; B], x: f64) -> Self {
        let a = Self::load(a);
        Self(
            a.0.neg_mul_add(V::splat(x), self.0),
            a.1.neg_mul_add(W::splat(x), self.1),
        )
    }

    /// self + other².
    #[inline(always)]
    fn add_square(self, other: Self) -> Self {
        Self(
            other.0.mul_add(other.0, self.0),
            other.1.mul_add(other.1, self.1),
        )
    }

    /// The sum of all lanes.
    #[inline(always)]
    fn sum<const B: usize>(self) -> f64 {
        let mut lanes = [0.0; B];
        self.store(&mut lanes);
        lanes.iter().sum()
    }
}

/// Takes A x away from the sum of both, every second column from the second.
#[inline(always)]
fn subtract_columns<V: Lanes, W: Lanes, const B: usize>(
    sums: &mut [Column<V, W>; 2],
    a: &[[f64; B]],
    x: &[f64],
) {
    let ((pairs, last), (xs, x_last)) = (a.as_chunks::<2>(), x.as_chunks::<2>());
    for (a, x) in pairs.iter().zip(xs) {
        sums[0] = sums[0].subtract(&a[0], x[0]);
        sums[1] = sums[1].subtract(&a[1], x[1]);
    }
    for (a, x) in last.iter().zip(x_last) {
        sums[0] = sums[0].subtract(a, *x);
    }
}

/// b − A x in block row `i` of B rows; `None` where it has others.
#[inline(always)]
fn residual<V: Lanes, W: Lanes, const B: usize>(
    rows: &Rows,
    i: usize,
    b: &[f64],
    x: &[f64],
) -> Option<Column<V, W>> {
    let mut sums = [Column::load(block_rows::<B>(rows, i, b)?), Column::zero()];
    for entry in &rows.entries[rows.start[i]..rows.start[i + 1]] {
        let block = &rows.values[entry.at..entry.at + B * entry.columns];
        let x = &x[entry.first..entry.first + entry.columns];
        let (columns, _) = block.as_chunks::<B>();
        match (columns.first_chunk::<B>(), x.first_chunk::<B>()) {
            // A constant number of columns, which the compiler unrolls.
            (Some(columns), Some(x)) if entry.columns == B => {
                subtract_columns(&mut sums, columns, x);
            }
            _ => subtract_columns(&mut sums, columns, x),
        }
    }
    Some(sums[0].plus(sums[1]))
}

/// The rows of block `i`, if there are B.
#[inline(always)]
fn block_rows<'a, const B: usize>(rows: &Rows, i: usize, v: &'a [f64]) -> Option<&'a [f64; B]> {
    v[rows.of(i)].try_into().ok()
}

struct Sweep<'a> {
    rows: &'a Rows,
    inverses: &'a Inverses<'a>,
    b: &'a [f64],
    x: &'a mut [f64],
}

impl Kernel for Sweep<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Isa>(self) -> f64 {
        match self.inverses.size {
            3 => self.of_size::<I::X2, I::X1, 3>(),
            5 => self.of_size::<I::X4, I::X1, 5>(),
            _ => self.of_size::<I::X4, I::X2, 6>(),
        }
    }
}

impl Sweep<'_> {
    #[inline(always)]
    fn of_size<V: Lanes, W: Lanes, const B: usize>(self) -> f64 {
        let Self {
            rows,
            inverses,
            b,
            x,
        } = self;
        let mut squares = Column::<V, W>::zero();
        let mut sum = 0.0;
        for i in 0..rows.row.len() - 1 {
            let inverse = inverses.of(i);
            let mut r = [0.0; B];
            if let Some(residual) = residual::<V, W, B>(rows, i, b, x)
                && let Some(inverse) = inverse.as_chunks::<B>().0.first_chunk::<B>()
                && let Ok(x) = <&mut [f64; B]>::try_from(&mut x[rows.of(i)])
            {
                squares = squares.add_square(residual);
                residual.store(&mut r);
                let mut sums = [Column::<V, W>::zero(); 2];
                subtract_columns(&mut sums, inverse, &r);
                Column::load(x).minus(sums[0].plus(sums[1])).store(x);
                continue;
            }
            let r = &mut r[..rows.of(i).len()];
            rows.residual_of(i, b, x, r);
            sum += r.iter().map(|r| r * r).sum::<f64>();
            add_product(B, inverse, r, &mut x[rows.of(i)]);
        }
        sum + squares.sum::<B>()
    }
}

struct Residual<'a> {
    rows: &'a Rows,
    blocks: &'a [usize],
    b: &'a [f64],
    x: &'a [f64],
    r: &'a mut [f64],
}

impl Kernel for Residual<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Isa>(self) -> f64 {
        match self.rows.size {
            3 => self.of_size::<I::X2, I::X1, 3>(),
            5 => self.of_size::<I::X4, I::X1, 5>(),
            _ => self.of_size::<I::X4, I::X2, 6>(),
        }
    }
}

impl Residual<'_> {
    #[inline(always)]
    fn of_size<V: Lanes, W: Lanes, const B: usize>(self) -> f64 {
        let Self {
            rows,
            blocks,
            b,
            x,
            r,
        } = self;
        let mut squares = Column::<V, W>::zero();
        let mut sum = 0.0;
        for &i in blocks {
            let r = &mut r[rows.of(i)];
            if let Some(residual) = residual::<V, W, B>(rows, i, b, x)
                && let Ok(r) = <&mut [f64; B]>::try_from(&mut *r)
            {
                squares = squares.add_square(residual);
                residual.store(r);
                continue;
            }
            rows.residual_of(i, b, x, r);
            sum += r.iter().map(|r| r * r).sum::<f64>();
        }
        sum + squares.sum::<B>()
    }
}
