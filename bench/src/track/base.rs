//! Program to compare this one with: an existing file, or a revision of the repository. A revision
//! is built with this program's profile, features and compiler flags, whatever `RUSTFLAGS` says
//! now. The rest of the environment is the same for both, such as `RUSTUP_TOOLCHAIN` and
//! `CARGO_PROFILE_RELEASE_LTO`. One build runs at a time; others wait for it.

use super::child;
use crate::machine;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Where revisions are checked out and built.
const FOLDER: &str = "target/taut/against";

/// Longest time of a build.
const LIMIT: Duration = Duration::from_secs(3600);

/// Last lines of a failed build that are shown.
const LAST: usize = 12;

/// A program that is compared.
#[derive(Debug, Clone)]
pub struct Program {
    pub path: PathBuf,
    /// Name in tables.
    pub name: String,
    /// The part of its time that each step is made longer by; 0 but for a self-test.
    pub slowed: f64,
}

impl Program {
    /// This program, whose steps are made longer by a part of their time.
    pub fn this(slowed: f64) -> io::Result<Self> {
        Ok(Self {
            path: std::env::current_exe()?,
            name: machine::commit(),
            slowed,
        })
    }
}

/// The program of that path, or else of that revision. `progress` is told what takes long.
pub fn base(name: &str, progress: impl Fn(&str)) -> Result<Program, String> {
    let program = |path, name: &str| Program {
        path,
        name: name.to_owned(),
        slowed: 0.0,
    };
    let given = Path::new(name);
    if given.is_file() {
        // With a folder, for else it would be looked for among the installed programs.
        return Ok(program(given.canonicalize().map_err(at(given))?, name));
    }
    let commit = format!("{name}^{{commit}}");
    let found = git(&["rev-parse", "--verify", "--end-of-options", &commit])?;
    let commit = found.map_err(|said| {
        format!(
            "`{name}` is neither a program nor a revision of the repository here: give the path of a program `taut`, \
             or a commit, branch or tag ({said})"
        )
    })?;
    let short: String = commit.chars().take(12).collect();
    let folder = std::path::absolute(FOLDER).map_err(at(Path::new(FOLDER)))?;
    let _turn = turn(&folder, &progress)?;
    let sources = Worktree::new(name, &commit, &folder.join("sources"))?;
    progress(&format!("building {short}"));
    let built = build(name, &sources.path, &folder)?;
    // The next build takes the place of this one. What runs already stays what it is: another file gets the name.
    let path = folder.join(format!("taut-{short}-{:08x}", options()));
    let copy = folder.join("copy");
    fs::copy(&built, &copy).map_err(at(&built))?;
    fs::rename(&copy, &path).map_err(at(&path))?;
    Ok(program(path, &short))
}

/// Waits until no other process builds below `folder`; none does until what this returns is gone.
fn turn(folder: &Path, progress: &impl Fn(&str)) -> Result<File, String> {
    fs::create_dir_all(folder).map_err(at(folder))?;
    let path = folder.join("lock");
    let file = File::create(&path).map_err(at(&path))?;
    if file.try_lock().is_err() {
        progress("waiting for another build");
        file.lock().map_err(at(&path))?;
    }
    Ok(file)
}

/// A number for what a build depends on besides its sources.
fn options() -> u32 {
    let mut all: Vec<&str> = machine::build_options().collect();
    all.extend([machine::ENCODED_RUSTFLAGS, machine::RUSTC]);
    crc32fast::hash(all.join(" ").as_bytes())
}

fn unrun(command: &str) -> impl Fn(io::Error) -> String {
    move |e| format!("cannot run `{command}` to build a revision: {e}")
}

/// A revision that cannot be checked out or built, with the last lines of what git or the build said.
fn unbuilt(name: &str, last: &[String]) -> String {
    format!(
        "`{name}` cannot be built as this program was ({}): it ended with\n  {}",
        machine::build_options().collect::<Vec<_>>().join(" "),
        last.join("\n  ")
    )
}

fn at(path: &Path) -> impl Fn(io::Error) -> String {
    let path = path.to_owned();
    move |source| format!("`{}`: {source}", path.display())
}

/// Output of git, or the last line of its complaint.
fn git(arguments: &[&str]) -> Result<Result<String, String>, String> {
    let done = Command::new("git")
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .map_err(unrun("git"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    Ok(if done.status.success() {
        Ok(text(&done.stdout))
    } else {
        let said = text(&done.stderr);
        Err(said.lines().last().unwrap_or("git said nothing").to_owned())
    })
}

/// The sources of a commit in a folder of their own; gone with this.
struct Worktree {
    path: PathBuf,
}

impl Worktree {
    fn new(name: &str, commit: &str, path: &Path) -> Result<Self, String> {
        // Gone also where git made only a part of it.
        let worktree = Self {
            path: path.to_owned(),
        };
        let place = path.to_string_lossy();
        // A killed run may have left its folder.
        let _ = fs::remove_dir_all(path);
        let added = git(&["worktree", "add", "--detach", "--force", &place, commit])?;
        added.map_err(|said| unbuilt(name, &[said]))?;
        Ok(worktree)
    }
}

impl Drop for Worktree {
    fn drop(&mut self) {
        // Nothing depends on its end: `git worktree prune` forgets what is left.
        let place = self.path.to_string_lossy();
        let _ = git(&["worktree", "remove", "--force", &place]);
        let _ = fs::remove_dir_all(&self.path);
    }
}

/// Builds the sources, with all that is built below `folder`; the program.
fn build(name: &str, sources: &Path, folder: &Path) -> Result<PathBuf, String> {
    let (target, log) = (folder.join("target"), folder.join("build.log"));
    let said = File::create(&log).map_err(at(&log))?;
    let failed = unrun("cargo build");
    let mut command = Command::new("cargo");
    command
        .arg("build")
        .args(machine::build_options())
        .current_dir(sources)
        .env("CARGO_TARGET_DIR", &target)
        .env("CARGO_TERM_COLOR", "never")
        // Before all other settings of flags.
        .env("CARGO_ENCODED_RUSTFLAGS", machine::ENCODED_RUSTFLAGS)
        .env_remove("CARGO_BUILD_TARGET")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(said);
    let mut cargo = command.spawn().map_err(&failed)?;
    let status = child::wait(&mut cargo, LIMIT).map_err(&failed)?;
    let built = target.join(machine::PROFILE).join("taut");
    let built = built.with_extension(std::env::consts::EXE_EXTENSION);
    if status.is_some_and(|s| s.success()) && built.is_file() {
        return Ok(built);
    }
    let text = fs::read(&log).map_err(at(&log))?;
    let text = String::from_utf8_lossy(&text);
    let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
    let mut last: Vec<String> = lines[lines.len().saturating_sub(LAST)..]
        .iter()
        .map(|line| (*line).to_owned())
        .collect();
    match status {
        None => last.push(format!("no end after {} s", LIMIT.as_secs())),
        Some(s) if s.success() => last.push(format!("it made no `{}`", built.display())),
        Some(_) => {}
    }
    Err(unbuilt(name, &last))
}
