//! Scripted inputs: what an operator does, from a table of times and control values, for runs that can be repeated.
//!
//! A CSV file with a heading: `time` (s, ascending) and names of the scene's controls, in any order. Between two rows the
//! values change linearly; before the first and after the last they are those of that row. A step holds the value of its
//! middle, so that the way driven is exact to second order in Δt.
//!
//! ```csv
//! time,trolley_speed,hoist_speed
//! 0,0,0
//! 1,0.5,0
//! 4,0.5,0.2
//! 5,0,0
//! ```

use crate::errors::Cause;
use std::fmt;
use taut_integrator::{StepError, Stepper};
use taut_model::Scene;

const TIME: &str = "time";

/// Values of some of a scene's controls over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Inputs {
    /// Names of the controls, one a column.
    controls: Vec<String>,
    /// Times \[s], ascending.
    time: Vec<f64>,
    /// Values, row by row.
    values: Vec<f64>,
}

/// A table of inputs that does not fit, by fault and remedy, with its line from 1 where it is known.
fn fault(line: Option<u64>, message: impl fmt::Display) -> Cause {
    match line {
        Some(line) => format!("line {line}: {message}").into(),
        None => message.to_string().into(),
    }
}

impl Inputs {
    /// Reads a CSV text for `scene`. Refused are tables without `time`, columns that name no control of the scene, cells
    /// without a finite number, times that do not ascend.
    pub fn parse(text: &str, scene: &Scene) -> Result<Self, Cause> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let read = |e: csv::Error| {
            let line = e.position().map(csv::Position::line);
            let message = match e.kind() {
                csv::ErrorKind::UnequalLengths {
                    expected_len, len, ..
                } => format!("has {len} values, the heading has {expected_len}"),
                _ => e.to_string(),
            };
            fault(line, message)
        };
        let heading = reader.headers().map_err(read)?.clone();
        if !heading.iter().any(|name| name == TIME) {
            let separated = heading.len() == 1 && heading.iter().any(|h| h.contains([';', '\t']));
            let message = if separated {
                "the columns have to be separated by commas".to_owned()
            } else {
                format!("the heading has no `{TIME}`: name the column of times (s) so")
            };
            return Err(fault(Some(1), message));
        }
        let columns: Vec<Option<String>> = heading
            .iter()
            .map(|name| column(name, scene))
            .collect::<Result<_, _>>()?;
        let timed = columns.iter().position(Option::is_none).unwrap_or(0);
        let mut inputs = Self {
            controls: columns.iter().flatten().cloned().collect(),
            ..Self::default()
        };
        let mut seen = inputs.controls.clone();
        seen.sort_unstable();
        seen.dedup();
        if seen.len() + 1 < columns.len() {
            return Err(fault(Some(1), "two columns have the same name: drop one"));
        }
        for record in reader.records() {
            let record = record.map_err(read)?;
            let line = record.position().map(csv::Position::line);
            for (k, text) in record.iter().enumerate() {
                let value: Option<f64> = text.parse().ok().filter(|v: &f64| v.is_finite());
                let value = value.ok_or_else(|| {
                    let name = heading.get(k).unwrap_or_default();
                    fault(line, format!("`{name}` is `{text}`: give a finite number"))
                })?;
                if k != timed {
                    inputs.values.push(value);
                } else if inputs.time.last().is_some_and(|last| *last >= value) {
                    let message = format!("`{TIME}` is {value}: times have to ascend");
                    return Err(fault(line, message));
                } else {
                    inputs.time.push(value);
                }
            }
        }
        if inputs.time.is_empty() {
            return Err(fault(None, "the table has no rows: give at least one"));
        }
        Ok(inputs)
    }

    /// Names of the controls that it sets.
    pub fn names(&self) -> &[String] {
        &self.controls
    }

    /// Value of column `k` at time `t` (s).
    fn at(&self, k: usize, t: f64) -> f64 {
        let (time, width) = (&self.time, self.controls.len());
        let value = |row: usize| self.values[row * width + k];
        let after = time.partition_point(|x| *x <= t);
        match (after.checked_sub(1), after < time.len()) {
            (Some(before), true) => {
                let part = (t - time[before]) / (time[after] - time[before]);
                value(before) + part * (value(after) - value(before))
            }
            (Some(last), false) => value(last),
            (None, _) => value(0),
        }
    }

    /// Mean of column `k` between the times `from` and `to` (s): what drives move in a step is then that of the table, whatever
    /// its rows are.
    fn mean(&self, k: usize, from: f64, to: f64) -> f64 {
        let first = self.time.partition_point(|t| *t <= from);
        let last = self.time.partition_point(|t| *t < to).max(first);
        let corners = self.time[first..last].iter().copied().chain([to]);
        let mut sum = 0.0;
        let mut before = (from, self.at(k, from));
        for t in corners {
            let value = self.at(k, t);
            sum += 0.5 * (t - before.0) * (value + before.1);
            before = (t, value);
        }
        sum / (to - from)
    }

    /// Sets the controls for the step that begins at the stepper's time, but for those that have gone with what they drove.
    pub fn apply(&self, stepper: &mut Stepper) -> Result<(), StepError> {
        let (from, dt) = (stepper.time(), stepper.options().dt);
        for (k, name) in self.controls.iter().enumerate() {
            let controls = &stepper.scene().controls;
            if let Some(control) = controls.iter().position(|c| c.name == *name) {
                stepper.set_control(control, self.mean(k, from, from + dt))?;
            }
        }
        Ok(())
    }
}

/// The name of the control that a column is for, none for that of the times.
fn column(name: &str, scene: &Scene) -> Result<Option<String>, Cause> {
    if name == TIME {
        return Ok(None);
    }
    let found = scene.control(name);
    found
        .map(|_| Some(name.to_owned()))
        .map_err(|e| fault(Some(1), e.to_string()))
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
        let at = |t| inputs.at(0, t);
        assert_eq!(
            [at(0.9), at(1.0), at(1.5), at(2.0), at(3.0), at(3.1)],
            [0.5, 0.5, 0.25, 0.0, -0.5, -0.5]
        );
    }

    #[test]
    fn faults_say_where_and_what_to_do() {
        let says = |text: &str, words: &str| {
            let error = Inputs::parse(text, &gantry())
                .expect_err("a fault")
                .to_string();
            assert_eq!(error, words);
        };
        says(
            "time,hoist\n0,1\n",
            "line 1: no control is called `hoist`: choose one of trolley_speed, hoist_speed",
        );
        says(
            "hoist_speed\n1\n",
            "line 1: the heading has no `time`: name the column of times (s) so",
        );
        says(
            "time;hoist_speed\n0;1\n",
            "line 1: the columns have to be separated by commas",
        );
        says(
            "time,hoist_speed,hoist_speed\n0,1,1\n",
            "line 1: two columns have the same name: drop one",
        );
        says(
            "time,hoist_speed\n0,1\n1,fast\n",
            "line 3: `hoist_speed` is `fast`: give a finite number",
        );
        says(
            "time,hoist_speed\n0,1\n1,inf\n",
            "line 3: `hoist_speed` is `inf`: give a finite number",
        );
        says(
            "time,hoist_speed\n1,1\n1,2\n",
            "line 3: `time` is 1: times have to ascend",
        );
        says(
            "time,hoist_speed\n0\n",
            "line 2: has 1 values, the heading has 2",
        );
        says(
            "time,hoist_speed\n",
            "the table has no rows: give at least one",
        );
        let none = Inputs::parse("time,x\n0,1\n", &Scene::new("none")).expect_err("a fault");
        assert!(none.to_string().ends_with("the scene has none"), "{none}");
    }
}
