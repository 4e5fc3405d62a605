//! Results of several runs as one Markdown text. It tells where each was measured and answers for
//! the main job. Checks are counted by verdict and listed where they do more than pass. Everything
//! else has its tables as they are printed.

use super::Report;
use super::page::{origin, title};
use serde_json::{Value, json};
use std::fmt::Write;
use taut_output::check::Verdict;
use taut_output::row::{self, Row, number_of, text_of};
use taut_output::sheet::{PLAIN, Sheet, Show, across, column};
use taut_studies::ladder::Answer;

pub fn markdown(reports: &[Report]) -> String {
    let mut out = "# Results\n\n\
         Written by `taut report --markdown` from the data of the runs named below each heading. Times are of one machine in \
         one run: compare them within a run only.\n"
        .to_owned();
    for report in reports {
        let title = title(report.name());
        let _ = write!(out, "\n## {}\n\n`{}`\n", capital(title), report.command);
        let origin = origin(report);
        let facts = origin.iter().chain(&report.settings);
        let facts: Vec<String> = facts
            .map(|(name, value)| format!("{name}: {value}"))
            .collect();
        let _ = write!(out, "\n{}.\n\n", facts.join("; "));
        match &report.other {
            None => main_job(&mut out, report),
            Some(other) => match row::rows_of(&other.rows, "") {
                rows if are_checks(&rows) => of_checks(&mut out, &rows),
                _ => {
                    let _ = writeln!(out, "```text\n{}\n```", other.printed.trim());
                }
            },
        }
    }
    out
}

pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}

fn main_job(out: &mut String, report: &Report) {
    let Answer {
        sheet,
        rows,
        advice,
    } = Answer::of(&report.records);
    let _ = writeln!(out, "{}\n{advice}", sheet.markdown(&rows));
    for o in &report.omissions {
        let _ = writeln!(out, "\nLeft out: `{}`: {}.", o.backend, o.reason);
    }
}

/// How many checks of each experiment came to what.
const COUNTS: Sheet = Sheet {
    columns: &[
        column("experiment", "experiment"),
        column("title", "about"),
        column("checks", "checks"),
    ],
    across: across(&[column("verdict", "{}")], &[column("count", "")]),
    ..PLAIN
};

const CHECKS: Sheet = Sheet {
    columns: &[
        column("case", "check").shown(Show::Row(named)),
        column("reference", "reference"),
        column("ours", "ours"),
        column("error", "error").shown(Show::Row(|row| small(row, "error"))),
        column("bar", "bar").shown(Show::Row(|row| small(row, "bar"))),
        column("verdict", "verdict")
            .shown(Show::Row(|row| text_of(row, "verdict").replace('-', " "))),
        column("note", "why"),
    ],
    ..PLAIN
};

fn named(row: &Row) -> String {
    format!("{}: {}", text_of(row, "experiment"), text_of(row, "case"))
}

/// An error or a bar; empty if absent.
fn small(row: &Row, key: &str) -> String {
    number_of(row, key).map_or_else(String::new, |x| format!("{x:.1e}"))
}

/// True if all rows are checks.
fn are_checks(rows: &[Row]) -> bool {
    let is_check = |row: &Row| {
        let keys = ["experiment", "title", "verdict"];
        keys.iter().all(|key| !text_of(row, key).is_empty())
    };
    !rows.is_empty() && rows.iter().all(is_check)
}

/// How many checks of each experiment came to what, and those that do more than pass.
fn of_checks(out: &mut String, all: &[Row]) {
    let is = |row: &Row, verdict: Verdict| text_of(row, "verdict") == verdict.key();
    let used = Verdict::ALL.into_iter();
    let used: Vec<Verdict> = used.filter(|v| all.iter().any(|r| is(r, *v))).collect();
    let counts = |name: &str, title: &str, rows: &[Row]| {
        let count = |verdict: &Verdict| match rows.iter().filter(|r| is(r, *verdict)).count() {
            0 => "".into(),
            n => Value::from(n),
        };
        let row = |verdict: &Verdict| {
            json!({ "experiment": name, "title": title, "checks": rows.len(),
                "verdict": verdict.to_string(), "count": count(verdict) })
        };
        used.iter().map(row).collect::<Vec<_>>()
    };
    let groups = all.chunk_by(|a, b| text_of(a, "experiment") == text_of(b, "experiment"));
    let one = |rows: &[Row]| {
        counts(
            text_of(&rows[0], "experiment"),
            text_of(&rows[0], "title"),
            rows,
        )
    };
    let rows = groups.flat_map(one).chain(counts("all", "", all));
    out.push_str(&COUNTS.markdown(&rows.collect()));
    let misses = all.iter().filter(|row| !is(row, Verdict::Pass));
    let misses: Vec<Value> = misses.cloned().map(Value::Object).collect();
    if !misses.is_empty() {
        let _ = write!(out, "\n{}", CHECKS.markdown(&misses.into()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Other;

    #[test]
    fn checks_are_counted_by_experiment_and_told_where_they_do_more_than_pass() {
        let check = |name: &str, verdict: &str| {
            json!({ "experiment": name, "title": "a case", "case": "it | that", "reference": "1", "ours": "2",
                "error": 1.0, "bar": null, "verdict": verdict, "note": "for a reason" })
        };
        let rows = json!([
            check("H01", "pass"),
            check("H01", "limit"),
            check("H02", "pass")
        ]);
        let report = |name: &str, rows| Report {
            other: Some(Other {
                name: name.to_owned(),
                rows,
                printed: " 1 2\n".to_owned(),
            }),
            ..Report::default()
        };
        let text = markdown(&[report("hard", rows), report("energy", json!([{ "a": 1 }]))]);
        for line in [
            "## Hard cases with known answers",
            "| experiment | about | checks | pass | limit |",
            "| --- | --- | ---: | ---: | ---: |",
            "| H01 | a case | 2 | 1 | 1 |",
            "| H02 | a case | 1 | 1 |  |",
            "| all |  | 3 | 2 | 1 |",
            "| H01: it \\| that | 1 | 2 | 1.0e0 |  | limit | for a reason |",
            "```text",
            "1 2",
        ] {
            let found = text.lines().filter(|l| *l == line).count();
            assert_eq!(found, 1, "{line}\n{text}");
        }
    }
}
