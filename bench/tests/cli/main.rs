//! The command line as its users meet it: exit codes, what goes to which stream, files for programs.

/// `taut track --against`, `--history`: other programs, revisions, many runs.
mod against;
/// Streams, line widths, colours, `--quiet`.
mod appearance;
/// The pages of reports in a browser.
mod browser;
/// `--shard`, `--resume`, `taut merge`: the cases of studies as files.
mod cases;
/// `taut paper`, `taut hard`, `taut static`: records of checks.
mod checks;
/// `taut run --columns`.
mod columns;
/// The gantry, driven by tables of inputs.
mod driven;
/// `taut run --error`, `--estimate`.
mod error;
/// `taut ledger`.
mod ledger;
/// `taut dump`, `taut solve`, `taut matrices`, `taut study matrix`: linear systems as files.
mod matrix;
/// Where results go: tried first, written whole, each to a place of its own; signals, streams that are closed or full.
mod outputs;
/// The page of `taut replay --html` in a browser.
mod player;
/// Bad input: one line that says what to do, and code 2.
mod refusals;
/// `taut run --record`, `taut replay`.
mod replay;
/// `taut report`, and the page that every benchmark writes.
mod report;
/// `taut run`, `taut scene`, and what all commands share.
mod runs;
/// `taut run --save` and `--resume`.
mod saved;
/// `taut bench` and `taut study`.
mod sweeps;
/// `taut track`: the comparison with a baseline.
mod track;

use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// An empty folder of a test's own, in which the program runs.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder to write to");
    folder
}

/// The program with the words of a line as arguments, its streams piped.
fn program(folder: &PathBuf, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
    command
        .current_dir(folder)
        .args(arguments.split_whitespace())
        .stdin(Stdio::null());
    for variable in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
        command.env_remove(variable);
    }
    command
}

fn taut(folder: &PathBuf, arguments: &str) -> Output {
    let output = program(folder, arguments).output();
    output.unwrap_or_else(|e| panic!("`taut {arguments}`: {e}"))
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

/// Bad input: code 2, nothing on standard output, and one line on standard error with all the words.
fn refused(folder: &PathBuf, arguments: &str, words: &[&str]) {
    let output = taut(folder, arguments);
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    let place = format!("`taut {arguments}`: {stderr}");
    assert_eq!(output.status.code(), Some(2), "{place}");
    assert_eq!(stdout, "", "{place}");
    assert_eq!(stderr.lines().count(), 1, "{place}");
    assert!(stderr.ends_with('\n'), "{place}");
    for word in words {
        assert!(stderr.contains(word), "`{word}` is missing in {place}");
    }
}

/// Each row `arguments → word … word` of a table is bad input.
fn refuses(folder: &PathBuf, table: &str) {
    for row in table.lines().map(str::trim).filter(|row| !row.is_empty()) {
        let (arguments, words) = row.split_once(" → ").expect("two cells");
        refused(folder, arguments, &words.split(" … ").collect::<Vec<_>>());
    }
}

/// Asserts that all words, with `…` between them, are in a text.
fn has(text: &str, words: &str) {
    assert!(
        words.split(" … ").all(|word| text.contains(word)),
        "{words}: {text}"
    );
}

/// A good run: code 0 and nothing on standard error.
fn good(folder: &PathBuf, arguments: &str) -> String {
    let output = taut(folder, arguments);
    assert_eq!(text(&output.stderr), "", "`taut {arguments}`");
    assert_eq!(output.status.code(), Some(0), "`taut {arguments}`");
    text(&output.stdout).to_owned()
}

/// A good run that writes nothing but JSON to standard output.
fn json(folder: &PathBuf, arguments: &str) -> Value {
    let stdout = good(folder, arguments);
    serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("`taut {arguments}`: {e}\n{stdout}"))
}
