//! The keys of a case's file: the table by which files are read is the text that people get.

use super::CaseError;
use super::places::line_of;
use toml::de::{DeTable, DeValue};

/// Heads of tables in brackets, and below each its keys, indented by two, with their meanings.
pub(in crate::hard) const KEYS: &str = include_str!("keys.txt");

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

/// Refuses a key that a table of the text, or one inside of it, does not know.
pub(super) fn refuse_unknown(table: &DeTable<'_>, name: &str, text: &str) -> Result<(), CaseError> {
    let known = keys(name);
    for (key, value) in table {
        let own = key.get_ref().as_ref();
        if !known.is_empty() && !known.contains(&own) {
            let error = CaseError::unknown("key", own, known.into_iter());
            return Err(error.at(line_of(text, key.span().start)));
        }
        let own = if name == "run.load" { "BODY" } else { own };
        let inner = [name, ".", own].concat();
        let inner = inner.trim_start_matches('.');
        match value.get_ref() {
            DeValue::Table(table) => refuse_unknown(table, inner, text)?,
            DeValue::Array(list) => {
                let mut tables = list.iter().filter_map(|item| item.get_ref().as_table());
                tables.try_for_each(|table| refuse_unknown(table, inner, text))?;
            }
            _ => {}
        }
    }
    Ok(())
}
