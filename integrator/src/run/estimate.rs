//! An estimate of the error of the load's position while the scene moves, [`StepOptions::estimate`].
//!
//! **Time step.** A coarse run starts in the same state and takes one step of kΔt for each k steps of Δt. Both errors are of
//! order p in the time step, so that from the distance d of the two loads
//!
//! ```text
//! e(kΔt) = kᵖ e(Δt)        e(Δt) ≈ d/(kᵖ − 1)
//! ```
//!
//! p is 2, and 1 with the linearly implicit scheme. It is also 1 for the growth of d once shapes
//! touch, cables slip, ropes catch or the guard redoes a step, since an event inside a step is localised only to
//! that step. An oscillation that turns by more than half a radian in kΔt is soon out of phase in
//! the coarse run, and d is as large as the error. Such oscillations dominate the second difference
//! of d. Half of it, at most d/2, is a second estimate; the larger one counts.
//!
//! The coarse run gets the mean of each control over each of its sub-steps. Whatever else is set starts it anew in the state of the run; what
//! was estimated until then is added, and steps that were not compared are counted as [`ErrorEstimate::unseen`].
//!
//! **Linear algebra.** A sample of every [`SAMPLED`]th step ([`crate::step::reference`]).
//!
//! **Segments.** A cable of curvature κ is as long as its polygon of segments l and kinks θ = κ l, whose ends are farther apart:
//! an arc is longer than its chord by the part θ²/24. The distance is Σ l θ²/24, of the cable where it is largest. It is the
//! shape's alone: what segments do to the frequencies of a cable is not in it.

use crate::run::Stepper;
use crate::step::Stage;
use crate::step::reference::{Sample, load_of};
use crate::{StepError, StepOptions, StepReport};
use nalgebra::Vector3;
use taut_model::{CableParts, Scene};

/// Steps from one sample of the error of the linear algebra to the next.
pub(crate) const SAMPLED: usize = 16;

/// Parts of the error of the load's position, each the largest so far \[m].
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ErrorEstimate {
    /// Error of the time step.
    pub time: f64,
    /// Error of the linear algebra.
    pub algebra: f64,
    /// Error of the segments' shape.
    pub segments: f64,
    /// Steps covered by `time`; 0 before the first comparison, where `time` says nothing.
    #[cfg_attr(feature = "serde", serde(default))]
    pub compared: usize,
    /// Steps that `time` does not cover: a setting made the coarse run start anew right after them.
    pub unseen: usize,
    /// True if the coarse run failed or could not start: `time` is the estimate of the steps
    /// before.
    pub lost: bool,
}

impl ErrorEstimate {
    /// Their sum \[m].
    #[must_use]
    pub fn total(&self) -> f64 {
        self.time + self.algebra + self.segments
    }

    /// The largest part, which tells how to reduce the error.
    #[must_use]
    pub fn largest(&self) -> ErrorPart {
        if self.segments >= self.time.max(self.algebra) {
            ErrorPart::Segments
        } else if self.time >= self.algebra {
            ErrorPart::Time
        } else {
            ErrorPart::Algebra
        }
    }
}

/// A part of an [`ErrorEstimate`].
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorPart {
    /// Time step: reduced by smaller steps.
    Time,
    /// Linear algebra: reduced by a direct solver, refinement or more iterations.
    Algebra,
    /// Shape of the segments: reduced by more segments only.
    Segments,
}

/// The coarse run, and what it has shown.
#[derive(Default)]
pub(crate) struct CoarseRun {
    /// `None` before it starts, and where it was lost.
    run: Option<Box<Stepper>>,
    /// Set by a setting or a change: the coarse run has to start anew from the state of the run.
    pub(crate) stale: bool,
    /// Steps so far, and those since both runs were at the same time.
    steps: usize,
    since: usize,
    /// Sums of the controls' values over these, of one after the other: one sum for each sub-step of the coarse run.
    controls: Vec<f64>,
    /// The order p, and the distance and the estimate from which on it holds \[m].
    order: i32,
    from: [f64; 2],
    /// The last distances, the latest first, and the norm of that \[m].
    apart: [Vector3<f64>; 2],
    distance: f64,
    estimate: ErrorEstimate,
}

impl CoarseRun {
    /// A coarse run from the present state of `run`; it goes on with what the one `before` has shown.
    fn of(run: &Stepper, every: usize, before: Option<&Self>) -> Self {
        let coarse = coarse_run(run, every).ok().map(Box::new);
        let mut estimate = before.map_or(ErrorEstimate::default(), |c| c.estimate);
        estimate.unseen += before.map_or(0, |c| c.since);
        Self {
            order: order(&run.step.options),
            from: [0.0, estimate.time],
            controls: vec![0.0; run.step.scene.controls.len() * run.step.options.substeps],
            steps: before.map_or(0, |c| c.steps),
            estimate: ErrorEstimate {
                lost: coarse.is_none(),
                ..estimate
            },
            run: coarse,
            ..Self::default()
        }
    }

    /// A step of the run is done.
    fn follow(&mut self, of: &Stepper, report: &StepReport, every: usize) {
        self.steps += 1;
        let substeps = of.step.options.substeps;
        for (i, sums) in self.controls.chunks_mut(substeps).enumerate() {
            let last = of.step.scene.control_value(i).unwrap_or(0.0);
            for k in 0..substeps {
                sums[(self.since * substeps + k) / every] += of.course.value(i, k).unwrap_or(last);
            }
        }
        let is_bounded = !of.step.active_set.is_empty();
        self.sink(report, is_bounded);
        self.since += 1;
        if self.since < every {
            return;
        }
        self.since = 0;
        self.estimate.segments = worst_polygon(&of.step.scene).max(self.estimate.segments);
        let Some(mut run) = self.run.take() else {
            return;
        };
        let stepped = step_driven(&mut run, &mut self.controls, every);
        if let Err(StepError::Stopped { .. }) = stepped {
            // The run itself has made its step: another one starts from there.
            (self.since, self.stale) = (every, true);
            return;
        }
        let apart = load(&run.step.scene) - load(&of.step.scene);
        let distance = apart.norm();
        let Some(report) = stepped.ok().filter(|_| distance.is_finite()) else {
            self.estimate.lost = true;
            return;
        };
        self.sink(&report, is_bounded);
        self.estimate.compared += every;
        let [from, before] = self.from;
        let time = before + (distance - from).max(0.0) / ((every as f64).powi(self.order) - 1.0);
        let [last, before_last] = self.apart;
        let second = (apart - last * 2.0 + before_last).norm();
        let fast = before + 0.5 * second.min(distance);
        self.estimate.time = self.estimate.time.max(time).max(fast);
        (self.apart, self.distance) = ([apart, last], distance);
        self.run = Some(run);
    }

    /// The order sinks to 1 where the report tells of what happens within a step: with rows with bounds a rope may have caught in
    /// it; without them it is divided where bodies turn or bounce, which the parts resolve.
    fn sink(&mut self, report: &StepReport, is_bounded: bool) {
        let within = report.redone
            || report.divided > 0 && is_bounded
            || report.slipping > 0
            || report.contacts.touching > 0;
        if within && self.order > 1 {
            self.order = 1;
            self.from = [self.distance, self.estimate.time];
        }
    }
}

fn order(options: &StepOptions) -> i32 {
    if options.scheme.is_staggered() { 2 } else { 1 }
}

/// The coarse run from the present state of another: its steps are `every` times as long.
fn coarse_run(of: &Stepper, every: usize) -> Result<Stepper, StepError> {
    let options = StepOptions {
        dt: of.step.options.dt * every as f64,
        estimate: None,
        energy_tolerance: None,
        sleep: None,
        ..of.step.options.clone()
    };
    let (mut scene, time) = (of.step.scene.clone(), of.step.time);
    // The run's own happen to both.
    scene.events.clear();
    scene.keep_resolution();
    if of.step.progress.started
        && of.step.options.scheme.is_staggered()
        && !matches!(
            of.step.progress.stage,
            Stage::Advanced { implicit: true, .. }
        )
    {
        // Its velocities are half a step old.
        let fresh = |i: &usize| !of.step.progress.newly_added.contains(i);
        for i in (0..scene.bodies.len()).filter(fresh) {
            let [x, y, z, p, q, r] = of.step.system_data.dv.get(i);
            scene.bodies.velocity[i] += Vector3::new(x, y, z) * 0.5;
            scene.bodies.angular_velocity[i] += Vector3::new(p, q, r) * 0.5;
        }
    }
    scene.lay_cables(time);
    let mut run = Stepper::build(scene, options, &mut None)?;
    run.step.effort.follow(&of.step.effort);
    run.step.guarded.division.coarseness = every as f64;
    run.step.time = time;
    let (rows, scene) = (&mut run.step.system_data.rows, &run.step.scene);
    rows.drive(scene, time - run.step.options.dt, time);
    run.step.history.forget(&rows.phi_t);
    rows.update(scene, time);
    let (known, dt) = of.step.contacts.known();
    run.step.contacts.remember_again(known, dt);
    Ok(run)
}

/// A step of the coarse run with the means of the controls over `count` sub-steps each, whose sums are taken. Means that differ
/// from the value by rounding set nothing: what follows a control may have been set alone.
fn step_driven(run: &mut Stepper, sums: &mut [f64], count: usize) -> Result<StepReport, StepError> {
    for (i, values) in sums.chunks_mut(run.step.options.substeps).enumerate() {
        values.iter_mut().for_each(|sum| *sum /= count as f64);
        let value = run.step.scene.control_value(i);
        let differs = |mean: &f64| value.is_some_and(|v| (v - mean).abs() > 1e-12 * mean.abs());
        if values.iter().any(differs) {
            run.set_course(i, values)?;
        }
        values.fill(0.0);
    }
    run.step()
}

fn load(scene: &Scene) -> Vector3<f64> {
    load_of(scene).map_or_else(Vector3::zeros, |i| scene.bodies.position[i])
}

/// The largest Σ l θ²/24 of a cable \[m]: l from centre to centre of neighbours, θ from one such line to the next.
fn worst_polygon(scene: &Scene) -> f64 {
    let of = |cable: &CableParts| {
        let centre = |i: usize| scene.bodies.position[cable.bodies[i]];
        let corners = 1..cable.bodies.len().saturating_sub(1);
        let shortening = corners.map(|i| {
            let (a, b) = (centre(i) - centre(i - 1), centre(i + 1) - centre(i));
            b.norm() * a.angle(&b).powi(2) / 24.0
        });
        shortening.sum::<f64>()
    };
    scene.cables.iter().map(of).fold(0.0, f64::max)
}

impl Stepper {
    /// The coarse run starts, where none is there or it is stale.
    pub(crate) fn accompany(&mut self, every: usize) {
        if self.coarse.as_ref().is_none_or(|c| c.stale) {
            let coarse = CoarseRun::of(self, every, self.coarse.as_deref());
            let sample = Sample::new(&self.step, coarse.estimate.algebra);
            self.step.output.sample = Some(Box::new(sample));
            self.coarse = Some(Box::new(coarse));
        }
    }

    /// The coarse run ends its steps by the flag of this run.
    pub(crate) fn share_stop(&mut self) {
        let run = self.coarse.as_mut().and_then(|c| c.run.as_mut());
        if let Some(run) = run {
            run.step.effort.follow(&self.step.effort);
        }
    }

    /// The estimate after a step.
    pub(crate) fn estimate(&mut self, report: &StepReport, every: usize) -> Option<ErrorEstimate> {
        let mut coarse = self.coarse.take()?;
        if let Some(sample) = &mut self.step.output.sample {
            coarse.estimate.algebra = sample.moved;
            sample.is_due = coarse.steps.is_multiple_of(SAMPLED);
        }
        coarse.follow(self, report, every);
        let estimate = coarse.estimate;
        self.coarse = Some(coarse);
        Some(estimate)
    }

    /// The coarse run has to start anew: something was set that it does not see.
    pub(crate) fn outdate_coarse_run(&mut self) {
        if let Some(coarse) = &mut self.coarse {
            coarse.stale = true;
        }
    }
}

#[cfg(test)]
mod tests;
