//! Drives that are set between steps.

use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;
const G: f64 = 9.81;

fn stepper(text: &str, dt: f64) -> Stepper {
    let source = SceneSource::parse(text, &[]).expect("reads");
    let options = StepOptions::default().with(|o| o.dt = dt);
    Stepper::new(source.build().expect("builds"), options).expect("starts")
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
            let rise = 1.5_f64.powi(2) / (2.0 * G);
            let missed = G * DT * DT / 8.0;
            let what = format!("{stretch} m/N, by control {by_control}: {highest} m of {rise} m");
            assert!((highest - rise).abs() < 0.02 * rise + missed, "{what}");
        }
    }
}

/// A table of a control stalled the winch before each step, and one that was too weak from the start threw its load up.
#[test]
fn a_winch_at_the_end_of_its_drum_hauls_what_it_can() {
    for (mass, limit, dt) in [
        (1000.0, 1.05, DT),
        (10.0, 2.0, DT / 4.0),
        (1e6, 1.5, DT),
        (10.0, 0.5, DT),
        (1000.0, 0.99, DT / 16.0),
    ] {
        for stretch in [0.0, 1e-5 / mass] {
            // What is left of the limit accelerates the load.
            let delay = 0.5 * 0.5 / (G * (limit - 1.0));
            let (limit, weak) = (limit * mass * G, limit < 1.0);
            let text = format!(
                "load = 'load'\n[[body]]\nname = 'load'\nmass = {mass:?}\nshape = 'particle'\n\
                 position = [0, 0, {:?}]\n\
                 [[massless_cable]]\nname = 'rope'\nthrough = [{{ body = 'world', point = [0, 0, 10] }}, {{ body = 'load' }}]\n\
                 length = 6\nstretch = {stretch:e}\nwinch = {{ longest = 6, force_limit = {limit:?}, speed = {} }}\n\
                 [[control]]\nname = 'haul'\ndrives = [{{ joint = 'rope' }}]\n",
                4.0 - stretch * mass * G,
                if weak { "-5" } else { "0" }
            );
            let mut stepper = stepper(&text, dt);
            let start = stepper.scene().bodies.position[0].z;
            let mut highest: f64 = 0.0;
            while stepper.time() < 2.0 - 0.5 * dt {
                if !weak {
                    stepper.set_control(0, -0.5).expect("a control");
                }
                stepper.step().expect("a step");
                highest = highest.max(stepper.tension(0).expect("a rope"));
            }
            let risen = stepper.scene().bodies.position[0].z - start;
            let what =
                format!("{mass} kg, {limit} N, {dt} s, {stretch} m/N: {risen} m, {highest} N");
            if weak {
                assert!(risen.abs() < 1e-3 && highest < 1.2 * mass * G, "{what}");
            } else {
                let exact = 0.5 * (2.0 - delay);
                assert!((risen - exact).abs() < 0.5 * DT, "{what} of {exact} m");
                assert!(highest < limit * (1.0 + 1e-9), "{what}");
            }
        }
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
