//! The linear system of the last solve in either form, and its solution in extended precision: the KKT system of M̃, J, Σ and c
//! as rounded to doubles, to the last digit. The oracle for every form and backend.
//!
//! Samples tell the error of the linear algebra without it: of a step the residual of the solution is solved for by the same
//! factor, S d = r. The impulses d move the load in that step by Δt |M̃⁻¹ Jᵀ d|.

use super::Step;
use super::system::{LinearSystem, schur_residual};
use crate::active_set::{ActiveSet, Outcome};
use crate::assembly_map::AssemblyMap;
use crate::geometric::wrench;
use crate::slip::Slip;
use crate::system_data::SystemData;
use crate::{Elimination, Form, StepError, elimination};
use nalgebra::Vector3;
use taut_model::{BodyVectors, Scene};
use taut_solver::{Backend, SolveError, SymBlockMatrix};

/// What a sample needs, and the largest error so far.
pub(crate) struct Sample {
    /// Set while the next linear solve is to be sampled.
    pub(crate) is_due: bool,
    /// By how much the error of a solve moved the load, at most \[m].
    pub(crate) moved: f64,
    /// Δv of the step, and the correction of its multipliers, one a row.
    dv: BodyVectors,
    correction: Vec<f64>,
}

impl Sample {
    /// Samples of steps of the scene, after some whose largest error is `moved` (m).
    pub(crate) fn new(step: &Step, moved: f64) -> Self {
        Self {
            is_due: false,
            moved,
            dv: BodyVectors::new(step.scene.bodies.len()),
            correction: vec![0.0; step.multipliers.mu.len()],
        }
    }

    /// Takes the sample of a linear solve that was just made.
    pub(super) fn take(&mut self, of: &mut Step) {
        self.is_due = false;
        let Some(load) = load_of(&of.scene).filter(|load| of.scene.bodies.is_dynamic(*load)) else {
            return;
        };
        self.dv.copy_from(&of.system_data.dv);
        let solved = of.correction(&mut self.correction);
        of.system_data.dv.copy_from(&self.dv);
        if solved.is_err() {
            return;
        }
        let rows = &of.system_data.rows;
        let held = rows
            .slots
            .iter()
            .enumerate()
            .filter(|(_, slot)| slot.body == load);
        let impulse: Vector3<f64> = held.map(|(s, _)| wrench(rows, s, &self.correction).0).sum();
        let moved = impulse.norm() / of.scene.bodies.mass[load] * of.multipliers.mu_dt;
        self.moved = self.moved.max(moved);
    }
}

/// The load, or the last body of a scene without one.
pub(crate) fn load_of(scene: &Scene) -> Option<usize> {
    scene.load.or_else(|| scene.bodies.len().checked_sub(1))
}

impl Step {
    /// Matrix and right-hand side of the last solve in either form, assembled anew.
    pub(crate) fn assembled(
        &mut self,
        form: Form,
    ) -> Result<(SymBlockMatrix, Vec<f64>), StepError> {
        let dt = self.multipliers.mu_dt;
        self.active_set.hold(&mut self.system_data, dt);
        // The right-hand side is found by way of Δv, which belongs to the solution until then.
        let dv = self.system_data.dv.clone();
        let assembled = self.assemble_as(form);
        self.system_data.dv = dv;
        self.active_set.release(&mut self.system_data);
        assembled
    }

    fn assemble_as(&mut self, form: Form) -> Result<(SymBlockMatrix, Vec<f64>), StepError> {
        let order = &self.system.elimination.constraints;
        let assembly_map = AssemblyMap::new(form, &self.scene, &self.system_data.rows, order);
        Ok(self.fill_system(form, &mut assembly_map.map_err(|e| self.at_state(e))?))
    }

    /// Matrix and right-hand side of a plan of the form, from the present pieces.
    fn fill_system(
        &mut self,
        form: Form,
        assembly_map: &mut AssemblyMap,
    ) -> (SymBlockMatrix, Vec<f64>) {
        let mut a = SymBlockMatrix::zeros(assembly_map.pattern.clone());
        let mut b = vec![0.0; a.dim()];
        let SystemData {
            rows,
            inertia,
            regularization,
            rate,
            ..
        } = &self.system_data;
        assembly_map.fill(rows, inertia, regularization, &mut a);
        match form {
            Form::Schur => {
                let [residual, _] = &mut self.system.in_rows;
                self.system_data.free_residual(residual);
                assembly_map.gather(&self.system_data.rows, None, residual, 1.0, &mut b);
            }
            Form::Kkt => assembly_map.gather(rows, Some(&inertia.impulse), rate, 1.0, &mut b),
        }
        (a, b)
    }

    /// The exact impulses of the next sub-step from the present state, one a row \[N s, N m s].
    pub(crate) fn reference_multipliers(&mut self) -> Result<Vec<f64>, StepError> {
        self.find_tension()?;
        self.linearize(self.options.stiffness)?;
        let dt = self.substep();
        // The stepper's own solves start from what they know, not from what is found here.
        let (mut bounded, mut slip) = (self.active_set.clone(), self.slip.clone());
        bounded.begin(&self.system_data.rows);
        self.contacts.keep(&self.system_data.inertia, false);
        loop {
            bounded.hold(&mut self.system_data, dt);
            self.contacts.keep(&self.system_data.inertia, true);
            let solved = self.touch_extended(&mut slip, &bounded, dt);
            bounded.release(&mut self.system_data);
            slip.release(&mut self.system_data);
            self.contacts.apply(&mut self.system_data.inertia, false);
            let mut mu = solved?;
            match bounded.judge(&mut self.system_data, &mut mu, dt, (false, slip.largest)) {
                Outcome::Settled => return Ok(mu),
                Outcome::Changed => self.contacts.take_out(&mut self.system_data.inertia, false),
                Outcome::NotConverged => return Err(StepError::Undecided { time: self.time }),
            }
        }
    }

    /// The multipliers with contacts: those of solves in extended precision, their impulses through the backend's factor
    /// until nothing is left to correct.
    fn touch_extended(
        &mut self,
        slip: &mut Slip,
        bounded: &ActiveSet,
        dt: f64,
    ) -> Result<Vec<f64>, StepError> {
        self.contacts.apply(&mut self.system_data.inertia, true);
        let stuck = self.solve_extended(None)?;
        let mu = self.slip_extended(slip, bounded, stuck)?;
        if self.contacts.is_empty() {
            return Ok(mu);
        }
        let own = (self.multipliers.mu.clone(), self.multipliers.mu_dt);
        self.assemble(dt);
        let factorized = self.system.solver.factorize(&self.system.matrix);
        factorized.map_err(|e| self.culprit(e))?;
        self.multipliers.mu.copy_from_slice(&mu);
        let done = self.pass_through(dt, 0.0, |stepper| {
            slip.take_out(&mut stepper.system_data);
            let stuck = stepper.solve_extended(None)?;
            let mu = stepper.slip_extended(slip, bounded, stuck)?;
            stepper.multipliers.mu.copy_from_slice(&mu);
            Ok(())
        });
        let mu = std::mem::replace(&mut self.multipliers.mu, own.0);
        self.multipliers.mu_dt = own.1;
        done.map(|_| mu.to_vec())
    }

    /// The multipliers with cables that slip, from those of none, with every solve in extended precision.
    fn slip_extended(
        &mut self,
        slip: &mut Slip,
        bounded: &ActiveSet,
        stuck: Vec<f64>,
    ) -> Result<Vec<f64>, StepError> {
        if slip.is_empty() {
            return Ok(stuck);
        }
        slip.take_out(&mut self.system_data);
        slip.begin();
        let mut mu = stuck.clone();
        let speed = self.system_data.largest_rate();
        for pass in 0.. {
            while let Some((i, column)) = slip.wanted(bounded) {
                let response = self.solve_extended(Some(column))?;
                slip.learn(i, &response);
            }
            match slip.settle(&stuck, &mut mu, speed, pass) {
                Some(true) => break,
                Some(false) => {}
                None => return Err(StepError::Undecided { time: self.time }),
            }
        }
        if slip.slips() {
            slip.apply(&mut self.system_data, bounded);
            mu = self.solve_extended(None)?;
            slip.correct(&mut mu);
        }
        Ok(mu)
    }

    /// μ of the KKT system of the present pieces, or with this part of the rows alone on the right, in extended precision.
    fn solve_extended(&mut self, column: Option<&[f64]>) -> Result<Vec<f64>, StepError> {
        // The order of `banded`, whatever the backend of the run: the reference eliminates all blocks.
        let (auto, all) = (Elimination::Auto, &Backend::Banded);
        let order = elimination::order_of(auto, &self.scene, &self.system_data.rows, all)
            .map_err(|e| self.at_state(e))?;
        let mut assembly_map = AssemblyMap::new(
            Form::Kkt,
            &self.scene,
            &self.system_data.rows,
            &order.constraints,
        )
        .map_err(|e| self.at_state(e))?;
        let (a, mut b) = self.fill_system(Form::Kkt, &mut assembly_map);
        if let Some(column) = column {
            assembly_map.gather(&self.system_data.rows, None, column, 1.0, &mut b);
        }
        let x = taut_solver::reference_solution(&a, &b).map_err(|e| self.at_state(e))?;
        let rows = &self.system_data.rows;
        let mut mu = vec![0.0; rows.rows()];
        assembly_map.scatter_multipliers(rows, &x, -1.0, &mut mu);
        Ok(mu)
    }

    /// Error d of the solution `x`, by its residual r and the factor: A d = r. The multipliers of d
    /// go into `d`, one a row. Overwrites Δv of the system's data.
    fn correction(&mut self, d: &mut [f64]) -> Result<(), SolveError> {
        let system_data = &mut self.system_data;
        let LinearSystem {
            solver,
            matrix,
            rhs,
            x,
            assembly_map,
            in_rows: [mu, residual],
            columns: [r, solution],
            ..
        } = &mut self.system;
        r.resize(x.len(), 0.0);
        solution.resize(x.len(), 0.0);
        if solver.takes_guess() {
            solution.fill(0.0);
        }
        match self.options.form {
            Form::Schur => schur_residual(assembly_map, system_data, x, [mu, residual], r),
            Form::Kkt => matrix.subtract_product(rhs, x, r),
        }
        solver.solve_unjudged(matrix, r, solution)?;
        let sign = self.multiplier_sign();
        let [_, solution] = &self.system.columns;
        self.system
            .assembly_map
            .scatter_multipliers(&self.system_data.rows, solution, sign, d);
        Ok(())
    }

    /// A solver's error at the present time, whatever its block.
    fn at_state(&self, source: SolveError) -> StepError {
        StepError::Solve {
            source,
            culprit: None,
            time: self.time,
        }
    }
}
