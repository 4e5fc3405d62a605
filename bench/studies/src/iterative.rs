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
//! direct solver refines; the least of several. The direct solver that a time is compared with is the cheaper of that
//! without and with one refinement that reaches the error.
//!
//! As measured, iterations win on no cable. From the pieces to the multipliers (assembly and solve; 24, 100, 1000
//! segments, ratios 1, 10³, 10⁵, errors 10⁻², 10⁻⁴, 10⁻⁸, from zero and from the last step's multipliers, which all
//! iterations start from by default) `banded` takes 3.9, 12 and 130 µs; the nearest is `gauss-seidel:groups`, 1.5 to 2
//! times that to 10⁻² at ratio 1, then `cg:group`, 2 to 5 times everywhere in 1 to 6 iterations. `cg:jacobi` needs 5 to
//! 50 iterations at 24 segments and hundreds from 100 on, `cg:none` hundreds and beyond 1000; Gauss–Seidel over joints
//! reaches 10⁻⁴ from zero nowhere. `minres/kkt` needs twice the iterations of `cg:jacobi`. A step's guess alone is within 10⁻² only in light motion (ratio 1). On a net of 8 ×
//! 8 nodes they win: `gauss-seidel:groups` and `cg:group` by 1.8 to 2.1 at every error, `cg:jacobi` by up to 2.0
//! (`taut study iterative`).

mod case;
mod search;
mod study;
mod table;
mod verdict;

pub(crate) use study::STUDY;
pub use verdict::{Verdict, verdicts};

use crate::cases::Cases;
use case::Case;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use taut_ground::choice::{Choice, Omission};
use taut_integrator::StepError;
use taut_model::Network;
use taut_output::check::ExperimentError;

/// Steps from the start to the state of a case.
pub const WARM_UP: usize = 30;

/// Angle at which the hoists start \[rad].
pub const ANGLE: f64 = 0.3;

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

/// Every iterative solver.
#[must_use]
pub fn choices() -> Vec<Choice> {
    let all = Choice::all().into_iter();
    all.filter(|choice| choice.backend.is_iterative()).collect()
}

/// Where an iteration starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// Least time of the direct solver that reaches the error \[ns]; none where it does not.
    pub direct_ns: Option<f64>,
    /// Reason for missing numbers if the solver failed: they are null in JSON. Without it null
    /// means not measured.
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

/// A scene that the solvers are compared on.
#[derive(Debug, Clone, Copy)]
enum Subject {
    Hoist(usize, f64),
    Network(Network, usize),
}

impl Subject {
    fn case(self, config: &Config) -> Result<Case, StepError> {
        match self {
            Self::Hoist(segments, ratio) => Case::hoist(config, segments, ratio),
            Self::Network(network, size) => Case::network(config, network, size),
        }
    }
}

/// Runs all cases, one after the other, since their times are measured.
///
/// # Errors
/// A scene that cannot be built, the direct solver's failure; an iterative solver's own is a row.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let mut omissions = Vec::new();
    let mut choices = Vec::new();
    for choice in &config.choices {
        match choice.check() {
            Ok(()) => choices.push(choice),
            Err(e) => omissions.push(Omission {
                backend: choice.family(),
                reason: e.to_string(),
            }),
        }
    }
    let mut subjects = Vec::new();
    for &segments in &config.segments {
        let ratios = config.ratios.iter();
        subjects.extend(ratios.map(|&ratio| Subject::Hoist(segments, ratio)));
    }
    let networks = config.networks.iter();
    subjects.extend(networks.map(|&(network, size)| Subject::Network(network, size)));
    let records = cases.in_turn("scenes", &subjects, |subject| {
        let case = subject.case(config)?;
        let direct = case.direct(config)?;
        let mut records = direct.clone();
        for choice in &choices {
            for start in Start::ALL {
                records.extend(case.iterative(config, choice, start, &direct));
            }
        }
        Ok::<_, StepError>(records)
    })?;
    Ok(Results {
        records: records.all()?.concat(),
        omissions,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use search::Search;

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
        let results = run(&config, &Cases::default()).unwrap();
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
            let mut search = Search {
                case: &case,
                config: &config,
                choice,
                start: Start::Warm,
                known: Vec::new(),
            };
            let Some(k) = search.fewest(1e-4).unwrap() else {
                continue;
            };
            assert!(search.error(k).unwrap() <= 1e-4);
            assert!(k <= 1 || search.error(k - 1).unwrap() > 1e-4, "{choice}");
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
