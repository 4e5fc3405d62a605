//! Steps allocate nothing.

use std::hint::black_box;
use taut_measure::allocations::{self, Counting};
use taut_tests::machines::random_machine;
use taut_tests::prelude::*;
use taut_tests::scenes::{KINDS, free_cable, random_scene};

const DT: f64 = 1.0 / 240.0;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Calls of the allocator while `work` runs, in this thread.
fn calls(work: impl FnOnce()) -> u64 {
    allocations::during(work).1
}

#[test]
fn the_counter_counts() {
    assert_eq!(calls(|| drop(black_box(Box::new(1)))), 2);
    assert_eq!(calls(|| ()), 0);
    assert!(allocations::are_counted());
    let mut v = black_box(vec![1_u8]);
    assert_eq!(calls(|| v.reserve_exact(100)), 1);
    assert_eq!(black_box(v), [1]);
}

/// The backends whose documentation promises that steps allocate nothing.
fn promises(backend: &Backend) -> bool {
    let text = backend.to_string();
    let names = "banded gauss-seidel cg minres dense faer:llt faer:ldlt";
    names.split(' ').any(|name| text.starts_with(name))
}

/// After the first step none of the project's own backends allocates: with every kind of joint, in both forms, with and
/// without refinement, whichever way the step is made. Of the others the count is printed.
#[test]
fn steps_after_the_first_allocate_nothing() {
    const STEPS: usize = 10;
    let scenes = KINDS.map(|kind| (kind, free_cable(kind, 6, 1e-6, 1)));
    let mut scenes: Vec<_> = scenes.into();
    scenes.push(("all joints", random_scene(3)));
    scenes.push(("all kinds", random_machine(3)));
    for network in Network::ALL {
        let params = NetworkParams::new(network)
            .with(|p| (p.segments, p.cables, p.rows) = (8, 2, 3))
            .with(|p| p.columns = 4);
        scenes.push((network.name(), params.build().expect("builds")));
    }
    for model in ChainModel::ALL {
        let chain = ParticleChainParams::default()
            .with(|p| (p.model, p.horizontal, p.seed) = (model, false, 1));
        scenes.push((model.name(), chain.build().expect("builds")));
    }
    let mut faults = Vec::new();
    for choice in compiled() {
        let mut most = 0;
        for (kind, scene) in &scenes {
            for refinements in [0, 2] {
                let options = choice.options(DT).with(|o| o.refinements = refinements);
                let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
                stepper.step().expect("stable");
                let state = stepper.scene().bodies.clone();
                let mu = stepper.multipliers().to_vec();
                let steps = calls(|| {
                    taut_tests::steps(&mut stepper, STEPS);
                    stepper.set_state(&state, 0.5).expect("same scene");
                    stepper.set_multipliers(&mu).expect("same scene");
                    stepper.solve().expect("solvable");
                    stepper.advance().expect("finite");
                });
                if promises(&choice.backend) && steps > 0 {
                    faults.push(format!(
                        "{choice}, {kind}, {refinements} refinements: {steps}"
                    ));
                }
                most = most.max(steps);
            }
        }
        // UMFPACK allocates in C, which is not counted here.
        let each = most as f64 / (STEPS + 1) as f64;
        println!("{choice}: at most {each:.1} calls of the allocator a step");
    }
    let holds = faults.is_empty();
    assert!(holds, "calls in {} steps\n{}", STEPS + 1, faults.join("\n"));
}

/// A cable that lies on the ground, most of whose contacts stick.
#[test]
fn steps_with_contacts_at_rest_allocate_nothing() {
    let params = ContactSceneParams::new(ContactScene::Pile).with(|p| p.count = Some(1));
    let scene = params.build().expect("builds");
    for choice in compiled().into_iter().filter(|c| promises(&c.backend)) {
        let options = choice.options(DT);
        let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
        taut_tests::steps(&mut stepper, 60);
        let mut touching = 0;
        let steps = calls(|| {
            for _ in 0..10 {
                touching = stepper.step().expect("stable").contacts.touching;
            }
        });
        assert!(touching > 16, "{choice}: {touching}");
        assert_eq!(steps, 0, "{choice}");
    }
}

/// The places of the gantry's bounded rows: whether each is at a bound.
fn at_bounds(stepper: &Stepper) -> [bool; 3] {
    let (mu, bounds) = (stepper.multipliers(), &stepper.linearized().bounds);
    let at = |bound: f64, mu: f64| (bound * DT - mu).abs() <= 1e-12 * mu.abs();
    [0, 1, 2].map(|k| {
        let bound = &bounds[k];
        at(bound.lower, mu[bound.row]) || at(bound.upper, mu[bound.row])
    })
}

/// A gantry whose controls are set before every step, with jerks beyond the trolley's motor and the
/// winches, and times without.
#[test]
fn a_driven_gantry_allocates_nothing() {
    let params = GantryParams::default()
        .with(|p| (p.segments, p.trolley_force, p.winch_force) = (4, Some(200.0), Some(3200.0)));
    let scene = params.build().expect("builds");
    for choice in compiled().iter().filter(|c| promises(&c.backend)) {
        let mut stepper = Stepper::new(scene.clone(), choice.options(DT)).expect("sound");
        stepper.step().expect("stable");
        let (mut reached, mut left, mut before) = ([false; 3], [false; 3], [false; 3]);
        let steps = calls(|| {
            for n in 0..120 {
                let (trolley, hoist) = match n % 60 {
                    0..20 => (0.5, 0.4),
                    20..40 => (0.001, -0.2),
                    _ => (0.0, 0.0),
                };
                stepper.set_control(0, trolley).expect("a control");
                stepper.set_control(1, hoist).expect("a control");
                stepper.step().expect("stable");
                let now = at_bounds(&stepper);
                for k in 0..3 {
                    reached[k] |= now[k] && !before[k];
                    left[k] |= before[k] && !now[k];
                }
                before = now;
            }
        });
        assert_eq!((reached, left), ([true; 3], [true; 3]), "{choice}");
        assert_eq!(steps, 0, "{choice}");
    }
}

/// A step that fails takes the same way.
#[test]
fn a_step_that_fails_allocates_for_its_error_only() {
    let choice = Choice::schur(Backend::Dense(taut_solver::DenseOptions::default()));
    // Without the guard, which would try again.
    let mut stepper = Stepper::new(random_scene(3), choice.plain_options(DT)).expect("sound");
    stepper.step().expect("stable");
    let mut state = stepper.scene().bodies.clone();
    // Its square overflows.
    state.velocity[0].x = 1e200;
    stepper.set_state(&state, 0.0).expect("same scene");
    let calls = calls(|| assert!(stepper.step().is_err()));
    // The culprit's name, made and dropped.
    assert!(calls <= 2, "{calls}");
}

#[test]
fn steps_after_a_change_allocate_nothing() {
    let scene = HoistParams::default().build().expect("builds");
    let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
    stepper.step().expect("stable");
    let cut = stepper.change(|edit| edit.cut("cable", 11));
    cut.expect("the joint is there");
    let steps = calls(|| {
        taut_tests::steps(&mut stepper, 10);
    });
    assert_eq!(steps, 0);
}

#[test]
fn steps_with_rules_of_resolution_that_change_nothing_allocate_nothing() {
    let text = include_str!("../integrator/examples/rope.toml");
    let source = SceneSource::parse(text, &[]).expect("read");
    let mut stepper =
        Stepper::new(source.build().expect("built"), StepOptions::default()).expect("sound");
    let (mut calm, mut changed) = (0, 1);
    for _ in 0..300 {
        let (mut changes, mut contacts) = (0, 0);
        let calls = calls(|| {
            let report = stepper.step().expect("stable");
            changes = report.resolved.splits + report.resolved.merges;
            contacts = report.contacts.near;
        });
        // The first step after a change makes room, and so do those in which contacts come.
        if changes == 0 && changed == 0 && contacts == 0 {
            calm += 1;
            assert_eq!(calls, 0);
        }
        changed = changes;
    }
    assert!(calm > 100, "{calm}");
}
