//! Charts as SVG text: lines, points and bars, linear or logarithmic axes, several panels beside each other.
//!
//! Colours are those of Okabe and Ito, which colour-blind readers can tell apart; every series also has its own place
//! in the legend. The paper is white, whatever the reader's theme.

mod ticks;

use plotters::coord::Shift;
use plotters::prelude::*;
use std::fmt;
use std::ops::Range;
use ticks::Scale;

/// Colours of series, in order; after the last the first comes again.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];

/// Width and height of a panel without its legend, in pixels.
const PANEL: (u32, u32) = (640, 360);

/// Places beyond are not shown: the distance of two would have no number.
const FARTHEST: f64 = 1e300;

/// Panels beside each other at most.
const ACROSS: usize = 2;

/// An axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// Whether it is logarithmic: numbers that are not positive are then left out.
    pub log: bool,
    /// Its ends; those of the data where there are none.
    pub range: Option<[f64; 2]>,
    /// Whether it grows downwards or to the left.
    pub reversed: bool,
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn linear(label: &str) -> Self {
        Self {
            label: label.to_owned(),
            ..Self::default()
        }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn log(label: &str) -> Self {
        Self {
            log: true,
            ..Self::linear(label)
        }
    }

    /// The place of a number on the axis: its logarithm on a logarithmic one.
    fn place(&self, value: f64) -> f64 {
        if self.log { value.log10() } else { value }
    }

    /// The axis that holds all `values`, with a margin.
    fn scale(&self, values: impl Iterator<Item = f64>) -> Scale {
        Scale::new(self.ends(values), self.log, self.reversed)
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
}

impl Mark {
    fn has_points(self) -> bool {
        matches!(self, Self::Points | Self::LineAndPoints | Self::Stairs)
    }
}

/// What a point is drawn as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shape {
    /// A dot.
    #[default]
    Circle,
    /// A triangle.
    Triangle,
    /// A square.
    Square,
    /// A cross.
    Cross,
}

/// How a series looks, whatever its place among the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Look {
    /// Red, green and blue.
    pub colour: [u8; 3],
    /// What its points are.
    pub shape: Shape,
    /// Whether its lines are dashed.
    pub dashed: bool,
}

impl Look {
    /// Of the series at that place among others: colours in turn, and another shape each time they begin anew.
    #[must_use]
    pub fn by_place(place: usize) -> Self {
        const SHAPES: [Shape; 4] = [Shape::Circle, Shape::Triangle, Shape::Square, Shape::Cross];
        let RGBColor(r, g, b) = COLOURS[place % COLOURS.len()];
        Self {
            colour: [r, g, b],
            shape: SHAPES[place / COLOURS.len() % SHAPES.len()],
            dashed: false,
        }
    }
}

/// A series of a chart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its points.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub mark: Mark,
    /// How it looks; by its place among the others where there is nothing.
    pub look: Option<Look>,
}

impl Series {
    /// A series of points drawn with `mark`.
    #[must_use]
    pub fn new(name: impl Into<String>, points: Vec<[f64; 2]>, mark: Mark) -> Self {
        Self {
            name: name.into(),
            points,
            mark,
            look: None,
        }
    }

    fn look(&self, place: usize) -> Look {
        self.look.unwrap_or(Look::by_place(place))
    }
}

/// One panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is shown.
    pub series: Vec<Series>,
}

/// A chart that could not be drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlotError(String);

impl fmt::Display for PlotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot draw the chart: {}", self.0)
    }
}

impl std::error::Error for PlotError {}

fn failed(e: impl fmt::Display) -> PlotError {
    PlotError(e.to_string())
}

/// The charts as panels of one picture, two beside each other.
///
/// # Errors
/// [`PlotError`] with the drawing library's message.
pub fn svg(charts: &[Chart]) -> Result<String, PlotError> {
    drawn(charts, true)
}

/// A chart as a part of a page: without paper, letters in the page's colour, as large as the page makes it.
///
/// # Errors
/// [`PlotError`] with the drawing library's message.
pub fn svg_for_page(chart: &Chart) -> Result<String, PlotError> {
    let charts = std::slice::from_ref(chart);
    let text = drawn(charts, false)?;
    let (width, height) = panel(charts);
    let size = format!("width=\"{width}\" height=\"{height}\" ");
    Ok(text
        .replacen(&size, "", 1)
        .replace("\"#000000\"", "\"currentColor\""))
}

/// Width and height of a panel with the longest legend of these charts, in pixels.
fn panel(charts: &[Chart]) -> (u32, u32) {
    let rows = charts.iter().map(|chart| legend_rows(chart).len()).max();
    (
        PANEL.0,
        PANEL.1 + LEGEND_ROW as u32 * rows.unwrap_or(0).max(1) as u32,
    )
}

fn drawn(charts: &[Chart], on_paper: bool) -> Result<String, PlotError> {
    let columns = charts.len().clamp(1, ACROSS);
    let rows = charts.len().div_ceil(columns).max(1);
    let panel = panel(charts);
    let size = (panel.0 * columns as u32, panel.1 * rows as u32);
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        if on_paper {
            root.fill(&WHITE).map_err(failed)?;
        }
        let panels = root.split_evenly((rows, columns));
        for (chart, area) in charts.iter().zip(&panels) {
            draw(chart, area)?;
        }
        root.present().map_err(failed)?;
    }
    Ok(text)
}

type Plane<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Scale, Scale>>;

fn draw(chart: &Chart, area: &DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), PlotError> {
    let places = |series: &Series| -> Vec<(f64, f64)> {
        let place = |p: &[f64; 2]| (chart.x.place(p[0]), chart.y.place(p[1]));
        let places = series.points.iter().map(place);
        places
            .filter(|(x, y)| x.abs() < FARTHEST && y.abs() < FARTHEST)
            .collect()
    };
    let all: Vec<_> = chart.series.iter().map(places).collect();
    let x = chart.x.scale(all.iter().flatten().map(|p| p.0));
    let bars = chart.series.iter().any(|s| s.mark == Mark::Bars);
    let zero = bars.then_some(0.0);
    let y = chart.y.scale(all.iter().flatten().map(|p| p.1).chain(zero));
    let rows = legend_rows(chart);
    let (area, below) = area.split_vertically(PANEL.1);
    let mut plane = ChartBuilder::on(&area)
        .caption(&chart.title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(72)
        .build_cartesian_2d(x, y)
        .map_err(failed)?;
    plane
        .configure_mesh()
        .x_desc(&chart.x.label)
        .y_desc(&chart.y.label)
        .x_labels(ticks::MOST)
        .y_labels(ticks::MOST)
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(128, 128, 128).mix(0.3))
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 15))
        .draw()
        .map_err(failed)?;
    for (i, (series, points)) in chart.series.iter().zip(&all).enumerate() {
        let later = (chart.series.len() - 1 - i) as i32;
        let size = Size::of(series, points.len(), later);
        draw_series(&mut plane, series.mark, points, (series.look(i), size))?;
    }
    draw_legend(chart, &rows, &below)
}

/// How large points and lines are, in pixels.
#[derive(Debug, Clone, Copy)]
struct Size {
    radius: i32,
    line: u32,
}

impl Size {
    /// Of a series before `later` others. Those are smaller, so that what is under them is seen.
    fn of(series: &Series, points: usize, later: i32) -> Self {
        let radius = match series.mark {
            _ if points > 400 => 1,
            Mark::Points => 3,
            _ if series.look.is_some() => 3 + (later / 4).min(2),
            _ => 3 + later.min(3),
        };
        let thick = series.look.is_none() && points <= 400;
        Self {
            radius,
            line: 2 + if thick { later.min(3) as u32 } else { 0 },
        }
    }
}

fn colour(look: Look) -> RGBColor {
    let [r, g, b] = look.colour;
    RGBColor(r, g, b)
}

/// Height of a row of the legend below a panel, in pixels.
const LEGEND_ROW: i32 = 20;

/// Width of the legend's key, and an estimate of that of a letter, in pixels.
const LEGEND_KEY: i32 = 46;
const LEGEND_LETTER: i32 = 7;

/// The named series in rows that fit below the panel: (series, left end).
fn legend_rows(chart: &Chart) -> Vec<Vec<(usize, i32)>> {
    let mut rows: Vec<Vec<(usize, i32)>> = Vec::new();
    let mut x = i32::MAX;
    for (i, series) in chart.series.iter().enumerate() {
        if series.name.is_empty() {
            continue;
        }
        let letters = series.name.chars().count().min(PANEL.0 as usize);
        let width = LEGEND_KEY + LEGEND_LETTER * letters as i32;
        if x.saturating_add(width) > PANEL.0 as i32 {
            rows.push(Vec::new());
            x = 84;
        }
        if let Some(row) = rows.last_mut() {
            row.push((i, x));
        }
        x += width;
    }
    rows
}

fn draw_legend(
    chart: &Chart,
    rows: &[Vec<(usize, i32)>],
    area: &DrawingArea<SVGBackend<'_>, Shift>,
) -> Result<(), PlotError> {
    for (k, row) in rows.iter().enumerate() {
        let y = LEGEND_ROW * k as i32;
        for &(i, x) in row {
            let look = chart.series[i].look(i);
            let pieces: &[(i32, i32)] = if look.dashed {
                &[(0, 6), (10, 18), (22, 28)]
            } else {
                &[(0, 28)]
            };
            for &(from, to) in pieces {
                let ends = [(x + from, y + 6), (x + to, y + 8)];
                let piece = Rectangle::new(ends, colour(look).filled());
                area.draw(&piece).map_err(failed)?;
            }
            if chart.series[i].mark.has_points() {
                draw_point(area, (x + 14, y + 7), look, 4)?;
            }
            let name = chart.series[i].name.clone();
            let text = Text::new(name, (x + 34, y), ("sans-serif", 13));
            area.draw(&text).map_err(failed)?;
        }
    }
    Ok(())
}

fn draw_series(
    plane: &mut Plane<'_, '_>,
    mark: Mark,
    points: &[(f64, f64)],
    (look, size): (Look, Size),
) -> Result<(), PlotError> {
    let colour = colour(look);
    if mark == Mark::Bars {
        let width = points.windows(2).next().map_or(1.0, |w| w[1].0 - w[0].0);
        let bar = |&(x, y): &(f64, f64)| {
            let corners = [(x - 0.45 * width, 0.0), (x + 0.45 * width, y)];
            Rectangle::new(corners, colour.mix(0.7).filled())
        };
        plane.draw_series(points.iter().map(bar)).map_err(failed)?;
    }
    if matches!(mark, Mark::Line | Mark::LineAndPoints | Mark::Stairs) {
        let (points, style) = (points.iter().copied(), colour.stroke_width(size.line));
        if look.dashed {
            let line = DashedLineSeries::new(points, 6, 4, style);
            plane.draw_series(line).map_err(failed)?;
        } else {
            let line = LineSeries::new(points, style);
            plane.draw_series(line).map_err(failed)?;
        }
    }
    if mark.has_points() {
        let area = plane.plotting_area();
        let (left, top) = area.get_pixel_range();
        let pixels = area.strip_coord_spec();
        let every = if mark == Mark::Stairs { 2 } else { 1 };
        for p in points.iter().skip(every - 1).step_by(every) {
            let (x, y) = area.map_coordinate(p);
            let at = (x - left.start, y - top.start);
            draw_point(&pixels, at, look, size.radius)?;
        }
    }
    Ok(())
}

/// A point at a place in pixels from the area's corner.
fn draw_point(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    (x, y): (i32, i32),
    look: Look,
    r: i32,
) -> Result<(), PlotError> {
    // Hollow where the line is dashed, so that one point alone tells as much.
    let style = if look.dashed {
        colour(look).stroke_width(2)
    } else {
        colour(look).filled()
    };
    match look.shape {
        Shape::Circle => area.draw(&Circle::new((x, y), r, style)),
        Shape::Triangle => area.draw(&TriangleMarker::new((x, y), r + 1, style)),
        Shape::Square => area.draw(&Rectangle::new([(x - r, y - r), (x + r, y + r)], style)),
        Shape::Cross => area.draw(&Cross::new((x, y), r, style)),
    }
    .map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_holds_its_title_axes_names_and_points() {
        let points = vec![[1.0, 1e-3], [10.0, 1e-6], [100.0, f64::NAN], [1000.0, -1.0]];
        let chart = Chart {
            title: "errors".to_owned(),
            x: Axis::log("segments"),
            y: Axis::log("error (m)"),
            series: vec![
                Series::new("ours", points.clone(), Mark::LineAndPoints),
                Series::new("theirs", points, Mark::Points),
            ],
        };
        let text = svg(&[chart.clone(), chart]).expect("draws");
        for part in ["errors", "segments", "error (m)", "ours", "theirs", "10⁻⁶"] {
            assert!(text.contains(part), "{part} is missing");
        }
        // Two panels of two series of the two points that a logarithmic axis can hold, and one in the legend.
        assert_eq!(text.matches("<circle").count(), 2 * 2 * (2 + 1));
    }

    #[test]
    fn charts_without_data_are_drawn_too() {
        assert!(svg(&[]).expect("draws").starts_with("<svg"));
        let empty = Chart {
            series: vec![Series::new("none", Vec::new(), Mark::Bars)],
            ..Chart::default()
        };
        let text = svg(&[empty]).expect("draws");
        assert!(!text.contains("NaN"));
    }
}
