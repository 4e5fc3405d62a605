//! A driven minute of the gantry, and the time that 99 % of its steps stay within: what a program that must end each step
//! in time waits for.
//!
//! Trolley and hook go along and up, along and down, back and up, back and down, five seconds each, three times. The motion
//! is the same each minute; a step's time is its least of all minutes, so that the steps that are long by themselves
//! count, such as those that the guard repeats, and not those that the system interrupts.

use super::cases::{DT, Workload};
use super::wall;
use taut_integrator::{StepError, Stepper};
use taut_measure::choice::Choice;
use taut_model::{Controls, Scene};

const STEPS: usize = 3600;
/// Steps between two changes of the controls.
const LEG: usize = 300;

const fn drive(along: f64, up: f64) -> Controls {
    Controls {
        trolley_speed: 0.5 * along,
        hoist_speed: 0.1 * up,
    }
}

/// Commands of the operator, one leg each.
const LEGS: [Controls; 4] = [
    drive(1.0, 1.0),
    drive(1.0, -1.0),
    drive(-1.0, 1.0),
    drive(-1.0, -1.0),
];

/// Minutes of a case.
#[derive(Debug)]
pub(super) struct Minutes {
    /// Least time of each step \[ns].
    least: Vec<f64>,
}

impl Minutes {
    pub(super) fn new() -> Self {
        Self {
            least: vec![f64::INFINITY; STEPS],
        }
    }

    /// Drives another minute, from the beginning of the scene; its steps are slowed as [`wall::step`] has it.
    pub(super) fn drive(
        &mut self,
        scene: &Scene,
        choice: &Choice,
        slowed: f64,
    ) -> Result<(), StepError> {
        // A winch counts from its last change: time cannot be put back.
        let mut stepper: Stepper = Workload::Gantry.stepper(scene.clone(), choice.options(DT))?;
        for (i, least) in self.least.iter_mut().enumerate() {
            if i % LEG == 0 {
                stepper.set_controls(&LEGS[i / LEG % LEGS.len()])?;
            }
            *least = least.min(wall::step(&mut stepper, slowed)?);
        }
        Ok(())
    }

    /// The time that 99 % of the steps stay within \[ns].
    pub(super) fn p99(&self) -> f64 {
        let mut sorted = self.least.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[STEPS * 99 / 100 - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_step_in_a_hundred_may_be_longer() {
        let mut minutes = Minutes::new();
        for (i, least) in minutes.least.iter_mut().enumerate() {
            // In no order.
            *least = (i * 7 % STEPS + 1) as f64;
        }
        assert_eq!(minutes.p99(), 3564.0);
    }

    #[test]
    fn trolley_and_hook_come_back() {
        let sum = |speed: fn(&Controls) -> f64| LEGS.iter().map(speed).sum::<f64>();
        assert_eq!(sum(|c| c.trolley_speed), 0.0);
        assert_eq!(sum(|c| c.hoist_speed), 0.0);
        assert_eq!(STEPS % (LEG * LEGS.len()), 0);
    }
}
