use super::*;
use crate::backends::testing::noise;
use crate::{SymBlockMatrix, backward_error, forward_error, reference_solution};
use std::collections::BTreeMap;
use std::sync::Arc;

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
                // Entries above the diagonal must not be read.
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

/// A chain of all blocks.
fn whole(pattern: &BlockPattern, level: Level) -> Option<Chain> {
    let all: Vec<usize> = (0..pattern.blocks()).collect();
    Chain::of(&all, pattern, level)
}

#[test]
fn solves_chains_at_every_level() {
    for pattern in patterns() {
        for seed in [1, 2] {
            let a = matrix(&pattern, seed);
            let b: Vec<_> = (0..a.dim()).map(|i| (i as f64).sin() + 0.1).collect();
            let exact = reference_solution(&a, &b).unwrap();
            for level in Level::available() {
                let mut chain = whole(&pattern, level).unwrap();
                let mut x = vec![f64::NAN; a.dim()];
                assert!(chain.factorize(&a, WEAK));
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
fn two_right_hand_sides_are_solved_as_each_alone() {
    for pattern in patterns() {
        let (a, n) = (matrix(&pattern, 3), pattern.dim());
        let b: Vec<f64> = (0..2 * n).map(|i| (i as f64).cos()).collect();
        let (one, other) = b.split_at(n);
        for level in Level::available() {
            let mut chain = whole(&pattern, level).expect("a chain");
            assert!(chain.factorize(&a, WEAK));
            let (mut x, mut y, mut alone) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
            chain.solve_two([one, other], [&mut x, &mut y]);
            for (b, x) in [(one, &x), (other, &y)] {
                chain.solve(b, &mut alone);
                assert_eq!(&alone, x, "{level} {pattern:?}");
            }
        }
    }
}

#[test]
fn takes_chains_of_small_blocks_only() {
    let new = |sizes: &[usize], couplings: &[_]| {
        let pattern = BlockPattern::new(sizes, couplings).unwrap();
        whole(&pattern, Level::best()).is_some()
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
                let mut chain = whole(&pattern, level).unwrap();
                let holds = !chain.factorize(&a, WEAK);
                assert!(holds, "{level}: {bad} of {blocks} blocks");
                assert!(chain.factorize(&matrix(&pattern, 7), WEAK));
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
            let mut chain = whole(&pattern, level).unwrap();
            assert!(!chain.factorize(&a, WEAK));
        }
    }
}

/// Chains of each size of a vector, full and padded, of even and odd lengths, and two chains of which the second begins
/// in the middle.
fn refusing() -> Vec<Arc<BlockPattern>> {
    let mut patterns = Vec::new();
    let sizes: &[usize] = if cfg!(miri) { &[3] } else { &[2, 3, 4, 5, 6] };
    for &size in sizes {
        for blocks in [1, 2, 5, 6] {
            patterns.push(pattern(&vec![size; blocks]));
            let mut sizes = vec![size; blocks];
            (sizes[0], sizes[blocks / 2]) = (1, 2);
            patterns.push(pattern(&sizes));
        }
        let couplings = [(0, 1), (1, 2), (3, 4), (4, 5)];
        patterns.push(Arc::new(BlockPattern::new(&[size; 6], &couplings).unwrap()));
    }
    patterns
}

/// Refused at every level; what was factorised then is as if nothing had been refused.
fn assert_refused(a: &SymBlockMatrix, good: &SymBlockMatrix, what: &str) {
    let b: Vec<_> = (0..a.dim()).map(|i| (i as f64).cos()).collect();
    for level in Level::available() {
        let solved = |chain: &mut Chain| {
            assert!(chain.factorize(good, WEAK), "{level}: {what}");
            let mut x = vec![f64::NAN; b.len()];
            chain.solve(&b, &mut x);
            x
        };
        let new = || whole(a.pattern(), level).unwrap();
        let mut chain = new();
        let holds = !chain.factorize(a, WEAK);
        assert!(holds, "{level}: {what} for {:?}", a.pattern());
        assert_eq!(solved(&mut chain), solved(&mut new()), "{level}: {what}");
    }
}

#[test]
fn diagonal_entries_that_are_no_pivots_are_refused_in_every_row() {
    let values = [
        0.0,
        -0.0,
        -1.0,
        1e-121,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];
    for pattern in refusing() {
        let good = matrix(&pattern, 3);
        for j in 0..pattern.blocks() {
            let n = pattern.size(j);
            for (r, value) in (0..n).flat_map(|r| values.map(|v| (r, v))) {
                let mut a = good.clone();
                a.block_mut(pattern.column(j).start)[r * (n + 1)] = value;
                assert_refused(&a, &good, &format!("{value} in row {r} of block {j}"));
            }
        }
    }
}

#[test]
fn couplings_that_leave_no_pivot_are_refused() {
    // Too large for positive definiteness, for its square, and no numbers.
    let values = [30.0, -30.0, 1e160, f64::INFINITY, f64::NAN];
    for pattern in refusing() {
        let good = matrix(&pattern, 4);
        for j in 0..pattern.blocks() {
            for k in pattern.column(j) {
                let (rows, columns) = (pattern.size(pattern.row(k)), pattern.size(j));
                let diagonal = pattern.row(k) == j;
                for (c, r) in (0..columns).flat_map(|c| (0..rows).map(move |r| (c, r))) {
                    if diagonal && r <= c {
                        continue;
                    }
                    for value in values {
                        let mut a = good.clone();
                        a.block_mut(k)[c * rows + r] = value;
                        assert_refused(&a, &good, &format!("{value} at {r}, {c} of {k}"));
                    }
                }
            }
        }
    }
}

/// Either end alone leaves a pivot in the middle, both do not.
#[test]
fn both_ends_take_from_the_middle() {
    let pattern = pattern(&[1, 1, 1]);
    let good = matrix(&pattern, 1);
    for (both, refused) in [(0.6, false), (0.8, true)] {
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        a.values_mut().copy_from_slice(&[1.0, both, 1.0, both, 1.0]);
        if refused {
            assert_refused(&a, &good, "both ends");
        } else {
            assert!(whole(&pattern, Level::best()).unwrap().factorize(&a, WEAK));
        }
    }
}

/// Rows of patches whose numbers were larger than they are now: a pivot is noise beside them, row by row. Here the matrix is
/// nothing but patches, in the reverse order.
#[test]
fn soundness_is_asked_row_by_row() {
    for pattern in refusing() {
        let a = matrix(&pattern, 5);
        let nothing = vec![f64::NAN; pattern.stored_values()];
        let (mut patched, mut patches) = (BTreeMap::new(), Vec::new());
        for k in (0..pattern.stored_blocks()).rev() {
            patched.insert(k, nothing.len() + patches.len());
            patches.extend_from_slice(a.block(k));
        }
        let (offsets, of_patches) = (
            Offsets {
                pattern: &pattern,
                patched: &patched,
            },
            Overlay {
                values: &nothing,
                patches: &patches,
            },
        );
        let all: Vec<usize> = (0..pattern.blocks()).collect();
        for level in Level::available() {
            let mut own = whole(&pattern, level).unwrap();
            let mut chain = Chain::of(&all, offsets, level).unwrap();
            assert!(chain.factorize(of_patches, WEAK) && own.factorize(&a, WEAK));
            assert_eq!(*chain.factor, *own.factor, "{level}: {pattern:?}");
            assert!(chain.is_sound(&vec![0.0; a.dim()]));
            for row in 0..a.dim() {
                // Pivots lie between a little and the diagonal entries, which are less than 11.
                let mut from = vec![0.0; a.dim()];
                from[row] = 11.0 / (WEAK * f64::ROUNDOFF);
                assert!(!chain.is_sound(&from), "{level}: {row} of {pattern:?}");
                from[row] = 1e-3 / (WEAK * f64::ROUNDOFF);
                assert!(chain.is_sound(&from), "{level}: {row} of {pattern:?}");
            }
        }
    }
}
