//! Runs that go on with other options.

use crate::contact::tests::{add_ball, ground};
use crate::testing::*;

const DT: f64 = 1.0 / 60.0;

fn options(backend: &str, scheme: Scheme, dt: f64) -> StepOptions {
    StepOptions {
        backend: backend.parse().expect("a backend"),
        scheme,
        dt,
        ..StepOptions::default()
    }
}

/// A hoist that swings, after so many steps.
fn swinging(options: StepOptions, steps: usize) -> Stepper {
    let params = HoistParams::default().with(|p| (p.segments, p.move_x) = (6, 0.5));
    let mut stepper = Stepper::new(params.build().expect("builds"), options).expect("sound");
    stepper.steps(steps);
    stepper
}

/// Goes on with another scheme and step.
fn go_on(stepper: &mut Stepper, scheme: Scheme, dt: f64) {
    let options = options("dense", scheme, dt);
    stepper.set_options(options).expect("goes on");
}

fn load(stepper: &Stepper) -> Vector3<f64> {
    let scene = stepper.scene();
    scene.bodies.position[scene.load.expect("a load")]
}

#[test]
fn the_same_options_change_nothing() {
    for scheme in Scheme::KINDS {
        let options = options("dense", scheme, DT);
        let mut plain = swinging(options.clone(), 20);
        let mut other = swinging(options.clone(), 20);
        other.set_options(options).expect("goes on");
        plain.steps(10);
        other.steps(10);
        assert_eq!(plain.scene().bodies, other.scene().bodies, "{scheme}");
    }
}

#[cfg(feature = "banded")]
#[test]
fn another_solver_goes_on_with_the_same_motion() {
    let mut plain = swinging(options("banded", Scheme::default(), DT), 60);
    let mut other = swinging(options("banded", Scheme::default(), DT), 20);
    let load_before = other.body("load").expect("a load");
    go_on(&mut other, Scheme::default(), DT);
    let found = other.backend();
    assert_eq!(found, &options("dense", Scheme::default(), DT).backend);
    assert_eq!(other.body("load").expect("a load"), load_before);
    other.steps(40);
    let apart = (load(&plain) - load(&other)).norm();
    assert!(apart < 1e-9, "{apart}");
    plain.steps(1);
    assert!((load(&plain) - load(&other)).norm() > 1e-5);
}

/// From a scheme to another and back: no farther from a run of tiny steps than the worse of both by itself. Without half a step
/// of acceleration at each change it would be much farther.
#[test]
fn another_scheme_starts_from_velocities_of_the_same_time() {
    let fine = swinging(options("dense", Scheme::default(), DT / 16.0), 16 * 60);
    let error = |scheme| (load(&swinging(options("dense", scheme, DT), 60)) - load(&fine)).norm();
    for [first, second] in [
        [Scheme::THIRD_DIFFERENCE, Scheme::Spook],
        [Scheme::THIRD_DIFFERENCE, Scheme::LinearlyImplicit],
        [Scheme::LinearlyImplicit, Scheme::THIRD_DIFFERENCE],
    ] {
        let mut stepper = swinging(options("dense", first, DT), 20);
        for scheme in [second, first, second] {
            go_on(&mut stepper, scheme, DT);
            stepper.steps(13);
        }
        stepper.steps(1);
        let apart = (load(&stepper) - load(&fine)).norm();
        let worse = error(first).max(error(second));
        assert!(apart <= 1.2 * worse, "{first}, {second}: {apart} {worse}");
    }
}

/// A body in free fall: its velocity is that of the time of its position, whatever the steps were.
#[test]
fn other_steps_keep_free_fall() {
    let mut scene = Scene::new("fall");
    scene.gravity.z = -10.0;
    scene.add_body("ball", Body::sphere(0.1, 1.0));
    let mut stepper =
        Stepper::new(scene, options("dense", Scheme::default(), 0.02)).expect("sound");
    stepper.steps(10);
    go_on(&mut stepper, Scheme::default(), 0.005);
    stepper.steps(40);
    let height = stepper.scene().bodies.position[0].z;
    assert!((height + 0.5 * 10.0 * 0.16).abs() < 1e-12, "{height}");
}

/// A ball has just landed: the blow is no acceleration that goes on, and the ball stays where it is.
#[test]
fn a_blow_does_not_count_twice() {
    let (radius, surface) = (0.1, Surface::default());
    let mut scene = ground(0.0, surface);
    add_ball(&mut scene, Vector3::z() * 0.3, radius, surface);
    let mut stepper = Stepper::new(scene, options("dense", Scheme::default(), DT)).expect("sound");
    let mut touching = 0;
    while touching == 0 {
        touching = stepper.step().expect("stable").contacts.touching;
    }
    for scheme in [Scheme::LinearlyImplicit, Scheme::default()] {
        go_on(&mut stepper, scheme, DT);
        let mut highest = 0.0_f64;
        for _ in 0..30 {
            stepper.steps(1);
            highest = highest.max(stepper.scene().bodies.position[0].z);
        }
        assert!(highest < radius + 2e-3, "{scheme}: {highest}");
    }
}

#[test]
fn the_estimate_is_kept() {
    let estimated = |scheme| options("dense", scheme, DT).with(|o| o.estimate = Some(2));
    let mut stepper = swinging(estimated(Scheme::default()), 60);
    let before = stepper.step().expect("stable").error.expect("an estimate");
    stepper
        .set_options(estimated(Scheme::Spook))
        .expect("goes on");
    let after = stepper.step().expect("stable").error.expect("an estimate");
    let holds = before.time > 0.0 && after.time >= before.time;
    assert!(holds, "{before:?} {after:?}");
}

#[test]
fn options_that_cannot_be_change_nothing() {
    let mut stepper = swinging(options("dense", Scheme::default(), DT), 5);
    let before = stepper.save().expect("a run");
    let error = stepper.set_options(options("dense", Scheme::default(), 0.0));
    let error = error.expect_err("no step");
    assert!(error.to_string().contains("dt"), "{error}");
    stepper.solve().expect("solvable");
    let error = stepper.set_options(options("dense", Scheme::default(), DT));
    assert!(matches!(error, Err(StepError::Solve { .. })), "{error:?}");
    stepper.advance().expect("finite");
    let mut other = Stepper::restore(before).expect("goes on");
    other.steps(1);
    assert_eq!(stepper.scene().bodies, other.scene().bodies);
}
