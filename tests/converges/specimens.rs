//! Figs 10–12 in their quick form: our own bars, the orders in N, what the twist angles read of bending.

use indicatif::ProgressBar;
use serde_json::Value;
use std::f64::consts::{FRAC_PI_2, TAU};
use taut_output::check::{Check, Verdict};
use taut_studies::paper::specimens::{SEGMENTS, bend, order, pull, twist};

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or(f64::NAN)
}

fn assert_no_failure(checks: &[Check]) {
    for check in checks {
        assert_ne!(check.verdict, Verdict::Fail, "{check:?}");
    }
    assert!(checks.iter().any(|c| c.verdict == Verdict::Pass));
}

#[test]
fn pull_is_exact_to_half_the_length_for_every_n() {
    let rows = pull::run(true, &ProgressBar::hidden()).expect("runs");
    assert_eq!(rows.len(), 3 * SEGMENTS.len() * 2 * 2);
    for row in &rows {
        assert_eq!(row["sideways_m"], 0.0, "{row:?}");
    }
    assert_no_failure(&pull::outcome(&rows).expect("reports").checks);
}

#[test]
fn twist_follows_37_turns_and_holds_them_under_tension() {
    let results = twist::run(true, &ProgressBar::hidden()).expect("runs");
    let [rows, held, _] = &results;
    let farthest = rows.iter().map(|r| number(r, "twist")).fold(0.0, f64::max);
    assert!((farthest - twist::FARTHEST).abs() < 1e-6);
    let held = |step: &str| {
        let mut taut = held.iter().filter(|h| number(h, "tension") > 1.0);
        taut.find(|h| h["step"] == step).expect("runs")
    };
    assert_eq!(held("stiffened")["straight"], true);
    assert_eq!(held("paper")["lost"], true);
    assert_no_failure(&twist::outcome(&results).expect("reports").checks);
}

#[test]
fn bending_leaks_into_the_papers_twist_angles_only() {
    for leak in twist::leaks().expect("builds") {
        let size = |key| number(&leak, key).abs();
        let direction = size("direction_rad");
        assert!(size("cosserat") < 1e-14, "{leak:?}");
        if direction == 0.0 || direction == FRAC_PI_2 {
            assert!(size("ordinary") < 1e-14, "{leak:?}");
        }
        if direction == FRAC_PI_2 {
            let difference = size("alternative") - size("theta");
            assert!(difference.abs() < 1e-14, "{leak:?}");
        }
    }
}

#[test]
fn the_chain_buckles_at_greenhills_torque() {
    let exact = 8.986_818_916;
    let errors = [12, 24, 48].map(|n| (n, twist::buckling_torque(n, 1e12, 0.0) / exact - 1.0));
    let order = order(&errors).expect("above rounding");
    assert!((order - 2.0).abs() < 0.1, "{errors:?}");
}

#[test]
fn bending_closes_the_circle_with_second_order() {
    let rows = bend::run(true, &ProgressBar::hidden()).expect("runs");
    assert!(rows.iter().any(|r| number(r, "direction_rad") > 0.0));
    assert_no_failure(&bend::outcome(&rows).expect("reports").checks);
    let radius = bend::deviations(&rows, 0.25 * TAU, "radius_deviation");
    let half_missing = bend::deviations(&rows, TAU, "half_missing_deviation");
    assert!((order(&radius[1..]).expect("above rounding") - 2.0).abs() < 0.1);
    assert!((order(&half_missing[1..]).expect("above rounding") - 1.0).abs() < 0.1);
}

#[test]
fn a_ring_under_a_fixed_moment_leaves_its_plane() {
    for refined in [1.0, 2.0] {
        let growth = |part| bend::growth_out_of_plane(24, part, refined).expect("runs");
        assert!(growth(0.75) < 1.0);
        assert!(growth(1.0) > 1e3);
    }
}
