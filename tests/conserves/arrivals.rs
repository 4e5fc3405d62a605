//! What meets in one step: shapes and ropes that arrive one after the other, drums at their end, blows that joints pass on.

use super::meeting::{stepper, weighed};
use taut_integrator::Stepper;

const DT: f64 = 1.0 / 60.0;
const G: f64 = 9.81;

/// A ball with this restitution, that falls by `height` to `clearance` above a floor of restitution 1.
fn ball(mass: f64, e: f64, clearance: f64, height: f64) -> String {
    format!(
        "load = 'ball'\n[[body]]\nname = 'ball'\nmass = {mass:?}\nshape = {{ sphere = {{ radius = 0.2 }} }}\n\
         position = [0, 0, {}]\ncollide = {{ restitution = {e:?} }}\n\
         [[ground]]\nname = 'floor'\nrestitution = 1\n",
        clearance + 0.2 + height
    )
}

/// Largest height of the ball's lowest point after it has fallen for `fall` (s).
fn rise(stepper: &mut Stepper, fall: f64) -> f64 {
    let mut highest = f64::NEG_INFINITY;
    while stepper.time() < 2.0 * fall {
        stepper.step().expect("a step");
        if stepper.time() > fall + 2.0 * DT {
            highest = highest.max(stepper.scene().bodies.position[0].z - 0.2);
        }
    }
    highest
}

/// A shape aimed at its rebound from a floor that a rope or a table above it kept it from.
#[test]
fn what_is_stopped_above_a_floor_does_not_rebound_from_it() {
    let rope = |length: f64| {
        format!(
            "[[massless_cable]]\nname = 'rope'\nstretch = 0\nlength = {length}\n\
             through = [{{ body = 'world', point = [0, 0, 10] }}, {{ body = 'ball' }}]\n"
        )
    };
    let table = |top: f64, e: f64| {
        format!(
            "[[collider]]\nname = 'table'\nbody = 'world'\nshape = {{ box = {{ size = [0.2, 0.2, 0.2] }} }}\n\
             position = [0, 0, {}]\nrestitution = {e:?}\n",
            top - 0.1
        )
    };
    for height in [1.5, 1.6, 1.73, 1.87, 2.0, 2.11] {
        let fall = (2.0_f64 * height / G).sqrt();
        for clearance in [0.002, 0.01, 0.03, 0.06] {
            for dt in [DT, DT / 4.0] {
                let text = ball(10.0, 1.0, clearance, height) + &rope(9.8 - clearance);
                let highest = rise(&mut stepper(&text, dt), fall);
                let what = format!("{height} m, {clearance} m, {dt} s: {highest} m");
                assert!((highest - clearance).abs() < 2e-3, "a rope, {what}");
                for e in [0.0, 0.5] {
                    let text = ball(10.0, 0.0, clearance, height) + &table(clearance, e);
                    let highest = rise(&mut stepper(&text, dt), fall) - clearance;
                    let apart = highest - e * e * height;
                    assert!(apart.abs() < 0.01 * height, "e = {e}, {what}: {highest}");
                }
            }
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

/// A step that is solved again, as a ball elsewhere is stopped in it, forgot that a drum had come to its end, and threw its load up.
#[test]
fn a_drum_at_its_end_holds_its_load_beside_a_ball_that_is_stopped() {
    let text = "load = 'load'\n[[body]]\nname = 'load'\nmass = 100\nshape = 'particle'\nposition = [0, 0, -4]\n\
                [[massless_cable]]\nname = 'rope'\nstretch = 0\nlength = 4\n\
                through = [{ body = 'world', point = [0, 0, 0] }, { body = 'load' }]\n\
                winch = { force_limit = 631.6440508492065, longest = 4.156264851109887 }\n\
                [[body]]\nname = 'ball'\nmass = 10\nshape = { sphere = { radius = 0.2 } }\nposition = [-5, 0, -19.366694736045737]\n\
                collide = { restitution = 0 }\n\
                [[collider]]\nname = 'table'\nbody = 'world'\nshape = { box = { size = [0.4, 0.4, 0.2] } }\n\
                position = [-5, 0, -20.096]\nrestitution = 0\n\
                [[ground]]\nname = 'floor'\npoint = [0, 0, -20]\nrestitution = 1\n";
    let mut stepper = stepper(text, DT);
    let mut lowest = 0.0_f64;
    while stepper.time() < 1.0 {
        stepper.step().expect("a step");
        let height = stepper.scene().bodies.position[0].z;
        lowest = lowest.min(height);
        assert!(height < lowest + 1e-6, "it rises to {height} m");
    }
    assert!((lowest + 4.156_264_851).abs() < 1e-6, "{lowest} m");
}

/// A ball falls to a floor of restitution 1 as its rope stretches: parts that were too coarse for both gained a quarter of the energy.
#[test]
fn a_rebound_under_a_rope_that_stretches_gains_nothing() {
    for omega in [10.0, 30.0, 60.0, 90.0] {
        for (clearance, height) in [(6.4e-4, 0.8), (1.7e-3, 1.3), (1e-4, 2.1)] {
            let stretch = 1.0 / (10.0 * (omega / DT).powi(2));
            let text = ball(10.0, 1.0, clearance, height)
                + &format!(
                    "[[massless_cable]]\nname = 'rope'\nstretch = {stretch:e}\nlength = {}\n\
                     through = [{{ body = 'world', point = [0, 0, 10] }}, {{ body = 'ball' }}]\n",
                    9.8 - clearance
                );
            let mut stepper = stepper(&text, DT);
            let fall = (2.0_f64 * height / G).sqrt();
            let highest = rise(&mut stepper, fall) - clearance;
            assert!(
                highest < 1.02 * height,
                "Ω = {omega}, {clearance} m: {highest} of {height} m"
            );
        }
    }
}

/// In the step of a blow the mean of a light body's velocities was none: up to 10⁵ times the energy.
#[test]
fn a_blow_that_a_joint_passes_on_reads_no_energy_from_nowhere() {
    for (heavy, light, e) in [(10.0, 1.0, 1.0), (1e3, 1.0, 1.0), (1e6, 1.0, 0.5)] {
        for (height, dt) in [(1e-4, DT / 2.0), (0.3, DT), (0.3, DT / 16.0)] {
            let text = format!(
                "load = 'heavy'\n[[body]]\nname = 'heavy'\nmass = {heavy:?}\nshape = {{ sphere = {{ radius = 0.2 }} }}\n\
                 position = [0, 0, {}]\n\
                 [[body]]\nname = 'light'\nmass = {light:?}\nshape = {{ sphere = {{ radius = 0.2 }} }}\nposition = [0, 0, {}]\n\
                 collide = {{ restitution = {e:?} }}\n[[ground]]\nname = 'floor'\nrestitution = {e:?}\n\
                 [[joint]]\nname = 'weld'\nkind = 'lock'\na = 'heavy'\nb = 'light'\npoint = [0, 0, {}]\n",
                1.2 + height,
                0.2 + height,
                0.7 + height
            );
            let mut stepper = weighed(&text, dt, Some(0.2));
            let start = stepper.energy().total();
            while stepper.time() < 1.0 {
                stepper.step().expect("a step");
                let gained = (stepper.energy().total() - start) / ((heavy + light) * G * height);
                // Of a blow that is slower than a step of gravity a row tells little.
                let allowed = if height < G * dt * dt { 1.0 } else { 0.05 };
                assert!(
                    gained < allowed,
                    "{heavy} : {light}, {height} m, {dt} s: {gained}"
                );
            }
        }
    }
}

/// A rope that rounding makes too short closes its gap, and that was energy from nowhere.
#[test]
fn a_rigid_rope_that_is_too_short_by_rounding_is_taken_as_it_is() {
    for (short, dt) in [(1e-4, DT), (6e-5, DT / 4.0), (1e-6, DT), (4e-6, DT / 16.0)] {
        let text = format!(
            "load = 'load'\n[[body]]\nname = 'load'\nmass = 100\nshape = 'particle'\nposition = [0, 0, 4]\n\
             [[massless_cable]]\nname = 'rope'\nstretch = 0\nlength = {}\n\
             through = [{{ body = 'world', point = [0, 0, 10] }}, {{ body = 'load' }}]\n",
            6.0 - short
        );
        let mut stepper = weighed(&text, dt, Some(0.2));
        while stepper.time() < 1.0 {
            let balance = stepper.step().expect("a step").balance;
            assert!(
                balance.is_none_or(|b| b.excess < 1e-3),
                "{short}: {balance:?}"
            );
        }
        let height = stepper.scene().bodies.position[0].z;
        assert!(
            (height - 4.0 - short).abs() < 1e-9 + 0.1 * short,
            "{height}"
        );
    }
}
