//! Tests of what moves: mobility, hinges, sliders, motors, winches, controls, and of their faults.

use crate::testing::*;

use super::SceneText;
use super::testing::{built, fault, says};

const CRANE: &str = include_str!("texts/drives.toml");

#[test]
fn the_crane_is_what_its_text_says() {
    let scene = built(CRANE);
    let tower = Body::fixed().at(Vector3::z() * 10.0);
    assert_eq!(scene.bodies.get(0), tower);
    assert_eq!(scene.bodies.mobility[1], Mobility::Driven);
    // Its mass is that of a fixed body: 1 kg.
    let ship = Body::cuboid(Vector3::new(9.0, 3.0, 2.0), 1.0);
    assert_eq!(scene.bodies.inertia[1], ship.inertia);
    assert_eq!(scene.bodies.inertia[2], Body::rod(20.0, 0.4, 900.0).inertia);
    let Constraint::Hinge(slew) = &scene.constraints[0] else {
        panic!("{:?}", scene.constraints[0]);
    };
    let motor = Motor {
        target: Target::Position(6.5),
        force_limit: 1e5,
        law: RowLaw::new(1e-6, 0.2),
    };
    assert_eq!(slew.motor, Some(motor));
    assert_eq!((slew.stretch, slew.tilt.compliance), (RowLaw::RIGID, 1e-9));
    assert_eq!(slew.angle_reference, 6.5);
    let upwards = axes_along(&Vector3::z()).expect("a direction");
    assert_eq!(slew.frames[0].axes, upwards);
    let Constraint::Slider(rail) = &scene.constraints[1] else {
        panic!("{:?}", scene.constraints[1]);
    };
    assert_eq!(rail.motor, Some(Motor::speed(0.5)));
    let found = (rail.rotation, rail.across);
    assert_eq!(found, (RowLaw::RIGID, RowLaw::new(2e-8, 0.3)));
    // Along the jib, whose z axis is along the world's x.
    assert!((rail.frames[0].axes.column(0) - Vector3::z()).norm() < 1e-15);
    let Constraint::MasslessCable(rope) = &scene.constraints[2] else {
        panic!("{:?}", scene.constraints[2]);
    };
    let winch = Winch::new()
        .with(|w| (w.speed, w.force_limit, w.brake_limit) = (-0.25, 4000.0, 9000.0))
        .with(|w| w.longest = 30.0);
    assert_eq!((rope.winch, rope.tension_only), (Some(winch), true));
    let drive = |constraint, gain| Drive { constraint, gain };
    assert_eq!(scene.controls[0].name, "hoist_speed");
    assert_eq!(scene.controls[0].drives, [drive(2, -2.0), drive(1, 1.0)]);
}

#[test]
fn limits_left_out_and_infinite_ones_are_none() {
    let text = CRANE.replace("force_limit = 4000", "force_limit = inf");
    let open = CRANE.replace("force_limit = 4000, ", "");
    assert_eq!(built(&text), built(&open));
    let scene = built(&open);
    let text = SceneText::from_scene(&scene).expect("a text");
    let toml = SceneSource::Explicit(Box::new(text)).to_toml();
    assert!(!toml.expect("writes").contains("inf"));
    let still = CRANE.replace(
        "{ speed = -0.25, force_limit = 4000, brake_limit = 9e3, longest = 30 }",
        "{}",
    );
    let Constraint::MasslessCable(rope) = &built(&still).constraints[2] else {
        panic!("a cable");
    };
    assert_eq!(rope.winch, Some(Winch::new()));
}

#[test]
fn groups_are_those_of_the_topology_unless_an_entry_gives_one() {
    // A second pair of bodies, and a second rope that closes a loop.
    let more = r#"
[[body]]
name = "bob"
mass = 1
inertia = [1, 1, 1]
position = [9, 9, 0]
[[massless_cable]]
name = "far"
through = [{ body = "world", point = [9, 9, 9] }, { body = "bob" }]
length = 9
stretch = 0
[[massless_cable]]
name = "loop"
through = [{ body = "jib" }, { body = "hook" }]
length = 12
stretch = 0
"#;
    let text = format!("{CRANE}{more}");
    let scene = built(&text);
    let mut again = scene.clone();
    again.group_by_topology();
    assert_eq!(scene.groups, again.groups);
    assert_eq!(scene.groups, [0, 0, 0, 1, 2]);
    let text = text.replace("kind = \"slider\"", "kind = \"slider\"\ngroup = 7");
    assert_eq!(built(&text).groups, [0, 7, 0, 0, 0]);
    // Written groups are kept, even where all are 0.
    let mut flat = scene;
    flat.groups.fill(0);
    let text = SceneText::from_scene(&flat).expect("a text");
    assert_eq!(text.build().expect("builds").groups, [0; 5]);
}

#[test]
fn overrides_of_what_moves() {
    let set = [
        ("joint.rail.motor.speed", "0.75"),
        ("control.hoist_speed.drives.0.gain", "3"),
        ("massless_cable.rope.winch.brake", "true"),
        ("body.tower.mobility", "driven"),
    ];
    let scene = SceneSource::parse(CRANE, &set).and_then(|s| s.build());
    let scene = scene.expect("builds");
    let found = scene.constraints[1].motor().copied();
    assert_eq!(found, Some(Motor::speed(0.75)));
    assert_eq!(scene.controls[0].drives[0].gain, 3.0);
    assert_eq!(scene.bodies.mobility[0], Mobility::Driven);
    assert_eq!(scene.bodies.inertia[0], Matrix3::identity());
    let text = fault(CRANE, &[("joint.slew.motor.force_limit", "-1")]);
    says(
        &text,
        "override `joint.slew.motor.force_limit`: joint `slew`",
    );
}
