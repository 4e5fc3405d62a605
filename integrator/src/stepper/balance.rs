//! The balance of energy: what a motion has more than it began with, than its drives have put in and than contacts have
//! done to undo penetrations.
//!
//! With elastic energy ½ ε λ² and ε λ = −φ, the energy of the dynamic bodies changes by
//!
//! ```text
//! dE/dt = F·v + T·ω of external loads  −  λᵀ (J_d v_d + ∂φ/∂t)  −  fᵀ H_d v_d of contacts  +  λ_b J_b v of rows at their
//!         limits of force
//! ```
//!
//! v_d are the velocities of driven bodies, f the forces of contacts in their rows H; ∂φ/∂t is that of moved points, motors
//! that hold speeds (−target) and winches (their speed). What a row gives way by at its limit is the work of a motor, or of a
//! drum that slips; a cable keeps the stretch of its limit. Damping takes away. Sums over the steps are trapezoidal: λ and f change the velocities at the
//! beginning of a step, between those of the steps before and after it, and in the guard's implicit ones at the end; blows
//! come after the step. The energy of the rope that a drum winds up, half its strain of the winch's work, is left out.
//! Healthy motions are off by less than 4·10⁻² of their own energy in shocks, and elsewhere by less than 10⁻³, besides
//! the weight's work over the gap of what rolls: a step along the tangent leaves a round body by ½ (v Δt)²/R.
//!
//! **Contacts.** The impulses p of a step turn the rates u⁻ into u⁺ = u⁻ + W p and do the work ½ p·(u⁻ + u⁺) = p·u⁺ − ½ p·W p.
//! Friction has p·u⁺ ≤ 0, and so has a normal whose gap closes. One that undoes a penetration has u_N⁺ = −b − σ p > 0
//! ([`crate::contact`]), at most the speed of recovery: what begins inside another shape is pushed out of it, and p_N u_N⁺ is
//! the work of recovery. It counts over the way that the deepest penetration of the start has to go, no further: what sinks
//! in later loses by that what it gets back. The compliance of a contact stores ½ ε f² or, where less, ½ φ²/ε.

use crate::active_set::RowState;
use crate::contact::Touch;
use crate::contact::rebound::slowest;
use crate::stepper::contact_solve::works;
use crate::stepper::{Stage, Stepper};
use crate::{Energy, StepError};
use nalgebra::Vector3;
use taut_model::Mobility;
use taut_model::linearized::{RowBounds, dot};

/// Energy and work since the first step \[J], at the beginning of the last sub-step as [`Energy`].
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EnergyBalance {
    /// Kinetic, gravitational and elastic energy, less that of the start.
    pub gained: f64,
    /// Work of driven bodies, by constraints and contacts, of moved points, motors, winches and external loads.
    pub work: f64,
    /// Work of contacts that undo the penetrations of the start, ≥ 0.
    pub recovery: f64,
    /// Scale of a gain: the larger of the largest kinetic energy, without what came from nowhere, and the largest work so far;
    /// at least 10⁻³ of the elastic energy and of the scene's weight times its extent.
    pub scale: f64,
    /// Energy from nowhere over the scale, (gained − work − recovery)/scale, if it lasts: the least
    /// of the last eight steps, so that a blow of a few steps does not count. A change of the scene begins the balance with
    /// the least of three. 0 without a gain, NaN if the energy is NaN.
    pub excess: f64,
}

/// Steps that an excess has to last.
const LASTING: usize = 8;

/// Steps that it has to last for the next balance to begin with it.
const OWED: usize = 3;

/// Least scale, over the elastic energy and the weight times the extent: motions of less are not judged.
const LEAST: f64 = 1e-3;

/// Speed of motions that are not judged either \[m/s].
const STILL: f64 = 1e-9;

/// Running sums of the balance.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Account {
    /// Energy before the first step, once there was one.
    start: Option<f64>,
    /// Work up to the beginning of the last sub-step, and the work in it without that of the next
    /// forces.
    work: f64,
    pending: f64,
    /// Work of recovery, split likewise.
    #[cfg_attr(feature = "serde", serde(default))]
    recovery: [f64; 2],
    /// Rest of the deepest penetration of the start \[m].
    #[cfg_attr(feature = "serde", serde(default))]
    overlap: f64,
    /// Half the drives' rates in the last sub-step \[m/s, rad/s], at which the next impulses act,
    /// and the last forces λ, one a row.
    open: Vec<f64>,
    lambda: Vec<f64>,
    /// Excess in the last steps \[J], and that of the balance before.
    recent: [f64; LASTING],
    #[cfg_attr(feature = "serde", serde(default))]
    owed: f64,
    /// Largest kinetic energy without excess, and largest work \[J].
    scale: f64,
    /// Weight times extent, and as much as a motion at [`STILL`] needs \[J].
    potential: f64,
}

impl Account {
    /// Numbers that are finite in a sound account, and the vectors with one number a row, which are
    /// empty before the first step.
    pub(crate) fn numbers(&self) -> (impl Iterator<Item = &f64>, [&[f64]; 2]) {
        let sums = [
            &self.work,
            &self.pending,
            &self.owed,
            &self.overlap,
            &self.scale,
            &self.potential,
        ];
        (
            sums.into_iter().chain(&self.recovery).chain(&self.start),
            [&self.open, &self.lambda],
        )
    }

    /// What a changed scene's balance begins with.
    pub(crate) fn left(&self) -> Self {
        let last = &self.recent[LASTING - OWED..];
        Self {
            recent: self.recent,
            owed: last.iter().copied().fold(f64::INFINITY, f64::min),
            ..Self::default()
        }
    }

    /// A new balance of so many rows, whose steps allocate nothing.
    pub(crate) fn begin(&mut self, rows: usize) {
        (self.open, self.lambda) = (vec![0.0; rows], vec![0.0; rows]);
    }

    /// Becomes a copy of `other`. Allocates only where this one has fewer rows.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        let [mut open, mut lambda] = [&mut self.open, &mut self.lambda].map(std::mem::take);
        open.clone_from(&other.open);
        lambda.clone_from(&other.lambda);
        *self = Self {
            open,
            lambda,
            ..*other
        };
    }

    /// The next step begins a new balance.
    pub(crate) fn close(&mut self) {
        let [mut open, mut lambda] = [&mut self.open, &mut self.lambda].map(std::mem::take);
        open.fill(0.0);
        lambda.fill(0.0);
        *self = Self {
            open,
            lambda,
            ..Self::default()
        };
    }
}

impl Stepper {
    /// A sub-step of `dt` is done, whose forces belong to its beginning or, where it is `implicit`, to its end: its work.
    pub(crate) fn account(&mut self, dt: f64, implicit: bool) {
        if self.options.energy_tolerance.is_none() {
            return;
        }
        let [_, scratch] = &mut self.in_rows;
        let mut moved = std::mem::take(scratch);
        self.drives(dt, &mut moved);
        let loads = self.work_of_loads(dt);
        let by_contacts = 0.5 * self.work_by_contacts();
        let recovery = 0.5 * self.work_of_recovery(dt);
        let account = &mut self.account;
        account.open.resize(self.mu.len(), 0.0);
        account.lambda.resize(self.mu.len(), 0.0);
        account.work += account.pending + by_contacts;
        account.pending = loads + by_contacts;
        account.recovery[0] += account.recovery[1] + recovery;
        account.recovery[1] = recovery;
        let last = account.open.iter_mut().zip(&mut account.lambda);
        for ((mu, moved), (open, lambda)) in self.mu.iter().zip(&moved).zip(last) {
            // An impulse acts at the mean of the rates before it and after it, however long their steps are; the force of an
            // implicit step over half its motion, and the force before it over the other half.
            let (force, half) = (mu / dt, 0.5 * moved);
            account.work -= *open * mu;
            if implicit {
                account.pending -= half * (force + *lambda);
            } else {
                account.pending -= half * force;
            }
            (*open, *lambda) = (if implicit { 0.0 } else { half / dt }, force);
        }
        if implicit {
            account.work += std::mem::take(&mut account.pending);
            account.recovery[0] += std::mem::take(&mut account.recovery[1]);
        }
        self.in_rows[1] = moved;
    }

    /// The present impulses bring the velocities to their own time: the work of the half before it, as far as drives do some.
    pub(crate) fn account_up_to_now(&mut self) {
        for (open, mu) in self.account.open.iter_mut().zip(&self.mu[..]) {
            self.account.work -= std::mem::take(open) * mu;
        }
    }

    /// The contacts' impulses are those of a blow after the sub-step: its work.
    pub(crate) fn account_for_blow(&mut self) {
        if self.options.energy_tolerance.is_some() {
            self.account.pending += self.work_by_contacts();
        }
    }

    /// Where a balance begins with this step, the energy of the present motion, without what is elastic. The velocities of a
    /// step of the scheme stand half a sub-step before: they go on as they changed in it.
    pub(crate) fn motion_at_start(&self) -> Option<Energy> {
        if self.options.energy_tolerance.is_none() || self.account.start.is_some() {
            return None;
        }
        let mut kinetic = self.scene.kinetic_energy();
        if let Stage::Advanced {
            implicit: false, ..
        } = self.stage
        {
            // T(v + Δv/2) = T(v) + v·M Δv/2 + Δv·M Δv/8.
            let (linear, square) = works(&self.scene.bodies, &self.system_data.dv);
            kinetic += 0.5 * linear + 0.125 * square;
        }
        Some(Energy {
            kinetic,
            gravity: self.scene.potential_energy(),
            elastic: 0.0,
        })
    }

    /// Where a balance begins with this step, the energy at the beginning of a sub-step, with the elastic energy of the
    /// rows' gaps, and with the motion `given`, where that is not the present one. The multipliers of a drive that starts
    /// with a jump do not tell it: they hold the damper's force and look ahead.
    pub(crate) fn opening(&mut self, given: Option<Energy>) -> Option<Energy> {
        let motion = given.or_else(|| self.motion_at_start())?;
        let account = &mut self.account;
        (account.work, account.pending, account.recovery) = (0.0, 0.0, [0.0; 2]);
        Some(Energy {
            elastic: self.gap_energy(),
            ..motion
        })
    }

    /// Elastic energy ½ ε λ² of the forces λ = −φ/ε, within their bounds, at the present positions.
    fn gap_energy(&self) -> f64 {
        let rows = &self.system_data.rows;
        let energy = |r: usize, (lower, upper): (f64, f64)| match rows.compliance[r] {
            0.0 => 0.0,
            compliance => {
                let lambda = (-rows.phi[r] / compliance).max(lower).min(upper);
                0.5 * compliance * lambda * lambda
            }
        };
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        let all: f64 = (0..rows.rows()).map(|r| energy(r, free)).sum();
        let beyond = |b: &RowBounds| energy(b.row, free) - energy(b.row, (b.lower, b.upper));
        all - rows.bounds.iter().map(beyond).sum::<f64>()
    }

    /// The energy `told` of the last sub-step, with what rows and contacts store.
    fn in_account(&self, told: Energy) -> Energy {
        Energy {
            elastic: self.stored_energy() + self.stored_in_contacts(),
            ..told
        }
    }

    /// A balance begins with the sub-step just taken, which began with `opening` ([`opening`](Self::opening)).
    pub(crate) fn open_account(&mut self, opening: Energy) {
        let start = self
            .start_of(opening, self.in_account(self.energy()))
            .total();
        self.account.start = Some(start - std::mem::take(&mut self.account.owed));
        let still = 0.5 * self.scene.mass() * STILL * STILL;
        self.account.potential = self.weight_times_extent() + still / LEAST;
    }

    /// The balance after a step, where it is asked for.
    ///
    /// # Errors
    /// [`StepError::EnergyGain`] beyond the tolerance of the options, and where the energy is infinite or no number.
    pub(crate) fn weigh(&mut self) -> Result<(), StepError> {
        let (Some(tolerance), Some(start)) = (self.options.energy_tolerance, self.account.start)
        else {
            return Ok(());
        };
        let told = self.energy();
        let energy = self.in_account(told);
        let total = energy.total();
        let account = &mut self.account;
        let gained = total - start;
        let [recovery, _] = account.recovery;
        let excess = gained - account.work - recovery;
        let moved = (energy.kinetic - excess.max(0.0)).max(account.work.abs());
        account.scale = account.scale.max(moved);
        let least = LEAST * (account.potential + energy.elastic);
        let scale = account.scale.max(least);
        account.recent.rotate_left(1);
        account.recent[LASTING - 1] = if excess <= 0.0 { 0.0 } else { excess };
        // `f64::min` drops NaN: the balance reports such an excess at once.
        let lasting = account.recent.iter().copied().fold(f64::INFINITY, f64::min);
        // Without dynamic bodies there is no scale.
        let lasting = if lasting > 0.0 { lasting / scale } else { 0.0 };
        let balance = EnergyBalance {
            gained,
            work: account.work,
            recovery,
            scale,
            excess: if excess.is_nan() { excess } else { lasting },
        };
        self.tally.balance = Some(balance);
        // Energies without end are no motion's, lost ones neither.
        let excess = match told.total() {
            total if total.is_finite() => excess,
            total => total,
        };
        if excess.is_finite() && balance.excess <= tolerance {
            return Ok(());
        }
        Err(StepError::EnergyGain {
            excess,
            scale,
            time: self.time,
        })
    }

    /// The energy that a balance begins with, after the first sub-step of it, which began with `opening` and is accounted with
    /// `energy`. That is of the mean of the velocities before and after the sub-step, in which a blow is half over: one that
    /// begins with a blow begins with the motion before.
    fn start_of(&mut self, opening: Energy, energy: Energy) -> Energy {
        let contacts = self.stored_in_contacts();
        let implicit = matches!(self.stage, Stage::Advanced { implicit: true, .. });
        if !implicit && self.has_blow() {
            return Energy {
                elastic: opening.elastic + contacts,
                ..opening
            };
        }
        (self.account.work, self.account.recovery[0]) = (0.0, 0.0);
        let gaps = if implicit {
            self.gap_energy()
        } else {
            opening.elastic
        };
        Energy {
            elastic: gaps + contacts,
            ..energy
        }
    }

    /// True if shapes with an impulse closed faster than the slowest blow in the last sub-step.
    fn has_blow(&self) -> bool {
        let contacts = &self.contacts;
        let slowest = slowest(&self.scene, contacts.dt());
        let before = |touch: &Touch| touch.rates(|i| self.system_data.v.get(i))[0];
        let mut carry = contacts.touches.iter().filter(|t| t.impulse[0] > 0.0);
        carry.any(|touch| before(touch) < -slowest)
    }

    /// Elastic energy of the rows, at most ½ φ²/ε: damping adds to λ, but stores nothing.
    fn stored_energy(&self) -> f64 {
        let rows = &self.system_data.rows;
        let of_row = |(c, r): (usize, usize)| {
            let compliance = rows.compliance[r];
            if compliance == 0.0 {
                return 0.0;
            }
            let stored = self.stretch(c, r).powi(2).min(rows.phi[r].powi(2));
            0.5 * stored / compliance
        };
        let of_constraint = |c: usize| rows.row_range(c).map(move |r| of_row((c, r)));
        (0..rows.constraints()).flat_map(of_constraint).sum()
    }

    /// Elastic energy of the contacts, at most ½ φ²/ε of the penetrations that the sub-step began with \[J].
    fn stored_in_contacts(&self) -> f64 {
        let of = |touch: &Touch| {
            let (compliance, force) = (
                touch.found.surface.compliance,
                touch.impulse[0] / self.contacts.dt(),
            );
            let depth = touch.found.gap.min(0.0);
            0.5 * (compliance * force * force).min(depth * depth / compliance)
        };
        self.contacts.touches.iter().map(of).sum()
    }

    /// Work of driven bodies by the contacts' impulses \[J].
    fn work_by_contacts(&self) -> f64 {
        let bodies = &self.scene.bodies;
        let mut work = 0.0;
        for touch in &self.contacts.touches {
            for (k, p) in touch.impulse.iter().enumerate() {
                let driven = touch
                    .row(k)
                    .filter(|(i, _)| bodies.mobility[*i] == Mobility::Driven);
                work -= p * driven
                    .map(|(i, row)| dot(&row, &bodies.rates(i)))
                    .sum::<f64>();
            }
        }
        work
    }

    /// Work of the contacts' impulses in the last sub-step of `dt` that undo the penetrations of the start \[J].
    fn work_of_recovery(&mut self, dt: f64) -> f64 {
        let (account, touches) = (&mut self.account, &self.contacts.touches);
        let rate = |touch: &Touch| match touch.impulse[0] {
            p if p > 0.0 => (-touch.offset - touch.softness * p).max(0.0),
            _ => 0.0,
        };
        let (mut deepest, mut fastest, mut work) = (0.0_f64, 0.0_f64, 0.0);
        for touch in touches {
            deepest = deepest.max(-touch.found.gap);
            fastest = fastest.max(rate(touch));
            work += touch.impulse[0] * rate(touch);
        }
        account.overlap = match account.start {
            None => deepest,
            Some(_) => account.overlap.min(deepest),
        };
        let undone = account.overlap.min(dt * fastest);
        account.overlap -= undone;
        if undone > 0.0 {
            work * undone / (dt * fastest)
        } else {
            0.0
        }
    }

    /// Into `moved` by how much driven bodies and ∂φ/∂t have changed the rows in the last sub-step of `dt`: dt (J_d v_d + ∂φ/∂t).
    fn drives(&self, dt: f64, moved: &mut [f64]) {
        let (bodies, rows) = (&self.scene.bodies, &self.system_data.rows);
        for (moved, phi_t) in moved.iter_mut().zip(&rows.phi_t) {
            *moved = dt * phi_t;
        }
        for (s, slot) in rows.slots.iter().enumerate() {
            if bodies.mobility[slot.body] == Mobility::Driven {
                let velocity = bodies.rates(slot.body);
                let moved = &mut moved[rows.row_range(slot.constraint)];
                for (moved, j) in moved.iter_mut().zip(rows.block(s).rows()) {
                    *moved += dt * dot(j, &velocity);
                }
            }
        }
    }

    /// Work of external loads and of rows at their limits of force in the last sub-step of `dt` \[J].
    fn work_of_loads(&self, dt: f64) -> f64 {
        let (bodies, rows) = (&self.scene.bodies, &self.system_data.rows);
        let mut work = 0.0;
        let bounds = rows.bounds.iter().zip(self.active_set.places());
        for (k, (bound, place)) in bounds.enumerate() {
            let mu = self.mu[bound.row];
            if place == RowState::Inside || mu == 0.0 {
                continue;
            }
            if self.scene.constraints[bound.constraint].motor().is_none() {
                // The slip: the path at the end beyond the stretch at the limit, or at the beginning. Rates at the beginning
                // would miss the turn of the path.
                let force = mu / dt;
                let kept = (-rows.compliance[bound.row] * force).max(self.activation.begun(k));
                work += force * (rows.phi[bound.row] - kept);
                continue;
            }
            let first = rows.row_range(bound.constraint).start;
            for s in rows.slot_range(bound.constraint) {
                let body = rows.slots[s].body;
                let j = rows.block(s).rows()[bound.row - first];
                work += mu * dot(&j, &bodies.rates(body));
            }
            work += mu * rows.phi_t[bound.row];
        }
        for i in self.scene.dynamic_bodies() {
            work += dt
                * (bodies.force[i].dot(&bodies.velocity[i])
                    + bodies.torque[i].dot(&bodies.angular_velocity[i]));
        }
        work
    }

    /// Weight of the dynamic bodies \[N] times the longest way from one to another, of a lever arm, of a shape's end or of a fall
    /// of one step \[m].
    fn weight_times_extent(&self) -> f64 {
        let rows = &self.system_data.rows;
        let levers = (0..rows.slots.len()).map(|s| rows.lever(s).norm());
        let position = &self.scene.bodies.position;
        let first = position.first().copied().unwrap_or_else(Vector3::zeros);
        let ways = position.iter().map(|x| (x - first).norm());
        let moving = |i: &usize| self.scene.bodies.is_dynamic(*i);
        let shapes = self
            .scene
            .colliders
            .iter()
            .filter(|c| c.body.as_ref().is_some_and(moving));
        let ends = shapes.map(|c| c.position.norm() + c.shape.reach());
        let ends = ends.filter(|end| end.is_finite());
        let gravity = self.scene.gravity.norm();
        // A body that hangs by its centre has no other length.
        let fall = gravity * self.options.dt * self.options.dt;
        let longest = levers.chain(ways).chain(ends).fold(fall, f64::max);
        self.scene.mass() * gravity * longest
    }
}

#[cfg(test)]
mod tests_contacts;
#[cfg(test)]
mod tests_endless;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Scheme, StepOptions};
    use std::f64::consts::TAU;
    use taut_model::{
        Body, Constraint, Controls, Frame, GantryParams, Hinge, HoistParams, MasslessCable, Motor,
        RowLaw, Scene, Sheave,
    };

    fn watched(scheme: Scheme) -> StepOptions {
        StepOptions {
            scheme,
            energy_tolerance: Some(0.2),
            ..StepOptions::default()
        }
    }

    /// The balances of a run of `time` seconds.
    fn balances(scene: Scene, options: StepOptions, time: f64) -> Vec<EnergyBalance> {
        let dt = options.dt;
        let mut stepper = Stepper::new(scene, options).unwrap();
        let steps = (time / dt).round() as usize;
        let reports = (0..steps).map(|_| stepper.step().unwrap().balance.unwrap());
        reports.collect()
    }

    /// Weights that hang by their centres on a rope: nothing moves, and rounding is no energy from nowhere.
    #[test]
    fn a_weight_at_rest_has_no_energy_from_nowhere() {
        for mass in [250.0, 300.0, 1000.0, 8000.0, 1e6] {
            let mut scene = Scene::new("rest");
            scene.gravity = Vector3::z() * -9.81;
            let load = scene.add_body("load", Body::sphere(0.2, mass));
            let frames = vec![
                Frame::world(Vector3::z() * 5.0),
                Frame::body(load, Vector3::zeros()),
            ];
            let rope = MasslessCable::new(frames, 5.0, RowLaw::RIGID);
            scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
            let options = StepOptions {
                energy_tolerance: Some(0.01),
                ..StepOptions::default()
            };
            let mut stepper = Stepper::new(scene, options).unwrap();
            for _ in 0..120 {
                stepper.step().unwrap();
            }
        }
    }

    /// An anchor in a circle does the work that its load gains, of which the first-order scheme loses some.
    #[test]
    fn a_moved_anchor_pays_for_the_swing() {
        for (scheme, lost) in [
            (Scheme::LinearlyImplicit, 0.1),
            (Scheme::THIRD_DIFFERENCE, 0.01),
        ] {
            let params = HoistParams {
                segments: 6,
                circle_radius: 1.0,
                circle_period: 2.0,
                ..HoistParams::default()
            };
            let all = balances(params.hanging_equilibrium().unwrap(), watched(scheme), 10.0);
            assert!(all.iter().any(|b| b.work > 1000.0), "{scheme}");
            for b in all {
                let off = (b.gained - b.work) / b.scale;
                assert!((-lost..0.02).contains(&off), "{scheme}: {b:?}");
            }
        }
    }

    /// A trolley and its winches, and a force on a free body.
    #[test]
    fn motors_winches_and_loads_pay_for_what_they_move() {
        let scene = GantryParams::default().build().unwrap();
        let mut stepper = Stepper::new(scene, watched(Scheme::default())).unwrap();
        let controls = Controls {
            trolley_speed: 0.5,
            hoist_speed: 0.3,
        };
        stepper.set_controls(&controls).unwrap();
        let mut last = EnergyBalance::default();
        for _ in 0..240 {
            last = stepper.step().unwrap().balance.unwrap();
        }
        // 1.2 m up, all but the trolley.
        let hanging: f64 = stepper.scene().bodies.mass[2..].iter().sum();
        let lifted = hanging * 9.81 * 1.1;
        assert!(last.work > lifted, "{last:?}");
        assert!((last.gained / last.work - 1.0).abs() < 0.01, "{last:?}");

        let mut scene = Scene::new("pushed");
        let body = scene.add_body("ball", Body::sphere(1.0, 2.0));
        scene.bodies.force[body] = Vector3::x() * 3.0;
        let all = balances(scene, watched(Scheme::LinearlyImplicit), 2.0);
        let b = all.last().unwrap();
        assert!(
            (b.gained / b.work - 1.0).abs() < 0.02 && b.work > 8.0,
            "{b:?}"
        );
    }

    /// A load hangs in equilibrium from a drum, which starts to lift it at `speed` at once.
    fn hoisted(ea: f64, damping: f64, speed: f64) -> Scene {
        let (radius, drop, weight) = (0.3, 10.0, 9810.0);
        let mut scene = Scene::new("drum");
        scene.gravity = Vector3::z() * -9.81;
        let drum = scene.add_body("drum", Body::rod(1.0, radius, 200.0));
        let below = Vector3::new(radius, 0.0, -drop);
        let load = scene.add_body("load", Body::sphere(0.3, 1000.0).at(below));
        let centre = |body| Frame::body(body, Vector3::zeros()).along(&-Vector3::y());
        let axle = Hinge {
            motor: Some(Motor::speed(-speed / radius)),
            ..Hinge::new([
                Frame::world(Vector3::zeros()).along(&-Vector3::y()),
                centre(drum),
            ])
        };
        scene.add_constraint("axle", Constraint::Hinge(axle), 0);
        let turns = 3.0;
        let length = radius * turns * TAU + drop / (1.0 + weight / ea);
        let on_drum = Sheave {
            turns,
            ..Sheave::new(radius)
        };
        let frames = vec![centre(drum), centre(load)];
        let cable = MasslessCable {
            sheaves: vec![Some(on_drum), None],
            ..MasslessCable::new(frames, length, RowLaw::new(length / ea, damping))
        };
        scene.reeve("rope", &cable, 0).unwrap();
        scene
    }

    /// A soft cable passes the jump on slowly: what it stores at the start is that of its load at rest.
    #[test]
    fn a_drum_that_starts_at_once_gains_nothing_until_it_is_pushed() {
        for (ea, damping) in [
            (1e5, 0.0),
            (1e6, 0.0),
            (1e6, 0.05),
            (1e7, 0.05),
            (1e9, 0.05),
        ] {
            for speed in [0.15, -0.15] {
                let scene = hoisted(ea, damping, speed);
                for b in balances(scene, watched(Scheme::default()), 5.0) {
                    assert!(b.excess < 0.05, "{ea} {damping} {speed}: {b:?}");
                }
            }
            let mut stepper =
                Stepper::new(hoisted(ea, damping, -0.15), watched(Scheme::default())).unwrap();
            let failed = (0..600).find_map(|_| {
                stepper.scene.bodies.velocity[1] *= 1.1;
                stepper.step().err()
            });
            let gained = matches!(failed, Some(StepError::EnergyGain { .. }));
            assert!(gained, "{ea} {damping}: {failed:?}");
        }
    }

    /// A spring whose load is pushed on by a trick of the caller's, ten per cent of its speed a step.
    #[test]
    fn energy_from_nowhere_is_an_error() {
        let mut scene = Scene::new("spring");
        scene.gravity = Vector3::z() * -9.81;
        let body = scene.add_body("ball", Body::sphere(0.1, 2.0).at(Vector3::z() * -1.0));
        let frames = vec![
            Frame::world(Vector3::zeros()),
            Frame::body(body, Vector3::zeros()),
        ];
        let cable = MasslessCable::new(frames, 1.0, RowLaw::new(1e-3, 0.0));
        scene.add_constraint("rope", Constraint::MasslessCable(cable), 0);
        for (gain, lost) in [(1.0, false), (1.1, true)] {
            let mut stepper = Stepper::new(scene.clone(), watched(Scheme::default())).unwrap();
            let failed = (0..120).find_map(|_| {
                stepper.scene.bodies.velocity[0] *= gain;
                stepper.step().err()
            });
            assert_eq!(failed.is_some(), lost, "{failed:?}");
            let gained =
                |e: &StepError| matches!(e, StepError::EnergyGain { excess, .. } if *excess > 0.0);
            assert!(failed.iter().all(gained), "{failed:?}");
        }
    }
}
