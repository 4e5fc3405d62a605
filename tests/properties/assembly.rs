use nalgebra::{DMatrix, DVector};
use taut_bench::Choice;
use taut_integrator::{Form, StepOptions, Stepper};
use taut_model::{Linearized, Scene};
use taut_solver::{Backend, DenseOptions, SymBlockMatrix, forward_error, norm_inf};
use taut_tests::scenes::random_scene;
use taut_tests::{Worst, compiled_direct};

const DT: f64 = 1.0 / 60.0;

fn solved(scene: Scene, form: Form, refinements: usize) -> Stepper {
    let options = StepOptions {
        dt: DT,
        form,
        backend: Backend::Dense(DenseOptions::default()),
        refinements,
        ..StepOptions::default()
    };
    let mut stepper = Stepper::new(scene, options).expect("a sound scene");
    stepper.solve().expect("solvable");
    stepper
}

fn dense(a: &SymBlockMatrix) -> DMatrix<f64> {
    DMatrix::from_fn(a.dim(), a.dim(), |r, c| a.get(r, c))
}

/// J, M⁻¹ and Σ as dense matrices, made from the scene without the integrator's maps.
fn pieces(scene: &Scene) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
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
    let mut mass = DMatrix::zeros(m, m);
    for i in 0..scene.bodies.len() {
        for r in 0..3 {
            mass[(6 * i + r, 6 * i + r)] = scene.bodies.mass[i];
        }
        let angular = scene.bodies.inertia_world(i);
        mass.view_mut((6 * i + 3, 6 * i + 3), (3, 3))
            .copy_from(&angular);
    }
    let sigma = DVector::from_fn(n, |r, _| {
        rows.compliance[r] / (DT * DT) / (1.0 + rows.damping[r] / DT)
    });
    (jacobian, mass, DMatrix::from_diagonal(&sigma))
}

/// S against J M⁻¹ Jᵀ + Σ from dense matrices, relative to the largest entry.
#[test]
fn the_schur_matrix_is_its_definition_and_positive_definite() {
    let mut worst = Worst::default();
    for seed in 1..=20 {
        let scene = random_scene(seed);
        let (jacobian, mass, sigma) = pieces(&scene);
        let inverse = mass.try_inverse().expect("masses");
        let expected = &jacobian * inverse * jacobian.transpose() + sigma;
        let stepper = solved(scene, Form::Schur, 0);
        let assembled = dense(stepper.system().0);
        let error = (&assembled - &expected).amax() / expected.amax();
        worst.see(error, format_args!("seed {seed}"));
        assert!(assembled.cholesky().is_some(), "seed {seed}");
    }
    worst.expect_measured("S − (J M⁻¹ Jᵀ + Σ)", 5.3e-16);
}

/// Diagonal blocks are stored in full: both triangles have to agree, relative to the block's largest entry.
#[test]
fn diagonal_blocks_are_symmetric() {
    let mut worst = Worst::default();
    for seed in 1..=20 {
        for form in [Form::Schur, Form::Kkt] {
            let stepper = solved(random_scene(seed), form, 0);
            let a = stepper.system().0;
            for i in 0..a.pattern().blocks() {
                let n = a.pattern().size(i);
                let block = a.block(a.pattern().column(i).start);
                let largest = block.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                for r in 0..n {
                    for c in 0..r {
                        let skew = (block[r + n * c] - block[c + n * r]).abs() / largest;
                        worst.see(skew, format_args!("seed {seed}, {form}, block {i}"));
                    }
                }
            }
        }
    }
    worst.expect_measured("skew part of a diagonal block", 5.9e-16);
}

/// The KKT matrix has as many positive eigenvalues as velocities and as many negative ones as rows, and the
/// eigenvalues are those of [M Jᵀ; J −Σ].
#[test]
fn the_kkt_matrix_is_quasi_definite_and_its_definition() {
    let mut worst = Worst::default();
    for seed in 1..=8 {
        let scene = random_scene(seed);
        let (jacobian, mass, sigma) = pieces(&scene);
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
        let stepper = solved(scene, Form::Kkt, 0);
        let found = sorted(dense(stepper.system().0));
        let expected = sorted(expected);
        let negative = found.iter().filter(|&&v| v < 0.0).count();
        assert_eq!((negative, found.len()), (n, n + m), "seed {seed}");
        worst.see(
            forward_error(&found, &expected),
            format_args!("seed {seed}"),
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

/// The velocities that come out satisfy J v⁺ + Σ μ = c and M (v⁺ − v) = Δt f + Jᵀ μ, checked with dense matrices row by
/// row, relative to the sum of the magnitudes of the row's terms.
#[test]
fn the_step_solves_its_equations() {
    let (mut constraints, mut momenta) = (Worst::default(), Worst::default());
    for seed in 1..=20 {
        for choice in [
            Choice::schur(Backend::Dense(DenseOptions::default())),
            Choice::kkt(Backend::Dense(DenseOptions::default())),
        ] {
            let scene = random_scene(seed);
            let (jacobian, mass, sigma) = pieces(&scene);
            let mut stepper = Stepper::new(scene.clone(), choice.options(DT)).expect("sound");
            stepper.step().expect("solvable");
            let velocities = |scene: &Scene| {
                let (v, w) = (&scene.bodies.velocity, &scene.bodies.angular_velocity);
                let both = v.iter().zip(w).flat_map(|(v, w)| v.iter().chain(w.iter()));
                DVector::from_iterator(mass.nrows(), both.copied())
            };
            let (before, after) = (velocities(&scene), velocities(stepper.scene()));
            let mu = DVector::from_column_slice(stepper.multipliers());
            let rows = stepper.linearized();
            let c = DVector::from_fn(rows.rows(), |r, _| {
                -rows.phi[r] / DT / (1.0 + rows.damping[r] / DT) - rows.phi_t[r]
            });
            let residual = &jacobian * &after + &sigma * &mu - &c;
            // The velocities are sums of large impulses that cancel.
            let inverse = mass.clone().try_inverse().expect("masses");
            let made_of = inverse.abs() * jacobian.abs().transpose() * mu.abs();
            let size = jacobian.abs() * (after.abs() + made_of) + &sigma * mu.abs() + c.abs();
            let place = format!("seed {seed}, {choice}");
            constraints.see(ratio(&residual, &size), &place);

            let bodies = &scene.bodies;
            let impulse = (0..bodies.len()).flat_map(|i| {
                let w = bodies.angular_velocity[i];
                let force = bodies.mass[i] * scene.gravity + bodies.force[i];
                let torque = bodies.torque[i] - w.cross(&(bodies.inertia_world(i) * w));
                [force * DT, torque * DT]
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
    momenta.expect_measured("M (v⁺ − v) − Δt f − Jᵀ μ", 6.0e-16);
}

/// Largest |r|/size.
fn ratio(r: &DVector<f64>, size: &DVector<f64>) -> f64 {
    norm_inf(r.abs().component_div(size).as_slice())
}
