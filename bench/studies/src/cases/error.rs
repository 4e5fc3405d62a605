//! Faults of one or several files of cases.

use std::fmt;
use std::path::PathBuf;
use taut_ground::files::FileError;
use taut_output::check::ExperimentError;

/// Why cases could not be kept, resumed or merged.
#[derive(Debug)]
pub enum CasesError {
    /// No fault: the study is not whole, for other shards have the rest of its cases.
    Elsewhere,
    /// A file that cannot be read or written.
    File(FileError),
    /// A file without cases, or in another format.
    NotCases(PathBuf),
    /// A file with something else than a case in that line, from 1.
    Damaged(PathBuf, usize),
    /// A file that another run writes.
    InUse(PathBuf),
    /// A file of another version of the program, other options or other input files than another, or than this run.
    Differs {
        path: String,
        /// Name of the differing part.
        what: &'static str,
        found: String,
        /// Origin of the other: `this run` or a file.
        other: String,
        /// Content of the other.
        wanted: String,
    },
    /// A file that holds cases, of a run that is not to resume it.
    Kept(PathBuf),
    /// Name of a case that no file has.
    Missing(String),
    /// Name of a case whose record cannot be written or read, and why.
    Record(String, String),
}

impl CasesError {
    /// True for [`Elsewhere`](Self::Elsewhere).
    #[must_use]
    pub fn is_elsewhere(error: &ExperimentError) -> bool {
        matches!(error.downcast_ref(), Some(Self::Elsewhere))
    }
}

impl fmt::Display for CasesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Elsewhere => f.write_str("the other cases are those of other shards"),
            Self::File(e) => e.fmt(f),
            Self::NotCases(path) => write!(
                f,
                "`{}` is no file of cases, as a study writes them to target/taut/NAME.cases, or one of an earlier version: name another, or delete it and run its study again",
                path.display()
            ),
            Self::Damaged(path, line) => write!(
                f,
                "`{}` is damaged in line {line}: delete it, and run its study again",
                path.display()
            ),
            Self::InUse(path) => write!(
                f,
                "`{}` is being written by another run: wait for its end, or give each a file of its own with `--cases`",
                path.display()
            ),
            Self::Differs {
                path,
                what,
                found,
                other,
                wanted,
            } => write!(
                f,
                "`{path}` has another {what} than {other}: `{found}`, not `{wanted}`"
            ),
            Self::Kept(path) => write!(
                f,
                "`{}` holds cases: add `--resume` to go on with them, or delete it to run them anew",
                path.display()
            ),
            Self::Missing(name) => write!(
                f,
                "the case `{name}` is in no file: name those of all shards, and finish the stopped ones with `--resume`"
            ),
            Self::Record(name, reason) => write!(
                f,
                "the record of the case `{name}` cannot be kept: {reason}"
            ),
        }
    }
}

impl std::error::Error for CasesError {}

impl From<FileError> for CasesError {
    fn from(e: FileError) -> Self {
        Self::File(e)
    }
}
