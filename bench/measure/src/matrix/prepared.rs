//! One backend on one matrix, symmetric or not, in its phases.

use super::Matrix;
use super::order::{Ordered, ordered};
use taut_solver::{
    AnalyzeReport, Backend, EliminationCost, FactorReport, GeneralMatrix, GeneralSolver,
    LinearSolver, SolveError, SolveReport, SymBlockMatrix,
};

/// A matrix with the common data of the backends: its order of elimination, or the obstacle to one.
pub struct Problem<'a> {
    pub matrix: &'a Matrix,
    /// For those that factorise in the order of the pattern; none for a general matrix.
    pub ordered: Option<Result<Ordered, SolveError>>,
}

impl<'a> Problem<'a> {
    /// Looks for a good order.
    pub fn new(matrix: &'a Matrix) -> Self {
        let ordered = match matrix {
            Matrix::Symmetric(a) => Some(ordered(a, EliminationCost::LARGEST)),
            Matrix::General(_) => None,
        };
        Self { matrix, ordered }
    }

    /// Where a block of what a backend is given stands in the original, counted from 1: `row 3`, or `block 2` of several rows.
    pub fn place(&self, backend: &Backend, block: usize) -> String {
        let (Matrix::Symmetric(a), Ok(View::Symmetric(seen, rows))) =
            (self.matrix, self.view(backend))
        else {
            return format!("row {}", block + 1);
        };
        let p = seen.pattern();
        let row = p.rows(block.min(p.blocks() - 1)).start;
        let row = rows.map_or(row, |rows| rows[row]);
        let (block, p) = (a.pattern().block_of_row(row), a.pattern());
        if p.size(block) == 1 {
            format!("row {}", row + 1)
        } else {
            format!("block {}", block + 1)
        }
    }

    /// The matrix as a backend is given it, and the place of its rows in the original where that is another.
    fn view(&self, backend: &Backend) -> Result<View<'_>, SolveError> {
        match (self.matrix, &self.ordered) {
            (Matrix::General(a), _) => Ok(View::General(a)),
            (Matrix::Symmetric(_), Some(ordered)) if backend.keeps_order() => {
                let ordered = ordered.as_ref().map_err(Clone::clone)?;
                Ok(View::Symmetric(&ordered.matrix, ordered.rows.as_deref()))
            }
            (Matrix::Symmetric(a), _) => Ok(View::Symmetric(a, None)),
        }
    }

    pub fn analyze(&self, backend: &Backend) -> Result<Prepared<'_>, SolveError> {
        let (work, report) = match self.view(backend)? {
            View::General(a) => {
                let solver = GeneralSolver::analyze(backend, a)?;
                (Work::General(Box::new(solver), a), AnalyzeReport::default())
            }
            View::Symmetric(a, rows) => {
                let mut solver = backend.create()?;
                let report = solver.analyze(a.pattern())?;
                let n = if rows.is_some() { a.dim() } else { 0 };
                let work = Work::Symmetric {
                    solver,
                    a,
                    rows,
                    in_order: [vec![0.0; n], vec![0.0; n]],
                };
                (work, report)
            }
        };
        Ok(Prepared { work, report })
    }
}

enum View<'a> {
    Symmetric(&'a SymBlockMatrix, Option<&'a [usize]>),
    General(&'a GeneralMatrix),
}

/// A backend that has analysed a matrix.
pub struct Prepared<'a> {
    work: Work<'a>,
    pub report: AnalyzeReport,
}

enum Work<'a> {
    Symmetric {
        solver: Box<dyn LinearSolver>,
        a: &'a SymBlockMatrix,
        /// Row of the original at each row, and b and x in this order.
        rows: Option<&'a [usize]>,
        in_order: [Vec<f64>; 2],
    },
    General(Box<GeneralSolver>, &'a GeneralMatrix),
}

impl Prepared<'_> {
    pub fn factorize(&mut self) -> Result<FactorReport, SolveError> {
        match &mut self.work {
            Work::Symmetric { solver, a, .. } => solver.factorize(a),
            Work::General(solver, a) => solver.factorize(a),
        }
    }

    /// Solves; `x` holds the guess when called.
    pub fn solve(&mut self, b: &[f64], x: &mut [f64]) -> Result<SolveReport, SolveError> {
        match &mut self.work {
            Work::General(solver, a) => solver.solve(a, b, x),
            Work::Symmetric {
                solver,
                a,
                rows: None,
                ..
            } => solver.solve(a, b, x),
            Work::Symmetric {
                solver,
                a,
                rows: Some(rows),
                in_order: [b_in_order, x_in_order],
            } => {
                for (at, &row) in rows.iter().enumerate() {
                    (b_in_order[at], x_in_order[at]) = (b[row], x[row]);
                }
                let report = solver.solve(a, b_in_order, x_in_order)?;
                for (&value, &row) in x_in_order.iter().zip(*rows) {
                    x[row] = value;
                }
                Ok(report)
            }
        }
    }
}
