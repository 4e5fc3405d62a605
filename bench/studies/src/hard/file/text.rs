//! Values and texts of a case's file, once the names in them are known.

use super::CaseError;
use super::expression::{Formula, Values, number};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use taut_output::table::formed;
use toml::{Table, Value};

/// Names of a run: numbers, and words that stand for themselves.
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    pub(super) values: Values,
    pub(super) words: BTreeMap<String, String>,
    /// Places of the bodies of a run's path \[m].
    pub(super) path: Vec<Vector3<f64>>,
}

impl Names {
    /// Those that are there before a file says any.
    pub(super) fn new(quick: bool) -> Self {
        let mut names = Self::default();
        names.values.set("pi", std::f64::consts::PI);
        names.values.set("quick", f64::from(u8::from(quick)));
        names
    }

    pub(super) fn is_quick(&self) -> bool {
        self.values.known["quick"] == [1.0]
    }

    /// A number, a formula after `=`, or a word.
    pub(super) fn add(&mut self, name: &str, value: &Value) -> Result<(), CaseError> {
        match value {
            Value::String(word) if !word.starts_with('=') => {
                self.words.insert(name.to_owned(), word.clone());
            }
            value => {
                let value = self.number(value)?;
                self.values.set(name, value);
            }
        }
        Ok(())
    }

    /// Values `NAME = FORMULA`, in order.
    pub(super) fn define(&mut self, all: &[String]) -> Result<(), CaseError> {
        for text in all {
            let (name, formula) = split(text)?;
            let value = number(formula, &self.values)?;
            self.values.set(name, value);
        }
        Ok(())
    }

    /// A count, or a time, in a range.
    pub(super) fn count(
        &self,
        key: &'static str,
        value: &Value,
        range: RangeInclusive<f64>,
    ) -> Result<usize, CaseError> {
        counted(key, self.number(value)?, range)
    }

    /// A number as it is written, or by a formula after `=`.
    pub(super) fn number(&self, value: &Value) -> Result<f64, CaseError> {
        match value {
            Value::Integer(n) => Ok(*n as f64),
            Value::Float(x) => Ok(*x),
            Value::Boolean(holds) => Ok(f64::from(u8::from(*holds))),
            Value::String(text) => number(text.trim_start_matches('='), &self.values),
            other => Err(CaseError::Formula {
                expected: "a number",
                found: other.to_string(),
            }),
        }
    }

    /// A text with `{FORMULA}`, `{FORMULA:.3}`, `{FORMULA:+e}`, `{WORD}` or `{CONDITION ? TEXT | TEXT}` in it.
    pub(super) fn text(&self, text: &str) -> Result<String, CaseError> {
        let mut out = String::new();
        let mut rest = text;
        while let Some((before, after)) = rest.split_once('{') {
            let end = closing(after).ok_or_else(|| {
                let expected = "`}`";
                let found = String::new();
                CaseError::Formula { expected, found }.within(text)
            })?;
            let (inner, after) = (&after[..end], &after[end + 1..]);
            out.push_str(before);
            out.push_str(&self.inserted(inner)?);
            rest = after;
        }
        out.push_str(rest);
        Ok(out)
    }

    fn inserted(&self, inner: &str) -> Result<String, CaseError> {
        if let Some((condition, texts)) = inner.split_once('?') {
            let (one, other) = texts.split_once('|').unwrap_or((texts, ""));
            let holds = number(condition, &self.values)? != 0.0;
            return self.text(if holds { one.trim() } else { other.trim() });
        }
        let (formula, form) = inner.split_once(':').unwrap_or((inner, ""));
        if let Some(word) = self.words.get(formula) {
            return Ok(word.clone());
        }
        Ok(formed(number(formula, &self.values)?, form))
    }

    /// A scene's table with numbers and texts in place of formulas, and entries repeated.
    pub(super) fn table(&self, table: &Table) -> Result<Table, CaseError> {
        let filled = table.iter().map(|(key, value)| {
            let value = self.filled(value).map_err(|e| e.inside(key))?;
            Ok((key.clone(), value))
        });
        filled.collect()
    }

    pub(super) fn filled(&self, value: &Value) -> Result<Value, CaseError> {
        Ok(match value {
            Value::String(text) if text.starts_with('=') => written(self.number(value)?),
            Value::String(text) => Value::String(self.text(text)?),
            Value::Table(table) => Value::Table(self.table(table)?),
            Value::Array(all) => {
                let mut filled = Vec::new();
                for (number, item) in all.iter().enumerate() {
                    let inside = |e: CaseError| e.inside(&number);
                    let mut entry = item.as_table().cloned().unwrap_or_default();
                    let Some(count) = entry.remove("repeat") else {
                        filled.push(self.filled(item).map_err(inside)?);
                        continue;
                    };
                    let alone = entry.get("value").filter(|_| entry.len() == 1);
                    let mut names = self.clone();
                    for k in 0..self.count("repeat", &count, 0.0..=1e4).map_err(inside)? {
                        names.values.set("k", k as f64);
                        let one = match alone {
                            Some(value) => names.filled(value),
                            None => names.table(&entry).map(Value::Table),
                        };
                        filled.push(one.map_err(inside)?);
                    }
                }
                Value::Array(filled)
            }
            other => other.clone(),
        })
    }
}

/// A number that has to be in a range, as a count, which is whole but for the rounding of a formula, or a time.
pub(super) fn counted(
    key: &'static str,
    found: f64,
    range: RangeInclusive<f64>,
) -> Result<usize, CaseError> {
    let (least, most, whole) = (range.start(), range.end(), found.round());
    let is_whole = key == "time" || (found - whole).abs() <= 1e-9 * whole.abs();
    if is_whole && range.contains(&found) {
        return Ok(whole as usize);
    }
    let exact = found.is_nan() || found.fract() == 0.0 || key == "time";
    let most = formed(*most, if *most < 1e3 { "" } else { ".0e" });
    let range = format!(
        "{}from {least} to {most}",
        if exact { "" } else { "whole, " }
    );
    Err(CaseError::Count { key, found, range })
}

/// Where the brace before a text closes.
pub(super) fn closing(text: &str) -> Option<usize> {
    let mut depth = 1;
    text.char_indices().find_map(|(at, c)| {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        (depth == 0).then_some(at)
    })
}

/// A whole number is written as one: counts are whole.
fn written(x: f64) -> Value {
    if x.fract() == 0.0 && x.abs() < 1e15 {
        Value::Integer(x as i64)
    } else {
        Value::Float(x)
    }
}

/// The name and the formula of `NAME = FORMULA`.
pub(super) fn split(text: &str) -> Result<(&str, &str), CaseError> {
    let (name, formula) = text.split_once('=').ok_or_else(|| CaseError::NoName {
        text: text.to_owned(),
    })?;
    Ok((name.trim(), formula.trim()))
}

/// The formula of `NAME = FORMULA`.
pub(super) fn defined(text: &str) -> Result<(&str, Formula), CaseError> {
    let (name, formula) = split(text)?;
    let read = Formula::read(formula).map_err(|e| e.within(formula))?;
    Ok((name, read))
}
