use super::{compiled, compiled_direct};
use std::sync::Arc;
use taut_solver::{Backend, BlockPattern, LinearSolver, SolveError, SymBlockMatrix};

/// Three coupled blocks of 2, 3 and 1 rows in two groups; definite.
fn system() -> (SymBlockMatrix, Vec<f64>) {
    let pattern = BlockPattern::new(&[2, 3, 1], &[(0, 1), (1, 2)]).expect("sound");
    let pattern = pattern.with_groups(vec![0, 0, 1]).expect("three groups");
    let mut a = SymBlockMatrix::zeros(Arc::new(pattern));
    let p = a.pattern().clone();
    for j in 0..p.blocks() {
        for (k, value) in p.column(j).zip([0.25, 0.5]) {
            a.block_mut(k).fill(value);
        }
        let n = p.size(j);
        let diagonal = a.block_mut(p.column(j).start);
        (0..n).for_each(|r| diagonal[r * (n + 1)] = 8.0 + r as f64);
    }
    (a, vec![1.0, -2.0, 3.0, -4.0, 5.0, -6.0])
}

/// The last diagonal entry of block `j` to be written.
fn last_diagonal(a: &mut SymBlockMatrix, j: usize) -> &mut f64 {
    let k = a.pattern().column(j).start;
    a.block_mut(k).last_mut().expect("a row")
}

fn analyzed(backend: &Backend, a: &SymBlockMatrix) -> Box<dyn LinearSolver> {
    let mut solver = backend.create().expect("compiled in");
    solver
        .analyze(a.pattern())
        .unwrap_or_else(|e| panic!("{backend}: {e}"));
    solver
}

fn factorized(backend: &Backend, a: &SymBlockMatrix) -> Box<dyn LinearSolver> {
    let mut solver = analyzed(backend, a);
    solver
        .factorize(a)
        .unwrap_or_else(|e| panic!("{backend}: {e}"));
    solver
}

/// A solve from zero, without its report.
fn solve(solver: &mut dyn LinearSolver, a: &SymBlockMatrix, b: &[f64]) -> Result<(), SolveError> {
    solver.solve(a, b, &mut vec![0.0; b.len()]).map(drop)
}

/// The features of this crate are those of the solver: what is asked for is there, what is not is named.
#[test]
fn what_is_not_compiled_in_says_how_to_get_it() {
    let features = [
        ("banded", cfg!(feature = "banded")),
        ("gauss-seidel", cfg!(feature = "gauss-seidel")),
        ("cg", cfg!(feature = "cg")),
        ("minres", cfg!(feature = "minres")),
        ("faer", cfg!(feature = "faer")),
        ("nalgebra-sparse", cfg!(feature = "nalgebra-sparse")),
        ("umfpack", cfg!(feature = "umfpack")),
        ("dense", true),
    ];
    for (name, on) in features {
        let backend: Backend = name.parse().expect("all names are always known");
        assert_eq!(backend.is_compiled(), on, "{name}");
        let made = backend.create();
        if let Ok(solver) = &made {
            assert_eq!(solver.name(), name);
        }
        if let Err(e) = made {
            let feature = backend.feature().expect("dense is always there");
            let expected = SolveError::NotCompiled {
                backend: backend.name(),
                feature,
            };
            assert_eq!(e, expected);
            let says = e.to_string().contains(&format!("--features {feature}"));
            assert!(says, "{e}");
        }
    }
}

#[test]
fn unknown_backends_and_options_list_the_known_ones() {
    for text in ["superlu", "Banded", "", "banded ", ":group"] {
        let e = text.parse::<Backend>().expect_err(text).to_string();
        let holds = e.contains("gauss-seidel") && e.contains("umfpack");
        assert!(holds, "{text}: {e}");
        assert!(!e.contains('\n'), "{e}");
    }
    let words = "cg:superlu gauss-seidel:iterations=-1 cg:tolerance= umfpack:refinement=x \
        dense:triple banded:fast cg:group=1 cg:matrix-free faer:qr auto:fast";
    for text in words.split(' ') {
        let e = text.parse::<Backend>().expect_err(text).to_string();
        let name = text.split(':').next().expect("a name");
        assert!(e.contains(name) && !e.contains('\n'), "{text}: {e}");
    }
}

#[test]
fn options_out_of_range_are_refused() {
    for backend in compiled().iter().filter(|b| b.is_iterative()) {
        let refused = |backend: Backend| match backend.create().map(|_| ()) {
            Err(SolveError::InvalidOption { option, .. }) => option,
            other => panic!("{backend}: {other:?}"),
        };
        assert_eq!(refused(backend.with_iterations(0)), "iterations");
        for tolerance in [-1e-9, 1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(refused(backend.with_tolerance(tolerance)), "tolerance");
        }
    }
}

#[test]
fn numbers_that_are_not_finite_are_named_with_their_block() {
    let (a, b) = system();
    for backend in compiled() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let non_finite = |what, block| Err(SolveError::NonFinite { what, block });
            let mut matrix = a.clone();
            *last_diagonal(&mut matrix, 1) = bad;
            let found = analyzed(&backend, &a).factorize(&matrix).map(|_| ());
            assert_eq!(found, non_finite("matrix", 1), "{backend}");

            let mut solver = factorized(&backend, &a);
            let mut rhs = b.clone();
            rhs[5] = bad;
            let found = solve(&mut *solver, &a, &rhs);
            assert_eq!(found, non_finite("right-hand side", 2), "{backend}");

            // Direct backends do not read the guess; neither does a start from the groups' own solutions.
            let mut x = vec![0.0; b.len()];
            x[2] = bad;
            let found = solver.solve(&a, &b, &mut x).map(|_| ());
            if backend.is_iterative() && !backend.to_string().contains("trial") {
                assert_eq!(found, non_finite("guess", 1), "{backend}");
            } else {
                assert_eq!(found, Ok(()), "{backend}");
                assert!(x.iter().all(|x| x.is_finite()), "{backend}: {x:?}");
            }
        }
    }
}

/// A negative diagonal entry is seen at once by everyone who needs a definite matrix; the others solve the system.
#[test]
fn indefinite_matrices_are_refused_or_solved() {
    let (mut a, b) = system();
    *last_diagonal(&mut a, 1) = -3.0;
    for backend in compiled() {
        let mut solver = analyzed(&backend, &a);
        let mut x = vec![0.0; b.len()];
        let solved = solver.factorize(&a);
        let solved = solved.and_then(|_| solver.solve(&a, &b, &mut x));
        if backend.accepts_indefinite() {
            solved.unwrap_or_else(|e| panic!("{backend}: {e}"));
            let error = taut_solver::backward_error(&a, &b, &x).expect("lengths fit");
            let bar = if backend.is_iterative() { 1e-9 } else { 1e-14 };
            assert!(error.componentwise <= bar, "{backend}: {error:?}");
        } else if backend.to_string().starts_with("cg:none") {
            // It meets the negative curvature in a direction that no single block owns.
            let refused = matches!(solved, Err(SolveError::NotPositiveDefinite { .. }));
            assert!(refused, "{backend}: {solved:?}");
        } else {
            assert_eq!(
                solved,
                Err(SolveError::NotPositiveDefinite { block: 1 }),
                "{backend}"
            );
        }
    }
}

#[test]
fn singular_matrices_are_named_as_such() {
    // Rows 3 and 4 of block 1 are made equal to rows of block 0: exactly dependent, without a zero in sight.
    let pattern = Arc::new(BlockPattern::new(&[2, 2], &[(0, 1)]).expect("sound"));
    let mut a = SymBlockMatrix::zeros(pattern);
    let block = [3.7, 1.3, 1.3, 2.9];
    for k in 0..3 {
        a.block_mut(k).copy_from_slice(&block);
    }
    for backend in compiled_direct() {
        let found = analyzed(&backend, &a).factorize(&a).map(|_| ());
        match found {
            Err(SolveError::Singular { block }) => assert!(block < 2, "{backend}: block {block}"),
            other => panic!("{backend}: {other:?}"),
        }
    }
    let zero = SymBlockMatrix::zeros(a.pattern().clone());
    for backend in compiled() {
        let b = [1.0, 2.0, 3.0, 4.0];
        let mut solver = analyzed(&backend, &zero);
        let mut x = [0.0; 4];
        let found = solver.factorize(&zero);
        let found = found.and_then(|_| solver.solve(&zero, &b, &mut x));
        let refused = matches!(
            found,
            Err(SolveError::Singular { .. } | SolveError::NotPositiveDefinite { .. })
        );
        assert!(refused, "{backend}: {found:?}");
    }
}

#[test]
fn another_pattern_is_refused() {
    let (a, b) = system();
    // As many rows, blocks and values.
    let pattern = BlockPattern::new(&[1, 3, 2], &[(0, 1), (1, 2)]).expect("sound");
    let mut other = SymBlockMatrix::zeros(Arc::new(pattern));
    assert_eq!(other.values().len() - a.values().len(), 0);
    other.values_mut().copy_from_slice(a.values());
    for backend in compiled() {
        let mut solver = factorized(&backend, &a);
        let found = solve(&mut *solver, &other, &b);
        assert_eq!(found, Err(SolveError::PatternChanged), "{backend}");
        let found = solver.factorize(&other).map(drop);
        assert_eq!(found, Err(SolveError::PatternChanged), "{backend}");
        // The factorisation before it is gone.
        let found = solve(&mut *solver, &a, &b);
        let early = matches!(found, Err(SolveError::OutOfOrder { .. }));
        assert!(early, "{backend}: {found:?}");
        // An equal pattern is the same pattern, whoever made it.
        let equal = Arc::new((**a.pattern()).clone());
        let mut same = SymBlockMatrix::zeros(equal);
        same.values_mut().copy_from_slice(a.values());
        let again = solver.factorize(&same);
        let again = again.and_then(|_| solve(&mut *solver, &a, &b));
        assert_eq!(again, Ok(()), "{backend}");
    }
}

/// b = 0 has the answer 0, whatever the guess, and an iteration that stops before says why: scenes without gravity
/// come here.
#[test]
fn a_zero_right_hand_side_is_solved() {
    let (a, b) = system();
    let mut faults = Vec::new();
    for backend in compiled() {
        let mut x = b.clone();
        let found = factorized(&backend, &a).solve(&a, &[0.0; 6], &mut x);
        if found.is_err() || taut_solver::norm_inf(&x) > 1e-12 {
            faults.push(format!("{backend}: {found:?}, {x:?}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
