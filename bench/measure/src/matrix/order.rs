//! The elimination order of a matrix from anywhere.
//!
//! The backends that factorise in the order of the pattern rely on a good one. A system that a step wrote has one; of a
//! grid, or of a matrix from a collection, the natural order may fill everything. So the cost of both orders, the
//! natural one and that of minimum degree, is counted before anything is factorised, and the latter taken where it
//! saves at least half: reordering costs a little accuracy where the natural order pairs bodies with their constraints.

use std::sync::Arc;
use taut_solver::{
    BlockPattern, EliminationCost, SolveError, SymBlockMatrix, elimination_cost,
    minimum_degree_within,
};

/// Operations that the search for an order may take: some seconds.
const MOST_SEARCH: u64 = 2_000_000_000;

/// A symmetric matrix in the order that its factorisation is to take.
#[derive(Debug, Clone)]
pub struct Ordered {
    pub matrix: SymBlockMatrix,
    /// Scalar row of the original at each row; none where the order is the natural one.
    pub rows: Option<Vec<usize>>,
    /// Cost of the factorisation.
    pub cost: EliminationCost,
}

impl Ordered {
    /// `natural` or `minimum-degree`.
    pub fn name(&self) -> &'static str {
        if self.rows.is_some() {
            "minimum-degree"
        } else {
            "natural"
        }
    }
}

pub fn ordered(a: &SymBlockMatrix, most: EliminationCost) -> Result<Ordered, SolveError> {
    let p = a.pattern();
    let natural: Vec<usize> = (0..p.blocks()).collect();
    let own = elimination_cost(p, &natural, most)?;
    let as_it_is = |cost| Ordered {
        matrix: a.clone(),
        rows: None,
        cost,
    };
    if let Some(cost) = own
        && cost.is_without_fill(p)
    {
        return Ok(as_it_is(cost));
    }
    let least = minimum_degree_within(p, MOST_SEARCH);
    let cost = match &least {
        Some(order) => elimination_cost(p, order, most)?,
        None => None,
    };
    match (own, cost, least) {
        (Some(own), Some(cost), _) if own.flops <= cost.flops.saturating_mul(2) => {
            Ok(as_it_is(own))
        }
        (_, Some(cost), Some(order)) => Ok(Ordered {
            matrix: permuted(a, &order)?,
            rows: Some(order.iter().flat_map(|&block| p.rows(block)).collect()),
            cost,
        }),
        (Some(own), ..) => Ok(as_it_is(own)),
        (None, _, least) => Err(too_large(p, &least.unwrap_or(natural), most)),
    }
}

/// By how much the cost of an order is beyond `most`, counted up to a hundredfold.
fn too_large(p: &BlockPattern, order: &[usize], most: EliminationCost) -> SolveError {
    let hundredfold = EliminationCost {
        entries: most.entries.saturating_mul(100),
        flops: most.flops.saturating_mul(100),
    };
    let cost = elimination_cost(p, order, hundredfold);
    cost.ok().flatten().unwrap_or(hundredfold).too_large(most)
}

/// The matrix with its block rows in `order` (position → block).
fn permuted(a: &SymBlockMatrix, order: &[usize]) -> Result<SymBlockMatrix, SolveError> {
    let p = a.pattern();
    let mut place = vec![0; order.len()];
    for (at, &block) in order.iter().enumerate() {
        place[block] = at;
    }
    let sizes: Vec<usize> = order.iter().map(|&block| p.size(block)).collect();
    let groups = order.iter().map(|&block| p.groups()[block]).collect();
    let stored = || (0..p.blocks()).flat_map(|j| p.column(j).map(move |k| (k, p.row(k), j)));
    let couplings: Vec<_> = stored().map(|(_, i, j)| (place[i], place[j])).collect();
    let pattern = Arc::new(BlockPattern::new(&sizes, &couplings)?.with_groups(groups)?);
    let mut to = SymBlockMatrix::zeros(pattern.clone());
    for (k, i, j) in stored() {
        let (row, column) = (place[i].max(place[j]), place[i].min(place[j]));
        let Some(at) = pattern.find(row, column) else {
            continue;
        };
        let from = a.block(k);
        let block = to.block_mut(at);
        if place[i] >= place[j] {
            block.copy_from_slice(from);
        } else {
            let (m, n) = (p.size(i), p.size(j));
            for c in 0..n {
                for r in 0..m {
                    block[c + r * n] = from[r + c * m];
                }
            }
        }
    }
    Ok(to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reordered_matrix_is_the_same_matrix() {
        // A star with its hub first fills everything in the natural order.
        let n = 30;
        let sizes: Vec<usize> = (0..n).map(|i| 1 + i % 3).collect();
        let hub: Vec<_> = (1..n).map(|i| (0, i)).collect();
        let pattern = BlockPattern::new(&sizes, &hub).expect("a pattern");
        let groups = (0..n).map(|i| i as u32).collect();
        let pattern = Arc::new(pattern.with_groups(groups).expect("groups"));
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        for (i, v) in a.values_mut().iter_mut().enumerate() {
            *v = 1.0 + i as f64;
        }
        let found = ordered(&a, EliminationCost::LARGEST).expect("an order");
        assert_eq!(found.name(), "minimum-degree");
        assert!(found.cost.is_without_fill(found.matrix.pattern()));
        let rows = found.rows.expect("another order");
        // A diagonal block counts by its lower triangle.
        found.matrix.for_each_lower(|r, c, value| {
            let (r, c) = (rows[r], rows[c]);
            assert_eq!(value, a.get(r, c), "{r} {c}");
        });
        let group = |r: usize| pattern.groups()[pattern.block_of_row(r)];
        let p = found.matrix.pattern();
        for (r, &from) in rows.iter().enumerate() {
            assert_eq!(p.groups()[p.block_of_row(r)], group(from));
        }
    }

    #[test]
    fn a_good_order_is_kept_and_too_much_fill_refused() {
        let chain: Vec<_> = (1..9).map(|i| (i, i - 1)).collect();
        let a = SymBlockMatrix::zeros(Arc::new(BlockPattern::new(&[2; 9], &chain).expect("sound")));
        let found = ordered(&a, EliminationCost::LARGEST)
            .expect("an order")
            .name();
        assert_eq!(found, "natural");
        let all: Vec<_> = (0..9).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
        let a = SymBlockMatrix::zeros(Arc::new(BlockPattern::new(&[2; 9], &all).expect("sound")));
        let small = EliminationCost {
            flops: 100,
            ..EliminationCost::LARGEST
        };
        let e = ordered(&a, small).expect_err("too much");
        assert!(matches!(e, SolveError::TooLarge { .. }), "{e}");
    }
}
