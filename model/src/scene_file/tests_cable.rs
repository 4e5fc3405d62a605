//! Cables of segments as entries: what they lay, and their faults.

use super::testing::{built, fault, reads_back, round_trip, says};
use super::{SceneSource, SceneText};

const ROPE: &str = include_str!("texts/cables.toml");

/// `tail` has the length that its segments say.
pub(super) fn text() -> String {
    let message = fault(ROPE, &[("cable.tail.lengths", "[1e9]")]);
    let (_, length) = message.split_once("on a route of ").unwrap();
    let length: f64 = length.split(' ').next().unwrap().parse().unwrap();
    ROPE.replace("[0.5, 1.3]", &format!("[0.5, {}]", length - 0.5))
}

#[test]
fn entries_lay_cables_that_others_hold_on_to() {
    let scene = built(&text());
    let names: Vec<_> = scene.cables.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["rope", "tail"]);
    assert_eq!(scene.cables[0].bodies, [1, 2, 3, 4, 5, 6]);
    assert_eq!(scene.cables[0].joints, [1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(scene.cables[1].bodies, [7, 8]);
    assert_eq!(scene.constraint_names[..2], ["sling", "rope-start"]);
    let held = scene.constraints[8].frames()[0].body_index();
    let found = (scene.constraint_names[8].as_str(), held);
    assert_eq!(found, ("tail-start", Some(6)));
    // Written one by one it is the same scene, cables and all.
    let explicit = SceneText::from_scene(&scene).unwrap();
    assert!(explicit.cable.is_empty());
    round_trip(&scene);
    // As entries, too.
    reads_back(&SceneSource::parse(&text(), &[]).unwrap());
}

#[test]
fn overrides_find_cables_by_name() {
    let overrides = [("cable.rope.segments", "3"), ("joint.sling.a", "rope-2")];
    // `tail` begins on a segment that is not there.
    let message = fault(&text(), &overrides);
    says(&message, "… `rope-6`, which is not there");
}

const HOIST: &str = include_str!("../../../integrator/examples/segment_crane.toml");

#[test]
fn a_winch_hauls_in_a_cable_of_segments() {
    let scene = built(HOIST);
    let lead = scene.constraint("rope-start").unwrap();
    let crate::Constraint::Fairlead(of) = &scene.constraints[lead] else {
        panic!("a fairlead");
    };
    assert_eq!((of.winch.force_limit, of.winch.shortest), (5e4, 4.0));
    assert!(of.law.bend.is_some() && (of.length, of.first) == (20.0, 1.0));
    assert_eq!(scene.controls[0].drives[0].constraint, lead);
    let refused = SceneText::from_scene(&scene).unwrap_err().to_string();
    says(&refused, "… the winch of a cable of segments, `rope-start`");
    reads_back(&SceneSource::parse(HOIST, &[]).unwrap());
}

const RULED: &str = include_str!("../../../integrator/examples/rope.toml");

#[test]
fn a_rule_of_resolution_is_read() {
    let source = SceneSource::parse(RULED, &[]).unwrap();
    let scene = source.build().unwrap();
    let stock = scene.cables[0].stock.as_ref().unwrap();
    let rule = stock.resolution.as_ref().unwrap();
    let length = 73.0_f64.sqrt();
    assert!((rule.shortest - length / 48.0).abs() < 0.01 && (rule.longest - length).abs() < 0.1);
    let default = crate::scene::resolution::Resolution::default();
    let found = (rule.bend, rule.phase, rule.most);
    assert_eq!(found, (0.2, default.phase, default.most));
    let refused = SceneText::from_scene(&scene).unwrap_err().to_string();
    says(&refused, "… the rule of resolution of the cable `rope`");
    reads_back(&source);
}
