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

    /// r_n = J v + ∂φ/∂t of the last step into `now`, and h = q r_n − s r_{n−1} with each row's weights into `known`; all
    /// of length rows.
    pub(crate) fn combine_rates(
        &self,
        (jv, phi_t): (&[f64], &[f64]),
        before: &[f64],
        now: &mut [f64],
        known: &mut [f64],
    ) {
        let weights = &self.weights;
        dispatch(
            Level::best(),
            Rates {
                jv,
                phi_t,
                before,
                weights,
                now,
                known,
            },
        );
    }

    /// Σ and c for what is `known` (h), and c − J v for the rates `jv` into `rate`.
    pub(crate) fn update(
        &mut self,
        dt: f64,
        rows: &Linearized,
        known: &[f64],
        jv: &[f64],
        rate: &mut [f64],
    ) {
        let update = Update {
            dt,
            rows,
            known,
            jv,
            regularization: self,
            rate,
        };
        dispatch(Level::best(), update);
    }
}

/// See [`Regularization::combine_rates`].
struct Rates<'a> {
    jv: &'a [f64],
    phi_t: &'a [f64],
    before: &'a [f64],
    weights: &'a RowWeights,
    now: &'a mut [f64],
    known: &'a mut [f64],
}

impl Kernel for Rates<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let weights = self.weights.now.iter().zip(&self.weights.before);
        let rates = self.jv.iter().zip(self.phi_t).zip(self.before);
        let to = self.now.iter_mut().zip(self.known);
        for ((now, known), (((jv, phi_t), before), (q, s))) in to.zip(rates.zip(weights)) {
            *now = jv + phi_t;
            *known = q * *now - s * before;
        }
    }
}

struct Update<'a> {
    dt: f64,
    rows: &'a Linearized,
    known: &'a [f64],
    jv: &'a [f64],
    regularization: &'a mut Regularization,
    rate: &'a mut [f64],
}

impl Kernel for Update<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(mut self) {
        self.rows_by::<I::X4, 4>(0);
        let whole = self.known.len() / 4 * 4;
        self.rows_by::<I::X1, 1>(whole);
    }
}

/// As many vectors of `L` numbers as there are whole ones from `first` to `end`.
#[inline(always)]
fn vectors<const L: usize>(of: &[f64], first: usize, end: usize) -> &[[f64; L]] {
    of[first..end].as_chunks().0
}

/// The same, to be written.
#[inline(always)]
fn vectors_mut<const L: usize>(of: &mut [f64], first: usize, end: usize) -> &mut [[f64; L]] {
    of[first..end].as_chunks_mut().0
}

impl Update<'_> {
    /// The rows from `first` on, as far as they fill vectors of `L` lanes.
    #[inline(always)]
    fn rows_by<V: Lanes, const L: usize>(&mut self, first: usize) {
        let Self { rows, known, .. } = self;
        let end = known.len();
        let Regularization { sigma, c, weights } = &mut *self.regularization;
        let next = vectors::<L>(&weights.next, first, end);
        let damping = vectors::<L>(&rows.damping, first, end);
        let compliance = vectors::<L>(&rows.compliance, first, end);
        let (phi, phi_t) = (
            vectors::<L>(&rows.phi, first, end),
            vectors::<L>(&rows.phi_t, first, end),
        );
        let (known, jv) = (
            vectors::<L>(known, first, end),
            vectors::<L>(self.jv, first, end),
        );
        let sigma = vectors_mut::<L>(sigma, first, end);
        let c = vectors_mut::<L>(c, first, end);
        let rate = vectors_mut::<L>(self.rate, first, end);
        let (dt, frequency) = (V::splat(self.dt), V::splat(1.0 / self.dt));
        for k in 0..sigma.len() {
            let divisor = V::load(&next[k]).mul_add(dt, V::load(&damping[k]));
            let inverse = V::splat(1.0) / divisor;
            (V::load(&compliance[k]) * frequency * inverse).store(&mut sigma[k]);
            let driven = dt.mul_add(V::load(&known[k]), -V::load(&phi[k]));
            let constant = driven.mul_add(inverse, -V::load(&phi_t[k]));
            constant.store(&mut c[k]);
            (constant - V::load(&jv[k])).store(&mut rate[k]);
        }
    }
}
