//! Forces of an instant within a step: catches, jumps of drives and blows have their impulse, and nothing beside them has more.

use super::meeting::stepper;

const DT: f64 = 1.0 / 60.0;
const G: f64 = 9.81;

/// A load of `mass` at `position` on a rope from `anchor`, with the rope's `keys`.
fn hung(mass: f64, anchor: [f64; 3], position: [f64; 3], keys: &str) -> String {
    format!(
        "load = 'load'\n[[body]]\nname = 'load'\nmass = {mass}\nshape = 'particle'\nposition = {position:?}\n\
         [[massless_cable]]\nname = 'rope'\nthrough = [{{ body = 'world', point = {anchor:?} }}, {{ body = 'load' }}]\n{keys}\n"
    )
}

/// Gaps of (v Δt)²/L that whole steps leave on a circle went within a divided step: the rope had T + 12 m v²/L in its first part, and
/// tore.
#[test]
fn a_catch_elsewhere_does_not_tear_the_rope_of_a_swing() {
    let dampings = [0.0, 0.05, 1.0];
    let laws = dampings.map(|damping| ["0", "1e-9", "1e-7"].map(|stretch| (stretch, damping)));
    for (stretch, damping) in laws.into_iter().flatten() {
        let keys = format!("stretch = {stretch}\ndamping = {damping}\nbreaks_at = 1300");
        let swing = hung(100.0, [0.0, 0.0, 10.0], [2.5, 0.0, 5.669_873], &keys);
        let text = format!(
            "{swing}[[body]]\nname = 'faller'\nmass = 50\nshape = 'particle'\nposition = [20, 0, 8]\n\
             [[massless_cable]]\nname = 'slack'\nstretch = 1e-7\nlength = 3\n\
             through = [{{ body = 'world', point = [20, 0, 10] }}, {{ body = 'faller' }}]\n"
        );
        let mut stepper = stepper(&text, DT);
        let mut divided = 0;
        while stepper.time() < 5.0 {
            divided += stepper.step().expect("a step").divided;
        }
        let names = &stepper.scene().constraint_names;
        let holds = names.iter().any(|name| name == "rope");
        assert!(
            holds && divided > 2,
            "{stretch}, {damping} s: torn or whole"
        );
    }
}

/// Of a catch in the first part of a divided step half as much again was told, of one in the last a fifth less.
#[test]
fn a_catch_has_its_impulse_at_any_instant_of_a_step() {
    let mass = 10.0;
    for phase in -24..24 {
        let caught = 0.5 + DT * f64::from(phase) / 48.0;
        let keys = format!("stretch = 0\nslack = {}", 0.5 * G * caught * caught);
        let mut stepper = stepper(&hung(mass, [0.0, 0.0, 1.0], [0.0; 3], &keys), DT);
        let mut impulse = 0.0;
        while stepper.time() < 0.9 {
            stepper.step().expect("a step");
            impulse += DT * (stepper.tension(0).expect("a rope") - mass * G);
        }
        let momentum = mass * G * caught;
        assert!(
            impulse.abs() < 5e-3 * momentum,
            "{phase}/48: {impulse} of {momentum} N s"
        );
    }
}

/// The stretch of a rope that throws its load back was taken for the gap that a curve leaves, and half of the rebound's energy with it.
#[test]
fn a_rebound_keeps_its_energy_beside_a_sideways_motion() {
    for slack in [0.35, 0.38, 0.4, 0.43, 0.46] {
        let keys = "stretch = 1e-9\nlength = 5";
        let position = [0.0, 0.0, 5.0 + slack];
        let text = hung(1000.0, [0.0, 0.0, 10.0], position, keys).replace(
            "[[massless_cable]]",
            "velocity = [5, 0, 0]\n[[massless_cable]]",
        );
        let mut stepper = stepper(&text, DT);
        let energy = |stepper: &taut_integrator::Stepper| stepper.energy().total();
        let start = energy(&stepper);
        while stepper.time() < 0.6 {
            stepper.step().expect("a step");
        }
        let lost = start - energy(&stepper);
        // Of what the rope takes, m v²/2 along it.
        let radial = 1000.0 * G * slack;
        assert!(
            (-1e-3..0.2).contains(&(lost / radial)),
            "{slack} m: {lost} of {radial} J"
        );
    }
}

/// The first part of a step took the jump of its drive half as much again, and the balance with it.
#[test]
fn jumps_of_a_winch_have_their_impulse() {
    let mass = 50.0;
    let keys = "stretch = 0\nwinch = { speed = -1, since = 0.5 }";
    let text = hung(mass, [0.0, 0.0, 60.0], [0.0; 3], keys);
    for dt in [DT, DT / 4.0] {
        let mut stepper = stepper(&text, dt);
        let mut largest = 0.0_f64;
        while stepper.time() < 1.0 {
            stepper.step().expect("a step");
            largest = largest.max(stepper.tension(0).expect("a rope"));
        }
        let exact = mass * (G + dt.recip());
        assert!(
            (largest / exact - 1.0).abs() < 1e-6,
            "{largest} N of {exact} N"
        );
    }
    let gravity = "gravity = [0, 0, 0]\n";
    let control = "[[control]]\nname = 'c'\ndrives = [{ joint = 'rope' }]\n";
    let keys = "stretch = 0\nwinch = { speed = 0 }";
    let text = format!(
        "{gravity}{}{control}",
        hung(mass, [0.0, 0.0, 60.0], [0.0; 3], keys)
    );
    let mut stepper = super::meeting::weighed(&text, DT, Some(1e-2));
    let mut work = 0.0;
    for step in 1..60 {
        let speed = -2.0 * DT * f64::from(step);
        stepper.set_control(0, speed).expect("a control");
        work = stepper
            .step()
            .expect("a step")
            .balance
            .expect("is weighed")
            .work;
        let tension = stepper.tension(0).expect("a rope");
        assert!(
            (tension - 2.0 * mass).abs() < 1e-6,
            "step {step}: {tension} N"
        );
    }
    let kinetic = stepper.scene().kinetic_energy();
    assert!((work / kinetic - 1.0).abs() < 1e-3, "{work} of {kinetic} J");
}

/// A motor or winch that a rope without stretch stops at its limit: the system of both was singular.
#[test]
fn drives_stall_at_their_limit_against_a_rope() {
    let rail = "[[body]]\nname = 'm'\nmass = 10\nshape = { box = { size = [0.4, 0.4, 0.4] } }\nposition = [0, 0, 0.2]\n\
                [[joint]]\nname = 'rail'\nkind = 'slider'\na = 'world'\nb = 'm'\npoint = [0, 0, 0.2]\naxis = [1, 0, 0]\n\
                motor = { speed = 0.5, force_limit = 400 }\n\
                [[massless_cable]]\nname = 'rope'\nthrough = [{ body = 'world', point = [-5, 0, 0.2] }, { body = 'm' }]\n\
                stretch = 0\nslack = 0.3\n";
    let tug = "[[body]]\nname = 'm'\nmass = 10\nshape = 'particle'\nposition = [0, 0, 1]\n\
               [[massless_cable]]\nname = 'up'\nthrough = [{ body = 'world', point = [0, 0, 6] }, { body = 'm' }]\n\
               stretch = 0\nwinch = { speed = -0.5, force_limit = 400 }\n\
               [[massless_cable]]\nname = 'rope'\nthrough = [{ body = 'world', point = [0, 0, -4] }, { body = 'm' }]\n\
               stretch = 0\nslack = 0.2\n";
    for (text, pull) in [(rail, 400.0), (tug, 400.0 - 10.0 * G)] {
        let mut stepper = stepper(&format!("load = 'm'\n{text}"), DT);
        while stepper.time() < 1.0 {
            stepper.step().expect("a step");
        }
        let rope = stepper.constraint("rope").expect("a rope");
        let rope = stepper.constraint_index(rope).expect("is there");
        let tension = stepper.tension(rope).expect("a rope");
        assert!((tension - pull).abs() < 1e-6 * pull, "{tension} N");
    }
}

/// A ball that a rod leads along a circle, between two ledges that throw it back: a whole step has one direction of the rod for the
/// ways there and back, and each blow gained or lost 2 to 7 % of the energy.
#[test]
fn blows_on_a_curve_keep_the_energy() {
    let angles = [-60.0_f64, -37.0, 0.0, 37.0, 60.0].map(|angle| ("distance", angle));
    for (kind, angle) in angles
        .into_iter()
        .chain([("hinge", 37.0), ("hinge", -37.0)])
    {
        let (radius, half) = (1.5_f64, 0.53_f64);
        let ledges = [1.0, -1.0].map(|side| {
            let (s, c) = half.sin_cos();
            let (across, out) = angle.to_radians().sin_cos();
            let normal = [-side * (out * c - across * s), -(out * s + across * c), 0.0];
            let point = [side * radius * s - 0.1 * normal[0], -radius * c - 0.1 * normal[1], 0.0];
            format!(
                "[[ground]]\nname = 'w{side}'\npoint = {point:?}\nnormal = {normal:?}\nrestitution = 1\nfriction = 0\n"
            )
        });
        // A hinge turns its body with the way, a rod does not.
        let spin = if kind == "hinge" { 3.0 / radius } else { 0.0 };
        let text = format!(
            "load = 'ball'\ngravity = [0, 0, 0]\n\
             [[body]]\nname = 'ball'\nmass = 1\nshape = {{ sphere = {{ radius = 0.1 }} }}\nposition = [0, -{radius}, 0]\n\
             velocity = [3, 0, 0]\nangular_velocity = [0, 0, {spin}]\ncollide = {{ restitution = 1, friction = 0 }}\n{}\
             [[joint]]\nname = 'r'\nkind = '{kind}'\na = 'world'\nb = 'ball'\nstretch = 0\n{}",
            ledges.concat(),
            match kind {
                "hinge" => "point = [0, 0, 0]\naxis = [0, 0, 1]\n".to_owned(),
                _ => format!("point_a = [0, 0, 0]\npoint_b = [0, 0, 0]\nlength = {radius}\n"),
            }
        );
        let mut stepper = super::meeting::weighed(&text, DT, Some(0.1));
        let start = stepper.scene().kinetic_energy();
        let (mut side, mut turns) = (1.0, 0);
        while turns < 20 {
            stepper.step().expect("a step");
            let along = stepper.scene().bodies.velocity[0].x;
            assert!(stepper.time() < 20.0, "{kind}, {angle}°: {turns} turns");
            if along * side < 0.0 {
                (side, turns) = (-side, turns + 1);
            }
        }
        let kept = stepper.scene().kinetic_energy() / start;
        assert!(
            (kept - 1.0).abs() < 0.05,
            "{kind}, {angle}°: {kept} after {turns} blows"
        );
    }
}

/// A row that its rate leaves open and a turn closes began the next step with stretch that nothing had paid for: a quarter of the
/// energy in 5 of 24 phases.
#[test]
fn a_body_that_spins_into_its_rope_gains_nothing() {
    for (stretch, lost) in [(3e-5, 2e-3), (2.8e-6, 2e-3), (3e-7, 0.02), (0.0, 1.0)] {
        for (spin, rate) in [(-15.0, -1.0), (-8.0, 1.0), (-25.0, 0.5)] {
            for phase in 0..24 {
                let height = 5.0 + 5e-3 * f64::from(phase);
                let text = format!(
                    "load = 'load'\n[[body]]\nname = 'load'\nmass = 9.27\nshape = {{ box = {{ size = [0.6, 0.6, 0.4] }} }}\n\
                     position = [0, 0, {height}]\nvelocity = [0, 0, {rate:?}]\nangular_velocity = [0, {spin:?}, 0]\n\
                     [[massless_cable]]\nname = 'rope'\nstretch = {stretch}\nlength = 4.8\n\
                     through = [{{ body = 'world', point = [0, 0, 10] }}, {{ body = 'load', point = [0, 0, 0.2] }}]\n"
                );
                let mut stepper = stepper(&text, DT);
                let (start, own) = (stepper.energy(), stepper.scene().kinetic_energy());
                // Until the rope is slack again.
                while stepper.time() < 0.3 {
                    stepper.step().expect("a step");
                }
                let gain = (stepper.energy().total() - start.total()) / own;
                assert!(
                    (-lost..1e-3).contains(&gain),
                    "{stretch}, {spin} rad/s, {height} m: {gain}"
                );
            }
        }
    }
}

/// The stop of a winch at its shortest rope was shared by two steps, and its load rose to 0.2 to 1 of its height.
#[test]
fn a_winch_at_its_shortest_rope_throws_its_load_at_any_instant() {
    let (mass, length) = (100.0, 6.0);
    for (omega, speed) in [0.5, 2.0, 6.0, 30.0, f64::INFINITY]
        .into_iter()
        .flat_map(|omega| [0.4, 1.0].map(|speed| (omega, speed)))
    {
        let rate = omega / DT;
        let stretch = 1.0 / (mass * rate * rate);
        let sag = stretch * mass * G;
        // Beyond the way in which the rope slackens it is a throw.
        let height = match (sag, speed / rate) {
            (sag, swing) if swing < sag => swing,
            (sag, _) => sag + (speed * speed - (rate.min(1e9) * sag).powi(2)) / (2.0 * G),
        };
        for phase in 0..8 {
            let shortest = length - speed * (0.5 + DT * f64::from(phase) / 8.0);
            let keys = format!(
                "stretch = {stretch:e}\nlength = {length}\nwinch = {{ speed = {:?}, shortest = {shortest} }}",
                -speed
            );
            let text = hung(mass, [0.0; 3], [0.0, 0.0, -length - sag], &keys).replace(
                "[[massless_cable]]",
                &format!("velocity = [0, 0, {speed:?}]\n[[massless_cable]]"),
            );
            let mut stepper = stepper(&text, DT);
            let mut highest = f64::NEG_INFINITY;
            while stepper.time() < 1.0 {
                stepper.step().expect("a step");
                highest = highest.max(stepper.scene().bodies.position[0].z);
            }
            let part = (highest + shortest + sag) / height;
            // Between two rows of time the top may be missed.
            let missed = G * DT * DT / 8.0 / height;
            assert!(
                (0.96 - missed..1.02).contains(&part),
                "Ω = {omega}, {speed} m/s, {phase}/8: {part}"
            );
        }
    }
}

/// Beside a crank that keeps the guard's sub-steps on, a ball fell by ½ g Δt t too far and rose to 0.79 to 0.93 of its height.
#[test]
fn balls_bounce_as_high_in_implicit_sub_steps() {
    for (steps, spin) in [(60.0, 7.0), (240.0, 28.0)] {
        for mass in [1.0, 1e5] {
            for (e, height) in [(0.3, 0.5), (0.3, 1.3), (0.8, 1.0), (1.0, 0.5), (1.0, 1.3)] {
                let text = format!(
                    "load = 'ball'\n[[body]]\nname = 'ball'\nmass = {mass:?}\nshape = {{ sphere = {{ radius = 0.1 }} }}\n\
                     position = [0, 0, {}]\ncollide = {{ restitution = {e} }}\n\
                     [[ground]]\nname = 'floor'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nrestitution = {e}\n\
                     [[body]]\nname = 'crank'\nmass = 1\nshape = {{ sphere = {{ radius = 0.3 }} }}\nposition = [5, 0, 3]\n\
                     velocity = [0, {spin:?}, 0]\nangular_velocity = [0, 0, {spin:?}]\n\
                     [[joint]]\nname = 'axle'\nkind = 'hinge'\na = 'world'\nb = 'crank'\npoint = [4, 0, 3]\naxis = [0, 0, 1]\n\
                     motor = {{ speed = {spin:?} }}\n",
                    height + 0.1
                );
                let mut stepper = stepper(&text, 1.0 / steps);
                let (mut redone, mut top) = (0, 0.0_f64);
                let bounce = (2.0 * height / G).sqrt();
                while stepper.time() < bounce * (1.0 + 1.2 * e) {
                    redone += usize::from(stepper.step().expect("a step").redone);
                    if stepper.time() > bounce + 1.0 / steps {
                        top = top.max(stepper.scene().bodies.position[0].z - 0.1);
                    }
                }
                let part = top / (e * e * height);
                let missed = G / (8.0 * steps * steps) / (e * e * height);
                assert!(redone > 10, "{redone} implicit steps");
                assert!(
                    (0.995 - missed..1.003).contains(&part),
                    "{mass} kg, e = {e}, {height} m, {steps}/s: {part}"
                );
            }
        }
    }
}
