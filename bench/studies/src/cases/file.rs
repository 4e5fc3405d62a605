//! The file of cases: lines of JSON, the first of which says what was asked. Finished cases are appended, each by one write.

use super::value::Record;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use taut_measure::files::{self, FileError};

const BEGINNING: &[u8] = br#"{"header":"#;

/// Identity of a study's cases, and the machine that runs them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the program, with its sources' and how it was built.
    pub version: String,
    /// The command with its options as they were given, without those that say where results go.
    pub command: Vec<String>,
    /// The files that it read, each with a sum of its content.
    pub inputs: Vec<String>,
    /// No part of the identity.
    pub machine: String,
}

impl Header {
    /// Refuses a file of another version, another command or other inputs than `other`, which is called `name`.
    pub fn check(&self, path: &Path, other: &Self, name: &str) -> Result<(), String> {
        let command = |h: &Self| format!("taut {}", h.command.join(" "));
        let inputs = |h: &Self| h.inputs.join(", ");
        let version = |h: &Self| h.version.clone();
        for (what, [found, wanted]) in [
            ("command", [self, other].map(command)),
            ("version", [self, other].map(version)),
            ("content of what it reads", [self, other].map(inputs)),
        ] {
            if found != wanted {
                let path = path.display();
                return Err(format!(
                    "`{path}` has another {what} than {name}: `{found}`, not `{wanted}`"
                ));
            }
        }
        Ok(())
    }
}

pub type Known = HashMap<String, Record>;

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Line {
    /// The cases from here on are those of this question and ran on this machine.
    Header(Header),
    /// Name and record of a finished case.
    Case(String, Value),
}

/// One or several files of cases as they were read.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    pub header: Header,
    pub machines: Vec<String>,
    pub known: Known,
}

impl Written {
    fn new(header: Header) -> Self {
        Self {
            header,
            machines: Vec::new(),
            known: Known::new(),
        }
    }

    /// Reads files of the same question as one.
    pub fn read(paths: &[PathBuf]) -> Result<Self, String> {
        let mut whole = None;
        for path in paths {
            regular(path)?;
            let bytes = fs::read(path).map_err(|e| fault(path, "read", e))?;
            let first = format!("`{}`", paths[0].display());
            add(&mut whole, path, &bytes, &first)?;
        }
        whole.ok_or_else(|| "no file of cases is named".to_owned())
    }

    fn ran_on(&mut self, machine: &str) {
        if !self.machines.iter().any(|known| known == machine) {
            self.machines.push(machine.to_owned());
        }
    }
}

/// Adds what a file holds to those before, the first of which is called `name`: length of its whole lines.
fn add(
    whole: &mut Option<Written>,
    path: &Path,
    bytes: &[u8],
    name: &str,
) -> Result<usize, String> {
    let (length, shown) = (length(path, bytes)?, path.display());
    if length < bytes.len() {
        files::note(format!("the last line of `{shown}` is torn and left out"));
    }
    for (k, line) in bytes[..length].split_inclusive(|b| *b == b'\n').enumerate() {
        match (serde_json::from_slice(line), &mut *whole) {
            (Ok(Line::Header(header)), whole) => {
                let whole = whole.get_or_insert_with(|| Written::new(header.clone()));
                header.check(path, &whole.header, name)?;
                whole.ran_on(&header.machine);
            }
            (Ok(Line::Case(name, record)), Some(whole)) => {
                drop(whole.known.insert(name, Record(record)))
            }
            _ => {
                return Err(format!(
                    "`{shown}` is damaged in line {}: delete it, and run its study again",
                    k + 1
                ));
            }
        }
    }
    Ok(length)
}

fn length(path: &Path, bytes: &[u8]) -> Result<usize, String> {
    let beginning = bytes.len().min(BEGINNING.len());
    match bytes[..beginning] == BEGINNING[..beginning] {
        true => Ok(bytes.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1)),
        false => Err(not_cases(path)),
    }
}

/// Refusal of a file without cases, or in another format.
pub fn not_cases(path: &Path) -> String {
    format!(
        "`{}` is no file of cases, as a study writes them to target/taut/NAME.cases, or one of an earlier version: name another, or delete it and run its study again",
        path.display()
    )
}

fn fault(path: &Path, doing: &'static str, source: io::Error) -> String {
    FileError::at(path, doing)(source).to_string()
}

/// Refuses a path that is not a regular file: reading a pipe might never end.
fn regular(path: &Path) -> Result<(), String> {
    match fs::metadata(path) {
        Ok(there) if !there.is_file() => Err(not_cases(path)),
        _ => Ok(()),
    }
}

/// A file of cases that is being written, locked on file systems that know locks.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    pub(super) file: File,
    /// Bytes to keep, and a line to write after them before the first case. Until then the file stays as it was: a study that
    /// refuses its options costs no cases.
    start: Option<(usize, Option<Line>)>,
}

impl Journal {
    /// Opens a file, making its folder: with `resume` for what it holds, else anew. One that was asked for and holds cases is
    /// refused without `resume`.
    pub fn open(
        path: &Path,
        header: Header,
        resume: bool,
        is_asked_for: bool,
    ) -> Result<(Self, Written), String> {
        let failed = |e| fault(path, "write", e);
        if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            files::make_folder(folder).map_err(|e| e.to_string())?;
        }
        regular(path)?;
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(path).map_err(failed)?;
        let shown = path.display();
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                return Err(format!(
                    "`{shown}` is being written by another run: wait for its end, or give each a file of its own with `--cases`"
                ));
            }
            // File systems of clusters may know no locks.
            Err(TryLockError::Error(e)) if e.kind() != ErrorKind::Unsupported => {
                return Err(fault(path, "lock", e));
            }
            _ => {}
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let mut written = Some(Written::new(header.clone()));
        let length = match length(path, &bytes)? {
            _ if resume => add(&mut written, path, &bytes, "this run")?,
            1.. if is_asked_for => {
                return Err(format!(
                    "`{shown}` holds cases: add `--resume` to go on with them, or delete it to run them anew"
                ));
            }
            _ => 0,
        };
        let mut written = written.unwrap_or_else(|| Written::new(header.clone()));
        let is_new = length == 0 || !written.machines.contains(&header.machine);
        written.ran_on(&header.machine);
        let start = Some((length, is_new.then_some(Line::Header(header))));
        let path = path.to_owned();
        Ok((Self { path, file, start }, written))
    }

    /// Appends a line, after what the file is to start with.
    pub(super) fn write(&mut self, line: Option<&Line>) -> Result<(), String> {
        self.try_write(line)
            .map_err(|e| fault(&self.path, "write", e))
    }

    fn try_write(&mut self, line: Option<&Line>) -> io::Result<()> {
        let start = self.start.take();
        if let Some((length, _)) = start {
            self.file.set_len(length as u64)?;
            self.file.seek(SeekFrom::End(0))?;
        }
        let mut text = String::new();
        for line in start.iter().flat_map(|(_, line)| line).chain(line) {
            text += &(serde_json::to_string(line)? + "\n");
        }
        self.file.write_all(text.as_bytes())
    }
}
