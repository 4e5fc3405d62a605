//! Steps that are divided: those in which a rope catches or is thrown slack, and those in which bodies turn too far.
//!
//! A one-sided row closes or opens somewhere within a step, and the step knows this to Δt alone.
//! Where a load lands and its rope catches it again, bodies keep velocities for a part of the step
//! that they had lost, and the error is of first order. Such a step is taken back and made of
//! [`PARTS`] or more steps of the same scheme, [`BLOW`] of rigid rows. The condition is a row, stiff in its eyes, that is caught,
//! thrown open or driven at another speed by more than the speed that gravity gives
//! in a step. Cables that slip over sheaves with friction are caught in whole steps: their parts share one length.
//!
//! A row that slips brakes up to the blow in which its load is thrown back, and is slack after it. A whole step has one force of a
//! row: none, so that the load would arrive too fast by F Δt/m and keep that. Where a drum or a rope over a sheave slipped in the
//! step before and its load is thrown back in this one, the step is divided too, with the Ω of a row that is caught.
//!
//! Shapes that are struck on an elastic row reverse its swing within the step. A whole step has one acceleration for both ways:
//! each bounce may gain Ω²/3 of the energy, and a blow without restitution loses what the row swings back with. From Ω = [`SOFT`]
//! to [`RESOLVED`] such a step is divided where the blow is fast, in scenes with bounded rows. Slow rebounds divide none: in a chain whose own modes are faster than the step, the half
//! kicks at both ends of a division would be added in every second step.
//!
//! An elastic row swings back after π/Ω of a step, Ω² = Δt² J M̃⁻¹ Jᵀ/ε. A whole step with Ω ≫ 1 damps this rebound, which may be
//! half of a lift by a pulley; parts with Ω < 1 keep its energy. The steps that follow are divided too while the row swings
//! fast, until it is slack ([`crate::activation`]). At the ends of a division half a kick is taken back or added; there
//! the gap tells whether the row is closed: without the force of a row that is, the speed is off by Ω²/12 of a part.
//!
//! A body that turns by θ = |ω| Δt in a step parts the gaps from their prediction by the lever arm times θ²/2, d of it. Where the
//! turns at the beginning of the step explain its disagreement d so, and not a blow in it, the scheme holds in parts: n of them
//! leave d/n² each. Such a step is made of the least power of two of parts that leaves an eighth of the guard's tolerance, at most
//! [`PARTS`]. The coarse run of the error's estimate, whose steps are longer by a factor k, is allowed k² times the tolerance: with
//! as many parts as the run its error is the larger one. Where a part disagrees too, all that is left of the step is implicit.
//! Scenes of joints and motors alone divide such steps: whips under loads of 10⁶ segments, bodies that struck a floor and elastic
//! ropes that caught them gained energy in parts.
//!
//! A staggered scheme keeps velocities half a step before the positions. Before the first part they
//! go forward by half of the Δv that the whole step has with all rows as they were and without
//! blows of contacts, then half a part back. After the last part they go forward to its end, with
//! Δv of a part. From there the next step begins as the first step of a run does. If it is divided too, it goes back to those
//! velocities.
//!
//! Gaps that a curve leaves in whole steps stay over the parts ([`curves`]). What drift the curve does not explain goes in proportion
//! to time ([`crate::activation`]).
//!
//! The multipliers of a divided step of a scene with bounded rows are the sums of those of its parts, from which the next step
//! starts: a catch in the last one is no force that lasts.

use super::{Stage, Step, WHOLE};
use crate::activation::{Activation, SOFT};
use crate::active_set::{RowState, jacobian, response_of};
use crate::contact::ContactPoint;
use crate::contact::rebound::slowest;
use crate::system_data::SystemData;
use crate::{Guard, StepError};
use nalgebra::Vector3;
use taut_lanes::Aligned;
use taut_model::{Constraint, Frame, RowBounds, Slot};

/// Parts of a divided step. A load that lands beside the weight of its pulley lifts again to 0.62
/// of the height at 1/60 s undivided, to 0.93 in 4 parts, 0.98 in 16, 0.99 in 32.
const PARTS: u32 = 32;

/// Parts where a rigid row is struck: a rope that goes slack as its load lands lacks its force for half to one and a half of a part,
/// and a lift by a pulley then 3 % of its height with 32.
const BLOW: u32 = 64;

/// Least number of parts over Ω of an elastic rope that is caught: half a swing, π/Ω of a step, then takes four of them or more.
const SWING: f64 = 1.5;

/// That number over the one of a swing where shapes may be thrown back while the rope pulls: a part gains 1.45 times its own Ω² of the
/// energy.
const THROWN: f64 = 4.0;

/// Largest Ω of shapes that are struck, and of those in scenes with ropes that slip or cables of segments, whose own modes are faster
/// than the step: the half kicks of a division at the rebound of a stiff one would add to them.
const RESOLVED: [f64; 2] = [96.0, 4.0];

/// Least rate that divides a step, |g| Δt, over the largest one without restitution.
pub(super) const LEAST: f64 = 10.0;

/// Part of a disagreement that the turns at the beginning of a step have to make.
const EXPLAINED: f64 = 0.5;

/// Largest change of an angular velocity in a step over the largest one that is a turn and no blow.
const STEADY: f64 = 0.25;

/// Largest change of a velocity in a step over that of a curve and of gravity.
const CURVED: f64 = 1.5;

/// Tolerance of the guard over the disagreement of a part: parts that turn by 0.035 rad at the default leave gaps of 0.6 mm in 1 m.
const LEFT: f64 = 8.0;

/// Sizes of a velocity and of an angular velocity.
fn halves([x, y, z, p, q, r]: [f64; 6]) -> [f64; 2] {
    [[x, y, z], [p, q, r]].map(|v| Vector3::from(v).norm())
}

/// State of a divided step.
#[derive(Debug, Clone)]
pub(crate) struct Division {
    /// Parts of the present step; 1 if it is not divided.
    pub(crate) parts: u32,
    /// Parts that the present sub-step takes at once.
    pub(crate) taken: u32,
    /// Parts that an implicit sub-step takes at once: those left of a step divided because bodies turn, else 1.
    pub(super) left: u32,
    /// Places of the bounded rows at the beginning of the step, and ∂φ/∂t of the step before.
    places: Vec<RowState>,
    phi_t: Vec<f64>,
    /// Bounded rows that gave way at their limit of force, or to friction on a sheave, in the step before; none where nothing
    /// can touch.
    gave: Vec<bool>,
    /// Bounded rows that the step just taken has struck.
    hit: Vec<bool>,
    /// True if the step before was divided or implicit.
    pub(crate) goes_on: bool,
    /// True if an elastic rope is caught, whose swing the parts resolve.
    swings: bool,
    /// True if the velocities of all bodies went half a step back just now, from those of the [`substep_start`](super::guarded::GuardState::substep_start).
    pub(super) from_start: bool,
    /// Work of drives that was taken back with them \[J].
    pub(super) work_of_start: f64,
    /// Length of the steps over that of the steps whose error these estimate.
    pub(crate) coarseness: f64,
    /// Sum of the parts' multipliers, one a row.
    sum: Aligned,
}

/// Rows that the half kick up to the present drives as the step before did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Drives {
    /// All with bounds, as at the beginning of the step that is divided.
    OfBounds,
    /// Those of winches and motors.
    OfSettings,
    /// None.
    Present,
}

impl Division {
    /// Buffers for a scene with `rows` rows, `bounded` of them with bounds.
    pub(crate) fn new(rows: usize, bounded: usize) -> Self {
        Self {
            parts: 1,
            taken: 1,
            left: 1,
            places: Vec::with_capacity(bounded),
            phi_t: Vec::with_capacity(bounded),
            gave: Vec::with_capacity(bounded),
            hit: vec![false; bounded],
            goes_on: false,
            swings: false,
            from_start: false,
            work_of_start: 0.0,
            coarseness: 1.0,
            sum: Aligned::new(rows),
        }
    }
}

impl Step {
    /// Keeps whether the last step was divided or implicit, before a solve of the present state replaces the stage.
    pub(super) fn note_stage(&mut self) {
        if let Stage::Advanced { implicit, .. } = self.progress.stage {
            self.guarded.division.goes_on = implicit;
        }
    }

    /// Before a step that may come to be divided.
    pub(super) fn begin_division(&mut self) {
        if self.guarded.division.parts > 1 {
            return;
        }
        let (division, bounds) = (&mut self.guarded.division, &self.system_data.rows.bounds);
        division.places.clear();
        division.places.extend(self.active_set.places());
        division.phi_t.clear();
        let phi_t = bounds.iter().map(|b| self.history.phi_t[b.row]);
        division.phi_t.extend(phi_t);
        division.gave.clear();
        if !self.contacts.can_be() {
            return;
        }
        let at_limit = |(bound, place): (&RowBounds, RowState)| match place {
            RowState::Inside => false,
            RowState::Lower => bound.side() > 0.0,
            RowState::Upper => bound.side() < 0.0,
        };
        let gave = bounds.iter().zip(self.active_set.places()).map(at_limit);
        division.gave.extend(gave);
        self.slip.giving().for_each(|k| division.gave[k] = true);
    }

    /// Parts that the step just taken needs for this disagreement of its gaps with their prediction: 1 if it stands, `None` if it
    /// has to be implicit.
    pub(super) fn parts(&mut self, disagreement: f64, tolerance: f64) -> Option<u32> {
        let explains =
            || self.is_smooth() && 2.0 * EXPLAINED * disagreement <= self.steady_turn().powi(2);
        let is_turn = disagreement > tolerance && explains();
        let is_part = self.guarded.division.parts > 1;
        let allowed = match is_turn {
            true => tolerance * self.guarded.division.coarseness.powi(2),
            false => tolerance,
        };
        let holds = disagreement <= allowed;
        if !holds && (!is_turn || is_part) {
            return None;
        }
        let bounded = !self.active_set.is_empty();
        let caught = bounded.then(|| self.caught()).flatten();
        let caught = caught.or_else(|| self.thrown_on_curves().then_some(0.0));
        self.guarded.division.swings = caught.is_some_and(|omega| omega > 0.0);
        if let Some(omega) = caught {
            // Parts of one length in run and coarse run would have the same error, which no estimate sees.
            let throws = self.contacts.rebound_is_due() || self.contacts.has_stopped();
            let swing = if throws { THROWN * SWING } else { SWING };
            let parts = (swing * omega / self.guarded.division.coarseness) as u32;
            let least = if omega == 0.0 { BLOW } else { PARTS };
            return Some(parts.next_power_of_two().max(least));
        }
        let least = if holds {
            1.0
        } else {
            (LEFT * disagreement / allowed).sqrt()
        };
        (least <= f64::from(PARTS)).then(|| (least.ceil() as u32).next_power_of_two())
    }

    /// True if no rope can catch, no shape strike, no cable slip and no segment whip: a blow inside a step in parts gains energy.
    fn is_smooth(&self) -> bool {
        let strikes = !self.active_set.is_empty() || self.contacts.can_be();
        !strikes && self.slip.is_empty() && !self.bends()
    }

    /// True if there are cables of segments.
    fn bends(&self) -> bool {
        use Constraint::{Cosserat, Fairlead, Paper};
        let bends = |c: &Constraint| matches!(c, Cosserat(_) | Fairlead(_) | Paper(_));
        self.scene.constraints.iter().any(bends)
    }

    /// Largest angle θ by which a body turns in a step at its velocity from the beginning \[rad]; 0 where bodies are struck: where
    /// their angular velocities change by more than [`STEADY`] allows, or velocities v by more than θ |v| and gravity.
    fn steady_turn(&self) -> f64 {
        let SystemData { v, dv, .. } = &self.system_data;
        let (mut rate, mut change) = (0.0_f64, 0.0_f64);
        for i in self.scene.dynamic_bodies() {
            rate = rate.max(halves(v.get(i))[1]);
            change = change.max(halves(dv.get(i))[1]);
        }
        let turn = rate * self.substep();
        let fall = self.scene.gravity.norm() * self.substep();
        let is_struck = |i: usize| {
            let [speed, _] = halves(v.get(i));
            let [change, _] = halves(dv.get(i));
            change > CURVED * (turn * speed + fall)
        };
        if change > STEADY * rate || self.scene.dynamic_bodies().any(is_struck) {
            return 0.0;
        }
        turn
    }

    /// The largest Ω of what was struck in the step just taken so fast that it has to be divided.
    fn caught(&mut self) -> Option<f64> {
        if self.guarded.division.parts > 1 {
            return None;
        }
        let mut hit = std::mem::take(&mut self.guarded.division.hit);
        hit.fill(false);
        let caught = self.caught_rows(|k| hit[k] = true);
        self.guarded.division.hit = hit;
        caught
    }

    /// [`caught`](Self::caught), with the rows that are struck.
    fn caught_rows(&self, hits: impl FnMut(usize)) -> Option<f64> {
        let dt = self.substep();
        let least = LEAST * slowest(&self.scene, dt);
        let struck_on_springs = self.struck_on_springs(least);
        let driven = |k: usize| {
            let row = self.system_data.rows.bounds[k].row;
            let change = self.history.phi_t[row] - self.guarded.division.phi_t[k];
            change.abs().max(self.stops(k))
        };
        let lands = self.contacts.lands();
        let landing = |k| if lands { self.landing(k, false) } else { 0.0 };
        let loaded = |k| match self.slip.holds(k) || self.is_beside_made(k) {
            true => 0.0,
            false => self.loaded_response(k),
        };
        let rebounds = lands && self.contacts.rebound_is_due();
        let thrown = |k: usize| {
            let gave = rebounds && self.guarded.division.gave[k] && !self.is_beside_made(k);
            match gave && self.landing(k, true) > least {
                true => self.loaded_response(k),
                false => 0.0,
            }
        };
        let struck = self.activation.struck(
            (&self.system_data, &self.active_set),
            (&self.history.rate, driven),
            (dt, least, self.guarded.division.goes_on),
            (hits, |k| self.curving(k)),
            landing,
            (loaded, thrown),
        );
        let both = [struck, struck_on_springs].into_iter().flatten();
        both.reduce(f64::max)
    }

    /// Speed that the winch of bounded row `k` loses at the end of its rope within the step just taken, or begins with in it \[m/s].
    fn stops(&self, k: usize) -> f64 {
        let constraint = self.system_data.rows.bounds[k].constraint;
        let Constraint::MasslessCable(cable) = &self.scene.constraints[constraint] else {
            return 0.0;
        };
        let Some(winch) = cable.winch.as_ref().filter(|winch| !winch.brake) else {
            return 0.0;
        };
        let (dt, end) = (self.substep(), cable.length_at(self.time));
        let is_inside = winch.shortest < end && end < winch.longest;
        if is_inside && winch.since <= self.time - dt {
            return 0.0;
        }
        let speed = winch.speed.abs();
        let way = (end - cable.length_at(self.time - dt)).abs();
        let stops = way > 0.0 && way < WHOLE * speed * dt;
        if stops { speed } else { 0.0 }
    }

    /// The largest Ω of shapes that are struck in the step just taken, faster than `least` (m/s), on elastic rows that pull them: none
    /// below [`SOFT`], or beyond what a division resolves. Beside cables of segments, and ropes over sheaves with friction, whose slip
    /// is of whole steps, only shapes that are thrown back count.
    fn struck_on_springs(&self, least: f64) -> Option<f64> {
        let coarse = self.bends() || !self.slip.is_empty();
        let most = RESOLVED[usize::from(coarse)];
        let omega = |touch: &ContactPoint| {
            let carriers = touch.carriers().iter().map(|carrier| carrier.body);
            let bodies = carriers.filter(|body| self.scene.bodies.is_dynamic(*body));
            let square = |body: usize| {
                self.stiffness_along(body, &touch.push(body)) / self.scene.bodies.mass[body]
            };
            self.substep() * bodies.map(square).fold(0.0, f64::max).sqrt()
        };
        let v = &self.system_data.v;
        let struck = self.contacts.struck(!coarse);
        let fast = struck.filter(|touch| -touch.normal_rate(|i| v.get(i)) > least);
        fast.map(omega)
            .filter(|omega| (SOFT..most).contains(omega))
            .reduce(f64::max)
    }

    /// Σ (t·n)² tᵀ k t of the joints at `body`, with the stiffness k of their rows and the direction t of their pull on it \[N/m]: what
    /// a cable's joint does not pull with, the turn of its segment takes up. The joint at a cable's end counts as all of the cable.
    fn stiffness_along(&self, body: usize, n: &Vector3<f64>) -> f64 {
        let rows = &self.system_data.rows;
        let slots = rows.slots.iter().enumerate();
        let own = slots.filter(|(_, slot)| slot.body == body);
        let of = |(s, slot): (usize, &Slot)| -> f64 {
            let (range, block) = (rows.row_range(slot.constraint), rows.block(s));
            let along = |(r, j): (usize, &[f64; 6])| (r, Vector3::new(j[0], j[1], j[2]));
            let lines = || range.clone().zip(block.rows()).map(along);
            let pull: Vector3<f64> = lines().map(|(r, j)| j * self.multipliers.mu[r]).sum();
            let Some(t) = pull.try_normalize(0.0) else {
                return 0.0;
            };
            let elastic = lines().filter(|(r, _)| rows.compliance[*r] > 0.0);
            let stiffness: f64 = elastic
                .map(|(r, j)| t.dot(&j).powi(2) / rows.compliance[r])
                .sum();
            t.dot(n).powi(2) * stiffness / self.joints_in_series(body, slot.constraint)
        };
        own.map(of).sum()
    }

    /// Compliance along a cable of segments over that of its joint `constraint` at the end which `body` hangs on: joints at ends are
    /// half as compliant as those between segments. 1 for all other constraints.
    fn joints_in_series(&self, body: usize, constraint: usize) -> f64 {
        let mut cables = self.scene.cables.iter();
        let cable = cables
            .find(|cable| cable.joints.contains(&constraint) && !cable.bodies.contains(&body));
        cable.map_or(1.0, |cable| 2.0 * cable.bodies.len() as f64)
    }

    /// Direction in which bounded row `k` pulls a body with this J.
    fn pull(&self, k: usize, j: &[f64; 6]) -> Vector3<f64> {
        Vector3::new(j[0], j[1], j[2]) * -self.system_data.rows.bounds[k].side()
    }

    /// J M̃⁻¹ Jᵀ of bounded row `k`, whose bodies move with the heaviest that it pulls each against \[1/kg]: a light plate that
    /// ropes hold bounces with what has landed on it.
    fn loaded_response(&self, k: usize) -> f64 {
        let parts = jacobian(&self.system_data, k).map(|(body, j)| {
            let own = self.scene.bodies.mass[body];
            let load = self
                .contacts
                .heaviest_on(&self.scene, body, &self.pull(k, &j));
            response_of(&self.system_data, body, &j) * own / (own + load)
        });
        parts.sum()
    }

    /// Fastest speed at which a body of bounded row `k` lands in the step on what takes its load \[m/s].
    fn landing(&self, k: usize, thrown: bool) -> f64 {
        let v = &self.system_data.v;
        let speeds = jacobian(&self.system_data, k)
            .map(|(body, j)| self.contacts.landing(body, v, &self.pull(k, &j), thrown));
        speeds.fold(0.0, f64::max)
    }

    /// Returns true if bounded row `k` holds a body that a row which an event has just made holds too. A divided step goes on
    /// from the motion before, and the blow of the new row does not belong to that motion.
    fn is_beside_made(&self, k: usize) -> bool {
        let rows = &self.system_data.rows;
        let slots = |constraint| &rows.slots[rows.slot_range(constraint)];
        let own = slots(rows.bounds[k].constraint);
        let just = self.activation.made().iter().filter(|row| row.age == 0);
        just.flat_map(|row| slots(row.constraint))
            .any(|made| own.iter().any(|slot| slot.body == made.body))
    }

    /// The step in `parts`, after it was taken back: because a body `turns`, or a rope catches.
    pub(super) fn divide(
        &mut self,
        guard: Guard,
        parts: u32,
        turns: bool,
    ) -> Result<(), StepError> {
        self.active_set.put(&self.guarded.division.places);
        for (bound, phi_t) in self
            .system_data
            .rows
            .bounds
            .iter()
            .zip(&self.guarded.division.phi_t)
        {
            self.history.phi_t[bound.row] = *phi_t;
        }
        self.history.known = false;
        self.tally.divided += 1;
        let end = self.time + self.substep();
        if self.guarded.division.from_start {
            self.guarded.substep_start.restore(&mut self.scene.bodies);
            self.output.account.work -= self.guarded.division.work_of_start;
        } else if self.options.scheme.is_staggered() {
            self.bring_forward(Drives::OfBounds)?;
        }
        self.guarded.division.parts = parts;
        let done = self.take_parts(guard, parts, turns);
        (
            self.guarded.division.parts,
            self.guarded.division.taken,
            self.guarded.division.left,
        ) = (1, 1, 1);
        if done.is_ok() {
            // To the last bit, as a restored run begins.
            self.time = end;
            self.cut_at_winches(false);
            self.system_data.rows.update_state(&self.scene, end);
            self.activation.make_young(&self.system_data.rows);
        }
        self.activation.let_go();
        done
    }

    fn take_parts(&mut self, guard: Guard, parts: u32, turns: bool) -> Result<(), StepError> {
        self.activation
            .take_drift(&self.system_data.rows, &self.multipliers.tension, true);
        let goes_on = self.guarded.division.goes_on || self.guarded.division.from_start;
        self.hold_drift_of_curves(parts);
        self.activation
            .drop_resolved_drift(&self.system_data, goes_on, self.substep());
        (self.activation.left, self.activation.share) = (1.0, 0.0);
        self.progress.started = false;
        // An elastic row that closes at the beginning had no force before.
        self.active_set.frozen = self.guarded.division.swings && !self.guarded.division.goes_on;
        let started = self.start();
        self.active_set.frozen = false;
        started?;
        self.guarded.division.sum.fill(0.0);
        let mut left = parts;
        while left > 0 {
            (self.guarded.division.taken, self.guarded.division.left) =
                (1, if turns { left } else { 1 });
            self.activation.left = f64::from(left - 1) / f64::from(parts);
            self.activation.share = f64::from(parts).recip();
            let implicit = self.tally.implicit_substeps;
            self.guarded_substep(guard)?;
            if self.tally.implicit_substeps > implicit {
                // Implicit sub-steps take back all of it.
                self.activation.forget_drift();
            }
            self.measure_events();
            left -= self.guarded.division.taken;
        }
        self.output.reported.add(&self.guarded.division.sum, 1.0);
        if self.is_late() {
            self.bring_forward(Drives::Present)?;
        }
        if !self.active_set.is_empty() {
            self.multipliers
                .mu
                .copy_from_slice(&self.guarded.division.sum);
            self.multipliers.mu_dt = self.options.dt / self.options.substeps as f64;
            for (tension, mu) in self
                .multipliers
                .tension
                .iter_mut()
                .zip(&self.multipliers.mu[..])
            {
                *tension = mu / self.multipliers.mu_dt;
            }
        }
        self.begin_anew();
        Ok(())
    }

    pub(super) fn is_divided(&self) -> bool {
        self.guarded.division.parts > 1
    }

    /// A part of the step stands, or an implicit sub-step of it.
    pub(super) fn add_part(&mut self) {
        for (sum, mu) in self
            .guarded
            .division
            .sum
            .iter_mut()
            .zip(&self.multipliers.mu[..])
        {
            *sum += mu;
        }
    }

    /// The next step starts from velocities of the present, and takes its half step back by its own rows.
    fn begin_anew(&mut self) {
        self.history.known = false;
        self.progress.stage = Stage::Advanced {
            dt: self.multipliers.mu_dt,
            implicit: true,
        };
        self.progress.started = false;
    }

    /// True if velocities lag half a step behind.
    fn is_late(&self) -> bool {
        self.options.scheme.is_staggered() && self.progress.started
    }

    /// Brings late velocities up to the present state with the forces of the rows that are about to go: a load that is let go
    /// has their force until now. Impulses stay those of the step.
    ///
    /// # Errors
    /// Those of a solve.
    pub(crate) fn catch_up(&mut self) -> Result<(), StepError> {
        if !self.is_late() {
            return Ok(());
        }
        self.keep_substep_start();
        self.bring_forward(Drives::OfSettings)?;
        let (mu, tension) = (&mut self.multipliers.mu, &mut self.multipliers.tension);
        self.multipliers.mu_dt = self.guarded.substep_start.restore_multipliers(mu, tension);
        self.begin_anew();
        Ok(())
    }

    /// Before a motor or a winch becomes `faster` by a jump (m/s, rad/s). Where that is more than gravity's speed in a step, what
    /// rides on it leaves with the velocity of now; so does what hangs on a massless rope that is paid out, or on one whose drum is
    /// turned.
    ///
    /// # Errors
    /// Those of a solve.
    pub(crate) fn catch_up_at_jump(
        &mut self,
        constraint: usize,
        faster: f64,
    ) -> Result<(), StepError> {
        let least = self.scene.gravity.norm() * self.substep();
        // Contacts as a restored run knows them.
        let rides = !self.contacts.known().0.is_empty();
        let hauls = faster.abs() * self.lever_of_ropes(constraint) > least;
        let pays_out = faster > least && self.pays_out(constraint);
        let jumps = rides && faster.abs() > least || least > 0.0 && (hauls || pays_out);
        // Slip goes on from the step before.
        if jumps && self.slip.is_empty() {
            self.catch_up()?;
        }
        Ok(())
    }

    fn pays_out(&self, constraint: usize) -> bool {
        matches!(
            self.scene.constraints[constraint],
            Constraint::MasslessCable(_)
        )
    }

    /// Largest lever of the pull of massless ropes on the bodies of a hinge \[m]; 0 of other constraints.
    fn lever_of_ropes(&self, constraint: usize) -> f64 {
        let Constraint::Hinge(hinge) = &self.scene.constraints[constraint] else {
            return 0.0;
        };
        let rows = &self.system_data.rows;
        let turned = |body: usize| hinge.frames.iter().any(|f| f.body_index() == Some(body));
        let ropes = rows.others().iter().filter(|c| self.pays_out(**c));
        let slots = ropes.flat_map(|c| rows.slot_range(*c));
        let own = slots.filter(|s| turned(rows.slots[*s].body));
        // Of the pull: the angular part of its row of J.
        let levers = own.filter_map(|s| rows.block(s).rows().first().map(|j| halves(*j)[1]));
        levers.fold(0.0, f64::max)
    }

    /// Brings velocities that lag half a step behind up to the present state. No row opens or closes and no shapes arrive meanwhile.
    fn bring_forward(&mut self, before: Drives) -> Result<(), StepError> {
        (self.active_set.frozen, self.contacts.begins) = (true, true);
        let solved = self.solve_frozen(before);
        (self.active_set.frozen, self.contacts.begins) = (false, false);
        solved?;
        self.account_for_half(-1.0);
        self.system_data
            .update_velocity_change(&self.multipliers.mu);
        self.take_half_back(0..self.scene.bodies.len(), -1.0);
        self.progress.stage = Stage::Unsolved;
        Ok(())
    }

    fn solve_frozen(&mut self, before: Drives) -> Result<(), StepError> {
        self.linearize(self.options.stiffness)?;
        let dt = self.substep();
        let ahead = if before == Drives::OfBounds { 0.0 } else { dt };
        let (rate, system_data) = (&self.history.rate_now, &mut self.system_data);
        Activation::close_by_gaps(&mut self.active_set, system_data, rate, dt, ahead);
        match before {
            Drives::OfBounds => self.drive_bounds_as_before(),
            Drives::OfSettings => self.drive_settings_as_before(),
            Drives::Present => {}
        }
        if self.can_strike() {
            self.leave_blows();
        }
        self.solve_linearized(dt)
    }

    fn drive_bounds_as_before(&mut self) {
        for k in 0..self.system_data.rows.bounds.len() {
            // The drives of cables that slip hold their slip, which is solved for anew.
            if !self.slip.holds(k) {
                let row = self.system_data.rows.bounds[k].row;
                self.drive_as_before(row, self.guarded.division.phi_t[k]);
            }
        }
    }

    /// The speeds of winches and motors that were set at this time have not acted yet. Rows whose supports move keep the drive of
    /// the present: the part of the winch in it is not known.
    fn drive_settings_as_before(&mut self) {
        let end = self.time + self.substep();
        for c in 0..self.scene.constraints.len() {
            let (constraint, bodies) = (&self.scene.constraints[c], &self.scene.bodies);
            let moves = |f: &Frame| {
                let at = |time| f.resolve(bodies, time).point();
                f.body_index().is_none() && at(self.time) != at(end)
            };
            let is_set = constraint.winch().is_some() || constraint.motor().is_some();
            if !is_set || constraint.frames().iter().any(moves) {
                continue;
            }
            for row in self.system_data.rows.row_range(c) {
                let bounds = &self.system_data.rows.bounds;
                let bound = bounds.binary_search_by_key(&row, |bound| bound.row);
                if !bound.is_ok_and(|k| self.slip.holds(k)) {
                    self.drive_as_before(row, self.history.phi_t[row]);
                }
            }
        }
    }

    /// Gives a row of the prepared system the drive `phi_t` of the step before.
    fn drive_as_before(&mut self, row: usize, phi_t: f64) {
        let SystemData { rows, rate, .. } = &mut self.system_data;
        let jump = rows.phi_t[row] - phi_t;
        rows.phi_t[row] -= jump;
        rate[row] += jump;
    }
}

mod curves;
#[cfg(test)]
mod tests;
