//! The main job: every solver on the hoist, speed against error, over mass ratios, in the default step; or on any other
//! scene.

mod answer;
mod case;
mod extras;
mod measure;
mod record;
mod study;
mod table;
mod trial;

pub use answer::Answer;
pub use case::{OwnScene, is_lost};
pub use extras::{Extras, Pattern, Trace};
pub use record::{Fastest, LadderRow, SceneKey};
pub(crate) use study::{STUDY, are_networks};
pub use table::{claim_rows, data_of, sheet_of};

use crate::cases::{Cases, shared};
use crate::options::pick;
use crate::systems::{add_omissions, at_rung, entrants, grid, rungs};
use case::{Case, Subject};
use measure::{task_rows, timed};
use rayon::prelude::*;
use record::mark_fastest;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;
use std::time::Duration;
use taut_measure::choice::{Choice, Omission};
use taut_measure::trajectory::Failure;
use taut_model::HoistParams;
use taut_output::check::ExperimentError;
use taut_solver::coulomb::ConeMethod;
use trial::{Trial, methods};

/// Error levels of the multipliers' relative error: good enough for a game, for a trainer, for a reference.
pub const LEVELS: [f64; 3] = [1e-3, 1e-6, 1e-10];

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// The hoist; segments and mass ratio are replaced by those below.
    pub scene: HoistParams,
    /// Other scenes, in place of the hoist where there are any.
    pub own: Vec<OwnScene>,
    pub segments: Vec<usize>,
    pub ratios: Vec<f64>,
    /// Solvers; iterative ones run over the ladder of iterations.
    pub choices: Vec<Choice>,
    pub iterations: Vec<usize>,
    /// Δt \[s].
    pub dt: f64,
    /// Simulated time of each row \[s].
    pub time: f64,
    /// Simulated time that the step itself has to stay stable for \[s].
    pub stability_time: f64,
    /// Time that the timing of a row aims at.
    pub timing_budget: Duration,
}

impl Config {
    /// 24 and 100 segments, mass ratios 1 to 10⁵, every solver, 2.5 s of an anchor moved by 0.5 m in 1.5 s. Quick a tenth of
    /// the work: for CI and a first look.
    pub fn new(quick: bool) -> Self {
        let ratios = vec![1.0, 10.0, 1e2, 1e3, 1e4, 1e5];
        let iterations = vec![1, 3, 10, 20, 50, 100, 300, 1000];
        Self {
            scene: HoistParams {
                seed: 1,
                move_x: 0.5,
                move_duration: pick(quick, [1.5, 1.0]),
                ..HoistParams::default()
            },
            own: Vec::new(),
            segments: pick(quick, [vec![24, 100], vec![24]]),
            ratios: pick(quick, [ratios, vec![1.0, 1e3, 1e5]]),
            choices: Choice::all(),
            iterations: pick(quick, [iterations, vec![1, 10, 100]]),
            dt: 1.0 / 60.0,
            time: pick(quick, [2.5, 1.5]),
            stability_time: 30.0,
            timing_budget: Duration::from_millis(pick(quick, [12, 4])),
        }
    }

    /// The scenes: the others, else the hoist at all its segments and mass ratios.
    fn subjects(&self) -> Vec<Subject> {
        if !self.own.is_empty() {
            let own = self.own.iter().cloned().map(Box::new);
            return own.map(Subject::Own).collect();
        }
        let hoist = |(segments, mass_ratio)| {
            Subject::Hoist(Box::new(HoistParams {
                segments,
                mass_ratio,
                load_mass: None,
                ..self.scene.clone()
            }))
        };
        let hoists = grid(&self.segments, &self.ratios).into_iter();
        hoists.map(hoist).collect()
    }
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Results {
    /// Rows, scene by scene, solvers in the order asked for, iterations ascending.
    pub records: Vec<LadderRow>,
    pub omissions: Vec<Omission>,
    pub scenes: Vec<SceneNote>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneNote {
    pub scene: String,
    /// Segments of the hoist's cable; none of another scene.
    pub segments: Option<usize>,
    /// Load over segment mass; of another scene the heaviest over the lightest moving body.
    pub mass_ratio: f64,
    /// Name of the body that stands in for a load that the scene does not name: the one that moves most.
    pub stand_in: Option<String>,
    /// Time step of the reference motion, before its extrapolation from this and twice this \[s].
    pub reference_dt: f64,
    /// Error of the velocities of the reference, of scenes with contacts.
    pub velocity_reference_error: Option<f64>,
    /// How long the step itself, solved directly, was tried \[s].
    pub stability_s: f64,
    /// How the step itself, solved directly, ended before that.
    pub failure: Option<Failure>,
}

/// The work of some rows: a solver, and for iterative ones the limits of iterations.
struct Task {
    choice: Choice,
    contacts: Option<ConeMethod>,
    rungs: Vec<usize>,
}

/// A row with whether more iterations would change nothing, which is not written with it.
type Untimed = (LadderRow, bool);

/// Runs the main job. A scene is a case, with its reference and all its rows.
///
/// # Errors
/// A scene that cannot be built, or a reference motion that fails, with the name of the scene where that is not the hoist;
/// a solver's own failure is a row.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let subjects = config.subjects();
    let made: Vec<OnceLock<Case>> = subjects.iter().map(|_| OnceLock::new()).collect();
    let case = |k: usize| {
        let new = || Case::new(config, &subjects[k]).map_err(|e| subjects[k].named(e));
        shared(&made[k], new)
    };
    let titles: Vec<_> = subjects.iter().map(Subject::title).enumerate().collect();
    let untimed = cases.parallel("physics", &titles, |(k, _)| {
        let case = case(*k)?;
        let (tasks, omissions) = tasks(config, case);
        let rows = tasks.par_iter().map(|task| task_rows(config, case, task));
        let rows: Vec<Vec<Untimed>> = rows.collect();
        Ok::<_, ExperimentError>((case.note(), rows, omissions))
    })?;
    let all = cases.in_turn("timing", &titles, |(k, _)| {
        let (case, (_, rows, _)) = (case(*k)?, untimed.of(*k)?);
        let (tasks, _) = tasks(config, case);
        Ok::<_, ExperimentError>(timed(config, case, &tasks, rows))
    })?;
    let mut results = Results::default();
    for (note, _, omissions) in untimed.all()? {
        results.scenes.push(note);
        add_omissions(&mut results.omissions, omissions);
    }
    results.records = all.all()?.concat();
    mark_fastest(&mut results.records);
    Ok(results)
}

/// Rows beyond which the dense solver, whose cost is cubic, would outlast all others together.
const DENSE_ROWS: usize = 200;

/// The work of a case, and which solvers have no rows.
fn tasks(config: &Config, case: &Case) -> (Vec<Task>, Vec<Omission>) {
    let rows = case.exact.first().map_or(0, Vec::len);
    let (choices, omissions) = entrants(&config.choices, DENSE_ROWS, |_| rows);
    let mut tasks = Vec::new();
    for choice in &choices {
        let methods = methods(case.has_contacts(), Some(choice) == choices.first());
        tasks.extend(methods.into_iter().map(|contacts| Task {
            choice: choice.clone(),
            contacts,
            rungs: rungs(choice, &config.iterations),
        }));
    }
    (tasks, omissions)
}

impl Task {
    fn trial_at(&self, rung: usize) -> Trial {
        Trial {
            choice: at_rung(&self.choice, rung),
            contacts: self.contacts,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_measure::inputs::Inputs;
    use taut_model::{Action, Event, When};
    use taut_solver::{Backend, DenseOptions};

    fn tiny() -> Config {
        Config {
            segments: vec![4],
            ratios: vec![10.0],
            choices: Choice::all(),
            iterations: vec![1, 200],
            time: 0.5,
            timing_budget: Duration::ZERO,
            ..Config::new(true)
        }
    }

    #[test]
    fn every_solver_has_its_rows_and_direct_ones_are_exact() {
        let results = run(&tiny(), &Cases::default()).unwrap();
        let compiled = Choice::all().into_iter();
        let compiled = compiled.filter(|c| c.check().is_ok()).count();
        let families: std::collections::BTreeSet<_> =
            results.records.iter().map(|r| &r.backend).collect();
        assert_eq!(families.len(), compiled);
        assert_eq!(results.omissions.len(), Choice::all().len() - compiled);
        for r in &results.records {
            assert_eq!(r.error, None, "{}", r.options);
            assert!(r.step_ns > Some(0.0) && r.solve_ns > Some(0.0), "{r:?}");
            // One iteration a step is not always enough to stay stable: then the row says so.
            let holds = r.stable || (r.iterations == 1 && r.failure.is_some());
            assert!(holds, "{r:?}");
            if r.iterations == 0 {
                let holds = r.forward_error.unwrap() < 1e-12 && r.elongation_error.unwrap() < 1e-9;
                assert!(holds, "{r:?}");
            }
        }
        for level in LEVELS {
            let found = results
                .records
                .iter()
                .filter(|r| r.fastest_at.iter().any(|f| f.level == level))
                .count();
            assert_eq!(found, 1);
        }
    }

    /// Frames count up to a change of the scene.
    #[test]
    fn another_scene_is_measured_up_to_its_event() {
        let params = HoistParams {
            segments: 4,
            mass_ratio: 100.0,
            initial_angle: 0.3,
            ..HoistParams::default()
        };
        let mut scene = params.build().unwrap();
        scene.load = None;
        scene.events.push(Event {
            name: "cut".to_owned(),
            when: When::Time(20.5 / 60.0),
            then: vec![Action::Release(2)],
        });
        let own = OwnScene {
            name: "cut.toml".to_owned(),
            scene,
            inputs: Inputs::default(),
        };
        let config = Config {
            own: vec![own],
            choices: vec![Choice::schur(Backend::Dense(DenseOptions::default()))],
            ..tiny()
        };
        let results = run(&config, &Cases::default()).unwrap();
        let [row] = &results.records[..] else {
            panic!("one row: {results:?}")
        };
        assert_eq!((row.scene.as_str(), row.segments), ("cut.toml", None));
        assert_eq!((&row.error, row.elongation_error), (&None, None));
        // States before frames 13 to 19, the first of which is only started from; the event ends frame 20.
        assert_eq!(row.frames, 6);
        assert!(row.forward_error.unwrap() < 1e-12 && row.stable, "{row:?}");
        assert_eq!(row.fastest_at.len(), LEVELS.len());
        assert_eq!(results.scenes[0].stand_in.as_deref(), Some("load"));
    }
}
