//! The estimate of the load's error ([`StepOptions::estimate`]) against the error.
//!
//! The error is the largest distance of the load from a run of `FINE` sub-steps, over all steps; the estimate that of the
//! last step, the largest so far. A run whose load is more than a tenth of its way from the finer one is *chaotic*, or coarser
//! than its motion: no estimate is asked of it but to say so.

mod scenes;
mod study;

pub(crate) use study::STUDY;

use crate::cases::Cases;
use nalgebra::Vector3;
use scenes::Case;
use serde::{Deserialize, Serialize};
use std::time::Instant;
use taut_ground::inputs::Inputs;
use taut_ground::trajectory::{load_position, steps_in};
use taut_integrator::{ErrorEstimate, StepOptions, Stepper};
use taut_model::SceneSource;
use taut_output::check::ExperimentError;

/// Sub-steps of the reference.
const FINE: usize = 8;

/// Within which factor of the error an estimate is right, and the least part of it that it may be.
const FACTOR: f64 = 3.0;
const LEAST: f64 = 0.1;

/// Part of the load's way beyond which nothing is asked.
const PARTED: f64 = 0.1;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Mass ratios, or masses of the load, as scene parameters.
    pub ratios: Vec<&'static str>,
    /// Steps that one of the companion covers.
    pub every: Vec<usize>,
    /// Simulated time \[s].
    pub time: f64,
    /// Runs whose times are compared.
    pub repeats: usize,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            ratios: vec!["10", "1e3", "1e5"],
            every: vec![2, 4, 8],
            time: 10.0,
            repeats: 7,
        }
    }
}

impl Config {
    /// One ratio and 2 s.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            ratios: vec!["1e3"],
            every: vec![2],
            time: 2.0,
            repeats: 3,
        }
    }
}

/// An estimate and the error \[mm].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scene with its parameters.
    pub scene: String,
    /// Steps that one of the companion covers.
    pub every: usize,
    /// The diagonal of the box that the load moves in.
    pub extent_mm: f64,
    /// The error of the time step.
    pub error_mm: f64,
    /// Its estimate, `None` where the companion was lost.
    pub estimate_mm: Option<f64>,
    /// The estimate over the error.
    pub of_error: Option<f64>,
    /// The estimate of the error of the linear algebra.
    pub algebra_mm: f64,
    /// The error of the segments: the distance of twice as many, `None` where their number is not a parameter.
    pub segments_error_mm: Option<f64>,
    /// The estimate of that of their shape.
    pub segments_mm: f64,
    /// The load is off by more than a tenth of its way.
    pub parted: bool,
}

/// Cost of the estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// The scene with its parameters.
    pub scene: String,
    /// Steps that one of the companion covers.
    pub every: usize,
    /// The time of a run over that without estimate, the median of runs in turns.
    pub cost: f64,
}

/// All rows.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    /// Case by case, each companion in turn.
    pub estimates: Vec<Row>,
    /// The times.
    pub costs: Vec<Cost>,
}

/// A run, as far as it is compared.
struct Run {
    path: Vec<Vector3<f64>>,
    error: ErrorEstimate,
    seconds: f64,
}

/// The largest distance of two paths \[mm].
fn apart(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let distances = a.iter().zip(b).map(|(x, y)| 1e3 * (x - y).norm());
    distances.fold(0.0, taut_ground::errors::worse)
}

fn once(
    source: &SceneSource,
    case: &Case,
    options: StepOptions,
    time: f64,
) -> Result<Run, ExperimentError> {
    let scene = source.build()?;
    let inputs = case.controls.map(|text| Inputs::parse(text, &scene));
    let inputs = inputs.transpose()?.unwrap_or_default();
    let steps = steps_in(time, options.dt);
    let mut stepper = Stepper::new(scene, options)?;
    let mut path = Vec::with_capacity(steps);
    let mut error = ErrorEstimate::default();
    let begun = Instant::now();
    for _ in 0..steps {
        inputs.apply(&mut stepper)?;
        let report = stepper.step()?;
        path.push(load_position(stepper.scene()));
        error = report.error.unwrap_or(error);
    }
    let seconds = begun.elapsed().as_secs_f64();
    Ok(Run {
        path,
        error,
        seconds,
    })
}

fn with(substeps: usize, estimate: Option<usize>) -> StepOptions {
    StepOptions {
        substeps,
        estimate,
        ..StepOptions::default()
    }
}

fn rows(case: &Case, config: &Config) -> Result<Vec<Row>, ExperimentError> {
    let source = case.source()?;
    let time = config.time.min(case.longest);
    let fine = once(&source, case, with(FINE, None), time)?;
    let finer = match source.with_segments(2.0)? {
        Some(source) => Some(once(&source, case, with(FINE, None), time)?),
        None => None,
    };
    let of = |&every: &usize| {
        let run = once(&source, case, with(1, Some(every)), time)?;
        let corners = run
            .path
            .iter()
            .fold([run.path[0]; 2], |[low, high], x| [low.inf(x), high.sup(x)]);
        let extent_mm = 1e3 * (corners[1] - corners[0]).norm();
        let error_mm = apart(&run.path, &fine.path);
        let estimate_mm = (!run.error.lost).then_some(1e3 * run.error.time);
        Ok(Row {
            scene: case.name(),
            every,
            extent_mm,
            error_mm,
            estimate_mm,
            of_error: estimate_mm.map(|estimate| estimate / error_mm),
            algebra_mm: 1e3 * run.error.algebra,
            segments_error_mm: finer.as_ref().map(|finer| apart(&fine.path, &finer.path)),
            segments_mm: 1e3 * run.error.segments,
            parted: error_mm > PARTED * extent_mm,
        })
    };
    config.every.iter().map(of).collect()
}

/// The times of runs with companions over those without, in turns.
fn costs(case: &Case, config: &Config) -> Result<Vec<Cost>, ExperimentError> {
    let source = case.source()?;
    let of = |&every: &usize| {
        let ratio = |_| {
            let [with, without] = [Some(every), None]
                .map(|estimate| once(&source, case, with(1, estimate), config.time));
            Ok::<_, ExperimentError>(with?.seconds / without?.seconds)
        };
        let mut ratios = (0..config.repeats)
            .map(ratio)
            .collect::<Result<Vec<f64>, _>>()?;
        ratios.sort_by(f64::total_cmp);
        Ok(Cost {
            scene: case.name(),
            every,
            cost: ratios[ratios.len() / 2],
        })
    };
    config.every.iter().map(of).collect()
}

/// Runs all cases, in parallel, then those of the times.
///
/// # Errors
/// A scene that cannot be built, a step that fails.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let list = scenes::all(&config.ratios);
    let estimates = cases.parallel("estimates", &list, |case| rows(case, config))?;
    let timed = scenes::timed();
    let costs = cases.in_turn("costs", &timed, |case| costs(case, config))?;
    Ok(Results {
        estimates: estimates.all()?.concat(),
        costs: costs.all()?.concat(),
    })
}

/// For the estimates of one companion: their number, the number within the factor, and the least
/// estimate over its error.
fn score(rows: &[Row], every: usize) -> (usize, usize, f64) {
    let judged = rows.iter().filter(|row| row.every == every && !row.parted);
    let parts: Vec<f64> = judged.map(|row| row.of_error.unwrap_or(0.0)).collect();
    let right = |part: &&f64| (1.0 / FACTOR..=FACTOR).contains(*part);
    let least = parts.iter().copied().fold(f64::INFINITY, f64::min);
    (parts.len(), parts.iter().filter(right).count(), least)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_driven_hoist_is_estimated() {
        let case = Case::new(
            "hoist",
            "segments=6 mass_ratio=1e3 equilibrium=true move_x=1",
        );
        let config = Config {
            time: 4.0,
            ..Config::quick()
        };
        let rows = rows(&case, &config).expect("runs");
        let part = rows[0].of_error.expect("an estimate");
        assert!((0.5..=2.0).contains(&part), "{rows:?}");
        assert_eq!(score(&rows, 2).1, 1);
    }
}
