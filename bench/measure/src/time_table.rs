//! Values over time, from a CSV file with a heading: `time` (s, ascending) and other names, in any order. Between two rows
//! the values change linearly; before the first and after the last they are those of that row.

use crate::errors::Cause;
use std::fmt;

const TIME: &str = "time";

/// Named values over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TimeTable {
    /// One a column.
    pub names: Vec<String>,
    /// \[s], ascending.
    pub time: Vec<f64>,
    /// Row by row.
    values: Vec<f64>,
}

/// A table that does not fit, by fault and remedy, with its line from 1 where it is known.
pub(crate) fn fault(line: Option<u64>, message: impl fmt::Display) -> Cause {
    match line {
        Some(line) => format!("line {line}: {message}").into(),
        None => message.to_string().into(),
    }
}

impl TimeTable {
    /// Refused are tables without `time` or rows, two columns of one name, cells without a finite number, times that do not
    /// ascend.
    pub fn parse(text: &str) -> Result<Self, Cause> {
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
        let Some(timed) = heading.iter().position(|name| name == TIME) else {
            let separated = heading.len() == 1 && heading.iter().any(|h| h.contains([';', '\t']));
            let message = if separated {
                "the columns have to be separated by commas".to_owned()
            } else {
                format!("the heading has no `{TIME}`: name the column of times (s) so")
            };
            return Err(fault(Some(1), message));
        };
        let mut seen: Vec<&str> = heading.iter().collect();
        seen.sort_unstable();
        seen.dedup();
        if seen.len() < heading.len() {
            return Err(fault(Some(1), "two columns have the same name: drop one"));
        }
        let names = heading.iter().filter(|name| *name != TIME);
        let mut table = Self {
            names: names.map(str::to_owned).collect(),
            ..Self::default()
        };
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
                    table.values.push(value);
                } else if table.time.last().is_some_and(|last| *last >= value) {
                    let message = format!("`{TIME}` is {value}: times have to ascend");
                    return Err(fault(line, message));
                } else {
                    table.time.push(value);
                }
            }
        }
        if table.time.is_empty() {
            return Err(fault(None, "the table has no rows: give at least one"));
        }
        Ok(table)
    }

    /// Value of column `k` at time `t` (s).
    pub fn at(&self, k: usize, t: f64) -> f64 {
        let (time, width) = (&self.time, self.names.len());
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

    /// Value of column `k` at time `t` (s), NaN where the table has begun or ended by more than the rounding of times.
    pub fn within(&self, k: usize, t: f64) -> f64 {
        let rounding = 1e-9 * t.abs().max(1.0);
        let begun = self
            .time
            .first()
            .is_some_and(|first| *first <= t + rounding);
        let lasts = self.time.last().is_some_and(|last| t - rounding <= *last);
        if begun && lasts {
            self.at(k, t)
        } else {
            f64::NAN
        }
    }
}
