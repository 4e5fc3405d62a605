//! Scripted inputs: what an operator does, from a table of times and control values, for runs that can be repeated.
//!
//! A [`TimeTable`] of the scene's controls. A sub-step holds the mean over its time, so that the way driven is that of the table.
//!
//! ```csv
//! time,trolley_speed,hoist_speed
//! 0,0,0
//! 1,0.5,0
//! 4,0.5,0.2
//! 5,0,0
//! ```

use crate::errors::Cause;
use crate::time_table::{TimeTable, fault};
use taut_integrator::{StepError, Stepper};
use taut_model::Scene;

/// Difference of means that is rounding, over the mean.
const ROUNDING: f64 = 1e-12;

/// Values of some of a scene's controls over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Inputs(TimeTable);

impl Inputs {
    /// Reads a CSV text for `scene`. Refused are faulty tables, and columns that name no control of the scene.
    pub fn parse(text: &str, scene: &Scene) -> Result<Self, Cause> {
        let table = TimeTable::parse(text)?;
        for name in &table.names {
            scene.control(name).map_err(|e| fault(Some(1), e))?;
        }
        Ok(Self(table))
    }

    /// Names of the controls that it sets.
    pub fn names(&self) -> &[String] {
        &self.0.names
    }

    /// Mean of column `k` between the times `from` and `to` (s): what drives move in a step is then that of the table, whatever
    /// its rows are.
    fn mean(&self, k: usize, from: f64, to: f64) -> f64 {
        let time = &self.0.time;
        let first = time.partition_point(|t| *t <= from);
        let last = time.partition_point(|t| *t < to).max(first);
        let corners = time[first..last].iter().copied().chain([to]);
        let mut sum = 0.0;
        let mut before = (from, self.0.at(k, from));
        for t in corners {
            let value = self.0.at(k, t);
            sum += 0.5 * (t - before.0) * (value + before.1);
            before = (t, value);
        }
        sum / (to - from)
    }

    /// Sets the controls for the step that begins at the stepper's time, but for those that have gone with what they drove.
    pub fn apply(&self, stepper: &mut Stepper) -> Result<(), StepError> {
        let (from, dt, n) = (
            stepper.time(),
            stepper.options().dt,
            stepper.options().substeps,
        );
        for (k, name) in self.0.names.iter().enumerate() {
            let controls = &stepper.scene().controls;
            let Some(control) = controls.iter().position(|c| c.name == *name) else {
                continue;
            };
            let at = |substep: usize| from + dt * (substep as f64 / n as f64);
            let means = (0..n).map(|i| self.mean(k, at(i), at(i + 1)));
            let means = means.collect::<Vec<f64>>();
            let whole = self.mean(k, from, from + dt);
            if means
                .iter()
                .all(|mean| (mean - whole).abs() <= ROUNDING * whole.abs())
            {
                stepper.set_control(control, whole)?;
            } else {
                stepper.set_course(control, &means)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_model::GantryParams;

    fn gantry() -> Scene {
        GantryParams::default().build().expect("builds")
    }

    #[test]
    fn a_step_is_driven_by_the_mean() {
        let text = "time,hoist_speed\n0,0\n0.1,0\n0.104,10\n0.108,0\n2,0\n";
        let inputs = Inputs::parse(text, &gantry()).expect("reads");
        for [from, to, mean] in [
            [0.0, 0.1, 0.0],
            [0.1, 0.2, 0.4],
            [0.102, 0.104, 7.5],
            [3.0, 4.0, 0.0],
        ] {
            let found = inputs.mean(0, from, to);
            assert!((found - mean).abs() < 1e-12, "{from} {to}: {found}");
        }
    }

    #[test]
    fn values_are_linear_between_rows_and_hold_outside() {
        let text = "# a drive\ntime, hoist_speed\n1,0.5\n3,-0.5\n";
        let inputs = Inputs::parse(text, &gantry()).expect("reads");
        assert_eq!(inputs.names(), ["hoist_speed"]);
        let at = |t| inputs.0.at(0, t);
        let found = [at(0.9), at(1.0), at(1.5), at(2.0), at(3.0), at(3.1)];
        assert_eq!(found, [0.5, 0.5, 0.25, 0.0, -0.5, -0.5]);
    }

    #[test]
    fn faults_say_where_and_what_to_do() {
        let faults = "\
time,hoist⏎0,1⏎ → line 1: no control is called `hoist`: choose one of trolley_speed, hoist_speed
hoist_speed⏎1⏎ → line 1: the heading has no `time`: name the column of times (s) so
time;hoist_speed⏎0;1⏎ → line 1: the columns have to be separated by commas
time,hoist_speed,hoist_speed⏎0,1,1⏎ → line 1: two columns have the same name: drop one
time,hoist_speed⏎0,1⏎1,fast⏎ → line 3: `hoist_speed` is `fast`: give a finite number
time,hoist_speed⏎0,1⏎1,inf⏎ → line 3: `hoist_speed` is `inf`: give a finite number
time,hoist_speed⏎1,1⏎1,2⏎ → line 3: `time` is 1: times have to ascend
time,hoist_speed⏎0⏎ → line 2: has 1 values, the heading has 2
time,hoist_speed⏎ → the table has no rows: give at least one";
        for row in faults.lines() {
            let (text, words) = row.split_once(" → ").expect("two cells");
            let fault = Inputs::parse(&text.replace('⏎', "\n"), &gantry());
            assert_eq!(fault.expect_err(text).to_string(), words);
        }
        let none = Inputs::parse("time,x\n0,1\n", &Scene::new("none")).expect_err("a fault");
        assert!(none.to_string().ends_with("the scene has none"), "{none}");
    }
}
