//! The comparison as a table for people.

use super::compare::{Comparison, Row, TOLERANCE};
use super::measures::Measure;
use super::self_test::{Extreme, SLOWED, SelfTest};
use comfy_table::Cell;
use std::fmt::Write;
use taut_output::settings::distinct;
use taut_output::table::{error, pairs, table, verdict};

pub const LEGEND: &str = "\
A step from a common state of the scene. instructions: by callgrind, FAIL beyond 2 % above the baseline of the same
compiler; errors and the own backends' allocations: FAIL beyond the bar; times: in ns, never a failure";

/// Legend of a comparison with another program.
pub const AGAINST_LEGEND: &str = "\
Base and head in turns: base, head, head, base. ratio: of least times, the head's over the base's; the median of all
rounds with its bootstrap interval of 95 %. time-min and time-p99 FAIL where the interval is above 1 and the ratio above
1.03, instructions above 1.01 at 24 segments, above 1.02 elsewhere; slower: beyond the interval alone";

/// A row for each figure under the name of its case; then the notes and the counts of the verdicts.
pub fn text(rows: &[Row]) -> String {
    let cells = |row: &Row| {
        let ratio = row.before.zip(row.now).map(|(before, now)| now / before);
        let ratio = ratio.filter(|r| r.is_finite()).map(|r| format!("{r:.3}"));
        [ratio, row.bar.map(bar)]
    };
    figures(rows, ["baseline", "now", "ratio", "bar"], cells) + &summary(rows)
}

/// Table of a comparison of two programs.
pub fn against_text(rows: &[Row]) -> String {
    let cells = |row: &Row| {
        let ratio = row.ratio.map(|r| format!("{:.4}", r.value));
        let interval = row.ratio.map(|r| format!("{:.4} … {:.4}", r.low, r.high));
        [ratio, interval]
    };
    figures(rows, ["base", "head", "ratio", "interval"], cells)
}

/// The rows with their values, two further cells, their verdicts and the notes below them.
fn figures(
    rows: &[Row],
    [before, now, third, fourth]: [&str; 4],
    cells: impl Fn(&Row) -> [Option<String>; 2],
) -> String {
    let mut t = table(&["", before, now, third, fourth, "verdict"]);
    let notes = rows.iter().map(|row| row.note.as_str());
    let notes = distinct(notes.filter(|note| !note.is_empty()));
    let noted = |row: &Row| match notes.iter().position(|note| *note == row.note) {
        None => row.verdict.to_string(),
        Some(i) => format!("{} ({})", row.verdict, i + 1),
    };
    let mut case = "";
    for row in rows {
        if row.case != case {
            case = &row.case;
            t.add_row([case]);
        }
        let good = match row.verdict {
            Comparison::Pass | Comparison::Better => Some(true),
            Comparison::Fail | Comparison::Slower => Some(false),
            _ => None,
        };
        let [third, fourth] = cells(row).map(|cell| Cell::new(cell.unwrap_or_default()));
        t.add_row([
            Cell::new(format!("  {}", row.measure)),
            Cell::new(number(&row.measure, row.before)),
            Cell::new(number(&row.measure, row.now)),
            third,
            fourth,
            verdict(noted(row), good),
        ]);
    }
    let notes = notes.iter().enumerate();
    let notes = notes.map(|(i, note)| [format!("({})", i + 1), (*note).to_owned()]);
    taut_output::table::text(&t) + &pairs(notes)
}

pub fn self_test_text(test: &SelfTest) -> String {
    if test.figures == 0 {
        return "nothing was measured\n".to_owned();
    }
    let trials = test.trials;
    let line = |what: &str, count: usize, does: &str, extremes: &Option<[Extreme; 2]>| {
        let mut line = format!("{what}: {count} of {trials} {does}");
        if let Some([(least, of_least), (most, of_most)]) = extremes {
            let _ = write!(
                line,
                ", ratios {least:.4} ({of_least}) … {most:.4} ({of_most})"
            );
        }
        line + "\n"
    };
    let slower = format!("{:.0} % slower", 100.0 * SLOWED);
    line("the same program", test.same, "pass", &test.same_ratios)
        + &line(&slower, test.slowed, "fail", &test.slowed_ratios)
}

fn number(measure: &str, value: Option<f64>) -> String {
    match value {
        None => "-".to_owned(),
        Some(v) if measure.ends_with("-error") => error(Some(v)),
        Some(v) if measure == Measure::Instructions.name() => format!("{v:.0}"),
        Some(v) => format!("{v:.2}"),
    }
}

fn bar(bar: f64) -> String {
    if bar == 0.0 {
        "0".to_owned()
    } else {
        error(Some(bar))
    }
}

/// How many figures came to what, and what to do about it.
fn summary(rows: &[Row]) -> String {
    use Comparison::{Better, Fail, New, NotMeasured, OtherToolchain, Pass};
    let count = |verdict| rows.iter().filter(|r| r.verdict == verdict).count();
    let mut out = format!("\n{} figures:", rows.len());
    for verdict in [Pass, Fail, Better, New, OtherToolchain, NotMeasured] {
        if count(verdict) > 0 {
            let _ = write!(out, " {} {verdict},", count(verdict));
        }
    }
    out = out.trim_end_matches(',').to_owned() + "\n";
    if count(Better) > 0 {
        let _ = writeln!(
            out,
            "Fewer instructions by more than {:.0} %: `--update` makes that the baseline",
            100.0 * TOLERANCE
        );
    }
    if count(OtherToolchain) > 0 {
        out += "Counts of another compiler or processor are not compared: `--update` makes a baseline of this one\n";
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_output::table::plain;

    #[test]
    fn figures_stand_under_their_case_with_their_notes_below() {
        let row = |measure: Measure, now, verdict, note: &str| Row {
            before: Some(1000.0),
            now: Some(now),
            verdict,
            note: note.to_owned(),
            ..Row::new("hoist-24-1e3/gauss-seidel:groups", measure.name())
        };
        let rows = [
            row(Measure::Instructions, 900.0, Comparison::Better, ""),
            row(
                Measure::LoadError,
                f64::NAN,
                Comparison::Fail,
                &"not a number ".repeat(20),
            ),
            row(Measure::Min, 1234.0, Comparison::Shown, ""),
        ];
        let text = plain(&text(&rows));
        assert_eq!(text.matches("gauss-seidel:groups").count(), 1);
        assert!(text.contains("0.900") && text.contains("better"), "{text}");
        let holds = text.contains("FAIL (1)") && text.contains("(1)  not a number");
        assert!(holds, "{text}");
        assert!(text.contains("1234.00"), "{text}");
        assert!(text.contains("3 figures: 1 FAIL, 1 better\n"), "{text}");
        assert!(text.contains("`--update`"), "{text}");
        assert!(text.lines().all(|l| l.chars().count() <= 120), "{text}");
    }
}
