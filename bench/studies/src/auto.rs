//! Choice of `auto` against every other solver, in turns, on scenes of all kinds.
//!
//! On each scene all direct solvers, in both forms, and conjugate gradient with groups make the same steps, a round after
//! another. The *ratio* is the median over the rounds of the step's time with `auto` over that with the fastest of the
//! others. The *analysis* is the least time of choosing over the time of a step: what `auto` adds to the making of a
//! stepper, which counts orders for every solver. Both have bars. The times from which the choice is predicted come from
//! [`fit`], on other scenes.

mod fit;
mod measure;
mod study;

pub use fit::{Fit, Fitted, Measured, fit};
pub(crate) use study::STUDY;

use crate::cases::Cases;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use taut_ground::choice::Choice;
use taut_model::{SceneError, SceneSource};
use taut_output::check::ExperimentError;

/// Largest ratio to the best.
pub const RATIO: f64 = 1.3;

/// Longest analysis \[steps].
pub const STEPS: f64 = 3.0;

/// Scenes that the choice is judged on: a name with overrides, or the name of an example.
pub const HELD: [&str; 33] = [
    "hoist segments=4 mass_ratio=100",
    "hoist segments=12 mass_ratio=100",
    "hoist segments=24 mass_ratio=1",
    "hoist segments=24 mass_ratio=1e5",
    "hoist segments=50 mass_ratio=100",
    "hoist segments=100 mass_ratio=1e4",
    "hoist segments=300 mass_ratio=100",
    "hoist segments=1000 mass_ratio=100",
    "hoist segments=3000 mass_ratio=100",
    "hoist segments=30 joint=\"spherical\"",
    "ring segments=8",
    "ring segments=24 points=1",
    "ring segments=100",
    "ring segments=1000",
    "junction segments=24",
    "cranes segments=24",
    "ladder cables=2",
    "ladder cables=4",
    "ladder cables=8",
    "ladder cables=16",
    "net rows=3 columns=3",
    "net rows=5 columns=5",
    "net rows=8 columns=8",
    "net rows=14 columns=14",
    "net rows=20 columns=20",
    "particles-f",
    "gantry",
    "tackle",
    "elevator",
    "stack",
    "floor",
    "pile",
    "tower_crane",
];

/// Scenes that the predicted times are fitted to.
pub const FITTED: [&str; 32] = [
    "hoist segments=6",
    "hoist segments=16",
    "hoist segments=36",
    "hoist segments=75",
    "hoist segments=200",
    "hoist segments=600",
    "hoist segments=2000",
    "hoist segments=16 twist=false",
    "hoist segments=120 twist=false",
    "hoist segments=20 joint=\"spherical\"",
    "hoist segments=150 joint=\"spherical\"",
    "ring segments=12",
    "ring segments=40",
    "ring segments=200",
    "ring segments=60 joint=\"spherical\"",
    "junction segments=10",
    "junction segments=60",
    "cranes segments=12",
    "cranes segments=100",
    "ladder cables=3",
    "ladder cables=6 rung_every=2",
    "ladder cables=12",
    "ladder cables=24 segments=8",
    "ladder cables=5 segments=40 joint=\"spherical\"",
    "net rows=4 columns=4",
    "net rows=6 columns=9",
    "net rows=10 columns=10",
    "net rows=12 columns=17",
    "net rows=17 columns=17",
    "net rows=24 columns=24",
    "gantry segments=40",
    "landing",
];

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub scenes: Vec<String>,
    /// Solvers besides `auto`.
    pub choices: Vec<Choice>,
    /// Rounds of a scene.
    pub rounds: usize,
    /// Least time of the steps of a round, of the fastest solver.
    pub round: Duration,
    /// Δt \[s].
    pub dt: f64,
}

impl Default for Config {
    fn default() -> Self {
        let group = |c: &Choice| c.family() == "cg:group";
        let all = Choice::all().into_iter().filter(|c| c.check().is_ok());
        Self {
            scenes: HELD.map(str::to_owned).to_vec(),
            choices: all
                .filter(|c| !c.backend.is_iterative() || group(c))
                .collect(),
            rounds: 21,
            round: Duration::from_millis(2),
            dt: 1.0 / 60.0,
        }
    }
}

impl Config {
    /// The small scenes, in a few rounds.
    #[must_use]
    pub fn quick() -> Self {
        let whole = Self::default();
        let large = ["s=1000", "s=3000", "s=14", "s=16", "s=20"];
        let small = |scene: &String| !large.iter().any(|size| scene.contains(size));
        Self {
            scenes: whole.scenes.into_iter().filter(small).collect(),
            rounds: 7,
            round: Duration::from_micros(500),
            ..whole
        }
    }
}

/// The choice on a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    pub scene: String,
    /// Rows of its constraints.
    pub rows: usize,
    /// The solver that was chosen.
    pub chosen: String,
    /// Why.
    pub reason: String,
    /// The fastest of the others, which may be the same.
    pub best: String,
    /// Time of a step with the one chosen, and with the fastest: medians \[ns].
    pub step_ns: f64,
    /// Median time of a step with the fastest \[ns].
    pub best_ns: f64,
    /// Median of the ratios of both in one round.
    pub ratio: f64,
    /// Least time of choosing \[ns].
    pub analysis_ns: f64,
    /// Least time of choosing over the time of a step.
    pub analysis_steps: f64,
    /// Both bars are kept.
    pub within_bar: bool,
    /// Every other solver that is not much slower, with the time of its step \[ns].
    pub others: Vec<(String, f64)>,
}

/// The scene of such a name.
///
/// # Errors
/// An unknown scene or override.
pub fn source(scene: &str) -> Result<SceneSource, SceneError> {
    let mut words = scene.split_whitespace();
    let name = words.next().unwrap_or_default();
    let overrides: Vec<(&str, &str)> = words.filter_map(|w| w.split_once('=')).collect();
    match name {
        "tower_crane" => SceneSource::parse(TOWER_CRANE, &overrides),
        "landing" => SceneSource::parse(LANDING, &overrides),
        _ => SceneSource::load(name, &overrides),
    }
}

const TOWER_CRANE: &str = include_str!("../../../integrator/examples/tower_crane.toml");
const LANDING: &str = include_str!("../../../integrator/examples/landing.toml");

/// Runs it, scene by scene.
///
/// # Errors
/// A scene that cannot be built, a step that fails with `auto`; another solver that fails drops out.
pub fn run(config: &Config, cases: &Cases) -> Result<Vec<Record>, ExperimentError> {
    let run = |scene: &String| measure::record(config, scene);
    let records = cases.in_turn("auto", &config.scenes, run)?;
    Ok(records.all()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_scene_is_both_fitted_and_held() {
        for scene in HELD.iter().chain(&FITTED) {
            source(scene)
                .and_then(|source| source.build())
                .unwrap_or_else(|e| panic!("{scene}: {e}"));
        }
        assert!(HELD.iter().all(|scene| !FITTED.contains(scene)));
        assert!(Config::quick().scenes.len() > 20);
    }

    #[test]
    fn every_choice_is_measured_beside_the_others() {
        let config = Config {
            scenes: ["hoist segments=3", "net rows=2 columns=3"]
                .map(str::to_owned)
                .to_vec(),
            rounds: 3,
            round: Duration::ZERO,
            ..Config::default()
        };
        for r in run(&config, &Cases::default()).unwrap() {
            let known = config.choices.iter().any(|c| c.to_string() == r.best);
            assert!(known && r.best_ns > 0.0 && r.ratio > 0.0, "{r:?}");
            assert!(r.analysis_ns > 0.0 && !r.reason.is_empty(), "{r:?}");
        }
    }
}
