//! Emphasis in tables: best values and verdicts. The styles are ANSI sequences;
//! [`taut_measure::files::print`] omits them where nobody would see them.

use comfy_table::{Attribute, Cell, Color};

/// Legend of the mark for best values.
pub const MARK: &str =
    "*: the least of its column, apart from what failed, became unstable or ran out of iterations";

/// Rows with the least value of their group, if they have a peer in it. `rows` holds the group and
/// the value of each row; a missing or infinite value or NaN is never the least.
pub(crate) fn least<G: PartialEq>(rows: &[(G, Option<f64>)]) -> Vec<bool> {
    let is_least = |row: &(G, Option<f64>)| {
        let peers = || rows.iter().filter(|(group, _)| *group == row.0);
        let least = peers().filter_map(finite).reduce(f64::min);
        least.is_some() && finite(row) == least && peers().nth(1).is_some()
    };
    rows.iter().map(is_least).collect()
}

fn finite<G>((_, value): &(G, Option<f64>)) -> Option<f64> {
    value.filter(|v| v.is_finite())
}

/// Which of the texts of a column are marked: those of the [`least`] values, and all that read as they do.
pub(crate) fn marked<G: PartialEq>(texts: &[&String], rows: &[(G, Option<f64>)]) -> Vec<bool> {
    let best = least(rows);
    let is_marked = |i: usize| {
        // Equal texts get equal marks, whatever their digits behind the last one shown.
        let like = |j: usize| best[j] && rows[j].0 == rows[i].0 && texts[j] == texts[i];
        finite(&rows[i]).is_some() && (0..rows.len()).any(like)
    };
    (0..rows.len()).map(is_marked).collect()
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
