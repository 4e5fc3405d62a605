//! Runs a setting through both motions, and finds the cheapest within the bar.

use super::{Config, Record, params};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};
use taut_ground::engine::motion::{self, Converged, FRAME, Motion};
use taut_ground::engine::{Engine, Frame, Setting};
use taut_ground::trajectory::{Timing, steps_in};
use taut_integrator::StepError;

/// What came of a setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Steps a frame.
    pub substeps: usize,
    /// Largest difference of the elongation at rest from the analytic one in the second second, over the length.
    pub elongation_error: Option<f64>,
    /// Largest distance of the swinging load from the reference, over the length.
    pub load_error: Option<f64>,
    /// Frame, median; NaN where the motion failed \[ns].
    pub frame_ns: f64,
    /// Frame, minimum, likewise \[ns].
    pub frame_ns_min: f64,
    /// Why a motion has no error: times are no numbers then, null in JSON.
    pub failure: Option<String>,
}

impl Outcome {
    /// The larger error; infinite where a motion has none.
    #[must_use]
    pub fn error(&self) -> f64 {
        match (self.elongation_error, self.load_error) {
            (Some(a), Some(b)) => a.max(b),
            _ => f64::INFINITY,
        }
    }
}

/// A cable with all that runs on it are judged by.
pub(super) struct Cable {
    rest: Motion,
    swing: Motion,
    reference: Converged,
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

    /// Times the rows again, all of them in turns, so that what else the machine does falls on all alike.
    pub(super) fn time(&self, rows: &mut [(&Setting, Record)]) -> Result<(), StepError> {
        let mut times = vec![Vec::new(); rows.len()];
        for _ in 0..TURNS {
            for ((setting, record), times) in rows.iter().zip(&mut times) {
                if record.outcome.failure.is_some() {
                    continue;
                }
                let frame = (setting.start)(&self.swing)?;
                let run = self.frames(frame, TURN, f64::INFINITY, times, |_| {});
                debug_assert!(run.is_ok(), "{run:?}: it ran before");
            }
        }
        for ((_, record), times) in rows.iter_mut().zip(times) {
            if times.is_empty() {
                continue;
            }
            let timing = Timing::of(times.into_iter());
            record.outcome.frame_ns = timing.median;
            record.outcome.frame_ns_min = timing.min;
        }
        Ok(())
    }

    fn length(&self) -> f64 {
        self.rest.params.length
    }

    /// Runs a setting through both motions, the swing first. Ends early where the load is lost or the first frames take
    /// longer than `longest_ns`.
    fn run(&self, setting: &Setting, longest_ns: f64) -> Result<Outcome, StepError> {
        let mut times = Vec::new();
        let mut failure = None;
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
        if let Err(reason) = &rested {
            failure = Some(reason.clone());
        }
        let slow = failure.as_deref() == Some(SLOW);
        let timing = match failure {
            Some(_) if !slow => Timing::of(std::iter::empty()),
            _ => Timing::of(times.into_iter()),
        };
        let known = |error: f64| rested.is_ok().then_some(error / self.length());
        Ok(Outcome {
            substeps: setting.substeps,
            elongation_error: known(elongation_error),
            load_error: known(load_error),
            frame_ns: timing.median,
            frame_ns_min: timing.min,
            failure,
        })
    }

    fn frames(
        &self,
        mut frame: Frame,
        count: usize,
        longest_ns: f64,
        times: &mut Vec<Duration>,
        mut each: impl FnMut(Vector3<f64>),
    ) -> Result<(), String> {
        let mut quickest = Duration::MAX;
        for i in 0..count {
            let start = Instant::now();
            let load = frame()?;
            let time = start.elapsed();
            // The first frames may allocate.
            if i > 0 {
                times.push(time);
            }
            quickest = quickest.min(time);
            let distance = load.norm();
            if distance.is_nan() || distance > self.reach {
                let t = FRAME * (i + 1) as f64;
                return Err(format!("lost at {t:.2} s"));
            }
            each(load);
            if i == 4 && quickest.as_nanos() as f64 > longest_ns {
                return Err(SLOW.to_owned());
            }
        }
        Ok(())
    }
}

/// The rows of an engine, each with its setting; what compares with other engines is not filled in.
pub(super) fn rows<'a>(
    config: &Config,
    cable: &Cable,
    engine: &'a Engine,
) -> Result<Vec<(&'a Setting, Record)>, StepError> {
    let record = |setting: &Setting, outcome: Outcome, tried: usize| Record {
        segments: cable.rest.params.segments,
        mass_ratio: cable.rest.params.mass_ratio,
        engine: engine.name.to_owned(),
        setting: setting.text.clone(),
        searched: !engine.all,
        tried,
        within: outcome.error() <= config.bar,
        ns_per_joint: f64::NAN,
        over_ours: f64::NAN,
        reference_error: cable.reference.halved / cable.length(),
        outcome,
    };
    if engine.all {
        let settings = engine.ladders.iter().flatten();
        return settings
            .map(|setting| {
                let outcome = cable.run(setting, f64::INFINITY)?;
                Ok((setting, record(setting, outcome, 1)))
            })
            .collect();
    }
    let mut best: Option<(&Setting, Record)> = None;
    let mut tried = 0;
    for ladder in &engine.ladders {
        for setting in ladder {
            // Beyond what the best costs no setting is of use.
            let longest = match &best {
                Some((_, best)) if best.within => best.outcome.frame_ns_min.min(config.longest_ns),
                _ => config.longest_ns,
            };
            let outcome = cable.run(setting, longest)?;
            let slow = outcome.frame_ns_min > longest;
            tried += 1;
            let found = record(setting, outcome, tried);
            let within = found.within;
            if best.as_ref().is_none_or(|(_, best)| better(&found, best)) {
                best = Some((setting, found));
            }
            if within || slow {
                break;
            }
        }
    }
    Ok(best
        .into_iter()
        .map(|(setting, record)| (setting, Record { tried, ..record }))
        .collect())
}

/// Within the bar before beyond it; then the cheaper, beyond it the less wrong.
fn better(a: &Record, b: &Record) -> bool {
    match (a.within, b.within) {
        (true, true) => a.outcome.frame_ns_min < b.outcome.frame_ns_min,
        (false, false) => a.outcome.error() < b.outcome.error(),
        (a, _) => a,
    }
}
