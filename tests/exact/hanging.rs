//! The experiments on the hanging cable: the same functions that the tables of `taut static` come from.

use nalgebra::Vector3;
use taut_integrator::{Form, Stepper};
use taut_measure::Choice;
use taut_model::{Body, Frame, HoistParams, Scene};
use taut_solver::{Backend, DenseOptions};
use taut_studies::statics::{hold, iterations_needed, settle};
use taut_tests::scenes::joint;
use taut_tests::{Worst, compiled_direct, compiled_iterative};

const DT: f64 = 1.0 / 60.0;
const SEGMENTS: usize = 6;
const LEVELS: [f64; 3] = [1e-3, 1e-6, 1e-9];

fn params(segments: usize, mass_ratio: f64) -> HoistParams {
    HoistParams {
        segments,
        mass_ratio,
        ..HoistParams::default()
    }
}

/// Mass ratios, and the measured relative error of the settled elongation: the length of 10 m is known to 10⁻¹⁵ m, the
/// elongation at ratio 1 is 10⁻⁵ m.
const SETTLED: [(f64, f64); 6] = [
    (1.0, 1.4e-11),
    (10.0, 1.1e-11),
    (1e2, 2.2e-12),
    (1e3, 2.6e-13),
    (1e4, 5.6e-14),
    (1e5, 1.8e-13),
];

/// Damped to rest, the cable has its exact discrete length with every direct solver at every mass ratio: to 10⁻⁹, as
/// promised, and as close as it was measured.
#[test]
fn every_direct_solver_lets_the_cable_settle_at_its_exact_length() {
    for (ratio, measured) in SETTLED {
        let mut worst = Worst::default();
        for choice in compiled_direct() {
            for segments in [SEGMENTS, 12] {
                let settled = settle(&params(segments, ratio), &choice, DT, 6000).expect("stable");
                let place = format!("{choice}, {segments} segments, ratio {ratio:e}");
                assert!(settled.steps < 6000, "{place}: not at rest");
                assert!(settled.error <= 1e-9, "{place}: {settled:?}");
                // Nothing pushes it sideways, to the last bit.
                assert_eq!(settled.sideways_m, 0.0, "{place}");
                // (M + N m/2) g L/(YA) in closed form: longer than M g L/(YA) by N m/(2 M).
                let own_weight = segments as f64 / (2.0 * ratio);
                let excess = settled.error_continuum - own_weight;
                worst.see(settled.error, &place);
                worst.see(excess.abs() / (1.0 + own_weight), &place);
            }
        }
        worst.expect_measured(&format!("elongation at ratio {ratio:e}"), measured);
    }
}

/// From the equilibrium, with cold multipliers, direct solvers keep it.
#[test]
fn every_direct_solver_holds_the_cable_in_equilibrium() {
    for (ratio, measured) in SETTLED {
        let mut worst = Worst::default();
        for choice in compiled_direct() {
            let held = hold(&params(SEGMENTS, ratio), &choice.options(DT)).expect("stable");
            worst.see(held.error, format_args!("{choice}, ratio {ratio:e}"));
        }
        // The bar for settling holds here, too.
        worst.expect_measured(&format!("elongation held at ratio {ratio:e}"), measured);
    }
}

/// Iterations needed for each level; `None` beyond `limit`.
fn needed(choice: &Choice, ratio: f64, warm_start: bool, limit: usize) -> Vec<Option<usize>> {
    let options = taut_tests::changed(choice.options(DT), |o| o.warm_start = warm_start);
    let (params, family) = (params(SEGMENTS, ratio), choice.family());
    let rows = iterations_needed(&params, &options, &family, &LEVELS, limit).expect("stable");
    for (row, level) in rows.iter().zip(LEVELS) {
        assert_eq!(
            (row.level, row.warm_start, row.limit),
            (level, warm_start, limit)
        );
    }
    let found: Vec<_> = rows.iter().map(|row| row.iterations).collect();
    println!("{family}, ratio {ratio:e}, warm {warm_start}: {found:?}");
    found
}

fn choice(name: &str) -> Option<Choice> {
    let choice: Choice = name.parse().expect("a known name");
    compiled_iterative()
        .iter()
        .find(|c| c.family() == choice.family())
        .cloned()
}

/// Conjugate gradient converges all at once, after as many iterations as S has distinct eigenvalues along the cable:
/// one for each of the 7 joints, whatever the mass ratio and the level. With the groups solved exactly only their
/// coupling is left: 3.
#[test]
fn conjugate_gradient_needs_the_same_iterations_at_every_mass_ratio() {
    for (name, expected) in [("cg:none", 7), ("cg:jacobi", 7), ("cg:group", 3)] {
        let Some(choice) = choice(name) else {
            continue;
        };
        for ratio in [10.0, 1e3, 1e5] {
            for warm_start in [true, false] {
                let found = needed(&choice, ratio, warm_start, 100);
                assert_eq!(found, [Some(expected); 3], "{name}, ratio {ratio:e}");
            }
        }
    }
}

/// Gauss–Seidel needs sweeps in proportion to the mass ratio when it starts cold; fewer over groups; and fewer from the
/// last step's multipliers.
#[test]
fn gauss_seidel_needs_sweeps_in_proportion_to_the_mass_ratio() {
    let (Some(joints), Some(groups)) =
        (choice("gauss-seidel:joints"), choice("gauss-seidel:groups"))
    else {
        return;
    };
    let sweeps = |choice: &Choice, ratio: f64, warm_start: bool| -> Vec<f64> {
        let found = needed(choice, ratio, warm_start, 10_000);
        assert!(found.is_sorted(), "{found:?}");
        found
            .into_iter()
            .map(|n| n.expect("within the limit") as f64)
            .collect()
    };
    let cold = sweeps(&groups, 10.0, false);
    let heavier = sweeps(&groups, 100.0, false);
    let warm = sweeps(&groups, 10.0, true);
    let by_joint = sweeps(&joints, 10.0, false);
    for (i, level) in LEVELS.iter().enumerate() {
        // Measured: 7.5 to 8.3 times, 7.6 to 9.8 times, 6.9 to 7.0 times.
        let (mass, start, parts) = (
            heavier[i] / cold[i],
            cold[i] / warm[i],
            by_joint[i] / cold[i],
        );
        println!("level {level:e}: {mass:.1} {start:.1} {parts:.1}");
        assert!(
            (5.0..12.0).contains(&mass),
            "level {level:e}: {cold:?} {heavier:?}"
        );
        assert!(start > 2.0, "level {level:e}: {cold:?} {warm:?}");
        assert!(parts > 2.0, "level {level:e}: {cold:?} {by_joint:?}");
    }
}

/// A limit that is too small is reported as such, not as an answer.
#[test]
fn levels_beyond_the_limit_have_no_answer() {
    if let Some(choice) = choice("gauss-seidel:joints") {
        assert_eq!(needed(&choice, 1e5, false, 50), [None; 3]);
    }
}

/// A rod on a soft twist joint under a constant torque turns until ε λ = twist: here 25 rad, four turns, which the
/// winding number has to count. The angle is the sum of what the body turned, not the joint's own idea of it.
#[test]
fn a_constant_torque_twists_a_joint_through_several_turns() {
    const TORQUE: f64 = 2.5;
    let mut worst = Worst::default();
    for kind in ["cosserat", "paper"] {
        for form in [Form::Schur, Form::Kkt] {
            let mut scene = Scene::new("twist");
            let mut rod = Body::rod(1.0, 0.05, 1.0).at(Vector3::new(0.0, 0.0, -0.5));
            rod.torque = Vector3::new(0.0, 0.0, TORQUE);
            scene.add_body("rod", rod);
            let held = Frame::world(Vector3::zeros());
            let top = Frame::body(0, Vector3::new(0.0, 0.0, 0.5));
            // Compliance 10 rad/(N m), damped critically: 2/ω with ω² = 1/(10 · 1.25·10⁻³ kg m²).
            let twisting = joint(kind, [held, top], 1e-6, 10.0, 0.22);
            scene.add_constraint("joint", twisting, 0);
            let backend = Backend::Dense(DenseOptions::default());
            let choice = Choice { backend, form };
            let mut stepper = Stepper::new(scene, choice.options(1.0 / 240.0)).expect("sound");
            let mut angle = 0.0;
            for _ in 0..240 * 8 {
                stepper.step().expect("stable");
                angle += stepper.scene().bodies.angular_velocity[0].z / 240.0;
            }
            worst.see(
                (angle / (10.0 * TORQUE) - 1.0).abs(),
                format_args!("{kind}, {form}"),
            );
        }
    }
    worst.expect_measured("twist", 9.8e-15);
}
