//! Elimination orders: what one costs, and one that is cheap.
//!
//! A block LDLᵀ without pivoting works in any order of the blocks, and the order decides its fill. Column k of L
//! reaches those rows i > k that have a neighbour in the subtree of the elimination tree below k (Liu 1990): walking
//! the tree from the neighbours of each row counts the factor without forming it.
//!
//! The order of minimum degree (George, Liu 1989) eliminates the block with the fewest scalar rows coupled to it, and
//! with it all that are coupled to nothing else. Blocks whose neighbours are coupled to each other already come before
//! all others, since they fill nothing; a tree is eliminated by them alone.

use crate::{BlockPattern, SolveError};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Size and operations of a block LDLᵀ in some order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EliminationCost {
    /// Scalar entries of the block factor, diagonal blocks in full.
    pub entries: u64,
    /// Additions, multiplications and divisions of the factorisation, blocks taken as dense; r² + 2 r for a scalar
    /// column with r entries below its diagonal.
    pub flops: u64,
}

impl EliminationCost {
    /// No limit.
    pub const MAX: Self = Self {
        entries: u64::MAX,
        flops: u64::MAX,
    };

    /// The largest factor that is tried: some gigabytes, some minutes.
    pub const LARGEST: Self = Self {
        entries: 200_000_000,
        flops: 200_000_000_000,
    };

    /// Limit for an order without fill: as many entries as the matrix stores, any number of
    /// operations.
    #[must_use]
    pub fn without_fill(pattern: &BlockPattern) -> Self {
        Self {
            entries: pattern.stored_values() as u64,
            ..Self::MAX
        }
    }

    /// Returns true if neither number exceeds that of `most`.
    #[must_use]
    pub fn is_within(&self, most: Self) -> bool {
        self.entries <= most.entries && self.flops <= most.flops
    }

    /// The error that says by how much this is beyond `most`.
    #[must_use]
    pub fn too_large(&self, most: Self) -> SolveError {
        let (size, limit, what) = if self.flops > most.flops {
            (
                self.flops,
                most.flops,
                "operations in its factorisation in this order",
            )
        } else {
            (
                self.entries,
                most.entries,
                "entries in its factor in this order",
            )
        };
        let [size, limit] = [size, limit].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        SolveError::TooLarge { size, limit, what }
    }

    /// Returns true if a factor of this cost has as many entries as the matrix stores: the order
    /// fills nothing.
    #[must_use]
    pub fn is_without_fill(&self, pattern: &BlockPattern) -> bool {
        self.entries == pattern.stored_values() as u64
    }
}

/// All neighbours of each block, ascending: both triangles of a pattern, without the diagonal.
pub(crate) fn neighbours(pattern: &BlockPattern) -> Vec<Vec<usize>> {
    let mut neighbours = vec![Vec::new(); pattern.blocks()];
    for j in 0..pattern.blocks() {
        for k in pattern.column(j).skip(1) {
            neighbours[pattern.row(k)].push(j);
        }
    }
    // Rows above came in ascending order; those below are ascending in each column.
    for (j, neighbours) in neighbours.iter_mut().enumerate() {
        neighbours.extend(pattern.column(j).skip(1).map(|k| pattern.row(k)));
    }
    neighbours
}

/// Position of each block in an order (position → block).
pub(crate) fn positions(order: &[usize], blocks: usize) -> Result<Vec<usize>, SolveError> {
    crate::error::expect_len("elimination order", blocks, order.len())?;
    let mut position = vec![usize::MAX; blocks];
    for (at, &block) in order.iter().enumerate() {
        match position.get_mut(block) {
            Some(to) if *to == usize::MAX => *to = at,
            _ => {
                return Err(SolveError::InvalidOption {
                    option: "elimination order",
                    allowed: "every block once",
                });
            }
        }
    }
    Ok(position)
}

/// The cost of eliminating the blocks in `order` (position → block), or `None` where that is more than `most` in
/// either. Time in proportion to the blocks of the factor or, where that is less, to what `most` allows; memory to
/// those of the matrix. Allocates.
///
/// # Errors
/// [`SolveError::Dimension`] and [`SolveError::InvalidOption`] where `order` is no permutation of the blocks.
pub fn elimination_cost(
    pattern: &BlockPattern,
    order: &[usize],
    most: EliminationCost,
) -> Result<Option<EliminationCost>, SolveError> {
    let cost = cost_until(pattern, order, most)?;
    Ok(cost.is_within(most).then_some(cost))
}

/// Fails with [`SolveError::TooLarge`] where the order of the pattern costs more than [`EliminationCost::LARGEST`].
#[allow(dead_code)] // where no backend that uses it is compiled in
pub(crate) fn expect_affordable(pattern: &BlockPattern) -> Result<(), SolveError> {
    let most = EliminationCost::LARGEST;
    let natural: Vec<usize> = (0..pattern.blocks()).collect();
    let cost = cost_until(pattern, &natural, most)?;
    if cost.is_within(most) {
        return Ok(());
    }
    Err(cost.too_large(most))
}

/// The cost of an order, or what it has come to where it passes `most`.
fn cost_until(
    pattern: &BlockPattern,
    order: &[usize],
    most: EliminationCost,
) -> Result<EliminationCost, SolveError> {
    const NONE: usize = usize::MAX;
    let blocks = pattern.blocks();
    let position = positions(order, blocks)?;
    let neighbours = neighbours(pattern);
    let size = |block: usize| pattern.size(block) as u64;
    let mut cost = EliminationCost::default();
    // All by position: parent in the elimination tree, last row that met the column, scalar rows below the diagonal.
    let (mut parent, mut met) = (vec![NONE; blocks], vec![NONE; blocks]);
    let mut below = vec![0_u64; blocks];
    for (i, &block) in order.iter().enumerate() {
        let m = size(block);
        cost.entries = cost.entries.saturating_add(m.saturating_mul(m));
        cost.flops = cost.flops.saturating_add(triangle_flops(m));
        met[i] = i;
        for &neighbour in &neighbours[block] {
            let mut k = position[neighbour];
            if k > i {
                continue;
            }
            while met[k] != i {
                met[k] = i;
                let n = size(order[k]);
                let entries = m.saturating_mul(n);
                cost.entries = cost.entries.saturating_add(entries);
                // r² + 2 r of n scalar columns, less the same without these m rows.
                let flops = entries.saturating_mul(2 * below[k] + m + n + 1);
                cost.flops = cost.flops.saturating_add(flops);
                below[k] += m;
                if parent[k] == NONE {
                    parent[k] = i;
                }
                k = parent[k];
            }
            if !cost.is_within(most) {
                return Ok(cost);
            }
        }
    }
    Ok(cost)
}

/// The pattern of the block LDLᵀ of matrices of `p` in its order: that of the matrix and its fill, for eliminating
/// column k couples all rows of that column with each other. Allocates.
///
/// # Errors
/// [`SolveError::TooLarge`] where the factor has more than 2²⁷ blocks (whose places alone take gigabytes).
pub fn factor_pattern(p: &BlockPattern) -> Result<BlockPattern, SolveError> {
    let blocks = p.blocks();
    let sizes: Vec<usize> = (0..blocks).map(|i| p.size(i)).collect();
    let mut rows_of: Vec<Vec<usize>> = (0..blocks)
        .map(|j| p.column(j).skip(1).map(|k| p.row(k)).collect())
        .collect();
    let mut couplings = Vec::new();
    for j in 0..blocks {
        // It is enough to hand the rows to the first of them: the parent in the elimination tree.
        let rows = std::mem::take(&mut rows_of[j]);
        if couplings.len() + rows.len() > MOST_BLOCKS {
            return Err(SolveError::TooLarge {
                size: couplings.len() + rows.len(),
                limit: MOST_BLOCKS,
                what: "blocks in its factor",
            });
        }
        couplings.extend(rows.iter().map(|&i| (i, j)));
        if let Some((&parent, rest)) = rows.split_first() {
            let merged = &mut rows_of[parent];
            merged.extend_from_slice(rest);
            // Two ascending runs, which a stable sort merges.
            merged.sort();
            merged.dedup();
        }
    }
    BlockPattern::new(&sizes, &couplings)
}

/// Most blocks of a factor.
const MOST_BLOCKS: usize = 1 << 27;

/// Flops of the LDLᵀ of a dense n × n block: Σ r² + 2 r for r = 0 … n − 1.
fn triangle_flops(n: u64) -> u64 {
    let before = n.saturating_sub(1);
    let squares = before.saturating_mul(n).saturating_mul(2 * n.max(1) - 1) / 6;
    squares.saturating_add(before.saturating_mul(n))
}

/// An order of minimum degree (position → block). A pattern that is the line graph of a tree, as S of a tree of bodies,
/// is eliminated without fill, a chain from its first block on. Ties go to the lower block. Time and memory at most
/// those of the blocks of the factor times the largest number of neighbours. Allocates.
#[must_use]
pub fn minimum_degree(pattern: &BlockPattern) -> Vec<usize> {
    minimum_degree_within(pattern, u64::MAX).unwrap_or_default()
}

/// [`minimum_degree`], or `None` where finding it takes more than about `most` operations: for patterns of which nothing
/// is known. Allocates.
#[must_use]
pub fn minimum_degree_within(pattern: &BlockPattern, most: u64) -> Option<Vec<usize>> {
    let mut graph = EliminationGraph::new(pattern);
    // Last in, first out: the lowest at first, then what the last elimination has touched.
    let mut candidates: Vec<usize> = (0..pattern.blocks()).rev().collect();
    while let Some(block) = candidates.pop() {
        if !graph.eliminated[block] && graph.is_simplicial(block) {
            candidates.extend(graph.eliminate(block, true).iter().rev());
        }
        if graph.work > most {
            return None;
        }
    }
    let degrees = (0..pattern.blocks()).filter(|&b| !graph.eliminated[b]);
    let mut queue: BinaryHeap<_> = degrees.map(|b| Reverse((graph.degree(b), b))).collect();
    let mut last: Vec<usize> = (0..pattern.blocks()).map(|b| graph.degree(b)).collect();
    while let Some(Reverse((degree, block))) = queue.pop() {
        if graph.eliminated[block] || degree != last[block] {
            continue;
        }
        for touched in graph.eliminate(block, false) {
            last[touched] = graph.degree(touched);
            queue.push(Reverse((last[touched], touched)));
        }
        if graph.work > most {
            return None;
        }
    }
    Some(graph.order)
}

/// The elimination graph: the remaining blocks of a matrix and their couplings.
struct EliminationGraph<'a> {
    pattern: &'a BlockPattern,
    /// Blocks that each block is coupled to, ascending; some may be eliminated.
    neighbours: Vec<Vec<usize>>,
    /// How many of them are not.
    count: Vec<usize>,
    eliminated: Vec<bool>,
    order: Vec<usize>,
    /// Stamp of the last set that each block was in.
    mark: Vec<usize>,
    stamp: usize,
    /// Room for a union.
    union: Vec<usize>,
    /// Neighbours read so far.
    work: u64,
}

impl<'a> EliminationGraph<'a> {
    fn new(pattern: &'a BlockPattern) -> Self {
        let blocks = pattern.blocks();
        let neighbours = neighbours(pattern);
        Self {
            pattern,
            count: neighbours.iter().map(Vec::len).collect(),
            neighbours,
            eliminated: vec![false; blocks],
            order: Vec::with_capacity(blocks),
            mark: vec![0; blocks],
            stamp: 0,
            union: Vec::new(),
            work: 0,
        }
    }

    /// Scalar rows of the neighbours.
    fn degree(&self, block: usize) -> usize {
        self.left(block).map(|b| self.pattern.size(b)).sum()
    }

    /// Marks a block and its neighbours.
    fn mark_with_neighbours(&mut self, block: usize) {
        self.stamp += 1;
        self.mark[block] = self.stamp;
        for &b in &self.neighbours[block] {
            self.mark[b] = self.stamp;
        }
    }

    /// Returns true if the neighbours of a block are all coupled to each other: eliminating it
    /// fills nothing.
    fn is_simplicial(&self, block: usize) -> bool {
        let degree = self.count[block];
        // From the end: the low ones are eliminated first, and those that are stay in the list.
        if self.left(block).rev().any(|b| self.count[b] < degree) {
            return false;
        }
        // Searched, not scanned: a neighbour may be coupled to very many others.
        let coupled = |a: usize, b: usize| self.neighbours[a].binary_search(&b).is_ok();
        self.left(block)
            .all(|a| self.left(block).all(|b| b == a || coupled(a, b)))
    }

    /// The neighbours of a block that are not yet eliminated, ascending.
    fn left(&self, block: usize) -> impl DoubleEndedIterator<Item = usize> {
        let neighbours = self.neighbours[block].iter().copied();
        neighbours.filter(|&b| !self.eliminated[b])
    }

    /// Eliminates a block and those of its neighbours that are coupled to nothing else, which then fill nothing more.
    /// Returns the other neighbours, which are coupled to each other now, ascending; they were before if the block is
    /// `simplicial`.
    fn eliminate(&mut self, block: usize, simplicial: bool) -> Vec<usize> {
        self.mark_with_neighbours(block);
        let degree = self.count[block];
        let marked = |b: usize| self.mark[b] == self.stamp;
        let (with, rest): (Vec<usize>, Vec<usize>) = self
            .left(block)
            .partition(|&b| self.count[b] <= degree && self.left(b).all(marked));
        let gone = 1 + with.len();
        self.work += degree as u64;
        for b in std::iter::once(block).chain(with) {
            self.eliminated[b] = true;
            self.neighbours[b] = Vec::new();
            self.order.push(b);
        }
        for &b in &rest {
            if simplicial {
                self.count[b] -= gone;
                // A list that is mostly eliminated is cleaned, so that reading lists stays cheap.
                if 2 * self.count[b] >= self.neighbours[b].len() {
                    continue;
                }
            }
            let mut union = std::mem::take(&mut self.union);
            merge(self.left(b), &rest, b, &mut union);
            self.work += (self.neighbours[b].len() + rest.len()) as u64;
            self.neighbours[b].clone_from(&union);
            self.count[b] = union.len();
            self.union = union;
        }
        rest
    }
}

/// The union of two ascending sequences without `but`, ascending.
fn merge(a: impl Iterator<Item = usize>, b: &[usize], but: usize, union: &mut Vec<usize>) {
    union.clear();
    let mut b = b.iter().copied().filter(|&x| x != but).peekable();
    for a in a {
        while let Some(b) = b.next_if(|&b| b < a) {
            union.push(b);
        }
        b.next_if_eq(&a);
        union.push(a);
    }
    union.extend(b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block_ldlt::BlockLdlt;

    /// Numbers below a bound, always the same.
    struct Numbers(u64);

    impl Numbers {
        fn below(&mut self, bound: usize) -> usize {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (self.0 >> 33) as usize % bound
        }

        fn shuffled(&mut self, n: usize) -> Vec<usize> {
            let mut order: Vec<usize> = (0..n).collect();
            for i in (1..n).rev() {
                order.swap(i, self.below(i + 1));
            }
            order
        }
    }

    fn in_scene_order(pattern: &BlockPattern) -> Vec<usize> {
        (0..pattern.blocks()).collect()
    }

    fn cost(pattern: &BlockPattern, order: &[usize]) -> EliminationCost {
        elimination_cost(pattern, order, EliminationCost::MAX)
            .unwrap()
            .unwrap()
    }

    /// Line graph of a tree with `edges` edges, numbered at random: edges are coupled where they share an end.
    fn tree(edges: usize, seed: u64) -> BlockPattern {
        let mut numbers = Numbers(seed);
        let label = numbers.shuffled(edges);
        let sizes: Vec<usize> = (0..edges).map(|_| 1 + numbers.below(6)).collect();
        let mut at_vertex = vec![Vec::new(); edges + 1];
        for v in 1..=edges {
            // Among the last few vertices, so that the tree is deep.
            let parent = v - 1 - numbers.below(v.min(4));
            at_vertex[parent].push(label[v - 1]);
            at_vertex[v].push(label[v - 1]);
        }
        let mut couplings = Vec::new();
        for edges in &at_vertex {
            for (i, &a) in edges.iter().enumerate() {
                couplings.extend(edges[..i].iter().map(|&b| (a, b)));
            }
        }
        BlockPattern::new(&sizes, &couplings).unwrap()
    }

    fn ring(n: usize) -> BlockPattern {
        let couplings: Vec<_> = (0..n).map(|i| (i, (i + 1) % n)).collect();
        BlockPattern::new(&vec![3; n], &couplings).unwrap()
    }

    /// The pattern in another order.
    fn permuted(pattern: &BlockPattern, order: &[usize]) -> BlockPattern {
        let position = positions(order, pattern.blocks()).unwrap();
        let sizes: Vec<usize> = order.iter().map(|&b| pattern.size(b)).collect();
        let mut couplings = Vec::new();
        for j in 0..pattern.blocks() {
            let column = pattern.column(j).skip(1);
            couplings.extend(column.map(|k| (position[pattern.row(k)], position[j])));
        }
        BlockPattern::new(&sizes, &couplings).unwrap()
    }

    /// Entries as the factorisation itself allocates them, flops as counted scalar by scalar on its columns.
    #[test]
    fn costs_are_those_of_the_factor() {
        let mut numbers = Numbers(7);
        for case in 0..40 {
            let n = 1 + numbers.below(20);
            let sizes: Vec<usize> = (0..n).map(|_| numbers.below(6)).collect();
            let pairs = (0..2 * n).map(|_| (numbers.below(n), numbers.below(n)));
            let pattern = BlockPattern::new(&sizes, &pairs.collect::<Vec<_>>()).unwrap();
            let order = numbers.shuffled(n);
            let other = permuted(&pattern, &order);
            let found = cost(&pattern, &order);
            let factor = BlockLdlt::<f64>::new(&other, &other).unwrap();
            assert_eq!(found.entries, factor.factor_values() as u64, "case {case}");
            assert_eq!(found, cost(&other, &in_scene_order(&other)));
            let flops = factor.scalar_column_lengths().map(|r| r * r + 2 * r);
            assert_eq!(found.flops, flops.sum::<u64>(), "case {case}");
            // Given up exactly where the limit is passed.
            let limited = |flops| {
                let most = EliminationCost {
                    flops,
                    ..EliminationCost::MAX
                };
                elimination_cost(&pattern, &order, most).unwrap()
            };
            assert_eq!(limited(found.flops), Some(found));
            assert!(found.flops == 0 || limited(found.flops - 1).is_none());
            let unfilled = EliminationCost::without_fill(&pattern);
            let unfilled = elimination_cost(&pattern, &order, unfilled).unwrap();
            assert_eq!(unfilled.is_some(), found.is_without_fill(&pattern));
        }
    }

    #[test]
    fn trees_are_eliminated_without_fill() {
        for (edges, seed) in [(1, 1), (2, 2), (10, 3), (100, 4), (1000, 5), (1000, 6)] {
            let pattern = tree(edges, seed);
            let order = minimum_degree(&pattern);
            assert!(cost(&pattern, &order).is_without_fill(&pattern), "{edges}");
        }
        // A hub with long arms: the arms' inner blocks have lower degrees than what ends in the hub.
        let mut couplings = Vec::new();
        for i in 0..50 {
            couplings.extend((0..i).map(|j| (i, j)));
            couplings.extend([(i, 50 + i), (50 + i, 100 + i)]);
        }
        let pattern = BlockPattern::new(&[6; 150], &couplings).unwrap();
        assert!(cost(&pattern, &minimum_degree(&pattern)).is_without_fill(&pattern));
    }

    #[test]
    fn chains_keep_their_order() {
        let couplings: Vec<_> = (1..50).map(|i| (i - 1, i)).collect();
        let pattern = BlockPattern::new(&[3, 6].repeat(25), &couplings).unwrap();
        assert_eq!(minimum_degree(&pattern), in_scene_order(&pattern));
        let none = BlockPattern::new(&[], &[]).unwrap();
        assert_eq!(minimum_degree(&none), []);
        assert_eq!(cost(&none, &[]), EliminationCost::default());
    }

    #[test]
    fn a_ring_costs_in_proportion_to_its_length() {
        let per_block = |n: usize| {
            let pattern = ring(n);
            cost(&pattern, &minimum_degree(&pattern)).flops as f64 / n as f64
        };
        assert!((per_block(1000) / per_block(100) - 1.0).abs() < 0.05);
        // The ring's factor has one block more than the ring in all columns but the last three.
        let pattern = ring(100);
        let entries = cost(&pattern, &minimum_degree(&pattern)).entries;
        assert_eq!(entries, pattern.stored_values() as u64 + 9 * 97);
    }

    /// A grid's band has n² n entries, an order of minimum degree some n² log n.
    #[test]
    fn minimum_degree_beats_the_band_of_a_grid() {
        let n = 30;
        let mut couplings = Vec::new();
        for i in 0..n * n {
            couplings.extend((i % n > 0).then(|| (i, i - 1)));
            couplings.extend((i >= n).then(|| (i, i - n)));
        }
        let pattern = BlockPattern::new(&vec![1; n * n], &couplings).unwrap();
        let band = cost(&pattern, &in_scene_order(&pattern));
        let order = minimum_degree(&pattern);
        let least = cost(&pattern, &order);
        assert!(3 * least.flops < band.flops, "{least:?} {band:?}");
        assert_eq!(order, minimum_degree(&pattern));
    }

    /// Chains and trees of 10⁵ blocks, and a border that would fill them, take a moment.
    #[test]
    fn large_patterns_take_little_time() {
        let pattern = tree(100_000, 8);
        assert!(cost(&pattern, &minimum_degree(&pattern)).is_without_fill(&pattern));
        // A hub first: a block of the factor for each pair of the others, if the limit did not hold.
        let n = 100_000;
        let hub: Vec<_> = (1..n).map(|i| (0, i)).collect();
        let pattern = BlockPattern::new(&vec![6; n], &hub).unwrap();
        let order = in_scene_order(&pattern);
        let most = EliminationCost {
            flops: 1 << 40,
            ..EliminationCost::MAX
        };
        assert_eq!(elimination_cost(&pattern, &order, most), Ok(None));
        assert!(cost(&pattern, &minimum_degree(&pattern)).is_without_fill(&pattern));
    }

    #[test]
    fn orders_that_are_none_are_refused() {
        let pattern = ring(3);
        for order in [&[0, 1][..], &[0, 1, 1], &[0, 1, 3]] {
            let holds = elimination_cost(&pattern, order, EliminationCost::MAX).is_err();
            assert!(holds, "{order:?}");
        }
    }
}
