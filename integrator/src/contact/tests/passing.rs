//! Bodies that pass by others, or over them.

use super::*;
use crate::testing::{centre, on_earth, over, sheave};

/// A box of the world.
fn add_block(scene: &mut Scene, size: Vector3<f64>, position: Vector3<f64>, surface: Surface) {
    let name = format!("block-{}", scene.colliders.len());
    scene.add_collider(Collider {
        position,
        surface,
        ..Collider::new(name, None, Shape::Cuboid { size })
    });
}

#[test]
fn what_flies_past_an_edge_keeps_its_velocity() {
    let mut scene = Scene::new("past");
    add_block(
        &mut scene,
        Vector3::new(1.0, 1.0, 0.4),
        Vector3::zeros(),
        rough(0.5),
    );
    let way = Vector3::x() * 30.0;
    let past = add_ball(&mut scene, Vector3::new(-1.3, 0.0, 0.35), 0.1, rough(0.5));
    let [by, other] = [0.25, 0.0].map(|z| {
        let place = Vector3::new(-1.3 * f64::from(z > 0.0), 5.0, z);
        add_ball(&mut scene, place, 0.1, rough(0.5))
    });
    for i in [past, by] {
        scene.bodies.velocity[i] = way;
    }
    let mut stepper = stepper(scene);
    run(&mut stepper, 20);
    let bodies = &stepper.scene().bodies;
    assert_eq!([past, by].map(|i| bodies.velocity[i]), [way; 2]);
    assert_eq!(bodies.velocity[other], Vector3::zeros());
}

#[test]
fn balls_that_meet_obliquely_part_along_the_line_between_them() {
    let surface = bouncing(1.0, 0.0);
    let mut scene = Scene::new("oblique");
    let a = add_ball(&mut scene, Vector3::new(-1.3, 0.0, 0.1), 0.1, surface);
    let b = add_ball(&mut scene, Vector3::zeros(), 0.1, surface);
    scene.bodies.velocity[a].x = 30.0;
    let mut stepper = stepper(scene);
    run(&mut stepper, 10);
    // At their meeting the line between them is 30° off.
    let normal = Vector3::new(-(0.75_f64.sqrt()), 0.0, 0.5);
    let exact = normal * (30.0 * normal.x);
    let velocity = &stepper.scene().bodies.velocity;
    assert!((velocity[b] - exact).norm() < 1e-5, "{}", velocity[b]);
    assert!((velocity[a] + exact - Vector3::x() * 30.0).norm() < 1e-5);
}

#[test]
fn bodies_slide_over_flush_boxes_as_over_one() {
    let smooth = rough(0.0);
    let mut scene = on_earth("tiles");
    for k in 0..10 {
        let size = Vector3::new(1.0, 1.0, 0.4);
        let place = Vector3::new(f64::from(k), 0.0, -0.2);
        add_block(&mut scene, size, place, smooth);
    }
    let bodies = [
        block(Vector3::repeat(0.2), 1.0),
        sphere(0.1, 1.0),
        cylinder(0.2, 0.1, 1.0),
    ];
    for (k, (body, shape)) in bodies.into_iter().enumerate() {
        let place = Vector3::new(0.0, 0.35 * (k as f64 - 1.0), 0.1);
        add(&mut scene, body.at(place), shape, smooth);
    }
    for speed in [0.5, 5.0] {
        let mut scene = scene.clone();
        let bodies = scene.bodies.velocity.iter_mut();
        bodies.for_each(|v| v.x = speed);
        let mut stepper = stepper(scene);
        run(&mut stepper, (60.0 * 2.5 / speed) as usize);
        for v in &stepper.scene().bodies.velocity {
            assert!((v.x / speed - 1.0).abs() < 0.01, "{speed}: {v}");
        }
    }
}

#[test]
fn a_load_that_is_hoisted_too_far_stops_at_the_jib() {
    let mut scene = on_earth("jib");
    let jib = add_box(&mut scene, Vector3::zeros(), 1.0, rough(0.3));
    scene.bodies.mobility[jib] = taut_model::Mobility::Static;
    let load = add_box(&mut scene, Vector3::z() * -1.5, 100.0, rough(0.3));
    let frames = [(jib, -0.5), (load, 0.5)].map(|(i, z)| Frame::body(i, Vector3::z() * z));
    // Shorter than it may be without the load in the jib.
    let law = RowLaw::new(1e-5, 0.0);
    let cable = MasslessCable::new(frames.to_vec(), 0.01, law);
    scene.add_constraint("cable", cable, 0);
    let ends = [(jib, 0.5), (load, 0.5)].map(|(i, z)| Frame::body(i, Vector3::z() * z));
    let hoist = MasslessCable::new(ends.to_vec(), 0.9, law);
    scene.add_constraint("hoist", hoist, 0);
    let mut stepper = stepper(scene);
    stepper.steps(240);
    let depth = stepper.scene().bodies.position[load].z + 1.0;
    assert!(depth < 1e-3, "{depth}");
    let pressed: f64 = stepper.contacts().map(|c| c.force.norm()).sum();
    assert!(pressed > 1e3, "{pressed}");
}

#[test]
fn a_body_that_is_added_in_a_run_stands_on_the_ground() {
    let mut scene = ground(0.0, rough(0.3));
    add_ball(&mut scene, Vector3::new(3.0, 0.0, 0.1), 0.1, rough(0.3));
    let mut stepper = stepper(scene);
    run(&mut stepper, 10);
    let crate_ = stepper
        .change(|edit| {
            let size = Vector3::repeat(1.0);
            let body = Body::cuboid(size, 100.0).at(Vector3::z() * 0.6);
            let body = edit.add_body("crate", body);
            let number = edit.body_index(body)?;
            let shape = Shape::Cuboid { size };
            edit.add_collider(Collider::new("crate", Some(number), shape));
            Ok(body)
        })
        .unwrap();
    run(&mut stepper, 120);
    let height = stepper.scene().bodies.position[stepper.body_index(crate_).unwrap()].z;
    assert!((height - 0.5).abs() < 1e-5, "{height}");
}

/// A load on the ground, and a counterweight that bounces on the rope between them, which slips over a sheave.
#[test]
fn what_a_sheave_s_slip_makes_of_contacts_is_found_in_further_passes() {
    for (mass, friction, compliance) in [(5e3, 0.1, 4e-7), (3e3, 0.25, 1e-6), (9e3, 0.05, 2e-7)] {
        let mut scene = ground(0.0, rough(0.5));
        let size = Vector3::new(1.6, 1.2, 1.0);
        let at = Vector3::new(0.2, 0.0, 0.5);
        let block = Body::cuboid(size, mass).at(at);
        let load = add(&mut scene, block, Shape::Cuboid { size }, rough(0.5));
        let weight = Body::particle(0.5 * mass).at(Vector3::new(-0.2, 0.0, 3.0));
        let weight = scene.add_body("weight", weight);
        let sheave = sheave(friction, 0.2);
        let frames = vec![
            centre(weight),
            Frame::world(Vector3::z() * 8.0).along(&Vector3::y()),
            Frame::body(load, Vector3::new(0.0, 0.0, 0.5)),
        ];
        let law = RowLaw::new(compliance, 0.05);
        let cable = over(
            sheave,
            frames,
            5.0 + 7.0 + 0.2 * std::f64::consts::PI + 0.01,
            law,
        );
        scene.reeve("rope", &cable, 0).expect("a rope");
        let mut stepper = stepper(scene);
        let mut slips = 0;
        while stepper.time() < 1.5 {
            let report = stepper.step().expect("a step");
            slips += report.slipping;
            assert_eq!(report.undecided, 0, "{mass} {friction} {report:?}");
        }
        assert!(slips > 5, "{mass} {friction}: {slips}");
    }
}
