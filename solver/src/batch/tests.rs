use super::*;
use crate::{backward_error, forward_error};

/// Pseudo-random numbers in −1 … 1.
fn noise(seed: u32) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state) / f64::from(u32::MAX) * 2.0 - 1.0
    }
}

fn chain(sizes: &[usize]) -> Arc<BlockPattern> {
    let couplings: Vec<_> = (1..sizes.len()).map(|i| (i - 1, i)).collect();
    Arc::new(BlockPattern::new(sizes, &couplings).unwrap())
}

/// A strong diagonal, everything else random.
fn matrix(pattern: &Arc<BlockPattern>, seed: u32) -> SymBlockMatrix {
    let (mut a, mut noise) = (SymBlockMatrix::zeros(pattern.clone()), noise(seed));
    a.values_mut().iter_mut().for_each(|v| *v = noise());
    for j in 0..pattern.blocks() {
        let n = pattern.size(j);
        let diagonal = a.block_mut(pattern.column(j).start);
        for v in diagonal.iter_mut().step_by(n + 1) {
            *v = 3.0 + n as f64 + noise();
        }
    }
    a
}

fn batch(pattern: &Arc<BlockPattern>, count: usize) -> (BatchMatrix, Vec<SymBlockMatrix>) {
    let mut a = BatchMatrix::zeros(pattern.clone(), count).unwrap();
    // Unused lanes must not be read.
    a.values_mut().fill(f64::NAN);
    let each: Vec<_> = (0..count).map(|c| matrix(pattern, c as u32 + 1)).collect();
    for (cable, one) in each.iter().enumerate() {
        a.set(cable, one).unwrap();
        let mut back = SymBlockMatrix::zeros(pattern.clone());
        a.get(cable, &mut back).unwrap();
        assert_eq!(back, *one);
    }
    (a, each)
}

#[test]
fn agrees_with_one_cable_at_a_time() {
    let shapes: [&[usize]; 7] = [
        &[5; 24],
        &[6; 9],
        &[3; 7],
        &[3, 6, 6, 6, 3],
        &[1, 4, 0, 2],
        &[5],
        &[],
    ];
    for (sizes, count) in shapes
        .into_iter()
        .flat_map(|s| (0..20).map(move |c| (s, c)))
    {
        let pattern = chain(sizes);
        let dim = pattern.dim();
        let (a, each) = batch(&pattern, count);
        let b: Vec<f64> = (0..batch_len(dim, count))
            .map(|i| (i as f64).sin())
            .collect();
        for level in Level::available() {
            let mut solver = BatchBanded::with_level(&pattern, count, level).unwrap();
            let [mut x, mut same] = [0, 1].map(|_| vec![0.0; b.len()]);
            solver.factorize_each(|cable| &each[cable]).unwrap();
            solver.solve(&b, &mut same).unwrap();
            solver.factorize(&a).unwrap();
            solver.solve(&b, &mut x).unwrap();
            assert_eq!(x, same, "{level}: {sizes:?} {count}");
            for (cable, a) in each.iter().enumerate() {
                let of = |v: &[f64]| -> Vec<f64> {
                    (0..dim).map(|r| v[batch_index(dim, r, cable)]).collect()
                };
                let (b, x) = (of(&b), of(&x));
                let mut exact = vec![0.0; dim];
                let mut one = Chain::new(&pattern, level).unwrap();
                assert!(one.factorize(a, NOISE));
                one.solve(&b, &mut exact);
                assert!(
                    forward_error(&x, &exact) <= 1e-13,
                    "{level}: {sizes:?} {count}"
                );
                let e = backward_error(a, &b, &x).unwrap();
                assert!(
                    e.componentwise <= 2e-15,
                    "{level}: {sizes:?} {count}: {e:?}"
                );
            }
        }
    }
}

/// Two chains in one pattern, of more blocks than are padded at a time: a coupling that is not there is zero.
#[test]
fn chains_without_a_coupling_agree() {
    for (size, gap) in [3, 5, 6]
        .into_iter()
        .flat_map(|b| (0..6).map(move |g| (b, g)))
    {
        let couplings: Vec<_> = (0..6).filter(|i| *i != gap).map(|i| (i, i + 1)).collect();
        let pattern = Arc::new(BlockPattern::new(&[size; 7], &couplings).unwrap());
        let each: Vec<_> = (0..4).map(|c| matrix(&pattern, c + 1)).collect();
        let b = vec![1.0; batch_len(pattern.dim(), 4)];
        let mut x = b.clone();
        let mut solver = BatchBanded::new(&pattern, 4).unwrap();
        solver.factorize_each(|cable| &each[cable]).unwrap();
        solver.solve(&b, &mut x).unwrap();
        for (cable, a) in each.iter().enumerate() {
            let rows = 0..pattern.dim();
            let x: Vec<f64> = rows
                .map(|r| x[batch_index(pattern.dim(), r, cable)])
                .collect();
            let e = backward_error(a, &b[..pattern.dim()], &x).unwrap();
            assert!(e.componentwise <= 2e-15, "{size}, {gap}: {e:?}");
        }
    }
}

#[test]
fn names_cable_and_block() {
    let pattern = chain(&[3; 6]);
    for level in Level::available() {
        for (bad, count) in (1..14).flat_map(|count| (0..count).map(move |bad| (bad, count))) {
            let mut solver = BatchBanded::with_level(&pattern, count, level).unwrap();
            let (good, mut each) = batch(&pattern, count);
            let mut a = good.clone();
            let named = |error| {
                let cable = Some(bad);
                Err(BatchError { cable, error })
            };
            for (value, error) in [
                (0.0, SolveError::Singular { block: 4 }),
                (-1.0, SolveError::NotPositiveDefinite { block: 4 }),
                (
                    f64::INFINITY,
                    SolveError::NonFinite {
                        what: "matrix",
                        block: 4,
                    },
                ),
            ] {
                // A row of zeros.
                let one = &mut each[bad];
                for (block, columns) in [((4, 3), 3), ((4, 4), 3), ((5, 4), 1)] {
                    let k = pattern.find(block.0, block.1).unwrap();
                    for c in 0..columns {
                        let block = &mut one.block_mut(k)[3 * c..];
                        let rows = if columns == 1 { 0..3 } else { 0..1 };
                        block[rows].fill(0.0);
                    }
                }
                one.block_mut(pattern.column(4).start)[..3].fill(0.0);
                one.block_mut(pattern.column(4).start)[0] = value;
                a.set(bad, one).unwrap();
                let by_itself = solver.factorize_each(|cable| &each[cable]);
                assert_eq!(by_itself, named(error.clone()), "{level}: {bad} of {count}");
                assert!(solver.solve(&[], &mut []).is_err());
                assert_eq!(
                    solver.factorize(&a),
                    named(error),
                    "{level}: {bad} of {count}"
                );
            }
            let mut x = vec![0.0; batch_len(18, count)];
            let mut b = vec![1.0; batch_len(18, count)];
            assert!(solver.solve(&b, &mut x).is_err());
            solver.factorize(&good).unwrap();
            b[batch_index(18, 7, bad)] = f64::NAN;
            let (what, block) = ("right-hand side", 2);
            assert_eq!(
                solver.solve(&b, &mut x),
                named(SolveError::NonFinite { what, block })
            );
            b[batch_index(18, 7, bad)] = 1.0;
            solver.solve(&b, &mut x).unwrap();
        }
    }
}

/// Numbers that `banded` takes the general way, in every lane and in cables that go one by one.
#[test]
fn names_the_cable_whose_numbers_cannot_be_squared() {
    let pattern = chain(&[3; 4]);
    for level in Level::available() {
        for (bad, count) in (1..14).flat_map(|count| (0..count).map(move |bad| (bad, count))) {
            let (mut a, mut each) = batch(&pattern, count);
            for scale in [1e-130, 1e160] {
                each[bad] = matrix(&pattern, 1);
                each[bad].values_mut().iter_mut().for_each(|v| *v *= scale);
                a.set(bad, &each[bad]).unwrap();
                let mut solver = BatchBanded::with_level(&pattern, count, level).unwrap();
                let error = solver.factorize(&a).unwrap_err();
                assert_eq!(error.cable, Some(bad), "{level}: {count} {scale:e}");
                assert_eq!(
                    solver.factorize_each(|cable| &each[cable]),
                    Err(error.clone())
                );
                assert!(
                    matches!(error.error, SolveError::OutOfRange { .. }),
                    "{error:?}"
                );
            }
        }
    }
}

#[test]
fn refuses_what_does_not_fit() {
    let ring = BlockPattern::new(&[3; 3], &[(0, 1), (1, 2), (0, 2)]).unwrap();
    assert!(BatchBanded::new(&Arc::new(ring), 4).is_err());
    let pattern = chain(&[3; 3]);
    for count in [usize::MAX, 1 << 50] {
        let too_large = |e| matches!(e, SolveError::TooLarge { .. });
        assert!(BatchMatrix::zeros(pattern.clone(), count).is_err_and(too_large));
        let refused = BatchBanded::new(&pattern, count).map(|_| ());
        assert!(refused.is_err_and(|e| too_large(e.error)), "{count}");
    }
    let mut solver = BatchBanded::new(&pattern, 4).unwrap();
    let mut x = [0.0; 9 * 8];
    let called = SolveError::OutOfOrder {
        called: "solve",
        needs: "factorize",
    };
    assert_eq!(solver.solve(&[0.0; 72], &mut x), Err(called.into()));
    assert!(
        solver
            .factorize(&BatchMatrix::zeros(pattern, 5).unwrap())
            .is_err()
    );
    let other = BatchMatrix::zeros(chain(&[3; 2]), 4).unwrap();
    assert_eq!(
        solver.factorize(&other),
        Err(SolveError::PatternChanged.into())
    );
    let [own, other] = [3, 2].map(|blocks| matrix(&chain(&vec![3; blocks]), 1));
    let refused = solver.factorize_each(|cable| if cable == 2 { &other } else { &own });
    let (cable, error) = (Some(2), SolveError::PatternChanged);
    assert_eq!(refused, Err(BatchError { cable, error }));
}

#[test]
fn vectors_of_four_are_put_where_a_batch_has_them() {
    for len in 0..14 {
        let vector =
            |cable: usize| -> Vec<f64> { (0..len).map(|r| (100 * cable + r) as f64).collect() };
        let mut all = vec![f64::NAN; batch_len(len, 12)];
        for first in [0, 4, 8] {
            let four = [0, 1, 2, 3].map(|k| vector(first + k));
            batch_set_four(&mut all, first, four.each_ref().map(Vec::as_slice)).unwrap();
        }
        for (cable, entry) in (0..12).flat_map(|c| (0..len).map(move |r| (c, r))) {
            assert_eq!(all[batch_index(len, entry, cable)], vector(cable)[entry]);
        }
        for first in [0, 4, 8] {
            let mut four = [0, 1, 2, 3].map(|_| vec![0.0; len]);
            batch_get_four(&all, first, four.each_mut().map(Vec::as_mut_slice)).unwrap();
            assert_eq!(four, [0, 1, 2, 3].map(|k| vector(first + k)));
        }
    }
}

#[test]
fn vectors_of_four_that_do_not_fit_are_refused() {
    let (mut all, own, long) = ([0.0; 24], [0.0; 3], [0.0; 4]);
    let four = [&own[..]; 4];
    assert!(batch_set_four(&mut all, 4, four).is_ok());
    for (first, from) in [(1, four), (8, four), (usize::MAX - 3, four)] {
        assert!(batch_set_four(&mut all, first, from).is_err(), "{first}");
    }
    assert!(batch_set_four(&mut all, 0, [&own, &own, &long, &own]).is_err());
    assert!(batch_set_four(&mut all, 0, [&long; 4]).is_err());
    let [mut a, mut b, mut c, mut d] = [[0.0; 3]; 4];
    assert!(batch_get_four(&all, 2, [&mut a, &mut b, &mut c, &mut d]).is_err());
    assert!(batch_get_four(&all[1..], 0, [&mut a, &mut b, &mut c, &mut d]).is_err());
}

/// Springs that a grain of themselves holds are definite, with a weak pivot: their number is none of their cable's concern.
#[test]
fn accepts_the_same_matrices_whatever_their_number() {
    let pattern = chain(&[1; 5]);
    for grain in [1e-10, 1e-12] {
        let k = [0.3, 0.7, 1.1, 0.9];
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        for (i, k) in k.into_iter().enumerate() {
            for node in [i, i + 1] {
                a.block_mut(pattern.column(node).start)[0] += k * (1.0 + grain);
            }
            a.block_mut(pattern.column(i).start + 1)[0] = -k;
        }
        let b: Vec<f64> = (0..5).map(|i| f64::from(i).cos()).collect();
        for count in 1..=9 {
            let mut all = BatchMatrix::zeros(pattern.clone(), count).unwrap();
            (0..count).for_each(|cable| all.set(cable, &a).unwrap());
            let mut solver = BatchBanded::new(&pattern, count).unwrap();
            solver.factorize(&all).unwrap();
            let len = batch_len(5, count);
            let (mut right, mut x) = (vec![0.0; len], vec![0.0; len]);
            for cable in 0..count {
                for (r, b) in b.iter().enumerate() {
                    right[batch_index(5, r, cable)] = *b;
                }
            }
            solver.solve(&right, &mut x).unwrap();
            for cable in 0..count {
                let x: Vec<f64> = (0..5).map(|r| x[batch_index(5, r, cable)]).collect();
                let e = backward_error(&a, &b, &x).unwrap();
                assert!(e.normwise < 1e-15, "{grain:e}, {cable} of {count}: {e:?}");
            }
        }
    }
}
