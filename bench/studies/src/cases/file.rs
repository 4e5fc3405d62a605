//! The file of cases: lines of JSON, the first of which says what was asked. Finished cases are appended, each by one write.

use super::CasesError;
use super::value::Record;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use taut_ground::files::{self, FileError};

/// Beginning of every file.
const BEGINNING: &[u8] = br#"{"header":"#;

/// Identity of a study's cases.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the program, with its sources' and how it was built.
    pub version: String,
    /// The command with its options as they were given, without those that say where results go.
    pub command: Vec<String>,
    /// The files that it read, each with a sum of its content.
    pub inputs: Vec<String>,
}

impl Header {
    /// Refuses a file of another version, another command or other inputs than `other`, which is called `name`.
    ///
    /// # Errors
    /// [`CasesError::Differs`].
    pub fn check(&self, path: &Path, other: &Self, name: &str) -> Result<(), CasesError> {
        let command = |h: &Self| format!("taut {}", h.command.join(" "));
        let [own, others] = [self, other].map(|h| {
            [
                ("command", command(h)),
                ("version", h.version.clone()),
                ("content of what it reads", h.inputs.join(", ")),
            ]
        });
        for ((what, found), (_, wanted)) in own.into_iter().zip(others) {
            if found != wanted {
                return Err(CasesError::Differs {
                    path: path.to_owned(),
                    what,
                    found,
                    other: name.to_owned(),
                    wanted,
                });
            }
        }
        Ok(())
    }
}

/// Records of finished cases by name.
pub type Known = HashMap<String, Record>;

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Line {
    Header(Header),
    /// The machine that the cases from here on ran on.
    Machine(String),
    /// Name and record of a finished case.
    Case(String, Value),
}

impl Line {
    fn text(&self) -> io::Result<String> {
        Ok(serde_json::to_string(self)? + "\n")
    }
}

/// One or several files of cases as they were read.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    pub header: Header,
    /// The machines that the cases ran on.
    pub machines: Vec<String>,
    pub known: Known,
}

impl Written {
    /// Reads files of the same question as one.
    ///
    /// # Errors
    /// [`CasesError`]: files of different questions, none, or one without a header.
    pub fn read(paths: &[PathBuf]) -> Result<Self, CasesError> {
        let mut whole: Option<Self> = None;
        for path in paths {
            regular(path)?;
            let bytes = fs::read(path).map_err(|e| fault(path, "read", e))?;
            let next = Self::of(path, &bytes)?
                .0
                .ok_or_else(|| CasesError::NotCases(path.clone()))?;
            let Some(whole) = &mut whole else {
                whole = Some(next);
                continue;
            };
            next.header
                .check(path, &whole.header, &format!("`{}`", paths[0].display()))?;
            whole.known.extend(next.known);
            next.machines
                .into_iter()
                .for_each(|machine| whole.ran_on(machine));
        }
        whole.ok_or_else(|| CasesError::NotCases(PathBuf::new()))
    }

    /// Reads a file from its bytes: what it holds, if it has a whole line, and the length of its whole lines.
    pub(super) fn of(path: &Path, bytes: &[u8]) -> Result<(Option<Self>, usize), CasesError> {
        let beginning = bytes.len().min(BEGINNING.len());
        if bytes[..beginning] != BEGINNING[..beginning] {
            return Err(CasesError::NotCases(path.to_owned()));
        }
        let length = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
        if length < bytes.len() {
            files::note(format!(
                "the last line of `{}` is torn and left out",
                path.display()
            ));
        }
        let mut written: Option<Self> = None;
        for (k, line) in bytes[..length].split_inclusive(|b| *b == b'\n').enumerate() {
            match (serde_json::from_slice(line), &mut written) {
                (Ok(Line::Header(header)), None) => {
                    written = Some(Self {
                        header,
                        machines: Vec::new(),
                        known: Known::new(),
                    })
                }
                (Ok(Line::Machine(machine)), Some(written)) => written.ran_on(machine),
                (Ok(Line::Case(name, record)), Some(written)) => {
                    drop(written.known.insert(name, Record(record)))
                }
                _ => return Err(CasesError::Damaged(path.to_owned(), k + 1)),
            }
        }
        Ok((written, length))
    }

    fn ran_on(&mut self, machine: String) {
        if !self.machines.contains(&machine) {
            self.machines.push(machine);
        }
    }
}

fn fault(path: &Path, doing: &'static str, source: io::Error) -> CasesError {
    CasesError::File(FileError {
        path: path.to_owned(),
        doing,
        source,
    })
}

/// Refuses a path that is not a regular file: reading a pipe might never end.
fn regular(path: &Path) -> Result<(), CasesError> {
    match fs::metadata(path) {
        Ok(there) if !there.is_file() => Err(CasesError::NotCases(path.to_owned())),
        _ => Ok(()),
    }
}

/// A file of cases that is being written, locked on file systems that know locks.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    pub(super) file: File,
    /// True if the user asked for the file. Otherwise failing to write it is harmless.
    pub(super) is_asked_for: bool,
    /// Bytes to keep, and lines to write after them before the first case. Until then the file stays as it was: a study that
    /// refuses its options costs no cases.
    start: Option<(usize, String)>,
}

impl Journal {
    /// Opens a file, making its folder: with `resume` for what it holds, else anew. One that was asked for and holds cases is
    /// refused without `resume`. A file that nobody asked for (`is_asked_for` false) may fail later without ending the run.
    ///
    /// # Errors
    /// [`CasesError`].
    pub fn open(
        path: &Path,
        header: Header,
        machine: &str,
        resume: bool,
        is_asked_for: bool,
    ) -> Result<(Self, Written), CasesError> {
        let failed = |e| fault(path, "write", e);
        if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            files::make_folder(folder)?;
        }
        regular(path)?;
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(path).map_err(failed)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(CasesError::InUse(path.to_owned())),
            // File systems of clusters may know no locks.
            Err(TryLockError::Error(e)) if e.kind() != ErrorKind::Unsupported => {
                return Err(fault(path, "lock", e));
            }
            _ => {}
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let (there, length) = match Written::of(path, &bytes) {
            Err(CasesError::Damaged(..)) if !resume && !is_asked_for => (None, 0),
            other => other?,
        };
        let mut text = String::new();
        let (mut written, length) = match there {
            Some(there) if resume => {
                there.header.check(path, &header, "this run")?;
                (there, length)
            }
            Some(there) if is_asked_for && !there.known.is_empty() => {
                return Err(CasesError::Kept(path.to_owned()));
            }
            _ => {
                text = Line::Header(header.clone()).text().map_err(failed)?;
                (
                    Written {
                        header,
                        machines: Vec::new(),
                        known: Known::new(),
                    },
                    0,
                )
            }
        };
        if !written.machines.iter().any(|known| known == machine) {
            text += &Line::Machine(machine.to_owned()).text().map_err(failed)?;
            written.ran_on(machine.to_owned());
        }
        let journal = Self {
            path: path.to_owned(),
            file,
            is_asked_for,
            start: Some((length, text)),
        };
        Ok((journal, written))
    }

    /// Appends a line, after what the file is to start with.
    pub(super) fn write(&mut self, line: Option<&Line>) -> Result<(), CasesError> {
        self.try_write(line)
            .map_err(|e| fault(&self.path, "write", e))
    }

    fn try_write(&mut self, line: Option<&Line>) -> io::Result<()> {
        let mut text = String::new();
        if let Some((length, start)) = self.start.take() {
            self.file.set_len(length as u64)?;
            self.file.seek(SeekFrom::End(0))?;
            text = start;
        }
        text += &line.map_or(Ok(String::new()), Line::text)?;
        self.file.write_all(text.as_bytes())
    }
}
