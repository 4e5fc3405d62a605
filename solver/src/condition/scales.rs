//! Powers of two that bring rows and columns to one size.

use crate::{SolveError, norm_inf};

/// R and C of R A C.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scales {
    /// Scale of each row, a power of two.
    pub(crate) rows: Vec<f64>,
    /// Scale of each column, a power of two.
    pub(crate) columns: Vec<f64>,
}

impl Scales {
    /// Room for matrices of a dimension. Allocates.
    pub(crate) fn new(dim: usize) -> Self {
        Self {
            rows: vec![1.0; dim],
            columns: vec![1.0; dim],
        }
    }

    /// Scales a matrix of these entries (row, column, value). Allocates nothing.
    pub(crate) fn of(&mut self, entries: impl Iterator<Item = (usize, usize, f64)> + Clone) {
        self.rows.fill(0.0);
        entries.clone().for_each(|(r, _, a)| {
            self.rows[r] = self.rows[r].max(a.abs());
        });
        self.rows.iter_mut().for_each(|r| *r = over(*r));
        self.columns.fill(0.0);
        entries.for_each(|(r, c, a)| {
            self.columns[c] = self.columns[c].max(a.abs() * self.rows[r]);
        });
        self.columns.iter_mut().for_each(|c| *c = over(*c));
    }

    /// Sets the scales for a factorisation; returns true if it scales. Where row scales and column
    /// scales each lie within a factor of 2²⁰, all scales are 1: scaling would change the row
    /// exchanges to no benefit.
    pub(crate) fn of_uneven(
        &mut self,
        entries: impl Iterator<Item = (usize, usize, f64)> + Clone,
    ) -> bool {
        self.of(entries);
        let even = [&self.rows, &self.columns].into_iter().all(|scales| {
            let least = scales.iter().copied().fold(f64::INFINITY, f64::min);
            norm_inf(scales) <= 1048576.0 * least
        });
        if even {
            self.rows.fill(1.0);
            self.columns.fill(1.0);
        }
        !even
    }

    /// Largest over smallest scale, of rows or of columns.
    pub(super) fn spread(&self) -> f64 {
        let of = |scales: &[f64]| {
            let least = scales.iter().copied().fold(f64::INFINITY, f64::min);
            norm_inf(scales) / least
        };
        of(&self.rows).max(of(&self.columns))
    }

    /// x ← (R A C)⁻¹ x, or (R A C)⁻ᵀ x, by what solves with A.
    pub(super) fn solve(
        &self,
        x: &mut [f64],
        transposed: bool,
        solve: &mut impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<(), SolveError> {
        let divide = |x: &mut [f64], by: &[f64]| x.iter_mut().zip(by).for_each(|(x, s)| *x /= s);
        let [before, after] = if transposed {
            [&self.columns, &self.rows]
        } else {
            [&self.rows, &self.columns]
        };
        divide(x, before);
        solve(x, transposed)?;
        divide(x, after);
        Ok(())
    }

    /// ‖R v‖∞ of a residual, ‖C⁻¹ v‖∞ of a solution.
    pub(super) fn by(&self, v: &[f64], is_residual: bool) -> f64 {
        let scales = if is_residual {
            &self.rows
        } else {
            &self.columns
        };
        let of = |(v, s): (&f64, &f64)| if is_residual { v * s } else { v / s };
        // A NaN stays the maximum.
        v.iter().zip(scales).map(of).fold(0.0, |most: f64, v| {
            if most.is_nan() || v.abs() <= most {
                most
            } else {
                v.abs()
            }
        })
    }

    /// R A C at an entry.
    #[inline]
    pub(crate) fn at(&self, r: usize, c: usize, a: f64) -> f64 {
        a * self.rows[r] * self.columns[c]
    }
}

/// The power of two that brings x to 1 … 2; 1 of zero and of what is no number.
pub(super) fn over(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return 1.0;
    }
    let exponent = (x.to_bits() >> 52).clamp(1, 2045);
    f64::from_bits((2046 - exponent) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_powers_of_two_over_the_size() {
        for x in [1.0, 1.5, 1e-300, 1e300, f64::MIN_POSITIVE, 3.0, 0.7] {
            let scaled = x * over(x);
            let holds = (1.0..2.0).contains(&scaled) && over(x).log2().fract() == 0.0;
            assert!(holds, "{x}");
        }
        assert!(over(f64::MAX) > 0.0 && over(5e-324).is_finite());
        assert_eq!([over(0.0), over(f64::INFINITY)], [1.0; 2]);
    }
}
