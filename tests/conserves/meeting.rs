//! Contacts beside motors and ropes: what one solves for the other must not undo.

use taut_integrator::{StepOptions, Stepper};
use taut_model::SceneSource;

pub(super) fn stepper(text: &str, dt: f64) -> Stepper {
    let source = SceneSource::parse(text, &[]).expect("reads");
    let scene = source.build().expect("builds");
    Stepper::new(
        scene,
        StepOptions {
            dt,
            ..StepOptions::default()
        },
    )
    .expect("starts")
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
                    assert!(
                        spin <= 1.01 * speed / 0.3,
                        "{mass} kg, {rate}/s, step {step}: {spin} rad/s"
                    );
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
            assert!(
                of_fall < 0.02,
                "{mass} kg, {rate}/s, step {step}: {of_fall}"
            );
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
