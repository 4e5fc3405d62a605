//! Draws charts: panels with their axes, series and legends, as SVG text.
//!
//! Letters are 12 pixels high and more in a panel as it is drawn. A picture on paper is white whatever the reader's
//! theme; a chart of a page has no paper, and letters and axes in the page's colour.

use super::legend::Legend;
use super::look::Look;
use super::marks::{
    Group, TAG, Tags, colour, draw_point, line_style, radius, with_dashes, with_groups,
};
use super::ticks::{self, Scale};
use super::{Chart, Mark, PlotError, Series};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::fmt;

/// Width and height of a panel without its legend, in pixels.
const PANEL: (u32, u32) = (640, 380);

/// Size of a panel when two share a row of a text column, in pixels; it is shown unscaled.
const NARROW: (u32, u32) = (420, 370);

/// Places beyond are not shown: the distance of two would have no number.
const FARTHEST: f64 = 1e300;

/// Points of a series with more are not told apart.
const MOST_WORDS: usize = 100;

/// Panels beside each other at most.
const ACROSS: usize = 2;

/// Where things are drawn.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

type Plane<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Scale, Scale>>;

/// Sizes of letters.
#[derive(Debug, Clone, Copy)]
pub(super) enum Letters {
    /// At ticks and in legends.
    Small,
    /// Beside axes.
    Middle,
    /// Titles.
    Large,
}

impl Letters {
    fn pixels(self) -> f64 {
        match self {
            Self::Small => 12.0,
            Self::Middle => 13.0,
            Self::Large => 15.0,
        }
    }

    /// The drawing library divides sizes by this in SVG.
    const POINTS: f64 = 1.24;

    pub(super) fn font(self) -> (&'static str, f64) {
        ("sans-serif", self.pixels() * Self::POINTS)
    }

    /// An estimate of the width of that many letters \[pixels].
    pub(super) fn width(self, letters: i32) -> i32 {
        (f64::from(letters) * 0.6 * self.pixels()).ceil() as i32
    }
}

pub(super) fn failed(e: impl fmt::Display) -> PlotError {
    PlotError(e.to_string())
}

/// The charts as panels of one picture, two beside each other, each with its legend.
pub fn svg(charts: &[Chart]) -> Result<String, PlotError> {
    drawn(charts, true)
}

/// The charts as panels of one picture of 840 pixels' width, two beside each other, with one legend below all of them.
pub fn picture(charts: &[Chart]) -> Result<String, PlotError> {
    let columns = charts.len().clamp(1, ACROSS);
    let rows = charts.len().div_ceil(columns).max(1);
    let (width, height) = (NARROW.0 * columns as u32, NARROW.1 * rows as u32);
    let legend = Legend::new(charts, width);
    written((width, height + legend.height()), |root| {
        root.fill(&WHITE).map_err(failed)?;
        let (panels, below) = root.split_vertically(height);
        for (chart, area) in charts.iter().zip(&panels.split_evenly((rows, columns))) {
            draw_panel(chart, area, Tags(false))?;
        }
        legend.draw(&below, Tags(false))
    })
}

/// A chart as a part of a page: without paper, letters in the page's colour, as large as the page makes it.
pub fn svg_for_page(chart: &Chart) -> Result<String, PlotError> {
    let chart = chart.without(TAG);
    let charts = std::slice::from_ref(&chart);
    let text = with_groups(&drawn(charts, false)?);
    let size = format!(
        "width=\"{}\" height=\"{}\" ",
        PANEL.0,
        PANEL.1 + legend_height(charts)
    );
    Ok(text
        .replacen(&size, "", 1)
        .replace("\"#000000\"", "\"currentColor\""))
}

/// Height of the longest legend of these charts, each below its own panel.
fn legend_height(charts: &[Chart]) -> u32 {
    let of = |chart| Legend::new(std::slice::from_ref(chart), PANEL.0).height();
    charts.iter().map(of).max().unwrap_or(0)
}

fn drawn(charts: &[Chart], on_paper: bool) -> Result<String, PlotError> {
    let columns = charts.len().clamp(1, ACROSS);
    let rows = charts.len().div_ceil(columns).max(1);
    let height = PANEL.1 + legend_height(charts);
    written((PANEL.0 * columns as u32, height * rows as u32), |root| {
        if on_paper {
            root.fill(&WHITE).map_err(failed)?;
        }
        for (chart, area) in charts.iter().zip(&root.split_evenly((rows, columns))) {
            let (panel, below) = area.split_vertically(PANEL.1);
            let tags = Tags(!on_paper);
            draw_panel(chart, &panel, tags)?;
            Legend::new(std::slice::from_ref(chart), PANEL.0).draw(&below, tags)?;
        }
        Ok(())
    })
}

/// SVG of a drawing on an area of `size` pixels.
fn written(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        draw(&root)?;
        root.present().map_err(failed)?;
    }
    Ok(with_dashes(text))
}

fn draw_panel(chart: &Chart, area: &Area<'_>, tags: Tags) -> Result<(), PlotError> {
    let places = |series: &Series| -> Vec<Marker> {
        let points = series.points.iter().enumerate();
        let place = |(of, p): (usize, &[f64; 2])| Marker {
            at: (chart.x.place(p[0]), chart.y.place(p[1])),
            of,
        };
        let is_shown = |p: &Marker| p.at.0.abs() < FARTHEST && p.at.1.abs() < FARTHEST;
        points.map(place).filter(is_shown).collect()
    };
    let all: Vec<_> = chart.series.iter().map(places).collect();
    let x = chart.x.scale(all.iter().flatten().map(|p| p.at.0));
    let bars = chart.series.iter().any(|s| s.mark == Mark::Bars);
    let zero = bars.then_some(0.0);
    let y = chart
        .y
        .scale(all.iter().flatten().map(|p| p.at.1).chain(zero));
    let mut plane = ChartBuilder::on(area)
        .caption(&chart.title, Letters::Large.font())
        .margin(12)
        .x_label_area_size(50)
        .y_label_area_size(76)
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
        .label_style(Letters::Small.font())
        .axis_desc_style(Letters::Middle.font())
        .draw()
        .map_err(failed)?;
    for (i, (series, points)) in chart.series.iter().zip(&all).enumerate() {
        if series.mark == Mark::Guide {
            let before = &chart.series[..i];
            let is_first = before.iter().all(|s| s.mark != Mark::Guide);
            draw_guide(&mut plane, &series.name, points, is_first)?;
            continue;
        }
        let later = (chart.series.len() - 1 - i) as i32;
        let radius = radius(series.mark, points.len(), later);
        tags.put(area, Group::Series(i), "")?;
        let say = |of: usize| chart.words(series, of);
        draw_series(
            &mut plane,
            series.mark,
            points,
            (series.look(i), radius),
            (tags, say),
        )?;
        tags.put(area, Group::End, "")?;
    }
    Ok(())
}

/// A point that is shown.
struct Marker {
    /// Where, on the axes.
    at: (f64, f64),
    /// Which of the series' points it is.
    of: usize,
}

/// Draws a guide line with its name at its end: below the first such line, above the others, which
/// rise from it.
fn draw_guide(
    plane: &mut Plane<'_, '_>,
    name: &str,
    points: &[Marker],
    is_first: bool,
) -> Result<(), PlotError> {
    let line = LineSeries::new(points.iter().map(|p| p.at), BLACK.mix(0.5).stroke_width(1));
    plane.draw_series(line).map_err(failed)?;
    let Some(end) = points.last() else {
        return Ok(());
    };
    let area = plane.plotting_area();
    let (left, top) = area.get_pixel_range();
    let (x, y) = area.map_coordinate(&end.at);
    let (away, side) = if is_first {
        (4, VPos::Top)
    } else {
        (-2, VPos::Bottom)
    };
    let at = (x - left.start - 4, y - top.start + away);
    let style = Letters::Small.font().into_text_style(area);
    let style = style.pos(Pos::new(HPos::Right, side));
    let text = Text::new(name.to_owned(), at, style);
    area.strip_coord_spec().draw(&text).map_err(failed)
}

fn draw_series(
    plane: &mut Plane<'_, '_>,
    mark: Mark,
    points: &[Marker],
    (look, radius): (Look, i32),
    (tags, say): (Tags, impl Fn(usize) -> String),
) -> Result<(), PlotError> {
    if mark == Mark::Bars {
        let width = points
            .windows(2)
            .next()
            .map_or(1.0, |w| w[1].at.0 - w[0].at.0);
        let bar = |&Marker { at: (x, y), .. }: &Marker| {
            let corners = [(x - 0.45 * width, 0.0), (x + 0.45 * width, y)];
            Rectangle::new(corners, colour(look).mix(0.7).filled())
        };
        plane.draw_series(points.iter().map(bar)).map_err(failed)?;
    }
    if mark.has_line() {
        let line = LineSeries::new(points.iter().map(|p| p.at), line_style(look));
        plane.draw_series(line).map_err(failed)?;
    }
    if mark.has_points() {
        let area = plane.plotting_area();
        let (left, top) = area.get_pixel_range();
        let pixels = area.strip_coord_spec();
        let every = if mark == Mark::Stairs { 2 } else { 1 };
        for p in points.iter().skip(every - 1).step_by(every) {
            let (x, y) = area.map_coordinate(&p.at);
            let at = (x - left.start, y - top.start);
            if points.len() > MOST_WORDS {
                draw_point(&pixels, at, look, radius)?;
                continue;
            }
            tags.put(&pixels, Group::Point, &say(p.of))?;
            draw_point(&pixels, at, look, radius)?;
            tags.put(&pixels, Group::End, "")?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Axis;

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
        // Two panels of the two points that a logarithmic axis can hold, and one in the legend; the second series has
        // another shape.
        assert_eq!(text.matches("<circle").count(), 2 * (2 + 1));
        assert_eq!(text.matches("<polygon").count(), 2 * (2 + 1));
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

    /// Three series of three points.
    fn crowded(points: &[[f64; 2]]) -> Chart {
        let series = |name| Series::new(name, points.to_vec(), Mark::LineAndPoints);
        Chart {
            x: Axis::log("Δt (s)"),
            y: Axis::log("error (m)"),
            series: ["a", "b", "c"].map(series).to_vec(),
            ..Chart::default()
        }
    }

    #[test]
    fn lines_are_dashed_and_none_is_too_wide() {
        let text = svg(&[crowded(&[[1.0, 1.0], [2.0, 2.0]])]).expect("draws");
        for dash in ["9 5", "2 4"] {
            // One in the panel, one in the legend.
            let dashed = format!("stroke-width=\"2\" stroke-dasharray=\"{dash}\"");
            assert_eq!(text.matches(&dashed).count(), 2, "{dash}");
        }
        let widths = text.split("stroke-width=\"").skip(1);
        for width in widths.filter_map(|rest| rest.split('"').next()) {
            assert!(width.parse::<u32>().expect("a number") <= 2, "{width}");
        }
    }

    #[test]
    fn panels_share_a_legend_in_letters_that_are_read() {
        let chart = crowded(&[[1.0, 1.0], [2.0, 2.0]]);
        let text = picture(&[chart.clone(), chart]).expect("draws");
        assert!(text.starts_with("<svg width=\"840\""), "{text}");
        for name in ["a", "b", "c"] {
            assert_eq!(text.matches(&format!("\n{name}\n")).count(), 1, "{name}");
        }
        let sizes = text.split("font-size=\"").skip(1);
        for size in sizes.filter_map(|rest| rest.split('"').next()) {
            // As shown 830 pixels wide.
            let shown = size.parse::<f64>().expect("a number") * 830.0 / 840.0;
            assert!(shown >= 11.0, "{size}");
        }
    }

    #[test]
    fn guides_have_slopes_and_are_not_in_the_legend() {
        let chart = crowded(&[[1.0, 0.1], [10.0, 10.0]]).with_orders();
        let ends = chart.series.iter().filter(|s| s.mark == Mark::Guide);
        let ends: Vec<_> = ends.map(|s| s.points.clone()).collect();
        let expected = [[[1.0, 3.0], [10.0, 30.0]], [[1.0, 3.0], [10.0, 300.0]]];
        assert_eq!(ends, expected);
        let text = svg_for_page(&chart).expect("draws");
        for name in ["slope 1", "slope 2"] {
            assert_eq!(text.matches(name).count(), 1);
        }
        // Nothing to show an order on.
        assert!(!crowded(&[[1.0, 0.1]]).with_orders().has_orders());
    }

    #[test]
    fn names_stand_at_their_places() {
        let chart = Chart {
            x: Axis::of_names("stiffness", ["off", "0.4"].map(str::to_owned).to_vec()),
            series: vec![Series::new("a", vec![[0.0, 1.0], [1.0, 2.0]], Mark::Points)],
            ..Chart::default()
        };
        let text = svg(&[chart]).expect("draws");
        let holds = text.contains("\noff\n") && text.contains("\n0.4\n");
        assert!(holds, "{text}");
    }
}
