//! Energy over sheaves with friction: step by step, and never gained.

use super::tests::{DT, G, options, reeving, tensions, total_energy, total_length};
use crate::testing::*;
use taut_model::body_vectors::unpacked;

/// Energy of one unguarded step that is not accounted for \[J]. φ̂ is the predicted φ, d the drives
/// and slips ∂φ/∂t, and G the work of the geometric stiffness through M and Δt f:
///
/// ```text
/// ΔKE = Δt f·v⁺ + Σ μ ((φ̂ − φ)/Δt − d) − ½ |Δv|²_M + G
/// ```
fn residual_of_the_step(stepper: &mut Stepper) -> f64 {
    let before = stepper.scene().clone();
    let phi = stepper.linearized().phi.clone();
    stepper.step().unwrap();
    let dt = stepper.step.options.dt;
    let (system_data, bodies) = (&stepper.step.system_data, &before.bodies);
    let halves = |[x, y, z, p, q, r]: [f64; 6]| [Vector3::new(x, y, z), Vector3::new(p, q, r)];
    let mut gained = 0.0;
    for i in before.dynamic_bodies() {
        let inertia = bodies.inertia_world(i);
        let [v, w] = halves(system_data.v.get(i));
        let [dv, dw] = halves(system_data.dv.get(i));
        let (v, w) = (v + dv, w + dw);
        let force = (bodies.force[i] + before.gravity * bodies.mass[i]) * dt;
        let torque = bodies.torque[i] * dt;
        gained += force.dot(&v) + torque.dot(&w);
        gained -= 0.5 * (bodies.mass[i] * dv.norm_squared() + dw.dot(&(inertia * dw)));
        let [linear, angular] = halves(system_data.inertia.impulse.get(i));
        let stiff = unpacked(system_data.inertia.angular.get(i));
        gained += (linear - force).dot(&v) + (angular - torque + (inertia - stiff) * dw).dot(&w);
    }
    for (r, mu) in stepper.multipliers().iter().enumerate() {
        gained += mu * ((system_data.predicted[r] - phi[r]) / dt - system_data.rows.phi_t[r]);
    }
    stepper.scene().kinetic_energy() - before.kinetic_energy() - gained
}

fn implicit() -> StepOptions {
    options().with(|o| (o.scheme, o.guard) = (Scheme::LinearlyImplicit, None))
}

#[test]
fn the_energy_of_each_step_is_accounted_for() {
    for seed in 1..=20 {
        let scene = reeving(seed);
        let size: f64 = scene.bodies.mass.iter().sum::<f64>() * G * 3.0;
        let plain = implicit().with(|o| (o.stiffness, o.dt) = (GeometricStiffness::Off, DT / 4.0));
        let mut stepper = Stepper::new(scene, plain).unwrap();
        for step in 0..100 {
            let compliance = stepper.linearized().compliance.clone();
            let left = residual_of_the_step(&mut stepper);
            assert!(left.abs() < 1e-12 * size, "{seed}, {step}: {left:e}");
            // Each taut cable ends the step with ε μ/Δt = −φ̂: it takes up the change of φ²/2ε and
            // the loss ½ (φ̂ − φ)²/ε.
            for bound in &stepper.linearized().bounds {
                let r = bound.row;
                let mu = stepper.multipliers()[r];
                let predicted = stepper.step.system_data.predicted[r];
                let law = mu + stepper.step.options.dt * predicted / compliance[r];
                let holds = mu == 0.0 || law.abs() < 1e-9 * mu.abs();
                assert!(holds, "{seed}, {step}: {law:e}");
            }
        }
    }
}

#[test]
fn so_is_that_of_a_gantry_driven_for_a_minute() {
    for falls in [2, 4, 8, 12] {
        for sheave_friction in [0.0, 0.1, 0.2] {
            let params = GantryParams::default()
                .with(|p| (p.parts, p.sheaves) = (falls, true))
                .with(|p| (p.sheave_friction, p.mass_ratio) = (sheave_friction, 1e5));
            let scene = params.build().unwrap();
            let size = scene.bodies.mass.iter().sum::<f64>() * G * 10.0;
            let mut stepper = Stepper::new(scene, implicit()).unwrap();
            let mut worst = 0.0_f64;
            for step in 0..3600 {
                if step % 300 == 0 {
                    let sign = if step % 600 == 0 { 1.0 } else { -1.0 };
                    let controls = Controls {
                        trolley_speed: 0.5 * sign,
                        hoist_speed: 0.1 * sign,
                    };
                    stepper.set_controls(&controls).unwrap();
                }
                worst = worst.max(residual_of_the_step(&mut stepper).abs() / size);
            }
            assert!(worst < 1e-12, "{falls}, {sheave_friction}: {worst:e}");
        }
    }
}

#[test]
fn friction_never_adds_energy_and_keeps_its_cone() {
    let mut slipped = 0;
    for seed in 1..=40 {
        let scene = reeving(seed);
        let frictions: Vec<f64> = scene.capstans.iter().map(|c| c.friction).collect();
        let options = options().with(|o| (o.scheme, o.dt) = (Scheme::LinearlyImplicit, DT / 4.0));
        let mut stepper = Stepper::new(scene, options).unwrap();
        let whole = total_length(stepper.scene());
        let mut start = None;
        for step in 0..120 {
            let wraps = (0..frictions.len()).map(|i| stepper.scene().wrap(i));
            let wraps: Vec<f64> = wraps.collect();
            let report = stepper.step().unwrap();
            assert_eq!(report.undecided, 0, "{seed}, step {step}");
            let found = tensions(&stepper);
            let most = found.iter().fold(0.0, |m: f64, t| m.max(*t));
            let rates: Vec<f64> = stepper.slip_rates().collect();
            for (i, rate) in rates.into_iter().enumerate() {
                let (k, before, after) = ((frictions[i] * wraps[i]).exp(), found[i], found[i + 1]);
                let beyond = (after - k * before).max(before - k * after);
                assert!(beyond <= 1e-10 * most, "{seed}, step {step}: {found:?}");
                let value = rate * (after - before);
                assert!(value >= -1e-10 * most, "{seed}, step {step}");
                slipped += usize::from(rate != 0.0);
            }
            assert!((total_length(stepper.scene()) - whole).abs() < 1e-12 * whole);
            let total = total_energy(&stepper);
            let size = whole * 10.0 * G;
            let start = *start.get_or_insert(total);
            let holds = total <= start + 1e-9 * size;
            assert!(holds, "{seed}, step {step}: {total} from {start}");
        }
    }
    assert!(slipped > 1000, "{slipped}");
}
