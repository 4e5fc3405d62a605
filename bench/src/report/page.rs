//! The page: one file without network, light and dark, its tables sorted by a click on a heading.

use super::{Other, Report, limits, main_job, sheets, study};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use taut_output::check::ExperimentError;
use taut_output::plan::{PRECISION, Plot};
use taut_output::plot::{self, Chart};
use taut_output::settings::Setting;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The report as HTML.
pub fn page(report: &Report) -> Result<String, ExperimentError> {
    let title = title(report.name());
    let mut sections = match &report.other {
        None => main_job::sections(report)?,
        Some(other) => other_sections(other)?,
    };
    sections.push(left_out(report));
    let links = sections.iter().map(|s| (&s.id, &s.title));
    let text = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "taut: " (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { "taut: " (title) }
                    p { "To reproduce: " code { (report.command) } }
                    (settings(&origin(report)))
                    (settings(&report.settings))
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

/// Title of an experiment's page.
pub(super) fn title(name: &str) -> &'static str {
    study(name).map_or("an experiment", |study| study.question().title)
}

/// The plots of a study that have something to show.
fn plots(other: &Other) -> Vec<Plot> {
    let plans = study(&other.name).map_or(&[][..], |study| &study.question().plots);
    let plots = plans.iter().map(|plan| plan.plot(&other.rows));
    plots.filter(|plot| !plot.charts.is_empty()).collect()
}

/// Where the report comes from: when, from which sources, on what.
pub(super) fn origin(report: &Report) -> Vec<Setting> {
    let known = |text: &str| {
        if text.is_empty() {
            "not recorded".to_owned()
        } else {
            text.to_owned()
        }
    };
    let pairs = [
        ("measured", date(report.unix_time)),
        ("program", format!("taut {}", report.version)),
        ("commit", known(&report.commit)),
        ("machine", known(&report.machine)),
        ("compiler", known(&report.compiler)),
    ];
    pairs.map(|(name, value)| (name.to_owned(), value)).to_vec()
}

/// Names with their values; empty without any.
pub(super) fn settings(pairs: &[Setting]) -> Markup {
    html! {
        @if !pairs.is_empty() {
            dl.settings {
                @for (name, value) in pairs { div { dt { (name) } dd { (value) } } }
            }
        }
    }
}

/// The sections of another benchmark than the main job: plots, tables, what is printed.
fn other_sections(other: &Other) -> Result<Vec<Section>, ExperimentError> {
    let mut sections = Vec::new();
    for plot in plots(other) {
        sections.extend(figures(plot.id, plot.title, &plot.text, &plot.charts)?);
    }
    sections.extend(sheets::sheets(other).iter().map(sheets::Sheet::section));
    if !other.printed.is_empty() {
        let body = html! { pre.scroll { (other.printed.trim()) } };
        sections.push(Section::new("printed", "As printed", body));
    }
    Ok(sections)
}

/// The plot of work against precision alone, as an SVG file on paper of its own.
pub fn picture(report: &Report) -> Result<String, ExperimentError> {
    let charts = match &report.other {
        None => main_job::work_precision(report),
        Some(other) => {
            let plots = plots(other);
            let precise = plots.into_iter().filter(|plot| plot.id == PRECISION);
            precise.flat_map(|plot| plot.charts).collect()
        }
    };
    if charts.is_empty() {
        let name = report.name();
        return Err(format!(
            "the rows of `{name}` hold no plot of work against precision: give a report of `taut bench`"
        )
        .into());
    }
    Ok(plot::picture(&charts)?)
}

/// A part of the page.
pub(super) struct Section {
    pub(super) id: String,
    pub(super) title: String,
    pub(super) body: Markup,
}

impl Section {
    pub(super) fn new(id: impl Into<String>, title: impl Into<String>, body: Markup) -> Self {
        let (id, title) = (id.into(), title.into());
        Self { id, title, body }
    }
}

/// Legend of the slopes below a chart.
const ORDERS: &str = "Thin lines: what is parallel to slope 1 shrinks in proportion to Δt, an error of first order; to \
                      slope 2 in proportion to Δt², of second order. Only their slopes mean something.";

/// A section of charts; `None` without any.
pub(super) fn figures(
    id: &str,
    title: &str,
    text: &str,
    charts: &[Chart],
) -> Result<Option<Section>, ExperimentError> {
    if charts.is_empty() {
        return Ok(None);
    }
    let mut pictures = Vec::new();
    for chart in charts {
        let below = chart.has_orders().then_some(ORDERS);
        pictures.push((chart.title.as_str(), plot::svg_for_page(chart)?, below));
    }
    let all = html! {
        div.figures {
            @for (title, picture, below) in &pictures {
                figure aria-label=(title) {
                    (PreEscaped(picture))
                    @if let Some(text) = below { figcaption { (text) } }
                }
            }
        }
    };
    let body = html! {
        p { (text) }
        @if id == PRECISION && pictures.len() > 1 {
            div.choice hidden {
                p { "Click a solver in the legend to hide it, twice to leave it alone; point at a mark to read it." }
                label { "Shown: " select autocomplete="off" {
                    @for (title, ..) in &pictures { option { (title) } }
                } }
            }
            figure.large aria-label=(pictures[0].0) { (PreEscaped(&pictures[0].1)) }
            details { summary { "All " (pictures.len()) " plots" } (all) }
        } @else {
            (all)
        }
    };
    Ok(Some(Section::new(id, title, body)))
}

/// Section on omitted solvers and known limits, with reasons.
fn left_out(report: &Report) -> Section {
    let body = html! {
        ul {
            @for o in &report.omissions { li { code { (o.backend) } ": " (o.reason) } }
            @for limit in limits::limits() { li { (limit) } }
        }
    };
    Section::new("limits", "Left out, and known limits", body)
}

/// Date and time in UTC of a time in seconds since 1970 (Hinnant's civil calendar).
fn date(unix_time: u64) -> String {
    if unix_time == 0 {
        return "not recorded".to_owned();
    }
    let second = unix_time % 86_400;
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
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
    let year = year + era * 400 + carry;
    format!("{year}-{month:02}-{of_month:02} {hour:02}:{minute:02}:{second:02} UTC")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_of_the_calendar() {
        for (time, expected) in [
            (951_782_400, "2000-02-29 00:00:00 UTC"),
            (1_735_689_599, "2024-12-31 23:59:59 UTC"),
            (1_735_689_600, "2025-01-01 00:00:00 UTC"),
        ] {
            assert_eq!(date(time), expected);
        }
    }
}
