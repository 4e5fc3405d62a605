//! Files for programs: JSON and CSV, `-` for standard output.

use serde::Serialize;
use std::fmt;
use std::io::{Read, Write};
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

/// Prints a text for people to standard output, with its colours and bold type where they are seen and wanted: on a
/// terminal, unless `NO_COLOR` or `CLICOLOR=0` is set, or wherever `CLICOLOR_FORCE` is. A reader that has gone away is
/// not an error: it has read what it wanted.
///
/// # Errors
/// [`FileError`].
pub fn print(text: &str) -> Result<(), FileError> {
    put(&mut anstream::stdout().lock(), text)
}

/// Writes a text as it is to a stream of the program's own.
fn put(out: &mut impl Write, text: &str) -> Result<(), FileError> {
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

/// Most bytes of a text that is read: more is no scene, table or run, but a device or a mistake.
const MOST_TEXT: u64 = 1 << 30;

/// The text of a file.
///
/// # Errors
/// [`FileError`] with the path; also where the text is longer than a gigabyte.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    read_at_most(path, MOST_TEXT).map_err(|source| FileError {
        path: path.into(),
        doing: "read",
        source,
    })
}

fn read_at_most(path: &Path, most: u64) -> std::io::Result<String> {
    let mut text = String::new();
    let file = std::fs::File::open(path)?;
    file.take(most + 1).read_to_string(&mut text)?;
    if text.len() as u64 > most {
        let message = format!("it has more than {most} bytes, which no text of this kind has");
        return Err(std::io::Error::new(
            std::io::ErrorKind::FileTooLarge,
            message,
        ));
    }
    Ok(text)
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
        return put(&mut std::io::stdout().lock(), text);
    }
    if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    std::fs::write(path, text).map_err(failed)
}

/// Writes a value as JSON; numbers that are not finite become null, as what is not there does. The rows say which it
/// is: a check by its `reached`, a row of a solver by its `error` or `failure`, the reason why it has no numbers,
/// without which null is what was not measured.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_without_end_is_refused() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
        let all = read_at_most(&path, MOST_TEXT).expect("readable");
        let length = all.len() as u64;
        assert_eq!(read_at_most(&path, length).expect("short enough"), all);
        let error = read_at_most(&path, length - 1).expect_err("too long");
        assert!(error.to_string().contains("more than"), "{error}");
    }
}
