//! What all iterations do alike.

use super::testing::{patterns, positive_definite, quasi_definite};
use crate::{Backend, Status, SymBlockMatrix, backward_error};

/// Iterations that are compiled in, each with systems that it takes.
fn cases() -> Vec<(Backend, Vec<SymBlockMatrix>)> {
    let all = Backend::all().into_iter();
    let compiled = all.filter(|b| b.is_compiled() && b.is_iterative());
    let made = compiled.map(|backend| {
        let make = match backend.accepts_indefinite() {
            true => quasi_definite,
            false => positive_definite,
        };
        let systems = patterns().iter().map(|pattern| make(pattern, 2)).collect();
        (backend, systems)
    });
    made.collect()
}

fn side(n: usize) -> Vec<f64> {
    (0..n).map(|i| 0.1 + (i as f64).cos()).collect()
}

/// With a tolerance that cannot be met an iteration ends where rounding does, and says so. Large and small entries over- and
/// underflow sooner.
#[test]
fn no_tolerance_ends_in_a_stall_and_few_iterations_at_the_limit() {
    for (backend, systems) in cases() {
        for (a, scale) in systems
            .iter()
            .flat_map(|a| [1.0, 1e120, 1e-120].map(|scale| (a, scale)))
        {
            let mut a = a.clone();
            a.values_mut().iter_mut().for_each(|v| *v *= scale);
            let (b, mut x) = (side(a.dim()), vec![0.0; a.dim()]);
            let endless = backend.with_iterations(1_000_000).with_tolerance(0.0);
            let mut solver = endless.create().expect("compiled");
            solver.analyze(a.pattern()).expect("sound");
            solver.factorize(&a).expect("regular");
            let place = format!("{backend}, {scale:e}: {:?}", a.pattern());
            let report = solver.solve(&a, &b, &mut x);
            let report = report.unwrap_or_else(|e| panic!("{place}: {e}"));
            let exact = report.status == Status::Converged && report.residual == 0.0;
            let holds = exact || report.status == Status::Stalled;
            assert!(holds, "{report:?} {place}");
            assert!(report.iterations < 5_000, "{report:?} {place}");
            let error = backward_error(&a, &b, &x).expect("finite");
            assert!(error.normwise < 1e-14, "{error:?} {place}");
        }
        let a = &systems[1];
        let few = backend.with_iterations(2).with_tolerance(1e-15);
        let mut solver = few.create().expect("compiled");
        solver.analyze(a.pattern()).expect("sound");
        solver.factorize(a).expect("regular");
        let report = solver.solve(a, &side(a.dim()), &mut vec![0.0; a.dim()]);
        let report = report.expect("solvable");
        // What solves whole groups is done at once.
        let few = report.is_claim() && report.iterations < 2;
        let limit = report.status == Status::IterationLimit && report.iterations == 2;
        assert!(few || limit, "{backend}: {report:?}");
    }
}

/// Overflow in one solve, in the first residual or in products within the iteration, leaves nothing behind.
#[test]
fn a_failed_solve_does_not_spoil_the_next() {
    for (backend, systems) in cases() {
        let good = &systems[1];
        let b = side(good.dim());
        let backend = backend.with_iterations(10_000).with_tolerance(1e-10);
        let mut solver = backend.create().expect("compiled");
        solver.analyze(good.pattern()).expect("sound");
        let mut first = Vec::new();
        for (scale, load, guess) in [(1.0, 1.0, 0.0), (1e200, 1.0, 1e150), (1e200, 1e150, 0.0)] {
            let mut bad = good.clone();
            bad.values_mut().iter_mut().for_each(|v| *v *= scale);
            let of_bad: Vec<_> = b.iter().map(|b| b * load).collect();
            let mut x = vec![guess; b.len()];
            solver.factorize(&bad).expect("finite");
            // How it ends is not the matter here.
            solver.solve(&bad, &of_bad, &mut x).ok();
            solver.factorize(good).expect("regular");
            x.fill(0.0);
            let report = solver.solve(good, &b, &mut x).expect("solvable");
            assert_eq!(report.status, Status::Converged, "{backend}");
            if first.is_empty() {
                first.clone_from(&x);
            }
            assert_eq!(x, first, "{backend}");
        }
    }
}
