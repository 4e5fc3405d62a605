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
//! come after the step. A drum winds up rope as it is strained, with its energy ½ λ² Δε.
//! Healthy motions are off by less than 4·10⁻² of their own energy in shocks, and elsewhere by less than 10⁻³, besides
//! the weight's work over the gap of what rolls: a step along the tangent leaves a round body by ½ (v Δt)²/R.
//!
//! **Contacts.** The impulses p of a step turn the rates u⁻ into u⁺ = u⁻ + W p and do the work ½ p·(u⁻ + u⁺) = p·u⁺ − ½ p·W p.
//! Friction has p·u⁺ ≤ 0, and so has a normal whose gap closes. One that undoes a penetration has u_N⁺ = −b − σ p > 0
//! ([`crate::contact`]), at most the speed of recovery: what begins inside another shape is pushed out of it, and p_N u_N⁺ is
//! the work of recovery. It counts over the way that the deepest penetration of the start has to go, no further: what sinks
//! in later loses by that what it gets back. The compliance of a contact stores ½ ε f² or, where less, ½ φ²/ε.

use crate::contact::ContactPoint;
use crate::contact::rebound::slowest;
use crate::run::Stepper;
use crate::step::Stage;
use crate::step::contact_solve::works;
use crate::step::work::LASTING;
use crate::{Energy, StepError};
use nalgebra::Vector3;
use taut_model::linearized::RowBounds;

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

/// Least scale, over the elastic energy and the weight times the extent: motions of less are not judged.
const LEAST: f64 = 1e-3;

/// Speed of motions that are not judged either \[m/s].
const STILL: f64 = 1e-9;

impl Stepper {
    /// Where a balance begins with this step, the energy of the present motion, without what is elastic. The velocities of a
    /// step of the scheme stand half a sub-step before: they go on as they changed in it.
    pub(crate) fn motion_at_start(&self) -> Option<Energy> {
        if self.step.output.account.start.is_some() {
            return None;
        }
        let mut kinetic = self.step.scene.kinetic_energy();
        if let Stage::Advanced {
            implicit: false, ..
        } = self.step.progress.stage
        {
            // T(v + Δv/2) = T(v) + v·M Δv/2 + Δv·M Δv/8.
            let (linear, square) = works(&self.step.scene.bodies, &self.step.system_data.dv);
            kinetic += 0.5 * linear + 0.125 * square;
        }
        Some(Energy {
            kinetic,
            gravity: self.step.scene.potential_energy(),
            elastic: 0.0,
        })
    }

    /// Where a balance begins with this step, the energy at the beginning of a sub-step, with the elastic energy of the
    /// rows' gaps, and with the motion `given`, where that is not the present one. The multipliers of a drive that starts
    /// with a jump do not tell it: they hold the damper's force and look ahead.
    pub(crate) fn opening(&mut self, given: Option<Energy>) -> Option<Energy> {
        let motion = given.or_else(|| self.motion_at_start())?;
        let account = &mut self.step.output.account;
        (account.work, account.pending, account.recovery) = (0.0, 0.0, [0.0; 2]);
        account.opens = true;
        let closing = if self.step.time == 0.0 {
            self.closing_energy()
        } else {
            0.0
        };
        Some(Energy {
            elastic: self.gap_energy() + closing,
            ..motion
        })
    }

    /// Most work of rigid rows that close the gaps φ a run begins with \[J], by their force λ before the first step: with the weight
    /// p of the scheme they leave bodies the energy −λ φ/(2 p) of r⁺ = −φ/(p Δt). Only gaps of rounding count, which close no faster
    /// than a body falls in a step.
    fn closing_energy(&self) -> f64 {
        let (rows, multipliers) = (&self.step.system_data.rows, &self.step.multipliers);
        let ahead = self.step.options.scheme.weights().next;
        let part = (0.5 / ahead).max(1.0);
        let dt = self.step.substep();
        let most = self.step.scene.gravity.norm() * dt * ahead * dt;
        let is_small = |r: &usize| rows.compliance[*r] == 0.0 && rows.phi[*r].abs() < most;
        let rigid = (0..rows.rows()).filter(is_small);
        let work = rigid.map(|r| -rows.phi[r] * multipliers.mu[r] / multipliers.mu_dt);
        part * work.map(|work| work.max(0.0)).sum::<f64>()
    }

    /// Elastic energy ½ ε λ² of the forces λ = −φ/ε, within their bounds, at the present positions.
    fn gap_energy(&self) -> f64 {
        let rows = &self.step.system_data.rows;
        let energy = |r: usize, (lower, upper): (f64, f64)| match rows.compliance[r] {
            0.0 => 0.0,
            compliance => {
                let lambda = (-rows.phi[r] / compliance).max(lower).min(upper);
                0.5 * compliance * lambda * lambda
            }
        };
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        let all: f64 = (0..rows.rows()).map(|r| energy(r, free)).sum();
        // A drum's limit is of the force with its damper's.
        let constraints = &self.step.scene.constraints;
        let is_damped = |b: &RowBounds| {
            rows.damping[b.row] > 0.0 && constraints[b.constraint].winch().is_some()
        };
        let of = |b: &RowBounds| match is_damped(b) {
            true => (f64::NEG_INFINITY, b.upper),
            false => (b.lower, b.upper),
        };
        let beyond = |b: &RowBounds| energy(b.row, free) - energy(b.row, of(b));
        all - rows.bounds.iter().map(beyond).sum::<f64>()
    }

    /// The `energy` reported of the last sub-step, with what rows and contacts store.
    fn in_account(&self, energy: Energy) -> Energy {
        Energy {
            elastic: self.stored_energy() + self.stored_in_contacts(),
            ..energy
        }
    }

    /// A balance begins with the sub-step just taken, which began with `opening` ([`opening`](Self::opening)).
    pub(crate) fn open_account(&mut self, opening: Energy) {
        // A winch that has fed its cable of segments, at the end of the sub-step, leaves another scene.
        if !std::mem::take(&mut self.step.output.account.opens) {
            return;
        }
        let start = self
            .start_of(opening, self.in_account(self.energy()))
            .total();
        self.step.output.account.start =
            Some(start - std::mem::take(&mut self.step.output.account.owed));
        let still = 0.5 * self.step.scene.mass() * STILL * STILL;
        self.step.output.account.potential = self.weight_times_extent() + still / LEAST;
    }

    /// The balance after a step.
    ///
    /// # Errors
    /// [`StepError::EnergyGain`] beyond the tolerance, and where the energy is infinite or no number.
    pub(crate) fn weigh(&mut self, tolerance: f64) -> Result<(), StepError> {
        let Some(start) = self.step.output.account.start else {
            return Ok(());
        };
        let reported = self.energy();
        let energy = self.in_account(reported);
        let total = energy.total();
        let account = &mut self.step.output.account;
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
        self.step.tally.balance = Some(balance);
        // Energies without end are no motion's, lost ones neither.
        let excess = match reported.total() {
            total if total.is_finite() => excess,
            total => total,
        };
        if excess.is_finite() && balance.excess <= tolerance {
            return Ok(());
        }
        Err(StepError::EnergyGain {
            excess,
            scale,
            time: self.step.time,
        })
    }

    /// The energy that a balance begins with, after the first sub-step of it, which began with `opening` and is accounted with
    /// `energy`. That is of the mean of the velocities before and after the sub-step, in which a blow is half over: one that
    /// begins with a blow, or with a step that is divided, begins with the motion before.
    fn start_of(&mut self, opening: Energy, energy: Energy) -> Energy {
        let contacts = self.stored_in_contacts();
        let implicit = matches!(
            self.step.progress.stage,
            Stage::Advanced { implicit: true, .. }
        );
        if self.step.tally.divided > 0 || !implicit && self.has_blow() {
            return Energy {
                elastic: opening.elastic + contacts,
                ..opening
            };
        }
        (
            self.step.output.account.work,
            self.step.output.account.recovery[0],
        ) = (0.0, 0.0);
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
        let contacts = &self.step.contacts;
        let slowest = slowest(&self.step.scene, contacts.dt());
        let before = |touch: &ContactPoint| touch.rates(|i| self.step.system_data.v.get(i))[0];
        let mut carry = contacts.touches.iter().filter(|t| t.impulse[0] > 0.0);
        carry.any(|touch| before(touch) < -slowest)
    }

    /// Elastic energy of the rows.
    fn stored_energy(&self) -> f64 {
        let rows = &self.step.system_data.rows;
        let of_constraint = |c: usize| rows.row_range(c).map(move |r| self.step.stored(c, r));
        (0..rows.constraints()).flat_map(of_constraint).sum()
    }

    /// Elastic energy of the contacts, at most ½ φ²/ε of the penetrations that the sub-step began with \[J].
    fn stored_in_contacts(&self) -> f64 {
        let of = |touch: &ContactPoint| {
            let (compliance, force) = (
                touch.found.surface.compliance,
                touch.impulse[0] / self.step.contacts.dt(),
            );
            let depth = touch.found.gap.min(0.0);
            0.5 * (compliance * force * force).min(depth * depth / compliance)
        };
        self.step.contacts.touches.iter().map(of).sum()
    }

    /// Weight of the dynamic bodies \[N] times the longest way from one to another, of a lever arm, of a shape's end or of a fall
    /// of one step \[m].
    fn weight_times_extent(&self) -> f64 {
        let rows = &self.step.system_data.rows;
        let levers = (0..rows.slots.len()).map(|s| rows.lever(s).norm());
        let position = &self.step.scene.bodies.position;
        let first = position.first().copied().unwrap_or_else(Vector3::zeros);
        let ways = position.iter().map(|x| (x - first).norm());
        let moving = |i: &usize| self.step.scene.bodies.is_dynamic(*i);
        let shapes = self
            .step
            .scene
            .colliders
            .iter()
            .filter(|c| c.body.as_ref().is_some_and(moving));
        let ends = shapes.map(|c| c.position.norm() + c.shape.reach());
        let ends = ends.filter(|end| end.is_finite());
        let gravity = self.step.scene.gravity.norm();
        // A body that hangs by its centre has no other length.
        let fall = gravity * self.step.options.dt * self.step.options.dt;
        let longest = levers.chain(ways).chain(ends).fold(fall, f64::max);
        self.step.scene.mass() * gravity * longest
    }
}

#[cfg(test)]
mod tests_contacts;
#[cfg(test)]
mod tests_endless;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;
    use std::f64::consts::TAU;

    fn watched(scheme: Scheme) -> StepOptions {
        StepOptions::default().with(|o| (o.scheme, o.energy_tolerance) = (scheme, Some(0.2)))
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
            let frames = vec![Frame::world(Vector3::z() * 5.0), centre(load)];
            let rope = MasslessCable::new(frames, 5.0, RowLaw::RIGID);
            scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
            let options = StepOptions::default().with(|o| o.energy_tolerance = Some(0.01));
            let mut stepper = Stepper::new(scene, options).unwrap();
            stepper.steps(120);
        }
    }

    /// An anchor in a circle does the work that its load gains, of which the first-order scheme loses some.
    #[test]
    fn a_moved_anchor_pays_for_the_swing() {
        for (scheme, lost) in [
            (Scheme::LinearlyImplicit, 0.1),
            (Scheme::THIRD_DIFFERENCE, 0.01),
        ] {
            let params = HoistParams::default()
                .with(|p| (p.segments, p.circle_radius, p.circle_period) = (6, 1.0, 2.0));
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
        let holds = (b.gained / b.work - 1.0).abs() < 0.02 && b.work > 8.0;
        assert!(holds, "{b:?}");
    }

    /// A load hangs in equilibrium from a drum, which starts to lift it at `speed` at once.
    fn hoisted(ea: f64, damping: f64, speed: f64) -> Scene {
        let (radius, drop, weight) = (0.3, 10.0, 9810.0);
        let mut scene = Scene::new("drum");
        scene.gravity = Vector3::z() * -9.81;
        let drum = scene.add_body("drum", Body::rod(1.0, radius, 200.0));
        let below = Vector3::new(radius, 0.0, -drop);
        let load = scene.add_body("load", Body::sphere(0.3, 1000.0).at(below));
        let centre = |body| centre(body).along(&-Vector3::y());
        let axle = Hinge::new([origin().along(&-Vector3::y()), centre(drum)])
            .with(|p| p.motor = Some(Motor::speed(-speed / radius)));
        scene.add_constraint("axle", Constraint::Hinge(axle), 0);
        let turns = 3.0;
        let length = radius * turns * TAU + drop / (1.0 + weight / ea);
        let on_drum = Sheave::new(radius).with(|p| p.turns = turns);
        let frames = vec![centre(drum), centre(load)];
        let cable = MasslessCable::new(frames, length, RowLaw::new(length / ea, damping))
            .with(|p| p.sheaves = vec![Some(on_drum), None]);
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
                stepper.step.scene.bodies.velocity[1] *= 1.1;
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
        let frames = vec![origin(), centre(body)];
        let cable = MasslessCable::new(frames, 1.0, RowLaw::new(1e-3, 0.0));
        scene.add_constraint("rope", Constraint::MasslessCable(cable), 0);
        for (gain, lost) in [(1.0, false), (1.1, true)] {
            let mut stepper = Stepper::new(scene.clone(), watched(Scheme::default())).unwrap();
            let failed = (0..120).find_map(|_| {
                stepper.step.scene.bodies.velocity[0] *= gain;
                stepper.step().err()
            });
            assert_eq!(failed.is_some(), lost, "{failed:?}");
            let gained =
                |e: &StepError| matches!(e, StepError::EnergyGain { excess, .. } if *excess > 0.0);
            assert!(failed.iter().all(gained), "{failed:?}");
        }
    }
}
