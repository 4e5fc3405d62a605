//! A solution whose residual is exactly zero, such as 0 of b = 0, is one whatever the condition.

use super::Rule;
use crate::DoubleDouble;

impl Rule {
    /// Returns true if b − A x is zero in double-double arithmetic. `residual` writes b − A x in doubles, which may be
    /// zero by rounding. Allocates nothing.
    pub(super) fn solves_exactly(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        x: &[f64],
        [r, d]: [&mut [f64]; 2],
        mut residual: impl FnMut(&[f64], &mut [f64]),
    ) -> bool {
        residual(x, r);
        if r.iter().any(|r| *r != 0.0) {
            return false;
        }
        // b is the residual of 0.
        d.fill(0.0);
        residual(d, r);
        let (high, low) = (&mut self.sums, &mut self.estimate.largest);
        high.copy_from_slice(r);
        low.fill(0.0);
        for (r, c, a) in entries.clone() {
            let product = DoubleDouble::from(a) * x[c].into();
            let sum = DoubleDouble::from(high[r]) + low[r].into() - product;
            let rounded = sum.to_f64();
            (high[r], low[r]) = (rounded, (sum - rounded.into()).to_f64());
        }
        let mut both = high.iter().zip(&*low);
        both.all(|(high, low)| *high == 0.0 && *low == 0.0)
    }
}
