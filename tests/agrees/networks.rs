use taut_measure::reference::{Snapshot, reference_choice};
use taut_measure::trajectory::load_position;
use taut_output::check::UNCONVERGED;
use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;

/// Bar of multipliers against 32 digits, and of the load's place, over the extent of the network.
const BAR: f64 = 1e-8;

/// Steps of a solver from the start, and of the swing before the multipliers are compared.
const SECOND: usize = 60;
const WARM_UP: usize = 20;

/// The network in its equilibrium, swinging as a whole about the line of its anchors.
fn swinging(network: Network) -> Scene {
    let mut params = NetworkParams::new(network).with(|p| (p.mass_ratio, p.seed) = (100.0, 1));
    match network {
        Network::Ladder => (params.segments, params.cables) = (12, 2),
        Network::Net => (params.rows, params.columns) = (4, 4),
        Network::Ring => params.segments = 12,
        Network::Junction => params.segments = 4,
        _ => params.segments = 6,
    }
    let scene = params.build().expect("sound parameters");
    let stepper = Stepper::new(scene, reference_choice().plain_options(DT));
    let mut scene = stepper.expect("an equilibrium").into_scene();
    let (spin, bodies) = (Vector3::x() * 0.2, &mut scene.bodies);
    for i in 0..bodies.len() {
        bodies.velocity[i] += spin.cross(&bodies.position[i]);
        if !bodies.is_point(i) {
            bodies.angular_velocity[i] += spin;
        }
    }
    scene
}

fn stepped(scene: &Scene, options: StepOptions, steps: usize) -> Stepper {
    let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
    taut_tests::steps(&mut stepper, steps);
    stepper
}

/// Ring, junction, cranes, ladder and net: multipliers of a moment of the swing; a direct solver's load is where that of
/// the reference solver is after a second; an iteration of a thousand that is not as exact does not claim to be.
#[test]
fn every_solver_agrees_on_networks() {
    for network in Network::ALL {
        let start = swinging(network);
        let places = start.bodies.position.iter();
        let reach = places.map(|x| (x - start.bodies.position[0]).amax());
        let extent = reach.fold(0.0, f64::max);
        let options = reference_choice().plain_options(DT);
        let load = load_position(stepped(&start, options.clone(), SECOND).scene());
        let mut motion = stepped(&start, options, WARM_UP);
        let (moment, guess) = (Snapshot::of(&motion), motion.multipliers().to_vec());
        moment.put(&mut motion).expect("a moment of its own");
        let exact = motion.reference_multipliers().expect("solvable");
        for choice in Choice::all().into_iter().filter(|c| c.check().is_ok()) {
            let place = format!("{} with {choice}", network.name());
            let iterates = choice.backend.is_iterative();
            let backend = choice.backend.with_iterations(1000);
            let options = Choice {
                backend,
                form: choice.form,
            }
            .plain_options(DT);
            let mut stepper = Stepper::new(start.clone(), options.clone()).expect("sound");
            moment.put(&mut stepper).expect("a moment of the scene");
            stepper.set_multipliers(&guess).expect("as many rows");
            let said = stepper.solve();
            let said = said.unwrap_or_else(|e| panic!("{place}: {e}")).solve;
            let error = forward_error(stepper.multipliers(), &exact);
            let unfinished = iterates && !said.is_claim() && error <= UNCONVERGED;
            assert!(error <= BAR || unfinished, "{place}: {error:e}, {said:?}");
            if !iterates {
                let way = load_position(stepped(&start, options, SECOND).scene()) - load;
                assert!(way.norm() <= BAR * extent, "{place}: {way:?}");
            }
        }
    }
}
