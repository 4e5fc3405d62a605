//! Common state of the cases of a scene, from which steps are measured, and the references of their
//! errors.

use super::cases::{Case, DT, Workload};
use super::measures::{Measure, Missing};
use nalgebra::Vector3;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_measure::allocations;
use taut_measure::choice::Choice;
use taut_measure::errors::worse;
use taut_measure::reference::Snapshot;
use taut_measure::trajectory::load_position;
use taut_model::Scene;
use taut_solver::{backward_error, forward_error};
use taut_studies::scenes::{WARM_UP, reference_choice};
use taut_studies::statics;

/// Steps of a pass, from the common state.
pub const PASS: usize = 30;
/// Steps of the motion whose load error is measured: a second.
const MOTION: usize = 60;
/// How much finer the steps are that it is compared with.
const FINER: usize = 16;

/// A scene and its common state, some steps from its beginning.
pub(super) struct Start {
    workload: Workload,
    scene: Scene,
    state: Snapshot,
    guess: Vec<f64>,
}

impl Start {
    pub(super) fn new(workload: Workload) -> Result<Self, StepError> {
        let scene = workload.scene()?;
        let mut stepper = workload.stepper(scene.clone(), reference_choice().options(DT))?;
        for _ in 0..WARM_UP {
            stepper.step()?;
        }
        let guess = stepper.multipliers().to_vec();
        let state = Snapshot::of(&stepper);
        Ok(Self {
            workload,
            scene,
            state,
            guess,
        })
    }

    /// Puts a stepper into the common state. Allocates nothing.
    pub(super) fn put(&self, stepper: &mut Stepper) -> Result<(), StepError> {
        self.state.put(stepper)?;
        stepper.set_multipliers(&self.guess)
    }

    /// The scene at its beginning.
    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// A stepper in the common state.
    pub(super) fn stepper(&self, choice: &Choice) -> Result<Stepper, StepError> {
        self.stepper_with(choice.options(DT))
    }

    fn stepper_with(&self, options: StepOptions) -> Result<Stepper, StepError> {
        let mut stepper = self.workload.stepper(self.scene.clone(), options)?;
        self.put(&mut stepper)?;
        Ok(stepper)
    }

    /// The load after each step of the motion, whose steps are `finer` times shorter than Δt.
    fn motion(&self, choice: &Choice, finer: usize) -> Result<Vec<Vector3<f64>>, StepError> {
        let options = choice.options(DT / finer as f64);
        let mut stepper = self.workload.stepper(self.scene.clone(), options)?;
        let frame = |_| {
            for _ in 0..finer {
                stepper.step()?;
            }
            Ok(load_position(stepper.scene()))
        };
        (0..MOTION).map(frame).collect()
    }
}

/// A start with the references of its errors.
pub(super) struct Judged {
    pub(super) start: Start,
    exact: Vec<f64>,
    load: Vec<Vector3<f64>>,
}

impl Judged {
    pub(super) fn new(workload: Workload) -> Result<Self, StepError> {
        let start = Start::new(workload)?;
        let exact = start
            .stepper(&reference_choice())?
            .reference_multipliers()?;
        let load = start.motion(&reference_choice(), FINER)?;
        Ok(Self { start, exact, load })
    }

    fn error(&self, case: &Case, choice: &Choice, measure: Measure) -> Result<f64, StepError> {
        match measure {
            Measure::ForwardError => {
                let mut stepper = self.start.stepper(choice)?;
                stepper.solve()?;
                Ok(forward_error(stepper.multipliers(), &self.exact))
            }
            Measure::BackwardError => {
                let mut stepper = self.start.stepper_with(StepOptions {
                    refinements: 0,
                    ..choice.options(DT)
                })?;
                stepper.solve()?;
                // Without a matrix of its own a solver has one here.
                let (a, b) = stepper.assembled(choice.form)?;
                let (.., x) = stepper.system();
                let errors = backward_error(&a, &b, x).map_err(|source| StepError::Solve {
                    source,
                    culprit: None,
                    time: stepper.time(),
                })?;
                Ok(errors.componentwise)
            }
            Measure::LoadError => {
                let motion = self.start.motion(choice, 1)?;
                let pairs = motion.iter().zip(&self.load);
                let off = pairs.map(|(ours, finer)| (ours - finer).norm());
                Ok(off.fold(0.0, worse))
            }
            _ => {
                let params = case.workload.hoist().unwrap_or_default();
                Ok(statics::hold(&params, &choice.options(DT))?.error)
            }
        }
    }

    /// Figure that is independent of the machine, except instructions.
    pub(super) fn figure(
        &self,
        case: &Case,
        choice: &Choice,
        measure: Measure,
    ) -> Result<f64, Missing> {
        let figure = match measure {
            Measure::Allocations if !allocations::are_counted() => {
                let why = "this program's allocator does not count".to_owned();
                return Err(Missing::NotMeasured(why));
            }
            Measure::Allocations => calls_per_step(&self.start, choice),
            _ => self.error(case, choice, measure),
        };
        Ok(figure?)
    }
}

/// Calls of the allocator in a step, after the first pass.
fn calls_per_step(start: &Start, choice: &Choice) -> Result<f64, StepError> {
    let mut stepper = start.stepper(choice)?;
    run(&mut stepper, PASS)?;
    start.put(&mut stepper)?;
    let (done, calls) = allocations::during(|| run(&mut stepper, PASS));
    done.map(|()| calls as f64 / PASS as f64)
}

fn run(stepper: &mut Stepper, steps: usize) -> Result<(), StepError> {
    (0..steps).try_for_each(|_| stepper.step().map(|_| ()))
}

/// `steps` steps of a case from its common state: what runs where instructions are counted.
pub fn steps(case: &Case, steps: usize) -> Result<(), String> {
    let choice = case.choice()?;
    let stepped = || {
        let start = Start::new(case.workload)?;
        run(&mut start.stepper(&choice)?, steps)
    };
    stepped().map_err(|e: StepError| e.to_string())
}
