//! ‖A⁻¹‖₁ from below by products with A⁻¹ and A⁻ᵀ (Higham and Tisseur 2000).

use super::noise;
use crate::SolveError;
use crate::agreement::split_mix;

/// Columns of the estimate.
pub(super) const COLUMNS: usize = 4;

/// Sweeps of the estimate at most: seldom more than two.
const SWEEPS: usize = 5;

/// Rows up to which ‖A⁻¹‖₁ is computed from all columns, which takes no longer.
const SMALL: usize = 16;

/// ‖A⁻¹‖₁ of a matrix of dimension `dim`, exactly for a few rows, else an estimate from below that is seldom off by more than
/// a factor of 3: `solve(x, false)` is x ← A⁻¹ x, `solve(x, true)` is x ← A⁻ᵀ x. Allocates.
///
/// # Errors
/// The errors of `solve`.
pub fn inverse_norm(
    dim: usize,
    solve: impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
) -> Result<f64, SolveError> {
    Ok(Estimate::new(dim).run(solve)?.norm)
}

/// Higham's last vector: of signs that alternate, with ‖x‖₁ = 1.
pub(super) fn alternate(x: &mut [f64]) {
    let n = x.len() as f64;
    for (i, x) in x.iter_mut().enumerate() {
        let weight = (1.0 + i as f64 / (n - 1.0).max(1.0)) / (1.5 * n);
        *x = if i % 2 == 0 { weight } else { -weight };
    }
}

/// Result of a norm estimate.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Longest {
    /// ‖y‖₁ of the longest product y.
    pub(super) norm: f64,
    /// Row of its largest component.
    pub(super) row: usize,
    /// The unit vector with the longest product.
    pub(super) unit: usize,
    /// The length of that.
    pub(super) of_unit: f64,
}

impl Longest {
    /// Takes a product, of a unit vector or another; NaN is longer than all.
    fn take(&mut self, y: &[f64], unit: Option<usize>) {
        let norm: f64 = y.iter().map(|y| y.abs()).sum();
        if let Some(unit) = unit.filter(|_| norm > self.of_unit) {
            (self.unit, self.of_unit) = (unit, norm);
        }
        if norm <= self.norm || self.norm.is_nan() {
            return;
        }
        let row = (0..y.len()).max_by(|&i, &j| y[i].abs().total_cmp(&y[j].abs()));
        (self.norm, self.row) = (norm, row.unwrap_or(0));
    }
}

/// Room of an estimate.
#[derive(Debug, Clone, Default)]
pub(super) struct Estimate {
    dim: usize,
    /// Columns x or signs of the products, and the signs of the sweep before.
    pub(super) columns: Vec<f64>,
    pub(super) signs: Vec<f64>,
    /// Rows whose unit vectors were tried.
    tried: Vec<bool>,
    /// Largest component of each row of A⁻ᵀ S.
    pub(super) largest: Vec<f64>,
    /// Row of each column that is a unit vector.
    units: [Option<usize>; COLUMNS],
}

impl Estimate {
    pub(super) fn new(dim: usize) -> Self {
        Self {
            dim,
            columns: vec![0.0; COLUMNS * dim],
            signs: vec![0.0; COLUMNS * dim],
            tried: vec![false; dim],
            largest: vec![0.0; dim],
            units: [None; COLUMNS],
        }
    }

    /// Allocates nothing.
    pub(super) fn run(
        &mut self,
        mut solve: impl FnMut(&mut [f64], bool) -> Result<(), SolveError>,
    ) -> Result<Longest, SolveError> {
        let n = self.dim;
        let mut longest = Longest::default();
        if n <= SMALL {
            for at in 0..n {
                let x = &mut self.columns[..n];
                unit(x, at);
                solve(x, false)?;
                longest.take(x, Some(at));
            }
            return Ok(longest);
        }
        // Other numbers than those of the probes.
        let mut bits = split_mix(n as u64 + (1 << 32));
        // Of several sizes, since numbers of one size cancel where two rows are nearly equal and have equal signs.
        for x in self.columns.chunks_mut(n) {
            noise(x, &mut bits);
            let norm: f64 = x.iter().map(|x| x.abs()).sum();
            x.iter_mut().for_each(|x| *x /= norm);
        }
        let mut random = || if bits() >> 63 == 0 { 1.0 } else { -1.0 };
        self.tried.fill(false);
        self.signs.fill(0.0);
        self.units = [None; COLUMNS];
        for sweep in 0..SWEEPS {
            let before = longest.norm;
            for (x, unit) in self.columns.chunks_mut(n).zip(self.units) {
                solve(x, false)?;
                longest.take(x, unit);
            }
            if sweep > 0 && longest.norm <= before {
                break;
            }
            if !self.turn_to_signs(&mut random) {
                break;
            }
            self.largest.fill(0.0);
            for x in self.columns.chunks_mut(n) {
                solve(x, true)?;
                let rows = self.largest.iter_mut().zip(&*x);
                rows.for_each(|(largest, x)| *largest = largest.max(x.abs()));
            }
            if !self.next_units() {
                break;
            }
        }
        // For what the gradient does not see.
        let x = &mut self.columns[..n];
        alternate(x);
        solve(x, false)?;
        longest.take(x, None);
        Ok(longest)
    }

    /// The signs of the columns, none parallel to those of the sweep before or to another, in which case random ones take its
    /// place; `false` where all were there before.
    fn turn_to_signs(&mut self, random: &mut impl FnMut() -> f64) -> bool {
        let n = self.dim;
        let parallel = |a: &[f64], b: &[f64]| {
            let product: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            product.abs() >= n as f64
        };
        let mut new = false;
        for at in 0..COLUMNS {
            let (done, rest) = self.columns.split_at_mut(at * n);
            let x = &mut rest[..n];
            x.iter_mut().for_each(|x| *x = 1.0_f64.copysign(*x));
            let known = self.signs.chunks(n).any(|s| parallel(s, x));
            new |= !known;
            if known || done.chunks(n).any(|s| parallel(s, x)) {
                x.iter_mut().for_each(|x| *x = random());
            }
        }
        self.signs.copy_from_slice(&self.columns);
        new
    }

    /// Unit vectors of the rows with the largest products that were not tried; `false` where the largest was.
    fn next_units(&mut self) -> bool {
        let n = self.dim;
        for at in 0..COLUMNS {
            let rows = (0..n).filter(|&r| at == 0 || !self.tried[r]);
            let row = rows.max_by(|&i, &j| self.largest[i].total_cmp(&self.largest[j]));
            let Some(row) = row else { break };
            if self.tried[row] {
                return false;
            }
            self.tried[row] = true;
            self.units[at] = Some(row);
            unit(&mut self.columns[at * n..(at + 1) * n], row);
        }
        true
    }
}

pub(super) fn unit(x: &mut [f64], at: usize) {
    x.fill(0.0);
    x[at] = 1.0;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Matrices of a line of neighbours, without a diagonal and with shifts. Without one, A⁻¹ holds
    /// ±1 and zeros, so that equal starting numbers end in a tie.
    #[test]
    fn the_estimate_is_near_the_norm() {
        let dense = "dense:double".parse().expect("a backend");
        for n in [4, 8, 20, 100, 200] {
            for diagonal in [0.0, 1e-3, 3.0] {
                let beside = (1..n).flat_map(|i| [(i, i - 1, 1.0), (i - 1, i, 1.0)]);
                let entries = (0..n).map(|i| (i, i, diagonal)).chain(beside).collect();
                let a = crate::GeneralMatrix::from_entries(n, entries).expect("sound");
                let mut solver = crate::GeneralSolver::analyze(&dense, &a).expect("sound");
                solver.factorize(&a).expect("regular");
                let mut solve = |x: &mut [f64], _| {
                    let b = x.to_vec();
                    solver.solve(&a, &b, x).map(|_| ())
                };
                let mut exact = 0.0_f64;
                let mut x = vec![0.0; n];
                for at in 0..n {
                    unit(&mut x, at);
                    solve(&mut x, false).expect("solves");
                    exact = exact.max(x.iter().map(|x| x.abs()).sum());
                }
                let found = inverse_norm(n, solve).expect("solves") / exact;
                let within = (1.0 / 3.0..1.001).contains(&found);
                assert!(within, "{n} {diagonal}: {found}");
            }
        }
    }

    /// Two nearly equal rows among others: numbers of one size cancel there where their signs agree.
    #[test]
    fn nearly_equal_rows_are_found() {
        let apart = 2.0_f64.powi(-30);
        for n in [17, 24, 40] {
            for (first, second) in (0..n).flat_map(|k| (0..k).map(move |i| (i, k))) {
                // The inverse of the unit matrix with 1 − ε in both places off the diagonal.
                let of = 1.0 / (2.0 * apart - apart * apart);
                let solve = |x: &mut [f64], _: bool| {
                    let [p, q] = [x[first], x[second]];
                    x[first] = of * (p - (1.0 - apart) * q);
                    x[second] = of * (q - (1.0 - apart) * p);
                    Ok(())
                };
                let found = inverse_norm(n, solve).expect("solves") * apart;
                let within = (0.3..1.001).contains(&found);
                assert!(within, "{n} {first} {second}: {found}");
            }
        }
    }
}
