//! Scenes at rest that sleep: their steps cost no solve.
//!
//! A scene rests where no material point goes farther than δ/2 in half of the longest period P. In half of its period a
//! mode a cos(ωt + ψ) goes as far as its amplitude, wherever it begins,
//!
//! ```text
//! max over 0 ≤ u ≤ π of |cos(ψ + u) − cos ψ| ≥ 1
//! ```
//!
//! so that each mode of a period up to P has an amplitude a ≤ δ/2: what stands still instead is at most 2 a ≤ δ from where
//! it would be. A bound of velocities says nothing of the kind, for a swing has none where it turns back. Rest is
//! seen in the time P/2, or foreseen from a shorter one, w = 3 h, in which no point has gone farther than δ/2. That is
//! as above for all modes of periods up to 2 w. The slower ones are parabolas, nearly: with the means X₁, X₂, X₃ of a
//! body's displacement in the thirds of w, in which faster motions cancel,
//!
//! ```text
//! v̇ = (X₁ − 2 X₂ + X₃)/h²,    v = (X₃ − X₁)/2h + 3/2 h v̇,    |v| P/2 + ½ |v̇| (P/2)² ≤ δ/2
//! ```
//!
//! of which the left side is 2 a or more for every period from 2 w to P, in every phase. What creeps, as a load does that
//! slides slowly, goes on by δ/2 in P/2 at most where it is taken for rest: it is slower than δ/P.
//!
//! The material points of a body are the corners of the box of its inertia, its attachments and its shapes.
//!
//! **Sleep.** The whole scene sleeps at once, when all of it rests, since one linear system holds it all. Its state stays as
//! it is, velocities, multipliers and past rates to the last bit, and waking goes on from there: a run that has slept makes
//! the steps of one that has not, later. Time and events go on. What drives (motors, winches, driven bodies, moved points)
//! ends sleep in the step in which it begins to move, a setting that changes something in the next step. What gives way at a
//! limit of its force keeps the scene awake ([`yielding`]).

mod yielding;

use crate::options::check;
use crate::report::Tally;
use crate::run::Stepper;
use crate::step::Step;
use crate::{ContactReport, Phase, PhaseTimes, Resolved, StepError, StepOptions, StepReport};
use nalgebra::{UnitQuaternion, Vector3};
use taut_model::collide::Shape;
use taut_model::{Bodies, Constraint, Mobility, Scene, Side, Target};
use taut_solver::SolveReport;

/// When a scene sleeps: once no material point of it goes farther than `distance`/2 in the time `period`/2. Each mode of
/// oscillation with a period of up to `period` then moves it by less than `distance` from where it sleeps; so does what creeps, in
/// the time `period`.
///
/// The whole scene sleeps at once. Its state, velocities included, stays as it is, and so do forces and energies; time goes
/// on, and so do events. It wakes with a motor, winch, driven body or moved point that sets off, and with each setting that
/// changes something. It stays awake while a brake, winch, motor or contact gives way at the limit of its force, however slowly:
/// that accelerates.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Sleep {
    /// Largest distance between the scene asleep and awake, > 0 \[m].
    pub distance: f64,
    /// Time of rest before sleep, > 0 \[s]; `period`/2 where the rest of the motion is too large to foresee it.
    pub after: f64,
    /// Longest period of an oscillation, > 0 \[s].
    pub period: f64,
}

impl Default for Sleep {
    /// 1 mm, 3 s, a minute.
    fn default() -> Self {
        Self {
            distance: 1e-3,
            after: 3.0,
            period: 60.0,
        }
    }
}

impl Sleep {
    pub(crate) fn validate(self) -> Result<(), StepError> {
        for (field, value) in [
            ("sleep.distance", self.distance),
            ("sleep.after", self.after),
            ("sleep.period", self.period),
        ] {
            let sound = value > 0.0 && value.is_finite();
            check(field, value, sound, "a finite number > 0")?;
        }
        Ok(())
    }
}

/// Translation \[m] and turn \[rad, body frame] of a body.
type Displacement = [Vector3<f64>; 2];

/// Observations of a scene since it began to rest.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(crate) struct Watch {
    /// Report of each step asleep; `None` while awake.
    pub(crate) asleep: Option<StepReport>,
    /// Steps since the beginning of rest.
    steps: usize,
    /// Poses of the bodies at the beginning of rest.
    position: Vec<Vector3<f64>>,
    orientation: Vec<UnitQuaternion<f64>>,
    /// Sums of the bodies' displacements in the thirds of the time that the rest is foreseen from.
    sums: [Vec<Displacement>; 3],
}

impl Watch {
    fn new(bodies: &Bodies) -> Self {
        Self {
            asleep: None,
            steps: 0,
            position: bodies.position.clone(),
            orientation: bodies.orientation.clone(),
            sums: [(); 3].map(|()| vec![Displacement::default(); bodies.len()]),
        }
    }

    /// Begins anew, awake.
    fn begin(&mut self, bodies: &Bodies) {
        self.asleep = None;
        self.steps = 0;
        self.position.copy_from_slice(&bodies.position);
        self.orientation.copy_from_slice(&bodies.orientation);
    }

    fn displacement(&self, bodies: &Bodies, i: usize) -> Displacement {
        let turn = self.orientation[i].inverse() * bodies.orientation[i];
        [
            bodies.position[i] - self.position[i],
            turn.imag() * 2.0_f64.copysign(turn.w),
        ]
    }

    /// Numbers that are finite in a sound watch, and the bodies of its vectors.
    pub(crate) fn numbers(&self) -> (impl Iterator<Item = &f64>, [usize; 5]) {
        let [a, b, c] = &self.sums;
        let sums = self.sums.iter().flatten().flatten().flatten();
        let poses = self.position.iter().flatten();
        let turns = self.orientation.iter().flat_map(|q| q.coords.iter());
        let counts = [
            self.position.len(),
            self.orientation.len(),
            a.len(),
            b.len(),
            c.len(),
        ];
        (sums.chain(poses).chain(turns), counts)
    }
}

/// Limits and observations that decide whether a scene sleeps.
#[derive(Debug, Clone)]
pub(crate) struct Rest {
    pub(crate) watch: Watch,
    /// δ/2 \[m], and the speed above which a force at its limit gives way \[m/s].
    most: f64,
    moves: f64,
    /// Steps in h and in P/2.
    third: usize,
    half_period: usize,
    /// h and P/2 \[s].
    mean_time: f64,
    horizon: f64,
    /// Farthest coordinates of each body's material points \[m].
    reach: Vec<Vector3<f64>>,
    /// Constraints that may drive, and driven bodies.
    drives: Vec<usize>,
    driven: Vec<usize>,
}

/// Steps at most that rest is foreseen from, and more than any run has.
const MANY: f64 = 1e12;

impl Rest {
    /// `None` without [`StepOptions::sleep`].
    pub(crate) fn new(scene: &Scene, options: &StepOptions) -> Option<Self> {
        let sleep = options.sleep?;
        let steps = |time: f64| (time / options.dt).ceil().clamp(1.0, MANY);
        let (third, horizon) = (steps(sleep.after / 3.0), 0.5 * sleep.period);
        let bodies = &scene.bodies;
        let driven = |i: &usize| bodies.mobility[*i] == Mobility::Driven;
        let constraints = scene.constraints.iter().enumerate();
        let drives = constraints.filter_map(|(c, constraint)| may_drive(constraint).then_some(c));
        Some(Self {
            watch: Watch::new(bodies),
            most: 0.5 * sleep.distance,
            moves: yielding::MOVES * sleep.distance / sleep.period,
            third: third as usize,
            half_period: steps(horizon) as usize,
            mean_time: third * options.dt,
            horizon,
            reach: reaches(scene),
            drives: drives.collect(),
            driven: (0..bodies.len()).filter(driven).collect(),
        })
    }

    /// True if a motor, a winch, a moved point or a driven body moves the scene between two times
    /// \[s].
    fn is_driven(&self, scene: &Scene, from: f64, to: f64) -> bool {
        let bodies = &scene.bodies;
        let mut constraints = self.drives.iter().map(|c| &scene.constraints[*c]);
        constraints.any(|constraint| drives(constraint, from, to))
            || self
                .driven
                .iter()
                .any(|i| bodies.rates(*i).iter().any(|rate| *rate != 0.0))
    }

    /// Takes the state after a step; true if the scene rests in it.
    fn is_seen(&mut self, scene: &Scene) -> bool {
        let watch = &mut self.watch;
        let phase = watch.steps % (3 * self.third);
        if phase == 0 {
            for sums in &mut watch.sums {
                sums.fill(Displacement::default());
            }
        }
        for i in scene.dynamic_bodies() {
            let displacement = watch.displacement(&scene.bodies, i);
            let near = way(&displacement, &self.reach[i]) <= self.most;
            if !near {
                watch.begin(&scene.bodies);
                return false;
            }
            let sum = &mut watch.sums[phase / self.third][i];
            sum.iter_mut().zip(displacement).for_each(|(s, d)| *s += d);
        }
        watch.steps += 1;
        let foreseeable = watch.steps.is_multiple_of(3 * self.third);
        watch.steps >= self.half_period || (foreseeable && self.is_foreseen(scene))
    }

    /// After a step awake: the next one sleeps where the scene rests and no force at its limit gives way.
    pub(crate) fn watch(&mut self, step: &Step, report: &StepReport) {
        let scene = &step.scene;
        if self.is_driven(scene, step.time - step.options.dt, step.time) {
            self.watch.begin(&scene.bodies);
        } else if self.is_seen(scene) && !step.gives_way(self.moves, &self.reach) {
            self.watch.asleep = Some(asleep(report));
        }
    }

    /// True if the means of the thirds predict rest for the time P/2 to come.
    fn is_foreseen(&self, scene: &Scene) -> bool {
        let (h, ahead) = (self.mean_time, self.horizon);
        let [first, second, third] = &self.watch.sums;
        let steps = self.third as f64;
        let stays = |i: usize| {
            let of = |k: usize| {
                let [a, b, c] = [first, second, third].map(|sums| sums[i][k] / steps);
                let acceleration = (a - b * 2.0 + c) / (h * h);
                [(c - a) / (2.0 * h) + acceleration * (1.5 * h), acceleration]
            };
            let [[v, a], [spin, b]] = [of(0), of(1)];
            let [speed, acceleration] = [[v, spin], [a, b]].map(|d| way(&d, &self.reach[i]));
            speed * ahead + 0.5 * acceleration * ahead * ahead <= self.most
        };
        scene.dynamic_bodies().all(stays)
    }
}

/// True if the constraint has a motor, a winch or a moved point, which may drive it at some time.
fn may_drive(constraint: &Constraint) -> bool {
    let winch = constraint.winch().is_some();
    let moved = |side: &Side| matches!(side, Side::World(motion) if !motion.is_fixed());
    let mut sides = constraint.frames().iter().map(|frame| &frame.side);
    winch || constraint.motor().is_some() || sides.any(moved)
}

/// True if the motor, winch or moved point of the constraint moves between two times \[s].
fn drives(constraint: &Constraint, from: f64, to: f64) -> bool {
    let moved = |side: &Side| match side {
        Side::World(motion) => motion.displacement(from) != motion.displacement(to),
        Side::Body(_) => false,
    };
    let turns = |target: Target| matches!(target, Target::Speed(speed) if speed != 0.0);
    let winds = constraint.length_at(from) != constraint.length_at(to);
    let mut sides = constraint.frames().iter().map(|frame| &frame.side);
    winds || constraint.motor().is_some_and(|m| turns(m.target)) || sides.any(moved)
}

/// The farthest coordinates of the material points of each body \[m].
fn reaches(scene: &Scene) -> Vec<Vector3<f64>> {
    let bodies = &scene.bodies;
    // A solid box with edges s has ½ (I_x + I_y + I_z) − I_x = m s_x²/12.
    let of_inertia = |i: usize| {
        let inertia = &bodies.inertia[i];
        let of_axis = |k: usize| {
            let square = 0.5 * inertia.trace() - inertia[(k, k)];
            (3.0 * square / bodies.mass[i]).max(0.0).sqrt()
        };
        Vector3::from_fn(|k, _| of_axis(k))
    };
    let mut reach: Vec<_> = (0..bodies.len()).map(of_inertia).collect();
    for frame in scene.constraints.iter().flat_map(Constraint::frames) {
        if let Some(i) = frame.body_index() {
            reach[i] = reach[i].sup(&frame.point.abs());
        }
    }
    for collider in &scene.colliders {
        let turn = collider.orientation.to_rotation_matrix().into_inner();
        let far = collider.position.abs() + turn.abs() * half(&collider.shape);
        if let Some(i) = collider.body.filter(|_| far.iter().all(|x| x.is_finite())) {
            reach[i] = reach[i].sup(&far);
        }
    }
    reach
}

/// Half of the extents of a shape along the axes of its frame, at most \[m].
fn half(shape: &Shape) -> Vector3<f64> {
    match *shape {
        Shape::Cuboid { size } => size * 0.5,
        Shape::Capsule { radius, .. } | Shape::Cylinder { radius, .. } => {
            Vector3::new(radius, radius, shape.reach())
        }
        _ => Vector3::repeat(shape.reach()),
    }
}

/// Bound of the path of points within `reach` of a body's centre under a displacement \[m].
fn way([translation, turn]: &Displacement, reach: &Vector3<f64>) -> f64 {
    let (t, r) = (turn.abs(), reach);
    let across = [
        t.y * r.z + t.z * r.y,
        t.z * r.x + t.x * r.z,
        t.x * r.y + t.y * r.x,
    ];
    translation.norm() + Vector3::from(across).norm()
}

impl Stepper {
    /// The next step is one awake.
    pub(crate) fn wake(&mut self) {
        if let Some(rest) = &mut self.rest {
            rest.watch.begin(&self.step.scene.bodies);
        }
    }

    /// The step of a scene that sleeps, with the report `last` of each, on through it; `None` where something wakes it.
    ///
    /// # Errors
    /// As [`step`](Self::step), of its events.
    pub(crate) fn sleep_through(
        &mut self,
        last: StepReport,
    ) -> Result<Option<StepReport>, StepError> {
        let mut end = self.step.time;
        for _ in 0..self.step.options.substeps {
            end += self.step.substep();
        }
        let is_driven = |rest: &Rest| rest.is_driven(&self.step.scene, self.step.time, end);
        if self.rest.as_ref().is_some_and(is_driven) {
            self.wake();
            return Ok(None);
        }
        self.step.tally = Tally::start();
        self.outdate_coarse_run();
        self.step.time = end;
        let events = self.fire()?;
        self.step.tally.end(Phase::Update);
        let step = self
            .step
            .tally
            .report(self.step.time, self.step.refinements());
        Ok(Some(StepReport {
            time: step.time,
            phases: step.phases,
            events,
            ..last
        }))
    }
}

/// Report of a step asleep, from the last one awake: the same forces and balance, no work done.
fn asleep(last: &StepReport) -> StepReport {
    let contacts = ContactReport {
        pivots: 0,
        sweeps: 0,
        fallbacks: 0,
        softened: 0,
        ..last.contacts
    };
    StepReport {
        solve: SolveReport::DIRECT,
        iterations: 0,
        solves: 0,
        undecided: 0,
        slip_passes: 0,
        implicit_substeps: 0,
        unconverged_substeps: 0,
        redone: false,
        disagreement: 0.0,
        phases: PhaseTimes::default(),
        asleep: true,
        contacts,
        resolved: Resolved {
            segments: last.resolved.segments,
            ..Resolved::default()
        },
        ..*last
    }
}

#[cfg(test)]
mod tests;
