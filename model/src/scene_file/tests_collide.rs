//! Shapes that can touch, as entries: what they are in a scene, back again, and their faults.

use crate::testing::*;

use super::SceneText;
use super::testing::{built, check_faults, fault, reads_back, round_trip, says};

const YARD: &str = r#"
[[body]]
name = "ball"
mass = 1
shape = { sphere = { radius = 0.2 } }
position = [0, 0, 1]
collide = true

[[body]]
name = "crate"
mass = 10
shape = { box = { size = [1, 2, 3] } }
position = [5, 0, 2]
collide = { friction = 0.3, restitution = 0.25, groups = ["loads", "all"], meets = ["default", "loads"] }

[[body]]
name = "drum"
mass = 10
shape = { cylinder = { length = 1, radius = 0.5 } }
position = [-5, 0, 1]
collide = { compliance = 1e-7, damping = 0.01 }

[[body]]
name = "dust"
mass = 1e-3
shape = "particle"
position = [0, 5, 1]

[[body]]
name = "quiet"
mass = 1
shape = { sphere = { radius = 0.2 } }
collide = false

[[cable]]
name = "rope"
from = { body = "world", point = [0, -5, 5], held = "free" }
to = { body = "world", point = [0, -5, 1], held = "free" }
segments = 2
radius = 0.01
collide = { friction = 0.1, groups = ["ropes"] }

[[ground]]
name = "floor"
friction = 0.8

[[ground]]
name = "slope"
point = [9, 0, 0]
normal = [-1, 0, 1]
meets = ["ropes", "group-9"]

[[ground]]
name = "ceiling"
point = [0, 0, 50]
normal = [0, 0, -2]

[[collider]]
name = "dust"
body = "dust"
shape = { sphere = { radius = 1e-3 } }

[[collider]]
name = "handle"
body = "crate"
shape = { capsule = { length = 0.2, radius = 0.02 } }
position = [0, 0, 1.6]
rotation = [0, 1.5, 0]
meets = []

[[collider]]
name = "post"
body = "world"
shape = { rod = { length = 2, radius = 0.1 } }
orientation = [0, 1, 0, 0]
groups = ["group-31"]
"#;

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
    assert_eq!(
        (ball.body, ball.shape),
        (Some(0), Shape::Sphere { radius: 0.2 })
    );
    assert_eq!((ball.groups, ball.meets), (DEFAULT_GROUP, u32::MAX));
    assert_eq!(ball.surface, Surface::default());
    let size = Vector3::new(1.0, 2.0, 3.0);
    assert_eq!(named("crate").shape, Shape::Cuboid { size });
    assert_eq!(
        (
            named("crate").surface.friction,
            named("crate").surface.restitution
        ),
        (0.3, 0.25)
    );
    // `loads`, `all` and `ropes` in the order of the text, after `default`.
    assert_eq!((named("crate").groups, named("crate").meets), (0b110, 0b11));
    let (length, radius) = (1.0, 0.5);
    assert_eq!(named("drum").shape, Shape::Cylinder { length, radius });
    assert_eq!(
        (
            named("drum").surface.compliance,
            named("drum").surface.damping
        ),
        (1e-7, 0.01)
    );
    assert_eq!(
        (named("rope-2").body, named("rope-2").groups),
        (Some(6), 0b1000)
    );
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

const FAULTS: &str = r##"
    friction = 0.3 → friction = -1 → line 14, column 13: body `crate`: collide.friction is -1: it has to be ≥ 0
    restitution = 0.25 → restitution = 1.5 → line … collide.restitution is 1.5: it has to be from 0 to 1
    damping = 0.01 → damping = nan → line … collide.damping is NaN
    compliance = 1e-7 → compliance = -1e-7 → line … body `drum`: collide.compliance is -0.0000001: it has to be ≥ 0 m/N
    friction = 0.3 → drag = 0.3 → line … unknown field `drag`, expected one of `friction`
    collide = false → collide = 3 → line … `true`, `false` or a table such as { friction = 0.3 }
    shape = "particle" → shape = "particle"⏎collide = true → line … needs shape: a sphere, a box or a cylinder
    collide = { friction = 0.1 → collide = { friction = -0.1 → line … cable `rope`: collide.friction is -0.1
    normal = [0, 0, -2] → normal = [0, 0, 0] → line … ground `ceiling`: normal: is zero
    friction = 0.8 → friction = -0.8 → line 45, column 1: ground `floor`: friction is -0.8
    name = "slope" → name = "floor" → line … two collider entries are called `floor`
    name = "handle" → name = "rope-1" → line … two collider entries are called `rope-1`
    body = "crate" → body = "box" → line … collider `handle` names the body `box`, which is not there
    length = 0.2, radius = 0.02 → length = 0.2, radius = 0 → line … collider `handle` of body `crate`: radius is 0: it has to be > 0 m
    length = 0.2, radius = 0.02 → length = -0.2, radius = 0.02 → line … length is -0.2: it has to be ≥ 0 m
    length = 2, radius = 0.1 → length = 2e9, radius = 0.1 → line … smallest dimension is 0.2: it has to be > 1e-9
    length = 2, radius = 0.1 → length = 0, radius = 0.1 → line … collider `post`: length is 0: it has to be > 0 m
    { sphere = { radius = 1e-3 } } → { sphere = { radius = nan } } → line … radius is NaN
    { capsule = { length = 0.2, radius = 0.02 } } → { box = { size = [1, 1, -1] } } → line … size is -1: it has to be > 0 m
    orientation = [0, 1, 0, 0] → orientation = [0, 2, 0, 0] → line … collider `post`: norm of the orientation is 2
    rotation = [0, 1.5, 0] → rotation = [0, 1.5, 0]⏎orientation = [1, 0, 0, 0] → line … excludes rotation
    { sphere = { radius = 1e-3 } } → { box = { size = [1, 1, 1] } } → line … collider `dust` of body `dust`: shape: would turn a point mass
    { capsule = { length = 0.2, radius = 0.02 } } → "half-space" → line … is a half-space, which has no end
    meets = ["ropes" → meets = ["rope" → line … meets: `rope`: is a group that nothing is in
    meets = ["ropes", "group-9"] → meets = ["group-32"] → line … meets: `group-32`: is a group that nothing is in
"##;

#[test]
fn faults_of_shapes_name_line_key_and_cure() {
    check_faults(YARD, FAULTS);
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
    assert_eq!(
        (
            scene.colliders[1].surface.friction,
            scene.colliders[5].surface.friction
        ),
        (0.9, 0.0)
    );
}
