use crate::testing::*;

/// A body that is held to the world's origin by a ball joint at `point` of it.
fn pendulum(body: Body, point: Vector3<f64>) -> Scene {
    let mut scene = Scene::new("pendulum");
    scene.gravity = Vector3::z() * -9.81;
    let i = scene.add_body("body", body);
    let frames = [origin(), Frame::body(i, point)];
    let stretch = RowLaw::new(1e-9, 0.0);
    let joint = Constraint::Spherical(Spherical { frames, stretch });
    scene.add_constraint("pin", joint, 0);
    scene
}

/// A bob on 1 m that swings over the top at 8 m/s, one that circles, and a top at 50 rad/s.
fn fast() -> [Scene; 3] {
    let bob = |at: Vector3<f64>, rate: Vector3<f64>| {
        let mut scene = pendulum(Body::sphere(0.05, 100.0).at(at), -at);
        scene.bodies.velocity[0] = rate.cross(&at);
        scene.bodies.angular_velocity[0] = rate;
        scene
    };
    let inertia = Matrix3::from_diagonal(&Vector3::new(0.02, 0.02, 0.03));
    let mut top = pendulum(Body::new(2.0, inertia), Vector3::z() * -0.4);
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.6, 0.0);
    top.bodies.orientation[0] = turn;
    top.bodies.position[0] = turn * Vector3::z() * 0.4;
    top.bodies.angular_velocity[0] = turn * Vector3::z() * 50.0;
    [
        bob(-Vector3::z(), Vector3::y() * -8.0),
        bob(Vector3::x(), Vector3::z() * 8.0),
        top,
    ]
}

/// Place of the body after 2 s, the energy \[J] that it lost, and the error that the run estimated.
fn run(scene: &Scene, substeps: usize) -> (Vector3<f64>, f64, f64) {
    let options = StepOptions::default().with(|o| (o.substeps, o.estimate) = (substeps, Some(2)));
    let mut stepper = Stepper::new(scene.clone(), options).unwrap();
    let energy = |scene: &Scene| scene.kinetic_energy() + scene.potential_energy();
    let mut estimate = 0.0;
    for _ in 0..120 {
        let report = stepper.step().unwrap();
        assert_eq!(report.implicit_substeps, 0, "t = {}", stepper.time());
        estimate = report.error.unwrap().total();
    }
    let after = stepper.scene();
    let lost = energy(scene) - energy(after);
    (after.bodies.position[0], lost, estimate)
}

#[test]
fn what_turns_fast_is_not_braked_and_the_estimate_sees_its_error() {
    for scene in fast() {
        let (exact, _, _) = run(&scene, 64);
        let (place, lost, estimate) = run(&scene, 1);
        let error = (place - exact).norm();
        assert!(lost.abs() < 0.01 * scene.kinetic_energy(), "{lost} J");
        assert!(error < 0.1, "{error} m");
        let within = (0.3 * error..20.0 * error).contains(&estimate);
        assert!(within, "{estimate} m of {error} m");
    }
}

/// A load that falls into its rope, which run and coarse run divided into parts of one length: 4·10⁻⁹ mm estimated of 60 mm.
#[test]
fn the_estimate_sees_the_error_of_a_stiff_catch() {
    for (mass, compliance) in [(3.0, 3e-7), (30.0, 3e-8), (10.0, 1e-6)] {
        let mut scene = Scene::new("catch");
        scene.gravity = Vector3::z() * -9.81;
        let load = Body::particle(mass).at(-Vector3::z() * 4.2);
        let load = scene.add_body("load", load);
        let frames = vec![origin(), centre(load)];
        let rope = MasslessCable::new(frames, 5.0, RowLaw::new(compliance, 0.0));
        scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
        let (exact, _, _) = run(&scene, 64);
        let (place, _, estimate) = run(&scene, 1);
        let error = (place - exact).norm();
        let within = (0.3 * error..20.0 * error).contains(&estimate);
        assert!(
            within,
            "{mass} kg, {compliance} m/N: {estimate} m of {error} m"
        );
    }
}

#[test]
fn a_motor_that_holds_an_angle_refuses_more_than_half_a_turn_a_step() {
    let mut scene = Scene::new("wheel");
    let i = scene.add_body("wheel", Body::sphere(0.2, 5.0));
    scene.bodies.angular_velocity[i].x = 250.0;
    let motor = Motor {
        target: Target::Position(1.0),
        force_limit: 5.0,
        law: RowLaw::RIGID,
    };
    let frames = [origin(), centre(i)];
    let axle = Constraint::Hinge(Hinge::new(frames).driven(motor));
    scene.add_constraint("axle", axle, 0);
    let first = |substeps| {
        let options = StepOptions::default().with(|o| o.substeps = substeps);
        Stepper::new(scene.clone(), options).unwrap().step()
    };
    let error = first(1).unwrap_err();
    let says = error.to_string().contains("`axle` turns by more");
    assert!(says, "{error}");
    assert!(first(4).is_ok());
}

/// A winch that pays out at once leaves its load in free fall from rest, until the rope is taut again: the load fell with the
/// velocity of half a step more. Over the time T in which the winch takes the static stretch out, the tension falls from the weight to
/// nothing, and gives the load ½ g T.
#[test]
fn what_hangs_on_a_rope_that_pays_out_falls_from_rest() {
    for (mass, compliance, substeps) in [(100.0, 1e-7, 1), (100.0, 1e-7, 4), (5e4, 1e-9, 1)] {
        let mut scene = Scene::new("paid out");
        scene.gravity = Vector3::z() * -9.81;
        let load = scene.add_body("load", Body::sphere(0.2, mass));
        let rope = MasslessCable {
            winch: Some(Winch::new()),
            ..MasslessCable::new(
                vec![Frame::world(Vector3::z() * 3.0), centre(load)],
                3.0,
                RowLaw::new(compliance, 0.0),
            )
        };
        let rope = scene.add_constraint("rope", rope, 0);
        scene.controls.push(Control::of("hoist", rope, 1.0));
        scene.start_in_equilibrium = true;
        let options = StepOptions::default().with(|o| o.substeps = substeps);
        let dt = options.dt;
        let winch = winch(1.0);
        for what in ["control", "drive", "winch", "brake"] {
            let mut scene = scene.clone();
            if let Constraint::MasslessCable(cable) = &mut scene.constraints[rope] {
                let brake = what == "brake";
                cable.winch = cable.winch.map(|winch| Winch { brake, ..winch });
            }
            let mut stepper = Stepper::new(scene, options.clone()).unwrap();
            let start = stepper.scene().bodies.position[0].z;
            stepper.step().unwrap();
            let set = match what {
                "control" => stepper.set_control(0, 1.0),
                "drive" => stepper.set_drive(0, 0, 1.0),
                _ => stepper.set_winch(rope, winch),
            };
            set.unwrap();
            for step in 1..=10 {
                stepper.step().unwrap();
                let t = f64::from(step) * dt;
                let slack_after = mass * 9.81 * compliance / 1.0;
                let held = 0.5 * 9.81 * slack_after * (t - slack_after / 3.0);
                let fall = 0.5 * 9.81 * t * t - held;
                let off = stepper.scene().bodies.position[0].z - (start - fall);
                let holds = off.abs() < 2e-4;
                assert!(holds, "{what} {mass} {substeps}: {off} m after {t} s");
            }
        }
    }
}
