//! Tables that a click on a heading sorts.

use maud::{Markup, html};

/// A table whose columns are sorted by what they show, or by a number that belongs to it.
pub(super) fn sortable(headings: &[impl AsRef<str>], rows: &[Vec<Cell>]) -> Markup {
    let is_number = |column: usize| {
        let numbers = rows.iter().filter_map(|row| row.get(column));
        numbers.clone().any(|cell| cell.number.is_some())
    };
    html! {
        div.scroll {
            table.sortable {
                thead {
                    tr {
                        @for (column, heading) in headings.iter().enumerate() {
                            th class=[is_number(column).then_some("number")] scope="col" aria-sort="none" {
                                button type="button" title="sort by this column" { (heading.as_ref()) }
                            }
                        }
                    }
                }
                tbody {
                    @for row in rows {
                        tr { @for cell in row { (cell.markup()) } }
                    }
                }
            }
        }
    }
}

/// Letters of a cell that stand in one line.
const MOST_LETTERS: usize = 60;

/// A cell: its text, and the number that it is sorted by.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cell {
    pub(super) text: String,
    pub(super) number: Option<f64>,
    pub(super) best: bool,
}

impl Cell {
    pub(super) fn text(text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            number: None,
            best: false,
        }
    }

    /// Cell of a measured number; [`Cell::none`] if it is not finite.
    pub(super) fn number(text: impl Into<String>, number: f64) -> Self {
        if !number.is_finite() {
            return Self::none();
        }
        Self {
            number: Some(number),
            ..Self::text(text)
        }
    }

    /// Cell without a number, sorted behind all numbers.
    pub(super) fn none() -> Self {
        Self {
            number: Some(f64::INFINITY),
            ..Self::text("–")
        }
    }

    fn markup(&self) -> Markup {
        let classes = [
            ("number", self.number.is_some()),
            ("best", self.best),
            ("long", self.text.chars().count() > MOST_LETTERS),
        ];
        let classes = classes.iter().filter(|(_, is)| *is).map(|(name, _)| *name);
        let class = classes.collect::<Vec<_>>().join(" ");
        // As a script reads it.
        let number = self.number.map(|n| match n {
            n if n == f64::INFINITY => "Infinity".to_owned(),
            n => n.to_string(),
        });
        html! { td class=[(!class.is_empty()).then_some(&class)] data-sort=[number] { (self.text) } }
    }
}
