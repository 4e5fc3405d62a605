//! Statements of the README and of the crates' front pages, compared with the workspace.

use super::sources::{MAY_KNOW, packages, read, root};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use taut_solver::Backend;
use toml::{Table, Value};

fn readme() -> String {
    read(&root().join("README.md"))
}

/// The rows of the Markdown table whose first heading this is, as cells.
fn table(text: &str, heading: &str) -> Vec<Vec<String>> {
    let head = format!("| {heading} |");
    let rows = text.lines().skip_while(|line| !line.starts_with(&head));
    let rows: Vec<Vec<String>> = rows
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let cells = line.trim_matches('|').split('|');
            cells.map(|cell| cell.trim().to_owned()).collect()
        })
        .collect();
    assert!(!rows.is_empty(), "no table that starts with {head}");
    rows
}

/// Words between backticks.
fn code(cell: &str) -> BTreeSet<String> {
    cell.split('`')
        .skip(1)
        .step_by(2)
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_table_of_solvers_is_that_of_the_backends() {
    let manifest: Table = toml::from_str(&read(&root().join("solver/Cargo.toml"))).expect("TOML");
    // No backend is left out of the list.
    let features = manifest["features"].as_table().expect("a table").keys();
    let features = features.map(String::as_str);
    let features = features.filter(|name| !["default", "serde"].contains(name));
    let listed = Backend::all();
    let listed = listed.iter().filter_map(Backend::feature);
    assert_eq!(features.collect::<BTreeSet<_>>(), listed.collect());
    let default = manifest["features"]["default"].as_array().expect("a list");
    let by_default = |feature: &str| default.iter().any(|f| f.as_str() == Some(feature));
    let expected: BTreeMap<_, _> = Backend::all()
        .iter()
        .map(|backend| {
            let feature = match backend.feature() {
                Some(feature) if by_default(feature) => format!("`{feature}` (default)"),
                Some(feature) => format!("`{feature}`"),
                None => "always there".to_owned(),
            };
            let name = format!("`{}`", backend.name());
            (name, (feature, backend.licence().to_owned()))
        })
        .collect();
    let found: BTreeMap<_, _> = table(&readme(), "name")
        .into_iter()
        .map(|row| {
            let [name, _, systems, feature, licence] = &row[..] else {
                panic!("a row of five cells: {row:?}")
            };
            let backend: Backend = code(name).first().expect("a name").parse().expect("known");
            let indefinite = ["quasi-definite", "symmetric", "any"];
            let any = indefinite.iter().any(|word| systems.contains(word));
            assert_eq!(any, backend.accepts_indefinite(), "{name}: {systems}");
            (name.clone(), (feature.clone(), licence.clone()))
        })
        .collect();
    assert_eq!(found, expected);
}

#[test]
fn the_map_of_the_crates_is_that_of_the_manifests() {
    let found: BTreeMap<_, _> = table(&readme(), "crate")
        .into_iter()
        .map(|row| {
            let [name, folder, imports, _] = &row[..] else {
                panic!("a row of four cells: {row:?}")
            };
            let folder = code(folder).first().expect("a folder").clone();
            let manifest = read(&root().join(&folder).join("Cargo.toml"));
            let manifest: Table = toml::from_str(&manifest).expect("TOML");
            let package = manifest["package"]["name"].as_str().expect("a name");
            assert!(code(name).contains(package), "{name}: {package}");
            (folder, code(imports))
        })
        .collect();
    let expected: BTreeMap<_, BTreeSet<String>> = MAY_KNOW
        .iter()
        .map(|(folder, known)| ((*folder).to_owned(), packages(known)))
        .collect();
    assert_eq!(found, expected);
}

/// The README's results are rows of those that the program wrote.
#[test]
fn results_are_those_of_the_results_file() {
    let results = read(&root().join("bench/RESULTS.md"));
    let known: BTreeSet<_> = results.lines().collect();
    let rows = table(&readme(), "segments");
    for row in rows {
        let line = format!("| {} |", row.join(" | "));
        assert!(known.contains(line.as_str()), "{line}: not in RESULTS.md");
    }
}

/// Every example is named in the README, runs under `cargo test`, and there is no other.
#[test]
fn examples_are_named_and_run() {
    let text = readme();
    for folder in ["integrator"] {
        let manifest = read(&root().join(folder).join("Cargo.toml"));
        let manifest: Table = toml::from_str(&manifest).expect("TOML");
        let tested: BTreeSet<String> = manifest["example"]
            .as_array()
            .expect("examples")
            .iter()
            .filter(|e| e.get("test").and_then(Value::as_bool) == Some(true))
            .filter_map(|e| e["name"].as_str().map(str::to_owned))
            .collect();
        let files = fs::read_dir(root().join(folder).join("examples")).expect("a folder");
        let files: BTreeSet<String> = files
            .flatten()
            .filter_map(|file| Some(file.path().file_stem()?.to_str()?.to_owned()))
            .collect();
        assert_eq!(files, tested, "{folder}");
        for name in files {
            let path = format!("{folder}/examples/{name}.rs");
            assert!(text.contains(&path), "the README does not name {path}");
        }
    }
}

/// The front page of each crate names all of its modules, and shows how it is used.
#[test]
fn front_pages_map_their_modules() {
    for (folder, _) in MAY_KNOW {
        let folder = match folder {
            "tests" => "tests/src".to_owned(),
            _ => format!("{folder}/src"),
        };
        let text = read(&root().join(&folder).join("lib.rs"));
        let page: String = text
            .lines()
            .filter(|line| line.starts_with("//!"))
            .collect();
        let (_, map) = page
            .split_once("# Map")
            .unwrap_or_else(|| panic!("{folder}: no map"));
        let mut modules = 0;
        for line in text.lines() {
            let line = line.strip_prefix("pub ").unwrap_or(line);
            let module = line.strip_prefix("mod ").and_then(|m| m.strip_suffix(';'));
            let Some(module) = module.filter(|m| !["tests", "testing"].contains(m)) else {
                continue;
            };
            modules += 1;
            let names = ["", "/", "mod@"].map(|extra| match extra {
                "mod@" => format!("`mod@{module}`"),
                end => format!("`{module}{end}`"),
            });
            let named = names.iter().any(|name| map.contains(name.as_str()));
            assert!(named, "{folder}/lib.rs: its map has no `{module}`");
        }
        assert!(modules > 0 || folder == "solver/umfpack/src", "{folder}");
        let example = page.contains("//! use taut_");
        assert!(example, "{folder}: no example");
    }
}

/// Both commands of the README are there once, where the scripts look for them.
#[test]
fn the_two_commands_stand_alone() {
    let text = readme();
    for (command, count) in [("cargo run", 1), ("cargo test", 1)] {
        let lines = text.lines().filter(|line| line.starts_with(command));
        assert_eq!(lines.count(), count, "{command}");
    }
}
