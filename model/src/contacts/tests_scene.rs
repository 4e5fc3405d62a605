//! Which pairs of a scene have contacts, and when.

use crate::testing::*;

use super::tests::{EXACT, contacts, v};
use super::*;

/// Balls of 1 m that all overlap each other and the ground.
fn heap(count: usize) -> Scene {
    let mut scene = Scene::new("heap");
    for i in 0..count {
        let body = Body::sphere(1.0, 1.0).at(v(0.1 * i as f64, 0.0, 0.5));
        let body = scene.add_body(format!("ball-{i}"), body);
        scene.add_collider(Collider::new(
            format!("ball-{i}"),
            Some(body),
            Shape::Sphere { radius: 1.0 },
        ));
    }
    scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
    scene
}

fn pairs(scene: &Scene) -> Vec<[usize; 2]> {
    contacts(scene).iter().map(|c| c.colliders).collect()
}

#[test]
fn bodies_that_are_joined_do_not_meet_but_all_meet_the_ground() {
    let mut scene = heap(3);
    let found = pairs(&scene);
    assert_eq!(found, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]);
    let frames = [
        Frame::body(0, v(0.1, 0.0, 0.0)),
        Frame::body(1, v(0.0, 0.0, 0.0)),
    ];
    let stretch = RowLaw::RIGID;
    scene.add_constraint("joint", Spherical { frames, stretch }, 0);
    let frames = [
        Frame::world(v(0.2, 0.0, 0.5)),
        Frame::body(2, v(0.0, 0.0, 0.0)),
    ];
    scene.add_constraint("anchor", Spherical { frames, stretch }, 0);
    assert_eq!(pairs(&scene), [[0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]);
    // A second shape of a body meets what the first does, but not the first.
    scene.add_collider(Collider::new(
        "more",
        Some(2),
        Shape::Sphere { radius: 1.0 },
    ));
    assert_eq!(pairs(&scene).len(), 8);
    // Nothing meets where nothing moves.
    for i in 0..3 {
        scene.bodies.mobility[i] = crate::Mobility::Static;
    }
    assert!(Collisions::new(&scene).is_empty());
    scene.bodies.mobility[2] = crate::Mobility::Dynamic;
    assert_eq!(pairs(&scene).len(), 6);
}

#[test]
fn bodies_that_only_a_cable_joins_meet() {
    let ends = [v(0.0, 0.0, -1.0), v(0.0, 0.0, 1.0)];
    let frames = [0, 1].map(|i| Frame::body(i, ends[i])).to_vec();
    let mut scene = heap(2);
    scene.add_constraint("cable", MasslessCable::new(frames, 3.0, RowLaw::RIGID), 0);
    assert_eq!(pairs(&scene), [[0, 1], [0, 2], [1, 2]]);
}

#[test]
fn groups_have_to_meet_both_ways() {
    let mut scene = heap(2);
    scene.colliders[0].groups = 0b10;
    assert_eq!(pairs(&scene).len(), 3);
    scene.colliders[1].meets = 0b1;
    assert_eq!(pairs(&scene), [[0, 2], [1, 2]]);
    scene.colliders[1].meets = u32::MAX;
    scene.colliders[0].meets = 0b100;
    assert_eq!(pairs(&scene), [[1, 2]]);
    scene.colliders[1].meets = 0;
    assert!(Collisions::new(&scene).is_empty());
}

#[test]
fn a_cable_meets_the_ground_and_not_itself() {
    let mut scene = Scene::new("laid");
    scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
    let ends = [v(0.0, 0.0, 0.01), v(4.0, 0.0, 0.01)].map(CableEnd::Free);
    let surface = Surface::default().with(|s| s.friction = 0.2);
    let cable = Cable::round("rope", &Material::STEEL, 0.01, ends)
        .with(|p| (p.segments, p.collide) = (Segments::Equal(4), Some(surface)));
    scene.add_cable(&cable).expect("lies");
    assert_eq!(scene.validate(), Ok(()));
    let names: Vec<_> = scene.colliders.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["ground", "rope-1", "rope-2", "rope-3", "rope-4"]);
    let Shape::Capsule { length, radius } = scene.colliders[2].shape else {
        panic!("a capsule");
    };
    assert!((length - 1.0).abs() < EXACT && radius == 0.01);
    let found = contacts(&scene);
    // One at each end of a segment, which neighbours share.
    assert_eq!(found.len(), 5);
    assert!(
        found
            .iter()
            .all(|c| c.gap.abs() < EXACT && c.colliders[0] == 0)
    );
    let expected = surface.meet(&Surface::default()).friction;
    assert_eq!(found[0].surface.friction, expected);
    // Names that are taken are refused, and the scene stays as it was.
    let before = scene.clone();
    scene.cables.clear();
    scene.body_names = (0..4).map(|i| i.to_string()).collect();
    scene.constraint_names = (0..3).map(|i| i.to_string()).collect();
    let fault = scene.add_cable(&cable).expect_err("taken").to_string();
    let says = fault.starts_with("two collider entries are called `rope-1`");
    assert!(says, "{fault}");
    scene = before;
    let bad = cable
        .with(|p| (p.name, p.collide) = ("bad".into(), Some(surface.with(|s| s.friction = -1.0))));
    let before = scene.clone();
    let fault = scene.add_cable(&bad).expect_err("friction").to_string();
    let says = fault.starts_with("collider `bad-1` of body `bad-1`: friction is -1");
    assert!(says, "{fault}");
    assert_eq!(scene, before);
}

#[test]
fn the_groups_of_a_cable_are_those_of_its_capsules() {
    let mut scene = heap(1);
    let ends = [v(0.0, 0.0, 0.01), v(1.0, 0.0, 0.01)].map(CableEnd::Free);
    let cable = Cable::round("rope", &Material::STEEL, 0.01, ends)
        .with(|p| (p.segments, p.collide) = (Segments::Equal(2), Some(Surface::default())))
        .with(|p| (p.groups, p.meets) = (0b10, 0b100));
    let own = scene.add_cable(&cable).expect("lies").bodies;
    let capsules = scene.colliders.iter();
    let capsules = capsules.filter(|c| c.body.is_some_and(|i| own.contains(&i)));
    let masks: Vec<_> = capsules.map(|c| (c.groups, c.meets)).collect();
    assert_eq!(masks, [(0b10, 0b100); 2]);
    // The ball and the ground, which the rope leaves out until they are of its group.
    assert_eq!(pairs(&scene), [[0, 1]]);
    scene.colliders[1].groups = 0b100;
    let mut met = pairs(&scene);
    met.dedup();
    assert_eq!(met, [[0, 1], [1, 2], [1, 3]]);
}

#[test]
fn contacts_depend_on_the_poses_alone() {
    let mut scene = heap(5);
    let mut old = Collisions::new(&scene);
    old.find(&scene, 0.01).expect("finite");
    for body in 0..5 {
        scene.bodies.position[body] = v(0.3 * (body * body % 5) as f64, 0.1 * body as f64, 0.9);
    }
    let again = old.find(&scene, 0.01).expect("finite").to_vec();
    let mut new = Collisions::new(&scene);
    assert_eq!(new.find(&scene, 0.01).expect("finite"), again);
}

#[test]
fn only_what_can_touch_in_time_is_found() {
    let mut scene = heap(1);
    scene.bodies.position[0].z = 1.5;
    let mut collisions = Collisions::new(&scene);
    assert!(!collisions.is_empty());
    let mut count = |scene: &Scene, dt| collisions.find(scene, dt).expect("finite").len();
    assert_eq!(count(&scene, 0.1), 0);
    scene.bodies.velocity[0].z = -5.0;
    assert_eq!((count(&scene, 0.09), count(&scene, 0.11)), (0, 1));
    scene.bodies.velocity[0].z = 0.0;
    scene.gravity.z = -10.0;
    assert_eq!((count(&scene, 0.2), count(&scene, 0.25)), (0, 1));
    scene.bodies.position[0].x = f64::NAN;
    let fault = collisions.find(&scene, 0.1).expect_err("NaN").to_string();
    let says = fault.starts_with("body `ball-0`: position is NaN");
    assert!(says, "{fault}");
    scene.colliders.pop();
    let fault = collisions.find(&scene, 0.1);
    let fault = fault.expect_err("one less").to_string();
    assert_eq!(fault, "colliders has length 1: it has to be 2");
}

/// Two segments that a joint holds end to end, on the ground, and one of them moved away by `apart` (m).
#[test]
fn segments_share_the_contact_of_their_joint_as_long_as_it_is_closed() {
    for (apart, expected) in [(0.0, 3), (1e-4, 3), (5e-3, 4)] {
        let mut scene = Scene::new("two");
        let shape = Shape::Capsule {
            length: 1.0,
            radius: 0.1,
        };
        for (i, x) in [-0.5, 0.5 + apart].into_iter().enumerate() {
            let body = Body::rod(1.0, 0.1, 1.0).at(v(x, 0.0, 0.1));
            let lying = nalgebra::UnitQuaternion::from_axis_angle(
                &Vector3::y_axis(),
                std::f64::consts::FRAC_PI_2,
            );
            let body = scene.add_body(format!("rod-{i}"), body.turned(lying));
            scene.add_collider(Collider::new(format!("rod-{i}"), Some(body), shape));
        }
        let frames = [
            Frame::body(0, v(0.0, 0.0, 0.5)),
            Frame::body(1, v(0.0, 0.0, -0.5)),
        ];
        let stretch = RowLaw::RIGID;
        scene.add_constraint("joint", Spherical { frames, stretch }, 0);
        scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
        let found = contacts(&scene);
        assert_eq!(found.len(), expected, "{apart}");
        let shared = found.iter().filter(|c| c.partners == [Some(1), None]);
        assert_eq!(shared.count(), 4 - expected, "{apart}");
    }
}
