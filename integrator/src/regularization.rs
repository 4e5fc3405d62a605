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
use taut_lanes::{Aligned, Isa, Kernel, Lanes, Level, dispatch};
use taut_model::Linearized;

/// Σ and c of all rows.
#[derive(Debug, Clone)]
pub(crate) struct Regularization {
    /// Σ, ≥ 0; length rows.
    pub(crate) sigma: Aligned,
    /// c; length rows.
    pub(crate) c: Aligned,
    /// d and 1/d of the last step: mostly those of the next.
    divisor: Aligned,
    inverse: Aligned,
    weights: RowWeights,
}

/// The weights of each row.
#[derive(Debug, Clone)]
struct RowWeights {
    /// p, q, s one a row: see [`Weights`].
    next: Aligned,
    now: Aligned,
    before: Aligned,
    /// The kinds' weights that these were made of.
    of: Option<[Weights; 4]>,
}

impl Regularization {
    pub(crate) fn new(rows: usize) -> Self {
        let zeros = Aligned::new(rows);
        Self {
            sigma: zeros.clone(),
            c: zeros.clone(),
            divisor: Aligned::new(rows),
            inverse: Aligned::new(rows),
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

    /// Row `r` takes the share `implicit` of (1, 0, 0), the rest of `kind`.
    pub(crate) fn mix(&mut self, r: usize, kind: Weights, implicit: f64) {
        let (weights, rest) = (&mut self.weights, 1.0 - implicit);
        weights.next[r] = implicit + rest * kind.next;
        weights.now[r] = rest * kind.now;
        weights.before[r] = rest * kind.before;
    }

    /// p − q + s of row `r`: how far ahead of the present state it looks at a constant rate, in steps.
    pub(crate) fn ahead(&self, r: usize) -> f64 {
        let weights = &self.weights;
        weights.next[r] - weights.now[r] + weights.before[r]
    }

    /// c of row `r` for a φ that is larger by `excess`; returns what that changes.
    pub(crate) fn add_violation(
        &mut self,
        r: usize,
        excess: f64,
        dt: f64,
        rows: &Linearized,
    ) -> f64 {
        let change = -excess / (self.weights.next[r] * dt + rows.damping[r]);
        self.c[r] += change;
        change
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
        self.rows_by::<I::X8, 8>(0);
        let whole = self.known.len() / 8 * 8;
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
        let Regularization {
            sigma,
            c,
            divisor,
            inverse,
            weights,
        } = &mut *self.regularization;
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
        let (divisor, inverse) = (
            vectors_mut::<L>(divisor, first, end),
            vectors_mut::<L>(inverse, first, end),
        );
        let rate = vectors_mut::<L>(self.rate, first, end);
        let (dt, frequency) = (V::splat(self.dt), V::splat(1.0 / self.dt));
        for k in 0..sigma.len() {
            let d = V::load(&next[k]).mul_add(dt, V::load(&damping[k]));
            let other = (d - V::load(&divisor[k])).abs();
            if !other.all_below(V::splat(f64::MIN_POSITIVE)) {
                d.store(&mut divisor[k]);
                (V::splat(1.0) / d).store(&mut inverse[k]);
            }
            let inverse = V::load(&inverse[k]);
            (V::load(&compliance[k]) * frequency * inverse).store(&mut sigma[k]);
            let driven = dt.mul_add(V::load(&known[k]), -V::load(&phi[k]));
            let constant = driven.mul_add(inverse, -V::load(&phi_t[k]));
            constant.store(&mut c[k]);
            (constant - V::load(&jv[k])).store(&mut rate[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scheme;
    use taut_model::HoistParams;

    /// Of rows whose φ went through any four values: ε λ + φ̄ + τ r⁺ vanishes, with φ̄ as [`Scheme`] states it, not by its
    /// weights.
    #[test]
    fn rows_are_those_of_the_scheme() {
        let params = HoistParams {
            segments: 3,
            ..HoistParams::default()
        };
        let mut rows = Linearized::new(&params.build().unwrap());
        let (count, dt) = (rows.rows(), 0.1);
        assert!(count % 4 != 0, "whole vectors and a rest");
        let some = |seed: usize| move |r: usize| ((7 * r + 3 * seed) % 11) as f64 / 11.0 + 0.05;
        let of = |seed: usize| -> Vec<f64> { (0..count).map(some(seed)).collect() };
        // φ at t_{n−2} … t_{n+1}; ∂φ/∂t of the last step and of this one.
        let phi = [of(1), of(2), of(3), of(4)];
        let [drive, driven] = [of(5), of(6)];
        let rate = |k: usize| -> Vec<f64> {
            (0..count)
                .map(|r| (phi[k + 1][r] - phi[k][r]) / dt)
                .collect()
        };
        let less =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
        let (before, now, next) = (rate(0), rate(1), rate(2));
        let jv = less(&now, &driven);
        (rows.compliance, rows.damping) = (of(7), of(8));
        rows.phi.clone_from(&phi[2]);
        rows.phi_t.clone_from(&drive);
        let scheme = Scheme::ThirdDifference {
            a: 0.7,
            gamma: -0.15,
        };
        for scheme in [Scheme::LinearlyImplicit, Scheme::Spook, scheme] {
            let mut regularization = Regularization::new(count);
            regularization.weigh(&[scheme.weights(); 4], |_| 0);
            let [mut at, mut known, mut rest] = [of(0), of(0), of(0)];
            regularization.combine_rates((&jv, &driven), &before, &mut at, &mut known);
            regularization.update(dt, &rows, &known, &jv, &mut rest);
            for r in 0..count {
                let [p0, p1, p2, p3] = std::array::from_fn(|k| phi[k][r]);
                let taken = match scheme {
                    Scheme::LinearlyImplicit => p3,
                    Scheme::Spook => 0.25 * (p1 + 2.0 * p2 + p3),
                    Scheme::ThirdDifference { a, gamma } => {
                        p2 + a * (p3 - 2.0 * p2 + p1) + gamma * (p3 - 3.0 * p2 + 3.0 * p1 - p0)
                    }
                };
                let mu = (regularization.c[r] - (next[r] - drive[r])) / regularization.sigma[r];
                let left = rows.compliance[r] * mu / dt + taken + rows.damping[r] * next[r];
                assert!(left.abs() < 1e-13, "{scheme}, row {r}: {left}");
                assert!((rest[r] - (regularization.c[r] - jv[r])).abs() < 1e-13);
            }
        }
    }
}
