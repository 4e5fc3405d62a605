//! What several runs found, as one Markdown text: where each was measured, the main job's answer, of checks how many came to
//! what and those that do more than pass, of everything else the tables as they are printed.

use super::page::{origin, title};
use super::{Other, Report};
use serde_json::Value;
use std::fmt::Write;
use taut_output::check::Verdict;
use taut_studies::ladder::Answer;

/// The text.
#[must_use]
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
            Some(other) => match checks(other) {
                Some(all) => of_checks(&mut out, &all),
                None => {
                    let _ = writeln!(out, "```text\n{}\n```", other.printed.trim());
                }
            },
        }
    }
    out
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}

/// A table, its numbers to the right.
fn table<R: AsRef<[String]>>(
    out: &mut String,
    headings: &[&str],
    is_text: &dyn Fn(usize) -> bool,
    rows: &[R],
) {
    let line = |cells: &mut dyn Iterator<Item = String>| {
        let cells: Vec<String> = cells.map(|cell| cell.replace('|', "\\|")).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    out.push_str(&line(&mut headings.iter().map(|h| (*h).to_owned())));
    let rule = |i| if is_text(i) { "---" } else { "---:" }.to_owned();
    out.push_str(&line(&mut (0..headings.len()).map(rule)));
    for row in rows {
        out.push_str(&line(&mut row.as_ref().iter().cloned()));
    }
}

fn main_job(out: &mut String, report: &Report) {
    let Answer { rows, advice } = Answer::of(&report.records);
    table(out, &Answer::HEADINGS, &Answer::is_text, &rows);
    let _ = writeln!(out, "\n{advice}");
    for o in &report.omissions {
        let _ = writeln!(out, "\nLeft out: `{}`: {}.", o.backend, o.reason);
    }
}

/// A check as it is written: its experiment's name and title, and what stands in its columns.
struct Row<'a> {
    name: &'a str,
    title: &'a str,
    verdict: &'a str,
    check: &'a Value,
}

impl Row<'_> {
    fn text(&self, key: &str) -> String {
        self.check[key].as_str().unwrap_or_default().to_owned()
    }

    fn number(&self, key: &str) -> String {
        self.check[key]
            .as_f64()
            .map_or(String::new(), |x| format!("{x:.1e}"))
    }
}

/// The rows, where they are checks.
fn checks(other: &Other) -> Option<Vec<Row<'_>>> {
    fn row(check: &Value) -> Option<Row<'_>> {
        let text = |key: &str| check[key].as_str();
        Some(Row {
            name: text("experiment")?,
            title: text("title")?,
            verdict: text("verdict")?,
            check,
        })
    }
    let rows: Option<Vec<Row<'_>>> = other.rows.as_array()?.iter().map(row).collect();
    rows.filter(|rows| !rows.is_empty())
}

/// How many checks of each experiment came to what, and those that do more than pass.
fn of_checks(out: &mut String, all: &[Row<'_>]) {
    let verdicts = Verdict::ALL.map(|v| (v.to_string(), v.key()));
    let used = verdicts
        .iter()
        .filter(|(_, key)| all.iter().any(|r| r.verdict == *key));
    let used: Vec<_> = used.collect();
    let mut headings = vec!["experiment", "about", "checks"];
    headings.extend(used.iter().map(|(shown, _)| shown.as_str()));
    let counts = |rows: &[Row<'_>]| {
        let count = |key: &str| rows.iter().filter(|r| r.verdict == key).count();
        let counts = used.iter().map(|(_, key)| match count(key) {
            0 => String::new(),
            n => n.to_string(),
        });
        counts.collect::<Vec<_>>()
    };
    let mut rows: Vec<Vec<String>> = Vec::new();
    for group in all.chunk_by(|a, b| a.name == b.name) {
        let mut row = vec![
            group[0].name.to_owned(),
            group[0].title.to_owned(),
            group.len().to_string(),
        ];
        row.extend(counts(group));
        rows.push(row);
    }
    let mut total = vec!["all".to_owned(), String::new(), all.len().to_string()];
    total.extend(counts(all));
    rows.push(total);
    table(out, &headings, &|i| i < 2, &rows);
    let told = all.iter().filter(|r| r.verdict != Verdict::Pass.key());
    let told: Vec<Vec<String>> = told
        .map(|r| {
            vec![
                format!("{}: {}", r.name, r.text("case")),
                r.text("reference"),
                r.text("ours"),
                r.number("error"),
                r.number("bar"),
                r.verdict.replace('-', " "),
                r.text("note"),
            ]
        })
        .collect();
    if !told.is_empty() {
        out.push('\n');
        let headings = [
            "check",
            "reference",
            "ours",
            "error",
            "bar",
            "verdict",
            "why",
        ];
        table(out, &headings, &|i| !(3..5).contains(&i), &told);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

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
            assert_eq!(
                text.lines().filter(|l| *l == line).count(),
                1,
                "{line}\n{text}"
            );
        }
    }
}
