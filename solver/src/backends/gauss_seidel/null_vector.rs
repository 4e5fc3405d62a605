//! Distinguishes slow convergence from a singular matrix.
//!
//! For a singular A the sweeps find a solution if one exists. If none exists, each sweep finally
//! moves x by the same d, a null vector of A, and the residual stays. A sweep with b = 0 leaves a
//! null vector unchanged: this tells a singular A from slow convergence once an iteration has ended
//! that way.

use super::Plan;
use crate::SymBlockMatrix;
use crate::block_ldlt::NOISE;

/// Sweeps without b between two looks at what they leave.
const PURIFY: usize = 4;

impl Plan {
    /// The block with the largest part of a null vector d of A, where d is what the last sweep changed x by. `change` holds
    /// x before it. What the rounding of x has left in d fades in up to `limit` sweeps without b.
    pub(super) fn null_vector(
        &mut self,
        a: &SymBlockMatrix,
        x: &[f64],
        limit: usize,
    ) -> Option<usize> {
        let mut d = std::mem::take(&mut self.change);
        for (d, x) in d.iter_mut().zip(x) {
            *d = x - *d;
        }
        let largest = crate::norm_inf(&d);
        let mut found = None;
        if largest > 0.0 && largest.is_finite() {
            // Scaled to ‖d‖∞ = 1: no square over- or underflows.
            d.iter_mut().for_each(|d| *d /= largest);
            let zeros = std::mem::take(&mut self.zeros);
            let mut before = f64::INFINITY;
            for _ in 0..limit.div_ceil(PURIFY) {
                for _ in 0..PURIFY {
                    self.sweep(&zeros, &mut d);
                }
                let rest = self.product_over_terms(a, &d);
                if rest <= NOISE * f64::EPSILON {
                    let most = (0..d.len()).max_by(|&i, &j| d[i].abs().total_cmp(&d[j].abs()));
                    found = most.map(|row| a.pattern().block_of_row(row));
                    break;
                }
                // A vector that is none stays as it is, but for what it slowly loses.
                if rest.is_nan() || rest > 0.99 * before {
                    break;
                }
                before = rest;
            }
            self.zeros = zeros;
        }
        self.change = d;
        found
    }

    /// maxᵢ |A d|ᵢ / (|A| |d|)ᵢ.
    fn product_over_terms(&mut self, a: &SymBlockMatrix, d: &[f64]) -> f64 {
        let (sums, terms) = (&mut self.residual, &mut self.correction);
        sums.fill(0.0);
        terms.fill(0.0);
        let mut add = |i: usize, term: f64| {
            sums[i] += term;
            terms[i] += term.abs();
        };
        a.for_each_lower(|i, j, a| {
            add(i, a * d[j]);
            if i != j {
                add(j, a * d[i]);
            }
        });
        let ratios =
            sums.iter().zip(&*terms).map(
                |(sum, terms)| {
                    if *sum == 0.0 { 0.0 } else { sum.abs() / terms }
                },
            );
        // Where sums overflow there is no telling.
        ratios.fold(0.0, |most, r| if r > most || r.is_nan() { r } else { most })
    }
}
