//! Times of entrants that take turns of about [`VISIT`] each, so that what slows the machine for a while slows all, and a
//! slow one waits until the others have had as much time. A turn begins with passes that are not timed, and is cut into
//! samples long enough for the clock.

use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};
use taut_integrator::{Phase, PhaseTimes, StepError};

pub const VISIT: Duration = Duration::from_millis(1);

/// Least duration of a sample: a thousand times that of reading the clock.
const SAMPLE: Duration = Duration::from_micros(25);

pub const LEAST_SAMPLES: usize = 5;

const MOST_PASSES: usize = 10_000;

/// What so many passes take: as a whole, its solve, and of that the refinement, where these are timed apart.
pub type Spent = [Duration; 3];

/// What is timed: makes so many passes.
pub type Work<'a> = Box<dyn FnMut(usize) -> Result<Spent, StepError> + 'a>;

/// Time of a pass \[ns].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Time {
    pub least: f64,
    pub median: f64,
    pub samples: usize,
}

/// A entrant with what was measured of it.
struct Entrant<'a> {
    work: Result<Work<'a>, StepError>,
    passes: usize,
    /// A pass outlasts ten turns, so the state of the caches is irrelevant.
    slow: bool,
    spent: Duration,
    /// Times of a pass in each sample \[ns].
    samples: Vec<[f64; 3]>,
}

impl<'a> Entrant<'a> {
    /// Makes two passes, the second of which says how long one is, and is the only sample without a share of time.
    fn new(work: Result<Work<'a>, StepError>, share: Duration) -> Self {
        let (mut passes, mut slow, mut samples) = (1, false, Vec::new());
        let work = work.and_then(|mut work| {
            work(1)?;
            let times = work(1)?;
            slow = times[0] > VISIT * 10;
            passes = (SAMPLE.as_nanos() / times[0].as_nanos().max(1)) as usize;
            if share.is_zero() {
                samples.push(times.map(|time| time.as_nanos() as f64));
            }
            Ok(work)
        });
        Self {
            work,
            passes: passes.clamp(1, MOST_PASSES),
            slow,
            spent: Duration::ZERO,
            samples,
        }
    }

    fn visit(&mut self) {
        let Ok(work) = &mut self.work else {
            return;
        };
        let clock = Instant::now();
        let mut turn = || {
            if !self.slow {
                // The others have taken the caches.
                work(self.passes)?;
            }
            loop {
                let times = work(self.passes)?;
                let pass = times.map(|time| time.as_nanos() as f64 / self.passes as f64);
                self.samples.push(pass);
                if clock.elapsed() >= VISIT {
                    return Ok(());
                }
            }
        };
        if let Err(e) = turn() {
            self.work = Err(e);
        }
        self.spent += clock.elapsed();
    }

    fn is_done(&self) -> bool {
        self.work.is_err() || self.samples.len() >= LEAST_SAMPLES
    }

    fn times(self) -> Result<[Time; 3], StepError> {
        let part = |part: usize| summary(self.samples.iter().map(|sample| sample[part]));
        self.work.map(|_| [0, 1, 2].map(part))
    }
}

/// The phases of a step, as they are timed.
pub fn spent(phases: &PhaseTimes) -> Spent {
    [phases.total(), phases.linear(), phases.of(Phase::Refine)]
}

pub fn sum(
    passes: usize,
    mut pass: impl FnMut() -> Result<Spent, StepError>,
) -> Result<Spent, StepError> {
    let mut all = Spent::default();
    for _ in 0..passes {
        for (sum, part) in all.iter_mut().zip(pass()?) {
            *sum += part;
        }
    }
    Ok(all)
}

fn summary(samples: impl Iterator<Item = f64>) -> Time {
    let mut sorted: Vec<f64> = samples.collect();
    sorted.sort_by(f64::total_cmp);
    let at = |i: usize| sorted.get(i).copied().unwrap_or(f64::NAN);
    Time {
        least: at(0),
        median: at(sorted.len() / 2),
        samples: sorted.len(),
    }
}

/// Times of entrants, round by round, until each has had its share and enough samples. Who has had more time than the
/// rounds so far waits. Without a share a pass of each is all. One that fails neither stops the others nor is waited for.
pub fn times<'a>(
    works: impl IntoIterator<Item = Result<Work<'a>, StepError>>,
    share: Duration,
) -> Vec<Result<[Time; 3], StepError>> {
    let entrants = works.into_iter().map(|work| Entrant::new(work, share));
    let mut entrants: Vec<Entrant<'_>> = entrants.collect();
    let clock = Instant::now();
    let all = share * u32::try_from(entrants.len()).unwrap_or(u32::MAX);
    let mut due = Duration::ZERO;
    let some_run = |entrants: &[Entrant<'_>]| entrants.iter().any(|entrant| entrant.work.is_ok());
    let is_timed = !share.is_zero();
    while is_timed
        && some_run(&entrants)
        && (clock.elapsed() < all || !entrants.iter().all(Entrant::is_done))
    {
        for entrant in &mut entrants {
            if entrant.spent <= due {
                entrant.visit();
            }
        }
        due += VISIT;
    }
    entrants.into_iter().map(Entrant::times).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_solver::SolveError;

    #[test]
    fn a_summary_has_the_least_and_the_median() {
        let time = summary([3.0, 1.0, 9.0].into_iter());
        assert_eq!((time.least, time.median, time.samples), (1.0, 3.0, 3));
        assert!(summary(std::iter::empty()).least.is_nan());
    }

    #[test]
    fn who_fails_is_left_alone() {
        let fails = || {
            Err(super::super::failed(SolveError::NotCompiled {
                backend: "none",
                feature: "none",
            }))
        };
        let works = |passes: usize| {
            std::thread::sleep(SAMPLE * u32::try_from(passes).unwrap_or(1));
            Ok([SAMPLE; 3])
        };
        let all = times([fails(), Ok(Box::new(works) as Work<'_>)], VISIT);
        assert!(all[0].is_err());
        assert!(
            all[1]
                .as_ref()
                .is_ok_and(|[t, ..]| t.samples >= LEAST_SAMPLES)
        );
        assert!(times([fails()], Duration::from_secs(3600))[0].is_err());
    }
}
