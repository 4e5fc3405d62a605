//! Path of a [`MasslessCable`] over its sheaves: its length, where it touches them, when it leaves
//! and meets them.

use std::cell::Cell;
use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::MasslessCable;
use crate::body::Bodies;
use crate::constraint::Rows;
use crate::constraint::sheave::{self, Pull, Sheave, SheaveContact, Wheel};
use crate::error::{SceneError, check, check_length, refuse};
use crate::frame::Frame;

/// Error for a sheave that the cable does not bend around.
const PASSED_BY: &str = "does not touch the cable, which would bend the other way there: reverse its axis, move it, or let the \
                         cable pass by (`off = true`)";

/// An end of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    First,
    Last,
}

impl MasslessCable {
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

    /// True if its place on some sheave is not known yet.
    pub(crate) fn is_new(&self) -> bool {
        self.sheaves
            .iter()
            .flatten()
            .any(|s| s.contact == SheaveContact::New)
    }

    /// True if it is a part of a cable that goes on as another constraint.
    #[must_use]
    pub fn is_part(&self) -> bool {
        let ends = [self.sheaves.first(), self.sheaves.last()];
        ends.into_iter().flatten().flatten().any(|s| s.shared)
    }

    /// Angle at which it leaves its first sheave \[rad]; NaN where not known.
    pub(crate) fn first_leaving(&self) -> f64 {
        angle(self.sheaves.first(), SheaveContact::leaving)
    }

    pub(crate) fn first_arriving(&self) -> f64 {
        angle(self.sheaves.first(), SheaveContact::arriving)
    }

    pub(crate) fn last_arriving(&self) -> f64 {
        angle(self.sheaves.last(), SheaveContact::arriving)
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
        let SheaveContact::On { arriving, leaving } = &mut sheave.contact else {
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
        let what = |side: usize| sheave::side_name(of, side);
        check_length("sheaves of a massless cable", count, sides)?;
        for (side, sheave) in self.sheaves.iter().enumerate() {
            let Some(sheave) = sheave else { continue };
            let of = |quantity: &str| format!("{}: {quantity}", what(side));
            let needs = "> 0 m; leave the sheave out for a point";
            check(of("radius"), sheave.radius, sheave.radius > 0.0, needs)?;
            let (turns, friction) = (sheave.turns, sheave.friction);
            check(of("turns"), turns, turns >= 0.0, "≥ 0")?;
            check(of("friction"), friction, friction >= 0.0, "≥ 0")?;
            let is_end = side == 0 || side + 1 == count;
            let whole = is_end || turns.fract() == 0.0;
            check(of("turns"), turns, whole, "whole: the path gives the rest")?;
            if is_end && friction > 0.0 {
                let reason =
                    "is a drum, from which the cable does not slip: leave its friction out";
                return refuse(what(side), reason);
            }
            if is_end && sheave.contact.is_off() {
                let reason = "is a drum, which the cable cannot leave: let it lie on it";
                return refuse(what(side), reason);
            }
            if let SheaveContact::On { arriving, leaving } = sheave.contact {
                let angles = [arriving, leaving];
                let bad = angles.into_iter().find(|angle| !angle.is_finite());
                check(of("angle"), bad.unwrap_or(0.0), true, "a number")?;
            }
            if !is_end && sheave.shared {
                let reason = "is shared with another part: only the end of a part can be";
                return refuse(what(side), reason);
            }
        }
        let (wound, length) = (self.wound(), self.length);
        let needs = "more than what lies on its drums, turns × 2π × radius (m)";
        check(format!("{of}: length"), length, wound < length, needs)?;
        // A path that has begun goes on from the state that it is in.
        let fault = self.fault(bodies, t).filter(|_| self.is_new());
        let fault = fault.or_else(|| Some((self.passed_by(bodies, t)?, PASSED_BY)));
        fault.map_or(Ok(()), |(side, reason)| refuse(what(side), reason))
    }

    /// The first new inner sheave that the path bends away from.
    fn passed_by(&self, bodies: &Bodies, t: f64) -> Option<usize> {
        let resolved = self.frames.iter().map(|f| f.resolve(bodies, t));
        let (mut found, last) = (None, self.sheaves.len().saturating_sub(1));
        let pass = |side: usize, _: &Wheel, _, [arriving, leaving]: [f64; 2]| {
            let is_new = |s: Sheave| s.contact == SheaveContact::New && s.turns < 1.0;
            let inner = side > 0 && side < last && self.sheaves[side].is_some_and(is_new);
            if inner && leaving - arriving > TAU - sheave::LANDING {
                found = found.or(Some(side));
            }
        };
        sheave::follow(resolved, |side| self.sheaves[side], pass);
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

    pub(super) fn evaluate_over_sheaves(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
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

    /// Λ at time `t` + `dt` (s) if its bodies go on at their velocities at `t` \[m].
    pub(crate) fn path_ahead(&self, bodies: &Bodies, t: f64, dt: f64) -> f64 {
        let resolved = self.frames.iter().map(|f| f.resolve_ahead(bodies, t, dt));
        if !self.sheaves.is_empty() {
            return sheave::follow(resolved, |side| self.sheaves[side], |_, _, _, _| ());
        }
        let mut points = resolved.map(|side| side.point());
        let mut last = points.next().unwrap_or_default();
        let spans = points.map(|point| (std::mem::replace(&mut last, point) - point).norm());
        spans.sum()
    }

    /// Takes the angles at which the cable touches its sheaves, and which of them it touches, from
    /// the state at time `t` (s). Returns true if its row changes by that; angles alone change
    /// nothing, since each state has its own.
    pub(crate) fn update_winding(&mut self, bodies: &Bodies, t: f64) -> bool {
        if self.sheaves.is_empty() {
            return false;
        }
        // The compliance is that of the rope off the drums at the ends; the cuts of parts move.
        let ends = [self.sheaves.first(), self.sheaves.last()];
        let changed = Cell::new(ends.into_iter().flatten().any(Option::is_some));
        let inner = 1..self.sheaves.len() - 1;
        let sheaves = Cell::from_mut(&mut self.sheaves[..]).as_slice_of_cells();
        let set = |side: usize, contact: SheaveContact| {
            let sheave = sheaves[side].get();
            let is_on = |contact: SheaveContact| matches!(contact, SheaveContact::On { .. });
            let other = sheave.is_some_and(|sheave| is_on(sheave.contact) != is_on(contact));
            changed.set(changed.get() || other);
            sheaves[side].set(sheave.map(|sheave| Sheave { contact, ..sheave }));
        };
        let resolved = self.frames.iter().map(|f| f.resolve(bodies, t));
        let on = |side, _: &Wheel, _, [arriving, leaving]: [f64; 2]| {
            let has_left = inner.contains(&side) && leaving < arriving;
            // Angles of a state that is not finite count for nothing.
            if (leaving - arriving).is_finite() {
                let on = SheaveContact::On { arriving, leaving };
                let off = SheaveContact::Off { clear: true };
                set(side, if has_left { off } else { on });
            }
        };
        sheave::follow(resolved, |side| sheaves[side].get(), on);
        let is_off = |side: &usize| sheaves[*side].get().is_some_and(|s| s.contact.is_off());
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
            if let Some(SheaveContact::Off { clear }) = sheaves[here].get().map(|s| s.contact) {
                set(here, Sheave::passed(clear, [&before, &wheel, &after]));
            }
        }
        changed.get()
    }
}

fn angle(end: Option<&Option<Sheave>>, of: fn(SheaveContact) -> Option<f64>) -> f64 {
    let contact = end.and_then(|sheave| of((*sheave)?.contact));
    contact.unwrap_or(f64::NAN)
}
