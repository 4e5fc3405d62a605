//! Shapes that can touch, as entries: what they are in a scene, back again, and their faults.

use crate::testing::*;

use super::SceneText;
use super::testing::{built, fault, reads_back, round_trip, says};

const YARD: &str = include_str!("texts/yard.toml");

#[test]
fn entries_are_colliders_of_bodies_of_cables_and_of_the_world() {
    let scene = built(YARD);
    let names: Vec<_> = scene.colliders.iter().map(|c| c.name.as_str()).collect();
    let all = "ball crate drum rope-1 rope-2 floor slope ceiling dust handle post";
    assert_eq!(names.join(" "), all);
    let named = |name: &str| {
        scene
            .colliders
            .iter()
            .find(|c| c.name == name)
            .expect("there")
    };
    let ball = named("ball");
    let found = (ball.body, ball.shape);
    assert_eq!(found, (Some(0), Shape::Sphere { radius: 0.2 }));
    assert_eq!((ball.groups, ball.meets), (DEFAULT_GROUP, u32::MAX));
    assert_eq!(ball.surface, Surface::default());
    let size = Vector3::new(1.0, 2.0, 3.0);
    assert_eq!(named("crate").shape, Shape::Cuboid { size });
    let found = (
        named("crate").surface.friction,
        named("crate").surface.restitution,
    );
    assert_eq!(found, (0.3, 0.25));
    // `loads`, `all` and `ropes` in the order of the text, after `default`.
    assert_eq!((named("crate").groups, named("crate").meets), (0b110, 0b11));
    let (length, radius) = (1.0, 0.5);
    assert_eq!(named("drum").shape, Shape::Cylinder { length, radius });
    let found = (
        named("drum").surface.compliance,
        named("drum").surface.damping,
    );
    assert_eq!(found, (1e-7, 0.01));
    let found = (named("rope-2").body, named("rope-2").groups);
    assert_eq!(found, (Some(6), 0b1000));
    assert!(
        matches!(named("rope-2").shape, Shape::Capsule { length, radius: 0.01 } if (length - 2.0).abs() < 1e-12)
    );
    assert_eq!(named("slope").meets, 0b10_0000_1000);
    let normal = named("slope").orientation * Vector3::z();
    assert!((normal - Vector3::new(-1.0, 0.0, 1.0).normalize()).norm() < 1e-15);
    assert!((named("ceiling").orientation * Vector3::z() + Vector3::z()).norm() < 1e-15);
    assert_eq!((named("handle").meets, named("post").groups), (0, 1 << 31));
    assert_eq!(named("post").body, None);
}

#[test]
fn a_written_scene_reads_back_to_the_same_bits() {
    round_trip(&built(YARD));
    // As it is read, too.
    let source = SceneSource::parse(YARD, &[]).expect("reads");
    reads_back(&source);
    let written = source.to_toml().expect("writes");
    assert!(written.contains("collide = true\n"), "{written}");
}

#[test]
fn a_scene_without_shapes_that_touch_is_written_without_them() {
    let scene = crate::HoistParams::default().build().expect("builds");
    let text = SceneText::from_scene(&scene).expect("a text");
    let written = SceneSource::Explicit(Box::new(text)).to_toml();
    let written = written.expect("writes");
    for word in ["collide", "ground", "group-"] {
        assert!(!written.contains(word), "{written}");
    }
}

#[test]
fn there_are_thirty_two_groups() {
    let groups = |count: usize| {
        let names: Vec<_> = (0..count).map(|i| format!("\"g{i}\"")).collect();
        YARD.replace(
            "groups = [\"ropes\"]",
            &format!("groups = [\"ropes\", {}]", names.join(", ")),
        )
    };
    // Beside `default`, `loads`, `all`, `ropes`, `group-9` and `group-31`.
    let scene = built(&groups(26));
    let all = scene.colliders.iter().fold(0, |all, c| all | c.groups);
    assert_eq!(all, u32::MAX - (1 << 9));
    says(
        &fault(&groups(27), &[]),
        "… number of groups is 33: at most 32",
    );
}

#[test]
fn overrides_reach_surfaces() {
    let overrides = [
        ("body.crate.collide.friction", "0.9"),
        ("ground.floor.friction", "0"),
    ];
    let scene = SceneSource::parse(YARD, &overrides).expect("reads");
    let scene = scene.build().expect("builds");
    let found = (
        scene.colliders[1].surface.friction,
        scene.colliders[5].surface.friction,
    );
    assert_eq!(found, (0.9, 0.0));
}
