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

/// Σ of all rows.
#[derive(Debug, Clone)]
pub(crate) struct Regularization {
    /// Σ, ≥ 0; length rows.
    pub(crate) sigma: Aligned,
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
    /// Weights that these were made of.
    of: Option<[Weights; 2]>,
}

impl Regularization {
    pub(crate) fn new(rows: usize) -> Self {
        let zeros = Aligned::new(rows);
        Self {
            sigma: zeros.clone(),
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

    /// Takes the weights of the rows, `of` all and of the transverse ones.
    pub(crate) fn weigh(&mut self, of: &[Weights; 2], is_transverse: impl Fn(usize) -> bool) {
        let weights = &mut self.weights;
        if weights.of.as_ref() == Some(of) {
            return;
        }
        for r in 0..weights.next.len() {
            let w = of[usize::from(is_transverse(r))];
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

    /// Change of c of row `r` if φ grows by `excess`.
    pub(crate) fn violation(&self, r: usize, excess: f64, dt: f64, rows: &Linearized) -> f64 {
        -excess / (self.weights.next[r] * dt + rows.damping[r])
    }

    /// Rate r⁺ that row `r` asks for at φ = 0 without its damper, after the rates r_n, `now`, and r_{n−1}, `before`.
    pub(crate) fn known_rate(&self, r: usize, now: f64, before: f64) -> f64 {
        let weights = &self.weights;
        (weights.now[r] * now - weights.before[r] * before) / weights.next[r]
    }

    /// Σ of a step `dt` long, and c − J v into `rate`, for the rates `jv` = J v and what is `known`; all of length rows.
    pub(crate) fn update(
        &mut self,
        dt: f64,
        rows: &Linearized,
        jv: &[f64],
        known: Known<'_>,
        rate: &mut [f64],
    ) {
        let update = Update {
            dt,
            rows,
            jv,
            known,
            regularization: self,
            rate,
        };
        dispatch(Level::best(), update);
    }
}

/// Rates known before the solve, one a row.
pub(crate) enum Known<'a> {
    /// h itself.
    Rates(&'a [f64]),
    /// h = q r_n − s r_{n−1} with each row's weights.
    Past {
        /// ∂φ/∂t of the last step.
        phi_t: &'a [f64],
        /// r_{n−1}.
        before: &'a [f64],
        /// Takes r_n = J v + ∂φ/∂t of the last step.
        now: &'a mut [f64],
    },
}

struct Update<'a> {
    dt: f64,
    rows: &'a Linearized,
    jv: &'a [f64],
    known: Known<'a>,
    regularization: &'a mut Regularization,
    rate: &'a mut [f64],
}

impl Kernel for Update<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(mut self) {
        self.rows_by::<I::X8, 8>(0);
        let whole = self.jv.len() / 8 * 8;
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
        let end = self.jv.len();
        let Regularization {
            sigma,
            divisor,
            inverse,
            weights,
        } = &mut *self.regularization;
        let next = vectors::<L>(&weights.next, first, end);
        let (of_now, of_before) = (
            vectors::<L>(&weights.now, first, end),
            vectors::<L>(&weights.before, first, end),
        );
        let damping = vectors::<L>(&rows.damping, first, end);
        let compliance = vectors::<L>(&rows.compliance, first, end);
        let (phi, phi_t) = (
            vectors::<L>(&rows.phi, first, end),
            vectors::<L>(&rows.phi_t, first, end),
        );
        let jv = vectors::<L>(self.jv, first, end);
        let (known, driven, now) = match known {
            Known::Rates(h) => (
                vectors::<L>(h, first, end),
                [].as_slice(),
                [].as_mut_slice(),
            ),
            Known::Past { phi_t, before, now } => (
                vectors::<L>(before, first, end),
                vectors::<L>(phi_t, first, end),
                vectors_mut::<L>(now, first, end),
            ),
        };
        let sigma = vectors_mut::<L>(sigma, first, end);
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
            let (jv, mut h) = (V::load(&jv[k]), V::load(&known[k]));
            if let (Some(phi_t), Some(now)) = (driven.get(k), now.get_mut(k)) {
                let rate = jv + V::load(phi_t);
                rate.store(now);
                h = V::load(&of_now[k]) * rate - V::load(&of_before[k]) * h;
            }
            let ahead = dt.mul_add(h, -V::load(&phi[k]));
            let c = ahead.mul_add(inverse, -V::load(&phi_t[k]));
            (c - jv).store(&mut rate[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    /// For any four values of φ, each row satisfies ε λ + φ̄ + τ r⁺ = 0, with φ̄ written out as
    /// [`Scheme`] states it rather than by its weights.
    #[test]
    fn rows_are_those_of_the_scheme() {
        let params = HoistParams::default().with(|p| p.segments = 3);
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
        (rows.compliance, rows.damping) = (of(7).into(), of(8).into());
        rows.phi.copy_from_slice(&phi[2]);
        rows.phi_t.copy_from_slice(&drive);
        let scheme = Scheme::ThirdDifference {
            a: 0.7,
            gamma: -0.15,
        };
        for scheme in [Scheme::LinearlyImplicit, Scheme::Spook, scheme] {
            let mut regularization = Regularization::new(count);
            regularization.weigh(&[scheme.weights(); 2], |_| false);
            let [mut at, mut rest] = [of(0), of(0)];
            let past = Known::Past {
                phi_t: &driven,
                before: &before,
                now: &mut at,
            };
            regularization.update(dt, &rows, &jv, past, &mut rest);
            let h: Vec<f64> = (0..count)
                .map(|r| {
                    let weights = &regularization.weights;
                    assert_eq!(at[r], jv[r] + driven[r]);
                    weights.now[r] * at[r] - weights.before[r] * before[r]
                })
                .collect();
            let mut of_known = of(0);
            regularization.update(dt, &rows, &jv, Known::Rates(&h), &mut of_known);
            assert_eq!(of_known, rest);
            for r in 0..count {
                let [p0, p1, p2, p3] = std::array::from_fn(|k| phi[k][r]);
                let taken = match scheme {
                    Scheme::LinearlyImplicit => p3,
                    Scheme::Spook => 0.25 * (p1 + 2.0 * p2 + p3),
                    Scheme::ThirdDifference { a, gamma } => {
                        p2 + a * (p3 - 2.0 * p2 + p1) + gamma * (p3 - 3.0 * p2 + 3.0 * p1 - p0)
                    }
                };
                let mu = (rest[r] + jv[r] - (next[r] - drive[r])) / regularization.sigma[r];
                let left = rows.compliance[r] * mu / dt + taken + rows.damping[r] * next[r];
                assert!(left.abs() < 1e-13, "{scheme}, row {r}: {left}");
            }
        }
    }
}
