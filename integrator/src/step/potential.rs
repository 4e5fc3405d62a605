//! Incremental potential of an implicit Euler step, and the line search along its Newton steps.
//!
//! The guard's equations, M (v⁺ − v) = Δt f + Jᵀ μ and ε μ/Δt + g = 0 with g = φ⁺ + τ (φ⁺ − φ₀)/Δt, are those of a stationary
//!
//! ```text
//! Φ(v⁺) = ½ |v⁺ − v|²_M − Δt f·(v⁺ − v) + Σ Ψ(g) Δt/(Δt + τ)
//! Ψ(g) = max over lo ≤ λ' ≤ hi of  −λ' g − ½ ε λ'² − ½ (e − ε)(λ' − λ)²        ∂Ψ/∂g = −λ'
//! ```
//!
//! since ∂g/∂φ⁺ = (Δt + τ)/Δt and ∂φ⁺/∂v⁺ = Δt J, but for a rotation that is not about the axis of the last and the dampers of
//! angles, which take J v⁺ + ∂φ/∂t: both are of second order in the angles. With e = ε the term of a row is the elastic energy,
//! cut off where the force is, with what the damper takes:
//!
//! ```text
//! g²/(2ε) Δt/(Δt + τ) = φ⁺²/(2ε) + τ (φ⁺ − φ₀)²/(2 ε Δt) − τ φ₀²/(2 ε (Δt + τ))
//! ```
//!
//! With more e it is the augmented Lagrangian about the multipliers
//! λ of the last solve: stationary in the same place, and finite for rigid rows. e is at least [`SOFTEST`] of
//! Δt² J M̃⁻¹ Jᵀ, so that the bend of a stiff row's path does not stop the search. A row of speeds takes Δt (J v⁺ + ∂φ/∂t)
//! for g.
//!
//! The system of a pass is positive definite, so that its step leads down from where it starts, and far from there it may
//! lead anywhere. In sub-steps that cannot be halved any more the step is halved until Φ is less, at most four times.
//!
//! Less of Φ is not yet less energy. A sub-step has gained
//!
//! ```text
//! ½ |v⁺|²_M − ½ |v|²_M − Δt f·v⁺ + Σ (Ψ(g) − Ψ(g₀)) Δt/(Δt + τ)
//! ```
//!
//! with g₀ where only driven bodies have moved: no less than their work, much more for a rigid motor of speed. One that
//! converges loses where the potential is convex.

use crate::StepError;
use crate::active_set::response_of;
use crate::step::Step;
use crate::system_data::SystemData;
use nalgebra::Vector3;
use taut_model::BodyVectors;
use taut_model::linearized::dot;

/// Least e over Δt² J M̃⁻¹ Jᵀ.
const SOFTEST: f64 = 1e-3;

/// A part of the promised decrease that is enough, and what of Φ is rounding.
const ENOUGH: f64 = 1e-4;
const ROUNDING: f64 = 1e-13;

/// The search ends with a part of the step below this one.
const SHORTEST: f64 = 0.1;

/// The iterates between which a search goes.
#[derive(Debug, Clone)]
pub(crate) struct Search {
    /// e, one a row.
    soft: Vec<f64>,
    /// φ₀, one a row.
    pub(crate) begun: Vec<f64>,
    /// Start of a pass: its φ, g and Δv.
    phi: Vec<f64>,
    gaps: Vec<f64>,
    from: BodyVectors,
    /// Δv of the pass's solve, and g at a part of the way there.
    to: BodyVectors,
    gaps_there: Vec<f64>,
    /// g₀, and the kinetic energy where the sub-step starts \[J].
    gaps_at_rest: Vec<f64>,
    kinetic: f64,
    /// Size of Φ where the sub-step starts \[J].
    scale: f64,
}

impl Search {
    pub(crate) fn new(rows: usize, bodies: usize) -> Self {
        let (zeros, none) = (vec![0.0; rows], BodyVectors::new(bodies));
        Self {
            soft: zeros.clone(),
            begun: zeros.clone(),
            phi: zeros.clone(),
            gaps: zeros.clone(),
            from: none.clone(),
            to: none,
            gaps_there: zeros.clone(),
            gaps_at_rest: zeros,
            kinetic: 0.0,
            scale: 0.0,
        }
    }

    fn soften(&mut self, system_data: &SystemData, dt: f64) {
        let rows = &system_data.rows;
        self.soft.fill(0.0);
        for (s, slot) in rows.slots.iter().enumerate() {
            let soft = &mut self.soft[rows.row_range(slot.constraint)];
            for (soft, j) in soft.iter_mut().zip(rows.block(s).rows()) {
                *soft += response_of(system_data, slot.body, j);
            }
        }
        for c in 0..rows.constraints() {
            // The rows of a gap are along the axes of the world: their mean does not depend on these.
            let range = rows.row_range(c);
            let is_length = |r: &usize| system_data.is_length(*r);
            let lengths = range.clone().take(3).take_while(is_length).count();
            let lengths = &mut self.soft[range.start..range.start + lengths];
            let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
            lengths.fill(mean);
        }
        for (soft, own) in self.soft.iter_mut().zip(&rows.compliance) {
            *soft = own.max(SOFTEST * dt * dt * *soft);
        }
    }
}

/// Ψ(g) and λ' of a row of compliance `own`, about the force `lambda`.
fn energy(g: f64, lambda: f64, own: f64, soft: f64, limits: (f64, f64)) -> (f64, f64) {
    if soft == 0.0 {
        // It holds nothing that moves.
        return (0.0, 0.0);
    }
    let force = (lambda - (g + own * lambda) / soft).clamp(limits.0, limits.1);
    let off = force - lambda;
    let value = -force * g - 0.5 * own * force * force - 0.5 * (soft - own) * off * off;
    (value, force)
}

impl Step {
    /// Before a pass about the present iterate, or, before the first one, about the beginning: there v⁺ = 0, but for
    /// driven bodies.
    pub(crate) fn begin_search(&mut self, first: bool, dt: f64) {
        let (system_data, bodies) = (&mut self.system_data, &self.scene.bodies);
        if first {
            system_data
                .dv
                .combine((-1.0, &system_data.v), (0.0, &system_data.v));
            for i in (0..bodies.len()).filter(|i| !bodies.is_dynamic(*i)) {
                system_data.dv.set(i, [0.0; 6]);
            }
        }
        self.guarded.search.from.copy_from(&system_data.dv);
        if first {
            self.guarded
                .search
                .begun
                .copy_from_slice(&system_data.rows.phi);
        }
        let [mut phi, mut gaps] =
            [&mut self.guarded.search.phi, &mut self.guarded.search.gaps].map(std::mem::take);
        phi.copy_from_slice(&self.system_data.rows.phi);
        self.gaps(&mut gaps, dt);
        if first {
            // φ of the end, which the rows do not hold yet: `gaps` left the rates.
            for (r, rate) in self.system.in_rows[1].iter().enumerate() {
                phi[r] += dt * rate;
                if !self.system_data.is_speed(r) {
                    gaps[r] += (dt + self.system_data.path_damping(r)) * rate;
                }
            }
        }
        if first {
            self.guarded.search.gaps_at_rest.copy_from_slice(&gaps);
            self.guarded.search.kinetic = self.scene.kinetic_energy();
        }
        (self.guarded.search.phi, self.guarded.search.gaps) = (phi, gaps);
    }

    /// After a pass: what it promised. One that is `judged` goes back from the iterate that it led to until Φ is less than
    /// where it came from; by halves, which pass no rounding on as the least of a parabola does.
    ///
    /// # Errors
    /// [`StepError::NonFinite`].
    pub(crate) fn search(
        &mut self,
        first: bool,
        judged: bool,
        dt: f64,
        end: f64,
    ) -> Result<f64, StepError> {
        if first {
            self.guarded.search.soften(&self.system_data, dt);
        }
        self.guarded.search.to.copy_from(&self.system_data.dv);
        let slope = self.slope(dt);
        let (begin, size) =
            self.potential(&self.guarded.search.from, &self.guarded.search.gaps, dt);
        if first {
            self.guarded.search.scale = size;
        }
        // An ascent is no rest.
        let promised = if slope <= 0.0 {
            -slope / self.guarded.search.scale.max(f64::MIN_POSITIVE)
        } else {
            f64::INFINITY
        };
        if !judged {
            return Ok(promised);
        }
        let mut part = 1.0;
        loop {
            let mut gaps = std::mem::take(&mut self.guarded.search.gaps_there);
            self.gaps(&mut gaps, dt);
            let change = self.potential(&self.system_data.dv, &gaps, dt).0 - begin;
            self.guarded.search.gaps_there = gaps;
            let enough = ENOUGH * part * slope.min(0.0) + ROUNDING * size;
            if change <= enough || part < SHORTEST {
                return Ok(promised);
            }
            part *= 0.5;
            let Search { from, to, .. } = &self.guarded.search;
            let dv = &mut self.system_data.dv;
            dv.combine((1.0 - part, from), (part, to));
            self.guarded.substep_start.restore(&mut self.scene.bodies);
            self.move_bodies(dt)?;
            self.system_data.rows.update_state(&self.scene, end);
        }
    }

    /// Energy that the sub-step to the present iterate has gained \[J].
    pub(crate) fn gained(&mut self, dt: f64) -> f64 {
        let mut gaps = std::mem::take(&mut self.guarded.search.gaps_there);
        self.gaps(&mut gaps, dt);
        let bodies = &self.scene.bodies;
        let mut sum = self.scene.kinetic_energy() - self.guarded.search.kinetic;
        for i in self.scene.dynamic_bodies() {
            let work = bodies.velocity[i]
                .dot(&(self.scene.gravity * bodies.mass[i] + bodies.force[i]))
                + bodies.angular_velocity[i].dot(&bodies.torque[i]);
            sum -= dt * work;
        }
        self.of_rows(&gaps, dt, |_, value, _| sum += value);
        self.of_rows(&self.guarded.search.gaps_at_rest, dt, |_, value, _| {
            sum -= value
        });
        self.guarded.search.gaps_there = gaps;
        sum
    }

    /// g of the present iterate; leaves the rates J v⁺ + ∂φ/∂t in the second of `in_rows`.
    fn gaps(&mut self, gaps: &mut [f64], dt: f64) {
        let (system_data, [_, rates]) = (&mut self.system_data, &mut self.system.in_rows);
        system_data.rates_after(rates);
        let rows = &system_data.rows;
        for (r, rate) in rates.iter_mut().enumerate() {
            *rate += rows.phi_t[r];
            let along = system_data.path_damping(r);
            gaps[r] = if system_data.is_speed(r) {
                dt * *rate
            } else {
                let grown = rows.phi[r] - self.guarded.search.begun[r];
                rows.phi[r] + along * grown / dt + (rows.damping[r] - along) * *rate
            };
        }
        self.activation.leave_gaps(rows, gaps, dt);
    }

    /// Φ of a velocity change, and the sum of the sizes of its terms \[J].
    fn potential(&self, dv: &BodyVectors, gaps: &[f64], dt: f64) -> (f64, f64) {
        let (mut sum, mut size) = (0.0, 0.0);
        let mut add = |term: f64| {
            sum += term;
            size += term.abs();
        };
        for i in self.scene.dynamic_bodies() {
            add(dot(&dv.get(i), &self.lacking(i, dv, 0.5, dt)));
        }
        self.of_rows(gaps, dt, |_, value, _| add(value));
        (sum, size)
    }

    /// Derivative of Φ by the part of the step, where the step starts.
    fn slope(&self, dt: f64) -> f64 {
        let (search, mut slope) = (&self.guarded.search, 0.0);
        for i in self.scene.dynamic_bodies() {
            let (from, to) = (search.from.get(i), search.to.get(i));
            let step = std::array::from_fn(|k| to[k] - from[k]);
            slope += dot(&step, &self.lacking(i, &search.from, 1.0, dt));
        }
        // g changes (Δt + τ)/Δt times as much as φ does.
        self.of_rows(&search.gaps, dt, |r, _, force| {
            slope -= force * (self.system_data.predicted[r] - search.phi[r]);
        });
        slope
    }

    /// Ψ Δt/(Δt + τ) and λ' of each row, but for those that are a filter alone.
    fn of_rows(&self, gaps: &[f64], dt: f64, mut of: impl FnMut(usize, f64, f64)) {
        let rows = &self.system_data.rows;
        let mut bounds = rows.bounds.iter().peekable();
        for (r, g) in gaps.iter().enumerate() {
            let bound = bounds.next_if(|bound| bound.row == r);
            if self.system_data.is_transverse(r) {
                continue;
            }
            let limits = bound.map_or((f64::NEG_INFINITY, f64::INFINITY), |b| (b.lower, b.upper));
            let (own, soft) = (rows.compliance[r], self.guarded.search.soft[r]);
            let (value, force) = energy(*g, self.multipliers.tension[r], own, soft, limits);
            of(r, value * dt / (dt + rows.damping[r]), force);
        }
    }

    /// x M Δv − Δt f of body `i`, with M of the beginning.
    fn lacking(&self, i: usize, dv: &BodyVectors, x: f64, dt: f64) -> [f64; 6] {
        let bodies = &self.scene.bodies;
        let ([a, b, c, p, q, r], mass) = (dv.get(i), bodies.mass[i]);
        let turned = self.guarded.substep_start.orientation(i);
        let spin = turned * (bodies.inertia[i] * (turned.inverse() * Vector3::new(p, q, r)));
        let linear = Vector3::new(a, b, c) * (x * mass);
        let linear = linear - (self.scene.gravity * mass + bodies.force[i]) * dt;
        let angular = spin * x - bodies.torque[i] * dt;
        [
            linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
        ]
    }
}

#[cfg(test)]
mod tests;
