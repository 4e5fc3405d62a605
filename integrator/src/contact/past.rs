//! Passes through a W that does not know all: accelerated by Anderson's method with one pass of the past.
//!
//! W takes the joints as linear. Cables that slip over sheaves answer impulses in another way, so that the rates q without
//! impulses, which a pass takes from those with its last ones, are other ones in each pass: q ↦ g(q). One sheave is off by a
//! matrix of rank 1, and the secant through two passes ends at g(q) = q:
//!
//! ```text
//! r = g − q,      q⁺ = g − α (g − g'),      α = r·(r − r')/|r − r'|²
//! ```

/// What the last accelerated pass began with, and its g and r where it had any.
#[derive(Debug, Default)]
pub(crate) struct Past {
    begun: Vec<f64>,
    reached: Vec<f64>,
    residual: Vec<f64>,
}

impl Past {
    /// The next pass is the first.
    pub(crate) fn forget(&mut self) {
        self.begun.clear();
        self.reached.clear();
        self.residual.clear();
    }

    /// Makes q⁺ of g.
    pub(crate) fn accelerate(&mut self, rates: &mut [f64]) {
        if self.begun.len() != rates.len() {
            self.forget();
            self.begun.extend_from_slice(rates);
            return;
        }
        let known = self.residual.len() == rates.len();
        let now = |k: usize| rates[k] - self.begun[k];
        let mut sums = [0.0; 2];
        for (k, last) in self.residual.iter().enumerate() {
            let change = now(k) - last;
            sums[0] += now(k) * change;
            sums[1] += change * change;
        }
        let part = if known && sums[1] > 0.0 {
            sums[0] / sums[1]
        } else {
            0.0
        };
        self.residual.resize(rates.len(), 0.0);
        self.reached.resize(rates.len(), 0.0);
        let past = self.residual.iter_mut().zip(&mut self.reached);
        for ((rate, begun), (residual, reached)) in rates.iter_mut().zip(&mut self.begun).zip(past)
        {
            let found = *rate;
            *rate = found - part * (found - *reached);
            (*residual, *reached, *begun) = (found - *begun, found, *rate);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Past;

    #[test]
    fn what_is_off_by_rank_one_ends_after_two_passes() {
        // It diverges by itself: the matrix has the eigenvalue −1.7.
        let (u, v, fixed) = ([1.0, -2.0, 0.5], [-0.5, 0.7, 0.4], [3.0, 1.0, -2.0]);
        let map = |q: &[f64]| -> Vec<f64> {
            let off: f64 = (0..3).map(|k| v[k] * (q[k] - fixed[k])).sum();
            (0..3).map(|k| fixed[k] + off * u[k]).collect()
        };
        let (mut past, mut q) = (Past::default(), vec![0.0; 3]);
        for _ in 0..4 {
            q = map(&q);
            past.accelerate(&mut q);
        }
        for (q, exact) in q.iter().zip(fixed) {
            assert!((q - exact).abs() < 1e-12, "{q} {exact}");
        }
    }
}
