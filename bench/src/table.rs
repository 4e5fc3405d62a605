//! Tables for people: aligned text, numbers short enough to read. The texts hold ANSI sequences for what stands out,
//! which [`crate::output::print`] leaves out where they would not be seen, and [`plain`] everywhere.

pub(crate) mod answer;
mod check;
mod iterative;
mod kernels;
mod linear;
mod matrix;
mod style;

use answer::Answer;
pub use check::checks;
pub use iterative::iterative;
pub use kernels::kernels;
pub use linear::linear;
pub use matrix::{compared, solved, suite};
pub use style::MARK;
pub(crate) use style::{mark_columns, mark_least, verdict};

use crate::ladder::{self, Fastest, Omission, Record, Results, SceneNote};
use crate::statics::{Needed, Settled};
use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, ContentArrangement, Table};
use std::fmt::Write;
use taut_solver::Backend;

/// An empty table with right-aligned columns but the first.
pub(crate) fn table(header: &[&str]) -> Table {
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

/// The same of cells that are wrapped where lines would be longer than 120 columns.
pub(crate) fn wrapped(header: &[&str]) -> Table {
    let mut table = table(header);
    table
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(WIDTH);
    table
}

/// The table's lines without the blanks at their ends.
pub(crate) fn text(table: &Table) -> String {
    let mut out = String::new();
    for line in table.lines() {
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out
}

/// A text without ANSI sequences.
#[must_use]
pub fn plain(text: &str) -> String {
    anstream::adapter::strip_str(text).to_string()
}

/// A number of nanoseconds with a unit, three digits.
#[must_use]
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

/// An error in two digits, `-` where there is none.
pub(crate) fn error(e: Option<f64>) -> String {
    match e {
        None => "-".to_owned(),
        Some(e) if e.is_nan() => "nan".to_owned(),
        Some(e) => format!("{e:.1e}"),
    }
}

pub(crate) fn ratio(r: f64) -> String {
    if r >= 1e4 {
        format!("{r:.0e}")
    } else {
        format!("{r}")
    }
}

/// Levels as marks, their exponents: `-3 -6`.
fn marks(fastest: &[Fastest]) -> String {
    let levels = fastest.iter().map(|f| format!("{:.0}", f.level.log10()));
    levels.collect::<Vec<_>>().join(" ")
}

/// All rows of the main job, a table for each scene, then what the solvers claimed.
#[must_use]
pub fn ladder(results: &Results) -> String {
    let mut out = String::new();
    for scene in results
        .records
        .chunk_by(|a, b| (a.segments, a.mass_ratio) == (b.segments, b.mass_ratio))
    {
        let r = &scene[0];
        let _ = write!(
            out,
            "\n{} segments, load/segment mass ratio {}",
            r.segments,
            ratio(r.mass_ratio)
        );
        let same = |n: &&SceneNote| (n.segments, n.mass_ratio) == (r.segments, r.mass_ratio);
        let note = results.scenes.iter().find(same);
        if let Some(note) = note {
            let verdict = note.failure.as_ref().map_or_else(
                || "stable for 30 s".to_owned(),
                |f| format!("unstable at {:.2} s", f.time),
            );
            let _ = write!(
                out,
                ": the step itself is {verdict} (reference motion at Δt = 1/{:.0} s)",
                1.0 / note.reference_dt
            );
        }
        out.push('\n');
        out.push_str(&scene_table(scene));
    }
    out.push_str(&claims(&results.records));
    out
}

/// What the main job answers, in a table and a sentence; what was left out.
#[must_use]
pub fn answer(results: &Results) -> String {
    let Answer { rows, advice } = Answer::of(&results.records);
    let mut t = wrapped(&Answer::HEADINGS);
    for (i, column) in t.column_iter_mut().enumerate() {
        if Answer::is_text(i) {
            column.set_cell_alignment(CellAlignment::Left);
        }
    }
    t.add_rows(rows);
    let mut sentence = wrapped(&[]);
    sentence.add_row([advice]);
    format!(
        "{}\n{}{}",
        text(&t),
        text(&sentence),
        omissions(&results.omissions)
    )
}

/// What has no rows, and why; nothing where there is nothing.
pub(crate) fn omissions(omissions: &[Omission]) -> String {
    let mut out = String::new();
    if !omissions.is_empty() {
        let _ = writeln!(out, "\nLeft out");
    }
    for Omission { backend, reason } in omissions {
        let _ = writeln!(out, "  {backend}: {reason}");
    }
    out
}

/// The rows without the repetitions of an iteration that converged before an earlier limit.
fn once(records: &[Record]) -> Vec<Record> {
    let mut rows = records.to_vec();
    rows.dedup_by(|r, last| {
        let converged = last.iterations_used < last.iterations as f64;
        converged && (&r.backend, r.step_ns.to_bits()) == (&last.backend, last.step_ns.to_bits())
    });
    rows
}

fn scene_table(records: &[Record]) -> String {
    let mut t = table(&[
        "solver",
        "iter",
        "step",
        "ns/joint",
        "backw.",
        "error",
        "error r0",
        "elong.",
        "load m",
        "held",
        "fastest 1e",
    ]);
    for r in &once(records) {
        let iterations = match r.iterations {
            0 => String::new(),
            limit if r.iterations_used < limit as f64 => {
                format!("{:.0} of {limit}", r.iterations_used)
            }
            limit => limit.to_string(),
        };
        let held = match &r.failure {
            None => format!("≥{} s", r.simulated_s),
            Some(failure) => format!("{:.2} s", failure.time),
        };
        let forward = if r.error.is_some() {
            "failed".to_owned()
        } else {
            error(Some(r.forward_error))
        };
        t.add_row([
            r.backend.clone(),
            iterations,
            nanoseconds(r.step_ns),
            format!("{:.0}", r.solve_ns / (r.segments + 1) as f64),
            error(Some(r.backward_error_componentwise)),
            forward,
            error(Some(r.forward_error_unrefined)),
            error(r.elongation_error),
            error(r.load_error_m),
            held,
            marks(&r.fastest_at),
        ]);
    }
    let ended = |r: &Record| r.iterations == 0 || r.iterations_used < r.iterations as f64;
    let runs = |r: &Record| r.error.is_none() && r.failure.is_none() && ended(r);
    mark_columns(
        &mut t,
        records,
        runs,
        &[
            (2, |r| Some(r.step_ns)),
            (3, |r| Some(r.solve_ns)),
            (4, |r| Some(r.backward_error_componentwise)),
            (5, |r| Some(r.forward_error)),
            (6, |r| Some(r.forward_error_unrefined)),
            (7, |r| r.elongation_error),
            (8, |r| r.load_error_m),
        ],
    );
    text(&t)
}

/// How often the solvers' own claim of a solution was true.
fn claims(records: &[Record]) -> String {
    let claims = ladder::claims(records);
    if claims.is_empty() {
        return String::new();
    }
    let mut t = table(&["solver", "solves", "claimed", "true", "rounding", "false"]);
    let count = |n: Option<usize>| n.map_or("-".to_owned(), |n| n.to_string());
    for c in claims {
        t.add_row([
            c.backend.clone(),
            c.solves.to_string(),
            c.claimed.to_string(),
            c.verified.to_string(),
            count(c.rounded()),
            count(c.false_ones()),
        ]);
    }
    format!(
        "\nSolutions claimed by the solvers' own tests, and true by the extended-precision residual (frames);\n\
         rounding: only with a normwise backward error of 1e-14 allowed for\n{}",
        text(&t)
    )
}

/// Cables damped to rest.
#[must_use]
pub fn settled(rows: &[Settled]) -> String {
    let mut t = table(&[
        "solver",
        "segments",
        "ratio",
        "steps",
        "elongation m",
        "vs discrete",
        "vs MgL/YA",
        "sideways m",
    ]);
    for r in rows {
        t.add_row([
            r.backend.clone(),
            r.segments.to_string(),
            ratio(r.mass_ratio),
            r.steps.to_string(),
            format!("{:.9}", r.elongation_m),
            error(Some(r.error)),
            error(Some(r.error_continuum)),
            error(Some(r.sideways_m)),
        ]);
    }
    let rows = rows
        .iter()
        .map(|r| ((r.segments, r.mass_ratio), Some(r.error)));
    mark_least(&mut t, 5, &rows.collect::<Vec<_>>());
    text(&t)
}

/// Iterations needed, the levels side by side.
#[must_use]
pub fn needed(rows: &[Needed]) -> String {
    let mut levels: Vec<f64> = Vec::new();
    for r in rows {
        if !levels.contains(&r.level) {
            levels.push(r.level);
        }
    }
    let headers: Vec<String> = levels.iter().map(|l| format!("{l:.0e}")).collect();
    let mut header = vec!["solver", "segments", "ratio", "start"];
    header.extend(headers.iter().map(String::as_str));
    let mut t = table(&header);
    let mut cells: Vec<&[Needed]> = Vec::new();
    for group in rows.chunk_by(|a, b| {
        (&a.backend, a.segments, a.mass_ratio, a.warm_start)
            == (&b.backend, b.segments, b.mass_ratio, b.warm_start)
    }) {
        let r = &group[0];
        let start = if r.warm_start { "warm" } else { "cold" };
        let mut row = vec![
            r.backend.clone(),
            r.segments.to_string(),
            ratio(r.mass_ratio),
            start.to_owned(),
        ];
        row.extend(group.iter().map(|r| {
            r.iterations
                .map_or(format!("> {}", r.limit), |n| n.to_string())
        }));
        t.add_row(row);
        cells.push(group);
    }
    for i in 0..levels.len() {
        let of = |group: &&[Needed]| {
            let iterations = group.get(i).and_then(|r| r.iterations);
            (
                (group[0].segments, group[0].mass_ratio),
                iterations.map(|n| n as f64),
            )
        };
        mark_least(&mut t, 4 + i, &cells.iter().map(of).collect::<Vec<_>>());
    }
    text(&t)
}

/// What is compiled in, with licences.
#[must_use]
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
            if backend.accepts_unsymmetric() {
                "any"
            } else if backend.accepts_indefinite() {
                "definite, quasi-definite"
            } else {
                "definite"
            },
            backend.licence(),
        ]);
    }
    text(&t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_three_digits_and_a_unit() {
        let shown: Vec<_> = [12.34, 1234.0, 98_765.0, 4.56e8, 2e9]
            .map(nanoseconds)
            .to_vec();
        assert_eq!(shown, ["12.3 ns", "1.23 µs", "98.8 µs", "456 ms", "2.00 s"]);
    }

    #[test]
    fn the_table_of_backends_names_every_one() {
        let text = backends();
        assert!(
            Backend::all().iter().all(|b| text.contains(b.name())),
            "{text}"
        );
        assert!(text.contains("GPL-2.0-or-later"));
    }
}
