//! Rows that lead bodies along a curve, in divided steps.
//!
//! A row φ of bodies that move freely has φ'' = κ, v²/L on a circle. A whole step has one direction of the row and leaves a gap
//! that it does not feel: with the weights of its scheme, from Δφ = 0 in the mean,
//!
//! ```text
//! φ + Δt (p r⁺ − q r + s r⁻) = 0    with r = r⁻ = −r⁺ = κ Δt/2:    φ = ½ (p + q − s) κ Δt²
//! ```
//!
//! Parts would take this drift for stretch, or take it back at once, and a rope that swings would have T + 12 m v²/L in the first
//! of them. Of n parts each feels 1/n² of it, its own, so that the force along the curve goes on from the first part to the step
//! after the last.
//!
//! Where a blow throws a body back within a step, the mean direction of the row is neither that of the way there nor that of the
//! way back: what the curve changes the rate of approach by goes into the blow, or out of it. Such a step is divided.

use super::{LEAST, Step};
use crate::activation::STIFF;
use crate::active_set::response_of_row;
use crate::contact::ContactPoint;
use crate::contact::rebound::slowest;
use crate::system_data::SystemData;
use nalgebra::Vector3;

/// Least change of a rate of approach by curves in a step, over the rate, that divides a step in which shapes are thrown back.
const STRAY: f64 = 2e-3;

impl Step {
    /// κ Δt² of the curve φ'' = κ that free bodies give the first `count` rows of constraint `c` at the present state, Δt being `dt`
    /// (s); 0 where a path over sheaves ends \[m].
    fn curves(&self, c: usize, dt: f64) -> ([f64; 3], usize) {
        let at = |dt| self.scene.constraints[c].gap_ahead(&self.scene.bodies, self.time, dt);
        let ((ahead, count), (behind, _)) = (at(dt), at(-dt));
        let phi = &self.system_data.rows.phi[self.system_data.rows.row_range(c)];
        let mut curves = [0.0; 3];
        for (i, curve) in curves.iter_mut().enumerate().take(count) {
            *curve = ahead[i] + behind[i] - 2.0 * phi[i];
        }
        match curves.iter().all(|curve| curve.is_finite()) {
            true => (curves, count),
            false => ([0.0; 3], 0),
        }
    }

    /// Largest change of the rate of bounded row `k` in a step that its curve makes \[m/s].
    pub(super) fn curving(&self, k: usize) -> f64 {
        let dt = self.substep();
        let ([first, ..], _) = self.curves(self.system_data.rows.bounds[k].constraint, dt);
        first.abs() / dt
    }

    /// The drift ½ (p + q − s) κ Δt² of curves stays over the `parts` of a divided step, each of which leaves 1/n² of it.
    pub(super) fn hold_drift_of_curves(&mut self, parts: u32) {
        let whole = self.substep() * f64::from(parts);
        let weights = self.options.scheme.weights();
        let weight = 0.5 * (weights.next + weights.now - weights.before);
        let own = f64::from(parts).powi(-2);
        for c in 0..self.scene.constraints.len() {
            let rows = &self.system_data.rows;
            let range = rows.row_range(c);
            let bounds = rows.bounds.partition_point(|bound| bound.row < range.start);
            let is_own = rows
                .bounds
                .get(bounds)
                .is_some_and(|b| range.contains(&b.row));
            // The gap of an elastic row that was struck is a swing, whatever its curve.
            let is_hit = is_own && self.guarded.division.hit[bounds];
            if is_hit && rows.compliance[range.start] > 0.0 {
                continue;
            }
            let (curves, count) = self.curves(c, whole);
            let curves = curves.map(|curve| weight * curve);
            self.activation
                .hold_drift(range.start, &curves[..count], own);
        }
    }

    /// True if shapes of the step just taken are thrown back, on a body that rows lead along a curve: a whole step has one direction of
    /// these rows for both ways, and what they change the rate of approach by is more than [`STRAY`] of it.
    pub(super) fn thrown_on_curves(&mut self) -> bool {
        let can_be = self.guarded.division.parts == 1 && self.contacts.rebound_is_due();
        if !can_be || self.bends() || !self.slip.is_empty() {
            return false;
        }
        self.swap_velocities();
        let least = LEAST * slowest(&self.scene, self.substep());
        let strays = |touch: &ContactPoint| {
            let approach = -touch.normal_rate(|i| self.scene.bodies.rates(i));
            approach > least && self.curve_along(touch) > STRAY * approach
        };
        let strays = self.contacts.thrown_back().any(strays);
        self.swap_velocities();
        strays
    }

    /// The velocities that the step has begun with, and those of the bodies, change places.
    fn swap_velocities(&mut self) {
        let (bodies, v) = (&mut self.scene.bodies, &mut self.system_data.v);
        for i in 0..bodies.len() {
            let rates = bodies.rates(i);
            let [x, y, z, p, q, r] = v.get(i);
            bodies.velocity[i] = Vector3::new(x, y, z);
            bodies.angular_velocity[i] = Vector3::new(p, q, r);
            v.set(i, rates);
        }
    }

    /// Change of the rate of approach of `touch` in a step that the curves of rows make, and as far as its friction acts, that across
    /// it \[m/s].
    fn curve_along(&self, touch: &ContactPoint) -> f64 {
        let [n, s, t] = touch.rates(|i| self.kick_of_curves(i));
        n.abs() + touch.found.surface.friction * s.hypot(t)
    }

    /// Change of the velocities of `body` in a step by which its rigid rows follow their curves: those of lengths each alone, the three
    /// of a joint's gap by the body's way \[m/s, rad/s].
    fn kick_of_curves(&self, body: usize) -> [f64; 6] {
        let (SystemData { rows, inertia, .. }, dt) = (&self.system_data, self.substep());
        let mut kick = [0.0; 6];
        if !self.scene.bodies.is_dynamic(body) {
            return kick;
        }
        let slots = rows.slots.iter().enumerate();
        for (s, slot) in slots.filter(|(_, slot)| slot.body == body) {
            let (curves, count) = self.curves(slot.constraint, dt);
            let block = rows.block(s);
            let own = rows.row_range(slot.constraint).zip(block.rows());
            for ((r, j), curve) in own.zip(curves).take(count) {
                let response = response_of_row(&self.system_data, slot.constraint, r);
                if dt * dt * response <= STIFF * STIFF * rows.compliance[r] {
                    continue;
                }
                let mut along = [0.0; 6];
                if count == 1 {
                    inertia.apply_inverse(body, j, &mut along);
                    along = along.map(|v| v / response);
                } else {
                    along[..3].copy_from_slice(&j[..3]);
                }
                let rate = curve / dt;
                kick.iter_mut()
                    .zip(along)
                    .for_each(|(kick, v)| *kick -= rate * v);
            }
        }
        kick
    }
}
