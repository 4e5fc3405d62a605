//! Where in the text of a case a fault stands, found once there is one.

use super::text::Names;
use super::{CaseError, Run};
use taut_model::SceneError;
use taut_model::named::NAMES;
use taut_output::check::ExperimentError;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// Keys, and numbers in lists, that lead to something.
type Path = Vec<String>;

/// Line from 1 of a byte.
pub(super) fn line_of(text: &str, at: usize) -> usize {
    1 + text.get(..at).unwrap_or(text).matches('\n').count()
}

/// All that a text holds, each after what it is in: its path, and the bytes at which its key and its value start.
pub(super) fn all(text: &str) -> Vec<(Path, [usize; 2])> {
    fn add(value: &DeValue<'_>, path: &Path, found: &mut Vec<(Path, [usize; 2])>) {
        let mut entry = |key: String, starts: [usize; 2], inner: &DeValue<'_>| {
            let path = [&path[..], &[key]].concat();
            found.push((path.clone(), starts));
            add(inner, &path, found);
        };
        match value {
            DeValue::Table(table) => table.iter().for_each(|(key, value)| {
                let starts = [key.span().start, value.span().start];
                entry(key.get_ref().to_string(), starts, value.get_ref());
            }),
            DeValue::Array(list) => list.iter().enumerate().for_each(|(k, value)| {
                entry(k.to_string(), [value.span().start; 2], value.get_ref());
            }),
            _ => {}
        }
    }
    let mut found = Vec::new();
    if let Ok(table) = DeTable::parse(text) {
        add(
            &DeValue::Table(table.into_inner()),
            &Path::new(),
            &mut found,
        );
    }
    found
}

/// The path in a scene as it is written, of one in the scene whose repeated entries stand one by one.
fn unfilled(scene: &Table, path: Path, names: &Names) -> Path {
    let mut here = Some(Value::Table(scene.clone()));
    let own = path.into_iter().map(|part| {
        let Some(Value::Array(list)) = &here else {
            here = here.as_ref().and_then(|here| here.get(&part).cloned());
            return part;
        };
        let begin = |end: usize| names.filled(&Value::Array(list[..=end].to_vec()));
        let holds = |end: &usize| {
            let begin = begin(*end).ok();
            begin.is_some_and(|begin| part.parse().is_ok_and(|k: usize| begin.get(k).is_some()))
        };
        let own = (0..list.len()).find(holds).unwrap_or_default();
        here = list.get(own).cloned();
        own.to_string()
    });
    own.collect()
}

/// A fault of a run's scene, reported where the case has it: the scene that is built has other lines than its file.
pub(super) fn in_scene(fault: &SceneError, filled: &Table, run: &Run, names: &Names) -> CaseError {
    let (place, message) = match fault {
        SceneError::Toml { place, message } => (*place, message.clone()),
        SceneError::InText { line, column, .. } => {
            let place = format!("line {line}, column {column}: ");
            (
                Some((*line, *column)),
                fault.to_string().replacen(&place, "", 1),
            )
        }
        fault => (None, fault.to_string()),
    };
    let path = match (place, filled.iter().find(|(_, value)| value.is_table())) {
        (Some((line, column)), _) => {
            let text = filled.to_string();
            let before: usize = text
                .split_inclusive('\n')
                .take(line - 1)
                .map(str::len)
                .sum();
            let within = text[before..].chars().take(column - 1);
            let at = before + within.map(char::len_utf8).sum::<usize>();
            let found = all(&text)
                .into_iter()
                .rfind(|(_, starts)| starts.contains(&at));
            found.map(|(path, _)| path).unwrap_or_default()
        }
        // A named scene tells no place: its faults begin with the key.
        (None, Some((name, _))) => {
            let key = message.split([' ', ':']).next().unwrap_or_default();
            vec![name.clone(), key.to_owned()]
        }
        (None, None) => Path::new(),
    };
    let path = unfilled(&run.scene, path, names);
    let error = CaseError::read(&message, NAMES.into_iter().chain(["repeat"]));
    path.iter()
        .rfold(error, |e, key| e.inside(key))
        .inside(&"scene")
}

/// What went wrong in a case, or in its run of that number, with the line of its text where that is known.
pub(super) fn located(error: ExperimentError, text: &str, run: Option<usize>) -> CaseError {
    let error = error
        .downcast()
        .map_or_else(|e| CaseError::message(&e), |e| *e);
    let all = all(text);
    let at = |path: &[String]| {
        all.iter()
            .find(|(known, _)| known == path)
            .map(|(_, starts)| starts[0])
    };
    let of_run = |run: usize| vec!["run".to_owned(), run.to_string()];
    // The innermost part that is there, in the run or else in the file.
    let start = |path: &[String]| {
        let run = of_run(run?);
        let own = [&run[..], &path[..path.len().min(1)]].concat();
        let whole = if at(&own).is_some() {
            [&run, path].concat()
        } else {
            path.to_vec()
        };
        (1..=whole.len()).rev().find_map(|n| at(&whole[..n]))
    };
    let found = match &error {
        CaseError::InKey { path, .. } => start(path),
        CaseError::Count { key, .. } => start(&[(*key).to_owned()]),
        CaseError::Missing { .. } => start(&[]),
        CaseError::Within { text: part, .. } | CaseError::Unknown { name: part, .. } => {
            let begin = run.and_then(|run| at(&of_run(run))).unwrap_or(0);
            let end = run
                .and_then(|run| at(&of_run(run + 1)))
                .unwrap_or(text.len());
            only(&text[begin..end], part).map(|at| begin + at)
        }
        _ => None,
    };
    match (found, error) {
        (Some(start), CaseError::InKey { error, .. }) => error.at(line_of(text, start)),
        (Some(start), error) => error.at(line_of(text, start)),
        (None, error) => error,
    }
}

/// Byte of a formula or a name that stands in a single place.
fn only(text: &str, part: &str) -> Option<usize> {
    let in_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = text.match_indices(part).map(|(at, _)| at).filter(|at| {
        let (before, after) = (&text[..*at], &text[at + part.len()..]);
        !(before.ends_with(in_word) || after.starts_with(in_word))
    });
    found.next().filter(|_| found.next().is_none())
}
