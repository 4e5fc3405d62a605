//! Operations on slices, four block rows at a time: copies, inverses, products.

use super::{LARGEST, ROWS, Slices, Source};
use crate::block_ldlt::NOISE;
use crate::kernels::Scalar;
use taut_lanes::vector::gather;
use taut_lanes::{Isa, Kernel, Lanes};

/// A block of zeros.
static ZEROS: [f64; LARGEST * LARGEST] = [0.0; LARGEST * LARGEST];

/// Copies a matrix.
pub(super) struct Fill<'a, const B: usize> {
    pub(super) slices: &'a mut Slices,
    pub(super) matrix: &'a [f64],
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
        // The lower triangle defines a diagonal block: copy it to the upper one.
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
pub(super) struct Invert<'a, const B: usize> {
    pub(super) slices: &'a mut Slices,
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
                // Padded rows get 1 on the diagonal: they need a pivot.
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
fn inverted<V: Lanes, const B: usize>(a: &[[V; B]; B]) -> Option<[[V; B]; B]> {
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
pub(super) struct Product<'a, const B: usize> {
    pub(super) slices: &'a Slices,
    pub(super) inverse: bool,
    pub(super) x: &'a [f64],
    pub(super) y: &'a mut [f64],
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

/// The rows of a vector, mutable.
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
pub(super) fn sum<V: Lanes>(v: V) -> f64 {
    let mut lanes = [0.0; ROWS];
    v.store(&mut lanes);
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

pub(super) struct Load<'a, const B: usize> {
    pub(super) slices: &'a Slices,
    pub(super) from: &'a [f64],
    pub(super) to: &'a mut [f64],
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

pub(super) struct Save<'a, const B: usize> {
    pub(super) slices: &'a Slices,
    pub(super) from: &'a [f64],
    pub(super) to: &'a mut [f64],
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
