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
