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
