//! What is known to be left out or to end, and why: the section "Limits" of the README, which is the one place of it.

use maud::{Markup, html};

const README: &str = include_str!("../../../README.md");

/// The points of the section, each in one line.
fn points() -> Vec<String> {
    let section = README.split("\n## ").find(|s| s.starts_with("Limits\n"));
    let (_, text) = section
        .unwrap_or_default()
        .split_once('\n')
        .unwrap_or_default();
    text.split("\n- ")
        .skip(1)
        .map(|point| point.split_whitespace().collect::<Vec<_>>().join(" "))
        .collect()
}

/// Each point as HTML.
pub(super) fn limits() -> Vec<Markup> {
    points().iter().map(|point| marked(point)).collect()
}

/// A line of Markdown, of which code and bold text are known.
fn marked(line: &str) -> Markup {
    let strong = |text: &str| {
        html! {
            @for (k, part) in text.split("**").enumerate() {
                @if k % 2 == 1 { strong { (part) } } @else { (part) }
            }
        }
    };
    html! {
        @for (k, part) in line.split('`').enumerate() {
            @if k % 2 == 1 { code { (part) } } @else { (strong(part)) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_readme_has_limits() {
        let points = points();
        assert!(points.len() > 6, "{points:?}");
        let full =
            |point: &&String| point.len() > 20 && point.ends_with('.') && !point.contains('\n');
        assert!(points.iter().all(|p| full(&p)), "{points:?}");
    }

    #[test]
    fn code_and_bold_text_are_marked() {
        let text = marked("**The step** ends: `a < b`, see `--help`.").into_string();
        assert_eq!(
            text,
            "<strong>The step</strong> ends: <code>a &lt; b</code>, see <code>--help</code>."
        );
    }
}
