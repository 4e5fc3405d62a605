//! Plots of any rows, by what stands on their axes: which columns, and which of them tell panels and series apart.

use super::charts::{FLOOR, distinct, known_look};
use super::sheets::{Row, cell, heading};
use crate::plot::{Axis, Chart, Look, Mark, Series};
use serde_json::Value;
use std::borrow::Cow;

/// Most panels of a plot.
const MOST_PANELS: usize = 36;

/// A plot of a list of rows: a panel for each set of values in some columns, in it a series for each set in others.
pub(super) struct Plan {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) text: &'static str,
    pub(super) list: &'static str,
    /// Rows that take part: one of these values in this column.
    pub(super) only: Option<(&'static str, &'static [&'static str])>,
    /// Columns in which a row that takes part has what the first row has.
    pub(super) as_first: &'static [&'static str],
    /// Columns that the rows of a panel share; a row without a value takes part in all.
    pub(super) panels: &'static [&'static str],
    /// Columns that the rows of a series share: its name.
    pub(super) series: &'static [&'static str],
    pub(super) x: Quantity,
    pub(super) y: Quantity,
    /// Whether of points above each other only the lowest is shown.
    pub(super) lowest: bool,
    /// Series without which a panel says nothing.
    pub(super) least: usize,
    pub(super) mark: Mark,
}

/// What stands on an axis: the sum of columns.
pub(super) struct Quantity {
    pub(super) columns: &'static [&'static str],
    /// With the unit.
    pub(super) label: &'static str,
    /// What the columns are multiplied by for it.
    pub(super) factor: f64,
    /// The smallest that is shown on a logarithmic axis; a linear one where it is 0.
    pub(super) floor: f64,
}

pub(super) const fn error(column: &'static [&'static str], label: &'static str) -> Quantity {
    Quantity {
        columns: column,
        label,
        factor: 1.0,
        floor: FLOOR,
    }
}

pub(super) const fn positive(
    columns: &'static [&'static str],
    label: &'static str,
    factor: f64,
) -> Quantity {
    Quantity {
        columns,
        label,
        factor,
        floor: f64::MIN_POSITIVE,
    }
}

pub(super) const PLAIN: Plan = Plan {
    id: "",
    title: "",
    text: "",
    list: "",
    only: None,
    as_first: &[],
    panels: &[],
    series: &["backend"],
    x: error(&[], ""),
    y: error(&[], ""),
    lowest: false,
    least: 1,
    mark: Mark::LineAndPoints,
};

/// A plot of several panels.
pub(super) struct Plot {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) text: Cow<'static, str>,
    pub(super) charts: Vec<Chart>,
}

/// The rows of the list with that name, wherever it is; those of the value itself where there is no name.
fn rows_of(value: &Value, list: &str) -> Vec<Row> {
    let objects = |value: &Value| -> Vec<Row> {
        let items = value.as_array().map_or(&[][..], Vec::as_slice);
        items.iter().filter_map(Value::as_object).cloned().collect()
    };
    match value {
        _ if list.is_empty() => objects(value),
        Value::Array(items) => items.iter().flat_map(|item| rows_of(item, list)).collect(),
        value => value.get(list).map(objects).unwrap_or_default(),
    }
}

/// What a row holds in a column, as it is shown; nothing where it holds nothing.
fn shown(row: &Row, column: &str) -> Option<String> {
    let value = row.get(column).filter(|value| !value.is_null())?;
    Some(cell(column, value).text)
}

impl Plan {
    /// The plot of a benchmark's data.
    pub(super) fn plot(&self, data: &Value) -> Plot {
        let takes_part = |row: &Row| {
            let Some((column, values)) = self.only else {
                return true;
            };
            shown(row, column).is_some_and(|text| values.contains(&text.as_str()))
        };
        let mut rows = rows_of(data, self.list);
        let first = rows.first().cloned().unwrap_or_default();
        let like_first = |row: &Row| self.as_first.iter().all(|c| row.get(*c) == first.get(*c));
        rows.retain(|row| takes_part(row) && like_first(row));
        let names = distinct(rows.iter().map(|row| self.name(row)));
        let key = |row: &Row| -> Vec<Option<String>> {
            self.panels
                .iter()
                .map(|column| shown(row, column))
                .collect()
        };
        let panels = distinct(
            rows.iter()
                .map(key)
                .filter(|key| key.iter().all(Option::is_some)),
        );
        let all = panels.len();
        let chart = |panel: &Vec<Option<String>>| {
            let fits = |row: &&Row| {
                let own = key(row);
                own.iter()
                    .zip(panel)
                    .all(|(own, panel)| own.is_none() || own == panel)
            };
            self.chart(panel, &rows.iter().filter(fits).collect::<Vec<_>>(), &names)
        };
        let charts = panels.iter().take(MOST_PANELS).map(chart);
        let charts = charts
            .filter(|chart| chart.series.len() >= self.least)
            .collect();
        let text = if all > MOST_PANELS {
            Cow::from(format!(
                "{} The first {MOST_PANELS} of {all} panels; the rows below hold all.",
                self.text
            ))
        } else {
            Cow::from(self.text)
        };
        Plot {
            id: self.id,
            title: self.title,
            text,
            charts,
        }
    }

    /// A panel of the rows, whose series have their looks by their places in `names`.
    fn chart(&self, panel: &[Option<String>], rows: &[&Row], names: &[String]) -> Chart {
        let parts = self.panels.iter().zip(panel).filter_map(|(column, value)| {
            let value = value.as_ref()?;
            let is_word = value.chars().next().is_some_and(char::is_alphabetic);
            Some(if is_word {
                value.clone()
            } else {
                format!("{} {value}", heading(column))
            })
        });
        let series = names.iter().enumerate().filter_map(|(place, name)| {
            let own = rows.iter().filter(|row| self.name(row) == *name);
            let mut points: Vec<[f64; 2]> = own.flat_map(|row| self.points(row)).collect();
            if self.lowest {
                points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
                points.dedup_by_key(|point| point[0]);
            }
            // Of lines alone each second one is dashed: those below are seen.
            let by_place = Look {
                dashed: self.mark == Mark::Line && place % 2 == 1,
                ..Look::by_place(place)
            };
            let series = Series {
                look: Some(known_look(name).unwrap_or(by_place)),
                ..Series::new(name, points, self.mark)
            };
            (!series.points.is_empty()).then_some(series)
        });
        Chart {
            title: parts.collect::<Vec<_>>().join(", "),
            x: self.x.axis(),
            y: self.y.axis(),
            series: series.collect(),
        }
    }

    fn name(&self, row: &Row) -> String {
        let parts = self
            .series
            .iter()
            .filter_map(|column| match row.get(*column)? {
                Value::Bool(true) => Some(heading(column)),
                Value::Bool(false) => None,
                _ => shown(row, column),
            });
        parts.collect::<Vec<_>>().join(", ")
    }

    /// The points of a row: one, or those of a list, which lie evenly over its `steps`.
    fn points(&self, row: &Row) -> Vec<[f64; 2]> {
        let list = self
            .y
            .columns
            .first()
            .and_then(|column| row.get(*column)?.as_array());
        let Some(list) = list else {
            let point = self.x.of(row).zip(self.y.of(row));
            return point.map(|(x, y)| [x, y]).into_iter().collect();
        };
        let steps = row.get("steps").and_then(Value::as_f64).unwrap_or(0.0);
        let each = steps / list.len() as f64;
        let values = list.iter().enumerate();
        let points = values.filter_map(|(i, value)| {
            let x = (i as f64 + 0.5) * each * self.x.factor;
            Some([x, value.as_f64()? * self.y.factor])
        });
        points.collect()
    }
}

impl Quantity {
    fn axis(&self) -> Axis {
        if self.floor > 0.0 {
            Axis::log(self.label)
        } else {
            Axis::linear(self.label)
        }
    }

    fn of(&self, row: &Row) -> Option<f64> {
        let mut sum = 0.0;
        for column in self.columns {
            sum += row.get(*column)?.as_f64()?;
        }
        let value = sum * self.factor;
        Some(if self.floor > 0.0 {
            value.max(self.floor)
        } else {
            value
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn rows_become_panels_of_series() {
        let plan = Plan {
            list: "records",
            only: Some(("stable", &["yes"])),
            as_first: &["dt"],
            panels: &["segments", "start"],
            x: positive(&["segments"], "segments (1)", 1.0),
            y: positive(&["factor_ns", "solve_ns"], "time (µs)", 1e-3),
            lowest: true,
            ..PLAIN
        };
        let row = |backend: &str, start: Option<&str>, ns: f64| {
            json!({ "segments": 24, "start": start, "backend": backend, "dt": 0.5, "stable": true,
                "factor_ns": 500.0, "solve_ns": ns })
        };
        let (mut lost, mut other) = (row("cg", Some("cold"), 9.0), row("cg", Some("cold"), 8.0));
        lost["stable"] = false.into();
        other["dt"] = 0.25.into();
        let rows = [
            row("banded", None, 1500.0),
            row("cg", Some("cold"), 3500.0),
            row("cg", Some("cold"), 2500.0),
            row("new", Some("warm"), 4500.0),
            lost,
            other,
        ];
        let plot = plan.plot(&json!([{ "records": rows }]));
        let shown: Vec<(&str, Vec<_>)> = plot
            .charts
            .iter()
            .map(|c| {
                let series = c.series.iter().map(|s| (s.name.as_str(), &s.points[..]));
                (c.title.as_str(), series.collect())
            })
            .collect();
        // The row without a start stands in both panels, of two points above each other the lowest.
        let banded = ("banded", &[[24.0, 2.0]][..]);
        assert_eq!(
            shown,
            [
                (
                    "segments 24, cold",
                    vec![banded, ("cg", &[[24.0, 3.0]][..])]
                ),
                (
                    "segments 24, warm",
                    vec![banded, ("new", &[[24.0, 5.0]][..])]
                ),
            ]
        );
        // What is no solver that is known looks by its place among all.
        let looks = plot.charts.iter().map(|c| c.series[1].look);
        let expected = [known_look("cg"), Some(Look::by_place(2))];
        assert!(looks.eq(expected));
    }

    #[test]
    fn panels_beyond_the_most_are_told_of() {
        let plan = Plan {
            panels: &["k"],
            x: error(&["k"], "k (1)"),
            y: error(&["k"], "k (1)"),
            text: "Said.",
            ..PLAIN
        };
        let rows: Vec<Value> = (1..=50)
            .map(|k| json!({ "k": k, "backend": "cg" }))
            .collect();
        let plot = plan.plot(&Value::from(rows));
        assert_eq!(plot.charts.len(), MOST_PANELS);
        assert!(
            plot.text.contains("Said. The first 36 of 50"),
            "{}",
            plot.text
        );
    }

    #[test]
    fn a_list_is_a_line_over_its_steps() {
        let plan = Plan {
            x: Quantity {
                floor: 0.0,
                ..positive(&[], "steps (1)", 1.0)
            },
            y: Quantity {
                floor: 0.0,
                ..positive(&["means"], "energy (1)", 1.0)
            },
            ..PLAIN
        };
        let plot = plan.plot(&json!([{ "backend": "cg", "steps": 20, "means": [0.0, -1.0] }]));
        assert_eq!(plot.charts[0].series[0].points, [[5.0, 0.0], [15.0, -1.0]]);
    }
}
