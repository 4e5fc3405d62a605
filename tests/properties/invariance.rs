use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use taut_bench::Choice;
use taut_integrator::Stepper;
use taut_model::{Bodies, Scene};
use taut_solver::{Backend, DenseOptions, forward_error};
use taut_tests::random::Random;
use taut_tests::scenes::{moved, random_scene, relabelled};
use taut_tests::{Worst, allowed, compiled_direct};

const DT: f64 = 1.0 / 60.0;

fn stepped(scene: &Scene, choice: &Choice, steps: usize) -> Stepper {
    let mut stepper = Stepper::new(scene.clone(), choice.options(DT)).expect("sound");
    for _ in 0..steps {
        stepper.step().expect("stable");
    }
    stepper
}

/// Largest differences of positions \[m], orientations \[rad], velocities \[m/s] and angular velocities \[rad/s].
fn differences(a: &Bodies, b: &Bodies) -> [f64; 4] {
    let vectors = |a: &[Vector3<f64>], b: &[Vector3<f64>]| {
        let distances = a.iter().zip(b).map(|(a, b)| (a - b).norm());
        distances.fold(0.0, f64::max)
    };
    let turns = a.orientation.iter().zip(&b.orientation);
    [
        vectors(&a.position, &b.position),
        turns.map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max),
        vectors(&a.velocity, &b.velocity),
        vectors(&a.angular_velocity, &b.angular_velocity),
    ]
}

/// Measured differences of positions, orientations, velocities and angular velocities after 1 and after 20 steps, in which
/// one scene multiplies its rounding by 1000; most do not.
const MEASURED: [(usize, [f64; 4]); 2] = [
    (1, [1.3e-15, 1.7e-14, 4.3e-14, 9.7e-13]),
    (20, [5.2e-13, 2.5e-12, 4.8e-11, 2.4e-10]),
];

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 24,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    /// A turned and shifted scene, its gravity and its moving anchor with it, does the same, turned and shifted: to
    /// rounding, and to what the motion makes of rounding.
    #[test]
    fn turning_and_shifting_the_scene_turns_and_shifts_the_result(
        seed in 1_u64..100,
        turn in prop::array::uniform3(-3.0..3.0_f64),
        shift in prop::array::uniform3(-5.0..5.0_f64),
        kkt in any::<bool>(),
    ) {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        let shift = Vector3::from(shift);
        let backend = Backend::Dense(DenseOptions::default());
        let choice = if kkt { Choice::kkt(backend) } else { Choice::schur(backend) };
        let scene = random_scene(seed);
        let other = moved(&scene, &turn, &shift);
        for (steps, measured) in MEASURED {
            let expected = moved(stepped(&scene, &choice, steps).scene(), &turn, &shift);
            let end = stepped(&other, &choice, steps);
            let errors = differences(&expected.bodies, &end.scene().bodies);
            let within = errors.iter().zip(measured).all(|(e, m)| *e <= allowed(m));
            prop_assert!(within, "after {} steps: {:?} against {:?}", steps, errors, measured);
        }
    }
}

/// Bodies and constraints in another order: the multipliers change places, the motion stays.
#[test]
fn relabelling_bodies_and_constraints_permutes_the_multipliers() {
    let (mut multipliers, mut motion) = (Worst::default(), Worst::default());
    for seed in 1..=10 {
        let scene = random_scene(seed);
        let mut random = Random::new(1000 + seed);
        let bodies = random.permutation(scene.bodies.len());
        let constraints = random.permutation(scene.constraints.len());
        let other = relabelled(&scene, &bodies, &constraints);
        for choice in compiled_direct() {
            let (plain, permuted) = (stepped(&scene, &choice, 1), stepped(&other, &choice, 1));
            let rows = plain.linearized();
            let rows = constraints.iter().flat_map(|&c| rows.row_range(c));
            let expected: Vec<f64> = rows.map(|r| plain.multipliers()[r]).collect();
            let place = format!("seed {seed}, {choice}");
            multipliers.see(forward_error(permuted.multipliers(), &expected), &place);
            let (a, b) = (&plain.scene().bodies, &permuted.scene().bodies);
            for (new, &old) in bodies.iter().enumerate() {
                motion.see((a.position[old] - b.position[new]).norm(), &place);
            }
        }
    }
    multipliers.expect_measured("multipliers", 8.2e-16);
    motion.expect_measured("positions", 6.7e-16);
}
