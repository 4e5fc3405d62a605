//! The page of the main job: its plots, what ranks its solvers, its claims, its rows.

use super::Report;
use super::cells::{Cell, sortable};
use super::charts;
use super::page::{Section, figures};
use super::score::{Scores, scores};
use super::sheets::table;
use maud::html;
use serde_json::{Value, json};
use taut_measure::choice::Omission;
use taut_output::check::ExperimentError;
use taut_output::notation::number;
use taut_output::plot::Chart;
use taut_output::table::nanoseconds;
use taut_studies::ladder::{self, Answer, LadderRow, Trace};
use taut_studies::studies::BENCH;

/// Work against precision of the report's scenes.
pub(super) fn work_precision(report: &Report) -> Vec<Chart> {
    charts::work_precision(&report.records)
}

/// The sections that have something to show.
pub(super) fn sections(report: &Report) -> Result<Vec<Section>, ExperimentError> {
    let scores = scores(&report.records);
    let extras = &report.extras;
    Ok([
        answer(&report.records),
        figures(
            "work-precision",
            "Work against precision",
            "A step's time against the error of the multipliers, relative, ∞-norm, against the KKT system solved in 32 \
             digits. Along a curve: iterations, or a direct solver's refinement. Lower left is better.",
            &work_precision(report),
        )?,
        profiles(&scores, &report.omissions)?,
        means(&scores),
        trace(&extras.trace)?,
        figures(
            "patterns",
            "Patterns",
            "Blocks of the lower triangle of S in the order of elimination, and those that its factor has besides.",
            &charts::patterns(extras),
        )?,
        claims(&report.records),
        rows(&report.records),
    ]
    .into_iter()
    .flatten()
    .collect())
}

/// Which solver to use: the fastest of each scene within each error, and who is next.
fn answer(records: &[LadderRow]) -> Option<Section> {
    let Answer {
        sheet,
        rows,
        advice,
    } = Answer::of(records);
    let body = html! {
        p { (advice) " Errors are those of multipliers and elongation; next is the fastest of another family of solvers, and \
             how many times as long its step takes; k× are iterations a step." }
        (table(sheet, &rows))
    };
    (rows != json!([])).then(|| Section::new("answer", "Which solver", body))
}

/// The times of single steps, and what most of them keep.
fn trace(trace: &Trace) -> Result<Option<Section>, ExperimentError> {
    let text = format!(
        "{}. The first step allocates; what else stands out may be a step that the guard redid, or the system taking the \
         processor away.",
        trace.title
    );
    let charts = charts::trace(trace);
    let section = figures("trace", "Times of single steps", &text, &charts)?;
    let row = |(name, ns): (&str, f64)| {
        vec![
            Cell::text(name),
            Cell::number(nanoseconds(ns), ns),
            Cell::number(format!("{:.3} %", 100.0 * ns * 1e-9 / trace.dt), ns),
        ]
    };
    let rows: Vec<Vec<Cell>> = trace.quantiles().into_iter().map(row).collect();
    let table = sortable(
        &["share of the steps", "step", "of the frame's time"],
        &rows,
    );
    Ok(section.map(|section| Section {
        body: html! { (section.body) (table) },
        ..section
    }))
}

/// The performance profiles, with the solvers that never reach a level, and those that were left out.
fn profiles(scores: &[Scores], omissions: &[Omission]) -> Result<Option<Section>, ExperimentError> {
    let section = figures(
        "profiles",
        "Performance profiles",
        "The share of the scenes that a solver does with errors within the level at most τ times as slowly as the best \
         (Dolan, Moré 2002): left is fast, high is reliable. Beside its name: how many scenes it does at all.",
        &charts::profiles(scores),
    )?;
    let never = scores.iter().filter_map(|s| {
        let none = s.solved().filter(|(_, solved)| *solved == 0);
        let names: Vec<&str> = none.map(|(name, _)| name).collect();
        let never = format!("0 of {} scenes within {}", s.problems(), number(s.level));
        (!names.is_empty()).then(|| (never, names.join(", ")))
    });
    let left_out = omissions
        .iter()
        .map(|o| (o.backend.clone(), format!("left out: {}", o.reason)));
    let list: Vec<(String, String)> = never.chain(left_out).collect();
    Ok(section.map(|section| Section {
        body: html! {
            (section.body)
            @if !list.is_empty() {
                ul { @for (what, of) in &list { li { (what) ": " (of) } } }
            }
        },
        ..section
    }))
}

/// The shifted geometric means: a row for each solver, columns for each level, by the first of them.
fn means(scores: &[Scores]) -> Option<Section> {
    let mut headings = vec!["solver".to_owned()];
    let mut rows: Vec<Vec<Cell>> = Vec::new();
    for s in scores {
        let within = number(s.level);
        headings.push(format!("step within {within}"));
        headings.push(format!("scenes within {within}"));
        for (place, (solver, solved, mean)) in s.means().into_iter().enumerate() {
            let known = rows.iter().position(|row| row[0].text == solver);
            let at = known.unwrap_or_else(|| {
                rows.push(vec![Cell::text(solver)]);
                rows.len() - 1
            });
            let step = if solved > 0 {
                Cell::number(nanoseconds(mean), mean)
            } else {
                Cell::none()
            };
            rows[at].push(Cell {
                best: place == 0 && solved > 0,
                ..step
            });
            let share = format!("{solved} of {}", s.problems());
            rows[at].push(Cell::number(share, solved as f64));
        }
    }
    let body = html! {
        p { "Whole step, shifted geometric mean over the scenes (shift 1 µs); what a solver does not reach, or is left out of, \
             counts as ten times the slowest that does, so that a mean may be less at a stricter level, where the slowest no longer \
             takes part; – where it reaches none. The best of each level is marked." }
        (sortable(&headings, &rows))
    };
    (!rows.is_empty()).then(|| Section::new("means", "Mean costs", body))
}

/// How often solvers that said so had solved their system.
fn claims(records: &[LadderRow]) -> Option<Section> {
    let rows = Value::from(ladder::claim_rows(records));
    let body = html! {
        p {
            "Solves whose solver claimed a solution, an iteration by its convergence, a direct solver by its status; \
             those of them whose residual in extended precision was within the iteration's tolerance, ‖r‖₂ ≤ τ ‖b‖₂; \
             those where it was not, but where rounding alone leaves that much, a normwise backward error of at most \
             10⁻¹⁴, the one bar of direct solvers; and those that are false. Before refinement."
        }
        (table(BENCH.question().sheet("claims"), &rows))
    };
    (rows != json!([])).then(|| Section::new("claims", "Claimed against verified", body))
}

fn rows(records: &[LadderRow]) -> Option<Section> {
    let rows = Value::from(ladder::data_of(records));
    let body = html! {
        p { (BENCH.question().legend) ". Marked: the least of its scene. A heading sorts its column." }
        (table(ladder::sheet_of(records), &rows))
    };
    (!records.is_empty()).then(|| Section::new("rows", "All rows", body))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two solvers at two levels of one scene.
    fn two() -> Vec<Scores> {
        let level = |level, cg| Scores {
            level,
            costs: vec![
                ("banded".to_owned(), vec![Some(1e3)]),
                ("cg:none".to_owned(), vec![cg]),
            ],
        };
        vec![level(1e-3, Some(5e3)), level(1e-6, None)]
    }

    #[test]
    fn profiles_name_who_never_reaches_a_level_and_who_was_left_out() {
        let omission = Omission {
            backend: "umfpack/kkt".to_owned(),
            reason: "not compiled in".to_owned(),
        };
        let section = profiles(&two(), &[omission]).expect("draws");
        let text = section.expect("profiles").body.into_string();
        for part in [
            "<li>0 of 1 scenes within 10⁻⁶: cg:none</li>",
            "<li>umfpack/kkt: left out: not compiled in</li>",
            "\ncg:none: 1 of 1\n",
            "\ncg:none: 0 of 1\n",
        ] {
            assert_eq!(text.matches(part).count(), 1, "{part}");
        }
    }

    #[test]
    fn means_are_a_row_for_each_solver_and_columns_for_each_level() {
        let text = means(&two()).expect("means").body.into_string();
        assert_eq!(text.matches("<th ").count(), 1 + 2 * 2);
        let rows = text.split("<tbody>").nth(1).expect("a body");
        assert_eq!(rows.matches("<tr>").count(), 2);
        assert_eq!(rows.matches("1 of 1").count(), 3);
        assert_eq!(rows.matches("0 of 1").count(), 1);
    }
}
