//! Checks: reference, ours, error, bar, verdict; criteria and notes below them.

use super::{error, pairs, text, verdict, wrapped};
use crate::check::{Check, Outcome, Parts, Verdict};
use crate::settings::distinct;
use comfy_table::{Cell, CellAlignment};

/// An outcome's own tables, and its checks with `reference` as the heading of what ours is compared with. A note that
/// several rows share in a row stands once; the parts of the errors have columns where any is known.
pub fn checks(outcome: &Outcome, reference: &str) -> String {
    let mut out = outcome.text.clone();
    if outcome.checks.is_empty() {
        return out;
    }
    let split = outcome.checks.iter().any(Check::is_split);
    let parts: &[&str] = if split {
        &["algebraic", "time", "space"]
    } else {
        &[]
    };
    let header = [
        &["case", reference, "ours", "error"],
        parts,
        &["bar", "verdict", "note"],
    ]
    .concat();
    let mut t = wrapped(&header);
    for (column, name) in t.column_iter_mut().zip(&header) {
        if ![&["error", "bar"], parts].concat().contains(name) {
            column.set_cell_alignment(CellAlignment::Left);
        }
    }
    let of = |check| noted(check).into_iter().filter(|note| !note.is_empty());
    let notes = distinct(outcome.checks.iter().flat_map(of));
    for check in &outcome.checks {
        let places = of(check).filter_map(|note| notes.iter().position(|n| *n == note));
        let marks: Vec<String> = places.map(|i| (i + 1).to_string()).collect();
        let number = |x: Option<f64>| x.map_or_else(String::new, |x| error(Some(x)));
        let mut row = vec![
            Cell::new(&check.case),
            Cell::new(&check.reference),
            Cell::new(&check.ours),
            Cell::new(number(check.error)),
        ];
        if split {
            let Parts {
                algebraic,
                time,
                space,
            } = check.parts;
            row.extend([algebraic, time, space].map(|part| Cell::new(number(part))));
        }
        let good = match check.verdict {
            Verdict::Pass => Some(true),
            Verdict::Fail => Some(false),
            _ => None,
        };
        row.extend([
            Cell::new(number(check.bar)),
            verdict(check.verdict, good),
            Cell::new(marks.join(" ")),
        ]);
        t.add_row(row);
    }
    out.push_str(&text(&t));
    let notes = notes.iter().enumerate();
    out + &pairs(notes.map(|(i, note)| [(i + 1).to_string(), (*note).to_owned()]))
}

fn noted(check: &Check) -> [&str; 2] {
    [&check.criterion, &check.note]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::plain;

    #[test]
    fn notes_stand_once_and_are_wrapped() {
        let row = |case: &str| {
            Check::within(case, "1", "2", 1.0, 2.0)
                .by("the same measure")
                .with_note("word ".repeat(60))
        };
        let outcome = Outcome {
            checks: vec![row("a"), row("b")],
            ..Outcome::default()
        };
        let shown = checks(&outcome, "paper, theory");
        assert_eq!(shown.matches("the same measure").count(), 1);
        let width = plain(&shown).lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{shown}");
        assert_eq!(shown.matches("pass").count(), 2);
        assert!(checks(&Outcome::default(), "theory").is_empty());
    }

    #[test]
    fn parts_of_errors_have_columns_where_known() {
        let row = Check::within("a", "1", "2", 1.0, 2.0);
        let shown = |row: &Check| {
            let outcome = Outcome {
                checks: vec![row.clone()],
                ..Outcome::default()
            };
            checks(&outcome, "theory")
        };
        assert!(!shown(&row).contains("space"));
        let shown = shown(&row.space_part(0.25));
        let holds = shown.contains("space") && shown.contains("2.5e-1");
        assert!(holds, "{shown}");
    }
}
