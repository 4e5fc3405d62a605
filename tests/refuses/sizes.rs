use super::compiled;
use std::path::Path;
use std::time::{Duration, Instant};
use taut_measure::matrix::{market, matrix_of};
use taut_solver::GeneralMatrix;
use taut_tests::prelude::*;

/// Nothing here takes longer, on a machine that does other things too: each takes a second at most, and what goes through
/// the memory or the numbers that a header announces takes hours.
const LONGEST: Duration = Duration::from_secs(60);

/// 10⁵ segments in motion: some steps of the default backend, within seconds.
#[test]
fn a_cable_of_a_hundred_thousand_segments_steps() {
    let params = HoistParams::default()
        .with(|p| (p.segments, p.length, p.move_x) = (100_000, 1e4, 0.5))
        .with(|p| p.seed = 1);
    let scene = params.build().expect("sound parameters");
    let options = StepOptions::default();
    if options.backend.name() == "dense" {
        return;
    }
    let start = Instant::now();
    let mut stepper = Stepper::new(scene, options).expect("sound");
    taut_tests::steps(&mut stepper, 3);
    let bodies = &stepper.scene().bodies;
    assert!(bodies.position.iter().flatten().all(|x| x.is_finite()));
    assert!(start.elapsed() < LONGEST, "{:?}", start.elapsed());
}

/// A scene that gains and loses bodies and joints before every step: each time with the state and a stepper of its own.
#[test]
fn a_topology_that_changes_in_every_step_is_stepped() {
    for backend in compiled() {
        let options = StepOptions::default()
            .with(|o| (o.refinements, o.backend) = (usize::from(!backend.is_iterative()), backend));
        let mut scene = Scene::new("growing");
        scene.gravity = Vector3::new(0.0, 0.0, -10.0);
        for n in 0..24 {
            let upper = match scene.bodies.len() {
                0 => origin(),
                last => Frame::body(last - 1, Vector3::new(0.0, 0.0, -0.5)),
            };
            let top = match scene.bodies.len() {
                0 => Vector3::zeros(),
                last => scene
                    .bodies
                    .point_world(last - 1, &Vector3::new(0.0, 0.0, -0.5)),
            };
            let rod = Body::rod(1.0, 0.05, 1.0).at(top - Vector3::z() * 0.5);
            let body = scene.add_body(format!("rod-{n}"), rod);
            let frames = [upper, Frame::body(body, Vector3::new(0.0, 0.0, 0.5))];
            let stretch = RowLaw::new(1e-7, 0.0);
            let joint = Constraint::Spherical(Spherical { frames, stretch });
            scene.add_constraint(format!("joint-{n}"), joint, 0);
            if n % 5 == 4 {
                // The cable breaks: the joint in the middle goes.
                let middle = scene.constraints.len() / 2;
                scene.constraints.remove(middle);
                scene.constraint_names.remove(middle);
                scene.groups.remove(middle);
            }
            let mut stepper = Stepper::new(scene, options.clone()).expect("sound");
            stepper
                .step()
                .unwrap_or_else(|e| panic!("{}: {e}", options.backend));
            scene = stepper.into_scene();
            let numbers = scene.bodies.position.iter();
            let numbers = numbers.chain(&scene.bodies.velocity).flatten();
            assert!(numbers.copied().all(f64::is_finite), "{}", options.backend);
        }
        assert_eq!((scene.bodies.len(), scene.constraints.len()), (24, 20));
    }
}

/// Headers that announce more than any machine holds: refused, or the end of the file is found before memory is made.
#[test]
fn announced_sizes_cost_nothing() {
    let path = Path::new("large.mtx");
    let start = Instant::now();
    for sizes in [
        "1000000000000000000 1000000000000000000 1000000000000000000",
        "1000000000000000000 1000000000000000000 1",
        "1000000000000000000 1000000000000000000 0",
        "9223372036854775807 9223372036854775807 9223372036854775807",
        "99999999999999999999999 1 1",
        "3 3 1000000000000000000",
    ] {
        for symmetry in ["general", "symmetric"] {
            let text =
                format!("%%MatrixMarket matrix coordinate real {symmetry}\n{sizes}\n1 1 1.0\n");
            let read = market::read_from(text.as_bytes(), path);
            let error = read.and_then(|m| matrix_of(&m, path)).expect_err("absurd");
            assert!(!error.to_string().is_empty());
        }
    }
    for sizes in ["1000000000000000000 1", "1000000000 1000000000"] {
        let text = format!("%%MatrixMarket matrix array real general\n{sizes}\n1.0\n");
        assert!(market::read_from(text.as_bytes(), path).is_err());
    }
    for dim in [1 << 60, usize::MAX - 1, usize::MAX] {
        let error = GeneralMatrix::from_entries(dim, vec![(0, 0, 1.0)]).expect_err("absurd");
        let refused = matches!(error, SolveError::TooLarge { size, .. } if size == dim);
        assert!(refused, "{error}");
    }
    assert!(start.elapsed() < LONGEST, "{:?}", start.elapsed());
}
