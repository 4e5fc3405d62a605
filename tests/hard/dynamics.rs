//! The gantry, and H20 to H39, H48, H59 and H61.

use super::{checks, limited};
use taut_integrator::{StepOptions, Stepper};
use taut_output::check::{Check, Verdict};
use taut_studies::hard::dynamics::CASES;

/// The largest error of the checks whose case contains `what`, of which there are at least `count`.
fn largest(checks: &[Check], what: &str, count: usize) -> f64 {
    let own = checks.iter().filter(|c| c.case.contains(what));
    let errors: Vec<f64> = own.map(|c| c.error.expect("a number")).collect();
    assert!(errors.len() >= count, "{what}: {errors:?}");
    assert!(errors.iter().all(|e| e.is_finite()), "{what}: {errors:?}");
    errors.into_iter().fold(0.0, f64::max)
}

/// Tolerances ten times above the measured figures.
#[test]
fn swings_and_chains_have_their_frequencies() {
    let found = checks("H20");
    assert!(
        largest(&found, "third-difference: period", 2) < 5e-8,
        "{found:#?}"
    );
    assert!(largest(&found, "10⁻⁴ rad", 1) < 6e-9, "{found:#?}");
    let found = checks("H21");
    assert!(largest(&found, "5 masses", 7) < 6e-6, "{found:#?}");
    assert!(largest(&found, ": eigenvalue", 6) < 3e-7, "{found:#?}");
}

#[test]
fn strings_bars_and_beams_have_their_frequencies() {
    let found = checks("H22");
    assert!(largest(&found, "mode 1", 6) < 3e-5, "{found:#?}");
    let found = checks("H23");
    assert!(largest(&found, ": eigenvalue", 2) < 1e-11, "{found:#?}");
    let limits = found.iter().filter(|c| c.verdict == Verdict::Limit);
    // The trapezoidal scheme rings at τ = 0.
    assert_eq!(limits.count(), 1, "{found:#?}");
    let found = checks("H24");
    assert!(largest(&found, ": eigenvalue", 1) < 1e-12, "{found:#?}");
    let found = checks("H25");
    assert!(largest(&found, ": order", 4) < 0.05, "{found:#?}");
}

#[test]
fn falls_snaps_and_flights() {
    let found = checks("H26");
    assert!(largest(&found, ": energy", 2) < 1e-12, "{found:#?}");
    let found = checks("H27");
    assert!(largest(&found, "small steps", 2) < 1e-2, "{found:#?}");
    let found = checks("H31");
    assert!(largest(&found, ": momentum", 2) < 2e-14, "{found:#?}");
    let found = checks("H32");
    assert!(
        largest(&found, ": angular momentum", 2) < 3e-11,
        "{found:#?}"
    );
}

/// H28: the amplitude of a swing that is hoisted follows the equation of its motion, and its adiabatic invariant.
#[test]
fn a_hoisted_swing_keeps_its_invariant() {
    let found = checks("H28");
    assert!(
        largest(&found, "growth of the amplitude", 2) < 1e-3,
        "{found:#?}"
    );
    assert!(largest(&found, "L^(3/4)", 2) < 5e-4, "{found:#?}");
}

/// H48: a winch's segments merge and split without their load noticing.
#[test]
fn segments_merge_and_split_unnoticed() {
    let found = checks("H48");
    assert!(largest(&found, "against 0.25 m", 1) < 1e-4, "{found:#?}");
    assert!(largest(&found, "twist", 1) < 1e-12, "{found:#?}");
    assert!(largest(&found, "momentum", 2) < 1e-12, "{found:#?}");
}

/// H48: so do those that a rule merges and splits anywhere in a cable.
#[test]
fn rules_merge_and_split_unnoticed() {
    let found = checks("H48-rule");
    assert!(largest(&found, "catenary", 1) < 5e-5, "{found:#?}");
    assert!(largest(&found, "winch", 1) < 1e-5, "{found:#?}");
    assert!(largest(&found, "kinetic energy", 1) < 1e-12, "{found:#?}");
}

/// H29: cranes swing with the frequencies of the double pendulum, the gantry with those of its own modes.
#[test]
fn cranes_have_the_frequencies_of_their_hooks_and_loads() {
    let found = checks("H29");
    for (what, count, bar) in [
        ("free rail", 1, 2e-6),
        ("slow", 2, 2e-6),
        ("fast", 2, 5e-5),
        ("turning", 1, 1e-5),
    ] {
        assert!(largest(&found, what, count) < bar, "{what}: {found:#?}");
    }
    assert!(
        found.iter().all(|c| c.verdict == Verdict::Pass),
        "{found:#?}"
    );
}

/// H30: force and way of a tackle of n parts are the n-th part, with every solver.
#[test]
fn tackles_multiply_forces() {
    let found = checks("H30");
    assert!(largest(&found, "Atwood", 2) < 1e-12, "{found:#?}");
    assert!(largest(&found, "parts at rest", 11) < 2e-9, "{found:#?}");
    assert!(largest(&found, "hauled in", 11) < 1e-12, "{found:#?}");
    assert!(
        found.iter().all(|c| c.verdict == Verdict::Pass),
        "{found:#?}"
    );
}

/// The gantry keeps to the same drive in finer steps, and every direct solver to its multipliers in 32 digits.
#[test]
fn the_gantry_is_driven_to_the_end() {
    let found = checks("gantry");
    assert!(largest(&found, ": hook", 1) < 5e-3, "{found:#?}");
    assert!(largest(&found, "e5: load", 1) < 2e-3, "{found:#?}");
    let solvers = found.iter().filter(|c| c.case.contains("multipliers"));
    for check in solvers {
        let slow = check.case.ends_with("gauss-seidel:joints");
        let expected = if slow { Verdict::Limit } else { Verdict::Pass };
        assert_eq!(check.verdict, expected, "{check:#?}");
    }
}

/// H33: in each step a deformation mode is multiplied by the roots of the scheme's characteristic polynomial.
#[test]
fn deformation_modes_are_damped_by_the_law_of_the_scheme() {
    let found = checks("H33");
    for mode in ["stretch", "twist", "bend"] {
        assert!(largest(&found, mode, 8) < 7e-11, "{found:#?}");
    }
}

/// H34: a rigid row closes its gap by a recurrence of the gaps alone, and as Δt → 0 exponentially with its time τ.
#[test]
fn gaps_close_by_the_law_of_the_scheme() {
    let found = checks("H34");
    assert!(largest(&found, "step by step", 12) < 2e-15, "{found:#?}");
    assert!(largest(&found, "relaxation time", 4) < 2e-7, "{found:#?}");
}

/// Every case in motion has a scene at its beginning that can be stepped.
#[test]
fn the_scenes_at_their_beginnings_can_be_stepped() {
    for case in CASES {
        let scenes = (case.scenes)().expect("scenes");
        assert!(!scenes.is_empty(), "{}", case.name);
        for scene in scenes {
            let place = format!("{}: {}", case.name, scene.name);
            let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
            for _ in 0..3 {
                stepper.step().unwrap_or_else(|e| panic!("{place}: {e}"));
            }
        }
    }
}

/// H35: a rope gives back no more than it took. H39: a winch that runs from the start adds nothing.
#[test]
fn ropes_and_winches_give_no_energy() {
    let found = checks("H35");
    assert!(largest(&found, "largest rebound", 5) < 1.0, "{found:#?}");
    assert!(largest(&found, "masses", 4) < 1e-9, "{found:#?}");
    let found = checks("H39");
    assert!(largest(&found, "hauled", 2) < 0.03, "{found:#?}");
}

/// H36: a load that snaps its cable taut has what it fell by.
#[test]
fn snaps_give_no_energy() {
    let found = checks("H36");
    assert!(largest(&found, "energy gained", 1) < 5e-4, "{found:#?}");
    assert!(largest(&found, "linear systems", 1) < 150.0, "{found:#?}");
}

#[test]
fn what_is_hooked_on_and_let_go_keeps_its_momentum() {
    assert_eq!(checks("H59").len(), 8);
}

/// H61: a damped rope catches where it is taut; its peaks are of the order of the step.
#[test]
fn damped_ropes_catch_where_they_are_taut() {
    let of = |compliance: &str, damping: &str| {
        let law = format!("{compliance} m/N, τ = {damping} s");
        format!("14 m of slack, {law}, 1/960 s: peak")
    };
    let stiff = ["0", "0.02", "0.05", "0.5", "5"].map(|damping| of("1e-6", damping));
    let soft = ["0.02", "0.05", "0.5", "5"].map(|damping| of("1e-4", damping));
    let rows: Vec<&str> = stiff.iter().chain(&soft).map(String::as_str).collect();
    let found = limited("H61", &rows);
    assert!(largest(&found, ": catch", 6) < 1e-3, "{found:#?}");
}
