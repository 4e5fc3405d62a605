use crate::{folder, good, has, program, refused, taut, text};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// One case, a few blocks of each program.
const CASE: &str = "track hoist-24-1e3/banded --quick";

/// A script in a folder that stands in for a program.
#[cfg(unix)]
fn script(at: &Path, name: &str, does: &str) {
    use std::os::unix::fs::PermissionsExt;
    let path = at.join(name);
    fs::write(&path, format!("#!/bin/sh\n{does}\n")).expect("writes");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("a script of ours");
}

/// A base that cannot be compared with is refused with all the words.
fn refused_base(at: &PathBuf, base: &str, words: &[&str]) {
    refused(at, &format!("{CASE} --against {base} --limit 20"), words);
}

#[test]
fn what_is_nothing_to_compare_with_is_named() {
    let at = folder("against_nothing");
    refused_base(&at, "no-such-thing", &["no-such-thing", "revision"]);
    refused_base(&at, "0123456789abcdef", &["0123456789abcdef", "revision"]);
    let itself = format!("{CASE} --self-test --against HEAD");
    refused(&at, &itself, &["--self-test", "--against"]);
    refused(
        &at,
        &format!("{CASE} --against HEAD --update"),
        &["--update"],
    );
    refused(&at, &format!("{CASE} --self-test=0"), &["--self-test"]);
    refused(
        &at,
        &format!("{CASE} --against HEAD --limit 0"),
        &["--limit"],
    );
}

#[cfg(unix)]
#[test]
fn programs_that_do_not_measure_are_named() {
    let at = folder("against_strangers");
    fs::write(at.join("text"), "no program").expect("writes");
    refused_base(&at, "text", &["text", "cannot start", "--against"]);
    // As an older `taut` does.
    script(
        &at,
        "old",
        "echo \"taut: unexpected argument '--measure' found\" >&2; exit 2",
    );
    refused_base(&at, "old", &["old", "older than", "'--measure' found"]);
    script(&at, "chatty", "echo hello; cat");
    refused_base(&at, "chatty", &["chatty", "it said: hello"]);
    script(&at, "endless", "while :; do echo $0; done");
    refused_base(&at, "endless", &["endless", "no `taut`"]);
    script(&at, "new", "echo '{\"schema\":3}'; cat");
    refused_base(&at, "new", &["new", "schema 3"]);
    script(
        &at,
        "other",
        "echo '{\"schema\":2,\"build\":\"tuned\",\"toolchain\":\"t\",\"cases\":[]}'; cat",
    );
    refused_base(&at, "other", &["other", "tuned build", "build both alike"]);
    // Its own child keeps its streams open.
    script(&at, "hangs", "sleep 30; true");
    let hung = format!("{CASE} --against hangs --limit 0.3");
    refused(&at, &hung, &["hangs", "did not answer", "--limit"]);
}

#[cfg(unix)]
#[test]
fn answers_that_are_no_times_are_named() {
    let at = folder("against_answers");
    let build = if cfg!(debug_assertions) {
        "debug"
    } else {
        "release"
    };
    let hello = format!(r#"echo '{{"schema":2,"build":"{build}","toolchain":"t","cases":[]}}'"#);
    script(
        &at,
        "dies",
        &format!("{hello}; read q; echo out of luck >&2; exit 7"),
    );
    refused_base(&at, "dies", &["dies", "ended", "7", "out of luck"]);
    script(
        &at,
        "lies",
        &format!("{hello}; read q; echo '{{\"ns\":-1}}'; cat"),
    );
    refused_base(&at, "lies", &["lies", "no time", "-1"]);
}

/// Runs git in a folder.
fn git(at: &Path, arguments: &[&str]) {
    let identity = "-c user.name=a -c user.email=a@b -c init.defaultBranch=main";
    let done = Command::new("git")
        .args(identity.split(' '))
        .args(arguments)
        .current_dir(at)
        .output()
        .expect("git is there");
    assert!(done.status.success(), "{}", text(&done.stderr));
}

/// A repository of which no revision can be built.
fn broken(name: &str) -> PathBuf {
    let at = folder(name);
    git(&at, &["init", "--quiet"]);
    fs::write(
        at.join("Cargo.toml"),
        "[package]\nname = 'broken'\nfeatures",
    )
    .expect("writes");
    git(&at, &["add", "Cargo.toml"]);
    git(&at, &["commit", "--quiet", "--message", "Broken"]);
    at
}

#[test]
fn one_build_waits_for_another() {
    let at = broken("against_turn");
    let against = at.join("target/taut/against");
    fs::create_dir_all(&against).expect("a folder");
    let other = fs::File::create(against.join("lock")).expect("a file");
    other.lock().expect("locks");
    let mut waiting = program(&at, &format!("{CASE} --quiet --against HEAD"))
        .stderr(Stdio::null())
        .spawn()
        .expect("starts");
    std::thread::sleep(Duration::from_millis(500));
    assert!(waiting.try_wait().expect("a program").is_none());
    drop(other);
    assert_eq!(waiting.wait().expect("ends").code(), Some(2));
}

#[test]
fn a_revision_that_cannot_be_built_says_its_last_lines_and_leaves_no_worktree() {
    let at = broken("against_revision");
    let output = taut(&at, &format!("{CASE} --against HEAD"));
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    for word in ["`HEAD` cannot be built", "--locked", "Cargo.toml"] {
        assert!(said.contains(word), "{said}");
    }
    let left: Vec<_> = fs::read_dir(at.join("target/taut/against"))
        .expect("a folder")
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|name| !["build.log", "lock", "target"].contains(&name.as_str()))
        .collect();
    assert!(left.is_empty(), "{left:?}");
    let trees = fs::read_dir(at.join(".git/worktrees")).map_or(0, Iterator::count);
    assert_eq!(trees, 0);
}

/// A package in place of this one, whose program says that each step takes a tenth of a microsecond.
const PACKAGE: &str = "[workspace]
[package]
name = 'taut'
version = '0.1.0'
edition = '2024'
[features]
umfpack = []
lapack = []
rapier = []
banded = []
gauss-seidel = []
cg = []
minres = []
faer = []
nalgebra-sparse = []
";

const MAIN: &str = r#"fn main() {
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    println!("{{\"schema\":2,\"build\":\"{build}\",\"toolchain\":\"another\",\"cases\":[]}}");
    for _ in std::io::stdin().lines() {
        println!("{{\"ns\":100}}");
    }
}
"#;

#[test]
fn a_revision_is_built_and_compared_with() {
    if !cfg!(feature = "banded") {
        return;
    }
    let at = folder("against_built");
    git(&at, &["init", "--quiet"]);
    let lock = "version = 4\n\n[[package]]\nname = \"taut\"\nversion = \"0.1.0\"\n";
    fs::create_dir(at.join("src")).expect("a folder");
    for (name, text) in [
        ("Cargo.toml", PACKAGE),
        ("Cargo.lock", lock),
        ("src/main.rs", MAIN),
    ] {
        fs::write(at.join(name), text).expect("writes");
    }
    git(&at, &["add", "Cargo.toml", "Cargo.lock", "src"]);
    git(&at, &["commit", "--quiet", "--message", "A stand-in"]);
    git(&at, &["tag", "v1"]);
    // A revision is built without uncommitted changes.
    fs::write(at.join("src/main.rs"), "no program").expect("writes");
    let output = taut(&at, &format!("{CASE} --against v1"));
    let (table, said) = (text(&output.stdout), text(&output.stderr));
    // No step of this program is so short.
    assert_eq!(output.status.code(), Some(1), "{table}{said}");
    for word in [
        "FAIL",
        "100.00",
        "the base is of another",
        "taut/against/taut-",
    ] {
        assert!(table.contains(word), "{word}: {table}{said}");
    }
}

#[test]
fn a_program_in_turns_with_itself_makes_rows_files_and_a_line_of_history() {
    if !cfg!(feature = "banded") {
        return;
    }
    let at = folder("against_itself");
    let program = env!("CARGO_BIN_EXE_taut");
    let compare =
        format!("{CASE} --against {program} --json a.json --bencher b.json --history h.jsonl");
    let table = good(&at, &compare);
    has(&table, "hoist-24-1e3/banded … time-min");
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
    let json = |name: &str| -> Value {
        serde_json::from_str(&fs::read_to_string(at.join(name)).expect("a file")).expect("JSON")
    };
    let name = "hoist-24-1e3/banded/time-min-against-base";
    assert_eq!(json("a.json")[0]["name"], name);
    let ratio = json("a.json")[0]["value"].as_f64().expect("a number");
    assert!((0.97..1.03).contains(&ratio), "{ratio}");
    let metric = &json("b.json")["hoist-24-1e3/banded"]["time-min-against-base"];
    assert!(
        metric["lower_value"].as_f64() <= metric["upper_value"].as_f64(),
        "{metric}"
    );
    let history = || fs::read_to_string(at.join("h.jsonl")).expect("a history");
    let run: Value = serde_json::from_str(&history()).expect("a line");
    assert_eq!(run["figures"][0]["name"], name);
}

#[test]
fn a_self_test_tells_the_same_program_from_a_slower_one() {
    let at = folder("against_self_test");
    let output = taut(&at, &format!("{CASE} --self-test=1"));
    let (said, complaint) = (text(&output.stdout), text(&output.stderr));
    if !cfg!(feature = "banded") {
        assert_eq!(output.status.code(), Some(3), "{said}{complaint}");
        assert!(!said.contains("inf"), "{said}");
        return;
    }
    assert_eq!(output.status.code(), Some(0), "{said}{complaint}");
    for line in ["the same program: 1 of 1 pass", "10 % slower: 1 of 1 fail"] {
        assert!(said.contains(line), "{said}");
    }
}

#[test]
fn a_history_grows_by_a_line_a_run_and_has_a_page() {
    if !cfg!(feature = "banded") {
        return;
    }
    let at = folder("track_history");
    fs::write(at.join("base.json"), "[]").expect("writes");
    let run = "track gantry/banded --quick --baseline base.json --history h.jsonl";
    good(&at, run);
    good(&at, run);
    let history = fs::read_to_string(at.join("h.jsonl")).expect("a history");
    assert_eq!(history.lines().count(), 2);
    assert!(history.contains("gantry/banded/time-p99"));
    good(&at, "report h.jsonl --out h.html");
    let page = fs::read_to_string(at.join("h.html")).expect("a page");
    let commit = history.split('"').nth(5).expect("a commit");
    for word in [
        "figures of a step, run by run",
        "time-p99",
        "gantry/banded",
        commit,
    ] {
        assert!(page.contains(word), "{word}");
    }
    // Before anything is measured.
    fs::write(at.join("h.jsonl"), format!("{history}{{\"schema\":1,")).expect("writes");
    refused(&at, run, &["line 3", "h.jsonl", "take it out"]);
    refused(&at, "report h.jsonl", &["line 3", "h.jsonl"]);
    fs::write(at.join("h.jsonl"), "{\"schema\":9}\n").expect("writes");
    refused(&at, run, &["line 1", "schema 9", "another file"]);
    refused(&at, &run.replace("h.jsonl", "-"), &["--history"]);
    fs::write(at.join("h.jsonl"), "").expect("writes");
    refused(&at, "report h.jsonl", &["h.jsonl", "no rows"]);
}
