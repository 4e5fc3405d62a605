use taut_measure::trajectory::load_position;
use taut_model::scene_file::SceneText;
use taut_studies::scenes::reference_choice;
use taut_tests::machines::{random_machine, unbounded};
use taut_tests::prelude::*;
use taut_tests::scenes::random_scene;

const DT: f64 = 1.0 / 60.0;

fn run(scene: Scene, options: StepOptions, steps: usize) -> Vec<u64> {
    let mut stepper = Stepper::new(scene, options).expect("sound");
    taut_tests::steps(&mut stepper, steps);
    bits(&stepper)
}

fn swinging() -> Scene {
    let params = HoistParams::default()
        .with(|p| (p.segments, p.mass_ratio, p.move_x) = (10, 5.0, 0.5))
        .with(|p| p.seed = 3);
    params.build().expect("sound parameters")
}

/// A scene taken in the midst of its motion, written as text and read back, goes on as the scene itself.
#[test]
fn a_scene_written_in_motion_goes_on_with_the_same_bits() {
    let mut sources = vec![swinging()];
    for name in ["particles-b", "particles-f", "twist", "bend"] {
        let overrides = [("seed", "3"), ("damping", "0.001")];
        let source = SceneSource::load(name, &overrides).expect("a scene");
        sources.push(source.build().expect("sound parameters"));
    }
    sources.extend((1..=6).map(random_machine));
    for scene in sources {
        let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
        taut_tests::steps(&mut stepper, 20);
        let mut moved = stepper.scene().clone();
        moved.start_in_equilibrium = false;
        let text = SceneText::from_scene(&moved).expect("a text");
        let toml = SceneSource::Explicit(Box::new(text)).to_toml();
        let again = SceneSource::parse(&toml.expect("writes"), &[]).and_then(|s| s.build());
        let again = again.expect("reads");
        assert_eq!(format!("{again:?}"), format!("{moved:?}"));
        let name = moved.name.clone();
        let same = run(moved, StepOptions::default(), 10);
        assert_eq!(run(again, StepOptions::default(), 10), same, "{name}");
    }
}

fn net() -> Scene {
    let params = NetworkParams::new(Network::Net).with(|p| (p.rows, p.columns, p.seed) = (4, 5, 2));
    params.build().expect("sound parameters")
}

/// Twice in a row, and again while another thread does the same; unfinished solves as much as finished ones.
#[test]
fn the_same_run_gives_the_same_bits() {
    let unfinished = compiled_iterative().into_iter().map(|choice| Choice {
        backend: choice.backend.with_iterations(3),
        ..choice
    });
    let choices: Vec<Choice> = compiled().into_iter().chain(unfinished).collect();
    for (choice, scene) in choices
        .iter()
        .flat_map(|c| [(c, swinging()), (c, net()), (c, random_machine(3))])
    {
        let again = || run(scene.clone(), choice.options(DT), 60);
        let first = again();
        assert_eq!(first, again(), "{choice}");
        let threads = [0, 1].map(|_| {
            let (scene, options) = (scene.clone(), choice.options(DT));
            std::thread::spawn(move || run(scene, options, 60))
        });
        for thread in threads {
            assert_eq!(first, thread.join().expect("no panic"), "{choice}");
        }
    }
}

/// Solvers differ by rounding, which a motion that is not chaotic keeps small: after a second all loads are within 10⁻¹⁰ of
/// the scene's extent of the reference's.
#[test]
fn every_solver_ends_where_the_reference_does() {
    let hoist = HoistParams::default()
        .with(|p| (p.mass_ratio, p.segments, p.move_x) = (50.0, 10, 0.5))
        .with(|p| p.seed = 3);
    for scene in [
        hoist.hanging_equilibrium().expect("sound parameters"),
        net(),
    ] {
        let place = |options: StepOptions| {
            let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
            taut_tests::steps(&mut stepper, 60);
            load_position(stepper.scene())
        };
        let reference = place(reference_choice().options(DT));
        let places = scene.bodies.position.iter().map(nalgebra::Matrix::norm);
        let extent = places.fold(0.0, f64::max);
        for mut choice in taut_studies::hard::solvers() {
            choice.backend = choice.backend.with_tolerance(1e-14);
            let error = (place(choice.options(DT)) - reference).norm() / extent;
            assert!(error <= 1e-10, "{choice}, {}: {error:e}", scene.name);
        }
    }
}

/// Every direct solver with a scene of each kind.
fn direct_on_each() -> Vec<(Choice, Scene)> {
    let choices = compiled_direct();
    let pairs = choices.iter().flat_map(|choice| {
        let scenes = [random_scene(4), resettable(4)];
        scenes.map(|scene| (choice.clone(), scene))
    });
    pairs.collect()
}

/// A machine of which a state of the bodies is the whole state: without winches, whose drums have let out what they have,
/// and without bounds, as rows at bounds are looked for from where they were: the place is the same, the rounding not.
fn resettable(seed: u64) -> Scene {
    let mut scene = unbounded(random_machine(seed));
    scene.controls.clear();
    for constraint in &mut scene.constraints {
        if let Constraint::MasslessCable(cable) = constraint {
            cable.winch = None;
        }
    }
    scene
}

/// A direct step of the paper depends on the state alone, and one of the default on the state and the tension, where both are
/// set: not on what the stepper did before, nor on whether the guard was at work.
#[test]
fn a_direct_step_does_not_depend_on_the_past() {
    let step_from = |scene: &Scene, options: &StepOptions, sets_tension: bool, warmed_up: bool| {
        let mut stepper = Stepper::new(scene.clone(), options.clone()).expect("sound");
        if warmed_up {
            taut_tests::steps(&mut stepper, 7);
        }
        if warmed_up || sets_tension {
            stepper.set_state(&scene.bodies, 0.0).expect("same scene");
        }
        if sets_tension {
            let rows = stepper.multipliers().len();
            let tension: Vec<f64> = (0..rows).map(|r| (r as f64).sin() * 300.0).collect();
            stepper.set_tension(&tension).expect("as many rows");
            stepper.step().expect("solvable");
        }
        stepper.step().expect("solvable");
        bits(&stepper)
    };
    for (choice, scene) in direct_on_each() {
        for (options, sets_tension) in [(paper(&choice, DT), false), (choice.options(DT), true)] {
            let [cold, warm] = [false, true].map(|w| step_from(&scene, &options, sets_tension, w));
            assert_eq!(cold, warm, "{choice}, {}", scene.name);
        }
    }
}

/// `begin` once, `solve` and then `advance` is `step`, from the first one on, and after a state is set: `step` then finds the
/// tension that it needs, as `solve` does.
#[test]
fn the_two_halves_of_a_step_are_the_step() {
    for choice in compiled() {
        for scene in [random_scene(5), random_machine(5)] {
            for options in [paper(&choice, DT), unguarded(&choice, DT)] {
                for set in [false, true] {
                    let steppers = [(); 2].map(|()| {
                        let made = Stepper::new(scene.clone(), options.clone());
                        let mut stepper = made.expect("sound");
                        if set {
                            stepper.set_state(&scene.bodies, 0.0).expect("same scene");
                        }
                        stepper
                    });
                    let [mut whole, mut halves] = steppers;
                    for n in 0..5 {
                        whole.step().expect("solvable");
                        if n > 0 || !set {
                            halves.begin().expect("solvable");
                        }
                        halves.solve().expect("solvable");
                        halves.advance().expect("finite");
                    }
                    assert_eq!(bits(&whole), bits(&halves), "{choice}, set: {set}");
                }
            }
        }
    }
}
