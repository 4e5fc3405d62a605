//! Lengths of massless cables by their paths, and ropes that are too short.

use super::testing::{built, fault, reads_back, round_trip, says};
use crate::testing::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A rope from a drum with 2½ turns over a sheave to a hook: `LENGTH` stands for its length and stiffness.
const CRANE: &str = include_str!("texts/wound.toml");

/// 5 m between wheels of one size, a quarter of a turn, 6 m down, and 2½ turns on the drum.
const WOUND: f64 = 2.5 * TAU * 0.2;
const PATH: f64 = 5.0 + 0.2 * FRAC_PI_2 + 6.0 + WOUND;

fn text(length: &str, friction: &str) -> String {
    CRANE
        .replace("LENGTH", length)
        .replace("FRICTION", friction)
}

/// Length, stiffness and length off the drums of all parts together.
fn whole(scene: &Scene) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for constraint in &scene.constraints {
        if let Constraint::MasslessCable(cable) = constraint {
            sums[0] += cable.length;
            sums[1] = cable.length / cable.law.compliance;
            sums[2] += cable.length - cable.wound();
        }
    }
    sums
}

#[test]
fn a_length_left_out_is_that_of_the_path_with_its_wraps() {
    for friction in ["", ", friction = 0.15"] {
        for (keys, expected) in [
            ("ea = 3e6", PATH),
            ("ea = 3e6\nslack = 0.25", PATH + 0.25),
            ("stretch = 2e-6\ntension_only = true", PATH),
        ] {
            let text = text(keys, friction);
            let scene = built(&text);
            let [length, ..] = whole(&scene);
            assert!((length - expected).abs() < 1e-12, "{keys}: {length}");
            let slack = keys.contains("slack");
            let found = scene.notes().len();
            assert_eq!(found, usize::from(slack), "{:?}", scene.notes());
            round_trip(&scene);
            reads_back(&SceneSource::parse(&text, &[]).unwrap());
        }
    }
}

#[test]
fn a_cable_begins_with_the_tension_that_is_asked_for() {
    for friction in ["", ", friction = 0.15"] {
        for tension in [0.0, 1.0, 2500.0, 9e4] {
            for law in ["ea = 3e6", "stretch = 4e-6"] {
                if tension > 5e4 && !friction.is_empty() {
                    continue;
                }
                let keys = format!("{law}\ntension = {tension}");
                let scene = built(&text(&keys, friction));
                let [length, ea, off] = whole(&scene);
                let found = (PATH - length) / off * ea;
                let apart = (found - tension).abs();
                assert!(apart < 1e-7 + 1e-9 * tension, "{keys}: {found}");
            }
        }
    }
}

#[test]
fn a_rope_shorter_than_its_path_is_told_and_one_far_shorter_refused() {
    for friction in ["", ", friction = 0.15"] {
        // Its weight strains it by 1e-3.
        for (short, told) in [(0.0, false), (5e-4, false), (0.02, true), (0.34, true)] {
            let keys = format!("ea = 3e6\nlength = {}", PATH - short);
            let notes = built(&text(&keys, friction)).notes();
            assert_eq!(notes.len(), usize::from(told), "{short}: {notes:?}");
            let strain = short / (PATH - short - WOUND);
            let begins = format!("`rope` starts taut: it is {short:.3e} m shorter than its path");
            let (percent, pull) = (100.0 * strain, 3e6 * strain);
            let ends = format!(" {percent:.2} % that pulls with {pull:.3e} N");
            let sound = |note: &String| note.starts_with(&begins) && note.contains(&ends);
            assert!(notes.iter().all(sound), "{begins} {ends} {notes:?}");
            assert!(notes.iter().all(|note| note.contains("which is 14.4557")));
        }
        let keys = format!("ea = 3e6\nlength = {}", PATH - 2.0);
        says(
            &fault(&text(&keys, friction), &[]),
            "… massless cable `rope`: length is 12.4 … its path is 14.4557 … leave `length` out",
        );
        // The equilibrium lifts the hook to where it hangs.
        let text = format!("equilibrium = true\n{}", text(&keys, friction));
        assert_eq!(built(&text).notes(), [""; 0]);
        // Meant so, as one that is written back is.
        let scene = built(&self::text(&format!("{keys}\nstrained = true"), friction));
        assert_eq!(scene.notes().len(), 1);
        round_trip(&scene);
        // A band that carries less than the weight is meant to be long.
        let keys = format!("ea = 6e3\nlength = {}", PATH - 2.0);
        assert_eq!(built(&self::text(&keys, friction)).notes(), [""; 0]);
    }
}

#[test]
fn a_rigid_cable_that_is_too_short_cannot_stretch() {
    let [drum, sheave] = [
        "  { body = \"drum\", sheave = { radius = 0.2, axis = [0, 1, 0], turns = 2.5 } },\n",
        "  { body = \"world\", sheave = { radius = 0.2, axis = [0, 1, 0]FRICTION } },\n",
    ];
    let plain = CRANE.replace(drum, "");
    let plain = plain.replace(sheave, "  { body = \"world\", point = [0.2, 0, 0] },\n");
    let of = |keys: &str| built(&plain.replace("LENGTH", keys));
    assert_eq!(of("stretch = 0").notes(), [""; 0]);
    assert!((whole(&of("stretch = 0"))[0] - 6.0).abs() < 1e-12);
    let notes = of("stretch = 0\nlength = 5.9").notes();
    assert!(notes[0].contains("of what cannot stretch"), "{notes:?}");
}

/// A strut that is too long pushes: it is not slack.
#[test]
fn a_strut_is_never_slack() {
    let keys = format!("ea = 3e6\nlength = {}\ntension_only = false", PATH + 0.2);
    let notes = built(&text(&keys, "")).notes();
    assert!(!notes.concat().contains("slack:"), "{notes:?}");
}
