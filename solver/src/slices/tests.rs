//! Products, inverses and layout against the matrix entry by entry, on patterns and block sizes of every kind.

use super::*;
use std::sync::Arc;

/// Numbers in −1 … 1 that differ from seed to seed.
struct Random(u32);

impl Random {
    fn next(&mut self) -> f64 {
        f64::from(self.bits()) / f64::from(u32::MAX / 2) - 1.0
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() >> 8) as usize % n
    }

    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.0
    }

    fn numbers(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }
}

/// A matrix of random numbers with a strong diagonal. Above the diagonal of its diagonal blocks stands nonsense.
fn matrix(sizes: &[usize], couplings: &[(usize, usize)], random: &mut Random) -> SymBlockMatrix {
    let pattern = BlockPattern::new(sizes, couplings).unwrap();
    let mut a = SymBlockMatrix::zeros(Arc::new(pattern));
    a.values_mut().iter_mut().for_each(|v| *v = random.next());
    let pattern = a.pattern().clone();
    for (j, &n) in sizes.iter().enumerate() {
        let block = a.block_mut(pattern.column(j).start);
        for r in 0..n {
            block[r * (n + 1)] = 8.0 + random.next();
        }
    }
    a
}

/// Random chains, nets and stars of blocks with the given sizes.
fn cases(largest: usize) -> impl Iterator<Item = (Vec<usize>, SymBlockMatrix, Random)> {
    (0..120_u32).map(move |seed| {
        let mut random = Random(seed);
        let blocks = 1 + random.below(23);
        let uniform = random.below(2) == 0;
        let size = 1 + random.below(largest);
        let mut sizes = vec![size; blocks];
        if !uniform {
            sizes
                .iter_mut()
                .for_each(|n| *n = 1 + random.below(largest));
        }
        let mut couplings: Vec<_> = (1..blocks).map(|i| (i - 1, i)).collect();
        match seed % 3 {
            0 => {}
            1 => couplings.extend((0..blocks).map(|i| (i, random.below(blocks)))),
            _ => couplings.extend((1..blocks).map(|i| (0, i))),
        }
        let a = matrix(&sizes, &couplings, &mut random);
        (sizes, a, random)
    })
}

/// Σ_c a_rc x_c and Σ_c |a_rc x_c|.
fn dense_product(a: &SymBlockMatrix, x: &[f64]) -> Vec<(f64, f64)> {
    let of = |r: usize| x.iter().enumerate().map(move |(c, x)| a.get(r, c) * x);
    (0..x.len())
        .map(|r| (of(r).sum(), of(r).map(f64::abs).sum()))
        .collect()
}

fn close(found: &[f64], expected: &[(f64, f64)]) -> bool {
    let pairs = found.iter().zip(expected);
    pairs.clone().count() == expected.len()
        && pairs
            .into_iter()
            .all(|(y, (e, size))| (y - e).abs() <= 64.0 * f64::EPSILON * size)
}

#[test]
fn products_are_those_of_the_entries() {
    let mut sliced = 0;
    for (sizes, a, mut random) in cases(7) {
        let x = random.numbers(a.dim());
        let expected = dense_product(&a, &x);
        let mut r = vec![0.0; a.dim()];
        a.subtract_product(&vec![0.0; a.dim()], &x, &mut r);
        r.iter_mut().for_each(|r| *r = -*r);
        assert!(close(&r, &expected), "{sizes:?}");
        let Some(mut slices) = Slices::new(a.pattern(), |_, _| true) else {
            let too_large = sizes.contains(&7);
            let mixed = sizes.iter().any(|n| *n != sizes[0] || *n < 5);
            assert!(too_large || mixed, "{sizes:?}");
            continue;
        };
        sliced += 1;
        for level in Level::available() {
            slices.level = level;
            slices.fill(&a);
            let (mut from, mut to) = (vec![0.0; slices.len()], vec![0.0; slices.len()]);
            slices.load(&x, &mut from);
            let energy = slices.product(&from, &mut to);
            let mut y = vec![f64::NAN; a.dim()];
            slices.save(&to, &mut y);
            assert!(close(&y, &expected), "{level}, {sizes:?}");
            let exact: f64 = x.iter().zip(&expected).map(|(x, (e, _))| x * e).sum();
            let size = x.iter();
            let size: f64 = size.zip(&expected).map(|(x, (_, s))| (x * s).abs()).sum();
            let off = (energy - exact).abs();
            assert!(off <= 64.0 * f64::EPSILON * size, "{level}, {sizes:?}");
        }
    }
    assert!(sliced >= 40, "{sliced}");
}

#[test]
fn inverses_are_those_of_the_diagonal_blocks() {
    for (sizes, a, mut random) in cases(6) {
        let diagonal = Slices::new(a.pattern(), |i, j| i == j);
        let Some(mut slices) = diagonal else { continue };
        for level in Level::available() {
            slices.level = level;
            slices.fill(&a);
            assert!(slices.invert_diagonal(), "{sizes:?}");
            let r = random.numbers(a.dim());
            let (mut from, mut to) = (vec![0.0; slices.len()], vec![0.0; slices.len()]);
            slices.load(&r, &mut from);
            slices.precondition(&from, &mut to);
            let mut z = vec![0.0; a.dim()];
            slices.save(&to, &mut z);
            // D z = r, and the inverses one by one are the same.
            let mut inverses = vec![0.0; slices.inverses_len()];
            slices.inverses(&mut inverses);
            for (j, &n) in sizes.iter().enumerate() {
                let (rows, size) = (a.pattern().rows(j), slices.size());
                let entry = |r: usize, c: usize| a.get(rows.start + r, rows.start + c);
                for i in 0..n {
                    let product: f64 = (0..n).map(|c| entry(i, c) * z[rows.start + c]).sum();
                    let off = (product - r[rows.start + i]).abs();
                    assert!(off < 1e-13, "{level}, {sizes:?}");
                    let own =
                        (0..n).map(|c| inverses[size * (size * j + c) + i] * r[rows.start + c]);
                    let off = (own.sum::<f64>() - z[rows.start + i]).abs();
                    assert!(off < 1e-14, "{level}, {sizes:?}");
                }
            }
        }
    }
}

#[test]
fn a_block_that_is_not_positive_definite_is_not_inverted() {
    for (sizes, mut a, mut random) in cases(6) {
        let j = random.below(sizes.len());
        let first = a.pattern().column(j).start;
        for bad in [-8.0, 0.0, f64::NAN] {
            a.block_mut(first)[0] = bad;
            if let Some(mut slices) = Slices::new(a.pattern(), |i, j| i == j) {
                slices.fill(&a);
                assert!(!slices.invert_diagonal(), "{sizes:?}, {bad}");
            }
        }
    }
}

#[test]
fn vectors_of_any_length() {
    let mut random = Random(5);
    for n in 0..40 {
        let [p, q, x, r] = [(); 4].map(|()| random.numbers(n));
        let (mut x_next, mut r_next) = (x.clone(), r.clone());
        let square = step(0.3, [&p, &q], [&mut x_next, &mut r_next]);
        for i in 0..n {
            assert!((x_next[i] - (x[i] + 0.3 * p[i])).abs() < 1e-15);
            assert!((r_next[i] - (r[i] - 0.3 * q[i])).abs() < 1e-15);
        }
        let exact: f64 = r_next.iter().map(|r| r * r).sum();
        assert!((square - exact).abs() <= 1e-14 && (dot(&r_next, &r_next) - exact).abs() <= 1e-14);
        let mut turned = p.clone();
        turn(-0.7, &q, &mut turned);
        assert!((0..n).all(|i| (turned[i] - (q[i] - 0.7 * p[i])).abs() < 1e-15));
    }
}

/// Two hubs that all others are coupled to: the square of their rows would take minutes.
#[test]
fn rows_of_very_many_blocks_are_laid_out_in_time() {
    let n = if cfg!(miri) { 100 } else { 200_000 };
    let hubs = (0..2).flat_map(|hub| (hub + 1..n).map(move |i| (hub, i)));
    let hubs: Vec<_> = hubs.collect();
    let pattern = BlockPattern::new(&vec![1; n], &hubs).unwrap();
    // Blocks of three rows at the least would be padding for the most part.
    assert!(Slices::new(&pattern, |_, _| true).is_none());
}
