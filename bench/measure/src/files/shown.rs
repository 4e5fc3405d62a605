//! Text as terminals may have it.
//!
//! Names come from files of others, and may hold what a terminal obeys: sequences that clear the screen or set the title, line
//! ends that forge lines. They are written as Rust writes them in a string, `\u{1b}` or `\n`, where text leaves the program.

use std::fmt::Write;

/// Most digits of a number as they are: shorter in scientific notation.
const DIGITS: usize = 30;

/// A text of several lines: line ends, tabs and the sequences of colour and bold type stay.
pub(super) fn text(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let taken = match style(rest) {
            Some(length) => {
                out.push_str(&rest[..length]);
                length
            }
            None => {
                add(&mut out, c, &['\n', '\t']);
                c.len_utf8()
            }
        };
        rest = &rest[taken..];
    }
    out
}

/// A text that is to be on one line, with numbers of many digits in scientific notation.
pub fn line(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in short(text).chars() {
        add(&mut out, c, &[]);
    }
    out
}

/// Adds a character, escaped where a terminal would obey it.
fn add(out: &mut String, c: char, kept: &[char]) {
    // Also those that reverse what follows, and separators of lines.
    let is_order =
        matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    if (c.is_control() || is_order) && !kept.contains(&c) {
        let _ = write!(out, "{}", c.escape_default());
    } else {
        out.push(c);
    }
}

/// Length of the sequence of a style that the text begins with, `ESC [ numbers m`.
fn style(text: &str) -> Option<usize> {
    let rest = text.strip_prefix("\u{1b}[")?;
    let end = rest.find(|c: char| !(c.is_ascii_digit() || c == ';'))?;
    rest[end..].starts_with('m').then_some(2 + end + 1)
}

/// Numbers that take more than [`DIGITS`] digits in scientific notation.
fn short(text: &str) -> String {
    let is_word = |c: char| c.is_alphanumeric() || matches!(c, '.' | '_');
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while !rest.is_empty() {
        let words = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        let (word, after) = rest.split_at(words.max(rest.chars().next().map_or(1, char::len_utf8)));
        let digits = word.len() > DIGITS && word.bytes().all(|b| b.is_ascii_digit() || b == b'.');
        match word.parse::<f64>() {
            Ok(number) if digits && number.is_finite() => {
                let _ = write!(out, "{number:e}");
            }
            _ => out.push_str(word),
        }
        rest = after;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_escaped() {
        let name = "a\u{1b}]0;x\u{7}b\u{1b}[2J\u{9b}1m\u{202e}\r";
        let shown = r"a\u{1b}]0;x\u{7}b\u{1b}[2J\u{9b}1m\u{202e}\r";
        assert_eq!(line(name), shown);
        assert_eq!(text(name), shown);
        assert_eq!(line("a\nb\tc\u{1b}[1md"), r"a\nb\tc\u{1b}[1md");
        let styled = "\u{1b}[1;31mø\u{1b}[0m\n\tt²\u{1b}[";
        assert_eq!(text(styled), "\u{1b}[1;31mø\u{1b}[0m\n\tt²\\u{1b}[");
    }

    #[test]
    fn numbers_of_hundreds_of_digits_are_short() {
        let told = format!("`a` is {}: {} of -{}, so", 1e300, 5e-324, 2.5e40);
        assert_eq!(line(&told), "`a` is 1e300: 5e-324 of -2.5e40, so");
        let kept = "x0000000000000000000000000000000000000000001, 16.666666666666668, 123456789012345678901234567890";
        assert_eq!(line(kept), kept);
    }
}
