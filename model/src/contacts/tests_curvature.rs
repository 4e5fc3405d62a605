//! The second order of gaps against differences of what the narrow phase finds.

use crate::testing::*;

use super::tests::v;
use super::*;

/// Radius of the round things, and the capsule's.
const WIDE: f64 = 0.2;
const THIN: f64 = 0.03;

fn capsule(radius: f64) -> Shape {
    Shape::Capsule {
        length: 1.0,
        radius,
    }
}

/// A shape of the first body above one of the second, which touch at the origin. The bodies' centres are anywhere.
fn pair(shapes: [Shape; 2], turns: [UnitQuaternion<f64>; 2], heights: [f64; 2]) -> Scene {
    let mut scene = Scene::new("two");
    for (i, centre) in [v(0.1, -0.05, 0.3), v(-0.2, 0.1, -0.25)]
        .into_iter()
        .enumerate()
    {
        let body = scene.add_body(format!("body-{i}"), Body::sphere(1.0, 1.0).at(centre));
        scene.add_collider(Collider {
            position: v(0.0, 0.0, heights[i]) - centre,
            orientation: turns[i],
            ..Collider::new(format!("shape-{i}"), Some(body), shapes[i])
        });
    }
    assert_eq!(scene.validate(), Ok(()));
    scene
}

/// The gap of the only contact.
fn gap(scene: &Scene) -> f64 {
    let mut collisions = Collisions::new(scene);
    let found = collisions.find(scene, 1.0).expect("finite");
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].gap
}

/// −∂²φ/∂θ² of turns about x, y and the line between them, by differences and by the formula.
fn compare(scene: &mut Scene, close: f64) {
    let mut collisions = Collisions::new(scene);
    let contact = collisions.find(scene, 0.0).expect("finite")[0];
    assert!(contact.gap.abs() < 1e-12 && contact.normal.z > 1.0 - 1e-12);
    let (h, start) = (1e-4, contact.gap);
    for side in [0, 1] {
        let formula = contact.turning(side, &scene.bodies.position[side]);
        for direction in [Vector3::x(), Vector3::y(), v(0.6, 0.8, 0.0)] {
            let before = scene.bodies.orientation[side];
            let mut sum = -2.0 * start;
            for sign in [1.0, -1.0] {
                let turn = UnitQuaternion::from_scaled_axis(direction * (sign * h));
                scene.bodies.orientation[side] = turn * before;
                sum += gap(scene);
            }
            scene.bodies.orientation[side] = before;
            let (exact, ours) = (-sum / (h * h), direction.dot(&(formula * direction)));
            let what = format!("{side} {direction:?}: {ours}, not {exact}, {contact:?}");
            assert!((ours - exact).abs() < close, "{what}");
        }
    }
}

fn lying(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::z() * angle)
        * UnitQuaternion::from_scaled_axis(Vector3::y() * std::f64::consts::FRAC_PI_2)
}

#[test]
fn gaps_of_round_shapes_change_as_their_curvatures_say() {
    let ball = Shape::Sphere { radius: 0.1 };
    let cylinder = Shape::Cylinder {
        length: 1.0,
        radius: WIDE,
    };
    let thin = (capsule(THIN), THIN);
    let upright = UnitQuaternion::identity();
    for (upper, lower) in [
        (thin, (capsule(WIDE), WIDE)),
        (thin, (ball, 0.1)),
        ((ball, 0.1), (cylinder, WIDE)),
        (thin, (cylinder, WIDE)),
        ((cylinder, WIDE), thin),
        // The end of one that stands.
        ((capsule(WIDE), 0.5 + WIDE), thin),
    ] {
        for angle in [0.3, 1.0, std::f64::consts::FRAC_PI_2] {
            let stands = upper.1 > 0.5;
            let turns = [if stands { upright } else { lying(angle) }, lying(0.0)];
            let mut scene = pair([upper.0, lower.0], turns, [upper.1, -lower.1]);
            compare(&mut scene, 2e-5);
        }
    }
}

#[test]
fn a_ball_on_a_plane_turns_freely_and_a_rod_rocks_on_an_edge() {
    let half = Vector3::repeat(0.5);
    let up = UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::FRAC_PI_4);
    let mut scene = pair(
        [capsule(THIN), Shape::Cuboid { size: half * 2.0 }],
        [lying(std::f64::consts::FRAC_PI_2), up],
        [THIN, -0.5_f64.sqrt()],
    );
    // The edge is as round as a thousandth of the box.
    compare(&mut scene, 2e-3);
    let shapes = [Shape::Sphere { radius: THIN }, Shape::Cuboid { size: half }];
    let mut scene = pair(shapes, [UnitQuaternion::identity(); 2], [THIN, -0.25]);
    compare(&mut scene, 1e-6);
}

#[test]
fn a_rod_rocks_across_a_cylinder_and_rolls_about_its_own_axis() {
    let turns = [lying(0.0), lying(std::f64::consts::FRAC_PI_2)];
    let mut scene = pair([capsule(THIN), capsule(WIDE)], turns, [THIN, -WIDE]);
    scene.bodies.position[0] = v(0.1, 0.0, THIN);
    scene.colliders[0].position.x = 0.0;
    scene.colliders[0].position.y = 0.0;
    scene.colliders[0].position.z = 0.0;
    let mut collisions = Collisions::new(&scene);
    let contact = collisions.find(&scene, 0.0).expect("finite")[0];
    let k = contact.turning(0, &scene.bodies.position[0]);
    let exact = Vector3::new(0.0, WIDE + THIN, 0.0);
    let off = (k - nalgebra::Matrix3::from_diagonal(&exact)).norm();
    assert!(off < 1e-15, "{k}");
}

#[test]
fn corners_turn_what_they_carry_and_topple_themselves() {
    let sizes = [v(1.0, 1.0, 1.0), v(3.0, 3.0, 0.5)];
    let shapes = sizes.map(|size| Shape::Cuboid { size });
    let scene = pair(shapes, [UnitQuaternion::identity(); 2], [0.5, -0.25]);
    for contact in contacts(&scene) {
        for (side, exact) in [-0.3, 0.25].into_iter().enumerate() {
            let k = contact.turning(side, &scene.bodies.position[side]);
            let exact = nalgebra::Matrix3::from_diagonal(&v(exact, exact, 0.0));
            // Corners are round with 10⁻³ of the box.
            assert!((k - exact).norm() < 2e-3, "{k}");
        }
    }
}

fn contacts(scene: &Scene) -> Vec<Contact> {
    let mut collisions = Collisions::new(scene);
    let found = collisions.find(scene, 0.0).expect("finite").to_vec();
    assert_eq!(found.len(), 4);
    found
}
