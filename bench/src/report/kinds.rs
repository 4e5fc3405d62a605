//! What the pages of the benchmarks beside the main job show: which columns of their rows stand on the axes of which
//! plot. A benchmark without plots has its tables alone.

use super::Other;
use super::charts::{FLOOR, distinct, known_look};
use super::sheets::{Row, cell, heading};
use crate::plot::{Axis, Chart, Look, Mark, Series};
use serde_json::Value;
use std::borrow::Cow;

/// The plot of work against precision, of which `taut report --picture` makes a file.
pub(super) const PRECISION: &str = "work-precision";

/// Most panels of a plot.
const MOST_PANELS: usize = 36;

/// A benchmark.
struct Kind {
    /// Its name, as that of its file of rows.
    name: &'static str,
    title: &'static str,
    /// A list of its rows and a column that no other has, by which rows without a name are known. The list without a name
    /// is the data itself.
    mark: (&'static str, &'static str),
    plans: &'static [Plan],
}

/// A plot of a list of rows: a panel for each set of values in some columns, in it a series for each set in others.
struct Plan {
    id: &'static str,
    title: &'static str,
    text: &'static str,
    list: &'static str,
    /// Rows that take part: one of these values in this column.
    only: Option<(&'static str, &'static [&'static str])>,
    /// Columns in which a row that takes part has what the first row has.
    as_first: &'static [&'static str],
    /// Columns that the rows of a panel share; a row without a value takes part in all.
    panels: &'static [&'static str],
    /// Columns that the rows of a series share: its name.
    series: &'static [&'static str],
    x: Quantity,
    y: Quantity,
    /// Whether of points above each other only the lowest is shown.
    lowest: bool,
    /// Series without which a panel says nothing.
    least: usize,
    mark: Mark,
}

/// What stands on an axis: the sum of columns.
struct Quantity {
    columns: &'static [&'static str],
    /// With the unit.
    label: &'static str,
    /// What the columns are multiplied by for it.
    factor: f64,
    /// The smallest that is shown on a logarithmic axis; a linear one where it is 0.
    floor: f64,
}

const fn error(column: &'static [&'static str], label: &'static str) -> Quantity {
    Quantity {
        columns: column,
        label,
        factor: 1.0,
        floor: FLOOR,
    }
}

const fn positive(columns: &'static [&'static str], label: &'static str, factor: f64) -> Quantity {
    Quantity {
        columns,
        label,
        factor,
        floor: f64::MIN_POSITIVE,
    }
}

const PLAIN: Plan = Plan {
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

const KINDS: &[Kind] = &[
    Kind {
        name: "accuracy",
        title: "error of whole motions against cost",
        mark: ("records", "horizontal_m"),
        plans: &[
            Plan {
                id: PRECISION,
                title: "Work against precision of the motion",
                text: "Along a curve: Δt. Lower left is better. A run that was lost is not shown.",
                list: "records",
                panels: &["segments", "mass_ratio", "joint", "drive"],
                series: &["setting"],
                x: error(
                    &["horizontal_m"],
                    "largest horizontal error of the load (m)",
                ),
                y: positive(&["cost"], "cost of a simulated second (ms)", 1e3),
                only: Some(("stable", &["yes"])),
                as_first: &["backend", "refinements", "iterations"],
                ..PLAIN
            },
            Plan {
                id: "solvers",
                title: "Solvers",
                text: "The default step with every solver. Along a curve: iterations, or refinements.",
                list: "records",
                panels: &["segments", "mass_ratio"],
                x: error(
                    &["horizontal_m"],
                    "largest horizontal error of the load (m)",
                ),
                y: positive(&["step_ns"], "whole step (µs)", 1e-3),
                only: Some(("stable", &["yes"])),
                as_first: &["setting", "dt", "joint", "drive"],
                least: 2,
                ..PLAIN
            },
        ],
    },
    Kind {
        name: "linear",
        title: "errors of the multipliers against mass ratio",
        mark: ("", "pose"),
        plans: &[Plan {
            id: "mass-ratios",
            title: "Error against mass ratio",
            text: "What forming S loses, about roundoff × mass ratio, refinement from the pieces brings back.",
            panels: &["pose", "segments", "refinements"],
            x: positive(&["mass_ratio"], "load/segment mass ratio (1)", 1.0),
            y: error(&["forward_error"], "relative error of the multipliers (1)"),
            ..PLAIN
        }],
    },
    Kind {
        name: "kernels",
        title: "factorisation and solve alone",
        mark: ("records", "ns_per_joint"),
        plans: &[
            Plan {
                id: PRECISION,
                title: "Work against precision",
                text: "Factorisation and solve of one system. Lower left is better.",
                list: "records",
                panels: &["joint_rows", "mass_ratio", "segments"],
                series: &["solver"],
                x: error(&["forward_error"], "relative error of the multipliers (1)"),
                y: positive(
                    &["ns_per_joint"],
                    "factorise and solve, per joint (ns)",
                    1.0,
                ),
                ..PLAIN
            },
            Plan {
                id: "sizes",
                title: "Time against elements",
                text: "A level line is a cost in proportion to the cable's elements.",
                list: "records",
                panels: &["joint_rows", "mass_ratio"],
                series: &["solver"],
                x: positive(&["segments"], "segments (1)", 1.0),
                y: positive(
                    &["ns_per_joint"],
                    "factorise and solve, per joint (ns)",
                    1.0,
                ),
                ..PLAIN
            },
        ],
    },
    Kind {
        name: "iterative",
        title: "time of iterations to an error",
        mark: ("", "target"),
        plans: &[Plan {
            id: PRECISION,
            title: "Work against precision",
            text: "Least time from the pieces to multipliers within the error, iterations from zero (cold) or from the step \
                   before (warm), beside the direct solver. Lower left is better.",
            panels: &["scene", "size", "mass_ratio", "start"],
            x: error(&["target"], "relative error of the multipliers (1)"),
            y: positive(&["ns"], "assembly, factorisation, solve (µs)", 1e-3),
            ..PLAIN
        }],
    },
    Kind {
        name: "scenes",
        title: "branches and loops",
        mark: ("records", "solve_ns_per_row"),
        plans: &[
            Plan {
                id: PRECISION,
                title: "Work against precision",
                text: "A step's time against the error of the multipliers against 32 digits. Along a curve: iterations. Lower \
                       left is better.",
                list: "records",
                panels: &["scene", "size", "mass_ratio"],
                x: error(&["forward_error"], "relative error of the multipliers (1)"),
                y: positive(&["step_ns"], "whole step (µs)", 1e-3),
                ..PLAIN
            },
            Plan {
                id: "sizes",
                title: "Time against size",
                text: "Of iterations those that converged, with the limit that costs least.",
                list: "records",
                only: Some(("status", &["direct", "converged"])),
                panels: &["scene", "mass_ratio"],
                x: positive(&["rows"], "rows of S (1)", 1.0),
                y: positive(&["solve_ns"], "linear solve (µs)", 1e-3),
                lowest: true,
                ..PLAIN
            },
        ],
    },
    Kind {
        name: "matrix",
        title: "systems from files",
        mark: ("", "about"),
        plans: &[Plan {
            id: PRECISION,
            title: "Work against precision",
            text: "Factorisation and solve against the relative error of x. Along a curve: iterations. Lower left is better.",
            list: "records",
            panels: &["matrix"],
            x: error(&["forward_error"], "relative error of x (1)"),
            y: positive(
                &["factorize_ns", "solve_ns"],
                "factorise and solve (µs)",
                1e-3,
            ),
            ..PLAIN
        }],
    },
    Kind {
        name: "engines",
        title: "whole engines",
        mark: ("", "over_ours"),
        plans: &[Plan {
            id: PRECISION,
            title: "Work against precision",
            text: "What a frame costs against the largest error of the swinging load. Lower left is better.",
            panels: &["segments", "mass_ratio"],
            series: &["engine"],
            x: error(&["load_error"], "error of the load over the length (1)"),
            y: positive(&["frame_ns_min"], "a frame (µs)", 1e-3),
            mark: Mark::Points,
            ..PLAIN
        }],
    },
    Kind {
        name: "energy",
        title: "amplitude, energy and angular momentum over time",
        mark: ("bands", "first_band"),
        plans: &[Plan {
            id: "energy",
            title: "Energy over time",
            text: "Mean of each window of steps minus that of the first, over the largest kinetic energy of the first.",
            list: "bands",
            panels: &["segments", "mass_ratio"],
            series: &["scheme", "stiffness", "guarded"],
            x: Quantity {
                floor: 0.0,
                ..positive(&["means_at"], "steps (10³)", 1e-3)
            },
            y: Quantity {
                floor: 0.0,
                ..positive(&["means"], "change of the energy (1)", 1.0)
            },
            mark: Mark::Line,
            ..PLAIN
        }],
    },
    Kind {
        name: "stability",
        title: "largest stable mass ratios",
        mark: ("", "stable_to"),
        plans: &[],
    },
    Kind {
        name: "shocks",
        title: "kicks, jerks and drops",
        mark: ("outcomes", "excess_gap"),
        plans: &[Plan {
            id: "errors",
            title: "Error after a shock",
            text: "Where the load is at the end, against a finer step. A run that was lost is not shown; the motion after some \
                   shocks is chaotic.",
            list: "outcomes",
            only: Some(("finite", &["yes"])),
            panels: &["shock", "length"],
            series: &["setting"],
            x: positive(&["ratio"], "load/segment mass ratio (1)", 1.0),
            y: error(&["error_m"], "distance of the load from the reference (m)"),
            ..PLAIN
        }],
    },
];

fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}

/// What the page of that benchmark is called.
pub(super) fn title(name: &str) -> &'static str {
    kind(name).map_or("a benchmark", |kind| kind.title)
}

/// The benchmark whose rows these are.
pub(super) fn name_of(rows: &Value) -> Option<&'static str> {
    let is = |kind: &&Kind| {
        let (list, column) = kind.mark;
        let list = if list.is_empty() {
            Some(rows)
        } else {
            rows.get(list)
        };
        let first = list.and_then(Value::as_array).and_then(|rows| rows.first());
        first.is_some_and(|row| row.get(column).is_some())
    };
    KINDS.iter().find(is).map(|kind| kind.name)
}

/// A plot of several panels.
pub(super) struct Plot {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) text: Cow<'static, str>,
    pub(super) charts: Vec<Chart>,
}

/// The plots of a benchmark that have something to show.
pub(super) fn plots(other: &Other) -> Vec<Plot> {
    let plans = kind(&other.name).map_or(&[][..], |kind| kind.plans);
    let plots = plans.iter().map(|plan| plan.plot(&other.rows));
    plots.filter(|plot| !plot.charts.is_empty()).collect()
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
    fn plot(&self, data: &Value) -> Plot {
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
