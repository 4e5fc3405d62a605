//! Emphasis in tables: best values and verdicts. The styles are ANSI sequences;
//! [`taut_ground::files::print`] omits them where nobody would see them.

use comfy_table::{Attribute, Cell, Color, Row, Table};

/// Legend of the mark for best values.
pub const MARK: &str =
    "*: the least of its column, apart from what failed, became unstable or ran out of iterations";

/// Rows with the least value of their group, if they have a rival in it. `rows` holds the group and
/// the value of each row; a missing or infinite value or NaN is never the least.
pub(crate) fn least<G: PartialEq>(rows: &[(G, Option<f64>)]) -> Vec<bool> {
    let is_least = |row: &(G, Option<f64>)| {
        let rivals = || rows.iter().filter(|(group, _)| *group == row.0);
        let least = rivals().filter_map(finite).reduce(f64::min);
        least.is_some() && finite(row) == least && rivals().nth(1).is_some()
    };
    rows.iter().map(is_least).collect()
}

fn finite<G>((_, value): &(G, Option<f64>)) -> Option<f64> {
    value.filter(|v| v.is_finite())
}

/// Marks the [`least`] values of a column: a `*` after them, in bold, in place of the blank before the next column. All
/// that read as the least does are marked.
pub(crate) fn mark_least<G: PartialEq>(t: &mut Table, column: usize, rows: &[(G, Option<f64>)]) {
    let best = least(rows);
    let shown = |i: usize| Some(t.row(i)?.cell_iter().nth(column)?.content());
    // Equal texts get equal marks, whatever their digits behind the last one shown.
    let marks: Vec<bool> = (0..rows.len())
        .map(|i| {
            let like = |j: usize| best[j] && rows[j].0 == rows[i].0 && shown(j) == shown(i);
            finite(&rows[i]).is_some() && (0..rows.len()).any(like)
        })
        .collect();
    if !marks.contains(&true) {
        return;
    }
    if let Some(column) = t.column_mut(column) {
        column.set_padding((1, 0));
    }
    if let Some(header) = t.header().map(|row| with_mark(row, column, false)) {
        t.set_header(header);
    }
    for (i, best) in marks.into_iter().enumerate() {
        if let Some(row) = t.row_mut(i) {
            *row = with_mark(row, column, best);
        }
    }
}

/// The row with a mark, or a blank as wide, in a column.
fn with_mark(row: &Row, column: usize, best: bool) -> Row {
    let cells = row.cell_iter().enumerate().map(|(i, cell)| match best {
        _ if i != column => cell.clone(),
        true => Cell::new(format!("{}*", cell.content())).add_attribute(Attribute::Bold),
        false => Cell::new(format!("{} ", cell.content())),
    });
    cells.collect::<Vec<_>>().into()
}

/// Shows what is bad in a column, by its words, as a bad [`verdict`] does.
pub(crate) fn mark_bad(t: &mut Table, column: usize, words: &[&str]) {
    for row in 0..t.row_count() {
        let cells = t.row(row).into_iter().flat_map(Row::cell_iter);
        let cells = cells.enumerate().map(|(i, cell)| {
            let text = cell.content();
            if i == column && words.contains(&text.as_str()) {
                verdict(text, Some(false))
            } else {
                cell.clone()
            }
        });
        let marked: Vec<Cell> = cells.collect();
        if let Some(row) = t.row_mut(row) {
            *row = marked.into();
        }
    }
}

/// A verdict: green where it is good, red where it is bad.
pub fn verdict(text: impl ToString, good: Option<bool>) -> Cell {
    let cell = Cell::new(text);
    match good {
        Some(true) => cell.fg(Color::Green),
        Some(false) => cell.fg(Color::Red).add_attribute(Attribute::Bold),
        None => cell,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{plain, table, text};

    /// A table of groups and values, with the marks.
    fn shown(rows: &[(&str, Option<f64>)]) -> String {
        let mut t = table(&["group", "value", "next"]);
        for (group, value) in rows {
            let value = value.map_or("-".to_owned(), |v| v.to_string());
            t.add_row([(*group).to_owned(), value, "x".to_owned()]);
        }
        mark_least(&mut t, 1, rows);
        text(&t)
    }

    #[test]
    fn the_least_of_each_group_is_marked_in_bold() {
        let rows = [
            ("a", Some(2.5)),
            ("a", Some(0.25)),
            ("b", Some(7.5)),
            ("a", Some(0.25)),
            ("b", Some(f64::NAN)),
            ("a", None),
            ("c", Some(1.5)),
            ("b", Some(f64::NEG_INFINITY)),
        ];
        let styled = shown(&rows);
        let plain = plain(&styled);
        let expected = [
            " group  value  next",
            " a        2.5     x",
            " a       0.25*    x",
            " b        7.5*    x",
            " a       0.25*    x",
            " b        NaN     x",
            " a          -     x",
            " c        1.5     x",
            " b       -inf     x",
        ];
        assert_eq!(plain.lines().collect::<Vec<_>>(), expected);
        assert_eq!(styled.matches("\u{1b}[1m").count(), 3, "{styled:?}");
        assert!(styled.contains("\u{1b}[1m0.25*\u{1b}[0m"), "{styled:?}");
    }

    #[test]
    fn nothing_is_marked_where_nothing_counts() {
        let rows = [("a", None), ("a", Some(f64::NAN)), ("b", Some(1.0))];
        let styled = shown(&rows);
        assert!(!styled.contains(['*', '\u{1b}']), "{styled:?}");
    }

    #[test]
    fn marks_take_no_room() {
        let rows = [("a", Some(1.0)), ("a", Some(2.0))];
        let width = |t: &str| plain(t).lines().map(str::len).max();
        let unmarked = shown(&rows.map(|(group, _)| (group, None)));
        assert_eq!(width(&shown(&rows)), width(&unmarked));
    }

    #[test]
    fn verdicts_have_colours() {
        let mut t = table(&["case", "verdict"]);
        t.add_row([Cell::new("a"), verdict("pass", Some(true))]);
        t.add_row([Cell::new("b"), verdict("FAIL", Some(false))]);
        t.add_row([Cell::new("c"), verdict("limit", None)]);
        let styled = text(&t);
        let lines: Vec<&str> = styled.lines().collect();
        assert!(lines[1].contains('\u{1b}') && lines[2].contains('\u{1b}'));
        assert!(!lines[3].contains('\u{1b}'), "{styled:?}");
        assert!(plain(&styled).ends_with("limit\n"), "{styled:?}");
    }
}
