//! Faults of one or several files of cases.

use super::Shard;
use super::journal::Key;
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
    /// A file that ends within its header.
    NoHeader(PathBuf),
    /// A file with something else than a case, from that byte on.
    Damaged(PathBuf, usize),
    /// A file that another run writes.
    InUse(PathBuf),
    /// A file of another version of the program, other options or other input files than another, or than this run.
    Differs {
        path: PathBuf,
        /// Name of the differing part.
        what: &'static str,
        found: String,
        /// Origin of the other: `this run` or a file.
        other: String,
        /// Content of the other.
        wanted: String,
    },
    /// Two files of the same shard.
    Twice(Shard, [PathBuf; 2]),
    /// A shard's file that holds cases, of a run that is not to resume it.
    Kept(PathBuf),
    /// Shards without a file.
    Absent {
        numbers: Vec<usize>,
        /// How many shards there are.
        of: usize,
        /// The command that runs the first of them.
        command: String,
    },
    /// A file whose run has not come to its end, and the command that resumes it.
    Unfinished(PathBuf, String),
    /// Files that do not hold as many cases as there are.
    Count {
        /// Cases in the files.
        found: usize,
        /// Cases of the study.
        wanted: usize,
    },
    /// A case that no file has.
    Missing(Key),
    /// A record of another case than that of its place.
    OtherCase(Key),
    /// A record that cannot be encoded or decoded.
    Record(Key, String),
}

impl CasesError {
    /// True for [`Elsewhere`](Self::Elsewhere).
    #[must_use]
    pub fn is_elsewhere(error: &ExperimentError) -> bool {
        matches!(error.downcast_ref(), Some(Self::Elsewhere))
    }
}

/// The first numbers of a list.
fn some(numbers: &[usize]) -> String {
    let first = numbers.iter().take(10).map(ToString::to_string);
    let mut text = first.collect::<Vec<_>>().join(", ");
    if numbers.len() > 10 {
        text.push_str(" …");
    }
    text
}

impl fmt::Display for CasesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Elsewhere => f.write_str("the other cases are those of other shards"),
            Self::File(e) => e.fmt(f),
            Self::NotCases(path) => write!(
                f,
                "`{}` is no file of cases, as a study writes them to target/taut/NAME.cases, or one of another format",
                path.display()
            ),
            Self::NoHeader(path) => write!(
                f,
                "`{}` ends within its header: run its study again",
                path.display()
            ),
            Self::Damaged(path, at) => write!(
                f,
                "`{}` is damaged at byte {at}: run its study again without `--resume`",
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
                "`{}` has another {what} than {other}: `{found}`, not `{wanted}`",
                path.display()
            ),
            Self::Twice(shard, [a, b]) => write!(
                f,
                "shard {shard} is there twice, in `{}` and in `{}`: give one of them",
                a.display(),
                b.display()
            ),
            Self::Kept(path) => write!(
                f,
                "`{}` holds cases of this shard: add `--resume` to go on with them, or delete it to run the shard anew",
                path.display()
            ),
            Self::Absent {
                numbers,
                of,
                command,
            } => write!(
                f,
                "shards are missing, of {of}: {}: name their files too, which `{command}` writes for the first",
                some(numbers)
            ),
            Self::Unfinished(path, command) => write!(
                f,
                "`{}` does not hold all its cases: finish it with `{command}`",
                path.display()
            ),
            Self::Count { found, wanted } => write!(
                f,
                "the files hold {found} cases, the study has {wanted}: run its shards again"
            ),
            Self::Missing(key) => write!(f, "{key} is in no file: run its shard again"),
            Self::OtherCase(key) => write!(
                f,
                "{key} is another one than it was: run the study again without `--resume`"
            ),
            Self::Record(key, reason) => write!(f, "{key} cannot be kept: {reason}"),
        }
    }
}

impl std::error::Error for CasesError {}

impl From<FileError> for CasesError {
    fn from(e: FileError) -> Self {
        Self::File(e)
    }
}
