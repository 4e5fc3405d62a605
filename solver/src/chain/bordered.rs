//! Chains with a border: a few block rows that couple to any others, as the joint that closes a ring or a junction does.
//!
//! With the border last the matrix is [C F; Fᵀ G], C the chain. Its factor L D Lᵀ is that of the chain, and
//!
//! ```text
//! U = D⁻¹ L⁻¹ F      S = G − Uᵀ D U
//! ```
//!
//! a forward pass for the columns of the border, two at a time in a vector, and a small dense matrix. A solve is
//! y = L⁻¹ b, the border's part s = S⁻¹ (b − Uᵀ y), and the backward pass of D⁻¹ y − U s: block LDLᵀ in an order of the
//! blocks, as stable as any. The passes make the products with U: these fill the time in which a step waits for the one
//! before it.

use super::layout::{columns_of, get, per_step, u_at, unroll};
use super::overlay::{Offsets, Overlay};
use super::schedule::{Schedule, size_of_chain};
use super::substitution::{InBoth, lower_solve, pass_on, scaled};
use super::twisted::{add_in_halves, load_rows, pair, store_rows};
use super::{Chain, with_size};
use crate::BlockPattern;
use crate::block_ldlt::{Pivots, factor_diagonal};
use crate::kernels::{OneByOne, Scalar, unit_lower_solve, unit_upper_solve};
use crate::singularity::WEAK;
use taut_lanes::{Aligned, Halves, Isa, Kernel, Level, dispatch};

/// Most rows in the border, of the chain's largest block: each pair costs a forward pass, and more of them can cost more
/// than the general factorisation.
const MOST_ROWS: usize = 2;

/// Factor of a chain with a border.
#[derive(Debug, Clone)]
pub(crate) struct Bordered {
    chain: Chain,
    /// BlockSlot of each of the border's rows in the matrix.
    rows: Vec<usize>,
    border: Border,
    /// U ([`u_at`]), with a column of zeros where the border's rows are odd.
    u: Aligned,
    /// Factor of S, column-major, and 1/D.
    s: Vec<f64>,
    inverse: Vec<f64>,
    /// Largest magnitude that each diagonal entry of S was made from.
    scale: Vec<f64>,
    /// Uᵀ D U, row-major, and Uᵀ y: two lanes an entry.
    products: Vec<f64>,
    sums: Vec<f64>,
    /// The border's part of a solution.
    part: Vec<f64>,
}

/// Where F and G go: values of the matrix, and where they belong.
#[derive(Debug, Clone)]
struct Border {
    /// The steps that F has entries in, ascending.
    steps: Vec<usize>,
    /// Entries of F, to stand in U before that is computed.
    f: Vec<(usize, usize)>,
    /// The lower triangle of G, to stand in S.
    g: Vec<(usize, usize)>,
}

/// Most pairs of columns that go the forward pass at once: those of a joint of six rows.
const PAIRS: usize = 3;

impl Bordered {
    /// For some block rows and columns (ascending) of matrices of a pattern, if they are a chain but for a border of few
    /// rows. Allocates all that is needed.
    pub(crate) fn of<'a>(
        blocks: &[usize],
        offsets: impl Into<Offsets<'a>>,
        level: Level,
    ) -> Option<Self> {
        let offsets = offsets.into();
        let pattern = offsets.pattern;
        let (border, inside) = split(blocks, pattern)?;
        let chain = Chain::of(&inside, offsets, level)?;
        let rows: Vec<usize> = border.iter().flat_map(|&j| pattern.rows(j)).collect();
        let count = rows.len();
        let columns = count.next_multiple_of(2);
        Some(Self {
            border: Border::new(&border, &rows, offsets, &chain.schedule),
            u: Aligned::new(chain.half.len() * columns),
            s: vec![0.0; count * count],
            inverse: vec![0.0; count],
            scale: vec![0.0; count],
            products: vec![0.0; 2 * columns * columns],
            sums: vec![0.0; 2 * columns],
            part: vec![0.0; columns],
            chain,
            rows,
        })
    }

    #[cfg(test)]
    /// Scalar rows of the border.
    pub(crate) fn border_rows(&self) -> usize {
        self.rows.len()
    }

    /// Factorises `a`, of the pattern of [`of`](Self::of); whether all pivots are positive and beyond doubt, of what
    /// their rows were made from where these magnitudes are given, one for every row of the matrix. Allocates nothing.
    pub(crate) fn factorize<'a>(
        &mut self,
        a: impl Into<Overlay<'a>>,
        magnitudes: Option<&[f64]>,
    ) -> bool {
        let a = a.into();
        let sound = |chain: &Chain| magnitudes.is_none_or(|m| chain.is_sound(m));
        if !self.chain.factorize(a, WEAK) || !sound(&self.chain) {
            return false;
        }
        let (count, columns) = (self.rows.len(), self.part.len());
        let size = self.chain.schedule.size;
        for &t in &self.border.steps {
            self.u[u_at(size, columns, t, 0)..u_at(size, columns, t + 1, 0)].fill(0.0);
        }
        for &(from, to) in &self.border.f {
            self.u[to] = a.block(from, 1)[0];
        }
        // Blocks of the border that do not couple have no entries.
        self.s.fill(0.0);
        for &(from, to) in &self.border.g {
            self.s[to] = a.block(from, 1)[0];
        }
        self.products.fill(0.0);
        with_size!(
            size,
            self.chain.level,
            Columns {
                schedule: &self.chain.schedule,
                factor: &*self.chain.factor,
                of_border: &self.border.steps,
                u: &mut *self.u,
                products: &mut self.products,
                columns: columns,
            }
        );
        for c in 0..count {
            for r in c..count {
                // One lane for each end of the chain.
                let at = 2 * (c * columns + r);
                let taken = self.products[at] + self.products[at + 1];
                let entry = &mut self.s[r + count * c];
                if r == c {
                    let made_from = magnitudes.map_or(0.0, |m| m[self.rows[r]]);
                    self.scale[c] = entry.abs().max(taken.abs()).max(made_from);
                }
                *entry -= taken;
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
        let count = self.rows.len();
        self.sums.fill(0.0);
        self.chain.forward::<true>(b, &self.u, &mut self.sums);
        let part = &mut self.part[..count];
        for ((part, &row), sum) in (part.iter_mut().zip(&self.rows)).zip(self.sums.chunks_exact(2))
        {
            *part = b[row] - (sum[0] + sum[1]);
        }
        unit_lower_solve(count, &self.s, part);
        for (part, inverse) in part.iter_mut().zip(&self.inverse) {
            *part *= inverse;
        }
        unit_upper_solve(count, &self.s, part);
        for (&row, &part) in self.rows.iter().zip(&*part) {
            x[row] = part;
        }
        self.chain.backward::<true>(&self.u, &self.part, x);
    }
}

impl Border {
    /// Border of the blocks `border`, with scalar rows `rows` in the matrix, beside a chain.
    fn new(border: &[usize], rows: &[usize], offsets: Offsets<'_>, schedule: &Schedule) -> Self {
        let (dim, size, count) = (offsets.pattern.dim(), schedule.size, rows.len());
        // For each chain row, its step and place in it; for each border row, its column.
        let (mut of_chain, mut of_border) = (vec![None; dim], vec![None; dim]);
        for (t, step) in schedule.steps.iter().enumerate() {
            for (end, place) in step.ends.iter().enumerate() {
                for i in 0..place.size {
                    of_chain[place.row + i] = Some((t, 2 * i + end));
                }
            }
        }
        for (c, &row) in rows.iter().enumerate() {
            of_border[row] = Some(c);
        }
        let (mut steps, mut f, mut g) = (Vec::new(), Vec::new(), Vec::new());
        for (row, other, value) in border.iter().flat_map(|&block| entries(offsets, block)) {
            let Some(c) = of_border[row] else { continue };
            if let Some((t, i)) = of_chain[other] {
                steps.push(t);
                f.push((value, u_at(size, count.next_multiple_of(2), t, c) + i));
            }
            if let Some(before) = of_border[other].filter(|&before| before <= c) {
                g.push((value, c + count * before));
            }
        }
        steps.sort_unstable();
        steps.dedup();
        Self { steps, f, g }
    }
}

/// U and Uᵀ D U, where U has F in some steps. Columns go the forward pass of the chain in pairs, in four lanes: both ends of
/// the first, then of the second.
struct Columns<'a, const B: usize> {
    schedule: &'a Schedule,
    factor: &'a [f64],
    /// The steps with entries of F.
    of_border: &'a [usize],
    u: &'a mut [f64],
    /// Entries (a, c) of Uᵀ D U for pairs of c from that of a on, a lane for each end of the chain.
    products: &'a mut [f64],
    columns: usize,
}

impl<const B: usize> Kernel for Columns<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(mut self) {
        for first in (0..self.columns).step_by(2 * PAIRS) {
            match (self.columns - first) / 2 {
                1 => self.pass::<I::X4, 1>(first),
                2 => self.pass::<I::X4, 2>(first),
                _ => self.pass::<I::X4, PAIRS>(first),
            }
        }
    }
}

impl<const B: usize> Columns<'_, B> {
    /// `P` pairs from column `first` on.
    #[inline(always)]
    fn pass<V: Halves<Half: Halves>, const P: usize>(&mut self, first: usize) {
        let (columns, count) = (self.columns, self.schedule.steps());
        let mut of_border = self.of_border.iter().peekable();
        let mut rows = [[V::splat(0.0); B]; P];
        for t in 0..=count {
            let factor = InBoth(&self.factor[2 * per_step(B) * t..]);
            let has_entries = of_border.next_if_eq(&&t).is_some();
            let mut done = [[V::splat(0.0); B]; P];
            unroll!(p < P, pairs, {
                let [one, other] = [0, 1].map(|c| u_at(B, columns, t, first + 2 * p + c));
                if has_entries {
                    let one: [V::Half; B] = load_rows(&self.u[one..]);
                    let other: [V::Half; B] = load_rows(&self.u[other..]);
                    unroll!(i < B, {
                        rows[p][i] = rows[p][i] + V::join(one[i], other[i]);
                    });
                }
                if t == count && count > 0 {
                    rows[p] = rows[p].map(add_in_halves);
                }
                done[p] = lower_solve(factor, rows[p]);
                if t == count {
                    let one = V::both(pair(1.0, 0.0));
                    unroll!(i < B, {
                        done[p][i] = done[p][i] * one;
                    });
                } else {
                    rows[p] = pass_on(factor, done[p], [V::splat(0.0); B]);
                }
                let scaled = scaled(factor, done[p]);
                store_rows(&scaled.map(Halves::lower), &mut self.u[one..]);
                store_rows(&scaled.map(Halves::upper), &mut self.u[other..]);
            });
            // With all columns up to those of each pair.
            let before = columns_of(self.u, B, columns, t).enumerate();
            for ((a, u), products) in before.zip(self.products.chunks_exact_mut(2 * columns)) {
                unroll!(p < P, pairs, {
                    let c = first + 2 * p;
                    if a < c + 2 {
                        let products = &mut products[2 * c..];
                        let mut sum = V::load(products);
                        unroll!(i < B, {
                            let u: V::Half = get(u, i);
                            sum = V::both(u).mul_add(done[p][i], sum);
                        });
                        sum.store(products);
                    }
                });
            }
        }
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

/// The entries of a block's rows in a symmetric matrix: row, column, and the value's number.
fn entries(offsets: Offsets<'_>, block: usize) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
    let p = offsets.pattern;
    let n = p.size(block);
    let before = (0..=block).filter_map(move |j| Some((j, p.find(block, j)?, 1, n)));
    let behind = p.column(block).skip(1).map(move |k| {
        let j = p.row(k);
        (j, k, p.size(j), 1)
    });
    before.chain(behind).flat_map(move |(j, k, down, across)| {
        let (rows, columns, first) = (p.rows(block), p.rows(j), offsets.of(k));
        rows.enumerate().flat_map(move |(r, row)| {
            let columns = columns.clone().enumerate();
            columns.map(move |(c, column)| (row, column, first + r * down + c * across))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{SymBlockMatrix, backward_error, forward_error, reference_solution};
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

    /// Rings (closed in either place), a chain with a closing row behind it, a junction of three chains, bridges, of which two
    /// borders couple to each other, a block of no rows.
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
        for size in [1, 3, 4, 5, 6] {
            for more in [vec![(0, 6), (5, 11)], vec![(0, 6), (5, 11), (6, 11)]] {
                systems.push(matrix(&[size; 12], &[chain(12), more].concat()));
            }
        }
        systems.push(matrix(&[6, 6, 0, 6, 1], &[chain(5), vec![(0, 4)]].concat()));
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
                // Nothing is left of another matrix.
                let mut other = a.clone();
                other.values_mut().iter_mut().for_each(|v| *v *= 0.5);
                assert!(factor.factorize(&other, None));
                assert!(factor.factorize(&a, None));
                factor.solve(&b, &mut x);
                let e = backward_error(&a, &b, &x).unwrap();
                let holds = e.componentwise <= 2e-15;
                assert!(holds, "{level}: {e:?} for {:?}", a.pattern());
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
        let found = of(&[6; 5], &[chain(5), vec![(0, 4)]].concat());
        assert_eq!(found, Some(vec![4]));
        let many: Vec<_> = (2..9).map(|i| (0, i)).collect();
        assert_eq!(of(&[6; 9], &[chain(9), many].concat()), Some(vec![0]));
        let full: Vec<_> = (0..9).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
        assert_eq!(of(&[6; 9], &full), None);
    }

    #[test]
    fn no_number_that_is_not_finite_is_accepted() {
        for mut a in systems() {
            let (pattern, before) = (a.pattern().clone(), a.values().to_vec());
            let mut factor = whole(&pattern, Level::best()).unwrap();
            let blocks: Vec<usize> = (0..pattern.blocks()).collect();
            let border = border(&blocks, &pattern).unwrap();
            for (row, column, at) in border.iter().flat_map(|&j| entries((&*pattern).into(), j)) {
                // The upper triangle of a diagonal block is not read.
                let (i, j) = (pattern.block_of_row(row), pattern.block_of_row(column));
                if i == j && row < column {
                    continue;
                }
                for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    a.values_mut()[at] = bad;
                    assert!(!factor.factorize(&a, None), "{bad} at {at} of {pattern:?}");
                }
                a.values_mut()[at] = before[at];
            }
            assert!(factor.factorize(&a, None));
        }
    }

    /// A row of the border that was made from much larger numbers is noise, whatever it is now.
    #[test]
    fn what_the_border_was_made_from_counts() {
        for a in systems() {
            let mut factor = whole(a.pattern(), Level::best()).unwrap();
            for row in factor.rows.clone() {
                let mut from = vec![0.0; a.dim()];
                from[row] = 31.0 / (WEAK * f64::ROUNDOFF);
                assert!(!factor.factorize(&a, Some(&from)));
                from[row] = 1.0 / (WEAK * f64::ROUNDOFF);
                assert!(factor.factorize(&a, Some(&from)));
            }
        }
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
