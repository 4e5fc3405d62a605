//! Files for programs: JSON and CSV, `-` for standard output.

use serde::Serialize;
use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A file that could not be written or read.
#[derive(Debug)]
pub struct FileError {
    /// The file.
    pub path: PathBuf,
    /// What was being done.
    pub doing: &'static str,
    /// Why it failed.
    pub source: std::io::Error,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "cannot {} `{}`: {}",
            self.doing,
            self.path.display(),
            self.source
        )
    }
}

impl std::error::Error for FileError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.source)
    }
}

/// Prints to standard output. A reader that has gone away is not an error: it has read what it wanted.
///
/// # Errors
/// [`FileError`].
pub fn print(text: &str) -> Result<(), FileError> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(FileError {
            path: "-".into(),
            doing: "write",
            source: e,
        }),
        _ => Ok(()),
    }
}

/// Makes a folder, with those above it.
///
/// # Errors
/// [`FileError`].
pub fn make_folder(path: &Path) -> Result<(), FileError> {
    std::fs::create_dir_all(path).map_err(|source| FileError {
        path: path.to_owned(),
        doing: "write",
        source,
    })
}

/// The text of a file.
///
/// # Errors
/// [`FileError`] with the path.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    std::fs::read_to_string(path).map_err(|source| FileError {
        path: path.into(),
        doing: "read",
        source,
    })
}

/// Writes text to `path`, making its folder, or to standard output for `-`.
///
/// # Errors
/// [`FileError`].
pub fn write_text(path: &Path, text: &str) -> Result<(), FileError> {
    let failed = |source| FileError {
        path: path.to_owned(),
        doing: "write",
        source,
    };
    if path == Path::new("-") {
        return print(text);
    }
    if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    std::fs::write(path, text).map_err(failed)
}

/// Writes a value as JSON; numbers that are not finite become null.
///
/// # Errors
/// [`FileError`].
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), FileError> {
    let failed = |e: serde_json::Error| FileError {
        path: path.to_owned(),
        doing: "write",
        source: e.into(),
    };
    let text = serde_json::to_string_pretty(value).map_err(failed)?;
    write_text(path, &(text + "\n"))
}
