use taut_output::check;
use taut_studies::hard;
use taut_tests::claims::audit;
use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;
const STEPS: usize = 60;

/// Every solver, with iterations that are soon over: what has no solution has none after more.
fn choices() -> Vec<Choice> {
    let mut all = hard::solvers();
    for choice in &mut all {
        choice.backend = choice.backend.with_iterations(200);
    }
    all
}

fn small() -> Scene {
    let params = HoistParams::default().with(|p| (p.segments, p.mass_ratio, p.seed) = (4, 10.0, 3));
    params.build().expect("sound parameters")
}

fn finite(stepper: &Stepper) -> bool {
    let bits = taut_tests::bits(stepper);
    bits.into_iter().all(|b| f64::from_bits(b).is_finite())
}

/// Runs for a second; true if all numbers of the last state are finite.
fn run(scene: Scene, options: StepOptions) -> Result<bool, StepError> {
    let mut stepper = Stepper::new(scene, options)?;
    for _ in 0..STEPS {
        stepper.step()?;
    }
    Ok(finite(&stepper))
}

fn stone() -> Scene {
    let mut scene = Scene::new("stone");
    scene.gravity = Vector3::new(0.0, 0.0, -9.81);
    scene.add_body("stone", Body::sphere(0.1, 2.0));
    scene
}

/// A stone on a ball joint beside its centre.
fn hung(mass: f64) -> Scene {
    let mut scene = stone();
    scene.bodies.mass[0] = mass;
    scene.bodies.inertia[0] = Matrix3::identity() * (0.004 * mass);
    scene.bodies.position[0].x = -0.3;
    let lever = Vector3::new(0.3, 0.0, 0.0);
    let joint = Constraint::Spherical(Spherical {
        frames: [origin(), Frame::body(0, lever)],
        stretch: RowLaw::RIGID,
    });
    scene.add_constraint("joint", joint, 0);
    scene
}

/// A stone on a link of that length, as far away as it is long.
fn linked(length: f64) -> Scene {
    let mut scene = stone();
    scene.bodies.position[0].x = length;
    let ends = [origin(), centre(0)];
    let link = Constraint::Distance(Distance {
        frames: ends,
        length,
        law: RowLaw::RIGID,
        transverse: false,
    });
    scene.add_constraint("link", link, 0);
    scene
}

fn under(gravity: f64) -> Scene {
    let mut scene = small();
    scene.gravity.z = -gravity;
    scene
}

/// A hoist of one segment that has no mass to speak of.
fn light() -> Result<Scene, SceneError> {
    let params = HoistParams::default().with(|p| (p.segments, p.mass_ratio) = (1, 1e-6));
    params.build()
}

/// Solvers that 10⁴ segments take more iterations than these have.
const UNFINISHED: [&str; 5] = [
    "gauss-seidel:joints",
    "gauss-seidel:groups",
    "cg:none",
    "cg:jacobi",
    "minres/kkt",
];

/// Scenes that are strange, and sound.
fn strange() -> [(&'static str, Scene); 7] {
    [
        ("10⁻³⁰ kg", hung(1e-30)),
        ("10³⁰ kg", hung(1e30)),
        ("link of 10¹² m", linked(1e12)),
        ("denormal gravity", under(1e-310)),
        ("one joint", hung(2.0)),
        ("no mass to speak of", light().expect("sound parameters")),
        ("parts", in_parts()),
    ]
}

/// A hoist, a stone that hangs beside it and a loose one.
fn in_parts() -> Scene {
    let mut scene = small();
    let stone = scene.add_body("stone", hung(2.0).bodies.get(0));
    let lever = Vector3::new(0.3, 0.0, 0.0);
    let joint = Spherical {
        frames: [origin(), Frame::body(stone, lever)],
        stretch: RowLaw::RIGID,
    };
    scene.add_constraint("beside", Constraint::Spherical(joint), 7);
    let loose = Body::sphere(0.1, 1.0).at(Vector3::new(9.0, 0.0, 0.0));
    scene.add_body("loose", loose);
    scene
}

#[test]
fn strange_scenes_run_with_every_solver() {
    for (name, scene) in strange() {
        for choice in choices() {
            let found = run(scene.clone(), choice.options(DT));
            assert!(found == Ok(true), "{name}, {choice}: {found:?}");
        }
        let solves = audit(&scene, &[0, 3, 40]).expect("sound");
        assert!(!solves.is_empty(), "{name}");
        let wrong = solves.iter().find(|s| s.is_wrong());
        assert_eq!(wrong, None, "{name}");
    }
}

/// Numbers at the ends of the range of doubles end in a typed error or a finite run.
#[test]
fn numbers_at_the_ends_of_their_range_leave_no_nan() {
    let scenes = [
        hung(1e-310),
        hung(1e-300),
        hung(1e300),
        linked(1e-310),
        linked(1e-9),
        under(1e300),
    ];
    let ends_well = |found: Result<bool, StepError>, place: &str| match found {
        Ok(finite) => assert!(finite, "{place}"),
        Err(
            StepError::InvalidOption { .. }
            | StepError::Scene(_)
            | StepError::NonFinite { .. }
            | StepError::Solve {
                culprit: Some(_), ..
            },
        ) => {}
        Err(e) => panic!("{place}: {e:?} names nothing"),
    };
    for choice in choices() {
        for (i, scene) in scenes.iter().enumerate() {
            let found = run(scene.clone(), choice.options(DT));
            ends_well(found, &format!("{choice}, scene {i}"));
        }
        for dt in [1e-320, 1e300] {
            let found = run(small(), choice.options(dt));
            ends_well(found, &format!("{choice}, {dt:e} s"));
        }
    }
}

/// 10⁴ segments: every solver carries their weight or says that it does not; the dense one says that they are too many.
#[test]
fn a_cable_of_ten_thousand_segments_is_carried_by_every_solver() {
    let segments = 10_000;
    let params = HoistParams::default()
        .with(|p| (p.segments, p.length) = (segments, 0.01 * segments as f64))
        .with(|p| (p.segment_mass, p.load_mass) = (Some(0.01), Some(1000.0)))
        .with(|p| p.joint = JointKind::Cosserat);
    let scene = params.hanging_equilibrium().expect("an equilibrium");
    let weight = scene.mass() * params.gravity;
    let dense = Choice::schur(Backend::Dense(DenseOptions::default()));
    let refused = Stepper::new(scene.clone(), dense.options(DT)).map(drop);
    let too_large = matches!(
        refused,
        Err(StepError::Solve {
            source: SolveError::TooLarge { .. },
            ..
        })
    );
    assert!(too_large, "{refused:?}");
    for choice in choices().iter().filter(|c| c.backend.name() != "dense") {
        let mut stepper = Stepper::new(scene.clone(), choice.plain_options(DT)).expect("sound");
        stepper.step().unwrap_or_else(|e| panic!("{choice}: {e}"));
        let report = stepper.step().unwrap_or_else(|e| panic!("{choice}: {e}"));
        let force = Vector3::from_column_slice(&stepper.multipliers()[..3]) / DT;
        let error = (force.norm() / weight - 1.0).abs();
        let honest = !report.solve.is_claim() && error <= check::UNCONVERGED;
        let unfinished = UNFINISHED.contains(&choice.family().as_str()) && honest;
        assert!(error <= 1e-8 || unfinished, "{choice}: {error:e}");
    }
}
