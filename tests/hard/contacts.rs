//! H41, H44, H45, H55, H56, H62 to H66, and cables and loads that meet the ground.

use super::{checks, limited};
use taut_output::check::Verdict;
use taut_studies::hard::contacts::CASES;

#[test]
fn boxes_balls_and_cards_do_what_friction_says() {
    checks("H41");
    limited(
        "H44",
        &["ball dropped by 1 m, e = 0.8, 60 steps a second: bounces until"],
    );
    checks("H45");
}

#[test]
fn cables_lie_wind_and_land() {
    for name in ["H56", "wound", "touchdown", "scale", "landing"] {
        let found = checks(name);
        assert!(
            found.iter().all(|c| c.verdict == Verdict::Pass),
            "{found:#?}"
        );
    }
}

#[test]
fn what_lands_bounces_rides_and_is_set_down_keeps_its_laws() {
    for (name, rows) in [("H62", 3), ("H63", 12), ("H64", 5), ("H66", 16)] {
        assert_eq!(limited(name, &[]).len(), rows, "{name}");
    }
    limited("H65", &["cb of 1e6, 1e6 kg: drift"]);
}

#[test]
fn a_taut_cable_rests_on_an_edge() {
    limited(
        "H55",
        &[
            "loads swing in the plane, 60 steps a second: energy",
            "loads swing along the edge, 60 steps a second: energy",
        ],
    );
}

#[test]
fn every_case_has_a_scene_or_says_that_it_has_none() {
    for case in CASES {
        let scenes = (case.scenes)().expect("builds");
        let audited = !["H55", "scale"].contains(&case.name);
        assert_eq!(scenes.is_empty(), !audited, "{}", case.name);
    }
}
