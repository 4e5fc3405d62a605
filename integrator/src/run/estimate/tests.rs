use super::{ErrorEstimate, ErrorPart};
use crate::testing::*;
use taut_solver::CgOptions;

/// A hoist whose anchor moves by a metre in a second.
fn jerked(segments: usize) -> Scene {
    let hoist = HoistParams::default()
        .with(|p| (p.segments, p.mass_ratio, p.equilibrium) = (segments, 1e3, true))
        .with(|p| p.move_x = 1.0);
    hoist.build().expect("built")
}

fn with(estimate: Option<usize>) -> StepOptions {
    StepOptions::default().with(|o| o.estimate = estimate)
}

/// Positions of the load, and the last step's estimate \[m].
fn run(scene: Scene, options: StepOptions, steps: usize) -> (Vec<Vector3<f64>>, Option<f64>) {
    let mut stepper = Stepper::new(scene, options).expect("built");
    let load = stepper.scene().load.expect("a load");
    let mut error = None;
    let path = (0..steps).map(|_| {
        let report = stepper.step().expect("steps");
        error = report.error.map(|e| e.time);
        stepper.scene().bodies.position[load]
    });
    (path.collect(), error)
}

#[test]
fn the_estimate_is_near_the_error_and_leaves_the_motion() {
    let substeps = with(None).with(|o| o.substeps = 8);
    let (fine, none) = run(jerked(6), substeps, 300);
    let (bare, _) = run(jerked(6), with(None), 300);
    let error = bare.iter().zip(&fine).map(|(x, y)| (x - y).norm());
    let error = error.fold(0.0, f64::max);
    assert!(none.is_none() && error > 1e-5);
    for every in [2, 4] {
        let (path, estimate) = run(jerked(6), with(Some(every)), 300);
        assert!(path == bare, "the motion has the same bits");
        let part = estimate.expect("estimated") / error;
        assert!((0.7..1.5).contains(&part), "{every}: {part}");
    }
}

/// A scheme of first order has d = (k − 1) e.
#[test]
fn the_order_is_that_of_the_scheme() {
    let paper = |substeps, estimate| StepOptions {
        substeps,
        estimate,
        ..StepOptions::paper()
    };
    let swing = HoistParams::default()
        .with(|p| (p.segments, p.mass_ratio, p.initial_angle) = (2, 1.0, 0.2));
    let scene = || swing.build().expect("built");
    let (fine, _) = run(scene(), paper(32, None), 120);
    let (coarse, estimate) = run(scene(), paper(1, Some(2)), 120);
    let error = coarse.iter().zip(&fine).map(|(x, y)| (x - y).norm());
    let part = estimate.expect("estimated") / error.fold(0.0, f64::max);
    assert!((0.6..1.6).contains(&part), "{part}");
}

/// Controls drive the coarse run, too; what it does not see starts it anew, and keeps what was estimated.
#[test]
fn the_coarse_run_follows_controls_and_changes() {
    let scene = GantryParams::default().build().expect("built");
    let mut stepper = Stepper::new(scene, with(Some(2))).expect("built");
    let trolley = stepper.scene().control("trolley_speed").expect("there");
    let mut last = 0.0;
    for k in 0..240 {
        // A ramp that no step of the coarse run sees whole.
        let speed = 0.5 * f64::from(k.min(61)) / 61.0;
        stepper.set_control(trolley, speed).expect("set");
        if k == 120 {
            let load = stepper.scene().load.expect("a load");
            let push = Vector3::x() * 10.0;
            stepper.set_load(load, push, Vector3::zeros()).expect("set");
        }
        let error = stepper.step().expect("steps").error.expect("estimated");
        assert!(!error.lost && error.time >= last, "{k}: {error:?}");
        let what = format!("{k}: it was set between two steps of the coarse run");
        assert_eq!(error.unseen, 0, "{what}");
        last = error.time;
    }
    assert!((1e-7..1e-3).contains(&last), "{last}");
}

/// Loads that change in each step leave nothing to compare, and the estimate says so.
#[test]
fn steps_that_are_not_compared_are_counted() {
    let mut stepper = Stepper::new(jerked(3), with(Some(2))).expect("built");
    let load = stepper.scene().load.expect("a load");
    for k in 0..40 {
        let wind = Vector3::x() * f64::from(k);
        stepper.set_load(load, wind, Vector3::zeros()).expect("set");
        let error = stepper.step().expect("steps").error.expect("estimated");
        // The last of these may still be compared.
        assert_eq!((error.time, error.unseen), (0.0, k as usize), "{error:?}");
    }
}

#[test]
fn few_iterations_show() {
    let error = |backend: Backend| {
        let options = with(Some(2))
            .with(|o| (o.refinements, o.backend) = (usize::from(!backend.is_iterative()), backend));
        let mut stepper = Stepper::new(jerked(12), options).expect("built");
        let steps = (0..60).map(|_| stepper.step().expect("steps").error);
        steps.last().flatten().expect("estimated").algebra
    };
    let few = CgOptions::default().with(|p| p.iterations = 4);
    let [direct, few] = [Backend::Banded, Backend::ConjugateGradient(few)].map(error);
    assert!(direct < 1e-12 && few > 1e3 * direct, "{direct} {few}");
}

#[test]
fn an_estimate_needs_two_steps() {
    for every in [0, 1, 1001] {
        let error = Stepper::new(jerked(2), with(Some(every))).err();
        let refused = matches!(error, Some(StepError::InvalidOption { .. }));
        assert!(refused, "{error:?}");
    }
}

#[test]
fn a_step_alone_estimates_nothing() {
    for every in [2, 3] {
        let mut stepper = Stepper::new(jerked(2), with(Some(every))).expect("built");
        for step in 1..=2 * every {
            let error = stepper.step().expect("steps").error.expect("estimated");
            assert_eq!(error.compared, step / every * every, "{every}: {step}");
        }
    }
}

#[test]
fn the_largest_part_is_known() {
    for (parts, largest) in [
        ([3.0, 2.0, 1.0], ErrorPart::Time),
        ([1.0, 2.0, 0.0], ErrorPart::Algebra),
        ([1.0, 2.0, 3.0], ErrorPart::Segments),
    ] {
        let [time, algebra, segments] = parts;
        let error = ErrorEstimate::default()
            .with(|p| (p.time, p.algebra, p.segments) = (time, algebra, segments));
        assert_eq!(error.largest(), largest, "{error:?}");
    }
}
