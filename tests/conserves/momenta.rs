use taut_tests::machines::unbounded;
use taut_tests::prelude::*;
use taut_tests::scenes::{KINDS, free_cable};

const DT: f64 = 1.0 / 60.0;

fn dense(form: Form) -> StepOptions {
    let backend = Backend::Dense(DenseOptions::default());
    Choice { backend, form }.options(DT)
}

fn after(scene: &Scene, options: StepOptions, steps: usize) -> Scene {
    let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
    taut_tests::steps(&mut stepper, steps);
    stepper.scene().clone()
}

/// Joints between bodies exchange impulses, and so do motors and massless cables: their sum stays, to rounding, over
/// 200 steps, relative to Σ m |v|.
#[test]
fn a_free_cable_keeps_its_momentum_to_rounding() {
    let mut worst = Worst::default();
    for kind in KINDS {
        for form in [Form::Schur, Form::Kkt] {
            for seed in 1..=3 {
                let scene = free_cable(kind, 8, 1e-6, seed);
                let end = after(&scene, dense(form), 200);
                let terms = scene.bodies.velocity.iter().zip(&scene.bodies.mass);
                let scale: f64 = terms.map(|(v, m)| m * v.norm()).sum();
                let drift = (end.momentum() - scene.momentum()).norm() / scale;
                worst.see(drift, format_args!("{kind}, {form}, seed {seed}"));
                // It has moved: the test is not about bodies at rest.
                let moved = end.bodies.velocity[0] - scene.bodies.velocity[0];
                assert!(moved.norm() > 0.1);
            }
        }
    }
    // Steps in parts, of bodies that turn fast, add the rounding of their solves.
    worst.expect_measured("drift of the momentum", 1.7e-15);
}

/// The lever arms are those of the beginning of the step, to which both velocities beside it belong by halves: the
/// angular momentum about the centre of mass is kept to O(Δt²), half the time step, about a quarter of the drift.
/// Motors are as strong as it takes here, and cables push: where rows reach bounds the motion has kinks at times that
/// the steps do not meet, and the order is the first.
#[test]
fn a_free_cable_keeps_its_angular_momentum_to_second_order() {
    let drift = |scene: &Scene, dt: f64| {
        let options = dense(Form::Schur).with(|o| o.dt = dt);
        let end = after(scene, options, (0.5 / dt).round() as usize);
        // About the centre of mass, so that the drift is not that of x × p.
        let about = |scene: &Scene| {
            let terms = scene.bodies.position.iter().zip(&scene.bodies.mass);
            let centre: Vector3<f64> =
                terms.map(|(x, m)| x * *m).sum::<Vector3<f64>>() / scene.mass();
            scene.angular_momentum(&centre)
        };
        (about(&end) - about(scene)).norm() / about(scene).norm()
    };
    for kind in KINDS {
        let scene = unbounded(free_cable(kind, 6, 1e-3, 2));
        let drifts = [1e-3, 5e-4, 2.5e-4, 1.25e-4].map(|dt| drift(&scene, dt));
        println!("{kind}: {drifts:?}");
        for pair in drifts.windows(2) {
            // Measured: 4.03 to 4.57.
            let fall = pair[0] / pair[1];
            assert!((3.2..5.5).contains(&fall), "{kind}: {drifts:?}");
        }
        // Measured: 2.0e-6 to 7.2e-6.
        assert!(drifts[0] < 7e-5, "{kind}: {drifts:?}");
    }
}

/// A damped cable that swings, nothing driven: no energy comes in. Of the energy's peaks in each half second none is
/// above the first.
#[test]
fn the_energy_of_a_damped_swing_does_not_grow() {
    for joint in [JointKind::Spherical, JointKind::Cosserat, JointKind::Paper] {
        let params = HoistParams::default()
            .with(|p| (p.segments, p.mass_ratio, p.joint) = (8, 10.0, joint))
            .with(|p| (p.damping, p.seed, p.seed_rate) = (0.02, 5, 0.1));
        let rest = params.hanging_equilibrium().expect("sound");
        let swing = params.with(|p| p.initial_angle = 0.6);
        let scene = swing.build().expect("sound");
        let stepper = Stepper::new(scene, dense(Form::Schur)).expect("sound");
        let peaks = peaks(stepper, energy_of_step, rest.potential_energy(), 20, 30);
        println!("{joint:?}: {peaks:?}");
        // Measured: the closest comes to within 1.4e-4 of the first, the last is 3e-4 to 4e-3 below it.
        let all_hold = peaks[1..].iter().all(|&p| p < peaks[0]);
        assert!(all_hold, "{joint:?}: {peaks:?}");
        let holds = peaks[0] < 1.1 * 240.0 && peaks[0] > 200.0;
        assert!(holds, "{joint:?}: {peaks:?}");
    }
}

/// A hoist whose load bounces on it, released unstretched, and the same at rest.
fn bounce(options: &StepOptions) -> [Stepper; 2] {
    let params =
        HoistParams::default().with(|p| (p.segments, p.mass_ratio, p.damping) = (8, 1000.0, 0.005));
    let scenes = [params.build(), params.hanging_equilibrium()];
    scenes.map(|scene| Stepper::new(scene.expect("sound"), options.clone()).expect("sound"))
}

/// A cable released unstretched bounces until the energy above that of the cable at rest is gone: each peak is below
/// the one before. The paper's step damps the bounce far more than the joints do.
#[test]
fn the_energy_of_a_damped_bounce_dies_out() {
    let choice = Choice::schur(Backend::Dense(DenseOptions::default()));
    let [released, mut resting] = bounce(&paper(&choice, DT));
    resting.solve().expect("solvable");
    let floor = resting.scene().potential_energy() + resting.elastic_energy();
    let peaks = peaks(released, energy_of_step, floor, 12, 15);
    println!("{peaks:?}");
    let gone = 1e-9 * peaks[0];
    for pair in peaks.windows(2) {
        // Measured: at most a seventeenth of the one before.
        assert!(pair[1] < 0.2 * pair[0] || pair[1] < gone, "{peaks:?}");
    }
    assert!(peaks[0] > 20.0 && peaks[11] < gone, "{peaks:?}");
}

/// The default step leaves the bounce to the joints' damping: in continuous time the energy falls by exp(−ω²τ t), with
/// ω² = YA/(L M), and in the step by the roots of its own equation, which is not far from that at ωΔt = 0.75.
#[test]
fn the_energy_of_a_bounce_dies_out_as_its_damping_says() {
    let [released, resting] = bounce(&dense(Form::Schur));
    let floor = resting.scene().potential_energy() + energy_in_gaps(&resting);
    let energy =
        |stepper: &mut Stepper| energy_in_gaps(stepper) + mechanical_energy_of_step(stepper);
    let peaks = peaks(released, energy, floor, 12, 15);
    println!("{peaks:?}");
    assert!(peaks.windows(2).all(|pair| pair[1] < pair[0]), "{peaks:?}");
    // The roots' modulus is 0.932 for ωΔt = 0.745, τ/Δt = 0.3; in continuous time it is e^(−1/24).
    let fall = (peaks[11] / peaks[0]).powf(1.0 / 11.0);
    let off = (fall / 0.932_f64.powi(30) - 1.0).abs();
    assert!(off < 0.1, "{fall}: {peaks:?}");
}

/// Energy that the gaps hold, ½ φ²/ε \[J]. The multipliers of damped rows hold the damping force too: ½ ε λ² is off by
/// as much as that, linear in the amplitude of the motion.
fn energy_in_gaps(stepper: &Stepper) -> f64 {
    let rows = stepper.linearized();
    let rows = rows.phi.iter().zip(&rows.compliance);
    rows.map(|(phi, compliance)| 0.5 * phi * phi / compliance)
        .sum()
}

/// The energy above `floor` \[J]: its peak in each of `windows` windows of `steps` steps.
fn peaks(
    mut stepper: Stepper,
    energy_of_step: impl Fn(&mut Stepper) -> f64,
    floor: f64,
    windows: usize,
    steps: usize,
) -> Vec<f64> {
    let peak = |_| {
        let energies = (0..steps).map(|_| energy_of_step(&mut stepper) - floor);
        energies.fold(f64::NEG_INFINITY, f64::max)
    };
    (0..windows).map(peak).collect()
}

/// Makes a step and gives the energy at its beginning.
fn energy_of_step(stepper: &mut Stepper) -> f64 {
    mechanical_energy_of_step(stepper) + stepper.elastic_energy()
}

/// Makes a step and gives the mechanical energy at its beginning; velocities stand half a step
/// before and after it.
fn mechanical_energy_of_step(stepper: &mut Stepper) -> f64 {
    let mut middle = stepper.scene().clone();
    stepper.step().expect("stable");
    let after = &stepper.scene().bodies;
    for i in 0..after.len() {
        middle.bodies.velocity[i] = 0.5 * (middle.bodies.velocity[i] + after.velocity[i]);
        let w = &mut middle.bodies.angular_velocity[i];
        *w = 0.5 * (*w + after.angular_velocity[i]);
    }
    middle.kinetic_energy() + middle.potential_energy()
}

/// A tumbling top for a minute.
#[test]
fn quaternions_keep_their_norm() {
    let mut worst = Worst::default();
    let mut scene = free_cable("cosserat", 5, 1e-6, 9);
    for w in &mut scene.bodies.angular_velocity {
        *w *= 3.0;
    }
    let mut stepper = Stepper::new(scene, dense(Form::Schur)).expect("sound");
    for step in 0..3600 {
        stepper.step().expect("stable");
        for q in &stepper.scene().bodies.orientation {
            worst.see(
                (q.as_vector().norm() - 1.0).abs(),
                format_args!("step {step}"),
            );
        }
    }
    let turned = stepper.scene().bodies.orientation[0].angle_to(&UnitQuaternion::identity());
    assert!(turned > 0.1, "{turned}");
    worst.expect_measured("|e| − 1", 2.2e-16);
}
