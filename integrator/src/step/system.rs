//! The linear system of the system's data: assembled, factorised, solved and refined.
//!
//! In the Schur form the unknown is μ, in the symmetric KKT form (Δv, −μ):
//!
//! ```text
//! Schur    (J M̃⁻¹ Jᵀ + Σ) μ = c − J (v + M̃⁻¹ Δt f)
//! KKT      [M̃ Jᵀ; J −Σ] (Δv, −μ) = (Δt f, c − J v)
//! ```
//!
//! Where rows have bounds, or shapes touch, it is solved until all of them keep theirs ([`super::condensed`]).

use super::{Stage, Step, choice};
use crate::assembly_map::{AssemblyMap, BlockOf};
use crate::elimination::EliminationOrder;
use crate::system_data::SystemData;
use crate::{Form, Phase, StepError};
use taut_lanes::{Aligned, Isa, Kernel, Level, dispatch};
use taut_solver::{LinearSolver, RefineScratch, SolveError, SolveReport, SymBlockMatrix};

/// The linear system of a step, its solver, and vectors to work in.
pub(crate) struct LinearSystem {
    pub(crate) solver: Box<dyn LinearSolver>,
    pub(crate) elimination: EliminationOrder,
    /// The solver that [`Backend::Auto`](taut_solver::Backend::Auto) stands for.
    pub(crate) chosen: Option<choice::Chosen>,
    pub(crate) assembly_map: AssemblyMap,
    pub(crate) matrix: SymBlockMatrix,
    /// Right-hand side and solution of the linear system, length `matrix.dim()`.
    pub(crate) rhs: Aligned,
    pub(crate) x: Aligned,
    pub(crate) scratch: RefineScratch,
    /// Multipliers and a residual in the order of the scene's rows.
    pub(crate) in_rows: [Aligned; 2],
    /// Right-hand sides and solutions for responses to sheaves and contacts.
    pub(crate) columns: [Vec<f64>; 2],
}

/// What the last solve found.
pub(crate) struct Multipliers {
    /// Impulses μ = Δt λ of the last solve, one a row.
    pub(crate) mu: Aligned,
    /// Length of the step that `mu` belongs to \[s].
    pub(crate) mu_dt: f64,
    /// λ that the geometric stiffness is made of, one a row \[N, N m].
    pub(crate) tension: Aligned,
    /// Set once `tension` has the forces of a solve.
    pub(crate) tension_known: bool,
}

impl Step {
    /// Assembles, factorises, solves and refines the system of the system's data, for a step `dt` long: once, or until all rows
    /// with bounds keep them and contacts their conditions.
    pub(crate) fn solve_linearized(&mut self, dt: f64) -> Result<(), StepError> {
        if self.uses.bounds || self.uses.contacts {
            self.solve_within_bounds(dt)?;
        } else {
            self.solve_once(dt)?;
        }
        self.multipliers.mu_dt = dt;
        let tension = Multiply(
            1.0 / dt,
            &self.multipliers.mu,
            &mut self.multipliers.tension,
        );
        dispatch(Level::best(), tension);
        self.multipliers.tension_known = true;
        self.progress.stage = Stage::Solved;
        Ok(())
    }

    /// One linear system: μ of all rows as if none had bounds.
    pub(super) fn solve_once(&mut self, dt: f64) -> Result<(), StepError> {
        self.assemble(dt);
        self.tally.end(Phase::Assemble);
        self.system
            .solver
            .factorize(&self.system.matrix)
            .map_err(|e| self.culprit(e))?;
        self.tally.end(Phase::Factorize);
        self.solve_assembled()
    }

    /// μ of the factorised system and its right-hand side.
    pub(crate) fn solve_assembled(&mut self) -> Result<(), StepError> {
        let report = self.solve_factorized().map_err(|e| self.culprit(e))?;
        self.tally.end(Phase::Solve);
        let refined = self.refine().map_err(|e| self.culprit(e))?;
        self.tally.end(Phase::Refine);
        self.tally.add(report, refined);
        let sign = self.multiplier_sign();
        self.system.assembly_map.scatter_multipliers(
            &self.system_data.rows,
            &self.system.x,
            sign,
            &mut self.multipliers.mu,
        );
        if let Some(mut sample) = self.output.sample.take_if(|sample| sample.is_due) {
            sample.take(self);
            self.output.sample = Some(sample);
        }
        Ok(())
    }

    fn solve_factorized(&mut self) -> Result<SolveReport, SolveError> {
        let sweeps = self.refinements();
        let LinearSystem {
            solver,
            matrix,
            rhs,
            x,
            ..
        } = &mut self.system;
        if sweeps > 0 {
            // The refinement judges by the residuals that it takes anyway.
            solver.solve_unjudged(matrix, rhs, x)
        } else {
            solver.solve(matrix, rhs, x)
        }
    }

    /// The matrix, the right-hand side, and the guess in `x`.
    pub(crate) fn assemble(&mut self, dt: f64) {
        let SystemData {
            rows,
            inertia,
            regularization,
            ..
        } = &self.system_data;
        self.system
            .assembly_map
            .fill(rows, inertia, regularization, &mut self.system.matrix);
        if dt != self.multipliers.mu_dt {
            // The guess keeps the forces, over another time.
            let factor = dt / self.multipliers.mu_dt;
            self.multipliers.mu.iter_mut().for_each(|mu| *mu *= factor);
            self.multipliers.mu_dt = dt;
        }
        self.right_hand_side();
    }

    /// The right-hand side of the system's data, and the guess in `x`.
    pub(crate) fn right_hand_side(&mut self) {
        let sign = self.multiplier_sign();
        match self.options.form {
            Form::Schur => {
                if self.system.assembly_map.in_scene_order {
                    self.system_data.free_residual(&mut self.system.rhs);
                } else {
                    let [residual, _] = &mut self.system.in_rows;
                    self.system_data.free_residual(residual);
                    let rows = &self.system_data.rows;
                    self.system.assembly_map.gather(
                        rows,
                        None,
                        residual,
                        1.0,
                        &mut self.system.rhs,
                    );
                }
            }
            Form::Kkt => {
                let SystemData {
                    rows,
                    inertia,
                    rate,
                    dv,
                    ..
                } = &mut self.system_data;
                dv.clear();
                self.system.assembly_map.gather(
                    rows,
                    Some(&inertia.impulse),
                    rate,
                    1.0,
                    &mut self.system.rhs,
                );
            }
        }
        if !self.system.solver.takes_guess() {
            return;
        }
        if self.options.warm_start {
            if self.options.form == Form::Kkt {
                self.system_data
                    .update_velocity_change(&self.multipliers.mu);
            }
            let SystemData { rows, dv, .. } = &self.system_data;
            let bodies = (self.options.form == Form::Kkt).then_some(dv);
            self.system.assembly_map.gather(
                rows,
                bodies,
                &self.multipliers.mu,
                sign,
                &mut self.system.x,
            );
        } else {
            self.system.x.fill(0.0);
        }
    }

    /// The report of the last refinement, if there was one, with the iterations of all.
    fn refine(&mut self) -> Result<Option<SolveReport>, SolveError> {
        let sweeps = self.refinements();
        let system_data = &mut self.system_data;
        let LinearSystem {
            solver,
            matrix,
            rhs,
            x,
            scratch,
            assembly_map,
            in_rows: [mu, residual],
            ..
        } = &mut self.system;
        match self.options.form {
            Form::Schur => {
                taut_solver::refine(&mut **solver, matrix, x, scratch, sweeps, |x, r| {
                    schur_residual(assembly_map, system_data, x, [mu, residual], r);
                })
            }
            Form::Kkt => taut_solver::refine(&mut **solver, matrix, x, scratch, sweeps, |x, r| {
                matrix.subtract_product(rhs, x, r);
            }),
        }
    }

    /// Refinements of a solve: one chosen that iterates to its own tolerance has none.
    pub(crate) fn refinements(&self) -> usize {
        match &self.system.chosen {
            Some(chosen) if chosen.backend.is_iterative() => 0,
            _ => self.options.refinements,
        }
    }

    /// The unknown of the symmetric KKT form is −μ.
    pub(super) fn multiplier_sign(&self) -> f64 {
        match self.options.form {
            Form::Schur => 1.0,
            Form::Kkt => -1.0,
        }
    }

    pub(crate) fn not_finite(&self, body: usize) -> StepError {
        StepError::NonFinite {
            body: self.scene.body_names[body].clone(),
            time: self.time,
        }
    }

    /// A solver's error with its block's name.
    pub(crate) fn culprit(&self, source: SolveError) -> StepError {
        let block = match &source {
            SolveError::Singular { block }
            | SolveError::NotPositiveDefinite { block }
            | SolveError::OutOfRange { block }
            | SolveError::NonFinite { block, .. } => Some(*block),
            _ => None,
        };
        let name = |b: usize| match self.system.assembly_map.block.get(b)? {
            BlockOf::Body(i) => self.scene.body_names.get(*i),
            BlockOf::Constraint(c) => self.scene.constraint_names.get(*c),
        };
        StepError::Solve {
            culprit: block.and_then(name).cloned(),
            source,
            time: self.time,
        }
    }
}

/// The residual of the Schur form at `x` from the system's data, into `r`; `mu` and `residual` are one number a row.
pub(super) fn schur_residual(
    assembly_map: &AssemblyMap,
    system_data: &mut SystemData,
    x: &[f64],
    [mu, residual]: [&mut [f64]; 2],
    r: &mut [f64],
) {
    if assembly_map.in_scene_order {
        return system_data.residual(x, r);
    }
    assembly_map.scatter_multipliers(&system_data.rows, x, 1.0, mu);
    system_data.residual(mu, residual);
    assembly_map.gather(&system_data.rows, None, residual, 1.0, r);
}

/// y ← a x.
struct Multiply<'a>(f64, &'a [f64], &'a mut [f64]);

impl Kernel for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        for (y, x) in self.2.iter_mut().zip(self.1) {
            *y = self.0 * x;
        }
    }
}
