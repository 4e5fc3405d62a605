use taut_solver::agreement::{Claims, check};
use taut_solver::{RefineScratch, reference_solution, refine};
use taut_tests::prelude::*;
use taut_tests::systems::{Shape, System, positive_definite, quasi_definite};

const SEEDS: std::ops::RangeInclusive<u64> = 1..=16;

/// Backward error, forward error, backward error after one refinement.
type Errors = [f64; 3];

/// Direct backends with the errors measured on all systems: componentwise backward error, forward error against the
/// oracle, and the backward error after one refinement; for definite systems, then for quasi-definite ones, where the
/// backend takes them. Some of these have more rows than velocities, held by Σ alone: that costs up to four digits row
/// by row, with pivoting and without, and the refinement brings them back.
const DIRECT: &str = "\
banded | 1.0e-15, 2.0e-15, 2.3e-16 | 8.2e-12, 8.0e-12, 1.9e-16
faer:llt | 4.0e-16, 2.4e-15, 1.7e-16 | -
faer:ldlt | 4.8e-16, 3.1e-15, 1.5e-16 | 8.4e-12, 1.1e-11, 1.6e-16
faer:lblt | 3.7e-16, 7.8e-15, 2.3e-16 | 5.1e-12, 3.0e-12, 1.8e-16
faer:lu | 3.8e-16, 2.6e-15, 2.0e-16 | 9.4e-13, 1.6e-12, 1.7e-16
nalgebra-sparse | 1.0e-15, 2.7e-15, 2.1e-16 | -
umfpack:refinement=0 | 3.6e-16, 5.3e-15, 1.8e-16 | 4.5e-13, 1.2e-12, 1.9e-16
umfpack:refinement=2 | 2.5e-16, 5.3e-15, 1.8e-16 | 1.9e-16, 1.8e-15, 1.6e-16
dense:double | 8.0e-16, 4.9e-15, 1.9e-16 | 2.8e-12, 2.0e-12, 2.1e-16";

/// The rows of [`DIRECT`].
fn direct() -> impl Iterator<Item = (&'static str, Errors, Option<Errors>)> {
    let errors = |cell: &str| -> Option<Errors> {
        let numbers: Result<Vec<f64>, _> = cell.split(", ").map(str::parse).collect();
        numbers.ok()?.try_into().ok()
    };
    DIRECT.lines().map(move |row| {
        let [name, definite, other] = [0, 1, 2].map(|k| row.split(" | ").nth(k).expect("a cell"));
        (name, errors(definite).expect("errors"), errors(other))
    })
}

/// Iterative backends with enough iterations, and their measured forward error, at a tolerance of 10⁻¹¹; of
/// MINRES, whose residual of quasi-definite systems rounding keeps above that, at 10⁻¹⁰.
const ITERATIVE: [(&str, f64); 7] = [
    ("cg:none:iterations=10000:tolerance=1e-11", 1.3e-11),
    ("cg:jacobi:iterations=10000:tolerance=1e-11", 4.6e-12),
    ("cg:group:iterations=10000:tolerance=1e-11", 5.1e-12),
    (
        "gauss-seidel:joints:iterations=10000:tolerance=1e-11",
        6.2e-11,
    ),
    (
        "gauss-seidel:groups:iterations=10000:tolerance=1e-11",
        1.9e-11,
    ),
    (
        "gauss-seidel:groups:trial:iterations=10000:tolerance=1e-11",
        1.7e-11,
    ),
    ("minres:iterations=10000:tolerance=1e-10", 2.9e-10),
];

fn systems(make: fn(Shape, u64) -> System) -> Vec<(System, Vec<f64>)> {
    let all = Shape::ALL.into_iter();
    let systems = all.flat_map(|shape| SEEDS.map(move |seed| make(shape, seed)));
    systems
        .map(|system| {
            let mut oracle = oracle().create().expect("always there");
            let exact = solve(&mut *oracle, &system, "the oracle");
            (system, exact)
        })
        .collect()
}

/// The solver of that name, if it is compiled in.
fn create(name: &str) -> Option<Box<dyn LinearSolver>> {
    let backend: Backend = name.parse().expect("a known name");
    backend
        .is_compiled()
        .then(|| backend.create().expect("sound options"))
}

fn solve(solver: &mut dyn LinearSolver, system: &System, name: &str) -> Vec<f64> {
    // Direct backends ignore the guess, whatever it holds.
    let mut x = vec![1e300; system.a.dim()];
    let mut phases = || -> Result<SolveReport, SolveError> {
        solver.analyze(system.a.pattern())?;
        solver.factorize(&system.a)?;
        solver.solve(&system.a, &system.b, &mut x)
    };
    let report = phases().unwrap_or_else(|e| panic!("{name}: {e}, on {system}"));
    assert_eq!(report.status, Status::Direct, "{name}, on {system}");
    x
}

#[test]
fn direct_backends_agree_with_the_oracle_on_definite_systems() {
    let all = systems(positive_definite);
    for (name, measured, _) in direct() {
        compare(name, &all, measured);
    }
}

#[test]
fn direct_backends_agree_with_the_oracle_on_quasi_definite_systems() {
    let all = systems(quasi_definite);
    for (name, _, measured) in direct() {
        let backend: Backend = name.parse().expect("a known name");
        assert_eq!(backend.accepts_indefinite(), measured.is_some(), "{name}");
        if let Some(measured) = measured {
            compare(name, &all, measured);
        }
    }
}

fn compare(name: &str, systems: &[(System, Vec<f64>)], measured: Errors) {
    let Some(mut solver) = create(name) else {
        return;
    };
    let mut worst = [(); 3].map(|()| Worst::default());
    for (system, exact) in systems {
        let (a, b) = (&system.a, &system.b);
        let mut x = solve(&mut *solver, system, name);
        let error = |x: &[f64]| backward_error(a, b, x).expect("lengths fit").componentwise;
        worst[0].see(error(&x), system);
        worst[1].see(forward_error(&x, exact), system);
        let mut scratch = RefineScratch::new(a.dim());
        let rest = |x: &[f64], r: &mut [f64]| a.subtract_product(b, x, r);
        refine(&mut *solver, a, &mut x, &mut scratch, 1, rest).expect("solvable");
        worst[2].see(error(&x), system);
    }
    let what = ["backward error", "forward error", "backward error, refined"];
    for ((worst, what), measured) in worst.iter().zip(what).zip(measured) {
        worst.expect_measured(&format!("{name}, {what}"), measured);
    }
}

/// The check for backends from elsewhere; the tables above say how well ours pass it.
#[test]
fn all_backends_pass_the_public_check() {
    for name in direct().map(|d| d.0).chain(ITERATIVE.map(|i| i.0)) {
        let Some(mut solver) = create(name) else {
            continue;
        };
        let backend: Backend = name.parse().expect("a known name");
        let agreement = check(&mut *solver, &Claims::of(&backend));
        let agreement = agreement.unwrap_or_else(|e| panic!("{name}: {e}"));
        println!("{name}: {agreement:?}");
        assert!(agreement.systems >= 24, "{name}");
        assert_eq!(agreement.iterations > 0, backend.is_iterative(), "{name}");
    }
}

/// The residual is within the claimed tolerance. The forward error depends on the conditioning.
#[test]
fn iterative_backends_converge_to_what_they_claim() {
    let definite = systems(positive_definite);
    let both = [definite.clone(), systems(quasi_definite)].concat();
    for (name, measured) in ITERATIVE {
        let Some(mut solver) = create(name) else {
            continue;
        };
        let backend: Backend = name.parse().expect("a known name");
        let all = if backend.accepts_indefinite() {
            &both
        } else {
            &definite
        };
        let (mut claim, mut forward, mut most) = (Worst::default(), Worst::default(), 0);
        for (system, exact) in all {
            let (a, b) = (&system.a, &system.b);
            let mut x = vec![0.0; a.dim()];
            solver.analyze(a.pattern()).expect("sound");
            solver.factorize(a).expect("regular");
            let report = solver.solve(a, b, &mut x).expect("solvable");
            let what = format!("{name}, {report:?}, on {system}");
            assert_eq!(report.status, Status::Converged, "{what}");
            let r = residual(a, b, &x).expect("lengths fit");
            claim.see(norm(&r) / norm(b), system);
            forward.see(forward_error(&x, exact), system);
            most = most.max(report.iterations);
        }
        println!("{name}: at most {most} iterations");
        let tolerance = backend.tolerance().expect("of an iteration");
        assert!(claim.error() <= tolerance, "{name}: {claim:?}");
        forward.expect_measured(&format!("{name}, forward error"), measured);
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// With too few iterations the status says so, and the report's residual is that of the solution.
#[test]
fn iterative_backends_admit_that_they_did_not_converge() {
    for (name, _) in ITERATIVE {
        let backend: Backend = name.parse().expect("a known name");
        let Some(mut solver) = create(&backend.with_iterations(2).to_string()) else {
            continue;
        };
        for shape in Shape::ALL {
            let system = positive_definite(shape, 5);
            let mut x = vec![0.0; system.a.dim()];
            solver.analyze(system.a.pattern()).expect("sound");
            solver.factorize(&system.a).expect("definite");
            let report = solver.solve(&system.a, &system.b, &mut x);
            let report = report.expect("solvable");
            assert_eq!(report.status, Status::IterationLimit, "{name}, on {system}");
            assert_eq!(report.iterations, 2, "{name}, on {system}");
            let r = residual(&system.a, &system.b, &x).expect("lengths fit");
            assert!(norm(&r) > 1e-11 * norm(&system.b), "{name}, on {system}");
        }
    }
}

/// Two oracles that share no elimination: dense LU with pivoting and block LDLᵀ, both in extended precision.
#[test]
fn the_two_oracles_agree() {
    for make in [positive_definite, quasi_definite] {
        let mut worst = Worst::default();
        for (system, exact) in systems(make) {
            let reference = reference_solution(&system.a, &system.b).expect("solvable");
            worst.see(forward_error(&reference, &exact), &system);
        }
        worst.expect_measured("reference solution", 0.0);
    }
}
