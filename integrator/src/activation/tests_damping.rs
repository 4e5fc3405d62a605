//! Ropes with dampers that are slack at first: against the law's own motion, over floors, sheaves and winches.

use super::tests::{DT, G, ball, hung, options, rope};
use crate::contact::tests::add_box;
use crate::slip::tests::cable_length;
use crate::testing::*;

const MASS: f64 = 100.0;

/// A load that reaches the length of its rope with the speed `speed` after `time` of free fall.
fn falling(law: RowLaw, speed: f64, time: f64) -> (Scene, f64) {
    let slack = speed * time - 0.5 * G * time * time;
    let ends = [Vector3::zeros(), Vector3::z()];
    let mut scene = hung(MASS, ends, 1.0 + slack, law, None);
    scene.bodies.velocity[0].z = G * time - speed;
    (scene, slack)
}

/// Rope that a drum pays out, which holds `hold` (N), for a load that falls by `height` (m) into its rope: T = k (x + τ ẋ) while
/// that is less, T = `hold` while the drum slips, by Euler's rule in steps of 1 µs.
fn paid_by_law(stiffness: f64, damping: f64, hold: f64, height: f64) -> f64 {
    let h = 1e-6;
    let (mut x, mut u, mut paid) = (0.0_f64, (2.0 * G * height).sqrt(), 0.0);
    for _ in 0..1_500_000 {
        let pull = if x > 0.0 {
            (stiffness * (x + damping * u)).max(0.0)
        } else {
            0.0
        };
        let slip = match pull > hold {
            true if damping > 0.0 => u - (hold / stiffness - x) / damping,
            true => u.max(0.0),
            false => 0.0,
        };
        (paid, x) = (paid + h * slip, x + h * (u - slip));
        u += h * (G - pull.min(hold) / MASS);
    }
    paid
}

/// A drum that slips pays out all but the damper lets the rope stretch by: the rope took that way itself, and was 0.1 m too long.
#[test]
fn a_drum_that_slips_on_a_damped_rope_pays_out_what_the_law_says() {
    let (stiffness, hold, height) = (2e4, 3.0 * MASS * G, 0.8);
    for damping in [0.0, 0.02, 0.2, 1.0] {
        let exact = paid_by_law(stiffness, damping, hold, height);
        // The rope softens by 0.7 % as it grows.
        for (dt, allowed) in [(DT, 0.04), (DT / 16.0, 0.01)] {
            let length = 40.0;
            let ends = [Vector3::zeros(), Vector3::z() * (length - height)];
            let law = RowLaw::new(1.0 / stiffness, damping);
            let winch = brake(hold);
            let scene = hung(MASS, ends, length, law, Some(winch));
            let mut stepper = Stepper::new(scene, options(dt, 1)).unwrap();
            stepper.until(1.9);
            let paid = cable(stepper.scene(), 0).length - length;
            let off = (paid / exact - 1.0).abs();
            assert!(off < allowed, "τ {damping}, {dt}: {paid}, {exact}");
        }
    }
}

/// Largest stretch within 0.3 s of a load that stretches its rope at `speed` at first, T = (x + τ ẋ)/ε ≥ 0: by Runge and Kutta.
fn largest_stretch(law: RowLaw, speed: f64) -> f64 {
    if law.compliance == 0.0 {
        return 0.0;
    }
    let stiffness = 1.0 / law.compliance;
    let pull = |x: f64, u: f64| (stiffness * (x + law.damping * u)).max(0.0);
    let rate = |[x, u]: [f64; 2]| [u, G - pull(x, u) / MASS];
    let step = |s: [f64; 2], k: [f64; 2], h: f64| [s[0] + h * k[0], s[1] + h * k[1]];
    let fast = (stiffness / MASS).sqrt() + stiffness * law.damping / MASS;
    let h = (0.02 / fast).min(1e-4);
    let (mut state, mut largest, mut t) = ([0.0, speed], 0.0_f64, 0.0);
    while t < 0.3 && state[1] > 0.0 {
        let a = rate(state);
        let b = rate(step(state, a, 0.5 * h));
        let c = rate(step(state, b, 0.5 * h));
        let d = rate(step(state, c, h));
        state = [0, 1].map(|i| state[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        largest = largest.max(state[0]);
        t += h;
    }
    largest
}

/// The largest stretch, after which no force came while the rope was slack at both ends of a step.
fn caught(law: RowLaw, speed: f64, dt: f64) -> f64 {
    let time = 0.05;
    let (scene, slack) = falling(law, speed, time);
    let mut stepper = Stepper::new(scene, options(dt, 1)).unwrap();
    let (mut largest, mut before) = (0.0_f64, f64::NEG_INFINITY);
    while stepper.time() < time + 0.3 - 0.5 * dt {
        stepper.step().unwrap();
        let x = -stepper.scene().bodies.position[0].z - slack;
        let tension = stepper.tension(0).unwrap();
        let is_slack = before.max(x) < -1e-12;
        let holds = !is_slack || tension == 0.0;
        assert!(holds, "{law:?}, {speed}: {tension} N at {x}");
        (largest, before) = (largest.max(x), x);
    }
    largest
}

#[test]
fn a_damped_rope_catches_a_load_where_it_is_taut() {
    for damping in [0.02, 0.05, 0.3, 0.5, 5.0] {
        for compliance in [0.0, 1e-6, 3e-5, 1e-4] {
            for speed in [0.3, 1.0, 5.0, 20.0] {
                let law = RowLaw::new(compliance, damping);
                let exact = largest_stretch(law, speed);
                let error = |dt| (caught(law, speed, dt) - exact).abs();
                let errors = [DT, DT / 4.0, DT / 16.0].map(error);
                let what = format!("{law:?}, {speed} m/s: {errors:?} of {exact}");
                assert!(errors[2] < 1e-3 * (1.0 + exact), "{what}");
                // First order, as soon as the stretch exceeds the path of one step.
                for (error, dt) in errors.into_iter().zip([DT, DT / 4.0, DT / 16.0]) {
                    assert!(error < 0.3 * speed * dt + 1e-5, "{what}");
                }
            }
        }
    }
}

/// A cube of 1 m over the ground.
fn grounded(scene: &mut Scene, mass: f64, at: Vector3<f64>) -> usize {
    scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
    add_box(scene, at, mass, Surface::default())
}

/// A hook on a rope over a sheave with friction, which a load under it takes down to the ground and up again.
fn set_down(law: RowLaw, friction: f64) -> Scene {
    let mut scene = on_earth("set-down");
    let hook = ball(&mut scene, 20.0, Vector3::new(0.2, 0.0, 5.0));
    let load = grounded(&mut scene, 800.0, Vector3::new(0.2, 0.0, 0.7));
    let top = Frame::body(load, Vector3::z() * 0.5);
    let sling = vec![hook, top];
    rope(&mut scene, sling, 3.8 + 1e-4, law);
    let frames = vec![
        Frame::world(Vector3::new(-4.0, 0.0, 9.8)),
        Frame::world(Vector3::new(0.0, 0.0, 10.0)).along(&Vector3::y()),
        hook,
    ];
    let mut cable = over(sheave(friction, 0.2), frames, 1.0, law);
    cable.winch = Some(Winch::new());
    cable.length = cable_length(&scene, &cable) - 0.002;
    scene.reeve("hoist", &cable, 0).unwrap();
    scene
}

/// Friction against the slip, tensions at the limit only where the rope slips, and at rest the lengths of its law.
#[test]
fn a_damped_rope_over_a_sheave_goes_on_to_slip_when_its_load_is_set_down() {
    for damping in [0.0, 0.05, 0.5] {
        for friction in [0.02, 0.1, 0.3] {
            let law = RowLaw::new(3e-7, damping);
            let mut stepper = Stepper::new(set_down(law, friction), options(DT, 1)).unwrap();
            let parts = ["hoist", "hoist-2"].map(|name| stepper.scene().constraint(name).unwrap());
            let mut slipped = [0.0; 2];
            for (stage, speed) in [0.3, 0.0, -0.3, 0.0].into_iter().enumerate() {
                let winch = winch(speed);
                stepper.set_winch(parts[0], winch).unwrap();
                for step in 0..180 {
                    stepper.step().unwrap();
                    let [before, after] = parts.map(|c| stepper.tension(c).unwrap());
                    let slip = stepper.slip_rates().next().unwrap();
                    let work = (after - before) * slip;
                    let what = format!("τ {damping}, μ {friction}, {stage}, {step}");
                    assert!(work > -1e-6, "{what}: {before} N, {after} N, {slip} m/s");
                    slipped[usize::from(stage > 1)] += slip.abs() * DT;
                }
                let rows = stepper.linearized();
                let gaps = parts.map(|c| {
                    let r = rows.row_range(c).start;
                    let tension = stepper.tension(c).unwrap();
                    let stretch = rows.compliance[r] * tension;
                    if tension > 0.0 {
                        rows.phi[r] - stretch
                    } else {
                        rows.phi[r].max(0.0)
                    }
                });
                // Dampers come to rest in a few of their times.
                let bar = if stage % 2 == 0 {
                    f64::INFINITY
                } else {
                    1e-4 * (1.0 + 100.0 * damping)
                };
                let held = gaps.iter().all(|gap| gap.abs() < bar);
                assert!(held, "τ {damping}, μ {friction}, {stage}: {gaps:?}");
            }
            let all_hold = slipped.iter().all(|way| *way > 0.3);
            assert!(all_hold, "τ {damping}, μ {friction}: {slipped:?}");
        }
    }
}
