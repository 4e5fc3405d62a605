//! Faults of one or several files of cases.

use std::fmt;
use std::path::Path;
use taut_ground::files::FileError;
use taut_output::check::ExperimentError;

/// Why cases could not be kept, resumed or merged.
#[derive(Debug)]
pub enum CasesError {
    /// No fault: the study is not whole, for other shards have the rest of its cases.
    Elsewhere,
    /// A file that cannot be read or written.
    File(FileError),
    /// What is wrong with a file or a case, and what to do.
    Refused(String),
}

impl CasesError {
    /// True for [`Elsewhere`](Self::Elsewhere).
    pub fn is_elsewhere(error: &ExperimentError) -> bool {
        matches!(error.downcast_ref(), Some(Self::Elsewhere))
    }

    /// A file without cases, or in another format.
    pub fn not_cases(path: &Path) -> Self {
        Self::Refused(format!(
            "`{}` is no file of cases, as a study writes them to target/taut/NAME.cases, or one of an earlier version: name another, or delete it and run its study again",
            path.display()
        ))
    }
}

impl fmt::Display for CasesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Elsewhere => f.write_str("the other cases are those of other shards"),
            Self::File(e) => e.fmt(f),
            Self::Refused(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for CasesError {}

impl From<FileError> for CasesError {
    fn from(e: FileError) -> Self {
        Self::File(e)
    }
}
