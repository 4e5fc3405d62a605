//! One state of a scene in motion, and the rows of the solvers on it.

use super::search::Search;
use super::{ANGLE, Config, Record, Start, WARM_UP};
use crate::scenes;
use std::time::{Duration, Instant};
use taut_ground::choice::Choice;
use taut_ground::reference::Snapshot;
use taut_integrator::{Phase, StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Network, Scene};
use taut_solver::forward_error;

/// Fewest timed solves.
const REPEATS: usize = 3;

/// Phases that are timed.
const PHASES: [Phase; 4] = [
    Phase::Assemble,
    Phase::Factorize,
    Phase::Solve,
    Phase::Refine,
];

/// One state of a scene, and what is known of its solution.
pub(super) struct Case {
    pub(super) name: String,
    pub(super) size: usize,
    pub(super) mass_ratio: f64,
    pub(super) scene: Scene,
    pub(super) state: Snapshot,
    /// Impulses of the step that led there.
    pub(super) guess: Vec<f64>,
    pub(super) exact: Vec<f64>,
}

impl Case {
    pub(super) fn hoist(
        config: &Config,
        segments: usize,
        mass_ratio: f64,
    ) -> Result<Self, StepError> {
        let params = HoistParams {
            segments,
            mass_ratio,
            initial_angle: ANGLE,
            seed: 7,
            ..HoistParams::default()
        };
        Self::new(config, "hoist", segments, mass_ratio, params.build()?)
    }

    pub(super) fn network(
        config: &Config,
        network: Network,
        size: usize,
    ) -> Result<Self, StepError> {
        let scenes = scenes::Config::default();
        let mass_ratio = scenes.ratios.first().copied().unwrap_or(1.0);
        let params = scenes.params(network, size, mass_ratio);
        let scene = scenes::swinging(&params, config.dt)?;
        Self::new(config, network.name(), size, mass_ratio, scene)
    }

    fn new(
        config: &Config,
        name: &str,
        size: usize,
        mass_ratio: f64,
        scene: Scene,
    ) -> Result<Self, StepError> {
        let options = scenes::reference_choice().options(config.dt);
        let mut stepper = Stepper::new(scene, options)?;
        for _ in 0..WARM_UP {
            stepper.step()?;
        }
        let guess = stepper.multipliers().to_vec();
        let state = Snapshot::of(&stepper);
        state.put(&mut stepper)?;
        let exact = stepper.reference_multipliers()?;
        Ok(Self {
            name: name.to_owned(),
            size,
            mass_ratio,
            scene: stepper.into_scene(),
            state,
            guess,
            exact,
        })
    }

    /// Puts a stepper at the state, with the guess.
    fn put(&self, stepper: &mut Stepper, start: Start) -> Result<(), StepError> {
        self.state.put(stepper)?;
        match start {
            Start::Cold => stepper.set_multipliers(&vec![0.0; self.guess.len()]),
            Start::Warm => stepper.set_multipliers(&self.guess),
        }
    }

    pub(super) fn stepper(&self, options: StepOptions) -> Result<Stepper, StepError> {
        Stepper::new(self.scene.clone(), options)
    }

    /// Error of one solve.
    pub(super) fn error(&self, stepper: &mut Stepper, start: Start) -> Result<f64, StepError> {
        self.put(stepper, start)?;
        stepper.solve()?;
        Ok(forward_error(stepper.multipliers(), &self.exact))
    }

    /// Least time of a solve \[ns].
    pub(super) fn time(
        &self,
        config: &Config,
        stepper: &mut Stepper,
        start: Start,
    ) -> Result<f64, StepError> {
        let (begin, mut least, mut repeats) = (Instant::now(), f64::INFINITY, 0);
        while repeats < REPEATS || begin.elapsed() < config.timing_budget {
            self.put(stepper, start)?;
            let report = stepper.solve()?;
            let time: Duration = PHASES.map(|phase| report.phases.of(phase)).iter().sum();
            least = least.min(time.as_nanos() as f64);
            repeats += 1;
        }
        Ok(least)
    }

    /// A row before anything is known.
    pub(super) fn row(&self, backend: String, start: Option<Start>, target: f64) -> Record {
        Record {
            scene: self.name.clone(),
            size: self.size,
            mass_ratio: self.mass_ratio,
            rows: self.guess.len(),
            backend,
            start,
            target,
            iterations: None,
            error: f64::NAN,
            ns: None,
            direct_ns: None,
            failure: None,
        }
    }

    /// The direct solver's rows: without refinement, and with one where that is needed.
    pub(super) fn direct(&self, config: &Config) -> Result<Vec<Record>, StepError> {
        let choice = scenes::reference_choice();
        let mut found = Vec::new();
        for refinements in [0, 1] {
            let options = StepOptions {
                refinements,
                ..choice.plain_options(config.dt)
            };
            let mut stepper = self.stepper(options)?;
            let error = self.error(&mut stepper, Start::Cold)?;
            let ns = self.time(config, &mut stepper, Start::Cold)?;
            found.push((refinements, error, ns));
        }
        let rows = config.targets.iter().map(|&target| {
            let mut row = self.row(choice.family(), None, target);
            let reached = found.iter().filter(|(_, error, _)| *error <= target);
            let cheapest = reached.min_by(|a, b| a.2.total_cmp(&b.2));
            let last = found.last();
            row.error = cheapest.or(last).map_or(f64::NAN, |(_, error, _)| *error);
            row.iterations = cheapest.map(|(refinements, ..)| *refinements);
            row.ns = cheapest.map(|(.., ns)| *ns);
            row.direct_ns = row.ns;
            row
        });
        Ok(rows.collect())
    }

    /// The rows of an iterative solver from one start.
    pub(super) fn iterative(
        &self,
        config: &Config,
        choice: &Choice,
        start: Start,
        direct: &[Record],
    ) -> Vec<Record> {
        let mut search = Search {
            case: self,
            config,
            choice,
            start,
            known: Vec::new(),
        };
        let rows = config.targets.iter().zip(direct).map(|(&target, direct)| {
            let mut row = self.row(choice.family(), Some(start), target);
            row.direct_ns = direct.ns;
            if let Err(e) = search.fill(&mut row) {
                row.failure = Some(e.to_string());
            }
            row
        });
        rows.collect()
    }
}
