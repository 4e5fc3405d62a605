//! Steps that fail or are stopped.

use super::Stepper;
use crate::StepError;

impl Stepper {
    /// Clears what failed work has left. Returns the error that is to be told.
    pub(super) fn after_failure(&mut self, mut e: StepError) -> StepError {
        if matches!(e, StepError::Stopped { .. } | StepError::TooMuchWork { .. }) {
            match self.return_to_beginning() {
                Ok(true) => return e,
                Ok(false) => {}
                Err(other) => e = other,
            }
        } else if let Some((c, reason)) = self.system_data.rows.lost {
            e = self.off_path(c, reason);
        }
        self.stage.unsolve();
        self.tension_known = false;
        self.mu.fill(0.0);
        self.account.close();
        self.fired.met.clear();
        e
    }
}
