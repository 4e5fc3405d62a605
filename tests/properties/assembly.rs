use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};
use taut_bench::Choice;
use taut_integrator::{Elimination, Form, Scheme, StepOptions, Stepper};
use taut_model::{Bodies, Linearized, Scene};
use taut_solver::{Backend, DenseOptions, SymBlockMatrix, forward_error, norm_inf};
use taut_tests::random::Random;
use taut_tests::scenes::random_scene;
use taut_tests::{Worst, compiled_direct, paper, unguarded};

const DT: f64 = 1.0 / 60.0;

/// A dense solver's paper's step and default step, by name.
fn steps(form: Form) -> [(&'static str, StepOptions); 2] {
    let choice = Choice {
        backend: Backend::Dense(DenseOptions::default()),
        form,
    };
    [
        ("paper", paper(&choice, DT)),
        ("default", unguarded(&choice, DT)),
    ]
}

/// Multipliers of the size of the weights, for the geometric stiffness \[N, N m].
fn tension(seed: u64, rows: usize) -> Vec<f64> {
    let mut random = Random::new(100 + seed);
    (0..rows).map(|_| random.vector(500.0).x).collect()
}

/// A stepper in the scene's state at t = 0, its past like that state, with the geometric stiffness of `tension`.
fn stepper_with_tension(scene: &Scene, seed: u64, options: StepOptions) -> Stepper {
    let mut stepper = Stepper::new(scene.clone(), options).expect("a sound scene");
    let tension = tension(seed, stepper.multipliers().len());
    stepper.set_tension(&tension).expect("as many rows");
    stepper.set_state(&scene.bodies, 0.0).expect("same scene");
    stepper
}

fn solved(scene: &Scene, seed: u64, options: StepOptions) -> Stepper {
    let mut stepper = stepper_with_tension(scene, seed, options);
    stepper.solve().expect("solvable");
    stepper
}

fn dense(a: &SymBlockMatrix) -> DMatrix<f64> {
    DMatrix::from_fn(a.dim(), a.dim(), |r, c| a.get(r, c))
}

/// S of the last solve with its rows in the scene's order.
fn schur(stepper: &Stepper) -> DMatrix<f64> {
    let (a, rows) = (stepper.system().0, stepper.linearized());
    let mut place = vec![0; a.dim()];
    let order = stepper.elimination().constraints.iter();
    for (at, row) in order.flat_map(|&c| rows.row_range(c)).enumerate() {
        place[row] = at;
    }
    DMatrix::from_fn(a.dim(), a.dim(), |r, c| a.get(place[r], place[c]))
}

/// Weights of the rates after, before and the step before that, of the schemes that are tested here.
fn weights(scheme: Scheme) -> [f64; 3] {
    match scheme {
        Scheme::LinearlyImplicit => [1.0, 0.0, 0.0],
        Scheme::ThirdDifference { a, gamma } => [a + gamma, a + 2.0 * gamma, gamma],
        other => panic!("{other} is not tested here"),
    }
}

/// K of a body from multipliers λ: Σ max(F·r, 0) (I − r rᵀ/r²) over its attachments.
fn geometric_stiffness(rows: &Linearized, lambda: &[f64], body: usize) -> Matrix3<f64> {
    let mut k = Matrix3::zeros();
    for (s, slot) in rows.slots.iter().enumerate() {
        let (r, lambda) = (rows.levers[s], &lambda[rows.row_range(slot.constraint)]);
        if slot.body == body && r.norm() > 0.0 {
            let pulls = rows.block(s).chunks_exact(6).zip(lambda);
            let force: Vector3<f64> = pulls
                .map(|(j, l)| Vector3::new(j[0], j[1], j[2]) * *l)
                .sum();
            let across = Matrix3::identity() - r.normalize() * r.normalize().transpose();
            k += across * force.dot(&r).max(0.0);
        }
    }
    k
}

/// J, M̃ = M + αΔt²K and Σ as dense matrices, made from the scene without the integrator's maps, and the rows.
fn pieces(
    scene: &Scene,
    seed: u64,
    options: &StepOptions,
) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>, Linearized) {
    let mut rows = Linearized::new(scene);
    rows.update(scene, 0.0);
    rows.drive(scene, 0.0, DT);
    let (n, m) = (rows.rows(), 6 * scene.bodies.len());
    let mut jacobian = DMatrix::zeros(n, m);
    for (s, slot) in rows.slots.iter().enumerate() {
        let first = rows.row_range(slot.constraint).start;
        for (r, row) in rows.block(s).chunks_exact(6).enumerate() {
            for (c, j) in row.iter().enumerate() {
                jacobian[(first + r, 6 * slot.body + c)] += j;
            }
        }
    }
    let lambda = tension(seed, n);
    let mut mass = DMatrix::zeros(m, m);
    for i in 0..scene.bodies.len() {
        for r in 0..3 {
            mass[(6 * i + r, 6 * i + r)] = scene.bodies.mass[i];
        }
        let k = geometric_stiffness(&rows, &lambda, i);
        let angular = scene.bodies.inertia_world(i) + k * (options.stiffness.alpha() * DT * DT);
        mass.view_mut((6 * i + 3, 6 * i + 3), (3, 3))
            .copy_from(&angular);
    }
    let [next, ..] = weights(options.scheme);
    let sigma = DVector::from_fn(n, |r, _| {
        rows.compliance[r] / (DT * DT) / (next + rows.damping[r] / DT)
    });
    (jacobian, mass, DMatrix::from_diagonal(&sigma), rows)
}

/// S against J M̃⁻¹ Jᵀ + Σ from dense matrices, relative to the largest entry.
#[test]
fn the_schur_matrix_is_its_definition_and_positive_definite() {
    for ((step, options), measured) in steps(Form::Schur).into_iter().zip([5.3e-16, 1.5e-15]) {
        let mut worst = Worst::default();
        for seed in 1..=20 {
            let scene = random_scene(seed);
            let (jacobian, mass, sigma, _) = pieces(&scene, seed, &options);
            let inverse = mass.try_inverse().expect("masses");
            let expected = &jacobian * inverse * jacobian.transpose() + sigma;
            for elimination in Elimination::ALL {
                let options = StepOptions {
                    elimination,
                    ..options.clone()
                };
                let assembled = schur(&solved(&scene, seed, options));
                let error = (&assembled - &expected).amax() / expected.amax();
                worst.see(error, format_args!("seed {seed}, {elimination}"));
                assert!(assembled.cholesky().is_some(), "{step}, seed {seed}");
            }
        }
        worst.expect_measured(&format!("{step}: S − (J M̃⁻¹ Jᵀ + Σ)"), measured);
    }
}

/// K is not lost in the comparison above: with it S is another matrix.
#[test]
fn geometric_stiffness_changes_the_schur_matrix() {
    for seed in 1..=20 {
        let scene = random_scene(seed);
        let [_, (_, options)] = steps(Form::Schur);
        let with = dense(solved(&scene, seed, options.clone()).system().0);
        let mut stepper = Stepper::new(scene, options).expect("sound");
        let rows = stepper.multipliers().len();
        stepper.set_tension(&vec![0.0; rows]).expect("as many rows");
        stepper.solve().expect("solvable");
        let without = dense(stepper.system().0);
        let change = (&with - &without).amax() / without.amax();
        assert!(change > 1e-5, "seed {seed}: {change:e}");
    }
}

/// Diagonal blocks are stored in full: both triangles have to agree, relative to the block's largest entry.
#[test]
fn diagonal_blocks_are_symmetric() {
    let mut worst = Worst::default();
    for seed in 1..=20 {
        let both = [Form::Schur, Form::Kkt].map(|form| steps(form).map(|(s, o)| (form, s, o)));
        for (form, step, options) in both.into_iter().flatten() {
            let stepper = solved(&random_scene(seed), seed, options);
            let a = stepper.system().0;
            for i in 0..a.pattern().blocks() {
                let n = a.pattern().size(i);
                let block = a.block(a.pattern().column(i).start);
                let largest = block.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                for r in 0..n {
                    for c in 0..r {
                        let skew = (block[r + n * c] - block[c + n * r]).abs() / largest;
                        worst.see(skew, format_args!("seed {seed}, {step}, {form}, block {i}"));
                    }
                }
            }
        }
    }
    worst.expect_measured("skew part of a diagonal block", 5.9e-16);
}

/// The KKT matrix has as many positive eigenvalues as velocities and as many negative ones as rows, and the
/// eigenvalues are those of [M̃ Jᵀ; J −Σ].
#[test]
fn the_kkt_matrix_is_quasi_definite_and_its_definition() {
    let mut worst = Worst::default();
    for (seed, (step, options)) in (1..=8).flat_map(|seed| steps(Form::Kkt).map(|s| (seed, s))) {
        let scene = random_scene(seed);
        let (jacobian, mass, sigma, _) = pieces(&scene, seed, &options);
        let (n, m) = jacobian.shape();
        let mut expected = DMatrix::zeros(m + n, m + n);
        expected.view_mut((0, 0), (m, m)).copy_from(&mass);
        expected.view_mut((m, 0), (n, m)).copy_from(&jacobian);
        expected
            .view_mut((0, m), (m, n))
            .copy_from(&jacobian.transpose());
        expected.view_mut((m, m), (n, n)).copy_from(&-sigma);
        let sorted = |a: DMatrix<f64>| {
            let mut values: Vec<f64> = a.symmetric_eigenvalues().iter().copied().collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let stepper = solved(&scene, seed, options);
        let found = sorted(dense(stepper.system().0));
        let expected = sorted(expected);
        let negative = found.iter().filter(|&&v| v < 0.0).count();
        assert_eq!((negative, found.len()), (n, n + m), "seed {seed}");
        worst.see(
            forward_error(&found, &expected),
            format_args!("{step}, seed {seed}"),
        );
    }
    worst.expect_measured("eigenvalues of the KKT matrix", 1.9e-15);
}

/// Both forms are the same equations: each solver's multipliers, refined once, are those of the KKT system in extended
/// precision.
#[test]
fn both_forms_have_the_same_multipliers() {
    let mut worst = Worst::default();
    for seed in 1..=20 {
        for choice in compiled_direct() {
            let mut stepper =
                Stepper::new(random_scene(seed), choice.options(DT)).expect("a sound scene");
            let exact = stepper.reference_multipliers().expect("solvable");
            stepper.solve().expect("solvable");
            let error = forward_error(stepper.multipliers(), &exact);
            worst.see(error, format_args!("seed {seed}, {choice}"));
        }
    }
    worst.expect_measured("multipliers", 6.2e-16);
}

/// The velocities that come out satisfy J v⁺ + Σ μ = c and M̃ (v⁺ − v) = Δt f + Jᵀ μ, checked with dense matrices row by
/// row, relative to the sum of the magnitudes of the row's terms. With a past like the present state the default's
/// stiffness adds nothing to the right-hand side.
#[test]
fn the_step_solves_its_equations() {
    let (mut constraints, mut momenta) = (Worst::default(), Worst::default());
    let forms = [Form::Schur, Form::Kkt].map(|form| steps(form).map(|(s, o)| (form, s, o)));
    for (form, step, options) in forms.into_iter().flatten() {
        for seed in 1..=20 {
            let scene = random_scene(seed);
            let (jacobian, mass, sigma, rows) = pieces(&scene, seed, &options);
            let mut stepper = stepper_with_tension(&scene, seed, options.clone());
            let rate_before = stepper.linearized().phi_t.clone();
            stepper.step().expect("solvable");
            let velocities = |scene: &Scene| {
                let (v, w) = (&scene.bodies.velocity, &scene.bodies.angular_velocity);
                let both = v.iter().zip(w).flat_map(|(v, w)| v.iter().chain(w.iter()));
                DVector::from_iterator(mass.nrows(), both.copied())
            };
            let mut end = stepper.scene().clone();
            take_back_precession(&mut end.bodies);
            let (before, after) = (velocities(&scene), velocities(&end));
            let mu = DVector::from_column_slice(stepper.multipliers());
            let [next, now, past] = weights(options.scheme);
            let rates = &jacobian * &before + DVector::from_vec(rate_before);
            let c = DVector::from_fn(rows.rows(), |r, _| {
                let known = (now - past) * rates[r] - rows.phi[r] / DT;
                known / (next + rows.damping[r] / DT) - rows.phi_t[r]
            });
            let residual = &jacobian * &after + &sigma * &mu - &c;
            // The velocities are sums of large impulses that cancel.
            let inverse = mass.clone().try_inverse().expect("masses");
            let made_of = inverse.abs() * jacobian.abs().transpose() * mu.abs();
            let size = jacobian.abs() * (after.abs() + made_of) + &sigma * mu.abs() + c.abs();
            let place = format!("seed {seed}, {step}, {form}");
            constraints.see(ratio(&residual, &size), &place);

            let impulse = (0..scene.bodies.len()).flat_map(|i| {
                let force = scene.bodies.mass[i] * scene.gravity + scene.bodies.force[i];
                let torque = scene.bodies.torque[i] * DT + gyroscopic_impulse(&scene.bodies, i);
                [force * DT, torque]
            });
            let impulse =
                DVector::from_iterator(mass.nrows(), impulse.flat_map(|v| [v.x, v.y, v.z]));
            let transposed = jacobian.transpose();
            let residual = &mass * (&after - &before) - &impulse - &transposed * &mu;
            let size = mass.abs() * (after.abs() + before.abs())
                + impulse.abs()
                + transposed.abs() * mu.abs();
            momenta.see(ratio(&residual, &size), &place);
        }
    }
    constraints.expect_measured("J v⁺ + Σ μ − c", 1.4e-16);
    momenta.expect_measured("M̃ (v⁺ − v) − Δt f − Jᵀ μ", 6.0e-16);
}

/// The principal moment that a body with an axis of symmetry has twice.
fn across(inertia: &Matrix3<f64>) -> Option<f64> {
    let d = inertia.diagonal();
    let diagonal = *inertia == Matrix3::from_diagonal(&d);
    let twice = [0, 1, 2].into_iter().find(|&k| d[k] == d[(k + 1) % 3]);
    twice.filter(|_| diagonal).map(|k| d[k])
}

/// Bodies with an axis of symmetry end a step with an angular velocity that has turned about their angular momentum:
/// back to what the linear system gave.
fn take_back_precession(bodies: &mut Bodies) {
    for i in 0..bodies.len() {
        if let Some(across) = across(&bodies.inertia[i]) {
            let omega = bodies.angular_velocity[i];
            let turning = bodies.inertia_world(i) * omega / across;
            let back = UnitQuaternion::from_scaled_axis(turning * -DT);
            bodies.angular_velocity[i] = back * omega;
        }
    }
}

/// What free rotation through a step does to a body's angular momentum: I y⁺ − I y with
/// exp(½Δt ŷ⁺) I y⁺ = exp(−½Δt ŷ) I y in the body's frame, by fixed-point iteration; nothing where the body has an axis of
/// symmetry, whose angular velocity turns with it.
fn gyroscopic_impulse(bodies: &Bodies, i: usize) -> Vector3<f64> {
    let (inertia, turn) = (bodies.inertia[i], bodies.orientation[i]);
    if across(&inertia).is_some() {
        return Vector3::zeros();
    }
    let y = turn.inverse() * bodies.angular_velocity[i];
    let back = |y: Vector3<f64>| UnitQuaternion::from_scaled_axis(y * (-0.5 * DT));
    let before = back(y) * (inertia * y);
    let inverse = inertia.try_inverse().expect("an inertia");
    let mut next = y;
    for _ in 0..60 {
        next = inverse * (back(next) * before);
    }
    turn * (inertia * (next - y))
}

/// Largest |r|/size.
fn ratio(r: &DVector<f64>, size: &DVector<f64>) -> f64 {
    norm_inf(r.abs().component_div(size).as_slice())
}
