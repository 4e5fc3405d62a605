//! Tests of cables over sheaves as text, and of their faults.

use super::SceneText;
use super::testing::{built, round_trip};
use crate::testing::*;

/// A load on a cable from a drum over a sheave with friction and one without.
const REEVED: &str = include_str!("texts/reeved.toml");

#[test]
fn a_cable_over_sheaves_with_friction_has_parts() {
    let scene = built(REEVED);
    assert_eq!(scene.constraint_names, ["axle", "rope", "rope-2"]);
    assert_eq!(scene.capstans.len(), 1);
    assert_eq!(scene.capstans[0].parts, [1, 2]);
    // A turn more than the path has.
    let wrap = scene.wrap(0);
    assert!(wrap > std::f64::consts::TAU && wrap < 7.0, "{wrap}");
    let length = |i: usize| match &scene.constraints[i] {
        Constraint::MasslessCable(cable) => {
            (cable.length, cable.law.compliance, cable.winch.is_some())
        }
        _ => unreachable!(),
    };
    let [(first, soft, winds), (second, softer, no)] = [1, 2].map(length);
    assert!((first + second - 20.0).abs() < 1e-14);
    assert!((soft / first - 1e-7).abs() < 1e-20 && (softer / second - 1e-7).abs() < 1e-20);
    assert!(winds && !no);
}

#[test]
fn a_reeved_scene_is_written_and_read_back_to_the_bit() {
    let mut scene = built(REEVED);
    for moved in [0.0, -0.4, 1.3] {
        scene.bodies.position[2].z += moved;
        update_windings(&mut scene, 0.0);
        round_trip(&scene);
    }
    if let Constraint::MasslessCable(cable) = &mut scene.constraints[2]
        && let Some(Some(inner)) = cable.sheaves.get_mut(1)
    {
        inner.contact = SheaveContact::Off { clear: true };
    }
    let text = SceneText::from_scene(&scene).expect("is written");
    assert_eq!(text.build(), Ok(scene));
}

#[test]
fn a_cable_off_a_sheave_with_friction_is_one_that_breaks_as_a_whole() {
    let mut scene = built(&REEVED.replace("ea = 1e7", "ea = 1e7\nbreaks_at = 1e5"));
    let laid = scene.rest_states(0);
    assert_eq!(scene.events.len(), 1);
    let second = scene.lift_off(0, 0.0).expect("a part");
    scene.remove(&[], &[second]).expect("goes");
    assert_eq!(scene.constraint_names, ["axle", "rope"]);
    assert_eq!((scene.capstans.len(), scene.events.len()), (0, 1));
    assert_eq!(scene.validate(), Ok(()));
    let text = SceneText::from_scene(&scene).expect("is written");
    let written = toml::to_string(&text).expect("a text");
    let holds = written.contains("friction = 0.1") && written.contains("off = true");
    assert!(holds, "{written}");
    assert_eq!(built(&written), scene, "{written}");
    // Nothing lies on it yet.
    assert_eq!(scene.landed().count(), 0);
    if let Constraint::MasslessCable(cable) = &mut scene.constraints[1]
        && let Some(Some(sheave)) = cable.sheaves.get_mut(1)
    {
        let (arriving, leaving) = (laid[0].cut - 3.3, laid[1].cut + 3.3);
        sheave.contact = SheaveContact::On { arriving, leaving };
    }
    assert_eq!(scene.landed().collect::<Vec<_>>(), [1]);
    assert_eq!(scene.lay_down(1, 0.0), Ok(vec![2]));
    assert_eq!(scene.constraint_names, ["axle", "rope", "rope-2"]);
    assert_eq!(scene.capstans[0].parts, [1, 2]);
    assert_eq!(scene.validate(), Ok(()));
    for (part, before) in [1, 2].into_iter().zip(laid) {
        let Constraint::MasslessCable(cable) = &scene.constraints[part] else {
            panic!("no cable");
        };
        assert!((cable.length - before.length).abs() < 1e-12, "{part}");
    }
}

#[test]
fn the_drum_of_the_guide_is_a_scene_without_doubts() {
    let scene = built(include_str!("drum.toml"));
    assert_eq!(scene.constraint_names, ["axle", "rope", "rope-2"]);
    assert_eq!(scene.notes(), [""; 0]);
}
