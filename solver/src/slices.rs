//! Matrices of small blocks for products in the lanes of vectors: four block rows side by side, which conjugate gradient
//! works on from the first product to the last.
//!
//! Block rows 4 s … 4 s + 3 are *slice* s (the sliced ELLPACK layout of Kreutzer et al., *A Unified Sparse Matrix Data
//! Format for Efficient General SpMV on Modern Processors with Wide SIMD Units*, 2014, with blocks for entries). All
//! blocks are padded to B×B, B the largest of them. An entry of a slice is one block of each row of it: those at the
//! same distance from the diagonal together, whose columns are then one after the other, and what is left over as it
//! comes; where a row has none it is zero. A chain's slice has three entries.
//!
//! Vectors are stored row by row of the blocks: number r of block i stands at r·stride + 1 + i, so that four
//! neighbouring blocks fill a vector. What comes before the first block and after the last is zero. Both triangles are
//! stored: each number is then read once, in order, and no product is added to another row's.
//!
//! Products with the matrix itself, lower triangle and block by block, take more: on nets of 8×8 and 16×16 nodes a
//! factorisation and solve by `cg:group` has 1.4 times the instructions without slices, by `cg:jacobi` 5 to 6 times,
//! and by `gauss-seidel:joints`, whose diagonal blocks are inverted here, 2.5 times (AVX2).

mod kernels;
#[cfg(test)]
mod tests;
mod vectors;

use crate::{BlockPattern, SymBlockMatrix};
use kernels::{Fill, Invert, Load, Product, Save};
use taut_lanes::{Level, dispatch};
#[allow(unused_imports)] // where no backend that uses it is compiled in
pub(crate) use vectors::{dot, step, turn};

/// Block rows of a slice.
const ROWS: usize = 4;

/// Largest blocks.
const LARGEST: usize = 6;

/// How many times what the matrix has may be stored; both its triangles and no padding are 2.
const MOST: usize = 6;

/// A matrix by slices.
#[derive(Debug, Clone)]
pub(crate) struct Slices {
    level: Level,
    /// Rows and columns B of each block.
    size: usize,
    /// First scalar row of each block row, and the dimension at the end.
    row: Vec<usize>,
    /// Numbers between two rows of the blocks.
    stride: usize,
    /// First entry of each slice, and their number at the end. The first is the diagonal.
    start: Vec<usize>,
    entries: Vec<Entry>,
    /// Where each entry's blocks come from.
    sources: Vec<Source>,
    /// Blocks of the entries, column-major, four numbers abreast.
    values: Vec<f64>,
    /// Inverses of the diagonal blocks, slice after slice.
    inverse: Vec<f64>,
}

/// Four blocks of a slice.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// Place of each block column in a row of a vector.
    columns: [usize; ROWS],
    /// True if these are one after the other.
    neighbours: bool,
}

/// Where four blocks come from.
#[derive(Debug, Clone, Copy, Default)]
struct Source {
    /// First value of each stored block, its rows and columns; none where the row has no such block.
    blocks: [Option<(usize, [usize; 2])>; ROWS],
    /// True where the transpose of the stored block is meant.
    transposed: [bool; ROWS],
    /// True if all present blocks have the full size and one orientation.
    full: bool,
}

/// Runs a kernel of the constant block size.
macro_rules! with_size {
    ($slices:expr, $kernel:ident { $($field:ident: $value:expr),* $(,)? }) => {
        match $slices.size {
            3 => dispatch($slices.level, $kernel::<3> { slices: $slices, $($field: $value),* }),
            5 => dispatch($slices.level, $kernel::<5> { slices: $slices, $($field: $value),* }),
            _ => dispatch($slices.level, $kernel::<6> { slices: $slices, $($field: $value),* }),
        }
    };
}

impl Slices {
    /// For those blocks of matrices of `pattern` that `keep(row, column)` accepts, the diagonal among them, unless one has
    /// more than six rows or padding would fill more than half of the storage. Allocates everything.
    pub(crate) fn new(pattern: &BlockPattern, keep: impl Fn(usize, usize) -> bool) -> Option<Self> {
        let blocks = pattern.blocks();
        let size = match (0..blocks).map(|i| pattern.size(i)).max()? {
            0..=3 => 3,
            4..=5 => 5,
            LARGEST => LARGEST,
            _ => return None,
        };
        // Column and source of all blocks of each row, both triangles.
        let mut rows = vec![Vec::new(); blocks.next_multiple_of(ROWS)];
        for j in 0..blocks {
            for k in pattern.column(j) {
                let i = pattern.row(k);
                if !keep(i, j) {
                    continue;
                }
                let stored = (pattern.values(k).start, [pattern.size(i), pattern.size(j)]);
                rows[i].push((j, Some((stored, false))));
                if i != j {
                    rows[j].push((i, Some((stored, true))));
                }
            }
        }
        let mut slices = Self {
            level: Level::best(),
            size,
            row: (0..blocks).map(|i| pattern.rows(i).start).collect(),
            stride: (rows.len() + 2).next_multiple_of(ROWS),
            start: vec![0],
            entries: Vec::new(),
            sources: Vec::new(),
            values: Vec::new(),
            inverse: Vec::new(),
        };
        slices.row.push(pattern.dim());
        for (s, rows) in rows.chunks_exact_mut(ROWS).enumerate() {
            slices.add_slice(ROWS * s, rows, blocks);
        }
        let block = size * size * ROWS;
        let values = block * slices.entries.len();
        if values > MOST * pattern.stored_values() + 3 * block {
            return None;
        }
        slices.values = vec![0.0; values];
        slices.inverse = vec![0.0; block * (slices.start.len() - 1)];
        Some(slices)
    }

    /// The entries of the slice from block row `first` on, of the blocks of its rows, ascending in each.
    fn add_slice(
        &mut self,
        first: usize,
        rows: &mut [Vec<(usize, Option<Stored>)>],
        blocks: usize,
    ) {
        let distance = |l: usize, column: usize| column.cast_signed() - (first + l).cast_signed();
        let mut distances: Vec<isize> = (rows.iter().enumerate())
            .flat_map(|(l, row)| row.iter().map(move |(column, _)| distance(l, *column)))
            .collect();
        distances.sort_unstable_by_key(|d| (d.abs(), *d));
        let own = |l: usize| (first + l).min(blocks.saturating_sub(1)) + 1;
        for shared in distances.chunk_by(|a, b| a == b) {
            let d = shared[0];
            // The column before the first and those after the last of the vectors are zeros.
            let from = (first + 1).cast_signed() + d;
            let fits =
                (0..self.stride - ROWS + 1).contains(&usize::try_from(from).unwrap_or(usize::MAX));
            if !fits || (shared.len() < 2 && d != 0) {
                continue;
            }
            let from = from.unsigned_abs();
            let mut source = Source::default();
            for (l, row) in rows.iter_mut().enumerate() {
                let there = row.binary_search_by_key(&d, |(column, _)| distance(l, *column));
                if let Some(stored) = there.ok().and_then(|k| row[k].1.take()) {
                    source.take(l, stored);
                }
            }
            self.add_entry([from, from + 1, from + 2, from + 3], true, source);
        }
        rows.iter_mut()
            .for_each(|row| row.retain(|(_, stored)| stored.is_some()));
        while rows.iter().any(|row| !row.is_empty()) {
            let mut columns: [usize; ROWS] = std::array::from_fn(own);
            let mut source = Source::default();
            for (l, row) in rows.iter_mut().enumerate() {
                if let Some((column, Some(stored))) = row.pop() {
                    columns[l] = column + 1;
                    source.take(l, stored);
                }
            }
            self.add_entry(columns, false, source);
        }
        self.start.push(self.entries.len());
    }

    fn add_entry(&mut self, columns: [usize; ROWS], neighbours: bool, mut source: Source) {
        let full = [self.size; 2];
        let there =
            || (source.blocks.iter().zip(source.transposed)).filter_map(|(b, t)| Some(((*b)?, t)));
        source.full = there().all(|((_, size), t)| size == full && t == source.transposed_at_all());
        self.entries.push(Entry {
            columns,
            neighbours,
        });
        self.sources.push(source);
    }

    /// Length of a vector.
    pub(crate) fn len(&self) -> usize {
        self.size * self.stride
    }

    /// Copies the matrix, which has the pattern of [`new`](Self::new). Allocates nothing.
    pub(crate) fn fill(&mut self, a: &SymBlockMatrix) {
        let matrix = a.values();
        with_size!(&mut *self, Fill { matrix: matrix });
    }

    /// Inverts the diagonal blocks; whether all their pivots are positive and more than noise. Allocates nothing.
    pub(crate) fn invert_diagonal(&mut self) -> bool {
        with_size!(&mut *self, Invert {})
    }

    /// Rows and columns of each block, with its padding.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Length of what [`inverses`](Self::inverses) writes.
    pub(crate) fn inverses_len(&self) -> usize {
        self.inverse.len()
    }

    /// The inverses of the diagonal blocks, one after the other, and what pads the last slice.
    pub(crate) fn inverses(&self, to: &mut [f64]) {
        let square = self.size * self.size;
        for (from, to) in
            (self.inverse.chunks_exact(ROWS * square)).zip(to.chunks_exact_mut(ROWS * square))
        {
            for (l, to) in to.chunks_exact_mut(square).enumerate() {
                for (k, to) in to.iter_mut().enumerate() {
                    *to = from[ROWS * k + l];
                }
            }
        }
    }

    /// y = A x; returns x·y.
    pub(crate) fn product(&self, x: &[f64], y: &mut [f64]) -> f64 {
        with_size!(
            self,
            Product {
                inverse: false,
                x: x,
                y: y
            }
        )
    }

    /// y = D⁻¹ x with the diagonal blocks D; returns x·y.
    pub(crate) fn precondition(&self, x: &[f64], y: &mut [f64]) -> f64 {
        with_size!(
            self,
            Product {
                inverse: true,
                x: x,
                y: y
            }
        )
    }

    /// A vector of `dim` numbers in the order of the slices.
    pub(crate) fn load(&self, from: &[f64], to: &mut [f64]) {
        with_size!(self, Load { from: from, to: to });
    }

    /// The reverse of [`load`](Self::load).
    pub(crate) fn save(&self, from: &[f64], to: &mut [f64]) {
        with_size!(self, Save { from: from, to: to });
    }

    /// First scalar rows of block rows 4 s … 4 s + 3; `None` unless all four exist in full size.
    fn rows_of_slice(&self, s: usize) -> Option<[usize; ROWS]> {
        let rows: &[usize; ROWS + 1] = self.row.get(ROWS * s..=ROWS * (s + 1))?.try_into().ok()?;
        let full = rows.windows(2).all(|pair| pair[1] - pair[0] == self.size);
        full.then_some([rows[0], rows[1], rows[2], rows[3]])
    }
}

/// First value, rows and columns of a stored block, and whether its transpose is meant.
type Stored = ((usize, [usize; 2]), bool);

impl Source {
    fn take(&mut self, lane: usize, (block, transposed): Stored) {
        self.blocks[lane] = Some(block);
        self.transposed[lane] = transposed;
    }

    fn transposed_at_all(&self) -> bool {
        self.transposed.contains(&true)
    }
}
