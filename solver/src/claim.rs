//! Acceptance test of direct solutions: one residual, and corrections where it is not small.
//!
//! LDLᵀ or L Lᵀ with positive pivots is backward stable: it is the exact factor of a matrix A + ΔA
//! with |ΔA| ≤ γ |L| D |Lᵀ|, and the entries of |L| D |Lᵀ| are at most the largest of the diagonal
//! (Higham, *Accuracy and Stability of Numerical Algorithms*, theorems 10.3 and 10.5). Its
//! solutions need no judge of their residuals. What is left is the condition, which pivots do not
//! tell: L Lᵀ of a unit triangle L has pivots of 1 and any condition. A probe of each factor, or
//! the last correction of a refinement, tells whether the rule (`condition`) has to look at it.
//!
//! All other eliminations may let entries grow: by 2ⁿ⁻¹ at most where rows are exchanged (Wilkinson
//! 1961), without bound where pivots of either sign are taken in order. A well-conditioned matrix
//! may then give an x without a correct digit. Such growth shows in the backward error of x,
//!
//! ```text
//! η = ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞)
//! ```
//!
//! which is claimed to be small where it is at most 2 (k + 2) u, with k entries in the longest row and u = 2⁻⁵³: that
//! is what refinement with residuals in doubles reaches at the least, whatever made the factors, if it contracts
//! (Skeel 1980; Higham, 12.1 and 12.2), and the residual itself is computed to (k + 1) u of the same. So an x above it is
//! corrected, and nothing is claimed of one that corrections do not bring there.

use crate::error::SolveError;
use crate::{GeneralMatrix, Status, SymBlockMatrix, norm_inf};

/// Corrections at most: each takes off a part of the residual or is the last.
const SWEEPS: usize = 16;

/// Acceptance bound for the solutions of one matrix.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judge {
    /// Largest ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞) that is claimed.
    part: f64,
    /// ‖A‖∞.
    norm: f64,
}

/// Size below which numbers are compared multiplied by `UP`: their products with roundoff may have no digits.
const SMALL: f64 = 1.0 / UP;

const UP: f64 = (1_u128 << 120) as f64
    * (1_u128 << 120) as f64
    * (1_u128 << 120) as f64
    * (1_u128 << 120) as f64;

impl Judge {
    /// For solutions of `a`; `sums` is room for one number a row. Allocates nothing.
    pub(crate) fn of(a: &SymBlockMatrix, sums: &mut [f64]) -> Self {
        let p = a.pattern();
        sums.fill(0.0);
        for j in 0..p.blocks() {
            for i in p.column(j).map(|k| p.row(k)).filter(|_| p.size(j) > 0) {
                sums[p.rows(j).start] += p.size(i) as f64;
                if i != j && p.size(i) > 0 {
                    sums[p.rows(i).start] += p.size(j) as f64;
                }
            }
        }
        Self::new(norm_inf(sums), a.norm_inf_in(sums))
    }

    /// For solutions of a matrix that need not be symmetric; `sums` is room for one number a row.
    pub(crate) fn of_general(a: &GeneralMatrix, sums: &mut [f64]) -> Self {
        sums.fill(0.0);
        a.for_each(|r, _, _| sums[r] += 1.0);
        Self::new(norm_inf(sums), a.norm_inf_in(sums))
    }

    /// For matrices with at most `longest` entries a row and the ∞-norm `norm`.
    pub(crate) fn new(longest: f64, norm: f64) -> Self {
        Self {
            part: (longest + 2.0) * f64::EPSILON,
            norm,
        }
    }

    /// For residuals over the size of x of at most `bar`.
    pub(crate) fn at(bar: f64) -> Self {
        Self {
            part: bar,
            norm: 1.0,
        }
    }

    /// For residuals over |A| |x|, row by row.
    pub(crate) fn by_rows(self) -> Self {
        Self::at(self.part)
    }

    /// Returns true if a residual of size `residual` is small enough for an x of size `x`. False if
    /// the bound overflows.
    pub(crate) fn admits(self, residual: f64, x: f64) -> bool {
        let (small, large) = (self.norm.min(x), self.norm.max(x));
        let up = if small < SMALL { UP } else { 1.0 };
        let most = small * up * self.part * large;
        // Below the normal numbers a product may be 0 for lack of digits.
        let is_zero = residual == 0.0 && x == 0.0;
        is_zero || most.is_normal() && residual * up <= most
    }

    /// Judges x, whose residual `residual(x, r)` writes, and corrects it by `solve(r, d)` where that is called for:
    /// [`Status::Direct`], or [`Status::Stalled`] of what is no solution, or numbers too large to tell. `before` is the
    /// size of the residual before the last correction, infinite where there was none. Allocates nothing.
    pub(crate) fn settle(
        self,
        x: &mut [f64],
        buffers: [&mut [f64]; 2],
        before: f64,
        residual: impl FnMut(&[f64], &mut [f64]),
        solve: impl FnMut(&[f64], &mut [f64]) -> Result<(), SolveError>,
    ) -> Result<Status, SolveError> {
        let sizes = |r: &[f64], x: &[f64]| [norm_inf(r), norm_inf(x)];
        self.settle_by(sizes, x, buffers, before, residual, solve)
    }

    /// Judges and corrects x as [`settle`](Self::settle) does, with `sizes(r, x)` in place of the
    /// ∞-norms.
    pub(crate) fn settle_by(
        self,
        mut sizes: impl FnMut(&[f64], &[f64]) -> [f64; 2],
        x: &mut [f64],
        [r, d]: [&mut [f64]; 2],
        mut before: f64,
        mut residual: impl FnMut(&[f64], &mut [f64]),
        mut solve: impl FnMut(&[f64], &mut [f64]) -> Result<(), SolveError>,
    ) -> Result<Status, SolveError> {
        for _ in 0..=SWEEPS {
            residual(x, r);
            let [left, size] = sizes(r, x);
            if self.admits(left, size) {
                return Ok(Status::Direct);
            }
            // Not a number, or no nearer by half.
            if !((self.part * self.norm * size).is_finite() && left <= 0.5 * before) {
                break;
            }
            before = left;
            solve(r, d)?;
            for (x, d) in x.iter_mut().zip(&*d) {
                *x += d;
            }
        }
        Ok(Status::Stalled)
    }
}

#[cfg(test)]
mod tests {
    use crate::{Backend, GeneralMatrix, Status, solve_general};

    fn all() -> impl Iterator<Item = Backend> {
        let names = [
            "umfpack",
            "umfpack:refinement=0",
            "faer:lu",
            "dense",
            "dense:extended",
        ];
        let backends = names.map(|n| n.parse::<Backend>().unwrap());
        backends.into_iter().filter(Backend::is_compiled)
    }

    /// A residual or a norm that overflows tells nothing, and nothing is claimed then; zero is its own solution.
    #[test]
    fn what_cannot_be_judged_is_not_claimed() {
        let a = GeneralMatrix::from_entries(2, vec![(0, 0, 1e200), (1, 1, 1e-200)]).unwrap();
        for backend in all() {
            if let Ok((x, report)) = solve_general(&backend, &a, &[1.0, 1.0]) {
                assert_eq!(report.status, Status::Stalled, "{backend} {x:?}");
            }
            let zero = solve_general(&backend, &a, &[0.0, 0.0]).unwrap();
            assert_eq!((zero.0, zero.1.status), (vec![0.0; 2], Status::Direct));
        }
    }
}
