use crate::*;
use std::time::Duration;

/// One case, a few blocks of each program.
const CASE: &str = "track hoist-24-1e3/banded --quick";

/// A script in a folder that stands in for a program.
#[cfg(unix)]
fn script(at: &At, name: &str, does: &str) {
    use std::os::unix::fs::PermissionsExt;
    let path = at.join(name);
    fs::write(&path, format!("#!/bin/sh\n{does}\n")).expect("writes");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("a script of ours");
}

/// A base that cannot be compared with is refused with all the words.
fn refused_base(at: &At, base: &str, words: &[&str]) {
    at.refused(format!("{CASE} --against {base} --limit 20"), words);
}

#[test]
fn what_is_nothing_to_compare_with_is_named() {
    let at = folder("against_nothing");
    refused_base(&at, "no-such-thing", &["no-such-thing", "revision"]);
    refused_base(&at, "0123456789abcdef", &["0123456789abcdef", "revision"]);
    let itself = format!("{CASE} --self-test --against HEAD");
    at.refused(&itself, &["--self-test", "--against"]);
    at.refused(format!("{CASE} --against HEAD --update"), &["--update"]);
    at.refused(format!("{CASE} --self-test=0"), &["--self-test"]);
    at.refused(format!("{CASE} --against HEAD --limit 0"), &["--limit"]);
}

#[cfg(unix)]
#[test]
fn programs_that_do_not_measure_are_named() {
    let at = folder("against_strangers");
    at.write("text", "no program");
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
    at.refused(&hung, &["hangs", "did not answer", "--limit"]);
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
    let text = &format!("{hello}; read q; echo out of luck >&2; exit 7");
    script(&at, "dies", text);
    refused_base(&at, "dies", &["dies", "ended", "7", "out of luck"]);
    let text = &format!("{hello}; read q; echo '{{\"ns\":-1}}'; cat");
    script(&at, "lies", text);
    refused_base(&at, "lies", &["lies", "no time", "-1"]);
}

/// Runs git in a folder.
fn git(at: &At, arguments: &[&str]) {
    let identity = "-c user.name=a -c user.email=a@b -c init.defaultBranch=main";
    let done = Command::new("git")
        .args(identity.split(' '))
        .args(arguments)
        .current_dir(&at.0)
        .output()
        .expect("git is there");
    assert!(done.status.success(), "{}", text(&done.stderr));
}

/// A repository of which no revision can be built.
fn broken(name: &str) -> At {
    let at = folder(name);
    git(&at, &["init", "--quiet"]);
    at.write("Cargo.toml", "[package]\nname = 'broken'\nfeatures");
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
    let mut waiting = at.program(format!("{CASE} --quiet --against HEAD"));
    let mut waiting = waiting.stderr(Stdio::null()).spawn().expect("starts");
    std::thread::sleep(Duration::from_millis(500));
    assert!(waiting.try_wait().expect("a program").is_none());
    drop(other);
    assert_eq!(waiting.wait().expect("ends").code(), Some(2));
}

#[test]
fn a_revision_that_cannot_be_built_says_its_last_lines_and_leaves_no_worktree() {
    let at = broken("against_revision");
    let [_, said] = at.ends(2, format!("{CASE} --against HEAD"));
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
        at.write(name, text);
    }
    git(&at, &["add", "Cargo.toml", "Cargo.lock", "src"]);
    git(&at, &["commit", "--quiet", "--message", "A stand-in"]);
    git(&at, &["tag", "v1"]);
    // A revision is built without uncommitted changes.
    at.write("src/main.rs", "no program");
    let [table, said] = at.ends(1, format!("{CASE} --against v1"));
    // No step of this program is so short.
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
    let table = at.good(&compare);
    has(&table, "hoist-24-1e3/banded … time-min");
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
    let json = |name: &str| -> Value { at.parsed(name) };
    let name = "hoist-24-1e3/banded/time-min-against-base";
    assert_eq!(json("a.json")[0]["name"], name);
    let ratio = json("a.json")[0]["value"].as_f64().expect("a number");
    assert!((0.97..1.03).contains(&ratio), "{ratio}");
    let metric = &json("b.json")["hoist-24-1e3/banded"]["time-min-against-base"];
    let found = metric["lower_value"].as_f64();
    assert!(found <= metric["upper_value"].as_f64(), "{metric}");
    let history = || at.read("h.jsonl");
    let run: Value = serde_json::from_str(&history()).expect("a line");
    assert_eq!(run["figures"][0]["name"], name);
}

#[test]
fn a_self_test_tells_the_same_program_from_a_slower_one() {
    let at = folder("against_self_test");
    let output = at.taut(format!("{CASE} --self-test=1"));
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
    at.write("base.json", "[]");
    let run = "track gantry/banded --quick --baseline base.json --history h.jsonl";
    at.good(run);
    at.good(run);
    let history = at.read("h.jsonl");
    assert_eq!(history.lines().count(), 2);
    assert!(history.contains("gantry/banded/time-p99"));
    at.good("report h.jsonl --out h.html");
    let page = at.read("h.html");
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
    at.write("h.jsonl", format!("{history}{{\"schema\":1,"));
    at.refused(run, &["line 3", "h.jsonl", "take it out"]);
    at.refused("report h.jsonl", &["line 3", "h.jsonl"]);
    at.write("h.jsonl", "{\"schema\":9}\n");
    at.refused(run, &["line 1", "schema 9", "another file"]);
    at.refused(run.replace("h.jsonl", "-"), &["--history"]);
    at.write("h.jsonl", "");
    at.refused("report h.jsonl", &["h.jsonl", "no rows"]);
}
