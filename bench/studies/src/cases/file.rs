//! The file of cases: lines of JSON, the first of which says what was asked. Finished cases are appended, each by one write.

use super::value::Record;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use taut_measure::files::{self, FileError};

const BEGINNING: &[u8] = br#"{"header":"#;

/// Some editors put it before a text.
const BYTE_ORDER: &[u8] = b"\xef\xbb\xbf";

/// Identity of a study's cases, and the machine that runs them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the program, how it was built, and a sum of what it is.
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
        let both = [[self, other], [other, self]];
        let command = both.map(|[own, _]| format!("taut {}", own.command.join(" ")));
        let version = both.map(|[own, _]| own.version.clone());
        let inputs = both.map(|[own, other]| {
            let inputs = own.inputs.iter();
            let only: Vec<_> = inputs
                .filter(|i| !other.inputs.contains(i))
                .cloned()
                .collect();
            if only.is_empty() {
                "nothing".to_owned()
            } else {
                only.join(", ")
            }
        });
        let again = "or delete it and run its study again";
        for (what, [found, wanted], cure) in [
            ("command", command, "name another file,"),
            ("version", version, "keep to one build of the program,"),
            ("content of what it reads", inputs, "put that back,"),
        ] {
            if found != wanted {
                let path = path.display();
                return Err(format!(
                    "`{path}` has another {what} than {name}: `{found}`, not `{wanted}`: {cure} {again}"
                ));
            }
        }
        Ok(())
    }
}

/// Records by the names of their cases, each with the file that it is from.
pub type Known = HashMap<String, (Record, Arc<Path>)>;

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
    let (length, shown, from) = (length(path, bytes)?, path.display(), Arc::from(path));
    if length < bytes.len() {
        files::note(format!("the last line of `{shown}` is torn and left out"));
    }
    for (k, line) in bytes[..length].split_inclusive(|b| *b == b'\n').enumerate() {
        let line = line.strip_prefix(BYTE_ORDER).unwrap_or(line);
        match (serde_json::from_slice(line), &mut *whole) {
            (Ok(Line::Header(header)), whole) => {
                let whole = whole.get_or_insert_with(|| Written::new(header.clone()));
                header.check(path, &whole.header, name)?;
                whole.ran_on(&header.machine);
            }
            (Ok(Line::Case(name, record)), Some(whole)) => match whole.known.entry(name) {
                Entry::Vacant(place) => drop(place.insert((Record(record), Arc::clone(&from)))),
                Entry::Occupied(there) if there.get().0.0 != record => {
                    let (name, other) = (there.key(), there.get().1.display());
                    return Err(format!(
                        "`{other}` and `{shown}` hold different records of the case `{name}`: name one of them"
                    ));
                }
                Entry::Occupied(_) => {}
            },
            _ => return Err(damaged(path, &format!("line {}", k + 1))),
        }
    }
    Ok(length)
}

/// Refusal of a file of which something does not read.
pub(super) fn damaged(path: &Path, place: &str) -> String {
    let path = path.display();
    format!("`{path}` is damaged in {place}: delete it, and run its study again")
}

fn length(path: &Path, bytes: &[u8]) -> Result<usize, String> {
    let text = bytes.strip_prefix(BYTE_ORDER).unwrap_or(bytes);
    let beginning = text.len().min(BEGINNING.len());
    match text[..beginning] == BEGINNING[..beginning] {
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
    /// Bytes of whole lines. What follows them goes with the first line that is written: a study that refuses its options
    /// costs no cases.
    length: u64,
    /// Written before the first case.
    header: Option<Line>,
    /// Why nothing more is written.
    failure: Option<String>,
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
        let journal = Self {
            path: path.to_owned(),
            file,
            length: length as u64,
            header: is_new.then_some(Line::Header(header)),
            failure: None,
        };
        Ok((journal, written))
    }

    /// Appends a line, after what the file is to start with. One that fails is the last: nothing follows a part of a line.
    pub(super) fn write(&mut self, line: Option<&Line>) -> Result<(), String> {
        if self.failure.is_none()
            && let Err(e) = self.try_write(line)
        {
            // Where that fails as well the file ends in a torn line.
            let _ = self.file.set_len(self.length);
            self.failure = Some(fault(&self.path, "write", e));
        }
        self.failure.clone().map_or(Ok(()), Err)
    }

    fn try_write(&mut self, line: Option<&Line>) -> io::Result<()> {
        let mut text = String::new();
        for line in self.header.iter().chain(line) {
            text += &(serde_json::to_string(line)? + "\n");
        }
        self.file.set_len(self.length)?;
        self.file.seek(SeekFrom::End(0))?;
        self.file.write_all(text.as_bytes())?;
        self.length += text.len() as u64;
        self.header = None;
        Ok(())
    }
}
