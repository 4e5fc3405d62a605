//! The guarded step: the scheme's linear step where its linearisation holds, implicit sub-steps where it does not.
//!
//! After a linear step the gaps φ(q⁺) are compared with their prediction φ + Δt (J v⁺ + ∂φ/∂t). A rotation by θ leaves
//! them r θ²/2 apart, and through a stiff cable that is a force without a cause in the motion: energy from nowhere. A
//! step that disagrees is taken back. Where it began with such turns it is divided ([`super::divided`]); where a blow in it
//! made them it is redone by the implicit Euler method on the nonlinear equations,
//!
//! ```text
//! M (v⁺ − v) = Δt f + J(q⁺)ᵀ μ,    ε μ/Δt + φ⁺ + τ (φ⁺ − φ₀)/Δt = 0,    q⁺ = q ⊕ Δt v⁺,  φ⁺ = φ(q⁺),  φ₀ = φ(q)
//! ```
//!
//! solved by Newton passes, each the same linear system with rows and geometric stiffness taken at the last q⁺. Where they
//! do not converge the sub-step is halved. In the shortest ones each pass searches along its step for less of the
//! incremental potential ([`super::potential`]); if they do not converge either, the velocities shrink until the sub-step
//! has gained no energy. The method is of first order and damps every motion that it cannot resolve, which is what a shock
//! leaves behind.
//!
//! **Dampers of lengths** resist what their path has grown by. The rate along the tangent at the end is another one,
//! J(q⁺) v⁺ + ∂φ/∂t = (φ⁺ − φ₀)/Δt + Δt κ/2 with κ = v²/L on a circle: its damper draws what swings inwards by τ κ Δt/2, 9 mm
//! a step at 8 m/s on 1 m where τ ≫ Δt. A pass about the iterate q_k, whose rates are h, takes φ⁺ = φ_k + Δt (r⁺ − h), so that
//!
//! ```text
//! (φ⁺ − φ₀)/Δt = r⁺ + (φ_k − φ₀)/Δt − h
//! ```
//!
//! and the row counts as violated by τ ((φ_k − φ₀)/Δt − h) more than it is. φ_k holds what drives, winches and slip have changed.
//! The first pass has φ_k = φ₀ and only the tangent: it ends no sub-step with such dampers. Angles take J(q⁺) v⁺ + ∂φ/∂t, since
//! they jump by 2π where a joint folds; what turns as a whole changes none of them.

use super::divided::Division;
use super::potential::Search;
use super::system::Multipliers;
use crate::gyroscopic;
use crate::history::State;
use crate::regularization::Known;
use crate::step::{Stage, Step};
use crate::system_data::SystemData;
use crate::{Guard, Phase, Scheme, StepError};
use nalgebra::Vector3;

/// Disagreement, relative to the guard's tolerance, at which a sub-step's Newton passes have converged.
const CONVERGED: f64 = 0.01;

/// Promised decrease of Φ over its size at which they have converged too, where the disagreement keeps the tolerance.
const AT_REST: f64 = 1e-6;

/// Turns that change the next one noticeably, and are short of half a one \[rad].
const TURNS: std::ops::Range<f64> = 1e-3..2.5;

/// About what a Newton pass linearises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Pass {
    /// The state at the beginning.
    First,
    /// The last iterate of q⁺.
    Next,
    /// The state at the beginning, which is at rest; bodies are as inert as their constraint forces with this
    /// acceleration (m/s²) demand. The equilibrium knows no inertia.
    FromRest(f64),
}

/// State of the guard.
pub(crate) struct GuardState {
    /// Steps that the guard still takes implicitly.
    pub(crate) hold_off: usize,
    /// State of a step divided because a rope catches or is thrown slack.
    pub(crate) division: Division,
    /// States at the beginning of the step and of its sub-step.
    pub(crate) step_start: State,
    pub(crate) substep_start: State,
    /// The guard's search along its Newton steps.
    pub(crate) search: Search,
}

impl Step {
    /// One sub-step of the options, by the scheme or, where its linearisation does not hold, implicitly.
    pub(crate) fn guarded_substep(&mut self, guard: Guard) -> Result<(), StepError> {
        let mut start = std::mem::take(&mut self.guarded.step_start);
        self.keep(&mut start);
        self.guarded.step_start = start;
        if self.uses.bounds {
            self.begin_division();
        }
        if self.guarded.hold_off > 0 {
            self.guarded.hold_off -= 1;
            return self.redo(guard);
        }
        let solved = self.solve_scheme(self.options.stiffness);
        let disagreement = match solved.and_then(|()| self.update()) {
            Ok(()) => self.system_data.disagreement(),
            Err(StepError::NonFinite { .. }) => f64::INFINITY,
            Err(other) => return Err(other),
        };
        self.tally.see(disagreement);
        match self.parts(disagreement, guard.tolerance) {
            Some(1) => return self.accept_linear(),
            Some(parts) => {
                self.return_to_start();
                self.tally.end(Phase::Update);
                let turns = disagreement > guard.tolerance;
                return self.divide(guard, parts, turns);
            }
            None => {}
        }
        self.return_to_start();
        self.guarded.hold_off = guard.hold;
        self.tally.redone = true;
        // More happens than turns: all that is left of the step.
        self.guarded.division.taken = self.guarded.division.left;
        self.tally.end(Phase::Update);
        self.redo(guard)
    }

    /// The sub-step by implicit ones.
    fn redo(&mut self, guard: Guard) -> Result<(), StepError> {
        let result = self.implicit_step(guard);
        if let Err(StepError::Solve { .. }) = result {
            self.return_to_start();
            self.guarded.hold_off = 0;
            // The past is that of the step that could not be made.
            let dt = self.substep();
            self.system_data
                .rows
                .drive(&self.scene, self.time - dt, self.time);
            self.history.forget(&self.system_data.rows.phi_t);
            self.system_data
                .rows
                .follow_windings(&mut self.scene, self.time);
        }
        result
    }

    fn return_to_start(&mut self) {
        let start = std::mem::take(&mut self.guarded.step_start);
        self.go_back(&start);
        self.guarded.step_start = start;
    }

    /// Implicit sub-steps over one step's time, halved where Newton's method does not converge.
    fn implicit_step(&mut self, guard: Guard) -> Result<(), StepError> {
        let (begin, whole) = (self.time, self.substep());
        let first = whole / guard.substeps as f64;
        let least = first / f64::from(1u32 << guard.halvings);
        let (mut done, mut length) = (0.0, first);
        self.activation
            .take_drift(&self.system_data.rows, &self.multipliers.tension, false);
        // In units of the least length all sums are exact to far less than half of it.
        while whole - done > 0.5 * least {
            let dt = length.min(whole - done);
            let shortest = dt <= 1.5 * least || self.effort.is_spent();
            self.activation.left = 1.0 - (done + dt) / whole;
            self.activation.share = dt / whole;
            // The rows of the last sub-step are those of the step's end, to the last bit.
            let last = whole - (done + dt) <= 0.5 * least;
            let end = begin + if last { whole } else { done + dt };
            let (converged, failed) = match self.implicit_substep(dt, end, guard, shortest) {
                Ok(converged) => (converged, false),
                Err(StepError::NonFinite { .. } | StepError::Solve { .. }) if !shortest => {
                    (false, true)
                }
                Err(error) => return Err(error),
            };
            if failed || !(converged || shortest || self.effort.is_spent()) {
                self.return_to_substep_start();
                length = 0.5 * dt;
                continue;
            }
            self.tally.unconverged_substeps += usize::from(!converged);
            self.tally.implicit_substeps += 1;
            self.progress.stage = Stage::Advanced { dt, implicit: true };
            if self.options.energy_tolerance.is_some() {
                self.account(dt, true);
            }
            done += dt;
            self.time = end;
            self.measure_events();
            let rows = &mut self.system_data.rows;
            if rows.follow_windings(&mut self.scene, self.time) {
                rows.update_state(&self.scene, self.time);
            }
            self.history.forget(&self.system_data.rows.phi_t);
            if converged {
                self.rebound()?;
            } else {
                self.lose_gain(dt);
            }
            self.add_substep(dt);
            length = (2.0 * dt).min(first);
        }
        // Not before: a sub-step that fails takes the whole step back, and drums do not wind back.
        self.accept();
        Ok(())
    }

    /// Velocities of all bodies shrink, at most to zero, until the sub-step that led to them has gained no energy.
    pub(crate) fn lose_gain(&mut self, dt: f64) {
        let gain = self.gained(dt);
        if gain > 0.0 {
            let part = (1.0 - gain / self.scene.kinetic_energy()).max(0.0).sqrt();
            let bodies = &mut self.scene.bodies;
            for i in 0..bodies.len() {
                if bodies.is_dynamic(i) {
                    bodies.velocity[i] *= part;
                    bodies.angular_velocity[i] *= part;
                }
            }
        }
    }

    /// Keeps the present state as that of the beginning of a sub-step.
    pub(crate) fn keep_substep_start(&mut self) {
        let mut start = std::mem::take(&mut self.guarded.substep_start);
        self.keep(&mut start);
        self.guarded.substep_start = start;
    }

    fn keep(&self, state: &mut State) {
        let Multipliers {
            mu, mu_dt, tension, ..
        } = &self.multipliers;
        state.save(&self.scene, self.time, (mu, *mu_dt), tension);
        if self.uses.contacts {
            state.save_contacts(&self.contacts);
        }
    }

    /// Takes back what [`update`](Self::update) did since `saved`.
    pub(crate) fn go_back(&mut self, saved: &State) {
        self.time = saved.restore(&mut self.scene.bodies);
        saved.restore_lengths(&mut self.scene);
        if self.uses.contacts {
            saved.restore_contacts(&mut self.contacts);
        }
        self.multipliers.mu_dt =
            saved.restore_multipliers(&mut self.multipliers.mu, &mut self.multipliers.tension);
        self.progress.stage = Stage::Unsolved;
        self.system_data.rows.update_state(&self.scene, self.time);
    }

    fn return_to_substep_start(&mut self) {
        let start = std::mem::take(&mut self.guarded.substep_start);
        self.go_back(&start);
        self.guarded.substep_start = start;
    }

    /// One implicit Euler step over `dt` to the time `end`: whether Newton's method converged. Those of the `shortest`
    /// search along their passes.
    fn implicit_substep(
        &mut self,
        dt: f64,
        end: f64,
        guard: Guard,
        shortest: bool,
    ) -> Result<bool, StepError> {
        self.keep_substep_start();
        self.system_data.load_velocities(&self.scene.bodies);
        if self.uses.contacts {
            self.find_contacts(dt, false)?;
        }
        self.system_data.rows.drive(&self.scene, self.time, end);
        self.active_set.forget_room();
        self.slip.forget();
        self.slip.update_ratios(&self.scene);
        self.activation.begin(&self.system_data.rows);
        let near = CONVERGED * guard.tolerance;
        for pass in 0..guard.passes {
            self.effort.check(self.time)?;
            let first = pass == 0;
            let kind = if first { Pass::First } else { Pass::Next };
            // Dampers follow their paths from the second pass on.
            let stands = !(first && self.system_data.has_path_dampers());
            self.begin_search(first, dt);
            let disagreement = self.newton_pass(kind, dt, end)?;
            if stands && disagreement <= near {
                return Ok(true);
            }
            if disagreement.is_nan() || self.effort.is_spent() {
                return Ok(false);
            }
            let promised = self.search(first, shortest, dt, end)?;
            if stands && promised <= AT_REST && disagreement <= guard.tolerance {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Changes of angular velocities become those that turn the last iterate further by as much, Δt δω: the rows' J is of
    /// turns from there on, not of angular velocities from the start.
    fn turn_on(&mut self, dt: f64) {
        // The drive of a pass after the first is the velocity change of the last iterate.
        let SystemData { v, dv, drive, .. } = &mut self.system_data;
        let angular = |[.., p, q, r]: [f64; 6]| Vector3::new(p, q, r);
        for i in self.scene.dynamic_bodies() {
            let last = angular(drive.get(i));
            let (turn, change) = ((angular(v.get(i)) + last) * dt, angular(dv.get(i)) - last);
            let further = match gyroscopic::symmetry(&self.scene.bodies.inertia[i]) {
                Some((axis, _)) => {
                    let axis = self.guarded.substep_start.orientation(i) * Vector3::ith_axis(axis);
                    swing_further(&axis, &turn, &change)
                }
                None => turn_further(&turn, &change),
            };
            let ([x, y, z, ..], next) = (dv.get(i), last + further);
            dv.set(i, [x, y, z, next.x, next.y, next.z]);
        }
    }

    /// One solve about the present iterate of q⁺, and the move to the next iterate, where the driven sides are as at the
    /// time `end`.
    pub(crate) fn newton_pass(&mut self, pass: Pass, dt: f64, end: f64) -> Result<f64, StepError> {
        let system_data = &mut self.system_data;
        // The rate whose effect the rows' φ already contains: that of the last iterate.
        let [jv, after] = &mut self.system.in_rows;
        system_data.rows.times_jacobian(&system_data.v, jv);
        system_data.known.fill(0.0);
        if pass == Pass::Next {
            system_data.rates_after(after);
            let rates = after.iter().zip(&system_data.rows.phi_t);
            for (known, (rate, phi_t)) in system_data.known.iter_mut().zip(rates) {
                *known = rate + phi_t;
            }
        }
        system_data
            .geometric
            .update(&system_data.rows, &self.multipliers.tension, None);
        if let Pass::FromRest(_) = pass {
            let bodies = self.scene.bodies.len();
            system_data
                .geometric
                .complete(&system_data.rows, &self.multipliers.tension, bodies);
        }
        // Δt² K (ω_k − ω) with ω_k = 0 at q itself.
        match pass {
            Pass::Next => system_data.drive.copy_from(&system_data.dv),
            _ => system_data
                .drive
                .combine_last((-1.0, &system_data.v), (0.0, &system_data.v)),
        }
        // The inertia is that of the beginning.
        self.guarded.substep_start.restore(&mut self.scene.bodies);
        self.update_inertia(dt, 1.0)?;
        if let Pass::FromRest(acceleration) = pass {
            let done = self
                .system_data
                .add_ballast(&self.multipliers.tension, acceleration);
            done.map_err(|i| self.not_finite(i))?;
        }
        self.system_data
            .soften_transverse_rows(&self.multipliers.tension, true);
        self.system_data
            .weigh(&[Scheme::LinearlyImplicit.weights(); 2]);
        self.slip.take_out(&mut self.system_data);
        let known = std::mem::take(&mut self.system_data.known);
        let jv = &self.system.in_rows[0];
        self.system_data.regularize(dt, jv, Known::Rates(&known));
        if pass == Pass::Next {
            let begun = &self.guarded.search.begun;
            self.system_data.follow_iterate(begun, &known, dt);
        }
        self.system_data.known = known;
        self.activation.leave_drift(&mut self.system_data, dt);
        self.activation.damp_from_taut(&mut self.system_data, dt);
        self.tally.end(Phase::Linearize);
        self.effort.spend_pass(self.system.matrix.values().len());
        self.solve_linearized(dt)?;
        self.system_data
            .update_velocity_change(&self.multipliers.mu);
        self.system_data.predict(dt);
        // φ contains the effect of the known rate.
        let system_data = &mut self.system_data;
        for (predicted, known) in system_data.predicted.iter_mut().zip(&system_data.known) {
            *predicted -= dt * known;
        }
        if pass == Pass::Next {
            self.turn_on(dt);
        }
        self.move_bodies(dt)?;
        self.guarded.substep_start.restore_lengths(&mut self.scene);
        self.slip.move_lengths(&mut self.scene, dt, end);
        self.system_data.rows.update_state(&self.scene, end);
        self.tally.end(Phase::Update);
        Ok(self.system_data.disagreement())
    }
}

/// The change of a turn u that is followed by a small turn δ, exp(δ) exp(u) = exp(u + δ') + O(δ²):
///
/// ```text
/// δ' = δ − ½ u × δ + (1 − (θ/2) cot(θ/2))/θ² u × (u × δ),    θ = |u|
/// ```
pub(crate) fn turn_further(turn: &Vector3<f64>, change: &Vector3<f64>) -> Vector3<f64> {
    let angle = turn.norm();
    if !TURNS.contains(&angle) {
        return *change;
    }
    let half = 0.5 * angle;
    let twice = (1.0 - half / half.tan()) / (angle * angle);
    let across = turn.cross(change);
    change - across * 0.5 + turn.cross(&across) * twice
}

/// Change of a swing, [`turn_further`] of a body with the axis of symmetry a, which only the part
/// of u across a moves ([`crate::gyroscopic`]). With e = u/θ of this part, b = e × a, and a₁ = cos
/// θ a + sin θ b after it,
///
/// ```text
/// δ' = (δ·e) e + θ/sin θ (δ·(e × a₁)) b + (δ·a₁) a
/// ```
pub(crate) fn swing_further(
    axis: &Vector3<f64>,
    turn: &Vector3<f64>,
    change: &Vector3<f64>,
) -> Vector3<f64> {
    let across = turn - axis * axis.dot(turn);
    let angle = across.norm();
    if !TURNS.contains(&angle) {
        return *change;
    }
    let along = across / angle;
    let (sine, cosine) = angle.sin_cos();
    let side = along.cross(axis);
    let turned = axis * cosine + side * sine;
    along * along.dot(change)
        + side * (angle / sine * along.cross(&turned).dot(change))
        + axis * turned.dot(change)
}
