//! The step's solve with cables that slip over their sheaves: see [`crate::slip`].

use super::Stepper;
use crate::StepError;
use crate::contact::operator::Factor;

impl Stepper {
    /// After a solve in which all sheaves stick: the solution with those that slip.
    pub(crate) fn solve_slip(&mut self) -> Result<(), StepError> {
        self.slip.begin();
        let mut stuck = std::mem::take(&mut self.in_rows[0]);
        stuck.copy_from_slice(&self.mu);
        let settled = self.settle_slip(&stuck);
        self.in_rows[0] = stuck;
        self.tally.undecided += usize::from(!settled?);
        if !self.slip.slips() {
            return Ok(());
        }
        self.slip.apply(&mut self.pieces, &self.bounded);
        self.right_hand_side();
        self.solve_assembled()?;
        // The law of friction to the last digits: what the rates lack now is rounding.
        // The system stays the one that was solved.
        self.slip.correct(&mut self.mu);
        self.slip.drive(&mut self.pieces);
        Ok(())
    }

    /// μ of the factorised system for another Δt f. The slip that the last solve found leaves c first: each solve finds the whole
    /// of it anew.
    pub(crate) fn solve_rows_again(&mut self) -> Result<(), StepError> {
        self.slip.take_out(&mut self.pieces);
        self.right_hand_side();
        self.solve_rows()
    }

    /// A⁻¹ B of sheave number `i`, whose B is in `slip.column`.
    fn respond(&mut self, i: usize) -> Result<(), StepError> {
        let mut response = std::mem::take(&mut self.slip.column);
        let mut factor = Factor {
            solver: &mut *self.solver,
            matrix: &self.matrix,
            plan: &self.plan,
            form: self.options.form,
            rows: &self.pieces.rows,
            slip: None,
            system: &mut self.columns,
        };
        let report = factor.respond(&mut response);
        self.slip.learn(i, &response);
        self.slip.column = response;
        let report = report.map_err(|e| self.culprit(e))?;
        self.tally.add_part(report);
        Ok(())
    }

    /// After the rows with bounds have been judged: the rates of what hangs slack, and of the rows that left the system.
    pub(crate) fn end_slip(&mut self) {
        let mut w = std::mem::take(&mut self.in_rows[0]);
        self.bounded.residuals(&self.pieces, &self.mu, &mut w);
        self.slip.share_slack(&mut w, &self.bounded);
        self.in_rows[0] = w;
        self.slip.release(&mut self.pieces);
    }

    /// Whether a pattern of sticking and slipping was found.
    fn settle_slip(&mut self, stuck: &[f64]) -> Result<bool, StepError> {
        let speed = self
            .pieces
            .rate
            .iter()
            .fold(0.0, |m: f64, r| m.max(r.abs()));
        for pass in 0.. {
            while let Some((i, _)) = self.slip.wanted(&self.bounded) {
                self.respond(i)?;
            }
            match self.slip.settle(stuck, &mut self.mu, speed, pass) {
                Some(true) => return Ok(true),
                Some(false) => self.tally.slip_passes += 1,
                None => break,
            }
        }
        Ok(false)
    }
}
