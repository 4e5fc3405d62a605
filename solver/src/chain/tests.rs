use super::*;
use crate::{backward_error, forward_error, reference_solution};
use std::sync::Arc;

/// Pseudo-random numbers in −1 … 1.
fn noise(seed: u32) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state) / f64::from(u32::MAX) * 2.0 - 1.0
    }
}

fn pattern(sizes: &[usize]) -> Arc<BlockPattern> {
    let couplings: Vec<_> = (1..sizes.len()).map(|i| (i - 1, i)).collect();
    Arc::new(BlockPattern::new(sizes, &couplings).unwrap())
}

/// Random couplings and diagonal blocks with a strong diagonal.
fn matrix(pattern: &Arc<BlockPattern>, seed: u32) -> SymBlockMatrix {
    let (mut a, mut noise) = (SymBlockMatrix::zeros(pattern.clone()), noise(seed));
    a.values_mut().iter_mut().for_each(|v| *v = noise());
    for j in 0..pattern.blocks() {
        let n = pattern.size(j);
        let block = a.block_mut(pattern.column(j).start);
        for r in 0..n {
            for c in 0..r {
                // What stands above the diagonal is not to be read.
                block[c + n * r] = 1e9;
            }
            block[r * (n + 1)] = 3.0 + n as f64 + noise();
        }
    }
    a
}

/// Chains of one size, of the hoist's sizes (small ends), of mixed ones, and several chains.
fn patterns() -> Vec<Arc<BlockPattern>> {
    let mut patterns = Vec::new();
    for size in 1..=6 {
        for blocks in [1, 2, 3, 4, 5, 24, 101] {
            patterns.push(pattern(&vec![size; blocks]));
            let mut sizes = vec![size; blocks];
            sizes[0] = 3;
            sizes[blocks - 1] = 1;
            patterns.push(pattern(&sizes));
        }
    }
    for seed in 1..30 {
        let mut noise = noise(seed);
        let mut draw = |n: usize| ((noise() + 1.0) / 2.0 * n as f64) as usize % n;
        let sizes: Vec<_> = (0..2 + draw(12)).map(|_| draw(7)).collect();
        let couplings = (1..sizes.len()).filter(|i| i % 4 != 3).map(|i| (i - 1, i));
        let couplings: Vec<_> = couplings.collect();
        patterns.push(Arc::new(BlockPattern::new(&sizes, &couplings).unwrap()));
    }
    patterns.push(pattern(&[]));
    patterns
}

#[test]
fn solves_chains_at_every_level() {
    for pattern in patterns() {
        for seed in [1, 2] {
            let a = matrix(&pattern, seed);
            let b: Vec<_> = (0..a.dim()).map(|i| (i as f64).sin() + 0.1).collect();
            let exact = reference_solution(&a, &b).unwrap();
            for level in Level::available() {
                let mut chain = Chain::new(&pattern, level).unwrap();
                let mut x = vec![f64::NAN; a.dim()];
                assert!(chain.factorize(&a));
                chain.solve(&b, &mut x);
                let e = backward_error(&a, &b, &x).unwrap();
                assert!(e.componentwise <= 2e-15, "{level}: {e:?} for {pattern:?}");
                let error = forward_error(&x, &exact);
                assert!(error <= 1e-13, "{level}: {error:e} for {pattern:?}");
            }
        }
    }
}

#[test]
fn takes_chains_of_small_blocks_only() {
    let new = |sizes: &[usize], couplings: &[_]| {
        let pattern = BlockPattern::new(sizes, couplings).unwrap();
        Chain::new(&pattern, Level::best()).is_some()
    };
    assert!(new(&[6, 3, 1], &[(0, 1), (1, 2)]));
    assert!(new(&[6, 3, 1], &[]));
    assert!(!new(&[6, 7], &[(0, 1)]));
    assert!(!new(&[3, 3, 3], &[(0, 1), (0, 2)]));
}

#[test]
fn a_pivot_that_is_noise_is_no_pivot() {
    for blocks in [1, 2, 3, 8, 9] {
        let pattern = pattern(&vec![3; blocks]);
        for bad in 0..blocks {
            // Row 2 of the block is row 1, and so are its couplings.
            let mut a = matrix(&pattern, 7);
            let column = pattern.column(bad);
            let diagonal = a.block_mut(column.start);
            (diagonal[5], diagonal[2], diagonal[8]) = (diagonal[4], diagonal[1], diagonal[4]);
            if let Some(k) = column.clone().nth(1) {
                let block = a.block_mut(k);
                block.copy_within(3..6, 6);
            }
            if let Some(k) = bad.checked_sub(1).and_then(|j| pattern.find(bad, j)) {
                for column in a.block_mut(k).chunks_exact_mut(3) {
                    column[2] = column[1];
                }
            }
            for level in Level::available() {
                let mut chain = Chain::new(&pattern, level).unwrap();
                assert!(!chain.factorize(&a), "{level}: {bad} of {blocks} blocks");
                assert!(chain.factorize(&matrix(&pattern, 7)));
            }
        }
        // Nothing is left of it after an elimination from the first block on: the last pivot is an exact zero.
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        for j in 0..blocks {
            let held = if j == 0 || j + 1 == blocks { 1.0 } else { 2.0 };
            let held = if blocks == 1 { 0.0 } else { held };
            for (k, value) in pattern.column(j).zip([held, -1.0]) {
                let diagonal = a.block_mut(k).iter_mut().step_by(4);
                diagonal.for_each(|v| *v = value);
            }
        }
        for level in Level::available() {
            let mut chain = Chain::new(&pattern, level).unwrap();
            assert!(!chain.factorize(&a));
        }
    }
}

#[test]
fn pivots_are_positive() {
    for blocks in [1, 2, 3, 8, 9] {
        let pattern = pattern(&vec![3; blocks]);
        for bad in 0..blocks {
            // Indefinite by itself: the product of two entries is less than the square of a third.
            let mut a = matrix(&pattern, 7);
            let diagonal = a.block_mut(pattern.column(bad).start);
            (diagonal[1], diagonal[3]) = (20.0, 20.0);
            for level in Level::available() {
                let mut chain = Chain::new(&pattern, level).unwrap();
                assert!(!chain.factorize(&a), "{level}: {bad} of {blocks} blocks");
            }
        }
    }
}

#[test]
fn an_infinite_pivot_is_no_pivot() {
    let pattern = pattern(&[1, 1, 1]);
    let mut a = matrix(&pattern, 1);
    a.values_mut()
        .copy_from_slice(&[1e-200, 1e200, 1.0, 0.0, 1.0]);
    for level in Level::available() {
        let mut chain = Chain::new(&pattern, level).unwrap();
        assert!(!chain.factorize(&a), "{level}");
    }
}
