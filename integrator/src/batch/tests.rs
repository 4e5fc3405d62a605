use super::*;
use crate::Guard;
use taut_model::{Bodies, HoistParams};

/// Hoists with different loads, materials and angles.
fn scenes(count: usize, segments: usize) -> Vec<Scene> {
    let one = |i: usize| {
        HoistParams {
            segments,
            mass_ratio: 10.0 * (1.0 + i as f64) * 10_f64.powi(i as i32 % 4),
            initial_angle: 0.1 * (i % 5) as f64,
            seed: i as u64,
            ..HoistParams::default()
        }
        .build()
        .unwrap()
    };
    (0..count).map(one).collect()
}

/// Largest difference of velocities, over the largest one or what gravity adds to it in a step, and of positions, over
/// the scene's size.
fn difference(a: &Bodies, b: &Bodies) -> f64 {
    let (mut speed, mut extent) = (9.81 / 60.0_f64, 0.0_f64);
    let (mut dv, mut dx) = (0.0_f64, 0.0_f64);
    for i in 0..a.len() {
        speed = speed.max(a.velocity[i].norm());
        extent = extent.max(a.position[i].norm());
        dv = dv.max((a.velocity[i] - b.velocity[i]).norm());
        dx = dx.max((a.position[i] - b.position[i]).norm());
    }
    (dv / speed).max(dx / extent)
}

fn ones(scenes: &[Scene], options: &StepOptions) -> Vec<Stepper> {
    let one = |scene: &Scene| Stepper::new(scene.clone(), options.clone()).unwrap();
    scenes.iter().map(one).collect()
}

#[test]
fn each_cable_moves_as_it_does_alone() {
    for (count, segments) in [(1, 3), (4, 12), (7, 5), (9, 24), (16, 4)] {
        for guard in [None, Some(Guard::default())] {
            let options = StepOptions {
                guard,
                ..StepOptions::default()
            };
            let scenes = scenes(count, segments);
            let mut ones = ones(&scenes, &options);
            let mut batch = BatchStepper::new(scenes, &options).unwrap();
            for step in 0..30 {
                let reports = batch.step().to_vec();
                for (i, one) in ones.iter_mut().enumerate() {
                    let expected = one.step().unwrap();
                    let found = reports[i].as_ref().unwrap();
                    assert_eq!(found.redone, expected.redone, "cable {i}, step {step}");
                    assert_eq!(found.solves, expected.solves, "cable {i}, step {step}");
                    // One step's rounding, or that of all before it.
                    let bound = if step == 0 { 1e-13 } else { 1e-11 };
                    let cable = &batch.cables()[i];
                    let found = difference(&one.scene().bodies, &cable.scene().bodies);

                    assert!(found < bound, "cable {i}, step {step}: {found:e}");
                }
            }
        }
    }
}

/// From the same state, one step each.
#[test]
fn a_step_agrees_to_rounding() {
    let options = StepOptions::default();
    let scenes = scenes(8, 24);
    let mut ones = ones(&scenes, &options);
    let mut batch = BatchStepper::new(scenes, &options).unwrap();
    for step in 0..20 {
        batch.step();
        for (i, one) in ones.iter_mut().enumerate() {
            one.step().unwrap();
            let cable = &mut batch.cables_mut()[i];
            let (expected, found) = (one.multipliers(), cable.multipliers());
            let largest = expected.iter().fold(0.0_f64, |a, mu| a.max(mu.abs()));
            for (expected, found) in expected.iter().zip(found) {
                let error = (found - expected).abs() / largest;
                assert!(error < 1e-13, "cable {i}, step {step}: {error:e}");
            }
            // On a segment the tensions of both sides cancel, which leaves their rounding: load/segment × 1e-16.
            let found = difference(&one.scene().bodies, &cable.scene().bodies);
            assert!(found < 1e-11, "cable {i}, step {step}: {found:e}");
            let time = one.time();
            let bodies = one.scene().bodies.clone();
            let (mu, tension) = (one.multipliers().to_vec(), one.tension.clone());
            for stepper in [&mut *one, cable] {
                stepper.set_state(&bodies, time).unwrap();
                stepper.set_multipliers(&mu).unwrap();
                stepper.set_tension(&tension).unwrap();
            }
        }
    }
}

#[test]
fn a_cable_that_fails_does_not_hold_up_the_others() {
    for guard in [None, Some(Guard::default())] {
        let options = StepOptions {
            guard,
            ..StepOptions::default()
        };
        let scenes = scenes(8, 6);
        let mut ones = ones(&scenes, &options);
        let mut batch = BatchStepper::new(scenes, &options).unwrap();
        batch.step();
        let mut bad = batch.cables()[5].scene().bodies.clone();
        bad.velocity[3].x = 1e160;
        batch.cables_mut()[5].set_state(&bad, 0.0).unwrap();
        for one in &mut ones {
            one.step().unwrap();
        }
        let mut failures = 0;
        for _ in 0..200 {
            for (i, report) in batch.step().iter().enumerate() {
                if i == 5 {
                    failures += usize::from(report.is_err());
                } else {
                    assert!(report.is_ok(), "cable {i}: {report:?}");
                }
            }
            for (i, one) in ones.iter_mut().enumerate().filter(|(i, _)| *i != 5) {
                one.step().unwrap();
                let cable = &batch.cables()[i];
                let found = difference(&one.scene().bodies, &cable.scene().bodies);

                assert!(found < 1e-9, "cable {i}: {found:e}");
            }
        }
        assert!(failures > 0, "{guard:?}");
        // And it comes back.
        let good = ones[5].scene().bodies.clone();
        batch.cables_mut()[5].set_state(&good, 0.0).unwrap();
        assert!(batch.step()[5].is_ok());
    }
}

/// States so fast that systems overflow, in all places, before a group of cables that is not full.
#[test]
fn cables_that_fail_together_do_not_hold_up_the_next() {
    for guard in [None, Some(Guard::default())] {
        let options = StepOptions {
            guard,
            ..StepOptions::default()
        };
        let width = Level::best().widest().clamp(4, 8);
        let mut batch = BatchStepper::new(scenes(width + width / 2, 4), &options).unwrap();
        batch.step();
        let bodies = |cable: &Stepper| cable.scene().bodies.clone();
        let good: Vec<Bodies> = batch.cables()[..width].iter().map(bodies).collect();
        for speed in [1e160, 1e308] {
            for (cable, good) in batch.cables_mut().iter_mut().zip(&good) {
                let mut bad = good.clone();
                bad.velocity[1].x = speed;
                cable.set_state(&bad, 0.0).unwrap();
            }
            for _ in 0..20 {
                assert!(batch.step()[width..].iter().all(Result::is_ok));
            }
        }
    }
}

/// A stepper that is put among others later, of another shape or the same, moves as it does alone.
#[test]
fn a_stranger_goes_alone() {
    let options = StepOptions::default();
    let scenes = scenes(4, 6);
    let mut ones = ones(&scenes, &options);
    let mut batch = BatchStepper::new(scenes, &options).unwrap();
    let stranger = |segments| {
        let params = HoistParams {
            segments,
            ..HoistParams::default()
        };
        Stepper::new(params.build().unwrap(), options.clone()).unwrap()
    };
    (batch.cables_mut()[3], ones[3]) = (stranger(9), stranger(9));
    for _ in 0..10 {
        assert!(batch.step().iter().all(Result::is_ok));
        for (one, cable) in ones.iter_mut().zip(batch.cables()) {
            one.step().unwrap();
            assert!(difference(&one.scene().bodies, &cable.scene().bodies) < 1e-11);
        }
    }
}

#[test]
fn what_is_no_batch_is_refused() {
    let refused =
        |scenes: Vec<Scene>, options: StepOptions| match BatchStepper::new(scenes, &options) {
            Err(StepError::NotOneShape { cable, reason }) => (cable, reason),
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("accepted"),
        };
    let mut mixed = scenes(3, 4);
    mixed.extend(scenes(1, 5));
    assert_eq!(refused(mixed, StepOptions::default()).0, 3);
    assert_eq!(refused(vec![], StepOptions::default()).0, 0);
    let kkt = StepOptions {
        form: Form::Kkt,
        ..StepOptions::default()
    };
    assert!(refused(scenes(2, 4), kkt).1.contains("Schur"));
    let matrix_free = StepOptions {
        backend: "cg:jacobi:matrix-free".parse().unwrap(),
        ..StepOptions::default()
    };
    assert!(refused(scenes(2, 4), matrix_free).1.contains("matrix"));
}

#[test]
fn short_cables_go_together_and_long_ones_alone() {
    let together = |segments| {
        let batch = BatchStepper::new(scenes(8, segments), &StepOptions::default()).unwrap();
        batch.together.is_some()
    };
    assert_eq!(together(24), Level::best().widest() >= 4);
    assert!(!together(100));
}
