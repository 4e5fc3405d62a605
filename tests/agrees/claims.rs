use rayon::prelude::*;
use taut_measure::matrix::dump::body_rows;
use taut_measure::matrix::solve::backends;
use taut_measure::poses::{Pose, hoist};
use taut_solver::agreement::{FALSE, claims_study};
use taut_solver::reference_solution;
use taut_studies::hard::{self, Measured};
use taut_tests::claims::{Finding, Solve, Verified, audit, verify, whole};
use taut_tests::prelude::*;
use taut_tests::scenes::{ball_jointed, copies, overstretched};

/// Scenes without compliance and with dependent rows, which have no solution or several: all may refuse them.
const DEPENDENT: [&str; 2] = ["copies, rigid", "overstretched, rigid"];

/// A scene of each hard case, or all that it has, and scenes whose rows depend on each other.
fn scenes(of_each: usize) -> Vec<(String, Scene)> {
    let mut all = Vec::new();
    for case in hard::cases() {
        let own = case.scenes().expect("scenes").into_iter().take(of_each);
        all.extend(own.map(|s| (format!("{} {}", case.name(), s.name), s)));
    }
    for compliance in [1e-6, 0.0] {
        let law = if compliance > 0.0 { "soft" } else { "rigid" };
        all.push((format!("copies, {law}"), copies(2, compliance)));
        let cable = overstretched((compliance > 0.0).then_some(0.0));
        all.push((format!("overstretched, {law}"), cable));
    }
    all
}

/// No claim is false, none hides a residual; every scene is solved by someone, and everyone solves some.
fn claims_are_true(of_each: usize, instants: &[usize]) {
    let scenes = scenes(of_each);
    let audits = scenes.par_iter().with_max_len(1).map(|(name, scene)| {
        let found = audit(scene, instants).unwrap_or_else(|e| panic!("{name}: {e}"));
        (name, found)
    });
    let audits: Vec<_> = audits.collect();
    for (name, solves) in &audits {
        let wrong = solves.iter().find(|s| s.is_wrong());
        assert_eq!(wrong, None, "{name}");
        let is_solved = |f| matches!(f, Finding::TruePositive | Finding::FalseNegative);
        let solved = solves.iter().any(|s| is_solved(s.finding));
        let refused = !solves.is_empty() && DEPENDENT.contains(&name.as_str());
        assert!(solved || refused, "{name}: no solver has a solution");
    }
    let solves = || audits.iter().flat_map(|(_, solves)| solves);
    println!("{} solves in {} scenes", solves().count(), audits.len());
    for choice in Choice::all().into_iter().filter(|c| c.check().is_ok()) {
        let claims = solves().filter(|s| s.is_claim() && s.backend == choice.family());
        assert!(claims.count() > 0, "{choice} claims nothing");
    }
}

#[test]
fn claims_are_true_in_the_first_scenes_of_the_hard_cases() {
    claims_are_true(1, &[0, 3]);
}

#[test]
#[ignore = "half a minute: up to the 300th step"]
fn claims_are_true_in_all_scenes_of_the_hard_cases() {
    claims_are_true(usize::MAX, &[0, 1, 10, 40, 300]);
}

/// Indefinite, graded and singular systems, and such with growth, that tempt to false claims.
fn nothing_false_is_claimed_of(systems: u64) {
    let compiled = backends().into_par_iter().filter(Backend::is_compiled);
    compiled.for_each(|backend| {
        let mut solver = backend.with_tolerance(FALSE).create().expect("compiled");
        let study = claims_study(&mut *solver, 0..systems).expect("sound patterns");
        assert_eq!(study.false_claims, 0, "{backend}: {study:?}");
        assert!(study.claims > study.systems / 10, "{backend}: {study:?}");
    });
}

#[test]
fn no_backend_claims_what_is_false_of_a_thousand_adverse_systems() {
    nothing_false_is_claimed_of(1_000);
}

#[test]
#[ignore = "a minute"]
fn no_backend_claims_what_is_false_of_ten_thousand_adverse_systems() {
    nothing_false_is_claimed_of(10_000);
}

/// A solver with one iteration claims nothing, and is not good: the audit tells claims from mere answers.
#[test]
fn an_unfinished_solve_is_an_honest_failure() {
    let found = audit(&ball_jointed(1e-9), &[2]).expect("sound");
    let is_short = |backend: &str, variant: &str| backend == "cg:none" && variant == "1 iterations";
    let short = found.iter().filter(|s| is_short(&s.backend, &s.variant));
    let all_hold = short.clone().all(|s| s.finding == Finding::TrueNegative);
    assert!(all_hold, "{found:#?}");
    let compiled = "cg:none".parse::<Backend>().is_ok_and(|b| b.is_compiled());
    assert_eq!(short.count() > 0, compiled);
}

/// A poor solution that is claimed is found, and so is a residual that is told too small.
#[test]
fn false_claims_and_hidden_residuals_are_found() {
    let one: (Choice, String) = (
        "cg:none:tolerance=1e-4".parse().expect("a name"),
        String::new(),
    );
    for (told, size, wrong) in [(1e-9, 1e-9, false), (1e-5, 5e-5, true), (1e-3, 1e-3, true)] {
        let report = SolveReport {
            status: Status::Converged,
            iterations: 1,
            residual: told,
        };
        let seen = Verified {
            residual: size,
            backward_error: size,
        };
        let solve = Solve::of(0, &one, Ok((report, seen)));
        assert_eq!(solve.is_wrong(), wrong, "{solve:?}");
    }
}

/// The exact multipliers have no residual but their own rounding; others have one of the size of their error.
#[test]
fn exact_multipliers_have_no_residual() {
    let params = HoistParams::default().with(|p| (p.segments, p.mass_ratio) = (6, 10.0));
    let scene = hoist(&params, Pose::Bent).expect("a scene");
    let options = Choice::schur(Backend::Dense(DenseOptions::default()));
    let mut stepper = Stepper::new(scene, options.plain_options(1.0 / 60.0)).expect("sound");
    stepper.solve().expect("solvable");
    let (s, b) = stepper.assembled(Form::Schur).expect("assembled");
    let (kkt, kkt_b) = stepper.assembled(Form::Kkt).expect("assembled");
    let x = reference_solution(&kkt, &kkt_b).expect("regular");
    assert!(whole(&kkt, &kkt_b, &x).backward_error < 2e-16);
    let (bodies, p) = (body_rows(&kkt), kkt.pattern());
    let rows = (0..p.blocks()).filter(|&i| !bodies[i]);
    let mut mu: Vec<f64> = rows.flat_map(|i| p.rows(i)).map(|r| -x[r]).collect();
    let exact = verify(&s, &b, (&kkt, &kkt_b), &mu);
    assert!(exact.backward_error < 2e-16, "{exact:?}");
    // S (1 + δ) μ − b = δ b.
    mu.iter_mut().for_each(|mu| *mu *= 1.0 + 1e-6);
    let wrong = verify(&s, &b, (&kkt, &kkt_b), &mu);
    assert!((wrong.residual / 1e-6 - 1.0).abs() < 1e-2, "{wrong:?}");
    assert!(verify(&s, &b, (&kkt, &kkt_b), &mu[1..]).residual.is_nan());
}
