//! The figures of many runs: a file of a line for each, in JSON, and its page.

use super::formats::Entry;
use crate::machine::{self, Machine};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::Path;
use taut_measure::files::{self, FileError, Output};
use taut_studies::study::{PLAIN, Study};

/// Version of the line format.
const SCHEMA: u32 = 1;

/// Most runs on a page, the last ones.
const MOST: usize = 60;

/// Page of a history.
pub const HISTORY: Study = Study {
    name: "track-history",
    question: taut_studies::question!("track-history", &[]),
    ..PLAIN
};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    schema: u32,
    /// The commit, as [`machine::commit`] has it.
    pub commit: String,
    /// When: seconds since 1970.
    pub unix_time: u64,
    /// The machine, one line.
    pub machine: String,
    /// Compiler and processor.
    pub toolchain: String,
    pub figures: Vec<Entry>,
}

impl Run {
    /// Figures measured now on this machine.
    pub fn new(figures: Vec<Entry>) -> Self {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        Self {
            schema: SCHEMA,
            commit: machine::commit(),
            unix_time: now.map_or(0, |t| t.as_secs()),
            machine: Machine::current().to_string(),
            toolchain: super::toolchain(),
            figures,
        }
    }
}

/// The runs of a file, the oldest first; empty before the file exists.
pub fn read(path: &Path) -> Result<Vec<Run>, String> {
    match files::read_text(path) {
        Ok(text) => parse(path, &text),
        Err(e) if e.source.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        Err(e) => Err(e.to_string()),
    }
}

fn parse(path: &Path, text: &str) -> Result<Vec<Run>, String> {
    let run = |(i, text): (usize, &str)| {
        let damaged = |reason: String| {
            let (line, path) = (i + 1, path.display());
            format!(
                "line {line} of `{path}` is no run of `taut track`: {reason}; take it out, or begin another file"
            )
        };
        let value: Value = serde_json::from_str(text).map_err(|e| damaged(e.to_string()))?;
        match value["schema"].as_u64() {
            Some(schema) if schema != u64::from(SCHEMA) => Err(damaged(format!(
                "it is of schema {schema}, this program's is {SCHEMA}"
            ))),
            _ => serde_json::from_value(value).map_err(|e| damaged(e.to_string())),
        }
    };
    text.lines().enumerate().map(run).collect()
}

/// Writes the runs that were there and another one. The file is the old one or the new one, whatever happens.
pub fn append(to: &Output, runs: &[Run], run: &Run) -> Result<(), FileError> {
    to.write(|out| {
        for run in runs.iter().chain([run]) {
            serde_json::to_writer(&mut *out, run)?;
            out.write_all(b"\n")?;
        }
        Ok(())
    })
}

/// The figures of the last runs as rows, each with its ratio to the first of its name.
pub fn data(runs: &[Run]) -> Value {
    let runs = &runs[runs.len().saturating_sub(MOST)..];
    let mut first: HashMap<&str, f64> = HashMap::new();
    let mut times: HashMap<&str, usize> = HashMap::new();
    let mut rows = Vec::new();
    for run in runs {
        let time = times.entry(&run.commit).or_default();
        *time += 1;
        // Short, for names stand side by side; a commit that was measured again has a place of its own.
        let commit = run.commit.replace("-dirty", "+");
        let name = match time {
            1 => commit,
            again => format!("{commit} #{again}"),
        };
        for figure in &run.figures {
            let first = *first.entry(&figure.name).or_insert(figure.value);
            let relative = figure.value / first;
            let (case, measure) = figure.name.rsplit_once('/').unwrap_or(("", &figure.name));
            rows.push(json!({
                "measure": measure,
                "case": case,
                "run": name,
                "value": figure.value,
                "unit": figure.unit,
                "relative": relative.is_finite().then_some(relative),
                "machine": run.machine,
            }));
        }
    }
    Value::Array(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(commit: &str, value: f64) -> Run {
        let figures = [
            ("gantry/banded/time-min", value),
            ("gantry/banded/allocations", 0.0),
        ];
        let figures = figures.map(|(name, value)| Entry {
            name: name.to_owned(),
            unit: "ns/step".to_owned(),
            value,
            range: None,
            extra: String::new(),
        });
        Run {
            commit: commit.to_owned(),
            ..Run::new(figures.into())
        }
    }

    #[test]
    fn figures_are_over_those_of_the_first_run() {
        let data = data(&[run("a", 200.0), run("b", 210.0), run("b", 190.0)]);
        let rows = data.as_array().unwrap();
        let of = |measure: &str| -> Vec<(&str, Option<f64>)> {
            let own = rows.iter().filter(|r| r["measure"] == measure);
            own.map(|r| (r["run"].as_str().unwrap(), r["relative"].as_f64()))
                .collect()
        };
        let expected = [("a", Some(1.0)), ("b", Some(1.05)), ("b #2", Some(0.95))];
        assert_eq!(of("time-min"), expected);
        // 0/0 draws no line.
        assert_eq!(of("allocations")[0], ("a", None));
        let plot = HISTORY.question().plots[0].plot(&data);
        assert_eq!(plot.charts[0].x.names, ["a", "b", "b #2"]);
    }

    #[test]
    fn the_last_runs_are_shown() {
        let runs: Vec<Run> = (0..100).map(|i| run(&i.to_string(), 1.0)).collect();
        let data = data(&runs);
        assert_eq!(data.as_array().unwrap().len(), 2 * MOST);
        assert_eq!(data[0]["run"], "40");
    }

    #[test]
    fn lines_that_are_no_runs_are_named() {
        let good = serde_json::to_string(&run("a", 1.0)).unwrap();
        let path = Path::new("h.jsonl");
        assert_eq!(parse(path, &format!("{good}\n{good}")).unwrap().len(), 2);
        let other = good.replace("\"schema\":1", "\"schema\":7");
        for (bad, words) in [
            (good[..40].to_owned(), "line 2 of `h.jsonl` is no run"),
            (String::new(), "line 2 of `h.jsonl` is no run"),
            ("{}".to_owned(), "missing field"),
            (other, "of schema 7"),
        ] {
            let text = format!("{good}\n{bad}\n{good}");
            let said = parse(path, &text).unwrap_err().to_string();
            assert!(said.contains(words), "{said}");
        }
    }
}
