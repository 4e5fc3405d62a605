//! Direct solver: block LDLᵀ without pivoting. Positive definite and quasi-definite matrices.
//!
//! A cable, or several, is a chain, eliminated from both ends (the mathematics is in `chain`); what hangs on it goes
//! before it (`chain/leaves`), and a few blocks that close loops or join branches become its border rows
//! (`chain/bordered`). All other patterns, blocks of more than six rows,
//! and matrices that are not positive definite, go the general way in the order of the pattern (`block_ldlt`).
//!
//! Matrices with a weak pivot go the general way too, after which inverse iteration tells whether they are singular
//! (`singularity`). A good indefinite matrix with a weak pivot loses as many digits in its factor, which corrections bring back
//! (`claim`).

use super::direct::{Common, Direct};
use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::chain::Chain;
use crate::chain::bordered::{self, Bordered};
use crate::chain::leaves::{self, Leaves};
use crate::chain::overlay::Offsets;
use crate::error::columns;
use crate::ordering::{expect_affordable, positions};
use crate::singularity::{SingularityTest, WEAK};
use crate::{AnalyzeReport, BlockPattern, FactorReport, SolveError, SymBlockMatrix};
use std::sync::Arc;
use taut_lanes::Level;

/// The `banded` backend.
#[derive(Debug, Default)]
pub(crate) struct Banded {
    common: Common,
    /// Where the pattern has a faster way.
    fast: Option<ChainFactor>,
    /// An error where the order of the pattern fills too much for it, and there is a faster way.
    in_order: Option<Result<BlockLdlt<f64>, SolveError>>,
    singularity: SingularityTest,
    last: FactorKind,
}

/// Which factor the last factorisation made.
#[derive(Debug, Clone, Copy, Default)]
enum FactorKind {
    #[default]
    InOrder,
    Chain,
}

/// A factor of a positive definite matrix that is not eliminated in the order of the pattern.
#[derive(Debug)]
struct ChainFactor {
    leaves: Option<Leaves>,
    rest: Remainder,
}

/// The blocks that are no leaves.
#[derive(Debug)]
enum Remainder {
    /// A chain of small blocks.
    Chain(Box<Chain>),
    /// One with a few rows besides.
    Bordered(Box<Bordered>),
}

impl ChainFactor {
    /// The first of these that the pattern is, if any: a chain; leaves on a chain, with a border or without; a chain with a
    /// border.
    fn new(pattern: &BlockPattern, level: Level) -> Option<Self> {
        let chain = |of: &[usize], offsets: Offsets<'_>| {
            Chain::of(of, offsets, level).map(|c| Remainder::Chain(Box::new(c)))
        };
        let bordered = |of: &[usize], offsets: Offsets<'_>| {
            Bordered::of(of, offsets, level).map(|b| Remainder::Bordered(Box::new(b)))
        };
        let all: Vec<usize> = (0..pattern.blocks()).collect();
        let own = Offsets::from(pattern);
        let whole = |rest| Self { leaves: None, rest };
        let on_leaves = || {
            let (leaves, others) = Leaves::new(pattern)?;
            let offsets = leaves.offsets(pattern);
            let rest = chain(&others, offsets).or_else(|| bordered(&others, offsets))?;
            let leaves = Some(leaves);
            Some(Self { leaves, rest })
        };
        let last = || bordered(&all, own).map(whole);
        chain(&all, own).map(whole).or_else(on_leaves).or_else(last)
    }

    #[cfg(test)]
    /// Scalar rows of the border.
    fn border_rows(&self) -> usize {
        match &self.rest {
            Remainder::Chain(_) => 0,
            Remainder::Bordered(factor) => factor.border_rows(),
        }
    }

    /// Factorises `a`; returns true if all pivots are positive and clear of rounding.
    fn factorize(&mut self, a: &SymBlockMatrix) -> bool {
        let (a, magnitudes) = match &mut self.leaves {
            None => (a.into(), None),
            Some(leaves) => match leaves.factorize(a) {
                Some((rest, magnitudes)) => (rest, Some(magnitudes)),
                None => return false,
            },
        };
        match &mut self.rest {
            Remainder::Chain(c) => c.factorize(a, WEAK) && magnitudes.is_none_or(|m| c.is_sound(m)),
            Remainder::Bordered(factor) => factor.factorize(a, magnitudes),
        }
    }

    fn solve(&mut self, b: &[f64], x: &mut [f64]) {
        let rest = &mut self.rest;
        let mut solve = |b: &[f64], x: &mut [f64]| match rest {
            Remainder::Chain(chain) => chain.solve(b, x),
            Remainder::Bordered(factor) => factor.solve(b, x),
        };
        match &mut self.leaves {
            None => solve(b, x),
            Some(leaves) => leaves.solve(b, x, solve),
        }
    }
}

/// Scalar rows of the border where blocks of positive definite matrices of `pattern`, taken in `order` (position → block),
/// are a chain with leaves and a border, 0 where they are less; `None` where they are more: those of [`ChainFactor::new`].
pub(crate) fn border_rows(
    pattern: &BlockPattern,
    order: &[usize],
) -> Result<Option<usize>, SolveError> {
    positions(order, pattern.blocks())?;
    let all: Vec<usize> = (0..pattern.blocks()).collect();
    let permuted;
    let pattern = if *order == all {
        pattern
    } else {
        permuted = pattern.permuted(order)?;
        &permuted
    };
    let chain = |of: &[usize]| Chain::is(of, pattern).then_some(0);
    let on_leaves = || {
        let others = leaves::others(pattern)?;
        chain(&others).or_else(|| bordered::border_rows(&others, pattern))
    };
    let last = || bordered::border_rows(&all, pattern);
    Ok(chain(&all).or_else(on_leaves).or_else(last))
}

impl Direct for Banded {
    const NAME: &'static str = "banded";

    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn prepare(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        self.fast = ChainFactor::new(pattern, Level::best());
        let in_order = match &self.fast {
            None => Ok(BlockLdlt::new(pattern, pattern)?),
            Some(_) => expect_affordable(pattern).and_then(|()| BlockLdlt::new(pattern, pattern)),
        };
        let factor_entries = in_order.as_ref().ok().map(BlockLdlt::factor_values);
        self.in_order = Some(in_order);
        self.singularity = SingularityTest::new(pattern.dim());
        Ok(AnalyzeReport { factor_entries })
    }

    fn eliminate(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        // A value that is not finite leaves a pivot that is not finite. The fast path takes
        // positive definite matrices only. Others have a factor in the order of the pattern at best
        // ([M Jᵀ; J 0] with M first).
        let fast = self.fast.as_mut().is_some_and(|fast| fast.factorize(a));
        self.last = if fast {
            FactorKind::Chain
        } else {
            FactorKind::InOrder
        };
        if let (FactorKind::InOrder, Some(in_order)) = (self.last, &mut self.in_order) {
            // It accepts more, and says what it does not.
            a.check_finite()?;
            let in_order = in_order.as_mut().map_err(|e| e.clone())?;
            in_order.factorize(a, Pivots::Nonzero)?;
            in_order.test(a, &mut self.singularity)?;
        }
        Ok(FactorReport::default())
    }

    fn is_stable(&self) -> bool {
        match (self.last, &self.in_order) {
            (FactorKind::InOrder, Some(Ok(factor))) => factor.is_positive(),
            _ => true,
        }
    }

    fn is_doubtful(&self) -> bool {
        matches!(self.last, FactorKind::InOrder) && self.singularity.is_doubtful()
    }

    fn substitute(
        &mut self,
        _: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError> {
        match (self.last, &mut self.fast, &self.in_order) {
            (FactorKind::Chain, Some(fast), _) => fast.solve(b, x),
            (.., Some(Ok(factor))) => {
                x.copy_from_slice(b);
                factor.solve(x);
            }
            (.., None | Some(Err(_))) => {}
        }
        Ok(())
    }

    /// A chain takes two right-hand sides at a time.
    fn substitute_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError> {
        let n = a.dim();
        for (b, x) in columns(2 * n, b, x) {
            match (self.last, &mut self.fast) {
                (
                    FactorKind::Chain,
                    Some(ChainFactor {
                        leaves: None,
                        rest: Remainder::Chain(chain),
                    }),
                ) if b.len() > n => {
                    let (b, x) = (b.split_at(n), x.split_at_mut(n));
                    chain.solve_two([b.0, b.1], [x.0, x.1]);
                }
                _ => {
                    for (b, x) in columns(n, b, x) {
                        self.substitute(a, b, x)?;
                    }
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use crate::{LinearSolver, backward_error};

    fn matrix(sizes: &[usize], couplings: &[(usize, usize)], values: &[f64]) -> SymBlockMatrix {
        let pattern = BlockPattern::new(sizes, couplings).expect("a pattern");
        let mut a = SymBlockMatrix::zeros(Arc::new(pattern));
        a.values_mut().copy_from_slice(values);
        a
    }

    fn solved(a: &SymBlockMatrix, b: &[f64]) -> Result<Vec<f64>, SolveError> {
        let (mut solver, mut x) = (Banded::default(), vec![0.0; b.len()]);
        solver.analyze(a.pattern())?;
        solver.factorize(a)?;
        solver.solve(a, b, &mut x)?;
        Ok(x)
    }

    /// A chain from its last block on has no first pivot where that is rigid: masses come before what joins them.
    #[test]
    fn a_rigid_kkt_matrix_is_eliminated_in_its_order() {
        // Masses of 2 and 3, each before a rigid joint.
        let values = [2.0, 1.0, 0.0, -1.0, 3.0, 1.0, 0.0];
        let a = matrix(&[1; 4], &[(0, 1), (1, 2), (2, 3)], &values);
        let b = [1.0, 2.0, 3.0, 4.0];
        let x = solved(&a, &b).expect("solved");
        assert!(backward_error(&a, &b, &x).expect("finite").componentwise < 1e-15);
        // The joint first.
        let a = matrix(&[1; 2], &[(0, 1)], &[0.0, 1.0, 2.0]);
        assert_eq!(solved(&a, &b[..2]), Err(SolveError::Singular { block: 0 }));
    }

    /// A chain or ring of `n` blocks of `size` rows, and after it hooks of three rows, each between a block and the next.
    fn with_hooks(n: usize, size: usize, ring: bool, hooks: &[usize]) -> SymBlockMatrix {
        let mut couplings: Vec<_> = (1..n).map(|i| (i - 1, i)).collect();
        if ring {
            couplings.push((0, n - 1));
        }
        for (h, &k) in hooks.iter().enumerate() {
            couplings.extend([(k, n + h), (k + 1, n + h)]);
            let same = (0..h).filter(|&g| hooks[g] == k);
            couplings.extend(same.map(|g| (n + g, n + h)));
        }
        let sizes = [vec![size; n], vec![3; hooks.len()]].concat();
        let pattern = Arc::new(BlockPattern::new(&sizes, &couplings).expect("a pattern"));
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        for (k, v) in a.values_mut().iter_mut().enumerate() {
            *v = (k as f64 * 0.7).sin();
        }
        for j in 0..pattern.blocks() {
            let n = pattern.size(j);
            let diagonal = a.block_mut(pattern.column(j).start);
            for r in 0..n {
                for c in 0..r {
                    diagonal[c + n * r] = diagonal[r + n * c];
                }
                diagonal[r * (n + 1)] = 30.0;
            }
        }
        a
    }

    #[test]
    fn hooks_go_before_chains_and_rings() {
        let all: Vec<usize> = (0..8).collect();
        for (ring, hooks) in [
            (false, [3].as_slice()),
            (false, &[0, 3, 3, 7]),
            (false, &all),
            (true, &[0, 4, 7]),
            (true, &[2, 2, 2, 5]),
        ] {
            // Under Miri, which takes minutes for all, one of them.
            let sizes: &[usize] = if cfg!(miri) { &[3] } else { &[2, 3, 4, 5, 6] };
            for &size in sizes {
                let a = with_hooks(9, size, ring, hooks);
                let b: Vec<f64> = (0..a.dim()).map(|i| (i as f64).cos()).collect();
                for level in Level::available() {
                    let mut solver = Banded::default();
                    solver.analyze(a.pattern()).expect("analysed");
                    let fast = ChainFactor::new(a.pattern(), level).expect("a fast way");
                    assert!(fast.leaves.is_some());
                    // One block closes a ring.
                    let rows = if ring { size } else { 0 };
                    assert_eq!(fast.border_rows(), rows, "{hooks:?}");
                    let order: Vec<usize> = (0..a.pattern().blocks()).collect();
                    assert_eq!(border_rows(a.pattern(), &order), Ok(Some(rows)));
                    solver.fast = Some(fast);
                    let mut x = vec![f64::NAN; b.len()];
                    // Twice: nothing is left of the first.
                    for _ in 0..2 {
                        solver.factorize(&a).expect("factorised");
                        assert!(matches!(solver.last, FactorKind::Chain));
                        solver.solve(&a, &b, &mut x).expect("solved");
                        let e = backward_error(&a, &b, &x).expect("finite");
                        assert!(e.componentwise < 2e-15, "{level} {size} {hooks:?}: {e:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_hook_that_repeats_a_joint_is_named() {
        // A chain of three blocks of one row and a second row like the first; all but the noise of its elimination.
        let couplings = [(0, 1), (1, 2), (0, 3), (1, 3)];
        let values = [0.3, 0.1, 0.3, 5.0, 0.7, 0.1, 4.0, 0.3];
        let a = matrix(&[1; 4], &couplings, &values);
        let mut solver = Banded::default();
        solver.analyze(a.pattern()).expect("analysed");
        assert!(solver.fast.as_ref().is_some_and(|f| f.leaves.is_some()));
        let found = solved(&a, &[1.0; 4]);
        assert_eq!(found, Err(SolveError::Singular { block: 3 }));
    }

    /// One solver takes definite and indefinite matrices in turns.
    #[test]
    fn the_way_is_chosen_for_each_matrix() {
        let definite = matrix(&[1; 3], &[(0, 1), (1, 2)], &[2.0, -1.0, 2.0, -1.0, 2.0]);
        let pattern = definite.pattern().clone();
        let mut indefinite = SymBlockMatrix::zeros(pattern.clone());
        let values = [2.0, 1.0, 0.0, 1.0, -3.0];
        indefinite.values_mut().copy_from_slice(&values);
        let mut solver = Banded::default();
        solver.analyze(&pattern).expect("analysed");
        for a in [&definite, &indefinite, &definite] {
            let (b, mut x) = ([1.0, 2.0, 3.0], [0.0; 3]);
            solver.factorize(a).expect("factorised");
            solver.solve(a, &b, &mut x).expect("solved");
            assert!(backward_error(a, &b, &x).expect("finite").componentwise < 1e-15);
        }
    }

    /// Dependence does not hang on one pivot, on the fast way or the general one.
    #[test]
    fn springs_that_nothing_holds_are_refused() {
        // To the square of a ten-thousandth.
        for (name, [loose, firm]) in testing::springs(25) {
            let mut solver = Banded::default();
            solver.analyze(loose.pattern()).expect("analysed");
            assert!(solver.fast.is_some());
            for fast in [true, false] {
                if !fast {
                    solver.fast = None;
                }
                let refused = solver.factorize(&loose);
                let singular = matches!(refused, Err(SolveError::Singular { .. }));
                assert!(singular, "{name} {fast}: {refused:?}");
                let (b, mut x) = ([1.0, 2.0, 3.0, 4.0, 5.0], [0.0; 5]);
                let too_early = solver.solve(&loose, &b, &mut x);
                assert!(matches!(too_early, Err(SolveError::OutOfOrder { .. })));
                solver.factorize(&firm).expect("factorised");
                solver.solve(&firm, &b, &mut x).expect("solved");
                let e = backward_error(&firm, &b, &x).expect("finite");
                assert!(e.normwise < 1e-15, "{name} {fast}: {e:?}");
            }
        }
    }

    /// A part that is all but singular by itself stands beside one that is singular, which is named.
    #[test]
    fn of_two_parts_in_doubt_the_singular_one_is_named() {
        for e in [1e-10, 1e-12, 1e-13] {
            for digits in 0..20 {
                let weak = 0.5_f64.powi(digits) / 3.0;
                let [p, q, r] = [0.3, 0.7, 1.1 * weak];
                let values = [1.0, 1.0, 1.0 + e, p, -p, p + q, -q, q + r, -r, r];
                let couplings = [(0, 1), (2, 3), (3, 4), (4, 5)];
                let a = matrix(&[1; 6], &couplings, &values);
                match solved(&a, &[1.0; 6]) {
                    Err(SolveError::Singular { block }) => assert!(block > 1, "{e} {weak}"),
                    other => panic!("{e} {weak}: {other:?}"),
                }
            }
        }
    }

    /// A light chain under a heavy load: condition 10¹⁵ by rounding's own measure, no row depends on others, and the
    /// elimination is as exact as any.
    #[test]
    fn a_heavy_load_is_not_a_dependent_row() {
        let weak = 1.4e-14;
        let values = &[1.0, -1.0, 2.0, -1.0, 1.0 + weak / 4.0];
        let a = matrix(&[1; 3], &[(0, 1), (1, 2)], values);
        let b = [1.0, 2.0, 3.0];
        let x = solved(&a, &b).expect("solved");
        assert!(backward_error(&a, &b, &x).expect("finite").normwise < 1e-15);
    }

    /// A hub that comes first fills everything in the order of the pattern: that factor is not made beside the fast one, and
    /// what needs it is refused.
    #[test]
    fn a_hub_that_comes_first_is_no_reason_to_fill_memory() {
        let n = if cfg!(miri) { 100 } else { 20_000 };
        let star: Vec<_> = (1..n).map(|i| (0, i)).collect();
        let pattern = Arc::new(BlockPattern::new(&vec![3; n], &star).expect("a pattern"));
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        for block in 0..n {
            let diagonal = a.block_mut(pattern.column(block).start);
            diagonal.iter_mut().step_by(4).for_each(|d| *d = 2.0);
        }
        let mut solver = Banded::default();
        let report = solver.analyze(&pattern).expect("an analysis");
        assert_eq!(report.factor_entries.is_none(), !cfg!(miri));
        solver.factorize(&a).expect("definite");
        let mut x = vec![0.0; 3 * n];
        solver.solve(&a, &vec![1.0; 3 * n], &mut x).expect("solved");
        assert!(x.iter().all(|x| *x == 0.5));
        a.block_mut(0)[0] = -2.0;
        let refused = solver.factorize(&a);
        if !cfg!(miri) {
            let fits = matches!(refused, Err(SolveError::TooLarge { .. }));
            assert!(fits, "{refused:?}");
        }
    }

    /// Two masses that are all but one, held by two joints: where the joints take them one by one, the inverse has a zero at
    /// the second of them, whose pivot is weak; where they do not, elimination loses as many digits as that pivot. The matrix
    /// is a good one, of whatever size its numbers are.
    #[test]
    fn a_weak_pivot_of_a_good_indefinite_matrix_is_one() {
        for e in [1e-9_f64, 1e-11, 1e-13, 3e-15] {
            for j in [[1.0, 0.0, 1.0, e.sqrt()], [1.0, 0.2, 0.3, 1.0]] {
                for scale in [1.0, 1e-150, 1e150] {
                    let m = [1.0, 1.0, 1.0, 1.0 + e];
                    let values = [m, j, [0.0; 4]].concat();
                    let values: Vec<f64> = values.iter().map(|v| v * scale).collect();
                    let a = matrix(&[2, 2], &[(0, 1)], &values);
                    let b = [1.0, 2.0, 3.0, 4.0];
                    let x = solved(&a, &b).expect("solved");
                    let found = backward_error(&a, &b, &x).expect("finite").normwise;
                    assert!(found < 1e-15, "{e} {j:?} {scale:e}: {found:e}");
                }
            }
        }
    }

    /// Products of earlier rows of the same block count in the magnitude that a pivot is compared
    /// with.
    #[test]
    fn a_pivot_is_lost_inside_a_block_as_between_blocks() {
        let rows = [3e-18, 1.0, 1.0, 1.0, 0.3, 0.1, 1.0, 0.1, 0.7];
        let whole = matrix(&[3], &[], &rows);
        let values = &[3e-18, 1.0, 1.0, 0.3, 0.1, 0.7];
        let apart = matrix(&[1; 3], &[(0, 1), (0, 2), (1, 2)], values);
        for a in [whole, apart] {
            let refused = solved(&a, &[1.0; 3]);
            let fits = matches!(refused, Err(SolveError::Singular { .. }));
            assert!(fits, "{refused:?}");
        }
    }
}
