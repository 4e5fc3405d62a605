//! Fig. 13: what a step costs over the number of elements \[SL §VII-C].
//!
//! The paper's solver, Gauss–Seidel over the groups with three iterations, and a banded factorisation beside it, on the
//! hoist under a load of a hundred segments, one run after the other. The phases of a step are those of the figure:
//! building the blocks (Jacobians, matrix, right-hand side), factorising the groups, iterating; their sum is the figure's
//! constraint force, and the update of the bodies is left out of it, as there.
//!
//! Over the elements N the total is fitted by a line and by a power,
//!
//! ```text
//! t = a + b N   (weights 1/t: the same relative error everywhere),      t = c N^p
//! ```
//!
//! from the medians over the steps of the best of several runs, since other work on the machine only adds time.

mod report;

pub use report::{charts, checks, text_tables};

use crate::options::pick;
use indicatif::ProgressBar;
use serde::Serialize;
use std::time::{Duration, Instant};
use taut_ground::trajectory::Timing;
use taut_integrator::{Phase, PhaseTimes, StepError, StepOptions, Stepper};
use taut_model::HoistParams;
use taut_output::check::{ExperimentError, Outcome, csv};
use taut_solver::{Backend, GaussSeidelOptions, Partition, Start};

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Numbers of elements, ascending.
    pub elements: Vec<usize>,
    /// Mass ratio load/element at which they are timed.
    pub ratio: f64,
    /// Other mass ratios, at `loaded` elements.
    pub ratios: Vec<f64>,
    /// Number of elements for these.
    pub loaded: usize,
    /// Sweeps of the paper's solver; the second for the comparison at a mass ratio of 10⁵.
    pub sweeps: [usize; 2],
    /// Rounds through all cells.
    pub repeats: usize,
    /// Time of the steps of a run \[s], but at least `least` steps.
    pub budget: f64,
    /// Least number of steps of a run.
    pub least: usize,
}

impl Config {
    /// 10 … 10⁴ elements; quick 30 … 1000.
    pub fn new(quick: bool) -> Self {
        let all = vec![10, 30, 100, 300, 1000, 3000, 10_000];
        Self {
            elements: pick(quick, [all, vec![30, 100, 300, 1000]]),
            ratio: 100.0,
            ratios: vec![10.0, 1e3, 1e5],
            loaded: 100,
            sweeps: [3, 20],
            repeats: 4,
            budget: pick(quick, [0.08, 0.02]),
            least: 7,
        }
    }
}

/// Time of the steps of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    pub solver: String,
    /// Sweeps; 0 for the direct solver.
    pub sweeps: usize,
    pub elements: usize,
    /// Mass ratio load/element.
    pub ratio: f64,
    /// Steps of a run.
    pub steps: usize,
    /// Median time of building the blocks \[ns].
    #[serde(rename = "building_ns")]
    pub building: f64,
    /// Median time of the factorisation \[ns].
    #[serde(rename = "factorisation_ns")]
    pub factorisation: f64,
    /// Median time of iterations, or solve and refinement \[ns].
    #[serde(rename = "iterations_ns")]
    pub iterations: f64,
    /// Median time of their sum \[ns].
    #[serde(rename = "total_ns")]
    pub total: f64,
    /// Least time of their sum \[ns].
    #[serde(rename = "least_ns")]
    pub least: f64,
}

/// The solver of the paper's Algorithm 1 with so many sweeps, or the direct one for 0.
fn options(sweeps: usize) -> StepOptions {
    let backend = match sweeps {
        0 => Backend::Banded,
        iterations => Backend::GaussSeidel(GaussSeidelOptions {
            partition: Partition::Groups,
            start: Start::Trial,
            iterations,
            ..GaussSeidelOptions::default()
        }),
    };
    StepOptions {
        refinements: usize::from(sweeps == 0),
        backend,
        ..StepOptions::paper()
    }
}

fn sum(times: &PhaseTimes, phases: &[Phase]) -> Duration {
    phases.iter().map(|&p| times.of(p)).sum()
}

const BUILDING: [Phase; 2] = [Phase::Linearize, Phase::Assemble];
const ITERATIONS: [Phase; 2] = [Phase::Solve, Phase::Refine];
const ALL: [Phase; 5] = [
    Phase::Linearize,
    Phase::Assemble,
    Phase::Factorize,
    Phase::Solve,
    Phase::Refine,
];

/// One run of a cell. The state is that of the hanging cable, put back before each step: what the step costs does not
/// depend on whether a motion with this solver would last.
fn time(config: &Config, elements: usize, ratio: f64, sweeps: usize) -> Result<Record, StepError> {
    let params = HoistParams {
        segments: elements,
        mass_ratio: ratio,
        ..HoistParams::default()
    };
    let options = options(sweeps);
    let solver = match sweeps {
        0 => "direct".to_owned(),
        n => format!("{n} iterations"),
    };
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    let start = stepper.scene().bodies.clone();
    let mut phases = Vec::new();
    let begin = Instant::now();
    while phases.len() <= config.least || begin.elapsed().as_secs_f64() < config.budget {
        stepper.set_state(&start, 0.0)?;
        phases.push(stepper.step()?.phases);
    }
    let median = |of: &[Phase]| Timing::of(phases.iter().skip(1).map(|p| sum(p, of)));
    let total = median(&ALL);
    Ok(Record {
        solver,
        sweeps,
        elements,
        ratio,
        steps: phases.len() - 1,
        building: median(&BUILDING).median,
        factorisation: median(&[Phase::Factorize]).median,
        iterations: median(&ITERATIONS).median,
        total: total.median,
        least: total.min,
    })
}

/// Times all cells one after the other, `repeats` times round, so that a slow spell of the machine hits none alone; the
/// round with the smallest median of a cell counts, and its least time of all rounds. `progress` advances once a run.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Vec<Record>, StepError> {
    let [few, many] = config.sweeps;
    let mut cells = Vec::new();
    for sweeps in [few, 0] {
        cells.extend(config.elements.iter().map(|&n| (n, config.ratio, sweeps)));
        cells.extend(config.ratios.iter().map(|&r| (config.loaded, r, sweeps)));
    }
    cells.push((PAPER_MANY.0, PAPER_MANY.1, many));
    let rounds = config.repeats.max(1);
    progress.set_length((cells.len() * rounds) as u64);
    // A processor that was idle is slow at first.
    time(config, config.loaded, config.ratio, few)?;
    let mut best: Vec<Record> = Vec::new();
    for round in 0..rounds {
        for (i, &(elements, ratio, sweeps)) in cells.iter().enumerate() {
            let record = time(config, elements, ratio, sweeps)?;
            progress.inc(1);
            if round == 0 {
                best.push(record);
                continue;
            }
            let least = record.least.min(best[i].least);
            if record.total < best[i].total {
                best[i] = record;
            }
            best[i].least = least;
        }
    }
    Ok(best)
}

/// Elements and mass ratio at which the paper needs 20 iterations in its 0.01 s.
const PAPER_MANY: (usize, f64) = (50, 1e5);

/// Offset and slope \[a, b] of the least-squares line y = a + b x.
pub fn line(points: &[[f64; 2]]) -> [f64; 2] {
    weighted_line(points, |_| 1.0)
}

/// Weighted least-squares line: offset and slope.
fn weighted_line(points: &[[f64; 2]], weight: impl Fn(&[f64; 2]) -> f64) -> [f64; 2] {
    let total: f64 = points.iter().map(&weight).sum();
    let mean = |i: usize| points.iter().map(|p| weight(p) * p[i]).sum::<f64>() / total;
    let (x, y) = (mean(0), mean(1));
    let of = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(|p| weight(p) * f(p)).sum::<f64>();
    let slope = of(&|p| (p[0] - x) * (p[1] - y)) / of(&|p| (p[0] - x).powi(2));
    [y - slope * x, slope]
}

/// Offset and slope of y = a + b x with the least sum of squared relative errors.
pub fn relative_line(points: &[[f64; 2]]) -> [f64; 2] {
    weighted_line(points, |p| p[1].powi(-2))
}

/// The exponent p of y = c x^p by least squares of the logarithms.
pub fn exponent(points: &[[f64; 2]]) -> f64 {
    let logs: Vec<_> = points.iter().map(|p| p.map(f64::ln)).collect();
    line(&logs)[1]
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let config = Config::new(quick);
    let records = run(&config, progress)?;
    Ok(Outcome {
        checks: checks(&records, &config),
        text: text_tables(&records, &config),
        csv: csv(&records)?,
        charts: charts(&records, &config),
        ..Outcome::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_powers_are_found_again() {
        let xs = [10.0, 100.0, 1e3, 1e4];
        let straight = xs.map(|x| [x, 3.0 + 0.25 * x]);
        for [a, b] in [line(&straight), relative_line(&straight)] {
            assert!(
                (a - 3.0).abs() < 1e-10 && (b - 0.25).abs() < 1e-13,
                "{a} {b}"
            );
        }
        let power = xs.map(|x| [x, 7.0 * x.powf(1.3)]);
        assert!((exponent(&power) - 1.3).abs() < 1e-13);
    }

    /// An error in the largest value does not move the offset that the small ones show.
    #[test]
    fn the_relative_line_keeps_the_small_end() {
        let mut points = [10.0, 100.0, 1e3, 1e4].map(|x| [x, 50.0 + x]);
        points[3][1] *= 1.1;
        assert!((relative_line(&points)[0] - 50.0).abs() < 3.0);
        assert!((line(&points)[0] - 50.0).abs() > 30.0);
    }
}
