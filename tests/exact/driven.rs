//! Bounds, motors, winches, driven bodies: against what mechanics says.

use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;
const G: f64 = 10.0;

fn scene(name: &str) -> Scene {
    let mut scene = Scene::new(name);
    scene.gravity = Vector3::new(0.0, 0.0, -G);
    scene
}

fn along(x: &Vector3<f64>) -> nalgebra::Matrix3<f64> {
    axes_along(x).expect("a direction")
}

/// A ball of `mass` on a massless cable from the origin, `excess` (m) shorter than the way down to the ball.
fn hung(mass: f64, excess: f64, winch: Option<Winch>) -> Scene {
    let mut scene = scene("hung");
    let ball = Body::sphere(0.1, mass).at(-Vector3::z() * 2.0);
    let ball = scene.add_body("ball", ball);
    scene.load = Some(ball);
    let frames = vec![origin(), centre(ball)];
    let cable =
        MasslessCable::new(frames, 2.0 - excess, RowLaw::new(1e-5, 0.0)).with(|p| p.winch = winch);
    scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    if winch.is_some() {
        let drives = vec![Drive {
            constraint: 0,
            gain: -1.0,
        }];
        scene.controls = vec![Control {
            name: "hoist".into(),
            drives,
        }];
    }
    scene
}

fn stepper(scene: Scene, choice: &Choice) -> Stepper {
    Stepper::new(scene, choice.options(DT)).expect("a stepper")
}

fn direct() -> Choice {
    "banded".parse().expect("a name")
}

fn height(stepper: &Stepper) -> f64 {
    stepper.scene().bodies.position[0].z
}

#[test]
fn a_slack_cable_lets_fall_freely_and_then_holds() {
    for choice in compiled() {
        let mut stepper = stepper(hung(3.0, -0.5, None), &choice);
        let mut lowest = 0.0_f64;
        for n in 1..=120_i32 {
            let report = stepper.step().expect("steps");
            assert_eq!(report.undecided, 0);
            let lambda = stepper.multipliers()[0] / DT;
            assert!(lambda <= 0.0, "{choice}: pushes with {lambda}");
            let fallen = -2.0 - G * DT * DT * f64::from(n * n) / 2.0;
            // Half a metre takes 0.316 s; starting velocities are half a step back.
            if n < 18 {
                assert_eq!(lambda, 0.0);
                let off = (height(&stepper) - fallen).abs();
                assert!(off < 1e-12, "{choice}: step {n}");
            }
            lowest = lowest.min(height(&stepper));
        }
        // It arrives with v² = 2 g · 0.5 m, unseen for up to a step; 1e5 N/m then stop 3 kg.
        let speed = G.sqrt();
        let overshoot = speed * DT + speed * (3.0_f64 / 1e5).sqrt();
        let below = -2.5 - lowest;
        let holds = below > 0.0 && below < overshoot;
        assert!(holds, "{choice}: {below} of {overshoot}");
    }
}

#[test]
fn a_winch_lifts_at_its_speed() {
    for choice in compiled() {
        let mut stepper = stepper(hung(100.0, 0.01, Some(Winch::new())), &choice);
        stepper.set_control(0, 0.25).expect("a control");
        let start = height(&stepper);
        taut_tests::steps(&mut stepper, 120);
        stepper.set_control(0, 0.0).expect("a control");
        taut_tests::steps(&mut stepper, 600);
        let risen = height(&stepper) - start;
        // It bounces about its rest, by a jerk of 0.25 m/s at 31.6 rad/s at most, and more compliant the longer it is.
        assert!((risen - 0.5).abs() < 0.01, "{choice}: {risen}");
    }
}

#[test]
fn a_winch_slips_at_its_force() {
    let winch = Winch::new().with(|w| (w.force_limit, w.brake_limit) = (900.0, 2000.0));
    for choice in compiled() {
        let mut scene = hung(100.0, 0.009, Some(winch));
        // At rest under the force that it holds.
        scene.bodies.velocity[0] = Vector3::zeros();
        let mut stepper = stepper(scene, &choice);
        for _ in 0..60 {
            stepper.step().expect("steps");
            let off = (stepper.multipliers()[0] / DT + 900.0).abs();
            assert!(off < 1e-9, "{choice}");
        }
        // (M g − F)/M = 1 m/s² for a second.
        let fallen = -2.0 - height(&stepper);
        assert!((fallen - 0.5).abs() < 1e-9, "{choice}: {fallen}");
        stepper
            .set_winch(0, winch.with(|w| w.brake = true))
            .expect("a winch");
        for _ in 0..600 {
            stepper.step().expect("steps");
            assert!(stepper.multipliers()[0] / DT >= -2000.0 - 1e-9, "{choice}");
        }
        let Constraint::MasslessCable(cable) = &stepper.scene().constraints[0] else {
            panic!("a cable");
        };
        // The brake takes v²/2a = 0.5·1/10 m with the 2000 N that it holds, less what stretches.
        let slipped = cable.length - (2.0 - 0.009) - 0.5;
        assert!(slipped > 0.0 && slipped < 0.06, "{choice}: {slipped}");
    }
}

#[test]
fn a_motor_drives_a_trolley_with_limited_force() {
    let mut scene = scene("trolley");
    let trolley = scene.add_body("trolley", Body::cuboid(Vector3::new(1.0, 0.5, 0.2), 50.0));
    let crane = scene.add_body("crane", Body::fixed());
    let axes = along(&Vector3::x());
    let at = |body| centre(body).with_axes(axes);
    let slider = Slider::new([at(crane), at(trolley)])
        .with(|p| p.motor = Some(Motor::speed(1.0).with(|p| p.force_limit = 100.0)));
    scene.add_constraint("rail", Constraint::Slider(slider), 0);
    for choice in compiled() {
        let mut stepper = stepper(scene.clone(), &choice);
        for n in 1..=60 {
            stepper.step().expect("steps");
            // 100 N on 50 kg for half a second, then the speed; the first half step is the start's.
            let speed = (2.0 * DT * (f64::from(n) - 0.5)).min(1.0);
            let v = stepper.scene().bodies.velocity[trolley];
            assert!((v.x - speed).abs() < 1e-9, "{choice}: step {n}: {v}");
            assert!(v.y.abs() + v.z.abs() < 1e-9, "{choice}");
            assert_eq!(stepper.scene().bodies.position[crane], Vector3::zeros());
        }
        assert!((stepper.multipliers()[5]).abs() < 1e-9, "{choice}");
    }
}

#[test]
fn a_position_motor_turns_a_hinge_to_its_target() {
    let mut scene = Scene::new("hinge");
    let arm = Body::cuboid(Vector3::new(0.2, 0.2, 1.0), 10.0).at(-Vector3::z() * 0.5);
    let arm = scene.add_body("arm", arm);
    let axes = along(&Vector3::y());
    let motor = Motor {
        target: Target::Position(7.0),
        force_limit: 20.0,
        law: RowLaw::new(1e-3, 0.3),
    };
    let hinge = Hinge {
        motor: Some(motor),
        ..Hinge::new([
            origin().with_axes(axes),
            Frame::body(arm, Vector3::z() * 0.5).with_axes(axes),
        ])
    };
    scene.add_constraint("hinge", Constraint::Hinge(hinge), 0);
    for choice in compiled() {
        let mut stepper = stepper(scene.clone(), &choice);
        let mut most = 0.0_f64;
        for _ in 0..600 {
            stepper.step().expect("steps");
            most = most.max(stepper.multipliers()[5].abs() / DT);
        }
        // More than a turn, and the force is what limits it on the way.
        let Constraint::Hinge(hinge) = &stepper.scene().constraints[0] else {
            panic!("a hinge");
        };
        let off = (hinge.angle_reference - 7.0).abs();
        assert!(off < 1e-6, "{choice}: {}", hinge.angle_reference);
        assert!((most - 20.0).abs() < 1e-9, "{choice}: {most}");
        let tip = stepper.scene();
        let tip = tip.bodies.point_world(arm, &(-Vector3::z() * 0.5));
        assert!((tip.norm() - 1.0).abs() < 1e-9, "{choice}");
    }
}

#[test]
fn a_driven_body_carries_and_feels_nothing() {
    let mut scene = scene("carrier");
    let mut carrier = Body::sphere(0.1, 1.0);
    carrier.mobility = Mobility::Driven;
    let carrier_speed = Vector3::x() * 0.6;
    carrier.velocity = carrier_speed;
    carrier.angular_velocity = Vector3::z() * 2.0;
    let carrier = scene.add_body("carrier", carrier);
    let mut load = Body::sphere(0.1, 1e4).at(-Vector3::z());
    load.velocity = carrier_speed;
    let load = scene.add_body("load", load);
    let link = Distance {
        frames: [carrier, load].map(centre),
        length: 1.0,
        law: RowLaw::RIGID,
        transverse: false,
    };
    scene.add_constraint("link", Constraint::Distance(link), 0);
    for choice in compiled() {
        let mut stepper = stepper(scene.clone(), &choice);
        taut_tests::steps(&mut stepper, 60);
        let bodies = &stepper.scene().bodies;
        // It hangs straight down at the speed of what it hangs on: rest in another frame.
        assert!((bodies.position[carrier].x - 0.6).abs() < 1e-13, "{choice}");
        let turned = bodies.orientation[carrier].scaled_axis() - Vector3::z() * 2.0;
        assert!(turned.norm() < 1e-13, "{choice}");
        let below = bodies.position[load] - bodies.position[carrier] + Vector3::z();
        assert!(below.norm() < 1e-9, "{choice}: {below}");
        stepper
            .set_velocity(carrier, Vector3::zeros(), Vector3::zeros())
            .expect("driven");
        assert!(
            stepper
                .set_velocity(load, Vector3::zeros(), Vector3::zeros())
                .is_err()
        );
    }
}

#[test]
fn what_cannot_be_set_is_refused() {
    let mut stepper = stepper(hung(1.0, 0.0, Some(Winch::new())), &direct());
    let says = |error: Result<(), taut_integrator::StepError>, words: &str| {
        let text = error.expect_err("refused").to_string();
        assert!(text.contains(words), "{text}");
    };
    says(
        stepper.set_control(1, 0.0),
        "control number 1, of 1, is not there",
    );
    says(stepper.set_control(0, f64::NAN), "control `hoist`");
    says(
        stepper.set_motor(0, Motor::speed(1.0)),
        "constraint `cable` has no motor",
    );
    let bad = Winch::new().with(|w| w.force_limit = -1.0);
    says(stepper.set_winch(0, bad), "winch.force_limit is -1");
    says(
        stepper.set_winch(7, Winch::new()),
        "constraint number 7, of 1, is not there",
    );
}
