use taut_model::collide::{Collider, Shape, Surface};
use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;

/// The ground, and gravity.
fn ground(surface: Surface) -> Scene {
    let mut scene = Scene::new("contacts");
    scene.gravity = Vector3::z() * -9.81;
    scene.add_collider(Collider {
        surface,
        ..Collider::new("ground", None, Shape::HalfSpace)
    });
    scene
}

fn add_box(
    scene: &mut Scene,
    name: &str,
    size: Vector3<f64>,
    mass: f64,
    at: Vector3<f64>,
) -> usize {
    let body = scene.add_body(name, Body::cuboid(size, mass).at(at));
    scene.add_collider(Collider::new(name, Some(body), Shape::Cuboid { size }))
}

fn refusal(scene: Scene) -> String {
    let made = Stepper::new(scene, StepOptions::default());
    made.map(|_| ()).expect_err("a fault").to_string()
}

/// A second of steps: the highest speed, in m/s, or the error that ended it. All numbers stay finite.
fn live(scene: Scene, dt: f64) -> Result<f64, StepError> {
    let options = StepOptions::default().with(|o| o.dt = dt);
    let mut stepper = Stepper::new(scene, options)?;
    let mut fastest = 0.0_f64;
    for _ in 0..60 {
        let report = stepper.step()?;
        assert!(report.contacts.complementarity.is_finite(), "{report:?}");
        let bodies = &stepper.scene().bodies;
        for v in bodies.position.iter().chain(&bodies.velocity) {
            assert!(v.iter().all(|x| x.is_finite()));
        }
        fastest = bodies.velocity.iter().fold(fastest, |m, v| m.max(v.norm()));
    }
    Ok(fastest)
}

#[test]
fn a_leaf_whose_thickness_is_lost_in_rounding_is_refused() {
    let mut scene = ground(Surface::default());
    let size = Vector3::new(1e-10, 1.0, 1.0);
    add_box(&mut scene, "leaf", size, 1.0, Vector3::z());
    let text = refusal(scene);
    assert!(text.contains("lost in rounding"), "{text}");
}

#[test]
fn what_cannot_move_does_not_touch() {
    let mut scene = ground(Surface::default());
    for name in ["pier", "wall"] {
        let size = Vector3::repeat(1.0);
        let mut body = Body::cuboid(size, 1.0);
        body.mobility = taut_model::Mobility::Static;
        let body = scene.add_body(name, body);
        scene.add_collider(Collider::new(name, Some(body), Shape::Cuboid { size }));
    }
    let size = Vector3::repeat(1.0);
    let number = add_box(&mut scene, "ghost", size, 1.0, Vector3::z() * 0.5);
    scene.colliders[number].meets = 0;
    let options = StepOptions::default();
    let mut stepper = Stepper::new(scene, options).expect("a sound scene");
    let report = stepper.step().expect("a step");
    assert_eq!(report.contacts.near, 0, "{report:?}");
}

#[test]
fn speeds_and_steps_at_the_ends_of_their_range_end_or_stay_finite() {
    for (speed, dt) in [
        (-1e6, DT),
        (1e6, DT),
        (-1e150, DT),
        (-1.0, 1e-9),
        (-1.0, 100.0),
    ] {
        let mut scene = ground(Surface::default());
        let number = add_box(&mut scene, "load", Vector3::repeat(1.0), 1.0, Vector3::z());
        let body = scene.colliders[number].body.expect("a body");
        scene.bodies.velocity[body].z = speed;
        if let Err(e) = live(scene, dt) {
            assert!(!e.to_string().is_empty());
        }
    }
}

#[test]
fn named_scenes_at_a_ratio_of_a_trillion_end_or_stay_finite() {
    for grounded in ContactScene::ALL {
        let params = ContactSceneParams::new(grounded)
            .with(|p| (p.count, p.segments, p.mass_ratio) = (Some(3), 4, 1e12));
        let scene = params.build().expect("a scene");
        match live(scene, DT) {
            Ok(fastest) => assert!(fastest < 100.0, "{grounded:?}: {fastest}"),
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
    }
}
