//! The file of cases: a CBOR sequence (RFC 8742) of a header, the machine, an item for each finished case, and one that
//! says that all are there.
//!
//! Items are appended, each by one write; what a killed run leaves is a file whose last item may be torn, which a run that
//! resumes it cuts off. CBOR keeps numbers that are not finite, and all bits of the others. A record is encoded CBOR within
//! its item, with its checksum: items are read without knowing what the study keeps. The file begins with the tag of CBOR
//! (RFC 8949, 3.4.6). It is locked while it is written, on file systems that know locks.

use super::{CasesError, Shard};
use ciborium::{Value, de};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fmt;
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use taut_ground::files::{self, FileError};

/// First bytes of every file: the CBOR tag 55799.
const TAG: [u8; 3] = [0xd9, 0xd9, 0xf7];

/// Most bytes of a file that is read.
const MOST: u64 = 1 << 30;

/// Identity of a study's cases.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the program, with its sources' and how it was built.
    pub version: String,
    /// The command with its options as they were given, without those that say where results go.
    pub command: Vec<String>,
    /// The files that it read.
    pub inputs: Vec<Input>,
    /// The shard that it was.
    pub shard: Shard,
}

/// A file that a study reads.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// Where it is.
    pub path: PathBuf,
    /// CRC-32 of what it holds.
    pub checksum: u32,
}

impl Header {
    /// The command as a shell takes it, with its shard where it is one, and further words.
    pub(super) fn call(&self, more: &[&str]) -> String {
        let shard = match self.shard {
            Shard::WHOLE => None,
            shard => Some(format!("--shard {shard}")),
        };
        let quoted = |word: &str| {
            let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:+".contains(c);
            match word.chars().all(is_plain) {
                true => word.to_owned(),
                false => format!("'{}'", word.replace('\'', r"'\''")),
            }
        };
        let words = self.command.iter().map(|word| quoted(word));
        let more = more.iter().map(|word| quoted(word));
        let words = std::iter::once("taut".to_owned()).chain(words);
        words.chain(shard).chain(more).collect::<Vec<_>>().join(" ")
    }

    /// Refuses a file of another version, another command or other inputs than `other`, which is called `name`.
    ///
    /// # Errors
    /// [`CasesError::Differs`].
    pub fn check(&self, path: &Path, other: &Self, name: &str) -> Result<(), CasesError> {
        let same = |what, texts| same(path, name, what, texts);
        let input = |i: &Input| format!("{} {:08x}", i.path.display(), i.checksum);
        let inputs = |h: &Self| h.inputs.iter().map(input).collect::<Vec<_>>().join(", ");
        let both = [self, other];
        same(
            "command",
            both.map(|h| format!("taut {}", h.command.join(" "))),
        )?;
        same("version", both.map(|h| h.version.clone()))?;
        same("content of what it reads", both.map(inputs))?;
        same("number of shards", both.map(|h| h.shard.of.to_string()))
    }
}

/// Refuses what a file has otherwise than `name`.
fn same(
    path: &Path,
    name: &str,
    what: &'static str,
    [found, wanted]: [String; 2],
) -> Result<(), CasesError> {
    if found == wanted {
        return Ok(());
    }
    Err(CasesError::Differs {
        path: path.to_owned(),
        what,
        found,
        other: name.to_owned(),
        wanted,
    })
}

/// A case of a study: its stage, and its place there from 0.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Key(String, usize);

impl Key {
    pub(super) fn new(stage: &str, index: usize) -> Self {
        Self(stage.to_owned(), index)
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "case {} of the stage `{}`", self.1 + 1, self.0)
    }
}

/// A finished case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Item {
    key: Key,
    /// CRC-32 of the case's description.
    pub(super) label: u32,
    /// CRC-32 of the record.
    checksum: u32,
    /// Record as encoded CBOR.
    record: Value,
}

impl Item {
    pub(super) fn of(key: Key, label: u32, record: &impl Serialize) -> Result<Self, CasesError> {
        let mut bytes = Vec::new();
        match ciborium::into_writer(record, &mut bytes) {
            Ok(()) => Ok(Self {
                key,
                label,
                checksum: crc32fast::hash(&bytes),
                record: Value::Bytes(bytes),
            }),
            Err(e) => Err(CasesError::Record(key, e.to_string())),
        }
    }

    fn bytes(&self) -> &[u8] {
        self.record.as_bytes().map_or(&[], Vec::as_slice)
    }

    pub(super) fn decoded<T: DeserializeOwned>(&self) -> Result<T, CasesError> {
        let decoded = ciborium::from_reader(self.bytes());
        decoded.map_err(|e| CasesError::Record(self.key.clone(), e.to_string()))
    }
}

/// The cases that are known.
pub type Known = HashMap<Key, Item>;

/// Entry after the header.
#[derive(Serialize, Deserialize)]
enum Entry<I> {
    /// The machine that the cases from here on ran on.
    Machine(String),
    /// A finished case.
    Case(I),
    /// All cases of the shard are there; how many those of all shards are.
    End(usize),
}

/// A file of cases as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    pub path: PathBuf,
    pub header: Header,
    /// The machines that they ran on.
    pub machines: Vec<String>,
    /// Its cases.
    pub known: Known,
    /// How many cases of all shards there are, where its run came to its end.
    pub(super) all: Option<usize>,
    /// Its bytes without a torn item at its end.
    length: usize,
}

/// The next item of a sequence; none where it is torn.
fn next<T: DeserializeOwned>(rest: &mut &[u8]) -> Result<Option<T>, ()> {
    match ciborium::from_reader(&mut *rest) {
        Ok(item) => Ok(Some(item)),
        Err(de::Error::Io(e)) if e.kind() == ErrorKind::UnexpectedEof => Ok(None),
        Err(_) => Err(()),
    }
}

impl Written {
    /// Reads a file that no run writes.
    ///
    /// # Errors
    /// [`CasesError`].
    pub fn read(path: &Path) -> Result<Self, CasesError> {
        let failed = |source| CasesError::File(error(path, "read", source));
        regular(path)?;
        let file = File::open(path).map_err(failed)?;
        lock(path, file.try_lock_shared())?;
        Self::of(path, &content(&file).map_err(failed)?)
    }

    fn empty(path: &Path, header: Header) -> Self {
        Self {
            path: path.to_owned(),
            header,
            machines: Vec::new(),
            known: Known::new(),
            all: None,
            length: 0,
        }
    }

    /// Reads a whole file from its bytes.
    ///
    /// # Errors
    /// [`CasesError`].
    pub fn of(path: &Path, bytes: &[u8]) -> Result<Self, CasesError> {
        let is_tagged = bytes.starts_with(&TAG) || TAG.starts_with(bytes);
        if !is_tagged {
            return Err(CasesError::NotCases(path.to_owned()));
        }
        let mut rest = bytes.get(TAG.len()..).unwrap_or_default();
        let header = next(&mut rest).map_err(|()| CasesError::NotCases(path.to_owned()))?;
        let header: Header = header.ok_or_else(|| CasesError::NoHeader(path.to_owned()))?;
        if !header.shard.is_one() {
            return Err(CasesError::NotCases(path.to_owned()));
        }
        let mut written = Self::empty(path, header);
        loop {
            written.length = bytes.len() - rest.len();
            let damaged = || CasesError::Damaged(path.to_owned(), written.length);
            let entry = next::<Entry<Item>>(&mut rest).map_err(|()| damaged())?;
            match entry {
                None => return Ok(written),
                Some(_) if written.all.is_some() => return Err(damaged()),
                Some(Entry::End(all)) => written.all = Some(all),
                Some(Entry::Machine(machine)) => written.machines.push(machine),
                Some(Entry::Case(item)) => {
                    let is_whole = crc32fast::hash(item.bytes()) == item.checksum;
                    let other = written.known.insert(item.key.clone(), item);
                    if !is_whole || other.is_some() {
                        return Err(damaged());
                    }
                }
            }
        }
    }
}

fn error(path: &Path, doing: &'static str, source: io::Error) -> FileError {
    FileError {
        path: path.to_owned(),
        doing,
        source,
    }
}

/// Refuses a path that is not a regular file: reading a pipe might never end.
fn regular(path: &Path) -> Result<(), CasesError> {
    match fs::metadata(path) {
        Ok(there) if !there.is_file() => Err(CasesError::NotCases(path.to_owned())),
        _ => Ok(()),
    }
}

/// Content of a file up to [`MOST`] bytes.
fn content(file: &File) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    Read::take(file, MOST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST {
        let message = format!("it has more than {MOST} bytes");
        return Err(io::Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// Maps the outcome of taking a lock to an error.
fn lock(path: &Path, locked: Result<(), TryLockError>) -> Result<(), CasesError> {
    match locked {
        Err(TryLockError::WouldBlock) => Err(CasesError::InUse(path.to_owned())),
        // File systems of clusters may know no locks.
        Err(TryLockError::Error(e)) if e.kind() != ErrorKind::Unsupported => {
            Err(error(path, "lock", e).into())
        }
        _ => Ok(()),
    }
}

/// A file of cases that is being written.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    is_asked_for: bool,
    is_complete: bool,
    /// Bytes to keep, and bytes to write after them before the first case. Until then the file
    /// stays as it was: a study that refuses its options costs no cases.
    start: Option<(usize, Vec<u8>)>,
}

impl Journal {
    /// Opens a file, making its folder: with `resume` for what it holds, else anew. One of a shard that holds cases is refused
    /// without `resume`. A file that nobody asked for (`is_asked_for` false) may fail later without ending the run.
    ///
    /// # Errors
    /// [`CasesError`].
    pub fn open(
        path: &Path,
        header: Header,
        machine: String,
        resume: bool,
        is_asked_for: bool,
    ) -> Result<(Self, Written), CasesError> {
        let failed = |source| CasesError::File(error(path, "write", source));
        if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            files::make_folder(folder)?;
        }
        regular(path)?;
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        let file = options.open(path).map_err(failed)?;
        lock(path, file.try_lock())?;
        let mut written = match Written::of(path, &content(&file).map_err(failed)?) {
            // A file that does not hold cases is never overwritten.
            Err(e @ CasesError::NotCases(_)) => return Err(e),
            Ok(written) if resume => {
                written.header.check(path, &header, "this run")?;
                let shards = [&written.header, &header].map(|h| h.shard.to_string());
                same(path, "this run", "shard", shards)?;
                written
            }
            // A whole run is made anew every day; a shard is one of hours, queued by a script.
            Ok(written) if header.shard != Shard::WHOLE && !written.known.is_empty() => {
                return Err(CasesError::Kept(path.to_owned()));
            }
            // A run killed before its first case left nothing to resume.
            Err(e) if resume && !matches!(e, CasesError::NoHeader(_)) => return Err(e),
            _ => Written::empty(path, header),
        };
        let is_complete = written.all.is_some();
        let mut bytes = Vec::new();
        if written.length == 0 {
            bytes.extend(TAG);
            encode(&written.header, &mut bytes).map_err(failed)?;
        }
        if !is_complete && written.machines.last() != Some(&machine) {
            let entry = Entry::<&Item>::Machine(machine.clone());
            encode(&entry, &mut bytes).map_err(failed)?;
            written.machines.push(machine);
        }
        let journal = Self {
            path: path.to_owned(),
            file,
            is_asked_for,
            is_complete,
            start: Some((written.length, bytes)),
        };
        Ok((journal, written))
    }

    /// True if the user asked for the file. Otherwise failing to write it is harmless.
    pub(super) fn is_asked_for(&self) -> bool {
        self.is_asked_for
    }

    pub(super) fn append(&mut self, item: &Item) -> Result<(), CasesError> {
        self.write(&Entry::Case(item))
    }

    /// Appends that all cases are there; `all` of all shards.
    pub(super) fn finish(&mut self, all: usize) -> Result<(), CasesError> {
        if std::mem::replace(&mut self.is_complete, true) {
            return Ok(());
        }
        self.write(&Entry::<&Item>::End(all))
    }

    fn write(&mut self, entry: &Entry<&Item>) -> Result<(), CasesError> {
        let written = self.try_write(entry);
        Ok(written.map_err(|source| error(&self.path, "write", source))?)
    }

    fn try_write(&mut self, entry: &Entry<&Item>) -> io::Result<()> {
        let mut bytes = Vec::new();
        if let Some((length, start)) = self.start.take() {
            self.file.set_len(length as u64)?;
            self.file.seek(SeekFrom::End(0))?;
            bytes = start;
        }
        encode(entry, &mut bytes)?;
        self.file.write_all(&bytes)
    }
}

fn encode(value: &impl Serialize, bytes: &mut Vec<u8>) -> io::Result<()> {
    ciborium::into_writer(value, bytes).map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::super::Cases;
    use super::*;

    /// A study does not end for a file that nobody asked for, and ends for one that somebody did.
    #[test]
    fn a_file_that_fails_ends_the_run_where_it_was_asked_for() {
        for (is_asked_for, name) in [(true, "asked"), (false, "unasked")] {
            let folder = std::env::temp_dir().join(format!("taut-{name}-{}", std::process::id()));
            let path = folder.join("a.cases");
            let header = Header {
                version: String::new(),
                command: Vec::new(),
                inputs: Vec::new(),
                shard: Shard::WHOLE,
            };
            let opened = Journal::open(&path, header, String::new(), false, is_asked_for);
            let (mut journal, _) = opened.expect("opened");
            // One that cannot be written.
            journal.file = File::open(&path).expect("there");
            let cases = Cases::new(Shard::WHOLE, Known::new(), Some(journal));
            let run = |k: &usize| Ok::<_, CasesError>(*k);
            let records = cases.in_turn("numbers", &[7, 8], |_| 1.0, run);
            assert_eq!(records.is_err(), is_asked_for);
            if let Ok(records) = records {
                assert_eq!(records.all().expect("all"), [7, 8]);
                cases.finish().expect("nothing to close");
            }
            fs::remove_dir_all(&folder).expect("removed");
        }
    }
}
