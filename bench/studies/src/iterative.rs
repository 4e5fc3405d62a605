//! Time to a given error of the iterative solvers, against the direct one: cables of several lengths and mass ratios and
//! two networks, from zero and from the multipliers of the step before.

mod table;

use crate::options::count;
use crate::scenes;
use crate::study::question::*;
use crate::systems::turns::{self, Work};
use crate::systems::{Fewest, Start, State, Told, at_rung, entrants, grid};
use serde::{Deserialize, Serialize};
use std::time::Duration;
use table::{cell, conclusions, reached, scene};
use taut_integrator::{Phase, StepError, StepOptions};
use taut_measure::choice::{Choice, Omission};
use taut_measure::reference::reference_choice;
use taut_model::{HoistParams, Network, Scene};

/// Steps from the start to the state of a case.
pub const WARM_UP: usize = 30;

/// Angle at which the hoists start \[rad].
pub const ANGLE: f64 = 0.3;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub segments: Vec<usize>,
    /// Mass ratios load/segment of the hoist.
    pub ratios: Vec<f64>,
    /// Networks with their sizes, at their own mass ratio.
    pub networks: Vec<(Network, usize)>,
    pub choices: Vec<Choice>,
    /// Errors to be reached, descending.
    pub targets: Vec<f64>,
    pub limit: usize,
    /// Time that the timing of a row aims at.
    pub timing_budget: Duration,
    /// Δt \[s].
    pub dt: f64,
}

impl Config {
    /// 24, 100 and 1000 segments at ratios 1, 10³, 10⁵; a ladder of four cables and a net of 8×8; errors of 10⁻², 10⁻⁴
    /// and 10⁻⁸ within 1000 iterations. Quick short cables and small networks.
    pub fn new(quick: bool) -> Self {
        let [cables, nodes] = pick(quick, [[4, 8], [2, 4]]);
        Self {
            segments: pick(quick, [vec![24, 100, 1000], vec![24]]),
            ratios: vec![1.0, 1e3, 1e5],
            networks: vec![(Network::Ladder, cables), (Network::Net, nodes)],
            choices: choices(),
            targets: vec![1e-2, 1e-4, 1e-8],
            limit: pick(quick, [1000, 100]),
            timing_budget: Duration::from_millis(pick(quick, [10, 1])),
            dt: 1.0 / 60.0,
        }
    }
}

pub fn choices() -> Vec<Choice> {
    let all = Choice::all().into_iter();
    all.filter(|choice| choice.backend.is_iterative()).collect()
}

const PHASES: [Phase; 4] = [
    Phase::Assemble,
    Phase::Factorize,
    Phase::Solve,
    Phase::Refine,
];

/// One row: a solver, a start and an error to reach on a case.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Record {
    pub scene: String,
    /// Its size: segments, cables of a ladder, rows and columns of a net.
    pub size: usize,
    pub mass_ratio: f64,
    pub rows: usize,
    /// Backend, without iterations.
    pub backend: String,
    /// Where it starts; none for the direct solver.
    pub start: Option<Start>,
    pub target: f64,
    /// Iterations that reach it, refinements of the direct solver; none where it is not reached within the limit; 0 of an
    /// iterative solver where the guess is within it already, which then has no time.
    pub iterations: Option<usize>,
    /// Error reached then, or at the limit.
    pub error: f64,
    /// Time from the pieces to the multipliers, the least \[ns].
    pub ns: Option<f64>,
    /// Least time of the direct solver that reaches the error \[ns]; none where it does not.
    pub direct_ns: Option<f64>,
    /// Reason for missing numbers if the solver failed: they are null in JSON. Without it null
    /// means not measured.
    pub failure: Option<String>,
}

impl Record {
    /// Time of the direct solver over this one's: above 1 it wins.
    pub fn gain(&self) -> Option<f64> {
        Some(self.direct_ns? / self.ns?)
    }
}

/// All rows, and what was left out.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    /// Rows, case by case, the direct solver first; solvers, starts, errors.
    pub records: Vec<Record>,
    #[serde(skip)]
    pub omissions: Vec<Omission>,
}

/// A state that the solvers are compared on, with what its rows share.
struct Case {
    shared: Record,
    state: State,
}

impl Case {
    fn hoist(config: &Config, segments: usize, mass_ratio: f64) -> Result<Self, StepError> {
        let params = HoistParams {
            segments,
            mass_ratio,
            initial_angle: ANGLE,
            seed: 7,
            ..HoistParams::default()
        };
        Self::new(config, "hoist", segments, mass_ratio, params.build()?)
    }

    fn network(config: &Config, network: Network, size: usize) -> Result<Self, StepError> {
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
        let options = reference_choice().options(config.dt);
        let state = State::after(WARM_UP, scene, options)?;
        let shared = Record {
            scene: name.to_owned(),
            size,
            mass_ratio,
            rows: state.rows(),
            error: f64::NAN,
            ..Record::default()
        };
        Ok(Self { shared, state })
    }

    /// Solves with those options.
    fn work(&self, options: StepOptions, start: Start) -> Result<Work<'_>, StepError> {
        let mut stepper = self.state.stepper(options, start)?;
        Ok(Box::new(move |passes| {
            turns::sum(passes, || {
                self.state.put(&mut stepper, start)?;
                let phases = stepper.solve()?.phases;
                Ok([PHASES.map(|phase| phases.of(phase)).iter().sum(); 3])
            })
        }))
    }

    /// The rows of a solver from a start, without their times, each with the step that takes its time. The direct solver
    /// has no start, and refinements for iterations.
    fn untimed(
        &self,
        config: &Config,
        choice: &Choice,
        start: Option<Start>,
    ) -> Vec<(Record, Option<StepOptions>)> {
        let step = |k| match start {
            Some(_) => limited(config, choice, k),
            None => StepOptions {
                refinements: k,
                ..choice.plain_options(config.dt)
            },
        };
        let begin = start.unwrap_or(Start::Cold);
        let error = |k| Ok(self.state.solve(step(k), begin)?.forward);
        let limit = start.map_or(1, |_| config.limit);
        let mut search = Fewest::new(limit, usize::MAX, error);
        let row = |&target: &f64| {
            let nothing = start.map_or_else(|| search.error(0), |s| Ok(self.state.guessed(s)));
            let found = nothing.and_then(|error| {
                if error <= target {
                    return Ok((Some(0), error));
                }
                let found = search.within(target)?;
                Ok((found, search.error(found.unwrap_or(limit))?))
            });
            let failure = found.as_ref().err().map(ToString::to_string);
            let (iterations, error) = found.unwrap_or((None, f64::NAN));
            let row = Record {
                backend: choice.family(),
                start,
                target,
                iterations,
                error,
                failure,
                ..self.shared.clone()
            };
            let timed = iterations.filter(|k| *k > 0 || start.is_none());
            (row, timed.map(step))
        };
        config.targets.iter().map(row).collect()
    }

    /// The rows: the direct solver's, then for each solver and start those of all errors.
    fn rows(&self, config: &Config, choices: &[Choice]) -> Vec<Record> {
        let mut rows = self.untimed(config, &reference_choice(), None);
        for choice in choices {
            for start in Start::ALL {
                rows.extend(self.untimed(config, choice, Some(start)));
            }
        }
        let timed = rows.iter().filter_map(|(row, options)| {
            let start = row.start.unwrap_or(Start::Cold);
            Some(self.work(options.clone()?, start))
        });
        let mut times = turns::times(timed, config.timing_budget).into_iter();
        let mut rows: Vec<Record> = rows
            .into_iter()
            .map(|(mut row, options)| {
                match options.and_then(|_| times.next()) {
                    Some(Ok([time, ..])) => row.ns = Some(time.least),
                    Some(Err(e)) => row.failure = Some(e.to_string()),
                    None => {}
                }
                row
            })
            .collect();
        let direct: Vec<Option<f64>> = rows.iter().map(|row| row.ns).collect();
        for (k, row) in rows.iter_mut().enumerate() {
            row.direct_ns = direct[k % config.targets.len()];
        }
        rows
    }
}

/// The step with so many iterations, whatever error they leave.
fn limited(config: &Config, choice: &Choice, iterations: usize) -> StepOptions {
    let mut choice = at_rung(choice, iterations);
    choice.backend = choice.backend.with_tolerance(0.0);
    choice.plain_options(config.dt)
}

/// A scene that the solvers are compared on.
#[derive(Debug, Clone, Copy)]
enum Subject {
    Hoist(usize, f64),
    Network(Network, usize),
}

/// Runs all cases, one after the other, since their times are measured.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let (choices, omissions) = entrants(&config.choices, 0, |_| 0);
    let hoists = grid(&config.segments, &config.ratios).into_iter();
    let mut subjects: Vec<Subject> = hoists.map(|(n, ratio)| Subject::Hoist(n, ratio)).collect();
    let networks = config.networks.iter();
    subjects.extend(networks.map(|&(network, size)| Subject::Network(network, size)));
    let records = cases.in_turn("scenes", &subjects, |subject| {
        let case = match *subject {
            Subject::Hoist(segments, ratio) => Case::hoist(config, segments, ratio),
            Subject::Network(network, size) => Case::network(config, network, size),
        }?;
        Ok::<_, StepError>(case.rows(config, &choices))
    })?;
    Ok(Results {
        records: records.all()?.concat(),
        omissions,
    })
}

pub(crate) const STUDY: Study = Study {
    name: "iterative",
    question: question!("iterative", FUNCTIONS),
    options: Own::augment_args,
    run: |matches, reporter| {
        let limit = Own::from_arg_matches(matches)?.iterations;
        ask(&Asked::read(matches), limit, reporter.cases)
    },
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[
    ("scene", Text(scene)),
    ("cell", Text(cell)),
    ("reached", Worth(reached)),
];

#[derive(Debug, Args)]
struct Own {
    /// Most iterations tried
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    iterations: Option<usize>,
}

fn ask(asked: &Asked, limit: Option<usize>, cases: &Cases) -> Result<Found, ExperimentError> {
    let config = config(asked, limit)?;
    let results = run(&config, cases)?;
    let told = Told {
        settings: settings(&config),
        heading: format!(
            "hoist at {ANGLE} rad and networks, state after {WARM_UP} steps of 1/{:.0} s, up to {} iterations",
            1.0 / config.dt,
            config.limit
        ),
        study: &STUDY,
        rows: data(&results.records)?,
        conclusion: conclusions(&results.records, config.limit),
        omissions: results.omissions,
    };
    Ok(told.into())
}

fn config(asked: &Asked, limit: Option<usize>) -> Result<Config, ExperimentError> {
    let mut config = Config::new(asked.quick);
    if !asked.segments.is_empty() || !asked.ratios.is_empty() {
        // Both are the hoist's.
        config.networks.clear();
    }
    asked.segments(&mut config.segments);
    asked.ratios(&mut config.ratios)?;
    if !asked.backends.is_empty() {
        config.choices = asked.choices()?;
    }
    if let Some(direct) = config.choices.iter().find(|c| !c.backend.is_iterative()) {
        return Err(format!(
            "`--backends {direct}`: `taut study iterative` takes iterative solvers, gauss-seidel, cg and minres"
        )
        .into());
    }
    if let Some(name) = asked.backends.iter().find(|b| b.contains('=')) {
        return Err(format!(
            "`{name}`: the study looks for the iterations itself, without a tolerance; use `--iterations`"
        )
        .into());
    }
    config.limit = limit.unwrap_or(config.limit);
    if config.limit == 0 {
        return Err("`--iterations` is 0: it must be at least 1".into());
    }
    Ok(config)
}

fn settings(config: &Config) -> Vec<Setting> {
    let network = |(network, size): &(Network, usize)| format!("{} of {size}", network.name());
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("networks", list(&config.networks, network)),
        ("solvers", solvers(&config.choices)),
        ("errors", numbers(&config.targets)),
        ("iterations at most", config.limit.to_string()),
        ("Δt", step(config.dt)),
        ("steps before", WARM_UP.to_string()),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tiny() -> Config {
        Config {
            segments: vec![6],
            ratios: vec![1.0, 1e3],
            networks: vec![(Network::Ladder, 2)],
            limit: 60,
            timing_budget: Duration::ZERO,
            ..Config::new(false)
        }
    }

    #[test]
    fn rows_reach_what_they_say_and_no_fewer_iterations_do() {
        let config = tiny();
        let results = run(&config, &Cases::default()).unwrap();
        let compiled = config.choices.len() - results.omissions.len();
        assert_eq!(results.records.len(), 3 * 3 * (1 + 2 * compiled));
        for r in &results.records {
            assert_eq!(r.failure, None, "{r:?}");
            assert_eq!(r.iterations.is_some(), r.error <= r.target, "{r:?}");
            // A guess that is near enough takes no time.
            let timed = r.iterations.is_some_and(|k| k > 0 || r.start.is_none());
            assert_eq!(timed, r.ns.is_some(), "{r:?}");
            let holds = r.direct_ns.is_some();
            assert!(holds, "the direct solver reaches all: {r:?}");
        }
        // The finite number of eigenvalues of six joints: conjugate gradient ends.
        let ended = |r: &&Record| r.backend == "cg:group" && r.scene == "hoist";
        assert!(
            results
                .records
                .iter()
                .filter(ended)
                .all(|r| r.iterations.is_some())
        );
        let case = Case::hoist(&config, 6, 1e3).unwrap();
        for choice in config.choices.iter().filter(|c| c.check().is_ok()) {
            let error = |k| {
                let options = limited(&config, choice, k);
                Ok(case.state.solve(options, Start::Warm)?.forward)
            };
            let mut search = Fewest::new(config.limit, usize::MAX, error);
            let Some(k) = search.within(1e-4).unwrap() else {
                continue;
            };
            assert!(search.error(k).unwrap() <= 1e-4);
            assert!(k <= 1 || search.error(k - 1).unwrap() > 1e-4, "{choice}");
        }
    }
}
