//! Known limits with their reasons: `LIMITS.md`, which the README links.

use maud::{Markup, html};

const LIMITS: &str = include_str!("../../LIMITS.md");

/// The points of the list, each in one line.
fn points() -> Vec<String> {
    let lists = LIMITS
        .split("\n\n")
        .filter_map(|block| block.strip_prefix("- "));
    let points = lists.flat_map(|list| list.split("\n- "));
    points
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
    fn there_are_limits() {
        let points = points();
        assert!(points.len() > 6, "{points:?}");
        let full =
            |point: &&String| point.len() > 20 && point.ends_with('.') && !point.contains('\n');
        assert!(points.iter().all(|p| full(&p)), "{points:?}");
    }

    #[test]
    fn code_and_bold_text_are_marked() {
        let text = marked("**The step** ends: `a < b`, see `--help`.").into_string();
        let expected =
            "<strong>The step</strong> ends: <code>a &lt; b</code>, see <code>--help</code>.";
        assert_eq!(text, expected);
    }
}
