//! Rule by which cables merge and split their segments between steps \[SL Algorithm 1, line 18].
//!
//! A segment of length ℓ is wanted no longer than
//!
//! ```text
//! ℓ* = min(β ē/θ, c Δt/φ),   the shortest where it touches something
//! ```
//!
//! - **Bend.** θ is the angle at the joint that stands for ē of cable, the worse one of its two: at this curvature segments of ℓ*
//!   meet at the angle β = [`bend`](Resolution::bend).
//! - **Frequency.** c = √(T/ρ). A segment between taut ones oscillates across with √(T/(m ℓ)) = c/ℓ, and turns by the phase
//!   φ = [`phase`](Resolution::phase) in a step where it is ℓ* long. In shorter ones is motion that no step shows; longer ones
//!   take some away that it would.
//! - **Contact.** Shapes that can come to touch within the step count as touching.
//!
//! A segment splits in halves at ℓ > ℓ*, where halves are long enough and the cable is not of as many segments as it may be: those
//! that miss ℓ* most come first. Two merge at ℓ + ℓ′ ≤ ℓ*/h of both, with the [`hysteresis`](Resolution::hysteresis) h, a
//! [`pause`](Resolution::pause) after the last change of their cable. A segment that holds anything but its neighbours stays as
//! it is, and so does the first one at a winch.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::Scene;
use super::event::{Action, When};
use crate::collide::Shape;
use crate::constraint::Constraint;
use crate::error::{SceneError, check};
use crate::frame::Frame;
use crate::linearized::Linearized;

/// Rule by which a cable merges and splits its segments: see the [module](self).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Resolution {
    /// Largest angle between neighbours, 0 < β ≤ π \[rad].
    pub bend: f64,
    /// Phase by which a segment oscillates across in a step, ≥ 0 \[rad]; 0: frequencies do not count.
    pub phase: f64,
    /// Least length of a segment, > 0 \[m]; 0 in a cable to be laid: the shortest that it is laid in.
    pub shortest: f64,
    /// Largest length of a segment, at least `shortest` \[m]; in a cable to be laid at most its own.
    pub longest: f64,
    /// Part that two segments are shorter than wanted before they merge, ≥ 1.
    pub hysteresis: f64,
    /// Time without change of the cable before segments merge, ≥ 0 \[s].
    pub pause: f64,
    /// Most segments, ≥ 1; a cable that has more does not split.
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
        let within = 0.0 < self.bend && self.bend <= PI;
        for (quantity, value, ok, needs) in [
            ("bend", self.bend, within, "> 0 and at most π (rad)"),
            ("phase", self.phase, self.phase >= 0.0, "≥ 0 (rad)"),
            ("shortest", self.shortest, self.shortest > 0.0, "> 0 m"),
            (
                "longest",
                self.longest,
                self.longest >= self.shortest,
                "at least `shortest` (m)",
            ),
            (
                "hysteresis",
                self.hysteresis,
                self.hysteresis >= 1.0,
                "≥ 1: with less, what has split would merge at once",
            ),
            ("pause", self.pause, self.pause >= 0.0, "≥ 0 s"),
            (
                "most",
                self.most as f64,
                self.most >= 1,
                "at least 1 segment",
            ),
        ] {
            check(
                format!("{}: resolution: {quantity}", what()),
                value,
                ok,
                needs,
            )?;
        }
        Ok(())
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

/// What a rule sees of the present state.
pub struct View<'a> {
    /// Time \[s], and length of a step \[s].
    pub time: f64,
    /// See `time`.
    pub dt: f64,
    /// Linearisation of the present state, and multipliers of its rows \[N, N m].
    pub rows: &'a Linearized,
    /// See `rows`; of a solve of this length \[s] its impulses, or forces with 1.
    pub lambda: (&'a [f64], f64),
    /// Of each body whether it touches something, and whether it stays as it is: [`Scene::unresolved`].
    pub touching: &'a [bool],
    /// See `touching`.
    pub stays: &'a [bool],
}

/// A change that a rule asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Due {
    /// Number of the segment that splits in halves, or merges with the next.
    pub segment: usize,
    /// Whether it splits.
    pub splits: bool,
    /// Length over ℓ* of one that splits.
    excess: f64,
}

impl Scene {
    /// Of each body whether rules leave it as it is: all but segments that hold nothing but their neighbours.
    #[must_use]
    pub fn unresolved(&self) -> Vec<bool> {
        let mut holds = vec![0_usize; self.bodies.len()];
        let constraints = self.constraints.iter();
        for body in constraints.flat_map(Constraint::bodies) {
            holds[body] += 1;
        }
        // Whatever else knows of a body counts like a third joint.
        let between = self.events.iter().flat_map(|event| {
            let of = event.then.iter().filter_map(|action| match action {
                Action::Attach { between, .. } => Some(between),
                _ => None,
            });
            let watched = match &event.when {
                When::Distance { between, .. } => Some(between),
                _ => None,
            };
            of.chain(watched).flat_map(|between| between.iter())
        });
        for body in between.filter_map(Frame::body_index).chain(self.load) {
            holds[body] += 3;
        }
        for collider in &self.colliders {
            let capsule = matches!(collider.shape, Shape::Capsule { .. });
            let centred = collider.position == Vector3::zeros();
            if let (Some(body), false) = (collider.body, capsule && centred) {
                holds[body] += 3;
            }
        }
        let mut stays = vec![true; self.bodies.len()];
        for (n, parts) in self.cables.iter().enumerate() {
            for (k, &body) in parts.bodies.iter().enumerate() {
                let joints = [0, 1].map(|end| self.joint_at(n, k, end));
                let leads =
                    |joint: &usize| matches!(self.constraints[*joint], Constraint::Fairlead(_));
                let own = joints.iter().flatten();
                stays[body] = !self.bodies.is_dynamic(body)
                    || own.clone().any(leads)
                    || own.count() < holds[body];
            }
        }
        stays
    }

    /// Takes the rules away: all cables keep their segments.
    pub fn keep_resolution(&mut self) {
        for stock in self
            .cables
            .iter_mut()
            .filter_map(|parts| parts.stock.as_mut())
        {
            stock.resolution = None;
        }
    }

    /// The rule of cable number `cable` has changed it at time `t` (s).
    pub fn resolved(&mut self, cable: usize, t: f64) {
        let stock = self
            .cables
            .get_mut(cable)
            .and_then(|parts| parts.stock.as_mut());
        if let Some(rule) = stock.and_then(|stock| stock.resolution.as_mut()) {
            rule.since = t;
        }
    }

    /// What the rule of cable number `cable` asks for, by the numbers of its segments, into `due`; `wanted` is a buffer.
    /// Allocates nothing in vectors that are large enough.
    pub fn resolution_due(
        &self,
        cable: usize,
        view: &View<'_>,
        wanted: &mut Vec<f64>,
        due: &mut Vec<Due>,
    ) {
        due.clear();
        let Some((parts, stock, rule)) = self.cables.get(cable).and_then(|parts| {
            let stock = parts.stock.as_ref()?;
            Some((parts, stock, stock.resolution.as_ref()?))
        }) else {
            return;
        };
        let length = |k: usize| self.bodies.mass[parts.bodies[k]] / stock.density;
        self.find_wanted(cable, view, wanted);
        let may = |k: usize| !view.stays[parts.bodies[k]];
        // Halves of a length are its halves to rounding.
        let least = rule.shortest * (1.0 - 1e-9);
        for k in (0..wanted.len()).filter(|k| may(*k)) {
            let excess = length(k) / wanted[k].clamp(rule.shortest, rule.longest);
            if excess > 1.0 + 1e-9 && 0.5 * length(k) >= least {
                due.push(Due {
                    segment: k,
                    splits: true,
                    excess,
                });
            }
        }
        let room = rule.most.saturating_sub(parts.bodies.len());
        if due.len() > room {
            due.sort_unstable_by(|a, b| b.excess.total_cmp(&a.excess));
            due.truncate(room);
        }
        let (mut k, pauses) = (0, view.time - rule.since < rule.pause);
        while k + 1 < wanted.len() && !pauses {
            let both = length(k) + length(k + 1);
            let most = wanted[k].min(wanted[k + 1]) / rule.hysteresis;
            let merges = both <= most.min(rule.longest * (1.0 + 1e-9));
            if merges && may(k) && may(k + 1) && self.joint_at(cable, k, 1).is_some() {
                due.push(Due {
                    segment: k,
                    splits: false,
                    excess: 0.0,
                });
                k += 1;
            }
            k += 1;
        }
        due.sort_unstable_by_key(|due| due.segment);
    }

    /// ℓ* of each segment of a cable with a rule \[m].
    fn find_wanted(&self, cable: usize, view: &View<'_>, wanted: &mut Vec<f64>) {
        wanted.clear();
        let parts = &self.cables[cable];
        let Some((stock, rule)) = parts
            .stock
            .as_ref()
            .and_then(|stock| Some((stock, stock.resolution.as_ref()?)))
        else {
            return;
        };
        let length = |k: usize| self.bodies.mass[parts.bodies[k]] / stock.density;
        let last = parts.bodies.len().saturating_sub(1);
        let mut before = [0.0; 2];
        for (k, &body) in parts.bodies.iter().enumerate() {
            if k == 0 {
                let ahead = self.joint_at(cable, 0, 0);
                before = self.bend_and_pull(ahead, (body, 1, false), 0.5 * length(0), view);
            }
            let next = if k < last { length(k + 1) } else { 0.0 };
            let (joint, stands_for) = (self.joint_at(cable, k, 1), 0.5 * (length(k) + next));
            let after = self.bend_and_pull(joint, (body, 0, k < last), stands_for, view);
            let curvature = before[0].max(after[0]);
            let speed = (0.5 * (before[1] + after[1]) / stock.density).sqrt();
            wanted.push(if view.touching[body] {
                rule.shortest
            } else {
                rule.wanted(curvature, speed, view.dt)
            });
            before = after;
        }
    }

    /// Curvature at a joint that stands for so much cable (m), 0 at an end that nothing holds in its direction \[1/m], and
    /// its pull along the segment on its `side`, 0 where it pushes \[N].
    fn bend_and_pull(
        &self,
        joint: Option<usize>,
        (body, side, inner): (usize, usize, bool),
        stands_for: f64,
        view: &View<'_>,
    ) -> [f64; 2] {
        let Some(joint) = joint else {
            return [0.0; 2];
        };
        let (range, constraint) = (view.rows.row_range(joint), &self.constraints[joint]);
        let frames = constraint.frames();
        let angle = match constraint {
            Constraint::Cosserat(c) if c.law.stretch.is_some() && c.law.bend.is_some() => {
                view.rows.phi[range.start + 3].hypot(view.rows.phi[range.start + 4])
            }
            _ if inner => {
                let [a, b] = [0, 1].map(|n| frames[n].resolve(&self.bodies, view.time).u());
                2.0 * (0.5 * (a - b).norm()).min(1.0).asin()
            }
            _ => 0.0,
        };
        let (impulses, dt) = view.lambda;
        let pull = match constraint {
            Constraint::Fairlead(_) => -impulses[range.start],
            Constraint::Cosserat(_) | Constraint::Spherical(_) if range.len() >= 3 => {
                let along = self.bodies.orientation[body] * frames[side].axes.column(0);
                along.dot(&Vector3::from_column_slice(
                    &impulses[range.start..range.start + 3],
                ))
            }
            _ => 0.0,
        };
        [angle / stands_for, pull.max(0.0) / dt]
    }
}

#[cfg(test)]
mod tests;
