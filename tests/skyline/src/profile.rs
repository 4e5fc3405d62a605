//! Profile (skyline) Cholesky.
//!
//! Row r of L is stored from its first entry in the lower triangle of A on, f(r), to the diagonal: Cholesky fills nothing
//! left of it. With the rows stored one after the other,
//!
//! ```text
//! l_rc = (a_rc − Σ_k l_rk l_ck) / l_cc,   k from max(f(r), f(c)) to c − 1,      l_rr = √(a_rr − Σ_k l_rk²)
//! ```

use std::sync::Arc;
use taut_solver::{
    AnalyzeReport, BlockPattern, FactorReport, LinearSolver, Phases, SolveError, SolveReport,
    SymBlockMatrix,
};

/// The solver: the envelope of L, made by `analyze`, and its values, by `factorize`.
pub struct Skyline {
    /// Roundoffs of its diagonal entry below which a pivot is lost.
    noise: f64,
    phases: Phases,
    /// First column of each scalar row of L; length n.
    first: Vec<usize>,
    /// Where each row of L starts in `l`, and their total at the end; length n + 1.
    start: Vec<usize>,
    /// The rows of L, one after the other.
    l: Vec<f64>,
}

impl Default for Skyline {
    fn default() -> Self {
        Self::new(4.0)
    }
}

impl Skyline {
    /// A solver that calls a matrix singular where a pivot is below `noise` roundoffs of its diagonal entry; no unit.
    #[must_use]
    pub fn new(noise: f64) -> Self {
        Self {
            noise,
            phases: Phases::default(),
            first: Vec::new(),
            start: Vec::new(),
            l: Vec::new(),
        }
    }

    /// Row r of L, from column `first[r]` to the diagonal.
    fn row(&self, r: usize) -> &[f64] {
        &self.l[self.start[r]..self.start[r + 1]]
    }

    /// Σ l_rk l_ck over the columns before c that both rows have.
    fn product(&self, r: usize, c: usize) -> f64 {
        let from = self.first[r].max(self.first[c]);
        let both = from..c.max(from);
        let (row, column) = (self.row(r), self.row(c));
        both.map(|k| row[k - self.first[r]] * column[k - self.first[c]])
            .sum()
    }
}

impl LinearSolver for Skyline {
    fn name(&self) -> &'static str {
        "skyline"
    }

    fn takes_guess(&self) -> bool {
        false
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        self.first = (0..pattern.dim()).collect();
        for j in 0..pattern.blocks() {
            for k in pattern.column(j) {
                for r in pattern.rows(pattern.row(k)) {
                    self.first[r] = self.first[r].min(pattern.rows(j).start);
                }
            }
        }
        self.start = vec![0];
        for (r, first) in self.first.iter().enumerate() {
            self.start.push(self.start[r] + r + 1 - first);
        }
        let entries = self.start[pattern.dim()];
        self.l = vec![0.0; entries];
        self.phases.analyzed(pattern);
        Ok(AnalyzeReport {
            factor_entries: Some(entries),
        })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        self.l.fill(0.0);
        a.for_each_lower(|r, c, a_rc| self.l[self.start[r] + c - self.first[r]] = a_rc);
        for r in 0..a.dim() {
            for c in self.first[r]..=r {
                let at = self.start[r] + c - self.first[r];
                let rest = self.l[at] - self.product(r, c);
                self.l[at] = if c < r {
                    rest / self.row(c)[c - self.first[c]]
                } else {
                    let block = a.pattern().block_of_row(r);
                    // A pivot that cancels to roundoff of its diagonal entry is zero.
                    let noise = self.noise * f64::EPSILON * self.l[at].abs();
                    if rest.abs() <= noise {
                        return Err(SolveError::Singular { block });
                    } else if rest < 0.0 {
                        return Err(SolveError::NotPositiveDefinite { block });
                    }
                    rest.sqrt()
                };
            }
        }
        self.phases.factorized();
        Ok(FactorReport::default())
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.phases.begin_solve(a, b, x)?;
        x.copy_from_slice(b);
        // L y = b, row by row; then Lᵀ x = y, from the last row on.
        for r in 0..x.len() {
            let (before, diagonal) = self.row(r).split_at(r - self.first[r]);
            let known: f64 = before
                .iter()
                .zip(&x[self.first[r]..r])
                .map(|(l, x)| l * x)
                .sum();
            x[r] = (x[r] - known) / diagonal[0];
        }
        for r in (0..x.len()).rev() {
            let (before, diagonal) = self.row(r).split_at(r - self.first[r]);
            let x_r = x[r] / diagonal[0];
            for (l, x) in before.iter().zip(&mut x[self.first[r]..r]) {
                *x -= l * x_r;
            }
            x[r] = x_r;
        }
        match x.iter().position(|x| !x.is_finite()) {
            Some(r) => Err(SolveError::NonFinite {
                what: "solution",
                block: a.pattern().block_of_row(r),
            }),
            None => Ok(SolveReport::DIRECT),
        }
    }
}
