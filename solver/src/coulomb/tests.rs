mod worlds;

use super::newton::{Best, Newton};
use super::scaled::Scaled;
use super::step::Step;
use super::sticking::Sticking;
use super::{ConeMethod, ConeReport, ConeSolver, Contacts};
use crate::SolveError;
pub(super) use worlds::Random;
use worlds::{FALL, Problem, heap, scatter, stack};

fn solve(problem: &Problem, impulses: &mut [f64]) -> ConeReport {
    solve_by(ConeMethod::Newton, problem, impulses)
}

fn solve_by(method: ConeMethod, problem: &Problem, impulses: &mut [f64]) -> ConeReport {
    ConeSolver::new()
        .solve(&problem.contacts(), method, impulses)
        .unwrap()
}

const SWEEPS: ConeMethod = ConeMethod::GaussSeidel {
    sweeps: 5000,
    tolerance: 1e-11,
};

/// One contact of W = diag(2, 3, 3) with a coupling of the normal.
fn single(coupling: f64, rates: [f64; 3], friction: f64) -> Problem {
    let w = [2.0, coupling, 0.0, coupling, 3.0, 0.0, 0.0, 0.0, 3.0];
    Problem::new(w.to_vec(), rates.to_vec(), vec![friction], 0.0)
}

fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance, "{found:?} {expected:?}");
    }
}

#[test]
fn one_contact_has_its_closed_forms_by_both_methods() {
    let cases = [
        // Open; sticking; sliding against its velocity; without friction; with any friction it sticks.
        (0.0, [1.0, -2.0, 0.5], 0.5, [0.0, 0.0, 0.0]),
        (0.0, [-2.0, 0.3, 0.0], 0.5, [1.0, -0.1, 0.0]),
        (0.0, [-2.0, 6.0, 8.0], 0.5, [1.0, -0.3, -0.4]),
        (0.0, [-2.0, 6.0, 8.0], 0.0, [1.0, 0.0, 0.0]),
        (0.0, [-2.0, 6.0, 9.0], 1e6, [1.0, -2.0, -3.0]),
        // u_N = 2 r_N + r_T − 2 = 0 with r_T = −r_N / 2.
        (1.0, [-2.0, 60.0, 0.0], 0.5, [4.0 / 3.0, -2.0 / 3.0, 0.0]),
    ];
    for (coupling, rates, friction, expected) in cases {
        let problem = single(coupling, rates, friction);
        for method in [ConeMethod::Newton, SWEEPS] {
            let mut r = [0.0; 3];
            let report = solve_by(method, &problem, &mut r);
            assert!(report.solved, "{method} {rates:?} {report:?}");
            assert_near(&r, &expected, 1e-9);
            assert_eq!(report.touching, usize::from(expected[0] > 0.0));
        }
    }
}

/// u_N = 2 r − 5 r' − 1 of two contacts: whatever r is, one of them approaches.
#[test]
fn an_operator_that_is_not_definite_is_said_to_be_and_costs_sweeps() {
    let mut w = vec![0.0; 36];
    (0..6).for_each(|k| w[7 * k] = 2.0);
    (w[3], w[18]) = (-5.0, -5.0);
    let rates = vec![-1.0, 0.0, 0.0, -1.0, 0.0, 0.0];
    let problem = Problem::new(w, rates, vec![0.5; 2], 0.0);
    let mut r = [0.0; 6];
    let report = solve(&problem, &mut r);
    assert!(!report.is_definite && !report.solved, "{report:?}");
    assert!(report.pivots <= 26 && report.sweeps <= 100, "{report:?}");
    assert!(r.iter().all(|r| r.is_finite()));
}

#[test]
fn what_slides_and_what_sticks_is_counted() {
    let sliding = |rates| solve(&single(0.0, rates, 0.5), &mut [0.0; 3]).sliding;
    assert_eq!(sliding([-2.0, 6.0, 8.0]), 1);
    assert_eq!(sliding([-2.0, 0.3, 0.0]), 0);
    assert_eq!(sliding([2.0, 0.3, 0.0]), 0);
}

#[test]
fn every_violation_shows_in_the_complementarity() {
    let judge = |rates, r: [f64; 3]| {
        let method = ConeMethod::GaussSeidel {
            sweeps: 0,
            tolerance: 0.0,
        };
        let report = solve_by(method, &single(0.0, rates, 0.5), &mut r.clone());
        assert_eq!(report.sweeps, 0);
        report.complementarity
    };
    assert!(judge([-2.0, 6.0, 8.0], [1.0, -0.3, -0.4]) < 1e-15);
    // Approach; both signs positive; slip of what sticks; a wrong direction; slip along the impulse.
    assert!(judge([-2.0, 0.0, 0.0], [0.0; 3]) > 0.5);
    assert!(judge([2.0, 0.0, 0.0], [1.0, 0.0, 0.0]) > 0.1);
    assert!(judge([-2.0, 0.3, 0.0], [1.0, 0.0, 0.0]) > 0.01);
    assert!(judge([-2.0, 6.0, 8.0], [1.0, 0.3, -0.4]) > 0.01);
    assert!(judge([-2.0, 6.0, 8.0], [1.0, 0.3, 0.4]) > 0.01);
}

#[test]
fn random_problems_of_few_bodies_are_solved_from_cold() {
    for ratio in [1.0, 1e3, 1e6] {
        for seed in 0..100 {
            let mut random = Random::new(seed);
            let contacts = 1 + random.below(60);
            let problem = scatter(contacts, ratio, &mut random);
            let report = solve(&problem, &mut vec![0.0; 3 * contacts]);
            assert!(report.solved, "ratio {ratio} seed {seed} {report:?}");
        }
    }
}

/// Ten cubes, one of them heavier.
fn masses(ratio: f64, place: usize) -> [f64; 10] {
    let mut masses = [1.0; 10];
    masses[place] = ratio;
    masses
}

#[test]
fn stacks_carry_the_weights_above_whatever_the_masses() {
    let mut random = Random::new(1);
    for relative in [1e-6, 1e-8, 1e-10] {
        for ratio in [1.0, 1e1, 1e2, 1e3, 1e4, 1e5] {
            for place in [9, 5] {
                let masses = masses(ratio, place);
                let problem = stack(&masses, 0.5, 1e-4, 0.0, &mut random).problem(relative);
                let mut r = vec![0.0; problem.rates.len()];
                let report = solve(&problem, &mut r);
                assert!(report.solved, "{relative} {ratio} {place} {report:?}");
                // A light cube's contacts give way by σ r under the heavy one.
                let tolerance = 1e-8 + 100.0 * relative * ratio;
                for (k, corners) in r.chunks_exact(12).enumerate() {
                    let sum: f64 = corners.iter().step_by(3).sum();
                    let weight = FALL * masses[k..].iter().sum::<f64>();
                    let error = (sum / weight - 1.0).abs();
                    assert!(error <= tolerance, "{relative} {ratio} {place} {k} {error}");
                }
                let mut next = problem.clone();
                next.rates.iter_mut().for_each(|q| *q *= 1.01);
                let warm = solve(&next, &mut r);
                assert!(warm.solved && warm.pivots <= 3, "{ratio} {place} {warm:?}");
            }
        }
    }
}

#[test]
fn stacks_that_are_pushed_and_recover_are_solved() {
    for relative in [1e-6, 1e-8, 1e-10] {
        for ratio in [1.0, 1e1, 1e2, 1e3, 1e4, 1e5] {
            for place in [9, 5] {
                for (push, recovery) in [(0.02, 0.0), (0.02, 0.05)] {
                    let mut random = Random::new(3);
                    let world = stack(&masses(ratio, place), 0.5, push, recovery, &mut random);
                    let problem = world.problem(relative);
                    let report = solve(&problem, &mut vec![0.0; problem.rates.len()]);
                    let holds = report.solved;
                    assert!(holds, "{relative} {ratio} {place} {push} {report:?}");
                }
            }
        }
    }
}

#[test]
fn heaps_are_solved_where_friction_does_not_jam_them() {
    for (ratio, friction) in [(1.0, 0.1), (1.0, 0.5), (1e3, 0.1), (1e3, 0.5), (1e6, 0.1)] {
        for seed in 0..60 {
            let mut random = Random::new(seed);
            let bodies = 6 + random.below(15);
            let problem = heap(bodies, ratio, friction, false, &mut random).problem(1e-8);
            let report = solve(&problem, &mut vec![0.0; problem.rates.len()]);
            assert!(report.solved, "{ratio} {friction} {seed} {report:?}");
        }
    }
}

#[test]
fn jammed_heaps_are_solved_or_said_not_to_be() {
    for seed in 0..10 {
        let mut random = Random::new(seed);
        let problem = heap(6, 1e3, 1.0, seed % 2 == 0, &mut random).problem(1e-8);
        let mut r = vec![0.0; problem.rates.len()];
        let report = solve(&problem, &mut r);
        let holds = report.complementarity < 0.1 && report.cone < 1e-12;
        assert!(holds, "{report:?}");
        assert_eq!(report.solved, report.complementarity <= 1e-10);
        assert!(r.iter().all(|r| r.is_finite()));
    }
}

#[test]
fn newton_and_sweeps_agree_on_an_easy_problem() {
    let mut random = Random::new(5);
    let problem = heap(4, 1.0, 0.3, false, &mut random).problem(0.1);
    let mut r = vec![0.0; problem.rates.len()];
    let mut other = r.clone();
    assert!(solve(&problem, &mut r).solved);
    let report = solve_by(SWEEPS, &problem, &mut other);
    assert!(report.solved && report.sweeps > 1, "{report:?}");
    assert_near(&other, &r, 1e-8 * crate::norm_inf(&r));
}

#[test]
fn what_is_solved_is_recognised_without_a_factorisation() {
    let mut random = Random::new(2);
    let problem = scatter(20, 1e3, &mut random);
    let mut r = vec![0.0; 60];
    let mut solver = ConeSolver::new();
    for expected in [false, true] {
        let contacts = problem.contacts();
        let report = solver.solve(&contacts, ConeMethod::Newton, &mut r).unwrap();
        assert!(report.solved);
        assert_eq!(report.pivots <= 1, expected, "{report:?}");
    }
}

#[test]
fn overlapping_contacts_share_their_impulse() {
    let one = single(0.0, [-2.0, 6.0, 8.0], 0.5);
    let copies = 5;
    let size = 3 * copies;
    let operator = (0..size * size).map(|k| one.operator[3 * (k / size % 3) + k % size % 3]);
    let operator: Vec<f64> = operator.collect();
    let problem = Problem::new(operator, one.rates.repeat(copies), vec![0.5; copies], 1e-8);
    let mut r = vec![0.0; size];
    let report = solve(&problem, &mut r);
    assert!(report.solved, "{report:?}");
    for r in r.chunks_exact(3) {
        assert_near(r, &[0.2, -0.06, -0.08], 1e-7);
    }
}

#[test]
fn stacks_that_stick_at_any_friction_are_solved() {
    for seed in 0..40 {
        let mut random = Random::new(seed);
        let mut problem = stack(&[1.0, 10.0, 1.0], 0.5, 1e-3, 0.0, &mut random).problem(1e-8);
        problem.friction.fill(1e6);
        let report = solve(&problem, &mut vec![0.0; problem.rates.len()]);
        assert!(report.solved, "{seed} {report:?}");
    }
}

#[test]
fn numbers_that_are_not_finite_solve_nothing() {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    for (method, bad) in [ConeMethod::Newton, SWEEPS]
        .iter()
        .flat_map(|m| bad.map(|b| (*m, b)))
    {
        let good = single(0.0, [-2.0, 6.0, 8.0], 0.5);
        let mut problems = vec![good.clone(); 4];
        problems[0].operator[4] = bad;
        problems[1].rates[1] = bad;
        problems[2].friction[0] = bad;
        problems[3].regularization[0] = bad;
        for problem in problems {
            let mut r = [1.0; 3];
            let report = solve_by(method, &problem, &mut r);
            assert!(!report.solved && report.complementarity.is_nan());
            assert_eq!(r, [0.0; 3]);
        }
        // A guess is only a guess.
        assert!(solve_by(method, &good, &mut [bad; 3]).solved);
        let huge = Problem::new(vec![1e300; 9], vec![-1e300; 3], vec![0.5], 0.0);
        solve_by(method, &huge, &mut [0.0; 3]);
    }
}

#[test]
fn without_contacts_or_without_an_operator_it_returns() {
    for method in [ConeMethod::Newton, SWEEPS] {
        let none = Problem::new(vec![], vec![], vec![], 0.0);
        assert!(solve_by(method, &none, &mut []).solved);
        let still = Problem::new(vec![0.0; 9], vec![1.0, 0.0, 0.0], vec![0.5], 0.0);
        assert!(solve_by(method, &still, &mut [0.0; 3]).solved);
        let closing = Problem::new(vec![0.0; 9], vec![-1.0, 0.0, 0.0], vec![0.5], 0.0);
        assert!(!solve_by(method, &closing, &mut [0.0; 3]).solved);
    }
}

#[test]
fn lengths_have_to_fit() {
    let problem = single(0.0, [-2.0, 6.0, 8.0], 0.5);
    let mut solver = ConeSolver::new();
    let short = Contacts {
        rates: &problem.rates[..2],
        ..problem.contacts()
    };
    let dimension = |what, expected, found| {
        Err(SolveError::Dimension {
            what,
            expected,
            found,
        })
    };
    let solved = solver.solve(&short, ConeMethod::Newton, &mut [0.0; 3]);
    assert_eq!(solved, dimension("rates", 3, 2));
    let solved = solver.solve(&problem.contacts(), ConeMethod::Newton, &mut [0.0; 4]);
    assert_eq!(solved, dimension("impulses", 3, 4));
}

#[test]
fn methods_are_read_as_they_are_written() {
    for method in [ConeMethod::Newton, SWEEPS] {
        assert_eq!(method.to_string().parse(), Ok(method));
    }
    let short: ConeMethod = "pgs:sweeps=7".parse().unwrap();
    assert!(matches!(short, ConeMethod::GaussSeidel { sweeps: 7, .. }));
    for (text, part) in [
        ("lemke", "lemke"),
        ("newton:sweeps=3", "sweeps=3"),
        ("pgs:x", "x"),
        ("pgs:sweeps=-1", "sweeps=-1"),
        ("staggered:sweeps=10", "staggered"),
    ] {
        assert_eq!(text.parse::<ConeMethod>().unwrap_err().part, part);
    }
    let told = "staggered".parse::<ConeMethod>().unwrap_err().to_string();
    let holds = told.contains("before the joints") && told.contains("`newton`");
    assert!(holds, "{told}");
}

/// Stacks of ten boxes of which some slide: the whole solved by blocks of what sticks, and at once.
#[test]
fn what_sticks_and_is_eliminated_has_the_impulses_of_the_whole() {
    for (ratio, place, push) in [(1.0, 9, 0.02), (1e3, 5, 0.02), (1e3, 9, 0.0)] {
        let world = stack(&masses(ratio, place), 0.5, push, 0.0, &mut Random::new(3));
        let (world, mut problem) = (world.problem(1e-8), Scaled::default());
        assert!(problem.load(&world.contacts()));
        let mut r = vec![0.0; 3 * problem.n];
        assert!(solve(&world, &mut r).solved, "{ratio} {place}");
        let scaled = r.iter().zip(problem.root_of_rows());
        let whole: Vec<f64> = scaled.map(|(r, root)| r * root).collect();
        // From near by: with impulses that all are a little off.
        let start: Vec<f64> = whole.iter().map(|x| x * (1.0 + 1e-3)).collect();
        let (mut step, mut newton, mut best) = <(Step, Newton, Best)>::default();
        best.begin(&start);
        let mut sticking = Sticking::default();
        let pivots = sticking.run(&problem, &mut step, &mut newton, &start, &mut best);
        assert!(pivots > 0, "{ratio} {place}");
        assert!(best.residual <= 1e-12, "{ratio} {place}: {}", best.residual);
        let size = whole.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for (a, b) in best.x.iter().zip(&whole) {
            assert!((a - b).abs() < 1e-5 * size, "{ratio} {place}: {a} {b}");
        }
    }
}
