//! The keys of a case's file: the table by which files are read is the text that people get.

use super::CaseError;
use super::expression::known;
use super::places::{all, line_of};
use super::probes::PROBES;

/// Heads of tables in brackets, and below each its keys, indented by two, with their meanings.
pub(super) const KEYS: &str = include_str!("keys.txt");

/// Operators, and functions of series with their arguments.
const FUNCTIONS: &str = include_str!("functions.txt");

/// The keys, and the names that formulas know, probes with their units.
pub(in crate::hard) fn help() -> String {
    let mut text = format!("{KEYS}\n{FUNCTIONS}");
    let functions: Vec<_> = known().map(str::to_owned).collect();
    let probe = |(name, unit, _): &(&str, &str, _)| match *unit {
        "" => (*name).to_owned(),
        unit => format!("{name}[{unit}]"),
    };
    let probes: Vec<_> = PROBES.iter().map(probe).collect();
    for (title, names) in [("Functions", functions), ("Probes", probes)] {
        text += "\n";
        text += title;
        text += ":";
        let mut width = title.len();
        for name in names {
            width += name.len() + 1;
            if width > WIDTH {
                text += "\n ";
                width = name.len() + 1;
            }
            text += " ";
            text += &name;
        }
        text += "\n";
    }
    text + "Columns: those of `taut run`, in its help\n"
}

/// Letters of a line of names, at most.
const WIDTH: usize = 110;

/// The keys of a table; none where all names are free.
pub(super) fn keys(table: &str) -> Vec<&'static str> {
    let head = |line: &&str| line.starts_with('[');
    let own = |line: &&str| line.trim_matches(['[', ']']) == table;
    let lines = KEYS
        .lines()
        .skip_while(|line| !(table.is_empty() || head(line) && own(line)));
    let lines = lines.skip(1).take_while(|line| !head(line));
    let entries = lines.filter_map(|line| line.strip_prefix("  "));
    let entries = entries.filter(|entry| !entry.starts_with(' '));
    let names = entries.filter_map(|entry| entry.split("  ").next());
    names.flat_map(|names| names.split(", ")).collect()
}

/// Refuses a key that its table does not know.
pub(super) fn refuse_unknown(text: &str) -> Result<(), CaseError> {
    for (path, [start, _]) in all(text) {
        let mut names = path.iter().map(String::as_str);
        let own = names.next_back().unwrap_or_default();
        let mut names: Vec<_> = names.filter(|name| !is_number(name)).collect();
        if let ["run", "load", body] = &mut names[..] {
            *body = "BODY";
        }
        let known = keys(&names.join("."));
        if !(known.is_empty() || known.contains(&own) || is_number(own)) {
            let error = CaseError::unknown("key", own, known.into_iter());
            return Err(error.at(line_of(text, start)));
        }
    }
    Ok(())
}

fn is_number(part: &str) -> bool {
    part.parse::<usize>().is_ok()
}
