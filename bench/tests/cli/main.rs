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
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// An empty folder of a test's own, in which the program runs.
struct At(PathBuf);

impl Deref for At {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.0
    }
}

fn folder(name: &str) -> At {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder to write to");
    At(folder)
}

impl At {
    fn write(&self, name: impl AsRef<Path>, content: impl AsRef<[u8]>) {
        fs::write(self.join(name), content).expect("writable");
    }

    fn read(&self, name: impl AsRef<Path>) -> String {
        let path = self.join(name);
        fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }

    fn parsed(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// The program with the words of a line as arguments, its streams piped.
    fn program(&self, arguments: impl AsRef<str>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
        let arguments = arguments.as_ref().split_whitespace();
        command.current_dir(&self.0).args(arguments);
        command.stdin(Stdio::null());
        for variable in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
            command.env_remove(variable);
        }
        command
    }

    fn taut(&self, arguments: impl AsRef<str>) -> Output {
        let output = self.program(&arguments).output();
        output.unwrap_or_else(|e| panic!("`taut {}`: {e}", arguments.as_ref()))
    }

    /// Standard output and standard error of a run that ends with this code.
    #[track_caller]
    fn ends(&self, code: i32, arguments: impl AsRef<str>) -> [String; 2] {
        let Output {
            status,
            stdout,
            stderr,
        } = self.taut(&arguments);
        let told = [stdout, stderr].map(|bytes| text(&bytes).to_owned());
        let found = status.code();
        assert_eq!(found, Some(code), "`taut {}`: {told:?}", arguments.as_ref());
        told
    }

    /// A good run: code 0 and nothing on standard error.
    #[track_caller]
    fn good(&self, arguments: impl AsRef<str>) -> String {
        let [stdout, stderr] = self.ends(0, &arguments);
        assert_eq!(stderr, "", "`taut {}`", arguments.as_ref());
        stdout
    }

    /// A good run that writes nothing but JSON to standard output.
    #[track_caller]
    fn json(&self, arguments: impl AsRef<str>) -> Value {
        let stdout = self.good(&arguments);
        let read = serde_json::from_str(&stdout);
        read.unwrap_or_else(|e| panic!("`taut {}`: {e}\n{stdout}", arguments.as_ref()))
    }

    /// Bad input: code 2, nothing on standard output, and one line on standard error with all the words.
    #[track_caller]
    fn refused(&self, arguments: impl AsRef<str>, words: &[&str]) {
        let [stdout, stderr] = self.ends(2, &arguments);
        let place = format!("`taut {}`: {stderr}", arguments.as_ref());
        assert_eq!(stdout, "", "{place}");
        assert_eq!(stderr.lines().count(), 1, "{place}");
        assert!(stderr.ends_with('\n'), "{place}");
        for word in words {
            assert!(stderr.contains(word), "`{word}` is missing in {place}");
        }
    }

    /// Each row `arguments → word … word` of a table is bad input.
    #[track_caller]
    fn refuses(&self, table: impl AsRef<str>) {
        let rows = table.as_ref().lines().map(str::trim);
        for row in rows.filter(|row| !row.is_empty()) {
            let (arguments, words) = row.split_once(" → ").expect("two cells");
            self.refused(arguments, &words.split(" … ").collect::<Vec<_>>());
        }
    }
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

/// Asserts that all words, with `…` between them, are in a text.
#[track_caller]
fn has(text: &str, words: &str) {
    for word in words.split(" … ") {
        assert!(text.contains(word), "`{word}` is missing in {text}");
    }
}
