use super::{Rest, *};
use crate::contact::tests::add;
use crate::testing::*;

const SLEEP: Sleep = Sleep {
    distance: 1e-3,
    after: 1.0,
    period: 60.0,
};

fn options(sleep: Option<Sleep>) -> StepOptions {
    StepOptions {
        backend: Backend::Dense(DenseOptions::default()),
        energy_tolerance: Some(0.2),
        sleep,
        ..StepOptions::default()
    }
}

/// A run that may sleep, and one that may not.
fn both(scene: &Scene) -> [Stepper; 2] {
    [Some(SLEEP), None].map(|sleep| Stepper::new(scene.clone(), options(sleep)).unwrap())
}

fn gantry() -> Scene {
    let params = GantryParams::default().with(|p| p.segments = 4);
    params.build().unwrap()
}

/// 1 kg on a link of law `law` at the distance `off` from where it hangs (with gravity) or lies (without).
fn held(gravity: f64, length: f64, law: RowLaw, off: Vector3<f64>) -> Scene {
    let mut scene = Scene::new("held");
    scene.gravity.z = -gravity;
    let at = Vector3::z() * -length + off;
    let load = scene.add_body("load", Body::particle(1.0).at(at));
    let link = link([origin(), centre(load)], length, law);
    scene.add_constraint("link", link, 0);
    scene
}

/// The first step asleep of at most so many.
fn falls_asleep(stepper: &mut Stepper, most: usize) -> Option<usize> {
    (0..most).find(|_| stepper.step().unwrap().asleep)
}

/// A spring of this period between the mass and its anchor, without gravity.
fn spring(period: f64, off: f64) -> Scene {
    let omega = std::f64::consts::TAU / period;
    let law = RowLaw::new(1.0 / (omega * omega), 0.0);
    held(0.0, 1.0, law, Vector3::z() * off)
}

#[test]
fn a_swing_does_not_sleep_where_it_turns() {
    let swing = |length: f64| {
        let off = Vector3::new(2e-3, 0.0, length - (length * length - 4e-6).sqrt());
        held(9.81, length, RowLaw::RIGID, off)
    };
    let swings = [0.5, 10.0, 100.0].map(swing);
    for scene in swings
        .into_iter()
        .chain([spring(3.0, 2e-3), spring(59.0, 2e-3)])
    {
        let [mut stepper, _] = both(&scene);
        assert_eq!(falls_asleep(&mut stepper, 4800), None);
    }
}

/// Modes of more than δ/4, of all periods from 2 w to P and in all phases, and of a tenth of that at P.
#[test]
fn the_means_foresee_no_rest_of_a_mode_that_goes_on() {
    let scene = spring(1.0, 0.0);
    let foreseen = |rest: &mut Rest, mode: &dyn Fn(f64) -> f64| {
        for k in 0..3 {
            let steps = (0..rest.third).map(|n| (k * rest.third + n + 1) as f64 / 60.0);
            let sum = steps.map(mode).sum::<f64>();
            rest.watch.sums[k][0] = [Vector3::x() * sum, Vector3::zeros()];
        }
        rest.is_foreseen(&scene)
    };
    for period in [2.0, 5.0, 20.0, 60.0, 3600.0] {
        let sleep = Sleep { period, ..SLEEP };
        let mut rest = Rest::new(&scene, &options(Some(sleep))).unwrap();
        for n in 0..=40 {
            let of_mode = 2.0 * (period / 2.0).powf(f64::from(n) / 40.0);
            let omega = std::f64::consts::TAU / of_mode;
            for phase in (0..120).map(|k| f64::from(k) * std::f64::consts::TAU / 120.0) {
                let mode = |t: f64| 0.255e-3 * (omega * t + phase).cos();
                assert!(!foreseen(&mut rest, &mode), "{of_mode} s of {period} s");
                let small = |t: f64| 0.1 * mode(t);
                assert!(n < 40 || foreseen(&mut rest, &small), "{period} s");
            }
        }
        assert!(!foreseen(&mut rest, &|t| 1.01e-3 / period * t));
    }
}

/// Slow relaxation without inertia to speak of, and a winch.
#[test]
fn what_creeps_does_not_sleep() {
    let scene = held(0.0, 1.0, RowLaw::new(1e-3, 1000.0), Vector3::z() * 0.05);
    let [mut stepper, _] = both(&scene);
    assert_eq!(falls_asleep(&mut stepper, 2400), None);
    let way = stepper.scene().bodies.position[0].z + 0.95;
    assert!((-3e-3..-1e-3).contains(&way), "{way}");
    let [mut stepper, _] = both(&gantry());
    stepper.set_control(1, 1e-9).unwrap();
    assert_eq!(falls_asleep(&mut stepper, 300), None);
}

/// Largest distance of a body from where the run without sleep has it, and the steps asleep of both runs' `steps`.
fn apart(scene: &Scene, steps: usize) -> (f64, usize) {
    let (mut most, mut asleep) = (0.0_f64, 0);
    let [mut sleeper, mut plain] = both(scene);
    for _ in 0..steps {
        let (a, b) = (sleeper.step().unwrap(), plain.step().unwrap());
        assert_eq!(a.time.to_bits(), b.time.to_bits());
        asleep += usize::from(a.asleep);
        let positions = |s: &Stepper| s.scene().bodies.position.clone();
        let pairs = positions(&sleeper).into_iter().zip(positions(&plain));
        let way = pairs.map(|(x, y)| (x - y).norm()).fold(0.0, f64::max);
        most = most.max(way);
    }
    (most, asleep)
}

#[test]
fn asleep_and_awake_are_no_farther_apart_than_the_distance() {
    let hoist = HoistParams::default().with(|p| (p.segments, p.mass_ratio) = (4, 100.0));
    let decaying = held(9.81, 2.0, RowLaw::new(0.1, 0.1), Vector3::zeros());
    // Its load swings by a tenth of a millimetre.
    let mut kicked = gantry();
    let load = kicked.load.unwrap();
    kicked.bodies.velocity[load].x = 1e-4;
    for (scene, steps) in [
        (kicked, 3000),
        (spring(40.0, 2e-4), 4800),
        (spring(0.3, 2e-4), 4800),
        (decaying, 3000),
        (hoist.build().unwrap(), 2400),
    ] {
        let (most, asleep) = apart(&scene, steps);
        assert!(asleep > steps / 4, "{}: {asleep}", scene.name);
        assert!(most > 0.0 && most <= SLEEP.distance, "{most}");
    }
}

/// State, multipliers and energies of a run: everything but its time.
fn observed(stepper: &Stepper) -> (Scene, Vec<f64>, [f64; 3]) {
    let energy = stepper.energy();
    let energies = [energy.kinetic, energy.gravity, energy.elastic];
    (
        stepper.scene().clone(),
        stepper.multipliers().to_vec(),
        energies,
    )
}

/// Both runs are at their first sleep.
fn at_rest(scene: &Scene) -> [Stepper; 2] {
    let [mut sleeper, mut plain] = both(scene);
    let steps = falls_asleep(&mut sleeper, 2000).expect("it sleeps");
    plain.steps(steps);
    assert_eq!(observed(&sleeper), observed(&plain));
    [sleeper, plain]
}

/// However long it has slept, the run goes on with the bits that it would have had, forces and balance included.
#[test]
fn waking_leaves_no_trace() {
    for asleep in [0, 37] {
        let [mut sleeper, mut plain] = at_rest(&gantry());
        for _ in 0..asleep {
            let report = sleeper.step().unwrap();
            assert!(report.asleep && report.solves == 0 && report.balance.is_some());
        }
        for n in 0..40 {
            for stepper in [&mut sleeper, &mut plain] {
                let force = Vector3::x() * f64::from(n + 1);
                stepper.set_load(2, force, Vector3::zeros()).unwrap();
            }
            let (a, b) = (sleeper.step().unwrap(), plain.step().unwrap());
            assert!(!a.asleep);
            assert_eq!((a.solves, a.balance), (b.solves, b.balance));
            assert_eq!(observed(&sleeper), observed(&plain));
        }
    }
}

#[test]
fn what_changes_something_wakes_it_and_nothing_else() {
    type Setting = fn(&mut Stepper) -> Result<(), StepError>;
    let zero = Vector3::zeros;
    let settings: [(Setting, bool); 8] = [
        (|s| s.set_control(1, 0.0), true),
        (|s| s.set_control(1, 0.01), false),
        (|s| s.set_load(2, Vector3::zeros(), Vector3::zeros()), true),
        (|s| s.set_load(2, Vector3::x(), Vector3::zeros()), false),
        (|s| s.change(|_| Ok(())), true),
        (|s| s.change(|edit| edit.set_load_body(None)), false),
        (|s| s.set_state(&s.scene().bodies.clone(), s.time()), false),
        (
            |s| {
                s.solve()?;
                s.advance()
            },
            false,
        ),
    ];
    let [sleeper, _] = at_rest(&gantry());
    let saved = sleeper.save().unwrap();
    assert_eq!(saved.scene().bodies.force[2], zero());
    for (n, (set, sleeps_on)) in settings.into_iter().enumerate() {
        let mut stepper = Stepper::restore(saved.clone()).unwrap();
        set(&mut stepper).unwrap();
        assert_eq!(stepper.step().unwrap().asleep, sleeps_on, "setting {n}");
    }
}

/// A run that is restored watches, sleeps and wakes in the same steps.
#[test]
fn a_restored_run_has_slept_as_long() {
    for steps in [30, 90] {
        let [mut stepper, _] = both(&gantry());
        stepper.steps(steps);
        let saved = stepper.save().unwrap();
        let mut again = Stepper::restore(saved.clone()).unwrap();
        assert_eq!(again.save().unwrap(), saved);
        for _ in 0..120 {
            let (a, b) = (stepper.step().unwrap(), again.step().unwrap());
            assert_eq!((a.asleep, a.balance), (b.asleep, b.balance));
            assert_eq!(observed(&stepper), observed(&again));
        }
        assert!(stepper.step().unwrap().asleep);
    }
}

#[test]
fn moved_points_and_events_come_in_time() {
    let mut scene = held(9.81, 1.0, RowLaw::new(1e-5, 0.0), Vector3::zeros());
    scene.start_in_equilibrium = true;
    scene.constraints[0].frames_mut()[0].side = Side::World(Motion::Smooth {
        displacement: Vector3::x(),
        start: 3.0,
        duration: 1.0,
    });
    scene
        .events
        .push(event("tied", When::Time(2.5), vec![Action::Release(0)]));
    let [mut stepper, _] = both(&scene);
    scene.events.clear();
    let [mut moved, _] = both(&scene);
    let last = |stepper: &mut Stepper| {
        let reports: Vec<_> = (0..200).map(|_| stepper.step().unwrap()).collect();
        let asleep = reports.iter().rfind(|report| report.asleep).unwrap();
        (asleep.time, asleep.events)
    };
    assert_eq!(last(&mut stepper), (stepper_time(150), 1));
    assert_eq!(last(&mut moved), (stepper_time(180), 0));
    assert!(stepper.scene().bodies.velocity[0].z < -1.0);
    assert!(moved.scene().bodies.velocity[0].x.abs() > 0.01);
}

/// The sum of so many steps \[s].
fn stepper_time(steps: usize) -> f64 {
    (0..steps).fold(0.0, |time, _| time + 1.0 / 60.0)
}

/// A driven box comes along and pushes a stack over.
#[test]
fn a_stack_sleeps_until_it_is_hit() {
    let params = ContactSceneParams::new(ContactScene::Stack).with(|p| p.count = Some(3));
    let mut scene = params.build().unwrap();
    let size = Vector3::repeat(params.length / 3.0);
    let at = Vector3::new(-1.2 * size.x, 0.0, 1.6 * size.z);
    let mut body = Body::cuboid(size, 1.0).at(at);
    body.mobility = Mobility::Driven;
    let ram = add(&mut scene, body, Shape::Cuboid { size }, Surface::default());
    let [mut sleeper, mut plain] = at_rest(&scene);
    let report = sleeper.step().unwrap();
    assert!(report.asleep && report.contacts.touching > 0);
    assert!(sleeper.contacts().any(|contact| contact.force.norm() > 1.0));
    let before = sleeper.scene().bodies.position.clone();
    for _ in 0..90 {
        for stepper in [&mut sleeper, &mut plain] {
            let speed = Vector3::x() * 2.0;
            stepper.set_velocity(ram, speed, Vector3::zeros()).unwrap();
            assert!(!stepper.step().unwrap().asleep);
        }
        assert_eq!(observed(&sleeper), observed(&plain));
    }
    let moved = |i: usize| (sleeper.scene().bodies.position[i] - before[i]).norm();
    assert!((0..3).any(|i| moved(i) > 0.1));
}

/// The least of both in turns: load elsewhere slows both.
#[test]
fn a_step_asleep_costs_a_tenth_of_one_awake_at_most() {
    let backend = Backend::preferred().unwrap_or(Backend::Dense(DenseOptions::default()));
    let scene = GantryParams::default().build().unwrap();
    let [mut asleep, mut moving] = [Some(SLEEP), None].map(|sleep| {
        let options = options(sleep).with(|o| o.backend = backend.clone());
        Stepper::new(scene.clone(), options).unwrap()
    });
    falls_asleep(&mut asleep, 2000).expect("it sleeps");
    let mut least = [f64::INFINITY; 2];
    for _ in 0..500 {
        for (stepper, least) in [&mut asleep, &mut moving].into_iter().zip(&mut least) {
            let speed = if stepper.options().sleep.is_some() {
                0.0
            } else {
                0.1
            };
            stepper.set_control(0, speed).unwrap();
            let start = std::time::Instant::now();
            assert_eq!(stepper.step().unwrap().asleep, speed == 0.0);
            *least = least.min(start.elapsed().as_secs_f64());
        }
    }
    let [asleep, moving] = least;
    assert!(asleep <= 0.1 * moving, "{asleep:e} s, {moving:e} s");
}

#[test]
fn options_out_of_range_are_named() {
    type Wrong = fn(&mut Sleep);
    let rows: [(Wrong, &str); 3] = [
        (|s| s.distance = 0.0, "sleep.distance"),
        (|s| s.after = f64::NAN, "sleep.after"),
        (|s| s.period = f64::INFINITY, "sleep.period"),
    ];
    for (wrong, named) in rows {
        let mut sleep = SLEEP;
        wrong(&mut sleep);
        let error = options(Some(sleep)).validate();
        assert!(matches!(error, Err(StepError::InvalidOption { field, .. }) if field == named));
    }
}

/// 100 kg on a rigid cable whose winch may hold so much \[N].
fn on_a_winch(winch: Winch) -> Scene {
    let mut scene = on_earth("winch");
    let load = Body::sphere(0.2, 100.0).at(Vector3::z() * -5.0);
    let load = scene.add_body("load", load);
    let ends = vec![origin(), centre(load)];
    let cable = reeled(winch, ends, 5.0, RowLaw::RIGID);
    scene.reeve("rope", &cable, 0).unwrap();
    scene
}

/// An arm of 1 m that a motor without speed holds out, 100 kg, with so much torque \[N m].
fn held_out(force_limit: f64) -> Scene {
    let mut scene = on_earth("arm");
    let arm = Body::sphere(0.2, 100.0).at(Vector3::x());
    let arm = scene.add_body("arm", arm);
    let axis = Vector3::y();
    let hinge = Hinge {
        motor: Some(Motor::speed(0.0).with(|p| p.force_limit = force_limit)),
        ..Hinge::new([
            origin().along(&axis),
            Frame::body(arm, -Vector3::x()).along(&axis),
        ])
    };
    scene.add_constraint("axle", hinge, 0);
    scene
}

/// Brakes, winches and motors that miss a part of what they have to hold, which accelerates, and those that miss nothing.
#[test]
fn what_gives_way_at_its_limit_stays_awake() {
    type Held = fn(f64) -> Scene;
    let kinds: [(&str, Held); 3] = [
        ("brake", |limit| on_a_winch(brake(limit))),
        ("winch", |force_limit| {
            on_a_winch(Winch::new().with(|w| w.force_limit = force_limit))
        }),
        // A weight would need less torque the farther the arm sinks.
        ("motor", |force_limit| {
            let mut scene = held_out(force_limit);
            scene.gravity.z = 0.0;
            scene.bodies.torque[0].y = 981.0;
            scene
        }),
    ];
    for (kind, held) in kinds {
        for missing in [1e-5, 1e-6, 1e-7, 1e-8] {
            let [mut stepper, _] = both(&held(981.0 * (1.0 - missing)));
            assert_eq!(falls_asleep(&mut stepper, 2400), None, "{kind} {missing:e}");
        }
        let [mut stepper, _] = both(&held(981.0 * (1.0 + 1e-6)));
        assert!(falls_asleep(&mut stepper, 300).is_some(), "{kind}");
    }
}

/// A motor that presses its arm of 1 m against a spring with all that it has moves nothing, and sleeps.
#[test]
fn a_motor_that_stalls_at_its_limit_sleeps() {
    let mut scene = held_out(50.0);
    scene.gravity.z = 0.0;
    if let Constraint::Hinge(hinge) = &mut scene.constraints[0] {
        hinge.motor = Some(Motor {
            target: Target::Position(1.0),
            force_limit: 50.0,
            law: RowLaw::RIGID,
        });
    }
    let frames = [Frame::world(Vector3::new(1.0, 0.0, 1.0)), centre(0)];
    let stop = link(frames, 1.0, RowLaw::new(1e-4, 0.2));
    scene.add_constraint("stop", stop, 0);
    let [mut stepper, _] = both(&scene);
    assert!(falls_asleep(&mut stepper, 2400).is_some());
    let axle = stepper.row_forces(0).unwrap();
    assert!((axle.last().unwrap().abs() - 50.0).abs() < 1e-9, "{axle:?}");
}
