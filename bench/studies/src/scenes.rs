//! Cables with branches and loops: what every solver costs there, how wrong it is, and how both grow with the size.

mod measure;
mod study;

pub use measure::swinging;
pub(crate) use study::STUDY;
pub use taut_measure::reference::reference_choice;

use crate::cases::{Cases, shared};
use crate::fit;
use crate::study::question::*;
use crate::systems::turns::{self, Time, Work};
use crate::systems::{Start, add_omissions, at_rung, entrants, rungs};
use measure::{Case, Task};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;
use std::time::Duration;
use taut_integrator::{Elimination, StepError};
use taut_measure::choice::{Choice, Omission};
use taut_model::{Network, NetworkParams};
use taut_solver::{Backend, SolveReport};

/// Largest relative error of the multipliers and of the load's place, for a direct solver with
/// refinement.
pub const BAR: f64 = 1e-8;

/// Steps from the start to the common state.
pub const WARM_UP: usize = 20;

/// Angular velocity about the line of the anchors at the start \[rad/s].
pub const SWING: f64 = 0.2;

/// Rows beyond which the dense solver, whose cost is cubic, has no rows.
pub const DENSE_ROWS: usize = 600;

/// Rows beyond which no run is made and iterative solvers have no rows: errors of one solve, times and entries only.
pub const RUN_ROWS: usize = 2400;

/// Rows beyond which iterative solvers make no run.
pub const ITERATIVE_RUN_ROWS: usize = 1300;

const LADDER_SEGMENTS: usize = 12;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub sizes: Vec<(Network, Vec<usize>)>,
    pub ratios: Vec<f64>,
    /// Solvers; iterative ones run over the ladder of iterations.
    pub choices: Vec<Choice>,
    pub iterations: Vec<usize>,
    /// Δt \[s].
    pub dt: f64,
    /// Simulated time after which the load's place is compared \[s].
    pub time: f64,
    /// Time that the timing of a row aims at.
    pub timing_budget: Duration,
}

impl Config {
    /// All scenes and solvers; quick two small sizes of each scene.
    pub fn new(quick: bool) -> Self {
        let sizes: [(_, &[usize], [usize; 2]); 5] = [
            (Network::Ring, &[24, 50, 100, 200, 1000], [12, 24]),
            (Network::Junction, &[8, 24, 100], [4, 8]),
            (Network::Cranes, &[8, 24, 100], [6, 12]),
            (Network::Ladder, &[2, 4, 8, 16, 64], [2, 3]),
            (Network::Net, &[5, 8, 14, 20], [4, 5]),
        ];
        let sizes = sizes.map(|(n, whole, few)| (n, pick(quick, [whole, &few]).to_vec()));
        Self {
            sizes: sizes.to_vec(),
            ratios: vec![100.0],
            choices: Choice::all(),
            iterations: pick(quick, [vec![10, 100, 1000], vec![10, 100]]),
            dt: 1.0 / 60.0,
            time: 1.0,
            timing_budget: Duration::from_millis(pick(quick, [15, 2])),
        }
    }

    /// The scenes with those names only, in that order, all of them where none is named; with `sizes` in place of
    /// their own where there are some.
    pub fn with(mut self, networks: &[Network], sizes: &[usize]) -> Self {
        if !networks.is_empty() {
            let of = |n: &Network| self.sizes.iter().find(|(own, _)| own == n).cloned();
            self.sizes = networks.iter().filter_map(of).collect();
        }
        if !sizes.is_empty() {
            for (_, own) in &mut self.sizes {
                *own = sizes.to_vec();
            }
        }
        self
    }

    pub fn params(&self, network: Network, size: usize, mass_ratio: f64) -> NetworkParams {
        let mut params = NetworkParams {
            mass_ratio,
            seed: 1,
            ..NetworkParams::new(network)
        };
        match network {
            Network::Ladder => (params.segments, params.cables) = (LADDER_SEGMENTS, size),
            Network::Net => (params.rows, params.columns) = (size, size),
            _ => params.segments = size,
        }
        params
    }
}

/// One row: a solver on a case. A number that is not known is none.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SceneRow {
    pub scene: String,
    /// Its size: segments, cables of a ladder, rows and columns of a net.
    pub size: usize,
    pub mass_ratio: f64,
    pub bodies: usize,
    pub rows: usize,
    /// Backend and form, without iterations; with the order of elimination where it is not the default's.
    pub backend: String,
    /// All options of the backend, as the command line reads them.
    pub options: String,
    pub elimination: String,
    /// Limit of iterations; 0 for direct solvers.
    pub iterations: usize,
    pub iterations_used: usize,
    /// Δt \[s].
    pub dt: f64,
    pub refinements: usize,
    /// Claim of the solver: `direct`, `converged`, `limit`, `stalled`.
    pub status: String,
    #[serde(skip)]
    pub said: Option<SolveReport>,
    /// Whole step, median \[ns].
    pub step_ns: Option<f64>,
    /// Whole step, minimum \[ns].
    pub step_ns_min: Option<f64>,
    /// Linear solve with its refinement, median \[ns].
    pub solve_ns: Option<f64>,
    /// Linear solve with its refinement, minimum \[ns].
    pub solve_ns_min: Option<f64>,
    /// The median over the number of rows \[ns].
    pub solve_ns_per_row: Option<f64>,
    /// Relative error of the multipliers against extended precision; none where the case has no reference.
    pub forward_error: Option<f64>,
    /// `forward_error` without refinement.
    pub forward_error_unrefined: Option<f64>,
    /// Distance of the load's place from that of the reference solver, over the size of the scene; none where the
    /// case is not run, or an iteration loses the motion.
    pub load_difference: Option<f64>,
    /// Entries of the factor, where the backend knows it beforehand.
    pub factor_entries: Option<usize>,
    /// A direct solver keeps [`BAR`]; none for iterations, and where nothing is known.
    pub within_bar: Option<bool>,
    /// Reason for missing numbers if the solver failed: they are null in JSON. Without it null
    /// means not measured.
    pub error: Option<String>,
}

/// All rows, what they show, what is missing.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    /// Rows, case by case, solvers in the order asked for, iterations ascending.
    pub records: Vec<SceneRow>,
    /// Cost against size: see `growth`.
    pub growth: Vec<Value>,
    #[serde(skip)]
    pub omissions: Vec<Omission>,
}

/// Runs it. A network of a size and a mass ratio is a case, with all its rows.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let mut wanted = Vec::new();
    for (network, sizes) in &config.sizes {
        for &ratio in &config.ratios {
            wanted.extend(sizes.iter().map(|&size| (*network, size, ratio)));
        }
    }
    let made: Vec<OnceLock<Case>> = wanted.iter().map(|_| OnceLock::new()).collect();
    let networks: Vec<_> = wanted.into_iter().enumerate().collect();
    let case = |&(k, (network, size, ratio)): &(usize, (Network, usize, f64))| {
        let params = config.params(network, size, ratio);
        shared(&made[k], || Case::new(config, size, &params))
    };
    let untimed = cases.parallel("errors", &networks, |network| {
        let case = case(network)?;
        let (tasks, omissions) = tasks(config, case);
        let row = |task: &Task| measure::row(config, case, task);
        let rows: Vec<(SceneRow, Option<SolveReport>)> = tasks.par_iter().map(row).collect();
        Ok::<_, StepError>((rows, omissions))
    })?;
    let timed = cases.in_turn("timing", &networks, |network| {
        let (case, (rows, _)) = (case(network)?, untimed.of(network.0)?);
        let (tasks, _) = tasks(config, case);
        let sound = tasks.iter().zip(rows);
        let sound = sound.filter(|(_, (row, _))| row.error.is_none());
        let works = sound.map(|(task, _)| work(config, case, task));
        let times = turns::times(works, config.timing_budget).into_iter();
        let times = times.map(|times| times.map_err(|e| e.to_string()));
        Ok::<_, ExperimentError>(times.collect::<Vec<_>>())
    })?;
    let mut results = Results::default();
    for ((rows, omissions), times) in untimed.all()?.into_iter().zip(timed.all()?) {
        add_omissions(&mut results.omissions, omissions);
        let mut times = times.into_iter();
        for (row, said) in rows {
            let time = if row.error.is_none() {
                times.next()
            } else {
                None
            };
            let row = SceneRow { said, ..row };
            results
                .records
                .push(time.map_or(row.clone(), |time| row.timed(time)));
        }
    }
    results.growth = growth(&results.records);
    Ok(results)
}

impl SceneRow {
    /// The row with times of the step and of its linear solve.
    fn timed(self, times: Result<[Time; 3], String>) -> Self {
        match times {
            Ok([step, solve, _]) => Self {
                step_ns: Some(step.median),
                step_ns_min: Some(step.least),
                solve_ns: Some(solve.median),
                solve_ns_min: Some(solve.least),
                solve_ns_per_row: Some(solve.median / self.rows as f64),
                ..self
            },
            Err(e) => Self {
                error: Some(e),
                ..self
            },
        }
    }
}

/// Steps from the common state, and of these the linear solve.
fn work<'a>(config: &Config, case: &'a Case, task: &Task) -> Result<Work<'a>, StepError> {
    let mut stepper = case.state.stepper(task.options(config), Start::Warm)?;
    Ok(Box::new(move |passes| {
        turns::sum(passes, || {
            case.state.put(&mut stepper, Start::Warm)?;
            Ok(turns::spent(&stepper.step()?.phases))
        })
    }))
}

/// The rows of a case, and which solvers have none.
fn tasks(config: &Config, case: &Case) -> (Vec<Task>, Vec<Omission>) {
    let rows = case.state.rows();
    let (choices, mut omissions) = entrants(&config.choices, DENSE_ROWS, |_| rows);
    let mut tasks = Vec::new();
    for choice in &choices {
        if choice.backend.is_iterative() && rows > RUN_ROWS && config.choices.len() > 1 {
            omissions.push(Omission {
                backend: choice.family(),
                reason: format!("no iterations beyond {RUN_ROWS} rows"),
            });
            continue;
        }
        let task = |rung, elimination| Task {
            choice: at_rung(choice, rung),
            elimination,
            rung,
        };
        let rungs = rungs(choice, &config.iterations).into_iter();
        tasks.extend(rungs.map(|rung| task(rung, Elimination::Auto)));
        // The scene's order against that of minimum degree, where the order is the backend's to take.
        if choice.backend == Backend::Banded && case.network == Network::Ring {
            tasks.extend([Elimination::Scene, Elimination::MinimumDegree].map(|e| task(0, e)));
        }
    }
    (tasks, omissions)
}

/// How the time of a solve grows with the rows of the scene: t ∝ rows^exponent, by least squares of the logarithms of the
/// minima, for every scene and solver with three sizes or more, from the fewest to the most rows. Iterative solvers stand
/// there with their lowest limit of iterations only, which they use up: what an iteration costs.
fn growth(records: &[SceneRow]) -> Vec<Value> {
    let limits = records.iter().map(|r| r.iterations).filter(|k| *k > 0);
    let lowest = limits.min().unwrap_or(0);
    let least = records.iter().filter(|r| r.iterations <= lowest);
    let key = |r: &SceneRow| {
        let ratio = r.mass_ratio.to_bits();
        (r.scene.clone(), ratio, r.backend.clone(), r.iterations)
    };
    let growth = |of: (String, u64, String, usize)| {
        let own = records.iter().filter(|r| key(r) == of);
        let points = own.clone().filter_map(|r| {
            let ns = r.solve_ns_min.filter(|ns| *ns > 0.0)?;
            Some([r.rows as f64, ns])
        });
        let exponent = exponent(&points.collect::<Vec<_>>())?;
        let rows = own.map(|r| r.rows);
        let (least, most) = (rows.clone().min()?, rows.max()?);
        let (scene, ratio, backend, iterations) = of;
        Some(json!({
            "scene": scene,
            "mass_ratio": f64::from_bits(ratio),
            "backend": backend,
            "iterations": iterations,
            "exponent": exponent,
            "rows": [least, most],
        }))
    };
    distinct(least.map(key))
        .into_iter()
        .filter_map(growth)
        .collect()
}

/// Exponent of a power through three points or more.
fn exponent(points: &[[f64; 2]]) -> Option<f64> {
    let found = (points.len() >= 3).then(|| fit::exponent(points));
    found.filter(|exponent| exponent.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponent_takes_three_points_or_more() {
        let points = [10.0_f64, 20.0, 50.0].map(|x| [x, 3.0 * x.powf(1.5)]);
        assert!((exponent(&points).unwrap() - 1.5).abs() < 1e-12);
        assert_eq!(exponent(&points[..2]), None);
        assert_eq!(exponent(&[[1.0, 1.0], [1.0, 2.0], [1.0, 3.0]]), None);
    }

    #[test]
    fn every_direct_solver_keeps_the_bar_on_every_scene() {
        let config = Config {
            timing_budget: Duration::ZERO,
            ..Config::new(true)
        };
        let results = run(&config, &Cases::default()).unwrap();
        for network in Network::ALL {
            let own = results.records.iter().filter(|r| r.scene == network.name());
            assert!(own.count() > 0, "{}", network.name());
        }
        for r in &results.records {
            assert_eq!(r.error, None, "{r:?}");
            assert!(r.solve_ns > Some(0.0) && r.step_ns >= r.solve_ns, "{r:?}");
            assert!(r.within_bar.is_none_or(|kept| kept), "{r:?}");
            assert_eq!(r.within_bar.is_some(), r.iterations == 0, "{r:?}");
        }
        let text = taut_output::table::plain(&STUDY.tables(&crate::study::data(&results).unwrap()));
        let width = text.lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{width:?}\n{text}");
    }
}
