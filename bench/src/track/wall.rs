//! Wall time of a step, and its ratio to the calibration kernel.
//!
//! A pass is [`PASS`] steps from the common state. Passes take turns with the kernel for about as long, so that what
//! slows the machine for a while slows both; what is reported is the ratio of the two.

use super::calibration::Calibration;
use super::measures::Measure;
use super::start::{PASS, Start};
use crate::choice::Choice;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use taut_integrator::{StepError, Stepper};

/// Fewest passes.
pub(super) const PASSES: usize = 30;
/// Most.
const MOST: usize = 600;

/// Nanoseconds of a step in each pass, and of a unit of the kernel beside it.
#[derive(Debug, Clone, Default)]
pub(super) struct Times {
    step: Vec<f64>,
    unit: Vec<f64>,
}

impl Times {
    /// Ratio, least, median and half the range between the quartiles \[ns].
    pub(super) fn summary(&self) -> [f64; 4] {
        let step = sorted(&self.step);
        let ratios: Vec<f64> = self
            .step
            .iter()
            .zip(&self.unit)
            .map(|(s, u)| s / u)
            .collect();
        let at = |v: &[f64], part: f64| {
            let i = (part * v.len().saturating_sub(1) as f64).round() as usize;
            v.get(i).copied().unwrap_or(f64::NAN)
        };
        let spread = 0.5 * (at(&step, 0.75) - at(&step, 0.25));
        let ratios = sorted(&ratios);
        let unit = sorted(&self.unit);
        eprintln!("RATIO min {:.3} pair {:.3} med {:.3} n {}", step[0]/unit[0], at(&ratios,0.5), at(&step,0.5)/at(&unit,0.5), step.len());
        [
            at(&step, 0.0) / at(&sorted(&self.unit), 0.0),
            at(&step, 0.0),
            at(&step, 0.5),
            spread,
        ]
    }
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values
}

/// The measures of one or two threads, in the order of [`Times::summary`].
pub(super) fn measures(threads: usize) -> [Measure; 3] {
    match threads {
        1 => [Measure::Ratio, Measure::Min, Measure::Median],
        _ => [Measure::Ratio2, Measure::Min2, Measure::Median2],
    }
}

fn nanoseconds(work: impl FnOnce() -> Result<(), StepError>) -> Result<f64, StepError> {
    let start = Instant::now();
    work()?;
    Ok(start.elapsed().as_nanos() as f64)
}

/// Times passes until there are [`PASSES`] of them and `budget` is spent; then goes on without recording until all
/// `threads` have got so far.
fn thread(
    start: &Start,
    stepper: &mut Stepper,
    budget: Duration,
    threads: usize,
    done: &AtomicUsize,
) -> Result<Times, StepError> {
    let mut calibration = Calibration::new();
    let pass = |stepper: &mut Stepper| {
        start.put(stepper)?;
        nanoseconds(|| (0..PASS).try_for_each(|_| stepper.step().map(|_| ())))
    };
    let mut unit = |units: usize| -> Result<f64, StepError> {
        let spent = nanoseconds(|| {
            calibration.run(units);
            Ok(())
        });
        Ok(spent? / units as f64)
    };
    // Warms up, and finds how many units last as long as a pass.
    pass(stepper)?;
    unit(100)?;
    let units = (pass(stepper)? / unit(100)?).clamp(1.0, 1e6) as usize;
    let mut times = Times::default();
    let (clock, mut own) = (Instant::now(), true);
    while own || done.load(Ordering::Relaxed) < threads {
        let (unit, step) = (unit(units)?, pass(stepper)? / PASS as f64);
        if own {
            times.unit.push(unit);
            times.step.push(step);
            let enough = times.step.len() >= PASSES && clock.elapsed() >= budget;
            if enough || times.step.len() == MOST {
                own = false;
                done.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
    Ok(times)
}

/// Times the steps of as many simulations at once as `threads` says.
pub(super) fn time(
    start: &Start,
    choice: &Choice,
    budget: Duration,
    threads: usize,
) -> Result<Times, StepError> {
    let steppers = (0..threads).map(|_| start.stepper(choice));
    let mut steppers: Vec<Stepper> = steppers.collect::<Result<_, _>>()?;
    let done = AtomicUsize::new(0);
    let run = |stepper: &mut Stepper| {
        let times = thread(start, stepper, budget, threads, &done);
        if times.is_err() {
            // The others need not wait.
            done.fetch_add(threads, Ordering::Relaxed);
        }
        times
    };
    if let [stepper] = steppers.as_mut_slice() {
        return run(stepper);
    }
    let mut all = Times::default();
    std::thread::scope(|scope| {
        let run = &run;
        let spawned: Vec<_> = steppers
            .iter_mut()
            .map(|stepper| scope.spawn(move || run(stepper)))
            .collect();
        for handle in spawned {
            let times = handle
                .join()
                .unwrap_or_else(|p| std::panic::resume_unwind(p))?;
            all.step.extend(times.step);
            all.unit.extend(times.unit);
        }
        Ok(all)
    })
}
