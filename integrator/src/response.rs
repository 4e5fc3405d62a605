//! Unknowns beside the linear system, condensed onto its factor.
//!
//! The matrix A holds the rows of joints, and its pattern stays from step to step. Two kinds of unknowns come and go; both
//! enter the right-hand side, A μ = b + C z, and answer to conditions of their own:
//!
//! | z | enters | columns C | conditions | module |
//! |---|---|---|---|---|
//! | slip rates s of sheaves | c | B = ±1 | T_out = e^(±μθ) T_in where it slips, s = 0 elsewhere | `slip` |
//! | contact impulses p | Δt f | −G = −J M̃⁻¹ Hᵀ | Signorini's and Coulomb's | `contact` |
//!
//! The responses A⁻¹ C, one solve with the factor a column, turn the conditions into a small dense problem in z. What the
//! solution lacks of them is taken from the system itself, and goes through the responses once more. Sheaves come first:
//! the response of a contact goes over those that slip.

use crate::Form;
use crate::assembly_map::AssemblyMap;
use crate::effort::Effort;
use crate::slip::Slip;
use taut_model::Linearized;
use taut_solver::{LinearSolver, SolveError, SolveReport, SymBlockMatrix};

/// The factor of the joints' system, for right-hand sides of rows.
pub(crate) struct Factor<'a> {
    pub(crate) solver: &'a mut dyn LinearSolver,
    pub(crate) matrix: &'a SymBlockMatrix,
    pub(crate) assembly_map: &'a AssemblyMap,
    pub(crate) form: Form,
    pub(crate) rows: &'a Linearized,
    /// The sheaves that the response goes over: those that slip hold the ratio of their tensions, not their lengths.
    pub(crate) slip: Option<&'a mut Slip>,
    /// Right-hand sides and solutions.
    pub(crate) system: &'a mut [Vec<f64>; 2],
    /// Work that the step has spent on contacts, its limit, and the flag that stops the step.
    pub(crate) effort: &'a mut Effort,
}

impl Factor<'_> {
    /// μ of S μ = b for each of these vectors of rows, in place.
    pub(crate) fn respond(&mut self, vectors: &mut [f64]) -> Result<SolveReport, SolveError> {
        let rows = self.rows;
        let (dim, count) = (self.matrix.dim(), vectors.len() / rows.rows().max(1));
        let [b, x] = &mut *self.system;
        for s in [&mut *b, &mut *x] {
            s.resize(dim * count, 0.0);
        }
        for (b, rhs) in b
            .chunks_exact_mut(dim)
            .zip(vectors.chunks_exact(rows.rows()))
        {
            self.assembly_map.gather(rows, None, rhs, 1.0, b);
        }
        if self.solver.takes_guess() {
            x.fill(0.0);
        }
        let report = match count {
            1 => self.solver.solve(self.matrix, b, x),
            _ => self.solver.solve_many(self.matrix, b, x),
        };
        if let Ok(report) = &report {
            let entries = self.matrix.values().len();
            self.effort.spend_solves(count, report.iterations, entries);
        }
        let sign = match self.form {
            Form::Schur => 1.0,
            Form::Kkt => -1.0,
        };
        for (x, to) in x
            .chunks_exact(dim)
            .zip(vectors.chunks_exact_mut(rows.rows()))
        {
            self.assembly_map.scatter_multipliers(rows, x, sign, to);
            if let Some(slip) = self.slip.as_mut().filter(|slip| slip.slips()) {
                // Where no rates obey, the sheave sticks.
                slip.obey(to);
            }
        }
        report
    }
}

/// The factor of a step, of which nothing else is borrowed, for responses over these slipping sheaves.
macro_rules! factor_of {
    ($step:expr, $slip:expr) => {
        $crate::response::Factor {
            solver: &mut *$step.system.solver,
            matrix: &$step.system.matrix,
            assembly_map: &$step.system.assembly_map,
            form: $step.options.form,
            rows: &$step.system_data.rows,
            slip: $slip,
            system: &mut $step.system.columns,
            effort: &mut $step.effort,
        }
    };
}
pub(crate) use factor_of;
