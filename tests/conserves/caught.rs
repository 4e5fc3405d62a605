//! Elastic ropes that catch their load or swing it, and motors and winches that drive it against a stop.

use super::meeting::stepper;
use taut_tests::prelude::*;

const G: f64 = 9.81;

/// A load of `mass[0]` over a pulley against `mass[1]`, `height` above the ground, on a rope of `stretch` \[m/N] that carries them
/// evenly.
fn lift(mass: [f64; 2], height: f64, stretch: f64) -> String {
    let [a, b] = mass;
    let (z, tension) = (0.2 + height, 2.0 * a * b / (a + b) * G);
    format!(
        "load = 'a'\n[[ground]]\nname = 'ground'\n\
         [[body]]\nname = 'a'\nmass = {a}\nshape = {{ box = {{ size = [0.4, 0.4, 0.4] }} }}\nposition = [-0.3, 0, {z}]\ncollide = true\n\
         [[body]]\nname = 'b'\nmass = {b}\nshape = {{ sphere = {{ radius = 0.1 }} }}\nposition = [0.3, 0, 1]\n\
         [[massless_cable]]\nname = 'rope'\nstretch = {stretch}\ntension = {tension}\nthrough = [{{ body = 'a' }}, \
         {{ body = 'world', point = [0, 0, 12], sheave = {{ radius = 0.3, axis = [0, 1, 0] }} }}, {{ body = 'b' }}]\n"
    )
}

/// Height \[m] to which a [`lift`]'s rope pulls the load again that has landed.
fn lifted([a, b]: [f64; 2], height: f64, stretch: f64, dt: f64) -> f64 {
    let mut stepper = stepper(&lift([a, b], height, stretch), dt);
    let acceleration = (a - b) / (a + b) * G;
    let speed = (2.0 * acceleration * height).sqrt();
    let caught = speed / acceleration + 2.0 * speed / G;
    let back = 2.0 * speed * b / (a + b) / acceleration;
    let (mut highest, end) = (0.0_f64, caught + back + 1.3);
    while stepper.time() < end {
        stepper.step().expect("a step");
        if stepper.time() > caught - speed / G {
            highest = highest.max(stepper.scene().bodies.position[0].z - 0.2);
        }
    }
    highest
}

/// Of the lift, undivided steps lose 16 % at Ω = 0.6 and 47 % at 2.5.
#[test]
fn elastic_ropes_lift_what_has_landed_to_its_height() {
    for (k, omega) in [0.25, 0.4, 0.6, 1.2, 2.5, 5.0].into_iter().enumerate() {
        for mass in [[100.0_f64, 30.0], [2000.0, 1500.0]] {
            let height = 0.5 + 0.3 * k as f64;
            let response = mass[0].recip() + mass[1].recip();
            let stretch = response / (omega * 60.0_f64).powi(2);
            let exact = lifted(mass, height, stretch, 1.0 / (60.0 * 128.0));
            let found = lifted(mass, height, stretch, 1.0 / 60.0);
            let error = (found / exact - 1.0).abs();
            let holds = error < 0.02;
            assert!(holds, "Ω {omega}, {mass:?} kg: {found} m of {exact} m");
        }
    }
}

/// Whole steps leave a gap of (v Δt)²/2L that they do not feel. Parts that took it for stretch released it: 40 % of the energy in
/// 0.05 s.
#[test]
fn a_load_that_circles_on_an_elastic_rope_keeps_its_energy() {
    for omega in [1.0, 5.0, 17.0, 53.0, 90.0] {
        for (gravity, velocity, position) in [
            (0.0, [3.0, 0.0], [0.0, -4.5e-7]),
            (G, [0.0, 0.0], [2.0, 2.0]),
        ] {
            let stretch = 1.0 / (omega * 60.0_f64).powi(2);
            let ([vx, vz], [x, z]) = (velocity, position);
            let text = format!(
                "load = 'ball'\ngravity = [0, 0, {}]\n\
                 [[body]]\nname = 'ball'\nmass = 1\nshape = {{ sphere = {{ radius = 0.1 }} }}\nposition = [{x}, 0, {z}]\n\
                 velocity = [{vx}, 0, {vz}]\n[[massless_cable]]\nname = 'rope'\nlength = 2\nstretch = {stretch}\n\
                 through = [{{ body = 'world', point = [0, 0, 2] }}, {{ body = 'ball' }}]\n",
                -gravity
            );
            let mut stepper = stepper(&text, 1.0 / 60.0);
            let begun = stepper.energy().total();
            for step in 0..180 {
                stepper.step().expect("a step");
                let change = stepper.energy().total() - begun;
                // Of 4.5 J of the circle, and of 19.6 J of the fall by 2 m.
                let off = change.abs();
                assert!(off < 0.4, "Ω {omega}, g {gravity}, step {step}: {change} J");
            }
        }
    }
}

/// The guard's implicit steps leave velocities half a step late, as others do. A divided step that took them for those of its
/// beginning lost g Δt/2 of each free body, 0.78 m in 2 s.
#[test]
fn a_body_falls_freely_beside_one_that_whirls() {
    let text = "load = 'free'\n\
                [[body]]\nname = 'free'\nmass = 1\nshape = { sphere = { radius = 0.1 } }\nposition = [50, 0, 0]\n\
                [[body]]\nname = 'ball'\nmass = 1\nshape = { sphere = { radius = 0.1 } }\nvelocity = [20, 0, 0]\n\
                [[massless_cable]]\nname = 'rope'\nlength = 2\nstretch = 0\n\
                through = [{ body = 'world', point = [0, 0, 2] }, { body = 'ball' }]\n";
    let mut stepper = stepper(text, 1.0 / 60.0);
    let mut implicit = 0;
    for _ in 0..120 {
        implicit += stepper.step().expect("a step").implicit_substeps;
    }
    assert!(implicit > 0);
    let z = stepper.scene().bodies.position[0].z;
    assert!((z + 0.5 * G * 4.0).abs() < 1e-9, "{z} m");
}

/// A motor at its speed holds its body against the wall that it strikes: joints leave nothing of the contact's W, whose rounding
/// let the body through or ended the run, by its mass.
#[test]
fn a_motor_presses_its_body_against_a_wall() {
    for mass in [3.0, 20.0, 250.0, 1e3, 5e3, 1e5] {
        for share in [2.0, 5.0, 20.0] {
            for rate in [60.0, 240.0] {
                let force = share * mass;
                let text = format!(
                    "load = 'ball'\n[[ground]]\nname = 'wall'\npoint = [0.5, 0, 0]\nnormal = [-1, 0, 0]\n\
                     [[body]]\nname = 'ball'\nmass = {mass}\nshape = {{ sphere = {{ radius = 0.1 }} }}\nposition = [-0.1, 0, 0]\n\
                     collide = true\n[[joint]]\nname = 'rail'\nkind = 'slider'\na = 'world'\nb = 'ball'\npoint = [-0.1, 0, 0]\n\
                     axis = [1, 0, 0]\nmotor = {{ speed = 1, force_limit = {force} }}\n"
                );
                let mut stepper = stepper(&text, 1.0 / rate);
                for _ in 0..(2.0 * rate) as usize {
                    let report = stepper.step().expect("a step");
                    assert_eq!(report.undecided, 0, "{mass} kg, {force} N, {rate}/s");
                }
                let [x, speed] = [
                    stepper.scene().bodies.position[0].x,
                    stepper.scene().bodies.velocity[0].norm(),
                ];
                // Both surfaces yield by 10⁻¹⁰ m/N.
                let holds = (x - 0.4).abs() < 1e-6 + 2e-10 * force && speed < 1e-3;
                assert!(holds, "{mass} kg, {force} N, {rate}/s: {x} m, {speed} m/s");
            }
        }
    }
}

/// A winch at its limit of force stays there in the half kicks about a divided step: as a rope, its damper threw the load down at
/// 3.6 m/s from nowhere.
#[test]
fn a_winch_that_slips_holds_its_load_against_a_beam() {
    for omega in [10.0, 25.0, 53.0, 90.0] {
        for damping in [0.0, 0.01, 0.05] {
            let stretch = 1e-3 / (omega * 60.0_f64).powi(2);
            let text = format!(
                "load = 'load'\n[[body]]\nname = 'beam'\nmobility = 'static'\nshape = {{ box = {{ size = [1, 1, 0.2] }} }}\n\
                 position = [0, 0, 5]\ncollide = true\n\
                 [[body]]\nname = 'load'\nmass = 1000\nshape = {{ box = {{ size = [0.4, 0.4, 0.4] }} }}\nposition = [0, 0, 4]\n\
                 collide = true\n[[massless_cable]]\nname = 'rope'\nstretch = {stretch}\ndamping = {damping}\n\
                 through = [{{ body = 'world', point = [0, 0, 6] }}, {{ body = 'load', point = [0, 0, 0.2] }}]\n\
                 winch = {{ speed = -0.5, force_limit = 14715.0 }}\n"
            );
            let mut stepper = stepper(&text, 1.0 / 60.0);
            taut_tests::steps(&mut stepper, 150);
            let bodies = &stepper.scene().bodies;
            let (z, speed) = (bodies.position[1].z, bodies.velocity[1].norm());
            let holds = (z - 4.7).abs() < 1e-5 && speed < 1e-3;
            assert!(holds, "Ω {omega}, τ {damping} s: {z} m, {speed} m/s");
        }
    }
}

/// A driven body at 10 m/s takes along a ball that stands on the ground: what the blow at the start gives is no energy from nowhere.
#[test]
fn the_balance_begins_after_the_blow_of_the_start() {
    let text = "load = 'ball'\n[[ground]]\nname = 'ground'\nfriction = 0\n\
                [[body]]\nname = 'driver'\nmobility = 'driven'\nposition = [-1.5, 0, 2]\nvelocity = [10, 0, 0]\n\
                [[body]]\nname = 'ball'\nmass = 100\nshape = { sphere = { radius = 0.1 } }\nposition = [0, 0, 0.1]\ncollide = true\n\
                [[joint]]\nname = 'rod'\nkind = 'distance'\na = 'driver'\nb = 'ball'\npoint_a = [0, 0, 0]\npoint_b = [0, 0, 0]\n\
                length = 2.420743687382041\nstretch = 0\n";
    for dt in [1.0 / 60.0, 1.0 / 960.0] {
        let scene = SceneSource::parse(text, &[]).expect("reads").build();
        let options = StepOptions::default().with(|o| (o.dt, o.energy_tolerance) = (dt, Some(0.2)));
        let mut stepper = Stepper::new(scene.expect("builds"), options).expect("starts");
        for _ in 0..30 {
            let report = stepper.step().expect("a step");
            let excess = report.balance.expect("a balance").excess;
            // 0.6 where it began before the blow; a blow of contacts is off by 0.04.
            assert!(excess < 0.01, "{dt} s: {excess}");
        }
        let speed = stepper.scene().bodies.velocity[1];
        assert!((speed.x - 10.0).abs() < 1e-9, "{dt} s: {speed:?}");
    }
}
