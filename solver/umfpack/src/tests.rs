use super::*;

struct Csc {
    n: usize,
    col_ptr: Vec<i32>,
    row_idx: Vec<i32>,
    values: Vec<f64>,
}

impl Csc {
    fn new(col_ptr: &[i32], row_idx: &[i32], values: &[f64]) -> Self {
        Self {
            n: col_ptr.len() - 1,
            col_ptr: col_ptr.to_vec(),
            row_idx: row_idx.to_vec(),
            values: values.to_vec(),
        }
    }

    /// The 5 by 5 matrix of UMFPACK's user guide.
    fn demo() -> Self {
        Self::new(
            &[0, 2, 5, 9, 10, 12],
            &[0, 1, 0, 2, 4, 1, 2, 3, 4, 2, 1, 4],
            &[2.0, 3.0, 3.0, -1.0, 4.0, 4.0, -3.0, 1.0, 2.0, 2.0, 6.0, 1.0],
        )
    }

    fn one(value: f64) -> Self {
        Self::new(&[0, 1], &[0], &[value])
    }

    /// Numbers in -0.5..0.5 by a fixed congruential sequence, about five in a column.
    fn random(n: u16, seed: u64, diagonal: f64) -> Self {
        let mut state = seed;
        let mut unit = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            f64::from(u32::try_from(state >> 32).unwrap()) / f64::from(u32::MAX)
        };
        let mut matrix = Self::new(&vec![0; usize::from(n) + 1], &[], &[]);
        for column in 0..n {
            for row in 0..n {
                let shift = if row == column { diagonal } else { 0.0 };
                if row == column || unit() < 4.0 / f64::from(n) {
                    matrix.row_idx.push(row.into());
                    matrix.values.push(unit() - 0.5 + shift);
                }
            }
            let end = matrix.row_idx.len().try_into().unwrap();
            matrix.col_ptr[usize::from(column) + 1] = end;
        }
        matrix
    }

    fn analyse(&self, options: &Options) -> Result<Symbolic, Error> {
        let (p, r) = (&self.col_ptr, &self.row_idx);
        Symbolic::new(self.n, p, r, Some(&self.values), options)
    }

    fn factor(&self, symbolic: &Symbolic, options: &Options) -> Result<Numeric, Error> {
        let (p, r) = (&self.col_ptr, &self.row_idx);
        Numeric::new(symbolic, p, r, &self.values, options)
    }

    fn factored(&self) -> (Symbolic, Numeric) {
        let symbolic = self.analyse(&Options::default()).unwrap();
        let numeric = self.factor(&symbolic, &Options::default()).unwrap();
        (symbolic, numeric)
    }

    fn refactor(&self, old: &mut Numeric, symbolic: &Symbolic) -> Result<FactorInfo, Error> {
        old.refactor(symbolic, &self.col_ptr, &self.row_idx, &self.values)
    }

    /// Also finds the largest residual relative to the sizes of its terms.
    fn solve(&self, numeric: &mut Numeric, b: &[f64]) -> Result<(SolveInfo, f64), Error> {
        let mut x = vec![0.0; self.n];
        let info = numeric.solve(&self.col_ptr, &self.row_idx, &self.values, b, &mut x)?;
        let mut sums: Vec<_> = b.iter().map(|b| (*b, b.abs())).collect();
        let mut entries = self.row_idx.iter().zip(&self.values);
        for (column, x) in self.col_ptr.windows(2).zip(x) {
            for _ in column[0]..column[1] {
                let (row, value) = entries.next().unwrap();
                let (residual, size) = &mut sums[usize::try_from(*row).unwrap()];
                *residual -= value * x;
                *size += (value * x).abs();
            }
        }
        let errors = sums.iter();
        let errors = errors.map(|(residual, size)| residual.abs() / size.max(1e-300));
        Ok((info, errors.fold(0.0, f64::max)))
    }
}

const B: [f64; 5] = [8.0, 45.0, -3.0, 3.0, 19.0];

fn mismatch(what: &'static str, expected: usize, found: usize) -> Error {
    Error::DimensionMismatch {
        what,
        expected,
        found,
    }
}

#[test]
fn demo_system_is_solved() {
    let demo = Csc::demo();
    let (symbolic, mut numeric) = demo.factored();
    let (info, error) = demo.solve(&mut numeric, &B).unwrap();
    assert!(error < 1e-15 && info.omega1.unwrap() < 1e-15 && info.omega2.unwrap() < 1e-15);
    assert!(info.refinement_steps_taken <= 2 && info.flops > 0.0);
    let factors = numeric.info();
    assert_eq!((symbolic.n(), info.rcond), (5, factors.rcond));
    assert!(factors.lnz >= 5 && factors.unz >= 5 && factors.lnz + factors.unz >= 17);
    assert!(factors.rcond > 1e-3 && factors.flops > 0.0 && factors.peak_memory > 1000);
    assert!(format!("{symbolic:?} {numeric:?}").contains("n: 5"));
}

#[test]
fn default_options_are_those_of_the_library() {
    let control = ffi::Control::new(&Options::default());
    assert_eq!(control, Ok(ffi::Control::defaults()));
    let BuildInfo { version, origin } = build_info();
    assert!(["system", "source"].contains(&origin));
    assert!(version.split('.').all(|part| part.parse::<u32>().is_ok()));
}

#[test]
fn symbolic_part_is_reused_and_may_go_first() {
    let mut matrix = Csc::demo();
    let (symbolic, mut numeric) = matrix.factored();
    for scale in [2.0, -3.0, 1e8] {
        matrix
            .values
            .iter_mut()
            .for_each(|value| *value = scale * *value + 1.0);
        let info = matrix.refactor(&mut numeric, &symbolic).unwrap();
        assert_eq!(info, numeric.info());
        assert!(matrix.solve(&mut numeric, &B).unwrap().1 < 1e-14);
    }
    drop(symbolic);
    assert!(matrix.solve(&mut numeric, &B).unwrap().1 < 1e-14);
    let in_another_thread_and_dimension = move || {
        let one = Csc::one(4.0);
        one.refactor(&mut numeric, &one.factored().0).unwrap();
        one.solve(&mut numeric, &[2.0]).unwrap().1
    };
    let thread = std::thread::spawn(in_another_thread_and_dimension);
    assert_eq!(thread.join().unwrap(), 0.0);
}

#[test]
fn random_systems_are_solved_by_every_option() {
    for (seed, n) in (0..30).zip([1, 2, 7, 40, 150].into_iter().cycle()) {
        let matrix = Csc::random(n, seed, if seed % 2 == 0 { 5.0 } else { 1.0 });
        let b = Csc::random(n, seed + 1000, 3.0).values[..matrix.n].to_vec();
        for case in 0..18 {
            let options = Options {
                refinement_steps: [0, u32::MAX][case % 2],
                strategy: [Strategy::Auto, Strategy::Unsymmetric, Strategy::Symmetric][case / 6],
                scaling: [Scaling::None, Scaling::Sum, Scaling::Max][case / 2 % 3],
                pivot_tolerance: [Some(1.0), None][case % 2],
            };
            let symbolic = matrix.analyse(&options).unwrap();
            let mut numeric = matrix.factor(&symbolic, &options).unwrap();
            let (info, error) = matrix.solve(&mut numeric, &b).unwrap();
            assert_eq!(info.omega1.is_some(), case % 2 == 1);
            let bound = [1e-9, 1e-14][case % 2];
            assert!(error < bound, "{error:e} for {options:?}, seed {seed}");
        }
    }
}

#[test]
fn singular_matrices_are_errors_that_leave_no_factors() {
    let options = Options::default();
    let singular = Error::SingularMatrix { rcond: 0.0 };
    for matrix in [
        Csc::new(&[0; 4], &[], &[]),
        Csc::new(&[0, 2, 4], &[0, 1, 0, 1], &[1.0; 4]),
    ] {
        let symbolic = matrix.analyse(&options).unwrap();
        assert_eq!(matrix.factor(&symbolic, &options).unwrap_err(), singular);
    }
    let mut matrix = Csc::demo();
    let (symbolic, mut numeric) = matrix.factored();
    matrix.values.fill(0.0);
    assert_eq!(matrix.refactor(&mut numeric, &symbolic), Err(singular));
    let found = matrix.solve(&mut numeric, &B);
    assert_eq!(found, Err(Error::InvalidNumericObject));
    let demo = Csc::demo();
    demo.refactor(&mut numeric, &symbolic).unwrap();
    assert!(demo.solve(&mut numeric, &B).unwrap().1 < 1e-15);
}

#[test]
fn bad_patterns_are_errors() {
    let invalid = |column| Error::InvalidMatrix {
        column: Some(column),
    };
    let overflow = |value| Error::IndexOverflow { what: "n", value };
    let cases: [(usize, &[i32], &[i32], Error); 17] = [
        (0, &[0], &[], Error::NonPositiveDimension),
        (usize::MAX, &[], &[], overflow(usize::MAX)),
        (1 << 31, &[], &[], overflow(1 << 31)),
        ((1 << 31) - 1, &[], &[], overflow((1 << 31) - 1)),
        (2, &[], &[], mismatch("col_ptr", 3, 0)),
        (2, &[0, 1], &[0], mismatch("col_ptr", 3, 2)),
        (2, &[0, 1, 2, 3], &[0, 1], mismatch("col_ptr", 3, 4)),
        (2, &[0, 1, 2], &[0, 1, 1], mismatch("row_idx", 2, 3)),
        (2, &[0, 1, 2], &[0], invalid(1)),
        (2, &[1, 1, 2], &[0, 1], invalid(0)),
        (2, &[0, 2, 1], &[0, 1], invalid(1)),
        (2, &[0, -1, 2], &[0, 1], invalid(0)),
        (2, &[0, 1, i32::MAX], &[0, 1], invalid(1)),
        (2, &[0, 1, 2], &[0, 2], invalid(1)),
        (2, &[0, 1, 2], &[-1, 1], invalid(0)),
        (2, &[0, 2, 4], &[0, 1, 1, 1], invalid(1)),
        (2, &[0, 2, 2], &[1, 0], invalid(0)),
    ];
    for (n, col_ptr, row_idx, error) in cases {
        let symbolic = Symbolic::new(n, col_ptr, row_idx, None, &Options::default());
        assert_eq!(symbolic.unwrap_err(), error);
    }
}

/// Nothing of that size is made: lengths are compared as they are.
#[test]
fn numbers_beyond_32_bits_are_errors() {
    let most = i32::MAX.unsigned_abs() as usize;
    assert_eq!(ffi::index("row_idx", most), Ok(i32::MAX));
    for value in [most + 1, 1 << 32, usize::MAX] {
        let what = "row_idx";
        let found = ffi::index(what, value);
        assert_eq!(found, Err(Error::IndexOverflow { what, value }));
    }
}

/// Whatever ends a scope, a panic too, frees what C holds: a leak checker sees this test as well.
#[test]
fn handles_are_freed_where_a_panic_unwinds() {
    let unwound = std::panic::catch_unwind(|| {
        let demo = Csc::demo();
        let (symbolic, mut numeric) = demo.factored();
        let mut singular = Csc::demo();
        singular.values.fill(0.0);
        assert!(singular.refactor(&mut numeric, &symbolic).is_err());
        let (other, _kept) = demo.factored();
        let info = demo.refactor(&mut numeric, &other).unwrap();
        std::panic::resume_unwind(Box::new(info.lnz));
    });
    assert!(unwound.is_err_and(|lnz| lnz.downcast::<u64>().is_ok_and(|lnz| *lnz >= 5)));
}

#[test]
fn bad_numbers_are_errors_that_keep_the_factors() {
    let options = Options::default();
    let not_finite = |what, index| Error::NonFinite { what, index };
    let demo = Csc::demo();
    let (symbolic, mut numeric) = demo.factored();
    let [mut nan, mut short, mut moved] = [(); 3].map(|()| Csc::demo());
    nan.values[7] = f64::NAN;
    short.values.pop();
    moved.row_idx[10] = 2;
    for (matrix, error) in [
        (nan, not_finite("values", 7)),
        (short, mismatch("values", 12, 11)),
        (moved, Error::DifferentPattern),
    ] {
        assert_eq!(matrix.refactor(&mut numeric, &symbolic).unwrap_err(), error);
        assert_eq!(matrix.factor(&symbolic, &options).unwrap_err(), error);
        assert_eq!(matrix.solve(&mut numeric, &B).unwrap_err(), error);
        let analysed = matrix.analyse(&options).err();
        let expected = Some(error).filter(|error| *error != Error::DifferentPattern);
        assert_eq!(analysed, expected);
    }
    assert_eq!(demo.solve(&mut numeric, &B[1..]), Err(mismatch("b", 5, 4)));
    let (p, r, v) = (&demo.col_ptr, &demo.row_idx, &demo.values);
    let found = numeric.solve(p, r, v, &B, &mut [0.0; 6]);
    assert_eq!(found, Err(mismatch("x", 5, 6)));
    let infinite = [0.0, 0.0, f64::INFINITY, 0.0, 0.0];
    assert_eq!(demo.solve(&mut numeric, &infinite), Err(not_finite("b", 2)));
    assert!(demo.solve(&mut numeric, &B).unwrap().1 < 1e-15);

    let tiny = Csc::one(1e-300);
    let overflow = tiny.solve(&mut tiny.factored().1, &[1e300]);
    assert_eq!(overflow, Err(not_finite("x", 0)));
}

#[test]
fn bad_options_are_errors() {
    let demo = Csc::demo();
    let (symbolic, _) = demo.factored();
    for value in [-0.1, 1.5, f64::INFINITY, f64::NAN] {
        let pivot_tolerance = Some(value);
        let options = Options {
            pivot_tolerance,
            ..Options::default()
        };
        for error in [
            demo.analyse(&options).err(),
            demo.factor(&symbolic, &options).err(),
        ] {
            assert!(matches!(
                error,
                Some(Error::InvalidOption {
                    name: "pivot_tolerance",
                    ..
                })
            ));
        }
    }
}

#[test]
fn every_status_has_its_error() {
    let statuses = [
        (-1, Error::OutOfMemory),
        (1, Error::SingularMatrix { rcond: 0.25 }),
        (2, Error::DeterminantUnderflow),
        (3, Error::DeterminantOverflow),
        (-3, Error::InvalidNumericObject),
        (-4, Error::InvalidSymbolicObject),
        (-5, Error::ArgumentMissing),
        (-6, Error::NonPositiveDimension),
        (-8, Error::InvalidMatrix { column: None }),
        (-11, Error::DifferentPattern),
        (-13, Error::InvalidSystem),
        (-15, Error::InvalidPermutation),
        (-17, Error::FileIo),
        (-18, Error::OrderingFailed),
        (-19, Error::InvalidBlob),
        (-911, Error::InternalError),
        (-2, Error::Unknown { status: -2 }),
    ];
    let mut texts = std::collections::HashSet::new();
    for (status, error) in statuses {
        assert_eq!(Error::check(status, 0.25), Err(error.clone()));
        assert!(texts.insert(error.to_string()), "{error}");
    }
    assert_eq!(Error::check(0, 0.25), Ok(()));
    assert!(texts.contains("the matrix is singular (reciprocal condition 2.5e-1)"));
}
