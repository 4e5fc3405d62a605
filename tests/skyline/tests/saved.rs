//! Saved runs of a solver that was handed over as a value and is registered.

use taut_integrator::{StepOptions, Stepper};
use taut_model::HoistParams;
use taut_skyline::{SKYLINE, Skyline};

#[test]
fn a_run_of_a_registered_solver_is_restored_and_goes_on_with_the_same_bits() {
    let scene = HoistParams::default().build().expect("builds");
    let solver = Box::new(Skyline::default());
    let options = StepOptions::default();
    let capabilities = SKYLINE.capabilities;
    let mut stepper = Stepper::with_solver(scene, options, solver, capabilities).expect("steps");
    stepper.step().expect("steps");
    let run = stepper.save().expect("saved");
    let unknown = Stepper::restore(run.clone()).err().expect("not registered");
    assert!(unknown.to_string().contains("register it"), "{unknown}");
    taut_solver::register(&[SKYLINE]).expect("once");
    let mut restored = Stepper::restore(run).expect("restored");
    for _ in 0..10 {
        stepper.step().expect("steps");
        restored.step().expect("steps");
    }
    assert_eq!(stepper.scene(), restored.scene());
}
