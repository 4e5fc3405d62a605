use crate::testing::*;

pub(super) const G: f64 = 9.81;
pub(super) const DT: f64 = 1.0 / 60.0;
/// Mass of the load that falls \[kg], length of its rope \[m].
const LOAD: f64 = 50.0;
const LENGTH: f64 = 4.0;

pub(super) fn options(dt: f64, substeps: usize) -> StepOptions {
    StepOptions {
        dt,
        substeps,
        backend: taut_solver::Backend::Dense(taut_solver::DenseOptions::default()),
        ..StepOptions::default()
    }
}

pub(super) fn ball(scene: &mut Scene, mass: f64, at: Vector3<f64>) -> Frame {
    let body = scene.add_body(format!("ball {at}"), Body::sphere(0.1, mass).at(at));
    centre(body)
}

pub(super) fn rope(scene: &mut Scene, frames: Vec<Frame>, length: f64, law: RowLaw) {
    let name = format!("rope {}", scene.constraints.len());
    scene.add_constraint(name, MasslessCable::new(frames, length, law), 0);
}

/// A ball at `at` on a rope from `top`.
pub(super) fn hung(
    mass: f64,
    [at, top]: [Vector3<f64>; 2],
    length: f64,
    law: RowLaw,
    winch: Option<Winch>,
) -> Scene {
    let mut scene = on_earth("hung");
    let load = ball(&mut scene, mass, at);
    let cable = reeled(winch, vec![Frame::world(top), load], length, law);
    scene.add_constraint("rope", cable, 0);
    scene
}

/// The load `height` above where its rope is straight, whose law and winch these are.
fn falling_on(height: f64, law: RowLaw, winch: Option<Winch>) -> Scene {
    let at = Vector3::z() * (height - LENGTH);
    hung(LOAD, [at, Vector3::zeros()], LENGTH, law, winch)
}

fn falling(height: f64, compliance: f64) -> Scene {
    falling_on(height, RowLaw::new(compliance, 0.0), None)
}

/// Compliance at which Ω of a step `DT` is `omega`.
fn compliance(omega: f64) -> f64 {
    (DT / omega).powi(2) / LOAD
}

/// Highest apex after the first contact, over the height of the fall: by the energy of the free flights, which the step
/// keeps to rounding.
fn rebound(height: f64, compliance: f64, options: StepOptions) -> f64 {
    let steps = (6.0 / options.dt).round() as usize;
    let mut stepper = Stepper::new(falling(height, compliance), options).unwrap();
    let (mut caught, mut highest) = (false, 0.0_f64);
    for _ in 0..steps {
        stepper.step().unwrap();
        if stepper.tension(0).unwrap() > 0.0 {
            caught = true;
        } else if caught {
            let apex = stepper.energy().total() / (LOAD * G) + LENGTH;
            highest = highest.max(apex / height);
        }
    }
    assert!(caught);
    highest
}

#[test]
fn a_load_that_falls_into_its_rope_is_thrown_no_higher() {
    const HEIGHTS: usize = 10;
    for options in [options(DT, 1), options(DT, 4), options(DT / 4.0, 1)] {
        for omega in [
            0.5,
            1.0,
            2.0,
            3.0,
            4.0,
            6.0,
            10.0,
            30.0,
            60.0,
            100.0,
            f64::INFINITY,
        ] {
            let mut mean = 0.0;
            for k in 0..HEIGHTS {
                let height = 0.2 + 0.2 * k as f64;
                let found = rebound(height, compliance(omega), options.clone());
                assert!(found <= 1.0, "Ω {omega}, {height} m, {options:?}: {found}");
                mean += found / HEIGHTS as f64;
            }
            // The parts of a step that catches resolve the rebound of a spring without damper.
            let swings = omega * options.dt / options.substeps as f64 / DT;
            let holds = !(0.1..90.0).contains(&swings) || mean > 0.95;
            assert!(holds, "Ω {omega}, {options:?}: {mean}");
        }
    }
}

/// A load that starts on its stretched rope leaves it with no more than the energy of the start: with half a kick of φ₊ in advance
/// it gained up to 0.63 Ω² of its motion. Gravity, which changes r by 0.2 of it a step, leaves half of that at most.
#[test]
fn a_start_on_a_stretched_rope_gains_nothing() {
    for omega in [0.1, 0.25, 0.46, 0.8, 1.2] {
        for speed in [-1.2_f64, 0.9, 1.5] {
            for part in [0.0, 0.3, 0.7, 1.5, 3.0] {
                let stretch = part * speed.abs() * DT;
                let mut scene = falling(-stretch, compliance(omega));
                scene.bodies.velocity[0].z = speed;
                let mut stepper = Stepper::new(scene, options(DT, 1)).unwrap();
                let start = stepper.energy().total() + 0.5 * stretch * stretch / compliance(omega);
                let (mut slack, mut steps) = (0, 0);
                while slack < 3 && steps < 600 {
                    stepper.step().unwrap();
                    slack = if stepper.tension(0).unwrap() > 0.0 {
                        0
                    } else {
                        slack + 1
                    };
                    steps += 1;
                }
                let gain = (stepper.energy().total() - start) / (0.5 * LOAD * speed * speed);
                let what = format!("Ω {omega}, {speed} m/s, {part}: {gain:.4} after {steps} steps");
                assert!(gain < 0.33 * omega * omega, "{what}");
            }
        }
    }
}

/// A load that settles on its damped rope: the damper's force is no stored energy, which came from nowhere when it went.
#[test]
fn a_damped_rope_that_settles_gains_nothing() {
    for (omega, damping) in [(0.3, 0.5), (1.0, 0.03), (4.0, 0.1), (30.0, 0.02)] {
        for (dt, substeps) in [(DT, 1), (DT / 4.0, 1), (DT, 4), (DT / 16.0, 1)] {
            let compliance = compliance(omega);
            let hangs = LOAD * G * compliance;
            for part in [0.0, 0.85, 1.3] {
                let scene = falling_on(-part * hangs, RowLaw::new(compliance, damping), None);
                let watched = options(dt, substeps).with(|o| o.energy_tolerance = Some(0.05));
                let mut stepper = Stepper::new(scene, watched).unwrap();
                while stepper.time() < 1.0 {
                    let done = stepper.step();
                    let holds = done.is_ok();
                    assert!(holds, "Ω {omega}, {damping} s, {dt}, {part}: {done:?}");
                }
            }
        }
    }
}

/// A plate on four ropes that spread, thrown up and turned; three masses, each on a rope from the one above; two masses
/// over two points, one thrown up. None of them has more energy than at the start.
fn thrown(compliance: f64) -> [Scene; 3] {
    let law = RowLaw::new(compliance, 0.0);
    let mut plate = on_earth("plate on four ropes");
    let body = Body::cuboid(Vector3::new(2.0, 2.0, 0.2), 400.0).at(-Vector3::z() * 2.5);
    let turned = nalgebra::UnitQuaternion::from_euler_angles(0.1, 0.05, 0.0);
    let body = plate.add_body("plate", body.turned(turned));
    for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let top = Frame::world(Vector3::new(1.5 * x, 1.3 * y, 0.0));
        let corner = Frame::body(body, Vector3::new(x, y, 0.0));
        rope(&mut plate, vec![top, corner], 3.0, law);
    }
    let mut row = on_earth("three masses in a row");
    let mut above = origin();
    for (k, mass) in [30.0, 5.0, 50.0].into_iter().enumerate() {
        let below = ball(&mut row, mass, -Vector3::z() * 0.7 * (k + 1) as f64);
        rope(&mut row, vec![above, below], 1.2, law);
        above = below;
    }
    let mut pair = on_earth("two masses over two points");
    let [left, right] = [-1.0, 1.0].map(|x| Frame::world(Vector3::x() * x));
    let a = ball(&mut pair, 5.0, Vector3::new(-1.0, 0.0, -40.0));
    let b = ball(&mut pair, 5.2, Vector3::new(1.0, 0.0, -40.0));
    // Exactly tight, and open from the first instant on.
    pair.bodies.velocity[0].z = 3.0;
    rope(&mut pair, vec![a, left, right, b], 82.0, law);
    [plate, row, pair]
}

#[test]
fn ropes_give_no_energy() {
    for dt in [DT, DT / 4.0] {
        for compliance in [1e-2, 1e-3, 2e-4, 1e-4, 2e-5, 5e-6, 1e-6, 2e-7, 1e-7, 0.0] {
            for scene in thrown(compliance) {
                let name = scene.name.clone();
                let mut stepper = Stepper::new(scene, options(dt, 1)).unwrap();
                let start = stepper.energy();
                for _ in 0..(10.0 / dt).round() as usize {
                    stepper.step().unwrap();
                    let gain = stepper.energy().total() - start.total();
                    // Whole steps hold the energy of a row's swing to Ω²/3 of it, and a division for another row that begins within
                    // this swing takes the difference over: 3·10⁻³ at Ω = 0.1, from where on a row divides the step by itself.
                    let allowed = if compliance == 0.0 { 1e-9 } else { 3e-3 };
                    let scale = allowed * start.gravity.abs();
                    assert!(gain <= scale, "{name}, ε {compliance:e}, {dt} s: {gain} J");
                }
            }
        }
    }
}

/// A rigid rope that is too short is taken back over the step, however short the sub-steps of its redoing.
#[test]
fn drift_is_taken_back_over_the_whole_step() {
    let gap = 4e-3;
    let mut scene = falling(-gap, 0.0);
    // So that no step is as its linearisation says.
    scene.bodies.velocity[0].x = 1.0;
    let guard = Guard::default().with(|g| (g.tolerance, g.substeps) = (f64::MIN_POSITIVE, 8));
    let options = options(DT / 4.0, 1).with(|o| o.guard = Some(guard));
    let speed = gap / options.dt;
    let mut stepper = Stepper::new(scene, options).unwrap();
    let start = stepper.energy().total();
    for step in 0..240 {
        let redone = stepper.step().unwrap().redone;
        // A slack rope has no gap that could disagree.
        assert!(redone || step > 0);
        let gain = stepper.energy().total() - start;
        let allowed = 0.5 * LOAD * speed * speed + LOAD * G * gap;
        assert!(gain < 1.05 * allowed, "{gain} J of {allowed} J");
    }
}

/// A load on a winch that hauls in from the start: one that moves with its rope feels the weight and no start; one that
/// rests swings about the speed, as far as an undamped rope throws it.
#[test]
fn a_winch_that_runs_from_the_start_kicks_only_what_rests() {
    let (mass, speed) = (33.0, -0.45);
    let at = Vector3::new(1.8173, 0.0, -4.9787);
    for dt in [DT, DT / 4.0] {
        for start in [speed, 0.0] {
            let law = RowLaw::new(5.3e-9, 0.0);
            let mut scene = hung(mass, [at, Vector3::zeros()], 5.3, law, Some(winch(speed)));
            scene.bodies.velocity[0] = at.normalize() * start;
            let mut stepper = Stepper::new(scene, options(dt, 1)).unwrap();
            for step in 0..(0.5 / dt) as usize {
                let x = stepper.scene().bodies.position[0];
                stepper.step().unwrap();
                let v = stepper.scene().bodies.velocity[0];
                let (length, along) = (x.norm(), x.normalize());
                let rate = v.dot(&along);
                let across = (v - along * rate).norm_squared();
                let exact = mass * (-along.z * G + across / length);
                let found = -stepper.multipliers()[0] / dt;
                if start == speed {
                    let off = (found / exact - 1.0).abs();
                    assert!(off < 0.03, "{step}: {found} of {exact} N");
                }
                let swing = if start == speed { 0.05 } else { 1.02 };
                assert!((rate / speed - 1.0).abs() < swing, "{step}: {rate} m/s");
            }
        }
    }
}

/// A rod made in flight stops a load along it: without rebound where it is stiff, with a rebound that the steps resolve where it
/// is soft.
#[test]
fn a_rod_that_is_made_between_parting_bodies_stops_them_without_a_rebound() {
    // Velocities of the middles of steps are larger by Ω²/24 of a swing.
    for (omega, highest) in [
        (f64::INFINITY, 0.01),
        (300.0, 0.01),
        (30.0, 0.05),
        (0.2, 1.002),
    ] {
        for speed in [0.3, 3.0, -3.0] {
            for substeps in [1, 2, 4] {
                let mut scene = Scene::new("caught");
                let load = ball(&mut scene, LOAD, Vector3::z() * -LENGTH);
                let body = load.body_index().unwrap();
                scene.bodies.velocity[body] = Vector3::new(0.0, 0.0, -speed);
                let mut stepper = Stepper::new(scene, options(DT, substeps)).unwrap();
                stepper.step().unwrap();
                let length = -stepper.scene().bodies.position[body].z;
                let law = RowLaw::new(compliance(omega * substeps as f64), 0.0);
                let rod = link([origin(), load], length, law);
                stepper.tie("rod", rod);
                let mut fastest = 0.0_f64;
                for _ in 0..120 {
                    stepper.step().unwrap();
                    let away = -stepper.scene().bodies.velocity[body].z / speed;
                    fastest = fastest.max(-away);
                }
                let what = format!("Ω = {omega}, {speed} m/s, {substeps} sub-steps: {fastest}");
                assert!(fastest <= highest + 1e-9, "{what}");
                assert!(omega > 1.0 || fastest > 0.9, "{what}");
            }
        }
    }
}

/// A load swings on a rigid rope as a rod to another point is made: the rod takes over without throwing it off.
#[test]
fn a_rod_beside_a_rigid_rope_takes_its_load_over() {
    for substeps in [1, 4, 16, 64] {
        let mut scene = on_earth("held twice");
        let load = ball(&mut scene, LOAD, Vector3::zeros());
        let body = load.body_index().unwrap();
        let hub = Vector3::new(-0.06, 0.0, 3.0);
        let frames = vec![Frame::world(hub), load];
        let rope = MasslessCable::new(frames, hub.norm(), RowLaw::new(0.0, 0.0));
        scene.add_constraint("rope", rope, 0);
        let mut stepper = Stepper::new(scene, options(DT, substeps)).unwrap();
        stepper.steps(30);
        let bodies = &stepper.scene().bodies;
        let before = bodies.velocity[body].norm();
        assert!(before > 0.05, "it swings: {before}");
        let anchor = Vector3::new(0.2, 0.0, 1.0);
        let rod = link(
            [Frame::world(anchor), load],
            (anchor - bodies.position[body]).norm(),
            RowLaw::new(1e-10, 0.0),
        );
        stepper.tie("rod", rod);
        for n in 0..15 {
            stepper.step().unwrap();
            let speed = stepper.scene().bodies.velocity[body].norm();
            let what = format!("{substeps} sub-steps, step {n}: {speed} m/s of {before}");
            assert!(speed < 1.1 * before, "{what}");
        }
    }
}

/// A drum that has paid out to its end under more than its motor hauls in with.
#[test]
fn a_motor_that_is_too_weak_for_its_load_stands_at_the_drum_s_end() {
    for (omega, part) in [(1.0, 0.5), (3.0, 0.9), (100.0, 0.3)] {
        let winch =
            winch(-0.5).with(|w| (w.force_limit, w.longest) = (part * LOAD * G, LENGTH + 0.1));
        let scene = falling_on(0.0, RowLaw::new(compliance(omega), 0.0), Some(winch));
        let watched = options(DT, 1).with(|o| o.energy_tolerance = Some(0.2));
        let mut stepper = Stepper::new(scene, watched).unwrap();
        let (mut ends, mut lengths) = (0, 0);
        for step in 0..600 {
            let report = stepper.step().unwrap();
            let balance = report.balance.unwrap();
            let what = format!("Ω = {omega}, {part} of the weight, step {step}");
            assert!(balance.excess < 4e-2, "{what}: {balance:?}");
            let tension = stepper.tension(0).unwrap();
            let at_end = cable(stepper.scene(), 0).length_at(stepper.time()) >= LENGTH + 0.1;
            // A motor hauls in with what it has, no more; a divided step tells the mean of its parts.
            if !at_end && report.divided == 0 {
                let holds = tension <= part * LOAD * G * (1.0 + 1e-9);
                assert!(holds, "{what}: {tension}");
            }
            (ends, lengths) = (ends + usize::from(at_end), lengths + 1);
        }
        assert!(2 * ends > lengths, "Ω = {omega}: at its end in {ends}");
        let last = stepper.tension(0).unwrap();
        assert!((last / (LOAD * G) - 1.0).abs() < 0.1, "Ω = {omega}: {last}");
    }
}

/// A load that pulls its rope off a drum until that is empty: a rigid rope stops it there, a soft one swings about where it hangs
/// and throws it no higher than it fell.
#[test]
fn an_emptied_drum_stops_its_load_at_its_end() {
    for (omega, part) in [(f64::INFINITY, 0.5), (300.0, 0.2), (30.0, 0.0), (1.0, 0.5)] {
        for (left, substeps) in [(0.2, 1), (0.37, 1), (0.2, 4), (1.0, 2)] {
            let winch = Winch {
                brake: true,
                brake_limit: part * LOAD * G,
                longest: LENGTH + left,
                ..Winch::new()
            };
            let scene = falling_on(0.0, RowLaw::new(compliance(omega), 0.0), Some(winch));
            let watched = options(DT, substeps).with(|o| o.energy_tolerance = Some(0.2));
            let mut stepper = Stepper::new(scene, watched).unwrap();
            let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
            let what = format!("Ω = {omega}, {part} of the weight, {left} m, {substeps}");
            for _ in 0..300 {
                let balance = stepper.step().unwrap().balance.unwrap();
                assert!(balance.excess < 4e-2, "{what}: {balance:?}");
                let height = stepper.scene().bodies.position[0].z + LENGTH + left;
                lowest = lowest.min(height);
                if lowest < 0.0 {
                    highest = highest.max(height);
                }
            }
            // With the energy that is left of its fall it stretches the rope by as much as a fall would without a brake.
            let sag = compliance(omega) * LOAD * G;
            let deepest = sag + (sag * sag + 2.0 * sag * left).sqrt();
            let holds = lowest > -1.2 * deepest - 1e-3;
            assert!(holds, "{what}: {lowest}, {deepest}");
            assert!(highest < left, "{what}: {highest}");
            let holds = omega < 100.0 || highest < 0.01 * left + 1e-3;
            assert!(holds, "{what}: {highest}");
        }
    }
}
