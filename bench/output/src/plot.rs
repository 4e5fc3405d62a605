//! Charts as SVG text: lines, points and bars, linear or logarithmic axes, several panels beside each other.
//!
//! This module says what a chart is. `look` holds colours, shapes and dashes, `marks` draws points and lines of these,
//! `ticks` has the axes' ticks, `legend` what stands below a panel, `draw` draws the whole.

mod draw;
mod legend;
mod look;
mod marks;
mod ticks;

pub use draw::{picture, svg, svg_for_page};
pub use look::{Dash, Look, Shape};

use crate::notation::number;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use ticks::Scale;

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Logarithmic: values that are not positive are left out.
    pub log: bool,
    /// `None` takes the ends of the data.
    pub range: Option<[f64; 2]>,
    /// Grows downwards or to the left.
    pub reversed: bool,
    /// Labels at the places 0, 1 … of an axis without numbers.
    pub names: Vec<String>,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str) -> Self {
        Self {
            label: label.to_owned(),
            ..Self::default()
        }
    }

    /// A logarithmic axis.
    pub fn log(label: &str) -> Self {
        Self {
            log: true,
            ..Self::linear(label)
        }
    }

    /// An axis of names at the places 0, 1 …
    pub fn of_names(label: &str, names: Vec<String>) -> Self {
        Self {
            names,
            ..Self::linear(label)
        }
    }

    /// The place of a number on the axis: its logarithm on a logarithmic one.
    fn place(&self, value: f64) -> f64 {
        if self.log { value.log10() } else { value }
    }

    /// The axis that holds all `values`, with a margin.
    fn scale(&self, values: impl Iterator<Item = f64>) -> Scale {
        if self.names.is_empty() {
            Scale::new(self.ends(values), self.log, self.reversed)
        } else {
            Scale::of_names(&self.names)
        }
    }

    /// The ends of the axis that holds all `values`, with a margin.
    fn ends(&self, values: impl Iterator<Item = f64>) -> Range<f64> {
        if let Some([low, high]) = self.range {
            return self.place(low)..self.place(high);
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|v| v.is_finite()) {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            return 0.0..1.0;
        }
        // A single value stands in the middle of something.
        let least = if self.log {
            0.5
        } else {
            1e-12 + 0.1 * low.abs()
        };
        let margin = (0.04 * (high - low)).max(if high > low { 0.0 } else { least });
        low - margin..high + margin
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Mark {
    /// Straight lines from point to point.
    #[default]
    Line,
    /// Lines with a dot at each point.
    LineAndPoints,
    /// A staircase: lines, with a dot at every second point, the upper end of each stair.
    Stairs,
    /// Dots.
    Points,
    /// Bars from zero, as wide as the distance of the first two points.
    Bars,
    /// A thin guide line without data; its name stands at its end, not in the legend.
    Guide,
}

impl Mark {
    fn has_line(self) -> bool {
        matches!(self, Self::Line | Self::LineAndPoints | Self::Stairs)
    }

    fn has_points(self) -> bool {
        matches!(self, Self::Points | Self::LineAndPoints | Self::Stairs)
    }
}

/// A series of a chart.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    pub points: Vec<[f64; 2]>,
    pub mark: Mark,
    /// `None` takes the look of its place among the series.
    pub look: Option<Look>,
    /// Tooltip of each point, beside its coordinates; points without a text have the coordinates
    /// alone.
    pub notes: Vec<String>,
}

impl Series {
    /// A series of points drawn with `mark`.
    pub fn new(name: impl Into<String>, points: Vec<[f64; 2]>, mark: Mark) -> Self {
        Self {
            name: name.into(),
            points,
            mark,
            look: None,
            notes: Vec::new(),
        }
    }

    fn look(&self, place: usize) -> Look {
        self.look.unwrap_or(Look::by_place(place))
    }

    /// True for a named series that is not a guide line.
    fn is_listed(&self) -> bool {
        !self.name.is_empty() && self.mark != Mark::Guide
    }
}

/// One panel.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Chart {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
}

impl Chart {
    /// The chart with lines of slope 1 and 2 on its logarithmic axes, above its points: what errors of first and of
    /// second order are parallel to. Without points to the right of others it stays as it is.
    pub fn with_orders(mut self) -> Self {
        let points = self.series.iter().flat_map(|s| &s.points);
        let points = points.filter(|[x, y]| *x > 0.0 && *y > 0.0 && y.is_finite());
        let xs = || points.clone().map(|p| p[0]);
        let (first, last) = (xs().fold(f64::INFINITY, f64::min), xs().fold(0.0, f64::max));
        if last > first {
            let highest = points.clone().map(|[x, y]| y * first / x);
            let start = 3.0 * highest.fold(0.0, f64::max);
            let guide = |slope: i32| {
                let end = start * (last / first).powi(slope);
                let points = vec![[first, start], [last, end]];
                Series::new(format!("slope {slope}"), points, Mark::Guide)
            };
            let guides = [1, 2].map(guide);
            self.series.extend(guides);
        }
        self
    }

    /// The chart with no text that holds the letter.
    fn without(&self, letter: char) -> Self {
        let mut chart = self.clone();
        let axes = [&mut chart.x, &mut chart.y].into_iter();
        let of_axes = axes.flat_map(|a| a.names.iter_mut().chain([&mut a.label]));
        let of_series = chart.series.iter_mut();
        let of_series = of_series.flat_map(|s| s.notes.iter_mut().chain([&mut s.name]));
        for text in of_axes.chain(of_series).chain([&mut chart.title]) {
            text.retain(|c| c != letter);
        }
        chart
    }

    /// Tooltip of a point: series, note, coordinates.
    fn words(&self, series: &Series, point: usize) -> String {
        let [x, y] = series.points[point];
        let value = |axis: &Axis, v: f64| match axis.names.get(v.round().max(0.0) as usize) {
            // Series stand beside each other at a name.
            Some(name) => format!("{}: {name}", axis.label),
            None => format!(
                "{}: {}",
                axis.label,
                number(if axis.reversed { -v } else { v })
            ),
        };
        let note = series.notes.get(point).filter(|note| !note.is_empty());
        let of = note.map_or(series.name.clone(), |note| {
            format!("{}, {note}", series.name)
        });
        format!("{of}; {}; {}", value(&self.x, x), value(&self.y, y))
    }

    /// True if guide lines show slopes; they mean something on two logarithmic axes only.
    pub fn has_orders(&self) -> bool {
        self.x.log && self.y.log && self.series.iter().any(|s| s.mark == Mark::Guide)
    }
}

/// A chart that could not be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot draw the chart: {0}")]
pub struct PlotError(String);
