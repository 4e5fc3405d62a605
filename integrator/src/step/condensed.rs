//! The step's solve where rows have bounds, cables slip over their sheaves ([`crate::slip`]), or shapes touch
//! ([`super::contact_solve`]). What is condensed onto the factor goes by [`crate::response`].

use super::Step;
use crate::StepError;
use crate::activation::STIFF;
use crate::active_set::{Outcome, RowState, jacobian, response};
use crate::response::factor_of;
use taut_model::linearized::dot;
use taut_solver::SolveError;

impl Step {
    /// The system of the system's data, solved until all rows with bounds keep them and what is thrown back has arrived.
    pub(super) fn solve_within_bounds(&mut self, dt: f64) -> Result<(), StepError> {
        let undecided = self.tally.undecided;
        self.keep_bounds(dt)?;
        if !self.may_be_stopped(dt) {
            return Ok(());
        }
        self.take_solve_back(dt);
        self.contacts.rebounds = false;
        let solved = self.keep_bounds(dt);
        self.contacts.rebounds = true;
        solved?;
        let v = &self.system_data.v;
        self.contacts.note_stopped(|i| v.get(i));
        self.take_solve_back(dt);
        self.tally.undecided = undecided;
        self.keep_bounds(dt)
    }

    /// True if something may stop what is thrown back before it arrives: other shapes, or a row that was slack and is passed.
    fn may_be_stopped(&self, dt: f64) -> bool {
        if !self.contacts.rebound_is_due() {
            return false;
        }
        let (system_data, fall) = (&self.system_data, self.scene.gravity.norm() * dt);
        // Where no division tells what an elastic rope leaves of the speed, it stops nothing.
        let divides = self.options.guard.is_some() && self.slip.is_empty();
        let is_passed = |(k, place): (usize, RowState)| {
            let bound = &system_data.rows.bounds[k];
            let rates = jacobian(system_data, k).map(|(i, j)| dot(&j, &system_data.v.get(i)));
            let rate = rates.sum::<f64>() + system_data.rows.phi_t[bound.row];
            let side = bound.side();
            let begun = side * system_data.rows.phi[bound.row];
            let stiff = dt * dt * response(system_data, k);
            let stops = divides || stiff > STIFF * STIFF * system_data.rows.compliance[bound.row];
            stops
                && place != RowState::Inside
                && begun < 0.0
                && begun + dt * (side * rate + fall) > 0.0
        };
        let bodies = &self.scene.bodies;
        self.contacts.may_be_stopped(|i| bodies.is_dynamic(i))
            || self.active_set.places().enumerate().any(is_passed)
    }

    /// Takes a solve out of the prepared system of a step `dt` long, before another one.
    fn take_solve_back(&mut self, dt: f64) {
        self.take_impulses_out();
        self.active_set.refill(&mut self.system_data, dt);
    }

    /// Takes the slip and the impulses of a solve out of the prepared system; drums that it emptied stay so.
    pub(super) fn take_impulses_out(&mut self) {
        self.slip.take_out(&mut self.system_data);
        self.contacts.take_out(&mut self.system_data.inertia, false);
    }

    /// The system of the system's data, solved until all rows with bounds keep them.
    fn keep_bounds(&mut self, dt: f64) -> Result<(), StepError> {
        self.active_set.begin(&self.system_data.rows);
        self.contacts.keep(&self.system_data.inertia, false);
        let undecided = self.tally.undecided;
        loop {
            // A solve that other rows at their bounds made obsolete may have stayed undecided.
            self.tally.undecided = undecided;
            self.active_set.hold(&mut self.system_data, dt);
            self.contacts.keep(&self.system_data.inertia, true);
            let solved = self.solve_condensed(dt);
            self.active_set.release(&mut self.system_data);
            if let Err(error) = solved {
                let bounds = &self.system_data.rows.bounds;
                if !is_singular(&error) || !self.active_set.give_way(bounds) {
                    return Err(error);
                }
                self.take_impulses_out();
                continue;
            }
            // The rows that were held are back: their c and Δt f hold slip and impulses as well.
            self.contacts.apply(&mut self.system_data.inertia, false);
            self.slip.release(&mut self.system_data);
            let beside = (self.contacts.presses(), self.slip.largest);
            let mu = &mut self.multipliers.mu;
            let verdict = self.active_set.judge(&mut self.system_data, mu, dt, beside);
            self.tally.undecided += usize::from(verdict == Outcome::NotConverged);
            if verdict != Outcome::Changed {
                break;
            }
            self.take_impulses_out();
        }
        if self.uses.slip {
            self.end_slip();
        }
        Ok(())
    }

    /// One linear system, with the slip and the contacts' impulses that keep their conditions.
    fn solve_condensed(&mut self, dt: f64) -> Result<(), StepError> {
        self.contacts.apply(&mut self.system_data.inertia, true);
        self.solve_once(dt)?;
        if self.uses.slip {
            self.solve_slip()?;
        }
        if !self.contacts.is_empty() {
            self.solve_contacts(dt)?;
        }
        Ok(())
    }

    /// After a solve in which all sheaves stick: the solution with those that slip.
    fn solve_slip(&mut self) -> Result<(), StepError> {
        self.slip.begin();
        let mut stuck = std::mem::take(&mut self.system.in_rows[0]);
        stuck.copy_from_slice(&self.multipliers.mu);
        let settled = self.settle_slip(&stuck);
        self.system.in_rows[0] = stuck;
        self.slip.undecided = !settled?;
        if !self.slip.slips() {
            return Ok(());
        }
        self.slip.apply(&mut self.system_data, &self.active_set);
        self.right_hand_side();
        self.solve_assembled()?;
        // The law of friction to the last digits: what the rates lack now is rounding.
        // The system stays the one that was solved.
        self.slip.correct(&mut self.multipliers.mu);
        self.slip.drive(&mut self.system_data);
        Ok(())
    }

    /// μ of the factorised system for another Δt f. The slip that the last solve found leaves c first: each solve finds the whole
    /// of it anew.
    pub(crate) fn solve_rows_again(&mut self) -> Result<(), StepError> {
        self.slip.take_out(&mut self.system_data);
        self.right_hand_side();
        self.solve_assembled()?;
        if self.uses.slip {
            self.solve_slip()?;
        }
        Ok(())
    }

    /// A⁻¹ B of sheave number `i`, whose B is in `slip.column`.
    fn respond(&mut self, i: usize) -> Result<(), StepError> {
        let mut response = std::mem::take(&mut self.slip.column);
        let report = factor_of!(self, None).respond(&mut response);
        self.slip.learn(i, &response);
        self.slip.column = response;
        let report = report.map_err(|e| self.culprit(e))?;
        self.tally.add_part(report);
        Ok(())
    }

    /// After the rows with bounds have been judged: the rates of what hangs slack, and of the rows that left the system. Slip of which
    /// a solve before the last was undecided does not count.
    fn end_slip(&mut self) {
        self.tally.undecided += usize::from(self.slip.undecided);
        let mut w = std::mem::take(&mut self.system.in_rows[0]);
        self.active_set
            .residuals(&self.system_data, &self.multipliers.mu, &mut w);
        self.slip.share_slack(&mut w, &self.active_set);
        self.system.in_rows[0] = w;
        self.slip.release(&mut self.system_data);
    }

    /// Searches a pattern of sticking and slipping; false if none was found.
    fn settle_slip(&mut self, stuck: &[f64]) -> Result<bool, StepError> {
        let speed = self.system_data.largest_rate();
        for pass in 0.. {
            while let Some((i, _)) = self.slip.wanted(&self.active_set) {
                self.respond(i)?;
            }
            match self
                .slip
                .settle(stuck, &mut self.multipliers.mu, speed, pass)
            {
                Some(true) => return Ok(true),
                Some(false) => self.tally.slip_passes += 1,
                None => break,
            }
        }
        Ok(false)
    }
}

/// True if the matrix is singular to the solver.
fn is_singular(error: &StepError) -> bool {
    use SolveError::{NotPositiveDefinite, Singular};
    matches!(
        error,
        StepError::Solve {
            source: Singular { .. } | NotPositiveDefinite { .. },
            ..
        }
    )
}
