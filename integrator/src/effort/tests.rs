use super::Effort;
use crate::testing::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use taut_solver::coulomb::ConeMethod;

/// A pile of cables under this gravity: 10⁹ m/s² crush them into dense problems without a solution.
fn pile(gravity: f64, mass_ratio: f64) -> Stepper {
    let params = ContactSceneParams::new(ContactScene::Pile)
        .with(|p| (p.mass_ratio, p.ei, p.damping) = (mass_ratio, 1.0, 0.5))
        .with(|p| p.gravity = gravity);
    let scene: Scene = params.build().expect("built");
    Stepper::new(scene, StepOptions::default()).expect("a sound scene")
}

#[test]
fn what_is_spent_decides_the_method() {
    let mut effort = Effort::default();
    effort.begin();
    assert_eq!(effort.method(ConeMethod::Newton), ConeMethod::Newton);
    effort.allow(3);
    effort.spent = 1.2e11;
    assert!(!effort.is_spent());
    effort.begin();
    effort.spent = 1.2e11;
    assert!(effort.is_spent());
    assert!(matches!(
        effort.method(ConeMethod::Newton),
        ConeMethod::GaussSeidel { .. }
    ));
    effort.begin();
    assert!(!effort.is_spent());
}

#[test]
fn a_step_has_a_limit_however_many_groups_there_are() {
    for groups in [1, 26, 200, 100_000] {
        let mut effort = Effort::default();
        effort.begin();
        effort.allow(groups);
        effort.spent = 5.1e11;
        assert!(effort.is_spent(), "{groups} groups");
        assert!(effort.check(0.5).is_ok());
        effort.all = 1.1e12;
        assert!(effort.ends());
        let error = effort.check(0.5);
        assert!(matches!(error, Err(StepError::TooMuchWork { time: 0.5 })));
        let text = error.expect_err("too much").to_string();
        assert!(text.contains("make the time step smaller"), "{text}");
    }
}

#[test]
fn columns_through_the_joints_and_passes_count() {
    let mut effort = Effort::default();
    effort.begin();
    effort.spend_solves(600, 0, 10_000);
    let columns = effort.all;
    assert!(columns >= 600.0 * 10_000.0);
    // Those of an iteration are as many more as it makes.
    effort.spend_solves(600, 5_400, 10_000);
    assert!(effort.all >= 10.0 * columns);
    let before = effort.all;
    effort.spend_pass(10_000);
    assert!(effort.all > before);
    // A step counts what it does.
    let mut counted = pile(9.81, 1.0);
    while counted
        .contacts()
        .all(|contact| contact.force.norm() == 0.0)
    {
        counted.step().expect("a step");
    }
    assert!(counted.step.effort.all > 0.0);
    let scene = taut_model::GantryParams::default().build().expect("built");
    let mut free = Stepper::new(scene, StepOptions::default()).expect("sound");
    free.step().expect("a step");
    assert_eq!(free.step.effort.all, 0.0);
    let guard = Some(crate::Guard::default().with(|g| g.tolerance = 1e-15));
    let guarded = free.options().clone().with(|o| o.guard = guard);
    free.set_options(guarded).expect("sound");
    let passes = free.step().expect("a step");
    assert!(passes.redone && free.step.effort.all > 0.0);
}

#[test]
fn a_step_that_crushes_cables_ends_within_its_limit() {
    let mut stepper = pile(1e9, 1e6);
    let done = stepper.step();
    let spent = stepper.step.effort.all;
    match done {
        Ok(report) => assert!(report.undecided > 0),
        Err(error) => assert!(matches!(error, StepError::TooMuchWork { .. }), "{error}"),
    }
    // It comes to the sweeps, and a problem at most goes beyond the limit.
    assert!((1e11..1.05e12).contains(&spent), "{spent:e}");
}

#[test]
fn a_step_at_its_limit_ends_in_the_state_that_it_began_with() {
    let mut stepper = pile(1e6, 1e6);
    stepper.stop_by(Arc::default());
    let before = stepper.save().expect("sound");
    stepper.step.effort.limit = 2e10;
    let error = stepper.step().expect_err("too much");
    assert!(matches!(error, StepError::TooMuchWork { .. }), "{error}");
    assert!(stepper.save().expect("sound") == before);
}

#[test]
fn a_step_ends_soon_after_its_flag_is_set() {
    for gravity in [1e9, 3e10] {
        let mut stepper = pile(gravity, 1e6);
        let stop = Arc::new(AtomicBool::new(false));
        stepper.stop_by(Arc::clone(&stop));
        let heights = stepper.scene();
        let heights: Vec<f64> = heights.bodies.position.iter().map(|p| p.z).collect();
        let (error, waited) = thread::scope(|scope| {
            let step = scope.spawn(|| stepper.step().err());
            thread::sleep(Duration::from_secs(1));
            stop.store(true, Ordering::Relaxed);
            let asked = Instant::now();
            (step.join().expect("no panic"), asked.elapsed())
        });
        let refused = matches!(error, Some(StepError::Stopped { time: 0.0 }));
        assert!(refused, "{error:?}");
        assert!(waited < Duration::from_secs(15), "{waited:?}");
        let left = stepper.scene().bodies.position.iter().map(|p| p.z);
        assert!(left.eq(heights), "the state is not that at the beginning");
        assert_eq!(stepper.time(), 0.0);
    }
}

#[test]
fn the_flag_is_looked_at_between_sub_steps_and_stays_through_changes() {
    let mut stepper = pile(9.81, 1.0);
    let stop = Arc::new(AtomicBool::new(true));
    stepper.stop_by(Arc::clone(&stop));
    let options = stepper.options().clone().with(|o| o.substeps = 3);
    stepper.set_options(options).expect("sound options");
    stepper
        .change(|edit| {
            edit.add_body("more", taut_model::Body::sphere(0.1, 1.0));
            Ok(())
        })
        .expect("changed");
    assert!(matches!(stepper.step(), Err(StepError::Stopped { .. })));
    stop.store(false, Ordering::Relaxed);
    stepper.step().expect("a step");
}
