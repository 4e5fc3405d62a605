//! Scenes without their parts.

use super::{Leaner, Part};
use taut_model::named::NAMES;
use taut_model::{Constraint, Scene, SceneSource};

fn rows(scene: &Scene) -> usize {
    scene.constraints.iter().map(Constraint::rows).sum()
}

fn mass(scene: &Scene) -> f64 {
    scene.dynamic_bodies().map(|i| scene.bodies.mass[i]).sum()
}

const CRANE: &str = include_str!("crane.toml");

fn crane() -> SceneSource {
    SceneSource::parse(CRANE, &[]).expect("a crane")
}

fn without(source: &SceneSource, part: Part) -> (SceneSource, Scene) {
    let lean = source.without(part).expect("sound").expect("has the part");
    let scene = lean.build().expect("built");
    (lean, scene)
}

#[test]
fn rows_of_cables_go_where_their_keys_say_so() {
    let source = crane();
    let all = rows(&source.build().expect("built"));
    let (lean, scene) = without(&source, Part::Torsion);
    assert_eq!(all - rows(&scene), 10, "the free end has none");
    let (lean, bare) = without(&lean, Part::Bending);
    assert_eq!(rows(&scene) - rows(&bare), 20);
    let SceneSource::Explicit(text) = &lean else {
        panic!("an explicit scene stays one");
    };
    let cable = &text.cable[0];
    assert_eq!((cable.twist, cable.bend), (Some(false), Some(false)));
    assert!(lean.without(Part::Torsion).expect("sound").is_none());
}

#[test]
fn contacts_and_friction_go() {
    let (_, scene) = without(&crane(), Part::Friction);
    assert_eq!(scene.colliders.len(), 12);
    assert!(scene.colliders.iter().all(|c| c.surface.friction == 0.0));
    let (_, scene) = without(&crane(), Part::Contacts);
    assert!(scene.colliders.is_empty());
}

#[test]
fn segments_become_a_massless_cable_of_their_length_and_compliance() {
    let full = crane().build().expect("built");
    let (_, scene) = without(&crane(), Part::Segments);
    let [Constraint::MasslessCable(rope)] = &scene.constraints[..] else {
        panic!("{:?}", scene.constraint_names);
    };
    assert!((rope.length - 10.5).abs() < 1e-12, "{}", rope.length);
    let soft = |constraint: &Constraint| match constraint {
        Constraint::Cosserat(joint) => joint.law.stretch.map_or(0.0, |law| law.compliance),
        Constraint::Spherical(joint) => joint.stretch.compliance,
        _ => 0.0,
    };
    let all: f64 = full.constraints.iter().map(soft).sum();
    assert!((rope.law.compliance / all - 1.0).abs() < 1e-12);
    assert_eq!(scene.body_names, ["mast", "load"]);
    assert_eq!(scene.colliders.len(), 2);
}

#[test]
fn other_numbers_of_segments_keep_masses_and_lengths() {
    let crane = SceneSource::parse(
        &CRANE.replace("segments = 10", "lengths = [1, 2, 3, 4.5]"),
        &[],
    );
    for source in [
        SceneSource::load("hoist", &[]).expect("known"),
        SceneSource::load("hoist", &[("radius", "0.01")]).expect("known"),
        SceneSource::load("gantry", &[]).expect("known"),
        SceneSource::load("floor", &[]).expect("known"),
        SceneSource::load("bend", &[]).expect("known"),
        crane.expect("a crane"),
    ] {
        let full = source.build().expect("built");
        for factor in [0.5, 2.0] {
            let other = source.with_segments(factor);
            let other = other.expect("sound").expect("segments");
            let other = other.build().expect("built");
            assert!(other.bodies.len() != full.bodies.len());
            assert!((mass(&other) / mass(&full) - 1.0).abs() < 1e-12);
            let at = |scene: &Scene| scene.bodies.position[scene.load.expect("a load")];
            assert!((at(&other) - at(&full)).norm() < 1e-9);
        }
    }
    let one = SceneSource::load("hoist", &[("segments", "1")]).expect("known");
    assert!(one.with_segments(0.5).expect("sound").is_none());
}

#[test]
fn a_cable_gets_a_rule_where_it_can_have_one() {
    let of = |text: &str| {
        let source = SceneSource::parse(text, &[]).expect("a scene");
        source.with_resolution().expect("sound")
    };
    let ruled = of(CRANE).expect("a cable").build().expect("built");
    let stock = ruled.cables[0].stock.as_ref().expect("a stock");
    assert!(stock.resolution.is_some());
    let paper = CRANE.replace("segments = 10", "segments = 10\njoint = \"paper\"");
    assert_eq!(of(&paper), None);
    let hoist = SceneSource::load("hoist", &[]).expect("known");
    assert_eq!(hoist.with_resolution(), Ok(None));
}

/// Whatever is left out of whatever scene, the rest builds and is read back, or an error tells why not.
#[test]
fn every_named_scene_does_without_each_part_or_says_why_not() {
    for name in NAMES {
        let source = SceneSource::load(name, &[]).expect("known");
        let full = rows(&source.build().expect("built"));
        for part in Part::ALL {
            let lean = match source.without(part) {
                Ok(Some(lean)) => lean,
                Ok(None) => continue,
                Err(e) => {
                    let why = e.to_string();
                    let holds = part == Part::Stretch && why.contains("undetermined");
                    assert!(holds, "{name} {part:?}: {why}");
                    continue;
                }
            };
            let scene = lean.build().expect("built");
            assert!(rows(&scene) <= full, "{name} {part:?}");
            let text = lean.to_toml().expect("text");
            let again = SceneSource::parse(&text, &[]).expect("read");
            assert_eq!(again.build().expect("built"), scene, "{name} {part:?}");
        }
    }
}
