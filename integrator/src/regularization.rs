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

use crate::options::Weights;
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};
use taut_model::Linearized;

/// Σ and c of all rows.
#[derive(Debug, Clone)]
pub(crate) struct Regularization {
    /// Σ, ≥ 0; length rows.
    pub(crate) sigma: Vec<f64>,
    /// c; length rows.
    pub(crate) c: Vec<f64>,
    weights: RowWeights,
}

/// The weights of each row.
#[derive(Debug, Clone)]
struct RowWeights {
    /// p, q, s one a row: see [`Weights`].
    next: Vec<f64>,
    now: Vec<f64>,
    before: Vec<f64>,
    /// The kinds' weights that these were made of.
    of: Option<[Weights; 4]>,
}

impl Regularization {
    pub(crate) fn new(rows: usize) -> Self {
        let zeros = vec![0.0; rows];
        Self {
            sigma: zeros.clone(),
            c: zeros.clone(),
            weights: RowWeights {
                next: zeros.clone(),
                now: zeros.clone(),
                before: zeros,
                of: None,
            },
        }
    }

    /// Takes the weights of the rows: those of each row's kind.
    pub(crate) fn weigh(&mut self, of: &[Weights; 4], kind: impl Fn(usize) -> usize) {
        let weights = &mut self.weights;
        if weights.of.as_ref() == Some(of) {
            return;
        }
        for r in 0..weights.next.len() {
            let w = of[kind(r)];
            (weights.next[r], weights.now[r], weights.before[r]) = (w.next, w.now, w.before);
        }
        weights.of = Some(*of);
    }

    /// h = q r_n − s r_{n−1} with each row's weights; all of length rows.
    pub(crate) fn combine_rates(&self, now: &[f64], before: &[f64], known: &mut [f64]) {
        let (q, s) = (&self.weights.now, &self.weights.before);
        let rates = now.iter().zip(before).zip(q.iter().zip(s));
        for (known, ((now, before), (q, s))) in known.iter_mut().zip(rates) {
            *known = q * now - s * before;
        }
    }

    /// Σ and c for what is `known` (h).
    pub(crate) fn update(&mut self, dt: f64, rows: &Linearized, known: &[f64]) {
        let update = Update {
            dt,
            rows,
            known,
            regularization: self,
        };
        dispatch(Level::best(), update);
    }
}

struct Update<'a> {
    dt: f64,
    rows: &'a Linearized,
    known: &'a [f64],
    regularization: &'a mut Regularization,
}

impl Kernel for Update<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(mut self) {
        let rows = self.known.len();
        let even = rows - rows % 4;
        for r in (0..even).step_by(4) {
            self.rows_at::<I::X4>(r);
        }
        for r in even..rows {
            self.rows_at::<I::X1>(r);
        }
    }
}

impl Update<'_> {
    /// A vector's worth of rows from `r` on.
    #[inline(always)]
    fn rows_at<V: Lanes>(&mut self, r: usize) {
        let Self {
            rows,
            known,
            regularization: Regularization { sigma, c, weights },
            ..
        } = self;
        let at = r..r + V::LANES;
        let dt = V::splat(self.dt);
        let next = V::load(&weights.next[at.clone()]);
        let inverse = V::splat(1.0) / next.mul_add(dt, V::load(&rows.damping[at.clone()]));
        let compliance = V::load(&rows.compliance[at.clone()]);
        (compliance * V::splat(1.0 / self.dt) * inverse).store(&mut sigma[at.clone()]);
        let known = V::load(&known[at.clone()]);
        let (phi, phi_t) = (
            V::load(&rows.phi[at.clone()]),
            V::load(&rows.phi_t[at.clone()]),
        );
        let driven = dt.mul_add(known, -phi);
        driven.mul_add(inverse, -phi_t).store(&mut c[at]);
    }
}
