//! Chains with a border: a few block rows that couple to any others, as the joint that closes a ring or a junction does.
//!
//! With the border last the matrix is [C F; Fᵀ G], C the chain. Its factor L D Lᵀ is that of the chain, and
//!
//! ```text
//! V = L⁻¹ F      S = G − Vᵀ D⁻¹ V
//! ```
//!
//! the forward pass for each column of the border and a small dense matrix. A solve is y = L⁻¹ b, the border's part
//! s = S⁻¹ (b − Vᵀ D⁻¹ y), and the backward pass of D⁻¹ (y − V s): block LDLᵀ in an order of the blocks, as stable as any.

use super::Chain;
use super::places::size_of_chain;
use crate::block_ldlt::{Pivots, factor_diagonal};
use crate::kernels::{OneByOne, Scalar, unit_lower_solve, unit_upper_solve};
use crate::singularity::WEAK;
use crate::{BlockPattern, SymBlockMatrix};
use std::ops::Range;
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// Most rows in the border, of the chain's largest block: each costs a forward pass, and more of them can cost more than
/// the general factorisation.
const MOST_ROWS: usize = 2;

/// Factor of a chain with a border.
#[derive(Debug, Clone)]
pub(crate) struct Bordered {
    chain: Chain,
    rows: Vec<BorderRow>,
    entries: Vec<Entries>,
    /// V and D⁻¹ V, by columns in the order of elimination.
    v: Vec<f64>,
    scaled: Vec<f64>,
    /// Factor of S, column-major, and 1/D.
    s: Vec<f64>,
    inverse: Vec<f64>,
    /// Largest magnitude that each diagonal entry of S was made from.
    scale: Vec<f64>,
    /// A column of F; the border's part of a solution.
    column: Vec<f64>,
    part: Vec<f64>,
}

/// A scalar row of the border.
#[derive(Debug, Clone)]
struct BorderRow {
    /// Its place in the matrix.
    row: usize,
    /// What the matrix stores of it.
    entries: Range<usize>,
}

impl Bordered {
    /// For some block rows and columns (ascending) of matrices of `pattern`, if they are a chain but for a border of few
    /// rows. Allocates all that is needed.
    pub(crate) fn of(blocks: &[usize], pattern: &BlockPattern, level: Level) -> Option<Self> {
        let (border, inside) = split(blocks, pattern)?;
        let chain = Chain::of(&inside, pattern, level)?;
        let (mut rows, mut all) = (Vec::new(), Vec::new());
        for block in border {
            for (r, row) in pattern.rows(block).enumerate() {
                let first = all.len();
                all.extend(entries(pattern, block, r));
                rows.push(BorderRow {
                    row,
                    entries: first..all.len(),
                });
            }
        }
        let count = rows.len();
        let len = chain.half.len();
        Some(Self {
            chain,
            rows,
            entries: all,
            v: vec![0.0; count * len],
            scaled: vec![0.0; count * len],
            s: vec![0.0; count * count],
            inverse: vec![0.0; count],
            scale: vec![0.0; count],
            column: vec![0.0; pattern.dim()],
            part: vec![0.0; count],
        })
    }

    #[cfg(test)]
    /// Scalar rows of the border.
    pub(crate) fn border_rows(&self) -> usize {
        self.rows.len()
    }

    /// Factorises `a`, of the pattern of [`of`](Self::of); whether all pivots are positive and beyond doubt, of what
    /// their rows were made from where these magnitudes are given, one for every row of the matrix. Allocates nothing.
    pub(crate) fn factorize(&mut self, a: &SymBlockMatrix, magnitudes: Option<&[f64]>) -> bool {
        let sound = |chain: &Chain| magnitudes.is_none_or(|m| chain.is_sound(m));
        if !self.chain.factorize(a, WEAK) || !sound(&self.chain) {
            return false;
        }
        let (len, count) = (self.chain.half.len(), self.rows.len());
        for (c, row) in self.rows.iter().enumerate() {
            let entries = &self.entries[row.entries.clone()];
            for e in entries {
                let values = a.values()[e.from..].iter().step_by(e.stride);
                for (to, from) in self.column[e.at..e.at + e.count].iter_mut().zip(values) {
                    *to = *from;
                }
            }
            let v = &mut self.v[c * len..(c + 1) * len];
            let scaled = &mut self.scaled[c * len..(c + 1) * len];
            self.chain.forward(&self.column, v, scaled);
            for (j, other) in self.rows[..=c].iter().enumerate() {
                let g = self.column[other.row];
                let taken = dot(
                    self.chain.level,
                    &self.v[j * len..][..len],
                    &self.scaled[c * len..][..len],
                );
                self.s[c + count * j] = g - taken;
                if j == c {
                    let made_from = magnitudes.map_or(0.0, |m| m[row.row]);
                    self.scale[c] = g.abs().max(taken.abs()).max(made_from);
                }
            }
            for e in entries {
                self.column[e.at..e.at + e.count].fill(0.0);
            }
        }
        let (s, inverse) = (&mut self.s, &mut self.inverse);
        factor_diagonal::<OneByOne, _, _>(count, s, inverse, &mut self.scale, Pivots::Positive)
            .is_ok()
            && (inverse.iter().zip(&self.scale))
                .all(|(d, from)| WEAK * f64::ROUNDOFF * from * d < 1.0)
    }

    /// Solves A x = b, of which the rows of the blocks are read and written. Allocates nothing.
    pub(crate) fn solve(&mut self, b: &[f64], x: &mut [f64]) {
        let (len, count) = (self.chain.half.len(), self.rows.len());
        let mut half = std::mem::take(&mut self.chain.half);
        self.chain.forward(b, &mut [], &mut half);
        for (c, row) in self.rows.iter().enumerate() {
            self.part[c] = b[row.row] - dot(self.chain.level, &self.v[c * len..][..len], &half);
        }
        unit_lower_solve(count, &self.s, &mut self.part);
        for (part, inverse) in self.part.iter_mut().zip(&self.inverse) {
            *part *= inverse;
        }
        unit_upper_solve(count, &self.s, &mut self.part);
        for (c, &part) in self.part.iter().enumerate() {
            subtract(
                self.chain.level,
                &mut half,
                part,
                &self.scaled[c * len..][..len],
            );
        }
        self.chain.backward(&half, x);
        for (row, &part) in self.rows.iter().zip(&self.part) {
            x[row.row] = part;
        }
        self.chain.half = half;
    }
}

/// The border and the other blocks, ascending; `None` where the border has too many rows.
fn split(blocks: &[usize], pattern: &BlockPattern) -> Option<(Vec<usize>, Vec<usize>)> {
    let border = border(blocks, pattern)?;
    let inside = |j: &usize| border.binary_search(j).is_err();
    let inside = blocks.iter().copied().filter(inside).collect();
    Some((border, inside))
}

/// Scalar rows of the border of [`Bordered::of`], where there is one.
pub(crate) fn border_rows(blocks: &[usize], pattern: &BlockPattern) -> Option<usize> {
    let (border, inside) = split(blocks, pattern)?;
    size_of_chain(pattern, &inside)?;
    Some(border.iter().map(|&j| pattern.size(j)).sum())
}

/// The fewest blocks, found greedily, without which the others are a chain; `None` where they have too many rows.
fn border(blocks: &[usize], pattern: &BlockPattern) -> Option<Vec<usize>> {
    let largest = blocks.iter().map(|&j| pattern.size(j)).max()?;
    let (mut border, mut rows) = (Vec::new(), 0);
    loop {
        // Neighbours among the blocks that are left.
        let mut place = vec![None; pattern.blocks()];
        let left = blocks.iter().copied();
        let left = left.filter(|j| border.binary_search(j).is_err());
        for (i, j) in left.enumerate() {
            place[j] = Some(i);
        }
        let mut wrong = vec![0_usize; pattern.blocks()];
        for j in 0..pattern.blocks() {
            for k in pattern.column(j).skip(1) {
                if let (Some(a), Some(b)) = (place[j], place[pattern.row(k)])
                    && b != a + 1
                {
                    wrong[j] += 1;
                    wrong[pattern.row(k)] += 1;
                }
            }
        }
        // The later one of equals: what closes a loop comes last.
        let worst = *blocks.iter().max_by_key(|&&j| wrong[j])?;
        if wrong[worst] == 0 {
            return Some(border);
        }
        rows += pattern.size(worst);
        if rows > MOST_ROWS * largest {
            return None;
        }
        border.insert(border.partition_point(|&j| j < worst), worst);
    }
}

/// Entries of a row of a symmetric matrix: a row or a column of one block.
#[derive(Debug, Clone, Copy)]
struct Entries {
    /// Where they stand in the row, and how many they are.
    at: usize,
    count: usize,
    /// Where they are among the matrix's values: the first, and how far apart.
    from: usize,
    stride: usize,
}

/// The entries of row `r` of a block row.
fn entries(p: &BlockPattern, block: usize, r: usize) -> impl Iterator<Item = Entries> + '_ {
    let n = p.size(block);
    let before = (0..=block).filter_map(move |j| {
        let k = p.find(block, j)?;
        Some(Entries {
            at: p.rows(j).start,
            count: p.size(j),
            from: p.values(k).start + r,
            stride: n,
        })
    });
    let behind = p.column(block).skip(1).map(move |k| {
        let m = p.size(p.row(k));
        Entries {
            at: p.rows(p.row(k)).start,
            count: m,
            from: p.values(k).start + r * m,
            stride: 1,
        }
    });
    // A block row of no rows may stand beside it.
    before.chain(behind).filter(|e| e.count > 0)
}

/// Σ aᵢ bᵢ.
fn dot(level: Level, a: &[f64], b: &[f64]) -> f64 {
    dispatch(level, Dot(a, b))
}

struct Dot<'a>(&'a [f64], &'a [f64]);

impl Kernel for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Isa>(self) -> f64 {
        let ((a, tail_a), (b, tail_b)) = (self.0.as_chunks::<16>(), self.1.as_chunks::<16>());
        let mut sums = [I::X4::splat(0.0); 4];
        for (a, b) in a.iter().zip(b) {
            sums[0] = I::X4::load(&a[..4]).mul_add(I::X4::load(&b[..4]), sums[0]);
            sums[1] = I::X4::load(&a[4..8]).mul_add(I::X4::load(&b[4..8]), sums[1]);
            sums[2] = I::X4::load(&a[8..12]).mul_add(I::X4::load(&b[8..12]), sums[2]);
            sums[3] = I::X4::load(&a[12..]).mul_add(I::X4::load(&b[12..]), sums[3]);
        }
        let mut lanes = [0.0; 4];
        ((sums[0] + sums[1]) + (sums[2] + sums[3])).store(&mut lanes);
        let tail: f64 = tail_a.iter().zip(tail_b).map(|(a, b)| a * b).sum();
        (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + tail
    }
}

/// y ← y − a x.
fn subtract(level: Level, y: &mut [f64], a: f64, x: &[f64]) {
    dispatch(level, Subtract(y, a, x));
}

struct Subtract<'a>(&'a mut [f64], f64, &'a [f64]);

impl Kernel for Subtract<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let ((y, tail_y), (x, tail_x)) = (self.0.as_chunks_mut::<4>(), self.2.as_chunks::<4>());
        for (y, x) in y.iter_mut().zip(x) {
            I::X4::load(x)
                .neg_mul_add(I::X4::splat(self.1), I::X4::load(y))
                .store(y);
        }
        for (y, x) in tail_y.iter_mut().zip(tail_x) {
            *y -= self.1 * x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{backward_error, forward_error, reference_solution};
    use std::sync::Arc;

    fn matrix(sizes: &[usize], couplings: &[(usize, usize)]) -> SymBlockMatrix {
        let pattern = Arc::new(BlockPattern::new(sizes, couplings).unwrap());
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        let mut state = 1_u32;
        for v in a.values_mut() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *v = f64::from(state) / f64::from(u32::MAX) * 2.0 - 1.0;
        }
        for j in 0..pattern.blocks() {
            let n = pattern.size(j);
            let diagonal = a.block_mut(pattern.column(j).start);
            diagonal.iter_mut().step_by(n + 1).for_each(|v| *v = 30.0);
        }
        a
    }

    fn whole(pattern: &BlockPattern, level: Level) -> Option<Bordered> {
        let all: Vec<usize> = (0..pattern.blocks()).collect();
        Bordered::of(&all, pattern, level)
    }

    fn chain(n: usize) -> Vec<(usize, usize)> {
        (1..n).map(|i| (i - 1, i)).collect()
    }

    /// Rings (closed in either place), a chain with a closing row behind it, a junction of three chains, a bridge.
    fn systems() -> Vec<SymBlockMatrix> {
        let mut systems = Vec::new();
        for n in [3, 4, 5, 24, 101] {
            for size in [3, 5, 6] {
                systems.push(matrix(
                    &vec![size; n],
                    &[chain(n), vec![(0, n - 1)]].concat(),
                ));
            }
            let mut sizes = vec![6; n + 1];
            (sizes[0], sizes[n]) = (3, 2);
            systems.push(matrix(
                &sizes,
                &[chain(n), vec![(0, n), (n - 1, n)]].concat(),
            ));
        }
        let junction = [chain(6), vec![(3, 7), (7, 8), (8, 9)]].concat();
        systems.push(matrix(&[6, 6, 6, 6, 6, 3, 3, 6, 6, 3], &junction));
        systems.push(matrix(
            &[3; 12],
            &[chain(12), vec![(0, 6), (5, 11)]].concat(),
        ));
        systems
    }

    #[test]
    fn solves_loops_and_junctions_at_every_level() {
        for a in systems() {
            let b: Vec<_> = (0..a.dim()).map(|i| (i as f64).sin() + 0.1).collect();
            let exact = reference_solution(&a, &b).unwrap();
            for level in Level::available() {
                let mut factor = whole(a.pattern(), level).unwrap();
                let mut x = vec![f64::NAN; a.dim()];
                assert!(factor.factorize(&a, None));
                factor.solve(&b, &mut x);
                let e = backward_error(&a, &b, &x).unwrap();
                assert!(
                    e.componentwise <= 2e-15,
                    "{level}: {e:?} for {:?}",
                    a.pattern()
                );
                assert!(forward_error(&x, &exact) <= 1e-13);
            }
        }
    }

    #[test]
    fn the_border_is_what_closes_the_loop() {
        let of = |sizes: &[usize], couplings: &[_]| {
            let all: Vec<usize> = (0..sizes.len()).collect();
            border(&all, &BlockPattern::new(sizes, couplings).unwrap())
        };
        assert_eq!(of(&[6; 5], &chain(5)), Some(vec![]));
        assert_eq!(
            of(&[6; 5], &[chain(5), vec![(0, 4)]].concat()),
            Some(vec![4])
        );
        let many: Vec<_> = (2..9).map(|i| (0, i)).collect();
        assert_eq!(of(&[6; 9], &[chain(9), many].concat()), Some(vec![0]));
        let full: Vec<_> = (0..9).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
        assert_eq!(of(&[6; 9], &full), None);
    }

    #[test]
    fn a_redundant_closing_row_is_refused() {
        // The second row of the last block is the first one.
        let mut a = matrix(&[3, 3, 3, 2], &[chain(4), vec![(0, 3)]].concat());
        let p = a.pattern().clone();
        for j in [0, 2] {
            for column in a.block_mut(p.find(3, j).unwrap()).chunks_exact_mut(2) {
                column[1] = column[0];
            }
        }
        let diagonal = a.block_mut(p.column(3).start);
        diagonal.copy_from_slice(&[0.7; 4]);
        for level in Level::available() {
            let mut factor = whole(&p, level).unwrap();
            assert!(!factor.factorize(&a, None), "{level}");
        }
    }
}
