use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// The root of the workspace.
pub(crate) fn root() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().expect("the workspace is above").to_owned()
}

pub(crate) fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// All Rust files below a folder of the workspace, as (path from the root, text).
pub(crate) fn rust_files(folder: &str) -> Vec<(String, String)> {
    fn walk(folder: &Path, files: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                // Build output of the fuzzer's own workspace.
                if path.ends_with("target") {
                    continue;
                }
                walk(&path, files);
            } else if path.extension().is_some_and(|e| e == "rs") {
                files.push(path);
            }
        }
    }
    let (root, mut files) = (root(), Vec::new());
    walk(&root.join(folder), &mut files);
    files.sort();
    assert!(!files.is_empty(), "no Rust files in {folder}");
    let name = |path: &Path| {
        path.strip_prefix(&root)
            .expect("below the root")
            .display()
            .to_string()
    };
    files.iter().map(|path| (name(path), read(path))).collect()
}

/// The lines that are code, with their numbers: comments (documentation is one) are cut off.
pub(crate) fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.split("//").next().unwrap_or("")))
}

/// The identifiers of a line.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter(|w| !w.is_empty())
}

/// Names of the workspace's packages that a manifest depends on, in any way: for use, tests, builds, on some target.
fn dependencies(folder: &str) -> BTreeSet<String> {
    fn collect(table: &Table, found: &mut BTreeSet<String>) {
        for (key, value) in table {
            let Value::Table(inner) = value else {
                continue;
            };
            if key.ends_with("dependencies") {
                let ours = inner.iter().map(|(name, entry)| {
                    let renamed = entry.get("package").and_then(Value::as_str);
                    renamed.unwrap_or(name).to_owned()
                });
                found.extend(ours.filter(|name| name.starts_with("taut")));
            } else if key != "features" {
                collect(inner, found);
            }
        }
    }
    let mut found = BTreeSet::new();
    collect(&manifest(folder), &mut found);
    found
}

/// Each member and the packages of the workspace that it may know, without `taut-`.
pub(crate) const MAY_KNOW: [(&str, &str); 14] = [
    ("solver/lanes", ""),
    ("solver/umfpack", ""),
    ("solver", "lanes umfpack"),
    ("model", "lanes"),
    ("integrator", "lanes model solver"),
    ("bench/measure", "integrator model solver"),
    ("bench/output", "measure solver"),
    ("bench/recording", "measure integrator model"),
    ("bench/baselines", "measure integrator model solver"),
    ("bench/studies", STUDIES),
    ("bench/view", "measure integrator model recording"),
    ("bench", BENCH),
    ("tests", TESTS),
    ("tests/skyline", "bench integrator model solver"),
];

const STUDIES: &str = "measure integrator lanes model output recording baselines solver";
const BENCH: &str = "measure integrator lanes model output recording solver studies view";
const TESTS: &str = "bench measure integrator model output recording solver studies";

/// The packages of a row of [`MAY_KNOW`].
pub(crate) fn packages(names: &str) -> BTreeSet<String> {
    let names = names.split_whitespace();
    names.map(|name| format!("taut-{name}")).collect()
}

fn manifest(folder: &str) -> Table {
    toml::from_str(&read(&root().join(folder).join("Cargo.toml"))).expect("TOML")
}

#[test]
fn manifests_depend_in_one_direction() {
    for (folder, allowed) in MAY_KNOW {
        let allowed = packages(allowed);
        assert_eq!(dependencies(folder), allowed, "{folder}/Cargo.toml");
    }
    let workspace = manifest("");
    let members = workspace["workspace"]["members"].as_array();
    let members = members.expect("a list");
    let members: BTreeSet<_> = members.iter().filter_map(Value::as_str).collect();
    let expected = MAY_KNOW.iter().map(|(folder, _)| *folder).collect();
    assert_eq!(members, expected);
}

#[test]
fn sources_name_only_the_crates_below_them() {
    for (folder, allowed) in MAY_KNOW {
        let parts = match folder {
            "tests" => vec!["tests"],
            _ => vec!["src", "tests", "benches", "examples"],
        };
        let own = format!("taut_{}", folder.rsplit('/').next().unwrap_or(folder));
        let allowed = packages(allowed);
        let allowed: Vec<_> = allowed.iter().map(|name| name.replace('-', "_")).collect();
        let folders = parts.into_iter().map(|part| match folder {
            "tests" => part.to_owned(),
            _ => format!("{folder}/{part}"),
        });
        for folder in folders.filter(|folder| root().join(folder).is_dir()) {
            let files = rust_files(&folder).into_iter();
            // A crate of its own below the tests.
            let own_crate = |file: &str| folder == "tests" && file.starts_with("tests/skyline/");
            for (file, text) in files.filter(|(file, _)| !own_crate(file)) {
                for (line, code) in code(&text) {
                    let ours = words(code).filter(|w| w.starts_with("taut_"));
                    let foreign = ours.filter(|w| *w != own && !allowed.iter().any(|a| a == w));
                    let foreign: Vec<_> = foreign.collect();
                    // This file itself lists the names of all.
                    let listed = file == "tests/structure/sources.rs";
                    let holds = foreign.is_empty() || listed;
                    assert!(holds, "{file}:{line} names {foreign:?}");
                }
            }
        }
    }
}

/// A step knows nothing of what a run does between steps: of the integrator only `run`, the crate's root and the vocabulary of
/// options and reports name it.
#[test]
fn the_step_knows_no_run() {
    let src = "integrator/src/";
    let knows = "lib.rs run.rs run/ options.rs report.rs serde_forms.rs";
    let of_runs = "Stepper Edit SavedRun Sleep Resolved ErrorEstimate ErrorPart EnergyBalance BodyId ConstraintId \
        ControlId";
    let mut looked = 0;
    for (file, text) in rust_files("integrator/src") {
        let own = file.strip_prefix(src).unwrap_or(&file);
        let is_known = knows.split(' ').any(|known| own.starts_with(known));
        if is_known || own.contains("/tests") || own == "testing.rs" {
            continue;
        }
        looked += 1;
        // Tests drive the whole.
        let text = text.split("\nmod tests").next().unwrap_or_default();
        for (line, code) in code(text) {
            let names_it =
                code.contains("run::") || words(code).any(|w| words(of_runs).any(|of| of == w));
            assert!(!names_it, "{file}:{line}");
        }
    }
    assert!(looked > 30, "{looked} files");
}

/// Conditional compilation by feature stays where backends are made; `serde` brings attributes alone, and one module.
#[test]
fn features_stand_in_two_files_of_the_solver() {
    let allowed = ["solver/src/backend.rs", "solver/src/backends.rs"];
    let mut counted = 0;
    for (file, text) in rust_files("solver/src") {
        for (line, code) in code(&text) {
            let has = code.contains("cfg")
                && words(code).any(|w| w == "feature")
                && !words(code).any(|w| w == "serde");
            let holds = !has || allowed.contains(&file.as_str());
            assert!(holds, "{file}:{line}: {code}");
            counted += usize::from(has);
        }
    }
    // One for each of six features in each of the two files: the search finds what there is.
    assert!(counted >= 12, "{counted}");
}

/// Each backend of the solver is passed on under its own name by all above it, each to the crates that it stands on, and on
/// by default nowhere where it brings a licence.
#[test]
fn features_are_passed_on_by_name() {
    let features = |folder: &str| {
        let features = &manifest(folder)["features"];
        features.as_table().expect("features").clone()
    };
    let list = |value: &Value| -> BTreeSet<String> {
        let list = value.as_array().expect("a list").iter();
        list.filter_map(Value::as_str).map(str::to_owned).collect()
    };
    let solver = features("solver");
    for (folder, through) in [
        ("integrator", vec!["taut-solver"]),
        ("bench/measure", vec!["taut-integrator", "taut-solver"]),
        ("bench/output", vec!["taut-measure"]),
        ("bench/studies", vec!["taut-output"]),
        ("bench", vec!["taut-studies"]),
        ("tests", vec!["taut-bench"]),
    ] {
        let own = features(folder);
        let backends = |name: &&String| !["default", "serde"].contains(&name.as_str());
        for name in solver.keys().filter(backends) {
            let expected = through.iter();
            let expected: BTreeSet<_> = expected.map(|crate_| format!("{crate_}/{name}")).collect();
            let found = own.get(name);
            let found = found.unwrap_or_else(|| panic!("{folder} has no feature {name}"));
            assert_eq!(list(found), expected, "{folder}, {name}");
        }
        assert!(!list(&own["default"]).contains("umfpack"), "{folder}");
    }
    assert!(!list(&solver["default"]).contains("umfpack"));
}

/// Baselines are there to measure, they are no part: an optional dependency of the experiments, off by default, Rapier in one
/// module of it.
#[test]
fn baselines_are_optional() {
    for (folder, name) in [
        ("bench/baselines", "rapier3d-f64"),
        ("bench/studies", "taut-baselines"),
    ] {
        let dependency = &manifest(folder)["dependencies"][name];
        let optional = dependency.get("optional").and_then(Value::as_bool);
        assert_eq!(optional, Some(true), "{folder}: {name}");
    }
    for folder in ["bench/baselines", "bench/studies", "bench"] {
        let features = &manifest(folder)["features"];
        let default = features["default"].as_array().expect("a list");
        for baseline in ["lapack", "rapier"] {
            assert!(features.get(baseline).is_some(), "{folder}: {baseline}");
            assert!(default.iter().all(|f| f.as_str() != Some(baseline)));
        }
    }
    for (folder, _) in MAY_KNOW {
        let folder = if folder == "tests" {
            "tests/src"
        } else {
            folder
        };
        for (file, text) in rust_files(folder) {
            let known = code(&text).any(|(_, line)| words(line).any(|w| w == "rapier3d_f64"));
            assert_eq!(known, file == "bench/baselines/src/rapier.rs", "{file}");
        }
    }
}

#[test]
fn unsafe_code_stands_in_the_ffi_the_intrinsics_and_the_allocator_only() {
    let allowed = [
        "bench/measure/src/allocations.rs",
        "bench/baselines/src/lapack.rs",
        "solver/lanes/src/x86.rs",
        "solver/lanes/src/x86/halves.rs",
        "solver/lanes/src/x86/transpose.rs",
        "solver/umfpack/src/ffi.rs",
    ];
    let mut found = BTreeSet::new();
    for folder in ["solver", "model", "integrator", "bench", "tests/src"] {
        for (file, text) in rust_files(folder) {
            let word = |w: &str| w == "unsafe" || w == "unsafe_code";
            if code(&text).any(|(_, line)| words(line).any(word)) {
                found.insert(file);
            }
        }
    }
    assert_eq!(found, BTreeSet::from(allowed.map(str::to_owned)));
    // Each block says why it is sound.
    for file in allowed {
        let text = read(&root().join(file));
        let blocks = code(&text)
            .filter(|(_, line)| line.contains("unsafe {"))
            .count();
        let reasons = text.lines().filter(|line| line.contains("SAFETY")).count();
        let holds = blocks > 0 && reasons >= blocks;
        assert!(holds, "{file}: {blocks} unsafe blocks, {reasons} reasons");
    }
}

#[test]
fn the_top_level_holds_what_was_agreed() {
    let agreed = "Cargo.toml Cargo.lock README.md LICENSE-APACHE LICENSE-MIT solver model integrator bench tests";
    let agreed: BTreeSet<String> = agreed.split(' ').map(str::to_owned).collect();
    let entries = fs::read_dir(root()).expect("the root").flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    // Dotfiles, and what builds leave.
    let found = names.filter(|name| !name.starts_with('.') && name != "target");
    let found: BTreeSet<_> = found.collect();
    assert_eq!(found, agreed);
}

/// Published packages have all fields that a registry shows, and their licences.
#[test]
fn published_packages_are_complete() {
    for (folder, _) in MAY_KNOW {
        let place = root().join(folder);
        let manifest = manifest(folder);
        let package = manifest["package"].as_table().expect("a table");
        if package.get("publish").and_then(Value::as_bool) == Some(false) {
            continue;
        }
        for key in ["description", "readme", "categories", "keywords"] {
            assert!(package.contains_key(key), "{folder}: {key}");
        }
        let licences: &[&str] = match folder {
            "solver/umfpack" => &["LICENSE-GPL-2.0"],
            _ => &["LICENSE-MIT", "LICENSE-APACHE"],
        };
        for licence in licences {
            let found = read(&place.join(licence)).len();
            assert!(found > 500, "{folder}: {licence}");
        }
    }
}

/// Every package has the workspace's version, edition, toolchain and lints, and says its licence.
#[test]
fn packages_share_what_the_workspace_sets() {
    for (folder, _) in MAY_KNOW {
        let manifest = manifest(folder);
        let package = &manifest["package"];
        let shared =
            |key: &str| package[key].get("workspace").and_then(Value::as_bool) == Some(true);
        for key in ["version", "edition", "rust-version"] {
            assert!(shared(key), "{folder}: {key}");
        }
        let licence = package["license"].as_str();
        match folder {
            "solver/umfpack" => assert_eq!(licence, Some("GPL-2.0-or-later")),
            _ => assert!(shared("license"), "{folder}"),
        }
        let lints = manifest.get("lints").and_then(|l| l.get("workspace"));
        let found = lints.and_then(Value::as_bool);
        assert_eq!(found, Some(true), "{folder}: lints");
    }
}

/// Public enums of the crates that others depend on can grow without breaking those who match on them; but for what
/// there is nothing else of.
#[test]
fn public_enums_can_grow() {
    let closed = ["Side"];
    let mut open = 0;
    for folder in "solver solver/lanes solver/umfpack model integrator".split(' ') {
        for (path, text) in rust_files(&format!("{folder}/src")) {
            let lines: Vec<&str> = text.lines().collect();
            for (n, line) in lines.iter().enumerate() {
                let Some(rest) = line.trim_start().strip_prefix("pub enum ") else {
                    continue;
                };
                let name = rest.split([' ', '<']).next().unwrap_or_default();
                // Of a macro: its uses name it.
                if name.starts_with('$') {
                    continue;
                }
                let attributes = lines[..n].iter().rev();
                let own = attributes.take_while(|l| !l.is_empty() && !l.ends_with('}'));
                // The macro of named scenes adds the attribute.
                let grows = |l: &&str| l.contains("non_exhaustive") || *l == "scenes! {";
                let can_grow = own.into_iter().any(grows);
                assert!(can_grow != closed.contains(&name), "{path}: {name}");
                open += usize::from(can_grow);
            }
        }
    }
    assert!(open > 10, "{open} enums found");
}
