//! Contacts beside motors and ropes: what one solves for the other must not undo.

use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;

pub(super) fn stepper(text: &str, dt: f64) -> Stepper {
    weighed(text, dt, None)
}

/// A run that ends where it gains more energy than this part of its own.
pub(super) fn weighed(text: &str, dt: f64, energy_tolerance: Option<f64>) -> Stepper {
    let source = SceneSource::parse(text, &[]).expect("reads");
    let scene = source.build().expect("builds");
    let options =
        StepOptions::default().with(|o| (o.dt, o.energy_tolerance) = (dt, energy_tolerance));
    Stepper::new(scene, options).expect("starts")
}

/// A cart of `mass` with a wheel in front and one behind, whose brakes hold half of what friction does.
fn braked(mass: f64, wheel: f64, speed: f64) -> String {
    let radius = 0.3;
    let torque = 0.5 * 0.6 * (mass + 2.0 * wheel) * 9.81 / 2.0 * radius;
    let spin = speed / radius;
    let wheels = [1.0, -1.0].map(|x| {
        format!(
            "[[body]]\nname = 'w{x}'\nmass = {wheel}\nshape = {{ cylinder = {{ length = 0.8, radius = {radius} }} }}\n\
             position = [{x}, 0, {radius}]\nrotation = [-1.5707963267948966, 0, 0]\nvelocity = [{speed}, 0, 0]\n\
             angular_velocity = [0, {spin}, 0]\ncollide = {{ friction = 0.6 }}\n\
             [[joint]]\nname = 'j{x}'\nkind = 'hinge'\na = 'cart'\nb = 'w{x}'\npoint = [{x}, 0, {radius}]\naxis = [0, 1, 0]\n\
             motor = {{ speed = 0, force_limit = {torque} }}\n"
        )
    });
    format!(
        "gravity = [0, 0, -9.81]\nload = 'cart'\n[[ground]]\nname = 'ground'\nfriction = 0.6\n\
         [[body]]\nname = 'cart'\nmass = {mass}\nshape = {{ box = {{ size = [3, 1, 0.2] }} }}\nposition = [0, 0, {radius}]\n\
         velocity = [{speed}, 0, 0]\n{}",
        wheels.concat()
    )
}

/// A brake at its limit drives a light wheel by τ Δt/I a step when it is left on the wrong side: 834 rad/s here.
#[test]
fn braked_wheels_come_to_rest() {
    for (mass, wheel, speed) in [(1e5, 5.0, 5.0), (1e4, 5.0, 1.0), (1e6, 1.0, 2.0)] {
        for rate in [60.0, 240.0] {
            let mut stepper = stepper(&braked(mass, wheel, speed), 1.0 / rate);
            let deceleration = 0.5 * 0.6 * 9.81;
            let steps = ((speed / deceleration + 0.3) * rate) as usize;
            for step in 0..steps {
                stepper.step().expect("a step");
                for &body in &[1, 2] {
                    let spin = stepper.scene().bodies.angular_velocity[body].norm();
                    let holds = spin <= 1.01 * speed / 0.3;
                    assert!(holds, "{mass} kg, {rate}/s, step {step}: {spin} rad/s");
                }
            }
            let left = stepper.scene().bodies.velocity[0].norm();
            assert!(left < 1e-3, "{mass} kg, {rate}/s: {left} m/s");
        }
    }
}

/// A plate that is light beside what falls on it bounces with that on its ropes, and must not divide each step.
#[test]
fn a_heavy_ball_on_a_light_plate_in_ropes_gains_nothing() {
    let ropes = [(1.0, 0.5), (1.0, -0.5), (-1.0, 0.5), (-1.0, -0.5)].map(|(x, y)| {
        format!(
            "[[massless_cable]]\nname = 'r{x}{y}'\nstretch = 1e-8\n\
             through = [{{ body = 'world', point = [{x}, {y}, 3] }}, {{ body = 'plate', point = [{x}, {y}, 0.05] }}]\n"
        )
    });
    for (mass, rate) in [(3000.0, 120.0), (3000.0, 240.0), (300.0, 240.0)] {
        let text = format!(
            "load = 'ball'\n[[body]]\nname = 'plate'\nmass = 1\nshape = {{ box = {{ size = [2, 1, 0.1] }} }}\n\
             position = [0, 0, -0.05]\ncollide = {{ friction = 0.3 }}\n\
             [[body]]\nname = 'ball'\nmass = {mass}\nshape = {{ sphere = {{ radius = 0.1 }} }}\nposition = [0, 0, 1.1]\n\
             collide = {{ friction = 0.3 }}\n{}",
            ropes.concat()
        );
        let mut stepper = stepper(&text, 1.0 / rate);
        let begun = stepper.energy().total();
        for step in 0..rate as usize {
            stepper.step().expect("a step");
            let gained = stepper.energy().total() - begun;
            // As a part of the fall's m g h, h = 1 m.
            let of_fall = gained / (mass * 9.81);
            let holds = of_fall < 0.02;
            assert!(holds, "{mass} kg, {rate}/s, step {step}: {of_fall}");
        }
    }
}

/// A light load above its guide point, which a heavy one hauls through it: a rope that is slack by the direction before the point
/// is taut by the one behind, and must not stay slack for good.
#[test]
fn a_rope_whose_end_passes_its_guide_point_still_pulls() {
    let text = "load = 'b'\n[[body]]\nname = 'a'\nmass = 1\nshape = { sphere = { radius = 0.1 } }\nposition = [0, 0, 7]\n[[body]]\nname = 'b'\nmass = 30\nshape = { sphere = { radius = 0.1 } }\nposition = [1, 0, -1]\n\
                [[massless_cable]]\nname = 'rope'\nstretch = 0\nthrough = [{ body = 'a' }, { body = 'world', point = [0, 0, 5] }, \
                { body = 'world', point = [1, 0, 5] }, { body = 'b' }]\n";
    for rate in [60.0, 240.0] {
        let mut stepper = stepper(text, 1.0 / rate);
        for step in 0..(2.0 * rate) as usize {
            stepper.step().expect("a step");
            let [a, b] = [0, 1].map(|body| stepper.scene().bodies.position[body]);
            let path = (a.z - 5.0).hypot(a.x) + 1.0 + (b.z - 5.0).hypot(b.x - 1.0);
            assert!(path < 9.1, "{rate}/s, step {step}: {path} m of 9 m");
        }
    }
}

/// The law of impact holds for the relative velocity: without gravity a ball leaves a wall that comes towards it or goes away as it
/// leaves one at rest, whatever the part of a step in which they meet.
#[test]
fn a_moving_wall_throws_back_as_one_at_rest() {
    for (speed, restitution) in [
        (0.0, 1.0),
        (-1.0, 1.0),
        (-8.0, 1.0),
        (1.5, 1.0),
        (-4.0, 0.5),
    ] {
        for rate in [60.0, 120.0, 240.0, 960.0] {
            let text = format!(
                "load = 'ball'\ngravity = [0, 0, 0]\n[[body]]\nname = 'ball'\nmass = 5\nshape = {{ sphere = {{ radius = 0.1 }} }}\n\
                 velocity = [2, 0, 0]\ncollide = {{ restitution = {restitution}, friction = 0 }}\n\
                 [[body]]\nname = 'wall'\nmobility = 'driven'\nshape = {{ box = {{ size = [1, 2, 2] }} }}\n\
                 position = [1.311, 0, 0]\nvelocity = [{speed}, 0, 0]\ncollide = {{ friction = 0 }}\n"
            );
            let mut stepper = stepper(&text, 1.0 / rate);
            while stepper.time() < 1.5 {
                stepper.step().expect("a step");
            }
            let right = speed - restitution * (2.0 - speed);
            let off = (stepper.scene().bodies.velocity[0].x - right).abs();
            assert!(off < 1e-6, "wall at {speed} m/s, {rate}/s: {off} m/s");
        }
    }
}

/// The same of a load in a cabin that a winch hoists on a rigid rope.
#[test]
fn a_load_bounces_in_a_cabin_that_is_hoisted() {
    let apex = |speed: f64, rate: f64| {
        let text = format!(
            "load = 'load'\n[[body]]\nname = 'cabin'\nmass = 5000\nshape = {{ box = {{ size = [2, 2, 0.2] }} }}\nposition = [0, 0, -0.1]\n\
             velocity = [0, 0, {speed}]\ncollide = true\n[[body]]\nname = 'load'\nmass = 50\nshape = {{ sphere = {{ radius = 0.2 }} }}\n\
             position = [0, 0, 0.5]\nvelocity = [0, 0, {speed}]\ncollide = {{ restitution = 0.8 }}\n\
             [[massless_cable]]\nname = 'rope'\nstretch = 0\n\
             through = [{{ body = 'world', point = [0, 0, 30] }}, {{ body = 'cabin', point = [0, 0, 0.1] }}]\nwinch = {{ speed = {} }}\n",
            -speed
        );
        let mut stepper = weighed(&text, 1.0 / rate, Some(0.04));
        let fall = (2.0 * 0.3 / 9.81_f64).sqrt();
        let mut highest = 0.0_f64;
        while stepper.time() < 1.7 * fall {
            stepper.step().expect("a step");
            let [cabin, load] = [0, 1].map(|body| stepper.scene().bodies.position[body].z);
            if stepper.time() > fall + 2.0 / rate {
                highest = highest.max(load - cabin - 0.3);
            }
        }
        highest
    };
    for rate in [60.0, 240.0] {
        for speed in [0.0, 2.0, 4.0, -3.0] {
            let (right, apex) = (0.8_f64.powi(2) * 0.3, apex(speed, rate));
            let off = (apex / right - 1.0).abs();
            assert!(off < 0.02, "{speed} m/s, {rate}/s: {apex} m of {right} m");
        }
    }
}

#[test]
fn a_body_at_its_resting_depth_rests() {
    for compliance in [1e-7, 1e-6, 1e-5] {
        for rate in [60.0, 240.0, 960.0] {
            let depth = 1000.0 * 9.81 * compliance;
            let text = format!(
                "load = 'load'\n[[body]]\nname = 'load'\nmass = 1000\nshape = {{ sphere = {{ radius = 0.5 }} }}\nposition = [0, 0, {}]\n\
                 collide = {{ compliance = {compliance}, damping = 1e-3 }}\n[[ground]]\nname = 'ground'\ncompliance = 0\ndamping = 0\n",
                0.5 - depth
            );
            let mut stepper = stepper(&text, 1.0 / rate);
            for step in 0..rate as usize {
                stepper.step().expect("a step");
                let lifted = stepper.scene().bodies.position[0].z - 0.5 + depth;
                let holds = lifted.abs() < 1e-9;
                assert!(holds, "{compliance} m/N, {rate}/s, step {step}: {lifted} m");
                let force: f64 = stepper.contacts().map(|c| c.force.z).sum();
                let holds = (force / 9810.0 - 1.0).abs() < 1e-6;
                assert!(holds, "{compliance} m/N, {rate}/s, step {step}: {force} N");
            }
        }
    }
}

/// A load that bounces with e = 1 under a cable that swings within the step, whose brake has let it down on the ground: each bounce
/// gained Ω²/3 of its energy, of 3 J.
#[test]
fn a_load_that_bounces_under_an_elastic_cable_gains_nothing() {
    for (mass, segments, room, rate) in [
        (100.0, 5, 0.01, 120.0),
        (100.0, 24, 0.01, 120.0),
        (50.0, 3, 0.05, 120.0),
    ] {
        let text = format!(
            "load = 'load'\n[[body]]\nname = 'load'\nmass = {mass}\nshape = {{ sphere = {{ radius = 0.25 }} }}\nposition = [0, 0, 0]\n\
             velocity = [0.05, 0, 0]\ncollide = {{ friction = 0.5, restitution = 1 }}\n\
             [[ground]]\nname = 'ground'\npoint = [0, 0, {}]\nfriction = 0.5\nrestitution = 1\n\
             [[cable]]\nname = 'rope'\nfrom = {{ body = 'world', point = [0, 0, 3.25] }}\nto = {{ body = 'load', point = [0, 0, 0.25] }}\n\
             segments = {segments}\nea = {}\nei = 9.81\ngj = 9.81\nmass_per_length = 0.1\ndamping = 0\n\
             winch = {{ since = 0, brake = true, brake_limit = {} }}\n",
            -0.25 - room,
            9810.0 * mass,
            9.810_981 * mass
        );
        let mut stepper = stepper(&text, 1.0 / rate);
        let (mut settled, mut later) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        while stepper.time() < 4.0 {
            stepper.step().expect("a step");
            let energy = stepper.energy().total();
            match stepper.time() {
                0.5..1.0 => settled = settled.max(energy),
                1.0.. => later = later.max(energy),
                _ => {}
            }
        }
        let holds = later < settled + 0.3;
        assert!(holds, "{mass} kg: {settled} J, then {later} J");
    }
}

/// Slip that stays undecided while contacts are still sought is no fault of a step whose last solve has decided it.
#[test]
fn a_rope_that_slips_under_a_bouncing_load_is_decided() {
    let text = "load = 'load'\n[[body]]\nname = 'load'\nmass = 50\nshape = { sphere = { radius = 0.25 } }\nposition = [0, 0, 0]\n\
                collide = { friction = 0.5, restitution = 0.6 }\n[[ground]]\nname = 'ground'\npoint = [0, 0, -0.45]\nfriction = 0.5\nrestitution = 0.6\n\
                [[massless_cable]]\nname = 'rope'\nstretch = 6.1e-6\nlength = 6.3178284\nwinch = { speed = 0.1, force_limit = 245.25 }\n\
                through = [{ body = 'world', point = [-3.2, 0, 3.25] }, { body = 'world', point = [-0.2, 0, 3.25], sheave = \
                { radius = 0.2, axis = [0, 1, 0], friction = 0.1 } }, { body = 'load', point = [0, 0, 0.25] }]\n";
    let mut stepper = stepper(text, 1.0 / 960.0);
    for step in 0..1920 {
        let report = stepper.step().expect("a step");
        assert_eq!(report.undecided, 0, "step {step}");
    }
}

/// The motor of a slider pays for what it bats away, whatever the part of the step in which they meet.
#[test]
fn a_motor_pays_for_what_its_plate_throws_back() {
    for place in [0.3, 0.32, 0.34, 0.36] {
        for rate in [60.0, 240.0] {
            let text = format!(
                "load = 'ball'\ngravity = [0, 0, 0]\n[[body]]\nname = 'plate'\nmass = 1\nshape = {{ box = {{ size = [0.1, 1, 1] }} }}\n\
                 velocity = [4, 0, 0]\ncollide = {{ friction = 0 }}\n[[body]]\nname = 'ball'\nmass = 1\nshape = {{ sphere = {{ radius = 0.1 }} }}\n\
                 position = [{place}, 0, 0]\ncollide = {{ restitution = 1, friction = 0 }}\n\
                 [[joint]]\nname = 'way'\nkind = 'slider'\na = 'world'\nb = 'plate'\npoint = [0, 0, 0]\naxis = [1, 0, 0]\nmotor = {{ speed = 4 }}\n"
            );
            let mut stepper = weighed(&text, 1.0 / rate, Some(0.02));
            while stepper.time() < 0.5 {
                stepper
                    .step()
                    .unwrap_or_else(|e| panic!("{place} m, {rate}/s: {e}"));
            }
            let v = stepper.scene().bodies.velocity[1].x;
            assert!((v - 8.0).abs() < 1e-6, "{place} m, {rate}/s: {v} m/s");
        }
    }
}

/// A load that a drum hauls flies on by v²/2g where the drum's motor is stopped at once.
#[test]
fn a_load_flies_on_from_a_drum_that_is_stopped() {
    for stretch in [0.0, 1e-7] {
        for by_control in [true, false] {
            let text = format!(
                "load = 'load'\n[[body]]\nname = 'load'\nmass = 300\nshape = {{ sphere = {{ radius = 0.2 }} }}\nposition = [0.3, 0, -6]\n\
                 velocity = [0, 0, 1.5]\n[[body]]\nname = 'drum'\nmass = 200\nshape = {{ cylinder = {{ length = 0.6, radius = 0.3 }} }}\n\
                 rotation = [1.5707963267948966, 0, 0]\nangular_velocity = [0, -5, 0]\n\
                 [[joint]]\nname = 'axle'\nkind = 'hinge'\na = 'world'\nb = 'drum'\npoint = [0, 0, 0]\naxis = [0, 1, 0]\nmotor = {{ speed = -5 }}\n\
                 [[massless_cable]]\nname = 'rope'\nstretch = {stretch}\nslack = 0\n\
                 through = [{{ body = 'drum', sheave = {{ radius = 0.3, axis = [0, 0, -1], turns = 5.25 }} }}, {{ body = 'load' }}]\n\
                 [[control]]\nname = 'hoist'\ndrives = [{{ joint = 'axle' }}]\n"
            );
            let mut stepper = stepper(&text, DT);
            taut_tests::steps(&mut stepper, 30);
            let below = stepper.scene().bodies.position[0].z;
            if by_control {
                stepper.set_control(0, 0.0).expect("a control");
            } else {
                let axle = stepper.scene().constraint("axle").expect("a joint");
                stepper.set_motor(axle, Motor::speed(0.0)).expect("a motor");
            }
            let mut highest = f64::NEG_INFINITY;
            for _ in 0..30 {
                stepper.step().expect("a step");
                highest = highest.max(stepper.scene().bodies.position[0].z - below);
            }
            let rise = 1.5_f64.powi(2) / (2.0 * 9.81);
            let missed = 9.81 * DT * DT / 8.0;
            let what = format!("{stretch} m/N, by control {by_control}: {highest} m of {rise} m");
            assert!((highest - rise).abs() < 0.02 * rise + missed, "{what}");
        }
    }
}

/// A load that leaves its rope's natural length at 3 m/s is caught within the first step, and an undamped rope throws it back to
/// v²/2g. Rows that began with φ = 0 counted as taut, and stiff ones lost all of the rebound.
#[test]
fn a_rope_that_begins_at_its_natural_length_throws_its_load_back() {
    for (mass, stretch) in [
        (100.0, 1e-6),
        (100.0, 1e-7),
        (100.0, 1e-8),
        (1e4, 1e-10),
        (1.0, 1e-6),
    ] {
        let text = format!(
            "load = 'b'\n[[body]]\nname = 'b'\nmass = {mass}\nshape = 'particle'\nposition = [0, 0, -5]\nvelocity = [0, 0, -3]\n\
             [[massless_cable]]\nname = 'rope'\nthrough = [{{ body = 'world' }}, {{ body = 'b' }}]\nstretch = {stretch}\n"
        );
        let mut stepper = stepper(&text, DT);
        let mut highest = f64::NEG_INFINITY;
        while stepper.time() < 0.6 {
            stepper.step().expect("a step");
            highest = highest.max(stepper.scene().bodies.position[0].z + 5.0);
        }
        let exact = 9.0 / (2.0 * 9.81);
        let holds = (highest / exact - 1.0).abs() < 0.01;
        assert!(holds, "{mass} kg, {stretch} m/N: {highest} of {exact} m");
    }
}

/// Controls that are set at one time act together: neither their order nor a value that another one replaces moves anything.
#[test]
fn speeds_set_at_one_time_know_nothing_of_each_other() {
    let load = |name: &str, x: f64| {
        format!(
            "[[body]]\nname = '{name}'\nmass = 100\nshape = {{ sphere = {{ radius = 0.2 }} }}\nposition = [{x}, 0, -5]\n\
             [[massless_cable]]\nname = 'rope-{name}'\nthrough = [{{ body = 'world', point = [{x}, 0, 0] }}, {{ body = '{name}' }}]\n\
             tension = 981\nstretch = 1e-6\nwinch = {{}}\n\
             [[control]]\nname = 'hoist-{name}'\ndrives = [{{ joint = 'rope-{name}', gain = -1 }}]\n"
        )
    };
    let scene = format!("load = 'b'\n{}{}", load("b", 0.0), load("c", 3.0));
    let after = |settings: &[(usize, f64)]| {
        let mut stepper = stepper(&scene, DT);
        for step in 0..30 {
            if step == 6 {
                for (control, value) in settings {
                    stepper.set_control(*control, *value).expect("a control");
                }
            }
            stepper.step().expect("a step");
        }
        [0, 1].map(|i| stepper.scene().bodies.position[i].z + 5.0)
    };
    for value in after(&[(0, 5.0), (0, 0.0)]) {
        assert!(value.abs() < 1e-9, "{value} m");
    }
    let (one, other) = (after(&[(0, 0.5), (1, -0.5)]), after(&[(1, -0.5), (0, 0.5)]));
    let alone = after(&[(0, 0.5)]);
    let order = [0, 1].map(|i| (one[i] - other[i]).abs());
    assert!(order.iter().all(|off| *off < 1e-12), "{one:?}, {other:?}");
    // The other rope divides its steps.
    assert!((one[0] - alone[0]).abs() < 1e-6, "{one:?}, {alone:?} m");
}

/// A rope over two sheaves with friction that begins at its natural length: rounding made some of its parts slack and others taut,
/// and what was slack took no rope from what was not.
#[test]
fn parts_of_a_rope_are_slack_together() {
    for (mass, friction, speed) in [(10.0, 0.3, 0.68), (10.0, 0.1, 1.5), (5.0, 0.2, 1.0)] {
        for (dt, x) in [(DT, 0.3), (DT, 0.31), (DT / 4.0, 0.3), (DT / 16.0, 0.3)] {
            let text = format!(
                "load = 'A'\n[[body]]\nname = 'A'\nmass = {mass}\nshape = 'particle'\nposition = [{x}, 0, -4.9957]\nvelocity = [0, 0, {speed}]\n\
                 [[body]]\nname = 'B'\nmass = 3\nshape = 'particle'\nposition = [-2.3, 0, -4]\n\
                 [[massless_cable]]\nname = 'rope'\nstretch = 6.5e-6\nthrough = [{{ body = 'A' }}, \
                 {{ body = 'world', sheave = {{ radius = 0.3, axis = [0, -1, 0], friction = {friction} }} }}, \
                 {{ body = 'world', point = [-2, 0, 0], sheave = {{ radius = 0.3, axis = [0, -1, 0], friction = {friction} }} }}, \
                 {{ body = 'B' }}]\n"
            );
            let mut stepper = weighed(&text, dt, Some(0.02));
            while stepper.time() < 0.8 {
                if let Err(error) = stepper.step() {
                    panic!("{mass} kg, μ {friction}, x {x}, {dt} s: {error}");
                }
                let parts = stepper.scene().parts_of(0);
                let tensions: Vec<f64> = parts.filter_map(|part| stepper.tension(part)).collect();
                let taut = tensions.iter().filter(|tension| **tension > 1e-9).count();
                assert!(taut == 0 || taut == tensions.len(), "{tensions:?} N");
            }
        }
    }
}

/// The balance of a run whose first step is divided begins with that step: a plate at constant speed does m v² of work as it takes
/// its load along, half of which the blow dissipates, and lifts it.
#[test]
fn a_divided_first_step_is_balanced() {
    let text = "load = 'B'\n[[body]]\nname = 'B'\nmass = 1\nshape = { box = { size = [0.4, 0.4, 0.4] } }\nposition = [0, 0, 0.3]\n\
                collide = { friction = 0, restitution = 0 }\n\
                [[body]]\nname = 'plate'\nmobility = 'driven'\nshape = { box = { size = [0.8, 0.8, 0.2] } }\nvelocity = [0, 0, 2]\n\
                collide = { friction = 0, restitution = 0 }\n\
                [[massless_cable]]\nname = 'rope'\nthrough = [{ body = 'world', point = [0, 0, 5] }, { body = 'B' }]\nlength = 4.7\nstretch = 0\n";
    let mut stepper = weighed(text, DT, Some(1e-2));
    let mut work = 0.0;
    for step in 0..30 {
        let report = stepper.step().expect("a step");
        assert!(step > 0 || report.divided > 0, "{report:?}");
        work = report.balance.expect("is weighed").work;
    }
    let body = &stepper.scene().bodies;
    let exact = body.velocity[0].norm_squared() + 9.81 * (body.position[0].z - 0.3);
    assert!((work / exact - 1.0).abs() < 0.03, "{work} of {exact} J");
}
