//! Loads that come down on the ground while their rope slips over a sheave and off a drum.

use super::tests::{G, R, cable_length, options, xz};
use crate::contact::tests::{add, ground, rough};
use crate::testing::*;

/// A ball `drop` above the ground whose drum, before a sheave, holds a part of its weight.
fn braked(mass: f64, drop: f64, friction: f64, part: f64) -> Scene {
    let mut scene = ground(0.0, rough(0.5));
    let radius = 0.25;
    let body = Body::sphere(radius, mass).at(xz(0.0, radius + drop));
    let load = add(&mut scene, body, Shape::Sphere { radius }, rough(0.5));
    let height = 4.0;
    let frames = vec![
        Frame::world(xz(-3.0, height)),
        Frame::world(xz(-R, height)).along(&Vector3::y()),
        centre(load),
    ];
    let law = RowLaw::new(1e-4 / (mass * G), 0.0);
    let mut cable = over(sheave(friction, R), frames, 1.0, law);
    cable.winch = Some(brake(part * mass * G));
    cable.length = cable_length(&scene, &cable);
    scene.reeve("rope", &cable, 0).unwrap();
    scene
}

#[test]
fn a_load_that_pulls_its_rope_through_a_brake_lands_without_a_rebound() {
    for mass in [1.0, 100.0, 1e5] {
        for friction in [0.02, 0.1, 0.3] {
            for (drop, part) in [(0.2, 0.5), (0.05, 0.3), (0.4, 0.45)] {
                let sinks = 2.0 * Surface::default().compliance * mass * G;
                let what = format!("{mass} kg, μ = {friction}, {drop} m, {part} of its weight");
                let scene = braked(mass, drop, friction, part);
                let mut stepper = Stepper::new(scene, options()).unwrap();
                let (mut lowest, mut undecided) = (f64::INFINITY, 0);
                for _ in 0..120 {
                    undecided += stepper.step().unwrap().undecided;
                    let height = stepper.scene().bodies.position[0].z - 0.25;
                    lowest = lowest.min(height);
                    let holds = height < lowest + 1e-4;
                    assert!(holds, "{what}: rises by {}", height - lowest);
                }
                assert_eq!(undecided, 0, "{what}");
                let holds = lowest.abs() < 1e-4 + sinks;
                assert!(holds, "{what}: ends {lowest} m above the ground");
            }
        }
    }
}
