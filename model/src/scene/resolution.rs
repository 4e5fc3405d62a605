//! Rule by which cables merge and split their segments between steps \[SL Algorithm 1, line 18].
//!
//! A segment of length ℓ is wanted no longer than
//!
//! ```text
//! ℓ* = min(β/κ, c Δt/φ),   the shortest where it touches something
//! ```
//!
//! - **Bend.** The curvature κ = (θ₋ + θ₊)/(2ℓ) is that of the angles θ at its joints, half of which are its own: ℓ > ℓ* where
//!   their mean is larger than β = [`bend`](Resolution::bend). A split leaves one of them to each half, and those of the neighbours
//!   as they are.
//! - **Frequency.** c = √(T/ρ). A segment between taut ones oscillates across with √(T/(m ℓ)) = c/ℓ, and turns by the phase
//!   φ = [`phase`](Resolution::phase) in a step where it is ℓ* long. In shorter ones is motion that no step shows; longer ones
//!   take some away that it would.
//! - **Contact.** Shapes that can come to touch within the step count as touching. A cable never touches itself.
//!
//! A segment splits in halves at ℓ > ℓ*, where halves are long enough and the cable is not of as many segments as it may be: those
//! that miss ℓ* most come first. Two merge at ℓ + ℓ′ ≤ ℓ*/h of both, with the [`hysteresis`](Resolution::hysteresis) h, or
//! where one is shorter than the shortest, a [`pause`](Resolution::pause) after the last change of their cable. A segment that
//! holds anything but its neighbours stays as it is, and so do one whose joint an event names and the first one at a winch,
//! which splits and merges by itself.
//!
//! Changes one beside the other and ties are settled from the higher end on, whichever is the cable's start: exchanging its ends
//! changes nothing but rounding.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector3};

use super::event::{Action, Event, When};
use super::{CableParts, Scene};
use crate::collide::Shape;
use crate::constraint::Constraint;
use crate::error::{SceneError, check};
use crate::frame::Frame;

/// Rule by which a cable merges and splits its segments: see the [module](self).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Resolution {
    /// Largest mean of the angles at a segment's ends, 0 < β ≤ π \[rad].
    pub bend: f64,
    /// Phase by which a segment oscillates across in a step, ≥ 0 \[rad]; 0: frequencies do not count.
    pub phase: f64,
    /// Least length of a segment, > 0 \[m]; 0 in a cable to be laid: the shortest that it is laid in.
    pub shortest: f64,
    /// Largest length of a segment, at least `shortest` \[m]; ∞ in a cable to be laid: its own.
    pub longest: f64,
    /// Part that two segments are shorter than wanted before they merge, ≥ 1.
    pub hysteresis: f64,
    /// Time without change of the cable before segments merge, > 0 \[s].
    pub pause: f64,
    /// Most segments that the rule splits into, ≥ 1.
    pub most: usize,
    /// Time of the last change \[s].
    pub since: f64,
}

impl Default for Resolution {
    /// Segments as short as they are laid and as long as the cable, which bend by 0.1 rad and oscillate by 0.25 rad a step;
    /// they merge to half of what is wanted, 0.1 s after the last change. At most 10,000 segments.
    fn default() -> Self {
        Self {
            bend: 0.1,
            phase: 0.25,
            shortest: 0.0,
            longest: f64::INFINITY,
            hysteresis: 2.0,
            pause: 0.1,
            most: 10_000,
            since: 0.0,
        }
    }
}

impl Resolution {
    /// This rule for a cable that is laid at time `t` (s) in segments of these lengths (m).
    pub(crate) fn laid(&self, lengths: impl Iterator<Item = f64> + Clone, t: f64) -> Self {
        let mut rule = self.clone();
        if rule.shortest == 0.0 {
            rule.shortest = lengths.clone().fold(f64::INFINITY, f64::min);
        }
        if rule.longest == f64::INFINITY {
            rule.longest = lengths.sum::<f64>().max(rule.shortest);
        }
        rule.since = rule.since.max(t);
        rule
    }

    /// Checks that all numbers are in their ranges; `what` is whose rule it is.
    pub(crate) fn validate(&self, what: impl Fn() -> String) -> Result<(), SceneError> {
        let own = |quantity: &str, value: f64, ok: bool, needs| {
            check(
                format!("{}: resolution: {quantity}", what()),
                value,
                ok,
                needs,
            )
        };
        let within = 0.0 < self.bend && self.bend <= PI;
        own("bend", self.bend, within, "> 0 and at most π (rad)")?;
        own("phase", self.phase, self.phase >= 0.0, "≥ 0 (rad)")?;
        own("shortest", self.shortest, self.shortest > 0.0, "> 0 m")?;
        let ordered = self.longest >= self.shortest;
        own("longest", self.longest, ordered, "at least `shortest` (m)")?;
        let needs = "≥ 1: with less, what has split would merge at once";
        own("hysteresis", self.hysteresis, self.hysteresis >= 1.0, needs)?;
        let needs = "> 0 s: without one, segments could split and merge at every step";
        own("pause", self.pause, self.pause > 0.0, needs)?;
        own("since", self.since, true, "a time (s)")?;
        own(
            "most",
            self.most as f64,
            self.most >= 1,
            "at least 1 segment",
        )
    }

    /// ℓ* of a segment with that curvature (1/m) and wave speed (m/s) in steps of `dt` (s), before its limits \[m].
    fn wanted(&self, curvature: f64, speed: f64, dt: f64) -> f64 {
        // 0/0 is nothing to resolve.
        let of = |most: f64, is: f64| if is > 0.0 { most / is } else { f64::INFINITY };
        let by_phase = if self.phase > 0.0 {
            speed * dt / self.phase
        } else {
            f64::INFINITY
        };
        of(self.bend, curvature).min(by_phase)
    }
}

/// Present state as the rules need it.
pub struct View<'a> {
    /// Time \[s], and length of a step \[s].
    pub time: f64,
    /// See `time`.
    pub dt: f64,
    /// Violations of all rows.
    pub phi: &'a [f64],
    /// First row of each constraint.
    pub first_rows: &'a [usize],
    /// Impulses of the rows \[N s, N m s], and the time that they belong to \[s].
    pub impulses: &'a [f64],
    /// See `impulses`.
    pub impulse_time: f64,
    /// Bodies that touch something, and bodies that rules leave as they are
    /// ([`Scene::unresolved`]); one flag a body.
    pub touching: &'a [bool],
    /// See `touching`.
    pub stays: &'a [bool],
    /// Joints of each body towards the start and the end of its cable:
    /// [`Scene::joints_of_segments`].
    pub joints: &'a [[Option<usize>; 2]],
}

/// A change that a rule asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Due {
    /// Number of the segment that splits in halves, or merges with the next.
    pub segment: usize,
    /// True for a split, false for a merge.
    pub splits: bool,
    /// Length over ℓ* of one that splits.
    excess: f64,
}

/// Part of a distance or of an excess that is rounding.
const SAME: f64 = 1e-9;

/// Keeps the changes of the largest excess, so many, the first ones where they are as large; the order stays.
fn keep_largest(due: &mut Vec<Due>, room: usize) {
    while due.len() > room {
        let excess = due.iter().map(|due| due.excess);
        let least = excess.fold(f64::INFINITY, f64::min);
        let last = |due: &Due| due.excess <= least * (1.0 + SAME);
        due.remove(due.iter().rposition(last).unwrap_or(0));
    }
}

impl Scene {
    /// Joints of each body towards the start and the end of the cable that it is a segment of.
    #[must_use]
    pub fn joints_of_segments(&self) -> Vec<[Option<usize>; 2]> {
        let mut joints = vec![[None; 2]; self.bodies.len()];
        let mut cable = vec![None; self.bodies.len()];
        for (n, parts) in self.cables.iter().enumerate() {
            for &body in &parts.bodies {
                cable[body] = Some(n);
            }
            for &joint in &parts.joints {
                for (frame, end) in self.constraints[joint].frames().iter().zip([1, 0]) {
                    if let Some(body) = frame.body_index().filter(|i| cable[*i] == Some(n)) {
                        joints[body][end].get_or_insert(joint);
                    }
                }
            }
        }
        joints
    }

    /// Bodies that rules leave as they are, one flag a body: all but segments that hold nothing but
    /// their neighbours. `joints` are [those of the segments](Self::joints_of_segments).
    #[must_use]
    pub fn unresolved(&self, joints: &[[Option<usize>; 2]]) -> Vec<bool> {
        let mut holds = vec![0_usize; self.bodies.len()];
        let bodies = self.constraints.iter().flat_map(Constraint::bodies);
        bodies.for_each(|body| holds[body] += 1);
        // Whatever else knows of a body counts like a third joint.
        let others = self.events.iter().flat_map(|event| self.watched(event));
        others.chain(self.load).for_each(|body| holds[body] += 3);
        let mut capsules = vec![0_usize; self.bodies.len()];
        for collider in &self.colliders {
            let capsule = matches!(collider.shape, Shape::Capsule { .. })
                && collider.position == Vector3::zeros()
                && collider.orientation == UnitQuaternion::identity();
            if let Some(body) = collider.body {
                capsules[body] += if capsule { 1 } else { 2 };
            }
        }
        let stays = |body: usize| {
            let own = joints[body].iter().flatten();
            let count = own.clone().count();
            let cable = { own }.all(|joint| self.constraints[*joint].joins_cable());
            !self.bodies.is_dynamic(body) || !cable || count == 0 || count < holds[body]
        };
        (0..self.bodies.len())
            .map(|body| stays(body) || capsules[body] > 1)
            .collect()
    }

    /// Bodies that an event knows of, but for a joint that breaks.
    fn watched<'a>(&'a self, event: &'a Event) -> impl Iterator<Item = usize> + 'a {
        let breaks = match (&event.when, event.then.as_slice()) {
            (When::Force { constraint, .. }, [Action::Release(joint)]) => constraint == joint,
            _ => false,
        };
        let (force, place) = match &event.when {
            When::Force { constraint, .. } => (Some(*constraint), None),
            When::Distance { between, .. } => (None, Some(between)),
            When::Time(_) => (None, None),
        };
        let released = event.then.iter().filter_map(|action| match action {
            Action::Release(joint) => Some(*joint),
            Action::Detach(name) => self.constraint_names.iter().position(|known| known == name),
            _ => None,
        });
        let attached = event.then.iter().filter_map(|action| match action {
            Action::Attach { between, .. } => Some(between),
            _ => None,
        });
        let joints = released.chain(force).filter(move |_| !breaks);
        let of_joints = joints.flat_map(|joint| self.constraints[joint].bodies());
        let points = attached.chain(place).flat_map(|between| between.iter());
        of_joints.chain(points.filter_map(Frame::body_index))
    }

    /// Takes the rules away: all cables keep their segments.
    pub fn keep_resolution(&mut self) {
        let stocks = self.cables.iter_mut().filter_map(|c| c.stock.as_mut());
        stocks.for_each(|stock| stock.resolution = None);
    }

    /// The rule of cable number `cable` has changed it at time `t` (s).
    pub fn resolved(&mut self, cable: usize, t: f64) {
        let stock = self.cables.get_mut(cable).and_then(|c| c.stock.as_mut());
        if let Some(rule) = stock.and_then(|stock| stock.resolution.as_mut()) {
            rule.since = t;
        }
    }

    /// Writes the changes that the rule of cable number `cable` asks for into `due`, by the numbers
    /// of its segments and in the order of their execution. Exchanging the cable's ends keeps the
    /// changes and their order. `wanted` is a buffer. Does not allocate if the vectors are large
    /// enough.
    pub fn resolution_due(
        &self,
        cable: usize,
        view: &View<'_>,
        wanted: &mut Vec<f64>,
        due: &mut Vec<Due>,
    ) {
        due.clear();
        let Some((parts, density, rule)) = self.ruled(cable) else {
            return;
        };
        let length = |k: usize| self.bodies.mass[parts.bodies[k]] / density;
        wanted.clear();
        let all = 0..parts.bodies.len();
        wanted.extend(all.map(|k| self.wanted(cable, k, view).unwrap_or(f64::INFINITY)));
        let may = |k: usize| !view.stays[parts.bodies[k]];
        let (count, turned) = (wanted.len(), self.is_turned(parts));
        // The segments in an order that knows nothing of which end is the first.
        let along = |i: usize| if turned { count - 1 - i } else { i };
        // Halves of a length are its halves to rounding.
        let (least, most) = (rule.shortest * (1.0 - 1e-9), rule.longest * (1.0 + 1e-9));
        let excess = |k: usize| length(k) / wanted[k].min(rule.longest).max(rule.shortest);
        let splits = |k: usize| excess(k) > 1.0 + 1e-9 && 0.5 * length(k) >= least;
        for k in (0..count).map(along).filter(|k| may(*k)) {
            if splits(k) {
                due.push(Due {
                    segment: k,
                    splits: true,
                    excess: excess(k),
                });
            }
        }
        keep_largest(due, rule.most.saturating_sub(count));
        let (mut i, pauses) = (0, view.time - rule.since < rule.pause);
        while i + 1 < count && !pauses {
            let [k, next] = [along(i), along(i + 1)];
            let both = length(k) + length(next);
            let coarse = both <= wanted[k].min(wanted[next]) / rule.hysteresis;
            let short = length(k).min(length(next)) < least && !splits(k) && !splits(next);
            let (merges, first) = (coarse || short, k.min(next));
            let joined = || view.joints[parts.bodies[first]][1].is_some();
            if merges && both <= most && may(k) && may(next) && joined() {
                due.push(Due {
                    segment: first,
                    splits: false,
                    excess: 0.0,
                });
                i += 1;
            }
            i += 1;
        }
        due.sort_unstable_by_key(|due| due.segment);
        if !turned {
            due.reverse();
        }
    }

    /// True if a rule takes the cable from its end on, which is then the higher one, or the farther
    /// one along an axis of the world where both are as high. Which end is called the start does
    /// not change the order of changes.
    fn is_turned(&self, parts: &CableParts) -> bool {
        let up = (-self.gravity).try_normalize(0.0);
        let axes = [Vector3::z(), Vector3::x(), Vector3::y()];
        let axes = up.into_iter().chain(axes);
        let pairs = parts.bodies.iter().zip(parts.bodies.iter().rev());
        let mut apart = pairs
            .take(parts.bodies.len() / 2)
            .map(|(a, b)| self.bodies.position[*a] - self.bodies.position[*b])
            .flat_map(|apart| {
                axes.clone()
                    .map(move |axis| (apart.dot(&axis), apart.norm()))
            });
        // Differences within rounding do not count.
        let decides = |(along, norm): &(f64, f64)| along.abs() > SAME * norm;
        apart.find(decides).is_some_and(|(along, _)| along < 0.0)
    }

    /// A cable with a rule, its mass per length \[kg/m], and the rule.
    fn ruled(&self, cable: usize) -> Option<(&CableParts, f64, &Resolution)> {
        let parts = self.cables.get(cable)?;
        let stock = parts.stock.as_ref()?;
        Some((parts, stock.density, stock.resolution.as_ref()?))
    }

    /// ℓ* of segment `k` of a cable with a rule \[m].
    fn wanted(&self, cable: usize, k: usize, view: &View<'_>) -> Option<f64> {
        let (parts, density, rule) = self.ruled(cable)?;
        let body = parts.bodies[k];
        if view.touching[body] {
            return Some(rule.shortest);
        }
        let inner = [k > 0, k + 1 < parts.bodies.len()];
        let (mut bend, mut pull) = (0.0, 0.0);
        for (end, inner) in inner.into_iter().enumerate() {
            if let Some(joint) = view.joints[body][end] {
                bend += 0.5 * self.bend_at(joint, inner, view);
                pull += 0.5 * self.pull_at(joint, (body, 1 - end), view);
            }
        }
        let (length, speed) = (self.bodies.mass[body] / density, (pull / density).sqrt());
        Some(rule.wanted(bend / length, speed, view.dt))
    }

    /// Angle between the sides of a joint of cable, 0 at an end that nothing holds in its direction \[rad].
    fn bend_at(&self, joint: usize, inner: bool, view: &View<'_>) -> f64 {
        let (first, constraint) = (view.first_rows[joint], &self.constraints[joint]);
        match (constraint, constraint.frames()) {
            (Constraint::Cosserat(c), _) if c.law.stretch.is_some() && c.law.bend.is_some() => {
                view.phi[first + 3].hypot(view.phi[first + 4])
            }
            (_, [a, b]) if inner => {
                let [a, b] = [a, b].map(|frame| frame.resolve(&self.bodies, view.time).u());
                2.0 * (0.5 * (a - b).norm()).min(1.0).asin()
            }
            _ => 0.0,
        }
    }

    /// Pull of a joint along the segment on its side, 0 where it pushes \[N].
    fn pull_at(&self, joint: usize, (body, side): (usize, usize), view: &View<'_>) -> f64 {
        let (first, constraint) = (view.first_rows[joint], &self.constraints[joint]);
        let impulse = match constraint {
            Constraint::Fairlead(_) => -view.impulses[first],
            _ if constraint.joins_cable() => {
                let axis = constraint.frames()[side].axes.column(0);
                let along = self.bodies.orientation[body] * axis;
                along.dot(&Vector3::from_column_slice(
                    &view.impulses[first..first + 3],
                ))
            }
            _ => 0.0,
        };
        impulse.max(0.0) / view.impulse_time
    }
}

#[cfg(test)]
mod tests;
