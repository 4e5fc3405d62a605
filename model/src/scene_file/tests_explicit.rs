//! Tests of explicit scenes.

use nalgebra::Vector3;
use proptest::prelude::*;

use super::SceneSource;
use crate::constraint::{Constraint, RowLaw};
use crate::frame::Side;
use crate::linearized::Linearized;
use crate::motion::Motion;
use crate::scene::Scene;

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
    let source = SceneSource::parse(text, &[]).expect("loads");
    let again = source.to_toml().expect("writes");
    let again = SceneSource::parse(&again, &[]).expect("reads");
    assert_eq!(again, source);
    source.build().expect("builds")
}

fn fault(text: &str) -> String {
    let error = SceneSource::parse(text, &[])
        .and_then(|s| s.build())
        .expect_err("a fault");
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text}");
    text
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
    let mut lin = Linearized::new(&scene);
    lin.update(&scene, 0.0);
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
        ("body.ring.mass", "no entry called `ring`"),
        ("body", "override `body`"),
        ("joint.anchor", "override `joint.anchor`"),
        ("joint.anchor.lenght", "unknown field `lenght`"),
        ("name.x", "has no keys"),
    ] {
        let error = SceneSource::parse(CRANE, &[(key, "1")]).expect_err("a fault");
        assert!(error.to_string().contains(words), "{error}");
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
    let mut lin = Linearized::new(&scene);
    lin.update(&scene, 0.0);
    assert_eq!((lin.rows(), lin.phi[0]), (4, 0.0));
    for i in 0..2 {
        assert!(crate::check_jacobian(&scene, i).max < 1e-9);
    }
    let says = |from: &str, to: &str, words: &str| {
        assert!(LINKS.contains(from), "{from}");
        let text = fault(&LINKS.replacen(from, to, 1));
        assert!(text.contains(words), "{text}");
    };
    let needs = "joint `low`: length is -1.25: it has to be > 0 m";
    says("length = 1.25", "length = -1.25", needs);
    says("length = 2", "length = 0", "joint `top`: length is 0");
    says("length = 1.25", "length = nan", "length is NaN");
    says("length = 1.25", "", "joint `low`: length: is needed");
    says("ea = 1e6", "", "joint `top` has no rows");
    says("ea = 1e6", "ea = 1e6\nbend = 1", "need kind");
    says("stretch = 1e-7", "stretch = nan", "compliance is NaN");
    says(
        "stretch = 1e-7",
        "stretch = 1\nrotation = 1",
        "is for locks",
    );
    says("transverse = true", "transverse = 1", "invalid type");
    let points = "point_a = [0, 0, 0]\npoint_b = [0, 0, 0.1]";
    says(points, "point = [0, 0, 0]", "give point_a and point_b");
    let text = fault(&CRANE.replacen("stretch = 1e-7", "stretch = 0\ntransverse = true", 1));
    assert!(text.contains("transverse: needs kind"), "{text}");
}

/// Asserts that the crane with one change fails with a message that contains `words`.
fn says(from: &str, to: &str, words: &str) {
    assert!(CRANE.contains(from), "{from}");
    let text = fault(&CRANE.replacen(from, to, 1));
    assert!(text.contains(words), "{text}");
}

#[test]
fn faults_of_bodies_say_what_and_where() {
    says(
        "mass = 2",
        "mass = -2",
        "body `link`: mass is -2: it has to be > 0 kg",
    );
    says("mass = 2", "mass = nan", "mass is NaN");
    says(
        "mass = 2",
        "",
        "line 6, column 1: body `link`: mass: is missing",
    );
    says("length = 1.0", "length = 0", "length is 0");
    says(
        "inertia = [1, 2, 2.5]",
        "inertia = [1, 2, -2.5]",
        "positive definite",
    );
    says("inertia = [1, 2, 2.5]", "", "exactly one of shape");
    says(
        "orientation = [0.6,",
        "orientation = [0.7,",
        "unit quaternion",
    );
    says(
        "rotation = [0,",
        "orientation = [1, 0, 0, 0]\nrotation = [0,",
        "excludes rotation",
    );
    says(
        "name = \"link\"",
        "name = \"world\"",
        "stands for the fixed world",
    );
    says(
        "name = \"link\"",
        "name = \"hook\"",
        "two body entries are called `hook`",
    );
}

#[test]
fn faults_of_joints_say_what_and_where() {
    says(
        "name = \"cable\"",
        "name = \"anchor\"",
        "two joint entries are called `anchor`",
    );
    says(
        "b = \"link\"",
        "b = \"lnik\"",
        "joint `anchor` names the body `lnik`",
    );
    says("b = \"link\"", "b = \"world\"", "the world to the world");
    says("a = \"link\"", "a = \"hook\"", "to itself");
    says(
        "load = \"hook\"",
        "load = \"hok\"",
        "choose one of link, hook",
    );
    says("axis = [1, 0, 0]", "axis = [0, 0, 0]", "no direction");
    says(
        "axis = [1, 0, 0]",
        "axes_a = [[1, 0, 0], [0, 1, 0], [0, 1, 0]]",
        "axes of side a of joint `cable`",
    );
    says("length = 0.5", "", "needs length");
    says("length = 0.5", "length = 0.5\nbend = 1", "give one of them");
    says("stretch = 1e-7", "", "no rows");
    says("stretch = 1e-7", "stretch = -1e-7", "compliance is -");
    says("stretch = 1e-7", "stretch = 0\nbend = 1", "need kind");
    says(
        "stretch = 1e-7",
        "stretch = 0\nrotation = 1",
        "is for locks",
    );
    says("kind = \"spherical\"", "kind = \"weld\"", "`cosserat`");
    says("a = \"world\"", "a = \"hook\"", "moves the world side");
    says("duration = 2", "duration = 0", "time span");
    says(
        "point = [1, 0, 0]",
        "point_a = [1, 0, 0]",
        "both point_a and point_b",
    );
    says("point = [0, 0, 0]", "point = [0, 0]", "line");
    says(
        "gravity = [0, 0, -9.81]",
        "gravity = [0, 0, inf]",
        "gravity is inf",
    );
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Any one value of the text replaced by any other: a valid scene or a one-line error.
    #[test]
    fn any_changed_value_is_read_or_refused(
        line in 0_usize..40,
        value in "(-?[0-9]{1,3}(\\.[0-9]|e-?[0-9]{1,3})?|nan|inf|true|\"[a-z]{0,6}\"|\\[[0-9, ]{0,12}\\]|\\{ \\})",
    ) {
        let text: Vec<_> = CRANE
            .lines()
            .enumerate()
            .map(|(i, l)| match l.split_once('=') {
                Some((key, _)) if i == line => format!("{key} = {value}"),
                _ => l.to_owned(),
            })
            .collect();
        match SceneSource::parse(&text.join("\n"), &[]).and_then(|s| s.build()) {
            Ok(scene) => prop_assert_eq!(scene.validate(), Ok(())),
            Err(error) => prop_assert!(!error.to_string().contains('\n'), "{error}"),
        }
    }
}
