//! Checks: reference, ours, error, bar, verdict; criteria and notes below them.

use super::{error, table, text};
use crate::check::Outcome;
use comfy_table::{CellAlignment, ContentArrangement};

/// Most characters of a line.
const WIDTH: u16 = 118;

/// An outcome's own tables, and its checks with `reference` as the heading of what ours is compared with. A note that
/// several rows share in a row stands once.
#[must_use]
pub fn checks(outcome: &Outcome, reference: &str) -> String {
    let mut out = outcome.text.clone();
    if outcome.checks.is_empty() {
        return out;
    }
    let mut t = table(&["case", reference, "ours", "error", "bar", "verdict", "note"]);
    t.set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(WIDTH);
    for column in t.column_iter_mut() {
        if [1, 2, 5, 6].contains(&column.index) {
            column.set_cell_alignment(CellAlignment::Left);
        }
    }
    let mut notes: Vec<&str> = Vec::new();
    for check in &outcome.checks {
        let mut marks = Vec::new();
        for note in [&check.criterion, &check.note] {
            if note.is_empty() {
                continue;
            }
            let known = notes.iter().position(|n| n == note);
            let index = known.unwrap_or_else(|| {
                notes.push(note);
                notes.len() - 1
            });
            marks.push((index + 1).to_string());
        }
        t.add_row([
            check.case.clone(),
            check.reference.clone(),
            check.ours.clone(),
            check.error.map_or_else(String::new, |e| error(Some(e))),
            check.bar.map_or_else(String::new, |b| error(Some(b))),
            check.verdict.to_string(),
            marks.join(" "),
        ]);
    }
    out.push_str(&text(&t));
    if !notes.is_empty() {
        let mut list = table(&[]);
        list.set_content_arrangement(ContentArrangement::Dynamic)
            .set_width(WIDTH);
        for (i, note) in notes.iter().enumerate() {
            list.add_row([(i + 1).to_string(), (*note).to_owned()]);
        }
        out.push_str(&text(&list));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::Check;

    #[test]
    fn notes_stand_once_and_are_wrapped() {
        let row = |case: &str| {
            Check::within(case, "1".into(), "2".into(), 1.0, 2.0)
                .by("the same measure")
                .noting("word ".repeat(60))
        };
        let outcome = Outcome {
            checks: vec![row("a"), row("b")],
            ..Outcome::default()
        };
        let shown = checks(&outcome, "paper, theory");
        assert_eq!(shown.matches("the same measure").count(), 1);
        assert!(shown.lines().all(|l| l.chars().count() <= 120), "{shown}");
        assert_eq!(shown.matches("pass").count(), 2);
        assert!(checks(&Outcome::default(), "theory").is_empty());
    }
}
