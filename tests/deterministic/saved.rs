use taut_tests::machines::random_machine;
use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;

/// Observable state of a stepper as bits: time, energies, impulses, gaps and drives; and its scene
/// as text.
fn observed(stepper: &Stepper) -> (Vec<u64>, String) {
    let energy = stepper.energy();
    let rows = stepper.linearized();
    let mut bits = vec![stepper.time().to_bits()];
    let numbers = [energy.kinetic, energy.gravity, energy.elastic];
    let all = numbers.iter().chain(stepper.multipliers());
    let all = all.chain(&rows.phi).chain(&rows.phi_t);
    bits.extend(all.map(|x| x.to_bits()));
    (bits, format!("{:?}", stepper.scene()))
}

/// Numbers of a step's report, without its times.
fn done(report: &StepReport) -> (usize, usize, bool, usize, u64) {
    (
        report.iterations,
        report.solves,
        report.redone,
        report.implicit_substeps,
        report.time.to_bits(),
    )
}

/// The run by way of JSON and of a binary format, which agree.
fn by_way_of_texts(saved: &SavedRun) -> SavedRun {
    let json = serde_json::to_string(saved).expect("writes");
    let from_json: SavedRun = serde_json::from_str(&json).expect("reads");
    let mut binary = Vec::new();
    ciborium::into_writer(saved, &mut binary).expect("writes");
    let from_binary: SavedRun = ciborium::from_reader(binary.as_slice()).expect("reads");
    assert_eq!(from_json, *saved);
    assert_eq!(from_binary, *saved);
    from_json
}

/// Controls before step `n` of a gantry: off, lift, stop, with jerks at which the winches slip. A
/// scene without controls runs by itself.
fn drive(stepper: &mut Stepper, n: usize) {
    if stepper.scene().controls.is_empty() {
        return;
    }
    let value = [0.0, 0.4, -0.3, 0.0][n / 7 % 4];
    for control in 0..stepper.scene().controls.len() {
        stepper.set_control(control, value).expect("a control");
    }
}

/// Saves after `first` steps, and takes `then` more with the run itself and with the restored one.
fn goes_on(scene: &Scene, options: &StepOptions, first: usize, then: usize, place: &str) -> usize {
    let mut stepper = Stepper::new(scene.clone(), options.clone()).expect("sound");
    let mut redone = 0;
    for n in 0..first {
        drive(&mut stepper, n);
        redone += usize::from(stepper.step().expect("a stable run").redone);
    }
    let saved = stepper.save().expect("a sound state");
    let mut again = Stepper::restore(by_way_of_texts(&saved)).expect("a sound run");
    assert_eq!(observed(&again), observed(&stepper), "{place}, restored");
    assert_eq!(again.save().expect("a sound state"), saved, "{place}");
    for n in first..first + then {
        let reports = [&mut stepper, &mut again].map(|stepper| {
            drive(stepper, n);
            stepper.step().expect("a stable run")
        });
        let [ours, theirs] = reports.map(|r| done(&r));
        assert_eq!(ours, theirs, "{place}, step {n}");
        assert_eq!(observed(&stepper), observed(&again), "{place}, step {n}");
        redone += usize::from(ours.2);
    }
    redone
}

fn swinging() -> Scene {
    let params = HoistParams::default()
        .with(|p| (p.segments, p.mass_ratio, p.initial_angle) = (7, 20.0, 0.5))
        .with(|p| (p.move_x, p.seed) = (0.5, 3));
    params.build().expect("sound parameters")
}

/// A gantry whose trolley and winches slip.
fn gantry() -> Scene {
    let params = GantryParams::default()
        .with(|p| (p.segments, p.winch_force, p.trolley_force) = (3, Some(3300.0), Some(500.0)));
    params.build().expect("sound parameters")
}

/// A swing whose middle is kicked aside: the guard redoes its first steps.
fn kicked() -> Scene {
    let mut scene = swinging();
    scene.bodies.velocity[2..5].fill(Vector3::y() * 5.0);
    scene
}

fn scenes() -> Vec<Scene> {
    let mut scenes = vec![kicked(), gantry(), random_machine(3), random_machine(5)];
    for name in ["particles-f", "twist", "junction"] {
        let source = SceneSource::load(name, &[("seed", "3")]).expect("a scene");
        scenes.push(source.build().expect("sound parameters"));
    }
    scenes
}

#[test]
fn every_scheme_goes_on_with_the_same_bits() {
    let mut redone = 0;
    for scene in scenes() {
        for scheme in Scheme::KINDS {
            for (guard, stiffness) in [
                (None, GeometricStiffness::Inertia { alpha: 0.4 }),
                (
                    Some(Guard::default()),
                    GeometricStiffness::Inertia { alpha: 0.4 },
                ),
                (
                    Some(Guard::default().with(|g| (g.tolerance, g.hold) = (1e-5, 3))),
                    GeometricStiffness::Inertia { alpha: 0.5 },
                ),
                (
                    Some(Guard::default().with(|g| g.tolerance = f64::INFINITY)),
                    GeometricStiffness::Inertia { alpha: 0.9 },
                ),
            ] {
                let options = StepOptions::default()
                    .with(|o| (o.scheme, o.guard, o.stiffness) = (scheme, guard, stiffness))
                    .with(|o| o.substeps = 2);
                let place = format!("{}, {scheme}, {guard:?}", scene.name);
                for first in [0, 1, 9] {
                    redone += goes_on(&scene, &options, first, 6, &place);
                }
            }
        }
    }
    let holds = redone > 100;
    assert!(holds, "{redone} steps redone: the guard was hardly at work");
}

/// Iterations start from the last step's multipliers: they too are part of the state.
#[test]
fn every_solver_goes_on_with_the_same_bits() {
    for scene in [swinging(), gantry(), random_machine(5)] {
        for choice in compiled() {
            let options = choice.options(DT);
            let text = &format!("{}, {choice}", scene.name);
            goes_on(&scene, &options, 11, 8, text);
        }
        let words = "cg:jacobi:iterations=7 gauss-seidel:groups:trial:iterations=3 \
            cg:group:tolerance=1e-4";
        for few in words.split(' ') {
            let backend: taut_solver::Backend = few.parse().expect("a backend");
            if !backend.is_compiled() {
                continue;
            }
            let options = StepOptions::default()
                .with(|o| (o.backend, o.refinements, o.guard) = (backend, 1, None));
            goes_on(&scene, &options, 2, 4, &format!("{}, {few}", scene.name));
        }
    }
}

#[test]
fn what_was_set_by_hand_is_saved() {
    let mut stepper = Stepper::new(gantry(), StepOptions::default()).expect("sound");
    taut_tests::steps(&mut stepper, 5);
    let rail = (stepper.scene().constraints.iter()).position(|c| c.motor().is_some());
    let rail = rail.expect("a motor");
    stepper.set_motor(rail, Motor::speed(0.2)).expect("a motor");
    let rows = stepper.multipliers().len();
    stepper
        .set_tension(&vec![-70.0; rows])
        .expect("as many rows");
    stepper
        .set_multipliers(&vec![-1.5; rows])
        .expect("as many rows");
    let saved = stepper.save().expect("a sound state");
    let found = (saved.version(), saved.time());
    assert_eq!(found, (SavedRun::VERSION, stepper.time()));
    assert_eq!(saved.scene().name, "gantry");
    assert_eq!(saved.options(), stepper.options());
    let mut again = Stepper::restore(by_way_of_texts(&saved)).expect("a sound run");
    for _ in 0..5 {
        stepper.step().expect("a stable run");
        again.step().expect("a stable run");
    }
    assert_eq!(observed(&stepper), observed(&again));
}

/// Between a solve and its advance there is nothing to save: what was solved for is not the state alone.
#[test]
fn half_a_step_is_not_saved() {
    for form in [Form::Schur, Form::Kkt] {
        let options = StepOptions::default().with(|o| (o.form, o.guard) = (form, None));
        let mut stepper = Stepper::new(swinging(), options).expect("sound");
        stepper.solve().expect("solvable");
        let error = stepper.save().expect_err("half a step").to_string();
        assert!(error.contains("advance"), "{error}");
        stepper.advance().expect("finite");
        assert!(stepper.save().is_ok());
    }
}

/// The impulses of a step that the guard has redone are spent.
#[test]
fn a_redone_step_is_not_advanced_again() {
    let guard = Guard::default().with(|g| g.tolerance = f64::MIN_POSITIVE);
    let options = StepOptions::default().with(|o| o.guard = Some(guard));
    let mut stepper = Stepper::new(swinging(), options).expect("sound");
    assert!(stepper.step().expect("a stable run").redone);
    assert!(stepper.save().is_ok());
    let error = stepper.advance().expect_err("nothing is solved");
    assert!(error.to_string().contains("solve"), "{error}");
}

/// Reports survive a round trip, NaN and infinite limits too, in formats that know neither.
#[test]
fn reports_round_trip() {
    for choice in compiled() {
        let scene = HoistParams::default().with(|p| p.segments = 4);
        let scene = scene.build().expect("sound");
        let mut stepper = Stepper::new(scene, choice.options(DT)).expect("sound");
        let report = stepper.step().expect("a step");
        let json = serde_json::to_string(&report).expect("writes");
        let read: StepReport = serde_json::from_str(&json).expect("reads");
        // NaN of a direct solver's residual differs from itself.
        let found = format!("{read:?}");
        assert_eq!(found, format!("{report:?}"), "{choice}: {json}");
        let backend = serde_json::to_string(&choice.backend).expect("writes");
        assert_eq!(backend, format!("\"{}\"", choice.backend), "{choice}");
        let read: taut_solver::Backend = serde_json::from_str(&backend).expect("reads");
        assert_eq!(read, choice.backend);
    }
}

/// A winch that gives way to its load, stands at the end of its empty drum and hauls in again: its first segment is cut, stalls
/// and goes on within the steps between which the run is saved.
#[test]
fn a_drum_that_runs_empty_goes_on_with_the_same_bits() {
    let text = r#"
        load = "load"
        gravity = [0, 0, -9.81]
        [[body]]
        name = "load"
        mass = 100.0
        shape = { sphere = { radius = 0.25 } }
        velocity = [0.05, 0.0, 0.0]
        [[cable]]
        name = "rope"
        from = { body = "world", point = [0.0, 0.0, 3.25] }
        to = { body = "load", point = [0, 0, 0.25] }
        segments = 5
        ea = 981000.0
        ei = 9.81
        gj = 9.81
        mass_per_length = 0.1
        winch = { since = 0, force_limit = 490.5, shortest = 2.8, longest = 3.2 }
        [[control]]
        name = "hoist"
        drives = [{ joint = "rope" }]
        [[event]]
        name = "haul"
        at = 0.1
        set = [{ control = "hoist", value = -0.5 }]
    "#;
    let source = SceneSource::parse(text, &[]).expect("a scene");
    for (substeps, guard) in [(1, None), (16, None), (16, Some(Guard::default()))] {
        let options = StepOptions::default().with(|o| (o.substeps, o.guard) = (substeps, guard));
        let scene = source.build().expect("sound");
        let mut stepper = Stepper::new(scene, options).expect("sound");
        let mut stood = 0;
        for n in 0..60 {
            let saved = stepper.save().expect("a sound state");
            let mut again = Stepper::restore(saved).expect("a sound run");
            for stepper in [&mut stepper, &mut again] {
                stepper.step().expect("a stable run");
            }
            assert_eq!(observed(&stepper), observed(&again), "{substeps} {n}");
            stood +=
                usize::from(format!("{:?}", stepper.scene().constraints).contains("stalled: true"));
        }
        assert!(stood > 5, "{substeps}: {stood}");
    }
}

/// A run that is saved asleep tells what its contacts carry: no step of it finds them.
#[test]
fn a_run_saved_asleep_tells_its_contacts() {
    let text = "load = 'b'\n[[body]]\nname = 'b'\nmass = 100\nshape = { box = { size = [1, 1, 1] } }\nposition = [0, 0, 0.5]\n\
                collide = { friction = 0.4 }\n[[ground]]\nname = 'g'\nfriction = 0.4\n\
                [[body]]\nname = 'hangs'\nmass = 10\nshape = { sphere = { radius = 0.2 } }\nposition = [3, 0, 3]\ncollide = {}\n\
                [[massless_cable]]\nname = 'rope'\nthrough = [{ body = 'world', point = [3, 0, 5] }, { body = 'hangs' }]\n\
                tension = 98.1\nstretch = 1e-6\n";
    let scene = SceneSource::parse(text, &[]).and_then(|source| source.build());
    let options = StepOptions::default().with(|o| o.sleep = Some(Sleep::default()));
    let mut stepper = Stepper::new(scene.expect("a scene"), options).expect("sound");
    while !stepper.step().expect("a stable run").asleep {
        assert!(stepper.time() < 10.0);
    }
    let load = |stepper: &Stepper| stepper.contacts().map(|c| c.on(0).z).sum::<f64>();
    let before = load(&stepper);
    let mut again = Stepper::restore(stepper.save().expect("a sound state")).expect("a sound run");
    for _ in 0..3 {
        assert!(again.step().expect("a stable run").asleep);
        assert!((load(&again) / before - 1.0).abs() < 1e-9 && (before - 981.0).abs() < 1e-3);
        assert_eq!(again.contacts().count(), stepper.contacts().count());
    }
}

/// Winch of a cable of segments that an event sets in each step, beside a rope whose load bounces on it: a divided step ends at its
/// own time, to which the cable has to be cut.
#[test]
fn a_divided_step_in_which_a_winch_is_set_leaves_nothing_unsaved() {
    let mut text = "load = 'load'\n[[body]]\nname = 'load'\nmass = 100\nshape = 'particle'\nposition = [0, 0, 0]\nvelocity = [0.05, 0, 0]\n\
                    [[cable]]\nname = 'rope'\nfrom = { body = 'world', point = [0, 0, 3.25] }\nto = { body = 'load' }\n\
                    segments = 2\nea = 981e3\nei = 9.81\ngj = 9.81\nmass_per_length = 0.1\ndamping = 0\nwinch = { since = 0 }\n\
                    [[body]]\nname = 'bounces'\nmass = 10\nshape = 'particle'\nposition = [5, 0, -1]\nvelocity = [0, 0, -3]\n\
                    [[massless_cable]]\nname = 'other'\nthrough = [{ body = 'world', point = [5, 0, 0] }, { body = 'bounces' }]\n\
                    slack = 0.3\nstretch = 1e-5\n\
                    [[control]]\nname = 'hoist'\ndrives = [{ joint = 'rope' }]\n"
        .to_owned();
    for step in 6..60 {
        let (at, value) = (f64::from(step) * DT, 0.5 - 0.01 * f64::from(step % 5));
        text += &format!(
            "[[event]]\nname = 'turn-{step}'\nat = {at}\nset = [{{ control = 'hoist', value = {value} }}]\n"
        );
    }
    let scene = SceneSource::parse(&text, &[]).and_then(|source| source.build());
    let options = StepOptions::default().with(|o| o.guard = Some(Guard::default()));
    let mut stepper = Stepper::new(scene.expect("a scene"), options).expect("sound");
    let mut divided = 0;
    for step in 0..60 {
        let saved = stepper.save().expect("a sound state");
        let mut again = Stepper::restore(saved).expect("a sound run");
        divided += stepper.step().expect("a stable run").divided;
        again.step().expect("a stable run");
        assert_eq!(observed(&stepper), observed(&again), "step {step}");
    }
    assert!(divided > 3, "{divided} divided steps");
}
