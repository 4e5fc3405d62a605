//! Runs a stepper and records what a user of the simulation would see: the load, energies, gaps, times, stability.

use crate::errors::worse;
use crate::inputs::Inputs;
use crate::openings::Openings;
use crate::pace;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Deref;
use std::time::Duration;
use taut_integrator::{Energy, PhaseTimes, StepError, StepReport, Stepper};
use taut_model::Scene;

/// The state after a step, in the numbers that are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Report of the step; its fields read as the sample's own.
    pub report: StepReport,
    /// Centre of the load, or of the last body where the scene names no load \[m].
    pub load: Vector3<f64>,
    /// Energies at the beginning of the step's last sub-step ([`Stepper::energy`]).
    pub energy: Energy,
    /// Largest gap of a joint \[m].
    pub violation: f64,
    /// Sum of all joints' gaps: the elongation of a cable \[m].
    pub gap_sum: f64,
    /// Largest tension of what holds on to the load \[N]: [`load_tension`].
    pub load_tension: Option<f64>,
}

impl Sample {
    /// The state after the step that ended in `report`.
    pub fn after(stepper: &Stepper, report: &StepReport) -> Self {
        Self {
            report: *report,
            load: load_position(stepper.scene()),
            energy: stepper.energy(),
            violation: gaps(stepper).fold(0.0, worse),
            gap_sum: gaps(stepper).sum(),
            load_tension: load_tension(stepper),
        }
    }
}

impl Deref for Sample {
    type Target = StepReport;

    fn deref(&self) -> &StepReport {
        &self.report
    }
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
    /// Steps in which it was left undecided which rows are at their bounds or which contacts carry what.
    pub undecided: usize,
}

/// The end of an unstable run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// When \[s].
    pub time: f64,
    /// Cause in words.
    pub reason: String,
}

impl fmt::Display for Failure {
    /// With the time once: most reasons begin with it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.reason.starts_with("at t = ") {
            write!(f, "unstable {}", self.reason)
        } else {
            write!(f, "unstable at t = {:.4} s: {}", self.time, self.reason)
        }
    }
}

impl Trajectory {
    /// Largest gap of a joint over the run \[m].
    pub fn max_violation(&self) -> f64 {
        self.samples.iter().map(|s| s.violation).fold(0.0, f64::max)
    }

    /// Largest distance of the load from `reference` (one position a step; the shorter run counts) \[m].
    pub fn max_load_error(&self, reference: &[Vector3<f64>]) -> f64 {
        self.samples
            .iter()
            .zip(reference)
            .map(|(s, r)| (s.load - r).norm())
            .fold(0.0, f64::max)
    }

    /// Change of the total energy from time `from` to the end, over the largest kinetic energy in between.
    pub fn energy_drift(&self, from: f64) -> Option<f64> {
        let window: Vec<_> = self.samples.iter().filter(|s| s.time >= from).collect();
        let (first, last) = (window.first()?, window.last()?);
        let scale = window.iter().map(|s| s.energy.kinetic).fold(0.0, f64::max);
        (scale > 0.0 && window.len() > 1)
            .then(|| (last.energy.total() - first.energy.total()) / scale)
    }

    /// Median and minimum of a time over the steps \[ns]; the first step, which may allocate, is left out.
    pub fn nanoseconds(&self, of: impl Fn(&PhaseTimes) -> Duration) -> Timing {
        Timing::of(self.samples.iter().skip(1).map(|s| of(&s.phases)))
    }
}

/// Median and minimum of repeated measurements \[ns].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Timing {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Timing {
    /// Median and extremes of durations, in nanoseconds; NaN if there are none.
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

/// How often each duration came, to 1/512 of itself: the memory of any number of measurements is that of their range.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Durations {
    /// Counts of m · 2ᵏ ns ≤ t < (m + 1) · 2ᵏ ns at 512 k + m: k = 0 with m < 1024, then k > 0 with 512 ≤ m < 1024.
    counts: Vec<u64>,
    /// Shortest and longest, exactly \[ns].
    ends: Option<(u64, u64)>,
}

impl Durations {
    /// Counts one.
    pub fn add(&mut self, duration: Duration) {
        let ns = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        let k = (u64::BITS - ns.leading_zeros()).saturating_sub(10);
        let place = 512 * k as usize + (ns >> k) as usize;
        if self.counts.len() <= place {
            self.counts.resize(place + 1, 0);
        }
        self.counts[place] += 1;
        let (least, most) = self.ends.unwrap_or((ns, ns));
        self.ends = Some((least.min(ns), most.max(ns)));
    }

    /// The median, to 1/512 from below, and the ends exactly; NaN of none.
    pub fn timing(&self) -> Timing {
        let Some((least, most)) = self.ends else {
            return Timing::of(std::iter::empty());
        };
        let mut left = self.counts.iter().sum::<u64>() / 2;
        let median = self.counts.iter().position(|&count| {
            let here = left < count;
            left = left.saturating_sub(count);
            here
        });
        let place = median.unwrap_or_default();
        let k = (place / 512).saturating_sub(1);
        let median = ((place - 512 * k) as u64) << k;
        Timing {
            median: median.max(least) as f64,
            min: least as f64,
            max: most as f64,
        }
    }
}

/// Gap of constraint `c`, where it has one \[m]: see [`Constraint::gap`](taut_model::Constraint::gap).
pub fn gap(stepper: &Stepper, c: usize) -> Option<f64> {
    let rows = stepper.linearized();
    let constraint = stepper.scene().constraints.get(c)?;
    constraint.gap(&rows.phi[rows.row_range(c)])
}

/// Gaps of all constraints that have one, with their numbers \[m].
fn numbered_gaps(stepper: &Stepper) -> impl Iterator<Item = (usize, f64)> {
    let constraints = 0..stepper.scene().constraints.len();
    constraints.filter_map(|c| Some((c, gap(stepper, c)?)))
}

/// The gaps of all constraints that have one \[m].
pub fn gaps(stepper: &Stepper) -> impl Iterator<Item = f64> {
    numbered_gaps(stepper).map(|(_, gap)| gap)
}

/// Largest tension of the joints, links and cables that hold on to the load \[N], where one of them has a tension.
pub fn load_tension(stepper: &Stepper) -> Option<f64> {
    let (scene, rows) = (stepper.scene(), stepper.linearized());
    let load = load_body(scene)?;
    let slots = rows.slots.iter().filter(|slot| slot.body == load);
    let tensions = slots.filter_map(|slot| stepper.tension(slot.constraint));
    tensions.reduce(worse)
}

fn load_body(scene: &Scene) -> Option<usize> {
    scene.load.or_else(|| scene.bodies.len().checked_sub(1))
}

/// Position of the load (or of the last body).
pub fn load_position(scene: &Scene) -> Vector3<f64> {
    load_body(scene).map_or_else(Vector3::zeros, |i| scene.bodies.position[i])
}

/// Rotation in one step beyond which a linearised step means nothing: an eighth of a turn \[rad].
const MAX_TURN: f64 = std::f64::consts::FRAC_PI_4;

/// Energy from nowhere, over the motion's own, at which `taut run` gives a run up.
pub const ENERGY_TOLERANCE: f64 = 0.2;

/// When a run is lost, beside a step that fails.
#[derive(Debug, Clone, PartialEq)]
pub enum Limits {
    /// Largest gap of each constraint \[m]: those of the scene ([`Scene::gap_limits`]).
    Scene(Vec<f64>),
    /// Where a sweep stops to count a run as stable: a gap of any joint \[m], and a body that turns by more than an eighth
    /// of a turn in a step. Healthy motions may do both: a body turns exactly about its own axis, and the segments of a
    /// cable that snaps do turn as fast.
    Sweep(f64),
}

impl Limits {
    /// What is stretched already may open by as much again: its force has that way to give back.
    fn widen(&mut self, stepper: &Stepper) {
        let Self::Scene(limits) = self else { return };
        let rows = stepper.linearized();
        let yields = |c: &usize| rows.compliance[rows.row_range(*c)].iter().any(|e| *e > 0.0);
        let open = numbered_gaps(stepper).filter(|(c, gap)| yields(c) && gap.is_finite());
        for (c, gap) in open {
            limits
                .get_mut(c)
                .into_iter()
                .for_each(|limit| *limit += gap);
        }
    }
}

/// A run step by step, until its steps are made or it is lost. It keeps no sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// Steps still to be made; 0 where it has ended.
    left: usize,
    limits: Limits,
    /// Largest gap of each constraint since the last event \[m].
    pub gaps: Vec<f64>,
    /// The widest gaps of the run.
    pub openings: Openings,
    /// Why and when it ended early.
    pub failure: Option<Failure>,
    /// The error of the step, where it was a step that failed.
    pub error: Option<StepError>,
    /// Steps whose iteration claimed convergence.
    pub claimed: usize,
    /// Steps in which it was left undecided which rows are at their bounds or which contacts carry what.
    pub undecided: usize,
}

impl Simulation {
    /// A run of so many steps.
    pub fn new(steps: usize, limits: Limits) -> Self {
        Self {
            left: steps,
            limits,
            gaps: Vec::new(),
            openings: Openings::default(),
            failure: None,
            error: None,
            claimed: 0,
            undecided: 0,
        }
    }

    /// True while steps are still to be made.
    pub fn goes_on(&self) -> bool {
        self.left > 0
    }

    /// Makes a step; none where the run has ended, ends because the step fails, or was asked to end
    /// ([`Stepper::stop_by`]), which is no failure.
    pub fn step(&mut self, stepper: &mut Stepper) -> Option<Sample> {
        self.left = self.left.checked_sub(1)?;
        let begun = stepper.time();
        if self.gaps.is_empty() {
            self.limits.widen(stepper);
        }
        let report = match pace::step(stepper) {
            Ok(report) => report,
            // Whoever asked the step to end knows why.
            Err(StepError::Stopped { .. }) => {
                self.left += 1;
                return None;
            }
            Err(e) => {
                self.fail(begun, e);
                return None;
            }
        };
        self.claimed += usize::from(report.solve.is_claim());
        self.undecided += usize::from(report.undecided > 0);
        let sample = Sample::after(stepper, &report);
        let constraints = stepper.scene().constraints.len();
        let others = !self.gaps.is_empty() && self.gaps.len() != constraints;
        if report.events > 0 || others {
            // Constraints have come and gone, by events or at a winch, and others have their numbers.
            self.gaps.clear();
            self.openings.forget_lengths();
            if let Limits::Scene(gaps) = &mut self.limits {
                *gaps = stepper.scene().gap_limits();
            }
            self.limits.widen(stepper);
        }
        self.openings.see(stepper);
        self.gaps.resize(stepper.scene().constraints.len(), 0.0);
        numbered_gaps(stepper).for_each(|(c, gap)| self.gaps[c] = worse(self.gaps[c], gap));
        if let Some(reason) = instability(stepper, &self.limits).or_else(|| endless(&sample.energy))
        {
            self.end(report.time, reason);
        }
        Some(sample)
    }

    /// Ends the run by an error, such as that of setting controls, at a time \[s].
    pub fn fail(&mut self, time: f64, error: StepError) {
        self.end(time, error.to_string());
        self.error = Some(error);
    }

    fn end(&mut self, time: f64, reason: String) {
        self.left = 0;
        self.failure = Some(Failure { time, reason });
    }
}

/// Steps until `time` or until the run is unstable by [`Limits::Sweep`] of `max_gap` (m), and keeps all samples.
pub fn simulate(
    stepper: &mut Stepper,
    time: f64,
    max_gap: f64,
    after_step: impl FnMut(&Sample),
) -> Trajectory {
    let limits = Limits::Sweep(max_gap);
    simulate_driven(stepper, &Inputs::default(), time, limits, after_step)
}

/// Steps until `time`, driven by inputs, or until the run is lost by its limits, and keeps all samples.
pub fn simulate_driven(
    stepper: &mut Stepper,
    inputs: &Inputs,
    time: f64,
    limits: Limits,
    mut after_step: impl FnMut(&Sample),
) -> Trajectory {
    let steps = steps_in(time, stepper.options().dt);
    let mut simulation = Simulation::new(steps, limits);
    let mut samples = Vec::with_capacity(steps);
    while simulation.goes_on() {
        if let Err(e) = inputs.apply(stepper) {
            simulation.fail(stepper.time(), e);
        }
        let Some(sample) = simulation.step(stepper) else {
            break;
        };
        after_step(&sample);
        samples.push(sample);
    }
    Trajectory {
        samples,
        failure: simulation.failure,
        error: simulation.error,
        claimed: simulation.claimed,
        undecided: simulation.undecided,
    }
}

/// Number of steps of length `dt` in `time`, to rounding.
pub fn steps_in(time: f64, dt: f64) -> usize {
    let steps = (time / dt).round();
    // A count beyond any run's length saturates.
    if steps.is_finite() && steps > 0.0 {
        steps as usize
    } else {
        0
    }
}

/// Failure text for an energy that is infinite or NaN, which no motion has.
fn endless(energy: &Energy) -> Option<String> {
    let total = energy.total();
    (!total.is_finite()).then(|| format!("the energy is {total} J: the step is unstable"))
}

fn instability(stepper: &Stepper, limits: &Limits) -> Option<String> {
    let scene = stepper.scene();
    let limit = |c: usize| match limits {
        Limits::Scene(gaps) => gaps.get(c).copied().unwrap_or(f64::INFINITY),
        Limits::Sweep(gap) => *gap,
    };
    let open = numbered_gaps(stepper).find(|(c, gap)| !gap.is_finite() || *gap > limit(*c));
    if let Some((c, gap)) = open {
        return Some(format!(
            "`{}` is open by {gap:.2e} m, beyond its limit of {:.2e} m",
            scene.constraint_names[c],
            limit(c)
        ));
    }
    if matches!(limits, Limits::Scene(_)) {
        return None;
    }
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
    use nalgebra::Vector3;
    use taut_integrator::StepOptions;
    use taut_model::{Body, Constraint, Distance, Frame, RowLaw, Scene};

    /// 10 kg on a spring of 0.1 m that is drawn to 2 m: it is open by what its force explains.
    #[test]
    fn a_spring_that_is_drawn_out_is_not_lost() {
        let mut scene = Scene::new("spring");
        let load = scene.add_body("load", Body::particle(10.0).at(Vector3::z() * -2.0));
        let origin = Vector3::zeros();
        let frames = [Frame::world(origin), Frame::body(load, origin)];
        let spring = Distance {
            frames,
            length: 0.1,
            law: RowLaw::new(1e-3, 0.0),
            transverse: false,
        };
        scene.add_constraint("spring", Constraint::Distance(spring), 0);
        let limits = Limits::Scene(scene.gap_limits());
        let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
        let mut simulation = Simulation::new(60, limits);
        while simulation.step(&mut stepper).is_some() {}
        assert_eq!(simulation.failure, None);
    }

    #[test]
    fn timings_are_order_statistics() {
        let t = Timing::of([5, 1, 9, 3, 7].into_iter().map(Duration::from_nanos));
        assert_eq!((t.median, t.min, t.max), (5.0, 1.0, 9.0));
        assert!(Timing::of(std::iter::empty()).median.is_nan());
    }

    /// Counted, not kept: the same order statistics, the median to 1/512.
    #[test]
    fn counted_durations_have_the_timing_of_kept_ones() {
        for scale in [1, 7, 1000, 123_457, 1 << 40] {
            let all = (0..1001_u64).map(|i| Duration::from_nanos(scale * (3 + i * i % 977)));
            let mut counted = Durations::default();
            all.clone().for_each(|d| counted.add(d));
            let (counted, kept) = (counted.timing(), Timing::of(all));
            assert_eq!((counted.min, counted.max), (kept.min, kept.max));
            let off = (kept.median - counted.median) / kept.median;
            assert!((0.0..1.0 / 512.0).contains(&off), "{scale}: {off:e}");
        }
        let mut odd = Durations::default();
        assert!(odd.timing().median.is_nan());
        odd.add(Duration::MAX);
        odd.add(Duration::ZERO);
        assert_eq!((odd.timing().min, odd.timing().max), (0.0, u64::MAX as f64));
    }

    #[test]
    fn step_counts_survive_odd_numbers() {
        assert_eq!(steps_in(2.0, 1.0 / 60.0), 120);
        assert_eq!(steps_in(-1.0, 0.1), 0);
        assert_eq!(steps_in(f64::NAN, 0.1), 0);
    }
}
