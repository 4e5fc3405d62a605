//! From compliance to the linear system: the diagonal Σ and the constant c of J v⁺ + Σ μ = c.
//!
//! A step takes the rows at φ̄ = φ + Δt (p r⁺ − h) with r⁺ = J v⁺ + ∂φ/∂t, the scheme's weight p and what is known, h
//! (of past rates, or of the last Newton pass). With ε λ = −(φ̄ + τ r⁺) and μ = Δt λ,
//!
//! ```text
//! Σ = ε/(Δt d),    c = (Δt h − φ)/d − ∂φ/∂t,    d = p Δt + τ
//! ```
//!
//! which for p = 1, h = 0 is [SL (8)–(11)] with Υ = 1/(1 + τ/Δt). This is the one place where it is computed.

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

    /// Σ and c for each row's weight `next` (p) and `known` (h).
    pub(crate) fn update(
        &mut self,
        next: impl Fn(usize) -> f64,
        dt: f64,
        rows: &Linearized,
        known: &[f64],
    ) {
        for (r, known) in known.iter().enumerate() {
            let d = next(r) * dt + rows.damping[r];
            self.sigma[r] = rows.compliance[r] / (dt * d);
            self.c[r] = (dt * known - rows.phi[r]) / d - rows.phi_t[r];
        }
    }
}
