//! Runs a setting through both motions, and finds the cheapest within the bar.

use super::{Config, params};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};
use taut_ground::engine::motion::{self, Converged, FRAME, Motion};
use taut_ground::engine::{Engine, Frame, Setting};
use taut_ground::trajectory::{Timing, steps_in};
use taut_integrator::StepError;

/// Errors `E` of the motions with a setting, and its times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome<E = Hung> {
    /// Steps a frame.
    pub substeps: usize,
    #[serde(flatten)]
    pub errors: E,
    /// Frame, median; NaN where the motion failed \[ns].
    pub frame_ns: f64,
    /// Frame, minimum, likewise \[ns].
    pub frame_ns_min: f64,
    /// Reason for a missing error; times are NaN then, null in JSON.
    pub failure: Option<String>,
}

/// Errors, none of them where a motion failed.
pub trait Errors {
    /// Each of them.
    fn all(&self) -> [Option<f64>; 2];
}

/// Errors on the hoist.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hung {
    /// Largest difference of the elongation at rest from the analytic one in the second second, over the length.
    pub elongation_error: Option<f64>,
    /// Largest distance of the swinging load from the reference, over the length.
    pub load_error: Option<f64>,
}

impl Errors for Hung {
    fn all(&self) -> [Option<f64>; 2] {
        [self.elongation_error, self.load_error]
    }
}

impl<E: Errors> Outcome<E> {
    /// Outcome of a run that took `times`, or ended early for the reason in `ran`.
    pub(super) fn new<M, P>(
        setting: &Setting<M, P>,
        errors: E,
        ran: Result<(), String>,
        times: Vec<Duration>,
    ) -> Self {
        let failure = ran.err();
        let timing = match failure.as_deref() {
            Some(reason) if reason != SLOW => Timing::of(std::iter::empty()),
            _ => Timing::of(times.into_iter()),
        };
        Self {
            substeps: setting.substeps,
            errors,
            frame_ns: timing.median,
            frame_ns_min: timing.min,
            failure,
        }
    }

    /// The larger error; infinite where a motion has none.
    #[must_use]
    pub fn error(&self) -> f64 {
        match self.errors.all() {
            [Some(a), Some(b)] => a.max(b),
            _ => f64::INFINITY,
        }
    }
}

/// A setting of an engine that is a row, what came of it, and how many settings were tried.
pub(super) struct Row<'a, E = Hung, M = Motion, P = Vector3<f64>> {
    pub(super) setting: &'a Setting<M, P>,
    pub(super) outcome: Outcome<E>,
    pub(super) tried: usize,
}

/// Row of a table, for any engine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry<E = Hung> {
    pub engine: String,
    pub setting: String,
    /// A search chose the setting.
    pub searched: bool,
    /// Settings tried.
    pub tried: usize,
    #[serde(flatten)]
    pub outcome: Outcome<E>,
    /// Both errors are within the bar.
    pub within: bool,
}

impl<E: Errors, M, P> Row<'_, E, M, P> {
    /// The entry of a row of this engine.
    pub(super) fn entry(self, engine: &Engine<M, P>, bar: f64) -> Entry<E> {
        Entry {
            engine: engine.name.to_owned(),
            setting: self.setting.text.clone(),
            searched: !engine.all,
            tried: self.tried,
            within: self.outcome.error() <= bar,
            outcome: self.outcome,
        }
    }
}

/// A cable, with what runs on it are judged by.
pub(super) struct Cable {
    rest: Motion,
    swing: Motion,
    pub(super) reference: Converged,
    /// Distance from the anchor at which a load is lost \[m].
    reach: f64,
}

/// Why a setting was not run to its end.
const SLOW: &str = "too slow";
/// Turns that the settings of a table are timed in, and frames of a turn.
const TURNS: usize = 8;
const TURN: usize = 40;

/// Time at rest, the second half of which counts \[s].
const REST: f64 = 2.0;

impl Cable {
    pub(super) fn new(
        config: &Config,
        segments: usize,
        mass_ratio: f64,
    ) -> Result<Self, StepError> {
        let at = |angle| Motion {
            params: params(segments, mass_ratio),
            angle,
        };
        let swing = at(config.angle);
        Ok(Self {
            reference: motion::converged(&swing, steps_in(config.time, FRAME))?,
            reach: motion::reach(&swing.params)?,
            rest: at(0.0),
            swing,
        })
    }

    /// Times the rows again.
    pub(super) fn time(&self, rows: &mut [Row<'_>]) -> Result<(), StepError> {
        in_turns(rows, &self.swing)
    }

    pub(super) fn length(&self) -> f64 {
        self.rest.params.length
    }

    /// Runs a setting through both motions, the swing first. Ends early where the load is lost or the first frames take
    /// longer than `longest_ns`.
    pub(super) fn run(&self, setting: &Setting, longest_ns: f64) -> Result<Outcome, StepError> {
        let mut times = Vec::new();
        let mut load_error = 0.0_f64;
        let mut exact = self.reference.load.iter();
        let swung = self.frames(
            (setting.start)(&self.swing)?,
            self.reference.load.len(),
            longest_ns,
            &mut times,
            |load| {
                if let Some(exact) = exact.next() {
                    load_error = load_error.max((load - Vector3::from(*exact)).norm());
                }
            },
        );
        let mut elongation_error = 0.0_f64;
        let rested = swung.and_then(|()| {
            let frames = steps_in(REST, FRAME);
            let analytic = self.rest.params.exact_elongation();
            let mut frame = 0;
            let start = (setting.start)(&self.rest).map_err(|e| e.to_string())?;
            self.frames(start, frames, longest_ns, &mut times, |load| {
                frame += 1;
                if 2 * frame > frames {
                    let elongation = -load.z - self.length();
                    elongation_error = elongation_error.max((elongation - analytic).abs());
                }
            })
        });
        let known = |error: f64| rested.is_ok().then_some(error / self.length());
        let errors = Hung {
            elongation_error: known(elongation_error),
            load_error: known(load_error),
        };
        Ok(Outcome::new(setting, errors, rested, times))
    }

    fn frames(
        &self,
        frame: Frame,
        count: usize,
        longest_ns: f64,
        times: &mut Vec<Duration>,
        mut each: impl FnMut(Vector3<f64>),
    ) -> Result<(), String> {
        frames(frame, count, longest_ns, times, |load| {
            let distance = load.norm();
            each(load);
            !distance.is_nan() && distance <= self.reach
        })
    }
}

/// Runs frames, until `each` finds its motion lost or the first take longer than `longest_ns`.
pub(super) fn frames<P>(
    mut frame: Frame<P>,
    count: usize,
    longest_ns: f64,
    times: &mut Vec<Duration>,
    mut each: impl FnMut(P) -> bool,
) -> Result<(), String> {
    let mut quickest = Duration::MAX;
    for i in 0..count {
        let start = Instant::now();
        let known = frame()?;
        let time = start.elapsed();
        // The first frames may allocate.
        if i > 0 {
            times.push(time);
        }
        quickest = quickest.min(time);
        if !each(known) {
            let t = FRAME * (i + 1) as f64;
            return Err(format!("lost at {t:.2} s"));
        }
        if i == 4 && quickest.as_nanos() as f64 > longest_ns {
            return Err(SLOW.to_owned());
        }
    }
    Ok(())
}

/// Times the rows again, all of them in turns, so that what else the machine does falls on all alike.
pub(super) fn in_turns<E, M, P>(
    rows: &mut [Row<'_, E, M, P>],
    motion: &M,
) -> Result<(), StepError> {
    let mut times = vec![Vec::new(); rows.len()];
    for _ in 0..TURNS {
        for (row, times) in rows.iter().zip(&mut times) {
            if row.outcome.failure.is_some() {
                continue;
            }
            let frame = (row.setting.start)(motion)?;
            let run = frames(frame, TURN, f64::INFINITY, times, |_| true);
            debug_assert!(run.is_ok(), "{run:?}: it ran before");
        }
    }
    for (row, times) in rows.iter_mut().zip(times) {
        if times.is_empty() {
            continue;
        }
        let timing = Timing::of(times.into_iter());
        row.outcome.frame_ns = timing.median;
        row.outcome.frame_ns_min = timing.min;
    }
    Ok(())
}

/// The rows of an engine: all of its settings, or the cheapest whose errors are within the bar, of those whose frame
/// takes no longer than `longest_ns`. `run` runs a setting, and may give up beyond the time that it is given.
pub(super) fn rows<'a, E: Errors, M, P>(
    engine: &'a Engine<M, P>,
    bar: f64,
    longest_ns: f64,
    run: impl Fn(&'a Setting<M, P>, f64) -> Result<Outcome<E>, StepError>,
) -> Result<Vec<Row<'a, E, M, P>>, StepError> {
    if engine.all {
        let settings = engine.ladders.iter().flatten();
        return settings
            .map(|setting| {
                let outcome = run(setting, f64::INFINITY)?;
                Ok(Row {
                    setting,
                    outcome,
                    tried: 1,
                })
            })
            .collect();
    }
    let mut best: Option<Row<'a, E, M, P>> = None;
    let mut tried = 0;
    for ladder in &engine.ladders {
        for setting in ladder {
            // Beyond what the best costs no setting is of use.
            let longest = match &best {
                Some(best) if best.outcome.error() <= bar => {
                    best.outcome.frame_ns_min.min(longest_ns)
                }
                _ => longest_ns,
            };
            let outcome = run(setting, longest)?;
            let slow = outcome.frame_ns_min > longest;
            tried += 1;
            let within = outcome.error() <= bar;
            if best
                .as_ref()
                .is_none_or(|best| better(&outcome, &best.outcome, bar))
            {
                best = Some(Row {
                    setting,
                    outcome,
                    tried,
                });
            }
            if within || slow {
                break;
            }
        }
    }
    Ok(best.into_iter().map(|row| Row { tried, ..row }).collect())
}

/// Within the bar before beyond it; then the cheaper, beyond it the less wrong.
fn better<E: Errors>(a: &Outcome<E>, b: &Outcome<E>, bar: f64) -> bool {
    match (a.error() <= bar, b.error() <= bar) {
        (true, true) => a.frame_ns_min < b.frame_ns_min,
        (false, false) => a.error() < b.error(),
        (a, _) => a,
    }
}
