//! Per-step figures that CI can trust: instructions, allocations, errors and wall time of a fixed set of scenes and
//! solvers, against a baseline that is kept with the source.
//!
//! All are of the default step at 1/60 s from a common state of the scene, [`WARM_UP`](taut_studies::scenes::WARM_UP) steps from
//! its beginning. Instructions repeat from run to run and are judged against the baseline; errors and allocations have
//! bars of their own; wall time depends on the machine and on what else it does, and is only shown. Times are judged
//! against another program, in turns with it.
//!
//! | module | holds |
//! |---|---|
//! | `cases` | what is tracked, and the bars |
//! | `measures` | the figures of a case |
//! | `start` | common states, errors, allocations |
//! | `wall` | times |
//! | `minute` | the steps of a driven minute |
//! | `callgrind` | instructions |
//! | `compare` | the verdicts |
//! | `formats`, `table` | files for programs, tables for people |
//! | `child` | programs that are run for a limited time |
//! | `base` | what is compared with: a program, or a revision that is built |
//! | `peer` | a program that times steps as it is asked to |
//! | `against`, `ratio` | two programs in turns, and the statistics of it |
//! | `self_test` | this program in turns with itself |
//! | `history` | the figures of many runs |

mod against;
mod base;
mod callgrind;
mod cases;
mod child;
mod compare;
mod formats;
mod history;
mod measures;
mod minute;
mod peer;
mod ratio;
mod self_test;
mod start;
mod table;
mod wall;

pub use against::{Effort, Versus, against, ratios};
pub use base::{Program, base};
pub use callgrind::Counter;
pub use cases::{CASES, Case, DT, Workload, named};
pub use compare::{Comparison, Row, TOLERANCE, compare, uncompared, updated};
pub use formats::{Entry, Metric, Metrics, bencher, entries};
pub use history::{HISTORY, Run, append, data, read};
pub use measures::{Figure, Kind, Measure, Missing};
pub use peer::serve;
pub use ratio::Ratio;
pub use self_test::{SelfTest, self_test};
pub use start::{PASS, steps};
pub use table::{AGAINST_LEGEND, LEGEND, against_text, self_test_text, text};

use crate::machine::{Machine, RUSTC, TARGET_CPU};
use indicatif::ProgressBar;
use minute::Minutes;
use rayon::prelude::*;
use start::{Judged, Start};
use std::time::{Duration, Instant};
use taut_integrator::StepError;
use taut_measure::Choice;
use taut_output::settings::distinct;

#[derive(Debug, Clone)]
pub struct Config {
    pub cases: Vec<Case>,
    /// `None` counts no instructions.
    pub counter: Option<Counter>,
    /// Shortest time that the passes of a case are timed for.
    pub budget: Duration,
}

/// Compiler and processor that this program was built with and for.
fn toolchain() -> String {
    format!("{RUSTC}, {TARGET_CPU}")
}

/// Measures all cases, one figure after the other in the order of [`Case::measures`]: instructions and errors in
/// parallel, times afterwards alone. `progress` advances twice for each case.
pub fn run(config: &Config, progress: &ProgressBar) -> Vec<Figure> {
    progress.set_length(2 * config.cases.len() as u64);
    progress.set_message("instructions, errors");
    let cases = &config.cases;
    let workloads = distinct(cases.iter().map(|case| case.workload));
    let judged: Vec<(Workload, Result<Judged, Missing>)> = workloads
        .par_iter()
        .map(|&workload| (workload, Judged::new(workload).map_err(Missing::from)))
        .collect();
    let judged = |case: &Case| {
        let own = judged
            .iter()
            .find(|(workload, _)| *workload == case.workload);
        &own.expect("the workload of every case is judged").1
    };
    let mut figures: Vec<Vec<Figure>> = cases
        .par_iter()
        .map(|case| {
            let figures = untimed(case, config.counter.as_ref(), judged(case));
            progress.inc(1);
            figures
        })
        .collect();
    progress.set_message("times");
    let machine = Machine::current();
    for (case, figures) in cases.iter().zip(&mut figures) {
        figures.extend(timed(case, config.budget, &machine, judged(case)));
        progress.inc(1);
    }
    figures.into_iter().flatten().collect()
}

fn figure(case: &Case, measure: Measure, value: Result<f64, Missing>) -> Figure {
    let bar = case.bar(measure);
    Figure {
        case: case.name(),
        measure,
        value,
        spread: None,
        condition: bar.map_or_else(String::new, |bar| format!("at most {bar:?}")),
        bar,
    }
}

fn untimed(
    case: &Case,
    counter: Option<&Counter>,
    judged: &Result<Judged, Missing>,
) -> Vec<Figure> {
    let choice = case.choice().map_err(Missing::NotMeasured);
    let measures = case.measures().filter(|m| m.kind() != Kind::Wall);
    let one = |measure: Measure| {
        let choice = match &choice {
            Ok(choice) => choice,
            Err(missing) => return figure(case, measure, Err(missing.clone())),
        };
        if measure == Measure::Instructions {
            return instructions(case, counter);
        }
        let judged = judged.as_ref().map_err(Clone::clone);
        let value = judged.and_then(|judged| judged.figure(case, choice, measure));
        figure(case, measure, value)
    };
    measures.map(one).collect()
}

fn instructions(case: &Case, counter: Option<&Counter>) -> Figure {
    let measure = Measure::Instructions;
    let Some(counter) = counter else {
        let why = "instructions were not counted: `--instructions` counts them".to_owned();
        return figure(case, measure, Err(Missing::NotMeasured(why)));
    };
    match counter.per_step(case) {
        Ok(count) => Figure {
            condition: counter.toolchain().to_owned(),
            ..figure(case, measure, Ok(count))
        },
        Err(missing) => figure(case, measure, Err(missing)),
    }
}

fn timed(
    case: &Case,
    budget: Duration,
    machine: &Machine,
    judged: &Result<Judged, Missing>,
) -> Vec<Figure> {
    let known = || -> Result<(Choice, &Start), Missing> {
        let choice = case.choice().map_err(Missing::NotMeasured)?;
        Ok((choice, &judged.as_ref().map_err(Clone::clone)?.start))
    };
    let passes = known().and_then(|(choice, start)| Ok(wall::time(start, &choice, budget)?));
    let minute = || known().and_then(|(choice, start)| Ok(minute(start, &choice, budget)?));
    let times = case.measures().filter(|m| m.kind() == Kind::Wall);
    let time = |measure| {
        let passes = passes.clone();
        let spread = passes.as_ref().ok().map(|p| p.spread);
        Figure {
            spread: spread.filter(|_| measure == Measure::Median),
            condition: machine.to_string(),
            ..match measure {
                Measure::Min => figure(case, measure, passes.map(|p| p.min)),
                Measure::Median => figure(case, measure, passes.map(|p| p.median)),
                _ => figure(case, measure, minute()),
            }
        }
    };
    times.map(time).collect()
}

/// Fewest minutes whose steps are timed.
const MINUTES: usize = 3;

fn minute(start: &Start, choice: &Choice, budget: Duration) -> Result<f64, StepError> {
    let (clock, mut minutes) = (Instant::now(), Minutes::new());
    let mut count = 0;
    while count < MINUTES || clock.elapsed() < budget {
        minutes.drive(start.scene(), choice, 0.0)?;
        count += 1;
    }
    Ok(minutes.p99())
}
