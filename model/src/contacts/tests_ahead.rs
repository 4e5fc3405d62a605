//! Contacts of shapes that move far in a step.

use crate::testing::*;

use super::tests::{cuboid, v};
use super::tests_random::Random;
use super::*;

const DT: f64 = 1.0 / 60.0;

const BALL: Shape = Shape::Sphere { radius: 0.1 };

fn add(scene: &mut Scene, shape: Shape, position: Vector3<f64>, velocity: Vector3<f64>) -> usize {
    let name = format!("body-{}", scene.bodies.len());
    let body = scene.add_body(name.clone(), Body::sphere(1.0, 1.0).at(position));
    scene.bodies.velocity[body] = velocity;
    scene.add_collider(Collider::new(name, Some(body), shape));
    body
}

fn add_block(scene: &mut Scene, shape: Shape, position: Vector3<f64>) {
    let name = format!("block-{}", scene.colliders.len());
    let block = Collider::new(name, None, shape);
    scene.add_collider(Collider { position, ..block });
}

fn contacts(scene: &Scene) -> Vec<Contact> {
    let mut collisions = Collisions::new(scene);
    collisions.find(scene, DT).expect("finite").to_vec()
}

#[test]
fn what_passes_by_has_no_contact() {
    let shapes = [
        BALL,
        cuboid(0.2, 0.2, 0.2),
        Shape::Capsule {
            length: 0.1,
            radius: 0.1,
        },
        Shape::Cylinder {
            length: 0.2,
            radius: 0.1,
        },
    ];
    for shape in shapes {
        // Over the edge of a block: at 3 m/s, at 30 m/s, and turning about the vertical.
        let low = shape.dimensions()[1] * 0.5;
        for (clear, speed, spin) in [(1e-3, 3.0, 0.0), (0.05, 30.0, 0.0), (0.05, 30.0, 20.0)] {
            let mut scene = Scene::new("past");
            add_block(&mut scene, cuboid(1.0, 1.0, 0.4), Vector3::zeros());
            let start = v(-0.52 - 0.5 * speed * DT, 0.0, 0.2 + low + clear);
            let body = add(&mut scene, shape, start, v(speed, 0.0, 0.0));
            scene.bodies.angular_velocity[body].z = spin;
            // At most the plane below, on which gravity could bring it down.
            let up = |c: &Contact| c.normal.z < -1.0 + 1e-6;
            for gravity in [0.0, 9.81] {
                scene.gravity.z = -gravity;
                let found = contacts(&scene);
                assert!(found.iter().all(up), "{shape:?} {speed} {found:?}");
                assert!(found.is_empty() || clear < 0.01, "{shape:?} {found:?}");
                assert!(!found.is_empty() || gravity == 0.0 || clear > 0.01);
            }
            // Lower, it strikes the side.
            scene.bodies.position[body].z = 0.2;
            let found = contacts(&scene);
            assert!(!found.is_empty(), "{shape:?}");
            assert!(found.iter().all(|c| c.normal.x.abs() > 0.5), "{found:?}");
        }
    }
    // Two balls that miss each other by 50 mm.
    let mut scene = Scene::new("balls");
    scene.gravity = Vector3::zeros();
    add(&mut scene, BALL, v(-0.3, 0.0, 0.25), v(30.0, 0.0, 0.0));
    add(&mut scene, BALL, Vector3::zeros(), Vector3::zeros());
    assert_eq!(contacts(&scene), []);
}

#[test]
fn balls_that_meet_obliquely_have_the_normal_of_their_meeting() {
    let mut scene = Scene::new("balls");
    add(&mut scene, BALL, v(-0.4, 0.0, 0.1), v(30.0, 0.0, 0.0));
    add(&mut scene, BALL, Vector3::zeros(), Vector3::zeros());
    let [contact] = contacts(&scene)[..] else {
        panic!("one contact");
    };
    let normal = v(-(0.75_f64.sqrt()), 0.0, 0.5);
    assert!((contact.normal - normal).norm() < 1e-6, "{contact:?}");
    // They touch when the first has come to x = −0.2 cos 30°.
    let time = (0.4 + 0.2 * normal.x) / 30.0;
    let gap = 30.0 * -normal.x * time;
    assert!((contact.gap - gap).abs() < 1e-6, "{contact:?} {gap}");
    let apart = (contact.points[0] - contact.points[1]).dot(&contact.normal);
    assert!((apart - gap).abs() < 1e-6, "{apart} {gap}");
    // Head on nothing changes: the contact is that of the beginning.
    scene.bodies.position[0] = v(-0.4, 0.0, 0.0);
    let [contact] = contacts(&scene)[..] else {
        panic!("one contact");
    };
    assert_eq!(contact.normal, v(-1.0, 0.0, 0.0));
    let side = contact.points[0] - v(-0.3, 0.0, 0.0);
    assert!(side.norm() < 1e-15, "{contact:?}");
}

#[test]
fn what_comes_round_a_corner_meets_the_face_behind_it() {
    // They face each other at no corner of the beginning.
    let mut scene = Scene::new("diagonal");
    add_block(&mut scene, cuboid(0.01, 1.0, 1.0), Vector3::zeros());
    let fast = v(600.0, 600.0, 0.0);
    add(&mut scene, cuboid(0.2, 0.2, 0.2), v(-4.95, -4.9, 0.0), fast);
    let found = contacts(&scene);
    assert!(!found.is_empty());
    let ways = found.iter().map(|c| (c.normal, c.gap));
    for (normal, gap) in ways {
        assert!((normal.x.abs(), normal.norm()) == (1.0, 1.0), "{normal}");
        assert!((gap - 4.845).abs() < 1e-9, "{gap}");
    }
}

#[test]
fn no_shapes_that_would_overlap_within_a_step_are_without_contact() {
    let mut random = Random::new(5);
    for n in 0..1000 {
        let mut scene = Scene::new("thrown");
        for side in [-1.0, 1.0] {
            let shape = random.shape((n / 7 + usize::from(side > 0.0) * (n % 4)) % 4);
            let speed = 10.0_f64.powf(3.0 * random.number());
            // Where both are at the middle of the step, but for some of the shape's size.
            let velocity = random.vector() * speed;
            let miss = random.vector() * shape.dimensions()[1];
            let body = add(&mut scene, shape, miss - velocity * (0.5 * DT), velocity);
            scene.bodies.orientation[body] = random.turn();
            if n % 3 == 0 {
                scene.bodies.angular_velocity[body] = random.vector() * 20.0;
            }
        }
        if !contacts(&scene).is_empty() {
            continue;
        }
        let solid = |side: usize, time: f64| {
            let mut bodies = scene.bodies.clone();
            bodies.position[side] += bodies.velocity[side] * time;
            let turn = UnitQuaternion::from_scaled_axis(bodies.angular_velocity[side] * time);
            bodies.orientation[side] = turn * bodies.orientation[side];
            Solid::of(&scene.colliders[side], &bodies)
        };
        for instant in 0..=200 {
            let [a, b] = [0, 1].map(|side| solid(side, DT * f64::from(instant) / 200.0));
            let mut found = Vec::new();
            touch(&a, &b, 0.0, &mut found);
            assert!(found.is_empty(), "{n} {instant} {:?}", scene.colliders);
        }
    }
}

#[test]
fn bodies_that_slide_over_flush_boxes_touch_none_of_their_sides() {
    for sunk in [0.0, 1e-12, 1e-9, 1e-5] {
        for ahead in [-0.05, -1e-4, -1e-12, 0.0, 1e-12, 1e-4, 1e-3, 0.05] {
            let mut scene = Scene::new("tiles");
            for x in [0.0, 1.0] {
                add_block(&mut scene, cuboid(1.0, 1.0, 0.4), v(x, 0.0, -0.2));
            }
            let drum = Shape::Cylinder {
                length: 0.2,
                radius: 0.1,
            };
            for (y, shape) in [(-0.2, cuboid(0.2, 0.2, 0.2)), (0.2, drum)] {
                let place = v(0.4 + ahead, y, 0.1 - sunk);
                add(&mut scene, shape, place, v(5.0, 0.0, 0.0));
            }
            let found = contacts(&scene);
            assert!(found.len() >= 8, "{found:?}");
            for contact in found {
                let up = contact.normal.z.abs();
                assert!((up - 1.0).abs() < 1e-12, "{ahead} {sunk} {contact:?}");
            }
        }
    }
}
