//! Wall time of a step, and its ratio to the calibration kernel.
//!
//! A pass is [`PASS`] steps from the common state, the same work each time. Passes take turns with the kernel for about as
//! long, so that what slows the machine for a while slows both. The least time of a step is the mean over a pass of the
//! least time that each of its steps took in any pass, and the kernel's that of its shortest slice: neither needs more
//! than some tens of microseconds without a disturbance. The median is that of whole passes.

use super::calibration::Calibration;
use super::measures::Measure;
use super::start::{PASS, Start};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use taut_ground::choice::Choice;
use taut_integrator::{StepError, Stepper};

/// Fewest passes.
const PASSES: usize = 30;
/// Most.
const MOST: usize = 600;
/// Units of the kernel in a slice.
const SLICE: usize = 32;

/// Times of passes and of the kernel beside them \[ns].
#[derive(Debug, Clone)]
pub(super) struct Times {
    /// Least of each step of a pass.
    least: [f64; PASS],
    /// Mean of a step in each pass.
    passes: Vec<f64>,
    /// Least of a unit of the kernel.
    unit: f64,
}

/// What is reported of them: the ratio of the least times; the others in ns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Summary {
    pub(super) ratio: f64,
    pub(super) min: f64,
    pub(super) median: f64,
    /// Half the range between the quartiles.
    pub(super) spread: f64,
}

impl Times {
    fn new() -> Self {
        Self {
            least: [f64::INFINITY; PASS],
            passes: Vec::with_capacity(MOST),
            unit: f64::INFINITY,
        }
    }

    /// Takes in those of another thread.
    fn join(&mut self, other: &Self) {
        for (own, other) in self.least.iter_mut().zip(&other.least) {
            *own = own.min(*other);
        }
        self.passes.extend(&other.passes);
        self.unit = self.unit.min(other.unit);
    }

    pub(super) fn summary(&self) -> Summary {
        let min = self.least.iter().sum::<f64>() / PASS as f64;
        let mut passes = self.passes.clone();
        passes.sort_by(f64::total_cmp);
        let at = |part: f64| {
            let i = (part * passes.len().saturating_sub(1) as f64).round() as usize;
            passes.get(i).copied().unwrap_or(f64::NAN)
        };
        Summary {
            ratio: min / self.unit,
            min,
            median: at(0.5),
            spread: 0.5 * (at(0.75) - at(0.25)),
        }
    }
}

/// The figures of one thread or of two.
pub(super) fn figures(threads: usize, summary: &Summary) -> [(Measure, f64, Option<f64>); 3] {
    let measures = measures(threads);
    [
        (measures[0], summary.ratio, None),
        (measures[1], summary.min, None),
        (measures[2], summary.median, Some(summary.spread)),
    ]
}

/// What is measured with one thread or with two.
pub(super) fn measures(threads: usize) -> [Measure; 3] {
    match threads {
        1 => [Measure::Ratio, Measure::Min, Measure::Median],
        _ => [Measure::Ratio2, Measure::Min2, Measure::Median2],
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

/// Slices of the kernel; the least time of a unit \[ns].
fn calibrate(calibration: &mut Calibration, slices: usize) -> f64 {
    let slice = |_| {
        let clock = Instant::now();
        calibration.run(SLICE);
        nanoseconds(clock) / SLICE as f64
    };
    (0..slices).map(slice).fold(f64::INFINITY, f64::min)
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
    let mut cold = [0.0; PASS];
    // Warms up, and finds how many slices last as long as a pass.
    pass(start, stepper, &mut cold, 0.0)?;
    let unit = calibrate(&mut calibration, 4);
    let mean = pass(start, stepper, &mut cold, 0.0)?;
    let slices = (mean * PASS as f64 / (unit * SLICE as f64)).clamp(1.0, 1e5) as usize;
    let mut times = Times::new();
    let (clock, mut own) = (Instant::now(), true);
    while own || done.load(Ordering::Relaxed) < threads {
        let unit = calibrate(&mut calibration, slices);
        if !own {
            pass(start, stepper, &mut cold, 0.0)?;
            continue;
        }
        let mean = pass(start, stepper, &mut times.least, 0.0)?;
        times.passes.push(mean);
        times.unit = times.unit.min(unit);
        let enough = times.passes.len() >= PASSES && clock.elapsed() >= budget;
        if enough || times.passes.len() == MOST {
            own = false;
            done.fetch_add(1, Ordering::Relaxed);
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
    let mut all = Times::new();
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
            all.join(&times);
        }
        Ok(all)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disturbance_moves_neither_the_least_time_nor_the_median() {
        let mut times = Times::new();
        times.least = std::array::from_fn(|i| 100.0 + i as f64);
        times.passes = vec![120.0, 9000.0, 119.0, 121.0, 118.0];
        times.unit = 10.0;
        let mut other = Times::new();
        other.least = [1e6; PASS];
        other.least[0] = 70.0;
        other.unit = 11.0;
        times.join(&other);
        let summary = times.summary();
        assert_eq!(summary.min, 113.5);
        assert_eq!(summary.ratio, 11.35);
        assert_eq!((summary.median, summary.spread), (120.0, 1.0));
        assert!(Times::new().summary().median.is_nan());
    }
}
