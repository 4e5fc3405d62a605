//! The page: one file without network, light and dark, its tables sorted by a click on a heading.

use super::charts::{self, decade};
use super::score::{Scores, scores};
use super::{Report, ReportError};
use crate::ladder::Record;
use crate::plot::{self, Chart};
use crate::table::nanoseconds;
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// What is known to be left out or to end, and why; beside the omissions of the run.
const LIMITATIONS: [&str; 6] = [
    "The dense solver is left out beyond 200 rows: its cost is cubic.",
    "Gauss–Seidel converges within useful numbers of sweeps only where the cable's ends are as heavy as its load, or the \
     groups are whole cables.",
    "UMFPACK on S refines against S, which has lost about roundoff × mass ratio when it was formed: on S it runs without its \
     own refinement and with one from the pieces.",
    "The scheme `spook` has no damping of its own and is lost on some light cables; the default damps the highest \
     frequencies only.",
    "At 1/60 s nothing is seen that is faster than a frame, as a longitudinal wave in steel is (10 m in 2 ms).",
    "Times are of one machine in one run: compare ratios within a page, not numbers between pages.",
];

/// The report as HTML.
///
/// # Errors
/// [`ReportError::Plot`].
pub fn page(report: &Report) -> Result<String, ReportError> {
    let sections = sections(report)?;
    let links = sections.iter().map(|s| (s.id, s.title));
    let text = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "taut: speed against error" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { "taut: speed against error of sparse solvers on hoisting cables" }
                    p { code { (report.command) } }
                    p.quiet { (report.machine) "; taut " (report.version) "; " (date(report.unix_time)) }
                    dl.settings {
                        @for (name, value) in &report.settings {
                            div { dt { (name) } dd { (value) } }
                        }
                    }
                    nav {
                        @for (id, title) in links { a href={ "#" (id) } { (title) } }
                    }
                }
                main {
                    @for section in &sections {
                        section id=(section.id) {
                            h2 { (section.title) }
                            (section.body)
                        }
                    }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    Ok(text.into_string())
}

/// The parts of the page that have something to show.
fn sections(report: &Report) -> Result<Vec<Section>, ReportError> {
    let scores = scores(&report.records);
    let extras = &report.extras;
    let precision = charts::work_precision(&report.records);
    Ok([
        figures(
            "work-precision",
            "Work against precision",
            "A step's time against the error of the multipliers, relative, ∞-norm, against the KKT system solved in 32 \
             digits. Along a curve: iterations, or a direct solver's refinement. Lower left is better.",
            &precision,
        )?,
        figures(
            "motion",
            "The time step",
            "Error of a motion against its cost, Δt from 1/30 s on along each curve: 24 segments, load/segment 10³, the \
             anchor moved aside; against the paper's step extrapolated to Δt = 0.",
            &charts::time_steps(extras),
        )?,
        figures(
            "profiles",
            "Performance profiles",
            "The share of the scenes that a solver does with errors within the level at most τ times as slowly as the best \
             (Dolan, Moré 2002): left is fast, high is reliable.",
            &charts::profiles(&scores),
        )?,
        means(&scores),
        figures(
            "sizes",
            "Time against elements",
            "A straight line of slope 1 is a cost in proportion to the cable's elements.",
            &charts::sizes(extras),
        )?,
        figures(
            "mass-ratios",
            "Condition and error against mass ratio",
            "What forming S loses, about roundoff × mass ratio, one refinement from the pieces J, M and Σ brings back. A bent \
             cable of 24 segments, the material stiff enough for the load.",
            &charts::mass_ratios(extras),
        )?,
        figures(
            "trace",
            "Times of single steps",
            &format!(
                "{}. What stands out is the system taking the processor away.",
                extras.trace.title
            ),
            &charts::trace(&extras.trace),
        )?,
        figures(
            "energy",
            "Energy over time",
            "A scheme's own damping, and its noise. Total energy of bodies, weight and joints.",
            &charts::energies(extras),
        )?,
        figures(
            "patterns",
            "Patterns",
            "Blocks of the lower triangle of S in the order of elimination, and those that its factor has besides.",
            &charts::patterns(extras),
        )?,
        claims(&report.records),
        rows(&report.records),
        limits(report),
    ]
    .into_iter()
    .flatten()
    .collect())
}

/// A part of the page.
struct Section {
    id: &'static str,
    title: &'static str,
    body: Markup,
}

/// A section of charts; none where there are none.
fn figures(
    id: &'static str,
    title: &'static str,
    text: &str,
    charts: &[Chart],
) -> Result<Option<Section>, ReportError> {
    if charts.is_empty() {
        return Ok(None);
    }
    let mut pictures = Vec::new();
    for chart in charts {
        pictures.push((chart.title.as_str(), plot::svg_for_page(chart)?));
    }
    let body = html! {
        p { (text) }
        div.figures {
            @for (title, picture) in &pictures {
                figure aria-label=(title) { (PreEscaped(picture)) }
            }
        }
    };
    Ok(Some(Section { id, title, body }))
}

/// A table whose columns are sorted by what they show, or by a number that belongs to it.
fn sortable(headings: &[&str], rows: &[Vec<Cell>]) -> Markup {
    html! {
        div.scroll {
            table.sortable {
                thead { tr { @for h in headings { th { button type="button" { (h) } } } } }
                tbody {
                    @for row in rows {
                        tr { @for cell in row { (cell.markup()) } }
                    }
                }
            }
        }
    }
}

/// A cell: its text, and the number that it is sorted by.
struct Cell {
    text: String,
    number: Option<f64>,
    best: bool,
}

impl Cell {
    fn text(text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            number: None,
            best: false,
        }
    }

    fn number(text: impl Into<String>, number: f64) -> Self {
        Self {
            number: Some(number),
            ..Self::text(text)
        }
    }

    fn error(value: Option<f64>) -> Self {
        match value {
            Some(e) if e.is_finite() => Self::number(format!("{e:.1e}"), e),
            _ => Self::number("–", f64::MAX),
        }
    }

    fn markup(&self) -> Markup {
        let class = match (self.number.is_some(), self.best) {
            (true, true) => "number best",
            (true, false) => "number",
            (false, true) => "best",
            (false, false) => "",
        };
        html! { td class=(class) data-sort=[self.number] { (self.text) } }
    }
}

/// The shifted geometric means of all levels.
fn means(scores: &[Scores]) -> Option<Section> {
    let mut rows = Vec::new();
    for s in scores {
        for (place, (solver, solved, mean)) in s.means().into_iter().enumerate() {
            rows.push(vec![
                Cell::number(format!("{:.0e}", s.level), s.level),
                Cell::text(solver),
                Cell::number(format!("{solved} of {}", s.problems()), solved as f64),
                Cell {
                    best: place == 0,
                    ..Cell::number(nanoseconds(mean), mean)
                },
            ]);
        }
    }
    let body = html! {
        p { "Whole step, shifted geometric mean over the scenes (shift 1 µs); what a solver does not reach counts as ten times \
             the slowest that does. The best of each level is marked." }
        (sortable(&["error within", "solver", "scenes done", "mean step"], &rows))
    };
    (!rows.is_empty()).then_some(Section {
        id: "means",
        title: "Mean costs",
        body,
    })
}

/// How often iterations that said so had converged.
fn claims(records: &[Record]) -> Option<Section> {
    let mut families: Vec<(&str, usize, usize, usize)> = Vec::new();
    for r in records {
        let (Some(claimed), Some(verified)) = (r.claimed_converged, r.verified_converged) else {
            continue;
        };
        match families.iter_mut().find(|(name, ..)| *name == r.backend) {
            Some((_, n, c, v)) => (*n, *c, *v) = (*n + r.frames, *c + claimed, *v + verified),
            None => families.push((&r.backend, r.frames, claimed, verified)),
        }
    }
    let rows: Vec<Vec<Cell>> = families
        .iter()
        .map(|&(name, frames, claimed, verified)| {
            vec![
                Cell::text(name),
                Cell::number(frames.to_string(), frames as f64),
                Cell::number(claimed.to_string(), claimed as f64),
                Cell::number(verified.to_string(), verified as f64),
                Cell::number(
                    claimed.saturating_sub(verified).to_string(),
                    claimed.saturating_sub(verified) as f64,
                ),
            ]
        })
        .collect();
    let body = html! {
        p { "Solves whose iteration claimed convergence, and those of them whose residual in extended precision was within the \
             tolerance." }
        (sortable(&["solver", "solves", "claimed", "true", "false"], &rows))
    };
    (!rows.is_empty()).then_some(Section {
        id: "claims",
        title: "Claimed against verified",
        body,
    })
}

/// All rows.
fn rows(records: &[Record]) -> Option<Section> {
    let row = |r: &Record| {
        let iterations = match r.iterations {
            0 => Cell::number("direct", 0.0),
            n => Cell::number(n.to_string(), n as f64),
        };
        let held = match (&r.failure, &r.error) {
            (_, Some(e)) => Cell::text(e.clone()),
            (Some(f), _) => Cell::text(format!("lost at {:.2} s", f.time)),
            _ => Cell::text(format!("{} s", r.simulated_s)),
        };
        let solve = r.solve_ns / (r.segments + 1) as f64;
        vec![
            Cell::number(r.segments.to_string(), r.segments as f64),
            Cell::number(decade(r.mass_ratio), r.mass_ratio),
            Cell::text(r.backend.clone()),
            iterations,
            Cell {
                best: !r.fastest_at.is_empty(),
                ..Cell::number(nanoseconds(r.step_ns), r.step_ns)
            },
            Cell::number(format!("{solve:.0} ns"), solve),
            Cell::error(Some(r.backward_error_componentwise)),
            Cell::error(Some(r.forward_error_unrefined)),
            Cell::error(Some(r.forward_error)),
            Cell::error(r.elongation_error),
            Cell::error(r.load_error_m),
            held,
        ]
    };
    let rows: Vec<Vec<Cell>> = records.iter().map(row).collect();
    let headings = [
        "segments",
        "load/segment",
        "solver",
        "iterations",
        "step",
        "solve a joint",
        "backward error",
        "error, unrefined",
        "error",
        "elongation error",
        "load off (m)",
        "held",
    ];
    let body = html! {
        p { "Times are medians. Marked: the fastest of its scene within an error level. A heading sorts its column." }
        (sortable(&headings, &rows))
    };
    (!rows.is_empty()).then_some(Section {
        id: "rows",
        title: "All rows",
        body,
    })
}

fn limits(report: &Report) -> Option<Section> {
    let body = html! {
        ul {
            @for o in &report.omissions { li { code { (o.backend) } ": " (o.reason) } }
            @for l in LIMITATIONS { li { (l) } }
        }
    };
    Some(Section {
        id: "limits",
        title: "Left out, and known limits",
        body,
    })
}

/// Year, month and day of a time in seconds since 1970 (Hinnant's civil calendar).
fn date(unix_time: u64) -> String {
    if unix_time == 0 {
        return "time not recorded".to_owned();
    }
    let days = unix_time / 86_400 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let of_month = of_year - (153 * month + 2) / 5 + 1;
    let (month, carry) = if month < 10 {
        (month + 3, 0)
    } else {
        (month - 9, 1)
    };
    format!("{}-{month:02}-{of_month:02}", year + era * 400 + carry)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_of_the_calendar() {
        for (time, expected) in [
            (951_782_400, "2000-02-29"),
            (1_735_689_599, "2024-12-31"),
            (1_735_689_600, "2025-01-01"),
        ] {
            assert_eq!(date(time), expected);
        }
    }
}
