//! Tables for people: aligned text, numbers short enough to read. The texts hold ANSI sequences for what stands out,
//! which [`taut_measure::files::print`] leaves out where they would not be seen, and [`plain`] everywhere.

mod check;
mod style;

pub use check::checks;
pub use style::{MARK, verdict};
pub(crate) use style::{least, marked};

use crate::settings::distinct;
use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, ContentArrangement, Table};
use std::fmt::Display;
use taut_measure::choice::Omission;
use taut_solver::Backend;

/// An empty table with right-aligned columns but the first.
pub fn table(header: &[impl Display]) -> Table {
    let mut table = Table::new();
    table
        .load_style(NOTHING)
        .enforce_styling()
        .set_header(header);
    table.style_text_only();
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Most characters of a line.
const WIDTH: u16 = 118;

/// Table that wraps its cells to the width of a line.
pub fn wrapped(header: &[impl Display]) -> Table {
    let mut table = table(header);
    table
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(WIDTH);
    table
}

/// The table's lines without the blanks at their ends.
pub fn text(table: &Table) -> String {
    let mut out = String::new();
    for line in table.lines() {
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out
}

/// Rows of two texts below a blank line, the second wrapped; nothing where there are none.
pub fn pairs(rows: impl IntoIterator<Item = [String; 2]>) -> String {
    let mut t = wrapped(&[""; 0]);
    t.add_rows(rows);
    // The heading is the blank line.
    match t.row_count() {
        0 => String::new(),
        _ => text(&t),
    }
}

/// How a cell of a record is written.
type CellOf<'a, R> = &'a dyn Fn(&R) -> String;

/// A table with a row for each record: what stands above each column, and how its cells are written.
pub fn of_records<'a, R: 'a>(
    records: impl IntoIterator<Item = &'a R>,
    columns: &[(&str, CellOf<'_, R>)],
) -> String {
    let headings: Vec<&str> = columns.iter().map(|(heading, _)| *heading).collect();
    let mut t = table(&headings);
    for record in records {
        t.add_row(columns.iter().map(|(_, cell)| cell(record)));
    }
    text(&t)
}

/// A text without ANSI sequences.
pub fn plain(text: &str) -> String {
    anstream::adapter::strip_str(text).to_string()
}

/// A number of nanoseconds with a unit, three digits.
pub fn nanoseconds(ns: f64) -> String {
    let (value, unit) = match ns {
        n if n.is_nan() => return "-".to_owned(),
        n if n < 1e3 => (n, "ns"),
        n if n < 1e6 => (n / 1e3, "µs"),
        n if n < 1e9 => (n / 1e6, "ms"),
        n => (n / 1e9, "s"),
    };
    let digits = if value < 10.0 {
        2
    } else {
        usize::from(value < 100.0)
    };
    format!("{value:.digits$} {unit}")
}

/// An error in two digits, `-` for `None`.
pub fn error(e: Option<f64>) -> String {
    match e {
        None => "-".to_owned(),
        Some(e) if e.is_nan() => "nan".to_owned(),
        Some(e) => format!("{e:.1e}"),
    }
}

/// A mass ratio: with an exponent from 10⁴ on.
pub fn ratio(r: f64) -> String {
    if r >= 1e4 {
        format!("{r:.0e}")
    } else {
        format!("{r}")
    }
}

/// A number in a form: time, mass ratio, decade, share, angle, number a second; or as Rust writes it, with so many digits
/// after the point, `+` before it or `e` for an exponent.
pub fn formed(x: f64, form: &str) -> String {
    let digits = form.trim_matches(['+', '.', 'e']).parse::<usize>().ok();
    let is_signed = form.starts_with('+') && x.is_sign_positive() && !x.is_nan();
    let sign = if is_signed { "+" } else { "" };
    let text = match (form, digits) {
        ("ns", _) => nanoseconds(x),
        ("ratio", _) => ratio(x),
        ("decade", _) => format!("{:.2}", x.log10()),
        ("share", _) => format!("{:.2} %", 100.0 * x),
        ("angle", _) => format!("{:.0}°", x.to_degrees()),
        ("per", _) => format!("{:.0}", x.recip()),
        (_, Some(digits)) if form.ends_with('e') => format!("{x:.digits$e}"),
        (_, Some(digits)) => format!("{x:.digits$}"),
        (_, None) if form.ends_with('e') => format!("{x:e}"),
        (_, None) => x.to_string(),
    };
    [sign, &text].concat()
}

/// Backends left out, together by reason; empty if there are none.
pub fn omissions(omissions: &[Omission]) -> String {
    let reasons = distinct(omissions.iter().map(|o| o.reason.as_str()));
    let rows = reasons.into_iter().map(|reason| {
        let of = omissions.iter().filter(|o| o.reason == reason);
        let backends: Vec<&str> = of.map(|o| o.backend.as_str()).collect();
        [backends.join(", "), reason.to_owned()]
    });
    match pairs(rows) {
        rows if rows.is_empty() => rows,
        rows => format!("\nLeft out{rows}"),
    }
}

/// Table of all backends with licences; shows which are compiled in.
pub fn backends() -> String {
    let mut t = table(&["backend", "compiled in", "feature", "systems", "licence"]);
    for column in t.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Left);
    }
    for backend in Backend::all() {
        t.add_row([
            backend.name(),
            if backend.is_compiled() { "yes" } else { "no" },
            backend.feature().unwrap_or("always"),
            systems(&backend),
            backend.licence(),
        ]);
    }
    text(&t)
}

/// The systems that a backend takes, with any of its options.
fn systems(backend: &Backend) -> &'static str {
    match backend {
        Backend::Faer(_) => "definite; ldlt quasi-definite; lblt symmetric; lu any",
        Backend::Minres(_) => "symmetric",
        _ if backend.accepts_unsymmetric() => "any",
        _ if backend.accepts_indefinite() => "definite, quasi-definite",
        _ => "definite",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_three_digits_and_a_unit() {
        let shown = [12.34, 1234.0, 98_765.0, 4.56e8, 2e9].map(nanoseconds);
        let shown: Vec<_> = shown.to_vec();
        assert_eq!(shown, ["12.3 ns", "1.23 µs", "98.8 µs", "456 ms", "2.00 s"]);
    }

    #[test]
    fn numbers_have_the_form_that_is_asked_for() {
        let shown =
            ["", ".1", "+.2", ".0e", "+e", "decade", "share", "per"].map(|f| formed(1.25, f));
        let expected = [
            "1.25", "1.2", "+1.25", "1e0", "+1.25e0", "0.10", "125.00 %", "1",
        ];
        assert_eq!(shown, expected);
        assert_eq!(formed(-1.25, "+.1"), "-1.2");
        assert_eq!(formed(f64::NAN, "+.1"), "NaN");
    }

    #[test]
    fn the_table_of_backends_names_every_one() {
        let text = backends();
        let says = Backend::all().iter().all(|b| text.contains(b.name()));
        assert!(says, "{text}");
        assert!(text.contains("GPL-2.0-or-later"));
    }
}
