//! Points and lines of a look as SVG has them.

use super::draw::{Area, Letters, failed};
use super::look::{Dash, Look, Shape};
use super::{Mark, PlotError};
use plotters::prelude::*;

/// How large the points of a series before `later` others are, in pixels. Those are smaller, so that what is under them
/// is seen.
pub(super) fn radius(mark: Mark, points: usize, later: i32) -> i32 {
    match mark {
        _ if points > 400 => 1,
        Mark::Points => {
            if points > 40 {
                3
            } else {
                4
            }
        }
        _ => 3 + later.min(2),
    }
}

pub(super) fn colour(look: Look) -> RGBColor {
    let [r, g, b] = look.colour;
    RGBColor(r, g, b)
}

/// Width of lines, in pixels.
const LINE: u32 = 2;

/// The drawing library has no dashes of several lengths: a line this much wider for each place in [`Dash::ALL`] stands
/// for one, which [`with_dashes`] writes in its place.
const DASHES: u32 = 1000;

pub(super) fn line_style(look: Look) -> ShapeStyle {
    let place = Dash::ALL.iter().position(|d| *d == look.dash).unwrap_or(0);
    colour(look).stroke_width(LINE + DASHES * place as u32)
}

/// The text with its lines as wide as they are, and dashed.
pub(super) fn with_dashes(text: String) -> String {
    let dashed = Dash::ALL.iter().enumerate().skip(1);
    dashed.fold(text, |text, (place, dash)| {
        let wide = format!("stroke-width=\"{}\"", LINE + DASHES * place as u32);
        let own = format!(
            "stroke-width=\"{LINE}\" stroke-dasharray=\"{}\"",
            dash.lengths()
        );
        text.replace(&wide, &own)
    })
}

/// The drawing library has no groups: a text that begins with the letter of one stands for its tag, which [`with_groups`]
/// writes in its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Group {
    /// The points and lines of the series at this place.
    Series(usize),
    /// The key of that series in the legend.
    Key(usize),
    /// A point, which says something when pointed at.
    Point,
    /// The end of the last.
    End,
}

/// First letter of a tag; the second one is its kind.
pub(super) const TAG: char = '\u{e000}';

/// Writes tags around groups if true.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tags(pub(super) bool);

impl Tags {
    /// Opens a group, or ends one. `text` is what a point says.
    pub(super) fn put(self, area: &Area<'_>, group: Group, text: &str) -> Result<(), PlotError> {
        if !self.0 {
            return Ok(());
        }
        let content = match group {
            Group::Series(place) => format!("{TAG}s{place}"),
            Group::Key(place) => format!("{TAG}k{place}"),
            Group::Point => format!("{TAG}p{text}"),
            Group::End => format!("{TAG}e"),
        };
        let text = Text::new(content, (0, 0), Letters::Small.font());
        area.draw(&text).map_err(failed)
    }
}

/// The text with tags in place of the texts that stand for them.
pub(super) fn with_groups(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(TAG) {
        let start = rest[..at].rfind("<text").unwrap_or(at);
        let content = &rest[at + TAG.len_utf8()..];
        let end = content.find("</text>").unwrap_or(content.len());
        let (content, after) = content.split_at(end);
        let content = content.trim_end();
        out.push_str(rest[..start].trim_end_matches('\n'));
        let place = || {
            content
                .get(1..)
                .and_then(|n| n.parse::<usize>().ok())
                .unwrap_or(0)
        };
        out.push_str(&match content.chars().next() {
            Some('s') => format!("\n<g data-series=\"{}\">", place()),
            Some('k') => format!("\n<g data-key=\"{}\">", place()),
            Some('p') => format!("\n<g><title>{}</title>", &content[1..]),
            _ => "\n</g>".to_owned(),
        });
        rest = after.trim_start_matches("</text>");
    }
    out.push_str(rest);
    out
}

/// A point at a place in pixels from the area's corner.
pub(super) fn draw_point(
    area: &Area<'_>,
    (x, y): (i32, i32),
    look: Look,
    r: i32,
) -> Result<(), PlotError> {
    let outline = colour(look).stroke_width(LINE);
    // Corners, so that all shapes look about as large.
    let at = |corners: &[(i32, i32)]| -> Vec<(i32, i32)> {
        corners.iter().map(|(dx, dy)| (x + dx, y + dy)).collect()
    };
    let wide = r + 1;
    let corners = match look.shape {
        Shape::Circle => {
            let style = if look.hollow {
                outline
            } else {
                colour(look).filled()
            };
            return area.draw(&Circle::new((x, y), r, style)).map_err(failed);
        }
        Shape::Cross => {
            let strokes = if look.hollow {
                [[(-wide, 0), (wide, 0)], [(0, -wide), (0, wide)]]
            } else {
                [[(-r, -r), (r, r)], [(-r, r), (r, -r)]]
            };
            for stroke in strokes {
                let line = PathElement::new(at(&stroke), outline);
                area.draw(&line).map_err(failed)?;
            }
            return Ok(());
        }
        Shape::Triangle => at(&[(0, -wide - 1), (wide, r), (-wide, r)]),
        Shape::Square => at(&[(-r, -r), (r, -r), (r, r), (-r, r)]),
        Shape::Diamond => at(&[(0, -wide - 1), (wide + 1, 0), (0, wide + 1), (-wide - 1, 0)]),
    };
    if look.hollow {
        let closed = corners.iter().chain(corners.first()).copied();
        let line = PathElement::new(closed.collect::<Vec<_>>(), outline);
        area.draw(&line).map_err(failed)
    } else {
        let shape = Polygon::new(corners, colour(look).filled());
        area.draw(&shape).map_err(failed)
    }
}
