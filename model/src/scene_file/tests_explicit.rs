//! Tests of explicit scenes.

use crate::testing::*;

use super::testing::{built, check_faults, fault, reads_back, says};

const CRANE: &str = r#"
name = "crane"
gravity = [0, 0, -9.81]
load = "hook"

[[body]]
name = "link"
mass = 2
shape = { rod = { length = 1.0, radius = 0.01 } }
position = [0.5, 0, 0]
rotation = [0, -1.5707963267948966, 0]

[[body]]
name = "hook"
mass = 50
inertia = [1, 2, 2.5]
position = [1.2, 0, 0]
orientation = [0.6, 0, 0.8, 0]
velocity = [0, 0, -1]

[[joint]]
name = "anchor"
kind = "spherical"
a = "world"
b = "link"
point = [0, 0, 0]
stretch = 1e-7
damping = 0.01
motion = { smooth = { displacement = [0, 0.5, 0], duration = 2 } }

[[joint]]
name = "cable"
kind = "cosserat"
a = "link"
b = "hook"
point = [1, 0, 0]
axis = [1, 0, 0]
ea = 1e6
ei = 10
gj = 8.0
length = 0.5
group = 1
"#;

fn load(text: &str) -> Scene {
    reads_back(&SceneSource::parse(text, &[]).expect("loads"));
    built(text)
}

#[test]
fn bodies_and_joints_are_as_written() {
    let scene = load(CRANE);
    assert_eq!((scene.name.as_str(), scene.load), ("crane", Some(1)));
    assert_eq!(scene.groups, [0, 1]);
    assert_eq!(scene.bodies.velocity[1], Vector3::new(0.0, 0.0, -1.0));
    let Constraint::Spherical(anchor) = scene.constraints[0] else {
        panic!("the anchor is spherical");
    };
    assert_eq!(anchor.stretch, RowLaw::new(1e-7, 0.01));
    assert!(matches!(
        anchor.frames[0].side,
        Side::World(Motion::Smooth { duration: 2.0, .. })
    ));
    assert_eq!(scene.constraints[1].row(3).1, RowLaw::new(0.05, 0.0));
    // Both points coincide and the joint is straight in the pose given.
    let lin = Linearized::at(&scene, 0.0);
    assert!(lin.phi.iter().all(|phi| phi.abs() < 1e-15), "{:?}", lin.phi);
    for i in 0..2 {
        assert!(crate::check_jacobian(&scene, i).max < 1e-9);
    }
}

#[test]
fn overrides_reach_entries_by_name_and_number() {
    let overrides = [
        ("body.hook.mass", "70"),
        ("joint.1.ei", "20"),
        ("load", "link"),
        ("gravity", "[0, 0, 0]"),
    ];
    let source = SceneSource::parse(CRANE, &overrides).expect("loads");
    let scene = source.build().expect("builds");
    assert_eq!(scene.bodies.mass[1], 70.0);
    assert_eq!(scene.constraints[1].row(3).1.compliance, 0.025);
    assert_eq!((scene.load, scene.gravity), (Some(0), Vector3::zeros()));
    for (key, words) in [
        ("body.ring.mass", "… no entry called `ring`"),
        ("body", "… override `body`"),
        ("joint.anchor", "… override `joint.anchor`"),
        ("joint.anchor.lenght", "… unknown field `lenght`"),
        ("name.x", "… has no keys"),
    ] {
        says(&fault(CRANE, &[(key, "1")]), words);
    }
}

#[test]
fn locks_and_papers_and_boxes() {
    let text = r#"
        [[body]]
        name = "box"
        mass = 12
        shape = { box = { size = [1, 1, 1] } }
        [[body]]
        name = "ball"
        mass = 1
        shape = { sphere = { radius = 0.1 } }
        [[joint]]
        name = "weld"
        kind = "lock"
        a = "box"
        b = "world"
        point = [0, 0, 0.5]
        rotation = 1e-3
        motion = { circle = { radius = 1, period = 2, ramp = 2 } }
        [[joint]]
        name = "twist"
        kind = "paper"
        a = "box"
        b = "ball"
        point_a = [0, 0, -0.5]
        point_b = [0, 0, 0.1]
        twist = 0.5
        twist_definition = "alternative"
    "#;
    let scene = load(text);
    assert_eq!(scene.bodies.inertia[0][(0, 0)], 2.0);
    let weld = &scene.constraints[0];
    assert_eq!(
        (
            weld.rows(),
            weld.row(2).1.compliance,
            weld.row(3).1.compliance
        ),
        (6, 0.0, 1e-3)
    );
    assert_eq!(scene.constraints[1].rows(), 1);
}

const LINKS: &str = r#"
[[body]]
name = "bead"
mass = 1
shape = "particle"
position = [0, 0, -1.5]
[[body]]
name = "ball"
mass = 3
shape = { sphere = { radius = 0.1 } }
position = [0, 0.1, -3]
[[joint]]
name = "top"
kind = "distance"
a = "world"
b = "bead"
point_a = [0, 0, 0.5]
point_b = [0, 0, 0]
length = 2
ea = 1e6
transverse = true
motion = { smooth = { displacement = [0, 0.5, 0], duration = 2 } }
[[joint]]
name = "low"
kind = "distance"
a = "bead"
b = "ball"
point_a = [0, 0, 0]
point_b = [0, 0, 0.1]
length = 1.25
stretch = 1e-7
damping = 0.5
"#;

#[test]
fn distances_are_as_written() {
    let scene = load(LINKS);
    assert_eq!(
        scene.bodies.get(0).inertia,
        crate::Body::particle(1.0).inertia
    );
    let [Constraint::Distance(top), Constraint::Distance(low)] = scene.constraints[..] else {
        panic!("two distances");
    };
    assert_eq!((top.length, top.law), (2.0, RowLaw::new(2e-6, 0.0)));
    assert_eq!((low.length, low.law), (1.25, RowLaw::new(1e-7, 0.5)));
    assert!(top.transverse && !low.transverse);
    assert!(matches!(
        top.frames[0].side,
        Side::World(Motion::Smooth { duration: 2.0, .. })
    ));
    let lin = Linearized::at(&scene, 0.0);
    assert_eq!((lin.rows(), lin.phi[0]), (4, 0.0));
    for i in 0..2 {
        assert!(crate::check_jacobian(&scene, i).max < 1e-9);
    }
    let faults = r##"
        length = 1.25 → length = -1.25 → line … joint `low`: length is -1.25: it has to be > 0 m
        length = 2 → length = 0 → line … joint `top`: length is 0
        length = 1.25 → length = nan → line … length is NaN
        length = 1.25 →  → line … joint `low`: length: is needed
        ea = 1e6 →  → line … joint `top` has no rows
        ea = 1e6 → ea = 1e6⏎bend = 1 → line … need kind
        stretch = 1e-7 → stretch = nan → line … compliance is NaN
        stretch = 1e-7 → stretch = 1⏎rotation = 1 → line … is for locks
        transverse = true → transverse = 1 → line … invalid type
        point_a = [0, 0, 0]⏎point_b = [0, 0, 0.1] → point = [0, 0, 0] → line … give point_a and point_b
    "##;
    check_faults(LINKS, faults);
}
