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

use crate::block_ldlt::NOISE;
use crate::kernels::Scalar;
use crate::{BlockPattern, SymBlockMatrix};
use taut_lanes::vector::gather;
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

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
    /// Whether these are one after the other.
    neighbours: bool,
}

/// Where four blocks come from.
#[derive(Debug, Clone, Copy, Default)]
struct Source {
    /// First value of each stored block, its rows and columns; none where the row has no such block.
    blocks: [Option<(usize, [usize; 2])>; ROWS],
    /// Whether they are the transposes of these.
    transposed: [bool; ROWS],
    /// Whether all that are there are of full size, and none or all of them transposed.
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
    /// more than six rows or the padding would be most of what is stored. Allocates all that is needed.
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
                rows[i].push((j, (stored, false)));
                if i != j {
                    rows[j].push((i, (stored, true)));
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

    /// The entries of the slice from block row `first` on, of the blocks of its rows.
    fn add_slice(&mut self, first: usize, rows: &mut [Vec<(usize, Stored)>], blocks: usize) {
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
                if let Some(k) = row.iter().position(|(column, _)| distance(l, *column) == d) {
                    source.take(l, row.swap_remove(k).1);
                }
            }
            self.add_entry([from, from + 1, from + 2, from + 3], true, source);
        }
        while rows.iter().any(|row| !row.is_empty()) {
            let mut columns: [usize; ROWS] = std::array::from_fn(own);
            let mut source = Source::default();
            for (l, row) in rows.iter_mut().enumerate() {
                if let Some((column, stored)) = row.pop() {
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

    /// Whether the block rows from 4 s on are there, all of full size, and their first rows.
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

/// A block of zeros.
static ZEROS: [f64; LARGEST * LARGEST] = [0.0; LARGEST * LARGEST];

/// Copies a matrix.
struct Fill<'a, const B: usize> {
    slices: &'a mut Slices,
    matrix: &'a [f64],
}

impl<const B: usize> Kernel for Fill<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self { slices, matrix } = self;
        let blocks = slices.values.chunks_exact_mut(ROWS * B * B);
        for (source, to) in slices.sources.iter().zip(blocks) {
            let Some(blocks) = source.full_blocks::<B>(matrix) else {
                source.copy::<B>(matrix, to);
                continue;
            };
            let transposed = source.transposed_at_all();
            let to = &mut to[..ROWS * B * B];
            let [first, second, third, fourth] = blocks;
            let columns = first.iter().zip(second).zip(third.iter().zip(fourth));
            for (c, ((first, second), (third, fourth))) in columns.enumerate() {
                let column: [I::X4; B] = gather([first, second, third, fourth]);
                for (r, entry) in column.iter().enumerate() {
                    let place = if transposed { r * B + c } else { c * B + r };
                    entry.store(&mut to[ROWS * place..ROWS * (place + 1)]);
                }
            }
        }
        // Of the diagonal the lower triangle counts.
        for &first in &slices.start[..slices.start.len() - 1] {
            let to = &mut slices.values[ROWS * B * B * first..][..ROWS * B * B];
            for c in 0..B {
                for r in c + 1..B {
                    let (below, above) = (ROWS * (c * B + r), ROWS * (r * B + c));
                    let entry = I::X4::load(&to[below..below + ROWS]);
                    entry.store(&mut to[above..above + ROWS]);
                }
            }
        }
    }
}

impl Source {
    /// Its blocks by columns, where all are of full size.
    #[inline(always)]
    fn full_blocks<'a, const B: usize>(
        &self,
        matrix: &'a [f64],
    ) -> Option<[&'a [[f64; B]; B]; ROWS]> {
        if !self.full {
            return None;
        }
        let zeros = ZEROS.as_chunks::<B>().0.first_chunk::<B>()?;
        let mut found = [zeros; ROWS];
        for (found, block) in found.iter_mut().zip(self.blocks) {
            if let Some((first, _)) = block {
                *found = matrix
                    .get(first..first + B * B)?
                    .as_chunks::<B>()
                    .0
                    .first_chunk()?;
            }
        }
        Some(found)
    }

    /// Copies its blocks, padded, one number after the other.
    fn copy<const B: usize>(&self, matrix: &[f64], to: &mut [f64]) {
        to.fill(0.0);
        for (lane, block) in self.blocks.into_iter().enumerate() {
            let Some((first, [rows, columns])) = block else {
                continue;
            };
            for c in 0..columns {
                for r in 0..rows {
                    let place = if self.transposed[lane] {
                        r * B + c
                    } else {
                        c * B + r
                    };
                    to[ROWS * place + lane] = matrix[first + r + rows * c];
                }
            }
        }
    }
}

/// Inverts the diagonal blocks.
struct Invert<'a, const B: usize> {
    slices: &'a mut Slices,
}

impl<const B: usize> Kernel for Invert<'_, B> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        let Slices {
            start,
            sources,
            values,
            inverse,
            ..
        } = self.slices;
        for (&first, to) in start.iter().zip(inverse.chunks_exact_mut(ROWS * B * B)) {
            let from = &values[ROWS * B * B * first..][..ROWS * B * B];
            let mut a = [[I::X4::splat(0.0); B]; B];
            for c in 0..B {
                for r in c..B {
                    a[r][c] = I::X4::load(&from[ROWS * (c * B + r)..][..ROWS]);
                }
            }
            if !sources[first].full || sources[first].blocks.contains(&None) {
                // What is padded has a pivot too.
                let sizes = sources[first]
                    .blocks
                    .map(|b| b.map_or(0, |(_, [rows, _])| rows));
                for (r, row) in a.iter_mut().enumerate() {
                    let mut one = [0.0; ROWS];
                    for (one, size) in one.iter_mut().zip(sizes) {
                        *one = f64::from(u8::from(r >= size));
                    }
                    row[r] = row[r] + I::X4::load(&one);
                }
            }
            let Some(inverse) = inverted(&a) else {
                return false;
            };
            for c in 0..B {
                for r in c..B {
                    inverse[r][c].store(&mut to[ROWS * (c * B + r)..][..ROWS]);
                    inverse[r][c].store(&mut to[ROWS * (r * B + c)..][..ROWS]);
                }
            }
        }
        true
    }
}

/// The lower triangle of the inverse of the positive definite matrix of which `a` is the lower triangle, by LDLᵀ; `None`
/// where a pivot is not positive or noise.
#[inline(always)]
pub(crate) fn inverted<V: Lanes, const B: usize>(a: &[[V; B]; B]) -> Option<[[V; B]; B]> {
    let zero = V::splat(0.0);
    let noise = V::splat(NOISE * f64::ROUNDOFF);
    // L below the diagonal, 1/D on it.
    let mut l = [[zero; B]; B];
    for i in 0..B {
        let mut y = a[i];
        let mut d = a[i][i];
        for j in 0..i {
            for k in 0..j {
                y[j] = y[k].neg_mul_add(l[j][k], y[j]);
            }
            l[i][j] = y[j] * l[j][j];
            d = y[j].neg_mul_add(l[i][j], d);
        }
        let scale = a[i][i].abs().max((a[i][i] - d).abs());
        if !(noise * scale).all_below(d) {
            return None;
        }
        l[i][i] = V::splat(1.0) / d;
    }
    // L⁻¹, whose diagonal is 1.
    let mut m = [[zero; B]; B];
    for i in 0..B {
        for j in 0..i {
            let mut sum = -l[i][j];
            for k in j + 1..i {
                sum = l[i][k].neg_mul_add(m[k][j], sum);
            }
            m[i][j] = sum;
        }
    }
    let mut inverse = [[zero; B]; B];
    for c in 0..B {
        for r in c..B {
            let mut sum = if r == c { l[r][r] } else { l[r][r] * m[r][c] };
            for k in r + 1..B {
                sum = (m[k][r] * l[k][k]).mul_add(m[k][c], sum);
            }
            inverse[r][c] = sum;
        }
    }
    Some(inverse)
}

/// Products with the matrix, or with the inverse of its diagonal blocks.
struct Product<'a, const B: usize> {
    slices: &'a Slices,
    inverse: bool,
    x: &'a [f64],
    y: &'a mut [f64],
}

/// The rows of a vector.
#[inline(always)]
fn rows<const B: usize>(x: &[f64], stride: usize) -> [&[f64]; B] {
    let mut rest = x;
    let mut rows = [x; B];
    for row in &mut rows {
        (*row, rest) = rest.split_at(stride);
    }
    rows
}

/// Those to be written.
#[inline(always)]
fn rows_mut<const B: usize>(x: &mut [f64], stride: usize) -> [&mut [f64]; B] {
    let mut rest = x;
    std::array::from_fn(|_| {
        let (row, others) = std::mem::take(&mut rest).split_at_mut(stride);
        rest = others;
        row
    })
}

impl<const B: usize> Kernel for Product<'_, B> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Isa>(self) -> f64 {
        let stride = self.slices.stride;
        let (x, y) = (rows::<B>(self.x, stride), rows_mut::<B>(self.y, stride));
        let Slices {
            start,
            entries,
            values,
            inverse,
            ..
        } = self.slices;
        let mut dot = I::X4::splat(0.0);
        for s in 0..start.len() - 1 {
            let place = ROWS * s + 1;
            let mut sums = [I::X4::splat(0.0); B];
            let mut own = [I::X4::splat(0.0); B];
            for c in 0..B {
                own[c] = I::X4::load(&x[c][place..place + ROWS]);
            }
            let blocks = if self.inverse {
                &inverse[ROWS * B * B * s..][..ROWS * B * B]
            } else {
                &values[ROWS * B * B * start[s]..ROWS * B * B * start[s + 1]]
            };
            let mut blocks = blocks.chunks_exact(ROWS * B * B);
            if let Some(diagonal) = blocks.next() {
                add_product(diagonal, &own, &mut sums);
            }
            for (entry, block) in entries[start[s]..start[s + 1]].iter().skip(1).zip(blocks) {
                let mut other = own;
                if entry.neighbours {
                    let from = entry.columns[0];
                    for c in 0..B {
                        other[c] = I::X4::load(&x[c][from..from + ROWS]);
                    }
                } else {
                    for c in 0..B {
                        other[c] = I::X4::from_fn(|l| x[c][entry.columns[l]]);
                    }
                }
                add_product(block, &other, &mut sums);
            }
            for r in 0..B {
                sums[r].store(&mut y[r][place..place + ROWS]);
                dot = sums[r].mul_add(own[r], dot);
            }
        }
        sum::<I::X4>(dot)
    }
}

/// y += A x.
#[inline(always)]
fn add_product<V: Lanes, const B: usize>(a: &[f64], x: &[V; B], y: &mut [V; B]) {
    let a = &a[..ROWS * B * B];
    for c in 0..B {
        for r in 0..B {
            y[r] = V::load(&a[ROWS * (c * B + r)..][..ROWS]).mul_add(x[c], y[r]);
        }
    }
}

/// The sum of all lanes.
#[inline(always)]
fn sum<V: Lanes>(v: V) -> f64 {
    let mut lanes = [0.0; ROWS];
    v.store(&mut lanes);
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

struct Load<'a, const B: usize> {
    slices: &'a Slices,
    from: &'a [f64],
    to: &'a mut [f64],
}

impl<const B: usize> Kernel for Load<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self { slices, from, to } = self;
        let to = rows_mut::<B>(to, slices.stride);
        for s in 0..slices.start.len() - 1 {
            let place = ROWS * s + 1;
            if let Some(rows) = slices.rows_of_slice(s) {
                let nothing = [0.0; B];
                let block: [I::X4; B] = gather([
                    from[rows[0]..].first_chunk().unwrap_or(&nothing),
                    from[rows[1]..].first_chunk().unwrap_or(&nothing),
                    from[rows[2]..].first_chunk().unwrap_or(&nothing),
                    from[rows[3]..].first_chunk().unwrap_or(&nothing),
                ]);
                for r in 0..B {
                    block[r].store(&mut to[r][place..place + ROWS]);
                }
                continue;
            }
            for (l, rows) in slices.row[ROWS * s..].windows(2).take(ROWS).enumerate() {
                for (r, from) in from[rows[0]..rows[1]].iter().enumerate() {
                    to[r][place + l] = *from;
                }
            }
        }
    }
}

struct Save<'a, const B: usize> {
    slices: &'a Slices,
    from: &'a [f64],
    to: &'a mut [f64],
}

impl<const B: usize> Kernel for Save<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self { slices, from, to } = self;
        let from = rows::<B>(from, slices.stride);
        for s in 0..slices.start.len() - 1 {
            let place = ROWS * s + 1;
            if let Some(rows) = slices.rows_of_slice(s) {
                let mut block = [I::X4::splat(0.0); B];
                for r in 0..B {
                    block[r] = I::X4::load(&from[r][place..place + ROWS]);
                }
                I::X4::scatter(&block, to, rows);
                continue;
            }
            for (l, rows) in slices.row[ROWS * s..].windows(2).take(ROWS).enumerate() {
                for (r, to) in to[rows[0]..rows[1]].iter_mut().enumerate() {
                    *to = from[r][place + l];
                }
            }
        }
    }
}

/// x += s p and r −= s q; returns r·r.
pub(crate) fn step(s: f64, [p, q]: [&[f64]; 2], [x, r]: [&mut [f64]; 2]) -> f64 {
    dispatch(Level::best(), Step { s, p, q, x, r })
}

/// p = z + s p.
pub(crate) fn turn(s: f64, z: &[f64], p: &mut [f64]) {
    dispatch(Level::best(), Turn { s, z, p });
}

/// a·b.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    dispatch(Level::best(), Dot(a, b))
}

struct Step<'a> {
    s: f64,
    p: &'a [f64],
    q: &'a [f64],
    x: &'a mut [f64],
    r: &'a mut [f64],
}

impl Kernel for Step<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Isa>(self) -> f64 {
        let (p, p_rest) = self.p.as_chunks::<ROWS>();
        let (q, q_rest) = self.q.as_chunks::<ROWS>();
        let (x, x_rest) = self.x.as_chunks_mut::<ROWS>();
        let (r, r_rest) = self.r.as_chunks_mut::<ROWS>();
        let s = I::X4::splat(self.s);
        let mut norm = I::X4::splat(0.0);
        for (((p, q), x), r) in p.iter().zip(q).zip(x).zip(r) {
            s.mul_add(I::X4::load(p), I::X4::load(x)).store(x);
            let residual = s.neg_mul_add(I::X4::load(q), I::X4::load(r));
            residual.store(r);
            norm = residual.mul_add(residual, norm);
        }
        let mut norm = sum::<I::X4>(norm);
        for (((p, q), x), r) in p_rest.iter().zip(q_rest).zip(x_rest).zip(r_rest) {
            *x += self.s * p;
            *r -= self.s * q;
            norm += *r * *r;
        }
        norm
    }
}

struct Turn<'a> {
    s: f64,
    z: &'a [f64],
    p: &'a mut [f64],
}

impl Kernel for Turn<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let (z, z_rest) = self.z.as_chunks::<ROWS>();
        let (p, p_rest) = self.p.as_chunks_mut::<ROWS>();
        let s = I::X4::splat(self.s);
        for (z, p) in z.iter().zip(p) {
            s.mul_add(I::X4::load(p), I::X4::load(z)).store(p);
        }
        for (z, p) in z_rest.iter().zip(p_rest) {
            *p = z + self.s * *p;
        }
    }
}

struct Dot<'a>(&'a [f64], &'a [f64]);

impl Kernel for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Isa>(self) -> f64 {
        let ((a, a_rest), (b, b_rest)) = (self.0.as_chunks::<8>(), self.1.as_chunks::<8>());
        let mut sums = [I::X4::splat(0.0); 2];
        for (a, b) in a.iter().zip(b) {
            sums[0] = I::X4::load(&a[..4]).mul_add(I::X4::load(&b[..4]), sums[0]);
            sums[1] = I::X4::load(&a[4..]).mul_add(I::X4::load(&b[4..]), sums[1]);
        }
        let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
        sum::<I::X4>(sums[0] + sums[1]) + rest
    }
}
