use taut_tests::prelude::*;
use taut_tests::scenes::slings;
const LENGTH: f64 = 10.0;

fn backend() -> Backend {
    StepOptions::default().backend
}

/// Six segments of a stiff cable (EI = 2·10⁴ N m²) clamped to the world at an angle of 0.5 rad, a load of their own mass
/// pushed sideways with 180 N: bending, not weight, brings it to rest, and soon.
fn bent(damping: f64) -> Scene {
    let params = HoistParams::default()
        .with(|p| (p.segments, p.mass_ratio, p.anchor) = (6, 1.0, End::Clamped))
        .with(|p| (p.initial_angle, p.ei, p.gj) = (0.5, Some(2e4), Some(1.5e4)))
        .with(|p| p.damping = damping);
    let mut scene = params.build().expect("sound");
    let clamp = &mut scene.constraints[0].frames_mut()[0];
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * 0.5);
    clamp.axes = turn.to_rotation_matrix() * clamp.axes;
    let load = scene.load.expect("a load");
    scene.bodies.force[load] = Vector3::new(150.0, 100.0, 0.0);
    scene
}

/// Largest distance of a body from where it is in the other scene, over the cable's length.
fn distance(a: &Scene, b: &Scene) -> f64 {
    let pairs = a.bodies.position.iter().zip(&b.bodies.position);
    pairs.map(|(x, y)| (x - y).norm()).fold(0.0, f64::max) / LENGTH
}

#[test]
fn the_equilibrium_depends_on_neither_backend_nor_start() {
    let shape = static_equilibrium(bent(0.0), &backend()).expect("an equilibrium");
    let mut worst = Worst::default();
    for Choice { backend, .. } in compiled_direct() {
        let found = static_equilibrium(bent(0.0), &backend).expect("an equilibrium");
        worst.see(distance(&found, &shape), backend);
    }
    // Thrown about first.
    let mut scene = bent(0.01);
    for (i, v) in scene.bodies.velocity.iter_mut().enumerate() {
        *v = Vector3::new((3.0 * i as f64).sin(), (5.0 * i as f64).cos(), 0.0);
    }
    let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
    taut_tests::steps(&mut stepper, 30);
    let thrown = stepper.into_scene();
    assert!(distance(&thrown, &shape) > 0.01);
    let found = static_equilibrium(thrown, &backend()).expect("an equilibrium");
    worst.see(distance(&found, &shape), "another start");
    worst.expect_measured("equilibrium", 2.1e-13);
}

#[test]
fn a_scene_can_start_in_equilibrium() {
    let mut scene = bent(0.0);
    scene.start_in_equilibrium = true;
    let shape = static_equilibrium(scene.clone(), &backend()).expect("an equilibrium");
    let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
    taut_tests::steps(&mut stepper, 120);
    let mut worst = Worst::default();
    worst.see(distance(stepper.scene(), &shape), "after 2 s");
    worst.expect_measured("drift from equilibrium", 1.1e-12);
}

#[test]
fn what_falls_has_no_equilibrium() {
    let mut scene = Scene::new("falling");
    scene.gravity = Vector3::new(0.0, 0.0, -9.81);
    scene.add_body("ball", Body::sphere(0.1, 2.0));
    let found = static_equilibrium(scene.clone(), &backend());
    assert!(
        matches!(&found, Err(StepError::NoEquilibrium { change, body, equilibrium_residual, .. })
            if *change > 0.0 && body.as_deref() == Some("ball") && *equilibrium_residual == 1.0),
        "{found:?}"
    );
    scene.start_in_equilibrium = true;
    let stepper = Stepper::new(scene, StepOptions::default());
    assert!(matches!(
        stepper.err(),
        Some(StepError::NoEquilibrium { .. })
    ));
}

/// Rigid slings a third too short for the pose they start from: they draw the load in, whatever solves.
#[test]
fn rigid_slings_too_short_for_the_start_are_drawn_in() {
    let mut scene = Scene::new("slings");
    scene.gravity = Vector3::new(0.0, 0.0, -9.81);
    let start = Vector3::new(0.4, 0.12, -1.03);
    scene.add_body("load", Body::sphere(0.3, 900.0).at(start));
    let (across, up, length) = (Vector3::new(0.33_f64, 0.24, 0.0), 0.34, 0.8_f64);
    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        let ends = vec![origin(), Frame::body(0, side * across + up * Vector3::z())];
        let sling = MasslessCable::new(ends, length, RowLaw::RIGID);
        scene.add_constraint(name, Constraint::MasslessCable(sling), 0);
    }
    let height = up + (length * length - across.norm_squared()).sqrt();
    for Choice { backend, .. } in compiled_direct() {
        let found = static_equilibrium(scene.clone(), &backend).expect("an equilibrium");
        let off = found.bodies.position[0] + height * Vector3::z();
        assert!(off.norm() < 1e-9, "{backend}: {off}");
    }
}

/// EA in MN: a cable as soft as that is no cable, and what hangs on it is named.
#[test]
fn what_a_cable_too_soft_does_not_hold_is_named() {
    let params = HoistParams::default().with(|p| (p.ea, p.segment_mass) = (Some(20.0), Some(1.0)));
    let found = static_equilibrium(params.build().expect("sound"), &backend());
    let error = found.expect_err("490-fold strain").to_string();
    assert!(error.contains("moved `load` the most"), "{error}");
}

/// A load that starts beside its place under two slings, where the slings' tension alone brings it back.
#[test]
fn a_load_on_slings_comes_to_rest_from_beside() {
    let mut worst = Worst::default();
    for angle in [0.0, 0.6, 1.3] {
        let mut scene = slings(8, angle);
        let load = scene.load.expect("a load");
        scene.bodies.position[load] += Vector3::new(0.3, 0.1, 0.0);
        for Choice { backend, .. } in compiled_direct() {
            let found = static_equilibrium(scene.clone(), &backend).expect("an equilibrium");
            let place = format!("{angle}, {backend}");
            worst.see(found.bodies.position[load].xy().norm() / LENGTH, place);
        }
    }
    assert!(worst.error() < 1e-9, "{}", worst.error());
}
