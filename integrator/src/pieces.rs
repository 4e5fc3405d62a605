//! What the linear system of a step is made of, and its residual.
//!
//! The unknown is the velocity *change* Δv together with the impulses μ. Both are kept through the refinement, and its
//! residual comes from the pieces,
//!
//! ```text
//! Δv ← Δv + M̃⁻¹ (Δt f + Jᵀ μ − M̃ Δv),    r = (c − J v) − J Δv − Σ μ
//! ```
//!
//! not from the assembled S, whose diagonal has rounded small inverse masses away. With μ = Δv = 0 the same two lines
//! give the right-hand side of the Schur form.

use crate::geometric::{Geometric, wrench};
use crate::inertia::Inertia;
use crate::products::{add_transposed, subtract_jacobian};
use crate::regularization::Regularization;
use nalgebra::Vector3;
use taut_model::{Bodies, Linearized, Scene};

/// The pieces M̃, J, Σ, c, Δt f, and the velocity change that goes with the present multipliers.
pub(crate) struct Pieces {
    pub(crate) rows: Linearized,
    pub(crate) geometric: Geometric,
    pub(crate) inertia: Inertia,
    pub(crate) regularization: Regularization,
    /// W = J M̃⁻¹, laid out as the Jacobian.
    pub(crate) w: Vec<f64>,
    /// c − J v, one a row.
    pub(crate) rate: Vec<f64>,
    /// v at the beginning of the step, 6 numbers a body.
    pub(crate) v: Vec<f64>,
    /// Δv, 6 numbers a body.
    pub(crate) dv: Vec<f64>,
    /// What a scheme knows of the rates beforehand (h of [`crate::regularization`]), one a row.
    pub(crate) known: Vec<f64>,
    /// φ at the end of the step as the linearisation predicts it, one a row.
    pub(crate) predicted: Vec<f64>,
    /// An impulse or a momentum, 6 numbers a body.
    impulse: Vec<f64>,
}

impl Pieces {
    pub(crate) fn new(scene: &Scene) -> Self {
        let rows = Linearized::new(scene);
        let (count, bodies) = (rows.rows(), 6 * scene.bodies.len());
        Self {
            geometric: Geometric::new(scene, &rows),
            inertia: Inertia::new(&scene.bodies),
            regularization: Regularization::new(count),
            w: vec![0.0; rows.jacobian.len()],
            rate: vec![0.0; count],
            v: vec![0.0; bodies],
            dv: vec![0.0; bodies],
            known: vec![0.0; count],
            predicted: vec![0.0; count],
            impulse: vec![0.0; bodies],
            rows,
        }
    }

    /// Copies the velocities into `v`.
    pub(crate) fn load_velocities(&mut self, bodies: &Bodies) {
        for (i, v) in self.v.chunks_exact_mut(6).enumerate() {
            v[..3].copy_from_slice(bodies.velocity[i].as_slice());
            v[3..].copy_from_slice(bodies.angular_velocity[i].as_slice());
        }
    }

    /// Angular velocity of body `i` in `v`.
    pub(crate) fn angular_velocity(&self, i: usize) -> Vector3<f64> {
        angular(&self.v, i)
    }

    /// Σ and c for the scheme's weight `next` and what is `known`, then c − J v; Δv is set to zero.
    pub(crate) fn regularize(&mut self, next: f64, dt: f64) {
        self.regularization
            .update(next, dt, &self.rows, &self.known);
        self.rate.copy_from_slice(&self.regularization.c);
        subtract_jacobian(&self.rows, &self.v, &mut self.rate);
        self.dv.fill(0.0);
    }

    /// M̃ of every body grows by what the constraint forces of multipliers `lambda` would move with `acceleration`
    /// (m/s²), about every axis as at the distance of their lever arms. `Err(body)` where the inertia has no inverse.
    pub(crate) fn add_ballast(&mut self, lambda: &[f64], acceleration: f64) -> Result<(), usize> {
        let Self { rows, inertia, .. } = self;
        for (slot, lever) in rows.slots.iter().zip(&rows.levers) {
            let (force, torque) = wrench(rows, slot, lambda);
            let (force, arm) = (force.norm(), lever.norm());
            let angular = (force * arm + torque.norm()) * arm;
            if !inertia.add_ballast(slot.body, force / acceleration, angular / acceleration) {
                return Err(slot.body);
            }
        }
        Ok(())
    }

    /// Δv ← Δv + M̃⁻¹ (Δt f + Jᵀ μ − M̃ Δv).
    pub(crate) fn update_velocity_change(&mut self, mu: &[f64]) {
        let inertia = &self.inertia;
        self.impulse.copy_from_slice(&inertia.impulse);
        add_transposed(&self.rows, mu, &mut self.impulse);
        let (impulses, _) = self.impulse.as_chunks_mut::<6>();
        let (dvs, _) = self.dv.as_chunks_mut::<6>();
        for (i, (p, dv)) in impulses.iter_mut().zip(dvs).enumerate() {
            let mut buffer = [0.0; 6];
            inertia.apply(i, dv, &mut buffer);
            for (p, momentum) in p.iter_mut().zip(&buffer) {
                *p -= momentum;
            }
            inertia.apply_inverse(i, p, &mut buffer);
            for (dv, correction) in dv.iter_mut().zip(&buffer) {
                *dv += correction;
            }
        }
    }

    /// r = (c − J v) − J Δv − Σ μ with the Δv that goes with μ.
    pub(crate) fn residual(&mut self, mu: &[f64], r: &mut [f64]) {
        self.update_velocity_change(mu);
        for (r, ((rate, sigma), mu)) in r
            .iter_mut()
            .zip(self.rate.iter().zip(&self.regularization.sigma).zip(mu))
        {
            *r = rate - sigma * mu;
        }
        subtract_jacobian(&self.rows, &self.dv, r);
    }

    /// φ + Δt (J (v + Δv) + ∂φ/∂t − `base`) into `predicted`, where `base` is a rate already contained in φ.
    pub(crate) fn predict(&mut self, dt: f64, base: impl Fn(usize) -> f64) {
        let Self {
            rows,
            v,
            dv,
            predicted,
            ..
        } = self;
        predicted.fill(0.0);
        subtract_jacobian(rows, v, predicted);
        subtract_jacobian(rows, dv, predicted);
        for (r, p) in predicted.iter_mut().enumerate() {
            *p = rows.phi[r] + dt * (rows.phi_t[r] - *p - base(r));
        }
    }

    /// Largest distance of a gap from its prediction, over the longer lever arm of its constraint. NaN where a gap is.
    pub(crate) fn disagreement(&self) -> f64 {
        let rows = &self.rows;
        let mut worst = 0.0_f64;
        for c in 0..rows.constraints() {
            let levers = &rows.levers[rows.slot_range(c)];
            let lever = levers.iter().map(Vector3::norm_squared).fold(0.0, f64::max);
            if lever == 0.0 {
                // Linear in the positions: there is nothing to disagree about.
                continue;
            }
            let range = rows.row_range(c);
            let both = rows.phi[range.clone()].iter().zip(&self.predicted[range]);
            let gap: f64 = both.take(3).map(|(a, b)| (a - b) * (a - b)).sum();
            let relative = gap / lever;
            if relative > worst || relative.is_nan() {
                worst = relative;
            }
        }
        worst.sqrt()
    }
}

/// The angular part of body `i` in a vector of 6 numbers a body.
pub(crate) fn angular(v: &[f64], i: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&v[6 * i + 3..6 * i + 6])
}
