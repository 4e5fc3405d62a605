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
use crate::block_ldlt::{Pivots, factor_diagonal};
use crate::kernels::{OneByOne, unit_lower_solve, unit_upper_solve};
use crate::{BlockPattern, SymBlockMatrix};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// Most rows in the border, of the chain's largest block: each costs a forward pass, and more of them can cost more than
/// the general factorisation.
const MOST_ROWS: usize = 2;

/// Factor of a chain with a border.
#[derive(Debug, Clone)]
pub(crate) struct Bordered {
    chain: Chain,
    /// The blocks of the border, ascending, and the first of their rows in it.
    blocks: Vec<(usize, usize)>,
    rows: usize,
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

impl Bordered {
    /// For matrices of `pattern`, if it is a chain but for a border of few rows. Allocates all that is needed.
    pub(crate) fn new(pattern: &BlockPattern, level: Level) -> Option<Self> {
        let border = border(pattern)?;
        let inside = |j: &usize| border.binary_search(j).is_err();
        let inside: Vec<usize> = (0..pattern.blocks()).filter(inside).collect();
        let chain = Chain::of(&inside, pattern, level)?;
        let (mut rows, mut blocks) = (0, Vec::new());
        for block in border {
            blocks.push((block, rows));
            rows += pattern.size(block);
        }
        let len = chain.half.len();
        Some(Self {
            chain,
            blocks,
            rows,
            v: vec![0.0; rows * len],
            scaled: vec![0.0; rows * len],
            s: vec![0.0; rows * rows],
            inverse: vec![0.0; rows],
            scale: vec![0.0; rows],
            column: vec![0.0; pattern.dim()],
            part: vec![0.0; rows],
        })
    }

    /// Factorises `a`, of the pattern of [`new`](Self::new); whether all pivots are more than noise. Allocates nothing.
    pub(crate) fn factorize(&mut self, a: &SymBlockMatrix) -> bool {
        if !self.chain.factorize(a) {
            return false;
        }
        let (p, len) = (a.pattern(), self.chain.half.len());
        let rows = self.rows;
        for &(block, first) in &self.blocks {
            for r in 0..p.size(block) {
                let c = first + r;
                self.column.fill(0.0);
                spread(a, (block, r), &mut self.column);
                let v = &mut self.v[c * len..(c + 1) * len];
                let scaled = &mut self.scaled[c * len..(c + 1) * len];
                self.chain.forward(&self.column, v, scaled);
                for &(other, at) in self.blocks.iter().take_while(|b| b.0 <= block) {
                    for k in 0..p.size(other) {
                        let j = at + k;
                        if j <= c {
                            let g = self.column[p.rows(other).start + k];
                            let taken = dot(
                                self.chain.level,
                                &self.v[j * len..][..len],
                                &self.scaled[c * len..][..len],
                            );
                            self.s[c + rows * j] = g - taken;
                            if j == c {
                                self.scale[c] = g.abs().max(taken.abs());
                            }
                        }
                    }
                }
            }
        }
        let (s, inverse) = (&mut self.s, &mut self.inverse);
        factor_diagonal::<OneByOne, _, _>(rows, s, inverse, &self.scale, Pivots::Nonzero).is_ok()
    }

    /// Solves A x = b, both of length `dim`. Allocates nothing.
    pub(crate) fn solve(&mut self, a: &SymBlockMatrix, b: &[f64], x: &mut [f64]) {
        let len = self.chain.half.len();
        let mut half = std::mem::take(&mut self.chain.half);
        self.chain.forward(b, &mut [], &mut half);
        let border = |&(block, first): &(usize, usize)| a.pattern().rows(block).zip(first..);
        for (row, c) in self.blocks.iter().flat_map(border) {
            self.part[c] = b[row] - dot(self.chain.level, &self.v[c * len..][..len], &half);
        }
        unit_lower_solve(self.rows, &self.s, &mut self.part);
        for (part, inverse) in self.part.iter_mut().zip(&self.inverse) {
            *part *= inverse;
        }
        unit_upper_solve(self.rows, &self.s, &mut self.part);
        for (c, &part) in self.part.iter().enumerate() {
            subtract(
                self.chain.level,
                &mut half,
                part,
                &self.scaled[c * len..][..len],
            );
        }
        self.chain.backward(&half, x);
        for (row, c) in self.blocks.iter().flat_map(border) {
            x[row] = self.part[c];
        }
        self.chain.half = half;
    }
}

/// The fewest blocks, found greedily, without which the pattern is a chain; `None` where they have too many rows.
fn border(pattern: &BlockPattern) -> Option<Vec<usize>> {
    let largest = (0..pattern.blocks()).map(|j| pattern.size(j)).max()?;
    let (mut border, mut rows) = (Vec::new(), 0);
    loop {
        // Neighbours among the blocks that are left.
        let mut place = vec![None; pattern.blocks()];
        let left = (0..pattern.blocks()).filter(|j| border.binary_search(j).is_err());
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
        let worst = (0..pattern.blocks()).max_by_key(|&j| wrong[j])?;
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

/// Row `row.1` of block row `row.0` of a symmetric matrix.
fn spread(a: &SymBlockMatrix, row: (usize, usize), to: &mut [f64]) {
    let (p, (block, r)) = (a.pattern(), row);
    for j in 0..=block {
        if let Some(k) = p.find(block, j) {
            let n = p.size(block);
            // A block row of no rows may stand beside it.
            let row = a.block(k).iter().skip(r).step_by(n);
            for (to, from) in to[p.rows(j)].iter_mut().zip(row) {
                *to = *from;
            }
        }
    }
    for k in p.column(block).skip(1) {
        let n = p.size(p.row(k));
        to[p.rows(p.row(k))].copy_from_slice(&a.block(k)[r * n..(r + 1) * n]);
    }
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
            let (n, sign) = (pattern.size(j), if j % 2 == 1 { -1.0 } else { 1.0 });
            let diagonal = a.block_mut(pattern.column(j).start);
            diagonal
                .iter_mut()
                .step_by(n + 1)
                .for_each(|v| *v = 30.0 * sign);
        }
        a
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
                let mut factor = Bordered::new(a.pattern(), level).unwrap();
                let mut x = vec![f64::NAN; a.dim()];
                assert!(factor.factorize(&a));
                factor.solve(&a, &b, &mut x);
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
            border(&BlockPattern::new(sizes, couplings).unwrap())
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
            let mut factor = Bordered::new(&p, level).unwrap();
            assert!(!factor.factorize(&a), "{level}");
        }
    }
}
