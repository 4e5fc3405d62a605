//! Solvers that step the same scene in turns.

use super::{Config, RATIO, Record, STEPS, source};
use crate::scenes::swing;
use std::time::Duration;
use taut_ground::choice::Choice;
use taut_ground::errors::worse;
use taut_ground::trajectory::Timing;
use taut_integrator::{SavedRun, StepError, StepReport, Stepper};
use taut_model::{Scene, SceneSource};
use taut_output::check::ExperimentError;
use taut_solver::Backend;

/// Steps before anything is timed.
const WARM_UP: usize = 4;

/// Times that the analysis is made.
const ANALYSES: usize = 9;

/// How many times the fastest's time the others may take in the warm-up: none of them is the fastest in the end.
const RIVALS: f64 = 3.0;

/// Rows beyond which a dense solver does not take part.
pub(super) const DENSE_ROWS: usize = 600;

/// Most steps of a round: motions without guard do not last for ever.
const MOST: usize = 300;

/// A solver with the times of its steps in each round \[ns].
struct Contestant {
    choice: Choice,
    stepper: Stepper,
    /// Where each round begins.
    start: SavedRun,
    warm: f64,
    rounds: Vec<f64>,
}

impl Contestant {
    fn new(scene: &Scene, choice: &Choice, dt: f64) -> Result<Self, StepError> {
        let stepper = Stepper::new(scene.clone(), choice.plain_options(dt))?;
        let mut contestant = Self {
            choice: choice.clone(),
            start: stepper.save()?,
            stepper,
            warm: f64::NAN,
            rounds: Vec::new(),
        };
        // The first step makes memory.
        steps(&mut contestant.stepper, 1)?;
        contestant.warm = total(&steps(&mut contestant.stepper, WARM_UP - 1)?).min;
        Ok(contestant)
    }

    fn visit(&mut self, count: usize) -> Result<(), StepError> {
        self.stepper = Stepper::restore(self.start.clone())?;
        // The first step makes memory.
        steps(&mut self.stepper, 1)?;
        let reports = steps(&mut self.stepper, count)?;
        self.rounds.push(total(&reports).median);
        Ok(())
    }

    /// The median of its rounds.
    fn median(&self) -> f64 {
        median(self.rounds.clone())
    }
}

/// So many steps.
pub(super) fn steps(stepper: &mut Stepper, count: usize) -> Result<Vec<StepReport>, StepError> {
    (0..count).map(|_| stepper.step()).collect()
}

/// Times of whole steps.
fn total(reports: &[StepReport]) -> Timing {
    Timing::of(reports.iter().map(|r| r.phases.total()))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The scene where it rests, if it has an equilibrium that is asked for; cables and nets swing from there on, for at rest an
/// iteration begins with its solution.
pub(super) fn start(name: &str, dt: f64) -> Result<Scene, ExperimentError> {
    let source = source(name)?;
    let built = source.build()?;
    let auto = Choice::schur(Backend::Auto).plain_options(dt);
    let unstrained = Scene {
        start_in_equilibrium: false,
        ..built.clone()
    };
    let mut scene = match Stepper::new(built, auto) {
        Ok(stepper) => stepper.into_scene(),
        Err(StepError::NoEquilibrium { .. }) => unstrained,
        Err(e) => return Err(e.into()),
    };
    if matches!(source, SceneSource::Hoist(_) | SceneSource::Network(_)) {
        swing(&mut scene);
    }
    Ok(scene)
}

/// `auto` on a scene beside the others.
pub(super) fn record(config: &Config, name: &str) -> Result<Record, ExperimentError> {
    let scene = start(name, config.dt)?;
    let auto = Choice::schur(Backend::Auto);
    let mut own = Contestant::new(&scene, &auto, config.dt)?;
    let rows = own.stepper.linearized().rows();
    let takes_part = |c: &&Choice| rows <= DENSE_ROWS || !matches!(c.backend, Backend::Dense(_));
    let choices = config.choices.iter().filter(takes_part);
    // Solvers that do not take the scene drop out.
    let contestants = choices.filter_map(|c| Contestant::new(&scene, c, config.dt).ok());
    let mut others: Vec<Contestant> = contestants.collect();
    let fastest = others.iter().map(|c| c.warm).fold(own.warm, f64::min);
    others.retain(|c| c.warm <= RIVALS * fastest);
    let count = (config.round.as_nanos() as f64 / fastest).ceil() as usize;
    let count = count.clamp(1, MOST);
    for _ in 0..config.rounds {
        own.visit(count)?;
        others.retain_mut(|c| c.visit(count).is_ok());
    }
    let best = others
        .iter()
        .min_by(|a, b| a.median().total_cmp(&b.median()))
        .ok_or("no other solver takes the scene")?;
    let ratios = own.rounds.iter().zip(&best.rounds);
    let ratio = median(ratios.map(|(own, best)| own / best).collect());
    let analysis = analysis(&scene, &own)?;
    let step_ns = own.median();
    let chosen = own.stepper.chosen().ok_or("`auto` chose no solver")?;
    let analysis_steps = analysis.as_nanos() as f64 / step_ns;
    Ok(Record {
        scene: name.to_owned(),
        rows,
        chosen: chosen.backend.to_string(),
        reason: chosen.to_string(),
        best: best.choice.to_string(),
        step_ns,
        best_ns: best.median(),
        ratio,
        analysis_ns: analysis.as_nanos() as f64,
        analysis_steps,
        within_bar: worse(ratio / RATIO, analysis_steps / STEPS) <= 1.0,
        others: (others.iter())
            .map(|c| (c.choice.to_string(), c.median()))
            .collect(),
    })
}

/// The least time that the choice took.
fn analysis(scene: &Scene, own: &Contestant) -> Result<Duration, ExperimentError> {
    let mut least = Duration::MAX;
    for _ in 0..ANALYSES {
        let stepper = Stepper::new(scene.clone(), own.stepper.options().clone())?;
        let chosen = stepper.chosen().ok_or("`auto` chose no solver")?;
        least = least.min(chosen.analysis);
    }
    Ok(least)
}
