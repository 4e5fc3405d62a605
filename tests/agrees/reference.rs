use taut_tests::machines::random_machine;
use taut_tests::prelude::*;
use taut_tests::scenes::{Pose, hoist, random_scene, rigid_chain};

const DT: f64 = 1.0 / 60.0;

/// The reference multipliers against the dense oracle on the KKT matrix: another elimination, with pivoting, in the
/// same extended precision, and another way from the scene to the matrix and back.
#[test]
fn the_reference_multipliers_are_those_of_the_dense_oracle() {
    let mut worst = Worst::default();
    let mut compare = |scene: Scene, place: String| {
        let options = Choice::kkt(oracle()).options(DT);
        let options = options.with(|o| o.refinements = 0);
        let mut stepper = Stepper::new(scene, options).expect("sound");
        let reference = stepper.reference_multipliers().expect("solvable");
        stepper.solve().expect("solvable");
        worst.see(forward_error(&reference, stepper.multipliers()), place);
    };
    for joint in [JointKind::Spherical, JointKind::Cosserat, JointKind::Paper] {
        for pose in [Pose::Straight, Pose::Bent] {
            for ratio in [1.0, 1e5, 1e10] {
                let place = format!("{joint:?}, {pose:?}, ratio {ratio:e}");
                compare(hoist(joint, pose, 8, ratio), place);
            }
        }
    }
    for seed in 1..=10 {
        compare(random_scene(seed), format!("random scene {seed}"));
        compare(random_machine(seed), format!("random machine {seed}"));
    }
    compare(rigid_chain(8, 1e8), "rigid chain".to_owned());
    worst.expect_measured("reference multipliers", 0.0);
}

/// Impulses of the rigid chain at rest: each joint carries the weight below it, g Δt Σ m, straight up.
fn hanging_impulses(scene: &Scene) -> Vec<f64> {
    let masses = &scene.bodies.mass;
    let below = |j: usize| masses[j..].iter().sum::<f64>();
    (0..masses.len())
        // The row is the gap a − b along z, and b is the body below: to hold it up the multiplier is negative.
        .flat_map(|j| [0.0, 0.0, scene.gravity.z * DT * below(j)])
        .collect()
}

/// With ε = 0 no material constant enters: the closed form has no error of its own.
#[test]
fn a_rigid_chain_at_rest_carries_the_weight_below_each_joint() {
    let mut worst = Worst::default();
    for load in [1.0, 1e3, 1e5, 1e8] {
        let scene = rigid_chain(12, load);
        let exact = hanging_impulses(&scene);
        let mut stepper =
            Stepper::new(scene, StepOptions::default().with(|o| o.dt = DT)).expect("sound");
        let reference = stepper.reference_multipliers().expect("solvable");
        worst.see(
            forward_error(&reference, &exact),
            format_args!("load {load:e}"),
        );
        // Row by row as well: the smallest is not drowned by the largest.
        for (r, (x, e)) in reference.iter().zip(&exact).enumerate() {
            worst.see(
                (x - e).abs() / e.abs().max(f64::MIN_POSITIVE),
                format_args!("load {load:e}, row {r}"),
            );
        }
    }
    worst.expect_measured("weights", 1.7e-16);
}

/// Machines: all solvers in both forms, iterations with the tolerance of their kind, over some steps; bounds included.
#[test]
fn every_solver_agrees_on_machines() {
    let [mut direct, mut gradients, mut residuals, mut sweeps] = [(); 4].map(|()| Worst::default());
    for choice in compiled() {
        let patient = Choice {
            backend: choice
                .backend
                .with_iterations(200_000)
                .with_tolerance(3e-13),
            form: choice.form,
        };
        for seed in 1..=10 {
            let orders = Elimination::ALL;
            let options = patient.options(DT);
            let options = options.with(|o| o.elimination = orders[seed as usize % orders.len()]);
            let mut stepper = Stepper::new(random_machine(seed), options).expect("sound");
            for step in 0..6 {
                let exact = stepper.reference_multipliers().expect("solvable");
                let report = stepper.solve().expect("solvable");
                let place = format!("{choice}, machine {seed}, step {step}");
                assert_eq!(report.undecided, 0, "{place}");
                let error = forward_error(stepper.multipliers(), &exact);
                match choice.backend.name() {
                    "cg" => gradients.see(error, &place),
                    "minres" => residuals.see(error, &place),
                    "gauss-seidel" => sweeps.see(error, &place),
                    _ => direct.see(error, &place),
                }
                stepper.step().expect("solvable");
            }
        }
    }
    direct.expect_measured("direct solvers", 8.0e-16);
    // The residual that they stop at, over what stiff joints make of it.
    sweeps.expect_measured("Gauss–Seidel", 4.8e-10);
    gradients.expect_measured("conjugate gradient", 1e-11);
    residuals.expect_measured("MINRES", 2.9e-12);
}
