//! Plots of any rows, by what stands on their axes: which columns, and which of them tell panels and series apart.

use crate::plot::{Axis, Chart, Look, Mark, Series};
use crate::row::{self, Row, heading, rows_of};
use crate::settings::distinct;
use serde::Deserialize;
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// The plot of work against precision, of which `taut report --picture` makes a file.
pub const PRECISION: &str = "work-precision";

/// Smallest error that is drawn: what is exact to the last bit stands there.
pub const FLOOR: f64 = 1e-17;

/// Most panels of a plot.
const MOST_PANELS: usize = 36;

/// A plot of a list of rows: a panel for each set of values in some columns, in it a series for each set in others.
#[derive(Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Plan {
    /// Name in pages and files.
    pub id: &'static str,
    pub title: &'static str,
    /// Caption below the title.
    pub text: &'static str,
    /// The list of rows in the data; the list without a name is the data itself.
    pub list: &'static str,
    /// Rows that take part: one of these values in each of these columns.
    pub only: BTreeMap<&'static str, Vec<&'static str>>,
    /// Columns in which a row that takes part has what the first row has.
    pub as_first: Vec<&'static str>,
    /// Columns that the rows of a panel share; a row without a value takes part in all.
    pub panels: Vec<&'static str>,
    /// Columns that the rows of a series share: its name.
    pub series: Vec<&'static str>,
    pub x: Quantity,
    pub y: Quantity,
    /// Shows only the lowest of the points at one x.
    pub lowest: bool,
    /// Series without which a panel says nothing.
    pub least: usize,
    /// Places on the horizontal axis without which a panel says nothing.
    pub least_places: usize,
    /// How series are drawn.
    pub mark: Mark,
    /// Draws guide lines for errors of first and second order.
    pub orders: bool,
}

impl Default for Plan {
    /// All rows of the data, a series for each solver.
    fn default() -> Self {
        Self {
            id: "",
            title: "",
            text: "",
            list: "",
            only: BTreeMap::new(),
            as_first: Vec::new(),
            panels: Vec::new(),
            series: vec!["backend"],
            x: Quantity::default(),
            y: Quantity::default(),
            lowest: false,
            least: 1,
            least_places: 1,
            mark: Mark::LineAndPoints,
            orders: false,
        }
    }
}

/// Quantity of an axis: the magnitude of a sum of columns if logarithmic, the sum if linear, or the
/// text of a column.
#[derive(Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Quantity {
    /// Columns to add.
    pub columns: Vec<&'static str>,
    /// With the unit.
    pub label: &'static str,
    /// Factor from the sum to the unit of the label.
    pub factor: f64,
    pub scale: Scale,
}

impl Default for Quantity {
    fn default() -> Self {
        Self {
            columns: Vec::new(),
            label: "",
            factor: 1.0,
            scale: Scale::Errors,
        }
    }
}

/// Scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Logarithmic, from [`FLOOR`] on.
    Errors,
    /// Logarithmic.
    Positive,
    Linear,
    /// A place for each distinct text of the column.
    Texts,
}

/// A plot of several panels.
pub struct Plot {
    /// Name in pages and files.
    pub id: &'static str,
    pub title: &'static str,
    /// Caption below the title.
    pub text: Cow<'static, str>,
    pub charts: Vec<Chart>,
}

/// Text of a row's cell; `None` if it is absent or null.
fn shown(row: &Row, column: &str) -> Option<String> {
    let value = row.get(column).filter(|value| !value.is_null())?;
    Some(row::shown(column, value))
}

/// [`shown`], with the column's name before a bare number.
fn labelled(row: &Row, column: &str) -> Option<String> {
    let text = shown(row, column)?;
    let is_number = row.get(column).is_some_and(Value::is_number) || text.parse::<f64>().is_ok();
    Some(if is_number {
        format!("{} {text}", heading(column))
    } else {
        text
    })
}

impl Plan {
    /// The plot of a benchmark's data.
    pub fn plot(&self, data: &Value) -> Plot {
        let takes_part = |row: &Row| {
            let fits = |(column, values): (&&str, &Vec<&str>)| {
                shown(row, column).is_some_and(|text| values.contains(&text.as_str()))
            };
            self.only.iter().all(fits)
        };
        let mut rows = rows_of(data, self.list);
        let first = rows.first().cloned().unwrap_or_default();
        let like_first = |row: &Row| self.as_first.iter().all(|c| row.get(*c) == first.get(*c));
        rows.retain(|row| takes_part(row) && like_first(row));
        let names = distinct(rows.iter().map(|row| self.name(row)));
        let key = |row: &Row| -> Vec<Option<String>> {
            self.panels
                .iter()
                .map(|column| labelled(row, column))
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
        let charts = charts.filter(|chart| self.says_something(chart)).collect();
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

    fn says_something(&self, chart: &Chart) -> bool {
        let data = chart.series.iter().filter(|s| s.mark == self.mark);
        let places = data.clone().flat_map(|s| &s.points).map(|p| p[0]);
        data.count() >= self.least && distinct(places).len() >= self.least_places
    }

    /// A panel of the rows, whose series have their looks by their places in `names`.
    fn chart(&self, panel: &[Option<String>], rows: &[&Row], names: &[String]) -> Chart {
        let parts: Vec<&str> = panel.iter().flatten().map(String::as_str).collect();
        let title = if parts.is_empty() {
            self.title.to_owned()
        } else {
            parts.join(", ")
        };
        let own = |name: &String| -> Vec<&&Row> {
            rows.iter().filter(|row| self.name(row) == *name).collect()
        };
        let texts = self.x.texts(rows);
        let in_panel = names.iter().filter(|name| !own(name).is_empty()).count();
        let mut series: Vec<Series> = Vec::new();
        for (place, name) in names.iter().enumerate() {
            // Beside each other where points of several series have the same place.
            let apart = 0.1_f64.min(0.8 / in_panel as f64);
            let aside = apart * (series.len() as f64 - 0.5 * (in_panel as f64 - 1.0));
            let points = own(name).into_iter().flat_map(|row| {
                let mut points = self.points(row, &texts);
                if self.x.scale == Scale::Texts {
                    points.iter_mut().for_each(|p| p[0] += aside);
                }
                points
            });
            let mut points: Vec<[f64; 2]> = points.collect();
            if self.lowest {
                points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
                points.dedup_by_key(|point| point[0]);
            }
            if !points.is_empty() {
                series.push(Series {
                    look: Some(Look::of_solver(name).unwrap_or(Look::by_place(place))),
                    ..Series::new(name, points, self.mark)
                });
            }
        }
        let chart = Chart {
            title,
            x: self.x.axis(texts),
            y: self.y.axis(Vec::new()),
            series,
        };
        if self.orders {
            chart.with_orders()
        } else {
            chart
        }
    }

    fn name(&self, row: &Row) -> String {
        let parts = self
            .series
            .iter()
            .filter_map(|column| match row.get(*column)? {
                Value::Bool(true) => Some(heading(column)),
                Value::Bool(false) => None,
                _ => labelled(row, column),
            });
        parts.collect::<Vec<_>>().join(", ")
    }

    /// The points of a row: one, or those of a list, which lie evenly over its `steps`.
    fn points(&self, row: &Row, texts: &[String]) -> Vec<[f64; 2]> {
        let list = self
            .y
            .columns
            .first()
            .and_then(|column| row.get(*column)?.as_array());
        let Some(list) = list else {
            let point = self.x.of(row, texts).zip(self.y.of(row, &[]));
            return point.map(|(x, y)| [x, y]).into_iter().collect();
        };
        let steps = row.get("steps").and_then(Value::as_f64).unwrap_or(0.0);
        let each = steps / list.len() as f64;
        let values = list.iter().enumerate();
        let points = values.filter_map(|(i, value)| {
            let x = (i as f64 + 0.5) * each * self.x.factor;
            Some([x, self.y.place(value.as_f64()?)])
        });
        points.collect()
    }
}

impl Quantity {
    fn axis(&self, texts: Vec<String>) -> Axis {
        match self.scale {
            Scale::Texts => Axis::of_names(self.label, texts),
            Scale::Errors | Scale::Positive => Axis::log(self.label),
            Scale::Linear => Axis::linear(self.label),
        }
    }

    /// Distinct texts of the rows; empty for a numeric quantity.
    fn texts(&self, rows: &[&Row]) -> Vec<String> {
        if self.scale != Scale::Texts {
            return Vec::new();
        }
        distinct(rows.iter().filter_map(|row| self.text(row)))
    }

    fn text(&self, row: &Row) -> Option<String> {
        shown(row, self.columns.first()?)
    }

    /// The place of a row, among the texts where it has one.
    fn of(&self, row: &Row, texts: &[String]) -> Option<f64> {
        if self.scale == Scale::Texts {
            let own = self.text(row)?;
            return texts.iter().position(|t| *t == own).map(|i| i as f64);
        }
        let mut sum = 0.0;
        for column in &self.columns {
            sum += row.get(*column)?.as_f64()?;
        }
        Some(self.place(sum))
    }

    fn place(&self, value: f64) -> f64 {
        let value = value * self.factor;
        match self.scale {
            Scale::Errors => value.abs().max(FLOOR),
            Scale::Positive => value.abs().max(f64::MIN_POSITIVE),
            Scale::Linear | Scale::Texts => value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn axis(scale: Scale, columns: &[&'static str], factor: f64) -> Quantity {
        Quantity {
            columns: columns.to_vec(),
            factor,
            scale,
            ..Quantity::default()
        }
    }

    #[test]
    fn rows_become_panels_of_series() {
        let plan = Plan {
            list: "records",
            only: BTreeMap::from([("stable", vec!["yes"])]),
            as_first: vec!["dt"],
            panels: vec!["segments", "start"],
            x: axis(Scale::Positive, &["segments"], 1.0),
            y: axis(Scale::Positive, &["factor_ns", "solve_ns"], 1e-3),
            lowest: true,
            ..Plan::default()
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
        let right = [
            (
                "segments 24, cold",
                vec![banded, ("cg", &[[24.0, 3.0]][..])],
            ),
            (
                "segments 24, warm",
                vec![banded, ("new", &[[24.0, 5.0]][..])],
            ),
        ];
        assert_eq!(shown, right);
        // The name `new` belongs to no solver, so its look follows from its place.
        let looks = plot.charts.iter().map(|c| c.series[1].look);
        let expected = [Look::of_solver("cg"), Some(Look::by_place(2))];
        assert!(looks.eq(expected));
    }

    #[test]
    fn panels_beyond_the_most_are_told_of() {
        let plan = Plan {
            panels: vec!["k"],
            x: axis(Scale::Errors, &["k"], 1.0),
            y: axis(Scale::Errors, &["k"], 1.0),
            text: "Said.",
            ..Plan::default()
        };
        let rows = (1..=50).map(|k| json!({ "k": k, "backend": "cg" }));
        let rows: Vec<Value> = rows.collect();
        let plot = plan.plot(&Value::from(rows));
        assert_eq!(plot.charts.len(), MOST_PANELS);
        let says = plot.text.contains("Said. The first 36 of 50");
        assert!(says, "{}", plot.text);
    }

    #[test]
    fn a_list_is_a_line_over_its_steps() {
        let plan = Plan {
            x: axis(Scale::Linear, &[], 1.0),
            y: axis(Scale::Linear, &["means"], 1.0),
            ..Plan::default()
        };
        let plot = plan.plot(&json!([{ "backend": "cg", "steps": 20, "means": [0.0, -1.0] }]));
        assert_eq!(plot.charts[0].series[0].points, [[5.0, 0.0], [15.0, -1.0]]);
    }

    #[test]
    fn texts_have_places_and_their_series_stand_beside_each_other() {
        let plan = Plan {
            x: axis(Scale::Texts, &["stiffness"], 1.0),
            y: axis(Scale::Positive, &["stable_to"], 1.0),
            ..Plan::default()
        };
        let row = |backend: &str, stiffness: &str, to: f64| {
            json!({ "backend": backend, "stiffness": stiffness,
                "stable_to": to })
        };
        let rows = [
            row("cg", "off", 10.0),
            row("cg", "0.4", 100.0),
            row("banded", "0.4", 1e3),
        ];
        let plot = plan.plot(&Value::from(rows.to_vec()));
        let chart = &plot.charts[0];
        assert_eq!(chart.x.names, ["off", "0.4"]);
        let points: Vec<_> = chart.series.iter().map(|s| s.points.clone()).collect();
        assert_eq!(points[0], [[-0.05, 10.0], [0.95, 100.0]]);
        assert_eq!(points[1], [[1.05, 1e3]]);
    }
}
