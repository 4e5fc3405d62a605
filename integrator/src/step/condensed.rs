//! Slip and contacts in the solve of a step: see [`crate::response`]. A scene with neither pays a test of emptiness each.

use super::Step;
use crate::StepError;

impl Step {
    /// Keeps Δt f as it is without contacts: of all rows, or with those `held` that are at a bound.
    #[inline(always)]
    pub(super) fn begin_condensed(&mut self, held: bool) {
        self.contacts.keep(&self.system_data.inertia, held);
    }

    /// After a factorisation: μ, with the slip and the contacts' impulses that keep their conditions.
    #[inline(always)]
    pub(super) fn solve_condensed(&mut self, dt: f64) -> Result<(), StepError> {
        self.solve_rows()?;
        if self.contacts.is_empty() {
            return Ok(());
        }
        self.solve_contacts(dt)
    }

    /// μ of the factorised system, and the sheaves' slip.
    #[inline(always)]
    pub(crate) fn solve_rows(&mut self) -> Result<(), StepError> {
        self.solve_assembled()?;
        if self.slip.is_empty() {
            return Ok(());
        }
        self.solve_slip()
    }

    /// The rows that were held are back in the system's data: their c and Δt f hold slip and impulses as well.
    #[inline(always)]
    pub(super) fn release_condensed(&mut self) {
        self.contacts.apply(&mut self.system_data.inertia, false);
        self.slip.release(&mut self.system_data);
    }

    /// c and Δt f hold neither, for a solve with other rows at their bounds.
    pub(super) fn take_condensed_out(&mut self) {
        self.slip.take_out(&mut self.system_data);
        self.contacts.take_out(&mut self.system_data.inertia, false);
    }

    /// After the rows with bounds have been judged.
    #[inline(always)]
    pub(super) fn end_condensed(&mut self) {
        if !self.slip.is_empty() {
            self.end_slip();
        }
    }
}
