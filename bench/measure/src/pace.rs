//! How fast simulations go: the steps and the time that all threads have simulated, counted as they step, and what
//! progress bars say of them.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use taut_integrator::{StepError, StepReport, Stepper};

/// Steps made through [`step`].
static STEPS: AtomicU64 = AtomicU64::new(0);

/// Their simulated time \[ps].
static PICOSECONDS: AtomicU64 = AtomicU64::new(0);

/// Totals simulated up to a moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Made {
    pub steps: u64,
    /// Simulated time \[ps].
    pub picoseconds: u64,
}

/// Steps, and counts the step; the count is the program's, not the stepper's.
pub fn step(stepper: &mut Stepper) -> Result<StepReport, StepError> {
    let report = stepper.step()?;
    STEPS.fetch_add(1, Ordering::Relaxed);
    PICOSECONDS.fetch_add((1e12 * stepper.options().dt) as u64, Ordering::Relaxed);
    Ok(report)
}

/// Totals of all threads.
pub fn made() -> Made {
    Made {
        steps: STEPS.load(Ordering::Relaxed),
        picoseconds: PICOSECONDS.load(Ordering::Relaxed),
    }
}

/// Period over which a bar averages.
const WINDOW: Duration = Duration::from_secs(3);

/// How often it looks.
const INTERVAL: Duration = Duration::from_millis(100);

/// The last seconds of what was simulated.
#[derive(Debug, Clone, Default)]
pub struct Pace {
    seen: VecDeque<(Instant, Made)>,
}

impl Pace {
    /// Notes what has been simulated until now.
    pub fn note(&mut self, now: Instant, made: Made) {
        let since = |then: Instant| now.saturating_duration_since(then);
        if self
            .seen
            .back()
            .is_some_and(|(last, _)| since(*last) < INTERVAL)
        {
            return;
        }
        self.seen.push_back((now, made));
        while self
            .seen
            .get(1)
            .is_some_and(|(second, _)| since(*second) >= WINDOW)
        {
            self.seen.pop_front();
        }
    }

    /// Steps and simulated seconds for each second of the clock; none where no step was made.
    pub fn rates(&self) -> Option<(f64, f64)> {
        let ((start, before), (end, after)) = (self.seen.front()?, self.seen.back()?);
        let seconds = end.saturating_duration_since(*start).as_secs_f64();
        let steps = after.steps.wrapping_sub(before.steps);
        let simulated = 1e-12 * after.picoseconds.wrapping_sub(before.picoseconds) as f64;
        (steps > 0 && seconds > 0.0).then(|| (steps as f64 / seconds, simulated / seconds))
    }

    /// Text of a bar: steps a second and the real-time factor, simulated time over wall-clock time.
    /// Without simulation it is the bar's own units a second.
    pub fn text(&self, units_per_second: f64) -> String {
        match self.rates() {
            Some((steps, simulated)) => {
                format!("{} steps/s, {}× real time", short(steps), short(simulated))
            }
            None => format!("{}/s", short(units_per_second)),
        }
    }
}

/// Three digits, thousands and millions as `k` and `M`.
fn short(x: f64) -> String {
    let (value, unit) = match x {
        x if x < 1e3 => (x, ""),
        x if x < 1e6 => (x / 1e3, "k"),
        x => (x / 1e6, "M"),
    };
    let digits = match value {
        v if v < 0.1 => 3,
        v if v < 10.0 => 2,
        v if v < 100.0 => 1,
        _ => 0,
    };
    format!("{value:.digits$}{unit}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_integrator::StepOptions;
    use taut_model::HoistParams;

    /// Totals of `count` steps of 1/50 s.
    fn steps(count: u64) -> Made {
        Made {
            steps: count,
            picoseconds: count * 20_000_000_000,
        }
    }

    #[test]
    fn the_pace_is_that_of_the_last_seconds() {
        let start = Instant::now();
        let after = |seconds| start + Duration::from_secs_f64(seconds);
        let mut pace = Pace::default();
        assert_eq!(pace.text(1.25), "1.25/s");
        pace.note(start, steps(1000));
        assert_eq!(pace.text(12.5), "12.5/s");
        // 25 000 steps of 1/50 s in two seconds; what comes too soon is not looked at.
        pace.note(after(2.0), steps(26_000));
        pace.note(after(2.01), steps(90_000));
        assert_eq!(pace.rates(), Some((12_500.0, 250.0)));
        assert_eq!(pace.text(0.0), "12.5k steps/s, 250× real time");
        // The beginning is out of sight, and then nothing is made.
        pace.note(after(4.0), steps(26_050));
        pace.note(after(6.0), steps(26_100));
        assert_eq!(pace.text(0.0), "25.0 steps/s, 0.50× real time");
        pace.note(after(9.0), steps(26_100));
        assert_eq!(pace.text(0.04), "0.040/s");
    }

    #[test]
    fn steps_are_counted_with_their_time() {
        let scene = HoistParams {
            segments: 2,
            ..HoistParams::default()
        };
        let options = StepOptions {
            dt: 0.125,
            ..StepOptions::default()
        };
        let mut stepper = Stepper::new(scene.build().unwrap(), options).unwrap();
        let before = made();
        step(&mut stepper).unwrap();
        let after = made();
        // Other tests step at the same time.
        assert!(after.steps > before.steps);
        assert!(after.picoseconds >= before.picoseconds + 125_000_000_000);
        assert_eq!(stepper.time(), 0.125);
    }

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 0.0123, 0.5, 45.67, 789.0, 12_345.0, 6.789e6].map(short);
        let expected = ["0.000", "0.012", "0.50", "45.7", "789", "12.3k", "6.79M"];
        assert_eq!(shown, expected);
    }
}
