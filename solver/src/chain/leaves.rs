//! Leaves: blocks that are eliminated before the chain, since that fills nothing.
//!
//! A hook on a ball joint or a short branch hangs on a segment of a cable. It couples to the joints
//! before and behind that segment, which couple to each other: a *simplicial* block. With such
//! blocks first the matrix is [L Eᵀ; E C]. The Schur complement C − E L⁻¹ Eᵀ has no more blocks
//! than C: it is a chain, or one with a border, that the leaves alone had kept from being one.

use super::overlay::{Offsets, Overlay};
use crate::block_ldlt::{Pivots, factor_diagonal};
use crate::kernels::{
    BlockWork, Scalar, Strips, by_size, by_sizes, panel_solve, subtract_product,
    subtract_transposed, unit_lower_solve, unit_upper_solve, update, update_diagonal,
};
use crate::ordering::neighbours;
use crate::singularity::WEAK;
use crate::{BlockPattern, SymBlockMatrix};
use std::collections::{BTreeMap, BinaryHeap};
use std::ops::Range;

/// Factors of the leaves, and what they leave.
#[derive(Debug, Clone)]
pub(crate) struct Leaves {
    leaves: Vec<Leaf>,
    couplings: Vec<Coupling>,
    updates: Vec<Update>,
    /// Factors of the leaves' diagonal blocks, and L⁻ᵀ D⁻¹ of their couplings.
    values: Vec<f64>,
    inverse_pivots: Vec<f64>,
    /// The couplings of a leaf times L⁻ᵀ.
    panel: Vec<f64>,
    /// Stored blocks that are patched in the Schur complement, and the numbers of their first values there.
    patched: BTreeMap<usize, usize>,
    /// Their values in the matrix, and in the Schur complement.
    own: Vec<Range<usize>>,
    patches: Vec<f64>,
    /// Largest magnitude that each diagonal entry was made from; 0 where no leaf couples to.
    scale: Vec<f64>,
    /// Right-hand side, less what the leaves take away.
    b: Vec<f64>,
}

/// A block that is eliminated.
#[derive(Debug, Clone)]
struct Leaf {
    rows: Range<usize>,
    /// The first value of its diagonal block, which is a patch where an earlier leaf couples to it, and the values of its
    /// factor.
    diagonal: usize,
    factor: Range<usize>,
    couplings: Range<usize>,
    updates: Range<usize>,
}

/// A leaf's coupling E to a block: m×n, n the rows of the leaf.
#[derive(Debug, Clone)]
struct Coupling {
    rows: Range<usize>,
    /// Its first value, as that of the diagonal block.
    from: usize,
    /// True if the matrix stores Eᵀ.
    transposed: bool,
    /// Where E L⁻ᵀ D⁻¹ and E L⁻ᵀ are kept.
    values: Range<usize>,
    panel: Range<usize>,
}

/// A patch from which the product of two couplings is subtracted.
#[derive(Debug, Clone)]
struct Update {
    to: Range<usize>,
    row: usize,
    column: usize,
}

/// The leaves of a pattern and all its other blocks, both ascending but the leaves in the order of their elimination.
/// Taken is what keeps its neighbours from being a chain: a block with two or more of them, or the only one of a block
/// with three.
///
/// The priority of a block changes with every leaf that is taken beside it. It is recomputed at
/// most [`PATIENCE`] times the number of blocks; after that a block is taken with its last known
/// priority. The time thus stays in proportion to the pattern where very many blocks hang on one.
fn split(pattern: &BlockPattern) -> (Vec<usize>, Vec<usize>) {
    let blocks = pattern.blocks();
    let neighbours = neighbours(pattern);
    // Neighbours of each block that are not leaves yet.
    let mut count: Vec<usize> = neighbours.iter().map(Vec::len).collect();
    let mut is_leaf = vec![false; blocks];
    let coupled = |a: usize, b: usize| pattern.find(a.max(b), a.min(b)).is_some();
    // Priority of a block, largest first: the number of its neighbours' neighbours, then the
    // largest distance to a neighbour in the order, which is short for a cable's next joint.
    let wanted = |block: usize, count: &[usize], is_leaf: &[bool]| {
        let size = pattern.size(block);
        if !(1..=MOST_NEIGHBOURS).contains(&count[block]) || !(1..=MOST_ROWS).contains(&size) {
            return None;
        }
        let mut own = [0; MOST_NEIGHBOURS];
        let own = &mut own[..count[block]];
        let left = neighbours[block].iter().filter(|&&other| !is_leaf[other]);
        for (to, from) in own.iter_mut().zip(left) {
            *to = *from;
        }
        let mut pairs = own.iter().enumerate();
        let simplicial = match *own {
            [only] => count[only] > 2,
            _ => pairs.all(|(i, &a)| own[..i].iter().all(|&b| coupled(a, b))),
        };
        let around: usize = own.iter().map(|&other| count[other]).sum();
        let far = own.iter().map(|&other| other.abs_diff(block)).max();
        simplicial.then_some((around, far, block))
    };
    let mut leaves = Vec::new();
    let first = (0..blocks).filter_map(|j| wanted(j, &count, &is_leaf));
    let mut queue: BinaryHeap<_> = first.collect();
    let mut patience = PATIENCE * blocks;
    while let Some(known) = queue.pop() {
        let block = known.2;
        if is_leaf[block] {
            continue;
        }
        match wanted(block, &count, &is_leaf) {
            None => continue,
            Some(now) if now != known && patience > 0 => {
                patience -= 1;
                queue.push(now);
                continue;
            }
            Some(_) => {}
        }
        is_leaf[block] = true;
        leaves.push(block);
        for &other in neighbours[block].iter().filter(|&&other| !is_leaf[other]) {
            count[other] -= 1;
        }
        let around = neighbours[block].iter().filter(|&&other| !is_leaf[other]);
        queue.extend(around.filter_map(|&other| wanted(other, &count, &is_leaf)));
    }
    let others = (0..blocks).filter(|&j| !is_leaf[j]).collect();
    (leaves, others)
}

/// Times that what blocks come by is looked up anew, of each.
const PATIENCE: usize = 4;

/// Most blocks that a leaf couples to: joints of a cable are coupled to two, to their own leaves, and to a branch.
const MOST_NEIGHBOURS: usize = 4;

/// Most rows of a leaf.
const MOST_ROWS: usize = 6;

/// The blocks that are no leaves, ascending; `None` where all are none.
pub(crate) fn others(pattern: &BlockPattern) -> Option<Vec<usize>> {
    let (leaves, others) = split(pattern);
    (!leaves.is_empty()).then_some(others)
}

impl Leaves {
    /// The leaves of matrices of `pattern` and the other blocks, ascending; `None` where there are none. Allocates all
    /// that is needed.
    pub(crate) fn new(p: &BlockPattern) -> Option<(Self, Vec<usize>)> {
        let (order, others) = split(p);
        if order.is_empty() {
            return None;
        }
        let mut taken = vec![false; p.blocks()];
        let mut all = Self {
            leaves: Vec::new(),
            couplings: Vec::new(),
            updates: Vec::new(),
            values: Vec::new(),
            inverse_pivots: vec![0.0; p.dim()],
            panel: Vec::new(),
            patched: BTreeMap::new(),
            own: Vec::new(),
            patches: Vec::new(),
            scale: vec![0.0; p.dim()],
            b: vec![0.0; p.dim()],
        };
        let coupled = neighbours(p);
        for leaf in order {
            taken[leaf] = true;
            let n = p.size(leaf);
            let factor = all.room(n * n);
            let first = all.couplings.len();
            let left = coupled[leaf].iter().copied().filter(|&j| !taken[j]);
            let left: Vec<usize> = left.collect();
            let mut panel = 0;
            for &block in &left {
                let k = p.find(leaf.max(block), leaf.min(block))?;
                let values = all.room(p.size(block) * n);
                let from = panel;
                panel += values.len();
                all.couplings.push(Coupling {
                    rows: p.rows(block),
                    from: all.offsets(p).of(k),
                    transposed: block < leaf,
                    values,
                    panel: from..panel,
                });
            }
            all.panel.resize(all.panel.len().max(panel), 0.0);
            // They ascend.
            let update = all.updates.len();
            for (column, &j) in left.iter().enumerate() {
                for (row, &i) in left.iter().enumerate().skip(column) {
                    let to = all.patch(p, p.find(i, j)?);
                    all.updates.push(Update {
                        to,
                        row: first + row,
                        column: first + column,
                    });
                }
            }
            all.leaves.push(Leaf {
                rows: p.rows(leaf),
                diagonal: all.offsets(p).of(p.column(leaf).start),
                factor,
                couplings: first..all.couplings.len(),
                updates: update..all.updates.len(),
            });
        }
        Some((all, others))
    }

    /// Where the blocks of the Schur complement begin.
    pub(crate) fn offsets<'a>(&'a self, pattern: &'a BlockPattern) -> Offsets<'a> {
        Offsets {
            pattern,
            patched: &self.patched,
        }
    }

    /// The patch of stored block `k`, which is made where there is none.
    fn patch(&mut self, pattern: &BlockPattern, k: usize) -> Range<usize> {
        let (values, own) = (pattern.stored_values(), pattern.values(k));
        let first = *self.patched.entry(k).or_insert_with(|| {
            let end = self.patches.len();
            self.patches.resize(end + own.len(), 0.0);
            self.own.push(own.clone());
            values + end
        }) - values;
        first..first + own.len()
    }

    /// Room for some more values.
    fn room(&mut self, count: usize) -> Range<usize> {
        let start = self.values.len();
        self.values.resize(start + count, 0.0);
        start..start + count
    }

    /// Eliminates the leaves of `a`, of the pattern of [`new`](Self::new); `None` where a pivot is weak. The Schur complement,
    /// and the largest magnitude that each entry of its diagonal was made from, one for each scalar row, 0 where no leaf
    /// couples to. Allocates nothing.
    pub(crate) fn factorize<'a>(
        &'a mut self,
        a: &'a SymBlockMatrix,
    ) -> Option<(Overlay<'a>, &'a [f64])> {
        let mut patches = &mut self.patches[..];
        for own in &self.own {
            let (to, behind) = patches.split_at_mut(own.len());
            to.copy_from_slice(&a.values()[own.clone()]);
            patches = behind;
        }
        let eliminated = f64::run(Eliminate(self, a.values()));
        let (values, patches) = (a.values(), &self.patches[..]);
        eliminated.then_some((Overlay { values, patches }, &self.scale))
    }

    #[inline(always)]
    fn eliminate<S: Strips<f64>>(&mut self, values: &[f64]) -> bool {
        let patches = &mut self.patches[..];
        self.scale.fill(0.0);
        for leaf in &self.leaves {
            let n = leaf.rows.len();
            let factor = &mut self.values[leaf.factor.clone()];
            let rest = Overlay { values, patches };
            factor.copy_from_slice(rest.block(leaf.diagonal, n * n));
            let scale = &mut self.scale[leaf.rows.clone()];
            for (scale, d) in scale.iter_mut().zip(factor.iter().step_by(n + 1)) {
                *scale = scale.max(d.abs());
            }
            let inverse = &mut self.inverse_pivots[leaf.rows.clone()];
            let pivots = Pivots::Positive;
            if by_size!(n, |n| factor_diagonal::<S, _, _>(
                n, factor, inverse, scale, pivots
            ))
            .is_err()
            {
                return false;
            }
            let mut pivots = inverse.iter().zip(&*scale);
            if pivots.any(|(d, from)| WEAK * f64::ROUNDOFF * from * d >= 1.0) {
                return false;
            }
            for c in &self.couplings[leaf.couplings.clone()] {
                let m = c.rows.len();
                let (head, tail) = self.values.split_at_mut(c.values.start);
                let (factor, w) = (&head[leaf.factor.clone()], &mut tail[..m * n]);
                let e = rest.block(c.from, m * n);
                if c.transposed {
                    for (i, e) in e.chunks_exact(n).enumerate() {
                        for (j, &e) in e.iter().enumerate() {
                            w[i + m * j] = e;
                        }
                    }
                } else {
                    w.copy_from_slice(e);
                }
                let panel = &mut self.panel[c.panel.clone()];
                by_size!(n, |n| by_size!(m, |m| panel_solve::<S, _, _, _>(
                    m, n, factor, inverse, w, panel
                )));
            }
            for u in &self.updates[leaf.updates.clone()] {
                let [row, column] = [&self.couplings[u.row], &self.couplings[u.column]];
                let (x, w) = (
                    &self.panel[row.panel.clone()],
                    &self.values[column.values.clone()],
                );
                let to = &mut patches[u.to.clone()];
                if u.row == u.column {
                    let m = row.rows.len();
                    let scale = &mut self.scale[row.rows.clone()];
                    for (scale, d) in scale.iter_mut().zip(to.iter().step_by(m + 1)) {
                        *scale = scale.max(d.abs());
                    }
                    by_size!(n, |n| by_size!(m, |m| update_diagonal::<S, _, _, _>(
                        m, n, to, x, w, scale
                    )));
                } else {
                    let (r, c) = (row.rows.len(), column.rows.len());
                    by_size!(n, |n| by_sizes!(r, c, |r, c| update::<S, _, _, _, _>(
                        r, c, n, to, x, w
                    )));
                }
            }
        }
        true
    }

    /// Solves A x = b, with `solve` for what the leaves leave. Allocates nothing.
    pub(crate) fn solve(
        &mut self,
        b: &[f64],
        x: &mut [f64],
        solve: impl FnOnce(&[f64], &mut [f64]),
    ) {
        self.b.copy_from_slice(b);
        f64::run(Forward(self));
        solve(&self.b, x);
        self.backward(x);
    }

    #[inline(always)]
    fn forward<S: Strips<f64>>(&mut self) {
        for leaf in &self.leaves {
            let n = leaf.rows.len();
            unit_lower_solve(
                n,
                &self.values[leaf.factor.clone()],
                &mut self.b[leaf.rows.clone()],
            );
            let mut y = [0.0; MOST_ROWS];
            let y = &mut y[..n];
            y.copy_from_slice(&self.b[leaf.rows.clone()]);
            for c in &self.couplings[leaf.couplings.clone()] {
                let w = &self.values[c.values.clone()];
                subtract_product::<S, _, _, _>(c.rows.len(), n, w, y, &mut self.b[c.rows.clone()]);
            }
        }
    }

    fn backward(&self, x: &mut [f64]) {
        for leaf in self.leaves.iter().rev() {
            let n = leaf.rows.len();
            let mut y = [0.0; MOST_ROWS];
            let y = &mut y[..n];
            for ((y, b), d) in y
                .iter_mut()
                .zip(&self.b[leaf.rows.clone()])
                .zip(&self.inverse_pivots[leaf.rows.clone()])
            {
                *y = b * d;
            }
            for c in &self.couplings[leaf.couplings.clone()] {
                let w = &self.values[c.values.clone()];
                subtract_transposed(c.rows.len(), n, w, &x[c.rows.clone()], y);
            }
            unit_upper_solve(n, &self.values[leaf.factor.clone()], y);
            x[leaf.rows.clone()].copy_from_slice(y);
        }
    }
}

/// The elimination of all leaves; whether their pivots were accepted.
struct Eliminate<'a>(&'a mut Leaves, &'a [f64]);

impl BlockWork<f64> for Eliminate<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Strips<f64>>(self) -> bool {
        self.0.eliminate::<S>(self.1)
    }
}

/// The leaves' part of the forward pass.
struct Forward<'a>(&'a mut Leaves);

impl BlockWork<f64> for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Strips<f64>>(self) {
        self.0.forward::<S>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaves(sizes: &[usize], couplings: &[(usize, usize)]) -> (Vec<usize>, Vec<usize>) {
        split(&BlockPattern::new(sizes, couplings).unwrap())
    }

    /// An arrow of 10⁵ blocks, either way round, takes no longer than others: its square would take minutes.
    #[test]
    fn very_many_leaves_of_one_block_are_found_in_time() {
        let n = if cfg!(miri) { 100 } else { 100_000 };
        for hub in [0, n - 1] {
            let arrow: Vec<_> = (0..n).filter(|&j| j != hub).map(|j| (j, hub)).collect();
            let (found, others) = leaves(&vec![1; n], &arrow);
            assert_eq!((found.len(), others.len()), (n - 3, 3));
            assert!(others.contains(&hub));
        }
    }

    #[test]
    fn what_keeps_a_chain_from_being_one_is_a_leaf() {
        let chain: Vec<_> = (1..6).map(|i| (i - 1, i)).collect();
        assert_eq!(leaves(&[5; 6], &chain).0, vec![]);
        // Two hooks on the segment between blocks 2 and 3, one between 3 and 4, a rope at the end of the hook 6.
        let hooks = [
            (2, 6),
            (3, 6),
            (2, 7),
            (3, 7),
            (6, 7),
            (3, 8),
            (4, 8),
            (6, 9),
            (7, 9),
        ];
        let (found, others) = leaves(&[5; 10], &[chain.as_slice(), &hooks].concat());
        assert_eq!(others, (0..6).collect::<Vec<_>>(), "{found:?}");
        // No block of a ring is simplicial; its hook is.
        let mut ring = [chain.as_slice(), &[(0, 5), (0, 6), (5, 6)]].concat();
        assert_eq!(leaves(&[6; 7], &ring).0, vec![6]);
        // One that couples to blocks that are not coupled to each other is none.
        ring.push((2, 6));
        assert_eq!(leaves(&[6; 7], &ring).0, vec![]);
    }
}
