use super::equations::{Equations, take_back_rotation, velocities};
use taut_tests::machines::{held_group, random_machine, unbounded};
use taut_tests::prelude::*;
use taut_tests::scenes::random_scene;

const DT: f64 = 1.0 / 60.0;

/// Scenes of each kind, and their seeds. Machines are without bounds here: rows at bounds leave the matrix, which then is
/// not that of the definition. `bounded` judges what comes out with them.
fn scenes(most: u64) -> impl Iterator<Item = (u64, Scene)> {
    let joints = (1..=most).map(|seed| (seed, random_scene(seed)));
    joints.chain((1..=most).map(|seed| (seed, unbounded(random_machine(seed)))))
}

/// The place of a fault.
fn place(seed: u64, scene: &Scene) -> String {
    format!("{}, seed {seed}", scene.name)
}

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

/// Its equations at t = 0.
fn equations(scene: &Scene, seed: u64, options: &StepOptions) -> Equations {
    let rows = taut_model::Linearized::new(scene).rows();
    Equations::of(scene, 0.0, &tension(seed, rows), options)
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

/// S against J M̃⁻¹ Jᵀ + Σ from dense matrices, relative to the largest entry.
#[test]
fn the_schur_matrix_is_its_definition_and_positive_definite() {
    for ((step, options), measured) in steps(Form::Schur).into_iter().zip([5.3e-16, 1.5e-15]) {
        let mut worst = Worst::default();
        for (seed, scene) in scenes(20) {
            let expected = equations(&scene, seed, &options).schur();
            for elimination in Elimination::ALL {
                let options = options.clone().with(|o| o.elimination = elimination);
                let assembled = schur(&solved(&scene, seed, options));
                let error = (&assembled - &expected).amax() / expected.amax();
                let place = place(seed, &scene);
                worst.see(error, format_args!("{place}, {elimination}"));
                assert!(assembled.cholesky().is_some(), "{step}, {place}");
            }
        }
        worst.expect_measured(&format!("{step}: S − (J M̃⁻¹ Jᵀ + Σ)"), measured);
    }
}

/// Diagonal blocks are stored in full: both triangles have to agree, relative to the block's largest entry.
#[test]
fn diagonal_blocks_are_symmetric() {
    let mut worst = Worst::default();
    for (seed, scene) in scenes(20) {
        let both = [Form::Schur, Form::Kkt].map(|form| steps(form).map(|(s, o)| (form, s, o)));
        for (form, step, options) in both.into_iter().flatten() {
            let stepper = solved(&scene, seed, options);
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
    let all = scenes(8).flat_map(|scene| steps(Form::Kkt).map(|s| (scene.clone(), s)));
    for ((seed, scene), (step, options)) in all {
        let Equations {
            coupling,
            mass,
            sigma,
            ..
        } = equations(&scene, seed, &options);
        let (n, m) = coupling.shape();
        let mut expected = DMatrix::zeros(m + n, m + n);
        expected.view_mut((0, 0), (m, m)).copy_from(&mass);
        expected.view_mut((m, 0), (n, m)).copy_from(&coupling);
        expected
            .view_mut((0, m), (m, n))
            .copy_from(&coupling.transpose());
        expected
            .view_mut((m, m), (n, n))
            .copy_from(&-DMatrix::from_diagonal(&sigma));
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
            format_args!("{step}, {}, seed {seed}", stepper.scene().name),
        );
    }
    worst.expect_measured("eigenvalues of the KKT matrix", 1.9e-15);
}

/// The velocities that come out satisfy J v⁺ + Σ μ = c and M̃ (v⁺ − v) = Δt f + Jᵀ μ, checked with dense matrices row by
/// row, relative to the sum of the magnitudes of the row's terms; of bodies with an axis of symmetry and without. With a past like the present state the default's
/// stiffness adds nothing to the right-hand side.
#[test]
fn the_step_solves_its_equations() {
    let (mut constraints, mut momenta) = (Worst::default(), Worst::default());
    let forms = [Form::Schur, Form::Kkt].map(|form| steps(form).map(|(s, o)| (form, s, o)));
    for (form, step, options) in forms.into_iter().flatten() {
        let boxes = (1..=20).map(|seed| (seed, unbounded(held_group(seed, 4, 2))));
        for (seed, scene) in scenes(20).chain(boxes) {
            let Equations {
                jacobian,
                coupling,
                mass,
                inverse,
                sigma,
                c,
                impulse,
                ..
            } = equations(&scene, seed, &options);
            let mut stepper = stepper_with_tension(&scene, seed, options.clone());
            stepper.step().expect("solvable");
            let mut end = stepper.scene().clone();
            take_back_rotation(&mut end.bodies, &scene.bodies, DT);
            let (before, after) = (velocities(&scene.bodies), velocities(&end.bodies));
            let mu = DVector::from_column_slice(stepper.multipliers());
            let sigma_mu = sigma.component_mul(&mu);
            let residual = &jacobian * &after + &sigma_mu - &c;
            // The velocities are sums of large impulses that cancel.
            let transposed = coupling.transpose();
            let made_of = inverse.abs() * transposed.abs() * mu.abs();
            let size = jacobian.abs() * (after.abs() + made_of) + sigma_mu.abs() + c.abs();
            let place = format!("{}, {step}, {form}", place(seed, &scene));
            constraints.see(ratio(&residual, &size), &place);

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

/// Largest |r|/size.
fn ratio(r: &DVector<f64>, size: &DVector<f64>) -> f64 {
    // Nothing is made of nothing: driven bodies feel no force.
    let ratios = r.iter().zip(size.iter()).map(|(r, size)| match *size {
        0.0 => r.abs(),
        size => r.abs() / size,
    });
    norm_inf(&ratios.collect::<Vec<_>>())
}
