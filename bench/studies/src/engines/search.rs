//! Runs settings through a motion, finds the cheapest within the bar, times what is found in turns.

use serde_json::{Value, json};
use std::time::{Duration, Instant};
use taut_integrator::StepError;
use taut_measure::engine::motion::FRAME;
use taut_measure::engine::{Engine, Frame, Setting};
use taut_measure::trajectory::Timing;

/// Two errors of a motion with a setting, none where it failed, and the times of a frame; NaN there \[ns].
#[derive(Debug)]
pub(super) struct Outcome {
    pub(super) errors: [Option<f64>; 2],
    pub(super) frame_ns: f64,
    pub(super) frame_ns_min: f64,
    failure: Option<String>,
}

impl Outcome {
    /// Outcome of a run that took `times`, or ended early for the reason in `ran`.
    pub(super) fn new(errors: [f64; 2], ran: Result<(), String>, times: Vec<Duration>) -> Self {
        let timing = match &ran {
            Err(reason) if reason != SLOW => Timing::of(std::iter::empty()),
            _ => Timing::of(times.into_iter()),
        };
        Self {
            errors: errors.map(|error| ran.is_ok().then_some(error)),
            frame_ns: timing.median,
            frame_ns_min: timing.min,
            failure: ran.err(),
        }
    }

    /// The larger error; infinite where a motion has none.
    pub(super) fn error(&self) -> f64 {
        match self.errors {
            [Some(a), Some(b)] => a.max(b),
            _ => f64::INFINITY,
        }
    }
}

/// A setting of an engine that is a row, what came of it, and how many settings were tried.
pub(super) struct Row<'a, M, P> {
    engine: &'a Engine<M, P>,
    setting: &'a Setting<M, P>,
    pub(super) outcome: Outcome,
    tried: usize,
}

impl<M, P> Row<'_, M, P> {
    /// The row's columns, with the names of its errors.
    pub(super) fn columns(&self, [first, second]: [&str; 2], bar: f64) -> Value {
        let outcome = &self.outcome;
        json!({
            "engine": self.engine.name,
            "setting": self.setting.text,
            // A search chose the setting, of those tried.
            "searched": !self.engine.all,
            "tried": self.tried,
            "substeps": self.setting.substeps,
            first: outcome.errors[0],
            second: outcome.errors[1],
            "frame_ns": outcome.frame_ns,
            "frame_ns_min": outcome.frame_ns_min,
            "failure": outcome.failure,
            "within": outcome.error() <= bar,
        })
    }
}

/// Why a setting was not run to its end.
const SLOW: &str = "too slow";
/// Turns that the settings of a table are timed in, and frames of a turn.
const TURNS: usize = 8;
const TURN: usize = 40;

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

/// The rows of engines on a motion, timed in turns: of each engine all of its settings, or the cheapest whose errors are
/// within the bar, of those whose frame takes no longer than `longest_ns`. `run` runs a setting, and may give up beyond the
/// time that it is given.
pub(super) fn rows<'a, M, P>(
    engines: &'a [Engine<M, P>],
    motion: &M,
    bar: f64,
    longest_ns: f64,
    run: impl Fn(&Setting<M, P>, f64) -> Result<Outcome, StepError>,
) -> Result<Vec<Row<'a, M, P>>, StepError> {
    let mut rows = Vec::new();
    for engine in engines {
        if engine.all {
            for setting in engine.ladders.iter().flatten() {
                rows.push(Row {
                    engine,
                    setting,
                    outcome: run(setting, f64::INFINITY)?,
                    tried: 1,
                });
            }
        } else {
            rows.extend(cheapest(engine, bar, longest_ns, &run)?);
        }
    }
    in_turns(&mut rows, motion)?;
    Ok(rows)
}

fn cheapest<'a, M, P>(
    engine: &'a Engine<M, P>,
    bar: f64,
    longest_ns: f64,
    run: impl Fn(&Setting<M, P>, f64) -> Result<Outcome, StepError>,
) -> Result<Option<Row<'a, M, P>>, StepError> {
    let mut best: Option<Row<'a, M, P>> = None;
    let mut tried = 0;
    for ladder in &engine.ladders {
        for setting in ladder {
            // Beyond what the best costs no setting is of use.
            let within = best.as_ref().filter(|best| best.outcome.error() <= bar);
            let least = within.map_or(f64::INFINITY, |best| best.outcome.frame_ns_min);
            let longest = least.min(longest_ns);
            let outcome = run(setting, longest)?;
            let ends = outcome.error() <= bar || outcome.frame_ns_min > longest;
            tried += 1;
            let is_better = |best: &Row<'_, M, P>| better(&outcome, &best.outcome, bar);
            if best.as_ref().is_none_or(is_better) {
                best = Some(Row {
                    engine,
                    setting,
                    outcome,
                    tried,
                });
            }
            if ends {
                break;
            }
        }
    }
    Ok(best.map(|row| Row { tried, ..row }))
}

/// Within the bar before beyond it; then the cheaper, beyond it the less wrong.
fn better(a: &Outcome, b: &Outcome, bar: f64) -> bool {
    match (a.error() <= bar, b.error() <= bar) {
        (true, true) => a.frame_ns_min < b.frame_ns_min,
        (false, false) => a.error() < b.error(),
        (a, _) => a,
    }
}

/// Times the rows again, all of them in turns, so that what else the machine does falls on all alike.
fn in_turns<M, P>(rows: &mut [Row<'_, M, P>], motion: &M) -> Result<(), StepError> {
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
        if !times.is_empty() {
            let timing = Timing::of(times.into_iter());
            row.outcome.frame_ns = timing.median;
            row.outcome.frame_ns_min = timing.min;
        }
    }
    Ok(())
}
