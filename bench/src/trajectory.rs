//! Runs a stepper and records what a user of the simulation would see: the load, energies, gaps, times, stability.

use crate::hard::worse;
use crate::pace;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use taut_integrator::{Energy, PhaseTimes, StepError, Stepper};
use taut_model::{Constraint, RowKind, Scene};

/// The state after a step, in the numbers that are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time \[s].
    pub time: f64,
    /// Centre of the load, or of the last body where the scene names no load \[m].
    pub load: Vector3<f64>,
    /// Energies at the beginning of the step's last sub-step ([`Stepper::energy`]).
    pub energy: Energy,
    /// Largest gap of a joint \[m].
    pub violation: f64,
    /// Sum of all joints' gaps: the elongation of a cable \[m].
    pub gap_sum: f64,
    /// Iterations of the step's solves.
    pub iterations: usize,
    /// Linear systems solved.
    pub solves: usize,
    /// Whether the guard took the linear step back.
    pub redone: bool,
    /// Implicit sub-steps that the guard took.
    pub implicit_substeps: usize,
    /// Wall-clock time of the step's phases.
    pub phases: PhaseTimes,
}

/// A recorded run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// One sample a step.
    pub samples: Vec<Sample>,
    /// Why and when it ended early.
    pub failure: Option<Failure>,
    /// The error of the step, where it was a step that failed.
    pub error: Option<StepError>,
    /// Steps whose iteration claimed convergence.
    pub claimed: usize,
    /// Steps in which it was left undecided which rows are at their bounds.
    pub undecided: usize,
}

/// The end of an unstable run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// When \[s].
    pub time: f64,
    /// What happened.
    pub reason: String,
}

impl Trajectory {
    /// Largest gap of a joint over the run \[m].
    #[must_use]
    pub fn max_violation(&self) -> f64 {
        self.samples.iter().map(|s| s.violation).fold(0.0, f64::max)
    }

    /// Largest distance of the load from `reference` (one position a step; the shorter run counts) \[m].
    #[must_use]
    pub fn max_load_error(&self, reference: &[Vector3<f64>]) -> f64 {
        self.samples
            .iter()
            .zip(reference)
            .map(|(s, r)| (s.load - r).norm())
            .fold(0.0, f64::max)
    }

    /// Change of the total energy from time `from` to the end, over the largest kinetic energy in between.
    #[must_use]
    pub fn energy_drift(&self, from: f64) -> Option<f64> {
        let window: Vec<_> = self.samples.iter().filter(|s| s.time >= from).collect();
        let (first, last) = (window.first()?, window.last()?);
        let scale = window.iter().map(|s| s.energy.kinetic).fold(0.0, f64::max);
        (scale > 0.0 && window.len() > 1)
            .then(|| (last.energy.total() - first.energy.total()) / scale)
    }

    /// Median and minimum of a time over the steps \[ns]; the first step, which may allocate, is left out.
    #[must_use]
    pub fn nanoseconds(&self, of: impl Fn(&PhaseTimes) -> Duration) -> Timing {
        Timing::of(self.samples.iter().skip(1).map(|s| of(&s.phases)))
    }
}

/// Median and minimum of repeated measurements \[ns].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Timing {
    /// Median.
    pub median: f64,
    /// Minimum.
    pub min: f64,
    /// Maximum.
    pub max: f64,
}

impl Timing {
    /// Of measured durations.
    #[must_use]
    pub fn of(durations: impl Iterator<Item = Duration>) -> Self {
        let mut ns: Vec<u128> = durations.map(|d| d.as_nanos()).collect();
        ns.sort_unstable();
        let at = |i: usize| ns.get(i).map_or(f64::NAN, |&ns| ns as f64);
        Self {
            median: at(ns.len() / 2),
            min: at(0),
            max: at(ns.len().wrapping_sub(1)),
        }
    }
}

/// Gaps of all joints with stretch rows, of sliders across their axis, and by how much links are too long or too short
/// \[m].
pub(crate) fn gaps(stepper: &Stepper) -> impl Iterator<Item = f64> {
    let (scene, rows) = (stepper.scene(), stepper.linearized());
    scene
        .constraints
        .iter()
        .enumerate()
        .filter_map(|(i, constraint)| {
            if matches!(constraint, Constraint::MasslessCable(c) if c.tension_only) {
                // What is slack is not too short.
                return Some(rows.phi[rows.row_range(i).start].max(0.0));
            }
            let mut first = rows.row_range(i).start;
            constraint.parts().find_map(|(kind, count, _)| {
                let range = first..first + count;
                first += count;
                let gap = matches!(kind, RowKind::Stretch | RowKind::Length | RowKind::Across);
                gap.then(|| rows.phi[range].iter().map(|x| x * x).sum::<f64>().sqrt())
            })
        })
}

/// Position of the load (or of the last body).
#[must_use]
pub fn load_position(scene: &Scene) -> Vector3<f64> {
    let load = scene.load.or_else(|| scene.bodies.len().checked_sub(1));
    load.map_or_else(Vector3::zeros, |i| scene.bodies.position[i])
}

/// Rotation in one step beyond which a linearised step means nothing: an eighth of a turn \[rad].
const MAX_TURN: f64 = std::f64::consts::FRAC_PI_4;

/// Steps until `time` or until the run is unstable: a step fails, a joint's gap exceeds `max_gap` (a segment's
/// length, say), or a body turns by more than an eighth of a turn in a step.
pub fn simulate(
    stepper: &mut Stepper,
    time: f64,
    max_gap: f64,
    after_step: impl FnMut(&Sample),
) -> Trajectory {
    simulate_driven(stepper, time, max_gap, |_| Ok(()), after_step)
}

/// [`simulate`] with something to be done before each step, such as setting controls.
pub fn simulate_driven(
    stepper: &mut Stepper,
    time: f64,
    max_gap: f64,
    mut before_step: impl FnMut(&mut Stepper) -> Result<(), StepError>,
    mut after_step: impl FnMut(&Sample),
) -> Trajectory {
    let dt = stepper.options().dt;
    let steps = steps_in(time, dt);
    let mut trajectory = Trajectory {
        samples: Vec::with_capacity(steps),
        ..Trajectory::default()
    };
    for _ in 0..steps {
        let report = match before_step(stepper).and_then(|()| pace::step(stepper)) {
            Ok(report) => report,
            Err(e) => {
                trajectory.failure = Some(Failure {
                    time: stepper.time(),
                    reason: e.to_string(),
                });
                trajectory.error = Some(e);
                return trajectory;
            }
        };
        trajectory.claimed += usize::from(report.solve.is_claim());
        trajectory.undecided += usize::from(report.undecided > 0);
        let sample = Sample {
            time: report.time,
            load: load_position(stepper.scene()),
            energy: stepper.energy(),
            violation: gaps(stepper).fold(0.0, worse),
            gap_sum: gaps(stepper).sum(),
            iterations: report.iterations,
            solves: report.solves,
            redone: report.redone,
            implicit_substeps: report.implicit_substeps,
            phases: report.phases,
        };
        after_step(&sample);
        trajectory.samples.push(sample);
        if let Some(reason) = instability(stepper, sample.violation, max_gap) {
            trajectory.failure = Some(Failure {
                time: report.time,
                reason,
            });
            return trajectory;
        }
    }
    trajectory
}

/// Number of steps of length `dt` in `time`, to rounding.
#[must_use]
pub fn steps_in(time: f64, dt: f64) -> usize {
    let steps = (time / dt).round();
    // A count beyond any run's length saturates.
    if steps.is_finite() && steps > 0.0 {
        steps as usize
    } else {
        0
    }
}

fn instability(stepper: &Stepper, gap: f64, max_gap: f64) -> Option<String> {
    if gap.is_nan() || gap > max_gap {
        return Some(format!(
            "a joint's gap of {gap:.2e} m exceeds {max_gap:.2e} m"
        ));
    }
    let scene = stepper.scene();
    let limit = MAX_TURN / stepper.options().dt;
    let fast = scene
        .bodies
        .angular_velocity
        .iter()
        .position(|w| w.norm() > limit)?;
    Some(format!(
        "body `{}` turns by more than an eighth of a turn in a step",
        scene.body_names[fast]
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timings_are_order_statistics() {
        let t = Timing::of([5, 1, 9, 3, 7].into_iter().map(Duration::from_nanos));
        assert_eq!((t.median, t.min, t.max), (5.0, 1.0, 9.0));
        assert!(Timing::of(std::iter::empty()).median.is_nan());
    }

    #[test]
    fn step_counts_survive_odd_numbers() {
        assert_eq!(steps_in(2.0, 1.0 / 60.0), 120);
        assert_eq!(steps_in(-1.0, 0.1), 0);
        assert_eq!(steps_in(f64::NAN, 0.1), 0);
    }
}
