//! The legend below a panel, or below several that share it: a key and a name for each series, in columns.

use super::draw::{Area, Letters, failed};
use super::look::Look;
use super::marks::{Group, Tags, colour, draw_point, line_style};
use super::{Chart, PlotError};
use plotters::prelude::*;

/// A series of the legend.
#[derive(Debug, Clone)]
struct Entry<'a> {
    name: &'a str,
    /// Among the series of its chart.
    place: usize,
    look: Look,
    has_line: bool,
    has_points: bool,
}

/// The named series of some charts, each name once.
#[derive(Debug, Clone)]
pub(super) struct Legend<'a> {
    entries: Vec<Entry<'a>>,
    /// Width of a column \[pixels].
    column: i32,
    columns: usize,
}

/// Height of a row, width of a key and of the gaps beside it \[pixels].
const ROW: i32 = 20;
const KEY: i32 = 36;
const GAP: i32 = 7;

/// Where the first column begins \[pixels].
const LEFT: i32 = 16;

impl<'a> Legend<'a> {
    /// Lists every named series of the charts once. `width` is in pixels.
    pub(super) fn new(charts: &'a [Chart], width: u32) -> Self {
        let mut entries: Vec<Entry<'a>> = Vec::new();
        for chart in charts {
            for (place, series) in chart.series.iter().enumerate() {
                if !series.is_listed() || entries.iter().any(|e| e.name == series.name) {
                    continue;
                }
                entries.push(Entry {
                    name: &series.name,
                    place,
                    look: series.look(place),
                    has_line: series.mark.has_line(),
                    has_points: series.mark.has_points(),
                });
            }
        }
        let room = width as i32 - 2 * LEFT;
        let widest = entries.iter().map(|e| e.name.chars().count()).max();
        let letters = widest.unwrap_or(0).min(room as usize) as i32;
        let own = KEY + 3 * GAP + Letters::Small.width(letters);
        let columns = (room / own).max(1);
        Self {
            entries,
            column: room / columns,
            columns: columns as usize,
        }
    }

    /// Its height \[pixels].
    pub(super) fn height(&self) -> u32 {
        let rows = self.entries.len().div_ceil(self.columns).max(1);
        ROW as u32 * rows as u32 + 6
    }

    pub(super) fn draw(&self, area: &Area<'_>, tags: Tags) -> Result<(), PlotError> {
        for (i, entry) in self.entries.iter().enumerate() {
            let x = LEFT + self.column * (i % self.columns) as i32;
            let y = ROW * (i / self.columns) as i32;
            let middle = y + 8;
            tags.put(area, Group::Key(entry.place), "")?;
            if entry.has_line {
                let ends = vec![(x, middle), (x + KEY, middle)];
                let line = PathElement::new(ends, line_style(entry.look));
                area.draw(&line).map_err(failed)?;
            }
            if entry.has_points {
                draw_point(area, (x + KEY / 2, middle), entry.look, 4)?;
            }
            if !entry.has_line && !entry.has_points {
                let ends = [(x, middle - 5), (x + KEY, middle + 5)];
                let bar = Rectangle::new(ends, colour(entry.look).mix(0.7).filled());
                area.draw(&bar).map_err(failed)?;
            }
            let text = Text::new(
                entry.name.to_owned(),
                (x + KEY + GAP, y + 2),
                Letters::Small.font(),
            );
            area.draw(&text).map_err(failed)?;
            tags.put(area, Group::End, "")?;
        }
        Ok(())
    }
}
