use super::*;
use crate::testing::*;

const DT: f64 = 1.0 / 60.0;

fn options(form: Form) -> StepOptions {
    let dense = taut_solver::Backend::Dense(taut_solver::DenseOptions::default());
    StepOptions::paper().with(|o| (o.dt, o.form, o.backend) = (DT, form, dense))
}

/// A body of 2 kg at `x` held at its centre to the world's origin, without gravity.
fn held(x: Vector3<f64>, law: RowLaw, motion: Motion) -> Scene {
    let mut scene = Scene::new("held");
    let body = scene.add_body("ball", Body::sphere(0.1, 2.0).at(x));
    let world = origin().moving(motion);
    let frames = [world, centre(body)];
    scene.add_constraint(
        "spring",
        Constraint::Spherical(Spherical {
            frames,
            stretch: law,
        }),
        0,
    );
    scene
}

#[test]
fn a_free_body_falls_as_symplectic_euler_says() {
    let mut scene = Scene::new("free");
    scene.gravity = Vector3::new(0.0, 0.0, -10.0);
    scene.add_body("ball", Body::sphere(0.1, 2.0));
    for form in [Form::Schur, Form::Kkt] {
        let mut stepper = Stepper::new(scene.clone(), options(form)).unwrap();
        for n in 1..=60 {
            stepper.step().unwrap();
            let exact = -10.0 * DT * DT * f64::from(n * (n + 1)) / 2.0;
            assert!((stepper.scene().bodies.position[0].z - exact).abs() < 1e-13);
        }
    }
}

/// The step is implicit Euler on a deformation mode of frequency ω: eigenvalues (1 ± iωΔt)/(1 + ω²Δt²), so that
/// with determinants of three consecutive amplitudes their squared modulus is 1/(1 + ω²Δt²) to rounding.
#[test]
fn a_deformation_mode_is_damped_by_its_law() {
    let (mass, compliance) = (2.0_f64, 1e-3_f64);
    let at = Vector3::new(0.01, 0.0, 0.0);
    let scene = held(at, RowLaw::new(compliance, 0.0), Motion::Fixed);
    for form in [Form::Schur, Form::Kkt] {
        let mut stepper = Stepper::new(scene.clone(), options(form)).unwrap();
        let mut x = vec![0.01];
        for _ in 0..8 {
            stepper.step().unwrap();
            x.push(stepper.scene().bodies.position[0].x);
        }
        let law = 1.0 / (1.0 + DT * DT / (mass * compliance));
        for w in x.windows(4) {
            let ratio = (w[2] * w[2] - w[3] * w[1]) / (w[1] * w[1] - w[2] * w[0]);
            assert!((ratio / law - 1.0).abs() < 1e-10, "{form}: {ratio} {law}");
        }
    }
}

/// τ turns a gap without inertia in the way into an exponential: φ⁺ = φ/(1 + Δt/τ) for ε = 0.
#[test]
fn a_gap_relaxes_with_its_damping_time() {
    let tau = 0.1;
    let at = Vector3::new(0.0, 0.02, 0.0);
    let scene = held(at, RowLaw::new(0.0, tau), Motion::Fixed);
    let mut stepper = Stepper::new(scene, options(Form::Schur)).unwrap();
    let mut exact = 0.02;
    for _ in 0..20 {
        stepper.step().unwrap();
        exact /= 1.0 + DT / tau;
        assert!((stepper.scene().bodies.position[0].y - exact).abs() < 1e-15);
    }
}

#[test]
fn a_rigid_row_follows_a_moving_anchor_without_lag() {
    let displacement = Vector3::new(0.5, -0.2, 0.1);
    let motion = Motion::Smooth {
        displacement,
        start: 0.1,
        duration: 0.5,
    };
    let scene = held(Vector3::zeros(), RowLaw::RIGID, motion);
    for form in [Form::Schur, Form::Kkt] {
        let mut stepper = Stepper::new(scene.clone(), options(form)).unwrap();
        for _ in 0..60 {
            stepper.step().unwrap();
            let anchor = motion.displacement(stepper.time());
            assert!((stepper.scene().bodies.position[0] - anchor).norm() < 1e-14);
        }
        assert_eq!(motion.displacement(stepper.time()), displacement);
    }
}

#[test]
fn a_spin_about_a_principal_axis_turns_by_its_angle() {
    let mut scene = Scene::new("top");
    let mut body = Body::new(1.0, Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0)));
    body.angular_velocity = Vector3::new(0.0, 0.0, 2.0);
    scene.add_body("top", body);
    let mut stepper = Stepper::new(scene, options(Form::Schur)).unwrap();
    stepper.steps(60);
    let turned = stepper.scene().bodies.orientation[0].scaled_axis();
    let off = (turned - Vector3::new(0.0, 0.0, 2.0)).norm();
    assert!(off < 1e-13, "{turned}");
}

#[test]
fn a_failed_solve_names_the_constraint() {
    let mut scene = held(Vector3::zeros(), RowLaw::RIGID, Motion::Fixed);
    let again = scene.constraints[0].clone();
    scene.add_constraint("again", again, 0);
    let mut stepper = Stepper::new(scene, options(Form::Schur)).unwrap();
    let error = stepper.step().unwrap_err();
    assert!(error.to_string().contains("`again`"), "{error}");
}

/// A hanging cable, and a stepper on it with the default scheme and stiffness.
fn hanging(guard: Option<crate::Guard>) -> Stepper {
    let params = taut_model::HoistParams {
        segments: 3,
        seed: 1,
        // A twist row would remember the turns of a motion that is lost.
        twist: Some(false),
        ..taut_model::HoistParams::default()
    };
    let options = StepOptions {
        guard,
        ..StepOptions::default().with(|o| o.backend = options(Form::Schur).backend)
    };
    Stepper::new(params.hanging_equilibrium().unwrap(), options).unwrap()
}

/// The tension of a motion that is lost makes M̃ overflow: with it, no later step would succeed.
#[test]
fn a_failed_step_leaves_no_tension_behind() {
    for guard in [None, Some(crate::Guard::default())] {
        let mut stepper = hanging(guard);
        let good = stepper.scene().bodies.clone();
        let from_good = |stepper: &mut Stepper| {
            stepper.set_state(&good, 0.0).unwrap();
            stepper.step().map(|_| stepper.multipliers().to_vec())
        };
        let expected = from_good(&mut hanging(guard));
        assert!(expected.is_ok());
        // Implicit sub-steps bring to rest what has a square.
        let speeds = [1e100, 1e160, 1e200, 1e300];
        for &speed in &speeds[usize::from(guard.is_some())..] {
            let mut bad = good.clone();
            bad.velocity[0].x = speed;
            stepper.set_state(&bad, 0.0).unwrap();
            let failed = (0..10_000).any(|_| stepper.step().is_err());
            assert!(failed, "{speed:e}, {guard:?}");
            assert_eq!(from_good(&mut stepper), expected, "{speed:e}, {guard:?}");
        }
    }
}

/// A step that is redone has the tension that it began with, whatever guess its solves start from.
#[test]
fn the_tension_of_a_step_that_is_taken_back_comes_back() {
    let guard = crate::Guard::default().with(|g| g.tolerance = f64::MIN_POSITIVE);
    let [a, b] = [0.0, -10.0].map(|guess| {
        let mut stepper = hanging(Some(guard));
        let bodies = stepper.scene().bodies.clone();
        let rows = stepper.multipliers().len();
        stepper.set_state(&bodies, 0.0).unwrap();
        stepper.set_multipliers(&vec![guess; rows]).unwrap();
        stepper.set_tension(&vec![-100.0; rows]).unwrap();
        assert!(stepper.step().unwrap().redone);
        stepper.into_scene()
    });
    assert_eq!(a, b);
}

/// Largest distance from the axis of a cable of EI = 30 N m², GJ = 25 N m², 2 m, between a clamp and a grip that slides
/// and turns, in 3 s of the default step.
fn off_axis(segments: usize, force: f64, torque: f64) -> f64 {
    let params = taut_model::SpecimenParams::new(taut_model::Specimen::Twist)
        .with(|p| (p.segments, p.length, p.ei) = (segments, 2.0, Some(30.0)))
        .with(|p| (p.gj, p.ea, p.force) = (Some(25.0), Some(1e6), Some(force)))
        .with(|p| (p.torque, p.bearing, p.seed) = (Some(torque), true, 4));
    let mut stepper = Stepper::new(params.build().unwrap(), StepOptions::default()).unwrap();
    let mut farthest = 0.0_f64;
    for _ in 0..180 {
        stepper.step().unwrap();
        let bodies = &stepper.scene().bodies;
        let off = bodies.position.iter().map(|x| x.y.hypot(x.z));
        farthest = off.fold(farthest, f64::max);
    }
    farthest
}

/// The chain's own loads, by the eigenvalues of its linearised balance.
#[test]
fn a_twisted_cable_leaves_its_axis_at_greenhills_torque() {
    for (segments, force, torque) in [
        (8, 740.22, 390.184),
        (20, 400.0, 246.437),
        (60, 0.0, 135.027),
    ] {
        for part in [0.6, 0.95] {
            let off = off_axis(segments, force, part * torque);
            assert!(off < 1e-5, "{segments} {part}: {off}");
        }
        let off = off_axis(segments, force, 1.1 * torque);
        assert!(off > 1e-3, "{segments}: {off}");
    }
}

/// An iteration starts from the last step's multipliers unless it is told not to, and is the shorter for it.
#[test]
#[cfg(feature = "cg")]
fn a_warm_start_is_the_default_and_saves_iterations() {
    let params = taut_model::HoistParams::default()
        .with(|p| (p.segments, p.mass_ratio, p.initial_angle) = (9, 100.0, 0.4))
        .with(|p| p.seed = 3);
    let options = StepOptions {
        backend: "cg:jacobi:tolerance=1e-6".parse().unwrap(),
        refinements: 0,
        guard: None,
        ..StepOptions::default()
    };
    assert!(options.warm_start);
    let iterations = [true, false].map(|warm_start| {
        let options = options.clone().with(|o| o.warm_start = warm_start);
        let mut stepper = Stepper::new(params.build().unwrap(), options).unwrap();
        (0..30)
            .map(|_| stepper.step().unwrap().iterations)
            .sum::<usize>()
    });
    assert!(iterations[0] < iterations[1], "{iterations:?}");
}

fn hoist() -> Scene {
    let params = taut_model::HoistParams::default().with(|p| (p.segments, p.move_x) = (4, 0.5));
    params.build().unwrap()
}

fn any() -> Capabilities {
    Capabilities {
        indefinite: true,
        iterative: false,
    }
}

/// The stepper with the solver that its options name, handed over as a value.
fn given(scene: Scene, options: StepOptions) -> Stepper {
    let solver = options.backend.create().unwrap();
    Stepper::with_solver(scene, options, solver, any()).unwrap()
}

#[test]
fn a_solver_handed_over_steps_as_the_one_of_that_name() {
    for form in [Form::Schur, Form::Kkt] {
        let mut scene = hoist();
        scene.start_in_equilibrium = true;
        let named = Stepper::new(scene.clone(), options(form)).unwrap();
        let mut named = Stepper::new(named.into_scene(), options(form)).unwrap();
        let mut given = given(named.scene().clone(), options(form));
        let order = |stepper: &Stepper| stepper.elimination().constraints.clone();
        assert_eq!(order(&given), order(&named));
        named.steps(30);
        given.steps(30);
        assert_eq!(given.scene(), named.scene());
        assert_eq!(given.multipliers(), named.multipliers());
        assert_eq!(given.options().backend.name(), "dense");
        Stepper::with_solver(scene, options(form), named.step.system.solver, any()).unwrap();
    }
}

#[test]
fn a_solver_handed_over_is_not_given_what_it_does_not_take() {
    let solver = options(Form::Kkt).backend.create().unwrap();
    let definite = Capabilities::default();
    let e = Stepper::with_solver(hoist(), options(Form::Kkt), solver, definite).err();
    let refused = matches!(e, Some(StepError::FormNotAccepted { .. }));
    assert!(refused, "{e:?}");
}

#[test]
fn a_solver_handed_over_stays_through_changes_and_those_that_fail() {
    let mut named = Stepper::new(hoist(), options(Form::Schur)).unwrap();
    let mut given = given(hoist(), options(Form::Schur));
    for stepper in [&mut named, &mut given] {
        for pass in 0..3 {
            stepper.step().unwrap();
            let mass = if pass == 1 { f64::NAN } else { 2.0 };
            let changed = stepper.change(|edit| {
                let body = edit.add_body(format!("ball {pass}"), Body::sphere(0.1, mass));
                let at = centre(edit.body_index(body)?);
                let spring = Spherical {
                    frames: [origin(), at],
                    stretch: RowLaw::new(1e-3, 0.0),
                };
                edit.add_constraint(format!("spring {pass}"), spring, 0);
                Ok(())
            });
            assert_eq!(changed.is_err(), pass == 1, "{changed:?}");
        }
        stepper.step().unwrap();
    }
    assert_eq!(given.scene(), named.scene());
    assert_eq!(given.multipliers(), named.multipliers());
}

#[test]
fn a_run_of_a_solver_handed_over_is_restored_where_that_is_registered() {
    let run = given(hoist(), options(Form::Schur)).save().unwrap();
    let e = Stepper::restore(run).err();
    let e = e.expect("no such solver").to_string();
    assert!(e.contains("register it"), "{e}");
}
