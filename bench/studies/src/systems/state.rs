//! A scene at a moment, and one solve of its system.

use super::failed;
use super::turns::{self, Work};
use serde::{Deserialize, Serialize};
use taut_integrator::{GeometricStiffness, Phase, StepError, StepOptions, Stepper};
use taut_measure::reference::Snapshot;
use taut_model::Scene;
use taut_solver::{BackwardError, SolveReport, backward_error, forward_error};

/// From the pieces to the multipliers.
const PHASES: [Phase; 4] = [
    Phase::Assemble,
    Phase::Factorize,
    Phase::Solve,
    Phase::Refine,
];

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// From zero.
    #[default]
    Cold,
    /// From the multipliers of the step before.
    Warm,
}

impl Start {
    pub const ALL: [Self; 2] = [Self::Cold, Self::Warm];
}

/// A scene at a moment: with the tension that the geometric stiffness is made of it gives all solvers the same system.
#[derive(Debug)]
pub struct State {
    scene: Scene,
    moment: Snapshot,
    /// Impulses of the step that led there; zeros at the beginning \[N s, N m s].
    guess: Vec<f64>,
    /// The multipliers by the KKT system in extended precision \[N s, N m s].
    exact: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
pub struct Solved {
    pub iterations: usize,
    pub report: SolveReport,
    /// ‖μ − μ*‖∞ / ‖μ*‖∞.
    pub forward: f64,
    /// On the assembled system, S or the KKT matrix.
    pub backward: BackwardError,
}

impl State {
    /// The moment where a stepper is.
    pub fn of(scene: Scene, stepper: &mut Stepper) -> Result<Self, StepError> {
        let guess = stepper.multipliers().to_vec();
        let moment = Snapshot::of(stepper);
        // As solvers are put there: the past of the run is not part of the state.
        moment.put(stepper)?;
        Ok(Self {
            exact: stepper.reference_multipliers()?,
            scene,
            moment,
            guess,
        })
    }

    /// The moment after so many steps.
    pub fn after(steps: usize, scene: Scene, options: StepOptions) -> Result<Self, StepError> {
        let mut stepper = Stepper::new(scene.clone(), options)?;
        for _ in 0..steps {
            stepper.step()?;
        }
        Self::of(scene, &mut stepper)
    }

    /// The beginning, under the tension that the multipliers have there without geometric stiffness.
    pub fn tense(scene: Scene, options: &StepOptions) -> Result<Self, StepError> {
        let soft = StepOptions {
            stiffness: GeometricStiffness::Off,
            ..options.clone()
        };
        let impulses = Stepper::new(scene.clone(), soft)?.reference_multipliers()?;
        let mut stepper = Stepper::new(scene.clone(), options.clone())?;
        let mut moment = Snapshot::of(&stepper);
        moment.tension = impulses.iter().map(|mu| mu / options.dt).collect();
        moment.put(&mut stepper)?;
        Ok(Self {
            exact: stepper.reference_multipliers()?,
            guess: vec![0.0; impulses.len()],
            scene,
            moment,
        })
    }

    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    pub fn rows(&self) -> usize {
        self.exact.len()
    }

    pub fn exact(&self) -> &[f64] {
        &self.exact
    }

    /// Error of what an iteration starts from.
    pub fn guessed(&self, start: Start) -> f64 {
        match start {
            Start::Cold => 1.0,
            Start::Warm => forward_error(&self.guess, &self.exact),
        }
    }

    /// Puts a stepper of the scene there.
    pub fn put(&self, stepper: &mut Stepper, start: Start) -> Result<(), StepError> {
        self.moment.put(stepper)?;
        match start {
            Start::Cold => stepper.set_multipliers(&vec![0.0; self.guess.len()]),
            Start::Warm => stepper.set_multipliers(&self.guess),
        }
    }

    /// A stepper of the scene there.
    pub fn stepper(&self, options: StepOptions, start: Start) -> Result<Stepper, StepError> {
        let mut stepper = Stepper::new(self.scene.clone(), options)?;
        self.put(&mut stepper, start)?;
        Ok(stepper)
    }

    /// What a solve takes, from the pieces to the multipliers.
    pub fn work(&self, options: StepOptions, start: Start) -> Result<Work<'_>, StepError> {
        let mut stepper = self.stepper(options, start)?;
        Ok(Box::new(move |passes| {
            turns::sum(passes, || {
                self.put(&mut stepper, start)?;
                let phases = stepper.solve()?.phases;
                Ok([PHASES.map(|phase| phases.of(phase)).iter().sum(); 3])
            })
        }))
    }

    pub fn solve(&self, options: StepOptions, start: Start) -> Result<Solved, StepError> {
        let mut stepper = self.stepper(options, start)?;
        let report = stepper.solve()?;
        let (a, b, x) = stepper.system();
        Ok(Solved {
            iterations: report.iterations,
            report: report.solve,
            forward: forward_error(stepper.multipliers(), &self.exact),
            backward: backward_error(a, b, x).map_err(failed)?,
        })
    }
}
