//! Wall time of a step.
//!
//! A pass is [`PASS`] steps from the common state, the same work each time. The least time of a step is the mean over a pass
//! of the least time that each of its steps took in any pass: none needs more than some tens of microseconds without a
//! disturbance. The median is that of whole passes.

use super::start::{PASS, Start};
use std::time::{Duration, Instant};
use taut_integrator::{StepError, Stepper};
use taut_measure::choice::Choice;

/// Fewest passes.
const PASSES: usize = 30;
const MOST: usize = 600;

/// Times of a step over the passes \[ns].
#[derive(Debug, Clone, Copy)]
pub(super) struct Summary {
    pub(super) min: f64,
    pub(super) median: f64,
    /// Half the range between the quartiles.
    pub(super) spread: f64,
}

impl Summary {
    /// Summary of the least time of each step of a pass and of the mean step of each pass.
    fn of(least: &[f64; PASS], mut passes: Vec<f64>) -> Self {
        passes.sort_by(f64::total_cmp);
        let at = |part: f64| passes[(part * (passes.len() - 1) as f64).round() as usize];
        Self {
            min: least.iter().sum::<f64>() / PASS as f64,
            median: at(0.5),
            spread: 0.5 * (at(0.75) - at(0.25)),
        }
    }
}

fn nanoseconds(since: Instant) -> f64 {
    since.elapsed().as_nanos() as f64
}

/// A step. Its time \[ns], which a spin makes longer by the part `slowed` of it, read from the clock and so some tens of
/// nanoseconds more.
pub(super) fn step(stepper: &mut Stepper, slowed: f64) -> Result<f64, StepError> {
    let clock = Instant::now();
    stepper.step()?;
    let mut spent = nanoseconds(clock);
    let end = spent * (1.0 + slowed);
    while spent < end {
        spent = nanoseconds(clock);
    }
    Ok(spent)
}

/// A pass, from the common state; `least` takes the least times of its steps, slowed as [`step`] has it. Mean time of a
/// step \[ns].
pub(super) fn pass(
    start: &Start,
    stepper: &mut Stepper,
    least: &mut [f64; PASS],
    slowed: f64,
) -> Result<f64, StepError> {
    start.put(stepper)?;
    let mut sum = 0.0;
    for least in least {
        let spent = step(stepper, slowed)?;
        *least = least.min(spent);
        sum += spent;
    }
    Ok(sum / PASS as f64)
}

/// Times passes for `budget`, but at least [`PASSES`] and at most [`MOST`] of them.
pub(super) fn time(start: &Start, choice: &Choice, budget: Duration) -> Result<Summary, StepError> {
    let mut stepper: Stepper = start.stepper(choice)?;
    let mut least = [f64::INFINITY; PASS];
    // Warms up.
    pass(start, &mut stepper, &mut least, 0.0)?;
    let (clock, mut passes) = (Instant::now(), Vec::with_capacity(MOST));
    while passes.len() < PASSES || (passes.len() < MOST && clock.elapsed() < budget) {
        passes.push(pass(start, &mut stepper, &mut least, 0.0)?);
    }
    Ok(Summary::of(&least, passes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disturbance_moves_neither_the_least_time_nor_the_median() {
        let least = std::array::from_fn(|i| 100.0 + i as f64);
        let summary = Summary::of(&least, vec![120.0, 9000.0, 119.0, 121.0, 118.0]);
        assert_eq!(summary.min, 114.5);
        assert_eq!((summary.median, summary.spread), (120.0, 1.0));
    }
}
