//! Tests of explicit scenes.

use crate::testing::*;

use super::testing::{built, fault, reads_back, says};

const CRANE: &str = include_str!("texts/joints.toml");

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
    let scene = load(include_str!("texts/boxes.toml"));
    assert_eq!(scene.bodies.inertia[0][(0, 0)], 2.0);
    let weld = &scene.constraints[0];
    let found = (
        weld.rows(),
        weld.row(2).1.compliance,
        weld.row(3).1.compliance,
    );
    assert_eq!(found, (6, 0.0, 1e-3));
    assert_eq!(scene.constraints[1].rows(), 1);
}

const LINKS: &str = include_str!("texts/links.toml");

#[test]
fn distances_are_as_written() {
    let scene = load(LINKS);
    let found = scene.bodies.get(0).inertia;
    assert_eq!(found, crate::Body::particle(1.0).inertia);
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
}
