//! Time to a given error of the iterative solvers, against the direct one: cables of several lengths and mass ratios and
//! two networks, from zero and from the multipliers of the step before.
//!
//! A case is one state of a scene in motion, after [`WARM_UP`] steps of the direct solver; the system is that of the
//! default step, with the same tension in the geometric stiffness for every solver, and the error that of the
//! multipliers, ‖μ − μ*‖∞ / ‖μ*‖∞, against the KKT system in extended precision. A solver without a tolerance of its own
//! makes k iterations, and the fewest that reach an error are looked for: up a ladder of limits, then by bisection between
//! the last that did not and the first that did.
//!
//! The time is that from the pieces to the multipliers: assembly, factorisation or preconditioner, solve, and what the
//! direct solver refines; the least of several. A matrix-free solver so gains what it does not assemble. The direct solver
//! that a time is compared with is the cheaper of that without and with one refinement that reaches the error.
//!
//! As measured, iterations win on no cable. From the pieces to the multipliers (assembly and solve; 24, 100, 1000
//! segments, ratios 1, 10³, 10⁵, errors 10⁻², 10⁻⁴, 10⁻⁸, from zero and from the last step's multipliers, which all
//! iterations start from by default) `banded` takes 3.9, 12 and 130 µs; the nearest is `gauss-seidel:groups`, 1.5 to 2
//! times that to 10⁻² at ratio 1, then `cg:group`, 2 to 5 times everywhere in 1 to 6 iterations. `cg:jacobi` needs 5 to
//! 50 iterations at 24 segments and hundreds from 100 on, `cg:none` hundreds and beyond 1000; Gauss–Seidel over joints
//! reaches 10⁻⁴ from zero nowhere. A step's guess alone is within 10⁻² only in light motion (ratio 1). On a net of 8 ×
//! 8 nodes they win: `gauss-seidel:groups` and `cg:group` by 1.8 to 2.1 at every error, `cg:jacobi` by up to 2.0.
//! Products without S cost the same for long cables and 1.4 to 2 times as much for short ones and nets, so that
//! `:matrix-free` wins over the assembled S nowhere by more than the scatter of the times (`taut bench --sweep
//! iterative`).

use crate::choice::Choice;
use crate::ladder::Omission;
use crate::reference::Snapshot;
use crate::scenes;
use indicatif::ProgressBar;
use serde::Serialize;
use std::time::{Duration, Instant};
use taut_integrator::{Phase, StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Network, Scene};
use taut_solver::forward_error;
use taut_solver::{Backend, CgOptions, GaussSeidelOptions, Partition, Preconditioner};

/// Steps from the start to the state of a case.
pub const WARM_UP: usize = 30;

/// Angle at which the hoists start \[rad].
pub const ANGLE: f64 = 0.3;

/// Fewest timed solves.
const REPEATS: usize = 3;

/// What [`run`] runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Numbers of segments of the hoist.
    pub segments: Vec<usize>,
    /// Mass ratios load/segment of the hoist.
    pub ratios: Vec<f64>,
    /// Networks with their sizes, at their own mass ratio.
    pub networks: Vec<(Network, usize)>,
    /// Iterative solvers.
    pub choices: Vec<Choice>,
    /// Errors to be reached, descending.
    pub targets: Vec<f64>,
    /// Most iterations.
    pub limit: usize,
    /// Time that the timing of a row aims at.
    pub timing_budget: Duration,
    /// Δt \[s].
    pub dt: f64,
}

impl Default for Config {
    /// 24, 100 and 1000 segments at ratios 1, 10³, 10⁵; a ladder of four cables and a net of 8×8; errors of 10⁻², 10⁻⁴
    /// and 10⁻⁸ within 1000 iterations.
    fn default() -> Self {
        Self {
            segments: vec![24, 100, 1000],
            ratios: vec![1.0, 1e3, 1e5],
            networks: vec![(Network::Ladder, 4), (Network::Net, 8)],
            choices: choices(),
            targets: vec![1e-2, 1e-4, 1e-8],
            limit: 1000,
            timing_budget: Duration::from_millis(10),
            dt: 1.0 / 60.0,
        }
    }
}

impl Config {
    /// Short cables and small networks.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            segments: vec![24],
            networks: vec![(Network::Ladder, 2), (Network::Net, 4)],
            limit: 100,
            timing_budget: Duration::from_millis(1),
            ..Self::default()
        }
    }
}

/// Every iterative solver: conjugate gradient with each preconditioner, assembled and matrix-free, and Gauss–Seidel with
/// each partition.
#[must_use]
pub fn choices() -> Vec<Choice> {
    let cg = |preconditioner, matrix_free| {
        Choice::schur(Backend::ConjugateGradient(CgOptions {
            preconditioner,
            matrix_free,
            ..CgOptions::default()
        }))
    };
    let gauss_seidel = |partition| {
        Choice::schur(Backend::GaussSeidel(GaussSeidelOptions {
            partition,
            ..GaussSeidelOptions::default()
        }))
    };
    let preconditioners = [
        Preconditioner::None,
        Preconditioner::BlockJacobi,
        Preconditioner::Group,
    ];
    let gradients = preconditioners.map(|p| [cg(p, false), cg(p, true)]);
    let sweeps = [Partition::Joints, Partition::Groups].map(gauss_seidel);
    gradients.into_iter().flatten().chain(sweeps).collect()
}

/// Where an iteration starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// From zero.
    Cold,
    /// From the multipliers of the step before.
    Warm,
}

impl Start {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Cold, Self::Warm];
}

/// One row: a solver, a start and an error to reach on a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// Name of the scene.
    pub scene: String,
    /// Its size: segments, cables of a ladder, rows and columns of a net.
    pub size: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// Rows of the system.
    pub rows: usize,
    /// Backend, without iterations.
    pub backend: String,
    /// Where it starts; none for the direct solver.
    pub start: Option<Start>,
    /// Error to be reached.
    pub target: f64,
    /// Iterations that reach it, refinements of the direct solver; none where it is not reached within the limit; 0 of an
    /// iterative solver where the guess is within it already, which then has no time.
    pub iterations: Option<usize>,
    /// Error reached then, or at the limit.
    pub error: f64,
    /// Time from the pieces to the multipliers, the least \[ns].
    pub ns: Option<f64>,
    /// The same of the direct solver that reaches the error; none where it does not.
    pub direct_ns: Option<f64>,
    /// Why there are no numbers, where the solver failed.
    pub failure: Option<String>,
}

impl Record {
    /// Time of the direct solver over this one's: above 1 it wins.
    #[must_use]
    pub fn gain(&self) -> Option<f64> {
        Some(self.direct_ns? / self.ns?)
    }
}

/// All rows, and what was left out.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    /// Rows, case by case, the direct solver first; solvers, starts, errors.
    pub records: Vec<Record>,
    /// Solvers without rows.
    #[serde(skip)]
    pub omissions: Vec<Omission>,
}

/// One state of a scene, and what is known of its solution.
struct Case {
    name: String,
    size: usize,
    mass_ratio: f64,
    scene: Scene,
    state: Snapshot,
    /// Impulses of the step that led there.
    guess: Vec<f64>,
    exact: Vec<f64>,
}

/// What is timed.
const PHASES: [Phase; 4] = [
    Phase::Assemble,
    Phase::Factorize,
    Phase::Solve,
    Phase::Refine,
];

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

    fn stepper(&self, options: StepOptions) -> Result<Stepper, StepError> {
        Stepper::new(self.scene.clone(), options)
    }

    /// Error of one solve.
    fn error(&self, stepper: &mut Stepper, start: Start) -> Result<f64, StepError> {
        self.put(stepper, start)?;
        stepper.solve()?;
        Ok(forward_error(stepper.multipliers(), &self.exact))
    }

    /// Least time of a solve \[ns].
    fn time(&self, config: &Config, stepper: &mut Stepper, start: Start) -> Result<f64, StepError> {
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
    fn row(&self, backend: String, start: Option<Start>, target: f64) -> Record {
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
    fn direct(&self, config: &Config) -> Result<Vec<Record>, StepError> {
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
    fn iterative(
        &self,
        config: &Config,
        choice: &Choice,
        start: Start,
        direct: &[Record],
    ) -> Vec<Record> {
        let mut ladder = Ladder {
            case: self,
            config,
            choice,
            start,
            known: Vec::new(),
        };
        let rows = config.targets.iter().zip(direct).map(|(&target, direct)| {
            let mut row = self.row(choice.family(), Some(start), target);
            row.direct_ns = direct.ns;
            if let Err(e) = ladder.fill(&mut row) {
                row.failure = Some(e.to_string());
            }
            row
        });
        rows.collect()
    }
}

/// Errors of a solver over its iterations.
struct Ladder<'a> {
    case: &'a Case,
    config: &'a Config,
    choice: &'a Choice,
    start: Start,
    /// Limits of iterations and errors, ascending.
    known: Vec<(usize, f64)>,
}

impl Ladder<'_> {
    fn stepper(&self, iterations: usize) -> Result<Stepper, StepError> {
        let backend = self.choice.backend.with_iterations(iterations);
        let choice = Choice {
            backend: backend.with_tolerance(0.0),
            form: self.choice.form,
        };
        self.case.stepper(choice.plain_options(self.config.dt))
    }

    fn error(&mut self, iterations: usize) -> Result<f64, StepError> {
        let place = self.known.partition_point(|(k, _)| *k < iterations);
        match self.known.get(place) {
            Some((k, error)) if *k == iterations => Ok(*error),
            _ => {
                let error = self
                    .case
                    .error(&mut self.stepper(iterations)?, self.start)?;
                self.known.insert(place, (iterations, error));
                Ok(error)
            }
        }
    }

    /// Error of what it starts from.
    fn guessed(&self) -> f64 {
        match self.start {
            Start::Cold => 1.0,
            Start::Warm => forward_error(&self.case.guess, &self.case.exact),
        }
    }

    /// Fewest iterations for an error, as far as it falls with them.
    fn fewest(&mut self, target: f64) -> Result<Option<usize>, StepError> {
        if self.guessed() <= target {
            return Ok(Some(0));
        }
        let limit = self.config.limit;
        let (mut short, mut k) = (0, 1);
        while self.error(k)? > target {
            if k == limit {
                return Ok(None);
            }
            short = k;
            k = (k + k.div_ceil(3)).min(limit);
        }
        while k - short > 1 {
            let middle = short.midpoint(k);
            if self.error(middle)? <= target {
                k = middle;
            } else {
                short = middle;
            }
        }
        Ok(Some(k))
    }

    fn fill(&mut self, row: &mut Record) -> Result<(), StepError> {
        row.iterations = self.fewest(row.target)?;
        if row.iterations == Some(0) {
            row.error = self.guessed();
            return Ok(());
        }
        row.error = self.error(row.iterations.unwrap_or(self.config.limit))?;
        if let Some(k) = row.iterations {
            let mut stepper = self.stepper(k)?;
            row.ns = Some(self.case.time(self.config, &mut stepper, self.start)?);
        }
        Ok(())
    }
}

/// Runs all cases, one after the other, since their times are measured. `progress` advances once for each solver of each
/// case.
///
/// # Errors
/// A scene that cannot be built, the direct solver's failure; an iterative solver's own is a row.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Results, StepError> {
    let mut results = Results::default();
    let mut choices = Vec::new();
    for choice in &config.choices {
        match choice.check() {
            Ok(()) => choices.push(choice),
            Err(e) => results.omissions.push(Omission {
                backend: choice.family(),
                reason: e.to_string(),
            }),
        }
    }
    let hoists = config.segments.len() * config.ratios.len();
    progress.set_length(((hoists + config.networks.len()) * choices.len()) as u64);
    let mut measure = |case: Case| -> Result<(), StepError> {
        let direct = case.direct(config)?;
        results.records.extend_from_slice(&direct);
        for choice in &choices {
            for start in Start::ALL {
                let rows = case.iterative(config, choice, start, &direct);
                results.records.extend(rows);
            }
            progress.inc(1);
        }
        Ok(())
    };
    for &segments in &config.segments {
        for &ratio in &config.ratios {
            measure(Case::hoist(config, segments, ratio)?)?;
        }
    }
    for &(network, size) in &config.networks {
        measure(Case::network(config, network, size)?)?;
    }
    Ok(results)
}

/// What the rows say of one error and start: where iterations win.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The error.
    pub target: f64,
    /// The start.
    pub start: Start,
    /// Cases in which what it starts from is not within the error already.
    pub cases: usize,
    /// Those in which some iterative solver is faster than the direct one: the fastest
    /// row of each, the largest gain first.
    pub wins: Vec<Record>,
    /// The row that loses least, where none wins.
    pub nearest: Option<Record>,
}

/// A verdict for each start and error.
#[must_use]
pub fn verdicts(records: &[Record]) -> Vec<Verdict> {
    let mut targets: Vec<f64> = records.iter().map(|r| r.target).collect();
    targets.sort_by(|a, b| b.total_cmp(a));
    targets.dedup();
    let mut verdicts = Vec::new();
    for start in Start::ALL {
        for &target in &targets {
            let of = |r: &&Record| r.start == Some(start) && r.target == target;
            let (mut fastest, mut cases) = (Vec::new(), 0);
            let scene = |r: &Record| (r.scene.clone(), r.size, r.mass_ratio.to_bits());
            for case in records.chunk_by(|a, b| scene(a) == scene(b)) {
                let own: Vec<&Record> = case.iter().filter(of).collect();
                cases += usize::from(own.iter().any(|r| r.iterations != Some(0)));
                let reached = own.into_iter().filter(|r| r.gain().is_some());
                fastest.extend(
                    reached
                        .max_by(|a, b| {
                            a.gain()
                                .partial_cmp(&b.gain())
                                .unwrap_or(std::cmp::Ordering::Equal)
                        })
                        .cloned(),
                );
            }
            fastest.sort_by(|a, b| {
                b.gain()
                    .partial_cmp(&a.gain())
                    .unwrap_or(std::cmp::Ordering::Equal)
            });
            let nearest = fastest.first().cloned();
            let wins: Vec<Record> = fastest
                .into_iter()
                .filter(|r| r.gain() > Some(1.0))
                .collect();
            verdicts.push(Verdict {
                target,
                start,
                cases,
                nearest: nearest.filter(|_| wins.is_empty()),
                wins,
            });
        }
    }
    verdicts
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
            ..Config::default()
        }
    }

    #[test]
    fn rows_reach_what_they_say_and_no_fewer_iterations_do() {
        let config = tiny();
        let results = run(&config, &ProgressBar::hidden()).unwrap();
        let compiled = config.choices.len() - results.omissions.len();
        assert_eq!(results.records.len(), 3 * 3 * (1 + 2 * compiled));
        for r in &results.records {
            assert_eq!(r.failure, None, "{r:?}");
            assert_eq!(r.iterations.is_some(), r.error <= r.target, "{r:?}");
            // A guess that is near enough takes no time.
            let timed = r.iterations.is_some_and(|k| k > 0 || r.start.is_none());
            assert_eq!(timed, r.ns.is_some(), "{r:?}");
            assert!(
                r.direct_ns.is_some(),
                "the direct solver reaches all: {r:?}"
            );
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
            let mut ladder = Ladder {
                case: &case,
                config: &config,
                choice,
                start: Start::Warm,
                known: Vec::new(),
            };
            let Some(k) = ladder.fewest(1e-4).unwrap() else {
                continue;
            };
            assert!(ladder.error(k).unwrap() <= 1e-4);
            assert!(k <= 1 || ladder.error(k - 1).unwrap() > 1e-4, "{choice}");
        }
    }

    #[test]
    fn a_verdict_counts_cases_and_names_the_fastest() {
        let case = Case::hoist(&tiny(), 3, 1.0).unwrap();
        let row = |backend: &str, size: usize, ns: f64| Record {
            size,
            iterations: Some(1),
            ns: Some(ns),
            direct_ns: Some(100.0),
            ..case.row(backend.to_owned(), Some(Start::Warm), 1e-2)
        };
        let rows = [
            row("a", 1, 50.0),
            row("b", 1, 25.0),
            row("a", 2, 200.0),
            row("b", 2, 400.0),
        ];
        let all = verdicts(&rows);
        let warm = all.iter().find(|v| v.start == Start::Warm).unwrap();
        assert_eq!((warm.cases, warm.wins.len()), (2, 1));
        assert_eq!(
            (warm.wins[0].backend.as_str(), warm.wins[0].gain()),
            ("b", Some(4.0))
        );
        assert_eq!(warm.nearest, None);
        let losing = verdicts(&rows[2..]);
        let nearest = losing.iter().find_map(|v| v.nearest.clone()).unwrap();
        assert_eq!((nearest.backend.as_str(), nearest.gain()), ("a", Some(0.5)));
    }
}
