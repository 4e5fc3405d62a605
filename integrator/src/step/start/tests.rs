use super::*;
use crate::testing::*;

/// Particles of `mass` on a line of links of `compliance`, which move with `velocity`, without gravity.
fn chain(mass: &[f64], compliance: f64, velocity: impl Fn(usize) -> Vector3<f64>) -> Scene {
    let mut scene = Scene::new("chain");
    for (k, mass) in mass.iter().enumerate() {
        let x = k as f64;
        let body = Body::particle(*mass).at(Vector3::new(x, 0.3 * x * x, 0.0));
        let body = scene.add_body(format!("p{k}"), body);
        scene.bodies.velocity[body] = velocity(k);
        if k > 0 {
            let apart = scene.bodies.position[body] - scene.bodies.position[body - 1];
            let frames = [body - 1, body].map(centre);
            let link = link(frames, apart.norm(), RowLaw::new(compliance, 0.0));
            scene.add_constraint(format!("l{k}"), link, 0);
        }
    }
    scene
}

fn options(scheme: Scheme, dt: f64, substeps: usize) -> StepOptions {
    StepOptions::default()
        .with(|o| (o.scheme, o.dt, o.substeps) = (scheme, dt, substeps))
        .with(|o| o.guard = Some(Guard::default()))
}

/// Two balls on a rod that fly apart end in their common velocity: before, the first step turned 1 m/s into −1.5 m/s.
#[test]
fn what_flies_apart_on_a_rod_is_stopped_by_it() {
    for scheme in Scheme::KINDS {
        for (dt, substeps) in [(1.0 / 60.0, 1), (1.0 / 60.0, 4), (1.0 / 960.0, 1)] {
            let mass = [1.0, 1e3];
            let along = Vector3::new(1.0, 0.3, 0.0).normalize();
            let scene = chain(&mass, 0.0, |k| along * [-1.0, 1.0][k]);
            let mut stepper = Stepper::new(scene, options(scheme, dt, substeps)).unwrap();
            stepper.steps(20);
            let common = along * ((1e3 - 1.0) / 1001.0);
            for v in &stepper.scene().bodies.velocity {
                assert!((v - common).norm() < 1e-10, "{scheme}, {dt} s: {v:?}");
            }
        }
    }
}

/// Random chains of rods with random velocities keep their momentum, gain nothing, and are in motion as the rods allow.
#[test]
fn a_blow_of_rods_keeps_momentum_and_gains_nothing() {
    let mut seed = 7_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    for round in 0..60 {
        let mass = (0..2 + round % 7).map(|_| 10_f64.powf(3.0 * random()));
        let mass: Vec<f64> = mass.collect();
        let velocities: Vec<_> = mass
            .iter()
            .map(|_| Vector3::from_fn(|_, _| 4.0 * random() - 2.0))
            .collect();
        let scene = chain(&mass, 0.0, |k| velocities[k]);
        let (momentum, before) = (scene.momentum(), scene.kinetic_energy());
        let dt = [1.0 / 60.0, 1.0 / 240.0, 1.0 / 960.0][round % 3];
        let mut stepper =
            Stepper::new(scene, options(Scheme::default(), dt, 1 + round % 2)).unwrap();
        stepper.step.strike_rigid_rows().unwrap();
        let scene = stepper.scene();
        let change = (scene.momentum() - momentum).norm();
        let holds = change < 1e-10 * mass.iter().sum::<f64>();
        assert!(holds, "round {round}: {change} kg m/s");
        let after = scene.kinetic_energy();
        assert!(after <= before * (1.0 + 1e-12), "round {round}");
        stepper
            .step
            .system_data
            .load_velocities(&stepper.step.scene.bodies);
        let mut rate = vec![0.0; mass.len() - 1];
        let rows = &stepper.step.system_data.rows;
        rows.times_jacobian(&stepper.step.system_data.v, &mut rate);
        let all_hold = rate.iter().all(|r| r.abs() < 1e-9);
        assert!(all_hold, "round {round}: {rate:?}");
        let mut worst = 0.0_f64;
        for _ in 0..30 {
            stepper.step().unwrap();
            let gain = stepper.energy().total() - after;
            worst = worst.max(gain / before);
        }
        assert!(worst < 0.02, "round {round}: {worst} of the motion before");
    }
}

/// A spring that the step resolves keeps the swing that it begins with, 0.3 % of its speed lost at Ω = 0.5; none ends the first steps faster than it
/// came.
#[test]
fn a_spring_keeps_the_swing_that_a_step_resolves() {
    let dt = 1.0 / 60.0;
    for omega in [
        0.03_f64, 0.1, 0.2, 0.5, 1.0, 3.0, 4.0, 5.0, 10.0, 30.0, 100.0, 1e4,
    ] {
        // Two balls of 2 kg move against each other as one of 1 kg.
        let compliance = (dt / omega).powi(2);
        let along = Vector3::new(1.0, 0.3, 0.0).normalize();
        let scene = chain(&[2.0, 2.0], compliance, |k| along * [-0.5, 0.5][k]);
        let begun = scene.kinetic_energy();
        let mut stepper = Stepper::new(scene, options(Scheme::default(), dt, 1)).unwrap();
        stepper.step.strike_rigid_rows().unwrap();
        let left = stepper.scene().kinetic_energy() / begun;
        let removed = omega * omega / (RIGID * RIGID + omega * omega);
        // Nothing changes that is slower than the slowest blow.
        let expected = if removed > 1e-3 {
            (1.0 - removed).powi(2)
        } else {
            1.0
        };
        assert!((left - expected).abs() < 1e-12, "Ω {omega}: {left}");
        for _ in 0..20 {
            stepper.step().unwrap();
            let share = stepper.energy().total() / begun;
            assert!(share < 1.01, "Ω {omega}: {share}");
        }
    }
}

/// The account of a step in sub-steps is that of as many steps: it used to begin with the last sub-step.
#[test]
fn a_balance_begins_with_the_first_sub_step() {
    let after = |dt: f64, substeps: usize, steps: usize| {
        let along = Vector3::new(1.0, 0.3, 0.0).normalize();
        let mut scene = chain(&[2.0, 3.0], 1e-3, |k| along * [-1.0, 1.0][k]);
        scene.gravity = Vector3::z() * -9.81;
        scene.bodies.mobility[0] = Mobility::Driven;
        let options =
            options(Scheme::default(), dt, substeps).with(|o| o.energy_tolerance = Some(10.0));
        let mut stepper = Stepper::new(scene, options).unwrap();
        let reports = (0..steps).map(|_| stepper.step().unwrap());
        reports.last().unwrap().balance.unwrap()
    };
    let [whole, parts] = [after(0.01, 8, 1), after(0.01 / 8.0, 1, 8)];
    assert!(parts.work.abs() > 0.05, "{parts:?}");
    for (whole, parts) in [(whole.work, parts.work), (whole.gained, parts.gained)] {
        let off = (whole / parts - 1.0).abs();
        assert!(off < 1e-9, "{whole} J for {parts} J");
    }
}

/// A support that speeds up at 50 m/s² strikes nothing that moves with it: the mean of ∂φ/∂t over a step is half a step ahead.
#[test]
fn what_moves_with_its_support_is_not_struck() {
    let motion = Motion::Smooth {
        displacement: Vector3::new(2.0, 0.0, 0.0),
        start: -0.1,
        duration: 0.5,
    };
    let part = 1e-5;
    let velocity = (motion.displacement(part) - motion.displacement(-part)) / (2.0 * part);
    let mut scene = Scene::new("support");
    let support = origin().moving(motion);
    let body = scene.add_body(
        "ball",
        Body::particle(100.0).at(Vector3::new(1.0, 0.0, 0.0)),
    );
    scene.bodies.velocity[body] = velocity;
    let at = motion.displacement(0.0);
    let frames = [support, centre(body)];
    let link = link(frames, (Vector3::x() - at).norm(), RowLaw::new(0.0, 0.0));
    scene.gravity = Vector3::z() * -9.81;
    scene.add_constraint("rod", link, 0);
    for dt in [1.0 / 60.0, 1.0 / 960.0] {
        let mut stepper = Stepper::new(scene.clone(), options(Scheme::default(), dt, 1)).unwrap();
        stepper.step.strike_rigid_rows().unwrap();
        assert_eq!(stepper.scene().bodies.velocity[body], velocity, "{dt} s");
    }
}
