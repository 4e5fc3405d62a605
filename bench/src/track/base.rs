//! What this program is compared with: a program that is there, or a revision of the repository, which is built as this
//! program was.

use super::child;
use crate::machine;
use std::fmt;
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
    /// Its file.
    pub path: PathBuf,
    /// What it is called in tables.
    pub name: String,
    /// The part of its time that each step is made longer by; 0 but for a self-test.
    pub slowed: f64,
}

impl Program {
    /// This program, whose steps are made longer by a part of their time.
    ///
    /// # Errors
    /// The system does not tell where this program is.
    pub fn this(slowed: f64) -> io::Result<Self> {
        Ok(Self {
            path: std::env::current_exe()?,
            name: machine::commit(),
            slowed,
        })
    }
}

/// Why there is no program to compare with.
#[derive(Debug)]
pub enum BaseError {
    /// A name of nothing.
    Unknown {
        /// As it was given.
        name: String,
        /// What git said.
        said: String,
    },
    /// A command that cannot be started or does not end.
    Command {
        /// The command.
        command: &'static str,
        /// Why.
        source: io::Error,
    },
    /// A revision that cannot be checked out.
    Worktree {
        /// The revision.
        name: String,
        /// What git said.
        said: String,
    },
    /// A revision that cannot be built.
    Build {
        /// The revision.
        name: String,
        /// The last lines of what the build said.
        last: Vec<String>,
    },
    /// A folder or a file on the way.
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl fmt::Display for BaseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { name, said } => write!(
                f,
                "`{name}` is neither a program nor a revision of the repository here: give the path of a program `taut`, \
                 or a commit, branch or tag ({said})"
            ),
            Self::Command { command, source } => {
                write!(f, "cannot run `{command}` to build a revision: {source}")
            }
            Self::Worktree { name, said } => write!(f, "`{name}` cannot be checked out: {said}"),
            Self::Build { name, last } => write!(
                f,
                "`{name}` cannot be built as this program was ({}): the build ended with\n  {}",
                machine::build_options().collect::<Vec<_>>().join(" "),
                last.join("\n  ")
            ),
            Self::File { path, source } => write!(f, "`{}`: {source}", path.display()),
        }
    }
}

impl std::error::Error for BaseError {}

/// The program of that path, or else of that revision. `progress` is told what takes long.
///
/// # Errors
/// [`BaseError`].
pub fn base(name: &str, progress: impl Fn(&str)) -> Result<Program, BaseError> {
    if Path::new(name).is_file() {
        // With a folder, for else it would be looked for among the installed programs.
        let path = Path::new(name)
            .canonicalize()
            .map_err(at(Path::new(name)))?;
        return Ok(Program {
            path,
            name: name.to_owned(),
            slowed: 0.0,
        });
    }
    let commit = format!("{name}^{{commit}}");
    let found = git(&["rev-parse", "--verify", "--end-of-options", &commit])?;
    let commit = found.map_err(|said| BaseError::Unknown {
        name: name.to_owned(),
        said,
    })?;
    let short: String = commit.chars().take(12).collect();
    let folder = std::path::absolute(FOLDER).map_err(at(Path::new(FOLDER)))?;
    let sources = Worktree::new(
        name,
        &commit,
        &folder.join(format!("{short}-{}", std::process::id())),
    )?;
    progress(&format!("building {short}"));
    let built = build(name, &sources.path, &folder)?;
    // The next build takes the place of this one.
    let path = folder.join(format!("taut-{short}"));
    let _ = fs::remove_file(&path);
    fs::copy(&built, &path).map_err(at(&built))?;
    Ok(Program {
        path,
        name: short,
        slowed: 0.0,
    })
}

/// An error with its file.
fn at(path: &Path) -> impl Fn(io::Error) -> BaseError {
    let path = path.to_owned();
    move |source| BaseError::File {
        path: path.clone(),
        source,
    }
}

/// What git writes, or what it says is wrong.
fn git(arguments: &[&str]) -> Result<Result<String, String>, BaseError> {
    let done = Command::new("git")
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .map_err(|source| BaseError::Command {
            command: "git",
            source,
        })?;
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
    fn new(name: &str, commit: &str, path: &Path) -> Result<Self, BaseError> {
        // Gone also where git made only a part of it.
        let worktree = Self {
            path: path.to_owned(),
        };
        let place = path.to_string_lossy();
        let added = git(&["worktree", "add", "--detach", "--force", &place, commit])?;
        added.map_err(|said| BaseError::Worktree {
            name: name.to_owned(),
            said,
        })?;
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
fn build(name: &str, sources: &Path, folder: &Path) -> Result<PathBuf, BaseError> {
    let (target, log) = (folder.join("target"), folder.join("build.log"));
    let said = File::create(&log).map_err(at(&log))?;
    let failed = |source| BaseError::Command {
        command: "cargo build",
        source,
    };
    let mut command = Command::new("cargo");
    command
        .arg("build")
        .args(machine::build_options())
        .current_dir(sources)
        .env("CARGO_TARGET_DIR", &target)
        .env("CARGO_TERM_COLOR", "never")
        .env_remove("CARGO_BUILD_TARGET")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(said);
    if let Some(flags) = machine::rustflags() {
        command.env("RUSTFLAGS", flags);
    }
    let mut cargo = command.spawn().map_err(failed)?;
    let status = child::wait(&mut cargo, LIMIT).map_err(failed)?;
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
    Err(BaseError::Build {
        name: name.to_owned(),
        last,
    })
}
