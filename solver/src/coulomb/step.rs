//! A linearised contact problem in few unknowns, which both Newton methods solve.
//!
//! A contact that is open has no unknown, one that sticks has its three impulses. One that slides has its impulse along
//! a ray of the cone and one across the ray. With a column c and a row ĉ of each unknown y, x = Σ c y, the rows say
//! ĉᵀ (W x + q) + γ y = 0. Those whose column is their row come first: their block is symmetric.

use super::dense::Dense;
use super::scaled::{Scaled, Three, dot, put, three};

/// One unknown.
#[derive(Debug, Clone, Copy)]
struct Unknown {
    contact: usize,
    column: Three,
    row: Three,
    /// γ.
    compliance: f64,
}

/// Beyond this γ, in units of the scaled operator's diagonal, an unknown is zero to rounding.
const RIGID: f64 = 1e14;

/// The linearised problem and its workspace.
#[derive(Debug, Default)]
pub(super) struct Step {
    unknowns: Vec<Unknown>,
    solution: Vec<f64>,
    dense: Dense,
    /// Unknowns whose columns are not their rows, which come after the others.
    oblique: Vec<Unknown>,
}

impl Step {
    /// Forgets the last one.
    pub(super) fn clear(&mut self) {
        self.unknowns.clear();
        self.oblique.clear();
    }

    /// A contact whose three impulses x are unknown and whose velocity is −`compliance` x.
    pub(super) fn stick(&mut self, contact: usize, compliance: f64) {
        for k in 0..3 {
            let mut axis = [0.0; 3];
            axis[k] = 1.0;
            self.push(contact, axis, axis, compliance);
        }
    }

    /// A contact whose impulse lies on the ray along `column`, where `row`ᵀ u = 0, and across it with compliance `across`
    /// for `tangent` = (t₁, t₂), the ray's tangential direction.
    pub(super) fn slide(
        &mut self,
        contact: usize,
        (column, compliance): (Three, f64),
        row: Three,
        tangent: (f64, f64),
        across: f64,
    ) {
        self.push(contact, column, row, compliance);
        // NaN, where a radius vanishes, is none.
        if across < RIGID {
            let side = [0.0, -tangent.1, tangent.0];
            self.push(contact, side, side, across);
        }
    }

    fn push(&mut self, contact: usize, column: Three, row: Three, compliance: f64) {
        let to = if column == row {
            &mut self.unknowns
        } else {
            &mut self.oblique
        };
        to.push(Unknown {
            contact,
            column,
            row,
            compliance,
        });
    }

    /// Solves for x, given what the scaled problem's operator is and `rate`, its q by contacts. `false` where the matrix
    /// is singular to rounding; x is then of no use.
    pub(super) fn solve(
        &mut self,
        problem: &Scaled,
        rate: impl Fn(usize) -> Three,
        x: &mut [f64],
    ) -> bool {
        let symmetric = self.unknowns.len();
        self.unknowns.append(&mut self.oblique);
        let m = self.unknowns.len();
        self.solution.resize(m, 0.0);
        let done = [symmetric, 0].into_iter().any(|symmetric| {
            self.assemble(problem, &rate, symmetric);
            let size = (m, symmetric);
            self.dense.solve(size, &mut self.solution)
        });
        x.fill(0.0);
        for (unknown, y) in self.unknowns.iter().zip(&self.solution) {
            let x = &mut x[3 * unknown.contact..3 * unknown.contact + 3];
            x.iter_mut()
                .zip(unknown.column)
                .for_each(|(x, c)| *x += c * y);
        }
        done
    }

    /// Returns true if W is positive definite to rounding.
    pub(super) fn is_definite(&mut self, problem: &Scaled) -> bool {
        self.clear();
        (0..problem.n).for_each(|i| self.stick(i, 0.0));
        let m = self.unknowns.len();
        self.solution.resize(m, 0.0);
        self.assemble(problem, &|i| three(&problem.rates, i), m);
        self.dense.solve((m, m), &mut self.solution)
    }

    /// Takes all contacts in this order for sticking, eliminates the `leading` first, and leaves operator and rates of the
    /// others in `rest`: what they have where those stick. `false` where W is not definite to rounding.
    pub(super) fn lead(
        &mut self,
        problem: &Scaled,
        order: &[usize],
        leading: usize,
        rest: &mut Scaled,
    ) -> bool {
        let (m, first) = (3 * order.len(), 3 * leading);
        let (rows, width) = self.dense.begin(m);
        for (k, to) in rows.chunks_exact_mut(width).enumerate() {
            let row = 3 * order[k / 3] + k % 3;
            let from = &problem.operator[row * m..(row + 1) * m];
            for (to, i) in to.as_chunks_mut::<3>().0.iter_mut().zip(order).skip(k / 3) {
                *to = three(from, *i);
            }
            to[m] = -problem.rates[row];
        }
        if !self.dense.lead(m, first) {
            return false;
        }
        let left = m - first;
        rest.operator.clear();
        rest.operator.resize(left * left, 0.0);
        rest.rates.clear();
        for (k, row) in self.dense.rows(m).skip(first).enumerate() {
            rest.rates.push(-row[m]);
            for (j, w) in row[first + k..m].iter().enumerate() {
                rest.operator[k * left + k + j] = *w;
                rest.operator[(k + j) * left + k] = *w;
            }
        }
        true
    }

    /// After [`lead`](Self::lead): all impulses x for those of the others.
    pub(super) fn follow(&mut self, order: &[usize], rest: &[f64], x: &mut [f64]) -> bool {
        let first = x.len() - rest.len();
        self.solution.resize(x.len(), 0.0);
        self.solution[first..].copy_from_slice(rest);
        let done = self.dense.follow(first, &mut self.solution);
        for (i, y) in order.iter().zip(self.solution.as_chunks::<3>().0) {
            put(x, *i, *y);
        }
        done
    }

    /// The matrix Ĉᵀ W C + Γ and −Ĉᵀ q beside it, without what lies left of the diagonal in the `symmetric` first rows.
    fn assemble(&mut self, problem: &Scaled, rate: &impl Fn(usize) -> Three, symmetric: usize) {
        let (m, size) = (self.unknowns.len(), 3 * problem.n);
        let (rows, width) = self.dense.begin(m);
        for (k, (to, a)) in rows.chunks_exact_mut(width).zip(&self.unknowns).enumerate() {
            for (component, &weight) in a.row.iter().enumerate() {
                if weight == 0.0 {
                    continue;
                }
                let first = (3 * a.contact + component) * size;
                let operator = &problem.operator[first..first + size];
                let read = if k < symmetric { k } else { 0 };
                for (to, b) in to[read..].iter_mut().zip(&self.unknowns[read..]) {
                    *to += weight * dot(three(operator, b.contact), b.column);
                }
            }
            to[k] += a.compliance;
            to[m] = -dot(a.row, rate(a.contact));
        }
    }
}
