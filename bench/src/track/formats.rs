//! The files: figures in the format of github-action-benchmark (`customSmallerIsBetter`), which the baseline has too, and
//! in Bencher's metric format.

use super::measures::{Figure, Measure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One figure, as github-action-benchmark reads it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// `scene/backend/measure`.
    pub name: String,
    pub unit: String,
    pub value: f64,
    /// The spread of times.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<String>,
    /// Condition of the value: toolchain of instructions, machine of times, bar of errors.
    #[serde(default)]
    pub extra: String,
}

/// The figures that have a value that is a number.
pub fn entries(figures: &[Figure]) -> Vec<Entry> {
    let entry = |f: &Figure| {
        let value = *f.value.as_ref().ok().filter(|v| v.is_finite())?;
        Some(Entry {
            name: f.name(),
            unit: f.measure.unit().to_owned(),
            value,
            range: f.spread.map(|s| format!("± {s:.0}")),
            extra: f.condition.clone(),
        })
    };
    figures.iter().filter_map(entry).collect()
}

/// Bencher's benchmarks, each with its measures by name.
pub type Metrics = BTreeMap<String, BTreeMap<String, Metric>>;

/// A measure of Bencher's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Metric {
    pub value: f64,
    /// The least.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lower_value: Option<f64>,
    /// The greatest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub upper_value: Option<f64>,
}

/// Benchmarks `scene/backend`, each with its measures by name. The time is `latency`, the median with
/// the least as the lower value (ns).
pub fn bencher(figures: &[Figure]) -> Metrics {
    let mut all = Metrics::new();
    for figure in figures {
        let Some(value) = figure.value.as_ref().ok().filter(|v| v.is_finite()) else {
            continue;
        };
        let least = |measure: Measure| {
            let same = |f: &&Figure| f.case == figure.case && f.measure == measure;
            figures.iter().find(same)?.value.clone().ok()
        };
        let (name, lower_value) = match figure.measure {
            Measure::Min => continue,
            Measure::Median => ("latency", least(Measure::Min)),
            other => (other.name(), None),
        };
        let metric = Metric {
            value: *value,
            lower_value,
            upper_value: None,
        };
        let case = all.entry(figure.case.clone()).or_default();
        case.insert(name.to_owned(), metric);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::measures::Missing;
    use serde_json::{Value, json};

    fn figures() -> Vec<Figure> {
        let figure = |measure, value| Figure {
            case: "ring-24/banded".to_owned(),
            measure,
            value,
            spread: (measure == Measure::Median).then_some(4.4),
            condition: "here".to_owned(),
            bar: None,
        };
        vec![
            figure(Measure::Instructions, Err(Missing::Failed("no".to_owned()))),
            figure(Measure::ForwardError, Ok(3.5e-16)),
            figure(Measure::LoadError, Ok(f64::NAN)),
            figure(Measure::Min, Ok(90.0)),
            figure(Measure::Median, Ok(100.0)),
        ]
    }

    #[test]
    fn entries_have_the_keys_of_github_action_benchmark_and_read_back() {
        let entries = entries(&figures());
        let text = serde_json::to_string(&entries).unwrap();
        let read: Value = serde_json::from_str(&text).unwrap();
        let expected = json!([
            { "name": "ring-24/banded/forward-error", "unit": "relative", "value": 3.5e-16, "extra": "here" },
            { "name": "ring-24/banded/time-min", "unit": "ns/step", "value": 90.0, "extra": "here" },
            { "name": "ring-24/banded/time-median", "unit": "ns/step", "value": 100.0, "range": "± 4",
              "extra": "here" },
        ]);
        assert_eq!(read, expected);
        assert_eq!(serde_json::from_str::<Vec<Entry>>(&text).unwrap(), entries);
    }

    #[test]
    fn bencher_has_benchmarks_with_measures() {
        let read = serde_json::to_value(bencher(&figures())).unwrap();
        let expected = json!({
            "ring-24/banded": {
                "forward-error": { "value": 3.5e-16 },
                "latency": { "value": 100.0, "lower_value": 90.0 },
            },
        });
        assert_eq!(read, expected);
    }
}
