//! Massless cable: the total length through any number of attachment points, with a winch if wanted.
//!
//! With the points p₀ … p_m (p = x + r) and the spans d_k = p_{k−1} − p_k, n_k = d_k/|d_k|:
//!
//!   φ = Σ_k |d_k| − L(t)  \[SL §III (b)],   φ̇ = Σ_j (n_{j+1} − n_j)·ṗ_j − L̇,  n_0 = n_{m+1} = 0
//!
//! 1 row, m. The cable slides freely through the inner points: one tension |λ| in all spans. With
//! [`sheaves`](MasslessCable::sheaves) it runs over wheels there ([`Sheave`]); beyond one with friction a cable goes on as
//! another one ([`crate::Scene::reeve`]). φ > 0 and λ < 0 where it is taut. With `tension_only` the row has the bound λ ≤ 0 and is
//! slack where it is too long; without, it also pushes.
//!
//! A winch changes L at a speed of its own and holds up to a tension F: λ ≥ −F. Where that is not enough the drum slips:
//! what is then paid out is what the elastic law asks for, Σ|d_k| − L = ε F ([`MasslessCable::settle`]). Compliance is
//! proportional to the length, ε(L) = ε L/L_ref.
//!
//! A span of length zero has no direction: it is taken to be z, so that all is finite.

use nalgebra::Vector3;
use std::cell::Cell;
use std::f64::consts::TAU;

use super::distance::direction;
use super::sheave::{self, Lay, Pull, Sheave, Wheel};
use super::{RowLaw, Rows};
use crate::body::Bodies;
use crate::error::{SceneError, check, limited};
use crate::frame::{Frame, Resolved};

/// What a sheave that the cable does not bend around is told.
const PASSED_BY: &str = "does not touch the cable, which would bend the other way there: reverse its axis, move it, or let the \
                         cable pass by (`off = true`)";

/// An end of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    First,
    Last,
}

/// Pays a massless cable out and hauls it in.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Winch {
    /// Speed at which it pays out \[m/s]; negative hauls in. Without effect while the brake is on.
    pub speed: f64,
    /// Largest tension that the winch holds while the brake is off \[N], ≥ 0; above it the drum slips.
    #[cfg_attr(feature = "serde", serde(with = "crate::unlimited"))]
    pub force_limit: f64,
    /// Whether the brake is on: the drum then stands still.
    pub brake: bool,
    /// Largest tension that the brake holds \[N], ≥ 0; above it the drum slips.
    #[cfg_attr(feature = "serde", serde(with = "crate::unlimited"))]
    pub brake_limit: f64,
    /// Length at which hauling in stops \[m], > 0.
    pub shortest: f64,
    /// Length at which the drum is empty and its end holds any tension \[m].
    #[cfg_attr(feature = "serde", serde(with = "crate::unlimited"))]
    pub longest: f64,
    /// Time from which on `speed` holds \[s]: the cable had its `length` then. A winch of a time > 0 rests before; one of
    /// 0, with which a run begins, was running already, so that a load that moves with its cable feels no start.
    pub since: f64,
}

impl Winch {
    /// A winch at rest without limits.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            speed: 0.0,
            force_limit: f64::INFINITY,
            brake: false,
            brake_limit: f64::INFINITY,
            shortest: 1e-3,
            longest: f64::INFINITY,
            since: 0.0,
        }
    }

    /// Checks that all numbers are in their ranges; `what` is whose winch it is.
    ///
    /// # Errors
    /// The first number that is not.
    pub fn validate(&self, what: impl Fn() -> String) -> Result<(), SceneError> {
        let of = |quantity: &str| format!("{}: winch {quantity}", what());
        check(of("speed"), self.speed, true, "a number of m/s")?;
        check(of("since"), self.since, true, "a time in s")?;
        for (quantity, limit) in [
            ("force limit", self.force_limit),
            ("brake limit", self.brake_limit),
        ] {
            limited(of(quantity), limit, limit >= 0.0, "≥ 0 N; inf is no limit")?;
        }
        let shortest = self.shortest;
        let needs = "> 0 m: where hauling in stops";
        check(of("shortest"), shortest, shortest > 0.0, needs)?;
        let needs = "≥ shortest (m); inf is no limit";
        limited(of("longest"), self.longest, self.longest >= shortest, needs)
    }

    /// Tension that makes the drum slip \[N].
    #[must_use]
    pub fn holding_force(&self) -> f64 {
        if self.brake {
            self.brake_limit
        } else {
            self.force_limit
        }
    }
}

impl Default for Winch {
    fn default() -> Self {
        Self::new()
    }
}

/// Total length through two or more points, 1 row.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MasslessCable {
    /// The attachment frames in the order of the cable, at least 2; their axes are not used.
    pub frames: Vec<Frame>,
    /// The sheaves at these points, `None` at a point that is none: one for each frame, or empty where there are none. Those
    /// at the ends are drums.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Vec::is_empty")
    )]
    pub sheaves: Vec<Option<Sheave>>,
    /// Total length L at rest \[m], > 0; with a winch that at the time [`Winch::since`].
    pub length: f64,
    /// Law of the row, compliance in m/N of a cable with that length.
    pub law: RowLaw,
    /// Whether it goes slack instead of pushing.
    pub tension_only: bool,
    /// What changes its length.
    pub winch: Option<Winch>,
}

impl MasslessCable {
    /// A cable without winch that goes slack instead of pushing: through `frames`, `length` in m, compliance in m/N.
    #[must_use]
    pub fn new(frames: Vec<Frame>, length: f64, law: RowLaw) -> Self {
        Self {
            frames,
            sheaves: Vec::new(),
            length,
            law,
            tension_only: true,
            winch: None,
        }
    }

    /// Length at rest at time `t` (s) \[m]; what it was before [`Winch::since`] is said there.
    #[must_use]
    pub fn length_at(&self, t: f64) -> f64 {
        match &self.winch {
            Some(w) if !w.brake && w.speed != 0.0 => {
                // A cable that is out of the range already stays as it is.
                let (shortest, longest) = (w.shortest.min(self.length), w.longest.max(self.length));
                let after = |time: f64| (self.length + w.speed * time).clamp(shortest, longest);
                match t - w.since {
                    time if time >= 0.0 => after(time),
                    _ if w.since > 0.0 => self.length,
                    // As it goes on: a drum at its stop stood there before.
                    time => (2.0 * self.length - after(-time)).max(shortest),
                }
            }
            _ => self.length,
        }
    }

    /// Compliance at time `t` (s) of what is off the drums \[m/N].
    #[must_use]
    pub fn compliance_at(&self, t: f64) -> f64 {
        let length = self.length_at(t) - self.wound();
        // The quotient of equal numbers is exact.
        self.law.compliance * (length / self.length)
    }

    /// Length that lies on drums \[m].
    #[must_use]
    pub fn wound(&self) -> f64 {
        let ends = [self.sheaves.first(), self.sheaves.last()];
        ends.into_iter()
            .flatten()
            .flatten()
            .map(Sheave::wound)
            .sum()
    }

    /// Fastest turning of a sheave about its axis \[rad/s]; 0 without any on a body.
    #[must_use]
    pub fn turn_of_sheaves(&self, bodies: &Bodies) -> f64 {
        let sides = self.frames.iter().zip(&self.sheaves);
        let rates = sides
            .filter(|(_, sheave)| sheave.is_some())
            .map(|(frame, _)| {
                let rate = |i: usize| {
                    let axis = bodies.rotation(i) * frame.axes.column(0);
                    bodies.angular_velocity[i].dot(&axis).abs()
                };
                frame.body_index().map_or(0.0, rate)
            });
        rates.fold(0.0, f64::max)
    }

    /// Whether the frame, one of its own, is that of a sheave.
    pub(crate) fn has_sheave(&self, frame: &Frame) -> bool {
        let mut sides = self.frames.iter().zip(&self.sheaves);
        sides.any(|(own, sheave)| sheave.is_some() && std::ptr::eq(own, frame))
    }

    /// Whether it does not lie on some sheave yet.
    pub(crate) fn is_new(&self) -> bool {
        self.sheaves.iter().flatten().any(|s| s.lay == Lay::New)
    }

    /// Whether it is a part of a cable that goes on as another one.
    #[must_use]
    pub fn is_part(&self) -> bool {
        let ends = [self.sheaves.first(), self.sheaves.last()];
        ends.into_iter().flatten().flatten().any(|s| s.shared)
    }

    /// Bounds of λ at time `t` (s), lower and upper \[N].
    #[must_use]
    pub fn bounds_at(&self, t: f64) -> (f64, f64) {
        let lower = match &self.winch {
            Some(w) if self.length_at(t) < w.longest => -w.holding_force(),
            _ => f64::NEG_INFINITY,
        };
        let upper = if self.tension_only {
            0.0
        } else {
            f64::INFINITY
        };
        (lower, upper)
    }

    /// Makes time `t` (s) the one that `length` and compliance belong to, so that the winch can be set anew.
    pub fn rebase(&mut self, t: f64) {
        self.set_length(self.length_at(t), t);
    }

    /// Pays out what a drum that slipped at time `t` (s) has let go, where the spans are `excess` (m) longer than the
    /// length at rest: until the elastic law gives the holding force, or the drum is empty. Returns what it paid out.
    pub fn settle(&mut self, excess: f64, t: f64) -> f64 {
        let Some(winch) = self.winch else {
            return 0.0;
        };
        let (now, compliance) = (self.length_at(t), self.compliance_at(t));
        // (total − L) = (ε/now) L F, of what is off the drums.
        let wound = self.wound();
        let (off, total) = (now - wound, now - wound + excess);
        let settled = total / (1.0 + compliance / off * winch.holding_force()) + wound;
        let settled = settled.min(winch.longest.max(now));
        if settled > now {
            self.set_length(settled, t);
            return settled - now;
        }
        0.0
    }

    fn set_length(&mut self, length: f64, t: f64) {
        if let Some(winch) = &mut self.winch {
            self.law.compliance *= length / self.length;
            self.length = length;
            winch.since = t;
        }
    }

    pub(super) fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        if !self.sheaves.is_empty() {
            return self.evaluate_over_sheaves(bodies, t, rows);
        }
        let resolved = |(k, f): (usize, &Frame)| (k, f.resolve(bodies, t));
        let mut sides = self.frames.iter().enumerate().map(resolved);
        let Some(mut last) = sides.next() else {
            return;
        };
        let (mut total, mut blocks) = (0.0, 0);
        let mut before = Vector3::zeros();
        let mut finish = |(k, side): &(usize, Resolved), g: Vector3<f64>| {
            if let Some(block) = rows.block_of(*k, &self.frames[*k], &mut blocks) {
                rows.point(block, 0, &g, &side.lever);
            }
        };
        for next in sides {
            let (length, n) = direction(&super::gap(&last.1, &next.1));
            total += length;
            finish(&last, n - before);
            (before, last) = (n, next);
        }
        finish(&last, -before);
        rows.phi[0] = total - self.length_at(t);
    }

    /// Λ at time `t` (s) \[m].
    pub(crate) fn path(&self, bodies: &Bodies, t: f64) -> f64 {
        let mut phi = [0.0];
        self.evaluate(bodies, t, &mut Rows::new(&mut phi, &mut [], &mut []));
        phi[0] + self.length_at(t)
    }

    /// Where it leaves its first sheave and arrives at its last \[rad]; NaN where that is not known.
    pub(crate) fn first_leaving(&self) -> f64 {
        angle(self.sheaves.first(), Lay::leaving)
    }

    pub(crate) fn first_arriving(&self) -> f64 {
        angle(self.sheaves.first(), Lay::arriving)
    }

    pub(crate) fn last_arriving(&self) -> f64 {
        angle(self.sheaves.last(), Lay::arriving)
    }

    /// Makes it longer by so much at time `t` (s), of the same material \[m]; what its winch may still feed stays.
    pub(crate) fn lengthen(&mut self, by: f64, t: f64) {
        self.rebase(t);
        if let Some(winch) = &mut self.winch {
            winch.shortest += by;
            winch.longest += by;
        }
        let length = self.length + by;
        self.law.compliance *= length / self.length;
        self.length = length;
    }

    /// Fastens an end elsewhere on its sheave, at the angle `cut` (rad), with what lies between.
    pub(crate) fn cut_at(&mut self, cut: f64, end: End, t: f64) {
        if let Some((radius, before)) = self.fasten(cut, end) {
            let by = radius * (cut - before);
            self.lengthen(if end == End::First { -by } else { by }, t);
        }
    }

    /// Sets the angle at which an end is fastened (rad); returns the radius and the angle before.
    pub(crate) fn fasten(&mut self, cut: f64, end: End) -> Option<(f64, f64)> {
        let sheave = match end {
            End::First => self.sheaves.first_mut(),
            End::Last => self.sheaves.last_mut(),
        };
        let sheave = sheave?.as_mut()?;
        let Lay::On { arriving, leaving } = &mut sheave.lay else {
            return None;
        };
        let at = if end == End::First { arriving } else { leaving };
        Some((sheave.radius, std::mem::replace(at, cut)))
    }

    /// Checks its sheaves and that it has a tangent on each with the bodies where they are at time `t` (s); `of` names it.
    pub(crate) fn check_path(&self, bodies: &Bodies, t: f64, of: &str) -> Result<(), SceneError> {
        let (count, sides) = (self.sheaves.len(), self.frames.len());
        if count == 0 {
            return Ok(());
        }
        let what = |side: usize| sheave::called(of, side);
        if count != sides {
            return Err(SceneError::Length {
                what: "sheaves of a massless cable",
                got: count,
                expected: sides,
            });
        }
        for (side, sheave) in self.sheaves.iter().enumerate() {
            let Some(sheave) = sheave else { continue };
            let of = |quantity: &str| format!("{}: {quantity}", what(side));
            let Sheave {
                radius,
                turns,
                friction,
                ..
            } = *sheave;
            check(
                of("radius"),
                radius,
                radius > 0.0,
                "> 0 m; leave the sheave out for a point",
            )?;
            check(of("turns"), turns, turns >= 0.0, "≥ 0")?;
            check(of("friction"), friction, friction >= 0.0, "≥ 0")?;
            let is_end = side == 0 || side + 1 == count;
            let conflict = |reason| {
                Err(SceneError::Conflict {
                    what: what(side),
                    reason,
                })
            };
            let whole = is_end || turns.fract() == 0.0;
            check(of("turns"), turns, whole, "whole: the path gives the rest")?;
            if is_end && friction > 0.0 {
                return conflict(
                    "is a drum, from which the cable does not slip: leave its friction out",
                );
            }
            if is_end && sheave.lay.is_off() {
                return conflict("is a drum, which the cable cannot leave: let it lie on it");
            }
            if let Lay::On { arriving, leaving } = sheave.lay {
                let angles = [arriving, leaving];
                let bad = angles.into_iter().find(|angle| !angle.is_finite());
                check(of("angle"), bad.unwrap_or(0.0), true, "a number")?;
            }
            if !is_end && sheave.shared {
                return conflict("is shared with another part: only the end of a part can be");
            }
        }
        let (wound, length) = (self.wound(), self.length);
        let needs = "more than what lies on its drums, turns × 2π × radius (m)";
        check(format!("{of}: length"), length, wound < length, needs)?;
        // A path that has begun goes on from the state that it is in.
        let fault = self.fault(bodies, t).filter(|_| self.is_new());
        let fault = fault.or_else(|| Some((self.passed_by(bodies, t)?, PASSED_BY)));
        fault.map_or(Ok(()), |(side, reason)| {
            Err(SceneError::Conflict {
                what: what(side),
                reason,
            })
        })
    }

    /// The first new inner sheave that the path bends away from.
    fn passed_by(&self, bodies: &Bodies, t: f64) -> Option<usize> {
        let resolved = self.frames.iter().map(|f| f.resolve(bodies, t));
        let (mut found, last) = (None, self.sheaves.len().saturating_sub(1));
        sheave::follow(
            resolved,
            |side| self.sheaves[side],
            |side, _, _, [arriving, leaving]| {
                let is_new = |s: &Sheave| s.lay == Lay::New && s.turns < 1.0;
                let inner =
                    side > 0 && side < last && self.sheaves[side].as_ref().is_some_and(is_new);
                if inner && leaving - arriving > TAU - sheave::LANDING {
                    found = found.or(Some(side));
                }
            },
        );
        found
    }

    fn fault(&self, bodies: &Bodies, t: f64) -> Option<(usize, &'static str)> {
        let resolved = self.frames.iter().map(|f| f.resolve(bodies, t));
        sheave::fault(resolved, |side| self.sheaves[side])
    }

    /// The largest angle between a span and the plane of a sheave where it ends \[rad], at time `t` (s), and the number of that
    /// sheave's side from 0; `None` without sheaves.
    #[must_use]
    pub fn fleet_angle(&self, bodies: &Bodies, t: f64) -> Option<(usize, f64)> {
        let resolved = self.frames.iter().map(|f| f.resolve(bodies, t));
        sheave::steepest(resolved, |side| self.sheaves.get(side).copied().flatten())
    }

    /// Why it has no way over its sheaves, where the state is finite.
    pub(crate) fn lost(&self, bodies: &Bodies, t: f64) -> Option<&'static str> {
        let point = |f: &Frame| f.resolve(bodies, t).point();
        if self.sheaves.is_empty()
            || !self
                .frames
                .iter()
                .all(|f| point(f).iter().all(|x| x.is_finite()))
        {
            return None;
        }
        let empty = "has run off its drum: put more turns on it, or stop before";
        Some(self.fault(bodies, t).map_or(empty, |(_, reason)| reason))
    }

    fn evaluate_over_sheaves(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let (mut next, mut blocks) = (0, 0);
        let mut write = |side: usize, pull: &Pull, lever: Vector3<f64>| {
            if let Some(block) = rows.block_of(side, &self.frames[side], &mut blocks) {
                rows.pull(block, 0, [&pull.force, &pull.torque], lever);
            }
        };
        let resolved = self.frames.iter().map(|f| f.resolve(bodies, t));
        let total = sheave::follow(
            resolved,
            |side| self.sheaves[side],
            |side, wheel, pull, _| {
                for passed in next..side {
                    write(passed, &Pull::default(), Vector3::zeros());
                }
                write(side, &pull, wheel.arm());
                next = side + 1;
            },
        );
        rows.phi[0] = total - self.length_at(t);
    }

    /// Takes the angles at which the cable touches its sheaves, and whether it does, from the state at time `t` (s).
    /// Whether its row is evaluated otherwise after that: angles alone change nothing, for each state has its own.
    pub(crate) fn update_winding(&mut self, bodies: &Bodies, t: f64) -> bool {
        if self.sheaves.is_empty() {
            return false;
        }
        // The compliance is that of what is off the ends' drums, the cuts of parts move.
        let ends = [self.sheaves.first(), self.sheaves.last()];
        let changed = Cell::new(ends.into_iter().flatten().any(Option::is_some));
        let inner = 1..self.sheaves.len() - 1;
        let sheaves = Cell::from_mut(&mut self.sheaves[..]).as_slice_of_cells();
        let set = |side: usize, lay: Lay| {
            let sheave = sheaves[side].get();
            let is_on = |lay: Lay| matches!(lay, Lay::On { .. });
            let other = sheave.is_some_and(|sheave| is_on(sheave.lay) != is_on(lay));
            changed.set(changed.get() || other);
            sheaves[side].set(sheave.map(|sheave| Sheave { lay, ..sheave }));
        };
        let resolved = self.frames.iter().map(|f| f.resolve(bodies, t));
        let on = |side, _: &Wheel, _, [arriving, leaving]: [f64; 2]| {
            let has_left = inner.contains(&side) && leaving < arriving;
            // What a state that is not finite left counts for nothing.
            if (leaving - arriving).is_finite() {
                let on = Lay::On { arriving, leaving };
                let off = Lay::Off { clear: true };
                set(side, if has_left { off } else { on });
            }
        };
        sheave::follow(resolved, |side| sheaves[side].get(), on);
        let is_off = |side: &usize| sheaves[*side].get().is_some_and(|s| s.lay.is_off());
        for here in inner.clone().filter(is_off) {
            let before = (0..here).rev().find(|side| !is_off(side));
            let after = (here + 1..sheaves.len()).find(|side| !is_off(side));
            let (Some(before), Some(after)) = (before, after) else {
                continue;
            };
            let [before, wheel, after] = [before, here, after].map(|side| {
                let radius = sheaves[side].get().map_or(0.0, |s| s.radius);
                Wheel::new(&self.frames[side].resolve(bodies, t), radius)
            });
            if let Some(Lay::Off { clear }) = sheaves[here].get().map(|s| s.lay) {
                set(here, Sheave::passed(clear, [&before, &wheel, &after]));
            }
        }
        changed.get()
    }
}

fn angle(end: Option<&Option<Sheave>>, of: fn(Lay) -> Option<f64>) -> f64 {
    let lay = end.and_then(|sheave| of((*sheave)?.lay));
    lay.unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::testing::{BAR, LAW, Poses};
    use crate::constraint::{Constraint, RowKind};
    use crate::{Body, Linearized, Motion, Scene, Side};

    /// A cable from the world through bodies and back to a world point that moves, attached off the centres.
    fn scene(seed: u64) -> Scene {
        let mut poses = Poses::new(seed);
        let mut scene = Scene::new("reeved");
        let motion = Motion::Smooth {
            displacement: Vector3::new(0.3, -0.2, 0.1),
            start: 0.0,
            duration: 1.0,
        };
        let mut frames = vec![Frame::world(poses.vector())];
        for name in ["a", "b", "c"] {
            let body = Body::sphere(1.0, 1.0).at(poses.vector() * 3.0);
            let index = scene.add_body(name, body.turned(poses.rotation()));
            frames.push(Frame::body(index, poses.vector()));
        }
        // Twice through the first body.
        frames.push(Frame::body(0, poses.vector()));
        frames.push(Frame::world(poses.vector()).moving(motion));
        let cable = MasslessCable::new(frames, 5.0, LAW);
        scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
        scene
    }

    #[test]
    fn jacobian_at_random_poses() {
        let mut worst = 0.0_f64;
        for seed in 1..=20 {
            let error = crate::check_jacobian(&scene(seed), 0).max;
            assert!(error <= BAR, "{error:e}");
            worst = worst.max(error);
        }
        println!("massless cable {worst:.1e}");
    }

    #[test]
    fn violation_is_the_excess_length_and_the_rate_of_a_driven_end() {
        let scene = scene(4);
        let points: Vec<_> = scene.constraints[0]
            .frames()
            .iter()
            .map(|f| f.resolve(&scene.bodies, 0.3).point())
            .collect();
        let total: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let mut lin = Linearized::new(&scene);
        lin.update(&scene, 0.3);
        assert!((lin.phi[0] - (total - 5.0)).abs() < 1e-13);
        assert_eq!(scene.constraints[0].row(0), (RowKind::Length, LAW));
        let mut after = lin.clone();
        after.update(&scene, 0.5);
        lin.drive(&scene, 0.3, 0.5);
        assert!((0.2 * lin.phi_t[0] - (after.phi[0] - lin.phi[0])).abs() < 1e-15);
        assert!(lin.phi_t[0].abs() > 0.01);
    }

    #[test]
    fn tension_is_the_same_in_all_spans() {
        // A point on a cable between two others is pulled along the bisector: n₂ − n₁.
        let mut scene = Scene::new("sheave");
        scene.add_body("sheave", Body::particle(1.0).at(-Vector3::z()));
        let at = |x| Frame::world(Vector3::new(x, 0.0, 0.0));
        let frames = vec![at(-1.0), Frame::body(0, Vector3::zeros()), at(1.0)];
        let cable = MasslessCable::new(frames, 2.0, RowLaw::RIGID);
        scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
        let mut lin = Linearized::new(&scene);
        lin.update(&scene, 0.0);
        let half = 0.5_f64.sqrt();
        assert!((lin.block(0)[2] + 2.0 * half).abs() < 1e-15, "{lin:?}");
        assert!(lin.block(0)[0].abs() < 1e-15);
        assert!((lin.phi[0] - (2.0 / half - 2.0)).abs() < 1e-15);
    }

    #[test]
    fn a_winch_changes_length_and_compliance_within_its_range() {
        let mut cable = MasslessCable {
            winch: Some(Winch {
                speed: -0.5,
                force_limit: 100.0,
                brake_limit: 300.0,
                shortest: 1.0,
                longest: 4.0,
                ..Winch::new()
            }),
            ..MasslessCable::new(Vec::new(), 2.0, RowLaw::new(1e-3, 0.0))
        };
        assert_eq!((cable.length_at(0.0), cable.length_at(1.0)), (2.0, 1.5));
        assert_eq!(
            (cable.length_at(9.0), cable.compliance_at(1.0)),
            (1.0, 0.75e-3)
        );
        assert_eq!(cable.bounds_at(0.0), (-100.0, 0.0));
        cable.rebase(1.0);
        assert_eq!((cable.length, cable.law.compliance), (1.5, 0.75e-3));
        let set = |cable: &mut MasslessCable, change: &dyn Fn(&mut Winch)| {
            if let Some(winch) = &mut cable.winch {
                change(winch);
            }
        };
        set(&mut cable, &|w| w.brake = true);
        assert_eq!(
            (cable.length_at(3.0), cable.bounds_at(3.0).0),
            (1.5, -300.0)
        );
        // Stretched by 0.9 m it pulls with 1200 N: the brake slips to 300 N.
        let paid = cable.settle(0.9, 3.0);
        assert!((cable.length - 1.5 - paid).abs() < 1e-15);
        let excess = 2.4 - cable.length;
        assert!((excess / cable.law.compliance - 300.0).abs() < 1e-10);
        // What the brake holds does not slip.
        assert_eq!(cable.settle(0.5 * excess, 3.0), 0.0);
        // The drum is empty at 4 m, and holds any tension then.
        assert!(cable.settle(50.0, 3.0) > 0.0);
        assert_eq!(
            (cable.length, cable.bounds_at(3.0).0),
            (4.0, f64::NEG_INFINITY)
        );
    }

    #[test]
    fn a_winch_rests_until_its_time() {
        let cable = MasslessCable {
            winch: Some(Winch {
                speed: -0.5,
                since: 5.0,
                ..Winch::new()
            }),
            ..MasslessCable::new(Vec::new(), 10.0, RowLaw::RIGID)
        };
        let lengths = [-1.0, 0.0, 5.0, 6.0].map(|t| cable.length_at(t));
        assert_eq!(lengths, [10.0, 10.0, 10.0, 9.5]);
    }

    #[test]
    fn a_winch_that_a_run_begins_with_was_running_unless_at_its_stop() {
        let winch = |speed, shortest| Winch {
            speed,
            shortest,
            ..Winch::new()
        };
        for (winch, before) in [
            (winch(-0.5, 1.0), 10.5),
            (winch(0.5, 1.0), 9.5),
            (winch(-0.5, 10.0), 10.0),
        ] {
            let cable = MasslessCable {
                winch: Some(winch),
                ..MasslessCable::new(Vec::new(), 10.0, RowLaw::RIGID)
            };
            assert_eq!(
                (cable.length_at(-1.0), cable.length_at(0.0)),
                (before, 10.0)
            );
        }
    }

    #[test]
    fn a_running_winch_is_a_rate() {
        let mut scene = scene(4);
        if let Constraint::MasslessCable(cable) = &mut scene.constraints[0] {
            cable.winch = Some(Winch {
                speed: 0.7,
                ..Winch::new()
            });
            cable.frames.pop();
        }
        let mut lin = Linearized::new(&scene);
        lin.update(&scene, 0.0);
        lin.drive(&scene, 0.0, 0.1);
        assert!((lin.phi_t[0] + 0.7).abs() < 1e-14, "{}", lin.phi_t[0]);
        let mut later = lin.clone();
        later.update(&scene, 0.1);
        assert!((later.phi[0] - lin.phi[0] + 0.07).abs() < 1e-14);
        assert!((later.compliance[0] / lin.compliance[0] - 5.07 / 5.0).abs() < 1e-15);
        assert!(crate::check_jacobian(&scene, 0).max < BAR);
    }

    #[test]
    fn spans_of_length_zero_are_finite() {
        let mut scene = scene(9);
        for frame in scene.constraints[0].frames_mut() {
            frame.side = Side::World(Motion::Fixed);
            frame.point = Vector3::zeros();
        }
        scene.constraints[0].frames_mut()[2] = Frame::body(1, Vector3::zeros());
        scene.bodies.position[1] = Vector3::zeros();
        let mut lin = Linearized::new(&scene);
        lin.update(&scene, 0.0);
        assert_eq!(lin.phi, [-5.0]);
        assert!(lin.jacobian.iter().all(|j| j.is_finite()));
    }
}
