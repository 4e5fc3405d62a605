//! Shared by the tests of texts: reading, writing back, and tables of faults.

use super::{SceneSource, SceneText};
use crate::scene::Scene;

/// The scene of a sound text.
pub(super) fn built(text: &str) -> Scene {
    let scene = SceneSource::parse(text, &[]).and_then(|source| source.build());
    scene.unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The message about a faulty text, which takes one line.
pub(super) fn fault(text: &str, overrides: &[(&str, &str)]) -> String {
    let built = SceneSource::parse(text, overrides).and_then(|source| source.build());
    let message = built.expect_err(text).to_string();
    assert!(!message.contains('\n'), "{message}");
    message
}

/// Asserts that a message starts with the first part of `wanted`, and that the other parts, each after `…`, are in it.
pub(super) fn says(message: &str, wanted: &str) {
    let mut parts = wanted.split('…').map(str::trim);
    let start = parts.next().unwrap_or_default();
    let good = message.starts_with(start) && parts.all(|words| message.contains(words));
    assert!(good, "says  {message}\nwants {wanted}");
}

/// Asserts that `sound` with one replacement is faulty, for each row `old → new → message` of a table, and that the
/// message [`says`] what is wanted. `⏎` stands for the end of a line; rows that begin with `#` are headings.
pub(super) fn check_faults(sound: &str, table: &str) {
    let rows = table.lines().map(str::trim_start);
    for row in rows.filter(|row| !row.is_empty() && !row.starts_with('#')) {
        let cells = row.split(" → ");
        let cells: Vec<_> = cells.map(|cell| cell.replace('⏎', "\n")).collect();
        let [old, new, wanted] = &cells[..] else {
            panic!("three cells: {row}");
        };
        assert!(sound.contains(old.as_str()), "{row}");
        says(&fault(&sound.replacen(old.as_str(), new, 1), &[]), wanted);
    }
}

/// Asserts that a source reads back from its texts, with comments and without.
pub(crate) fn reads_back(source: &SceneSource) {
    for toml in [source.to_toml(), source.to_commented_toml()] {
        let toml = toml.expect("writes");
        let again = SceneSource::parse(&toml, &[]);
        assert_eq!(again.as_ref(), Ok(source), "{toml}");
    }
}

/// Asserts that the scene's own text reads back to the scene, to the bit: Rust's debug text tells −0 from 0.
pub(crate) fn round_trip(scene: &Scene) {
    let text = SceneText::from_scene(scene).expect("a text");
    let source = SceneSource::Explicit(Box::new(text));
    for toml in [source.to_toml(), source.to_commented_toml()] {
        let toml = toml.expect("writes");
        let found = format!("{:?}", built(&toml));
        assert_eq!(found, format!("{scene:?}"), "\n{toml}");
    }
}
