//! From compliance to the linear system: the diagonal Σ and the constant c of J v⁺ + Σ μ = c.
//!
//! ε λ = −(φ + τ φ̇) at the end of the step, with φ⁺ = φ + Δt (J v⁺ + ∂φ/∂t) and μ = Δt λ. This is the one place where
//! a scheme's weights are computed.

use crate::Scheme;
use taut_model::Linearized;

/// Σ and c of all rows.
#[derive(Debug, Clone)]
pub(crate) struct Regularization {
    /// Σ, ≥ 0; length rows.
    pub(crate) sigma: Vec<f64>,
    /// c; length rows.
    pub(crate) c: Vec<f64>,
}

impl Regularization {
    pub(crate) fn new(rows: usize) -> Self {
        Self {
            sigma: vec![0.0; rows],
            c: vec![0.0; rows],
        }
    }

    /// Σ = Υ ε/Δt² and c = −Υ φ/Δt − ∂φ/∂t with Υ = 1/(1 + τ/Δt), [SL (8)–(11)] with damping.
    pub(crate) fn update(&mut self, scheme: Scheme, dt: f64, rows: &Linearized) {
        match scheme {
            Scheme::LinearlyImplicit => {
                for r in 0..self.sigma.len() {
                    let upsilon = 1.0 / (1.0 + rows.damping[r] / dt);
                    self.sigma[r] = upsilon * rows.compliance[r] / (dt * dt);
                    self.c[r] = -upsilon * rows.phi[r] / dt - rows.phi_t[r];
                }
            }
        }
    }
}
