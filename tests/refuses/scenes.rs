use super::compiled;
use nalgebra::Quaternion;
use taut_tests::prelude::*;
use taut_tests::scenes::{Pose, hoist};

const DT: f64 = 1.0 / 60.0;

fn small() -> Scene {
    hoist(JointKind::Cosserat, Pose::Straight, 3, 10.0)
}

fn refusal(scene: Scene, options: StepOptions) -> StepError {
    let made = Stepper::new(scene, options).map(drop);
    made.expect_err("a fault")
}

fn one_line(e: &StepError, words: &str) {
    let text = e.to_string();
    assert!(text.contains(words) && !text.contains('\n'), "{text}");
}

#[test]
fn the_kkt_form_needs_a_backend_for_indefinite_matrices() {
    for backend in compiled().into_iter().filter(|b| !b.accepts_indefinite()) {
        let e = refusal(small(), Choice::kkt(backend.clone()).options(DT));
        let named = matches!(&e, StepError::FormNotAccepted { backend: b, form: Form::Kkt } if *b == backend.to_string());
        assert!(named, "{e:?}");
        one_line(&e, "schur");
        // On the command line it does not get that far.
        let text = format!("{backend}/kkt");
        let refused = text.parse::<Choice>().expect_err("a fault");
        assert!(refused.contains("positive definite"), "{refused}");
    }
}

/// A change that spoils a state.
type Fault = fn(&mut Bodies);

/// Spoiled states, and the words by which an error has to name each.
const FAULTS: [(&str, Fault); 6] = [
    ("`segment-2`: position is NaN", |b| {
        b.position[1].y = f64::NAN;
    }),
    ("`segment-2`: position is inf", |b| {
        b.position[1].y = f64::INFINITY;
    }),
    ("`segment-3`: velocity is NaN", |b| {
        b.velocity[2].x = f64::NAN;
    }),
    ("`segment-1`: angular_velocity is NaN", |b| {
        b.angular_velocity[0].z = f64::NAN;
    }),
    ("`segment-2`: norm of the orientation is NaN", |b| {
        b.orientation[1] = UnitQuaternion::new_unchecked(Quaternion::new(1.0, f64::NAN, 0.0, 0.0));
    }),
    ("`segment-2`: norm of the orientation is 2", |b| {
        b.orientation[1] = UnitQuaternion::new_unchecked(Quaternion::new(2.0, 0.0, 0.0, 0.0));
    }),
];

#[test]
fn a_state_that_is_none_is_refused_by_the_body() {
    let mut stepper = Stepper::new(small(), StepOptions::default()).expect("sound");
    let good = stepper.scene().bodies.clone();
    for (named, fault) in FAULTS {
        let mut bad = good.clone();
        fault(&mut bad);
        let e = stepper.set_state(&bad, 0.0).expect_err(named);
        assert!(matches!(e, StepError::Scene(_)), "{e:?}");
        one_line(&e, named);
    }
}

/// States of finite numbers that nothing finite follows from.
const OVERFLOWS: [(&str, Fault); 3] = [
    ("speed 1e200", |b| b.velocity[2].x = 1e200),
    ("speed 1e300", |b| b.velocity[0].y = 1e300),
    ("spin 1e300", |b| b.angular_velocity[0].z = 1e300),
];

/// Puts a stepper into a state that overflows; what its steps say, and the good state.
fn step_from_overflow(choice: &Choice, fault: Fault) -> (Stepper, Bodies, Result<(), StepError>) {
    let mut stepper = Stepper::new(small(), choice.options(DT)).expect("sound");
    let good = stepper.scene().bodies.clone();
    let mut bad = good.clone();
    fault(&mut bad);
    stepper.set_state(&bad, 0.0).expect("finite");
    let found = (0..100).try_for_each(|_| stepper.step().map(|_| ()));
    (stepper, good, found)
}

#[test]
fn a_state_that_overflows_stops_the_step() {
    for choice in taut_tests::compiled() {
        for (what, fault) in OVERFLOWS {
            let (_, _, found) = step_from_overflow(&choice, fault);
            let typed = match &found {
                Err(StepError::NonFinite { .. }) => true,
                Err(StepError::Solve { source, .. }) => {
                    matches!(source, SolveError::NonFinite { .. })
                }
                _ => false,
            };
            assert!(typed, "{choice}, {what}: {found:?}");
        }
    }
}

/// Nothing of a bad state is left once a good one is set: no warm start, no tension, no winding number.
#[test]
fn a_good_state_after_a_bad_one_is_as_good_as_new() {
    let mut faults = Vec::new();
    for choice in taut_tests::compiled() {
        let mut fresh = Stepper::new(small(), choice.options(DT)).expect("sound");
        let good = fresh.scene().bodies.clone();
        fresh.set_state(&good, 0.0).expect("same scene");
        fresh.step().expect("sound");
        for (what, fault) in OVERFLOWS {
            let (mut stepper, good, _) = step_from_overflow(&choice, fault);
            let again = stepper.set_state(&good, 0.0).and_then(|()| stepper.step());
            let error = forward_error(stepper.multipliers(), fresh.multipliers());
            if again.is_err() || error.is_nan() || error > 1e-9 {
                faults.push(format!(
                    "{choice}, after {what}: {again:?}, error {error:e}"
                ));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn states_and_multipliers_of_another_scene_are_refused() {
    let mut stepper = Stepper::new(small(), StepOptions::default()).expect("sound");
    let other = hoist(JointKind::Cosserat, Pose::Straight, 5, 10.0);
    let wrong = |e: Result<(), StepError>| match e {
        Err(StepError::Solve {
            source:
                SolveError::Dimension {
                    what,
                    expected,
                    found,
                },
            ..
        }) => (what, expected, found),
        other => panic!("{other:?}"),
    };
    let ours = wrong(stepper.set_state(&other.bodies, 0.0));
    assert_eq!(ours, ("bodies", 4, 6));
    let rows = stepper.multipliers().len();
    let ours = wrong(stepper.set_multipliers(&[1.0]));
    assert_eq!(ours, ("multipliers", rows, 1));
}

/// An unheld body beside a chain is no fault: it has a part of the KKT matrix, and none of S. A joint between the world
/// and the world is one.
#[test]
fn loose_bodies_beside_a_chain_fall() {
    for choice in taut_tests::compiled() {
        let mut scene = small();
        let body = Body::sphere(0.1, 2.0).at(Vector3::new(9.0, 0.0, 0.0));
        let stone = scene.add_body("stone", body);
        let fall = |options: StepOptions| {
            let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
            stepper.step().unwrap_or_else(|e| panic!("{choice}: {e}"));
            let bodies = &stepper.scene().bodies;
            (bodies.velocity[stone].z, bodies.position[stone].z)
        };
        let (velocity, _) = fall(paper(&choice, DT));
        let off = (velocity + 9.81 * DT).abs();
        assert!(off <= 1e-15, "{choice}: {velocity}");
        // The default: ½ g t² at the steps.
        let (_, position) = fall(choice.options(DT));
        let off = (position + 0.5 * 9.81 * DT * DT).abs();
        assert!(off <= 1e-15, "{choice}: {position}");
    }
    let mut scene = small();
    let world = origin();
    let frames = [world, world];
    let nothing = Constraint::Spherical(Spherical {
        frames,
        stretch: RowLaw::RIGID,
    });
    scene.add_constraint("nothing", nothing, 0);
    let e = refusal(scene, StepOptions::default());
    one_line(&e, "`nothing` ties the world to the world");
}
